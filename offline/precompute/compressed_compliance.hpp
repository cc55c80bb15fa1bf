// The compliance of a surface too large to keep dense, within a tolerance of every entry.
//
// K^-1 is symmetric: the columns of a panel's dofs, 32 nodes beside one another, say what a unit force at any
// contact node j does to the panel. Panel by panel these columns are solved for, and C, 96 x 3 contact nodes,
// is what is left of them; the dense matrix never exists. With s_a = sqrt(K^-1_aa), what a dof moves under its
// own unit force to the half,
//
//   near:  C_j as it is, for nodes nearer to the panel than a part of its size
//   far:   s^-1 C s^-1 = Q diag(sigma) V^T over all far j, singular values falling; by the eigenvectors of the
//          96 x 96 product of the matrix with its transpose, which loses what is below 1e-8 of the largest
//          B = s Q / max s,  Z_j = max s Q^T s^-1 C_j,  C_j ~ B Z_j with as many leading columns as make
//          |C_ab - (B Z)_ab| <= tolerance s_b min(s_a, s_b)
//
// for every entry: a part of the displacement of the dof that is pushed, so that fields are right to it, and
// of sqrt(C_aa C_bb), so that the forces, which come from inverting blocks of C, are.
// (The far field of an elastic force is smooth: Hackbusch, Hierarchical Matrices, 2015, chapter 4.)
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/linear_dd.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// As CompressedCompliance in schemas/pack.fbs.
struct CompressedCompliance {
  double tolerance = 0;
  std::vector<pack::CompressedPanel> panels;
  std::vector<std::uint32_t> node_places;
  std::vector<float> basis;
  std::vector<pack::CompressedBlock> blocks;  // [contact nodes][panels]
  std::vector<float> coefficients;
  // Measured with the runtime (ComplianceErrors); 0 samples: not yet.
  double displacement_error = 0;
  double force_error = 0;
  int samples = 0;

  std::size_t num_bytes() const;
};

// At this tolerance sets of up to 12 contacts on the brain and on blocks of 4,000 and 20,000 nodes have forces
// right to 2e-4 and displacements, of the worst node of the worst set, to 1e-3 of |d|, in a fifth to a seventh
// of the dense bytes. Both errors fall with the tolerance; three times as small a one costs a quarter of the
// bytes more.
inline constexpr double kComplianceTolerance = 1e-4;

// Solves with as many threads as the assembly was made for; the result does not depend on them. Throws as
// compute_linear_dd does. `progress` gets done, total columns. Memory: about twice the result.
CompressedCompliance compress_linear_dd(const Assembly& assembly, const ContactSites& sites, double tolerance,
                                        const std::function<void(int, int)>& progress = {},
                                        const RestState& rest = RestState());

// A of the contact nodes of a site's patch, as the runtime reads it.
Eigen::MatrixXd patch_compliance(const CompressedCompliance& compressed, const ContactSites& sites,
                                 const ContactSite& site);

// Bytes that the dense form takes, and about what this one does.
double dense_compliance_bytes(std::size_t packed_nodes, std::size_t contact_nodes);
double estimate_compressed_bytes(std::size_t packed_nodes, std::size_t contact_nodes);

}  // namespace palpate
