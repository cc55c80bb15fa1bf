// Benchmark of surface_bvh on the whole surface of the shipped brain: time, visited boxes and triangles.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <vector>

#include "offline/mesh/inp_reader.hpp"
#include "runtime/src/pack/surface_bvh.hpp"
#include "tests/support/tetrahedral_block.hpp"
#include "tests/support/touchable_surface.hpp"

namespace {

using Eigen::Vector3d;
using palpate::test::TouchableSurface;
using Clock = std::chrono::steady_clock;

constexpr size_t kPositions = 1 << 14;

const TouchableSurface& brain() {
  static const TouchableSurface surface(
      palpate::read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models/brain/brain.inp"));
  return surface;
}

// Returns positions of a tip around the brain, 0.3 mm a frame, up to 10 mm outside and inside of the surface.
std::vector<Vector3d> path() {
  std::vector<Vector3d> positions;
  Vector3d centre = Vector3d::Zero();
  const size_t sites = brain().site_nodes.size();
  for (size_t site = 0; site < sites; ++site) centre += brain().site(site) / static_cast<double>(sites);
  for (size_t i = 0; i < kPositions; ++i) {
    const double angle = 0.3 / 80.0 * static_cast<double>(i);
    const Vector3d direction(std::cos(angle), std::sin(angle) * std::cos(0.1 * angle),
                             std::sin(angle) * std::sin(0.1 * angle));
    palpate::SurfaceHit hit;
    const Vector3d outside = centre + 80.0 * direction;
    palpate::find_nearest_surface_point(brain().pack, outside.data(), 0, hit);
    positions.push_back(Vector3d(hit.point) + 10.0 * std::sin(0.001 * static_cast<double>(i)) * direction);
  }
  return positions;
}

// Returns random positions in and around the brain.
std::vector<Vector3d> anywhere() {
  palpate::test::TestRandom random(1);
  std::vector<Vector3d> positions(kPositions);
  for (Vector3d& position : positions) position = 100.0 * random.vector();
  return positions;
}

void nearest_point(benchmark::State& state, const std::vector<Vector3d>& positions, bool warm_start) {
  const pal_pack& pack = brain().pack;
  palpate::SurfaceHit hit = {};
  size_t next = 0;
  for (auto _ : state) {
    palpate::find_nearest_surface_point(pack, positions[next].data(), warm_start ? hit.primitive : 0, hit);
    benchmark::DoNotOptimize(hit);
    next = (next + 1) % kPositions;
  }
  // Times each search alone, including the clock, and counts visits.
  std::vector<double> nanoseconds;
  double nodes = 0;
  double primitives = 0;
  for (const Vector3d& position : positions) {
    palpate::SurfaceVisits visits;
    const Clock::time_point start = Clock::now();
    palpate::find_nearest_surface_point(pack, position.data(), warm_start ? hit.primitive : 0, hit, &visits);
    nanoseconds.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count());
    nodes += visits.nodes;
    primitives += visits.primitives;
  }
  std::sort(nanoseconds.begin(), nanoseconds.end());
  const auto quantile = [&](double share) {
    return nanoseconds[static_cast<size_t>(share * static_cast<double>(kPositions - 1))];
  };
  state.counters["median_ns"] = quantile(0.5);
  state.counters["p99_ns"] = quantile(0.99);
  state.counters["max_ns"] = quantile(1);
  state.counters["boxes"] = nodes / kPositions;
  state.counters["triangles"] = primitives / kPositions;
  state.counters["of_triangles"] = static_cast<double>(brain().size());
}

void nearest_point_on_a_path(benchmark::State& state) {
  nearest_point(state, path(), true);
}
void nearest_point_anywhere(benchmark::State& state) {
  nearest_point(state, anywhere(), false);
}
BENCHMARK(nearest_point_on_a_path);
BENCHMARK(nearest_point_anywhere);

}  // namespace
