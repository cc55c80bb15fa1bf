#include "offline/precompute/zone_exterior.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "offline/fem/parallel_for.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/tied_patch.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

constexpr Eigen::Index kQuadratic = pack::num_monomials(2);

Eigen::Index column_of(std::array<uint32_t, 3> powers) {
  return static_cast<Eigen::Index>(pack::monomial_index(powers[0], powers[1], powers[2]) -
                                   pack::monomial_start(2));
}

// The column of x_i x_j.
Eigen::Index column_of(int i, int j) {
  std::array<uint32_t, 3> powers = {};
  ++powers[static_cast<size_t>(i)];
  ++powers[static_cast<size_t>(j)];
  return column_of(powers);
}

// The columns of x_i times each quadratic monomial.
std::array<Eigen::Index, kQuadratic> columns_times(int i) {
  std::array<Eigen::Index, kQuadratic> columns = {};
  pack::for_each_monomial(2, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    if (a + b + c != 2) return;
    std::array<uint32_t, 3> powers = {a, b, c};
    ++powers[static_cast<size_t>(i)];
    columns[index - pack::monomial_start(2)] = column_of(powers);
  });
  return columns;
}

// Orders of P about rest, by differences of K over steps of +- `step` of the given fields.
class ForceSeries {
 public:
  ForceSeries(const Assembly& assembly, const Eigen::VectorXd& at_rest, double step)
      : assembly_(&assembly), at_rest_(&at_rest), step_(step) {}

  // n2(u, u) / 2 and n3(u, u, u) / 6 of u = sum_i x_i first_i: columns of the monomials of x.
  Eigen::MatrixXd of_first_order(const Eigen::MatrixXd& first) const {
    Eigen::MatrixXd series(first.rows(), pack::kZoneColumns);
    const Eigen::MatrixXd at_rest = assembly_->tangent_times(*at_rest_, first);
    const auto second = [&](const Eigen::VectorXd& along, const Eigen::MatrixXd& vectors) -> Eigen::MatrixXd {
      const Eigen::MatrixXd sum = moved(along, 1) * vectors + moved(along, -1) * vectors;
      return (sum - 2 * assembly_->tangent_times(*at_rest_, vectors)) / (step_ * step_);
    };
    std::array<Eigen::MatrixXd, 3> third;  // n3(first_i, first_i, .)
    for (int i = 0; i < 3; ++i) {
      const Eigen::MatrixXd plus = moved(first.col(i), 1) * first;
      const Eigen::MatrixXd minus = moved(first.col(i), -1) * first;
      const Eigen::MatrixXd n2 = (plus - minus) / (2 * step_);
      third[static_cast<size_t>(i)] = (plus + minus - 2 * at_rest) / (step_ * step_);
      for (int j = i; j < 3; ++j) series.col(column_of(i, j)) = (i == j ? 0.5 : 1.0) * n2.col(j);
      for (int j = 0; j < 3; ++j) {
        const Eigen::Index column = columns_times(j)[static_cast<size_t>(column_of(i, i))];
        series.col(column) = (i == j ? 1.0 / 6.0 : 0.5) * third[static_cast<size_t>(i)].col(j);
      }
    }
    // 2 n3(1, 2, 3) = n3(1 + 2, 1 + 2, 3) - n3(1, 1, 3) - n3(2, 2, 3)
    series.col(column_of({1, 1, 1})) =
        0.5 * (second(first.col(0) + first.col(1), first.col(2)) - third[0].col(2) - third[1].col(2));
    return series;
  }

  // Adds n2(first, second), second = sum over quadratic monomials, to the cubic columns.
  void add_mixed(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second, Eigen::MatrixXd& series) const {
    for (int i = 0; i < 3; ++i) {
      const Eigen::MatrixXd n2 =
          (moved(first.col(i), 1) * second - moved(first.col(i), -1) * second) / (2 * step_);
      const auto columns = columns_times(i);
      for (Eigen::Index m = 0; m < kQuadratic; ++m) series.col(columns[static_cast<size_t>(m)]) += n2.col(m);
    }
  }

 private:
  struct Moved {
    const Assembly* assembly;
    Eigen::VectorXd displacement;
    Eigen::MatrixXd operator*(const Eigen::MatrixXd& vectors) const {
      return assembly->tangent_times(displacement, vectors);
    }
  };
  Moved moved(const Eigen::VectorXd& along, double sign) const {
    return {assembly_, *at_rest_ + sign * step_ * along};
  }

  const Assembly* assembly_;
  const Eigen::VectorXd* at_rest_;
  double step_;
};

}  // namespace

void compute_zone_exterior(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                           double max_displacement, int threads, const std::function<void(int)>& progress,
                           ZoneTables& zone) {
  const Model& model = assembly.model();
  const Eigen::VectorXd at_rest = rest.displacement_of(model);
  const ZoneFinder finder(model);
  const std::vector<Eigen::Index> shown = exterior_dofs(sites, zone);
  const size_t num_sites = sites.sites.size();
  zone.force_scale.assign(num_sites, 0);
  zone.exterior.assign(static_cast<size_t>(zone.rings) * num_sites, {});
  std::vector<std::unique_ptr<StaticSolver>> solvers(
      std::min(static_cast<size_t>(std::max(1, threads)), std::max<size_t>(1, num_sites)));
  for (std::unique_ptr<StaticSolver>& solver : solvers) {
    solver = std::make_unique<StaticSolver>(assembly);
    factor_at_rest(*solver, rest);
  }
  std::mutex mutex;
  int done = 0;
  parallel_for(static_cast<int>(solvers.size()), static_cast<int>(num_sites), [&](int index, int worker) {
    const auto s = static_cast<size_t>(index);
    const ContactSite& site = sites.sites[s];
    StaticSolver& solver = *solvers[static_cast<size_t>(worker)];
    const TiedPatch patch(solver, site);
    zone.force_scale[s] = max_displacement * patch.stiffness().norm();
    const Eigen::MatrixXd first = zone.force_scale[s] * patch.per_force();
    const double step = difference_step(patch, zone.force_scale[s], sites.mean_surface_edge);
    const ForceSeries all(assembly, at_rest, step);
    Eigen::MatrixXd of_all = all.of_first_order(first);
    Eigen::MatrixXd loaded = -of_all.leftCols(kQuadratic);
    solve_at_rest(solver, loaded);
    const Eigen::MatrixXd second = patch.tied(loaded);
    all.add_mixed(first, second, of_all);
    for (int ring = 1; ring <= zone.rings; ++ring) {
      Model inside = model;
      inside.elements.clear();
      for (const int e : finder.elements_about(site, ring))
        inside.elements.push_back(model.elements[static_cast<size_t>(e)]);
      const Assembly of_zone(inside, inside.fixed_dofs());
      const ForceSeries zone_series(of_zone, at_rest, step);
      Eigen::MatrixXd of_inside = zone_series.of_first_order(first);
      zone_series.add_mixed(first, second, of_inside);
      Eigen::MatrixXd fields = of_inside - of_all;
      solve_at_rest(solver, fields);
      zone.exterior[static_cast<size_t>(ring - 1) * num_sites + s] =
          fields(shown, Eigen::all).cast<pack::Real>();
    }
    const std::lock_guard lock(mutex);
    if (progress) progress(++done);
  });
}

}  // namespace palpate
