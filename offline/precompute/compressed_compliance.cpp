#include "offline/precompute/compressed_compliance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "offline/fem/parallel_for.hpp"
#include "offline/numerics/decompositions.hpp"

namespace palpate {
namespace {

// Nodes within this fraction of a panel's diagonal are near. The value suits small and large organs.
constexpr double kNearness = 0.4;
// A block that needs more columns stays uncompressed: its bytes grow little, and frames save a product.
constexpr Eigen::Index kMostColumns = 64;
constexpr int kSlab = 96;  // right-hand sides of one solve

// Divides nodes [first, last) into groups of up to 32 neighbours by bisection across the longest side.
void split(const Model& model, std::vector<int>& nodes, size_t first, size_t last,
           std::vector<std::vector<int>>& groups) {
  const size_t count = (last - first + pack::kPanelNodes - 1) / pack::kPanelNodes;
  const auto begin = nodes.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = nodes.begin() + static_cast<std::ptrdiff_t>(last);
  if (count <= 1) {
    groups.emplace_back(begin, end);
    std::sort(groups.back().begin(), groups.back().end());
    return;
  }
  const auto at = [&](int node) -> const Eigen::Vector3d& {
    return model.positions[static_cast<size_t>(node)];
  };
  Eigen::Vector3d low = at(*begin);
  Eigen::Vector3d high = low;
  for (auto node = begin; node != end; ++node) {
    low = low.cwiseMin(at(*node));
    high = high.cwiseMax(at(*node));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  std::sort(begin, end,
            [&](int a, int b) { return at(a)[axis] != at(b)[axis] ? at(a)[axis] < at(b)[axis] : a < b; });
  const size_t middle = first + count / 2 * pack::kPanelNodes;
  split(model, nodes, first, middle, groups);
  split(model, nodes, middle, last, groups);
}

// The blocks of one panel, before lay_out() orders all blocks by contact node.
struct PanelBlocks {
  std::vector<std::uint32_t> ranks;  // for each contact node
  std::vector<size_t> starts;        // offset in `values`, for each contact node
  std::vector<float> values;
};

class Compressor {
 public:
  Compressor(const Assembly& assembly, const ContactSites& sites, double tolerance,
             const std::function<void(int, int)>& progress, const RestState& rest)
      : assembly_(assembly),
        sites_(sites),
        tolerance_(tolerance),
        progress_(progress),
        solver_(assembly),
        num_contacts_(static_cast<int>(sites.contact_nodes.size())) {
    factor_at_rest(solver_, rest);
    group_nodes();
  }

  CompressedCompliance run() {
    total_ = 3 * num_contacts_;
    for (size_t p = 0; p < num_moving_; ++p) total_ += 3 * static_cast<int>(groups_[p].size());
    find_contact_roots();
    CompressedCompliance result;
    result.tolerance = tolerance_;
    std::vector<PanelBlocks> blocks;
    blocks.reserve(groups_.size());
    for (size_t p = 0; p < groups_.size(); ++p) {
      pack::CompressedPanel panel = {};
      std::fill(std::begin(panel.nodes), std::end(panel.nodes), pack::kNoNode);
      for (size_t i = 0; i < groups_[p].size(); ++i)
        panel.nodes[i] = static_cast<std::uint32_t>(packed_of_[static_cast<size_t>(groups_[p][i])]);
      panel.first_column = static_cast<std::uint32_t>(result.basis.size() / pack::kPanelRows);
      blocks.push_back(p < num_moving_ ? compress(groups_[p], result.basis) : empty_blocks());
      panel.num_columns =
          static_cast<std::uint32_t>(result.basis.size() / pack::kPanelRows) - panel.first_column;
      result.panels.push_back(panel);
    }
    result.node_places.resize(sites_.packed_nodes.size());
    for (size_t p = 0; p < groups_.size(); ++p) {
      for (size_t i = 0; i < groups_[p].size(); ++i)
        result.node_places[result.panels[p].nodes[i]] = static_cast<std::uint32_t>(p * pack::kPanelNodes + i);
    }
    lay_out(blocks, result);
    return result;
  }

 private:
  // Groups the moving nodes, then the nodes fixed along all axes, whose panels stay empty.
  void group_nodes() {
    const Model& model = assembly_.model();
    packed_of_.assign(static_cast<size_t>(model.num_nodes()), -1);
    std::vector<int> moving;
    std::vector<int> immovable;
    for (size_t i = 0; i < sites_.packed_nodes.size(); ++i) {
      const int node = sites_.packed_nodes[i];
      packed_of_[static_cast<size_t>(node)] = static_cast<int>(i);
      bool moves = false;
      for (int axis = 0; axis < 3; ++axis)
        moves = moves || assembly_.dof_equations()[static_cast<size_t>(3 * node + axis)] >= 0;
      (moves ? moving : immovable).push_back(node);
    }
    if (!moving.empty()) split(model, moving, 0, moving.size(), groups_);
    num_moving_ = groups_.size();
    if (!immovable.empty()) split(model, immovable, 0, immovable.size(), groups_);
  }

  // Returns the columns of K^-1 at the dofs of these nodes: all dofs x 3 nodes.
  Eigen::MatrixXd columns_of(const std::vector<int>& nodes) {
    Eigen::MatrixXd columns =
        Eigen::MatrixXd::Zero(assembly_.num_dofs(), static_cast<Eigen::Index>(3 * nodes.size()));
    for (size_t i = 0; i < nodes.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis)
        columns(3 * nodes[i] + axis, static_cast<Eigen::Index>(3 * i) + axis) = 1.0;
    }
    if (!solver_.back_solve(columns)) throw std::logic_error("a Cholesky factor always solves");
    done_ += static_cast<int>(columns.cols());
    if (progress_) progress_(done_, total_);
    return columns;
  }

  void find_contact_roots() {
    contact_roots_.resize(3 * num_contacts_);
    for (int first = 0; first < num_contacts_; first += kSlab / 3) {
      std::vector<int> nodes;
      for (int c = first; c < std::min(first + kSlab / 3, num_contacts_); ++c)
        nodes.push_back(sites_.model_node(c));
      contact_roots_.segment(3 * first, static_cast<Eigen::Index>(3 * nodes.size())) =
          roots_of(nodes, columns_of(nodes));
    }
  }

  // Returns s_a = sqrt(K^-1_aa) of these nodes from their columns of K^-1.
  static Eigen::VectorXd roots_of(const std::vector<int>& nodes, const Eigen::MatrixXd& columns) {
    Eigen::VectorXd roots(columns.cols());
    for (Eigen::Index j = 0; j < columns.cols(); ++j)
      roots[j] = std::sqrt(columns(3 * nodes[static_cast<size_t>(j / 3)] + j % 3, j));
    return roots;
  }

  PanelBlocks empty_blocks() const {
    return {std::vector<std::uint32_t>(static_cast<size_t>(num_contacts_), 0),
            std::vector<size_t>(static_cast<size_t>(num_contacts_), 0),
            {}};
  }

  bool is_near(const std::vector<int>& nodes, int contact) const {
    const Model& model = assembly_.model();
    Eigen::AlignedBox3d box;
    for (const int node : nodes) box.extend(model.positions[static_cast<size_t>(node)]);
    const Eigen::Vector3d& at = model.positions[static_cast<size_t>(sites_.model_node(contact))];
    return box.exteriorDistance(at) <= kNearness * box.diagonal().norm();
  }

  // Compresses one panel. Appends the columns of its B to `basis`.
  PanelBlocks compress(const std::vector<int>& nodes, std::vector<float>& basis) {
    const Eigen::MatrixXd columns = columns_of(nodes);
    const Eigen::Index rows = columns.cols();
    const Eigen::VectorXd roots = roots_of(nodes, columns);
    Eigen::MatrixXd compliance(rows, 3 * num_contacts_);  // C, by reciprocity
    for (int c = 0; c < num_contacts_; ++c)
      compliance.middleCols<3>(3 * c) = columns.middleRows<3>(3 * sites_.model_node(c)).transpose();
    std::vector<int> far;
    for (int c = 0; c < num_contacts_; ++c) {
      if (!is_near(nodes, c)) far.push_back(c);
    }
    const Eigen::MatrixXf modes = far_modes(compliance, roots, far);
    // weights = B (max s / s)^2, hence weights^T C = Z. A fixed dof has s = 0 and a row of zeros in C.
    const Eigen::VectorXd inverse_roots = roots.unaryExpr([](double s) { return s > 0 ? 1.0 / s : 0.0; });
    const Eigen::MatrixXd weights =
        (modes.cast<double>().array().colwise() * (roots.maxCoeff() * inverse_roots).array().square())
            .matrix();
    PanelBlocks blocks = empty_blocks();
    std::fill(blocks.ranks.begin(), blocks.ranks.end(), pack::kPanelRows);
    std::vector<std::vector<float>> reduced(far.size());
    parallel_for(assembly_.threads(), static_cast<int>(far.size()), [&](int index, int) {
      const int c = far[static_cast<size_t>(index)];
      const Eigen::Matrix<double, Eigen::Dynamic, 3> exact_block = compliance.middleCols<3>(3 * c);
      const Eigen::Matrix<float, Eigen::Dynamic, 3> z = (weights.transpose() * exact_block).cast<float>();
      const Eigen::Index rank = rank_of(exact_block, modes, z, roots, contact_roots_.segment<3>(3 * c));
      if (rank < 0) return;
      blocks.ranks[static_cast<size_t>(c)] = static_cast<std::uint32_t>(rank);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        for (Eigen::Index k = 0; k < rank; ++k) reduced[static_cast<size_t>(index)].push_back(z(k, axis));
      }
    });
    Eigen::Index used = 0;
    auto next_far = far.begin();
    for (int c = 0; c < num_contacts_; ++c) {
      const size_t at = static_cast<size_t>(c);
      blocks.starts[at] = blocks.values.size();
      const bool is_far = next_far != far.end() && *next_far == c;
      if (is_far && blocks.ranks[at] < pack::kPanelRows) {
        const std::vector<float>& values = reduced[static_cast<size_t>(next_far - far.begin())];
        blocks.values.insert(blocks.values.end(), values.begin(), values.end());
        used = std::max(used, static_cast<Eigen::Index>(blocks.ranks[at]));
      } else {
        for (int axis = 0; axis < 3; ++axis) append_rows(compliance.col(3 * c + axis), blocks.values);
      }
      if (is_far) ++next_far;
    }
    for (Eigen::Index k = 0; k < used; ++k) append_rows(modes.col(k), basis);
    return blocks;
  }

  // Returns B for the far nodes, at most kMostColumns columns, in stored precision.
  Eigen::MatrixXf far_modes(const Eigen::MatrixXd& compliance, const Eigen::VectorXd& roots,
                            const std::vector<int>& far) const {
    const Eigen::Index rows = compliance.rows();
    if (far.empty()) return {rows, 0};
    Eigen::MatrixXd scaled(rows, static_cast<Eigen::Index>(3 * far.size()));
    for (size_t i = 0; i < far.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const int column = 3 * far[i] + axis;
        scaled.col(static_cast<Eigen::Index>(3 * i) + axis) = compliance.col(column) / contact_roots_[column];
      }
    }
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (roots[row] > 0) scaled.row(row) /= roots[row];
    }
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(rows, rows);
    product.selfadjointView<Eigen::Lower>().rankUpdate(scaled);
    const SymmetricModes modes = symmetric_modes(product);
    const Eigen::Index step = pack::kRankStep;
    const Eigen::Index count = std::min(kMostColumns, rows) / step * step;
    return (modes.vectors.rightCols(count).rowwise().reverse().array().colwise() *
            (roots / roots.maxCoeff()).array())
        .cast<float>();
  }

  // Returns the fewest columns that keep every entry within tolerance; -1 where all columns do not suffice.
  Eigen::Index rank_of(const Eigen::Matrix<double, Eigen::Dynamic, 3>& exact_block,
                       const Eigen::MatrixXf& modes, const Eigen::Matrix<float, Eigen::Dynamic, 3>& z,
                       const Eigen::VectorXd& roots, const Eigen::Vector3d& contact_roots) const {
    Eigen::Matrix<double, Eigen::Dynamic, 3> error = exact_block;
    for (Eigen::Index rank = 0;; rank += pack::kRankStep) {
      bool is_within = true;
      for (Eigen::Index axis = 0; axis < 3 && is_within; ++axis) {
        const double s_b = contact_roots[axis];
        is_within = (error.col(axis).array().abs() <= tolerance_ * s_b * roots.array().min(s_b)).all();
      }
      if (is_within) return rank;
      if (rank >= modes.cols()) return -1;
      constexpr int kStep = pack::kRankStep;
      error.noalias() -=
          modes.middleCols<kStep>(rank).cast<double>() * z.middleRows<kStep>(rank).cast<double>();
    }
  }

  template <typename Column>
  static void append_rows(const Column& column, std::vector<float>& out) {
    for (Eigen::Index row = 0; row < pack::kPanelRows; ++row)
      out.push_back(row < column.size() ? static_cast<float>(column[row]) : 0.0f);
  }

  // Stores the blocks of each contact node together, at multiples of 64 bytes; uncompressed blocks first.
  void lay_out(std::vector<PanelBlocks>& panels, CompressedCompliance& result) const {
    constexpr size_t kLine = pack::kAlignment / sizeof(pack::Real);
    size_t total = 0;
    for (int c = 0; c < num_contacts_; ++c) {
      for (const PanelBlocks& panel : panels) total += 3 * panel.ranks[static_cast<size_t>(c)];
      total = pack::round_up(total, kLine);
    }
    if (total / pack::kBlockUnit > std::numeric_limits<std::uint32_t>::max())
      throw std::runtime_error(
          assembly_.model().file +
          ": the compliance of this surface is beyond 64 GB; make sites or output fewer");
    result.coefficients.reserve(total);
    result.blocks.resize(static_cast<size_t>(num_contacts_) * panels.size());
    for (int c = 0; c < num_contacts_; ++c) {
      const size_t at = static_cast<size_t>(c);
      for (const bool exact : {true, false}) {
        for (size_t p = 0; p < panels.size(); ++p) {
          const PanelBlocks& panel = panels[p];
          if ((panel.ranks[at] == pack::kPanelRows) != exact) continue;
          result.blocks[at * panels.size() + p] = {
              static_cast<std::uint32_t>(result.coefficients.size() / pack::kBlockUnit), panel.ranks[at]};
          const auto from = panel.values.begin() + static_cast<std::ptrdiff_t>(panel.starts[at]);
          result.coefficients.insert(result.coefficients.end(), from,
                                     from + static_cast<std::ptrdiff_t>(3 * panel.ranks[at]));
        }
      }
      result.coefficients.resize(pack::round_up(result.coefficients.size(), kLine), 0.0f);
    }
  }

  const Assembly& assembly_;
  const ContactSites& sites_;
  double tolerance_;
  const std::function<void(int, int)>& progress_;
  StaticSolver solver_;
  int num_contacts_;
  std::vector<int> packed_of_;            // for each node of the model; -1: not packed
  std::vector<std::vector<int>> groups_;  // nodes of the model
  size_t num_moving_ = 0;                 // number of groups of moving nodes
  Eigen::VectorXd contact_roots_;         // s of each contact dof
  int done_ = 0;
  int total_ = 0;
};

}  // namespace

std::size_t CompressedCompliance::num_bytes() const {
  return panels.size() * sizeof panels[0] + node_places.size() * sizeof node_places[0] +
         basis.size() * sizeof basis[0] + blocks.size() * sizeof blocks[0] +
         coefficients.size() * sizeof coefficients[0];
}

CompressedCompliance compress_linear_dd(const Assembly& assembly, const ContactSites& sites, double tolerance,
                                        const std::function<void(int, int)>& progress,
                                        const RestState& rest) {
  return Compressor(assembly, sites, tolerance, progress, rest).run();
}

Eigen::MatrixXd patch_compliance(const CompressedCompliance& compressed, const ContactSites& sites,
                                 const ContactSite& site) {
  const auto size = static_cast<Eigen::Index>(3 * site.patch.size());
  Eigen::MatrixXd compliance(size, size);
  for (Eigen::Index j = 0; j < size; j += 3) {
    const auto column_node = static_cast<std::size_t>(site.patch[static_cast<std::size_t>(j / 3)]);
    for (Eigen::Index i = j; i < size; i += 3) {
      const auto row_node = static_cast<std::size_t>(site.patch[static_cast<std::size_t>(i / 3)]);
      const std::uint32_t place =
          compressed.node_places[static_cast<std::size_t>(sites.contact_nodes[row_node])];
      const std::uint32_t panel = place / pack::kPanelNodes;
      const auto row = static_cast<Eigen::Index>(3 * (place % pack::kPanelNodes));
      const pack::CompressedBlock& block = compressed.blocks[column_node * compressed.panels.size() + panel];
      const auto rank = static_cast<Eigen::Index>(block.rank);
      const Eigen::Map<const Eigen::MatrixXf> weights(
          &compressed.coefficients[std::size_t{block.start} * pack::kBlockUnit], rank, 3);
      Eigen::Matrix3d entry;
      if (block.rank == pack::kPanelRows) {
        entry = weights.middleRows<3>(row).cast<double>();
      } else {
        const Eigen::Map<const Eigen::MatrixXf> basis(
            &compressed.basis[std::size_t{compressed.panels[panel].first_column} * pack::kPanelRows],
            pack::kPanelRows, rank);
        entry = basis.middleRows<3>(row).cast<double>() * weights.cast<double>();
      }
      if (i == j) entry.triangularView<Eigen::StrictlyUpper>() = entry.transpose();
      compliance.block<3, 3>(i, j) = entry;
      compliance.block<3, 3>(j, i) = entry.transpose();
    }
  }
  return compliance;
}

double dense_compliance_bytes(std::size_t packed_nodes, std::size_t contact_nodes) {
  const double rows =
      pack::num_panels(static_cast<uint32_t>(packed_nodes)) * static_cast<double>(pack::kPanelRows);
  const double contact_dofs = 3.0 * static_cast<double>(contact_nodes);
  return 0.5 * contact_dofs * contact_dofs * sizeof(double) + contact_dofs * rows * sizeof(pack::Real);
}

double estimate_compressed_bytes(std::size_t packed_nodes, std::size_t contact_nodes, double tolerance) {
  const double panels = pack::num_panels(static_cast<uint32_t>(packed_nodes));
  // Typical compact organ: near panels, and columns of far panels.
  constexpr double kNearPanels = 9;
  const double mean_rank = tolerance >= kBridgingTolerance ? 8 : 20;
  const double near = std::min(panels, kNearPanels);
  return static_cast<double>(contact_nodes) * (near * pack::kPanelRows + (panels - near) * mean_rank) * 3 *
         sizeof(pack::Real);
}

}  // namespace palpate
