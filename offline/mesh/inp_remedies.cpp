#include "offline/mesh/inp_remedies.hpp"

#include <array>
#include <vector>

#include "offline/mesh/nearest_name.hpp"

namespace palpate {
namespace {

struct Remedy {
  const char* keyword;    // normalised
  const char* parameter;  // normalised; "" for the keyword itself
  const char* text;
};

constexpr const char* kSolidsOnly =
    "its elements carry load, and Palpate solves tetrahedra alone; mesh that part of the body with "
    "tetrahedra";
constexpr const char* kStaticOnly = "Palpate finds equilibria, without inertia and rates; write *STATIC";
constexpr const char* kJoinsNodes =
    "it ties displacements of nodes, which move freely without it; join the bodies by common nodes, or "
    "prescribe "
    "the displacements with *BOUNDARY";
constexpr const char* kRigid =
    "without it the body is soft there; prescribe the motion of its nodes with *BOUNDARY";
constexpr const char* kContact =
    "without it bodies pass through each other; join them by common nodes, or prescribe their displacements";
constexpr const char* kHeat = "Palpate knows no temperatures; write the load as forces or displacements";
constexpr const char* kOtherLaw =
    "without it the material answers differently; write *HYPERELASTIC or *ELASTIC with moduli for the "
    "strains and "
    "rates of the load";
constexpr const char* kLines = "put these lines into the file, or name their file with *INCLUDE";

constexpr std::array kRemedies = {
    // Ties between nodes.
    Remedy{"EQUATION", "", kJoinsNodes},
    Remedy{"MPC", "", kJoinsNodes},
    Remedy{"EMBEDDEDELEMENT", "", kJoinsNodes},
    Remedy{"COUPLING", "", kRigid},
    Remedy{"KINEMATIC", "", kRigid},
    Remedy{"DISTRIBUTING", "", "it spreads a load over a surface; write the load with *DSLOAD or *CLOAD"},
    Remedy{"DISTRIBUTINGCOUPLING", "",
           "it spreads a load over a surface; write the load with *DSLOAD or *CLOAD"},
    Remedy{"KINEMATICCOUPLING", "", kRigid},
    Remedy{"RIGIDBODY", "", kRigid},
    Remedy{"PRE-TENSIONSECTION", "", "without it the body has no pretension; write the load with *DSLOAD"},
    // Axes.
    Remedy{"TRANSFORM", "",
           "it turns the axes of *BOUNDARY and *CLOAD, which act along x, y, z without it; write their "
           "components "
           "along x, y, z"},
    Remedy{"SYSTEM", "",
           "it moves or turns the coordinates of *NODE; write the coordinates x, y, z themselves"},
    // Materials.
    Remedy{"EXPANSION", "", kHeat},
    Remedy{"VISCOELASTIC", "", kOtherLaw},
    Remedy{"PLASTIC", "", kOtherLaw},
    Remedy{"HYPERFOAM", "", kOtherLaw},
    Remedy{"ANISOTROPICHYPERELASTIC", "", kOtherLaw},
    Remedy{"USERMATERIAL", "", kOtherLaw},
    Remedy{"CREEP", "", kOtherLaw},
    Remedy{"MULLINSEFFECT", "", kOtherLaw},
    Remedy{"HYSTERESIS", "", kOtherLaw},
    Remedy{"POROUSELASTIC", "", kOtherLaw},
    Remedy{"HYPOELASTIC", "", kOtherLaw},
    Remedy{"DAMPING", "", kStaticOnly},
    // Elements that are no solids.
    Remedy{"SHELLSECTION", "", kSolidsOnly},
    Remedy{"SHELLGENERALSECTION", "", kSolidsOnly},
    Remedy{"MEMBRANESECTION", "", kSolidsOnly},
    Remedy{"SURFACESECTION", "", kSolidsOnly},
    Remedy{"BEAMSECTION", "", kSolidsOnly},
    Remedy{"BEAMGENERALSECTION", "", kSolidsOnly},
    Remedy{"SPRING", "", kSolidsOnly},
    Remedy{"DASHPOT", "", kSolidsOnly},
    Remedy{"MASS", "", "Palpate finds equilibria; write the weight of the mass with *CLOAD"},
    // Contact.
    Remedy{"CONTACT", "", kContact},
    Remedy{"CONTACTPAIR", "", kContact},
    Remedy{"SURFACEINTERACTION", "", kContact},
    Remedy{"SURFACEBEHAVIOR", "", kContact},
    Remedy{"FRICTION", "", kContact},
    // Procedures and loads.
    Remedy{"DYNAMIC", "", "write *STATIC"},
    Remedy{"VISCO", "", kStaticOnly},
    Remedy{"FREQUENCY", "", kStaticOnly},
    Remedy{"BUCKLE", "", "write *STATIC, RIKS, which follows the path through the buckling load"},
    Remedy{"HEATTRANSFER", "", kHeat},
    Remedy{"COUPLEDTEMPERATURE-DISPLACEMENT", "", kHeat},
    Remedy{"UNCOUPLEDTEMPERATURE-DISPLACEMENT", "", kHeat},
    Remedy{"TEMPERATURE", "", kHeat},
    Remedy{"CFLUX", "", kHeat},
    Remedy{"DFLUX", "", kHeat},
    Remedy{"FILM", "", kHeat},
    Remedy{"RADIATE", "", kHeat},
    Remedy{"MODELCHANGE", "",
           "it takes elements out or puts them in; write a file for each state of the body"},
    Remedy{"IMPERFECTION", "", "it moves the nodes at rest; write the moved coordinates in *NODE"},
    Remedy{"NCOPY", "", "it makes nodes by moving others; write the nodes themselves"},
    Remedy{"NGEN", "", "it makes nodes between others; write the nodes themselves"},
    Remedy{"NFILL", "", "it makes nodes between others; write the nodes themselves"},
    Remedy{"ELGEN", "", "it makes elements from one; write the elements themselves"},
    Remedy{"ELCOPY", "", "it makes elements from others; write the elements themselves"},
    Remedy{"PARAMETER", "", "it computes values that follow; write the values themselves"},
    // Parameters.
    Remedy{"NODE", "SYSTEM",
           "cylindrical or spherical coordinates would be read as x, y, z; write the coordinates x, y, z"},
    Remedy{"NODE", "INPUT", kLines},
    Remedy{"ELEMENT", "INPUT", kLines},
    Remedy{"SURFACE", "COMBINE", "name the faces of the surface"},
    Remedy{"CLOAD", "FOLLOWER",
           "a force that turns with the body differs from one that does not; load its surface with *DSLOAD"},
    Remedy{"STEP", "PERTURBATION",
           "it asks for a linear answer about the state so far; write *STEP without NLGEOM in a file of its "
           "own"},
    Remedy{"BOUNDARY", "TYPE",
           "a velocity or acceleration would be read as a displacement; write the displacement at the step's "
           "end"},
    Remedy{"BOUNDARY", "SUBMODEL", "its values come from another run; write the displacements themselves"},
    Remedy{"BOUNDARY", "USER", "its values come from a program; write the displacements themselves"},
};

// The phrase where nobody knows whether the result changes.
constexpr const char* kUnknown = "; remove it only where the result stays the same without it";

const Remedy* find_remedy(std::string_view keyword, std::string_view parameter) {
  for (const Remedy& remedy : kRemedies) {
    if (remedy.keyword == keyword && remedy.parameter == parameter) return &remedy;
  }
  return nullptr;
}

}  // namespace

std::string keyword_remedy(const KeywordLine& keyword, std::span<const std::string> known) {
  if (const Remedy* remedy = find_remedy(keyword.name, "")) return std::string("; ") + remedy->text;
  return did_you_mean(keyword.shown, {known.begin(), known.end()}, kUnknown);
}

std::string parameter_remedy(const KeywordLine& keyword, const Parameter& parameter,
                             std::span<const std::string_view> known) {
  if (const Remedy* remedy = find_remedy(keyword.name, parameter.name))
    return std::string("; ") + remedy->text;
  return did_you_mean(parameter.name, {known.begin(), known.end()}, kUnknown);
}

}  // namespace palpate
