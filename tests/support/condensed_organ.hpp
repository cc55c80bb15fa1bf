// The memory and the elements of a whole organ, condensed onto the boundary of a zone.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <vector>

#include "offline/precompute/organ_tree.hpp"
#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {

// Memory that an arena takes, zeroed.
class Memory {
 public:
  explicit Memory(const std::function<void(Arena&)>& carve) : bytes_(size_of(carve)) {
    Arena arena(bytes_.bytes().data());
    carve(arena);
  }

 private:
  static size_t size_of(const std::function<void(Arena&)>& carve) {
    Arena counting(nullptr);
    carve(counting);
    return counting.used();
  }
  AlignedBytes bytes_;
};

// The condensation of a whole organ, and of its exterior of a zone.
struct CondensedOrgan {
  CondensedOrgan(const ZoneBlock& organ, const std::vector<int>& zone_elements)
      : block(organ),
        pack(*organ.pack->get()),
        tree(make_organ_tree(organ.block.model, organ.block.sites)),
        is_zone_element(tree.elements.size(), 0),
        memory([&](Arena& arena) {
          carve_organ_elements(pack, arena, elements);
          front_of = carve_front_of(pack, arena);
          const uint32_t most = std::min(pack.organ.num_free, kMostKept);
          carve_condensation(pack, condensation_room(pack, 0), arena, whole);
          carve_condensation(pack, condensation_room(pack, most), arena, exterior);
          carve_scratch(pack, most, arena, scratch);
        }) {
    EXPECT_TRUE(fill_organ_elements(pack, elements));
    EXPECT_TRUE(fill_front_of(pack, front_of));
    clear_scratch(pack, scratch);
    for (uint32_t i = 0; i < pack.organ.num_nodes; ++i) {
      for (const double u : pack.organ.nodes[i].displacement) rest.push_back(u);
    }
    std::fill_n(whole.roles, pack.organ.num_nodes, NodeRole::eliminated);
    mark_zone(zone_elements);
    zone_of_simd_lane.resize(most_simd_lanes(pack));
    list_zones(pack.organ, elements, is_zone_element.data(), zone_of_simd_lane.data());
  }

  bool run() {
    return advance(nullptr, nullptr, whole) && advance(&whole, zone_of_simd_lane.data(), exterior);
  }

  // What is outside of the zone.
  Exterior outside() const {
    return {pack, kernel, front_of, elements, zone_of_simd_lane.data(), rest.data()};
  }

  bool advance(const Condensation* shared, const uint8_t* without, Condensation& condensation) {
    const Exterior what = {pack, kernel, front_of, elements, without, rest.data()};
    begin_condensation(what, shared, scratch, condensation);
    Progress progress;
    do {
      uint64_t spent = 0;
      progress = advance_condensation(what, kSlice, scratch, condensation, spent);
      ++slices;
    } while (progress == Progress::goes_on);
    return progress == Progress::ended;
  }

  // The stiffness at rest of all elements, or of those outside of the zone: rows of the pack's nodes.
  Eigen::MatrixXd stiffness(bool without_zone) const {
    Model model = block.block.model;
    std::vector<Tetrahedron> left;
    for (size_t i = 0; i < tree.elements.size(); ++i) {
      if (!without_zone || is_zone_element[i] == 0)
        left.push_back(model.elements[static_cast<size_t>(tree.elements[i])]);
    }
    model.elements = left;
    const Assembly assembly(model, model.fixed_dofs());
    SparseLower lower;
    assembly.tangent(block.rest.displacement_of(model), false, lower);
    const Eigen::MatrixXd equations = Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
    const auto rows = static_cast<Eigen::Index>(3 * tree.nodes.size());
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, rows);
    const auto equation_of = [&](Eigen::Index row) {
      return assembly.dof_equations()[static_cast<size_t>(3 * tree.nodes[static_cast<size_t>(row / 3)]) +
                                      static_cast<size_t>(row % 3)];
    };
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j < rows; ++j) {
        if (equation_of(i) >= 0 && equation_of(j) >= 0) all(i, j) = equations(equation_of(i), equation_of(j));
      }
    }
    return all;
  }

  // The dofs of these nodes that the model leaves free.
  std::vector<Eigen::Index> dofs_of(NodeRole role) const {
    std::vector<Eigen::Index> dofs;
    const auto add = [&](uint32_t node) {
      for (uint32_t axis = 0; axis < 3; ++axis) {
        if ((pack.organ.nodes[node].free_axes >> axis & 1) != 0) dofs.push_back(3 * node + axis);
      }
    };
    if (role == NodeRole::kept) {
      for (uint32_t i = 0; i < exterior.num_kept; ++i) add(exterior.kept[i]);
    } else {
      for (uint32_t node = 0; node < pack.organ.num_free; ++node) {
        if (exterior.roles[node] == role) add(node);
      }
    }
    return dofs;
  }

  static constexpr uint64_t kSlice = 5000;
  static constexpr uint32_t kMostKept = 600;
  const ZoneBlock& block;
  const pal_pack& pack;
  OrganTree tree;
  std::vector<uint8_t> is_zone_element;
  std::vector<uint8_t> zone_of_simd_lane;
  std::vector<double> rest;
  EliminationKernel kernel = choose_elimination_kernel();
  OrganElements elements;
  uint32_t* front_of = nullptr;
  Condensation whole;
  Condensation exterior;
  CondensationScratch scratch;
  Memory memory;
  int slices = 0;

 private:
  void mark_zone(const std::vector<int>& zone_elements) {
    const std::set<int> in_zone(zone_elements.begin(), zone_elements.end());
    for (size_t i = 0; i < tree.elements.size(); ++i)
      is_zone_element[i] = in_zone.count(tree.elements[i]) > 0 ? 1 : 0;
    for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
      const pack::OrganNode& entry = pack.organ.nodes[node];
      uint32_t inside = 0;
      for (uint32_t e = 0; e < entry.num_elements; ++e)
        inside += is_zone_element[pack.organ.node_elements[entry.first_element + e]];
      exterior.roles[node] = node >= pack.organ.num_free || inside == entry.num_elements ? NodeRole::absent
                             : inside > 0                                                ? NodeRole::kept
                                          : NodeRole::eliminated;
      if (exterior.roles[node] == NodeRole::kept) exterior.kept[exterior.num_kept++] = node;
    }
  }
};

}  // namespace palpate::test
