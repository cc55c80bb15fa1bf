#include "offline/fem/step_loads.hpp"

#include <Eigen/Geometry>

#include "offline/fem/face_shape.hpp"
#include "offline/mesh/element_faces.hpp"

namespace palpate {
namespace {

// Adds the nodal forces int N_a rho b dV of an element at rest.
template <int kNodes>
void add_gravity(const Model& model, const Tetrahedron& element, const Eigen::Vector3d& acceleration,
                 Eigen::VectorXd& force) {
  using Shape = TetrahedronShape<kNodes>;
  typename Shape::Nodal positions;
  for (int a = 0; a < kNodes; ++a)
    positions.col(a) = model.positions[static_cast<size_t>(element.node_array[static_cast<size_t>(a)])];
  const double density = model.materials[static_cast<size_t>(element.material)].density;
  for (int point = 0; point < Shape::kPoints; ++point) {
    const Eigen::Vector3d weight = density * ShapeAtPoint<kNodes>(positions, point).volume * acceleration;
    const auto values = Shape::values(Shape::point(point));
    for (int a = 0; a < kNodes; ++a)
      force.segment<3>(3 * element.node_array[static_cast<size_t>(a)]) += values[a] * weight;
  }
}

// Adds the nodal forces int N_a (t - p n) dS of a face at rest.
template <int kNodes>
void add_traction(const Model& model, const std::array<int, 6>& nodes, const Eigen::Vector3d& traction,
                  double pressure, Eigen::VectorXd& force) {
  Eigen::Matrix<double, 3, kNodes> X;
  for (int a = 0; a < kNodes; ++a)
    X.col(a) = model.positions[static_cast<size_t>(nodes[static_cast<size_t>(a)])];
  for (int point = 0; point < FaceShape<kNodes>::kPoints; ++point) {
    const FaceShape<kNodes> shape(point);
    const Eigen::Vector3d g_xi = X * shape.d_xi;
    const Eigen::Vector3d g_eta = X * shape.d_eta;
    const Eigen::Vector3d normal = g_xi.cross(g_eta);
    const Eigen::Vector3d pull = FaceShape<kNodes>::kWeight * (normal.norm() * traction - pressure * normal);
    for (int a = 0; a < kNodes; ++a)
      force.segment<3>(3 * nodes[static_cast<size_t>(a)]) += shape.values[a] * pull;
  }
}

void add_traction(const Model& model, const FaceId& face, const Eigen::Vector3d& traction, double pressure,
                  Eigen::VectorXd& force) {
  const Tetrahedron& element = model.elements[static_cast<size_t>(face.element)];
  const std::array<int, 6> nodes = outward_face(element, face.face);
  if (element.num_nodes == 4) {
    add_traction<3>(model, nodes, traction, pressure, force);
  } else {
    add_traction<6>(model, nodes, traction, pressure, force);
  }
}

}  // namespace

StepLoads::StepLoads(const Model& model, const Step& step) : model_(&model), step_(&step) {
  const auto forces_of = [&](int amplitude) -> Eigen::VectorXd& {
    return forces_.try_emplace(amplitude, Eigen::VectorXd::Zero(model.num_dofs())).first->second;
  };
  for (const NodalForce& load : step.forces)
    forces_of(load.amplitude)[3 * load.node + load.axis] += load.value;
  for (const Gravity& load : step.gravity) {
    const Tetrahedron& element = model.elements[static_cast<size_t>(load.element)];
    if (element.num_nodes == 4) {
      add_gravity<4>(model, element, load.value, forces_of(load.amplitude));
    } else {
      add_gravity<10>(model, element, load.value, forces_of(load.amplitude));
    }
  }
  for (const FaceTraction& load : step.tractions)
    add_traction(model, load.face, load.value, 0.0, forces_of(load.amplitude));
  if (!model.small_strain()) return;
  for (const FacePressure& load : step.pressures)
    add_traction(model, load.face, Eigen::Vector3d::Zero(), load.value, forces_of(load.amplitude));
}

double StepLoads::factor(int amplitude, double fraction) const {
  if (amplitude == kRamp) return 1;
  const Amplitude& history = model_->amplitudes[static_cast<size_t>(amplitude)];
  return history.at((history.total_time ? step_->start_time : 0.0) + fraction * step_->period);
}

LoadCase StepLoads::at(double fraction) const {
  LoadCase load;
  load.held.assign(static_cast<size_t>(model_->num_dofs()), 0);
  load.displacement.setZero(model_->num_dofs());
  load.force.setZero(model_->num_dofs());
  for (const PrescribedDisplacement& prescribed : step_->prescribed) {
    const int dof = 3 * prescribed.node + prescribed.axis;
    load.held[static_cast<size_t>(dof)] = 1;
    load.displacement[dof] = factor(prescribed.amplitude, fraction) * prescribed.value;
  }
  for (const auto& [amplitude, force] : forces_) load.force += factor(amplitude, fraction) * force;
  if (!model_->small_strain()) {
    for (const FacePressure& pressure : step_->pressures)
      load.pressures[pressure.face] += factor(pressure.amplitude, fraction) * pressure.value;
  }
  return load;
}

}  // namespace palpate
