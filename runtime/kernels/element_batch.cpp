#include "runtime/kernels/element_batch.hpp"

namespace palpate {
namespace {

#define PALPATE_INLINE [[gnu::always_inline]] inline

// y = M x.
PALPATE_INLINE void multiply(const std::array<std::array<Lanes, 3>, 3>& M, const std::array<Lanes, 3>& x,
                             std::array<Lanes, 3>& y) {
  for (size_t i = 0; i < 3; ++i) y[i] = M[i][0] * x[0] + M[i][1] * x[1] + M[i][2] * x[2];
}

// F = 1 + sum_a u_a g_a^T, H = F^-T, I1 = F : F, J = det F.
template <int kNodes>
PALPATE_INLINE void deform(const typename ElementBatch<kNodes>::Point& point,
                           const NodalLanes<kNodes>& displacement, KinematicsLanes& kinematics) {
  auto& F = kinematics.F;
  auto& H = kinematics.H;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t J = 0; J < 3; ++J) {
      Lanes sum = displacement[0][i] * point.gradients[0][J];
      for (size_t a = 1; a < kNodes; ++a) sum += displacement[a][i] * point.gradients[a][J];
      F[i][J] = i == J ? 1.0 + sum : sum;
    }
  }
  // H = cof F / det F.
  for (size_t i = 0; i < 3; ++i) {
    const auto& next = F[(i + 1) % 3];
    const auto& last = F[(i + 2) % 3];
    for (size_t J = 0; J < 3; ++J) {
      const size_t K = (J + 1) % 3;
      const size_t L = (J + 2) % 3;
      H[i][J] = next[K] * last[L] - next[L] * last[K];
    }
  }
  kinematics.J = F[0][0] * H[0][0] + F[0][1] * H[0][1] + F[0][2] * H[0][2];
  const Lanes inverse = 1.0 / kinematics.J;
  kinematics.I1 = F[0][0] * F[0][0];
  for (size_t n = 1; n < 9; ++n) kinematics.I1 += F[n / 3][n % 3] * F[n / 3][n % 3];
  for (size_t n = 0; n < 9; ++n) H[n / 3][n % 3] *= inverse;
}

// Adds V P g_a, P = identity F - transposed H.
template <int kNodes>
PALPATE_INLINE void add_force(const typename ElementBatch<kNodes>::Point& point,
                              const KinematicsLanes& kinematics, const DyadicLanes& terms,
                              NodalLanes<kNodes>& force) {
  const Lanes with_F = point.volume * terms.identity;
  const Lanes with_H = point.volume * terms.transposed;
  for (size_t i = 0; i < 3; ++i) {
    std::array<Lanes, 3> stress;
    for (size_t J = 0; J < 3; ++J) stress[J] = with_F * kinematics.F[i][J] - with_H * kinematics.H[i][J];
    for (size_t a = 0; a < kNodes; ++a) {
      const auto& g = point.gradients[a];
      force[a][i] += stress[0] * g[0] + stress[1] * g[1] + stress[2] * g[2];
    }
  }
}

// Adds K_ab of element_batch.hpp for a >= b.
template <int kNodes>
PALPATE_INLINE void add_stiffness(const typename ElementBatch<kNodes>::Point& point,
                                  const KinematicsLanes& kinematics, const DyadicLanes& terms,
                                  StiffnessLanes<kNodes>& stiffness) {
  NodalLanes<kNodes> f;
  NodalLanes<kNodes> h;
  for (size_t a = 0; a < kNodes; ++a) {
    multiply(kinematics.F, point.gradients[a], f[a]);
    multiply(kinematics.H, point.gradients[a], h[a]);
  }
  for (size_t b = 0; b < kNodes; ++b) {
    std::array<Lanes, 3> identity;
    std::array<Lanes, 3> transposed;
    std::array<Lanes, 3> with_h;
    std::array<Lanes, 3> with_f;
    for (size_t k = 0; k < 3; ++k) {
      identity[k] = point.volume * terms.identity * point.gradients[b][k];
      transposed[k] = point.volume * terms.transposed * h[b][k];
      with_h[k] = point.volume * (terms.hh * h[b][k] + terms.fh * f[b][k]);
      with_f[k] = point.volume * (terms.fh * h[b][k] + terms.ff * f[b][k]);
    }
    for (size_t a = b; a < kNodes; ++a) {
      const auto& g = point.gradients[a];
      const Lanes diagonal = identity[0] * g[0] + identity[1] * g[1] + identity[2] * g[2];
      for (size_t k = 0; k < 3; ++k) {
        // Column 3 b + k begins with its diagonal entry.
        const size_t column = 3 * b + k;
        const size_t begin = column * 3 * kNodes - column * (column - 1) / 2 - column;
        for (size_t i = a == b ? k : 0; i < 3; ++i) {
          Lanes& entry = stiffness[begin + 3 * a + i];
          entry += transposed[i] * h[a][k] + h[a][i] * with_h[k] + f[a][i] * with_f[k];
          if (i == k) entry += diagonal;
        }
      }
    }
  }
}

// The macro compiles the same source for the baseline instruction set and for 256-bit vectors.
#define PALPATE_KERNELS(name, ...)                                                                      \
  template <int kNodes>                                                                                 \
  struct name {                                                                                         \
    using Point = typename ElementBatch<kNodes>::Point;                                                 \
    __VA_ARGS__ static void deform_here(const Point& point, const NodalLanes<kNodes>& displacement,     \
                                        KinematicsLanes& kinematics) {                                  \
      deform<kNodes>(point, displacement, kinematics);                                                  \
    }                                                                                                   \
    __VA_ARGS__ static void add_force_here(const Point& point, const KinematicsLanes& kinematics,       \
                                           const DyadicLanes& terms, NodalLanes<kNodes>& force) {       \
      add_force<kNodes>(point, kinematics, terms, force);                                               \
    }                                                                                                   \
    __VA_ARGS__ static void add_stiffness_here(const Point& point, const KinematicsLanes& kinematics,   \
                                               const DyadicLanes& terms,                                \
                                               StiffnessLanes<kNodes>& stiffness) {                     \
      add_stiffness<kNodes>(point, kinematics, terms, stiffness);                                       \
    }                                                                                                   \
    static constexpr BatchKernels<kNodes> kKernels = {deform_here, add_force_here, add_stiffness_here}; \
  };
#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
PALPATE_KERNELS(Avx2, __attribute__((target("avx2"))))
PALPATE_KERNELS(Portable,
                __attribute__((cold)))  // few processors need the baseline code, so it is optimised for size
#else
PALPATE_KERNELS(Portable)
#endif

}  // namespace

template <int kNodes>
const BatchKernels<kNodes>& portable_batch_kernels() {
  return Portable<kNodes>::kKernels;
}

template <int kNodes>
const BatchKernels<kNodes>& batch_kernels() {
#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
  if (__builtin_cpu_supports("avx2")) return Avx2<kNodes>::kKernels;
#endif
  return portable_batch_kernels<kNodes>();
}

template const BatchKernels<4>& batch_kernels<4>();
template const BatchKernels<10>& batch_kernels<10>();
template const BatchKernels<4>& portable_batch_kernels<4>();
template const BatchKernels<10>& portable_batch_kernels<10>();

}  // namespace palpate
