// VTK's XML files of unstructured grids (.vtu).
//
//   <VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
//     ... <DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="appended" .../>
//     ... <AppendedData encoding="raw">
//      _[bytes: uint64][values][bytes: uint64][values] ...      offsets count from behind the underscore
//
// Source: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html. The reader knows arrays as
// text, base64 and appended, in each byte order, with zlib or without.
// Written are raw appended arrays, which keep every bit, or text. Sets become arrays (set_arrays.hpp). Values
// that are not finite are kept, so that a failed state can be viewed.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/file_number.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/vtk_mesh.hpp"
#include "offline/io/vtu_array.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// All compressed arrays of a file together grow to at most so many times its size. Meshes with sets, whose
// zeros compress best, stay below 20.
constexpr std::size_t kMaxGrowth = 100;
// Arrays without compression have their bytes in the file. Several may name one offset.
constexpr std::size_t kMaxRawGrowth = 2;
// An element or an attribute of XML takes up to 72 bytes in memory. A grid of one piece has a few hundred.
constexpr std::ptrdiff_t kMaxXmlItems = 100'000;

class VtuReader {
 public:
  explicit VtuReader(FileCursor& cursor) : cursor_(cursor) {}

  MeshData read() {
    parse();
    const pugi::xml_node root = document_.child("VTKFile");
    if (!root) cursor_.fail_at(1, "is no VTU file, which has an element VTKFile; check its ending");
    read_coding(root);
    const pugi::xml_node grid = root.child("UnstructuredGrid");
    if (!grid) cursor_.fail_at(line_of(root), "has no element UnstructuredGrid; export an unstructured grid");
    read_pieces(grid, Pass::check);
    return read_pieces(grid, Pass::build);
  }

 private:
  // Appended data are no XML: the document ends before them.
  void parse() {
    file_ = cursor_.take_bytes();
    growth_ = file_.size();
    constexpr std::string_view kAppended = "<AppendedData";
    if (const std::size_t begin = file_.find(kAppended); begin != std::string::npos) {
      const std::size_t end = std::min(file_.find('>', begin), file_.size() - 1);
      xml_ = file_.substr(0, end + 1) + "</AppendedData></VTKFile>";
      const std::size_t mark = std::min(file_.find('_', end), file_.size() - 1);
      appended_ = std::string_view(file_).substr(mark + 1);
    } else {
      xml_ = std::move(file_);
    }
    note_lines();
    // The parser changes the text, so that it takes no memory for another.
    const pugi::xml_parse_result outcome =
        document_.load_buffer_inplace(xml_.data(), xml_.size(), pugi::parse_escapes, pugi::encoding_utf8);
    if (!outcome)
      cursor_.fail_at(line_at(outcome.offset), std::string("is no complete XML (") + outcome.description() +
                                                   "); copy or export it again");
  }

  void note_lines() {
    int line = 1;
    std::ptrdiff_t num_items = 0;
    for (std::size_t i = 0; i < xml_.size(); ++i) {
      if (xml_[i] == '\n') ++line;
      if (xml_[i] == '<' || xml_[i] == '=') ++num_items;
      if (xml_[i] == '<' && num_items <= kMaxXmlItems) tags_.emplace_back(i, line);
    }
    if (num_items > kMaxXmlItems)
      cursor_.fail_at(1, "has more XML elements than a mesh needs; export the file again");
  }

  // The line of the tag before a place.
  int line_at(std::ptrdiff_t offset) const {
    auto tag = std::ranges::upper_bound(tags_, offset, {}, &std::pair<std::ptrdiff_t, int>::first);
    return tag == tags_.begin() ? 1 : std::prev(tag)->second;
  }

  int line_of(const pugi::xml_node& node) const { return line_at(node.offset_debug()); }

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
    growth_ *= coding_.is_compressed ? kMaxGrowth : kMaxRawGrowth;
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail("arrays are compressed by " + printable(compressor) +
           ", which is not supported; export the file with zlib or without compression");
    appended_is_base64_ =
        std::string_view(root.child("AppendedData").attribute("encoding").value()) == "base64";
  }

  MeshData read_pieces(const pugi::xml_node& grid, Pass pass) {
    VtkMesh mesh(pass, cursor_);
    growth_left_ = growth_;
    for (const pugi::xml_node piece : grid.children("Piece")) {
      mesh.begin_piece();
      const std::size_t num_points = count_of(piece, "NumberOfPoints");
      const std::size_t num_cells = count_of(piece, "NumberOfCells");
      if (num_points > 0) read_points(piece.child("Points").child("DataArray"), num_points, mesh);
      if (num_cells > 0) read_cells(piece.child("Cells"), num_cells, pass, mesh);
      for (const pugi::xml_node array : piece.child("PointData").children("DataArray"))
        read_array(array, num_points, pass, [&](MeshArray read) {
          mesh.add_point_array(std::move(read), num_points, line_of(array));
        });
      for (const pugi::xml_node array : piece.child("CellData").children("DataArray"))
        read_array(array, num_cells, pass,
                   [&](MeshArray read) { mesh.add_cell_array(std::move(read), num_cells, line_of(array)); });
    }
    return mesh.finish(line_of(grid));
  }

  void read_points(const pugi::xml_node& array, std::size_t count, VtkMesh& mesh) {
    const std::string name = "Points";
    const NumberType type = type_of(array, name);
    if (array.attribute("NumberOfComponents").as_int(3) != 3)
      cursor_.fail_at(line_of(array), "array 'Points' has not 3 components; export the file again");
    read_values(array, name, 3 * count, type, [&](FileCursor& values, std::size_t num_values) {
      mesh.add_coordinates(values, num_values, type, coding_of(array));
    });
  }

  void read_cells(const pugi::xml_node& arrays, std::size_t num_cells, Pass pass, VtkMesh& mesh) {
    VtkCells cells;
    const bool keeps = pass == Pass::build;
    read_indices(named(arrays, "types"), "types", num_cells, [&](FileCursor&, int type) {
      if (keeps) cells.types.push_back(type);
    });
    int end = 0;
    const pugi::xml_node offsets = named(arrays, "offsets");
    read_indices(offsets, "offsets", num_cells, [&](FileCursor& values, int next) {
      if (next < end) values.fail("the offsets do not ascend; export the file again");
      end = next;
      if (keeps) cells.ends.push_back(end);
    });
    int place = 0;
    read_indices(named(arrays, "connectivity"), "connectivity", static_cast<std::size_t>(end),
                 [&](FileCursor& values, int node) {
                   if (!mesh.has_point(node))
                     mesh.check_node(values, node, cell_of(offsets, num_cells, place));
                   ++place;
                   if (keeps) cells.nodes.push_back(node);
                 });
    mesh.add_cells(cells, num_cells);
  }

  // Returns the cell of a place in the connectivity, for a message.
  std::size_t cell_of(const pugi::xml_node& offsets, std::size_t num_cells, int place) {
    std::size_t cell = 0;
    growth_left_ = growth_;
    read_indices(offsets, "offsets", num_cells, [&](FileCursor&, int end) { cell += end <= place ? 1 : 0; });
    return cell;
  }

  // Passes over an array of strings or bits.
  void read_array(const pugi::xml_node& array, std::size_t size, Pass pass,
                  const std::function<void(MeshArray)>& take) {
    if (!number_type(array.attribute("type").value())) return;
    const int components = array.attribute("NumberOfComponents").as_int(1);
    if (components < 1 || components > kMaxComponents)
      cursor_.fail_at(line_of(array), "NumberOfComponents is out of range; export the file again");
    MeshArray read = {array.attribute("Name").value(), components, {}};
    const NumberType type = type_of(array, read.name);
    read_values(array, read.name, size * static_cast<std::size_t>(components), type,
                [&](FileCursor& values, std::size_t num_values) {
                  for (std::size_t i = 0; i < num_values; ++i) {
                    const double value = next_number(values, type, coding_of(array), "a value");
                    if (pass == Pass::build) read.values.push_back(value);
                  }
                });
    take(std::move(read));
  }

  static pugi::xml_node named(const pugi::xml_node& arrays, const char* name) {
    return arrays.find_child_by_attribute("DataArray", "Name", name);
  }

  void read_indices(const pugi::xml_node& array, const std::string& name, std::size_t count,
                    const std::function<void(FileCursor& values, int index)>& take) {
    const NumberType type = type_of(array, name);
    read_values(array, name, count, type, [&](FileCursor& values, std::size_t num_values) {
      for (std::size_t i = 0; i < num_values; ++i)
        take(values, next_index(values, type, coding_of(array), name.c_str()));
    });
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

  // Gives `take` the numbers of an array: text at once, binary numbers in blocks.
  void read_values(const pugi::xml_node& array, const std::string& name, std::size_t count, NumberType type,
                   const std::function<void(FileCursor& values, std::size_t num_values)>& take) {
    const int line = line_of(array);
    const std::string_view format = array.attribute("format").as_string("ascii");
    const VtuArrayPlace place = {cursor_, line, name};
    if (format == "ascii") {
      FileCursor values(cursor_, line, array.child_value());
      check_room(values, count, type, NumberCoding::text, name.c_str());
      take(values, count);
      if (values.skip_blanks()) place.fail("has more values than the mesh; export the file again");
      return;
    }
    if (format != "binary" && format != "appended")
      place.fail("has the unknown format '" + printable(format) + "'; export the file again");
    const bool is_appended = format == "appended";
    std::string_view stored = is_appended ? appended_ : std::string_view(array.child_value());
    if (is_appended && count > 0) {
      const unsigned long long offset =
          array.attribute("offset").as_ullong(std::numeric_limits<unsigned long long>::max());
      if (offset >= appended_.size())
        place.fail("begins behind the end of the file; copy or export the file again");
      stored.remove_prefix(offset);
    }
    decode_vtu_array(stored, !is_appended || appended_is_base64_, coding_, count * num_bytes(type),
                     growth_left_, place, [&](std::string_view block) {
                       FileCursor values(cursor_, line, block);
                       take(values, block.size() / num_bytes(type));
                     });
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

  FileCursor& cursor_;
  std::string file_;  // empty without appended data: the document has the bytes
  std::string xml_;   // the document points into it
  std::string_view appended_;
  bool appended_is_base64_ = false;
  pugi::xml_document document_;
  std::vector<std::pair<std::ptrdiff_t, int>> tags_;  // (offset, line)
  VtuCoding coding_;
  std::size_t growth_ = 0, growth_left_ = 0;  // bytes of binary arrays, in a pass
};

}  // namespace

MeshData read_vtu(FileCursor& cursor) {
  return VtuReader(cursor).read();
}

}  // namespace palpate
