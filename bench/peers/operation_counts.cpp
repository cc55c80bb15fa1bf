// Page of the operation counts and frame rates of Zhong et al. 2005 (sections 3.1 and 3.4, table 1), measured
// on the brain. The paper's model and the brain have 2,886 free nodes.
//
// linear_dd's counts come from docs/embedding.md, with k contacts, n = 3 k and m free nodes:
//   a new set of contacts   2 n^3 / 3 + 10 n^2 at most
//   a frame of forces       3 k (3 k + n)
//   a field                 9 m k; u = C f takes one product, the paper forms C A^-1 first
#include "bench/peers/method_frames.hpp"
#include "bench/peers/peers.hpp"
#include "bench/peers/site_sets.hpp"

namespace palpate::peers {
namespace {

using Sites = std::vector<std::uint32_t>;

constexpr size_t kMostContacts = 32;
constexpr size_t kNumSets = 3;  // more sets than the session keeps

// Returns a scene with a one-node site at each of `nodes`, and all free nodes packed.
LoadedScene patch_scene(const Model& model, const std::vector<int>& nodes) {
  LoadedScene loaded;
  loaded.model = model;
  Scene& scene = loaded.scene;
  scene.file = scene.model_file = model.file;
  scene.sites = nodes;
  std::sort(scene.sites.begin(), scene.sites.end());
  scene.max_displacement = 1;
  scene.max_contacts = static_cast<int>(kMostContacts);
  scene.polynomial = false;
  const std::vector<char> fixed = model.fixed_nodes();
  for (int node = 0; node < model.num_nodes(); ++node) {
    if (fixed[static_cast<size_t>(node)] == 0) scene.output_nodes.push_back(node);
  }
  return loaded;
}

// Times force frames whose contact sets have no contact of the two sets before.
FrameTimes time_new_sets(const LinearOrgan& organ, const Sites& sites, size_t k) {
  LinearSession session(organ, static_cast<std::uint32_t>(k));
  std::vector<pal_contact> sets[kNumSets];
  for (size_t i = 0; i < kNumSets; ++i) {
    const auto first = sites.begin() + static_cast<std::ptrdiff_t>(i * k);
    sets[i] = contacts_at(Sites(first, first + static_cast<std::ptrdiff_t>(k)));
    displace(circling(0, k, Motion::as_one, 1.0), sets[i]);
  }
  for (size_t i = 0; i < 100; ++i) session.contact_frame(sets[i % kNumSets]);
  FrameTimes times;
  for (size_t i = 0; i < 5000; ++i) times.time([&] { session.contact_frame(sets[(i + 100) % kNumSets]); });
  return times;
}

// An operation count of the paper: its formula, and the value.
struct Count {
  const char* formula;
  double value;
};

// Adds a row for k contacts. `multiply_adds`: operations of our method. `rest`: the last three cells.
void add_row(size_t k, const std::string& operation, const Count& counted, const FrameTimes& times,
             double multiply_adds, const std::vector<std::string>& rest, study::StudyTable& table) {
  std::vector<std::string> row = {std::to_string(k),
                                  operation,
                                  counted.formula,
                                  fmt::format("{:.3g}", counted.value),
                                  in_us(times.median()),
                                  in_us(times.at(0.999)),
                                  in_us(times.at(1)),
                                  fmt::format("{:.3g}", 1e6 * times.median() / counted.value),
                                  fmt::format("{:.3g}", multiply_adds),
                                  fmt::format("{:.3g}", 1e6 * times.median() / multiply_adds)};
  row.insert(row.end(), rest.begin(), rest.end());
  table.add(row);
}

struct PaperRow {
  const char* name;
  const char* method;  // MethodFrames::method
  const char* frames_per_second;
  const char* times_lcg;
};

}  // namespace

std::vector<study::StudyTable> operation_counts_page(const LinearOrgan& brain, const Study& study) {
  const SiteRings rings(brain, site_at(brain, kPushedLabel));
  std::vector<int> nodes;
  for (size_t i = 0; i < kNumSets * kMostContacts; ++i) nodes.push_back(brain.site_node(rings.sites[i]));
  const LinearOrgan organ(patch_scene(brain.model, nodes));
  Sites sites;  // sites of `organ`, the nearest to the pushed node first
  for (const int node : nodes) {
    std::uint32_t site = 0;
    while (organ.site_node(site) != node) ++site;
    sites.push_back(site);
  }
  const double m = organ.assembly.num_equations() / 3.0;
  SparseLower lower;
  organ.assembly.tangent(Eigen::VectorXd::Zero(organ.assembly.num_dofs()), false, lower);
  const double nonzeros = 2.0 * static_cast<double>(lower.nonZeros()) - 3 * m;  // of both triangles of K

  study::StudyTable counts(
      "operation_counts",
      fmt::format(
          "The brain, m = {:.0f} free nodes, all of them shown, a patch of k contact nodes that moves "
          "as one. us; ps for each multiplication that the paper counts, and for each multiply-add "
          "that is made. nu: iterations.",
          m),
      {"k", "what", "the paper's count", "counted", "median", "p99.9", "max", "ps / counted", "made",
       "ps / made", "nu", "displacement error", "force error"});
  study::StudyTable table1(
      "paper_table1",
      fmt::format("The paper's table 1, and frames a second here (1 / median; forces and all {:.0f} free "
                  "nodes).",
                  m),
      {"method", "the paper: 1 GHz", "k = 1", "k = 3", "k = 8", "k = 32", "times LCG: the paper",
       "times LCG: k = 3", "displacement error at k = 3", "force error at k = 3"});
  const size_t all_k[] = {1, 3, 8, 32};
  std::vector<std::vector<MethodFrames>> by_k;
  for (const size_t count : all_k) {
    std::fprintf(stderr, "operations, %zu contacts\n", count);
    const Sites held(sites.begin(), sites.begin() + static_cast<std::ptrdiff_t>(count));
    by_k.push_back(
        measure_methods(organ, held, Motion::as_one, 1.0, {study.patient ? 2.0 : 0.4, 20, 20000, true}));
    const auto n = static_cast<double>(3 * count);
    const auto k = static_cast<double>(count);
    add_row(count, "linear_dd: new contacts", {"27 k^2 (m + k)", 27 * k * k * (m + k)},
            time_new_sets(organ, sites, count), 2 * n * n * n / 3 + 10 * n * n, {"", "", ""}, counts);
    for (const MethodFrames& frames : by_k.back()) {
      const double nu = frames.iterations;
      const std::vector<std::string> rest = {nu > 0 ? fmt::format("{:.0f}", nu) : "",
                                             error_cell(frames.errors.displacement),
                                             error_cell(frames.errors.force)};
      if (frames.method == "linear_dd")
        add_row(count, frames.method, {"3 m (3 k + 3 k) + k^3", 18 * m * k + k * k * k}, frames.times,
                9 * m * k + 2 * n * n, rest, counts);
      if (frames.method == "PFE")
        add_row(count, frames.method, {"3 m 3 k", 9 * m * k}, frames.times, 9 * m * k + n * n, rest, counts);
      // The count is an upper bound, because LCG skips rows without displacement.
      if (nu > 0 && frames.method != "LCG block-Jacobi")
        add_row(count, frames.method, {"60 m nu", 60 * m * nu}, frames.times, (nonzeros + 15 * m) * nu, rest,
                counts);
    }
  }
  const PaperRow rows[] = {{"LCG", "LCG", "3", "1"},
                           {"LCG block-Jacobi", "LCG block-Jacobi", "", ""},
                           {"PFE", "PFE", "200 +", "67 +"},
                           {"EPFE (linear_dd)", "linear_dd", "50 - 100", "17 - 33"},
                           {"EPFE forces alone", "linear_dd forces alone", "", ""},
                           {"back-solve", "back-solve", "", ""}};
  const auto find = [&](size_t index, const std::string& method) -> const MethodFrames& {
    return *std::find_if(by_k[index].begin(), by_k[index].end(),
                         [&](const MethodFrames& frames) { return frames.method == method; });
  };
  constexpr size_t kThree = 1;  // index of k = 3 in all_k
  for (const PaperRow& row : rows) {
    std::vector<std::string> cells = {row.name, row.frames_per_second};
    for (size_t index = 0; index < by_k.size(); ++index)
      cells.push_back(fmt::format("{:.3g}", 1e6 / find(index, row.method).times.median()));
    const MethodFrames& three = find(kThree, row.method);
    cells.emplace_back(row.times_lcg);
    cells.push_back(fmt::format("{:.3g}", find(kThree, "LCG").times.median() / three.times.median()));
    cells.push_back(error_cell(three.errors.displacement));
    cells.push_back(error_cell(three.errors.force));
    table1.add(cells);
  }
  return {table1, counts};
}

}  // namespace palpate::peers
