// The scene that a pack was made from, read from the files that it carries: what it takes to solve the same organ
// again.
#pragma once

#include "offline/fem/assembly.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

// Throws std::runtime_error "PATH: REASON; REMEDY" where the pack carries no such files, or not what it was made from.
// Paths that lead out of their folders, as absolute ones do, find what lies there today, or nothing.
LoadedScene read_carried_scene(const OpenedPack& opened, const std::filesystem::path& pack);

// An organ to be solved. Stays where it is made: its assembly refers to its model.
struct Organ {
  Scene scene;
  Model model;
  ContactSites sites;
  Assembly assembly;
  RestState rest;

  // Throws std::runtime_error where no equilibrium is found at rest.
  explicit Organ(LoadedScene loaded);
  Organ(const Organ&) = delete;
  Organ& operator=(const Organ&) = delete;
};

// Throws std::runtime_error "PACK: REASON; REMEDY" where the pack's sites are not the organ's.
void check_same_sites(const OpenedPack& opened, const Organ& organ, const std::filesystem::path& pack);

}  // namespace palpate
