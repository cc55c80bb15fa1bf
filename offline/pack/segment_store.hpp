// The bulk arrays of a pack, and the layouts that several tables share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Bulk arrays, one after the other, each at a multiple of pack::kAlignment.
class SegmentStore {
 public:
  // Appends an array. Returns its offset from the first array, and its size, in bytes.
  template <typename Values>
  pack::Segment add(const Values& values) {
    const size_t offset = body_.size();
    const size_t bytes = values.size() * sizeof(typename Values::value_type);
    body_.resize(pack::round_up(offset + bytes, pack::kAlignment), 0);
    if (bytes > 0) std::memcpy(body_.data() + offset, values.data(), bytes);
    return {offset, bytes};
  }
  // Converts to the pack's precision.
  pack::Segment add_reals(const std::vector<float>& values) {
    if constexpr (std::is_same_v<pack::Real, float>) {
      return add(values);
    } else {
      return add(std::vector<pack::Real>(values.begin(), values.end()));
    }
  }
  const std::vector<unsigned char>& body() const { return body_; }

 private:
  std::vector<unsigned char> body_;
};

// Converts an offset in the store to an offset in the file, where the store begins at `base`.
inline pack::Segment placed(const pack::Segment& segment, uint64_t base) {
  return pack::Segment(base + segment.offset(), segment.bytes());
}

inline size_t num_panels(const ContactSites& sites) {
  return pack::num_panels(static_cast<uint32_t>(sites.packed_nodes.size()));
}

// Appends the rows of one panel, column by column; pads with zeros.
template <typename Columns, typename Number>
void append_panel(const Eigen::MatrixBase<Columns>& columns, size_t panel, std::vector<Number>& out) {
  for (Eigen::Index column = 0; column < columns.cols(); ++column) {
    for (size_t i = 0; i < pack::kPanelRows; ++i) {
      const auto row = static_cast<Eigen::Index>(panel * pack::kPanelRows + i);
      out.push_back(row < columns.rows() ? static_cast<Number>(columns(row, column)) : Number{0});
    }
  }
}

// Appends a panel as int16, in multiples of units[column] / kBasisUnit, in the order of
// pack::rounded_place(). Needs at least three columns.
template <typename Columns>
void append_rounded_panel(const Eigen::MatrixBase<Columns>& columns, const Eigen::VectorXd& units,
                          size_t panel, std::vector<std::int16_t>& out) {
  const auto count = static_cast<uint32_t>(columns.cols());
  const size_t start = out.size();
  out.resize(start + pack::rounded_panel_numbers(count));
  const auto first = static_cast<Eigen::Index>(panel * pack::kPanelRows);
  const Eigen::Index rows = std::min<Eigen::Index>(pack::kPanelRows, columns.rows() - first);
  for (uint32_t column = 0; column < count; ++column) {
    const double per_unit = units[column] > 0 ? pack::kBasisUnit / units[column] : 0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double entry = per_unit * static_cast<double>(columns(first + i, column));
      out[start + pack::rounded_place(column, static_cast<uint32_t>(i))] =
          static_cast<std::int16_t>(std::lround(entry));
    }
  }
}

// Returns the entries row by row.
inline std::vector<double> by_rows(const Eigen::MatrixXd& matrix) {
  std::vector<double> numbers;
  for (const auto& row : matrix.rowwise()) numbers.insert(numbers.end(), row.begin(), row.end());
  return numbers;
}

}  // namespace palpate
