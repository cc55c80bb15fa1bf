// A pack as the commands use it: opened by the runtime itself, with errors as exceptions and one session.
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
  // Throws std::runtime_error "PATH: REASON" when the runtime would not open it.
  explicit OpenedPack(const std::filesystem::path& file);
  explicit OpenedPack(const AlignedBytes& bytes);

  const Pack& pack() const { return pack_; }
  pal_pack_info info() const { return pack_.info(); }
  const pack::Pack& tables() const;
  std::string length_unit() const;  // "" when the scene states none
  std::string force_unit() const;
  // As they are printed behind a number: " mm", " mN"; nothing when the scene states none.
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

// A session with memory of its own that speaks model units. Throws std::runtime_error with the runtime's
// reason.
class ModelUnitSession {
 public:
  // Of the nonlinear zone: `zone_rings`, 0: all that the pack carries; Newton iterations of a frame, 0: the runtime's
  // default; and whether patches turn.
  ModelUnitSession(const OpenedPack& opened, pal_model model, std::uint32_t max_contacts,
                   std::uint32_t max_fixed, std::uint32_t zone_rings = 0, std::uint32_t zone_iterations = 0,
                   bool patches_turn = false);

  void fix(std::span<const std::uint32_t> contact_nodes);
  // The pack lets it turn, and not only polynomials answer.
  void set_gravity(const Eigen::Vector3d& acceleration);
  // In length units. The session has zones.
  void set_inclusion(pal_inclusion inclusion);
  // How `settle` turns the patches of its contacts: rotation vectors, radians. Patches turn.
  void turn(std::vector<Eigen::Vector3d> rotations) { rotations_ = std::move(rotations); }
  // Of the last frame's contact: force unit x length unit, and force unit.
  pal_contact_torque torque(std::uint32_t contact) const;
  // Displacements in length units; the results' forces and stiffness are in force unit, force unit / length
  // unit.
  std::vector<pal_contact_result> contact_frame(std::span<const pal_contact> contacts);
  // The same from rest, in so many frames as a model that iterates takes to come to rest there.
  std::vector<pal_contact_result> settle(std::span<const pal_contact> contacts);
  Eigen::VectorXd visual_frame();  // 3 packed nodes, length unit

 private:
  ModelUnitSession(const OpenedPack& opened, const pal_session_config& config);
  void turn_patches(double part);

  const OpenedPack* opened_;
  AlignedBytes arena_;
  Session session_;
  std::vector<Eigen::Vector3d> rotations_;
};

// Throws std::runtime_error "WHERE: REASON" unless the status is OK.
void require_ok(pal_status status, const std::string& where);

const char* model_name(pal_model model);  // "linear", "polynomial", "zone"
pal_model runtime_model(pack::ResponseModel model);
std::vector<std::string> flag_names(std::uint32_t flags);  // "extrapolated", "clamped", ...

}  // namespace palpate
