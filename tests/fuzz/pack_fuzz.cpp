// Opens arbitrary bytes as a pack and touches the organ. A fully verified pack must answer with finite numbers; a pack
// that is only trusted (PAL_VERIFY_NEVER) may not, but no access may leave it.
#include <vector>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/signed_pack.hpp"

namespace palpate::fuzz {
namespace {

struct Answers {
  bool must_be_finite;
  template <typename Real>
  void check(std::span<const Real> numbers) const {
    if (must_be_finite) require_finite(numbers);
  }
};

void play_contacts(pal_session* session, const pal_pack_info& info, const Answers& answers) {
  for (const double reach : {0.3, 0.3, -1.0, 4.0}) {
    const double d = reach * info.max_displacement;
    const pal_contact contact = {info.num_sites - 1, {0.4 * d, -0.2 * d, d}, 0, {}, {0, 0}, {0.25, 0}};
    pal_contact_result result;
    if (pal_contact_frame(session, &contact, 1, &result) != PAL_STATUS_OK) continue;
    (void)!pal_session_refine(session, 0, nullptr);  // only sessions of zones refine
    answers.check<double>(result.force);
    answers.check<double>({result.stiffness[0], 9});
    answers.check<double>({&result.displacement_error, 2});  // and force_error
  }
}

// Tool 0 holds site 0, tool 1 comes down on the surface at the first site.
void play_tools(const pal_pack* pack, pal_session* session, const pal_pack_info& info,
                const Answers& answers) {
  const pal_hold hold = pal_default_hold(0);
  (void)!pal_tool_hold(session, 0, &hold);
  pal_geometry geometry = {};
  geometry.struct_size = sizeof geometry;
  std::uint32_t node = 0;
  if (pal_pack_get_geometry(pack, &geometry) != PAL_STATUS_OK ||
      pal_pack_get_site_node(pack, 0, &node) != PAL_STATUS_OK)
    std::abort();
  pal_touch touch = {};
  touch.struct_size = sizeof touch;
  touch.law = PAL_LAW_TOUCH;
  (void)!pal_tool_set_touch(session, 1, &touch);
  for (int frame = 0; frame < 5; ++frame) {
    const double d = 0.2 * frame * info.max_displacement;
    pal_pose poses[2] = {{{0, 0.5 * d, -d}, {1, 0, 0, 0}}, {{0, 0, 0}, {1, 0, 0, 0}}};
    for (std::uint32_t i = 0; i < 3; ++i)
      poses[1].position[i] = info.metres_per_length_unit * geometry.rest_positions[3 * std::size_t{node} + i];
    poses[1].position[2] -= d;
    pal_tool_result results[2];
    const pal_haptic_input input = {sizeof input, 2, poses, nullptr, 0.001, sizeof *results, 2};
    if (pal_haptic_frame(session, &input, results) != PAL_STATUS_OK) continue;
    for (const pal_tool_result& result : results) {
      answers.check<double>(result.force);
      answers.check<double>(result.torque);
      answers.check<double>({result.stiffness[0], 9});
    }
  }
}

void play(const pal_pack* pack, const Answers& answers) {
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  if (pal_pack_get_info(pack, &info) != PAL_STATUS_OK) std::abort();
  std::vector<pal_real> field(std::size_t{3} * info.num_nodes);
  std::vector<pal_real> normals(field.size());
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    pal_session_config config = pal_default_session_config(pack);
    config.model = model;
    const Memory arena = arena_for(pack, config);
    if (arena.size() == 0) continue;
    pal_session* session = nullptr;
    if (pal_session_init(pack, &config, arena.data(), arena.size(), &session) != PAL_STATUS_OK) std::abort();
    play_contacts(session, info, answers);
    play_tools(pack, session, info, answers);
    constexpr std::size_t kStride = 3 * sizeof(pal_real);
    if (pal_visual_frame(session, field.data(), kStride) != PAL_STATUS_OK) continue;
    answers.check<pal_real>(field);
    if (pal_pack_compute_normals(pack, field.data(), kStride, normals.data(), kStride) == PAL_STATUS_OK)
      answers.check<pal_real>(normals);
  }
}

}  // namespace
}  // namespace palpate::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::fuzz;
  const Memory bytes = signed_pack(data, size);
  for (const pal_verify verify : {PAL_VERIFY_ONCE, PAL_VERIFY_NEVER}) {
    alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
    pal_pack* pack = nullptr;
    if (pal_pack_open_memory(bytes.data(), bytes.size(), verify, storage, sizeof storage, &pack) !=
        PAL_STATUS_OK)
      continue;
    play(pack, {verify == PAL_VERIFY_ONCE});
    pal_pack_close(pack);
    ++num_accepted;
    break;
  }
  return 0;
}
