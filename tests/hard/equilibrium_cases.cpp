// Bodies with several equilibria: the system finds the equilibrium on the path from rest, or says that none
// exists.
#include <fmt/core.h>

#include <filesystem>
#include <numbers>

#include "offline/fem/step_loads.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/hard/hard_bodies.hpp"
#include "tests/hard/hard_cases.hpp"

namespace palpate::hard {
namespace {

// A column of 1 x 1 x `length` on a fixed base; the patch of its only site is the whole top.
OrganSpec column(double length, double most, int sites) {
  test::BlockShape shape;
  shape.cells = {2, 2, static_cast<int>(2 * length)};
  shape.size = {1, 1, length};
  shape.jitter = 0;
  OrganSpec spec;
  spec.model = test::with_fixed_base(test::tetrahedral_block(shape));
  for (const int node : test::nodes_on_plane(spec.model, 2, length)) {
    const Eigen::Vector3d& at = spec.model.positions[static_cast<size_t>(node)];
    if (std::abs(at.x() - 0.5) < 0.1 && std::abs(at.y() - 0.5) < 0.1) spec.sites.push_back(node);
  }
  spec.sites.resize(static_cast<size_t>(sites));
  spec.max_displacement = most;
  spec.tip_radius = 0.75;
  return spec;
}

// A column compressed end on: it shortens straight, then buckles to one side. Each side is an equilibrium, so
// an answer is compared with the nearest of the full solves that come straight or from a side.
std::vector<Answer> compressed_column(double length, double part, const Bar& bar) {
  const double most = part * length;
  const Organ& organ =
      shared_organ(fmt::format("column {} {}", length, part), [&] { return column(length, most, 1); });
  std::vector<std::vector<Answer>> sets;
  for (const pal_contact& goal : {push(0, {0, 0, -most}), push(0, {0.3 * most, 0, -0.9 * most})}) {
    std::vector<Answer> nearest = ask_all(organ, {goal});
    for (const Eigen::Vector3d& side : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0),
                                        Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, -1, 0)}) {
      const Eigen::Vector3d aside = Eigen::Vector3d(goal.displacement) / 2 + most * side;
      const std::vector<Answer> answers = ask_all(organ, {goal}, {push(0, aside)});
      for (size_t i = 0; i < nearest.size(); ++i) {
        if (answers[i].displacement_error < nearest[i].displacement_error) nearest[i] = answers[i];
      }
    }
    sets.push_back(nearest);
  }
  return worst_of(sets, bar);
}

// The same place reached straight and around: a zone's state must not depend on the path.
std::vector<Answer> two_ways(double size, double radius, int cells) {
  const Organ& organ = shared_organ(fmt::format("two ways {} {}", size, radius), [&] {
    OrganSpec spec = touched(unit_block(cells), size, radius);
    spec.sites.resize(4);
    spec.zone_rings = 2;
    return spec;
  });
  const Eigen::Vector3d d = size * Eigen::Vector3d(0.6, 0, -0.8);
  const std::vector<pal_contact> contacts = {push(1, d)};
  const Truth truth = organ.solve(contacts);
  std::vector<Answer> answers;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_ZONE}) {
    const std::string by = model == PAL_MODEL_AUTO ? "auto" : model_name(model);
    ModelUnitSession session(organ.opened(), model, 1, 0);
    std::vector<pal_contact_result> results;
    constexpr int kFrames = 400;
    for (int frame = 0; frame <= kFrames; ++frame) {
      const double part = static_cast<double>(frame) / kFrames;
      const double angle = 3 * std::numbers::pi * part;
      const Eigen::Vector3d on_the_way(-0.6 * size * std::cos(angle), 0.6 * size * std::sin(angle),
                                       -0.8 * size * std::min(1.0, 2 * part));
      results = session.contact_frame(std::vector<pal_contact>{push(1, on_the_way)});
    }
    for (int frame = 0; frame < 60; ++frame) {
      if (results.front().model == PAL_MODEL_ZONE) session.refine();
      results = session.contact_frame(contacts);
    }
    answers.push_back(organ.compare(by, contacts, results, session.visual_frame(), truth));
  }
  return answers;
}

// A step of a shipped model under load control.
std::vector<Answer> snapped_arch() {
  const std::filesystem::path folder = std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "arch";
  const Model model = read_inp(folder / "arch_snap.inp");
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.keep_to_path = true;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  const LoadCase load = StepLoads(model, model.steps.front()).at(1);
  const SolveReport report = solver.ramp(LoadCase::rest(model), load, u, settings);
  if (!report.converged) {
    Answer answer = refused(
        "solve", fmt::format("stopped at a load factor of {:.3f} by the limit point", report.load_factor));
    if (report.stopped != StopCause::limit_point) answer.happened = "stopped, not by a limit point";
    return {answer};
  }
  Answer answer;
  answer.by = "solve";
  answer.happened = "went over to the snapped arch in silence";
  return {answer};
}

}  // namespace

Group equilibrium_cases() {
  Group group{
      "equilibrium",
      "Two equilibria",
      "Columns compressed end on, which buckle; pushes reached on two ways; an arch under a dead load that "
      "snaps through. Where the "
      "sampled equilibrium is not the one from rest, or not stable, the build cuts the domain or refuses.",
      {}};
  const auto add = [&](const std::string& name, const std::string& hard, const Bar& bar, Expected expected,
                       auto run, const std::string& reason = "") {
    group.cases.push_back({"equilibrium", name, hard, bar, expected, reason, run});
  };
  const Bar bar = {0.02, 0.02};
  add("stocky_column", "column three times as high as wide, compressed by 10 %", bar, Expected::answer,
      [bar] { return compressed_column(3, 0.1, bar); });
  add(
      "slender_column",
      "column eight times as high as wide, compressed end on by 15 %, far beyond Euler's load", bar,
      Expected::nothing, [bar] { return compressed_column(8, 0.15, bar); },
      "past Euler's load the straight column is not stable and it buckles to either side: no function of the "
      "displacement tells which");
  group.cases.back().slow = true;
  add("two_ways_half_edge", "a patch at half an edge, reached on a spiral", bar, Expected::answer,
      [] { return two_ways(0.12, 0.26, 4); });
  add("two_ways_edge", "a single node at one edge, reached on a spiral", bar, Expected::answer,
      [] { return two_ways(0.2, 0, 5); });
  add("arch_dead_load", "shallow arch under a dead load past its limit point, without *STATIC, RIKS", bar,
      Expected::nothing, [] { return snapped_arch(); });
  return group;
}

}  // namespace palpate::hard
