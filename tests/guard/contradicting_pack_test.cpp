// Opening refuses packs whose tables contradict one another: geometry, sites, compliance, surveys.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_pack_test {

TEST_F(Contradiction, Geometry) {
  const pack::Geometry& geometry = *tables().geometry();
  EXPECT_EQ(status_with<int32_t>(geometry.labels(), [](int32_t*) {}), PAL_STATUS_OK);
  EXPECT_EQ(status_with<int32_t>(geometry.labels(), [](int32_t* labels) { labels[5] = labels[4]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<double>(geometry.positions(), [](double* x) { x[3] = std::nan(""); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(geometry.triangles(), [&](uint32_t* t) { t[7] = geometry.num_nodes(); }),
            PAL_STATUS_CORRUPT_CONTENT);
}

TEST_F(Contradiction, Sites) {
  const pack::ContactSites& sites = *tables().sites();
  EXPECT_EQ(status_with<uint32_t>(sites.contact_nodes(), [](uint32_t* n) { std::swap(n[1], n[2]); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.site_nodes(), [](uint32_t* n) { n[11] = 1u << 30; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[0] = 1; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[3] = s[2]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[3] = 0xffffffff; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { ++s[12]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_nodes(), [](uint32_t* n) { n[1] = n[0]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(
      status_with<uint32_t>(sites.patch_nodes(), [&](uint32_t* n) { n[3] = sites.num_contact_nodes(); }),
      PAL_STATUS_CORRUPT_CONTENT);
}

// A compliance is symmetric and positive definite, so |a_ij| <= sqrt(a_ii a_jj). A violation could feed
// energy to a device.
TEST_F(Contradiction, LinearCompliance) {
  const pack::LinearDd& linear = *tables().linear_dd();
  const auto changed = [&](auto&& change) {
    return status_with<double>(linear.contact_compliance(), change);
  };
  const size_t own = 9 * pack::lower_block(1, 1);  // of contact node 1
  const size_t other = 9 * pack::lower_block(1, 0);
  EXPECT_EQ(changed([](double*) {}), PAL_STATUS_OK);
  EXPECT_EQ(changed([&](double* a) { a[own] = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = -a[own]; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = 1e-300; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = 1e300; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own + 2] += 1e-3 * a[0]; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own + 2] = a[own + 6] = 1e3; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[other + 5] = 1e3; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<pal_real>(linear.field_compliance(), [](pal_real* c) { c[9] = 1e38f; }),
            PAL_STATUS_CORRUPT_CONTENT);
}

// Finite scene values that overflow or vanish in double or float arithmetic.
TEST_F(Contradiction, Scales) {
  const auto written = [&](auto&& change) {
    Scene scene = small_.scene;
    change(scene);
    const PackContent content = small_.content();
    const AlignedBytes bytes =
        write_pack({small_.model, scene, small_.sites, content.linear, content.polynomials, content.rounded,
                    content.inputs, content.surveys});
    return open_status(bytes.bytes());
  };
  EXPECT_EQ(written([](Scene&) {}), PAL_STATUS_OK);
  for (const double absurd : {0.0, -1.0, 1e-300, 1e300, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(written([&](Scene& scene) { scene.max_displacement = absurd; }), PAL_STATUS_CORRUPT_CONTENT)
        << absurd;
    const auto in_units = [&](double metres, double newtons) {
      return written([&](Scene& scene) {
        scene.length_unit = std::string(1, 'a');
        scene.force_unit = std::string(1, 'b');
        scene.metres_per_length_unit = metres;
        scene.newtons_per_force_unit = newtons;
      });
    };
    EXPECT_EQ(in_units(absurd, 1), PAL_STATUS_CORRUPT_CONTENT) << absurd;
    EXPECT_EQ(in_units(1, absurd), PAL_STATUS_CORRUPT_CONTENT) << absurd;
    EXPECT_EQ(in_units(1e-6, 1e-6), PAL_STATUS_OK);
  }
  EXPECT_EQ(written([](Scene& scene) { scene.max_contacts = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written([](Scene& scene) { scene.max_contacts = 65; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written([](Scene& scene) { scene.tip_radius = -1; }), PAL_STATUS_CORRUPT_CONTENT);
}

// Two surveys of one response model have together more bins than a pack view holds.
TEST_F(Contradiction, Surveys) {
  const auto written = [&](std::vector<ModelSurvey> surveys) {
    PackContent content = small_.content();
    content.surveys = std::move(surveys);
    return open_status(write_pack(content).bytes());
  };
  const ModelSurvey survey = small_.surveys[0];
  EXPECT_EQ(written({}), PAL_STATUS_OK);
  EXPECT_EQ(written({survey}), PAL_STATUS_OK);
  EXPECT_EQ(written({survey, survey}), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written(std::vector<ModelSurvey>(20, survey)), PAL_STATUS_CORRUPT_CONTENT);
  ModelSurvey broken = survey;
  broken.table.bins[1].from = 0.3;  // a gap
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].displacement.bound = std::nan("");
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].force.bound = -1;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].samples = 0;  // an error of zero without a sample
  broken.table.bins[2].force.bound = 0.5;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken.table.bins[2].displacement = broken.table.bins[2].force = {1, 1, 1, 1, 0};
  EXPECT_EQ(written({broken}), PAL_STATUS_OK);
  broken.table.bins[2].displacement.growth = 0.5;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  for (const double bad : {-0.1, 1.1, std::nan("")}) {
    broken = survey;
    broken.table.bins[2].displacement.growth = bad;
    EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
    broken = survey;
    broken.table.bins[2].force.growth = bad;
    EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
  }
  broken = survey;
  broken.table.bins.back().to = 0.9;  // not the whole range
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  ModelSurvey sets = survey;
  sets.sets.kinds = {{SetKind::two_near, 9, 0, 0, {}, {}}};
  sets.sets.over_load = {0.1, 0.1};
  EXPECT_EQ(written({sets}), PAL_STATUS_OK);
  for (const double bad : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (double* bound : {&broken.sets.over_load.displacement, &broken.sets.over_load.force,
                          &broken.sets.over_reach.displacement, &broken.sets.over_reach.force}) {
      broken = sets;
      *bound = bad;
      EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
    }
  }
}

TEST_F(Contradiction, InwardNormals) {
  PackContent content = small_.content();
  Scene inward = small_.scene;
  inward.directions = Directions::inward;
  ContactSites sites = small_.sites;
  const PackContent changed{content.model,       inward,          sites,          content.linear,
                            content.polynomials, content.rounded, content.inputs, content.surveys};
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_OK);
  sites.sites[3].inward *= 1.1;
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_CORRUPT_CONTENT);
  sites.sites[3].inward.setConstant(std::nan(""));
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_CORRUPT_CONTENT);
}

TEST_F(Contradiction, NoModelAtAll) {
  PackContent content = small_.content();
  content.linear = nullptr;
  content.polynomials = nullptr;
  EXPECT_EQ(open_status(write_pack(content).bytes()), PAL_STATUS_CORRUPT_CONTENT);
}

}  // namespace contradicting_pack_test
}  // namespace palpate::test::mutated_pack_fixture
