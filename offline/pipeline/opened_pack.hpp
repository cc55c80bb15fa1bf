// Opens a pack through the runtime. Errors become exceptions.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <palpate/palpate.hpp>
#include <span>
#include <string>
#include <vector>

#include "offline/pack/pack_writer.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

class OpenedPack {
 public:
  // Throws std::runtime_error "PATH: REASON" where the runtime refuses the pack.
  explicit OpenedPack(const std::filesystem::path& file);
  explicit OpenedPack(const AlignedBytes& bytes);

  const Pack& pack() const { return pack_; }
  pal_pack_info info() const { return pack_.info(); }
  const pack::Pack& tables() const;
  std::string length_unit() const;  // "" where the scene states no unit
  std::string force_unit() const;
  // Suffixes behind a number: " mm", " mN"; empty where the scene states no unit.
  std::string length_suffix() const;
  std::string force_suffix() const;
  int label_of_site(size_t site) const;
  std::span<const unsigned char> bytes() const;
  template <typename Number = std::uint32_t>
  std::span<const Number> segment(const pack::Segment& segment) const {
    return {reinterpret_cast<const Number*>(bytes().data() + segment.offset()),
            segment.bytes() / sizeof(Number)};
  }

 private:
  Pack pack_;
};

// A session in model units with its own memory. Throws std::runtime_error with the runtime's reason.
class ModelUnitSession {
 public:
  // Settings of nonlinear_zone:
  //   `zone_rings`: 0 takes all rings of the pack,
  //   `zone_iterations`: Newton iterations of a frame; 0 takes the default of the runtime,
  //   `patches_turn`: patches follow the rotations of turn(),
  //   `refines`: settle() continues to the equilibrium of the whole organ.
  ModelUnitSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                   std::uint32_t max_fixed, std::uint32_t zone_rings = 0, std::uint32_t zone_iterations = 0,
                   bool patches_turn = false, bool refines = true);

  void fix(std::span<const std::uint32_t> contact_nodes);
  // Sets gravity: length unit / s^2. Throws std::runtime_error where pack or model allow no other gravity.
  void set_gravity(const Eigen::Vector3d& acceleration);
  // Lengths in length units. The session must have zones.
  void set_inclusion(pal_inclusion inclusion);
  // Sets the rotation of each contact's patch for settle(): rotation vectors, radians. Needs `patches_turn`.
  void turn(std::vector<Eigen::Vector3d> rotations) { rotations_ = std::move(rotations); }
  // Returns the torque of a contact in the last frame, force unit x length unit, and its derivatives by
  // displacement (force unit) and by rotation (force unit x length unit).
  pal_contact_torque torque(std::uint32_t contact) const;
  // Computes a frame. Where a zone is missing, the refining lane prepares the zone and the frame is repeated.
  // Displacements in length unit, forces in force unit, stiffness in force unit / length unit.
  std::vector<pal_contact_result> contact_frame(std::span<const pal_contact> contacts);
  // Ramps the contacts from rest until nonlinear_zone converges. Other models need a single frame.
  std::vector<pal_contact_result> settle(std::span<const pal_contact> contacts);
  Eigen::VectorXd visual_frame();  // 3 packed nodes, length unit
  // Runs an iteration of the refining lane, if due. Returns the largest change of a displacement component by
  // the last iteration since settle() began: length unit; infinity after a failure, 0 before the first.
  double refine();

 private:
  ModelUnitSession(const OpenedPack& opened, const pal_session_config& config, bool refines);
  void rotate_patches(double fraction);
  // Raises contacts and rotations from rest in equal steps. Returns the results of the last step.
  std::vector<pal_contact_result> ramp(std::span<const pal_contact> contacts, int steps);
  // Holds the contacts until the exterior is in equilibrium, then until the stiffness is renewed.
  std::vector<pal_contact_result> hold(std::span<const pal_contact> contacts, double largest_displacement);

  const OpenedPack* opened_;
  AlignedBytes arena_;
  Session session_;
  std::vector<Eigen::Vector3d> rotations_;
  bool refines_;
  double change_ = 0;  // last result of refine(): length unit
};

// Throws std::runtime_error "WHERE: REASON" unless the status is OK.
void require_ok(pal_status status, const std::string& where);

const char* model_name(pal_model model);  // "linear", "polynomial", "zone"
pal_model runtime_model(pack::ResponseModel model);
std::vector<std::string> flag_names(std::uint32_t flags);  // "extrapolated", "clamped", ...

}  // namespace palpate
