// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/joint_curvature.h"

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

// The place of (θ, θ) in a block.
constexpr int kAngle = 8;

template <typename T>
T Dot(const Vector2<T>& a, const Vector2<T>& b) {
  return a.x() * b.x() + a.y() * b.y();
}

// block += factor u vᵀ.
template <typename T>
void AddOuter(const T& factor, const RowPart<T>& u, const RowPart<T>& v, T* block) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      block[3 * i + j] += factor * u[i] * v[j];
    }
  }
}

template <typename T>
void AddDistance(const Vector2<T>& arm_a, const Vector2<T>& arm_b, const Vector2<T>& offset,
                 const T& multiplier, JointCurvature<T>* out) {
  using std::sqrt;
  const T squared = offset.squaredNorm();
  if (!(ValueOf(squared) > 0.0)) {
    return;
  }
  const T length = sqrt(squared);
  const Vector2<T> normal = offset / length;
  const Vector2<T> across = Perp(normal);
  const RowPart<T> row_a = PointRow(across, arm_a);
  const RowPart<T> row_b = Negative(PointRow(across, arm_b));
  const T factor = multiplier / length;
  AddOuter(factor, row_a, row_a, out->aa);
  AddOuter(factor, row_a, row_b, out->ab);
  AddOuter(factor, row_b, row_b, out->bb);
  out->aa[kAngle] -= multiplier * Dot(normal, arm_a);
  out->bb[kAngle] += multiplier * Dot(normal, arm_b);
}

}  // namespace

template <typename T>
void EvaluateJointCurvature(JointType type, const Pose<T>& pose_a, const Pose<T>& pose_b,
                            const T* numbers, const T* multipliers, JointCurvature<T>* out) {
  std::fill_n(out->aa, 9, T(0.0));
  std::fill_n(out->ab, 9, T(0.0));
  std::fill_n(out->bb, 9, T(0.0));
  if (type == JointType::kFixedAngle || type == JointType::kCoupling) {
    return;
  }
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  switch (type) {
    case JointType::kRevolute:
    case JointType::kWeld: {
      const Vector2<T> force(multipliers[0], multipliers[1]);
      out->aa[kAngle] = -Dot(force, arm_a);
      out->bb[kAngle] = Dot(force, arm_b);
      break;
    }
    case JointType::kDistance: {
      const Vector2<T> offset = pose_a.position + arm_a - pose_b.position - arm_b;
      AddDistance(arm_a, arm_b, offset, multipliers[0], out);
      break;
    }
    case JointType::kPrismatic: {
      const Vector2<T> across =
          Perp(Vector2<T>(pose_b.rotation * Vector2<T>(numbers[4], numbers[5])));
      const Vector2<T> turned = Perp(across);
      const Vector2<T> reach = pose_a.position + arm_a - pose_b.position;
      const T& mu = multipliers[0];
      out->aa[kAngle] = -mu * Dot(across, arm_a);
      out->bb[kAngle] = -mu * Dot(across, reach);
      for (int i = 0; i < 2; ++i) {
        out->ab[3 * i + 2] = mu * turned[i];
        out->bb[3 * i + 2] = out->bb[6 + i] = -mu * turned[i];
      }
      out->ab[kAngle] = mu * Dot(across, arm_a);
      break;
    }
    case JointType::kFixedAngle:
    case JointType::kCoupling:
    case JointType::kRope:
    case JointType::kLimitedCoupling:
      break;
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                                \
  template void EvaluateJointCurvature<T>(JointType, const Pose<T>&, const Pose<T>&, const T*, \
                                          const T*, JointCurvature<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
