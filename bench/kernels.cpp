// Microbenchmarks of the runtime's kernels, each beside a memcpy of the bytes that it reads.
#include <benchmark/benchmark.h>

#include <cstring>
#include <new>
#include <vector>

#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"

namespace {

using palpate::pack::kPanelRows;

// Coefficients of `panels` panels of `terms` columns, on cache lines.
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

// Rows shown (3 a node) and columns: one held node of linear_dd, a patch of 7, polynomials of degree 3 and 5.
void shapes(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"rows", "columns"});
  for (const int rows : {960, 4800, 9600}) {
    for (const int columns : {3, 21, 19, 55}) bench->Args({rows, columns});
  }
}

}  // namespace

// What the two threads do to hand a field over, without its weights.
void snapshot_hand_over(benchmark::State& state) {
  palpate::FieldSnapshots snapshots = {};
  palpate::reset_snapshots(snapshots);
  for (auto _ : state) {
    palpate::publish(snapshots);
    benchmark::DoNotOptimize(palpate::acquire(snapshots));
  }
}
BENCHMARK(snapshot_hand_over);

// Each kernel that this processor runs.
const bool field_kernels_are_registered = [] {
  palpate::FieldKernel kernels[palpate::kMostFieldKernels];
  const uint32_t count = palpate::list_field_kernels(kernels);
  for (uint32_t k = 0; k < count; ++k)
    shapes(benchmark::RegisterBenchmark((std::string("field_") + kernels[k].name).c_str(), field,
                                        kernels[k].add_columns));
  return true;
}();
BENCHMARK(copy_of_same_bytes)->Apply(shapes);
