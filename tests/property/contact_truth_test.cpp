// Reference solves of several contacts, and the thickness of a block under a site.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "offline/precompute/contact_truth.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/local_thickness.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace contact_truth_test {

struct Block {
  SceneFiles files;
  LoadedScene loaded = read_scene(files.scene);
  ContactSites sites = find_contact_sites(loaded.scene, loaded.model);
  Assembly assembly{loaded.model, loaded.model.fixed_dofs()};
  RestState rest;
  explicit Block(const std::string& contact) : files(contact) {}
};

const std::string kApart = "[contact]\nsites = [19, 27]\nmax_displacement = 0.03\nmax_contacts = 2\n";

TEST(ContactTruth, OneContactEqualsTheSurvey) {
  const Block block(kContact);
  const Eigen::Vector3d d(0.01, -0.005, -0.02);
  const SurveySample survey = solve_pushes(block.assembly, block.sites, {{1, d, 2}}, 1).front();
  const ContactTruth truth =
      solve_contact_sets(block.assembly, block.sites, {{{1, d}}}, 1, block.rest).front();
  ASSERT_TRUE(survey.solved && truth.solved);
  constexpr double kSingle = 1e-6;  // a survey stores fields in single precision
  EXPECT_LE((truth.field - survey.truth.field).norm(), kSingle * truth.field.norm());
  EXPECT_LE((truth.forces[0] - survey.truth.force).norm(), 1e-8 * truth.forces[0].norm());
  EXPECT_EQ(truth.largest_displacement(), d.norm());
}

TEST(ContactTruth, SmallPushesAreLinear) {
  const Block block(kApart);
  StaticSolver solver(block.assembly);
  factor_at_rest(solver);
  constexpr double kSmall = 1e-6;
  const std::vector<LinearContact> contacts = {{0, kSmall * Eigen::Vector3d(0.2, 0.3, -1)},
                                               {1, kSmall * Eigen::Vector3d(-0.5, 0.1, 0.8)}};
  const std::vector<std::vector<LinearContact>> sets = {contacts, {contacts[1]}};
  const std::vector<ContactTruth> truths =
      solve_contact_sets(block.assembly, block.sites, sets, 2, block.rest);
  for (size_t i = 0; i < sets.size(); ++i) {
    ASSERT_TRUE(truths[i].solved);
    const LinearContactAnswer linear = solve_contacts(solver, block.sites, sets[i]);
    constexpr double kNonlinear = 1e-4;  // strains of about 1e-5
    EXPECT_LE((truths[i].field - linear.field).norm(), kNonlinear * linear.field.norm());
    for (size_t c = 0; c < sets[i].size(); ++c)
      EXPECT_LE((truths[i].forces[c] - linear.forces[c]).norm(), kNonlinear * linear.forces[c].norm());
  }
}

// The block is 0.25 x 0.25 x 0.25. Node 19 is a corner of its top; pushes lead inwards or outwards.
TEST(LocalThickness, ABlocksThicknessIsItsHeight) {
  const Block block(kContact);
  const Surface surface = extract_surface(block.loaded.model);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : block.loaded.model.positions) box.extend(position);
  const ContactSite& site = block.sites.sites[1];  // node 23, in the middle of the top
  const auto along = [&](const Eigen::Vector3d& d) {
    return local_thickness(block.loaded.model, surface, site, d);
  };
  const double height = box.sizes().z();
  EXPECT_NEAR(along({0, 0, -3}), height, 1e-12);
  EXPECT_NEAR(along({0, 0, 2}), height, 1e-12);
  const Eigen::Vector3d slanted = Eigen::Vector3d(0.3, 0.1, -1);
  EXPECT_NEAR(along(slanted), height * slanted.norm(), 1e-12);
}

}  // namespace contact_truth_test
}  // namespace palpate::test
