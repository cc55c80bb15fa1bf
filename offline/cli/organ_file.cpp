#include "offline/cli/organ_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "offline/io/mesh_formats.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/io/organ_check.hpp"
#include "offline/io/tissue_table.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/largest_part.hpp"
#include "offline/mesh/merge_nodes.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Gives the tidied mesh of an .inp file the file's materials and supports.
void copy_laws_and_supports(const Model& deck, Model& model) {
  model.files = deck.files;
  model.materials = deck.materials;
  model.merge_length = deck.merge_length;
  for (size_t i = 0; i < model.elements.size(); ++i) {
    model.elements[i].material = deck.elements[i].material;
    model.elements[i].volume_patch = deck.elements[i].volume_patch;
  }
  for (PrescribedDisplacement dof : deck.fixed) {
    dof.node = model.find_node(deck.labels[static_cast<size_t>(dof.node)]);
    if (dof.node >= 0) model.fixed.push_back(dof);
  }
}

OrganFile read_deck(const std::filesystem::path& file, double merge_length) {
  OrganFile organ;
  Model deck;
  try {
    deck = read_inp_unchecked(file, merge_length);
    const auto num_bare = std::count_if(deck.elements.begin(), deck.elements.end(),
                                        [](const Tetrahedron& element) { return element.material < 0; });
    organ.has_laws = num_bare == 0;
    if (num_bare > 0 && num_bare < std::ssize(deck.elements))
      throw InputError({deck.file, 0},
                       fmt::format("{} of {} elements have no *SOLID SECTION; add one for them", num_bare,
                                   deck.elements.size()));
    // A build takes such a file as it is, so that nothing of it can be mended here.
    if (organ.has_laws) check_elements(deck, whole_file_origin(deck));
  } catch (const InputError& error) {
    if (deck.elements.empty()) {
      deck = read_inp_mesh(file);  // throws where not even the mesh can be read
      if (merge_length > 0) merge_nodes(deck, merge_length, whole_file_origin(deck));
    }
    if (!organ.has_laws) {
      for (Tetrahedron& element : deck.elements) element.material = -1;
    }
    organ.faults.emplace_back(error.what());
  }
  organ.model = model_from_mesh(mesh_from_model(deck));
  copy_laws_and_supports(deck, organ.model);
  return organ;
}

OrganFile read_bare_mesh(const std::filesystem::path& file) {
  OrganFile organ;
  MeshData mesh = read_mesh(file);
  labels_to_sets(mesh);
  organ.model = model_from_mesh(mesh);
  organ.moduli = find_element_moduli(mesh, 1, kTissueRatio);
  std::ranges::copy(organ.moduli.notes, std::back_inserter(organ.model.warnings));
  for (size_t i = 0; i < organ.model.elements.size(); ++i)
    organ.model.elements[i].material = organ.moduli.empty() ? -1 : organ.moduli.group_of_element[i];
  return organ;
}

// Moves the groups of moduli from the elements that are left back to `moduli`, without groups that have lost
// all elements.
void take_groups(OrganFile& organ) {
  std::vector<int> new_group(organ.moduli.groups.size(), -1);
  std::vector<ElementModuli::Group> groups;
  organ.moduli.group_of_element.clear();
  for (Tetrahedron& element : organ.model.elements) {
    int& group = new_group[static_cast<size_t>(element.material)];
    if (group < 0) {
      group = static_cast<int>(groups.size());
      groups.push_back(organ.moduli.groups[static_cast<size_t>(element.material)]);
    }
    organ.moduli.group_of_element.push_back(group);
    element.material = -1;
  }
  organ.moduli.groups = std::move(groups);
}

}  // namespace

OrganFile read_organ(const std::filesystem::path& file, const OrganOptions& options) {
  const double merge_length = options.merge_length / options.scale;  // in numbers of the file
  const bool is_inp = normalised_name(file.extension().string()) == ".INP";
  OrganFile organ = is_inp ? read_deck(file, merge_length) : read_bare_mesh(file);
  Model& model = organ.model;
  if (merge_length > 0 && !is_inp) merge_nodes(model, merge_length, whole_file_origin(model));
  for (Eigen::Vector3d& position : model.positions) position *= options.scale;
  if (options.keep_largest) keep_largest_part(model);
  if (!organ.moduli.empty()) take_groups(organ);
  return organ;
}

}  // namespace palpate
