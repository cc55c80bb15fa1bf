// Measures the growth of frames, packs and builds with the organ and the request, on blocks held at the base
// and touched on top.
//
//   palpate_study_scaling DIR [--quick]     writes DIR/scaling.csv, .svg, .txt and scaling_points.csv
//
// A polynomial's cost does not depend on its coefficients, so they are random and no sample needs a solve.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "bench/scaling/scaling_series.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/study/method_timing.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::scaling {
namespace {

constexpr double kPush = 0.3;  // largest |d|, over an edge

struct Effort {
  std::vector<int> cells = {5, 8, 12, 16, 19, 22, 26};  // along each edge of a block: 216 to 19,683 nodes
  int cells_of_others = 12;                             // the block of all other series
  int cells_of_samples = 8;                             // the block of the sampled sites
  std::vector<int> contacts = {1, 2, 4, 8, 16, 32};
  std::vector<int> zone_contacts = {1, 2, 4, 8};
  int rings = 4;
  std::vector<int> sites = {1, 2, 4, 8, 16, 32};
  double seconds = 0.4;  // time of the frames of a point
};

Effort quick_effort() {
  Effort effort;
  effort.cells = {5, 8, 12};
  effort.cells_of_others = 8;
  effort.cells_of_samples = 5;
  effort.contacts = {1, 2, 4, 8};
  effort.zone_contacts = {1, 2};
  effort.rings = 2;
  effort.sites = {1, 2, 4};
  effort.seconds = 0.05;
  return effort;
}

LoadedScene block_scene(int cells, int num_sites, int max_contacts) {
  test::BlockShape shape;
  shape.cells = {cells, cells, cells};
  LoadedScene loaded;
  loaded.model = test::with_fixed_base(test::tetrahedral_block(shape));
  Scene& scene = loaded.scene;
  scene.file = scene.model_file = "block";
  // A square grid of sites separates the zones as far as possible.
  const std::vector<int> top = test::nodes_on_plane(loaded.model, 2, 1.0);
  const int side = static_cast<int>(std::ceil(std::sqrt(num_sites)));
  for (int i = 0; i < num_sites; ++i) {
    const int row = (2 * (i / side) + 1) * (cells + 1) / (2 * side);
    const int column = (2 * (i % side) + 1) * (cells + 1) / (2 * side);
    scene.sites.push_back(top[static_cast<size_t>(row * (cells + 1) + column)]);
  }
  std::sort(scene.sites.begin(), scene.sites.end());
  scene.max_displacement = kPush / cells;
  scene.max_contacts = max_contacts;
  for (int node = 0; node < loaded.model.num_nodes(); ++node) scene.output_nodes.push_back(node);
  return loaded;
}

struct Block {
  Scene scene;
  Model model;
  ContactSites sites;
  Assembly assembly;
  explicit Block(LoadedScene loaded)
      : scene(std::move(loaded.scene)),
        model(std::move(loaded.model)),
        sites(find_contact_sites(scene, model)),
        assembly(model, model.fixed_dofs()) {}
  Block(const Block&) = delete;  // the assembly refers to the model
  Block& operator=(const Block&) = delete;
  double nodes() const { return model.num_nodes(); }
};

AlignedBytes pack_of(const Block& block, const LinearDd* linear, const std::vector<SiteResult>* polynomials,
                     const ZoneTables* zone) {
  PackContent content{block.model, block.scene, block.sites, linear, polynomials, false, {}, {}};
  content.zone = zone;
  return write_pack(content);
}

// Returns for each site a polynomial of the given size, with random coefficients.
std::vector<SiteResult> random_polynomials(const Block& block, int degree, int rank) {
  // Monomials of degree 2 .. p in three variables: choose_three(p + 3) - 4.
  const auto choose_three = [](int n) { return n * (n - 1) * (n - 2) / 6; };
  test::TestRandom random(7);
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(block.sites.packed_nodes.size());
  std::vector<SiteResult> results(block.sites.sites.size());
  for (SiteResult& result : results) {
    SitePolynomial& polynomial = result.polynomial;
    polynomial.to_unit = Eigen::Matrix3d::Identity() / block.scene.max_displacement;
    polynomial.degree = degree;
    polynomial.linear = random.matrix(rows, 3);
    polynomial.basis = random.matrix(rows, rank);
    polynomial.coefficients = random.matrix(choose_three(degree + 3) - 4, rank);
    polynomial.energy = random.vector(Eigen::Index{choose_three(degree + 4)} - 4);
    result.samples = 1;
  }
  return results;
}

ZoneTables zones_of(const Block& block, int rings) {
  ZoneTables zone = find_zones(block.model, block.sites, rings);
  return zone;
}

struct FrameTimes {
  double haptic;  // us, median
  double visual;
};

// Times frames of contacts at the first sites.
FrameTimes time_frames_of(const OpenedPack& opened, pal_model model, int contacts, int rings,
                          double seconds) {
  std::vector<std::uint32_t> sites(static_cast<size_t>(contacts));
  std::iota(sites.begin(), sites.end(), 0u);
  MethodTimer timer(opened, model, static_cast<std::uint32_t>(rings), {sites}, 1);
  timer.time_round(seconds, 100000);
  MethodRow row;
  timer.summarise(row);
  return {row.haptic.median, row.visual.median};
}

// Returns the time of the fastest of three runs; a run beyond kShort ends the series.
double seconds_of(const std::function<void()>& work) {
  constexpr double kShort = 0.2;
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (best > kShort) break;
  }
  return best;
}

class Study {
 public:
  Study(Effort effort, int jobs) : effort_(std::move(effort)), jobs_(jobs) {}

  std::vector<Series> run() {
    over_nodes();
    over_contacts();
    over_polynomials();
    over_rings();
    over_sites_and_jobs();
    return std::move(series_);
  }

 private:
  static void print_progress(const std::string& what) { fmt::print(stderr, "scaling over {}\n", what); }

  void over_nodes() {
    const char* frames = "frames of one contact";
    const char* prepared = "one contact, made beforehand";
    Series linear{frames, "linear_dd, force", "nodes, all of them shown", "µs", 0, {}};
    Series linear_field{frames, "linear_dd, field", linear.size, "µs", 1, {}};
    Series polynomial{frames, "polynomial_dd of rank 20, field", linear.size, "µs", 1, {}};
    Series zone_force{frames, "nonlinear_zone of one ring, force", linear.size, "µs", 0, {}};
    Series zone_field{frames, "nonlinear_zone of one ring, field", linear.size, "µs", 1, {}};
    Series bytes{prepared, "pack of all three", linear.size, "MB", 1, {}};
    Series linear_seconds{prepared, "linear_dd", linear.size, "s", 2, {}};
    Series equilibrium{prepared, "one full nonlinear solve", linear.size, "s", 2, {}};
    for (const int cells : effort_.cells) {
      print_progress(fmt::format("nodes: a block of {}^3", cells + 1));
      const Block block(block_scene(cells, 1, 1));
      LinearDd dd;
      linear_seconds.points.emplace_back(
          block.nodes(), seconds_of([&] { dd = compute_linear_dd(block.assembly, block.sites); }));
      const LinearContact push{0, 0.5 * block.scene.max_displacement * block.sites.sites[0].inward};
      equilibrium.points.emplace_back(block.nodes(), seconds_of([&] {
                                        solve_contact_sets(block.assembly, block.sites, {{push}}, 1, {});
                                      }));
      const ZoneTables zone = zones_of(block, 1);
      constexpr int kDegree = 5;
      constexpr int kRank = 20;
      const std::vector<SiteResult> polynomials = random_polynomials(block, kDegree, kRank);
      const AlignedBytes packed = pack_of(block, &dd, &polynomials, &zone);
      const OpenedPack opened(packed);
      bytes.points.emplace_back(block.nodes(), 1e-6 * static_cast<double>(packed.bytes().size()));
      const FrameTimes of_linear = time_frames_of(opened, PAL_MODEL_LINEAR, 1, 0, effort_.seconds);
      linear.points.emplace_back(block.nodes(), of_linear.haptic);
      linear_field.points.emplace_back(block.nodes(), of_linear.visual);
      polynomial.points.emplace_back(
          block.nodes(), time_frames_of(opened, PAL_MODEL_POLYNOMIAL, 1, 0, effort_.seconds).visual);
      const FrameTimes of_zone = time_frames_of(opened, PAL_MODEL_ZONE, 1, 1, effort_.seconds);
      zone_force.points.emplace_back(block.nodes(), of_zone.haptic);
      zone_field.points.emplace_back(block.nodes(), of_zone.visual);
    }
    add({linear, linear_field, polynomial, zone_force, zone_field, bytes, linear_seconds, equilibrium});
  }

  void over_contacts() {
    print_progress("contacts");
    const std::string panel = "several contacts";
    Series force{panel, "linear_dd, force", "contacts", "µs", 2, {}};
    Series field{panel, "linear_dd, field", force.size, "µs", 1, {}};
    Series zone_force{panel, "nonlinear_zone of one ring, force", force.size, "µs", 2, {}};
    {
      const int most = effort_.contacts.back();
      const Block block(block_scene(effort_.cells_of_others, most, most));
      const LinearDd dd = compute_linear_dd(block.assembly, block.sites);
      const AlignedBytes packed = pack_of(block, &dd, nullptr, nullptr);
      const OpenedPack opened(packed);
      for (const int contacts : effort_.contacts) {
        const FrameTimes times = time_frames_of(opened, PAL_MODEL_LINEAR, contacts, 0, effort_.seconds);
        force.points.emplace_back(contacts, times.haptic);
        field.points.emplace_back(contacts, times.visual);
      }
    }
    const int most = effort_.zone_contacts.back();
    const Block block(block_scene(effort_.cells_of_others, most, most));
    const LinearDd dd = compute_linear_dd(block.assembly, block.sites);
    const ZoneTables zone = zones_of(block, 1);
    const AlignedBytes packed = pack_of(block, &dd, nullptr, &zone);
    const OpenedPack opened(packed);
    for (const int contacts : effort_.zone_contacts) {
      zone_force.points.emplace_back(
          contacts, time_frames_of(opened, PAL_MODEL_ZONE, contacts, 1, effort_.seconds).haptic);
    }
    add({force, field, zone_force});
  }

  void over_polynomials() {
    print_progress("polynomials");
    const std::string panel = "polynomials of one contact";
    Series force{panel, "force and stiffness, of degree 2 to 7", "terms of the energy, or rank", "µs", 1, {}};
    Series field{panel, "field, of rank 4 to 64", force.size, "µs", 1, {}};
    Series bytes{panel, "pack, of rank 4 to 64", force.size, "MB", 1, {}};
    const Block block(block_scene(effort_.cells_of_others, 1, 1));
    for (int degree = 2; degree <= 7; ++degree) {
      const std::vector<SiteResult> polynomials = random_polynomials(block, degree, 8);
      const AlignedBytes packed = pack_of(block, nullptr, &polynomials, nullptr);
      force.points.emplace_back(
          static_cast<double>(polynomials.front().polynomial.energy.size()),
          time_frames_of(OpenedPack(packed), PAL_MODEL_POLYNOMIAL, 1, 0, effort_.seconds).haptic);
    }
    for (const int rank : {4, 8, 16, 32, 64}) {
      const std::vector<SiteResult> polynomials = random_polynomials(block, 7, rank);
      const AlignedBytes packed = pack_of(block, nullptr, &polynomials, nullptr);
      field.points.emplace_back(
          rank, time_frames_of(OpenedPack(packed), PAL_MODEL_POLYNOMIAL, 1, 0, effort_.seconds).visual);
      bytes.points.emplace_back(rank, 1e-6 * static_cast<double>(packed.bytes().size()));
    }
    add({force, field, bytes});
  }

  void over_rings() {
    print_progress("rings of a zone");
    const std::string panel = fmt::format("zones of 1 to {} rings", effort_.rings);
    Series force{panel, "force", "unknowns of the zone", "µs", 2, {}};
    Series field{panel, "field", force.size, "µs", 1, {}};
    Series bytes{panel, "pack", force.size, "MB", 1, {}};
    const Block block(block_scene(effort_.cells_of_others, 1, 1));
    const LinearDd dd = compute_linear_dd(block.assembly, block.sites);
    for (int rings = 1; rings <= effort_.rings; ++rings) {
      const ZoneTables zone = zones_of(block, rings);
      const AlignedBytes packed = pack_of(block, &dd, nullptr, &zone);
      const FrameTimes times = time_frames_of(OpenedPack(packed), PAL_MODEL_ZONE, 1, rings, effort_.seconds);
      const double unknowns = 3.0 * zone.most_nodes;
      force.points.emplace_back(unknowns, times.haptic);
      field.points.emplace_back(unknowns, times.visual);
      bytes.points.emplace_back(unknowns, 1e-6 * static_cast<double>(packed.bytes().size()));
    }
    add({force, field, bytes});
  }

  void over_sites_and_jobs() {
    const std::string panel = "samples of polynomials";
    Series sites{panel, fmt::format("over sites, {} threads", jobs_), "sites, or threads", "s", 1, {}};
    Series jobs{panel, fmt::format("over threads, {} sites", effort_.sites.back()), sites.size, "s", -1, {}};
    const auto sample = [](const Block& block, int threads) {
      const LinearDd dd = compute_linear_dd(block.assembly, block.sites);
      SamplingPlan plan;
      plan.survey_samples = 0;
      plan.jobs = threads;
      return seconds_of([&] { sample_sites(block.assembly, block.scene, block.sites, dd, plan); });
    };
    for (const int count : effort_.sites) {
      print_progress(fmt::format("sites: {}", count));
      sites.points.emplace_back(count, sample(Block(block_scene(effort_.cells_of_samples, count, 1)), jobs_));
    }
    add({sites});
    if (jobs_ < 2) return;
    const Block block(block_scene(effort_.cells_of_samples, effort_.sites.back(), 1));
    for (int threads = 1; threads <= jobs_; threads *= 2) {
      print_progress(fmt::format("threads: {}", threads));
      jobs.points.emplace_back(threads, sample(block, threads));
    }
    add({jobs});
  }

  void add(const std::vector<Series>& some) { series_.insert(series_.end(), some.begin(), some.end()); }

  Effort effort_;
  int jobs_;
  std::vector<Series> series_;
};

void study(const std::filesystem::path& folder, bool quick) {
  std::filesystem::create_directories(folder);
  const int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const Effort effort = quick ? quick_effort() : Effort();
  const std::string caption = fmt::format(
      "Blocks of neo-Hookean tetrahedra, held at their base, touched at single nodes of their top, every "
      "node shown. "
      "Exponents are fitted to the upper half of each range, in logarithm (grey lines), and stand in the "
      "legend; expected "
      "is what the largest part of the operations grows with: matrices in memory with what they are read "
      "for, a sparse "
      "factor of a solid with the square of its nodes. Small sizes are bound by what does not grow, and "
      "sizes that leave a "
      "cache grow faster for a while. Medians of frames, warm, {} threads beforehand.{}",
      jobs, quick ? " A quick run, of small sizes: its exponents are rough." : "");
  write_scaling(Study(effort, jobs).run(), caption, folder);
}

}  // namespace
}  // namespace palpate::scaling

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  try {
    const bool quick = argc == 3 && std::strcmp(argv[2], "--quick") == 0;
    if (argc != 2 && !quick) throw std::invalid_argument("usage: palpate_study_scaling DIR [--quick]");
    palpate::scaling::study(argv[1], quick);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
