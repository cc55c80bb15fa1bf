// The tissue, supports and scene that `palpate new` writes for a mesh, and that `palpate check` judges it by.
#pragma once

#include <string>
#include <vector>

#include "offline/cli/organ_file.hpp"
#include "offline/io/organ_check.hpp"
#include "offline/io/tissue_table.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

inline constexpr const char* kFixedSet = "FIXED";
inline constexpr const char* kProbeSet = "PROBE";

// A length unit, the force unit for which moduli come out in numbers of ordinary size, and the pressure
// unit of both.
struct Units {
  const char* length;
  const char* force;
  const char* pressure;
  double kilopascal;  // in the pressure unit
  double centimetre;  // in the length unit
};
inline constexpr std::array kUnits = {Units{"mm", "mN", "kPa", 1.0, 10}, Units{"cm", "N", "N/cm^2", 0.1, 1},
                                      Units{"m", "N", "Pa", 1000.0, 0.01}};

const Units& units_of(const std::string& length);
const Tissue& tissue_of(const std::string& name);

// Gives every element a material, four-node elements shared volumes, and the model an element set for each of
// several materials. Arrays of the file precede the tissue.
void set_tissue(OrganFile& organ, const Tissue& tissue, const Units& units);

// Where an organ is held.
struct HeldPlace {
  std::vector<int> nodes;   // sorted
  int guessed_percent = 0;  // of the extent along z, from below; 0: no guess
};

// The place, or node set FIXED where `place` is empty, or a guess: the lowest tenth, or more until that
// holds the organ.
HeldPlace find_held_place(const Model& model, const std::string& place);

// All axes of the nodes, sorted.
std::vector<PrescribedDisplacement> held_dofs(const std::vector<int>& nodes);

// The free surface nodes among `nodes`, sorted as these.
std::vector<int> touchable_nodes(const Model& model, const std::vector<int>& nodes);

// The free surface nodes of --probe. Throws std::runtime_error where there are none.
std::vector<int> probed_nodes(const Model& model, const std::string& place);

// Appends a line with the remedy for each part of `check` that is not held, and kNothingHeld for a model with
// laws that nothing holds: a build refuses them.
void add_loose_parts(const OrganFile& organ, const OrganCheck& check, std::vector<std::string>& faults);

// Returns a warning where no soft tissue is as stiff as the array E of the file says in the unit's pressure;
// else empty.
std::string moduli_warning(const OrganFile& organ, const Units& units);

inline constexpr const char* kNothingHeld =
    "has laws, and nothing is held; hold a part of it with *BOUNDARY before the first *STEP";

inline constexpr const char* kNothingFree =
    "every node of the surface is held, so that no tool can touch it; hold fewer with --fix";

// The scene that `palpate new` writes, in memory. `sites`: empty: every free surface node, of which there may
// be none.
Scene default_scene(const Model& model, std::vector<int> sites);

}  // namespace palpate
