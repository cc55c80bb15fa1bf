// `palpate solve` with shared volumes under pressure and weight, compared with closed forms.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/nodal_csv.hpp"
#include "tests/support/pressurised_tube.hpp"
#include "tests/support/principal_stretch_laws.hpp"

namespace palpate::test {
namespace cli_pressure_test {

// NEO HOOKE with mu = 1.
constexpr double kPoisson = 0.499;
constexpr double bulk_of(double poisson) {
  return 2 * (1 + poisson) / (3 * (1 - 2 * poisson));
}
// All elements represent homogeneous states, so the error is the solver's force tolerance over mu. The
// pressure is about ten times mu.
constexpr double kClosedForm = 1e-7;

double root(const std::function<double(double)>& rising, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (rising(middle) < 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

class SharedVolumesUnderLoad : public ::testing::TestWithParam<Elements> {
 protected:
  static constexpr double kHeight = 0.75;

  static Model block() {
    BlockShape shape;
    shape.size = {1.0, 1.25, kHeight};
    return in_nodes_of(GetParam(), tetrahedral_block(shape));
  }
  static PrincipalStretchLaw law(double poisson = kPoisson) {
    return principal_polynomial("NeoHooke", neo_hooke_of(1, poisson));
  }

  // Mesh, material and section, and *BOUNDARY for the model's fixed dofs.
  static std::string text_of(const Model& model, double poisson = kPoisson) {
    std::string text = "*NODE, NSET=EVERY\n";
    for (int node = 0; node < model.num_nodes(); ++node) {
      const Eigen::Vector3d& at = model.positions[static_cast<size_t>(node)];
      text += fmt::format("{}, {:.17g}, {:.17g}, {:.17g}\n", node + 1, at.x(), at.y(), at.z());
    }
    const bool ten = GetParam() == Elements::c3d10h;
    text += fmt::format("*ELEMENT, TYPE={}, ELSET=BODY\n", ten ? "C3D10H" : "C3D4");
    for (size_t i = 0; i < model.elements.size(); ++i) {
      text += std::to_string(i + 1);
      for (const int node : model.elements[i].nodes()) text += ", " + std::to_string(node + 1);
      text += "\n";
    }
    text += fmt::format(
        "*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, NEO HOOKE\n0.5, {:.17g}\n*DENSITY\n2\n*SOLID SECTION, "
        "ELSET=BODY, MATERIAL=TISSUE{}\n*BOUNDARY\n",
        2 / bulk_of(poisson), ten ? "" : ", MEAN DILATATION");
    for (const PrescribedDisplacement& held : model.fixed)
      text += fmt::format("{}, {}, {}\n", held.node + 1, held.axis + 1, held.axis + 1);
    return text;
  }
  // Rollers on the planes x = 0, y = 0, z = 0.
  static Model on_rollers(Model model) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int node : nodes_on_plane(model, axis, 0.0)) model.fixed.push_back({node, axis, 0.0});
    }
    return model;
  }

  // Runs the text and reads its last step: u and f at every node.
  void solve(const std::string& text) {
    const TempDir dir;
    const std::filesystem::path folder = dir.path() / "results";
    run_ = run_program({"solve", dir.write("body.inp", text).string(), "-o", folder.string(), "--json"});
    ASSERT_EQ(run_.exit_code, 0) << run_.error;
    EXPECT_EQ(run_.error, "") << "elements that lock are warned of";
    EXPECT_GT(run_.json()["volume_patches"], 0);
    const std::vector<CsvRow> rows = read_csv(folder / "step1.csv");
    displacement_.resize(3 * static_cast<Eigen::Index>(rows.size()));
    force_.resize(displacement_.size());
    for (const CsvRow& row : rows) {
      displacement_.segment<3>(3 * (row.node - 1)) = Eigen::Vector3d(row.u.data());
      force_.segment<3>(3 * (row.node - 1)) = Eigen::Vector3d(row.f.data());
    }
  }
  void expect_stretches(const Model& model, const Eigen::Vector3d& stretches) const {
    const Eigen::VectorXd expected = affine_displacement(model, stretches.asDiagonal());
    EXPECT_LE((displacement_ - expected).cwiseAbs().maxCoeff(), kClosedForm * 1.25);
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.02) << "else this test shows nothing";
  }

  ProgramRun run_;
  Eigen::VectorXd displacement_;
  Eigen::VectorXd force_;
};

INSTANTIATE_TEST_SUITE_P(Elements, SharedVolumesUnderLoad,
                         ::testing::Values(Elements::c3d4_mean_dilatation, Elements::c3d10h),
                         [](const auto& one) {
                           return one.param == Elements::c3d10h ? "C3D10H" : "MeanDilatation";
                         });

// In a fluid a body keeps its shape, and W = mu/2 (I1bar - 3) + K/2 (J - 1)^2 gives -p = K (J - 1).
TEST_P(SharedVolumesUnderLoad, ABodyInAFluidShrinks) {
  const Model model = on_rollers(block());
  const double J = 0.9;
  const double pressure = bulk_of(kPoisson) * (1 - J);
  solve(text_of(model) + fmt::format("*SURFACE, NAME=SKIN\nBODY,\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nSKIN, P, "
                                     "{:.17g}\n*END STEP\n",
                                     pressure));
  const double stretch = std::cbrt(J);
  expect_stretches(model, {stretch, stretch, stretch});
}

// A plate on rollers and a pressure on the opposite face: sigma_33 = -p, no lateral stress.
TEST_P(SharedVolumesUnderLoad, APressureOnOneFaceCompresses) {
  const Model model = on_rollers(block());
  const double pressure = 0.6;
  const auto aside = [](double s) {
    return root([&](double a) { return law().stresses({a, a, s})[0]; }, 0.5, 2);
  };
  const double s = root(
      [&](double l) {
        const double a = aside(l);
        return law().stresses({a, a, l})[2] / (a * a) + pressure;
      },
      0.5, 1);
  std::string load = "*DLOAD\n";
  for (size_t element = 0; element < model.elements.size(); ++element) {
    for (int face = 0; face < 4; ++face) {
      const std::array<int, 6> nodes = outward_face(model.elements[element], face);
      if (std::all_of(nodes.begin(), nodes.begin() + 3,
                      [&](int node) { return model.positions[static_cast<size_t>(node)].z() == kHeight; }))
        load += fmt::format("{}, P{}, {:.17g}\n", element + 1, face + 1, pressure);
    }
  }
  solve(text_of(model) + "*STEP, NLGEOM\n*STATIC\n" + load + "*END STEP\n");
  expect_stretches(model, {aside(s), aside(s), s});
  double bearing = 0;
  for (const int node : nodes_on_plane(model, 2, 0.0)) bearing += force_[3 * node + 2];
  EXPECT_NEAR(bearing, pressure * 1.25 * aside(s) * aside(s), 1e-7);
}

// A tube opens by a fifth of its inner radius. nu = 0.499 differs from incompressible tissue by about a
// thousandth.
TEST_P(SharedVolumesUnderLoad, ATubeIsInflated) {
  const double opening = 0.2;
  const bool ten = GetParam() == Elements::c3d10h;
  const Tube tube = pressurised_tube(ten ? 4 : 8, GetParam(), neo_hooke_of(1, kPoisson));
  std::string surface = "*SURFACE, NAME=INSIDE\n";
  for (const auto& [element, face] : tube.inside) surface += fmt::format("{}, S{}\n", element + 1, face + 1);
  solve(text_of(tube.model) + surface +
        fmt::format("*STEP, NLGEOM\n*STATIC\n*DSLOAD\nINSIDE, P, {:.17g}\n*END STEP\n",
                    tube_pressure(1, opening)));
  EXPECT_NEAR(tube_opening(tube, displacement_), opening, (ten ? 0.01 : 0.02) * opening);
}

// A column without lateral motion under its own weight: dP/dZ = rho g, P from the stretches (1, 1, s), P = 0
// at the top. The top sinks by the integral of 1 - s, and the weight does the work. nu = 0.4, because the
// nodes of a patch sink separately by K / mu times the square of the patch's part of the height.
TEST_P(SharedVolumesUnderLoad, AColumnSinksUnderItsWeight) {
  BlockShape shape;
  shape.cells = {2, 2, 12};
  shape.size = {0.5, 0.5, 3};
  Model model = in_nodes_of(GetParam(), tetrahedral_block(shape));
  for (int node = 0; node < model.num_nodes(); ++node) {
    for (const int axis : {0, 1}) model.fixed.push_back({node, axis, 0.0});
  }
  for (const int node : nodes_on_plane(model, 2, 0.0)) model.fixed.push_back({node, 2, 0.0});
  constexpr double kLessStiff = 0.4;
  constexpr double kWeight = 2 * 0.2;  // density 2, for each unit of volume
  solve(text_of(model, kLessStiff) +
        "*STEP, NLGEOM\n*STATIC\n*DLOAD\nBODY, GRAV, 0.2, 0, 0, -1\n*END STEP\n");
  constexpr int kSlices = 1000;
  constexpr double kSlice = 3.0 / kSlices;
  double sunk = 0;
  double work = 0;
  for (int i = 0; i < kSlices; ++i) {
    const double above = 3 - (i + 0.5) * kSlice;
    const double shorter =
        kSlice * (1 - root(
                          [&](double s) {
                            return law(kLessStiff).stresses({1, 1, s})[2] + kWeight * above;
                          },
                          0.1, 1));
    work += kWeight * 0.25 * kSlice * (sunk + 0.5 * shorter);
    sunk += shorter;
  }
  EXPECT_GT(sunk, 0.2) << "else this test shows nothing";
  EXPECT_NEAR(force_.dot(displacement_), work, 0.01 * work);
}

}  // namespace cli_pressure_test
}  // namespace palpate::test
