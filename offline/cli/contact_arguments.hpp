// Contacts as `eval` and `picture` take them: --contact NODE=dx,dy,dz, NODE a label of the model file.
#pragma once

#include <palpate/palpate.h>

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "offline/cli/opened_pack.hpp"

namespace palpate {

struct ContactArguments {
  std::vector<std::string> contacts;
  std::vector<int> fixed;
  std::string gravity;
  std::string model = "auto";
};

// Adds --contact, --fix, --gravity and --model.
void add_contact_options(CLI::App& command, ContactArguments& arguments);

// The answer of the runtime to them, from rest, in model units.
struct ContactAnswer {
  std::vector<int> labels;            // of the site of each contact
  std::vector<pal_contact> contacts;  // model units; with the displacements that given forces have made
  std::vector<pal_contact_result> results;
  Eigen::VectorXd field;  // 3 packed nodes
};

// Throws std::runtime_error naming the option and the remedy when it does not fit the pack.
ContactAnswer answer_contacts(const OpenedPack& opened, const ContactArguments& arguments);

}  // namespace palpate
