// Repeats figures 3, 4 and 5 of Zhong et al. 2005 section 2.4 on its cylinder, the difference between its eq.
// (1) and Abaqus' eq. (11), and its experiment with 0.998 x 2 ln J.
//
//   palpate_study_paper DIR     writes DIR/paper_*.csv, for plot_paper.py, and the tables DIR/paper.md
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/solver/paper_laws.hpp"
#include "bench/solver/paper_paths.hpp"
#include "bench/solver/small_newton.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "tests/support/paper_cylinder.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {
namespace {

constexpr int kTableForces[] = {0, 5, 10, 20, 40, 52, 60, 80};  // 0 stands for kTiny
constexpr double kRatios[] = {1, 100, 1000};                    // lambda over the paper's
constexpr double kPenalty = 0.998;                              // the paper's factor on 2 ln J

// Force and -uz of P1 in the paper's tables 2 and 3, on the paper's mesh.
constexpr std::pair<double, double> kPaperPush[] = {
    {4, 0.327541}, {12, 0.955437}, {20, 1.55091}, {28, 2.11458}, {36, 2.64742},
    {44, 3.14994}, {52, 3.62138},  {60, 4.05941}, {68, 4.46167}, {80, 4.99196}};

class Study {
 public:
  explicit Study(std::filesystem::path directory)
      : directory_(std::move(directory)),
        model_(paper_cylinder(PALPATE_SOURCE_DIR, CompressibleNeoHookean{kPaperMu, kPaperLambda})),
        markdown_(directory_ / "paper.md") {}

  void run() {
    for (const double ratio : kRatios) answers_.emplace(ratio, solve_all(ratio));
    figures_3_to_5();
    linearity();
    shear_energies();
    differences();
    small_loads();
    penalty();
    if (!markdown_.flush()) throw std::runtime_error("cannot write " + directory_.string());
  }

 private:
  double component(const Eigen::VectorXd& displacement, const char* set, int axis) const {
    return displacement[3 * marked_node(model_, set) + axis];
  }
  double tip(const Paths& paths, int sign, size_t index) const {
    return component(paths.at(sign)[index], "P1", 2);
  }
  // Returns the mean det F under the tip: current over reference volume of the elements at P1.
  double volume_at_tip(const Paths& paths, int sign, size_t index) const {
    const int tip_node = marked_node(model_, "P1");
    double rest = 0;
    double now = 0;
    for (const Tetrahedron& element : model_.elements) {
      const auto nodes = element.corners();
      if (std::find(nodes.begin(), nodes.end(), tip_node) == nodes.end()) continue;
      Eigen::Matrix<double, 3, 4> positions;
      Eigen::Matrix<double, 3, 4> moved;
      for (int a = 0; a < 4; ++a) {
        const int node = nodes[static_cast<size_t>(a)];
        positions.col(a) = model_.positions[static_cast<size_t>(node)];
        moved.col(a) = positions.col(a) + paths.at(sign)[index].segment<3>(3 * node);
      }
      rest += ShapeAtPoint<4>(positions, 0).volume;
      now += ShapeAtPoint<4>(moved, 0).volume;
    }
    return now / rest;
  }
  // Returns the relative excess of the tip's displacement in `other` over eq. (1).
  double excess(const Paths& other, double ratio, int sign, size_t index) const {
    return tip(other, sign, index) / tip(answers_.at(ratio).equation_1, sign, index) - 1;
  }

  void table(const std::string& caption, const std::string& header) {
    const auto columns = std::count(header.begin(), header.end(), '|') - 1;
    fmt::print(markdown_, "\n{}\n\n{}\n|", caption, header);
    for (long column = 0; column < columns; ++column) fmt::print(markdown_, "---:|");
    fmt::print(markdown_, "\n");
  }
  template <typename... T>
  void row(fmt::format_string<T...> format, T&&... values) {
    fmt::print(markdown_, "{}\n", fmt::format(format, std::forward<T>(values)...));
  }
  std::ofstream csv(const char* name, const char* header) const {
    std::ofstream file(directory_ / name);
    file << header << "\n";
    return file;
  }
  // Calls visit(sign, index) from the largest push to the largest pull.
  template <typename Visitor>
  static void for_table_forces(Visitor&& visit) {
    for (const int sign : {-1, 1}) {
      std::vector<int> forces(std::begin(kTableForces), std::end(kTableForces));
      if (sign < 0) std::reverse(forces.begin(), forces.end());
      for (const int force : forces) visit(sign, static_cast<size_t>(force));
    }
  }

  void figures_3_to_5() {
    const LawPaths& answers = answers_.at(1);
    const Paths linear = solved(LinearElastic{kPaperMu, kPaperLambda});
    std::ofstream file = csv("paper_curves.csv", "law,force,p1_z,p2_y,p3_x,p3_y,p3_z");
    for (const auto& [name, paths] :
         {std::pair{"eq1", &answers.equation_1}, std::pair{"eq11", &answers.equation_11},
          std::pair{"eq11_matched", &answers.matched}, std::pair{"linear", &linear}}) {
      for (const auto& [sign, path] : *paths) {
        for (size_t index = 0; index < path.size(); ++index) {
          fmt::print(file, "{},{}", name, force_at(sign, index));
          for (const auto& [set, axis] : {std::pair{"P1", 2}, {"P2", 1}, {"P3", 0}, {"P3", 1}, {"P3", 2}})
            fmt::print(file, ",{:.8g}", component(path[index], set, axis));
          fmt::print(file, "\n");
        }
      }
    }
    std::ofstream paper = csv("paper_table2.csv", "force,p1_z");
    for (const auto& [force, depth] : kPaperPush) fmt::print(paper, "{},{}\n", -force, -depth);

    table(
        "z of P1 under a force along z (figure 3; kappa: bulk modulus at rest), and J, the volume of the "
        "elements at P1 over that at rest.",
        "| force | eq. (1) | eq. (11), kappa = lambda | eq. (11), kappa = lambda + 2 mu/3 | linear | J, (1) "
        "| J, (11) |");
    for_table_forces([&](int sign, size_t i) {
      row("| {:g} | {:#.4g} | {:#.4g} | {:#.4g} | {:#.4g} | {:.2f} | {:.2f} |", force_at(sign, i),
          tip(answers.equation_1, sign, i), tip(answers.equation_11, sign, i), tip(answers.matched, sign, i),
          tip(linear, sign, i), volume_at_tip(answers.equation_1, sign, i),
          volume_at_tip(answers.equation_11, sign, i));
    });
    table("y of P2, and x, y, z of P3 (figures 4 and 5a); in each cell eq. (1) / eq. (11), kappa = lambda.",
          "| force | P2 y | P3 x | P3 y | P3 z |");
    for_table_forces([&](int sign, size_t i) {
      const Eigen::VectorXd& one = answers.equation_1.at(sign)[i];
      const Eigen::VectorXd& two = answers.equation_11.at(sign)[i];
      const auto both = [&](const char* set, int axis) {
        return fmt::format("{:#.3g} / {:#.3g}", component(one, set, axis), component(two, set, axis));
      };
      row("| {:g} | {} | {} | {} | {} |", force_at(sign, i), both("P2", 1), both("P3", 0), both("P3", 1),
          both("P3", 2));
    });
  }

  // Returns the depth, by interpolation, where a curve of (force, depth) deviates by `part` from the line
  // through rest and the first point. Negative where the curve stays nearer.
  static double departure(const std::vector<std::pair<double, double>>& curve, double part) {
    const auto deviation = [&](size_t i) {
      return std::abs(curve[i].second / curve[i].first * curve[0].first / curve[0].second - 1);
    };
    for (size_t i = 1; i < curve.size(); ++i) {
      if (deviation(i) < part) continue;
      const double t = (part - deviation(i - 1)) / (deviation(i) - deviation(i - 1));
      return curve[i - 1].second + t * (curve[i].second - curve[i - 1].second);
    }
    return -1;
  }
  // Returns the deviation of the secant at `depth` from the first point's secant, by interpolation.
  static double deviation_at(const std::vector<std::pair<double, double>>& curve, double depth) {
    size_t i = 1;
    while (i + 1 < curve.size() && curve[i].second < depth) ++i;
    const double t = (depth - curve[i - 1].second) / (curve[i].second - curve[i - 1].second);
    const double force = curve[i - 1].first + t * (curve[i].first - curve[i - 1].first);
    return depth / force * curve[0].first / curve[0].second - 1;
  }

  void linearity() {
    const LawPaths& answers = answers_.at(1);
    std::vector<std::pair<std::string, std::vector<std::pair<double, double>>>> curves;
    for (const auto& [name, paths] : {std::pair{"eq. (1)", &answers.equation_1},
                                      std::pair{"eq. (11), kappa = lambda", &answers.equation_11},
                                      std::pair{"eq. (11), kappa = lambda + 2 mu/3", &answers.matched}}) {
      for (const int sign : {-1, 1}) {
        std::vector<std::pair<double, double>> curve;
        for (size_t i = 0; i <= kLargest; ++i)
          curve.emplace_back(std::abs(force_at(sign, i)), std::abs(tip(*paths, sign, i)));
        curves.emplace_back(fmt::format("{}, {}", name, sign < 0 ? "pushed" : "pulled"), curve);
      }
    }
    curves.emplace_back("the paper's table 2, pushed, from its force 4",
                        std::vector(std::begin(kPaperPush), std::end(kPaperPush)));
    table("Where the tip leaves the straight line: secant compliance against that at rest.",
          "| curve | 5 % off at depth / height | off at depth / height = 18 % |");
    for (const auto& [name, curve] : curves)
      row("| {} | {:.1f} % | {:+.1f} % |", name, 100 * departure(curve, 0.05) / kPaperHeight,
          100 * deviation_at(curve, 0.18 * kPaperHeight));
  }

  // Figure 5b: mu/2 (I - 3 - 2 ln J) and mu/2 (J^(-2/3) I - 3) at I = 4.2. No deformation has I < 3 J^(2/3).
  void shear_energies() {
    constexpr double kInvariant = 4.2;
    const double largest = std::pow(kInvariant / 3, 1.5);
    std::ofstream file = csv("paper_shear_energy.csv", "J,eq1,eq11");
    for (int i = 0; i <= 100; ++i) {
      const double J = 0.4 + (largest - 0.4) * i / 100;
      fmt::print(file, "{:.6f},{:.8g},{:.8g}\n", J, kPaperMu / 2 * (kInvariant - 3 - 2 * std::log(J)),
                 kPaperMu / 2 * (std::pow(J, -2.0 / 3.0) * kInvariant - 3));
    }
  }

  void differences() {
    // Relative to eq. (1), the step from eq. (11) to eq. (11) + V is the effect of V. The further step to
    // eq. (1) is the effect of C. The sum of both is `whole`.
    const auto coupling = [&](double ratio, int sign, size_t i) {
      return excess(answers_.at(ratio).without_coupling, ratio, sign, i);
    };
    const auto whole = [&](double ratio, int sign, size_t i) {
      return excess(answers_.at(ratio).equation_11, ratio, sign, i);
    };
    const auto matched = [&](double ratio, int sign, size_t i) {
      return excess(answers_.at(ratio).matched, ratio, sign, i);
    };
    std::ofstream file =
        csv("paper_difference.csv", "lambda_over_mu,force,eq11,eq11_matched,volume,coupling");
    for (const double ratio : kRatios)
      for (const int sign : {-1, 1})
        for (size_t i = 0; i <= kLargest; ++i)
          fmt::print(file, "{:.4g},{},{:.6g},{:.6g},{:.6g},{:.6g}\n", ratio * kPaperLambda / kPaperMu,
                     force_at(sign, i), whole(ratio, sign, i), matched(ratio, sign, i),
                     whole(ratio, sign, i) - coupling(ratio, sign, i), coupling(ratio, sign, i));
    const auto pairs_table = [&](const std::string& caption, const auto& first, const auto& second) {
      table(caption, "| force | lambda/mu = 0.4167 | 41.67 | 416.7 |");
      for_table_forces([&](int sign, size_t i) {
        std::string cells;
        for (const double ratio : kRatios)
          cells +=
              fmt::format(" {:+.2f} / {:+.2f} |", 100 * first(ratio, sign, i), 100 * second(ratio, sign, i));
        row("| {:g} |{}", force_at(sign, i), cells);
      });
    };
    pairs_table(
        "By how much the tip moves further by eq. (11) than by eq. (1), %: kappa = lambda / kappa = lambda + "
        "2 mu/3.",
        whole, matched);
    pairs_table(
        "The first of these split in two: what the volume term V does / what the coupling C does.",
        [&](double ratio, int sign, size_t i) { return whole(ratio, sign, i) - coupling(ratio, sign, i); },
        coupling);
  }

  // Returns the compliance of the tip at small strain, uz / force.
  static double compliance(const Law& law, bool ten_nodes) {
    Model model = paper_cylinder(PALPATE_SOURCE_DIR, law);
    if (ten_nodes) {
      model.fixed.clear();
      model = with_fixed_base(with_middle_nodes(std::move(model)));
    }
    LoadedCylinder body(std::move(model));
    const std::optional<Eigen::VectorXd> displacement = body.under(kTiny);
    if (!displacement) throw std::runtime_error("no equilibrium near rest");
    return (*displacement)[3 * marked_node(body.model(), "P1") + 2] / kTiny;
  }

  // The compliance C at small strain is twice the energy of a unit force. Hence - d ln C / d ln kappa is the
  // volumetric part of the energy, between 0 and 1 on any body and mesh. The tip therefore
  // differs by at most the difference of the bulk moduli.
  void small_loads() {
    table(
        "At rest, on four-node / ten-node tetrahedra: the tip's compliance, the volumetric part of "
        "the energy, and eq. (11), kappa = lambda, beyond eq. (1), with its bound 2 mu / (3 lambda).",
        "| lambda/mu | Poisson's ratio, (1) / (11) | compliance | volumetric | difference | bound |");
    for (const double ratio : kRatios) {
      const double lambda = ratio * kPaperLambda;
      std::array<double, 2> at_rest{};
      std::array<double, 2> volumetric{};
      std::array<double, 2> difference{};
      for (const bool ten_nodes : {false, true}) {
        // Returns the compliance by linear elasticity with `part` times the bulk modulus of eq. (1).
        const auto linear = [&](double part) {
          const double kappa = part * (lambda + 2 * kPaperMu / 3);
          return compliance(LinearElastic{kPaperMu, kappa - 2 * kPaperMu / 3}, ten_nodes);
        };
        constexpr double kStep = 1e-3;
        at_rest[ten_nodes] = linear(1);
        volumetric[ten_nodes] = std::log(linear(1 - kStep) / linear(1 + kStep)) / (2 * kStep);
        difference[ten_nodes] = linear(lambda / (lambda + 2 * kPaperMu / 3)) / at_rest[ten_nodes] - 1;
      }
      row("| {:.4g} | {:.4f} / {:.4f} | {:.4f} / {:.4f} | {:.3f} / {:.3f} | {:.3f} % / {:.3f} % | {:.2f} % |",
          lambda / kPaperMu, small_strain_moduli(CompressibleNeoHookean{kPaperMu, lambda}).poisson_ratio(),
          small_strain_moduli(equation_11(kPaperMu, lambda)).poisson_ratio(), at_rest[0], at_rest[1],
          volumetric[0], volumetric[1], 100 * difference[0], 100 * difference[1],
          100 * 2 * kPaperMu / (3 * lambda));
    }
  }

  void penalty() {
    constexpr double kAgreement = 1e-8;  // between SmallNewton and StaticSolver, length unit
    const Paths check = solved_by_small_newton([](const Eigen::Matrix3d& F) { return with_penalty(1.0, F); });
    double distance = 0;
    for (const int sign : {-1, 1})
      for (size_t i = 0; i <= kLargest; ++i)
        distance = std::max(
            distance, (check.at(sign)[i] - answers_.at(1).equation_1.at(sign)[i]).cwiseAbs().maxCoeff());
    if (!(distance <= kAgreement))
      throw std::runtime_error(fmt::format("the study's own Newton is {} off", distance));
    fmt::print("the study's own Newton agrees with StaticSolver to {:.1g}\n", distance);

    const auto law = [](const Eigen::Matrix3d& F) { return with_penalty(kPenalty, F); };
    const Paths paths = solved_by_small_newton(law);
    SmallNewton body(model_, law);
    const std::optional<Eigen::VectorXd> unloaded = body.under(0.0);
    if (!unloaded) throw std::runtime_error("no equilibrium without load");
    table(fmt::format("2 ln J scaled by {}: stress at F = 1, and how the unloaded body moves.", kPenalty),
          "| P(1) = p 1, p | uz of P1 | uy of P2 | ux of P3 | largest displacement |");
    row("| {:.3g} | {:.5f} | {:.5f} | {:.5f} | {:.5f} |", (1 - kPenalty) * kPaperMu,
        component(*unloaded, "P1", 2), component(*unloaded, "P2", 1), component(*unloaded, "P3", 0),
        unloaded->reshaped(3, unloaded->size() / 3).colwise().norm().maxCoeff());
    std::ofstream file = csv("paper_penalty.csv", "force,eq1,penalty,penalty_from_its_rest");
    const double rest = component(*unloaded, "P1", 2);
    const auto beyond = [&](double z, int sign, size_t i) {
      return tip(answers_.at(1).equation_11, sign, i) / z - 1;
    };
    for (const int sign : {-1, 1})
      for (size_t i = 0; i <= kLargest; ++i)
        fmt::print(file, "{},{:.6g},{:.6g},{:.6g}\n", force_at(sign, i),
                   beyond(tip(answers_.at(1).equation_1, sign, i), sign, i),
                   beyond(tip(paths, sign, i), sign, i), beyond(tip(paths, sign, i) - rest, sign, i));
    table(
        fmt::format(
            "By how much eq. (11), kappa = lambda, moves the tip further than eq. (1), %, with 2 ln J whole "
            "and scaled by {}, the latter also measured from its own unloaded state.",
            kPenalty),
        "| force | 2 ln J | scaled | scaled, from its rest |");
    for_table_forces([&](int sign, size_t i) {
      row("| {:g} | {:+.2f} | {:+.2f} | {:+.2f} |", force_at(sign, i),
          100 * beyond(tip(answers_.at(1).equation_1, sign, i), sign, i),
          100 * beyond(tip(paths, sign, i), sign, i), 100 * beyond(tip(paths, sign, i) - rest, sign, i));
    });
  }

  std::filesystem::path directory_;
  Model model_;
  std::ofstream markdown_;
  std::map<double, LawPaths> answers_;  // by ratio
};

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  if (argc != 2) {
    std::cerr << "usage: palpate_study_paper DIR\n";
    return 1;
  }
  try {
    std::filesystem::create_directories(argv[1]);
    palpate::test::Study(argv[1]).run();
  } catch (const std::exception& error) {
    std::cerr << "palpate_study_paper: " << error.what() << "\n";
    return 1;
  }
}
