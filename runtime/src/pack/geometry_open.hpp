// Opens a pack's geometry, contact sites and surface_bvh.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// Each function sets its part of `view`. False if an array is missing or misplaced, or has invalid content.
// Arrays lie at `first_offset` or later: the first aligned byte behind the tables.

bool read_geometry(const pack::Geometry& geometry, uint64_t first_offset, pal_pack& view);

// Needs the geometry and the units.
bool read_sites(const pack::ContactSites& sites, uint64_t first_offset, pal_pack& view);

// Needs the contact sites.
bool read_surface_bvh(const pack::SurfaceBvh& surface, uint64_t first_offset, pal_pack& view);

}  // namespace palpate
