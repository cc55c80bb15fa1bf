// Rotations and poses. Vectors are arrays of three; matrices are row-major.
#pragma once

#include <palpate/palpate.h>

#include <math.h>

#include <algorithm>

namespace palpate {

// The products skip an identity, because most organs and many tools do not rotate.
struct Rotation {
  double m[9];
  bool is_identity;
};

// read_pose() normalises a quaternion whose length is within this distance of 1, and refuses others.
inline constexpr double kQuaternionDrift = 0.01;
// The largest accepted coordinate. Its square does not overflow.
inline constexpr double kMostPosition = 1e100;

// Checks a pose and normalises its quaternion. Returns false beyond the limits above, or for a NaN.
inline bool read_pose(const pal_pose& given, pal_pose& pose) {
  double square = 0;
  for (const double component : given.orientation) square += component * component;
  constexpr double kLeast = (1.0 - kQuaternionDrift) * (1.0 - kQuaternionDrift);
  constexpr double kMost = (1.0 + kQuaternionDrift) * (1.0 + kQuaternionDrift);
  if (!(square >= kLeast && square <= kMost)) return false;
  for (const double component : given.position) {
    if (!(fabs(component) <= kMostPosition)) return false;
  }
  pose = given;
  // A normalised quaternion stays as given, so that a recorded pose replays to the same bits.
  constexpr double kRounding = 2e-15;
  if (fabs(square - 1.0) <= kRounding) return true;
  const double scale = 1.0 / sqrt(square);
  for (double& component : pose.orientation) component *= scale;
  return true;
}

// The rotation R of a unit quaternion w, x, y, z: R v = v + 2 w (q x v) + 2 q x (q x v), q = (x, y, z).
inline Rotation rotation_of(const double q[4]) {
  const double w = q[0];
  const double x = q[1];
  const double y = q[2];
  const double z = q[3];
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
           2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  //
           2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)},
          x == 0 && y == 0 && z == 0};
}

// out = R v.
inline void rotate(const Rotation& R, const double v[3], double out[3]) {
  if (R.is_identity) {
    for (int i = 0; i < 3; ++i) out[i] = v[i];
    return;
  }
  for (int i = 0; i < 3; ++i) out[i] = R.m[3 * i] * v[0] + R.m[3 * i + 1] * v[1] + R.m[3 * i + 2] * v[2];
}

// out = R^T v.
inline void rotate_back(const Rotation& R, const double v[3], double out[3]) {
  if (R.is_identity) {
    for (int i = 0; i < 3; ++i) out[i] = v[i];
    return;
  }
  for (int i = 0; i < 3; ++i) out[i] = R.m[i] * v[0] + R.m[3 + i] * v[1] + R.m[6 + i] * v[2];
}

// out = R K R^T.
inline void rotate_matrix(const Rotation& R, const double K[9], double out[9]) {
  if (R.is_identity) {
    for (int i = 0; i < 9; ++i) out[i] = K[i];
    return;
  }
  double half[9];  // (R K)^T
  for (int column = 0; column < 3; ++column) {
    const double of_column[3] = {K[column], K[3 + column], K[6 + column]};
    rotate(R, of_column, half + 3 * column);
  }
  for (int row = 0; row < 3; ++row) {
    const double of_row[3] = {half[row], half[3 + row], half[6 + row]};
    rotate(R, of_row, out + 3 * row);
  }
}

// Computes the turn from one unit quaternion to another: twice the vector part of now * conjugate(before),
// with non-negative scalar part. A small turn equals the rotation vector.
inline void turn_between(const double before[4], const double now[4], double out[3]) {
  const double w = now[0] * before[0] + now[1] * before[1] + now[2] * before[2] + now[3] * before[3];
  const double scale = w < 0 ? -2.0 : 2.0;
  for (int i = 0; i < 3; ++i) {
    const int j = 1 + (i + 1) % 3;
    const int k = 1 + (i + 2) % 3;
    out[i] =
        scale * (before[0] * now[1 + i] - now[0] * before[1 + i] - now[j] * before[k] + now[k] * before[j]);
  }
}

// The unit quaternion of a turn.
inline void quaternion_of(const double turn[3], double q[4]) {
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    q[1 + i] = 0.5 * turn[i];
    square += q[1 + i] * q[1 + i];
  }
  q[0] = sqrt(std::max(0.0, 1 - square));
}

// The turn that leads from the orientation `from` to the orientation `to`, both given as turns.
inline void find_turn_change(const double from[3], const double to[3], double out[3]) {
  double q_from[4];
  double q_to[4];
  quaternion_of(from, q_from);
  quaternion_of(to, q_to);
  turn_between(q_from, q_to, out);
}

// out = conjugate(a) * b.
inline void divide_quaternions(const double a[4], const double b[4], double out[4]) {
  out[0] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  for (int i = 0; i < 3; ++i) {
    const int j = 1 + (i + 1) % 3;
    const int k = 1 + (i + 2) % 3;
    out[1 + i] = a[0] * b[1 + i] - b[0] * a[1 + i] - a[j] * b[k] + a[k] * b[j];
  }
}

// sum += a x b.
inline void add_cross(const double a[3], const double b[3], double sum[3]) {
  sum[0] += a[1] * b[2] - a[2] * b[1];
  sum[1] += a[2] * b[0] - a[0] * b[2];
  sum[2] += a[0] * b[1] - a[1] * b[0];
}

}  // namespace palpate
