// palpate_study_peers DIR: what a frame of a linear organ costs by every method that we know of, and how wrong
// it is: linear_dd (EPFE) through the runtime, one back-solve, PFE, and LCG with and without a preconditioner.
// Blocks of 512 to 19,683 nodes, 1 to 64 contacts of one node each, which move by 2 % of their amplitude a
// frame; a frame gives the displacement of every node and the contacts' forces. Writes DIR/peers.md and
// DIR/linear_frames.csv.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <palpate/palpate.hpp>
#include <string>

#include <fmt/format.h>

#include "bench/peers/fixed_tensor.hpp"
#include "bench/peers/localized_cg.hpp"
#include "bench/solver/study_table.hpp"
#include "offline/pack/pack_writer.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::peers {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void require(pal_status status) {
  if (status != PAL_STATUS_OK) throw std::runtime_error(pal_status_text(status));
}

constexpr double kAmplitude = 0.01;  // of the block's edge
constexpr double kTolerance = 1e-3;  // of LCG: about what the eye sees
constexpr double kSeconds = 0.5;     // for the frames of one method
constexpr int kMostFrames = 2000;

// Contacts on circles of their own, three numbers each.
Eigen::VectorXd contacts_at(int frame, Eigen::Index num_contacts) {
  Eigen::VectorXd d(3 * num_contacts);
  for (Eigen::Index c = 0; c < num_contacts; ++c) {
    const double angle = 0.02 * frame + static_cast<double>(c);
    d.segment<3>(3 * c) = kAmplitude * Eigen::Vector3d(std::cos(angle), std::sin(angle), -1.0);
  }
  return d;
}

// A block held at its base with contacts spread over its top, and the linear pack of them.
struct Organ {
  Model model;
  std::vector<int> contacts;  // nodes
  Assembly assembly;
  double pack_seconds = 0;
  AlignedBytes pack{0};

  Organ(int cells, int num_contacts)
      : model(block(cells)), contacts(spread(num_contacts)), assembly(model, model.fixed_dofs()) {
    Scene scene;
    scene.file = scene.model_file = "block";
    scene.sites = contacts;
    scene.max_displacement = kAmplitude * std::sqrt(2.0);
    scene.tip_radius = 1e-6;
    scene.max_contacts = num_contacts;
    scene.polynomial = false;
    for (int node = 0; node < model.num_nodes(); ++node) scene.output_nodes.push_back(node);
    const double start = now();
    const ContactSites sites = find_contact_sites(scene, model);
    const LinearDd linear = compute_linear_dd(assembly, sites);
    PackContent content{model, scene, sites, &linear, nullptr, 0, {}, {}};
    pack = write_pack(content);
    pack_seconds = now() - start;
  }

 private:
  static Model block(int cells) {
    test::BlockShape shape;
    shape.cells = {cells, cells, cells};
    return test::with_fixed_base(test::tetrahedral_block(shape));
  }
  std::vector<int> spread(int count) const {
    const std::vector<int> top = test::nodes_on_plane(model, 2, 1.0);
    std::vector<int> nodes;
    nodes.reserve(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i)
      nodes.push_back(top[(static_cast<size_t>(i) * 2 + 1) * top.size() / (2 * static_cast<size_t>(count))]);
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  }
};

struct Cost {
  std::vector<double> seconds;    // ascending
  double displacement_error = 0;  // of any node, as part of what a contact moves
  double force_error = 0;         // of all contacts together

  double at(double part) const {
    return seconds[static_cast<size_t>(part * static_cast<double>(seconds.size() - 1))];
  }
};

// `frame(d)` is timed and gives the contacts' forces; `displacement()` is u_f after it. Errors are against the
// exact ones in every 20th frame.
template <typename Frame, typename Displacement>
Cost measure(const HeldContacts& held, BackSolve& exact, Frame&& frame, Displacement&& displacement) {
  Cost cost;
  const Eigen::Index num_contacts = held.free_contact.cols() / 3;
  const double start = now();
  for (int index = 0; index < kMostFrames && (index < 10 || now() - start < kSeconds); ++index) {
    const Eigen::VectorXd d = contacts_at(index, num_contacts);
    const double before = now();
    const Eigen::VectorXd force = frame(d);
    if (index > 0) cost.seconds.push_back(now() - before);  // the first one is cold
    if (index % 20 != 9) continue;
    const Eigen::VectorXd& right = exact.frame(d);
    const Eigen::VectorXd wrong = displacement().template cast<double>() - right;
    for (Eigen::Index node = 0; node < wrong.size() / 3; ++node)
      cost.displacement_error =
          std::max(cost.displacement_error, wrong.segment<3>(3 * node).norm() / contacts_at(0, 1).norm());
    const Eigen::VectorXd right_force = held.force(right, d);
    cost.force_error = std::max(cost.force_error, (force - right_force).norm() / right_force.norm());
  }
  std::sort(cost.seconds.begin(), cost.seconds.end());
  return cost;
}

// linear_dd as a scene would use it.
class Runtime {
 public:
  Runtime(const Organ& organ, const HeldContacts& held)
      : held_(&held), contacts_(organ.contacts.size()), results_(contacts_.size()) {
    require(pack_.open_memory(organ.pack.bytes().data(), organ.pack.bytes().size()));
    pal_session_config config = pal_default_session_config(pack_.get());
    config.max_contacts = static_cast<uint32_t>(contacts_.size());
    size_t bytes = 0;
    require(Session::required_bytes(pack_, config, bytes));
    arena_.emplace(bytes);
    require(session_.init(pack_, config, arena_->bytes()));
    for (size_t c = 0; c < contacts_.size(); ++c) contacts_[c].site = static_cast<uint32_t>(c);
    field_.resize(3 * organ.model.num_nodes());
  }

  Eigen::VectorXd forces(const Eigen::VectorXd& d) {
    for (size_t c = 0; c < contacts_.size(); ++c) {
      for (size_t i = 0; i < 3; ++i) contacts_[c].displacement[i] = d[static_cast<Eigen::Index>(3 * c + i)];
    }
    require(session_.contact_frame(contacts_, results_));
    Eigen::VectorXd force(d.size());
    for (size_t c = 0; c < contacts_.size(); ++c) {
      for (size_t i = 0; i < 3; ++i) force[static_cast<Eigen::Index>(3 * c + i)] = results_[c].force[i];
    }
    return force;
  }
  void show() { require(pal_visual_frame(session_.get(), field_.data(), 3 * sizeof(float))); }

  // Of the free dofs, as last shown.
  Eigen::VectorXf displacement() const { return field_(held_->free_dofs); }

 private:
  const HeldContacts* held_;
  Pack pack_;
  std::optional<AlignedBytes> arena_;
  Session session_;
  std::vector<pal_contact> contacts_;
  std::vector<pal_contact_result> results_;
  Eigen::VectorXf field_;
};

void add_rows(int cells, int num_contacts, study::StudyTable& table) {
  const Organ organ(cells, num_contacts);
  const HeldContacts held(organ.assembly, organ.contacts);
  const std::string nodes = std::to_string(organ.model.num_nodes());
  const auto add = [&](const char* method, double setup, double operations, const Cost& cost,
                       const std::string& iterations = "") {
    table.add({nodes, std::to_string(num_contacts), method, fmt::format("{:.2f}", setup),
               fmt::format("{:.3g}", 1e6 * cost.at(0.5)), fmt::format("{:.3g}", 1e6 * cost.at(0.999)),
               fmt::format("{:.1e}", cost.displacement_error), fmt::format("{:.1e}", cost.force_error),
               fmt::format("{:.2g}", operations), iterations});
  };
  const double m = static_cast<double>(held.free_dofs.size()) / 3;
  const double k = num_contacts;

  double start = now();
  BackSolve exact(held);
  const double factor_seconds = now() - start;
  start = now();
  FixedTensor tensor(held, exact);
  const double tensor_seconds = factor_seconds + now() - start;

  Runtime runtime(organ, held);
  // The paper: 3 m (3 k + 3 k) + k^3.
  add("linear_dd", organ.pack_seconds, 18 * m * k + k * k * k,
      measure(
          held, exact,
          [&](const Eigen::VectorXd& d) {
            Eigen::VectorXd force = runtime.forces(d);
            runtime.show();
            return force;
          },
          [&] { return runtime.displacement(); }));
  runtime.show();
  add("linear_dd forces alone", organ.pack_seconds, 9 * k * k,
      measure(
          held, exact, [&](const Eigen::VectorXd& d) { return runtime.forces(d); },
          [&] {
            runtime.show();
            return runtime.displacement();
          }));
  Eigen::VectorXf by_tensor;
  add("PFE", tensor_seconds, 9 * m * k,
      measure(
          held, exact,
          [&](const Eigen::VectorXd& d) {
            by_tensor = tensor.frame(d);
            return held.force(by_tensor.cast<double>(), d);
          },
          [&]() -> const Eigen::VectorXf& { return by_tensor; }));
  Eigen::VectorXd by_solve;
  BackSolve back_solve(held);
  add("back-solve", factor_seconds, 0,
      measure(
          held, exact,
          [&](const Eigen::VectorXd& d) {
            by_solve = back_solve.frame(d);
            return held.force(by_solve, d);
          },
          [&]() -> const Eigen::VectorXd& { return by_solve; }));
  for (const bool precondition : {false, true}) {
    start = now();
    LocalizedCg lcg(held, precondition, kTolerance);
    const double setup = now() - start;
    std::vector<int> iterations;
    Eigen::VectorXd by_lcg;
    const Cost cost = measure(
        held, exact,
        [&](const Eigen::VectorXd& d) {
          by_lcg = lcg.frame(d);
          iterations.push_back(lcg.iterations());
          return held.force(by_lcg, d);
        },
        [&]() -> const Eigen::VectorXd& { return by_lcg; });
    std::sort(iterations.begin(), iterations.end());
    const int median = iterations[iterations.size() / 2];
    // The paper: 60 m for each iteration.
    add(precondition ? "LCG block-Jacobi" : "LCG", setup, 60 * m * median, cost, std::to_string(median));
  }
}

}  // namespace

void write_study(const std::filesystem::path& directory) {
  study::StudyTable table(
      "linear_frames",
      "Frames of a linear organ that give every node's displacement and the contacts' forces.",
      {"nodes", "contacts", "method", "made ready (s)", "median (us)", "p99.9 (us)", "displacement error",
       "force error", "operations by the paper", "iterations"});
  for (const int cells : {7, 12, 19, 26}) {
    for (const int num_contacts : {1, 8, 64}) {
      std::fprintf(stderr, "%d nodes, %d contacts\n", (cells + 1) * (cells + 1) * (cells + 1), num_contacts);
      if (num_contacts <= (cells + 1) * (cells + 1)) add_rows(cells, num_contacts, table);
    }
  }
  std::filesystem::create_directories(directory);
  study::write_page(directory, "peers", {table});
  std::fputs(table.markdown().c_str(), stdout);
}

}  // namespace palpate::peers

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: palpate_study_peers DIR\n", stderr);
    return 2;
  }
  try {
    palpate::peers::write_study(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "palpate_study_peers: %s\n", error.what());
    return 1;
  }
}
