// Compresses the compliance of a large surface within a tolerance of every entry.
//
// A panel has 32 neighbouring nodes. K^-1 is symmetric: its columns at the dofs of a panel give the response
// of the panel to a unit force at any contact node j. The code solves for C [96 x 3 contact nodes] of one
// panel at a time; the dense matrix never exists. With s_a = sqrt(K^-1_aa):
//
//   near:  C_j unchanged, for nodes j near the panel
//   far:   s^-1 C s^-1 = Q diag(sigma) V^T over all far j, singular values falling, by the eigenvectors of
//          the 96 x 96 Gram matrix (relative accuracy 1e-8)
//          B = s Q / max s,  Z_j = max s Q^T s^-1 C_j,  C_j ~ B Z_j with the fewest leading columns so that
//          |C_ab - (B Z)_ab| <= tolerance s_b min(s_a, s_b)
//
// The error is at most tolerance C_bb, which bounds fields, and at most tolerance sqrt(C_aa C_bb), which
// bounds forces from inverted blocks of C. Few columns suffice, because the far field of an elastic force is
// smooth (Hackbusch, Hierarchical Matrices, 2015, chapter 4).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/linear_dd.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// The arrays of CompressedCompliance in schemas/pack.fbs.
struct CompressedCompliance {
  double tolerance = 0;
  std::vector<pack::CompressedPanel> panels;
  std::vector<std::uint32_t> node_places;
  std::vector<float> basis;
  std::vector<pack::CompressedBlock> blocks;  // [contact nodes][panels]
  std::vector<float> coefficients;
  // Measured with the runtime (ComplianceErrors); 0 samples: not measured.
  double displacement_error = 0;
  double force_error = 0;
  int samples = 0;

  std::size_t num_bytes() const;
};

// Relative tolerance: forces and displacements then lie well within common accuracy targets.
inline constexpr double kComplianceTolerance = 1e-4;

// The same where linear_dd only bridges the time until zones are prepared. Its own error beside a nonlinear
// organ is a few percent there, and stays as it is; the bytes halve (offline/measurements.md).
inline constexpr double kBridgingTolerance = 1e-3;

// Compresses the compliance on the threads of `assembly`; the result does not depend on threads. Throws as
// compute_linear_dd(). `progress` gets done and total columns. Memory: about twice the result.
CompressedCompliance compress_linear_dd(const Assembly& assembly, const ContactSites& sites, double tolerance,
                                        const std::function<void(int, int)>& progress = {},
                                        const RestState& rest = RestState());

// Returns the compliance A of a site's patch, (3 patch nodes)^2, as the runtime reads the blocks.
Eigen::MatrixXd patch_compliance(const CompressedCompliance& compressed, const ContactSites& sites,
                                 const ContactSite& site);

// These functions return the bytes of the dense form, and estimate the bytes of the compressed form.
double dense_compliance_bytes(std::size_t packed_nodes, std::size_t contact_nodes);
double estimate_compressed_bytes(std::size_t packed_nodes, std::size_t contact_nodes, double tolerance);

}  // namespace palpate
