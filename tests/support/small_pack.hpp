// A small organ taken to a pack in memory: a block with twelve sites on its top and patches of several nodes.
// The pack has linear_dd and polynomial_dd, with nonlinear zones on request. Built once a process.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "offline/pack/pack_writer.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {

// The block has 4 x 4 x 4 nodes, 0.125 apart, and a fixed base; node 1 + i + 4 (j + 4 k).
inline constexpr int kBlockCells = 3;
inline constexpr double kMaxDisplacement = 0.05;
// More than an axis-aligned edge, less than a diagonal edge. Inner patches have 5 nodes, a few more beside
// other diagonals.
inline constexpr double kTipRadius = 0.13;

class SmallPack {
 public:
  SmallPack() {
    const TempDir dir;
    // The sites: twelve of the sixteen nodes on top, without the corners.
    dir.write("block.inp",
              block_inp(kBlockCells) + "*NSET, NSET=PROBE\n50, 51, 53, 54, 55, 56, 57, 58, 59, 60, 62, 63\n");
    LoadedScene loaded = read_scene(dir.write(
        "block.toml",
        "model = \"block.inp\"\n[contact]\nsites = \"PROBE\"\nmax_displacement = 0.05\ntip_radius = "
        "0.13\nmax_contacts = 3\n[models]\npolynomial = true\nlinear = true\n"));
    scene = loaded.scene;
    model = loaded.model;
    sites = find_contact_sites(scene, model);
    const Assembly assembly(model, model.fixed_dofs());
    linear = compute_linear_dd(assembly, sites);
    zone = find_zones(model, sites, 1);
    SamplingPlan plan;
    plan.least_samples = 8;
    plan.survey_samples = 4;
    polynomials = sample_sites(assembly, scene, sites, linear, plan);
    std::vector<SurveySample> samples;
    for (const SiteResult& result : polynomials)
      samples.insert(samples.end(), result.survey.begin(), result.survey.end());
    // A cheap survey with definite numbers: the error of answering every sample with zero displacement.
    const SurveyTable table = survey_errors(samples, scene.max_displacement, [&](size_t, const auto&) {
      return Answer{Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(sites.packed_nodes.size())),
                    Eigen::Vector3d::Zero()};
    });
    surveys = {{SurveyedModel::linear_dd, table}, {SurveyedModel::polynomial_dd, table}};
  }

  PackContent content() const {
    PackContent content{model, scene, sites, &linear, &polynomials, false, {}, surveys};
    content.inputs = {{"block.toml", std::string(32, '0'), "a scene"},
                      {"block.inp", std::string(32, '1'), "a model"}};
    return content;
  }

  AlignedBytes write() const { return write_pack(content()); }

  // The same numbers, declared as millimetres and millinewtons.
  AlignedBytes write_with_units() const {
    Scene in_units = scene;
    in_units.length_unit = "mm";
    in_units.force_unit = "mN";
    in_units.metres_per_length_unit = 1e-3;
    in_units.newtons_per_force_unit = 1e-3;
    return write_pack(
        {model, in_units, sites, &linear, &polynomials, false, content().inputs, content().surveys});
  }

  AlignedBytes write_linear_only() const {
    PackContent only = content();
    only.polynomials = nullptr;
    return write_pack(only);
  }

  AlignedBytes write_with_zone() const {
    PackContent with = content();
    with.zone = &zone;
    with.surveys.push_back({SurveyedModel::nonlinear_zone, surveys.front().table});
    with.surveys.push_back({SurveyedModel::unrefined_zone, surveys.front().table});
    return write_pack(with);
  }

  AlignedBytes write_polynomial_only() const {
    PackContent only = content();
    only.linear = nullptr;
    return write_pack(only);
  }

  // Polynomials with field columns of int16.
  std::vector<SiteResult> rounded_polynomials() const {
    constexpr double kTolerance = 1e-3;
    std::vector<SiteResult> rounded = polynomials;
    for (SiteResult& result : rounded)
      result.polynomial = reduce_basis(result.polynomial, false, kTolerance, true);
    return rounded;
  }

  AlignedBytes write_rounded() const {
    const std::vector<SiteResult> results = rounded_polynomials();
    PackContent rounded = content();
    rounded.polynomials = &results;
    rounded.rounded = true;
    return write_pack(rounded);
  }

  // Index of the site at the node with this label.
  uint32_t site_at(int label) const {
    for (size_t site = 0; site < sites.sites.size(); ++site) {
      if (model.labels[static_cast<size_t>(sites.sites[site].node)] == label)
        return static_cast<uint32_t>(site);
    }
    throw std::invalid_argument("no site at node " + std::to_string(label));
  }

  Scene scene;
  Model model;
  ContactSites sites;
  LinearDd linear;
  ZoneTables zone;
  std::vector<SiteResult> polynomials;
  std::vector<ModelSurvey> surveys;
};

inline const SmallPack& small_pack() {
  static const SmallPack pack;
  return pack;
}

inline const AlignedBytes& small_pack_bytes() {
  static const AlignedBytes bytes = small_pack().write();
  return bytes;
}

inline const AlignedBytes& zone_pack_bytes() {
  static const AlignedBytes bytes = small_pack().write_with_zone();
  return bytes;
}

inline const AlignedBytes& rounded_pack_bytes() {
  static const AlignedBytes bytes = small_pack().write_rounded();
  return bytes;
}

}  // namespace palpate::test
