#include "offline/precompute/zone_exterior.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "offline/fem/parallel_for.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/rigid_patch.hpp"
#include "offline/precompute/taylor_orders.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// The orders of P along a path, for all elements or some.
class ForceOrders {
 public:
  ForceOrders(const Assembly& assembly, const Eigen::VectorXd& at_rest, const Eigen::MatrixXd& first)
      : assembly_(&assembly), at_rest_(&at_rest), orders_{assembly.tangent_times(at_rest, first)} {}

  // Computes c_j of the path to a_(j-1). False where an element inverts.
  [[nodiscard]] bool find_next(const std::vector<Eigen::MatrixXd>& path) {
    std::optional<Eigen::MatrixXd> found =
        internal_force_of_order(*assembly_, *at_rest_, path, orders_, static_cast<int>(path.size()) + 1);
    if (found) next_ = *std::move(found);
    return found.has_value();
  }
  const Eigen::MatrixXd& next() const { return next_; }
  // Extends the orders of P to the path with a_j.
  void append(const Eigen::MatrixXd& a_j) {
    orders_.push_back(next_ + assembly_->tangent_times(*at_rest_, a_j));
  }

 private:
  const Assembly* assembly_;
  const Eigen::VectorXd* at_rest_;
  std::vector<Eigen::MatrixXd> orders_;
  Eigen::MatrixXd next_;
};

bool is_linear(const Model& model) {
  return std::all_of(model.materials.begin(), model.materials.end(), [](const Material& material) {
    return std::holds_alternative<LinearElastic>(material.law);
  });
}

// Chooses the degree of a patch's series. A patch may be far softer along one axis; coefficients then grow by
// the stiffness ratio to the power of the degree and cancel in single precision.
int degree_of(const RigidPatch& patch, double reach_in_edges, int degree) {
  constexpr double kMostCancellation = 1e5;
  const Eigen::Vector3d stiffnesses =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(patch.stiffness()).eigenvalues();
  const double spread = std::max(1.0, reach_in_edges) * stiffnesses[2] / stiffnesses[0];
  while (degree > static_cast<int>(pack::kLeastZoneDegree) && std::pow(spread, degree) > kMostCancellation)
    --degree;
  return degree;
}

// For a site: directions y and, where a_1 moves the patch by `length` y, q at some dofs.
struct SiteOrders {
  Eigen::Matrix3Xd directions;
  double length = 0;
  std::vector<std::vector<Eigen::MatrixXd>> of_rings;  // by ring: orders 2, 3, ...: dofs x directions
};

// Runs work for each site with a factor at rest.
class ExteriorSeries {
 public:
  ExteriorSeries(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                 double max_displacement, int threads)
      : model_(&assembly.model()),
        sites_(&sites),
        at_rest_(rest.displacement_of(assembly.model())),
        finder_(assembly.model()),
        max_displacement_(max_displacement),
        solvers_(
            std::min(static_cast<size_t>(std::max(1, threads)), std::max<size_t>(1, sites.sites.size()))) {
    for (std::unique_ptr<StaticSolver>& solver : solvers_) {
      solver = std::make_unique<StaticSolver>(assembly);
      factor_at_rest(*solver, rest);
    }
  }

  // Calls work(site, its patch, solver of the thread), then progress(sites done).
  template <typename Work>
  void for_each_site(const std::function<void(int)>& progress, Work&& work) {
    std::mutex mutex;
    int done = 0;
    parallel_for(static_cast<int>(solvers_.size()), static_cast<int>(sites_->sites.size()),
                 [&](int index, int worker) {
                   const auto s = static_cast<size_t>(index);
                   StaticSolver& solver = *solvers_[static_cast<size_t>(worker)];
                   work(s, RigidPatch(solver, sites_->sites[s]), solver);
                   const std::lock_guard lock(mutex);
                   if (progress) progress(++done);
                 });
  }

  // Computes the orders outside of each number of rings, to this degree or the patch's highest. Orders end
  // where an element inverts; a linear organ has none.
  SiteOrders orders_of(size_t s, const RigidPatch& patch, StaticSolver& solver, const std::vector<int>& rings,
                       int degree, const std::vector<Eigen::Index>& dofs) const {
    constexpr int kTrials = 4;
    constexpr int kHighest[kTrials] = {5, 5, 4, 3};  // highest degrees above rounding for such short paths
    const int highest = degree_of(patch, max_displacement_ / sites_->mean_surface_edge, degree);
    SiteOrders orders;
    orders.directions = ray_directions(num_rays(highest));
    // Retry with a shorter path where a flat element inverts.
    orders.length = sites_->mean_surface_edge;
    orders.of_rings.resize(rings.size());
    for (int trial = 0; trial < kTrials && !is_linear(*model_); ++trial) {
      orders.length = sites_->mean_surface_edge / std::pow(4.0, trial);
      const int to = std::min(highest, kHighest[trial]);
      orders.of_rings = outside_orders(solver, sites_->sites[s], patch,
                                       orders.length * patch.per_force() * patch.stiffness(),
                                       orders.directions, dofs, rings, to);
      if (static_cast<int>(orders.of_rings.front().size()) == to - 1) break;
    }
    return orders;
  }

 private:
  // The path with a_1 = `first` y.
  std::vector<std::vector<Eigen::MatrixXd>> outside_orders(StaticSolver& solver, const ContactSite& site,
                                                           const RigidPatch& patch,
                                                           const Eigen::MatrixXd& first,
                                                           const Eigen::Matrix3Xd& directions,
                                                           const std::vector<Eigen::Index>& dofs,
                                                           const std::vector<int>& rings, int degree) const {
    std::vector<Eigen::MatrixXd> path = {first * directions};
    ForceOrders all(solver.assembly(), at_rest_, path.front());
    std::deque<Model> zones;
    std::deque<Assembly> assemblies;
    std::vector<ForceOrders> inside;
    for (const int ring : rings) {
      Model& zone = zones.emplace_back(*model_);
      zone.elements.clear();
      for (const int e : finder_.elements_about(site, ring))
        zone.elements.push_back(model_->elements[static_cast<size_t>(e)]);
      inside.emplace_back(assemblies.emplace_back(zone, zone.fixed_dofs()), at_rest_, path.front());
    }
    std::vector<std::vector<Eigen::MatrixXd>> orders(inside.size());
    for (int order = 2;; ++order) {
      // The series fails if any element of the organ inverts.
      if (!all.find_next(path)) return orders;
      for (size_t ring = 0; ring < inside.size(); ++ring) {
        if (!inside[ring].find_next(path)) throw std::logic_error("elements of a zone are of the organ");
        Eigen::MatrixXd fields = inside[ring].next() - all.next();
        solve_at_rest(solver, fields);
        orders[ring].push_back(fields(dofs, Eigen::all));
      }
      if (order == degree) return orders;
      Eigen::MatrixXd loaded = -all.next();
      solve_at_rest(solver, loaded);
      path.push_back(patch.tied(loaded));
      all.append(path.back());
      for (ForceOrders& of_zone : inside) of_zone.append(path.back());
    }
  }

  const Model* model_;
  const ContactSites* sites_;
  Eigen::VectorXd at_rest_;
  ZoneFinder finder_;
  double max_displacement_;
  std::vector<std::unique_ptr<StaticSolver>> solvers_;
};

// Converts values of forms along `directions` y = B x to monomials of x: monomials x forms.
Eigen::MatrixXd forms_of_loads(const Eigen::Matrix3Xd& directions, const Eigen::Matrix3d& B, int order,
                               const Eigen::MatrixXd& values) {
  const Eigen::MatrixXd in_y = forms_along_rays(directions, order, values);
  Eigen::MatrixXd along_x(directions.cols(), in_y.rows());
  for (Eigen::Index ray = 0; ray < directions.cols(); ++ray)
    along_x.row(ray) = hermite_rows(B * directions.col(ray), order, order, 0);
  return forms_along_rays(directions, order, along_x * in_y);
}

}  // namespace

ZoneTables widen_zones(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, int threads, const std::function<void(int)>& progress,
                       const ZoneTables& zone) {
  constexpr double kMostLeft = 2;  // multiple of the accuracy target
  if (zone.exterior_degree < static_cast<int>(pack::kMostZoneDegree)) return zone;
  const std::vector<Eigen::Index> shown = exterior_dofs(sites, zone);
  std::vector<std::uint8_t> more_rings(sites.sites.size());
  ExteriorSeries series(assembly, sites, rest, scene.max_displacement, threads);
  series.for_each_site(progress, [&](size_t s, const RigidPatch& patch, StaticSolver& solver) {
    const SiteOrders orders = series.orders_of(s, patch, solver, {zone.rings}, zone.exterior_degree, shown);
    if (orders.of_rings.front().empty()) return;
    const Eigen::MatrixXd& last = orders.of_rings.front().back();
    const auto order = static_cast<double>(orders.of_rings.front().size() + 1);
    const double left = last.reshaped(3, last.size() / 3).colwise().norm().maxCoeff() *
                        std::pow(scene.max_displacement / orders.length, order);
    more_rings[s] = left > kMostLeft * scene.accuracy_target * scene.max_displacement ? 1 : 0;
  });
  ZoneTables wider =
      find_zones(scene, assembly.model(), sites, zone.rings, std::move(more_rings), zone.between);
  wider.exterior_degree = zone.exterior_degree;  // the plan may have lowered the degree
  return wider;
}

void compute_zone_exterior(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                           double max_displacement, int threads, const std::function<void(int)>& progress,
                           ZoneTables& zone) {
  const std::vector<Eigen::Index> shown = exterior_dofs(sites, zone);
  const size_t num_sites = sites.sites.size();
  zone.force_scale.assign(num_sites, 0);
  zone.exterior.assign(static_cast<size_t>(zone.rings) * num_sites, {});
  ExteriorSeries series(assembly, sites, rest, max_displacement, threads);
  series.for_each_site(progress, [&](size_t s, const RigidPatch& patch, StaticSolver& solver) {
    std::vector<int> rings;
    for (int ring = 1; ring <= zone.rings; ++ring) rings.push_back(zone.rings_of(s, ring));
    const SiteOrders orders = series.orders_of(s, patch, solver, rings, zone.exterior_degree, shown);
    zone.force_scale[s] = max_displacement * patch.stiffness().norm();
    const Eigen::Matrix3d to_directions = zone.force_scale[s] / orders.length * patch.stiffness().inverse();
    for (size_t ring = 0; ring < rings.size(); ++ring) {
      auto& fields = zone.exterior[ring * num_sites + s];
      fields.setZero(static_cast<Eigen::Index>(shown.size()),
                     pack::num_monomials(2, static_cast<std::uint32_t>(zone.exterior_degree)));
      for (size_t i = 0; i < orders.of_rings[ring].size(); ++i) {
        const auto order = static_cast<std::uint32_t>(i) + 2;
        fields.middleCols(pack::num_monomials(2, order - 1), pack::num_monomials(order)) =
            forms_of_loads(orders.directions, to_directions, static_cast<int>(order),
                           orders.of_rings[ring][i].transpose())
                .transpose()
                .cast<pack::Real>();
      }
    }
  });
}

}  // namespace palpate
