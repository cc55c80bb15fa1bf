// palpate solve: the full nonlinear finite element solution of every step of a model.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "offline/cli/allow_outside_option.hpp"
#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/nodal_table.hpp"
#include "offline/cli/path_table.hpp"
#include "offline/cli/solve_failure.hpp"
#include "offline/cli/solve_progress.hpp"
#include "offline/fem/arc_length.hpp"
#include "offline/fem/static_solver.hpp"
#include "offline/fem/step_loads.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"
#include "offline/mesh/volume_patches.hpp"

namespace palpate {
namespace {

constexpr const char* kByArcLength = "arc-length";
constexpr const char* kByStiffness = "current-stiffness";

struct SolveArguments {
  std::filesystem::path include_root;  // argument of read_inp()
  std::filesystem::path model;
  std::filesystem::path folder;
  std::string solver = "cholesky";
  std::string stepping;     // path control of *STATIC, RIKS; empty: not given
  double merge_length = 0;  // argument of read_inp()
  bool json = false;
};

// Marks the dofs that every step holds at zero, which need no equation: [num_dofs].
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
  MeshData mesh;
  mesh.positions = model.positions;
  mesh.point_arrays = {{"node", 1, {model.labels.begin(), model.labels.end()}},
                       {"displacement", 3, {displacement.begin(), displacement.end()}},
                       {"force", 3, {force.begin(), force.end()}}};
  MeshArray labels = {"element", 1, {}};
  MeshArray materials = {"material", 1, {}};
  for (const Tetrahedron& element : model.elements) {
    mesh.cells.push_back(
        {CellKind::tetrahedron, element.label, element.num_nodes, element.node_array, /*line=*/0});
    labels.values.push_back(element.label);
    materials.values.push_back(element.material);
  }
  mesh.cell_arrays = {labels, materials};
  write_vtu(mesh, {.is_binary = true}, file);
}

// Returns the peak memory of the process so far, bytes; 0 where the system does not report the peak.
std::int64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return 1024 * std::stoll(line.substr(6));
  }
  return 0;
}

// Whether a file name is a result of `solve`.
bool is_result_name(const std::string& name) {
  for (const char* fixed : {"partial.csv", "path.csv", "result.vtu", "summary.json"}) {
    if (name == fixed) return true;
  }
  constexpr std::string_view kFront = "step";
  constexpr std::string_view kBack = ".csv";
  if (name.size() <= kFront.size() + kBack.size() || !name.starts_with(kFront) || !name.ends_with(kBack))
    return false;
  return name.find_first_not_of("0123456789", kFront.size()) == name.size() - kBack.size();
}

// Makes the folder and removes the results of an earlier solve. Throws where an input would be removed.
void prepare_folder(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& inputs) {
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
  for (const std::filesystem::path& file : old) check_keeps_inputs(file, inputs);
  for (const std::filesystem::path& file : old) std::filesystem::remove(file);
}

// The outcome of one step.
struct StepResult {
  SolveReport report;
  std::optional<bool> stable;  // whether the tangent at the end is positive definite; empty: unknown
  std::optional<std::vector<double>> limit_load_factors;  // of the limit points; empty: a step without RIKS
};

// Solves the steps in order. Holds the solvers and the current state.
class StepSolver {
 public:
  StepSolver(const Model& model, const Assembly& assembly, const SolveArguments& arguments)
      : model_(model),
        assembly_(assembly),
        folder_(arguments.folder),
        linear_solver_(arguments.solver == "cg" ? LinearSolver::conjugate_gradient : LinearSolver::cholesky),
        stepping_(arguments.stepping == kByStiffness ? Stepping::current_stiffness : Stepping::arc_length),
        solver_(assembly, linear_solver_),
        reached_load_(LoadCase::rest(model)),
        displacement_(Eigen::VectorXd::Zero(model.num_dofs())) {}

  StepResult solve(const Step& step, const std::function<void(const IterationRecord&)>& progress) {
    return step.riks ? follow_path(step, progress) : follow_time(step, progress);
  }

  const Eigen::VectorXd& displacement() const { return displacement_; }

  nlohmann::json seconds() const {
    const SolveSeconds& a = solver_.seconds();
    return {{"analysis", a.analysis + path_seconds_.analysis},
            {"assembly", a.assembly + path_seconds_.assembly},
            {"factor", a.factor + path_seconds_.factor},
            {"back_solve", a.back_solve + path_seconds_.back_solve}};
  }

 private:
  StepResult follow_time(const Step& step, const std::function<void(const IterationRecord&)>& progress) {
    const StepLoads loads(model_, step);
    SolverSettings settings;
    settings.max_increments = step.max_increments;
    settings.first_increment = step.first_increment;
    settings.smallest_increment = step.smallest_increment;
    settings.largest_increment = step.largest_increment;
    settings.keep_to_path = true;
    StepResult result;
    result.report = solver_.follow(
        reached_load_, [&](double time) { return loads.at(time); }, displacement_, settings, progress);
    reached_load_ = loads.at(1.0);
    // The Cholesky factor decides stability; conjugate gradients cannot. With pressures the factor covers
    // only the symmetric part of the tangent. A positive definite symmetric part proves stability; an
    // indefinite part proves nothing.
    if (result.report.converged && linear_solver_ == LinearSolver::cholesky) {
      const bool positive_definite = solver_.factorize_at(reached_load_, displacement_, false);
      if (positive_definite || reached_load_.pressures.empty()) result.stable = positive_definite;
    }
    return result;
  }

  StepResult follow_path(const Step& step, const std::function<void(const IterationRecord&)>& progress) {
    const LoadCase to = StepLoads(model_, step).at(1.0);
    if (to.held == reached_load_.held && to.displacement == reached_load_.displacement &&
        to.force == reached_load_.force && to.pressures == reached_load_.pressures) {
      throw InputError(
          step.source,
          "*STATIC, RIKS has no path to follow: its step changes no load and moves nothing; give it "
          "a load other than 0");
    }
    if (stepping_ == Stepping::current_stiffness &&
        (to.held != reached_load_.held || to.displacement != reached_load_.displacement)) {
      throw InputError(
          step.source,
          "--stepping current-stiffness is for steps that change loads alone, and this one moves "
          "nodes or holds others; solve with --stepping arc-length");
    }
    ArcLengthSettings settings;
    settings.stepping = stepping_;
    settings.max_increments = step.max_increments;
    settings.first_increment = step.first_increment;
    settings.smallest_increment = step.smallest_increment;
    settings.largest_increment = step.largest_increment;
    settings.end_load_factor = step.riks->end_load_factor;
    if (step.riks->end_displacement) {
      const int dof = 3 * step.riks->node + step.riks->axis;
      settings.end_displacement = {dof, *step.riks->end_displacement};
    }
    PathTable path(model_, *step.riks);
    std::vector<PathPoint> points;
    ArcLength solver(assembly_);
    StepResult result;
    result.report = solver.follow(
        reached_load_, to, displacement_, settings,
        [&](const PathPoint& point, const Eigen::VectorXd& displacement) {
          path.add(point, displacement);
          points.push_back(point);
        },
        progress);
    path_seconds_ = solver.seconds();
    path.write(folder_ / "path.csv");
    const bool positive_definite = !points.empty() && points.back().negative_pivots == 0;
    if (positive_definite || to.pressures.empty()) result.stable = positive_definite;
    result.limit_load_factors = limit_load_factors(points);
    return result;
  }

  const Model& model_;
  const Assembly& assembly_;
  std::filesystem::path folder_;
  LinearSolver linear_solver_;
  Stepping stepping_;
  StaticSolver solver_;
  SolveSeconds path_seconds_;     // seconds of the step with RIKS
  LoadCase reached_load_;         // load at the end of the last step
  Eigen::VectorXd displacement_;  // num_dofs
};

nlohmann::json summary_of(const StepResult& result, double seconds, const Model& model) {
  const SolveReport& report = result.report;
  nlohmann::json summary = {
      {"converged", report.converged},
      {"positive_definite", result.stable ? nlohmann::json(*result.stable) : nlohmann::json()},
      {"load_factor", report.load_factor},
      {"increments", report.increments},
      {"cutbacks", report.cutbacks},
      {"iterations", report.iterations},
      {"factorizations", report.factorizations},
      {"residual", report.residual},
      {"min_J", report.min_jacobian},
      {"min_J_element", model.elements[static_cast<size_t>(report.worst_element)].label},
      {"seconds", seconds}};
  if (result.limit_load_factors) summary["limit_load_factors"] = *result.limit_load_factors;
  return summary;
}

void print_step(size_t number, const Step& step, const StepResult& result, double seconds) {
  const SolveReport& report = result.report;
  fmt::print("step {}: {} increments, {} iterations, {} factors, residual {:.1e}, min J {:.4f}, {:.2f} s\n",
             number, report.increments, report.iterations, report.factorizations, report.residual,
             report.min_jacobian, seconds);
  if (result.limit_load_factors) {
    fmt::print("step {}: the load factor ends at {:.6g}", number, report.load_factor);
    const char* before = ", with limit points at ";
    for (const double limit : *result.limit_load_factors) {
      fmt::print("{}{:.6g}", before, limit);
      before = ", ";
    }
    fmt::print("\n");
  }
  if (step.riks && !step.riks->end_load_factor && !step.riks->end_displacement) {
    fmt::print(
        "step {}: the path has no end condition and took all {} increments; give a load factor or "
        "a "
        "displacement on the data line of *STATIC, RIKS\n",
        number, report.increments);
  }
  if (result.stable == false)
    fmt::print("step {}: this equilibrium is unstable: the tangent is not positive definite\n", number);
}

int run_solve(const SolveArguments& arguments) {
  const Model model = read_inp(arguments.model, arguments.include_root, arguments.merge_length);
  for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
  for (const auto& fault : unjoined_messages(model, find_unjoined(model))) fmt::print(stderr, "{}\n", fault);
  if (model.steps.empty())
    throw InputError({model.file, 0}, "no *STEP: there is nothing to solve; add one with its loads");
  if (model.steps.back().riks && arguments.solver == "cg") {
    throw InputError(model.steps.back().source,
                     "*STATIC, RIKS needs a factor of the tangent, which conjugate gradients do not make; "
                     "solve without --solver cg");
  }
  if (!arguments.stepping.empty() && !model.steps.back().riks) {
    throw InputError(model.steps.back().source,
                     "--stepping is for *STATIC, RIKS, and the last *STEP has *STATIC alone; write *STATIC, "
                     "RIKS there, or solve without --stepping");
  }
  prepare_folder(arguments.folder, {model.files.begin(), model.files.end()});

  const Assembly assembly(model, always_at_zero(model),
                          static_cast<int>(std::thread::hardware_concurrency()));
  StepSolver solver(model, assembly, arguments);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(model.num_dofs());
  nlohmann::json summary = {{"model", model.file},
                            {"nodes", model.num_nodes()},
                            {"elements", model.elements.size()},
                            {"volume_patches", count_volume_patches(model).patches},
                            {"equations", assembly.num_equations()},
                            {"solver", arguments.solver},
                            {"steps", nlohmann::json::array()}};
  if (model.steps.back().riks)
    summary["stepping"] = arguments.stepping.empty() ? kByArcLength : arguments.stepping;
  bool converged = true;
  for (size_t i = 0; i < model.steps.size() && converged; ++i) {
    const auto start = std::chrono::steady_clock::now();
    SolveProgress progress(model.steps[i], i + 1);
    const StepResult result =
        solver.solve(model.steps[i], [&](const IterationRecord& record) { progress.show(record); });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    converged = result.report.converged;
    summary["steps"].push_back(summary_of(result, seconds, model));
    assembly.internal_force(solver.displacement(), force);
    const std::string name = converged ? fmt::format("step{}.csv", i + 1) : "partial.csv";
    write_nodal_table(arguments.folder / name, nodal_rows(model, solver.displacement(), force));
    if (!converged) {
      print_failure(result.report, i + 1, model);
    } else if (!arguments.json) {
      print_step(i + 1, model.steps[i], result, seconds);
    }
  }
  summary["seconds"] = solver.seconds();
  summary["peak_memory_bytes"] = peak_memory_bytes();
  write_result(arguments.folder / "result.vtu", model, solver.displacement(), force);
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
      "*STATIC, RIKS follows the path of equilibria past its limit points and writes path.csv, a row a "
      "point: "
      "load_factor,\n"
      "current_stiffness (Bergan's: 1 at the start, 0 at a limit point), negative_pivots (0 = stable), and "
      "ux_N,uy_N,uz_N of the\n"
      "nodes N in the NSET of the step's *NODE PRINT or *NODE FILE, else of the node on its data line, else "
      "of "
      "the one that\n"
      "moves furthest at first. Its step is the last. The data line says where it ends; if it does not, INC "
      "of "
      "*STEP does.\n\n"
      "With --stepping current-stiffness (Bergan's procedure) the first arc increment is one of the load, "
      "and "
      "those behind it\n"
      "are the first times sqrt|current_stiffness|, with its sign: at most half longer than the last, and "
      "that "
      "where the stiffness\n"
      "hardly changes. It does not pass a snap-back, where the deflection under the load turns: exit code "
      "2.\n\n"
      "Example: palpate solve models/cylinder/cylinder_push.inp -o /tmp/push");
  command->add_option("MODEL.inp", arguments->model, "Model file with at least one *STEP")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->folder, "Folder for the results; made if it is not there")
      ->type_name("DIR")
      ->required();
  command
      ->add_option("--solver", arguments->solver,
                   "cholesky (default): a sparse Cholesky factor; cg: conjugate gradients, slower on most "
                   "organs, with a "
                   "fraction of the memory")
      ->type_name("cholesky|cg")
      ->check(CLI::IsMember({"cholesky", "cg"}));
  command
      ->add_option(
          "--stepping", arguments->stepping,
          "What sizes and directs the increments of *STATIC, RIKS: arc-length (default): the length of "
          "the path; current-stiffness: Bergan's parameter, for loads without snap-back")
      ->type_name(std::string(kByArcLength) + "|" + kByStiffness)
      ->check(CLI::IsMember({kByArcLength, kByStiffness}));
  command
      ->add_option("--merge", arguments->merge_length,
                   "Merge nodes closer together than this (length unit of the model), to join parts")
      ->type_name("LENGTH")
      ->check([](const std::string& text) {
        return parse_number(text).value_or(0) > 0 ? "" : "write a length above 0";
      });
  add_allow_outside_option(*command, arguments->include_root);
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_solve(*arguments); });
}

}  // namespace palpate
