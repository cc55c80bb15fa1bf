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

constexpr Eigen::Index kMonomials = pack::kPairMonomials;
constexpr Eigen::Index kQuadratic = pack::num_monomials(2);
constexpr size_t kPairsAtOnce = 8;   // share the passes over a factor; more gain nothing and take memory
constexpr double kTolerance = 1e-4;  // of the largest singular value
constexpr double kRidge = 1e-6;      // of the largest square: fields that nearly cancel stay small

// The fields of pairs of sites.
class PairResponses {
 public:
  PairResponses(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
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

  // What a pair adds outside of each ring.
  struct OfRing {
    Eigen::MatrixXd fields;            // rows of the exterior x kMonomials, zero in `inside`
    std::vector<Eigen::Index> inside;  // rows that zones hide
  };

  // Calls use(k, rings) for each of `others`.
  template <typename Use>
  void for_each_pair(size_t site, const std::vector<size_t>& others, StaticSolver& solver, Use&& use) const {
    for (size_t first = 0; first < others.size(); first += kPairsAtOnce) {
      const auto from = others.begin() + static_cast<std::ptrdiff_t>(first);
      const std::vector<size_t> some(from,
                                     from + std::min<std::ptrdiff_t>(kPairsAtOnce, others.end() - from));
      const Eigen::MatrixXd all = products(*assembly_, site, some);
      std::vector<std::vector<OfRing>> pairs(some.size());
      for (int ring = 1; ring <= zone_->rings; ++ring) add_ring(ring, site, some, all, solver, pairs);
      for (size_t k = 0; k < some.size(); ++k) use(first + k, pairs[k]);
    }
  }

 private:
  // `all`: products() of all elements.
  void add_ring(int rings, size_t site, const std::vector<size_t>& others, const Eigen::MatrixXd& all,
                StaticSolver& solver, std::vector<std::vector<OfRing>>& pairs) const {
    Eigen::MatrixXd fields(all.rows(), kMonomials * static_cast<Eigen::Index>(others.size()));
    const std::vector<int> about_site = finder_.elements_about(sites_->sites[site], rings);
    for (size_t k = 0; k < others.size(); ++k) {
      const std::vector<int> about_other = finder_.elements_about(sites_->sites[others[k]], rings);
      auto of_pair = fields.middleCols<kMonomials>(kMonomials * static_cast<Eigen::Index>(k));
      // Outside of both zones.
      std::vector<int> both;
      std::set_union(about_site.begin(), about_site.end(), about_other.begin(), about_other.end(),
                     std::back_inserter(both));
      of_pair.leftCols<9>() =
          products_by(both, site, others[k]) - all.middleCols<9>(9 * static_cast<Eigen::Index>(k));
      pairs[k].push_back({{}, rows_inside(both)});
      // What each by itself counts inside of the other's.
      of_pair.middleCols<kQuadratic>(9) = own_products(site, about_site, about_other);
      of_pair.rightCols<kQuadratic>() = own_products(others[k], about_other, about_site);
    }
    solve_at_rest(solver, fields);
    for (size_t k = 0; k < others.size(); ++k) {
      OfRing& of_ring = pairs[k].back();
      of_ring.fields =
          fields(shown_, Eigen::seqN(kMonomials * static_cast<Eigen::Index>(k), Eigen::fix<kMonomials>));
      of_ring.fields(of_ring.inside, Eigen::all).setZero();
    }
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

// So many fields of which the given ones are made, the largest part first, each as large as an int8 is; zero where
// there are fewer.
ZoneTables::PairFields largest_parts(const Eigen::MatrixXd& fields, Eigen::Index most) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(fields.transpose() * fields);
  const Eigen::VectorXd& squares = eigen.eigenvalues();  // ascending
  ZoneTables::PairFields parts = ZoneTables::PairFields::Zero(fields.rows(), most);
  const Eigen::Index count = std::min(squares.size(), most);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index from = squares.size() - 1 - i;
    if (!(squares[from] > kTolerance * kTolerance * squares[squares.size() - 1])) break;
    const Eigen::VectorXd part = fields * eigen.eigenvectors().col(from);
    parts.col(i) = (pack::kPairUnit / part.cwiseAbs().maxCoeff() * part).array().round().cast<std::int8_t>();
  }
  return parts;
}

}  // namespace

void compute_zone_mutual(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone) {
  const size_t num_sites = sites.sites.size();
  const size_t num_pairs = num_zone_pairs(sites, scene.max_contacts);
  const bool is_linear = std::all_of(zone.exterior.begin(), zone.exterior.end(),
                                     [](const Fields& fields) { return fields.isZero(0); });
  if (num_pairs == 0 || is_linear) return;
  PairResponses pairs(assembly, sites, rest, zone, threads);
  std::mutex mutex;
  size_t done = 0;
  const auto advance = [&](size_t fields) {
    const std::lock_guard lock(mutex);
    done += fields;
    if (progress) progress(std::min(1.0, static_cast<double>(done) / static_cast<double>(num_pairs)));
  };

  const Eigen::Index most = num_pair_fields(zone.rings, scene.accuracy_target);
  zone.pair_fields.assign(num_pairs, {});
  zone.pair_weights.assign(static_cast<size_t>(zone.rings) * num_pairs, {});
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    std::vector<size_t> others;
    for (size_t other = 0; other < site; ++other) others.push_back(other);
    pairs.for_each_pair(site, others, solver, [&](size_t k, std::vector<PairResponses::OfRing>& rings) {
      const size_t pair = pack::lower_block(site - 1, others[k]);
      std::vector<Eigen::MatrixXd> weights;
      for (size_t ring = 0; ring < rings.size(); ++ring) {
        const size_t first = ring * num_sites;
        const Eigen::MatrixXd columns =
            side_by_side(zone.exterior[first + site], zone.exterior[first + others[k]], rings[ring].inside);
        weights.push_back(fit(columns, rings[ring].fields));
        rings[ring].fields -= columns * weights.back();
      }
      zone.pair_fields[pair] = largest_parts(rings.back().fields, most);
      const Eigen::MatrixXd own =
          scene.max_displacement / pack::kPairUnit * zone.pair_fields[pair].cast<double>();
      for (size_t ring = 0; ring < rings.size(); ++ring) {
        Eigen::MatrixXd outside = own;
        outside(rings[ring].inside, Eigen::all).setZero();
        Eigen::MatrixXf& of_ring = zone.pair_weights[ring * num_pairs + pair];
        of_ring.resize(2 * pack::kZoneColumns + most, kMonomials);
        of_ring << weights[ring].cast<float>(), fit(outside, rings[ring].fields).cast<float>();
      }
    });
    advance(others.size());
  });
}

}  // namespace palpate
