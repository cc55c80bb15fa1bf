// Gmsh's mesh files: format 1, 2.0 to 2.2 and 4.1, text and binary.
//
// A physical group of dimension 3 becomes an element set. A group of curves or surfaces becomes an element
// set of these cells and a node set of their nodes, the middles of quadratic cells included. A group of
// points becomes a node set alone. Groups without a name are called POINT_7, CURVE_7, SURFACE_7 or VOLUME_7
// by their number. $NodeData and $ElementData become arrays: the last time step of each name. The reader
// skips all other sections.
//
// Source: Gmsh 4.11 reference manual, sections "MSH file format" and "Legacy formats".
//
// The ending of the name picks the format that is written, as in Gmsh: .msh1, .msh2 (2.2), .msh4 (4.1); .msh
// is 4.1. Format 1 has text alone. Reading the file gives the same mesh, except for a node set that an
// element set of curves or surfaces gains. A point cell in an element set becomes a node of a node set.
#include "offline/io/gmsh_reader.hpp"
#include "offline/io/mesh_formats.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Each element of an entity joins all its groups, so their number bounds the memory that a damaged file can
// take.
constexpr std::size_t kMostGroups = 100;

constexpr std::size_t kLongestName = 100;  // of a section

}  // namespace

MeshData GmshReader::read() {
  while (in_.skip_blanks()) read_section();
  if (!draft_.has_nodes()) in_.fail("has no section $Nodes; name a mesh file of Gmsh, or export it again");
  return draft_.finish();
}

void GmshReader::read_section() {
  section_line_ = in_.line();
  const std::string_view word = in_.next_word("a section");
  if (word.front() != '$' || word.size() > kLongestName)
    in_.fail(
        "'" + printable(word) +
        "' stands where a section such as $Nodes should begin; name a mesh file of Gmsh, or export it again");
  const std::string name(word.substr(1));
  std::string end = "$End" + name;
  if (name == "MeshFormat") {
    read_format();
  } else if (name == "PhysicalNames") {
    read_names();
  } else if ((name == "Entities" || name == "PartitionedEntities") && version_ == 4) {
    read_entities(name != "Entities");
  } else if (name == "NOD" || name == "Nodes" || name == "ParametricNodes") {
    if (name == "NOD") end = "$ENDNOD";
    if (draft_.has_nodes()) in_.fail("a second section of nodes begins; keep one mesh in the file");
    if (version_ == 4) {
      read_node_blocks();
    } else {
      read_nodes(name == "ParametricNodes");
    }
    draft_.end_nodes(section_line_);
  } else if (name == "ELM" || name == "Elements") {
    if (name == "ELM") end = "$ENDELM";
    if (!draft_.has_nodes()) in_.fail("the elements stand before the nodes; export the file again");
    if (draft_.has_elements()) in_.fail("a second section of elements begins; keep one mesh in the file");
    if (version_ == 4) {
      read_element_blocks();
    } else {
      read_elements();
    }
    draft_.end_elements(section_line_);
  } else if (name == "NodeData" || name == "ElementData") {
    read_data(name == "ElementData");
  } else {
    skip_section(name);
    return;
  }
  end_section(end);
}

void GmshReader::end_section(const std::string& end) {
  const std::string_view word = in_.next_word(end.c_str());
  if (word != end)
    in_.fail("'" + printable(word) + "' stands where " + end +
             " should be; the count of the section is wrong, so export the file again");
}

void GmshReader::skip_section(const std::string& name) {
  if (!in_.skip_past_word("$End" + name, "$END" + name))
    in_.fail("$" + printable(name) + " has no $End" + printable(name) + "; export the file again");
  if (name == "ElementNodeData")
    draft_.add_note("line " + std::to_string(section_line_) +
                    ": values at the nodes of elements are left out");
}

void GmshReader::read_format() {
  const double version = in_.next_number("the version");
  const bool is_two = version > 1.99 && version < 2.99;
  const bool is_four = version > 4.09 && version < 4.11;
  if (!is_two && !is_four)
    in_.fail("Gmsh's format " + std::to_string(version).substr(0, 3) +
             " is not read; save the file as 4.1: gmsh FILE -save -format msh41 -o NEW.msh");
  version_ = is_two ? 2 : 4;
  const int file_type = in_.next_integer("the file type, 0 or 1,");
  if (file_type != 0 && file_type != 1)
    in_.fail("the file type is " + std::to_string(file_type) + ", not 0 (text) or 1 (binary); correct it");
  const int data_size = in_.next_integer("the data size");
  if (file_type == 0) return;
  if (data_size != 8)
    in_.fail("numbers have " + std::to_string(data_size) + " bytes, not 8; export the file again, as text");
  in_.next_line("the data size");
  const auto one = in_.next_binary<std::uint32_t>(false, "the byte order");
  if (one != 1 && one != 0x01000000U)
    in_.fail("the byte order after the format is damaged; copy the file again, in binary");
  numbers_.coding = one == 1 ? NumberCoding::little_endian : NumberCoding::big_endian;
}

void GmshReader::read_names() {
  const std::size_t count = in_.next_count("the number of physical names", 4);
  for (std::size_t i = 0; i < count; ++i) {
    const int dimension = in_.next_integer("the dimension of a physical name");
    const int number = in_.next_integer("the number of a physical name");
    draft_.add_name(dimension, number, unquoted(trimmed(in_.next_line("a physical name"))));
  }
}

void GmshReader::read_entities(bool partitioned) {
  numbers_.end_line("the entities");
  if (partitioned) {
    numbers_.wide("the number of partitions");
    const std::size_t num_ghosts = numbers_.wide_count("the number of ghost entities", 4, 8);
    for (std::size_t i = 0; i < 2 * num_ghosts; ++i) numbers_.integer("a ghost entity");
  }
  std::array<std::size_t, 4> counts = {};
  for (std::size_t& count : counts) count = numbers_.wide_count("the number of entities", 10, 36);
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (std::size_t i = 0; i < counts[static_cast<std::size_t>(dimension)]; ++i)
      read_entity(dimension, partitioned);
  }
}

void GmshReader::read_entity(int dimension, bool partitioned) {
  const int number = numbers_.integer("the number of an entity");
  if (partitioned) {
    numbers_.integer("the dimension of a parent");
    numbers_.integer("the number of a parent");
    const std::size_t num_partitions = numbers_.wide_count("the number of partitions", 2, 4);
    for (std::size_t i = 0; i < num_partitions; ++i) numbers_.integer("a partition");
  }
  const int num_reals = dimension == 0 ? 3 : 6;
  for (int i = 0; i < num_reals; ++i) numbers_.real("the box of an entity");
  const std::size_t num_groups = numbers_.wide_count("the number of physical groups", 2, 4);
  if (num_groups > kMostGroups)
    in_.fail("an entity is in " + std::to_string(num_groups) + " physical groups; use at most " +
             std::to_string(kMostGroups));
  if (num_groups > 0)
    entities_.push_back({dimension, number, static_cast<std::uint32_t>(groups_.size()),
                         static_cast<std::uint32_t>(num_groups)});
  for (std::size_t i = 0; i < num_groups; ++i) groups_.push_back(numbers_.integer("a physical group"));
  if (dimension == 0) return;
  const std::size_t num_bounds = numbers_.wide_count("the number of bounding entities", 2, 4);
  for (std::size_t i = 0; i < num_bounds; ++i) numbers_.integer("a bounding entity");
}

std::vector<int> GmshReader::groups_of(int dimension, int number) const {
  const Entity behind_all = {dimension, number, UINT32_MAX, UINT32_MAX};
  const auto behind = std::ranges::upper_bound(entities_, behind_all);
  if (behind == entities_.begin()) return {};
  const Entity& last = *std::prev(behind);  // the last of an entity that stands in the file twice
  if (last.dimension != dimension || last.number != number) return {};
  const auto first = groups_.begin() + last.first_group;
  return {first, first + last.num_groups};
}

void GmshReader::read_nodes(bool parametric) {
  const std::size_t count = numbers_.text_count("the number of nodes", 8, 28);
  for (std::size_t i = 0; i < count; ++i) {
    const int label = numbers_.integer("the number of a node");
    Eigen::Vector3d position;
    for (int axis = 0; axis < 3; ++axis) position[axis] = numbers_.real("a coordinate");
    if (parametric) {
      const int dimension = numbers_.integer("the dimension of a node's entity");
      numbers_.integer("the number of a node's entity");
      for (int k = 0; k < dimension && dimension < 3; ++k) numbers_.real("a parametric coordinate");
    }
    draft_.add_node(label, position);
  }
}

void GmshReader::read_node_blocks() {
  numbers_.end_line("the nodes");
  const std::size_t num_blocks = numbers_.wide_count("the number of blocks of nodes", 8, 20);
  const std::size_t total = numbers_.wide_count("the number of nodes", 8, 32);
  numbers_.wide("the least number of a node");
  numbers_.wide("the largest number of a node");
  for (std::size_t block = 0; block < num_blocks; ++block) {
    const int dimension = numbers_.integer("the dimension of a block of nodes");
    if (dimension < 0 || dimension > 3)
      in_.fail("a block of nodes has the dimension " + std::to_string(dimension) +
               ", not 0 to 3; correct it");
    numbers_.integer("the entity of a block of nodes");
    const bool parametric = numbers_.integer("whether a block of nodes is parametric") != 0;
    read_node_block(numbers_.wide_count("the number of nodes of a block", 8, 32), dimension, parametric);
  }
  expect_total(draft_.num_points(), total, "nodes");
}

void GmshReader::read_node_block(std::size_t count, int dimension, bool parametric) {
  std::vector<int> labels(count);
  for (int& label : labels) label = numbers_.wide("the number of a node");
  for (const int label : labels) {
    Eigen::Vector3d position;
    for (int axis = 0; axis < 3; ++axis) position[axis] = numbers_.real("a coordinate");
    for (int k = 0; k < dimension && parametric; ++k) numbers_.real("a parametric coordinate");
    draft_.add_node(label, position);
  }
}

void GmshReader::expect_total(std::size_t found, std::size_t stated, const char* items) const {
  if (found != stated)
    in_.fail("the blocks hold " + std::to_string(found) + " " + items + ", but their section states " +
             std::to_string(stated) + "; export the file again");
}

MeshData read_gmsh(FileCursor& in) {
  return read_twice<GmshReader>(in);
}

}  // namespace palpate
