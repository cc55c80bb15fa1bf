// palpate_study_sites models/brain/brain.toml DIR: measures errors of a sampled site's response transferred
// to other sites, by eq. (25) of Zhong et al. 2005 (the paper) and by the maps of affine_site.hpp, against
// full solves. Writes the tables moved, contacted, origin and blended as .md and .csv, and keeps solves in
// DIR/samples.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bench/solver/study_table.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/precompute/affine_site.hpp"
#include "offline/precompute/site_survey.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

using study::StudyTable;

struct Errors {
  std::vector<double> displacement;  // max over packed nodes |u - u_FE| / |d|
  std::vector<double> force;         // |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the largest force
};

// Returns a polynomial with only the terms of orders first .. last in d, for field and force.
SitePolynomial orders_of(SitePolynomial polynomial, int first, int last) {
  const auto num_terms = [](int lowest, int order) {
    return Eigen::Index{pack::num_monomials(static_cast<uint32_t>(lowest), static_cast<uint32_t>(order))};
  };
  if (first > 1) {
    polynomial.linear.setZero();
    const int last_dropped = std::min(first - 1, polynomial.degree);
    polynomial.coefficients.topRows(num_terms(2, last_dropped)).setZero();
    polynomial.energy.head(num_terms(2, last_dropped + 1)).setZero();
  }
  if (last < polynomial.degree) {
    polynomial.coefficients.bottomRows(num_terms(last + 1, polynomial.degree)).setZero();
    polynomial.energy.tail(num_terms(last + 2, polynomial.degree + 1)).setZero();
  }
  return polynomial;
}

// Holds the organ with sampled sites, and with the series (Taylor polynomial at rest) of each site.
class StudiedOrgan {
 public:
  StudiedOrgan(const std::filesystem::path& scene, const std::filesystem::path& samples)
      : loaded_(read_scene(scene)),
        sites_(find_contact_sites(loaded_.scene, loaded_.model)),
        assembly_(loaded_.model, loaded_.model.fixed_dofs()),
        linear_(compute_linear_dd(assembly_, sites_)) {
    SamplingPlan plan;
    plan.target = 1e-3;
    plan.jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const SampleStore store(samples, loaded_.model.file);
    results_ = sample_sites(assembly_, loaded_.scene, sites_, linear_, plan, {}, RestState(), &store);
    StaticSolver solver(assembly_);
    const RestState unloaded;
    for (size_t i = 0; i < results_.size(); ++i) {
      const int label = loaded_.model.labels[static_cast<size_t>(site(i).node)];
      SampleFile kept(store.file_of(label), store.binding_of(label));
      SiteSampler sampler(solver, sites_, site(i), unloaded, &kept);
      const std::optional<TaylorCoefficients> series =
          sampler.coefficients_at_rest(sites_.mean_surface_edge * site(i).frame);
      series_.push_back(unsampled_polynomial(
          linear_at(i), series.value(), site(i).frame.transpose() / loaded_.scene.max_displacement, false));
    }
    for (const SiteResult& result : results_) {
      for (const SurveySample& sample : result.survey)
        largest_force_ = std::max(largest_force_, sample.truth.force.norm());
    }
  }

  size_t num_sites() const { return results_.size(); }
  const ContactSite& site(size_t index) const { return sites_.sites[index]; }
  const Eigen::Vector3d& place(size_t index) const {
    return loaded_.model.positions[static_cast<size_t>(site(index).node)];
  }
  double edges_between(size_t one, size_t other) const {
    return (place(one) - place(other)).norm() / sites_.mean_surface_edge;
  }
  const std::vector<SurveySample>& survey(size_t index) const { return results_[index].survey; }
  const SitePolynomial& polynomial(size_t index) const { return results_[index].polynomial; }
  const SitePolynomial& series(size_t index) const { return series_[index]; }
  SiteLinearResponse linear_at(size_t index) const { return linear_response(linear_, site(index)); }

  std::optional<Placement> placement(SiteMap map, size_t from, size_t to) const {
    return place_contact(loaded_.model, sites_, map, site(from), site(to));
  }
  // Returns the model translated by `away`, for maps and tables.
  Model moved_by(const Eigen::Vector3d& away) const {
    Model model = loaded_.model;
    for (Eigen::Vector3d& position : model.positions) position += away;
    return model;
  }
  const ContactSites& sites() const { return sites_; }
  LocalTable table(const Placement& placement) const { return local_table(loaded_.model, sites_, placement); }
  std::vector<size_t> spread(size_t count) const { return spread_sites(loaded_.model, sites_, count); }

  // Returns the mean |u - d| over the nodes that a tool at the site holds, in the model's length unit.
  double mean_contacted_error(size_t index, const Eigen::VectorXd& field, const Eigen::Vector3d& d) const {
    double sum = 0;
    for (const int member : site(index).patch)
      sum += (field.segment<3>(3 * sites_.contact_nodes[static_cast<size_t>(member)]) - d).norm();
    return sum / static_cast<double>(site(index).patch.size());
  }

  void add(const SurveySample& sample, const Eigen::VectorXd& field, const Eigen::Vector3d& force,
           Errors& errors) const {
    const Sample& truth = sample.truth;
    const Eigen::VectorXd difference = field - truth.field;
    errors.displacement.push_back(difference.reshaped(3, difference.size() / 3).colwise().norm().maxCoeff() /
                                  truth.displacement.norm());
    errors.force.push_back((force - truth.force).norm() /
                           std::max(truth.force.norm(), 0.05 * largest_force_));
  }

 private:
  LoadedScene loaded_;
  ContactSites sites_;
  Assembly assembly_;
  LinearDd linear_;
  std::vector<SiteResult> results_;
  std::vector<SitePolynomial> series_;
  double largest_force_ = 0;
};

std::string percent(double part) {
  return fmt::format("{:.3g}", 100 * part);
}

std::vector<std::string> row_of(const std::string& name, const std::string& where, const Errors& errors) {
  return {name,
          where,
          fmt::format("{}", errors.displacement.size()),
          percent(quantile(errors.displacement, 0.5)),
          percent(quantile(errors.displacement, 0.95)),
          percent(quantile(errors.displacement, 1)),
          percent(quantile(errors.force, 0.95)),
          percent(quantile(errors.force, 1))};
}

const std::vector<std::string> kColumns = {"way", "edges away", "pushes",    "median",
                                           "p95", "max",        "force p95", "force max"};

// For each distance `edges`, tables errors at each site t of the response of the site s whose distance from t
// is nearest to `edges`. Exact linear parts and series are those of t.
StudyTable moved_table(const StudiedOrgan& organ) {
  StudyTable table(
      "moved",
      "Errors in percent at one site of the answer of another one, over the survey pushes of all sites.",
      kColumns);
  for (const double edges : {0.0, 1.0, 2.0, 3.0, 5.0}) {
    std::vector<std::pair<std::string, Errors>> ways = {{"not moved", {}},
                                                        {"eq. (25), printed sense", {}},
                                                        {"eq. (25), inverse sense", {}},
                                                        {"affine about the site", {}},
                                                        {"rigid along the surface", {}},
                                                        {"linear alone", {}},
                                                        {"linear + remainder", {}},
                                                        {"series to order 2", {}},
                                                        {"to order 3", {}},
                                                        {"to order 4", {}},
                                                        {"to order 5", {}},
                                                        {"to order 3 + remainder", {}}};
    int singular = 0;
    for (size_t t = 0; t < organ.num_sites(); ++t) {
      size_t s = t;
      double nearest = 1e300;
      for (size_t other = 0; other < organ.num_sites(); ++other) {
        const double deviation = std::abs(organ.edges_between(t, other) - edges);
        if (deviation < nearest) {
          nearest = deviation;
          s = other;
        }
      }
      if (nearest > 0.5) continue;
      const auto linear = organ.linear_at(t);
      constexpr std::array kMaps = {SiteMap::printed, SiteMap::inverse, SiteMap::affine, SiteMap::rigid};
      std::array<std::optional<SitePolynomial>, 4> by_map;
      std::optional<SitePolynomial> remainder;
      for (size_t m = 0; m < kMaps.size(); ++m) {
        const auto placement = organ.placement(kMaps[m], s, t);
        if (!placement) {
          ++singular;
          continue;
        }
        const LocalTable lookups = organ.table(*placement);
        by_map[m] = moved(organ.polynomial(s), *placement, lookups);
        if (kMaps[m] != SiteMap::rigid) continue;
        remainder = moved_remainder(organ.polynomial(s), *placement, lookups);
      }
      for (const SurveySample& sample : organ.survey(t)) {
        if (!sample.solved) continue;
        const Eigen::Vector3d& d = sample.truth.displacement;
        const auto answer = [&](size_t way, const SitePolynomial& polynomial) {
          organ.add(sample, field_at(polynomial, d), force_at(polynomial, d), ways[way].second);
        };
        answer(0, organ.polynomial(s));
        for (size_t m = 0; m < kMaps.size(); ++m) {
          if (by_map[m]) answer(m + 1, *by_map[m]);
        }
        organ.add(sample, linear.field * d, linear.stiffness * d, ways[5].second);
        organ.add(sample, linear.field * d + field_at(*remainder, d),
                  linear.stiffness * d + force_at(*remainder, d), ways[6].second);
        for (const int order : {2, 3, 4, 5})
          answer(static_cast<size_t>(order) + 5, orders_of(organ.series(t), 1, order));
        const SitePolynomial exact = orders_of(organ.series(t), 1, 3);
        const SitePolynomial beyond = orders_of(*remainder, 4, remainder->degree);
        organ.add(sample, field_at(exact, d) + field_at(beyond, d), force_at(exact, d) + force_at(beyond, d),
                  ways[11].second);
      }
    }
    for (const auto& [name, errors] : ways) {
      if (!errors.displacement.empty()) table.add(row_of(name, fmt::format("{:g}", edges), errors));
    }
    if (singular > 0) fmt::print("{} maps at {:g} edges are singular\n", singular, edges);
  }
  return table;
}

// Tables errors at sites t that are left out of a spread of `count` sites: the linear part is that of t, the
// remainders come from near sites.
StudyTable blended_table(const StudiedOrgan& organ) {
  StudyTable table(
      "blended",
      "Errors in percent where there is no site: exact linear answer and the remainders of sites nearby.",
      {"sites", "blended", "edges to the nearest", "pushes", "median", "p95", "max", "force p95",
       "force max"});
  for (const size_t count : {10, 16, 24, 36}) {
    const std::vector<size_t> kept = organ.spread(count);
    for (const size_t num_blended : {1, 3, 5, 7, 9}) {
      Errors errors;
      double farthest = 0;
      for (size_t t = 0; t < organ.num_sites(); ++t) {
        if (std::find(kept.begin(), kept.end(), t) != kept.end()) continue;
        std::vector<size_t> near = kept;
        std::sort(near.begin(), near.end(), [&](size_t one, size_t other) {
          return organ.edges_between(t, one) < organ.edges_between(t, other);
        });
        farthest = std::max(farthest, organ.edges_between(t, near.front()));
        // site_weights() gives the farthest site 0.
        near.resize(std::min(near.size(), num_blended + (num_blended > 1 ? 1 : 0)));
        std::vector<Eigen::Vector3d> places;
        places.reserve(near.size());
        for (const size_t s : near) places.push_back(organ.place(s));
        const std::vector<double> weights = num_blended == 1
                                                ? std::vector<double>{1}
                                                : site_weights(places, organ.place(t), organ.site(t).inward);
        std::vector<SitePolynomial> remainders;
        remainders.reserve(near.size());
        for (const size_t s : near) {
          const auto placement = organ.placement(SiteMap::rigid, s, t);
          remainders.push_back(moved_remainder(organ.polynomial(s), *placement, organ.table(*placement)));
        }
        const auto linear = organ.linear_at(t);
        for (const SurveySample& sample : organ.survey(t)) {
          if (!sample.solved) continue;
          const Eigen::Vector3d& d = sample.truth.displacement;
          Eigen::VectorXd field = linear.field * d;
          Eigen::Vector3d force = linear.stiffness * d;
          for (size_t i = 0; i < near.size(); ++i) {
            field += weights[i] * field_at(remainders[i], d);
            force += weights[i] * force_at(remainders[i], d);
          }
          organ.add(sample, field, force, errors);
        }
      }
      std::vector<std::string> row = row_of(fmt::format("{}", count), fmt::format("{}", num_blended), errors);
      row.insert(row.begin() + 2, fmt::format("up to {:.2g}", farthest));
      table.add(row);
    }
  }
  return table;
}

// Tables the measure of the paper's section 3.4: the deviation of the nodes that a tool at t holds from the
// tool's d.
StudyTable contacted_table(const StudiedOrgan& organ) {
  StudyTable table("contacted",
                   "Mean error of the contacted nodes, in mm, of the answer of a site so many edges away; "
                   "pushes to 8.24 mm.",
                   {"edges away", "pairs", "not moved", "eq. (25) as printed", "eq. (25) inverse",
                    "affine about the site", "rigid along the surface", "linear + remainder"});
  for (const double edges : {0.5, 1.0, 2.0, 3.0, 5.0}) {
    std::array<double, 6> sums = {};
    std::array<int, 6> counts = {};
    int pairs = 0;
    for (size_t s = 0; s < organ.num_sites(); ++s) {
      for (size_t t = 0; t < organ.num_sites(); ++t) {
        if (s == t || std::abs(organ.edges_between(s, t) - edges) > 0.25) continue;
        ++pairs;
        const SiteLinearResponse linear = organ.linear_at(t);
        const auto add = [&](size_t way, const SitePolynomial& polynomial, bool is_remainder) {
          for (const SurveySample& sample : organ.survey(t)) {
            const Eigen::Vector3d& d = sample.truth.displacement;
            Eigen::VectorXd field = field_at(polynomial, d);
            if (is_remainder) field += linear.field * d;
            sums[way] += organ.mean_contacted_error(t, field, d);
            ++counts[way];
          }
        };
        add(0, organ.polynomial(s), false);
        constexpr std::array kMaps = {SiteMap::printed, SiteMap::inverse, SiteMap::affine, SiteMap::rigid};
        for (size_t m = 0; m < kMaps.size(); ++m) {
          const auto placement = organ.placement(kMaps[m], s, t);
          if (!placement) continue;
          const LocalTable lookups = organ.table(*placement);
          add(m + 1, moved(organ.polynomial(s), *placement, lookups), false);
          if (kMaps[m] == SiteMap::rigid)
            add(5, moved_remainder(organ.polynomial(s), *placement, lookups), true);
        }
      }
    }
    std::vector<std::string> row = {fmt::format("{:g}", edges), fmt::format("{}", pairs)};
    for (size_t way = 0; way < sums.size(); ++way)
      row.push_back(counts[way] == 0 ? "-" : fmt::format("{:.2f}", sums[way] / counts[way]));
    table.add(row);
  }
  return table;
}

// Translates the organ. Compares eq. (25), which is linear through the origin, with maps about the site.
StudyTable origin_table(const StudiedOrgan& organ) {
  StudyTable table(
      "origin",
      "Maps to sites two edges away (within a quarter), the brain moved as a whole; mean error of the "
      "contacted nodes in mm, pushes to 8.24 mm. Singular: pairs for which the map does not exist.",
      {"moved by (mm)", "pairs", "map", "singular", "condition, median", "largest", "mean error"});
  for (const double away : {0.0, 1e2, 1e4, 1e6, 1e9}) {
    const Model model = organ.moved_by(Eigen::Vector3d(0.6, -0.48, 0.64) * away);
    for (const auto& [name, map] : {std::pair("eq. (25), inverse", SiteMap::inverse),
                                    {"affine about the site", SiteMap::affine},
                                    {"rigid along the surface", SiteMap::rigid}}) {
      int pairs = 0;
      int singular = 0;
      std::vector<double> conditions;
      std::vector<double> errors;
      for (size_t s = 0; s < organ.num_sites(); ++s) {
        for (size_t t = 0; t < organ.num_sites(); ++t) {
          if (s == t || std::abs(organ.edges_between(s, t) - 2) > 0.25) continue;
          ++pairs;
          const auto placement = place_contact(model, organ.sites(), map, organ.site(s), organ.site(t));
          if (!placement) {
            ++singular;
            continue;
          }
          conditions.push_back(placement->condition);
          const SitePolynomial answer =
              moved(organ.polynomial(s), *placement, local_table(model, organ.sites(), *placement));
          for (const SurveySample& sample : organ.survey(t)) {
            const Eigen::Vector3d& d = sample.truth.displacement;
            errors.push_back(organ.mean_contacted_error(t, field_at(answer, d), d));
          }
        }
      }
      const auto number = [](const std::vector<double>& values, double value, const char* format) {
        return values.empty() ? std::string("-") : fmt::format(fmt::runtime(format), value);
      };
      double sum = 0;
      for (const double error : errors) sum += error;
      table.add({fmt::format("{:g}", away), std::to_string(pairs), name, std::to_string(singular),
                 number(conditions, quantile(conditions, 0.5), "{:.2g}"),
                 number(conditions, quantile(conditions, 1), "{:.2g}"),
                 number(errors, sum / static_cast<double>(errors.size()), "{:.2f}")});
    }
  }
  return table;
}

void run_study(const std::filesystem::path& scene, const std::filesystem::path& folder) {
  const StudiedOrgan organ(scene, folder / "samples");
  for (const StudyTable& table :
       {moved_table(organ), contacted_table(organ), origin_table(organ), blended_table(organ)}) {
    study::write_text(folder / (table.name() + ".md"), table.markdown());
    study::write_text(folder / (table.name() + ".csv"), table.csv());
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  try {
    if (argc != 3) throw std::invalid_argument("usage: palpate_study_sites SCENE DIR");
    std::filesystem::create_directories(argv[2]);
    palpate::run_study(argv[1], argv[2]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
