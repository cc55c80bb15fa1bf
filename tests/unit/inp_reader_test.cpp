// The .inp reader: the Model of a good file, and one message for any other file.
#include <gtest/gtest.h>

#include "tests/support/inp_reader_fixture.hpp"

namespace palpate::inp_reader_fixture {
namespace inp_reader_test {

TEST_F(InpReader, ReadsABody) {
  const Model model = read("*HEADING\nTwo tetrahedra\nmade by hand\n" + kBody);
  EXPECT_EQ(without_folder(model.file), "organ.inp");
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_EQ(model.positions[4], Eigen::Vector3d(1, 1, 1));
  ASSERT_EQ(model.elements.size(), 2U);
  EXPECT_EQ(model.elements[1].label, 2);
  EXPECT_TRUE(std::ranges::equal(model.elements[1].nodes(), std::array{1, 4, 2, 3}));
  ASSERT_EQ(model.materials.size(), 1U);
  EXPECT_EQ(model.materials[0].name, "TISSUE");
  const auto& law = std::get<CompressibleNeoHookean>(model.materials[0].law);
  EXPECT_EQ(law.mu, 0.48);
  EXPECT_EQ(law.lambda, 0.2);
  EXPECT_EQ(model.node_sets.at("BASE"), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(model.element_sets.at("BODY"), (std::vector<int>{0, 1}));
  ASSERT_EQ(model.fixed.size(), 9U);
  EXPECT_EQ(model.fixed[5].node, 1);
  EXPECT_EQ(model.fixed[5].axis, 2);
  EXPECT_TRUE(model.steps.empty());
  EXPECT_TRUE(model.warnings.empty());
  EXPECT_EQ(model.find_node(5), 4);
  EXPECT_EQ(model.find_node(6), -1);
}

TEST_F(InpReader, TakesAbaqusSpelling) {
  const Model model = read(
      "\xEF\xBB\xBF** made by a program\r\n"
      "*Heading\r\n"
      "*element,\r\n"
      "** between the parts of a keyword line\r\n"
      "   type = c3d4 , elset = Body\r\n"
      " 10, 1, 2,\r\n"
      "   3, 4\r\n"
      " 20,2,5,3,4,\r\n"
      "\r\n"
      "*Node , nset=\"All nodes\"\r\n"
      "1, , 0., -0.\r\n"
      "2, 1.0D0, 0\t, +0.0\r\n"
      "3, 0, 1e0, 0,\r\n"
      "4, 0,, +1.d+0\r\n"
      "5, 10.E-1, 1, 1\r\n"
      "*nset, nset=odd, generate\r\n"
      "1, 5, 2\r\n"
      "*NSET, NSET=Base\r\n"
      "odd, 2\r\n"
      "*NSET, NSET=base\r\n"
      "\"All nodes\",\r\n"
      "*elset, elset=first, generate\r\n"
      "10, 10\r\n"
      "*elset, elset=second\r\n"
      "20\r\n"
      "*SolidSection, elset=first, material=soft\r\n"
      "1.\r\n"
      "*solid  section, material=STIFF, elset=second\r\n"
      ",\r\n"
      "*material, name=Soft\r\n"
      "*hyperelastic, compressible neo hooke\r\n"
      "1, 4\r\n"
      "*material, name=Stiff\r\n"
      "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\r\n"
      "+2., -1.0E+0\r\n"
      "*boundary, op=mod\r\n"
      "odd, 1, 3, 0.\r\n"
      "2, pinned\r\n"
      "4, ENCASTRE\r\n"
      "4, 3\r\n"
      "4, 2,\r\n");
  EXPECT_EQ(model.positions[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(model.positions[3], Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(model.positions[4], Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(model.node_sets.at("All nodes").size(), 5U);
  EXPECT_EQ(model.node_sets.at("ODD"), (std::vector<int>{0, 2, 4}));
  EXPECT_EQ(model.node_sets.at("BASE"), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(model.elements[0].label, 10);
  EXPECT_EQ(model.elements[0].material, 0);
  EXPECT_EQ(model.elements[1].material, 1);
  EXPECT_EQ(std::get<CompressibleNeoHookean>(model.materials[1].law).lambda, -1.0);
  EXPECT_EQ(model.fixed.size(), 15U);
}

// A model of a stranger names /etc/passwd, a file beside its folder, or a link in its folder.
TEST_F(InpReader, IncludesStayBelowTheModelsFolder) {
  const test::TempDir outside;
  const std::filesystem::path secret = outside.write("secret.inc", "3, 0, 1, 0\n");
  std::filesystem::create_symlink(secret, dir_.path() / "link.inc");
  for (const std::string& name :
       {std::string("/etc/passwd"), secret.string(),
        "../" + outside.path().filename().string() + "/secret.inc", std::string("link.inc")}) {
    EXPECT_NE(refusal("*NODE\n*INCLUDE, INPUT=" + name + "\n").find("--allow-outside"), std::string::npos)
        << name;
  }
  const std::string model = with_line(4, "*INCLUDE, INPUT=link.inc");
  const std::filesystem::path file = dir_.write("organ.inp", model);
  EXPECT_THROW(read_inp(file), InputError);
  EXPECT_NO_THROW(read_inp(file, "/"));
}

// A bare file name has no folder to resolve a missing file in.
TEST_F(InpReader, MissingIncludeOfABareNameIsMissing) {
  dir_.write("organ.inp", "*NODE\n*INCLUDE, INPUT=missing.inc\n");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(dir_.path());
  std::string message;
  try {
    read_inp("organ.inp");
  } catch (const InputError& error) {
    message = error.what();
  }
  std::filesystem::current_path(before);
  EXPECT_NE(message.find("No such file"), std::string::npos) << message;
}

TEST_F(InpReader, FollowsIncludes) {
  dir_.write("parts/nodes.inc", "3, 0, 1, 0\n4, 0, 0, 1\n*INCLUDE, INPUT=last.inc\n");
  dir_.write("parts/last.inc", "5, 1, 1, 1");
  const Model model =
      read(with_line(4, "*INCLUDE, INPUT=\"parts/nodes.inc\"", with_line(5, "", with_line(6, ""))));
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_EQ(model.node_sets.at("ALL").size(), 5U);
  EXPECT_EQ(model.files, (std::vector<std::string>{(dir_.path() / "organ.inp").string(),
                                                   (dir_.path() / "parts/nodes.inc").string(),
                                                   (dir_.path() / "parts/last.inc").string()}));

  EXPECT_EQ(refusal("*INCLUDE, INPUT=none.inc\n"),
            "organ.inp:1: *INCLUDE of none.inc: cannot be read (No such file or directory); check its name");
  EXPECT_EQ(refusal("*INCLUDE\n"), "organ.inp:1: *INCLUDE needs INPUT=...; add it");
  EXPECT_EQ(refusal("** me\n*INCLUDE, INPUT=organ.inp\n"),
            "organ.inp:2: *INCLUDE of organ.inp: the file includes itself; break the circle");
  dir_.write("bad.inc", "\n*PART\n1\n");
  EXPECT_EQ(refusal("*INCLUDE, INPUT=bad.inc\n"), "bad.inc:2: *PART needs NAME=...; add it");
  for (int i = 0; i < 40; ++i) {
    dir_.write("deep" + std::to_string(i) + ".inc",
               "*INCLUDE, INPUT=deep" + std::to_string(i + 1) + ".inc\n");
  }
  EXPECT_EQ(refusal("*INCLUDE, INPUT=deep0.inc\n"),
            "deep30.inc:1: *INCLUDE of deep31.inc: files are nested more than 32 deep; flatten them");
}

TEST_F(InpReader, RefusesAFileThatIsNotThere) {
  const auto message = [&](const std::filesystem::path& file) {
    try {
      read_inp(file);
    } catch (const InputError& error) {
      return without_folder(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(dir_.path() / "none.inp"),
            "none.inp: cannot be read (No such file or directory); check its name");
  EXPECT_EQ(message(dir_.path() / "."), ".: is a folder; name a file");
  EXPECT_EQ(refusal(""), "organ.inp: is empty; copy or export it again");
}

TEST_F(InpReader, WarnsOfMaterialsThatLock) {
  const auto warnings = [&](const std::string& lambda) {
    return read(with_line(14, "1, " + lambda)).warnings;
  };
  EXPECT_EQ(warnings("9").size(), 0U) << "nu = 0.45";
  ASSERT_EQ(warnings("49").size(), 1U);
  EXPECT_EQ(without_folder(warnings("49")[0]),
            "organ.inp: material TISSUE has a Poisson ratio of 0.49 at small strain; above 0.45 tetrahedra "
            "of four nodes lock, and forces come out too large; write MEAN DILATATION in its *SOLID SECTION, "
            "or mesh with C3D10H");
  const std::string sharing = "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE, MEAN DILATATION";
  EXPECT_EQ(read(with_line(14, "1, 49", with_line(15, sharing))).warnings.size(), 0U);
}

TEST_F(InpReader, SharesVolumesWhereASectionAsksForIt) {
  for (const Tetrahedron& element : read(kBody).elements) EXPECT_EQ(element.volume_patch, -1);
  const Model all = read(with_line(15, "*Solid section, elset=BODY, material=TISSUE, mean dilatation"));
  EXPECT_EQ(all.elements[0].volume_patch, 0);
  EXPECT_EQ(all.elements[1].volume_patch, 0) << "two elements are one patch";
  const Model sections = read(
      with_line(15,
                "*ELSET, ELSET=ONE\n1\n*ELSET, ELSET=TWO\n2\n*SOLID SECTION, ELSET=ONE, MATERIAL=TISSUE\n"
                "*SOLID SECTION, ELSET=TWO, MATERIAL=TISSUE, MEAN DILATATION"));
  EXPECT_EQ(sections.elements[0].volume_patch, -1);
  EXPECT_EQ(sections.elements[1].volume_patch, 0);

  std::string text = test::block_inp(1, true);
  text.replace(text.find("C3D10"), 5, "C3D10H");
  const Model hybrid = read(text);
  for (size_t e = 0; e < hybrid.elements.size(); ++e)
    EXPECT_EQ(hybrid.elements[e].volume_patch, static_cast<int>(e));
}

TEST_F(InpReader, ReadsEveryLaw) {
  const auto law_of = [&](const std::string& keyword_and_data, const std::string& steps = "") {
    return read(with_line(13, keyword_and_data, with_line(14, "")) + steps).materials[0].law;
  };
  const auto invariant = [&](const std::string& text) { return std::get<InvariantLaw>(law_of(text)); };
  const InvariantLaw neo_hooke = invariant("*Hyperelastic, neo hooke\n0.24, 4");
  EXPECT_EQ(neo_hooke.c10, 0.24);
  EXPECT_EQ(neo_hooke.c01, 0);
  EXPECT_EQ(neo_hooke.volumetric.inverse_d, (std::array<double, 3>{0.25, 0, 0}));
  const InvariantLaw mooney = invariant("*HYPERELASTIC, MOONEY-RIVLIN\n0.24, 0.1, 2");
  EXPECT_EQ(mooney.c10, 0.24);
  EXPECT_EQ(mooney.c01, 0.1);
  EXPECT_EQ(mooney.volumetric.inverse_d, (std::array<double, 3>{0.5, 0, 0}));
  const InvariantLaw yeoh = invariant("*HYPERELASTIC, YEOH\n1, -0.1, 0.01, 2, 0, 8");
  EXPECT_EQ(yeoh.c10, 1);
  EXPECT_EQ(yeoh.c20, -0.1);
  EXPECT_EQ(yeoh.c30, 0.01);
  EXPECT_EQ(yeoh.volumetric.inverse_d, (std::array<double, 3>{0.5, 0, 0.125}));
  const Ogden ogden = std::get<Ogden>(law_of("*HYPERELASTIC, OGDEN, N=3\n1, 2, 3, 4, 5, -6, 2, 4\n8"));
  ASSERT_EQ(ogden.terms.size(), 3U);
  EXPECT_EQ(ogden.terms[2].mu, 5);
  EXPECT_EQ(ogden.terms[2].alpha, -6);
  EXPECT_EQ(ogden.volumetric.inverse_d, (std::array<double, 3>{0.5, 0.25, 0.125}));
  EXPECT_EQ(std::get<Ogden>(law_of("*HYPERELASTIC, OGDEN\n1, 2, 4")).terms.size(), 1U);

  const std::string elastic = "*ELASTIC, TYPE=ISO\n2.8, 0.4";
  EXPECT_NEAR(std::get<LinearElastic>(law_of(elastic)).mu, 1.0, 1e-15);
  EXPECT_NEAR(std::get<LinearElastic>(law_of(elastic, "*STEP\n*STATIC\n*END STEP\n")).lambda, 4.0, 1e-14);
  EXPECT_NEAR(std::get<StVenantKirchhoff>(law_of(elastic, kStep + kEnd)).lambda, 4.0, 1e-14);
  EXPECT_NEAR(std::get<StVenantKirchhoff>(law_of(elastic, kStep + kEnd + "*STEP\n*STATIC\n*END STEP\n")).mu,
              1.0, 1e-15)
      << "what follows a step with NLGEOM has it too";
}

TEST_F(InpReader, NamesTheMotionThatRemains) {
  const auto free = [](const std::string& motion) {
    return "organ.inp: the part with node 1 can still " + motion + "; hold more of it with *BOUNDARY";
  };
  EXPECT_EQ(refusal(with_line(17, "BASE, 2, 3")), free("move along x"));
  EXPECT_EQ(refusal(with_line(17, "BASE, 1, 2")), free("move along z"));
  EXPECT_EQ(refusal(with_line(17, "4, 1, 3")), free("turn about an axis along x"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n4, 1, 3")), free("turn about an axis along z"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n5, 1, 3")), free("move as a whole"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n2, 2, 3\n3, 3")), "accepted");
}

TEST_F(InpReader, HoldsEachPart) {
  const std::string nodes = "5, 1, 1, 1\n6, 5, 0, 0\n7, 6, 0, 0\n8, 5, 1, 0\n9, 5, 0, 1";
  const std::string two_parts = with_line(6, nodes, with_line(8, "1, 1, 2, 3, 4\n3, 6, 7, 8, 9"));
  EXPECT_EQ(refusal(two_parts),
            "organ.inp: the part with node 6 can still move along x; hold more of it with *BOUNDARY");
  EXPECT_EQ(refusal(two_parts + "6, 1, 3\n7, 1, 3\n8, 3\n"), "accepted");
}

TEST_F(InpReader, WarnsOfPartsThatHangByACornerOrAnEdge) {
  const auto warning = [&](const std::string& nodes, const std::string& element) {
    const Model model = read(with_line(6, "5, 1, 1, 1\n" + nodes, with_line(9, "2, 2, 5, 3, 4\n" + element)));
    return model.warnings.empty() ? "none" : without_folder(model.warnings.front());
  };
  const auto hangs = [](const std::string& motion) {
    return "organ.inp: the elements at node 8 hang on the rest by a corner or an edge and can " + motion +
           "; join them face to face, or hold them with *BOUNDARY";
  };
  EXPECT_EQ(warning("6, 2, 1, 1\n7, 1, 2, 1\n8, 1, 1, 2", "3, 5, 6, 7, 8"),
            hangs("turn about an axis along x"));
  EXPECT_EQ(warning("6, 1, 1, 2\n7, 2, 1, 1.5", "3, 5, 6, 4, 7").substr(0, 20), "organ.inp: the eleme");
  // A common face joins the two parts.
  EXPECT_EQ(warning("6, 2, 2, 1", "3, 2, 6, 3, 5"), "none");
}

TEST_F(InpReader, WarnsOfNodesWithoutElements) {
  const Model model = read(with_line(6, "5, 1, 1, 1\n99, 3, 3, 3\n98, 4, 4, 4"));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(without_folder(model.warnings[0]),
            "organ.inp: 2 nodes belong to no element and stay where they are; the first is node 99");
}

// Reading any bytes ends in a Model or in an InputError, each line of which names its place.
TEST_F(InpReader, SurvivesChangedBytes) {
  const std::string good = kBody + kStep + "0.1, 1.\n*BOUNDARY\n4, 1, 1, 0.2\n*CLOAD\n5, 2, 3.\n" + kEnd;
  std::mt19937 random(20050823);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::string letters = "*,=\n\r\t \"-+.eED0123456789ABCNSTX";
  int refused = 0;
  constexpr int kRounds = 3000;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = good;
    const std::size_t changes = 1 + below(6);
    for (std::size_t i = 0; i < changes; ++i) {
      const std::size_t at = below(text.size());
      switch (below(4)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text[at] = letters[below(letters.size())];
          break;
        case 2:
          text.erase(at, 1 + below(20));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), below(40)));
          break;
      }
    }
    try {
      read(text);
    } catch (const InputError& error) {
      ++refused;
      std::istringstream lines(error.what());
      for (std::string line; std::getline(lines, line);) {
        EXPECT_NE(line.find("organ.inp"), std::string::npos) << error.what();
      }
    }
  }
  EXPECT_GT(refused, kRounds / 2);
  EXPECT_LT(refused, kRounds);
}

}  // namespace inp_reader_test
}  // namespace palpate::inp_reader_fixture
