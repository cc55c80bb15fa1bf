// palpate_bench_solver: what one Newton iteration on the shipped brain is made of, each part on one thread
// and on all. The factor stands beside CHOLMOD's own on the same ordering, and beside a dense product, the
// bound of both.
#include <benchmark/benchmark.h>
#include <cblas.h>
#include <cholmod.h>

#include <algorithm>
#include <thread>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/mesh/inp_reader.hpp"

namespace palpate {
namespace {

const Model& brain() {
  static const Model model = read_inp(PALPATE_SOURCE_DIR "/models/brain/brain.inp");
  return model;
}

// A state away from rest, as small as leaves K positive definite.
Eigen::VectorXd displacement() {
  const int num_dofs = brain().num_dofs();
  return 1e-3 * Eigen::VectorXd::LinSpaced(num_dofs, 0.0, num_dofs).array().sin().matrix();
}

Assembly assembly_for(const benchmark::State& state) {
  return Assembly(brain(), brain().fixed_dofs(), static_cast<int>(state.range(0)));
}

SparseLower stiffness_of(const Assembly& assembly) {
  SparseLower stiffness;
  assembly.tangent(displacement(), false, stiffness);
  return stiffness;
}

void count_operations(benchmark::State& state, double operations) {
  state.counters["FLOP/s"] = benchmark::Counter(operations, benchmark::Counter::kIsIterationInvariantRate);
}

void forces(benchmark::State& state) {
  const Assembly assembly = assembly_for(state);
  const Eigen::VectorXd u = displacement();
  Eigen::VectorXd force;
  for (auto _ : state) benchmark::DoNotOptimize(assembly.internal_force(u, force));
}

void tangent(benchmark::State& state) {
  const Assembly assembly = assembly_for(state);
  const Eigen::VectorXd u = displacement();
  SparseLower stiffness;
  for (auto _ : state) assembly.tangent(u, false, stiffness);
}

// |b - K x| / |b| of one solve.
double residual_of(Cholesky& cholesky, const SparseLower& stiffness) {
  const Eigen::VectorXd right = Eigen::VectorXd::Ones(stiffness.cols());
  Eigen::VectorXd solution = right;
  cholesky.solve(solution);
  return (stiffness.selfadjointView<Eigen::Lower>() * solution - right).norm() / right.norm();
}

template <Precision kPrecision>
void factor(benchmark::State& state) {
  const Assembly assembly = assembly_for(state);
  const SparseLower stiffness = stiffness_of(assembly);
  Cholesky cholesky(assembly.analysis(), static_cast<int>(state.range(0)));
  bool definite = true;
  for (auto _ : state) definite = cholesky.factorize(stiffness, kPrecision) && definite;
  if (!definite) return state.SkipWithError("not positive definite");
  count_operations(state, assembly.analysis().factor_operations());
  state.counters["error"] = residual_of(cholesky, stiffness);
}

template <Precision kPrecision>
void back_solve(benchmark::State& state) {
  const Assembly assembly = assembly_for(state);
  const SparseLower stiffness = stiffness_of(assembly);
  Cholesky cholesky(assembly.analysis(), static_cast<int>(state.range(0)));
  if (!cholesky.factorize(stiffness, kPrecision)) return state.SkipWithError("not positive definite");
  const Eigen::VectorXd right = Eigen::VectorXd::Ones(stiffness.cols());
  Eigen::VectorXd solution;
  for (auto _ : state) {
    solution = right;
    cholesky.solve(solution);
  }
  state.counters["error"] = residual_of(cholesky, stiffness);
}

void factor_by_cholmod(benchmark::State& state) {
  const Assembly assembly(brain(), brain().fixed_dofs());
  SparseLower stiffness = stiffness_of(assembly);
  std::vector<int> order = assembly.analysis().fronts()->permutation();
  openblas_set_num_threads(static_cast<int>(state.range(0)));
  cholmod_common common;
  cholmod_start(&common);
  common.supernodal = CHOLMOD_SUPERNODAL;
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_GIVEN;
  cholmod_sparse sparse = {};
  sparse.nrow = sparse.ncol = static_cast<size_t>(stiffness.cols());
  sparse.nzmax = static_cast<size_t>(stiffness.nonZeros());
  sparse.p = stiffness.outerIndexPtr();
  sparse.i = stiffness.innerIndexPtr();
  sparse.x = stiffness.valuePtr();
  sparse.stype = -1;
  sparse.itype = CHOLMOD_INT;
  sparse.xtype = CHOLMOD_REAL;
  sparse.dtype = CHOLMOD_DOUBLE;
  sparse.sorted = sparse.packed = 1;
  ::cholmod_factor* symbolic = cholmod_analyze_p(&sparse, order.data(), nullptr, 0, &common);
  for (auto _ : state) cholmod_factorize(&sparse, symbolic, &common);
  count_operations(state, common.fl);
  cholmod_free_factor(&symbolic, &common);
  cholmod_finish(&common);
  openblas_set_num_threads(1);
}

// One thread.
void dense_product(benchmark::State& state) {
  constexpr int kSize = 1024;
  openblas_set_num_threads(1);
  const Eigen::MatrixXd a = Eigen::MatrixXd::Ones(kSize, kSize);
  Eigen::MatrixXd b(kSize, kSize);
  for (auto _ : state) {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, kSize, kSize, kSize, 1.0, a.data(), kSize, a.data(),
                kSize, 0.0, b.data(), kSize);
  }
  count_operations(state, 2.0 * kSize * kSize * kSize);
}

// Of several repetitions.
void median_and_max(benchmark::internal::Benchmark* one) {
  one->Repetitions(9)->ReportAggregatesOnly()->MinTime(0.1);
  one->ComputeStatistics(
      "max", [](const std::vector<double>& times) { return *std::max_element(times.begin(), times.end()); });
}

void one_thread_and_all(benchmark::internal::Benchmark* one) {
  one->ArgName("threads")->Arg(1);
  const int all = static_cast<int>(std::thread::hardware_concurrency());
  if (all > 1) one->Arg(all);
  one->UseRealTime()->Unit(benchmark::kMillisecond);
  median_and_max(one);
}

BENCHMARK(forces)->Apply(one_thread_and_all);
BENCHMARK(tangent)->Apply(one_thread_and_all);
BENCHMARK(factor<Precision::single_precision>)->Apply(one_thread_and_all);
BENCHMARK(factor<Precision::double_precision>)->Apply(one_thread_and_all);
BENCHMARK(factor_by_cholmod)->Apply(one_thread_and_all);
BENCHMARK(back_solve<Precision::single_precision>)->Apply(one_thread_and_all);
BENCHMARK(back_solve<Precision::double_precision>)->Apply(one_thread_and_all);
BENCHMARK(dense_product)->Unit(benchmark::kMillisecond)->Apply(median_and_max);

}  // namespace
}  // namespace palpate
