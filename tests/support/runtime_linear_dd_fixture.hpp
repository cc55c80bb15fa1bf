// Compares the runtime's linear_dd with a dense reference.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstring>
#include <numeric>
#include <random>

#include "tests/support/dense_reference.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test::runtime_linear_dd_fixture {

// Rounding of two float64 factorisations of matrices with condition numbers of a few thousand.
inline constexpr double kForceTolerance = 1e-10;

// Rounding of sums of up to about 50 products, relative to the largest displacement.
inline constexpr double kFieldTolerance = field_tolerance(1e-5);

using Contacts = std::vector<std::pair<size_t, Eigen::Vector3d>>;
inline std::vector<pal_contact> as_runtime(const Contacts& contacts) {
  std::vector<pal_contact> list;
  for (const auto& [site, d] : contacts)
    list.push_back({static_cast<uint32_t>(site), {d[0], d[1], d[2]}, 0, {}, {}, {}});
  return list;
}

inline Eigen::Vector3d force_of(const pal_contact_result& result) {
  return Eigen::Vector3d(result.force);
}

class RuntimeLinearDd : public ::testing::Test {
 protected:
  RuntimeLinearDd() : pack_(small_pack_bytes()), session_(pack_.get(), PAL_MODEL_LINEAR, 4, 8) {}

  // A random displacement within the scene's largest.
  Eigen::Vector3d any_displacement() {
    std::uniform_real_distribution<double> component(-kMaxDisplacement, kMaxDisplacement);
    Eigen::Vector3d d;
    for (double& value : d) value = component(random_);
    return d * 0.5;
  }

  uint32_t contact_node_at(int label) const {
    uint32_t node = 0;
    require(pal_pack_find_contact_node(pack_.get(), label, &node), "contact node");
    return node;
  }

  // Compares forces and field with the dense solve. `fixed_labels` are node labels of the model.
  void expect_exact(const Contacts& contacts, const std::vector<int>& fixed_labels) {
    std::vector<uint32_t> fixed;
    std::vector<int> fixed_nodes;
    for (const int label : fixed_labels) {
      fixed.push_back(contact_node_at(label));
      fixed_nodes.push_back(small_.model.find_node(label));
    }
    session_.fix(fixed);
    const auto results = session_.touch(as_runtime(contacts));
    const DenseReference::Answer truth = dense_.solve(dense_.hold(contacts, fixed_nodes));
    double largest_force = 0;
    for (size_t c = 0; c < contacts.size(); ++c)
      largest_force = std::max(largest_force, dense_.tool_force(contacts, c, fixed_nodes, truth).norm());
    ASSERT_GT(largest_force, 0);
    for (size_t c = 0; c < contacts.size(); ++c) {
      const Eigen::Vector3d expected = dense_.tool_force(contacts, c, fixed_nodes, truth);
      EXPECT_LE((force_of(results[c]) - expected).norm(), kForceTolerance * largest_force) << "contact " << c;
    }
    const Eigen::VectorXd expected = dense_.packed(truth.field);
    EXPECT_LE((as_vector(session_.field()) - expected).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * expected.lpNorm<Eigen::Infinity>());
  }

  const SmallPack& small_ = small_pack();
  Assembly assembly_{small_.model, small_.model.fixed_dofs()};
  DenseReference dense_{assembly_, small_.sites};
  OpenPack pack_;
  OwnedSession session_;
  std::mt19937_64 random_{7};
};

}  // namespace palpate::test::runtime_linear_dd_fixture
