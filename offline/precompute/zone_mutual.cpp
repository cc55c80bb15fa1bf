#include "offline/precompute/zone_mutual.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include "offline/fem/parallel_for.hpp"
#include "offline/precompute/force_derivatives.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/rigid_patch.hpp"
#include "schemas/pair_monomials.hpp"

namespace palpate {
namespace {

constexpr Eigen::Index kQuadratic = pack::num_monomials(2);
constexpr Eigen::Index kCubic = pack::num_monomials(3);
constexpr Eigen::Index kSecondOrder = pack::num_pair_monomials(2);
constexpr Eigen::Index kMixed = 3 * kQuadratic;  // quadratic in one load, linear in the other
constexpr double kTolerance = 1e-4;              // fraction of the largest singular value
constexpr double kRidge = 1e-6;  // fraction of the largest square: keeps nearly cancelling fields small

// Index of x_a x_b among the quadratic monomials.
Eigen::Index quadratic_of(int a, int b) {
  return a <= b ? a * (5 - a) / 2 + b : quadratic_of(b, a);
}

// Index of x_a times the quadratic monomial of b and c among the cubic monomials.
Eigen::Index cubic_of(int a, int b, int c) {
  uint32_t powers[3] = {};
  for (const int axis : {a, b, c}) ++powers[axis];
  return static_cast<Eigen::Index>(pack::monomial_index(powers[0], powers[1], powers[2]) -
                                   pack::monomial_start(3));
}

template <typename Visit>
void for_each_quadratic(Visit&& visit) {
  for (int a = 0; a < 3; ++a) {
    for (int b = a; b < 3; ++b) visit(a, b, quadratic_of(a, b));
  }
}

// The linear organ's response to a site's load, and its second order.
struct SiteResponse {
  Eigen::MatrixXd first;   // num_dofs x 3
  Eigen::MatrixXd second;  // num_dofs x quadratic monomials; empty for pairs of second order
  double step = 0;         // step of differences along `first`
};

// Interaction fields of site pairs, in monomials of the order of pack::kPairMonomials.
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
        responses_(sites.sites.size()),
        patches_(sites.sites.size()) {
    for (int worker = 0; worker < std::max(1, threads); ++worker) {
      solvers_.push_back(std::make_unique<StaticSolver>(assembly));
      factor_at_rest(*solvers_.back(), rest);
    }
    for_each_site([&](size_t s, StaticSolver& solver) {
      RigidPatch patch(solver, sites.sites[s]);
      SiteResponse& response = responses_[s];
      response.first = zone.force_scale[s] * patch.per_force();
      response.step = difference_step(patch, zone.force_scale[s], sites.mean_surface_edge);
      if (!is_third_order()) return;
      response.second = patch.tied(answer_to(own_second(derivatives(assembly, s, false), response), solver));
      patches_[s].emplace(std::move(patch));
    });
  }

  bool is_third_order() const { return zone_->pair_degree > 2; }
  Eigen::Index num_monomials() const {
    return pack::num_pair_monomials(static_cast<std::uint32_t>(zone_->pair_degree));
  }

  // Calls work(site, solver of the thread) for all sites, sites with the most pairs first.
  template <typename Work>
  void for_each_site(Work&& work) {
    const auto count = static_cast<int>(sites_->sites.size());
    parallel_for(static_cast<int>(solvers_.size()), count, [&](int index, int worker) {
      work(static_cast<size_t>(count - 1 - index), *solvers_[static_cast<size_t>(worker)]);
    });
  }

  // Interaction of a pair outside of a ring.
  struct OfRing {
    Eigen::MatrixXd fields;            // rows of the exterior x monomials, zero in `inside`
    std::vector<Eigen::Index> inside;  // rows inside of zones
  };

  // Over all elements.
  ForceDerivatives derivatives(size_t site) const { return derivatives(*assembly_, site, is_third_order()); }

  // Interaction outside of each ring. `of_site`: the site's derivatives.
  std::vector<OfRing> fields_of(size_t site, const ForceDerivatives& of_site, size_t other,
                                StaticSolver& solver) const {
    // Pairs near at one ring are near at more rings.
    const bool is_any_third = is_third_order() && !are_near(site, other, 1);
    const Eigen::MatrixXd bilinear = second_order(of_site, other);
    Eigen::MatrixXd mixed;
    Eigen::MatrixXd of_both;
    if (is_any_third) {
      of_both = patches_[other]->tied(patches_[site]->tied(answer_to(bilinear, solver)));
      mixed = third_order({site, of_site}, {other, derivatives(other)}, of_both);
    }
    std::vector<OfRing> fields;
    for (int rings = 1; rings <= zone_->rings; ++rings) {
      const bool is_third = is_any_third && !are_near(site, other, rings);
      const std::vector<int> about_site = zone_of(site, rings);
      const std::vector<int> about_other = zone_of(other, rings);
      // Elements outside of both zones.
      std::vector<int> both;
      std::set_union(about_site.begin(), about_site.end(), about_other.begin(), about_other.end(),
                     std::back_inserter(both));
      Eigen::MatrixXd forces(at_rest_.size(), is_third ? num_monomials() : kSecondOrder);
      with_elements(both, [&](const Assembly& of_zones) {
        const ForceDerivatives inside = derivatives(of_zones, site, is_third);
        forces.leftCols<9>() = bilinear - second_order(inside, other);
        if (is_third)
          forces.middleCols<2 * kMixed>(kSecondOrder) =
              mixed - third_order({site, inside}, {other, derivatives(of_zones, other, true)}, of_both);
      });
      // Each site's own terms inside of the other's zone.
      Eigen::Index quadratic = 9;
      Eigen::Index cubic = kSecondOrder + 2 * kMixed;
      for (const auto& [own, of_own, of_other] :
           {std::tuple(site, &about_site, &about_other), std::tuple(other, &about_other, &about_site)}) {
        std::vector<int> elements;
        std::set_difference(of_other->begin(), of_other->end(), of_own->begin(), of_own->end(),
                            std::back_inserter(elements));
        with_elements(elements, [&, own = own](const Assembly& of_elements) {
          const ForceDerivatives inside = derivatives(of_elements, own, is_third);
          forces.middleCols<kQuadratic>(quadratic) = -own_second(inside, responses_[own]);
          if (is_third) forces.middleCols<kCubic>(cubic) = -own_third(inside, responses_[own]);
        });
        quadratic += kQuadratic;
        cubic += kCubic;
      }
      OfRing& of_ring = fields.emplace_back();
      of_ring.inside = rows_inside(both);
      of_ring.fields.setZero(static_cast<Eigen::Index>(shown_.size()), num_monomials());
      const Eigen::MatrixXd answers = answer_to(std::move(forces), solver);
      of_ring.fields.leftCols(answers.cols()) = answers(shown_, Eigen::all);
      of_ring.fields(of_ring.inside, Eigen::all).setZero();
    }
    return fields;
  }

 private:
  // Solves -K^-1 `forces`.
  static Eigen::MatrixXd answer_to(Eigen::MatrixXd forces, StaticSolver& solver) {
    forces *= -1;
    solve_at_rest(solver, forces);
    return forces;
  }

  // Elements of the site's zone.
  std::vector<int> zone_of(size_t site, int rings) const {
    return finder_.elements_about(sites_->sites[site], zone_->rings_of(site, rings));
  }

  // Whether a patch reaches into the other zone; such pairs carry second order only (ZoneSet::near).
  bool are_near(size_t site, size_t other, int rings) const {
    const auto reaches = [&](size_t one, size_t into) {
      const std::vector<int> zone = zone_of(into, rings);
      const std::vector<int>& patch = sites_->sites[one].patch_nodes;
      return std::any_of(patch.begin(), patch.end(), [&](int node) {
        const std::vector<int>& about = finder_.elements_of(node);
        return std::any_of(about.begin(), about.end(), [&](int element) {
          return std::binary_search(zone.begin(), zone.end(), element);
        });
      });
    };
    return reaches(site, other) || reaches(other, site);
  }

  // Rows of nodes whose elements are all among these.
  std::vector<Eigen::Index> rows_inside(const std::vector<int>& elements) const {
    std::vector<Eigen::Index> rows;
    for (size_t row = 0; row < shown_.size(); ++row) {
      const std::vector<int>& about = finder_.elements_of(static_cast<int>(shown_[row] / 3));
      if (std::includes(elements.begin(), elements.end(), about.begin(), about.end()))
        rows.push_back(static_cast<Eigen::Index>(row));
    }
    return rows;
  }

  // Calls use(assembly of these elements alone).
  template <typename Use>
  void with_elements(const std::vector<int>& elements, Use&& use) const {
    Model part = assembly_->model();
    part.elements.clear();
    for (const int e : elements) part.elements.push_back(assembly_->model().elements[static_cast<size_t>(e)]);
    use(Assembly(part, part.fixed_dofs()));
  }

  // Derivatives of the assembly's elements along the first order of a site.
  ForceDerivatives derivatives(const Assembly& assembly, size_t site, bool to_third_order) const {
    return {assembly, at_rest_, responses_[site].first, responses_[site].step, to_third_order};
  }

  // n2(u, u) / 2, u = first x.
  static Eigen::MatrixXd own_second(const ForceDerivatives& along, const SiteResponse& site) {
    Eigen::MatrixXd columns(site.first.rows(), kQuadratic);
    for (int a = 0; a < 3; ++a) {
      const Eigen::MatrixXd n2 = along.second(a, site.first);
      for (int b = a; b < 3; ++b) columns.col(quadratic_of(a, b)) = (a == b ? 0.5 : 1.0) * n2.col(b);
    }
    return columns;
  }

  // n2(u, U2) + n3(u, u, u) / 6, U2 the second order.
  static Eigen::MatrixXd own_third(const ForceDerivatives& along, const SiteResponse& site) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(site.first.rows(), kCubic);
    for (int a = 0; a < 3; ++a) {
      const Eigen::MatrixXd n2 = along.second(a, site.second);
      for_each_quadratic([&](int b, int c, Eigen::Index m) { columns.col(cubic_of(a, b, c)) += n2.col(m); });
      const Eigen::MatrixXd n3 = along.third(a, a, site.first);
      for (int b = 0; b < 3; ++b) columns.col(cubic_of(a, a, b)) += (a == b ? 1.0 / 6 : 0.5) * n3.col(b);
    }
    columns.col(cubic_of(0, 1, 2)) += along.third(0, 1, site.first.col(2));
    return columns;
  }

  // n2(u, v), u of `along` and v = first y of other: x_a y_b at 3 a + b.
  Eigen::MatrixXd second_order(const ForceDerivatives& along, size_t other) const {
    Eigen::MatrixXd columns(at_rest_.size(), 9);
    for (int a = 0; a < 3; ++a) columns.middleCols<3>(3 * a) = along.second(a, responses_[other].first);
    return columns;
  }

  // n2(v, U2_u) + n2(u, U2_uv) + n3(u, u, v) / 2: quadratic monomials of x times y_b; then x_a times
  // quadratic monomials of y. `of_both`: U2_uv, of x_a y_b at 3 a + b.
  struct SiteDerivatives {
    size_t site;
    const ForceDerivatives& along;
  };
  Eigen::MatrixXd third_order(const SiteDerivatives& x, const SiteDerivatives& y,
                              const Eigen::MatrixXd& of_both) const {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(at_rest_.size(), 2 * kMixed);
    for (const bool twice_x : {true, false}) {
      const auto& [site, twice] = twice_x ? x : y;
      const auto& [other, once] = twice_x ? y : x;
      const auto column = [&](Eigen::Index quadratic, int axis) {
        return columns.col(twice_x ? 3 * quadratic + axis : kMixed + kQuadratic * axis + quadratic);
      };
      const auto both = [&](int axis_of_twice, int axis_of_once) {
        return twice_x ? 3 * axis_of_twice + axis_of_once : 3 * axis_of_once + axis_of_twice;
      };
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::MatrixXd n2 = once.second(axis, responses_[site].second);
        for (Eigen::Index m = 0; m < kQuadratic; ++m) column(m, axis) += n2.col(m);
      }
      for (int a = 0; a < 3; ++a) {
        const Eigen::MatrixXd n2 = twice.second(a, of_both);
        for (int b = 0; b < 3; ++b) {
          for (int axis = 0; axis < 3; ++axis) column(quadratic_of(a, b), axis) += n2.col(both(b, axis));
        }
      }
      for_each_quadratic([&, &twice = twice, other = other](int a, int b, Eigen::Index m) {
        const Eigen::MatrixXd n3 = twice.third(a, b, responses_[other].first);
        for (int axis = 0; axis < 3; ++axis) column(m, axis) += (a == b ? 0.5 : 1.0) * n3.col(axis);
      });
    }
    return columns;
  }

  const Assembly* assembly_;
  const ContactSites* sites_;
  const ZoneTables* zone_;
  Eigen::VectorXd at_rest_;
  ZoneFinder finder_;
  std::vector<Eigen::Index> shown_;
  std::vector<SiteResponse> responses_;
  std::vector<std::optional<RigidPatch>> patches_;  // for third order
  std::vector<std::unique_ptr<StaticSolver>> solvers_;
};

using Fields = Eigen::Matrix<pack::Real, Eigen::Dynamic, Eigen::Dynamic>;

// Returns the coefficients of `columns` nearest to each of `fields` in least squares.
Eigen::MatrixXd fit(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& fields) {
  Eigen::MatrixXd gram = columns.transpose() * columns;
  if (gram.isZero(0)) return Eigen::MatrixXd::Zero(columns.cols(), fields.cols());
  gram.diagonal().array() += kRidge * gram.diagonal().maxCoeff();
  return gram.ldlt().solve(columns.transpose() * fields);
}

// Joins the lowest-degree columns of both sites, with zeros in `inside`.
Eigen::MatrixXd side_by_side(const Fields& first, const Fields& second,
                             const std::vector<Eigen::Index>& inside) {
  Eigen::MatrixXd columns(first.rows(), Eigen::Index{2 * pack::kPairColumns});
  columns << first.leftCols<pack::kPairColumns>().cast<double>(),
      second.leftCols<pack::kPairColumns>().cast<double>();
  columns(inside, Eigen::all).setZero();
  return columns;
}

// Returns the leading singular vectors of `fields` scaled to int8, at most `most`; zeros where fewer exist.
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

// Returns a pair's own fields: first of second order, which dominate small loads, then of the remaining third order.
ZoneTables::PairFields own_fields(const Eigen::MatrixXd& fields, Eigen::Index most) {
  const Eigen::MatrixXd third = fields.rightCols(fields.cols() - kSecondOrder);
  if (third.isZero(0)) return largest_parts(fields.leftCols<kSecondOrder>(), most);
  ZoneTables::PairFields own(fields.rows(), most);
  own.leftCols(most - kThirdOrderFields) =
      largest_parts(fields.leftCols<kSecondOrder>(), most - kThirdOrderFields);
  const Eigen::MatrixXd columns = own.leftCols(most - kThirdOrderFields).cast<double>();
  own.rightCols<kThirdOrderFields>() =
      largest_parts(third - columns * fit(columns, third), kThirdOrderFields);
  return own;
}

}  // namespace

void compute_zone_mutual(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone) {
  const size_t num_sites = sites.sites.size();
  const size_t num_pairs = zone.num_pairs;
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

  const Eigen::Index most = zone.num_pair_fields;
  zone.pair_fields.assign(num_pairs, {});
  zone.pair_weights.assign(static_cast<size_t>(zone.rings) * num_pairs, {});
  pairs.for_each_site([&](size_t site, StaticSolver& solver) {
    if (site == 0) return;
    const ForceDerivatives of_site = pairs.derivatives(site);
    for (size_t other = 0; other < site; ++other) {
      std::vector<PairResponses::OfRing> rings = pairs.fields_of(site, of_site, other, solver);
      const size_t pair = pack::lower_block(site - 1, other);
      std::vector<Eigen::MatrixXd> weights;
      for (size_t ring = 0; ring < rings.size(); ++ring) {
        const size_t first = ring * num_sites;
        const Eigen::MatrixXd columns =
            side_by_side(zone.exterior[first + site], zone.exterior[first + other], rings[ring].inside);
        weights.push_back(fit(columns, rings[ring].fields));
        rings[ring].fields -= columns * weights.back();
      }
      zone.pair_fields[pair] = own_fields(rings.back().fields, most);
      const Eigen::MatrixXd own =
          scene.max_displacement / pack::kPairUnit * zone.pair_fields[pair].cast<double>();
      for (size_t ring = 0; ring < rings.size(); ++ring) {
        Eigen::MatrixXd outside = own;
        outside(rings[ring].inside, Eigen::all).setZero();
        Eigen::MatrixXf& of_ring = zone.pair_weights[ring * num_pairs + pair];
        of_ring.resize(2 * pack::kPairColumns + most, pairs.num_monomials());
        of_ring << weights[ring].cast<float>(), fit(outside, rings[ring].fields).cast<float>();
      }
      advance(1);
    }
  });
}

}  // namespace palpate
