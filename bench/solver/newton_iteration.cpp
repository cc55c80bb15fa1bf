// palpate_bench_solver: times the parts of a Newton iteration on the shipped brain, on one thread and on all,
// and CHOLMOD's factor beside ours. A dense product on one thread bounds the double precision factor.
#include <benchmark/benchmark.h>
#include <cblas.h>

#include <Eigen/CholmodSupport>
#include <algorithm>
#include <thread>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/mesh/inp_reader.hpp"

namespace palpate {
namespace {

const Model& brain() {
  static const Model model = read_inp(PALPATE_SOURCE_DIR "/models/brain/brain.inp");
  return model;
}

// Returns a state away from rest, near enough for a positive definite K.
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

// Returns |b - K x| / |b| of a solution x, where b is all ones.
double residual_of(const Eigen::VectorXd& solution, const SparseLower& stiffness) {
  const Eigen::VectorXd load = Eigen::VectorXd::Ones(stiffness.cols());
  return (stiffness.selfadjointView<Eigen::Lower>() * solution - load).norm() / load.norm();
}

double residual_of(Cholesky& cholesky, const SparseLower& stiffness) {
  Eigen::VectorXd solution = Eigen::VectorXd::Ones(stiffness.cols());
  cholesky.solve(solution);
  return residual_of(solution, stiffness);
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
  const Eigen::VectorXd load = Eigen::VectorXd::Ones(stiffness.cols());
  Eigen::VectorXd solution;
  for (auto _ : state) {
    solution = load;
    cholesky.solve(solution);
  }
  state.counters["error"] = residual_of(cholesky, stiffness);
}

// CHOLMOD's supernodal factor by the sparser of two orderings, with the threads of OpenBLAS.
class SupernodalFactor : public Eigen::CholmodSupernodalLLT<SparseLower, Eigen::Lower> {
 public:
  SupernodalFactor(const SparseLower& matrix, int threads) {
    openblas_set_num_threads(threads);
    cholmod().nmethods = 2;
    cholmod().method[0].ordering = CHOLMOD_AMD;
    cholmod().method[1].ordering = CHOLMOD_METIS;
    analyzePattern(matrix);
  }
};

void factor_by_cholmod(benchmark::State& state) {
  const SparseLower stiffness = stiffness_of(assembly_for(state));
  SupernodalFactor cholmod(stiffness, static_cast<int>(state.range(0)));
  for (auto _ : state) cholmod.factorize(stiffness);
  if (cholmod.info() != Eigen::Success) return state.SkipWithError("not positive definite");
  count_operations(state, cholmod.cholmod().fl);
  const Eigen::VectorXd solution = cholmod.solve(Eigen::VectorXd::Ones(stiffness.cols()));
  state.counters["error"] = residual_of(solution, stiffness);
}

void back_solve_by_cholmod(benchmark::State& state) {
  const SparseLower stiffness = stiffness_of(assembly_for(state));
  SupernodalFactor cholmod(stiffness, static_cast<int>(state.range(0)));
  cholmod.factorize(stiffness);
  if (cholmod.info() != Eigen::Success) return state.SkipWithError("not positive definite");
  const Eigen::VectorXd load = Eigen::VectorXd::Ones(stiffness.cols());
  Eigen::VectorXd solution;
  for (auto _ : state) solution = cholmod.solve(load);
  state.counters["error"] = residual_of(solution, stiffness);
}

// Times a product of dense matrices on a single thread.
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

// Reports median and maximum over repetitions.
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
BENCHMARK(back_solve_by_cholmod)->Apply(one_thread_and_all);
BENCHMARK(dense_product)->Unit(benchmark::kMillisecond)->Apply(median_and_max);

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
