// Packs with bytes changed on purpose, and the status of opening each.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "runtime/src/pack/surface_bvh.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/nightly.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test::mutated_pack_fixture {

// ---- Contradictions that a check of content must refuse.

// Status after `change` to the array in `segment`, with the checksum repaired.
template <typename T, typename Change>
pal_status status_with(const pack::Segment* segment, Change&& change,
                       const AlignedBytes& original = small_pack_bytes()) {
  AlignedBytes copy = copy_of(original.bytes());
  change(reinterpret_cast<T*>(copy.bytes().data() + segment->offset()));
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

class Contradiction : public ::testing::Test {
 protected:
  const pack::Pack& tables() const {
    return *pack::GetPack(small_pack_bytes().bytes().data() + sizeof(pack::PackHeader));
  }
  const SmallPack& small_ = small_pack();
};

// Address of a table's scalar. The format stores only scalars that differ from their default.
inline unsigned char* field_of_table(AlignedBytes& copy, flatbuffers::voffset_t table,
                                     flatbuffers::voffset_t field) {
  unsigned char* tables = copy.bytes().data() + header_of(copy.bytes()).tables_offset;
  unsigned char* place = flatbuffers::GetMutableRoot<flatbuffers::Table>(tables)
                             ->GetPointer<flatbuffers::Table*>(table)
                             ->GetAddressOf(field);
  if (place == nullptr) throw std::runtime_error("not in the tables");
  return place;
}

// Status with this scalar in a table, checksum repaired.
template <typename T>
pal_status status_with_scalar(flatbuffers::voffset_t table, flatbuffers::voffset_t field, T value,
                              const AlignedBytes& original) {
  AlignedBytes copy = copy_of(original.bytes());
  memcpy(field_of_table(copy, table, field), &value, sizeof value);
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

}  // namespace palpate::test::mutated_pack_fixture
