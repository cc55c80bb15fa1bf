// Opens a pack: maps the file, then checks everything once, so that frames need no checks.
//
// Each step makes the next step's reads safe:
// - header,
// - FlatBuffers verifier,
// - meaning: each segment has the size that the tables imply; indices and numbers are within bounds,
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
#include "runtime/src/pack/geometry_open.hpp"
#include "runtime/src/pack/linear_open.hpp"
#include "runtime/src/pack/number_checks.hpp"
#include "runtime/src/pack/organ_open.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/pack/polynomial_open.hpp"
#include "runtime/src/pack/table_check.hpp"
#include "runtime/src/pack/zone_open.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

static_assert(sizeof(pal_pack) <= PAL_PACK_STORAGE_BYTES);

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
  static_assert(kUnrefinedZone == static_cast<uint32_t>(pack::ResponseModel::unrefined_zone));
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
      const ErrorBinView bin_view = {bin->to(), bin->displacement_bound(),
                                     bin->displacement_bound() * bin->displacement_growth() / width,
                                     bin->force_bound(), bin->force_bound() * bin->force_growth() / width};
      if (!isfinite(bin_view.displacement_slope) || !isfinite(bin_view.force_slope)) return false;
      view.bins[view.num_bins++] = bin_view;
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
  if ((tables.nonlinear_zone() != nullptr) != (tables.organ() != nullptr)) return PAL_STATUS_CORRUPT_CONTENT;
  if (tables.nonlinear_zone() != nullptr && (!read_zone(*tables.nonlinear_zone(), first_offset, pack) ||
                                             !read_organ(*tables.organ(), first_offset, pack)))
    return PAL_STATUS_CORRUPT_CONTENT;
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
