#include "offline/fem/load_path.hpp"

namespace palpate {

LoadPath::LoadPath(const LoadCase& from, const std::function<LoadCase(double)>& loads, const Model& model,
                   const Eigen::VectorXd& displacement, const Eigen::VectorXd& internal)
    : loads_(loads), held_(loads(1.0).held), pressure_offset_(from.pressures) {
  Eigen::VectorXd pressure_force = Eigen::VectorXd::Zero(displacement.size());
  add_pressure_force(model, from.pressures, displacement, pressure_force);
  Eigen::VectorXd force = from.force;
  for (Eigen::Index dof = 0; dof < force.size(); ++dof) {
    if (from.held[static_cast<size_t>(dof)]) force[dof] = internal[dof] - pressure_force[dof];
  }
  const LoadCase first = loads(0.0);
  displacement_offset_ = displacement - first.displacement;
  force_offset_ = force - first.force;
  for (const auto& [face, pressure] : first.pressures) pressure_offset_[face] -= pressure;
}

LoadCase LoadPath::at(double time) const {
  LoadCase load = loads_(time);
  load.held = held_;
  if (time != 1.0) {
    load.displacement += (1.0 - time) * displacement_offset_;
    load.force += (1.0 - time) * force_offset_;
    for (const auto& [face, pressure] : pressure_offset_) load.pressures[face] += (1.0 - time) * pressure;
  }
  for (Eigen::Index dof = 0; dof < load.force.size(); ++dof) {
    if (held_[static_cast<size_t>(dof)]) load.force[dof] = 0;
  }
  return load;
}

}  // namespace palpate
