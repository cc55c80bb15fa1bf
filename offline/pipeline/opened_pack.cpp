#include "offline/pipeline/opened_pack.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

size_t arena_bytes(const Pack& pack, const pal_session_config& config) {
  size_t bytes = 0;
  require_ok(Session::required_bytes(pack, config, bytes), "session");
  return bytes;
}

pal_session_config config_of(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                             std::uint32_t max_fixed, std::uint32_t zone_rings, std::uint32_t zone_iterations,
                             bool patches_turn) {
  pal_session_config config = pal_default_session_config(opened.pack().get());
  config.patches_turn = patches_turn ? 1 : 0;
  config.zone_rings = zone_rings;
  config.zone_iterations = zone_iterations;
  config.model = model;
  config.max_contacts = max_contacts;
  config.max_fixed = max_fixed;
  return config;
}

}  // namespace

void require_ok(pal_status status, const std::string& where) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(where + ": " + pal_status_text(status));
}

const char* model_name(pal_model model) {
  switch (model) {
    case PAL_MODEL_AUTO:
      return "none";
    case PAL_MODEL_LINEAR:
      return "linear";
    case PAL_MODEL_POLYNOMIAL:
      return "polynomial";
    case PAL_MODEL_ZONE:
      return "zone";
    case PAL_MODEL_AFFINE:
      return "affine";
  }
  return "unknown";
}

pal_model runtime_model(pack::ResponseModel model) {
  switch (model) {
    case pack::ResponseModel::linear_dd:
      return PAL_MODEL_LINEAR;
    case pack::ResponseModel::polynomial_dd:
      return PAL_MODEL_POLYNOMIAL;
    case pack::ResponseModel::nonlinear_zone:
      return PAL_MODEL_ZONE;
    case pack::ResponseModel::affine_site:
      return PAL_MODEL_AFFINE;
    case pack::ResponseModel::unrefined_zone:
      return PAL_MODEL_ZONE;
  }
  throw std::logic_error("no such model");
}

std::vector<std::string> flag_names(std::uint32_t flags) {
  constexpr std::pair<std::uint32_t, const char*> kNames[] = {
      {PAL_FLAG_EXTRAPOLATED, "extrapolated"},       {PAL_FLAG_CLAMPED, "clamped"},
      {PAL_FLAG_LINEAR_FALLBACK, "linear_fallback"}, {PAL_FLAG_OVERLAPPING, "overlapping"},
      {PAL_FLAG_ILL_CONDITIONED, "ill_conditioned"}, {PAL_FLAG_NEAREST_SITE, "nearest_site"},
      {PAL_FLAG_UNCONVERGED, "unconverged"},         {PAL_FLAG_UNREFINED, "unrefined"}};
  std::vector<std::string> names;
  for (const auto& [flag, name] : kNames) {
    if ((flags & flag) != 0) names.emplace_back(name);
  }
  return names;
}

OpenedPack::OpenedPack(const std::filesystem::path& file) {
  require_ok(pack_.open(file.c_str()), file.string());
}

OpenedPack::OpenedPack(const AlignedBytes& bytes) {
  const pal_status status = pack_.open_memory(bytes.bytes().data(), bytes.bytes().size());
  // A pack of write_pack() fails this check only through numbers outside the range of float32.
  if (status == PAL_STATUS_CORRUPT_CONTENT)
    throw std::runtime_error(
        "the organ's forces or displacements are too large or too small for a pack's 32-bit numbers: state "
        "the model in other units of length or force, or lower a max_displacement far beyond its size");
  require_ok(status, "pack in memory");
}

std::span<const unsigned char> OpenedPack::bytes() const {
  const void* bytes = nullptr;
  size_t count = 0;
  require_ok(pal_pack_get_bytes(pack_.get(), &bytes, &count), "pack");
  return {static_cast<const unsigned char*>(bytes), count};
}

const pack::Pack& OpenedPack::tables() const {
  return *pack::GetPack(bytes().data() + sizeof(pack::PackHeader));
}

std::string OpenedPack::length_unit() const {
  return tables().units() == nullptr ? "" : tables().units()->length()->str();
}
std::string OpenedPack::force_unit() const {
  return tables().units() == nullptr ? "" : tables().units()->force()->str();
}

std::string OpenedPack::length_suffix() const {
  return tables().units() == nullptr ? "" : fmt::format(" {}", length_unit());
}
std::string OpenedPack::force_suffix() const {
  return tables().units() == nullptr ? "" : fmt::format(" {}", force_unit());
}

int OpenedPack::label_of_site(size_t site) const {
  std::uint32_t node = 0;
  require_ok(pal_pack_get_site_node(pack_.get(), static_cast<std::uint32_t>(site), &node), "site");
  // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): an open pack has labels
  return pack_.geometry().labels[node];
}

ModelUnitSession::ModelUnitSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                                   std::uint32_t max_fixed, std::uint32_t zone_rings,
                                   std::uint32_t zone_iterations, bool patches_turn, bool refines)
    : ModelUnitSession(
          opened,
          config_of(opened, model, max_contacts, max_fixed, zone_rings, zone_iterations, patches_turn),
          refines) {}

ModelUnitSession::ModelUnitSession(const OpenedPack& opened, const pal_session_config& config, bool refines)
    : opened_(&opened), arena_(arena_bytes(opened.pack(), config)), refines_(refines) {
  require_ok(session_.init(opened.pack(), config, arena_.bytes()), "session");
}

void ModelUnitSession::fix(std::span<const std::uint32_t> contact_nodes) {
  require_ok(session_.set_fixed(contact_nodes), "fixed nodes");
}

void ModelUnitSession::set_gravity(const Eigen::Vector3d& acceleration) {
  const Eigen::Vector3d scaled = opened_->info().metres_per_length_unit * acceleration;
  const pal_status status = pal_session_set_gravity(session_.get(), scaled.data());
  if (status == PAL_STATUS_BAD_ARGUMENT)
    throw std::runtime_error("--gravity: more than ten times the scene's; reduce it");
  require_ok(status, "gravity");
}

void ModelUnitSession::set_inclusion(pal_inclusion inclusion) {
  const double metres = opened_->info().metres_per_length_unit;
  inclusion.struct_size = sizeof inclusion;
  for (double& component : inclusion.centre) component *= metres;
  inclusion.radius *= metres;
  const pal_status status = pal_session_set_inclusion(session_.get(), &inclusion);
  if (status == PAL_STATUS_BAD_ARGUMENT) {
    throw std::runtime_error(
        "--inclusion: the radius must be above 0 and the stiffness from 0.01 to 100 times the tissue's");
  }
  require_ok(status, "inclusion");
}

// Sets the orientations of the patches at a fraction of their rotations, as quaternions.
void ModelUnitSession::rotate_patches(double fraction) {
  std::vector<double> orientations;
  for (const Eigen::Vector3d& rotation : rotations_) {
    const double angle = fraction * rotation.norm();
    const Eigen::Vector3d xyz = std::sin(angle / 2) * rotation.normalized();  // 0 where the rotation is 0
    orientations.insert(orientations.end(), {std::cos(angle / 2), xyz[0], xyz[1], xyz[2]});
  }
  if (orientations.empty()) return;
  require_ok(pal_session_set_orientations(session_.get(), orientations.data(),
                                          static_cast<std::uint32_t>(rotations_.size())),
             "orientations");
}

pal_contact_torque ModelUnitSession::torque(std::uint32_t contact) const {
  const pal_pack_info info = opened_->info();
  pal_contact_torque torque = {};
  torque.struct_size = sizeof torque;
  require_ok(pal_session_get_torque(session_.get(), contact, &torque), "torque");
  const double newtons = info.newtons_per_force_unit;
  for (size_t i = 0; i < 3; ++i) {
    torque.torque[i] /= newtons * info.metres_per_length_unit;
    for (double& entry : torque.by_displacement[i]) entry /= newtons;
    for (double& entry : torque.by_rotation[i]) entry /= newtons * info.metres_per_length_unit;
  }
  return torque;
}

std::vector<pal_contact_result> ModelUnitSession::contact_frame(std::span<const pal_contact> contacts) {
  const pal_pack_info info = opened_->info();
  std::vector<pal_contact> scaled(contacts.begin(), contacts.end());
  for (pal_contact& contact : scaled) {
    for (double& component : contact.displacement) component *= info.metres_per_length_unit;
    for (double& component : contact.force) component *= info.newtons_per_force_unit;
  }
  std::vector<pal_contact_result> results(contacts.size());
  require_ok(session_.contact_frame(scaled, results), "frame");
  while (!results.empty() && (results.front().flags & PAL_FLAG_PREPARING) != 0) {
    require_ok(session_.refine(), "refinement");
    require_ok(session_.contact_frame(scaled, results), "frame");
  }
  for (pal_contact_result& result : results) {
    for (double& component : result.force) component /= info.newtons_per_force_unit;
    for (double& component : result.displacement) component /= info.metres_per_length_unit;
    for (auto& row : result.stiffness) {
      for (double& entry : row) entry *= info.metres_per_length_unit / info.newtons_per_force_unit;
    }
  }
  return results;
}

double ModelUnitSession::refine() {
  pal_refinement refinement = {};
  require_ok(session_.refine(0, refinement), "refinement");
  if (refinement.failed != 0) change_ = std::numeric_limits<double>::infinity();
  if (refinement.delivered != 0) change_ = refinement.change / opened_->info().metres_per_length_unit;
  return change_;
}

std::vector<pal_contact_result> ModelUnitSession::settle(std::span<const pal_contact> contacts) {
  rotate_patches(0);
  contact_frame({});  // at rest
  std::vector<pal_contact_result> results = contact_frame(contacts);
  if (results.empty() || results.front().model != PAL_MODEL_ZONE) return results;
  contact_frame({});  // back to rest
  change_ = 0;
  constexpr double kStepsPerEdge = 8;
  constexpr int kStepsOfForce = 16;
  constexpr double kStepsPerRadian = 16;
  constexpr int kMostSteps = 64;
  double farthest = 0;
  int least_steps = 1;
  for (const pal_contact& contact : contacts) {
    farthest = std::max(farthest, Eigen::Vector3d(contact.displacement).norm());
    if (contact.force_axes != 0) least_steps = kStepsOfForce;
  }
  for (const Eigen::Vector3d& rotation : rotations_)
    least_steps = std::max(least_steps, static_cast<int>(std::ceil(kStepsPerRadian * rotation.norm())));
  const pal_pack_info info = opened_->info();
  const double edge = info.mean_surface_edge / info.metres_per_length_unit;
  const int steps =
      std::max(least_steps,
               static_cast<int>(std::min(std::ceil(kStepsPerEdge * farthest / edge), double{kMostSteps})));
  results = ramp(contacts, steps);
  for (const Eigen::Vector3d& rotation : rotations_) farthest = std::max(farthest, edge * rotation.norm());
  for (const pal_contact_result& result : results)
    farthest = std::max(farthest, Eigen::Vector3d(result.displacement).norm());
  return hold(contacts, farthest);
}

std::vector<pal_contact_result> ModelUnitSession::ramp(std::span<const pal_contact> contacts, int steps) {
  constexpr int kMostFrames = 16;  // for one load step
  std::vector<pal_contact> step_contacts(contacts.begin(), contacts.end());
  std::vector<pal_contact_result> results;
  for (int step = 1; step <= steps; ++step) {
    for (size_t c = 0; c < contacts.size(); ++c) {
      for (size_t axis = 0; axis < 3; ++axis) {
        step_contacts[c].displacement[axis] = contacts[c].displacement[axis] * step / steps;
        step_contacts[c].force[axis] = contacts[c].force[axis] * step / steps;
      }
    }
    rotate_patches(static_cast<double>(step) / steps);
    for (int frame = 0; frame < kMostFrames; ++frame) {
      results = contact_frame(step_contacts);
      if ((results.front().flags & PAL_FLAG_UNCONVERGED) == 0) break;
    }
    if (refines_) refine();
  }
  return results;
}

std::vector<pal_contact_result> ModelUnitSession::hold(std::span<const pal_contact> contacts,
                                                       double largest_displacement) {
  constexpr int kMostHoldFrames = 256;
  constexpr double kRefined = 1e-6;  // fraction of the largest displacement
  bool is_refined = !refines_;
  std::vector<pal_contact_result> results;
  for (int frame = 0, unchanged_frames = 0;
       frame < kMostHoldFrames && unchanged_frames <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) {
    const bool has_changed_nothing = is_refined || refine() <= kRefined * largest_displacement;
    results = contact_frame(contacts);
    is_refined =
        is_refined || (has_changed_nothing && frame > 0 && (results.front().flags & PAL_FLAG_UNREFINED) == 0);
    const bool is_converged = (results.front().flags & PAL_FLAG_UNCONVERGED) == 0;
    unchanged_frames = is_refined && is_converged ? unchanged_frames + 1 : 0;
  }
  for (pal_contact_result& result : results) {
    if (!is_refined) result.flags |= PAL_FLAG_UNREFINED;
  }
  return results;
}

Eigen::VectorXd ModelUnitSession::visual_frame() {
  const pal_pack_info info = opened_->info();
  Eigen::Matrix<pal_real, Eigen::Dynamic, 1> displacements(Eigen::Index{3} * info.num_nodes);
  require_ok(session_.visual_frame(displacements.data()), "frame");
  return displacements.cast<double>() / info.metres_per_length_unit;
}

}  // namespace palpate
