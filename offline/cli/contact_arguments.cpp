#include "offline/cli/contact_arguments.hpp"

#include <fmt/core.h>

#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>

#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// Reads an argument from front to back. Each take() returns whether the text matched.
class ArgumentReader {
 public:
  explicit ArgumentReader(const std::string& text) : place_(text.data()), end_(text.data() + text.size()) {}
  bool take(char wanted) {
    const bool matches = place_ != end_ && *place_ == wanted;
    place_ += matches ? 1 : 0;
    return matches;
  }
  bool take(int& number) { return advance(std::from_chars(place_, end_, number)); }
  bool take(double& number) {
    take('+');
    return advance(std::from_chars(place_, end_, number)) && std::isfinite(number);
  }
  bool is_at_end() const { return place_ == end_; }

 private:
  bool advance(const std::from_chars_result& result) {
    place_ = result.ptr;
    return result.ec == std::errc();
  }
  const char* place_;
  const char* end_;
};

// Reads three coordinates: "1,2.5,-3".
bool take_point(ArgumentReader& reader, Eigen::Vector3d& point) {
  return reader.take(point[0]) && reader.take(',') && reader.take(point[1]) && reader.take(',') &&
         reader.take(point[2]);
}

// Parses --gravity: "0,0,-9810".
Eigen::Vector3d parse_gravity(const std::string& text) {
  Eigen::Vector3d acceleration;
  ArgumentReader reader(text);
  if (!take_point(reader, acceleration) || !reader.is_at_end())
    throw std::runtime_error(fmt::format("--gravity {}: expected gx,gy,gz, for example 0,0,-9810", text));
  return acceleration;
}

// Parses --inclusion, "10,0,4,5,3": centre, radius, stiffness factor; model units.
pal_inclusion parse_inclusion(const std::string& text) {
  pal_inclusion inclusion = {};
  Eigen::Vector3d centre;
  ArgumentReader reader(text);
  if (!take_point(reader, centre) || !reader.take(',') || !reader.take(inclusion.radius) ||
      !reader.take(',') || !reader.take(inclusion.stiffness) || !reader.is_at_end()) {
    throw std::runtime_error(fmt::format(
        "--inclusion {}: expected x,y,z,radius,stiffness, for example 10,0,4,5,3: a ball of radius 5 that is "
        "three times as stiff",
        text));
  }
  Eigen::Map<Eigen::Vector3d>(inclusion.centre) = centre;
  return inclusion;
}

// Parses --turn, "0,0,20" in degrees. Returns the rotation vector in radians.
Eigen::Vector3d parse_turn(const std::string& text) {
  Eigen::Vector3d degrees;
  ArgumentReader reader(text);
  if (!take_point(reader, degrees) || !reader.is_at_end()) {
    throw std::runtime_error(fmt::format(
        "--turn {}: expected rx,ry,rz, an axis times the angle in degrees, for example 0,0,20", text));
  }
  constexpr double kMost = 90;
  if (degrees.norm() > kMost) {
    throw std::runtime_error(
        fmt::format("--turn {}: {:.6g} degrees; patches turn by 90 at most", text, degrees.norm()));
  }
  return degrees * (std::numbers::pi / 180);
}

// Reads a displacement, "0,0,-5", or with a prescribed force along z, "0,0,f-300".
bool take_push(ArgumentReader& reader, pal_contact& contact) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    if (axis > 0 && !reader.take(',')) return false;
    const bool by_force = reader.take('f');
    if (by_force) contact.force_axes |= 1u << axis;
    if (!reader.take(by_force ? contact.force[axis] : contact.displacement[axis])) return false;
  }
  return reader.is_at_end();
}

// Adds the contact of --contact, "7=0,0,-5", in model units.
void add_site_contact(const OpenedPack& opened, const std::string& text, ContactAnswer& answer) {
  int label = 0;
  pal_contact contact = {};
  ArgumentReader reader(text);
  if (!reader.take(label) || !reader.take('=') || !take_push(reader, contact)) {
    throw std::runtime_error(
        fmt::format("--contact {}: expected NODE=dx,dy,dz, for example 7=0,0,-5, or with a force in place of "
                    "a displacement 7=0,0,f-300",
                    text));
  }
  if (opened.pack().find_site(label, contact.site) != PAL_STATUS_OK) {
    throw std::runtime_error(fmt::format(
        "--contact {}: node {} is not a contact site of this pack; `palpate info` lists them, and "
        "--at takes any place",
        text, label));
  }
  answer.places.push_back(
      {std::to_string(label), true, position_of_site(opened, contact.site), 0, {{label, 1.0}}});
  answer.contacts.push_back(contact);
}

// Adds the contact of --at, "10,20,30=0,0,-5", in model units.
void add_point_contact(const OpenedPack& opened, const std::string& text, ContactAnswer& answer) {
  Eigen::Vector3d asked;
  pal_contact push = {};
  ArgumentReader reader(text);
  if (!take_point(reader, asked) || !reader.take('=') || !take_push(reader, push)) {
    throw std::runtime_error(fmt::format(
        "--at {}: expected x,y,z=dx,dy,dz, for example 10,20,30=0,0,-5, or with a force in place of "
        "a displacement 10,20,30=0,0,f-300",
        text));
  }
  const double metres = opened.info().metres_per_length_unit;
  const Eigen::Vector3d position = metres * asked;
  pal_surface_point point;
  const pal_status status = pal_pack_find_surface_point(opened.pack().get(), position.data(), &point);
  if (status == PAL_STATUS_BAD_ARGUMENT || status == PAL_STATUS_NOT_FINITE)
    throw std::runtime_error(fmt::format(
        "--at {}: coordinates go to 1e15 of the organ's length unit; give a place near the surface", text));
  if (status != PAL_STATUS_OK)
    throw std::runtime_error(fmt::format("--at {}: {}", text, pal_status_text(status)));
  const Eigen::Vector3d found = Eigen::Vector3d(point.position) / metres;
  TouchedPlace place = {fmt::format("{:.6g},{:.6g},{:.6g}", found[0], found[1], found[2]),
                        false,
                        found,
                        (found - asked).norm(),
                        {}};
  for (int i = 0; i < 3; ++i) {
    if (point.weights[i] > 0)
      place.corners.emplace_back(opened.label_of_site(point.sites[i]), point.weights[i]);
  }
  pal_contact contact = pal_contact_at(&point, push.displacement);
  contact.force_axes = push.force_axes;
  for (int i = 0; i < 3; ++i) contact.force[i] = push.force[i];
  answer.places.push_back(place);
  answer.contacts.push_back(contact);
}

}  // namespace

Eigen::Vector3d position_of_site(const OpenedPack& opened, std::uint32_t site) {
  std::uint32_t node = 0;
  require_ok(pal_pack_get_site_node(opened.pack().get(), site, &node), "site");
  return Eigen::Vector3d(opened.pack().geometry().rest_positions + size_t{3} * node);
}

int TouchedPlace::label() const {
  return std::max_element(corners.begin(), corners.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

void add_contact_options(CLI::App& command, ContactArguments& arguments) {
  command
      .add_option(
          "--contact", arguments.contacts,
          "Move the patch of the site at NODE (label in the model file) by (dx,dy,dz); a component written "
          "fN is a force of N on it instead (answered by zones or the linear model); may be repeated")
      ->type_name("NODE=dx,dy,dz")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--at", arguments.points,
                  "The same at the surface point nearest to (x,y,z), also between sites; may be repeated")
      ->type_name("x,y,z=dx,dy,dz")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--turn", arguments.turns,
                  "Turn the patch of the first contact about its place, an axis times the angle in degrees; "
                  "repeated: of the next one, --contact before --at (answered by zones, up to 90 degrees)")
      ->type_name("rx,ry,rz")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--fix", arguments.fixed,
                  "Hold a node of a contact patch at zero (answered by zones, up to 32 of them, or the "
                  "linear model); may be repeated")
      ->type_name("NODE")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option(
          "--gravity", arguments.gravity,
          "Acceleration in place of the scene's, which must let it turn (answered by the linear model)")
      ->type_name("gx,gy,gz");
  command
      .add_option("--inclusion", arguments.inclusion,
                  "Tissue within a ball that is so many times as stiff, 0.01 to 100 (answered by zones)")
      ->type_name("x,y,z,radius,stiffness");
  command
      .add_option(
          "--model", arguments.model,
          "auto, linear, polynomial, affine or zone; default auto: the first of polynomial, zone and linear "
          "that is in the pack and can answer. affine: polynomial, where a site was not sampled")
      ->type_name("MODEL")
      ->check(CLI::IsMember({"auto", "linear", "polynomial", "affine", "zone"}));
  command
      .add_option("--rings", arguments.zone_rings,
                  "Rings of nonlinear elements about each patch; default: all that the pack carries")
      ->type_name("N")
      ->check(CLI::Range(1, static_cast<int>(pack::kMostZoneRings)));
}

namespace {

// Returns the contact nodes of a site's patch.
std::span<const std::uint32_t> patch_of(const OpenedPack& opened, std::uint32_t site) {
  const pack::ContactSites& sites = *opened.tables().sites();
  const auto starts = opened.segment(*sites.patch_starts());
  return opened.segment(*sites.patch_nodes()).subspan(starts[site], starts[site + 1] - starts[site]);
}

void mark_fixed(const OpenedPack& opened, const std::vector<std::uint32_t>& fixed, ContactAnswer& answer) {
  for (TouchedPlace& place : answer.places) {
    for (const auto& [label, weight] : place.corners) {
      std::uint32_t site = 0;
      require_ok(opened.pack().find_site(label, site), "site");
      const auto patch = patch_of(opened, site);
      place.holds_fixed_node =
          place.holds_fixed_node ||
          std::find_first_of(patch.begin(), patch.end(), fixed.begin(), fixed.end()) != patch.end();
    }
  }
}

std::vector<std::uint32_t> find_fixed_nodes(const OpenedPack& opened, const std::vector<int>& labels) {
  std::vector<std::uint32_t> fixed(labels.size());
  for (size_t i = 0; i < labels.size(); ++i) {
    if (pal_pack_find_contact_node(opened.pack().get(), labels[i], &fixed[i]) == PAL_STATUS_OK) continue;
    throw std::runtime_error(
        fmt::format("--fix {}: only nodes of contact patches can be fixed at run time; `palpate info "
                    "--json` lists them",
                    labels[i]));
  }
  return fixed;
}

// `is_single`: there is at most one contact, without force, and no fixed node.
void check_model_choice(const ContactArguments& arguments, const pal_pack_info& info, pal_model model,
                        bool is_single, bool zones_can_answer) {
  const bool is_polynomial = model == PAL_MODEL_POLYNOMIAL || model == PAL_MODEL_AFFINE;
  if (is_polynomial && !is_single) {
    throw std::runtime_error(fmt::format(
        "--model {} supports one displaced contact and no --fix; use auto, zone or linear", arguments.model));
  }
  if (info.has_linear == 0 && (model == PAL_MODEL_LINEAR || !is_single)) {
    throw std::runtime_error(
        "--model linear, --fix, forces and several contacts need the linear model, absent from this pack; "
        "build it with [models] linear = true");
  }
  if (info.has_polynomial == 0 && is_polynomial)
    throw std::runtime_error("this pack has no polynomial model; build it with [models] polynomial = true");
  if (info.zone_rings == 0 && (model == PAL_MODEL_ZONE || arguments.zone_rings > 0))
    throw std::runtime_error("this pack has no nonlinear zone; build it with [models] zone = true");
  if (arguments.zone_rings > info.zone_rings) {
    throw std::runtime_error(
        fmt::format("--rings {}: the zones of this pack have {}; build it with [models] zone_rings = {}",
                    arguments.zone_rings, info.zone_rings, arguments.zone_rings));
  }
  if (model == PAL_MODEL_ZONE && !zones_can_answer) {
    throw std::runtime_error(
        "--model zone answers up to 8 contacts and 32 --fix, and no --gravity; use auto or linear");
  }
}

// Only nonlinear_zone implements --turn and --inclusion.
void require_zones(bool zones_can_answer, const char* option) {
  if (zones_can_answer) return;
  throw std::runtime_error(
      fmt::format("{} needs zones: a pack with [models] zone = true, --model auto or "
                  "zone, up to 8 contacts and 32 --fix, and no --gravity",
                  option));
}

void apply_gravity(const ContactArguments& arguments, const pal_pack_info& info, pal_model model,
                   ModelUnitSession& session) {
  const Eigen::Vector3d acceleration = parse_gravity(arguments.gravity);
  if (info.gravity_may_turn == 0)
    throw std::runtime_error(
        "--gravity: the gravity of this pack may not turn; build it with [gravity] may_turn = true");
  if (model == PAL_MODEL_POLYNOMIAL || model == PAL_MODEL_AFFINE)
    throw std::runtime_error(
        fmt::format("--model {} supports the scene's gravity only; use auto or linear", arguments.model));
  session.set_gravity(acceleration);
}

// Fills the displacements under prescribed forces, results, torques and field of the answer.
void fill_response(ModelUnitSession& session, bool patches_turn, ContactAnswer& answer) {
  answer.results = session.settle(answer.contacts);
  for (size_t c = 0; c < answer.contacts.size(); ++c) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((answer.contacts[c].force_axes >> axis & 1) != 0)
        answer.contacts[c].displacement[axis] = answer.results[c].displacement[axis];
    }
  }
  // Only zones turn patches. Where linear_dd answered instead, the results carry a flag and no torques.
  const bool zones_answered =
      std::all_of(answer.results.begin(), answer.results.end(),
                  [](const pal_contact_result& result) { return result.model == PAL_MODEL_ZONE; });
  for (std::uint32_t c = 0; c < answer.contacts.size() && patches_turn && zones_answered; ++c)
    answer.torques.push_back(session.torque(c));
  answer.field = session.visual_frame();
}

}  // namespace

ContactAnswer answer_contacts(const OpenedPack& opened, const ContactArguments& arguments) {
  // pal_session_config::max_contacts has the same bound.
  const size_t count = arguments.contacts.size() + arguments.points.size();
  if (count > pack::kMostContacts)
    throw std::runtime_error(
        fmt::format("{} contacts are given; the runtime holds at most {}", count, pack::kMostContacts));
  ContactAnswer answer;
  for (const std::string& text : arguments.contacts) add_site_contact(opened, text, answer);
  for (const std::string& text : arguments.points) add_point_contact(opened, text, answer);
  const bool forces_given = std::any_of(answer.contacts.begin(), answer.contacts.end(),
                                        [](const pal_contact& contact) { return contact.force_axes != 0; });
  const std::vector<std::uint32_t> fixed = find_fixed_nodes(opened, arguments.fixed);
  mark_fixed(opened, fixed, answer);
  const pal_model model = arguments.model == "linear"       ? PAL_MODEL_LINEAR
                          : arguments.model == "polynomial" ? PAL_MODEL_POLYNOMIAL
                          : arguments.model == "affine"     ? PAL_MODEL_AFFINE
                          : arguments.model == "zone"       ? PAL_MODEL_ZONE
                                                            : PAL_MODEL_AUTO;
  const pal_pack_info info = opened.info();
  const bool is_single = count <= 1 && fixed.empty() && !forces_given;
  const bool zones_can_answer = info.zone_rings > 0 && (model == PAL_MODEL_AUTO || model == PAL_MODEL_ZONE) &&
                                count <= pack::kMostZoneContacts && fixed.size() <= pack::kMostZoneFixed &&
                                arguments.gravity.empty();
  check_model_choice(arguments, info, model, is_single, zones_can_answer);
  std::vector<Eigen::Vector3d> rotations;
  for (const std::string& text : arguments.turns) rotations.push_back(parse_turn(text));
  if (rotations.size() > count)
    throw std::runtime_error(
        fmt::format("{} --turn for {} contacts; give one for each at most", rotations.size(), count));
  if (!rotations.empty()) require_zones(zones_can_answer, "--turn");
  ModelUnitSession session(opened, model, static_cast<std::uint32_t>(std::max(size_t{1}, count)),
                           static_cast<std::uint32_t>(fixed.size()), arguments.zone_rings, 0,
                           !rotations.empty(), true);
  session.turn(rotations);
  session.fix(fixed);
  if (!arguments.gravity.empty()) apply_gravity(arguments, info, model, session);
  if (!arguments.inclusion.empty()) {
    const pal_inclusion inclusion = parse_inclusion(arguments.inclusion);
    require_zones(zones_can_answer, "--inclusion");
    session.set_inclusion(inclusion);
  }
  fill_response(session, !rotations.empty(), answer);
  return answer;
}

}  // namespace palpate
