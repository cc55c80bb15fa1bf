// $Elements, $NodeData and $ElementData of Gmsh's files.
#include <algorithm>

#include "offline/io/gmsh_reader.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// The part of the points or cells that an array must cover. Sparse arrays would take far more memory than
// their file.
constexpr std::size_t kLeastShare = 8;

constexpr int kMostComponents = 9;  // Gmsh: 1, 3 or 9, a scalar, a vector or a tensor

}  // namespace

const GmshType& GmshReader::type_of(int number) const {
  const GmshType* type = find_gmsh_type(number);
  if (type == nullptr)
    in_.fail("Gmsh's element type " + std::to_string(number) +
             " is not supported; export the mesh with elements of order 1 or 2");
  if (!type->is_supported)
    in_.fail(std::string(type->name) + " (Gmsh's type " + std::to_string(number) +
             ") are not supported; export the mesh with elements of order 1 or 2");
  return *type;
}

void GmshReader::read_labels(GmshElement& element, bool wide) {
  for (int i = 0; i < element.type->num_nodes; ++i)
    element.labels[static_cast<std::size_t>(i)] =
        wide ? numbers_.wide("a node of an element") : numbers_.integer("a node of an element");
}

void GmshReader::read_elements() {
  const std::size_t count = numbers_.text_count("the number of elements", 8, 8);
  if (numbers_.is_binary()) return read_binary_elements(count);
  for (std::size_t i = 0; i < count; ++i) {
    GmshElement element;
    element.label = in_.next_integer("the number of an element");
    element.line = in_.line();
    element.type = &type_of(in_.next_integer("the type of an element"));
    int group = 0;
    if (version_ == 1) {
      group = in_.next_integer("the physical group of an element");
      element.entity = in_.next_integer("the entity of an element");
      if (const int num_nodes = in_.next_integer("the number of nodes"); num_nodes != element.type->num_nodes)
        in_.fail("element " + std::to_string(element.label) + " states " + std::to_string(num_nodes) +
                 " nodes, but " + element.type->name + " have " + std::to_string(element.type->num_nodes) +
                 "; correct it");
    } else {
      const std::size_t num_tags = in_.next_count("the number of tags of an element", 2);
      for (std::size_t tag = 0; tag < num_tags; ++tag) {
        const int value = in_.next_integer("a tag of an element");
        if (tag == 0) group = value;
        if (tag == 1) element.entity = value;
      }
    }
    element.groups = {&group, 1};
    read_labels(element, false);
    draft_.add_element(element);
  }
}

void GmshReader::read_binary_elements(std::size_t count) {
  std::size_t num_read = 0;
  while (num_read < count) {
    GmshElement element;
    element.type = &type_of(numbers_.integer("the type of a block of elements"));
    const int num_elements = numbers_.integer("the number of elements of a block");
    const int num_tags = numbers_.integer("the number of tags of an element");
    if (num_elements < 1 || static_cast<std::size_t>(num_elements) > count - num_read || num_tags < 0)
      in_.fail("a block has " + std::to_string(num_elements) + " elements with " + std::to_string(num_tags) +
               " tags, which does not fit the " + std::to_string(count) +
               " elements of the section; export the file again");
    for (int i = 0; i < num_elements; ++i) {
      element.label = numbers_.integer("the number of an element");
      int group = 0;
      for (int tag = 0; tag < num_tags; ++tag) {
        const int value = numbers_.integer("a tag of an element");
        if (tag == 0) group = value;
        if (tag == 1) element.entity = value;
      }
      element.groups = {&group, 1};
      read_labels(element, false);
      draft_.add_element(element);
    }
    num_read += static_cast<std::size_t>(num_elements);
  }
}

void GmshReader::read_element_blocks() {
  numbers_.end_line("the elements");
  const std::size_t num_blocks = numbers_.wide_count("the number of blocks of elements", 8, 20);
  const std::size_t total = numbers_.wide_count("the number of elements", 4, 16);
  numbers_.wide("the least number of an element");
  numbers_.wide("the largest number of an element");
  std::ranges::sort(entities_);
  std::size_t num_read = 0;
  for (std::size_t block = 0; block < num_blocks; ++block) {
    numbers_.integer("the dimension of a block of elements");
    const int entity = numbers_.integer("the entity of a block of elements");
    const GmshType& type = type_of(numbers_.integer("the type of a block of elements"));
    const std::size_t count = numbers_.wide_count("the number of elements of a block", 4, 16);
    read_element_block(count, type, entity, groups_of(dimension(type.kind), entity));
    num_read += count;
  }
  expect_total(num_read, total, "elements");
}

void GmshReader::read_element_block(std::size_t count, const GmshType& type, int entity,
                                    const std::vector<int>& groups) {
  GmshElement element;
  element.type = &type;
  element.entity = entity;
  element.groups = groups;
  for (std::size_t i = 0; i < count; ++i) {
    element.label = numbers_.wide("the number of an element");
    element.line = numbers_.is_binary() ? 0 : in_.line();
    read_labels(element, true);
    draft_.add_element(element);
  }
}

// Reads the tags before the values. `count`: of the points or cells that have values.
MeshArray GmshReader::read_data_header(std::size_t& count) {
  MeshArray array;
  const std::size_t num_names = in_.next_count("the number of string tags", 2);
  if (num_names > 0) in_.next_line("the number of string tags");
  for (std::size_t i = 0; i < num_names; ++i) {
    const std::string name = unquoted(trimmed(in_.next_line("a string tag")));
    if (i == 0) array.name = name;
  }
  const std::size_t num_reals = in_.next_count("the number of real tags", 2);
  for (std::size_t i = 0; i < num_reals; ++i) in_.next_number("a real tag");
  const int num_integers = in_.next_integer("the number of integer tags");
  if (num_integers < 3)
    in_.fail(
        "there are " + std::to_string(num_integers) +
        " integer tags, but the time step, the components and the count are needed; export the file again");
  in_.next_integer("the time step");
  array.num_components = in_.next_integer("the number of components");
  if (array.num_components < 1 || array.num_components > kMostComponents)
    in_.fail("there are " + std::to_string(array.num_components) + " components, not 1 to " +
             std::to_string(kMostComponents) + "; correct it");
  const auto size = static_cast<std::size_t>(array.num_components);
  count = in_.next_count("the number of values", numbers_.is_binary() ? 4 + 8 * size : 2 + 2 * size);
  for (int i = 3; i < num_integers; ++i) in_.next_integer("an integer tag");
  numbers_.end_line("the integer tags");
  return array;
}

void GmshReader::read_data(bool of_cells) {
  if (of_cells ? !draft_.has_elements() : !draft_.has_nodes())
    in_.fail("values stand before the mesh that they belong to; export the file again");
  std::size_t count = 0;
  MeshArray array = read_data_header(count);
  const std::size_t num_items = of_cells ? draft_.num_cells() : draft_.num_points();
  const auto size = static_cast<std::size_t>(array.num_components);
  const bool is_kept = draft_.keeps() && num_items > 0 && count >= num_items / kLeastShare;
  std::vector<char> has_value(is_kept ? num_items : 0);
  if (is_kept) array.values.resize(num_items * size);
  for (std::size_t i = 0; i < count; ++i) {
    const int label = numbers_.integer("the number of a node or an element");
    const int index = of_cells ? draft_.find_cell(label) : draft_.find_node(label);
    const auto at = static_cast<std::size_t>(index);
    for (std::size_t k = 0; k < size; ++k) {
      const double value = numbers_.real("a value");
      if (is_kept && index >= 0) array.values[at * size + k] = value;
    }
    if (is_kept && index >= 0) has_value[at] = 1;
  }
  const auto missing = static_cast<std::size_t>(std::count(has_value.begin(), has_value.end(), 0));
  const std::string items = of_cells ? " elements" : " nodes";
  if (!is_kept) {
    draft_.add_note("values '" + array.name + "' of " + std::to_string(count) + " of " +
                    std::to_string(num_items) + items + " are left out");
  } else {
    if (missing > 0)
      draft_.add_note("'" + array.name + "' has no values for " + std::to_string(missing) + items +
                      "; they get 0");
    draft_.add_array(of_cells, std::move(array));
  }
}

}  // namespace palpate
