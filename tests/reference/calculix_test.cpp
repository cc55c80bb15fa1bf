// An independent solver on the same file: CalculiX, for the laws and elements that both know.
//
// Its table of displacements has seven digits and its default convergence is loose (half a percent of the
// mean force), so its copy of the file gets *CONTROLS with a tight one; nothing else differs.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "tests/support/block_mesh.hpp"
#include "tests/support/nodal_csv.hpp"
#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace {

constexpr double kAgreement = 5e-6;  // of the largest displacement: seven digits, and rounding of the last

struct SharedLaw {
  const char* name;
  const char* text;  // below *MATERIAL
  bool nlgeom = true;
  bool ten_nodes = false;
};

std::ostream& operator<<(std::ostream& out, const SharedLaw& law) {
  return out << law.name;
}

class Calculix : public ::testing::TestWithParam<SharedLaw> {
 protected:
  // A block on a fixed base, two nodes of its upper edge pushed in and sideways, two others pulled.
  static std::string model_text(const SharedLaw& law) {
    std::string text = block_inp(law.ten_nodes ? 2 : 3, law.ten_nodes);
    const std::string ours = "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n";
    text.replace(text.find(ours), ours.size(), law.text);
    const std::string geometry = law.nlgeom ? ", NLGEOM" : "";
    // The last two corners in the row y = z = high, and two of the row y = low.
    const int side = law.ten_nodes ? 3 : 4;
    const int last = side * side * side;
    const int far = last - side * (side - 1);
    const std::string push = ", 1, 1, 0.03\n", down = ", 3, 3, -0.09\n", across = ", 2, 2, -0.02\n";
    std::string loads = "*BOUNDARY\n";
    for (const int node : {last, last - 1}) {
      for (const std::string& motion : {push, across, down}) loads += std::to_string(node) + motion;
    }
    loads += "*CLOAD\n" + std::to_string(far) + ", 3, 0.005\n" + std::to_string(far - 1) + ", 1, -0.004\n";
    return text + "*STEP" + geometry + ", INC=1000\n*STATIC\n0.25, 1\n" + loads +
           "*NODE PRINT, NSET=EVERY\nU\n*END STEP\n";
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
  const std::vector<CsvRow> rows = read_csv(dir.path() / "ours" / "step1.csv");

  std::string theirs = text;
  theirs.insert(theirs.rfind("*BOUNDARY\n"), "*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-7, , , 1e-9\n");
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
  EXPECT_GT(largest, 0.05);
  EXPECT_LE(difference, kAgreement * largest);
}

INSTANTIATE_TEST_SUITE_P(
    Laws, Calculix,
    ::testing::Values(
        SharedLaw{"NeoHooke", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n"},
        SharedLaw{"NeoHookeStiffInVolume", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.05\n"},
        SharedLaw{"MooneyRivlin", "*HYPERELASTIC, MOONEY-RIVLIN\n0.3, 0.2, 0.5\n"},
        SharedLaw{"Yeoh", "*HYPERELASTIC, YEOH\n0.5, 0.05, 0.02, 0.5, 2, 5\n"},
        SharedLaw{"OgdenOne", "*HYPERELASTIC, OGDEN, N=1\n1, 3.1, 0.5\n"},
        SharedLaw{"OgdenThree", "*HYPERELASTIC, OGDEN, N=3\n0.5, 1.3, 0.1, 5, 0.3, -2, 0.5, 2\n5\n"},
        SharedLaw{"StVenantKirchhoff", "*ELASTIC\n3, 0.3\n"},
        SharedLaw{"SmallStrain", "*ELASTIC\n3, 0.3\n", false},
        SharedLaw{"TenNodesNeoHooke", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.5\n", true, true},
        SharedLaw{"TenNodesNearlyIncompressible", "*HYPERELASTIC, NEO HOOKE\n0.5, 0.02\n", true, true},
        SharedLaw{"TenNodesOgden", "*HYPERELASTIC, OGDEN, N=1\n1, 3.1, 0.5\n", true, true},
        SharedLaw{"TenNodesSmallStrain", "*ELASTIC\n3, 0.3\n", false, true}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace palpate::test
