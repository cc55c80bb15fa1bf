// Opens a pack: maps the file, then checks everything once, so that frames need no checks.
//
// Each step makes the next step's reads safe:
// - header,
// - FlatBuffers verifier,
// - meaning: each segment lies in the file with the size that its tables imply; indices and numbers are within bounds,
// - checksum.
//
// PAL_VERIFY_NEVER skips the checks of the models' numbers, and the checksum.
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <errno.h>
#include <math.h>

#include <palpate/palpate.h>

#include "runtime/src/base/checksum.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/compressed_open.hpp"
#include "runtime/src/pack/number_checks.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/pack/polynomial_open.hpp"
#include "runtime/src/pack/surface_bvh.hpp"
#include "runtime/src/pack/table_check.hpp"
#include "runtime/src/pack/zone_open.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

static_assert(sizeof(pal_pack) <= PAL_PACK_STORAGE_BYTES);

// Whether all indices are below `limit`, and strictly ascending if `rising`.
bool indices_valid(const uint32_t* indices, size_t count, uint32_t limit, bool rising) {
  for (size_t i = 0; i < count; ++i) {
    if (indices[i] >= limit) return false;
    if (rising && i > 0 && indices[i] <= indices[i - 1]) return false;
  }
  return true;
}

bool read_geometry(const pack::Geometry& geometry, uint64_t first_offset, pal_pack& pack) {
  pack.num_nodes = geometry.num_nodes();
  pack.num_triangles = geometry.num_triangles();
  pack.mean_surface_edge = geometry.mean_surface_edge();
  pack.labels = array_of<int32_t>(pack, geometry.labels(), first_offset, pack.num_nodes);
  pack.positions = array_of<double>(pack, geometry.positions(), first_offset, uint64_t{3} * pack.num_nodes);
  pack.rest_positions = pack.positions;
  pack.triangles =
      array_of<uint32_t>(pack, geometry.triangles(), first_offset, uint64_t{3} * pack.num_triangles);
  if (pack.num_nodes == 0 || pack.num_nodes > kMostNodes || pack.labels == nullptr ||
      pack.positions == nullptr || pack.triangles == nullptr)
    return false;
  for (uint32_t i = 1; i < pack.num_nodes; ++i) {
    if (pack.labels[i] <= pack.labels[i - 1]) return false;
  }
  return is_scale(pack.mean_surface_edge) &&
         all_within(pack.positions, size_t{3} * pack.num_nodes, kLargestScale) &&
         indices_valid(pack.triangles, size_t{3} * pack.num_triangles, pack.num_nodes, false);
}

// Whether a vector has unit length; `rounding` bounds the error of the squared length.
template <typename Real>
bool are_unit_vectors(const Real* vectors, size_t count, Real rounding) {
  bool are = true;
  for (const Real* v = vectors; v != vectors + 3 * count; v += 3) {
    const Real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    are = are && square >= 1 - rounding && square <= 1 + rounding;
  }
  return are;
}

bool read_sites(const pack::ContactSites& sites, uint64_t first_offset, pal_pack& pack) {
  pack.num_contact_nodes = sites.num_contact_nodes();
  pack.num_sites = sites.num_sites();
  pack.max_contacts = sites.max_contacts();
  pack.tip_radius = sites.tip_radius();
  pack.max_displacement = sites.max_displacement();
  if (pack.num_sites == 0 || pack.num_contact_nodes == 0 || pack.max_contacts < 1 ||
      pack.max_contacts > pack::kMostContacts ||
      !(pack.tip_radius >= 0 && pack.tip_radius <= kLargestScale) || !is_scale(pack.max_displacement) ||
      !is_scale(pack.max_displacement * pack.metres)) {
    return false;
  }
  pack.contact_nodes = array_of<uint32_t>(pack, sites.contact_nodes(), first_offset, pack.num_contact_nodes);
  pack.site_nodes = array_of<uint32_t>(pack, sites.site_nodes(), first_offset, pack.num_sites);
  pack.patch_starts =
      array_of<uint32_t>(pack, sites.patch_starts(), first_offset, uint64_t{pack.num_sites} + 1);
  if (pack.contact_nodes == nullptr || pack.site_nodes == nullptr || pack.patch_starts == nullptr)
    return false;
  if (!indices_valid(pack.contact_nodes, pack.num_contact_nodes, pack.num_nodes, true)) return false;
  if (!indices_valid(pack.site_nodes, pack.num_sites, pack.num_nodes, true)) return false;
  if (pack.patch_starts[0] != 0) return false;
  pack.max_patch_nodes = 0;
  for (uint32_t site = 0; site < pack.num_sites; ++site) {
    if (pack.patch_starts[site + 1] <= pack.patch_starts[site]) return false;
    const uint32_t size = pack.patch_starts[site + 1] - pack.patch_starts[site];
    if (size > pack.num_contact_nodes) return false;
    if (size > pack.max_patch_nodes) pack.max_patch_nodes = size;
  }
  pack.patch_nodes =
      array_of<uint32_t>(pack, sites.patch_nodes(), first_offset, pack.patch_starts[pack.num_sites]);
  if (pack.patch_nodes == nullptr) return false;
  for (uint32_t site = 0; site < pack.num_sites; ++site) {
    const uint32_t start = pack.patch_starts[site];
    if (!indices_valid(pack.patch_nodes + start, pack.patch_starts[site + 1] - start, pack.num_contact_nodes,
                       true))
      return false;
  }
  if (sites.inward_normals() == nullptr) return true;
  pack.inward_normals =
      array_of<double>(pack, sites.inward_normals(), first_offset, uint64_t{3} * pack.num_sites);
  return pack.inward_normals != nullptr && are_unit_vectors(pack.inward_normals, pack.num_sites, 1e-9);
}

// A symmetric positive definite compliance has a_ij^2 <= a_ii a_jj for every pair. contact_stiffness.cpp
// finds an inverse for any matrix that passes this check.
bool is_compliance(const double* blocks, uint64_t num_nodes) {
  constexpr double kRounding = 1e-9;
  const auto diagonal = [&](uint64_t node, uint64_t axis) {
    return blocks[9 * pack::lower_block(node, node) + 4 * axis];
  };
  bool is = true;
  for (uint64_t i = 0; i < num_nodes; ++i) {
    const double* block = blocks + 9 * pack::lower_block(i, 0);
    for (uint64_t j = 0; j <= i; ++j, block += 9) {
      for (uint64_t a = 0; a < 3; ++a) {
        for (uint64_t b = 0; b < 3; ++b) {
          const double entry = block[3 * a + b];
          const double bound = diagonal(i, a) * diagonal(j, b) * (1.0 + kRounding);
          is = is && entry * entry <= bound && (i != j || entry == block[3 * b + a]);
        }
      }
    }
    if (!is) return false;
  }
  return true;
}

// Needs the compliance.
bool read_site_forces(const pack::Segment* segment, uint64_t first_offset, bool trusted, pal_pack& pack) {
  const uint32_t num_entries = pack.patch_starts[pack.num_sites];
  pack.site_forces = array_of<double>(pack, segment, first_offset, uint64_t{9} * num_entries);
  if (pack.site_forces == nullptr) return false;
  for (uint32_t entry = 0; entry < num_entries && !trusted; ++entry) {
    const uint32_t node = pack.patch_nodes[entry];
    double own[9];
    contact_compliance(pack, node, node, own);
    for (uint32_t row = 0; row < 3; ++row) {
      if (!all_within(pack.site_forces + size_t{9} * entry + size_t{3} * row, 3,
                      kLargestNodalForce / own[4 * row]))
        return false;
    }
  }
  return true;
}

bool read_compliance(const pack::LinearDd& linear, uint64_t first_offset, bool trusted, pal_pack& pack) {
  if (linear.compressed() != nullptr) {
    return linear.contact_compliance() == nullptr && linear.field_compliance() == nullptr &&
           read_compressed(*linear.compressed(), first_offset, trusted, pack);
  }
  const uint64_t num_contact_nodes = pack.num_contact_nodes;
  const uint64_t column = uint64_t{pack::num_panels(pack.num_nodes)} * 3 * pack::kPanelRows;
  pack.contact_compliance = array_of<double>(pack, linear.contact_compliance(), first_offset,
                                             9 * pack::lower_block(num_contact_nodes, 0));
  pack.field_compliance =
      array_of<pal_real>(pack, linear.field_compliance(), first_offset, num_contact_nodes * column);
  if (pack.contact_compliance == nullptr || pack.field_compliance == nullptr) return false;
  if (trusted) return true;
  for (uint64_t node = 0; node < num_contact_nodes; ++node) {
    const double* block = pack.contact_compliance + 9 * pack::lower_block(node, node);
    double largest = 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double diagonal = block[4 * axis];
      if (!is_own_compliance(pack, diagonal)) return false;
      if (diagonal > largest) largest = diagonal;
    }
    if (!all_within(pack.field_compliance + node * column, column,
                    static_cast<pal_real>(kLargestAmplification * largest)))
      return false;
  }
  return is_compliance(pack.contact_compliance, num_contact_nodes);
}

bool read_linear(const pack::LinearDd& linear, uint64_t first_offset, bool trusted, pal_pack& pack) {
  return read_compliance(linear, first_offset, trusted, pack) &&
         read_site_forces(linear.site_forces(), first_offset, trusted, pack);
}

bool read_surface_bvh(const pack::SurfaceBvh& surface, uint64_t first_offset, pal_pack& pack) {
  pack.num_primitives = surface.num_primitives();
  pack.num_bvh_nodes = surface.num_nodes();
  const uint64_t corners = uint64_t{3} * pack.num_primitives;
  pack.primitives = array_of<uint32_t>(pack, surface.primitives(), first_offset, corners);
  pack.bvh_nodes = array_of<pack::BvhNode>(pack, surface.nodes(), first_offset, pack.num_bvh_nodes);
  pack.primitive_normals = array_of<float>(pack, surface.primitive_normals(), first_offset, 4 * corners);
  pack.site_normals =
      array_of<float>(pack, surface.site_normals(), first_offset, uint64_t{3} * pack.num_sites);
  if (pack.primitives == nullptr || pack.bvh_nodes == nullptr || pack.primitive_normals == nullptr ||
      pack.site_normals == nullptr || pack.num_bvh_nodes == 0) {
    return false;
  }
  constexpr float kNormalRounding = 1e-5f;
  // The bound of boxes, which the builder rounds outward from positions within kLargestScale.
  constexpr auto kLargestBound = static_cast<float>(1.001 * kLargestScale);
  const pack::BvhNode& root = pack.bvh_nodes[0];
  return all_within(root.min, 3, kLargestBound) && all_within(root.max, 3, kLargestBound) &&
         indices_valid(pack.primitives, corners, pack.num_sites, false) &&
         are_unit_vectors(pack.primitive_normals, size_t{4} * pack.num_primitives, kNormalRounding) &&
         are_unit_vectors(pack.site_normals, pack.num_sites, kNormalRounding) && is_surface_tree(pack);
}

bool read_gravity(const pack::Gravity& gravity, uint64_t first_offset, bool trusted, pal_pack& pack) {
  const uint64_t dofs = uint64_t{3} * pack.num_nodes;
  const double* acceleration = array_of<double>(pack, gravity.acceleration(), first_offset, 3);
  pack.rest_positions = array_of<double>(pack, gravity.rest_positions(), first_offset, dofs);
  if (acceleration == nullptr || pack.rest_positions == nullptr) return false;
  if (!all_within(acceleration, 3, kLargestScale) || !all_within(pack.rest_positions, dofs, kLargestScale))
    return false;
  pack.has_gravity = true;
  memcpy(pack.acceleration, acceleration, sizeof pack.acceleration);
  const double square = acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1] +
                        acceleration[2] * acceleration[2];
  if (!is_scale(sqrt(square))) return false;
  if (gravity.field_per_gravity() == nullptr && gravity.contact_per_gravity() == nullptr) return true;
  const uint64_t rows = uint64_t{pack::num_panels(pack.num_nodes)} * pack::kPanelRows;
  const uint64_t contacts = uint64_t{9} * pack.num_contact_nodes;
  pack.field_per_gravity = array_of<pal_real>(pack, gravity.field_per_gravity(), first_offset, 3 * rows);
  pack.contact_per_gravity = array_of<double>(pack, gravity.contact_per_gravity(), first_offset, contacts);
  if (pack.field_per_gravity == nullptr || pack.contact_per_gravity == nullptr) return false;
  // The limit keeps nodes within kLargestScale under the largest gravity of a session.
  const double limit = kLargestScale / sqrt(square);
  return trusted || (all_within(pack.field_per_gravity, 3 * rows, static_cast<pal_real>(limit)) &&
                     all_within(pack.contact_per_gravity, contacts, limit));
}

// Frames do not read the input files, but a pack must be complete.
bool are_inputs_inside(const pack::Pack& tables, uint64_t first_offset, const pal_pack& pack) {
  for (const pack::InputFile* input : *tables.inputs()) {
    const pack::Segment* contents = input->contents();
    if (contents != nullptr && array_of<char>(pack, contents, first_offset, contents->bytes()) == nullptr)
      return false;
  }
  return true;
}

bool is_error(double value) {
  return value >= 0 && value <= kLargestEnergy;
}

bool is_growth(double value) {
  return value >= 0 && value <= 1;
}

bool read_surveys(const pack::Pack& tables, pal_pack& pack) {
  for (const pack::ErrorSurvey* survey : *tables.surveys()) {
    const auto model = static_cast<uint32_t>(survey->model());
    if (model >= kNumModels) continue;  // a later builder's model, unknown here
    if (survey->bins()->size() == 0 || survey->bins()->size() > pack::kSurveyBins) return false;
    SurveyView& view = pack.surveys[model];
    if (view.num_bins != 0) return false;  // a pack has one survey a model
    double from = 0;
    for (const pack::ErrorBin* bin : *survey->bins()) {
      if (!(bin->from() == from) || !(bin->to() > from && bin->to() <= kLargestScale) ||
          !is_error(bin->displacement_bound()) || !is_error(bin->force_bound()) ||
          !is_growth(bin->displacement_growth()) || !is_growth(bin->force_growth())) {
        return false;
      }
      if (bin->samples() == 0 && !(bin->displacement_bound() >= 1 && bin->force_bound() >= 1 &&
                                   bin->displacement_growth() == 0 && bin->force_growth() == 0))
        return false;
      const double width = bin->to() - from;
      const ErrorBinView of = {bin->to(), bin->displacement_bound(),
                               bin->displacement_bound() * bin->displacement_growth() / width,
                               bin->force_bound(), bin->force_bound() * bin->force_growth() / width};
      if (!isfinite(of.displacement_slope) || !isfinite(of.force_slope)) return false;
      view.bins[view.num_bins++] = of;
      from = bin->to();
    }
    view.most_contacts = survey->most_contacts();
    view.set_displacement_bound = survey->set_displacement_bound();
    view.set_force_bound = survey->set_force_bound();
    view.set_displacement_reach_bound = survey->set_displacement_reach_bound();
    view.set_force_reach_bound = survey->set_force_reach_bound();
    view.force_scale = static_cast<float>(survey->force_scale());
    if (!(view.force_scale >= 0 && isfinite(view.force_scale))) return false;
    if (from != 1.0 || !is_error(view.set_displacement_bound) || !is_error(view.set_force_bound) ||
        !is_error(view.set_displacement_reach_bound) || !is_error(view.set_force_reach_bound))
      return false;
  }
  return true;
}

// `trusted`: PAL_VERIFY_NEVER.
pal_status check(const unsigned char* bytes, size_t num_bytes, bool trusted, pal_pack& pack) {
  pack::PackHeader header;
  if (num_bytes < sizeof header) return PAL_STATUS_NOT_A_PACK;
  memcpy(&header, bytes, sizeof header);
  if (memcmp(header.magic, pack::kMagic, sizeof header.magic) != 0) return PAL_STATUS_NOT_A_PACK;
  if (header.format_version != pack::kFormatVersion || header.header_bytes != sizeof header)
    return PAL_STATUS_WRONG_VERSION;
  if (header.file_bytes != num_bytes) return PAL_STATUS_TRUNCATED;
  if (header.tables_offset != sizeof header || header.tables_bytes > num_bytes - sizeof header)
    return PAL_STATUS_CORRUPT_TABLES;

  const unsigned char* tables_bytes = bytes + header.tables_offset;
  if (!are_sound_tables(tables_bytes, header.tables_bytes)) return PAL_STATUS_CORRUPT_TABLES;

  const pack::Pack& tables = *pack::GetPack(tables_bytes);
  if (tables.real_bytes() != sizeof(float) && tables.real_bytes() != sizeof(double))
    return PAL_STATUS_CORRUPT_CONTENT;
  if (tables.real_bytes() != sizeof(pal_real)) return PAL_STATUS_OTHER_PRECISION;
  pack = {};
  pack.bytes = bytes;
  pack.num_bytes = num_bytes;
  const uint64_t first_offset = pack::round_up(header.tables_offset + header.tables_bytes, pack::kAlignment);
  pack.metres = 1;
  pack.newtons = 1;
  if (tables.units() != nullptr) {
    pack.has_units = true;
    pack.metres = tables.units()->metres();
    pack.newtons = tables.units()->newtons();
    if (!is_scale(pack.metres) || !is_scale(pack.newtons)) return PAL_STATUS_CORRUPT_CONTENT;
  }
  if (!are_inputs_inside(tables, first_offset, pack) ||
      !read_geometry(*tables.geometry(), first_offset, pack) ||
      !read_sites(*tables.sites(), first_offset, pack)) {
    return PAL_STATUS_CORRUPT_CONTENT;
  }
  if (tables.linear_dd() != nullptr && !read_linear(*tables.linear_dd(), first_offset, trusted, pack))
    return PAL_STATUS_CORRUPT_CONTENT;
  if (tables.polynomial_dd() != nullptr &&
      !read_polynomial(*tables.polynomial_dd(), first_offset, trusted, pack)) {
    return PAL_STATUS_CORRUPT_CONTENT;
  }
  if (tables.nonlinear_zone() != nullptr &&
      !read_zone(*tables.nonlinear_zone(), first_offset, trusted, pack)) {
    return PAL_STATUS_CORRUPT_CONTENT;
  }
  if (tables.gravity() != nullptr && !read_gravity(*tables.gravity(), first_offset, trusted, pack))
    return PAL_STATUS_CORRUPT_CONTENT;
  if (tables.surface_bvh() != nullptr && !read_surface_bvh(*tables.surface_bvh(), first_offset, pack))
    return PAL_STATUS_CORRUPT_CONTENT;
  if (pack.field_compliance == nullptr &&
      (pack.polynomial_sites == nullptr || pack.contact_per_gravity != nullptr))
    return PAL_STATUS_CORRUPT_CONTENT;
  if (!read_surveys(tables, pack)) return PAL_STATUS_CORRUPT_CONTENT;

  if (!trusted && checksum_of_file(bytes, num_bytes) != header.checksum) return PAL_STATUS_BAD_CHECKSUM;
  return PAL_STATUS_OK;
}

pal_status check_arguments(pal_verify verify, const void* storage, size_t storage_bytes) {
  int value;  // a C program may pass any integer
  static_assert(sizeof value == sizeof verify);
  memcpy(&value, &verify, sizeof value);
  if (value != PAL_VERIFY_ONCE && value != PAL_VERIFY_NEVER) return PAL_STATUS_BAD_ARGUMENT;
  // Callers must not depend on this version's smaller sizeof(pal_pack).
  if (storage_bytes < PAL_PACK_STORAGE_BYTES) return PAL_STATUS_ARENA_TOO_SMALL;
  if (reinterpret_cast<uintptr_t>(storage) % 16 != 0) return PAL_STATUS_ARENA_MISALIGNED;
  return PAL_STATUS_OK;
}

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_pack_open_memory(const void* bytes, size_t num_bytes, pal_verify verify,
                                           void* storage, size_t storage_bytes, pal_pack** pack) noexcept {
  if (bytes == nullptr || storage == nullptr || pack == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (const pal_status status = palpate::check_arguments(verify, storage, storage_bytes);
      status != PAL_STATUS_OK)
    return status;
  if (reinterpret_cast<uintptr_t>(bytes) % palpate::pack::kAlignment != 0) return PAL_STATUS_ARENA_MISALIGNED;
  pal_pack opened = {};
  const pal_status status =
      palpate::check(static_cast<const unsigned char*>(bytes), num_bytes, verify == PAL_VERIFY_NEVER, opened);
  if (status != PAL_STATUS_OK) return status;
  memcpy(storage, &opened, sizeof opened);
  *pack = static_cast<pal_pack*>(storage);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_pack_open(const char* path, pal_verify verify, void* storage, size_t storage_bytes,
                                    pal_pack** pack) noexcept {
  if (path == nullptr || storage == nullptr || pack == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (const pal_status status = palpate::check_arguments(verify, storage, storage_bytes);
      status != PAL_STATUS_OK)
    return status;
  // O_NONBLOCK: without this flag open() would wait for the writer of a pipe.
  const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return errno == ENOENT ? PAL_STATUS_FILE_NOT_FOUND : PAL_STATUS_FILE_NOT_READABLE;
  struct stat description;
  if (fstat(file, &description) != 0 || !S_ISREG(description.st_mode)) {
    close(file);
    return PAL_STATUS_FILE_NOT_READABLE;
  }
  const auto num_bytes = static_cast<size_t>(description.st_size);
  if (num_bytes == 0) {
    close(file);
    return PAL_STATUS_NOT_A_PACK;
  }
  void* bytes = mmap(nullptr, num_bytes, PROT_READ, MAP_SHARED, file, 0);
  close(file);
  if (bytes == MAP_FAILED) return PAL_STATUS_FILE_NOT_READABLE;
  const pal_status status = pal_pack_open_memory(bytes, num_bytes, verify, storage, storage_bytes, pack);
  if (status != PAL_STATUS_OK) {
    munmap(bytes, num_bytes);
    return status;
  }
  (*pack)->mapped = true;
  return PAL_STATUS_OK;
}

extern "C" void pal_pack_close(pal_pack* pack) noexcept {
  if (pack == nullptr || pack->bytes == nullptr) return;
  if (pack->mapped) munmap(const_cast<unsigned char*>(pack->bytes), pack->num_bytes);
  pack->bytes = nullptr;
}
