#include "offline/fem/equilibrium.hpp"

#include <cmath>

#include "offline/fem/gmres.hpp"

namespace palpate {

Eigen::VectorXd external_force(const Model& model, const LoadCase& load,
                               const Eigen::VectorXd& displacement) {
  Eigen::VectorXd external = load.force;
  add_pressure_force(model, load.pressures, displacement, external);
  return external;
}

void clear_held(const Assembly& assembly, const LoadCase& load, Eigen::VectorXd& vector) {
  for (int dof = 0; dof < assembly.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)] || assembly.dof_equations()[static_cast<size_t>(dof)] < 0)
      vector[dof] = 0;
  }
}

Eigen::VectorXd out_of_balance(const Assembly& assembly, const LoadCase& load,
                               const Eigen::VectorXd& internal, const Eigen::VectorXd& external) {
  Eigen::VectorXd residual = external - internal;
  clear_held(assembly, load, residual);
  return residual;
}

double force_scale(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& internal,
                   const Eigen::VectorXd& external) {
  double held = 0;
  double applied = 0;
  for (int dof = 0; dof < assembly.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      held += internal[dof] * internal[dof];
    } else if (assembly.dof_equations()[static_cast<size_t>(dof)] >= 0) {
      applied += external[dof] * external[dof];
    }
  }
  return std::sqrt(held) + std::sqrt(applied);
}

std::vector<char> held_equations(const Assembly& assembly, const LoadCase& load) {
  std::vector<char> held;
  held.reserve(assembly.equation_dofs().size());
  for (const int dof : assembly.equation_dofs()) held.push_back(load.held[static_cast<size_t>(dof)]);
  return held;
}

void hold_equations(const std::vector<char>& held, SparseLower& stiffness) {
  for (int column = 0; column < stiffness.outerSize(); ++column) {
    const bool column_held = held[static_cast<size_t>(column)] != 0;
    for (SparseLower::InnerIterator it(stiffness, column); it; ++it) {
      if (it.row() != column && (column_held || held[static_cast<size_t>(it.row())])) it.valueRef() = 0;
    }
  }
}

bool solve_with_pressures(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& displacement,
                          const std::function<bool(Eigen::VectorXd&)>& precondition, Eigen::VectorXd& b) {
  constexpr double kTolerance = 1e-6;
  constexpr int kMaxSweeps = 100;
  const auto product = [&](const Eigen::VectorXd& v) {
    Eigen::VectorXd result = assembly.tangent_times(displacement, v);
    subtract_pressure_product(assembly.model(), load.pressures, displacement, v, result);
    clear_held(assembly, load, result);
    return result;
  };
  Eigen::VectorXd right_hand_side = b;
  clear_held(assembly, load, right_hand_side);
  Eigen::VectorXd x;
  if (!gmres(product, precondition, right_hand_side, kTolerance, kMaxSweeps, x)) return false;
  b = x;
  return true;
}

}  // namespace palpate
