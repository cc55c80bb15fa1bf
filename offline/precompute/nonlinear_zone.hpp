// nonlinear_zone: data for nonlinear elements around any contacts, coupled to the linear rest of the organ at
// their boundary. runtime/src/zone has the equations.
//
// The zone of a site with n rings has the elements at its patch's nodes, extended n times by neighbours, and
// completes volume patches. With known pairs (num_pairs) the near-field ring is the elements that share a
// node with the zone. A pack carries:
//   1. elements and nodes of all zones and rings,
//   2. the compliance K^-1 at rest between these nodes; linear_dd has the blocks of contact nodes,
//   3. the exterior's nonlinear terms (zone_exterior.hpp).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"
#include "schemas/pack_layout.hpp"
#include "schemas/pair_monomials.hpp"

namespace palpate {

struct ZoneTables {
  int rings = 0;
  bool rounded = false;                  // packs store its fields as int16
  std::vector<std::uint8_t> more_rings;  // for each site: additional rings of its zones
  std::vector<int> nodes;        // model nodes: contact nodes in their order, other free nodes, fixed nodes
  int num_free = 0;              // the first num_free nodes are free
  std::vector<int> elements;     // in Model::elements: patch by patch, then elements without a shared volume
  std::vector<int> num_outside;  // for each node: elements of the model outside of `elements`
  // Size of the largest zone, or of half the zone of two near contacts, whichever is larger.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
  // The same for near-field rings, any number of rings; 0 without pairs.
  int most_rim_nodes = 0;
  int most_rim_elements = 0;
  // C of the free nodes after the contact nodes: a column for each of their dofs, rows of all free nodes.
  Eigen::MatrixXd compliance;
  Eigen::MatrixXd field_compliance;  // the same columns, rows of packed nodes
  // Unpacked free nodes of zones, in order, and of near-field rings where `between` is set; model nodes.
  std::vector<int> inner_nodes;
  // For each site: the net force of x = 1, at least the linear organ's force at the scene's largest displacement.
  std::vector<double> force_scale;
  int exterior_degree = pack::kLeastZoneDegree;
  // q for ring 1 of each site, then ring 2, ...: rows of packed nodes, then of inner nodes; a column for each
  // monomial of degrees 2 .. exterior_degree of x = f / force_scale.
  std::vector<Eigen::Matrix<pack::Real, Eigen::Dynamic, Eigen::Dynamic>> exterior;
  // Number of site pairs with interaction terms: all pairs where a scene has several contacts, none for too
  // many sites. Each pair has its own columns (zone_mutual.hpp).
  std::size_t num_pairs = 0;
  int num_pair_fields = 0;
  int pair_degree = pack::kLeastPairDegree;
  bool between = false;  // zones of near contacts include their common neighbours
  // Interaction of sites i > j, at lower_block(i - 1, j); empty before the computation and for linear organs. The
  // pair's own columns, rows as in exterior, in units of 1 / pack::kPairUnit of the scene's largest displacement;
  using PairFields = Eigen::Matrix<std::int8_t, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<PairFields> pair_fields;
  // and for each ring and pair the weights of three groups of columns: the first pack::kPairColumns exterior
  // columns of i, the same columns of j, and the pair's own; x pack::kPairMonomials to pair_degree.
  std::vector<Eigen::MatrixXf> pair_weights;

  // Rings of a site's zone for a request of `asked_for` rings.
  int rings_of(size_t site, int asked_for) const { return asked_for + more_rings[site]; }
};

// The dofs of the rows of `exterior`.
std::vector<Eigen::Index> exterior_dofs(const ContactSites& sites, const ZoneTables& zone);

// Finds the elements of zones.
class ZoneFinder {
 public:
  explicit ZoneFinder(const Model& model);
  // Ascending. Thread-safe.
  std::vector<int> elements_about(const ContactSite& site, int rings) const;
  // Returns the elements that share a node with `elements` and are not among them.
  std::vector<int> elements_next_to(const std::vector<int>& elements) const;
  // Returns the elements of the near-field ring.
  std::vector<int> rim_of(const std::vector<int>& elements) const;
  // Returns the zones of two near contacts with the elements between them (runtime/src/zone).
  std::vector<int> elements_of_near(const std::vector<int>& elements, const std::vector<int>& others) const;
  std::vector<int> nodes_of(const std::vector<int>& elements) const;
  const std::vector<int>& elements_of(int node) const { return by_node_[static_cast<size_t>(node)]; }

 private:
  const Model* model_;
  std::vector<std::vector<int>> by_node_;
  std::vector<std::vector<int>> by_patch_;
};

// Finds nodes and elements of zones and the degrees of the exterior; leaves all other members empty. `more_rings`: for
// each site; empty: none. `may_hold_between` = false leaves out elements between near contacts despite the target.
ZoneTables find_zones(const Scene& scene, const Model& model, const ContactSites& sites, int rings,
                      std::vector<std::uint8_t> more_rings = {}, bool may_hold_between = true);

// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done and
// total columns.
void compute_zone_compliance(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                             const std::function<void(int, int)>& progress, ZoneTables& zone);

// The part of num_pair_fields for third order.
inline constexpr int kThirdOrderFields = 8;

// Upper bound of a pack's bytes for compliance and exterior.
double zone_bytes(const ZoneTables& zone, const ContactSites& sites);

}  // namespace palpate
