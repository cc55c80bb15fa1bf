// Contacts as `eval` and `picture` take them: --contact NODE=dx,dy,dz, NODE a label of the model file, and --at
// x,y,z=dx,dy,dz, anywhere on the surface.
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
  unsigned zone_rings = 0;  // 0: all that the pack carries
};

// Adds --contact, --at, --turn, --fix, --gravity, --inclusion, --model and --rings.
void add_contact_options(CLI::App& command, ContactArguments& arguments);

// Where a contact is.
struct TouchedPlace {
  std::string name;  // the label of a site, or "x,y,z"
  bool is_site = true;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // at rest, length unit
  double distance = 0;                                 // of the place that was asked for, length unit
  std::vector<std::pair<int, double>> corners;         // labels of the sites that answer, and their weights
  bool holds_fixed_node = false;                       // of its patch --fix holds some
  int label() const;                                   // of the one that weighs most
};

// The answer of the runtime to them, from rest, in model units.
struct ContactAnswer {
  std::vector<TouchedPlace> places;   // of each contact
  std::vector<pal_contact> contacts;  // model units; with the displacements that given forces have made
  std::vector<pal_contact_result> results;
  std::vector<pal_contact_torque> torques;  // of each contact, where some are turned
  Eigen::VectorXd field;                    // 3 packed nodes
};

// Throws std::runtime_error naming the option and the remedy when it does not fit the pack.
ContactAnswer answer_contacts(const OpenedPack& opened, const ContactArguments& arguments);

}  // namespace palpate
