// A pack and a session that own their memory.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <palpate/palpate.hpp>
#include <stdexcept>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate::test {

inline void require(pal_status status, const char* what) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(std::string(what) + ": " + pal_status_text(status));
}

// Size of a node's displacement in a visual frame.
inline constexpr size_t kNodeBytes = 3 * sizeof(pal_real);

// Tolerance of a field: `in_float32`, or the tighter promise of a PALPATE_FLOAT64 build.
constexpr double field_tolerance(double in_float32) {
  return sizeof(pal_real) == sizeof(float) ? in_float32 : 1e-10;
}

// Opens a pack. The bytes must outlive the object.
class OpenPack {
 public:
  explicit OpenPack(const AlignedBytes& bytes, pal_verify verify = PAL_VERIFY_ONCE) {
    require(pack_.open_memory(bytes.bytes().data(), bytes.bytes().size(), verify), "open");
  }
  const Pack& face() const { return pack_; }
  const pal_pack* get() const { return pack_.get(); }
  pal_pack_info info() const { return pack_.info(); }

 private:
  Pack pack_;
};

// A config without blending or limits: tools feel the response model at once.
inline pal_session_config session_config(const pal_pack* pack, pal_model model, uint32_t max_contacts,
                                         uint32_t max_fixed) {
  pal_session_config config = pal_default_session_config(pack);
  config.model = model;
  config.max_contacts = max_contacts;
  config.max_fixed = max_fixed;
  config.blend_seconds = 0;
  config.max_force = config.max_force_rate = std::numeric_limits<double>::infinity();
  return config;
}

class OwnedSession {
 public:
  OwnedSession(const pal_pack* pack, pal_model model, uint32_t max_contacts = 3, uint32_t max_fixed = 4)
      : OwnedSession(pack, session_config(pack, model, max_contacts, max_fixed)) {}

  OwnedSession(const pal_pack* pack, const pal_session_config& config) : arena_(required(pack, config)) {
    pal_pack_info info = {};
    info.struct_size = sizeof info;
    require(pal_pack_get_info(pack, &info), "info");
    num_nodes_ = info.num_nodes;
    require(pal_session_init(pack, &config, arena_.bytes().data(), arena_.bytes().size(), &session_), "init");
  }

  pal_session* get() const { return session_; }

  void fix(const std::vector<uint32_t>& nodes) {
    require(pal_session_set_fixed(session_, nodes.data(), static_cast<uint32_t>(nodes.size())), "set_fixed");
  }

  // A frame; repeated after the refining lane's work, where the lane has to prepare a zone first.
  std::vector<pal_contact_result> touch(const std::vector<pal_contact>& contacts) {
    std::vector<pal_contact_result> results = touch_once(contacts);
    while (!results.empty() && (results.front().flags & PAL_FLAG_PREPARING) != 0) {
      require(pal_session_refine(session_, 0, nullptr), "refine");
      results = touch_once(contacts);
    }
    return results;
  }

  std::vector<pal_contact_result> touch_once(const std::vector<pal_contact>& contacts) {
    std::vector<pal_contact_result> results(contacts.size());
    require(
        pal_contact_frame(session_, contacts.data(), static_cast<uint32_t>(contacts.size()), results.data()),
        "contact_frame");
    return results;
  }

  // [num_nodes][3]
  std::vector<pal_real> field() {
    std::vector<pal_real> displacements(size_t{3} * num_nodes_);
    require(pal_visual_frame(session_, displacements.data(), kNodeBytes), "visual_frame");
    return displacements;
  }

 private:
  static size_t required(const pal_pack* pack, const pal_session_config& config) {
    size_t bytes = 0;
    require(pal_session_required_bytes(pack, &config, &bytes), "required_bytes");
    return bytes;
  }

  AlignedBytes arena_;
  pal_session* session_ = nullptr;
  uint32_t num_nodes_ = 0;
};

inline Eigen::VectorXd as_vector(const std::vector<pal_real>& field) {
  Eigen::VectorXd vector(static_cast<Eigen::Index>(field.size()));
  std::copy(field.begin(), field.end(), vector.begin());
  return vector;
}

inline bool all_finite(const std::vector<pal_real>& values) {
  for (const pal_real value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

// Whether two linear_dd results agree to the rounding of their sums. The order of the sums depends on the
// order in which nodes joined and left the contact set.
template <typename Result>
bool are_alike(const Result& a, const Result& b) {
  constexpr double kRounding = 1e-10;
  const Eigen::Vector3d force(b.force);
  return a.flags == b.flags && a.model == b.model &&
         (Eigen::Vector3d(a.force) - force).norm() <= kRounding * force.norm();
}

// Every number of a result.
inline bool all_finite(const pal_contact_result& result) {
  bool finite = std::isfinite(result.displacement_error) && std::isfinite(result.force_error);
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(result.force[i]);
    for (int j = 0; j < 3; ++j) finite = finite && std::isfinite(result.stiffness[i][j]);
  }
  return finite;
}

// An iteration of the refining lane, in slices of so many multiply-adds; 0: in one. Of a session without zones: none.
inline pal_refinement refine(OwnedSession& session, uint64_t slice = 0) {
  pal_refinement refinement = {};
  refinement.struct_size = sizeof refinement;
  do {
    const pal_status status = pal_session_refine(session.get(), slice, &refinement);
    if (status == PAL_STATUS_NO_SUCH_MODEL) return refinement;
    require(status, "refine");
  } while (refinement.delivered == 0 && refinement.failed == 0 && refinement.waiting != 0);
  return refinement;
}

// The flags but for PAL_FLAG_UNREFINED.
inline uint32_t flags_of(const pal_contact_result& result) {
  return result.flags & ~uint32_t{PAL_FLAG_UNREFINED};
}

}  // namespace palpate::test
