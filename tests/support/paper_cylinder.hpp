// The cylinder of Zhong et al. 2005 section 2.4 under a force at the middle of its top, for any law. Tests
// and the study in bench/solver share this scene.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/mesh/inp_reader.hpp"

namespace palpate::test {

// mu and lambda of section 2.4 (the paper states no units), and the cylinder's height.
inline constexpr double kPaperMu = 0.48;
inline constexpr double kPaperLambda = 0.2;
inline constexpr double kPaperHeight = 20.0;

// Zhong et al. 2005 eq. (11), the law of Abaqus: W = mu/2 (J^(-2/3) I - 3) + kappa/2 (J - 1)^2. kappa is the
// bulk modulus at small strain. The paper writes lambda for kappa; eq. (1) has lambda + 2 mu / 3.
inline InvariantLaw equation_11(double mu, double kappa) {
  InvariantLaw law;
  law.c10 = mu / 2;
  law.volumetric.inverse_d[0] = kappa / 2;
  return law;
}

inline Model paper_cylinder(const std::filesystem::path& source_dir, const Law& law) {
  Model model = read_inp(source_dir / "models/cylinder/cylinder.inp");
  model.materials.at(0).law = law;
  return model;
}

// The node of P1, P2 or P3. The mesh has a node at each of the paper's points.
inline int marked_node(const Model& model, const char* set) {
  return model.node_sets.at(set).at(0);
}

// The cylinder under (0, 0, force) at P1. Each solve starts from the one before: ask for small forces first.
class LoadedCylinder {
 public:
  explicit LoadedCylinder(Model model)
      : model_(std::move(model)),
        assembly_(model_, model_.fixed_dofs()),
        solver_(assembly_),
        load_(LoadCase::rest(model_)),
        displacement_(Eigen::VectorXd::Zero(model_.num_dofs())) {}
  LoadedCylinder(const LoadedCylinder&) = delete;
  LoadedCylinder& operator=(const LoadedCylinder&) = delete;

  // The displacement of every dof; empty if Newton did not converge.
  std::optional<Eigen::VectorXd> under(double force) {
    LoadCase next = load_;
    next.force[3 * marked_node(model_, "P1") + 2] = force;
    report_ = solver_.ramp(load_, next, displacement_, SolverSettings{});
    if (!report_.converged) return std::nullopt;
    load_ = next;
    return displacement_;
  }

  const Model& model() const { return model_; }
  const SolveReport& report() const { return report_; }  // of the last solve

 private:
  Model model_;
  Assembly assembly_;
  StaticSolver solver_;
  LoadCase load_;
  Eigen::VectorXd displacement_;
  SolveReport report_;
};

}  // namespace palpate::test
