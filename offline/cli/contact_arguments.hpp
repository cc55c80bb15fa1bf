// Parses the contacts of `eval` and `picture` and asks the runtime for their response:
//   --contact NODE=dx,dy,dz   NODE is a label of the model file
//   --at x,y,z=dx,dy,dz       a point near the surface
#pragma once

#include <palpate/palpate.h>

#include <CLI/App.hpp>
#include <string>
#include <utility>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

struct ContactArguments {
  std::vector<std::string> contacts;
  std::vector<std::string> points;
  std::vector<int> fixed;
  std::string gravity;
  std::string inclusion;
  std::vector<std::string> turns;
  std::string model = "auto";
  unsigned zone_rings = 0;  // 0: all rings of the pack
};

// Adds --contact, --at, --turn, --fix, --gravity, --inclusion, --model and --rings.
void add_contact_options(CLI::App& command, ContactArguments& arguments);

// Returns the node of a site at rest, length unit.
Eigen::Vector3d position_of_site(const OpenedPack& opened, std::uint32_t site);

// The place of a contact on the surface.
struct TouchedPlace {
  std::string name;  // the label of a site, or "x,y,z"
  bool is_site = true;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // at rest, length unit
  double distance = 0;                                 // from the requested point to the surface, length unit
  std::vector<std::pair<int, double>> corners;  // labels and weights of the sites whose responses are blended
  bool holds_fixed_node = false;                // --fix holds a node of a corner's patch
  int label() const;                            // label of the corner with the largest weight
};

// The runtime's response to the contacts, from rest, in model units.
struct ContactAnswer {
  std::vector<TouchedPlace> places;   // one for each contact
  std::vector<pal_contact> contacts;  // model units; given forces are resolved to displacements
  std::vector<pal_contact_result> results;
  std::vector<pal_contact_torque> torques;  // one for each contact; empty where no patch turns
  Eigen::VectorXd field;                    // 3 packed nodes: displacement, length unit
};

// Asks the runtime. Throws std::runtime_error with option and remedy where an argument does not fit the pack.
ContactAnswer answer_contacts(const OpenedPack& opened, const ContactArguments& arguments);

}  // namespace palpate
