#include "bench/speed_error/bullet_body.hpp"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace palpate::study {
namespace {

constexpr btScalar kFrame = 1;  // dt, the unit of time

btVector3 to_bullet(const Eigen::Vector3d& vector) {
  return {static_cast<btScalar>(vector.x()), static_cast<btScalar>(vector.y()),
          static_cast<btScalar>(vector.z())};
}

Eigen::Vector3d from_bullet(const btVector3& vector) {
  return {static_cast<double>(vector.x()), static_cast<double>(vector.y()), static_cast<double>(vector.z())};
}

double volume_of(const Model& model, const Tetrahedron& element) {
  const auto at = [&](size_t corner) -> const Eigen::Vector3d& {
    return model.positions[static_cast<size_t>(element.node_array[corner])];
  };
  return (at(1) - at(0)).dot((at(2) - at(0)).cross(at(3) - at(0))) / 6;
}

double largest_extent(const Model& model) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : model.positions) box.extend(position);
  return box.sizes().maxCoeff();
}

std::vector<int> held_nodes(const Model& model, const std::vector<char>& held) {
  std::vector<int> nodes;
  for (int node = 0; node < model.num_nodes(); ++node) {
    const auto first = held.begin() + 3 * static_cast<std::ptrdiff_t>(node);
    const auto axes = std::count(first, first + 3, 1);
    if (axes == 3) nodes.push_back(node);
    if (axes == 1 || axes == 2) {
      throw std::runtime_error(
          fmt::format("{}: node {} is held along some axes alone; Bullet holds whole nodes", model.file,
                      model.labels[static_cast<size_t>(node)]));
    }
  }
  return nodes;
}

void check_elements(const Model& model) {
  for (const Tetrahedron& element : model.elements) {
    if (element.num_nodes != 4 || element.volume_patch >= 0) {
      throw std::runtime_error(fmt::format(
          "{}: element {} {}; Bullet knows tetrahedra of four nodes with volumes of their own", model.file,
          element.label, element.num_nodes == 4 ? "shares its volume change" : "has ten nodes"));
    }
  }
}

}  // namespace

struct BulletBody::World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &constraints, &configuration, &solver};
  std::unique_ptr<btDeformableNeoHookeanForce> law;
  std::unique_ptr<btSoftBody> body;
  std::vector<int> held;
  std::vector<Eigen::Vector3d> rest;  // in Bullet's single precision
  double force_unit = 1;              // Bullet's unit of force, in the model's force unit

  ~World() {
    if (body) world.removeSoftBody(body.get());
  }
};

BulletBody::BulletBody(const Model& model, const std::vector<char>& held, double frames_of_a_wave)
    : world_(std::make_unique<World>()) {
  World& w = *world_;
  check_elements(model);
  w.held = held_nodes(model, held);
  const SmallStrainModuli first = small_strain_moduli(model.materials.front().law);
  const double lambda = first.bulk - 2 * first.shear / 3;

  // A shear wave travels sqrt(mu / rho) a frame.
  const double extent = largest_extent(model);
  const double density = first.shear * std::pow(frames_of_a_wave / extent, 2);
  std::vector<double> mass(model.positions.size(), 0.0);
  double volume = 0;
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.corners())
      mass[static_cast<size_t>(node)] += density * volume_of(model, element) / 4;
    volume += volume_of(model, element);
  }
  // Bullet's conjugate gradients stop at r . M^-1 r < 1.2e-7 min(1, b . M^-1 b), a relative tolerance only
  // for b . M^-1 b < 1. N nodes beside the tool, pushed by the node distance h, give N (mu h^2)^2 / (rho h^3)
  // = N mu h (extent / frames_of_a_wave)^2. The unit of force makes this 1.
  const double h = std::cbrt(volume / static_cast<double>(mass.size()));
  constexpr double kNodesPushed = 100;
  w.force_unit = kNodesPushed * first.shear * h * std::pow(extent / frames_of_a_wave, 2);
  for (const int node : w.held) mass[static_cast<size_t>(node)] = 0;  // zero mass holds a node in Bullet

  std::vector<btVector3> positions;
  std::vector<btScalar> masses;
  for (size_t node = 0; node < mass.size(); ++node) {
    positions.push_back(to_bullet(model.positions[node]));
    w.rest.push_back(from_bullet(positions.back()));
    masses.push_back(static_cast<btScalar>(mass[node] / w.force_unit));
  }
  w.body = std::make_unique<btSoftBody>(&w.world.getWorldInfo(), static_cast<int>(positions.size()),
                                        positions.data(), masses.data());
  for (const Tetrahedron& element : model.elements) {
    const auto corners = element.corners();
    w.body->appendTetra(corners[0], corners[1], corners[2], corners[3]);
  }
  w.body->initializeDmInverse();
  btSoftBody::TetraScratch at_rest;
  at_rest.m_F.setIdentity();
  at_rest.m_cofF.setIdentity();
  at_rest.m_corotation.setIdentity();
  at_rest.m_trace = 3;
  at_rest.m_J = 1;
  w.body->m_tetraScratches.resize(w.body->m_tetras.size(), at_rest);
  w.body->m_tetraScratchesTn.resize(w.body->m_tetras.size(), at_rest);
  // A Bullet body has a single law, linear in the moduli and in an element's measure. A stiffer material gets
  // a larger measure.
  for (size_t i = 0; i < model.elements.size(); ++i) {
    const Material& material = model.materials[static_cast<size_t>(model.elements[i].material)];
    const SmallStrainModuli moduli = small_strain_moduli(material.law);
    constexpr double kSame = 1e-6;
    if (std::abs(moduli.poisson_ratio() - first.poisson_ratio()) > kSame) {
      throw std::runtime_error(
          fmt::format("{}: material {} has another Poisson's ratio than {}; a body of Bullet's has one",
                      model.file, material.name, model.materials.front().name));
    }
    w.body->m_tetras[static_cast<int>(i)].m_element_measure *=
        static_cast<btScalar>(moduli.shear / first.shear);
  }
  w.body->m_cfg.collisions = 0;
  w.body->setActivationState(DISABLE_DEACTIVATION);
  for (int node = 0; node < w.body->m_nodes.size(); ++node) w.body->m_nodes[node].index = node;
  w.body->updateDeformation();

  w.law = std::make_unique<btDeformableNeoHookeanForce>(
      static_cast<btScalar>(4 * first.shear / 3 / w.force_unit),
      static_cast<btScalar>((lambda + 5 * first.shear / 6) / w.force_unit), btScalar(0));
  w.constraints.setDeformableSolver(&w.solver);
  w.world.getWorldInfo().m_maxDisplacement = BT_LARGE_FLOAT;
  w.world.addSoftBody(w.body.get());
  w.world.addForce(w.body.get(), w.law.get());
  w.world.setImplicit(true);
  w.world.setLineSearch(false);
  w.world.setUseProjection(true);  // of held nodes; Bullet's implicit step needs the projection
}

BulletBody::~BulletBody() = default;

void BulletBody::frame(const Eigen::VectorXd& displacement) {
  World& w = *world_;
  for (const int i : w.held) {
    btSoftBody::Node& node = w.body->m_nodes[i];
    const Eigen::Vector3d place = w.rest[static_cast<size_t>(i)] + displacement.segment<3>(3 * i);
    node.m_v = node.m_vn = (to_bullet(place) - node.m_x) / kFrame;
  }
  w.world.stepSimulation(kFrame, 0);
}

Eigen::VectorXd BulletBody::displacement() const {
  const World& w = *world_;
  Eigen::VectorXd u(3 * static_cast<Eigen::Index>(w.rest.size()));
  for (int node = 0; node < w.body->m_nodes.size(); ++node)
    u.segment<3>(3 * node) = from_bullet(w.body->m_nodes[node].m_x) - w.rest[static_cast<size_t>(node)];
  return u;
}

Eigen::VectorXd BulletBody::internal_force() const {
  const World& w = *world_;
  w.body->updateDeformation();
  std::vector<btVector3> force(w.rest.size(), btVector3(0, 0, 0));
  const int num_nodes = static_cast<int>(force.size());
  btAlignedObjectArray<btVector3> array;
  array.initializeFromBuffer(force.data(), num_nodes, num_nodes);
  w.law->addScaledElasticForce(-1, array);
  Eigen::VectorXd f(3 * num_nodes);
  for (int node = 0; node < num_nodes; ++node)
    f.segment<3>(3 * node) = w.force_unit * from_bullet(force[static_cast<size_t>(node)]);
  return f;
}

double BulletBody::imbalance() const {
  Eigen::VectorXd free = internal_force();
  double held = 0;
  for (const int node : world_->held) {
    held += free.segment<3>(3 * node).squaredNorm();
    free.segment<3>(3 * node).setZero();
  }
  return free.norm() / std::sqrt(held);
}

double BulletBody::smallest_jacobian() const {
  const World& w = *world_;
  w.body->updateDeformation();
  btScalar smallest = 1;
  for (int i = 0; i < w.body->m_tetraScratches.size(); ++i)
    smallest = std::min(smallest, w.body->m_tetraScratches[i].m_J);
  return static_cast<double>(smallest);
}

std::string BulletBody::version() {
  return fmt::format("{}.{:02}", BT_BULLET_VERSION / 100, BT_BULLET_VERSION % 100);
}

}  // namespace palpate::study
