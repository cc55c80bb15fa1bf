#include "offline/io/vtu_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/file_number.hpp"
#include "offline/io/vtk_mesh.hpp"
#include "offline/io/vtu_array.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// All compressed arrays of a file together grow to at most so many times its size. Meshes with sets, whose
// zeros compress best, stay below 20.
constexpr std::size_t kMaxGrowth = 100;
// An element or an attribute of XML takes up to 72 bytes in memory. A grid of one piece has a few hundred.
constexpr std::ptrdiff_t kMaxXmlItems = 100'000;

class VtuReader {
 public:
  explicit VtuReader(FileCursor& cursor)
      : cursor_(cursor), mesh_(cursor), growth_left_(kMaxGrowth * cursor.num_left()) {}

  MeshData read() {
    parse();
    const pugi::xml_node root = document_.child("VTKFile");
    if (!root) cursor_.fail_at(1, "is no VTU file, which has an element VTKFile; check its ending");
    read_coding(root);
    const pugi::xml_node grid = root.child("UnstructuredGrid");
    if (!grid) cursor_.fail_at(line_of(root), "has no element UnstructuredGrid; export an unstructured grid");
    for (const pugi::xml_node piece : grid.children("Piece")) read_piece(piece);
    return mesh_.finish(line_of(grid));
  }

 private:
  // Appended data are no XML: the document ends before them.
  void parse() {
    text_ = cursor_.next_bytes(cursor_.num_left(), "the file");
    constexpr std::string_view kAppended = "<AppendedData";
    const std::size_t begin = text_.find(kAppended);
    if (begin == std::string_view::npos) {
      xml_ = text_;
    } else {
      const std::size_t end = std::min(text_.find('>', begin), text_.size());
      xml_ = text_.substr(0, std::min(end + 1, text_.size()));
      xml_ += "</AppendedData></VTKFile>";
      const std::size_t mark = std::min(text_.find('_', end), text_.size());
      appended_ = text_.substr(std::min(mark + 1, text_.size()));
    }
    if (std::ranges::count(xml_, '<') + std::ranges::count(xml_, '=') > kMaxXmlItems)
      cursor_.fail_at(1, "has more XML elements than a mesh needs; export the file again");
    const pugi::xml_parse_result outcome =
        document_.load_buffer_inplace(xml_.data(), xml_.size(), pugi::parse_escapes, pugi::encoding_utf8);
    if (!outcome)
      cursor_.fail_at(line_at(outcome.offset), std::string("is no complete XML (") + outcome.description() +
                                                   "); copy or export it again");
  }

  void read_coding(const pugi::xml_node& root) {
    const auto fail = [&](const std::string& message) { cursor_.fail_at(line_of(root), message); };
    const std::string_view type = root.attribute("type").value();
    if (type != "UnstructuredGrid")
      fail("data of type '" + printable(type) + "' are no unstructured grid; export an unstructured grid");
    const std::string_view order = root.attribute("byte_order").as_string("LittleEndian");
    if (order != "LittleEndian" && order != "BigEndian")
      fail("byte_order '" + printable(order) + "' is not known; write LittleEndian");
    if (order == "BigEndian") coding_.numbers = NumberCoding::big_endian;
    const std::string_view header = root.attribute("header_type").as_string("UInt32");
    if (header != "UInt32" && header != "UInt64")
      fail("header_type '" + printable(header) + "' is not known; write UInt64");
    coding_.header_bytes = header == "UInt64" ? 8 : 4;
    const std::string_view compressor = root.attribute("compressor").value();
    coding_.is_compressed = !compressor.empty();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail("arrays are compressed by " + printable(compressor) +
           ", which is not supported; export the file with zlib or without compression");
    appended_is_base64_ =
        std::string_view(root.child("AppendedData").attribute("encoding").value()) == "base64";
  }

  void read_piece(const pugi::xml_node& piece) {
    mesh_.begin_piece();
    const int line = line_of(piece);
    const std::size_t num_points = count_of(piece, "NumberOfPoints");
    const std::size_t num_cells = count_of(piece, "NumberOfCells");
    const pugi::xml_node points = piece.child("Points").child("DataArray");
    if (num_points > 0) read_points(points, num_points);
    VtkCells cells;
    if (num_cells > 0) {
      const pugi::xml_node arrays = piece.child("Cells");
      cells.types = indices(named(arrays, "types"), "types", num_cells);
      cells.ends = indices(named(arrays, "offsets"), "offsets", num_cells);
      if (cells.ends[0] < 0 || !std::ranges::is_sorted(cells.ends))
        cursor_.fail_at(line_of(named(arrays, "offsets")),
                        "the offsets do not ascend; export the file again");
      const auto num_nodes = static_cast<std::size_t>(cells.ends.back());
      cells.nodes = indices(named(arrays, "connectivity"), "connectivity", num_nodes);
    }
    mesh_.add_cells(cells, line);
    for (const pugi::xml_node array : piece.child("PointData").children("DataArray")) {
      if (std::optional<MeshArray> read = read_array(array, num_points))
        mesh_.add_point_array(*std::move(read), line_of(array));
    }
    for (const pugi::xml_node array : piece.child("CellData").children("DataArray")) {
      if (const std::optional<MeshArray> read = read_array(array, num_cells))
        mesh_.add_cell_array(*read, line_of(array));
    }
  }

  void read_points(const pugi::xml_node& array, std::size_t count) {
    const std::string name = "Points";
    check_components(array, name, 3);
    const NumberType type = type_of(array, name);
    FileCursor values = values_of(array, name, 3 * count * num_bytes(type));
    mesh_.add_points(values, count, type, coding_of(array), line_of(array));
    check_end(values, name);
  }

  // Returns nothing for an array of strings or bits.
  std::optional<MeshArray> read_array(const pugi::xml_node& array, std::size_t size) {
    if (!number_type(array.attribute("type").value())) return std::nullopt;
    const int components = array.attribute("NumberOfComponents").as_int(1);
    if (components < 1 || components > kMaxComponents)
      cursor_.fail_at(line_of(array), "NumberOfComponents is out of range; export the file again");
    MeshArray read = {array.attribute("Name").value(), components, {}};
    const NumberType type = type_of(array, read.name);
    const std::size_t count = size * static_cast<std::size_t>(components);
    FileCursor values = values_of(array, read.name, count * num_bytes(type));
    read.values = next_numbers(values, count, type, coding_of(array), read.name.c_str());
    check_end(values, read.name);
    return read;
  }

  static pugi::xml_node named(const pugi::xml_node& arrays, const char* name) {
    return arrays.find_child_by_attribute("DataArray", "Name", name);
  }

  void check_components(const pugi::xml_node& array, const std::string& name, int components) const {
    if (array.attribute("NumberOfComponents").as_int(components) != components)
      cursor_.fail_at(line_of(array), fmt::format("array '{}' has not {} components; export the file again",
                                                  printable(name), components));
  }

  std::vector<int> indices(const pugi::xml_node& array, const std::string& name, std::size_t count) {
    const NumberType type = type_of(array, name);
    FileCursor values = values_of(array, name, count * num_bytes(type));
    std::vector<int> read = next_indices(values, count, type, coding_of(array), name.c_str());
    check_end(values, name);
    return read;
  }

  NumberType type_of(const pugi::xml_node& array, const std::string& name) const {
    if (!array) cursor_.fail_at(0, "has no array '" + printable(name) + "'; export the file again");
    const std::string_view type = array.attribute("type").value();
    const std::optional<NumberType> known = number_type(type);
    if (!known)
      cursor_.fail_at(line_of(array), "array '" + printable(name) + "' has the unknown type '" +
                                          printable(type) + "'; export the file again");
    return *known;
  }

  NumberCoding coding_of(const pugi::xml_node& array) const {
    return std::string_view(array.attribute("format").as_string("ascii")) == "ascii" ? NumberCoding::text
                                                                                     : coding_.numbers;
  }

  // Returns the text or the decoded bytes of an array.
  FileCursor values_of(const pugi::xml_node& array, const std::string& name, std::size_t size) {
    const int line = line_of(array);
    const std::string_view format = array.attribute("format").as_string("ascii");
    const VtuArrayPlace place = {cursor_, line, name};
    if (format == "ascii") return {cursor_.file(), line, array.child_value()};
    if (format == "binary")
      return {cursor_.file(), line,
              decode_vtu_array(array.child_value(), true, coding_, size, growth_left_, place)};
    if (format != "appended")
      place.fail("has the unknown format '" + printable(format) + "'; export the file again");
    const unsigned long long offset =
        array.attribute("offset").as_ullong(std::numeric_limits<unsigned long long>::max());
    if (size > 0 && offset >= appended_.size())
      place.fail("begins behind the end of the file; copy or export the file again");
    const std::string_view stored = size > 0 ? appended_.substr(offset) : std::string_view();
    return {cursor_.file(), line,
            decode_vtu_array(stored, appended_is_base64_, coding_, size, growth_left_, place)};
  }

  static void check_end(FileCursor& values, const std::string& name) {
    if (values.skip_blanks())
      values.fail("array '" + printable(name) + "' has more values than the mesh; export the file again");
  }

  std::size_t count_of(const pugi::xml_node& piece, const char* name) const {
    const std::string_view text = trimmed(piece.attribute(name).value());
    const std::optional<int> count = parse_integer(text);
    if (!count || *count < 0)
      cursor_.fail_at(
          line_of(piece),
          fmt::format("{} is '{}', where a count should be; export the file again", name, printable(text)));
    return static_cast<std::size_t>(*count);
  }

  int line_of(const pugi::xml_node& node) const { return line_at(node.offset_debug()); }

  int line_at(std::ptrdiff_t offset) const {
    if (offset < 0) return 0;
    const std::string_view before = text_.substr(0, static_cast<std::size_t>(offset));
    return 1 + static_cast<int>(std::ranges::count(before, '\n'));
  }

  FileCursor& cursor_;
  VtkMesh mesh_;
  std::size_t growth_left_;
  std::string_view text_, appended_;
  bool appended_is_base64_ = false;
  std::string xml_;  // the document points into it
  pugi::xml_document document_;
  VtuCoding coding_;
};

}  // namespace

MeshData read_vtu(FileCursor& cursor) {
  return VtuReader(cursor).read();
}

MeshData read_vtu(const std::filesystem::path& file) {
  FileCursor cursor(file);
  return read_vtu(cursor);
}

}  // namespace palpate
