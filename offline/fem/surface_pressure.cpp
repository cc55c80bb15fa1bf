#include "offline/fem/surface_pressure.hpp"

#include <Eigen/Geometry>

#include "offline/fem/face_shape.hpp"
#include "offline/mesh/element_faces.hpp"

namespace palpate {
namespace {

template <int kNodes>
using FaceNodes = Eigen::Matrix<double, 3, kNodes>;  // a column for each node

template <int kNodes>
FaceNodes<kNodes> current_positions(const Model& model, const std::array<int, 6>& nodes,
                                    const Eigen::VectorXd& displacement) {
  FaceNodes<kNodes> x;
  for (int a = 0; a < kNodes; ++a) {
    const int node = nodes[static_cast<size_t>(a)];
    x.col(a) = model.positions[static_cast<size_t>(node)] + displacement.segment<3>(3 * node);
  }
  return x;
}

// Calls visit(face nodes, pressure); the template argument is the number of nodes of the face.
template <typename Visitor>
void for_each_face(const Model& model, const FacePressures& pressures, Visitor&& visit) {
  for (const auto& [face, pressure] : pressures) {
    const Tetrahedron& element = model.elements[static_cast<size_t>(face.element)];
    const std::array<int, 6> nodes = outward_face(element, face.face);
    if (element.num_nodes == 4) {
      visit.template operator()<3>(nodes, pressure);
    } else {
      visit.template operator()<6>(nodes, pressure);
    }
  }
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;  // matrix d = v x d
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

// Returns df/dx of one face: a row and a column of 3 x 3 blocks for each node.
template <int kNodes>
Eigen::Matrix<double, 3 * kNodes, 3 * kNodes> face_tangent(const FaceNodes<kNodes>& x, double pressure) {
  Eigen::Matrix<double, 3 * kNodes, 3 * kNodes> tangent;
  tangent.setZero();
  for (int point = 0; point < FaceShape<kNodes>::kPoints; ++point) {
    const FaceShape<kNodes> shape(point);
    const Eigen::Matrix3d g_xi = cross_matrix(x * shape.d_xi);
    const Eigen::Matrix3d g_eta = cross_matrix(x * shape.d_eta);
    for (int b = 0; b < kNodes; ++b) {
      const Eigen::Matrix3d normal_change =
          -pressure * FaceShape<kNodes>::kWeight * (shape.d_eta[b] * g_xi - shape.d_xi[b] * g_eta);
      for (int a = 0; a < kNodes; ++a)
        tangent.template block<3, 3>(3 * a, 3 * b) += shape.values[a] * normal_change;
    }
  }
  return tangent;
}

}  // namespace

void add_pressure_force(const Model& model, const FacePressures& pressures,
                        const Eigen::VectorXd& displacement, Eigen::VectorXd& force) {
  for_each_face(model, pressures, [&]<int kNodes>(const std::array<int, 6>& nodes, double pressure) {
    const FaceNodes<kNodes> x = current_positions<kNodes>(model, nodes, displacement);
    for (int point = 0; point < FaceShape<kNodes>::kPoints; ++point) {
      const FaceShape<kNodes> shape(point);
      const Eigen::Vector3d g_xi = x * shape.d_xi;
      const Eigen::Vector3d g_eta = x * shape.d_eta;
      const Eigen::Vector3d push = -pressure * FaceShape<kNodes>::kWeight * g_xi.cross(g_eta);
      for (int a = 0; a < kNodes; ++a)
        force.segment<3>(3 * nodes[static_cast<size_t>(a)]) += shape.values[a] * push;
    }
  });
}

void subtract_pressure_tangent(const Assembly& assembly, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, Assembly::SparseLower& stiffness) {
  const Model& model = assembly.model();
  for_each_face(model, pressures, [&]<int kNodes>(const std::array<int, 6>& nodes, double pressure) {
    const auto tangent =
        face_tangent<kNodes>(current_positions<kNodes>(model, nodes, displacement), pressure);
    const auto equation = [&](int local) {
      const int node = nodes[static_cast<size_t>(local / 3)];
      return assembly.dof_equations()[static_cast<size_t>(3 * node + local % 3)];
    };
    for (int j = 0; j < 3 * kNodes; ++j) {
      for (int i = 0; i < 3 * kNodes; ++i) {
        const int row = equation(i);
        const int column = equation(j);
        if (column >= 0 && row >= column)
          stiffness.coeffRef(row, column) -= 0.5 * (tangent(i, j) + tangent(j, i));
      }
    }
  });
}

void subtract_pressure_product(const Model& model, const FacePressures& pressures,
                               const Eigen::VectorXd& displacement, const Eigen::VectorXd& vector,
                               Eigen::VectorXd& product) {
  for_each_face(model, pressures, [&]<int kNodes>(const std::array<int, 6>& nodes, double pressure) {
    const auto tangent =
        face_tangent<kNodes>(current_positions<kNodes>(model, nodes, displacement), pressure);
    Eigen::Matrix<double, 3 * kNodes, 1> local;
    for (int a = 0; a < kNodes; ++a)
      local.template segment<3>(3 * a) = vector.segment<3>(3 * nodes[static_cast<size_t>(a)]);
    const Eigen::Matrix<double, 3 * kNodes, 1> change = tangent * local;
    for (int a = 0; a < kNodes; ++a)
      product.segment<3>(3 * nodes[static_cast<size_t>(a)]) -= change.template segment<3>(3 * a);
  });
}

double pressure_work(const Model& model, const FacePressures& pressures, const Eigen::VectorXd& displacement,
                     const Eigen::VectorXd& step) {
  double work = 0;
  for_each_face(model, pressures, [&]<int kNodes>(const std::array<int, 6>& nodes, double pressure) {
    FaceNodes<kNodes> motion;
    for (int a = 0; a < kNodes; ++a) motion.col(a) = step.segment<3>(3 * nodes[static_cast<size_t>(a)]);
    const FaceNodes<kNodes> start = current_positions<kNodes>(model, nodes, displacement);
    for (int point = 0; point < FaceShape<kNodes>::kPoints; ++point) {
      const FaceShape<kNodes> shape(point);
      const Eigen::Vector3d moved = motion * shape.values;
      const auto power = [&](double s) {
        const FaceNodes<kNodes> x = start + s * motion;
        const Eigen::Vector3d g_xi = x * shape.d_xi;
        const Eigen::Vector3d g_eta = x * shape.d_eta;
        return -pressure * FaceShape<kNodes>::kWeight * g_xi.cross(g_eta).dot(moved);
      };
      work += (power(0.0) + 4.0 * power(0.5) + power(1.0)) / 6.0;
    }
  });
  return work;
}

}  // namespace palpate
