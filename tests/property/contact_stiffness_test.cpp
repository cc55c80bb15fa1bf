// The contact stiffness M, the inverse of the held block of the compliance A, updated as nodes join and
// leave.
#include "runtime/src/linear/contact_stiffness.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>

#include "offline/precompute/linear_dd.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {
namespace contact_stiffness_test {

// All instruction sets of this processor agree with the plain loops. Kernels with fused multiply-add agree
// with one another to the bit.
TEST(InverseKernel, AllAgreeWithScalarWithinRounding) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> value(-1, 1);
  constexpr uint32_t kMostNodes = 11;
  constexpr size_t kStride = 40;
  const auto fill = [&](AlignedBytes& bytes) {
    auto* numbers = reinterpret_cast<double*>(bytes.bytes().data());
    for (size_t i = 0; i < bytes.bytes().size() / sizeof(double); ++i) numbers[i] = value(random);
    return numbers;
  };
  InverseKernel kernels[kMostInverseKernels];
  const uint32_t num_kernels = list_inverse_kernels(kernels);
  ASSERT_STREQ(kernels[0].name, "scalar");
  EXPECT_EQ(choose_inverse_kernel().multiply, kernels[num_kernels - 1].multiply);
  using Rows = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
  for (uint32_t num_nodes = 0; num_nodes <= kMostNodes; ++num_nodes) {
    const Eigen::Index n = 3 * static_cast<Eigen::Index>(num_nodes);
    AlignedBytes matrix_bytes(3 * kMostNodes * kStride * sizeof(double));
    AlignedBytes p_bytes(3 * kStride * sizeof(double));
    AlignedBytes q_bytes(3 * kStride * sizeof(double));
    Rows matrix(fill(matrix_bytes), 3 * kMostNodes, kStride);
    Rows p(fill(p_bytes), 3, kStride);
    Rows q(fill(q_bytes), 3, kStride);
    const auto square = matrix.topLeftCorner(n, n);
    const Eigen::MatrixXd symmetric = square + square.transpose();
    matrix.topLeftCorner(n, n) = symmetric;
    const Eigen::MatrixXd product = p.leftCols(n) * symmetric;
    const Eigen::MatrixXd sum = symmetric + p.leftCols(n).transpose() * q.leftCols(n);
    std::vector<Eigen::MatrixXd> fused;
    for (uint32_t k = 0; k < num_kernels; ++k) {
      SCOPED_TRACE(kernels[k].name);
      matrix.topLeftCorner(n, n) = symmetric;
      AlignedBytes y_bytes(3 * kStride * sizeof(double));
      const Rows y(fill(y_bytes), 3, kStride);
      kernels[k].multiply(matrix.data(), kStride, num_nodes, p.data(),
                          reinterpret_cast<double*>(y_bytes.bytes().data()));
      kernels[k].add_products(matrix.data(), kStride, num_nodes, p.data(), q.data());
      const double rounding = 3e-16 * 3 * (num_nodes + 1);
      EXPECT_LE((y.leftCols(n) - product).cwiseAbs().sum(), rounding * static_cast<double>(9 * n + 1));
      EXPECT_LE((matrix.topLeftCorner(n, n) - sum).cwiseAbs().sum(),
                rounding * static_cast<double>(n * n + 1));
      if (k == 1) fused = {y.leftCols(n), matrix.topLeftCorner(n, n)};
      if (k > 1) {
        EXPECT_EQ(y.leftCols(n), fused[0]);
        EXPECT_EQ(matrix.topLeftCorner(n, n), fused[1]);
      }
    }
  }
}

// Sites close together whose patches have one node each.
class ContactStiffnessTest : public ::testing::Test {
 protected:
  static constexpr double kAlone = 1e-6;  // a tip radius without neighbours

  static const AlignedBytes& pack_bytes() {
    static const AlignedBytes bytes = [] {
      const TouchedBlock block = touched_block(6, kAlone);
      const Assembly assembly(block.model, block.model.fixed_dofs());
      const LinearDd linear = compute_linear_dd(assembly, block.sites);
      return write_pack({block.model, block.scene, block.sites, &linear, nullptr, 0, {}, {}});
    }();
    return bytes;
  }

  uint32_t any(uint32_t below) { return std::uniform_int_distribution<uint32_t>(0, below - 1)(random_); }

  std::mt19937_64 random_{11};
  OpenPack pack_{pack_bytes()};
};

// |M A - 1| after any sequence of updates.
class KeptInverse {
 public:
  explicit KeptInverse(const OpenPack& pack, uint32_t max_nodes, const InverseKernel& kernel)
      : pack_(*pack.get()) {
    Arena counting(nullptr);
    carve_inverse(pack_, max_nodes, counting, inverse_);
    memory_ = AlignedBytes(counting.used());
    Arena arena(memory_.bytes().data());
    inverse_ = {};
    carve_inverse(pack_, max_nodes, arena, inverse_);
    inverse_.kernel = kernel;
  }
  ContactStiffness* operator->() { return &inverse_; }
  void add(uint32_t node) { add_node(pack_, node, inverse_); }
  bool remove(uint32_t slot) { return remove_node(slot, inverse_); }
  bool correct() { return correct_inverse(pack_, inverse_); }
  double error() const {
    const Eigen::Index n = 3 * static_cast<Eigen::Index>(inverse_.num_nodes);
    Eigen::MatrixXd compliance(n, n);
    Eigen::MatrixXd kept(n, n);
    for (uint32_t i = 0; i < inverse_.num_nodes; ++i) {
      for (uint32_t j = 0; j < inverse_.num_nodes; ++j) {
        Eigen::Matrix<double, 3, 3, Eigen::RowMajor> block;
        contact_compliance(pack_, inverse_.nodes[i], inverse_.nodes[j], block.data());
        compliance.block<3, 3>(3 * i, 3 * j) = block;
      }
      for (uint32_t axis = 0; axis < 3; ++axis)
        kept.row(3 * i + axis) = Eigen::Map<const Eigen::RowVectorXd>(inverse_row(inverse_, i, axis), n);
    }
    EXPECT_EQ(kept, kept.transpose());
    return n == 0 ? 0 : (kept * compliance - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff();
  }

 private:
  const pal_pack& pack_;
  AlignedBytes memory_{0};
  ContactStiffness inverse_ = {};
};

TEST_F(ContactStiffnessTest, IsTheInverseWhateverComesAndGoes) {
  InverseKernel kernels[kMostInverseKernels];
  const uint32_t num_kernels = list_inverse_kernels(kernels);
  constexpr double kRounding = 1e-12;
  for (uint32_t k = 0; k < num_kernels; ++k) {
    SCOPED_TRACE(kernels[k].name);
    KeptInverse inverse(pack_, pack_.info().num_contact_nodes, kernels[k]);
    for (uint32_t node = 0; node < pack_.info().num_contact_nodes; ++node) {
      inverse.add(node);
      EXPECT_LE(inverse.error(), kRounding);
    }
    for (; inverse->num_nodes > 0;) {
      ASSERT_TRUE(inverse.remove(any(inverse->num_nodes)));
      EXPECT_LE(inverse.error(), kRounding);
    }
    EXPECT_EQ(inverse->num_regularised, 0U);
  }
}

// A slightly damaged M is repaired node by node; a badly damaged M sets a flag.
TEST_F(ContactStiffnessTest, SetsItselfRight) {
  KeptInverse inverse(pack_, 8, choose_inverse_kernel());
  for (uint32_t node = 0; node < 8; ++node) inverse.add(3 * node);
  for (Eigen::Index i = 0; i < 24; ++i) {
    for (Eigen::Index j = 0; j < 24; ++j)
      inverse->matrix[i * static_cast<Eigen::Index>(inverse->stride) + j] *=
          1 + 1e-9 * std::cos(static_cast<double>(i * j));
  }
  const double broken = inverse.error();
  EXPECT_GT(broken, 1e-9);
  for (uint32_t node = 0; node < 8; ++node) {
    inverse->changes = 100;
    ASSERT_TRUE(inverse.correct());
  }
  EXPECT_LE(inverse.error(), 1e-4 * broken);
  inverse->matrix[5] *= 1.01;
  bool right = true;
  for (uint32_t node = 0; node < 8; ++node) {
    inverse->changes = 100;
    right = right && inverse.correct();
  }
  EXPECT_FALSE(right);
  inverse->matrix[0] = std::nan("");
  inverse->changes = 100;
  EXPECT_FALSE(inverse.correct());
  EXPECT_FALSE(inverse.remove(0));
  EXPECT_EQ(inverse->num_nodes, 0U);
}

// Two numbers for the same node.
TEST_F(ContactStiffnessTest, ANodeThatMovesAsAnotherGetsASpring) {
  AlignedBytes bytes(pack_bytes().bytes().size());
  std::copy(pack_bytes().bytes().begin(), pack_bytes().bytes().end(), bytes.bytes().begin());
  const pack::Pack& tables = *pack::GetPack(bytes.bytes().data() + sizeof(pack::PackHeader));
  auto* blocks =
      reinterpret_cast<double*>(bytes.bytes().data() + tables.linear_dd()->contact_compliance()->offset());
  std::copy_n(blocks + 9 * pack::lower_block(3, 0), 27, blocks + 9 * pack::lower_block(4, 0));
  for (const uint64_t j : {uint64_t{3}, uint64_t{4}})
    std::copy_n(blocks + 9 * pack::lower_block(3, 3), 9, blocks + 9 * pack::lower_block(4, j));
  const OpenPack pack(bytes, PAL_VERIFY_NEVER);
  KeptInverse inverse(pack, 5, choose_inverse_kernel());
  for (uint32_t node = 0; node < 5; ++node) inverse.add(node);
  EXPECT_EQ(inverse->num_regularised, 1U);
  EXPECT_TRUE(inverse->regularised[4]);
  for (size_t i = 0; i < 15 * inverse->stride; ++i) ASSERT_TRUE(std::isfinite(inverse->matrix[i]));
}

// A million contacts and fixed nodes join, leave and move: the result stays within 1e-9 of a fresh session.
TEST_F(ContactStiffnessTest, AMillionChangesLeaveNoTrace) {
  constexpr int kChanges = kSanitized ? 30'000 : 1'000'000;
  constexpr int kBetweenChecks = 1'000;
  constexpr uint32_t kMost = 12;
  constexpr double kTolerance = 1e-9;
  OwnedSession session(pack_.get(), PAL_MODEL_LINEAR, kMost, kMost);
  std::vector<pal_contact> contacts;
  std::vector<uint32_t> fixed;
  std::uniform_real_distribution<double> component(-0.1, 0.1);
  const auto is_free = [&](uint32_t site) {
    return std::none_of(contacts.begin(), contacts.end(),
                        [&](const pal_contact& contact) { return contact.site == site; });
  };
  const auto free_site = [&] {
    uint32_t site = any(pack_.info().num_sites);
    while (!is_free(site)) site = any(pack_.info().num_sites);
    return site;
  };
  const auto place = [&](const auto& list) {
    return static_cast<std::ptrdiff_t>(any(static_cast<uint32_t>(list.size())));
  };
  std::vector<pal_contact_result> results(kMost);
  double worst = 0;
  for (int change = 1; change <= kChanges; ++change) {
    const uint32_t kind = any(8);
    if (kind < 3 && contacts.size() < kMost) {
      contacts.push_back(
          {free_site(), {component(random_), component(random_), component(random_)}, 0, {}, {}, {}});
    } else if (kind < 5 && !contacts.empty()) {
      contacts.erase(contacts.begin() + place(contacts));
    } else if (kind < 7 && !contacts.empty()) {
      contacts[static_cast<size_t>(place(contacts))].site = free_site();
    } else {
      if (fixed.size() < 4 && any(2) == 0) {
        fixed.push_back(any(pack_.info().num_contact_nodes));
      } else if (!fixed.empty()) {
        fixed.erase(fixed.begin() + place(fixed));
      }
      session.fix(fixed);
    }
    require(pal_contact_frame(session.get(), contacts.data(), static_cast<uint32_t>(contacts.size()),
                              results.data()),
            "contact_frame");
    if (change % kBetweenChecks != 0 || contacts.empty()) continue;
    OwnedSession fresh(pack_.get(), PAL_MODEL_LINEAR, kMost, kMost);
    fresh.fix(fixed);
    const std::vector<pal_contact_result> expected = fresh.touch(contacts);
    double largest = 0;
    double difference = 0;
    for (size_t c = 0; c < contacts.size(); ++c) {
      const Eigen::Vector3d force(expected[c].force);
      largest = std::max(largest, force.norm());
      difference = std::max(difference, (Eigen::Vector3d(results[c].force) - force).norm());
      EXPECT_EQ(results[c].flags, expected[c].flags);
    }
    if (largest > 0) worst = std::max(worst, difference / largest);
  }
  EXPECT_LE(worst, kTolerance);
  EXPECT_GT(worst, 0) << "then nothing was kept";
}

}  // namespace contact_stiffness_test
}  // namespace palpate::test
