#include "offline/precompute/zone_mutual.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <mutex>
#include <utility>

#include "offline/fem/parallel_for.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/tied_patch.hpp"

namespace palpate {
namespace {

constexpr Eigen::Index kPairColumns = pack::kPairColumns;
constexpr Eigen::Index kQuadratic = pack::num_monomials(2);
constexpr size_t kBasisPairs = 40;  // of a site, that its fields for pairs are made of
constexpr double kReach = 6;        // mean surface edges about a site, in which its fields tell of pairs
constexpr double kBasisTolerance = 1e-4;  // of the largest singular value
constexpr double kRidge = 1e-6;           // of the largest square: fields that nearly cancel stay small

// The fields of pairs of sites.
class PairFields {
 public:
  PairFields(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
             const ZoneTables& zone, int threads)
      : assembly_(&assembly),
        sites_(&sites),
        zone_(&zone),
        at_rest_(rest.displacement_of(assembly.model())),
        finder_(assembly.model()),
        shown_(exterior_dofs(sites, zone)),
        first_(sites.sites.size()),
        steps_(sites.sites.size()) {
    for (int worker = 0; worker < std::max(1, threads); ++worker) {
      solvers_.push_back(std::make_unique<StaticSolver>(assembly));
      factor_at_rest(*solvers_.back(), rest);
    }
    for_each_site([&](size_t s, StaticSolver& solver) {
      const TiedPatch patch(solver, sites.sites[s]);
      first_[s] = zone.force_scale[s] * patch.per_force();
      steps_[s] = difference_step(patch, zone.force_scale[s], sites.mean_surface_edge);
    });
  }

  // Calls work(site, solver of the thread) for all, those with the most pairs first.
  template <typename Work>
  void for_each_site(Work&& work) {
    const auto count = static_cast<int>(sites_->sites.size());
    parallel_for(static_cast<int>(solvers_.size()), count, [&](int index, int worker) {
      work(static_cast<size_t>(count - 1 - index), *solvers_[static_cast<size_t>(worker)]);
    });
  }

  // Calls use(ring, k, fields, inside) for each ring and each of `others`: rows of the exterior by kPairColumns; of which
  // zones hide the rows `inside`.
  template <typename Use>
  void for_each_pair(size_t site, const std::vector<size_t>& others, StaticSolver& solver, Use&& use) const {
    const Eigen::MatrixXd all = products(*assembly_, site, others);
    for (int ring = 1; ring <= zone_->rings; ++ring) {
      std::vector<std::vector<Eigen::Index>> inside(others.size());
      const Eigen::MatrixXd fields = outside_of(ring, site, others, all, solver, inside);
      for (size_t k = 0; k < others.size(); ++k)
        use(ring, k, fields.middleCols<kPairColumns>(kPairColumns * static_cast<Eigen::Index>(k)), inside[k]);
    }
  }

 private:
  // `all`: products() of all elements.
  Eigen::MatrixXd outside_of(int rings, size_t site, const std::vector<size_t>& others,
                             const Eigen::MatrixXd& all, StaticSolver& solver,
                             std::vector<std::vector<Eigen::Index>>& inside) const {
    Eigen::MatrixXd fields(all.rows(), kPairColumns * static_cast<Eigen::Index>(others.size()));
    const std::vector<int> about_site = finder_.elements_about(sites_->sites[site], rings);
    for (size_t k = 0; k < others.size(); ++k) {
      const std::vector<int> about_other = finder_.elements_about(sites_->sites[others[k]], rings);
      auto of_pair = fields.middleCols<kPairColumns>(kPairColumns * static_cast<Eigen::Index>(k));
      // Outside of both zones.
      std::vector<int> both;
      std::set_union(about_site.begin(), about_site.end(), about_other.begin(), about_other.end(),
                     std::back_inserter(both));
      of_pair.leftCols<9>() =
          products_by(both, site, others[k]) - all.middleCols<9>(9 * static_cast<Eigen::Index>(k));
      inside[k] = rows_inside(both);
      // What each by itself counts inside of the other's.
      of_pair.middleCols<kQuadratic>(9) = own_products(site, about_site, about_other);
      of_pair.rightCols<kQuadratic>() = own_products(others[k], about_other, about_site);
    }
    solve_at_rest(solver, fields);
    return fields(shown_, Eigen::all);
  }

  // Rows of nodes that have no element but these.
  std::vector<Eigen::Index> rows_inside(const std::vector<int>& elements) const {
    std::vector<Eigen::Index> rows;
    for (size_t row = 0; row < shown_.size(); ++row) {
      const std::vector<int>& about = finder_.elements_of(static_cast<int>(shown_[row] / 3));
      if (std::includes(elements.begin(), elements.end(), about.begin(), about.end()))
        rows.push_back(static_cast<Eigen::Index>(row));
    }
    return rows;
  }

  // n2(first of site, first of other) of the assembly's elements, nine columns for each of `others`.
  Eigen::MatrixXd products(const Assembly& assembly, size_t site, const std::vector<size_t>& others) const {
    Eigen::MatrixXd vectors(at_rest_.size(), 3 * static_cast<Eigen::Index>(others.size()));
    for (size_t k = 0; k < others.size(); ++k)
      vectors.middleCols<3>(3 * static_cast<Eigen::Index>(k)) = first_[others[k]];
    Eigen::MatrixXd columns(at_rest_.size(), 3 * vectors.cols());
    const double step = steps_[site];
    for (int a = 0; a < 3; ++a) {
      const Eigen::VectorXd along = step * first_[site].col(a);
      const Eigen::MatrixXd n2 = (assembly.tangent_times(at_rest_ + along, vectors) -
                                  assembly.tangent_times(at_rest_ - along, vectors)) /
                                 (2 * step);
      for (Eigen::Index k = 0; k < n2.cols() / 3; ++k)
        columns.middleCols<3>(9 * k + 3 * a) = n2.middleCols<3>(3 * k);
    }
    return columns;
  }

  // The same of these elements of the model alone.
  Eigen::MatrixXd products_by(const std::vector<int>& elements, size_t site, size_t other) const {
    Model part = assembly_->model();
    part.elements.clear();
    for (const int e : elements) part.elements.push_back(assembly_->model().elements[static_cast<size_t>(e)]);
    return products(Assembly(part, part.fixed_dofs()), site, {other});
  }

  // n2(u, u) / 2 of a site by the elements in the other's zone that are not in its own; of each monomial.
  Eigen::MatrixXd own_products(size_t site, const std::vector<int>& own,
                               const std::vector<int>& of_other) const {
    std::vector<int> elements;
    std::set_difference(of_other.begin(), of_other.end(), own.begin(), own.end(),
                        std::back_inserter(elements));
    const Eigen::MatrixXd n2 = products_by(elements, site, site);
    Eigen::MatrixXd columns(n2.rows(), kQuadratic);
    Eigen::Index column = 0;
    for (Eigen::Index a = 0; a < 3; ++a) {
      for (Eigen::Index b = a; b < 3; ++b) columns.col(column++) = (a == b ? 0.5 : 1.0) * n2.col(3 * a + b);
    }
    return columns;
  }

  const Assembly* assembly_;
  const ContactSites* sites_;
  const ZoneTables* zone_;
  Eigen::VectorXd at_rest_;
  ZoneFinder finder_;
  std::vector<Eigen::Index> shown_;
  std::vector<Eigen::MatrixXd> first_;
  std::vector<double> steps_;
  std::vector<std::unique_ptr<StaticSolver>> solvers_;
};

using Fields = Eigen::Matrix<pack::Real, Eigen::Dynamic, Eigen::Dynamic>;

// Coefficients of `columns` that come nearest to each of `fields`.
Eigen::MatrixXd fit(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& fields) {
  Eigen::MatrixXd gram = columns.transpose() * columns;
  if (gram.isZero(0)) return Eigen::MatrixXd::Zero(columns.cols(), fields.cols());
  gram.diagonal().array() += kRidge * gram.diagonal().maxCoeff();
  return gram.ldlt().solve(columns.transpose() * fields);
}

// Columns of what the first site carries, then of what the other does; zero in these rows.
Eigen::MatrixXd side_by_side(const Fields& first, const Fields& second,
                             const std::vector<Eigen::Index>& inside) {
  Eigen::MatrixXd columns(first.rows(), first.cols() + second.cols());
  columns << first.cast<double>(), second.cast<double>();
  columns(inside, Eigen::all).setZero();
  return columns;
}

// kMostMutual columns, as large as `scale`, of which the given ones are made, the largest part first; zero where they are not.
Fields largest_parts(const Eigen::MatrixXd& fields, double scale) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(fields.transpose() * fields);
  const Eigen::VectorXd& squares = eigen.eigenvalues();  // ascending
  Fields parts = Fields::Zero(fields.rows(), pack::kMostMutual);
  const Eigen::Index count = std::min<Eigen::Index>(squares.size(), pack::kMostMutual);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index from = squares.size() - 1 - i;
    if (!(squares[from] > kBasisTolerance * kBasisTolerance * squares[squares.size() - 1])) break;
    parts.col(i) =
        (scale / std::sqrt(squares[from]) * (fields * eigen.eigenvectors().col(from))).cast<pack::Real>();
  }
  return parts;
}

// Sites by their distance from this one, as many as its fields are made of, near and far alike.
std::vector<size_t> sites_about(const Model& model, const ContactSites& sites, size_t site) {
  const auto distance = [&](size_t other) {
    return (model.positions[static_cast<size_t>(sites.sites[other].node)] -
            model.positions[static_cast<size_t>(sites.sites[site].node)])
        .norm();
  };
  std::vector<std::pair<double, size_t>> by_distance;
  for (size_t other = 0; other < sites.sites.size(); ++other) {
    if (other != site) by_distance.emplace_back(distance(other), other);
  }
  std::sort(by_distance.begin(), by_distance.end());
  const size_t count = std::min(kBasisPairs, by_distance.size());
  std::vector<size_t> others;
  for (size_t i = 0; i < count; ++i) others.push_back(by_distance[i * by_distance.size() / count].second);
  return others;
}

// What remains of pairs with this site once both sites' own fields are fitted, near it: for each ring.
std::vector<Fields> mutual_fields(const Assembly& assembly, const ContactSites& sites,
                                  const PairFields& pairs, const ZoneTables& zone, size_t site,
                                  StaticSolver& solver) {
  const Model& model = assembly.model();
  const std::vector<Eigen::Index> dofs = exterior_dofs(sites, zone);
  Eigen::VectorXd nearness(static_cast<Eigen::Index>(dofs.size()));
  const Eigen::Vector3d centre = model.positions[static_cast<size_t>(sites.sites[site].node)];
  for (Eigen::Index row = 0; row < nearness.size(); ++row) {
    const double distance =
        (model.positions[static_cast<size_t>(dofs[static_cast<size_t>(row)] / 3)] - centre).norm() /
        (kReach * sites.mean_surface_edge);
    nearness[row] = std::max(0.0, 1 - distance * distance);
  }
  const std::vector<size_t> others = sites_about(model, sites, site);
  const auto own = [&](int ring, size_t of) -> const Fields& {
    return zone.exterior[static_cast<size_t>(ring - 1) * sites.sites.size() + of];
  };
  std::vector<Fields> fields;
  Eigen::MatrixXd remainders(nearness.size(), kPairColumns * static_cast<Eigen::Index>(others.size()));
  pairs.for_each_pair(
      site, others, solver,
      [&](int ring, size_t k, Eigen::MatrixXd of_pair, const std::vector<Eigen::Index>& inside) {
        const Eigen::MatrixXd columns = side_by_side(own(ring, site), own(ring, others[k]), inside);
        of_pair(inside, Eigen::all).setZero();
        of_pair -= columns * fit(columns, of_pair);
        remainders.middleCols<kPairColumns>(kPairColumns * static_cast<Eigen::Index>(k)) =
            nearness.asDiagonal() * of_pair;
        if (k + 1 == others.size()) {
          const double largest = own(ring, site).cast<double>().colwise().norm().maxCoeff();
          fields.push_back(largest_parts(remainders, largest));
        }
      });
  return fields;
}

}  // namespace

void compute_zone_mutual(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                         int max_contacts, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone) {
  const size_t num_sites = sites.sites.size();
  const size_t num_pairs = num_zone_pairs(sites, max_contacts);
  const bool is_linear = std::all_of(zone.exterior.begin(), zone.exterior.end(),
                                     [](const Fields& fields) { return fields.isZero(0); });
  if (num_pairs == 0 || is_linear) return;
  PairFields pairs(assembly, sites, rest, zone, threads);
  std::mutex mutex;
  size_t done = 0;
  const size_t all_work = num_pairs + num_sites * std::min(kBasisPairs, num_sites - 1);
  const auto advance = [&](size_t fields) {
    const std::lock_guard lock(mutex);
    done += fields;
    if (progress) progress(std::min(1.0, static_cast<double>(done) / static_cast<double>(all_work)));
  };

  std::vector<std::vector<Fields>> by_site(num_sites);
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    by_site[site] = mutual_fields(assembly, sites, pairs, zone, site, solver);
    advance(std::min(kBasisPairs, num_sites - 1));
  });
  for (size_t i = 0; i < zone.exterior.size(); ++i) {
    Fields& fields = zone.exterior[i];
    fields.conservativeResize(Eigen::NoChange, pack::kZoneColumns + pack::kMostMutual);
    fields.rightCols(pack::kMostMutual) = by_site[i % num_sites][i / num_sites];
  }
  zone.mutual.assign(static_cast<size_t>(zone.rings) * num_pairs, {});
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    std::vector<size_t> others;
    for (size_t other = 0; other < site; ++other) others.push_back(other);
    if (others.empty()) return;
    pairs.for_each_pair(
        site, others, solver,
        [&](int ring, size_t k, Eigen::MatrixXd of_pair, const std::vector<Eigen::Index>& inside) {
          const size_t first = static_cast<size_t>(ring - 1) * num_sites;
          const Eigen::MatrixXd columns =
              side_by_side(zone.exterior[first + site], zone.exterior[first + others[k]], inside);
          of_pair(inside, Eigen::all).setZero();
          zone.mutual[static_cast<size_t>(ring - 1) * num_pairs + pack::lower_block(site - 1, others[k])] =
              fit(columns, of_pair).cast<float>();
        });
    advance(others.size());
  });
}

}  // namespace palpate
