// Restores the scene of a pack from the files that the pack carries, to solve the same organ again.
#pragma once

#include "offline/fem/assembly.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

// Reads the carried files. Throws std::runtime_error "PATH: REASON; REMEDY", PATH = `pack`, where the files
// are absent, differ from the inputs of the pack, or name files outside the carried folder.
LoadedScene read_carried_scene(const OpenedPack& opened, const std::filesystem::path& pack);

// An organ with its solver data. Not movable: the assembly refers to the model.
struct Organ {
  Scene scene;
  Model model;
  ContactSites sites;
  Assembly assembly;
  RestState rest;

  // Throws std::runtime_error where the organ has no equilibrium at rest.
  explicit Organ(LoadedScene loaded);
  Organ(const Organ&) = delete;
  Organ& operator=(const Organ&) = delete;
};

// Throws std::runtime_error "PACK: REASON; REMEDY" where the pack's sites differ from the organ's sites.
void check_same_sites(const OpenedPack& opened, const Organ& organ, const std::filesystem::path& pack);

}  // namespace palpate
