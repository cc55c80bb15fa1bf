// Repeats tables 2 and 3 of Zhong et al. 2005 on its cylinder, with the paper's sampling and fit and with
// ours. Also measures the error of each off the ray of its samples.
//
//   palpate_study_polynomials DIR     writes DIR/table2.md, DIR/table3.md, DIR/off_axis.md and their CSVs
#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/solver/study_table.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/paper_quadratic.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/paper_cylinder.hpp"

namespace palpate::test {
namespace {

using study::StudyTable;

// The paper's errors in percent: each row of table 2, and both ends of the path of table 3.
constexpr std::array<double, 9> kPaperErrors = {-1.075,  1.6656, 5.2912,  9.6448, 14.6772,
                                                20.5463, 27.274, 34.8015, 42.9465};
constexpr double kPaperAtOnce = 56.1622;
constexpr double kPaperInSteps = 0.0;

class Cylinder {
 public:
  Cylinder()
      : loaded_(read_scene(std::filesystem::path(PALPATE_SOURCE_DIR) / "models/cylinder/cylinder.toml")),
        sites_(find_contact_sites(loaded_.scene, loaded_.model)),
        assembly_(loaded_.model, loaded_.model.fixed_dofs()),
        linear_(compute_linear_dd(assembly_, sites_)),
        solver_(assembly_),
        p1_(marked_node(loaded_.model, "P1")),
        pm_(marked_node(loaded_.model, "PM")) {}
  Cylinder(const Cylinder&) = delete;
  Cylinder& operator=(const Cylinder&) = delete;

  // Returns the tip's displacement under each force along z. Each solve starts from the last.
  std::vector<Eigen::Vector3d> tips_under(const std::vector<double>& forces) const {
    LoadedCylinder body(loaded_.model);
    std::vector<Eigen::Vector3d> tips;
    for (const double force : forces) {
      const auto u = body.under(force);
      if (!u) throw std::runtime_error(fmt::format("no equilibrium at {}", force));
      tips.push_back(u->segment<3>(Eigen::Index{3} * p1_));
    }
    return tips;
  }

  // Returns the full solve at a displacement of the tip, in four increments or more from rest.
  Sample solved(const Eigen::Vector3d& tip) {
    SiteSampler sampler(solver_, sites_, site(), rest_);
    Sample sample;
    if (!sampler.solve_from_rest(tip, 4, sample)) throw std::runtime_error("no equilibrium for a tip");
    return sample;
  }

  // Fits the paper's quadratic to solves at these displacements of the tip.
  SitePolynomial paper_fit(const std::vector<Eigen::Vector3d>& tips) {
    SiteSamples samples;
    samples.linear = linear_response(linear_, site());
    double reach = 0;
    for (const Eigen::Vector3d& tip : tips) {
      samples.samples.push_back(solved(tip));
      reach = std::max(reach, tip.norm());
    }
    samples.to_unit = Eigen::Matrix3d::Identity() / reach;
    return fit_paper_quadratic(samples);
  }

  // Returns the fit of a build for |d| up to `reach`, with this method and target, and 200 survey pushes.
  SiteResult fit(double reach, PolynomialMethod method, double target) {
    Scene scene = loaded_.scene;
    scene.max_displacement = reach;
    scene.polynomial_method = method;
    SamplingPlan plan;
    plan.target = target;
    plan.survey_samples = 200;
    return sample_sites(assembly_, scene, sites_, linear_, plan).front();
  }

  // Returns the tool's force for this field by eq. (4), from the elements around the contact.
  Eigen::Vector3d element_force(const Eigen::VectorXd& field) const {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(assembly_.num_dofs());
    for (size_t node = 0; node < sites_.packed_nodes.size(); ++node)
      u.segment<3>(3 * sites_.packed_nodes[node]) = field.segment<3>(3 * static_cast<Eigen::Index>(node));
    Eigen::VectorXd force;
    assembly_.internal_force(u, force);
    return force.segment<3>(3 * p1_);
  }
  double pm_z(const Eigen::VectorXd& field) const { return field[row_of_pm() + 2]; }
  static double error(const SitePolynomial& polynomial, const Sample& truth) {
    const Eigen::VectorXd difference = field_at(polynomial, truth.displacement) - truth.field;
    return difference.reshaped(3, difference.size() / 3).colwise().norm().maxCoeff() /
           truth.displacement.norm();
  }

 private:
  const ContactSite& site() const { return sites_.sites.front(); }
  Eigen::Index row_of_pm() const {
    for (size_t node = 0; node < sites_.packed_nodes.size(); ++node) {
      if (sites_.packed_nodes[node] == pm_) return 3 * static_cast<Eigen::Index>(node);
    }
    throw std::runtime_error("P_m is not packed");
  }

  LoadedScene loaded_;
  ContactSites sites_;
  Assembly assembly_;
  LinearDd linear_;
  StaticSolver solver_;
  RestState rest_;
  int p1_;  // node of the paper's P1, the tip
  int pm_;  // node of the paper's P_m
};

std::string percent(double part) {
  return fmt::format("{:.3g}", 100 * part);
}

// Returns the error in the paper's measure (z at P_m), and the largest error of any node over |d|: percent.
std::vector<std::string> both_errors(const Cylinder& cylinder, const SitePolynomial& polynomial,
                                     const Sample& truth) {
  const double z = cylinder.pm_z(truth.field);
  return {percent((cylinder.pm_z(field_at(polynomial, truth.displacement)) - z) / z),
          percent(Cylinder::error(polynomial, truth))};
}

// Returns the gradient of the energy: force unit.
Eigen::Vector3d gradient_at(const SitePolynomial& polynomial, const Eigen::Vector3d& d) {
  const Eigen::Vector3d x = polynomial.to_unit * d;
  return polynomial.to_unit.transpose() *
         (hermite_rows(x, 2, polynomial.degree + 1, 1).bottomRows<3>() * polynomial.energy);
}

void append(std::vector<std::string>& row, const std::vector<std::string>& cells) {
  row.insert(row.end(), cells.begin(), cells.end());
}

void write(const StudyTable& table, const std::filesystem::path& folder, const std::string& name) {
  study::write_text(folder / (name + ".md"), table.markdown());
  study::write_text(folder / (name + ".csv"), table.csv());
}

// Compares the force as the gradient of the energy with the paper's force, by eq. (4) from displacements.
StudyTable force_table(Cylinder& cylinder) {
  StudyTable table(
      "force",
      "Errors of the force in percent of the force, over the same 200 pushes, below a tenth of the range "
      "left out: of displacements from the solver, rounded to single precision as they are kept, and of the "
      "polynomial's.",
      {"strain %", "gradient, p95", "gradient, max", "eq. (4), solver's u, max", "eq. (4), p95",
       "eq. (4), max"});
  for (const double strain : {0.1, 0.2, 0.23, 0.3, 0.4}) {
    const double reach = strain * kPaperHeight;
    const SiteResult result = cylinder.fit(reach, PolynomialMethod::hermite, 1e-3);
    std::vector<double> gradient;
    std::vector<double> solver;
    std::vector<double> elements;
    for (const auto& [site, truth, solved] : result.survey) {
      if (truth.displacement.norm() < 0.1 * reach) continue;
      const double size = truth.force.norm();
      gradient.push_back((gradient_at(result.polynomial, truth.displacement) - truth.force).norm() / size);
      solver.push_back((cylinder.element_force(truth.field) - truth.force).norm() / size);
      const Eigen::VectorXd field = field_at(result.polynomial, truth.displacement);
      elements.push_back((cylinder.element_force(field) - truth.force).norm() / size);
    }
    table.add({fmt::format("{:g}", 100 * strain), percent(quantile(gradient, 0.95)),
               percent(quantile(gradient, 1.0)), percent(quantile(solver, 1.0)),
               percent(quantile(elements, 0.95)), percent(quantile(elements, 1.0))});
  }
  return table;
}

void study(const std::filesystem::path& folder) {
  Cylinder cylinder;
  std::vector<double> sampled;
  std::vector<double> tested;
  for (int i = 1; i <= 10; ++i) sampled.push_back(-8.0 * i);
  for (int i = 1; i <= 9; ++i) tested.push_back(-8.0 * i + 4);
  const std::vector<Eigen::Vector3d> tips = cylinder.tips_under(sampled);
  const std::vector<Eigen::Vector3d> test_tips = cylinder.tips_under(tested);
  constexpr double kHeight = kPaperHeight;
  constexpr double kFine = 1e-3;
  constexpr double kCoarse = 5e-3;  // a finer target would shrink the domain at 40 % strain
  const SitePolynomial ray = cylinder.paper_fit(tips);
  const SiteResult grid = cylinder.fit(test_tips.back().norm(), PolynomialMethod::paper_grid, kFine);
  const SiteResult ours =
      cylinder.fit(test_tips.back().norm() * (1 + 1e-12), PolynomialMethod::hermite, kFine);

  StudyTable table2(
      "table2",
      fmt::format(
          "Errors in percent at P_m's z, the paper's measure, and at any node as part of |d|. Ray: a "
          "quadratic through the paper's ten forces. Grid: one through {} displacements. Ours: degree {} "
          "from {} solves.",
          grid.samples, ours.polynomial.degree, ours.samples),
      {"force", "-uz of P1", "strain %", "paper, P_m z", "ray, P_m z", "ray, any node", "grid, P_m z",
       "grid, any node", "ours, P_m z", "ours, any node"});
  for (size_t i = 0; i < tested.size(); ++i) {
    const Sample truth = cylinder.solved(test_tips[i]);
    std::vector<std::string> row = {fmt::format("{:g}", tested[i]), fmt::format("{:.4g}", -test_tips[i].z()),
                                    fmt::format("{:.3g}", 100 * test_tips[i].norm() / kHeight),
                                    fmt::format("{:.3g}", kPaperErrors[i])};
    for (const SitePolynomial* one : {&ray, &grid.polynomial, &ours.polynomial})
      append(row, both_errors(cylinder, *one, truth));
    table2.add(row);
  }
  write(table2, folder, "table2");

  // Compares -80 at once with the last of ten steps of -8.
  StudyTable table3(
      "table3",
      "The same at the last of the ray's own ten samples: -80, at once and in ten steps of -8. Ours is "
      "sampled as far.",
      {"load", "uz of P1", "paper, P_m z", "ray, P_m z", "ray, any node", "ours, P_m z", "ours, any node"});
  const Eigen::Vector3d at_once = cylinder.tips_under({-80.0}).front();
  const SiteResult farther = cylinder.fit(at_once.norm() * (1 + 1e-12), PolynomialMethod::hermite, kFine);
  for (const auto& [name, tip, paper] : {std::tuple("-80 at once", at_once, kPaperAtOnce),
                                         std::tuple("ten times -8", tips.back(), kPaperInSteps)}) {
    const Sample truth = cylinder.solved(tip);
    std::vector<std::string> row = {name, fmt::format("{:.6g}", tip.z()), fmt::format("{:.3g}", paper)};
    for (const SitePolynomial* one : {&ray, &farther.polynomial})
      append(row, both_errors(cylinder, *one, truth));
    table3.add(row);
  }
  write(table3, folder, "table3");

  StudyTable off_axis(
      "off_axis",
      "Any node, percent of |d|, over 200 pushes in all directions that no fit has seen. Ours to a "
      "target of 0.1 %, at 40 % strain of 0.5: there the finer one would end the domain sooner.",
      {"strain %", "way", "solves", "degree", "median", "p95", "max"});
  for (const double strain : {0.1, 0.2, 0.23, 0.3, 0.4}) {
    const double reach = strain * kHeight;
    for (const auto& [name, method] : {std::pair("paper, ray", PolynomialMethod::paper_ray),
                                       std::pair("paper, grid", PolynomialMethod::paper_grid),
                                       std::pair("ours", PolynomialMethod::hermite)}) {
      const SiteResult result = cylinder.fit(reach, method, strain < 0.35 ? kFine : kCoarse);
      std::vector<double> errors;
      if (result.unsolved > 0 || is_shortened(least_reach(result.polynomial.to_unit), reach))
        throw std::runtime_error(fmt::format("not all pushes to {:g} % strain are to be had", 100 * strain));
      for (const SurveySample& sample : result.survey)
        errors.push_back(Cylinder::error(result.polynomial, sample.truth));
      off_axis.add({fmt::format("{:g}", 100 * strain), name, fmt::format("{}", result.samples),
                    fmt::format("{}", result.polynomial.degree), percent(quantile(errors, 0.5)),
                    percent(quantile(errors, 0.95)), percent(quantile(errors, 1.0))});
    }
  }
  write(off_axis, folder, "off_axis");
  write(force_table(cylinder), folder, "force");
}

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  try {
    if (argc != 2) throw std::invalid_argument("usage: palpate_study_polynomials DIR");
    std::filesystem::create_directories(argv[1]);
    palpate::test::study(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
