#include "offline/cli/path_table.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <iterator>

#include "offline/io/finished_file.hpp"

namespace palpate {

PathTable::PathTable(const Model& model, const ArcLengthControl& control)
    : model_(&model), nodes_(control.watched) {
  if (nodes_.empty() && control.node >= 0) nodes_ = {control.node};
}

void PathTable::add(const PathPoint& point, const Eigen::VectorXd& displacement) {
  if (nodes_.empty() && point.increment == 0) {
    start_ = point;
    start_displacement_ = displacement;
    return;
  }
  if (nodes_.empty()) {
    const Eigen::Matrix3Xd moved = (displacement - start_displacement_).reshaped(3, model_->num_nodes());
    Eigen::Index furthest = 0;
    moved.colwise().squaredNorm().maxCoeff(&furthest);
    nodes_ = {static_cast<int>(furthest)};
    add_row(start_, start_displacement_);
  }
  add_row(point, displacement);
}

void PathTable::add_row(const PathPoint& point, const Eigen::VectorXd& displacement) {
  Row row = {point, {}};
  for (const int node : nodes_) row.displacements.emplace_back(displacement.segment<3>(3 * node));
  rows_.push_back(std::move(row));
}

void PathTable::write(const std::filesystem::path& file) const {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "increment,arc_length,load_factor,current_stiffness,negative_pivots,min_J");
  for (const int node : nodes_) {
    const int label = model_->labels[static_cast<size_t>(node)];
    fmt::format_to(out, ",ux_{0},uy_{0},uz_{0}", label);
  }
  fmt::format_to(out, "\n");
  for (const Row& row : rows_) {
    const PathPoint& point = row.point;
    fmt::format_to(out, "{},{:.12g},{:.12g},{:.12g},{},{:.12g}", point.increment, point.arc_length,
                   point.load_factor, point.current_stiffness, point.negative_pivots, point.min_jacobian);
    for (const Eigen::Vector3d& u : row.displacements)
      fmt::format_to(out, ",{:.12g},{:.12g},{:.12g}", u[0], u[1], u[2]);
    fmt::format_to(out, "\n");
  }
  write_finished_text(file, {text.data(), text.size()});
}

}  // namespace palpate
