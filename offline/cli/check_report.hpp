// The report of `palpate check` as text and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "offline/cli/organ_scene.hpp"
#include "offline/io/organ_check.hpp"
#include "offline/pipeline/organ_cost.hpp"

namespace palpate {

// Nodes that --fix or --probe selects.
struct SelectedNodes {
  int num_nodes = 0;
  int num_touchable = 0;  // free nodes of the surface among them
  Eigen::AlignedBox3d box;
};

struct CheckReport {
  const Model* model = nullptr;
  OrganCheck check;
  const Units* unit = nullptr;  // null: not said
  std::string held_by;          // "*BOUNDARY", "--fix z<10%", "the node set FIXED"; empty: nothing holds it
  std::optional<SelectedNodes> fix;    // of --fix
  std::optional<SelectedNodes> probe;  // of --probe
  std::optional<OrganCost> cost;
  std::string cost_of;  // the tissue and supports that the cost assumes, or why there is no cost
};

void print_check_text(const CheckReport& report);  // without the cost
void print_cost_text(const CheckReport& report);
void print_check_json(const CheckReport& report);

}  // namespace palpate
