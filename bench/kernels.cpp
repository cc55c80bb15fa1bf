// Microbenchmarks of the runtime's kernels, each beside a memcpy of the same bytes.
#include <benchmark/benchmark.h>

#include <cstring>
#include <new>
#include <vector>

#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/response/field_snapshot.hpp"

namespace {

using palpate::pack::kPanelRows;

// `panels` panels of `terms` columns, aligned to cache lines.
struct Coefficients {
  Coefficients(size_t panels, size_t terms)
      : count(panels * terms * kPanelRows),
        values(static_cast<pal_real*>(::operator new(count * sizeof(pal_real), std::align_val_t(64)))) {
    for (size_t i = 0; i < count; ++i) values[i] = static_cast<pal_real>(i % 17) / 10;
  }
  ~Coefficients() { ::operator delete(values, std::align_val_t(64)); }
  Coefficients(const Coefficients&) = delete;
  Coefficients& operator=(const Coefficients&) = delete;
  size_t count;
  pal_real* values;
};

void field(benchmark::State& state, palpate::AddColumns add_columns) {
  const auto panels = static_cast<size_t>(state.range(0)) / kPanelRows;
  const auto terms = static_cast<uint32_t>(state.range(1));
  const Coefficients coefficients(panels, terms);
  const std::vector<pal_real> weights(terms, 0.5f);
  alignas(64) pal_real sum[kPanelRows];
  for (auto _ : state) {
    for (size_t panel = 0; panel < panels; ++panel) {
      add_columns(coefficients.values + panel * terms * kPanelRows, kPanelRows, weights.data(), terms, false,
                  sum);
      benchmark::DoNotOptimize(sum);
    }
  }
  state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) *
                          static_cast<int64_t>(coefficients.count * sizeof(pal_real)));
}

void copy_of_same_bytes(benchmark::State& state) {
  const auto panels = static_cast<size_t>(state.range(0)) / kPanelRows;
  const Coefficients from(panels, static_cast<size_t>(state.range(1)));
  const Coefficients to(panels, static_cast<size_t>(state.range(1)));
  for (auto _ : state) {
    std::memcpy(to.values, from.values, from.count * sizeof(pal_real));
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) *
                          static_cast<int64_t>(from.count * sizeof(pal_real)));
}

// Sets (rows, columns), 3 rows a node. linear_dd has 3 columns for a held node and 21 for a patch of 7 nodes.
// A polynomial has 3 + rank columns; ranks are 8, 16 and 32.
void shapes(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"rows", "columns"});
  for (const int rows : {960, 4800, 9600}) {
    for (const int columns : {3, 21, 11, 19, 35}) bench->Args({rows, columns});
  }
}

// The panels of a polynomial with columns of int16.
struct RoundedPanels {
  RoundedPanels(size_t panels, uint32_t rank)
      : panel_bytes(palpate::pack::field_panel_bytes(3 + rank, true)),
        count(panels * panel_bytes),
        bytes(static_cast<unsigned char*>(::operator new(count, std::align_val_t(64)))) {
    for (size_t panel = 0; panel < panels; ++panel) {
      auto* columns = reinterpret_cast<int16_t*>(bytes + panel * panel_bytes);
      for (size_t i = 0; i < panel_bytes / sizeof *columns; ++i)
        columns[i] = static_cast<int16_t>(997 * i % 32767);
    }
  }
  ~RoundedPanels() { ::operator delete(bytes, std::align_val_t(64)); }
  RoundedPanels(const RoundedPanels&) = delete;
  RoundedPanels& operator=(const RoundedPanels&) = delete;
  size_t panel_bytes;
  size_t count;
  unsigned char* bytes;
};

void rounded_field(benchmark::State& state, palpate::AddRounded add_rounded) {
  const auto panels = static_cast<size_t>(state.range(0)) / kPanelRows;
  const auto rank = static_cast<uint32_t>(state.range(1));
  const RoundedPanels field(panels, rank);
  palpate::RoundedWeights rounded = {};
  rounded.num_pairs = palpate::pack::num_column_pairs(3 + rank);
  rounded.first_unit = rounded.unit = pal_real(1e-9);
  for (uint32_t k = 0; k < 3 + 2 * rounded.num_pairs; ++k)
    rounded.weights[k] = static_cast<int16_t>(65000 / rank);
  alignas(64) pal_real sum[kPanelRows];
  for (auto _ : state) {
    for (size_t panel = 0; panel < panels; ++panel) {
      add_rounded(reinterpret_cast<const int16_t*>(field.bytes + panel * field.panel_bytes), rounded, false,
                  sum);
      benchmark::DoNotOptimize(sum);
    }
  }
  state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) * static_cast<int64_t>(field.count));
}

void copy_of_same_rounded_bytes(benchmark::State& state) {
  const auto panels = static_cast<size_t>(state.range(0)) / kPanelRows;
  const RoundedPanels from(panels, static_cast<uint32_t>(state.range(1)));
  const RoundedPanels to(panels, static_cast<uint32_t>(state.range(1)));
  for (auto _ : state) {
    std::memcpy(to.bytes, from.bytes, from.count);
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) * static_cast<int64_t>(from.count));
}

void rounded_shapes(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"rows", "rank"});
  for (const int rows : {960, 4800, 9600}) {
    for (const int rank : {8, 16, 32}) bench->Args({rows, rank});
  }
}

}  // namespace

// Times the swaps by which the haptic thread hands a field to the visual thread, without a copy of weights.
void snapshot_hand_over(benchmark::State& state) {
  palpate::FieldSnapshots snapshots = {};
  palpate::reset_snapshots(snapshots);
  for (auto _ : state) {
    palpate::publish(snapshots);
    benchmark::DoNotOptimize(palpate::acquire(snapshots));
  }
}
BENCHMARK(snapshot_hand_over);

// Registers a benchmark for each kernel that this processor runs.
const bool field_kernels_are_registered = [] {
  palpate::FieldKernel kernels[palpate::kMostFieldKernels];
  const uint32_t count = palpate::list_field_kernels(kernels);
  for (uint32_t k = 0; k < count; ++k) {
    // A kernel may share one of its two loops with the kernel before. The shared loop is registered once.
    if (k == 0 || kernels[k].add_columns != kernels[k - 1].add_columns) {
      shapes(benchmark::RegisterBenchmark((std::string("field_") + kernels[k].name).c_str(), field,
                                          kernels[k].add_columns));
    }
    if (k == 0 || kernels[k].add_rounded != kernels[k - 1].add_rounded) {
      rounded_shapes(benchmark::RegisterBenchmark((std::string("rounded_field_") + kernels[k].name).c_str(),
                                                  rounded_field, kernels[k].add_rounded));
    }
  }
  return true;
}();
BENCHMARK(copy_of_same_bytes)->Apply(shapes);
BENCHMARK(copy_of_same_rounded_bytes)->Apply(rounded_shapes);
