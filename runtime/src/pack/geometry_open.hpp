// Opens a pack's geometry, contact sites and surface tree.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of the geometry. False if an array or a number is invalid, as in the functions below.
bool read_geometry(const pack::Geometry& geometry, uint64_t first_offset, pal_pack& pack);

// Needs the geometry.
bool read_sites(const pack::ContactSites& sites, uint64_t first_offset, pal_pack& pack);

// Needs the contact sites.
bool read_surface_bvh(const pack::SurfaceBvh& surface, uint64_t first_offset, pal_pack& pack);

}  // namespace palpate
