// The inner loops of every field: all instruction sets of this processor agree with plain loops to the bound
// in field_kernel.hpp.
#include "runtime/src/numerics/field_kernel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "offline/pack/pack_writer.hpp"

namespace palpate {
namespace field_kernel_test {

constexpr double kEpsilon = static_cast<double>(std::numeric_limits<pal_real>::epsilon());

TEST(FieldKernel, AllAgreeWithScalarWithinTheStatedBound) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<pal_real> value(-1, 1);
  std::uniform_int_distribution<int> exponent(-20, 20);
  const auto any = [&] { return std::ldexp(value(random), exponent(random)); };
  constexpr size_t kStride = 2 * pack::kPanelRows;
  constexpr uint32_t kMostColumns = 128;
  AlignedBytes memory(kMostColumns * kStride * sizeof(pal_real));
  auto* columns = reinterpret_cast<pal_real*>(memory.bytes().data());
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t num_kernels = list_field_kernels(kernels);
  for (const uint32_t count : {0u, 1u, 2u, 3u, 19u, 55u, 128u}) {
    for (size_t i = 0; i < kMostColumns * kStride; ++i) columns[i] = any();
    std::vector<pal_real> weights(count + 1);  // never empty
    for (pal_real& weight : weights) weight = any();
    std::vector<pal_real> scalar(pack::kPanelRows);
    for (pal_real& start : scalar) start = any();
    const std::vector<pal_real> start = scalar;
    kernels[0].add_columns(columns, kStride, weights.data(), count, true, scalar.data());
    std::vector<pal_real> fused;  // result of the first kernel with fused multiply-add
    for (uint32_t k = 0; k < num_kernels; ++k) {
      SCOPED_TRACE(kernels[k].name);
      std::vector<pal_real> result = start;
      kernels[k].add_columns(columns, kStride, weights.data(), count, true, result.data());
      std::vector<pal_real> from_zero(pack::kPanelRows, 7);
      kernels[k].add_columns(columns, kStride, weights.data(), count, false, from_zero.data());
      std::vector<pal_real> added(pack::kPanelRows);
      kernels[k].add_columns(columns, kStride, weights.data(), count, true, added.data());
      EXPECT_EQ(from_zero, added);
      for (size_t i = 0; i < pack::kPanelRows; ++i) {
        double magnitude =
            std::abs(static_cast<double>(start[i]));  // the start value takes part in the rounding
        double exact = static_cast<double>(start[i]);
        for (uint32_t j = 0; j < count; ++j) {
          const double product =
              static_cast<double>(weights[j]) * static_cast<double>(columns[j * kStride + i]);
          magnitude += std::abs(product);
          exact += product;
        }
        const double bound = count * kEpsilon * magnitude;
        EXPECT_LE(std::abs(static_cast<double>(scalar[i]) - static_cast<double>(result[i])), bound);
        EXPECT_LE(std::abs(static_cast<double>(result[i]) - exact), bound);
      }
      if (k == 1) fused = result;
      if (k > 1) {
        EXPECT_EQ(result, fused);
      }
    }
  }
}

// ---- Columns of int16

constexpr uint32_t kMostPairs = pack::num_column_pairs(3 + pack::kMostRank);

// The operands of a call, with columns on cache lines.
struct RoundedPanel {
  explicit RoundedPanel(uint32_t num_pairs)
      : num_columns(3 + 2 * num_pairs), memory(sizeof(int16_t) * pack::rounded_panel_numbers(num_columns)) {
    rounded.num_pairs = num_pairs;
    rounded.first_unit = rounded.unit = 1;
    for (int16_t& weight : rounded.weights) weight = 0;
  }

  int16_t* columns() { return reinterpret_cast<int16_t*>(memory.bytes().data()); }
  int16_t& entry(uint32_t column, size_t row) {
    return columns()[pack::rounded_place(column, static_cast<uint32_t>(row))];
  }
  // Sum over the columns [first, end), in 64-bit integers.
  int64_t integer(size_t row, uint32_t first, uint32_t end) {
    int64_t sum = 0;
    for (uint32_t k = first; k < end; ++k) sum += int64_t{rounded.weights[k]} * int64_t{entry(k, row)};
    return sum;
  }

  uint32_t num_columns;
  AlignedBytes memory;
  RoundedWeights rounded;
};

// Every entry has its own place, and the entries of a pair are adjacent.
TEST(FieldKernel, RoundedColumnsFillTheirPanel) {
  for (const uint32_t columns : {3u, 4u, 5u, 16u, 52u, 99u}) {
    SCOPED_TRACE(columns);
    std::vector<int> taken(pack::rounded_panel_numbers(columns));
    EXPECT_EQ(taken.size() * sizeof(int16_t) % pack::kAlignment, 0);
    for (uint32_t column = 0; column < columns; ++column) {
      for (uint32_t row = 0; row < pack::kPanelRows; ++row) {
        ++taken.at(pack::rounded_place(column, row));
        if (column == 1 || (column > 3 && column % 2 == 0)) {
          EXPECT_EQ(pack::rounded_place(column, row), pack::rounded_place(column - 1, row) + 1);
        }
      }
    }
    EXPECT_EQ(*std::max_element(taken.begin(), taken.end()), 1);
  }
}

// Error of a kernel against 64-bit integer sums, over its stated bound. The sum starts from `start`, or from
// zero.
double error_over_bound(AddRounded add_rounded, RoundedPanel& panel, const std::vector<pal_real>& start) {
  std::vector<pal_real> result = start.empty() ? std::vector<pal_real>(pack::kPanelRows, 7) : start;
  add_rounded(panel.columns(), panel.rounded, !start.empty(), result.data());
  double worst = 0;
  for (size_t i = 0; i < pack::kPanelRows; ++i) {
    const double from = start.empty() ? 0.0 : static_cast<double>(start[i]);
    double exact = from;
    double magnitude = std::abs(from);
    const auto add = [&](uint32_t first, uint32_t end, pal_real unit) {
      const int64_t integer = panel.integer(i, first, end);
      if (std::abs(integer) > int64_t{std::numeric_limits<int32_t>::max()})
        throw std::logic_error("more than the kernel need bear");
      exact += static_cast<double>(unit) * static_cast<double>(integer);
      magnitude += std::abs(static_cast<double>(unit) * static_cast<double>(integer));
    };
    add(0, 3, panel.rounded.first_unit);
    add(3, panel.num_columns, panel.rounded.unit);
    const double error = std::abs(static_cast<double>(result[i]) - exact);
    if (error > 0) worst = std::max(worst, error / (4 * kEpsilon * magnitude));
  }
  return worst;
}

void expect_exact(RoundedPanel& panel, const std::vector<pal_real>& start) {
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t num_kernels = list_field_kernels(kernels);
  for (uint32_t k = 0; k < num_kernels; ++k) {
    // Half the bound for each kernel: any two are then within the bound of each other.
    ASSERT_LE(error_over_bound(kernels[k].add_rounded, panel, start), 0.5) << kernels[k].name;
    ASSERT_LE(error_over_bound(kernels[k].add_rounded, panel, {}), 0.5) << kernels[k].name;
  }
}

TEST(FieldKernel, RoundedColumnsAreSummedExactly) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<pal_real> value(-1, 1);
  std::uniform_int_distribution<int> exponent(-20, 20);
  const auto any = [&] { return std::ldexp(value(random), exponent(random)); };
  for (const uint32_t num_pairs : {0u, 1u, 2u, 3u, 8u, 15u, kMostPairs}) {
    SCOPED_TRACE(num_pairs);
    for (int round = 0; round < 20; ++round) {
      RoundedPanel panel(num_pairs);
      for (pal_real* unit : {&panel.rounded.first_unit, &panel.rounded.unit})
        *unit = std::abs(any()) / pack::kBasisUnit;
      const int most = static_cast<int>(65000 / panel.num_columns);
      std::uniform_int_distribution<int> weight(-std::min(most, 32767), std::min(most, 32767));
      std::uniform_int_distribution<int> entry(-32767, 32767);
      for (uint32_t k = 0; k < panel.num_columns; ++k)
        panel.rounded.weights[k] = static_cast<int16_t>(weight(random));
      for (size_t i = 0; i < pack::rounded_panel_numbers(panel.num_columns); ++i)
        panel.columns()[i] = static_cast<int16_t>(entry(random));
      std::vector<pal_real> start(pack::kPanelRows);
      for (pal_real& row : start) row = any();
      expect_exact(panel, start);
    }
  }
}

// Sums of the largest numbers with all signs, where 16 bits saturate and 32 bits overflow on any excess. The
// weights' magnitudes add up to 65535. No builder writes an entry of -32768, but a pack may hold one.
TEST(FieldKernel, TheLargestRoundedSumsDoNotOverflow) {
  const std::vector<pal_real> start(pack::kPanelRows, 0);
  std::mt19937_64 random(9);
  constexpr uint32_t kMost = pack::kMostRank;
  constexpr int kEach = 65535 / static_cast<int>(kMost);
  const std::vector<std::vector<int>> weight_sets = {
      {32767, 32767, 1, 0},           {-32767, -32767, -1, 0}, {32767, -32767, 0, 1},
      {0, 32767, 32767, 1},           {1, 32766, -32767, 1},   std::vector<int>(kMost, kEach),
      std::vector<int>(kMost, -kEach)};
  for (const std::vector<int>& weights : weight_sets) {
    for (const int largest : {32767, -32767, -32768}) {
      for (const bool same_signs : {true, false}) {
        RoundedPanel panel(static_cast<uint32_t>(weights.size() / 2));
        panel.rounded.first_unit = panel.rounded.unit = pal_real(1) / 65536;
        const auto weight_of = [&](size_t k) {
          const bool is_turned = weights.size() == kMost && !same_signs && random() % 2 == 0;
          return static_cast<int16_t>(is_turned ? -weights[k] : weights[k]);
        };
        // Three columns are equal, too.
        for (size_t k = 0; k < 3; ++k) panel.rounded.weights[k] = weight_of(k);
        for (size_t k = 0; k < weights.size(); ++k) panel.rounded.weights[3 + k] = weight_of(k);
        for (size_t row = 0; row < pack::kPanelRows; ++row) {
          for (uint32_t k = 0; k < panel.num_columns; ++k) {
            // Either all products have one sign and nothing cancels, or the largest numbers stay as they are.
            const bool turned = !same_signs && (panel.rounded.weights[k] < 0) != (row % 2 == 0);
            const int entry = turned ? std::min(32767, -largest) : largest;
            panel.entry(k, row) = static_cast<int16_t>(entry);
          }
        }
        expect_exact(panel, start);
      }
    }
  }
}

// Breaks the check on purpose: a kernel that saturates pairs, and a kernel with sums of less than 32 bits.
TEST(FieldKernel, SaturatedAndWrappedSumsAreSeen) {
  constexpr AddRounded kSaturated = [](const int16_t* columns, const RoundedWeights& rounded, bool,
                                       pal_real* sum) {
    for (size_t i = 0; i < pack::kPanelRows; ++i) {
      const int exact = rounded.weights[0] * columns[2 * i] + rounded.weights[1] * columns[2 * i + 1];
      sum[i] = rounded.first_unit * static_cast<pal_real>(std::min(exact, 1 << 30));
    }
  };
  constexpr AddRounded kWrapped = [](const int16_t* columns, const RoundedWeights& rounded, bool,
                                     pal_real* sum) {
    for (size_t i = 0; i < pack::kPanelRows; ++i) {
      const int exact = rounded.weights[0] * columns[2 * i] + rounded.weights[1] * columns[2 * i + 1];
      sum[i] = rounded.first_unit * static_cast<pal_real>(exact % (1 << 30));
    }
  };
  RoundedPanel panel(0);
  panel.rounded.weights[0] = panel.rounded.weights[1] = 32767;
  for (size_t i = 0; i < size_t{2} * pack::kPanelRows; ++i) panel.columns()[i] = 32767;
  EXPECT_GT(error_over_bound(kSaturated, panel, {}), 1);
  EXPECT_GT(error_over_bound(kWrapped, panel, {}), 1);
  for (size_t i = 0; i < size_t{2} * pack::kPanelRows; ++i) panel.columns()[i] = 8000;
  EXPECT_LE(error_over_bound(kSaturated, panel, {}), 0.5);
  EXPECT_LE(error_over_bound(kWrapped, panel, {}), 0.5);
}

}  // namespace field_kernel_test
}  // namespace palpate
