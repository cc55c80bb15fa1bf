// nonlinear_zone: what the runtime needs to put nonlinear elements around any contacts and the linear rest of the
// organ onto their boundary (runtime/src/zone_set.hpp has the equations).
//
// The zone of a site with n rings is the elements at the nodes of its patch, the elements at their nodes, and so on n
// times, and in the end the rest of their volume patches. Where pairs of contacts are known (num_pairs), the elements
// that share a node with it and are not in it are its rim (runtime/src/zone_rim.hpp). Carried are the elements and nodes
// of all sites' zones and rims, and the compliance K^-1 at rest between those nodes, of which the rows and columns of
// contact nodes are linear_dd's; and what the organ outside adds to its linear answer (zone_exterior.hpp).
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
  bool rounded = false;                  // whether a pack has its fields as int16
  std::vector<std::uint8_t> more_rings;  // of each site: those that its zones have beyond the rings asked for
  std::vector<int>
      nodes;  // model nodes: contact nodes in their order, others that are free along some axis, fixed ones
  int num_free = 0;              // of them the first
  std::vector<int> elements;     // in Model::elements: patch by patch, then those that share no volume
  std::vector<int> num_outside;  // of each node: elements of the model that are not among these
  // Largest zone of a site, or half of what two near ones share, whichever is larger.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
  // The same of their rims, of any number of rings; 0 where nothing of pairs is carried.
  int most_rim_nodes = 0;
  int most_rim_elements = 0;
  // C of the free nodes after the contact nodes: a column for each of their dofs, rows of all free nodes.
  Eigen::MatrixXd compliance;
  Eigen::MatrixXd field_compliance;  // the same columns, rows of packed nodes
  // Free ones of zones that are not packed, in their order, and of rims where there is something between; model nodes
  std::vector<int> inner_nodes;
  // Of each site: the net force that x = 1 stands for, at least as large as one at the scene's largest displacement is
  // in a linear organ.
  std::vector<double> force_scale;
  int exterior_degree = pack::kLeastZoneDegree;
  // q of ring 1 for each site, then of ring 2, ...: rows of packed nodes, then of inner ones; a column for each
  // monomial of degrees 2 .. exterior_degree of x = f / force_scale.
  std::vector<Eigen::Matrix<pack::Real, Eigen::Dynamic, Eigen::Dynamic>> exterior;
  // Pairs of sites of which it is known what they add to that: all where a scene has several contacts at a time, none of
  // too many sites. Columns of its own that each has (zone_mutual.hpp).
  std::size_t num_pairs = 0;
  int num_pair_fields = 0;
  int pair_degree = pack::kLeastPairDegree;
  bool between = false;  // zones of near contacts hold what is next to both
  // What sites i > j, at lower_block(i - 1, j), add; empty until that is known, and where it is nothing. Their own
  // columns, rows as those of exterior, in units of 1 / pack::kPairUnit of the scene's largest displacement;
  using PairFields = Eigen::Matrix<std::int8_t, Eigen::Dynamic, Eigen::Dynamic>;
  std::vector<PairFields> pair_fields;
  // and for each ring, and in it each pair, weights of the exterior's first pack::kPairColumns columns of i, of those
  // of j, and of these, x pack::kPairMonomials to pair_degree.
  std::vector<Eigen::MatrixXf> pair_weights;

  // Of the zone of a site, where so many are asked for.
  int rings_of(size_t site, int asked_for) const { return asked_for + more_rings[site]; }
};

// The dofs that rows of `exterior` are.
std::vector<Eigen::Index> exterior_dofs(const ContactSites& sites, const ZoneTables& zone);

// Which elements are in the zone of a site.
class ZoneFinder {
 public:
  explicit ZoneFinder(const Model& model);
  // Ascending. Thread-safe.
  std::vector<int> elements_about(const ContactSite& site, int rings) const;
  // Those that share a node with some elements and are not among them.
  std::vector<int> elements_next_to(const std::vector<int>& elements) const;
  // Of these those that rims hold.
  std::vector<int> rim_of(const std::vector<int>& elements) const;
  // The zones of two near contacts and what is between them (runtime/src/zone_members.hpp).
  std::vector<int> elements_of_near(const std::vector<int>& elements, const std::vector<int>& others) const;
  std::vector<int> nodes_of(const std::vector<int>& elements) const;
  const std::vector<int>& elements_of(int node) const { return by_node_[static_cast<size_t>(node)]; }

 private:
  const Model* model_;
  std::vector<std::vector<int>> by_node_;
  std::vector<std::vector<int>> by_patch_;
};

// Which nodes and elements, and to which degree what is outside of zones is to be carried; all else is left empty.
// `more_rings`: of each site; none where it is empty. `may_hold_between`: false to leave out what is between near contacts
// where their target would ask for it.
ZoneTables find_zones(const Scene& scene, const Model& model, const ContactSites& sites, int rings,
                      std::vector<std::uint8_t> more_rings = {}, bool may_hold_between = true);

// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done, total columns.
void compute_zone_compliance(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                             const std::function<void(int, int)>& progress, ZoneTables& zone);

// Of num_pair_fields, those for what is of third order.
inline constexpr int kThirdOrderFields = 8;

// Bytes of a pack that the compliance and the exterior take, at most.
double zone_bytes(const ZoneTables& zone, const ContactSites& sites);

}  // namespace palpate
