// Moduli of soft tissues, from the sources in docs/tissues.md.
#pragma once

#include <array>
#include <string>

namespace palpate {

struct Tissue {
  const char* name;
  double shear_modulus;  // mu at small strain, kPa
};

// The rows of the table in docs/tissues.md, in its order. A test compares both.
inline constexpr std::array kTissues = {
    Tissue{"liver", 2.09},   Tissue{"brain", 3.07},       Tissue{"kidney", 4.9},
    Tissue{"spleen", 3.57},  Tissue{"pancreas", 1.14},    Tissue{"muscle", 1.00},
    Tissue{"fat", 0.75},     Tissue{"breast-fat", 1.85},  Tissue{"breast-gland", 2.95},
    Tissue{"prostate", 5.7}, Tissue{"thyroid", 1.3},      Tissue{"uterus", 2.71},
    Tissue{"tongue", 2.67},  Tissue{"soft-palate", 2.53},
};

// Poisson's ratio of the tissues: nearly incompressible.
inline constexpr double kTissueRatio = 0.49;

}  // namespace palpate
