#include "offline/cli/contact_arguments.hpp"

#include <fmt/core.h>

#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

struct ParsedContact {
  int label = 0;
  pal_contact contact = {};  // without its site
};

// "0,0,-9810".
Eigen::Vector3d parse_gravity(const std::string& text) {
  Eigen::Vector3d acceleration;
  const char* place = text.data();
  const char* const end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    std::from_chars_result result = {place, std::errc::invalid_argument};
    if (axis == 0 || (place != end && *place++ == ','))
      result = std::from_chars(place, end, acceleration[axis]);
    if (result.ec != std::errc() || !std::isfinite(acceleration[axis]) || (axis == 2 && result.ptr != end)) {
      throw std::runtime_error(fmt::format("--gravity {}: expected gx,gy,gz, for example 0,0,-9810", text));
    }
    place = result.ptr;
  }
  return acceleration;
}

// "7=0,0,-5": node 7 is moved by (0, 0, -5); "7=0,0,f-300": along z the force on it is -300 instead.
ParsedContact parse_contact(const std::string& text) {
  const auto refuse = [&]() -> std::runtime_error {
    return std::runtime_error(
        fmt::format("--contact {}: expected NODE=dx,dy,dz, for example 7=0,0,-5, or with a force in place of "
                    "a displacement 7=0,0,f-300",
                    text));
  };
  ParsedContact parsed;
  const char* place = text.data();
  const char* const end = text.data() + text.size();
  std::from_chars_result result = std::from_chars(place, end, parsed.label);
  if (result.ec != std::errc()) throw refuse();
  place = result.ptr;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (place == end || *place++ != (axis == 0 ? '=' : ',')) throw refuse();
    const bool by_force = place != end && *place == 'f';
    if (by_force) {
      ++place;
      parsed.contact.force_axes |= 1u << axis;
    }
    if (place != end && *place == '+') ++place;
    double& number = by_force ? parsed.contact.force[axis] : parsed.contact.displacement[axis];
    result = std::from_chars(place, end, number);
    if (result.ec != std::errc() || !std::isfinite(number)) throw refuse();
    place = result.ptr;
  }
  if (place != end) throw refuse();
  return parsed;
}

}  // namespace

void add_contact_options(CLI::App& command, ContactArguments& arguments) {
  command
      .add_option(
          "--contact", arguments.contacts,
          "Move the patch of the site at NODE (label in the model file) by (dx,dy,dz); a component written "
          "fN is a force of N on it instead (answered by the linear model); may be repeated")
      ->type_name("NODE=dx,dy,dz")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--fix", arguments.fixed,
                  "Hold a node of a contact patch at zero (answered by the linear model); may be repeated")
      ->type_name("NODE")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option(
          "--gravity", arguments.gravity,
          "Acceleration in place of the scene's, which must let it turn (answered by the linear model)")
      ->type_name("gx,gy,gz");
  command
      .add_option("--model", arguments.model,
                  "auto, linear or polynomial; default auto: polynomial where it can answer, else linear")
      ->type_name("MODEL")
      ->check(CLI::IsMember({"auto", "linear", "polynomial"}));
}

ContactAnswer answer_contacts(const OpenedPack& opened, const ContactArguments& arguments) {
  ContactAnswer answer;
  // The runtime's own bound: pal_session_config::max_contacts.
  if (arguments.contacts.size() > pack::kMostContacts) {
    throw std::runtime_error(fmt::format("--contact is given {} times; the runtime holds at most {} contacts",
                                         arguments.contacts.size(), pack::kMostContacts));
  }
  bool forces_given = false;
  for (const std::string& text : arguments.contacts) {
    auto [label, contact] = parse_contact(text);
    if (opened.pack().find_site(label, contact.site) != PAL_STATUS_OK) {
      throw std::runtime_error(
          fmt::format("--contact {}: node {} is not a contact site of this pack; `palpate info` lists them",
                      text, label));
    }
    forces_given = forces_given || contact.force_axes != 0;
    answer.labels.push_back(label);
    answer.contacts.push_back(contact);
  }
  std::vector<std::uint32_t> fixed;
  for (const int label : arguments.fixed) {
    std::uint32_t node = 0;
    if (pal_pack_find_contact_node(opened.pack().get(), label, &node) != PAL_STATUS_OK) {
      throw std::runtime_error(
          fmt::format("--fix {}: only nodes of contact patches can be fixed at run time; `palpate info "
                      "--json` lists them",
                      label));
    }
    fixed.push_back(node);
  }
  const pal_model model = arguments.model == "linear"       ? PAL_MODEL_LINEAR
                          : arguments.model == "polynomial" ? PAL_MODEL_POLYNOMIAL
                                                            : PAL_MODEL_AUTO;
  const auto count = static_cast<std::uint32_t>(answer.contacts.size());
  if (model == PAL_MODEL_POLYNOMIAL && (count > 1 || !fixed.empty() || forces_given)) {
    throw std::runtime_error(
        "--model polynomial answers one contact that is moved, and no --fix; use auto or linear");
  }
  const pal_pack_info info = opened.info();
  if (info.has_linear == 0 && (model == PAL_MODEL_LINEAR || count > 1 || !fixed.empty() || forces_given)) {
    throw std::runtime_error(
        "this pack has no linear model, which --model linear, --fix, forces and several contacts need; build "
        "it with "
        "[models] "
        "linear = true");
  }
  if (info.has_polynomial == 0 && model == PAL_MODEL_POLYNOMIAL)
    throw std::runtime_error("this pack has no polynomial model; build it with [models] polynomial = true");
  ModelUnitSession session(opened, model, std::max(1u, count), static_cast<std::uint32_t>(fixed.size()));
  session.fix(fixed);
  if (!arguments.gravity.empty()) {
    const Eigen::Vector3d acceleration = parse_gravity(arguments.gravity);
    if (info.gravity_may_turn == 0) {
      throw std::runtime_error(
          "--gravity: the gravity of this pack may not turn; build it with [gravity] may_turn = true");
    }
    if (model == PAL_MODEL_POLYNOMIAL)
      throw std::runtime_error("--model polynomial answers the scene's gravity alone; use auto or linear");
    session.set_gravity(acceleration);
  }
  answer.results = session.contact_frame(answer.contacts);
  for (size_t c = 0; c < answer.contacts.size(); ++c) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((answer.contacts[c].force_axes >> axis & 1) != 0)
        answer.contacts[c].displacement[axis] = answer.results[c].displacement[axis];
    }
  }
  answer.field = session.visual_frame();
  return answer;
}

}  // namespace palpate
