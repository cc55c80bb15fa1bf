#include "offline/precompute/zone_mutual.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <iterator>
#include <memory>
#include <mutex>

#include "offline/fem/parallel_for.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/tied_patch.hpp"

namespace palpate {
namespace {

constexpr Eigen::Index kPairColumns = pack::kPairColumns;
constexpr Eigen::Index kQuadratic = pack::num_monomials(2);
constexpr size_t kMostBasisFields = 900;  // which the basis is made of
constexpr double kBasisTolerance = 1e-4;  // of the largest singular value

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

  // Calls use(ring, fields) for each ring: rows of the exterior, kPairColumns for each of `others`.
  template <typename Use>
  void for_each_ring(size_t site, const std::vector<size_t>& others, StaticSolver& solver, Use&& use) const {
    const Eigen::MatrixXd all = products(*assembly_, site, others);
    for (int ring = 1; ring <= zone_->rings; ++ring) use(ring, outside_of(ring, site, others, all, solver));
  }

 private:
  // `all`: products() of all elements.
  Eigen::MatrixXd outside_of(int rings, size_t site, const std::vector<size_t>& others,
                             const Eigen::MatrixXd& all, StaticSolver& solver) const {
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
      // What each by itself counts inside of the other's.
      of_pair.middleCols<kQuadratic>(9) = own_products(site, about_site, about_other);
      of_pair.rightCols<kQuadratic>() = own_products(others[k], about_other, about_site);
    }
    solve_at_rest(solver, fields);
    return fields(shown_, Eigen::all);
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

// Orthonormal columns that hold the given ones but for kBasisTolerance.
Eigen::MatrixXd basis_of(const Eigen::MatrixXd& fields) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(fields.transpose() * fields);
  const Eigen::VectorXd& squares = eigen.eigenvalues();  // ascending
  const double largest = squares.size() > 0 ? squares[squares.size() - 1] : 0.0;
  Eigen::Index rank = 0;
  while (rank < std::min<Eigen::Index>(squares.size(), pack::kMostMutual) &&
         squares[squares.size() - 1 - rank] > kBasisTolerance * kBasisTolerance * largest)
    ++rank;
  return fields * eigen.eigenvectors().rightCols(rank) *
         squares.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace

void compute_zone_mutual(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                         int max_contacts, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone) {
  const size_t num_sites = sites.sites.size();
  const size_t num_pairs = num_zone_pairs(sites, max_contacts);
  if (num_pairs == 0) return;
  PairFields pairs(assembly, sites, rest, zone, threads);
  std::mutex mutex;
  size_t done = 0;
  const size_t basis_pairs =
      std::max<size_t>(1, kMostBasisFields / static_cast<size_t>(kPairColumns * zone.rings));
  const size_t stride = (num_pairs + basis_pairs - 1) / basis_pairs;
  const size_t work = static_cast<size_t>(zone.rings) * num_pairs;
  const size_t all_work = work + work / stride;
  const auto advance = [&](size_t fields) {
    const std::lock_guard lock(mutex);
    done += fields;
    if (progress) progress(std::min(1.0, static_cast<double>(done) / static_cast<double>(all_work)));
  };

  // Every so many-th pair.
  std::vector<Eigen::MatrixXd> chosen(num_sites);
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    std::vector<size_t> others;
    for (size_t other = 0; other < site; ++other) {
      if (pack::lower_block(site - 1, other) % stride == 0) others.push_back(other);
    }
    if (others.empty()) return;
    const auto width = kPairColumns * static_cast<Eigen::Index>(others.size());
    pairs.for_each_ring(site, others, solver, [&](int ring, const Eigen::MatrixXd& of_ring) {
      chosen[site].conservativeResize(of_ring.rows(), width * ring);
      chosen[site].rightCols(width) = of_ring;
    });
    advance(static_cast<size_t>(zone.rings) * others.size());
  });
  Eigen::Index columns = 0;
  for (const Eigen::MatrixXd& fields : chosen) columns += fields.cols();
  Eigen::MatrixXd fields(static_cast<Eigen::Index>(exterior_dofs(sites, zone).size()), columns);
  columns = 0;
  for (Eigen::MatrixXd& of_site : chosen) {
    if (of_site.size() == 0) continue;
    fields.middleCols(columns, of_site.cols()) = of_site;
    columns += of_site.cols();
    of_site.resize(0, 0);
  }
  const Eigen::MatrixXd basis = basis_of(fields);
  fields.resize(0, 0);
  zone.mutual_basis = basis.cast<pack::Real>();
  zone.mutual.assign(static_cast<size_t>(zone.rings) * num_pairs, {});
  if (basis.cols() == 0) {
    zone.mutual.clear();
    return;
  }
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    std::vector<size_t> others;
    for (size_t other = 0; other < site; ++other) others.push_back(other);
    if (others.empty()) return;
    pairs.for_each_ring(site, others, solver, [&](int ring, const Eigen::MatrixXd& of_ring) {
      const Eigen::MatrixXd coefficients = basis.transpose() * of_ring;
      for (const size_t other : others) {
        zone.mutual[static_cast<size_t>(ring - 1) * num_pairs + pack::lower_block(site - 1, other)] =
            coefficients.middleCols<kPairColumns>(kPairColumns * static_cast<Eigen::Index>(other))
                .cast<float>();
      }
    });
    advance(static_cast<size_t>(zone.rings) * others.size());
  });
}

}  // namespace palpate
