// The scene reader: defaults, every key, and a message with its line for every mistake.
#include "offline/precompute/scene.hpp"

#include <gtest/gtest.h>

#include <random>

#include "offline/mesh/input_error.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate {
namespace scene_test {

// A cube of six tetrahedra. Node 90 belongs to no element, so it is off the surface.
const std::string kModel =
    "*NODE, NSET=ALL\n"
    "10, 0, 0, 0\n20, 1, 0, 0\n30, 0, 1, 0\n40, 1, 1, 0\n"
    "50, 0, 0, 1\n60, 1, 0, 1\n70, 0, 1, 1\n80, 1, 1, 1\n90, 9, 9, 9\n"
    "*ELEMENT, TYPE=C3D4, ELSET=BODY\n"
    "1, 10, 20, 40, 80\n2, 10, 40, 30, 80\n3, 10, 30, 70, 80\n"
    "4, 10, 70, 50, 80\n5, 10, 50, 60, 80\n6, 10, 60, 20, 80\n"
    "*NSET, NSET=PROBE\n50, 80\n"
    "*NSET, NSET=BASE\n10, 20, 30\n"
    "*NSET, NSET=FLOATING\n90\n"
    "*NSET, NSET=NOTHING\n"
    "*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 4\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n"
    "*BOUNDARY\nBASE, 1, 3\n40, 3\n";

const std::string kScene =
    "model = \"organ.inp\"\n"    // 1
    "[contact]\n"                // 2
    "sites = \"PROBE\"\n"        // 3
    "max_displacement = 0.5\n";  // 4

class SceneFile : public ::testing::Test {
 protected:
  LoadedScene read(const std::string& scene, const std::string& model = kModel) const {
    dir_.write("organ.inp", model);
    return read_scene(dir_.write("scene.toml", scene));
  }

  std::string refusal(const std::string& scene, const std::string& model = kModel) const {
    try {
      read(scene, model);
    } catch (const InputError& error) {
      return dir_.without_folder(error.what());
    }
    return "accepted";
  }

  std::vector<int> labels(const LoadedScene& loaded, const std::vector<int>& nodes) const {
    std::vector<int> labels;
    labels.reserve(nodes.size());
    for (const int node : nodes) labels.push_back(loaded.model.labels[static_cast<std::size_t>(node)]);
    return labels;
  }

  test::TempDir dir_;
};

TEST_F(SceneFile, HasDefaults) {
  const LoadedScene loaded = read(kScene);
  const Scene& scene = loaded.scene;
  EXPECT_EQ(scene.file, dir_.path() / "scene.toml");
  EXPECT_EQ(scene.model_file, dir_.path() / "organ.inp");
  EXPECT_EQ(scene.length_unit, "");
  EXPECT_EQ(scene.force_unit, "");
  EXPECT_EQ(scene.metres_per_length_unit, 1);
  EXPECT_EQ(scene.newtons_per_force_unit, 1);
  EXPECT_EQ(labels(loaded, scene.sites), (std::vector<int>{50, 80}));
  EXPECT_EQ(scene.max_displacement, 0.5);
  EXPECT_EQ(scene.directions, Directions::all);
  EXPECT_EQ(scene.tip_radius, 0);
  EXPECT_EQ(scene.max_contacts, 1);
  EXPECT_EQ(labels(loaded, scene.output_nodes), (std::vector<int>{10, 20, 30, 40, 50, 60, 70, 80}));
  EXPECT_EQ(scene.accuracy_target, 0.01);
  EXPECT_EQ(scene.frame_budget_us, 100);
  EXPECT_TRUE(scene.linear);
  EXPECT_TRUE(scene.polynomial);
  EXPECT_EQ(scene.compliance, ComplianceForm::automatic);
}

TEST_F(SceneFile, ReadsEveryKey) {
  const LoadedScene loaded = read(
      "model = \"organ.inp\"\n"
      "[units]\nlength = \"mm\"\nforce = \"mN\"\n"
      "[contact]\nsites = [80, 50, 80]\nmax_displacement = 6\ndirections = \"inward\"\ntip_radius = 1.0\n"
      "max_contacts = 3\n"
      "[output]\nnodes = \"probe\"\nprecision = \"i16\"\n"
      "[accuracy]\ntarget = 0.02\n"
      "[budget]\nframe_us = 50.5\n"
      "[models]\nlinear = true\npolynomial = false\nzone = \"auto\"\ncompliance = \"compressed\"\n");
  const Scene& scene = loaded.scene;
  EXPECT_EQ(scene.length_unit, "mm");
  EXPECT_EQ(scene.force_unit, "mN");
  EXPECT_EQ(scene.metres_per_length_unit, 1e-3);
  EXPECT_EQ(scene.newtons_per_force_unit, 1e-3);
  EXPECT_EQ(labels(loaded, scene.sites), (std::vector<int>{50, 80}));
  EXPECT_EQ(scene.max_displacement, 6);
  EXPECT_EQ(scene.directions, Directions::inward);
  EXPECT_EQ(scene.tip_radius, 1.0);
  EXPECT_EQ(scene.max_contacts, 3);
  // The set's nodes and the patches' nodes: 60 and 70 are an edge from a site; 10 and 40 are too, but are
  // fixed.
  EXPECT_EQ(labels(loaded, scene.output_nodes), (std::vector<int>{50, 60, 70, 80}));
  EXPECT_EQ(scene.accuracy_target, 0.02);
  EXPECT_EQ(scene.frame_budget_us, 50.5);
  EXPECT_TRUE(scene.linear);
  EXPECT_FALSE(scene.polynomial);
  EXPECT_EQ(scene.compliance, ComplianceForm::compressed);
}

TEST_F(SceneFile, SurfaceSitesAreTheFreeSurfaceNodes) {
  const LoadedScene loaded = read(
      "model = \"organ.inp\"\ncontact = {sites = \"surface\", max_displacement = 1}\noutput.nodes = "
      "\"all\"\n");
  EXPECT_EQ(labels(loaded, loaded.scene.sites), (std::vector<int>{50, 60, 70, 80}));
  EXPECT_EQ(loaded.scene.output_nodes.size(), 8U);
}

TEST_F(SceneFile, FindsItsModelBesideIt) {
  dir_.write("models/organ.inp", kModel);
  const auto file = dir_.write("models/organ.toml", kScene);
  EXPECT_EQ(read_scene(file).scene.model_file, dir_.path() / "models/organ.inp");
}

TEST_F(SceneFile, WarnsOfSteps) {
  const std::string step = "*STEP, NLGEOM\n*STATIC\n*END STEP\n";
  const LoadedScene loaded = read(kScene, kModel + step);
  ASSERT_FALSE(loaded.model.warnings.empty());
  EXPECT_EQ(dir_.without_folder(loaded.model.warnings.back()),
            "organ.inp:32: a build takes NLGEOM from *STEP and ignores the rest: only what is held before it "
            "counts");
  // Only a step holds this model, and a build ignores steps.
  const std::string loose = kModel.substr(0, kModel.find("*BOUNDARY"));
  EXPECT_EQ(refusal(kScene, loose + "*STEP, NLGEOM\n*STATIC\n*BOUNDARY\nBASE, 1, 3\n*END STEP\n"),
            "organ.inp: the part with node 10 can still move along x; hold more of it with *BOUNDARY");
}

// Deeper than a recursive parser's stack, in each way in which TOML nests.
TEST_F(SceneFile, RefusesNestingWithoutBound) {
  constexpr int kDepth = 31250;
  std::string dotted = "a";
  for (int i = 0; i < kDepth; ++i) dotted += ".a";
  std::string tables;
  for (int i = 0; i < kDepth; ++i) tables += "{a = ";
  const std::string arrays(kDepth, '[');
  for (const std::string& text :
       {dotted + " = 1\n", "[" + dotted + "]\n", "b = " + arrays + "\n", "b = " + tables})
    EXPECT_NE(refusal(kScene + text).find("scene.toml:5: tables, arrays or keys are nested"),
              std::string::npos);
}

TEST_F(SceneFile, DotsInNumbersTextsAndCommentsDoNotNest) {
  std::string dots(100, '.');
  EXPECT_EQ(refusal(kScene + "# " + dots + "\n[gravity]\nacceleration = [1.5, 2.5, 3.5]\n").find("nested"),
            std::string::npos);
  EXPECT_EQ(refusal("model = \"" + dots + "\"\n").find("nested"), std::string::npos);
}

TEST_F(SceneFile, MayLeaveItsFilesOutOfThePack) {
  EXPECT_TRUE(read(kScene).scene.embed_inputs);
  EXPECT_FALSE(read(kScene + "[output]\nembed_inputs = false\n").scene.embed_inputs);
}

TEST_F(SceneFile, PassesOnErrorsOfTheModel) {
  EXPECT_EQ(refusal(kScene, "*DENSITY\n1\n"),
            "organ.inp:1: *DENSITY belongs to no material; move it below *MATERIAL");
}

TEST_F(SceneFile, RefusesAFileThatIsNotThere) {
  const auto message = [&](const std::filesystem::path& file) {
    try {
      read_scene(file);
    } catch (const InputError& error) {
      return dir_.without_folder(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(dir_.path() / "none.toml"),
            "none.toml: cannot be read (No such file or directory); check its name");
  EXPECT_EQ(message(dir_.path() / "."), ".: is a folder; name a file");
}

struct BadScene {
  const char* text;
  const char* message;
};

void PrintTo(const BadScene& bad, std::ostream* out) {
  *out << bad.text;
}

class BadScenes : public SceneFile, public ::testing::WithParamInterface<BadScene> {};
class BadAdditions : public SceneFile, public ::testing::WithParamInterface<BadScene> {};

TEST_P(BadScenes, AreRefusedByLine) {
  EXPECT_EQ(refusal(GetParam().text), GetParam().message);
}

// Lines from 5 on, after kScene, still inside [contact] until another table begins.
TEST_P(BadAdditions, AreRefusedByLine) {
  EXPECT_EQ(refusal(kScene + GetParam().text), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    SceneFile, BadScenes,
    ::testing::Values(
        BadScene{"", "scene.toml: [contact] is missing; add it with sites and max_displacement"},
        BadScene{"[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
                 "scene.toml: model is missing; add model = \"organ.inp\""},
        BadScene{"model = 3\n[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
                 "scene.toml:1: model must be a text in double quotes, not 3; correct it"},
        BadScene{"model = \"organ.inp\"\nmerge = 0\n[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
                 "scene.toml:2: merge must be a number above 0, not 0; correct it"},
        BadScene{"model = \"organ.inp\"\nseparate_bodies = 2\n[contact]\nsites = \"PROBE\"\nmax_displacement "
                 "= 1\n",
                 "scene.toml:2: separate_bodies must be true or false, not 2; correct it"},
        BadScene{"model = \"orgn.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
                 "scene.toml:1: model orgn.inp is not a file; correct its name"},
        BadScene{"model = \"scene.toml\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = 1\n",
                 "scene.toml:1: model scene.toml is not an .inp file and has no law and no supports; run "
                 "`palpate new scene.toml`, and name the .inp file that it writes"},
        BadScene{"model = \"organ.inp\"\n[contact]\nmax_displacement = 1\n",
                 "scene.toml:2: contact.sites is missing; add a node set, an array of node labels, or "
                 "\"surface\""},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"PROBE\"\n",
                 "scene.toml:2: contact.max_displacement is missing; add how far a tool may push, such as "
                 "max_displacement = 6.0"},
        BadScene{"model = \"organ.inp\"\ncontact = 3\n",
                 "scene.toml:2: contact must be a table, written [contact], not 3; correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"PROB\"\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node set PROB is not in organ.inp; did you mean PROBE?"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"NOTHING\"\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node set NOTHING is empty; add nodes to it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"ALL\"\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node 10 is fixed by *BOUNDARY along an axis at least, so no "
                 "tool can move it; take "
                 "it out"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"FLOATING\"\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node 90 is not on the surface, where no tool reaches it; take "
                 "it out"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = [50,\n 40]\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node 40 is fixed by *BOUNDARY along an axis at least, so no "
                 "tool can move it; take "
                 "it out"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = [55]\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites: node 55 is not in organ.inp; correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = []\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites is empty; name a node"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = 50\nmax_displacement = 1\n",
                 "scene.toml:3: contact.sites must be a node set, an array of node labels, or \"surface\", "
                 "not 50; "
                 "correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = [50,\n\"60\"]\nmax_displacement = 1\n",
                 "scene.toml:4: contact.sites must be a node set, an array of node labels, or \"surface\", "
                 "and \"60\" "
                 "is none; correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = 0\n",
                 "scene.toml:4: contact.max_displacement must be a number above 0, not 0; correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = \"far\"\n",
                 "scene.toml:4: contact.max_displacement must be a number above 0, not \"far\"; correct it"},
        BadScene{"model = \"organ.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = inf\n",
                 "scene.toml:4: contact.max_displacement must be a number above 0, not inf; correct it"},
        BadScene{"model = fals\n",
                 "scene.toml:1: not valid TOML: Error while parsing boolean: expected 'false', saw 'fals?'"},
        BadScene{"model = \"organ.inp\"\n[contact\n",
                 "scene.toml:2: not valid TOML: Error while parsing table header: expected ']', saw '\\n'"}));

INSTANTIATE_TEST_SUITE_P(
    SceneFile, BadAdditions,
    ::testing::Values(
        BadScene{"tip_raduis = 1\n",
                 "scene.toml:5: contact.tip_raduis is not known; did you mean tip_radius?"},
        BadScene{
            "colour = 1\n",
            "scene.toml:5: contact.colour is not known; write sites, sampled, max_displacement, directions, "
            "tip_radius "
            "or max_contacts"},
        BadScene{"\n[ouput]\nnodes = \"all\"\n", "scene.toml:6: ouput is not known; did you mean output?"},
        BadScene{"[gravity]\ng = 9.81\n",
                 "scene.toml:6: gravity.g is not known; write acceleration or may_turn"},
        BadScene{
            "[gravity]\nmay_turn = true\n",
            "scene.toml:5: gravity.acceleration is missing; add acceleration = [gx, gy, gz] in the model's "
            "units"},
        BadScene{"[gravity]\nacceleration = [0, 0]\n",
                 "scene.toml:6: gravity.acceleration must be an array of three finite numbers, and this has "
                 "2; correct it"},
        BadScene{"[gravity]\nacceleration = [0, 0, 0]\n",
                 "scene.toml:6: gravity.acceleration is zero, or outside 1e-15 to 1e15; correct it"},
        BadScene{
            "[gravity]\nacceleration = [0, 0, -9810]\n",
            "scene.toml:6: gravity pulls at mass, and material TISSUE of organ.inp has none; add *DENSITY to "
            "it"},
        BadScene{"directions = \"up\"\n",
                 "scene.toml:5: contact.directions must be all or inward, not \"up\"; correct it"},
        BadScene{"tip_radius = -1\n",
                 "scene.toml:5: contact.tip_radius must be a number, 0 or above, not -1; correct it"},
        BadScene{"tip_radius = true\n",
                 "scene.toml:5: contact.tip_radius must be a number, 0 or above, not true; correct it"},
        BadScene{"max_contacts = 0\n",
                 "scene.toml:5: contact.max_contacts must be a whole number from 1 to 64, not 0; correct it"},
        BadScene{
            "max_contacts = 65\n",
            "scene.toml:5: contact.max_contacts must be a whole number from 1 to 64, not 65; correct it"},
        BadScene{
            "max_contacts = 2.5\n",
            "scene.toml:5: contact.max_contacts must be a whole number from 1 to 64, not 2.5; correct it"},
        BadScene{"max_contacts = [1]\n",
                 "scene.toml:5: contact.max_contacts must be a whole number from 1 to 64, not an array; "
                 "correct it"},
        BadScene{"max_displacement = 1\n",
                 "scene.toml:5: not valid TOML: Error while parsing key-value pair: cannot redefine existing "
                 "floating-point 'max_displacement'"},
        BadScene{"[units]\nlength = \"mm\"\n",
                 "scene.toml:6: units.length is given without units.force; give both or neither"},
        BadScene{"[units]\nforce = \"N\"\n",
                 "scene.toml:6: units.force is given without units.length; give both or neither"},
        BadScene{"[units]\nlength = \"inch\"\nforce = \"N\"\n",
                 "scene.toml:6: units.length must be m, km, cm, mm or um, not \"inch\"; correct it"},
        BadScene{"[units]\nlength = \"m\"\nforce = \"lbf\"\n",
                 "scene.toml:7: units.force must be N, kN, mN or uN, not \"lbf\"; correct it"},
        BadScene{"[output]\nnodes = \"SKIN\"\n",
                 "scene.toml:6: output.nodes: node set SKIN is not in organ.inp; name one of its "
                 "node sets, or \"surface\""},
        BadScene{"[output]\nprecision = \"i8\"\n",
                 "scene.toml:6: output.precision must be auto, f32 or i16, not \"i8\"; correct it"},
        BadScene{"[models]\npolynomial_method = \"spline\"\n",
                 "scene.toml:6: models.polynomial_method must be hermite, paper_grid or paper_ray, not "
                 "\"spline\"; "
                 "correct it"},
        BadScene{"[accuracy]\ntarget = 0\n",
                 "scene.toml:6: accuracy.target must be a number above 0, not 0; correct it"},
        BadScene{"[budget]\nframe_us = -5\n",
                 "scene.toml:6: budget.frame_us must be a number above 0, not -5; correct it"},
        BadScene{"[models]\nzone_rings = 2\n",
                 "scene.toml:6: models.zone_rings is for models.zone = true; add it"},
        BadScene{"[models]\nzone = true\nzone_rings = 9\n",
                 "scene.toml:7: models.zone_rings must be a whole number from 1 to 8, not 9; correct it"},
        BadScene{"[models]\nlinear = \"yes\"\n",
                 "scene.toml:6: models.linear must be true, false or \"auto\", not \"yes\"; correct it"},
        BadScene{"[models]\ncompliance = \"small\"\n",
                 "scene.toml:6: models.compliance must be auto, dense or compressed, not \"small\"; "
                 "correct it"},
        BadScene{"[models]\nlinear = 1\n",
                 "scene.toml:6: models.linear must be true, false or \"auto\", not 1; correct it"},
        BadScene{"[models]\nlinear = false\npolynomial = false\n",
                 "scene.toml:6: models.linear and models.polynomial are both false: nothing is left to "
                 "answer with; "
                 "carry one of them, or write models.zone = true"},
        BadScene{"[[models]]\nlinear = false\n",
                 "scene.toml:5: models must be a table, written [models], not an array; correct it"}));

TEST_F(SceneFile, SurvivesChangedBytes) {
  const std::string good =
      kScene + "tip_radius = 1.0\n[units]\nlength = \"mm\"\nforce = \"mN\"\n[models]\nzone = false\n";
  std::mt19937 random(20050823);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  int refused = 0;
  constexpr int kRounds = 1500;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = good;
    const std::size_t changes = 1 + below(3);
    for (std::size_t i = 0; i < changes; ++i) {
      const std::size_t at = below(text.size());
      switch (below(3)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(12));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), below(20)));
          break;
      }
    }
    try {
      read(text);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, kRounds / 2);
}

}  // namespace scene_test
}  // namespace palpate
