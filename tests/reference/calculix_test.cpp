// Reference: CalculiX on the same file, for the laws and elements that both programs have.
//
// CalculiX prints seven digits and stops at a loose tolerance, so its file gets *CONTROLS with a tight
// tolerance. No other line differs. CalculiX takes residual forces below 1e-6 for zero, so loads with slow
// Newton convergence come with moduli of 1e9.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/nodal_csv.hpp"
#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace calculix_test {

constexpr double kAgreement = 5e-6;  // over the largest displacement: rounding of the seventh digit

enum class Loads { push, gravity, pressure, surface_pressure, amplitudes, released };

struct SharedCase {
  const char* name;
  const char* law;  // below *MATERIAL
  bool nlgeom = true;
  bool ten_nodes = false;
  Loads loads = Loads::push;
  // Pressure of Loads::pressure. `furthest` is the displacement that makes strains large; the block is 0.25
  // to 0.375 wide. CalculiX diverges on six-node faces under much more than 0.3e9.
  double pressure = 0.4e9;
  double moved = 0.05;
};

std::ostream& operator<<(std::ostream& out, const SharedCase& one) {
  return out << one.name;
}

// "label, Pn" or "label, Sn" of each outer face at the top of a block, where the corners have the largest z.
std::vector<std::string> top_faces(const std::string& block, char letter) {
  const TempDir dir;
  const Model model = read_inp(dir.write("block.inp", block));
  double top = 0;
  for (const Eigen::Vector3d& position : model.positions) top = std::max(top, position.z());
  std::vector<std::string> faces;
  for (const Tetrahedron& element : model.elements) {
    for (int face = 0; face < 4; ++face) {
      const std::array<int, 6> nodes = outward_face(element, face);
      const bool is_top = std::all_of(nodes.begin(), nodes.begin() + 3, [&](int node) {
        return model.positions[static_cast<size_t>(node)].z() == top;
      });
      if (is_top) faces.push_back(std::to_string(element.label) + ", " + letter + std::to_string(face + 1));
    }
  }
  return faces;
}

class Calculix : public ::testing::TestWithParam<SharedCase> {
 protected:
  static std::string model_text(const SharedCase& one) {
    std::string text = block_inp(one.ten_nodes ? 2 : 3, one.ten_nodes);
    const std::string block = text;
    const std::string ours = "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n";
    text.replace(text.find(ours), ours.size(), std::string("*DENSITY\n1.5e9\n") + one.law);
    const std::string step =
        std::string("*STEP") + (one.nlgeom ? ", NLGEOM" : "") + ", INC=1000\n*STATIC\n0.25, 1\n";
    // The step is half as long, so an amplitude that restarted would end elsewhere.
    const std::string half_step = step.substr(0, step.find("0.25, 1")) + "0.25, 0.5\n";
    const std::string end = "*NODE PRINT, NSET=EVERY\nU\n*END STEP\n";
    // The last two corners in the row y = z = high, and two corners of the row y = low.
    const int side = one.ten_nodes ? 3 : 4;
    const int last = side * side * side;
    const int far = last - side * (side - 1);
    std::string push = "*BOUNDARY\n";
    for (const int node : {last, last - 1}) {
      for (const char* motion : {", 1, 1, 0.03\n", ", 2, 2, -0.02\n", ", 3, 3, -0.09\n"})
        push += std::to_string(node) + motion;
    }
    const std::string forces =
        "*CLOAD\n" + std::to_string(far) + ", 3, 0.005\n" + std::to_string(far - 1) + ", 1, -0.004\n";
    switch (one.loads) {
      case Loads::push:
        return text + step + push + forces + end;
      case Loads::gravity:
        return text + step + "*DLOAD\nE, GRAV, 1.4, 0.6, 0, -0.8\n" + end;
      case Loads::pressure: {
        // Pressure on half of the top, so that the patch's boundary moves freely.
        const std::vector<std::string> faces = top_faces(block, 'P');
        std::string load = "*DLOAD\n";
        for (size_t i = 0; i < faces.size() / 2; ++i)
          load += faces[i] + ", " + std::to_string(one.pressure) + "\n";
        return text + step + load + end;
      }
      case Loads::surface_pressure: {
        std::string surface = "*SURFACE, NAME=TOP\n";
        for (const std::string& face : top_faces(block, 'S')) surface += face + "\n";
        return text + surface + step + "*DSLOAD\nTOP, P, -0.5e9\n" + end;
      }
      case Loads::amplitudes:
        // Up, back and half way up again; the second step continues in total time.
        return text +
               "*AMPLITUDE, NAME=TURNS\n0, 0, 0.5, 1, 1, 0.5\n*AMPLITUDE, NAME=LONG, TIME=TOTAL TIME\n0, 0, "
               "2, 1\n" +
               step + "*BOUNDARY, AMPLITUDE=TURNS" + push.substr(push.find('\n')) + "*CLOAD, AMPLITUDE=LONG" +
               forces.substr(forces.find('\n')) + end + half_step + end;
      case Loads::released:
        return text + step + push + end + step + "*BOUNDARY, OP=NEW\nBASE, 1, 3\n" + forces + end;
    }
    return "";
  }

  // Node label -> displacement, from the last table of a .dat file.
  static std::map<int, std::array<double, 3>> read_dat(const std::filesystem::path& file) {
    std::map<int, std::array<double, 3>> displacements;
    std::istringstream text(file_text(file));
    for (std::string line; std::getline(text, line);) {
      std::istringstream fields(line);
      int node = 0;
      std::array<double, 3> u{};
      if (fields >> node >> u[0] >> u[1] >> u[2]) displacements[node] = u;
    }
    return displacements;
  }
};

TEST_P(Calculix, AgreesToSixDigits) {
  ASSERT_EQ(run_command("command -v ccx").exit_code, 0)
      << "CalculiX is missing: ./dev test installs calculix-ccx";
  const TempDir dir;
  const std::string text = model_text(GetParam());
  const std::filesystem::path model = dir.write("block.inp", text);
  ASSERT_EQ(run_program({"solve", model.string(), "-o", (dir.path() / "ours").string()}).exit_code, 0);
  const bool two_steps = std::filesystem::exists(dir.path() / "ours" / "step2.csv");
  const std::vector<CsvRow> rows = read_csv(dir.path() / "ours" / (two_steps ? "step2.csv" : "step1.csv"));

  std::string theirs = text;
  const std::string increments = "0.25, 1\n";
  theirs.insert(theirs.find(increments) + increments.size(),
                "*CONTROLS, PARAMETERS=FIELD\n1e-10, 1e-9, , , 1e-10\n");
  dir.write("theirs.inp", theirs);
  const CommandResult run =
      run_command("cd " + shell_word(dir.path().string()) + " && OMP_NUM_THREADS=1 ccx theirs");
  ASSERT_NE(run.output.find("Job finished"), std::string::npos) << run.output;
  const std::map<int, std::array<double, 3>> displacements = read_dat(dir.path() / "theirs.dat");
  ASSERT_EQ(displacements.size(), rows.size());

  double largest = 0;
  double difference = 0;
  for (const CsvRow& row : rows) {
    for (size_t axis = 0; axis < 3; ++axis) {
      largest = std::max(largest, std::abs(row.u[axis]));
      difference = std::max(difference, std::abs(row.u[axis] - displacements.at(row.node)[axis]));
    }
  }
  EXPECT_GT(largest, GetParam().moved);
  std::printf("differs by %.1e of the largest displacement\n", difference / largest);
  EXPECT_LE(difference, kAgreement * largest);
}

INSTANTIATE_TEST_SUITE_P(
    Cases, Calculix,
    ::testing::Values(
        SharedCase{"NeoHooke", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n"},
        SharedCase{"NeoHookeStiffInVolume", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.05\n"},
        SharedCase{"MooneyRivlin", "*HYPERELASTIC, MOONEY-RIVLIN\n0.3, 0.2, 0.5\n"},
        SharedCase{"Yeoh", "*HYPERELASTIC, YEOH\n0.5, 0.05, 0.02, 0.5, 2, 5\n"},
        SharedCase{"OgdenOne", "*HYPERELASTIC, OGDEN, N=1\n1, 3.1, 0.5\n"},
        SharedCase{"OgdenThree", "*HYPERELASTIC, OGDEN, N=3\n0.5, 1.3, 0.1, 5, 0.3, -2, 0.5, 2\n5\n"},
        SharedCase{"StVenantKirchhoff", "*ELASTIC\n3, 0.3\n"},
        SharedCase{"SmallStrain", "*ELASTIC\n3, 0.3\n", false},
        SharedCase{"TenNodesNeoHooke", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n", true, true},
        SharedCase{"TenNodesNearlyIncompressible", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.02\n", true, true},
        SharedCase{"TenNodesOgden", "*HYPERELASTIC, OGDEN, N=1\n1, 3.1, 0.5\n", true, true},
        SharedCase{"TenNodesSmallStrain", "*ELASTIC\n3, 0.3\n", false, true},
        SharedCase{"Gravity", "*HYPERELASTIC, NEO HOOKE\n0.5e9, 0.5e-9\n", true, false, Loads::gravity},
        SharedCase{"TenNodesGravity", "*HYPERELASTIC, NEO HOOKE\n0.5e9, 0.5e-9\n", true, true,
                   Loads::gravity},
        SharedCase{"Pressure", "*HYPERELASTIC, NEO HOOKE\n0.5e9, 0.5e-9\n", true, false, Loads::pressure},
        SharedCase{"TenNodesPressure", "*HYPERELASTIC, NEO HOOKE\n0.5e9, 0.5e-9\n", true, true,
                   Loads::pressure, 0.3e9, 0.02},
        SharedCase{"SmallStrainPressure", "*ELASTIC\n1e9, 0.3\n", false, true, Loads::pressure},
        SharedCase{"SurfacePressure", "*HYPERELASTIC, MOONEY-RIVLIN\n0.3e9, 0.2e9, 0.5e-9\n", true, false,
                   Loads::surface_pressure},
        SharedCase{"Amplitudes", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n", true, false, Loads::amplitudes},
        SharedCase{"Released", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n", true, false, Loads::released}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace calculix_test
}  // namespace palpate::test
