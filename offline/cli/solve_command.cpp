// palpate solve: the full nonlinear finite element solution of every step of a model.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/nodal_table.hpp"
#include "offline/cli/progress_bar.hpp"
#include "offline/fem/static_solver.hpp"
#include "offline/fem/step_loads.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/output/finished_file.hpp"
#include "offline/output/vtu_writer.hpp"

namespace palpate {
namespace {

struct SolveArguments {
  std::filesystem::path model;
  std::filesystem::path folder;
  std::string solver = "cholmod";
  bool json = false;
};

// Dofs that no step frees or moves: they need no equation.
std::vector<char> always_at_zero(const Model& model) {
  std::vector<char> eliminated(static_cast<size_t>(model.num_dofs()), 1);
  for (const Step& step : model.steps) {
    std::vector<char> at_zero(eliminated.size(), 0);
    for (const PrescribedDisplacement& held : step.prescribed)
      at_zero[static_cast<size_t>(3 * held.node + held.axis)] = held.value == 0;
    for (size_t dof = 0; dof < eliminated.size(); ++dof) eliminated[dof] = eliminated[dof] && at_zero[dof];
  }
  return eliminated;
}

void write_result(const std::filesystem::path& file, const Model& model, const Eigen::VectorXd& displacement,
                  const Eigen::VectorXd& force) {
  VtuMesh mesh;
  mesh.points = model.positions;
  mesh.point_data = {{"displacement", 3, {displacement.begin(), displacement.end()}},
                     {"force", 3, {force.begin(), force.end()}}};
  mesh.point_integers = {{"node", model.labels}};
  VtuIntegerArray labels = {"element", {}};
  VtuIntegerArray materials = {"material", {}};
  for (const Tetrahedron& element : model.elements) {
    mesh.connectivity.insert(mesh.connectivity.end(), element.nodes().begin(), element.nodes().end());
    mesh.cells.push_back(element.num_nodes == 4 ? VtuCell::kTetrahedron : VtuCell::kQuadraticTetrahedron);
    labels.values.push_back(element.label);
    materials.values.push_back(element.material);
  }
  mesh.cell_integers = {labels, materials};
  write_vtu(mesh, file);
}

// `stable`: whether the tangent at the end is positive definite, null where that is not known.
nlohmann::json summary_of(const SolveReport& report, double seconds, const nlohmann::json& stable,
                          const Model& model) {
  return {{"converged", report.converged},
          {"positive_definite", stable},
          {"load_factor", report.load_factor},
          {"increments", report.increments},
          {"cutbacks", report.cutbacks},
          {"iterations", report.iterations},
          {"factorizations", report.factorizations},
          {"residual", report.residual},
          {"min_J", report.min_jacobian},
          {"min_J_element", model.elements[static_cast<size_t>(report.worst_element)].label},
          {"seconds", seconds}};
}

// Of this process so far; 0 where the system does not tell.
std::int64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return 1024 * std::stoll(line.substr(6));
  }
  return 0;
}

const char* text_of(StopCause cause) {
  switch (cause) {
    case StopCause::none:
      break;
    case StopCause::no_tangent:
      return "there is no tangent to go on with; hold the body better, or use a smaller load";
    case StopCause::inverted:
      return "the first guess of the smallest increment turns an element inside out; allow smaller "
             "increments in *STATIC";
    case StopCause::no_descent:
      return "no part of Newton's step comes nearer; use a finer increment, a smaller load or a better "
             "shaped mesh there";
    case StopCause::iterations:
      return "the smallest increment takes too many iterations; use a smaller load or a better shaped mesh "
             "there";
    case StopCause::not_finite:
      return "the forces are no finite numbers; correct the loads or their units";
    case StopCause::increments:
      return "INC of *STEP is reached; raise it, or allow larger increments in *STATIC";
  }
  return "";
}

void print_failure(const SolveReport& report, size_t step, const Model& model) {
  constexpr size_t kRows = 12;
  fmt::print(stderr, "increment  load      iteration  residual    step      min J\n");
  const size_t first = report.history.size() > kRows ? report.history.size() - kRows : 0;
  for (size_t i = first; i < report.history.size(); ++i) {
    const IterationRecord& row = report.history[i];
    fmt::print(stderr, "{:9}  {:<8.6f}  {:9}  {:<10.3e}  {:<8.2e}  {:.4f}\n", row.increment, row.load_factor,
               row.iteration, row.residual, row.step, row.min_jacobian);
  }
  fmt::print(
      stderr,
      "{}: step {} did not converge: last converged load factor {:.6f}, after {} increments and {} cutbacks; "
      "in the last try element {} has the smallest J, {:.3g}; {}\n",
      model.file, step, report.load_factor, report.increments, report.cutbacks,
      model.elements[static_cast<size_t>(report.trouble_element)].label, report.trouble_jacobian,
      text_of(report.stopped));
}

// A name that only a solve writes.
bool is_result_name(const std::string& name) {
  if (name == "partial.csv" || name == "result.vtu" || name == "summary.json") return true;
  constexpr std::string_view kFront = "step";
  constexpr std::string_view kBack = ".csv";
  if (name.size() <= kFront.size() + kBack.size() || !name.starts_with(kFront) || !name.ends_with(kBack))
    return false;
  return name.find_first_not_of("0123456789", kFront.size()) == name.size() - kBack.size();
}

// Makes the folder and takes out what an earlier solve left in it: results of another run, or of a step that
// this one does not reach, must not stand beside its own.
void prepare_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: this folder cannot be made ({}); name another with -o",
                                         folder.string(), error.message()));
  }
  check_can_finish(folder / "summary.json");
  std::vector<std::filesystem::path> old;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file() && is_result_name(entry.path().filename().string()))
      old.push_back(entry.path());
  }
  for (const std::filesystem::path& file : old) std::filesystem::remove(file);
}

int run_solve(const SolveArguments& arguments) {
  const Model model = read_inp(arguments.model);
  for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
  if (model.steps.empty())
    throw InputError({model.file, 0}, "no *STEP: there is nothing to solve; add one with its loads");
  prepare_folder(arguments.folder);

  const Assembly assembly(model, always_at_zero(model),
                          static_cast<int>(std::thread::hardware_concurrency()));
  const LinearSolver linear_solver =
      arguments.solver == "cg" ? LinearSolver::conjugate_gradient : LinearSolver::cholesky;
  StaticSolver solver(assembly, linear_solver);

  LoadCase from = LoadCase::rest(model);
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(model.num_dofs());
  Eigen::VectorXd force = Eigen::VectorXd::Zero(model.num_dofs());
  nlohmann::json summary = {{"model", model.file},
                            {"nodes", model.num_nodes()},
                            {"elements", model.elements.size()},
                            {"equations", assembly.num_equations()},
                            {"solver", arguments.solver},
                            {"steps", nlohmann::json::array()}};
  bool converged = true;
  for (size_t i = 0; i < model.steps.size() && converged; ++i) {
    const StepLoads loads(model, model.steps[i]);
    const LoadCase at_end = loads.at(1.0);
    SolverSettings settings;
    settings.max_increments = model.steps[i].max_increments;
    settings.first_increment = model.steps[i].first_increment;
    settings.smallest_increment = model.steps[i].smallest_increment;
    settings.largest_increment = model.steps[i].largest_increment;
    SolveProgress progress(i + 1);
    const auto start = std::chrono::steady_clock::now();
    const SolveReport report = solver.follow(
        from, [&](double time) { return loads.at(time); }, displacement, settings,
        [&](const IterationRecord& record) { progress.show(record); });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    progress.finish();
    converged = report.converged;
    // A factor tells at once; conjugate gradients would have to find a direction that is not. With pressures
    // the factor is of the symmetric part alone: positive definite, it proves stability, indefinite nothing.
    nlohmann::json stable;
    if (converged && linear_solver == LinearSolver::cholesky) {
      const bool positive_definite = solver.factorize_at(at_end, displacement, false);
      if (positive_definite || at_end.pressures.empty()) stable = positive_definite;
    }
    summary["steps"].push_back(summary_of(report, seconds, stable, model));
    assembly.internal_force(displacement, force);
    const std::string name = converged ? fmt::format("step{}.csv", i + 1) : "partial.csv";
    write_nodal_table(arguments.folder / name, nodal_rows(model, displacement, force));
    if (converged) {
      if (!arguments.json) {
        fmt::print(
            "step {}: {} increments, {} iterations, {} factors, residual {:.1e}, min J {:.4f}, {:.2f} s\n",
            i + 1, report.increments, report.iterations, report.factorizations, report.residual,
            report.min_jacobian, seconds);
        if (stable == false)
          fmt::print("step {}: this equilibrium is unstable: the tangent is not positive definite\n", i + 1);
      }
    } else {
      print_failure(report, i + 1, model);
    }
    from = at_end;
  }
  summary["seconds"] = {{"analysis", solver.seconds().analysis},
                        {"assembly", solver.seconds().assembly},
                        {"factor", solver.seconds().factor},
                        {"back_solve", solver.seconds().back_solve}};
  summary["peak_memory_bytes"] = peak_memory_bytes();
  write_result(arguments.folder / "result.vtu", model, displacement, force);
  write_finished_text(arguments.folder / "summary.json", json_text(summary) + "\n");
  if (arguments.json) {
    fmt::print("{}\n", json_text(summary));
  } else {
    fmt::print("wrote {}\n", (arguments.folder / "result.vtu").string());
  }
  return converged ? 0 : 2;
}

}  // namespace

void add_solve_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SolveArguments>();
  CLI::App* command =
      app.add_subcommand("solve", "Solve every *STEP of a model by full nonlinear finite elements");
  command->footer(
      "Writes to DIR: stepN.csv (node,x,y,z,ux,uy,uz,fx,fy,fz; f is the force that the outside must apply at "
      "the node),\n"
      "result.vtu for ParaView, summary.json. If a step does not converge: exit code 2, and the last "
      "converged state in\n"
      "partial.csv. Results of an earlier solve in DIR are removed once the model is read.\n\n"
      "Example: palpate solve models/cylinder/cylinder_push.inp -o /tmp/push");
  command->add_option("MODEL.inp", arguments->model, "Model file with at least one *STEP")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->folder, "Folder for the results; made if it is not there")
      ->type_name("DIR")
      ->required();
  command
      ->add_option("--solver", arguments->solver,
                   "cholmod (default): a sparse Cholesky factor; cg: conjugate gradients, slower on most "
                   "organs, with a "
                   "fraction of the memory")
      ->type_name("cholmod|cg")
      ->check(CLI::IsMember({"cholmod", "cg"}));
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_solve(*arguments); });
}

}  // namespace palpate
