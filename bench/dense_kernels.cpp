// Microbenchmarks of dense kernels: linear_dd's contact stiffness, a zone's elimination and products, a batch
// of elements. Memory-bound kernels stand beside a memcpy of the same bytes; the others count multiply-adds.
#include <benchmark/benchmark.h>

#include <cstring>
#include <new>
#include <string>
#include <vector>

#include "runtime/kernels/element_batch.hpp"
#include "runtime/src/numerics/elimination.hpp"
#include "runtime/src/numerics/inverse_kernel.hpp"

namespace {

// An array of small numbers, aligned to cache lines.
template <typename Number>
struct Aligned {
  explicit Aligned(size_t size)
      : count(size),
        values(static_cast<Number*>(::operator new(size * sizeof(Number), std::align_val_t(64)))) {
    for (size_t i = 0; i < size; ++i) values[i] = Number(1e-3) * static_cast<Number>(i % 17);
  }
  ~Aligned() { ::operator delete(values, std::align_val_t(64)); }
  Aligned(const Aligned&) = delete;
  Aligned& operator=(const Aligned&) = delete;
  size_t count;
  Number* values;
};
using Numbers = Aligned<double>;
using Floats = Aligned<float>;

size_t round_up(size_t size, size_t multiple) {
  return (size + multiple - 1) / multiple * multiple;
}

void count_work(benchmark::State& state, size_t bytes, double multiply_adds) {
  if (bytes > 0)
    state.SetBytesProcessed(static_cast<int64_t>(state.iterations()) * static_cast<int64_t>(bytes));
  state.counters["multiply_adds"] =
      benchmark::Counter(multiply_adds, benchmark::Counter::kIsIterationInvariantRate);
}

void copy(benchmark::State& state, size_t bytes) {
  const Numbers from(bytes / sizeof(double));
  const Numbers to(bytes / sizeof(double));
  for (auto _ : state) {
    std::memcpy(to.values, from.values, bytes);
    benchmark::ClobberMemory();
  }
  count_work(state, bytes, 0);
}

// Returns the stride of a padded row of the contact stiffness, for `nodes` held nodes.
size_t inverse_stride(size_t nodes) {
  return round_up(3 * nodes, palpate::kInverseLanes);
}

// Times the product of the contact stiffness with three vectors.
void inverse_multiply(benchmark::State& state, palpate::InverseKernel kernel) {
  const auto nodes = static_cast<size_t>(state.range(0));
  const size_t stride = inverse_stride(nodes);
  const Numbers matrix(stride * stride);
  const Numbers x(3 * stride);
  const Numbers y(3 * stride);
  for (auto _ : state) {
    kernel.multiply(matrix.values, stride, static_cast<uint32_t>(nodes), x.values, y.values);
    benchmark::DoNotOptimize(y.values[0]);
    benchmark::ClobberMemory();
  }
  count_work(state, 3 * nodes * stride * sizeof(double), 27.0 * static_cast<double>(nodes * nodes));
}

void copy_of_inverse(benchmark::State& state) {
  const auto nodes = static_cast<size_t>(state.range(0));
  copy(state, 3 * nodes * inverse_stride(nodes) * sizeof(double));
}

void held_nodes(benchmark::internal::Benchmark* bench) {
  bench->ArgName("nodes");
  for (const int nodes : {3, 8, 32, 96}) bench->Arg(nodes);
}

// Times the product with the symmetric boundary matrix of a zone. The kernel reads half of the matrix.
void zone_product(benchmark::State& state, palpate::EliminationKernel kernel) {
  const auto size = static_cast<uint32_t>(state.range(0));
  const uint32_t stride = palpate::symmetric_stride(size);
  const Floats matrix(size_t{stride} * stride);
  const Numbers x(stride);
  const Numbers y(stride);
  for (auto _ : state) {
    kernel.add_symmetric_product(matrix.values, stride, x.values, y.values);
    benchmark::DoNotOptimize(y.values[0]);
    benchmark::ClobberMemory();
    y.values[0] = 0;
  }
  count_work(state, size_t{stride} * stride * sizeof(float) / 2, 1.0 * size * size);
}

void copy_of_zone_product(benchmark::State& state) {
  const auto size = static_cast<uint32_t>(state.range(0));
  const size_t stride = palpate::symmetric_stride(size);
  copy(state, stride * stride * sizeof(float) / 2);
}

// Times the elimination of all unknowns of a zone, with a copy of the matrix, a small part of the time.
void zone_elimination(benchmark::State& state, palpate::EliminationKernel kernel) {
  const auto size = static_cast<uint32_t>(state.range(0));
  const uint32_t stride = palpate::elimination_stride(size);
  const uint32_t columns = palpate::round_to_columns(size);
  const size_t count = size_t{stride} * columns;
  Floats original(count);
  std::memset(original.values, 0, count * sizeof(float));
  for (uint32_t i = 0; i < columns; ++i) {
    for (uint32_t j = 0; j < columns; ++j)
      original.values[size_t{j} * stride + i] = i == j ? 2.0F * static_cast<float>(size) : 1.0F;
  }
  const Floats matrix(count);
  const uint32_t eliminated = size / palpate::kEliminationColumns * palpate::kEliminationColumns;
  for (auto _ : state) {
    std::memcpy(matrix.values, original.values, count * sizeof(float));
    if (!palpate::eliminate(kernel, matrix.values, stride, size, eliminated))
      state.SkipWithError("not positive definite");
    benchmark::ClobberMemory();
  }
  const double n = size;
  count_work(state, 0, n * n * n / 6);
}

void zone_sizes(benchmark::internal::Benchmark* bench) {
  bench->ArgName("unknowns");
  for (const int unknowns : {27, 123, 285}) bench->Arg(unknowns);
}

// Times deformation gradient, force and stiffness at a point of each of kLanes elements.
template <int kNodes>
void element_batch(benchmark::State& state, const palpate::BatchKernels<kNodes>& kernels) {
  typename palpate::ElementBatch<kNodes>::Point point = {};
  palpate::NodalLanes<kNodes> displacement = {};
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t i = 0; i < 3; ++i) {
      for (int lane = 0; lane < palpate::kLanes; ++lane) {
        point.gradients[a][i].set(lane, 0.1 * static_cast<double>(a + i) - 0.3);
        displacement[a][i].set(lane, 0.01 * static_cast<double>(a));
      }
    }
  }
  palpate::DyadicLanes terms = {};
  for (int lane = 0; lane < palpate::kLanes; ++lane) {
    point.volume.set(lane, 1);
    terms.set(lane, {1, 0.5, 0.1, 0.1, 0.1});
  }
  palpate::NodalLanes<kNodes> force = {};
  palpate::StiffnessLanes<kNodes> stiffness = {};
  palpate::KinematicsLanes kinematics = {};
  for (auto _ : state) {
    kernels.deform(point, displacement, kinematics);
    kernels.add_force(point, kinematics, terms, force);
    kernels.add_stiffness(point, kinematics, terms, stiffness);
    benchmark::DoNotOptimize(stiffness);
    benchmark::DoNotOptimize(force);
  }
}

const bool dense_kernels_are_registered = [] {
  palpate::InverseKernel inverse[palpate::kMostInverseKernels];
  const uint32_t num_inverse = palpate::list_inverse_kernels(inverse);
  for (uint32_t k = 0; k < num_inverse; ++k) {
    held_nodes(benchmark::RegisterBenchmark((std::string("held_inverse_") + inverse[k].name).c_str(),
                                            inverse_multiply, inverse[k]));
  }
  held_nodes(benchmark::RegisterBenchmark("copy_of_contact_stiffness", copy_of_inverse));
  palpate::EliminationKernel elimination[palpate::kMostEliminationKernels];
  const uint32_t num_elimination = palpate::list_elimination_kernels(elimination);
  for (uint32_t k = 0; k < num_elimination; ++k) {
    zone_sizes(benchmark::RegisterBenchmark((std::string("zone_product_") + elimination[k].name).c_str(),
                                            zone_product, elimination[k]));
    zone_sizes(benchmark::RegisterBenchmark((std::string("zone_elimination_") + elimination[k].name).c_str(),
                                            zone_elimination, elimination[k]));
  }
  zone_sizes(benchmark::RegisterBenchmark("copy_of_zone_product", copy_of_zone_product));
  benchmark::RegisterBenchmark("four_c3d4_portable", element_batch<4>, palpate::portable_batch_kernels<4>());
  benchmark::RegisterBenchmark("four_c3d4", element_batch<4>, palpate::batch_kernels<4>());
  benchmark::RegisterBenchmark("four_c3d10_point", element_batch<10>, palpate::batch_kernels<10>());
  return true;
}();

}  // namespace
