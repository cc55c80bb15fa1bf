// Parameters of the constitutive laws; moduli in force unit / length unit^2. Each law has its own header with
// energy, first Piola-Kirchhoff stress and consistent tangent. constitutive_response.hpp selects the law.
#pragma once

#include <array>
#include <variant>
#include <vector>

namespace palpate {

// Zhong et al. 2005 eq. (1). *HYPERELASTIC, COMPRESSIBLE NEO HOOKE.
struct CompressibleNeoHookean {
  double mu = 0;
  double lambda = 0;
};

// Volumetric energy of Abaqus' hyperelastic laws: U(J) = sum over i of (J - 1)^(2 i) / D_i, i = 1 .. 3.
struct VolumetricEnergy {
  std::array<double, 3> inverse_d = {};  // 1 / D_i; 0 omits a term
};

// NEO HOOKE (C10), MOONEY-RIVLIN (C10, C01) and YEOH (C10, C20, C30) of *HYPERELASTIC; see invariant_law.hpp.
struct InvariantLaw {
  double c10 = 0;
  double c01 = 0;
  double c20 = 0;
  double c30 = 0;
  VolumetricEnergy volumetric;
};

// *HYPERELASTIC, OGDEN, N = 1 .. 3; see ogden.hpp.
struct Ogden {
  struct Term {
    double mu = 0;
    double alpha = 0;  // not 0
  };
  std::vector<Term> terms;
  VolumetricEnergy volumetric;
};

// *ELASTIC without NLGEOM: Hooke's law for small strain, linear in the displacement; see elastic.hpp.
struct LinearElastic {
  double mu = 0;
  double lambda = 0;
};

// *ELASTIC with NLGEOM: Hooke's law between second Piola-Kirchhoff stress and Green strain; see elastic.hpp.
struct StVenantKirchhoff {
  double mu = 0;
  double lambda = 0;
};

using Law = std::variant<CompressibleNeoHookean, InvariantLaw, Ogden, LinearElastic, StVenantKirchhoff>;

// Moduli of Hooke's law with the same tangent at F = 1, in force unit / length unit^2.
struct SmallStrainModuli {
  double shear = 0;
  double bulk = 0;
  double poisson_ratio() const { return (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)); }
};

SmallStrainModuli small_strain_moduli(const Law& law);

}  // namespace palpate
