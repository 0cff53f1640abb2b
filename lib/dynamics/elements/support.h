// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Supports: Coulomb friction of a body on the plane of motion, as of a table seen from above.
//
// Each point i of the body, at the arm r_i from its centre of mass, carries a load N_i and has the
// velocity v_i = (vx − ω r_iy, vy + ω r_ix):
//
//   |f_i| ≤ μ N_i,   v_i ≠ 0 ⇒ f_i = −μ N_i v_i / |v_i|
//
// A disc of radius R that presses evenly has the same at every point; with v the velocity of its
// centre, q = max(v², ω² R²), m = min(v², ω² R²) / q, and the complete elliptic integrals
// K, E, D = (K − E) / m, B = K − D and C = (D − B) / m of the parameter m, its integrals are
//
//   force  = −μ N 4 (E + B) / (3 π) v / √q
//   torque = −μ N R² 4 ψ / (9 π) ω / √q     ψ = (4 − 2 m) E − (1 − m) K   where |v| ≤ |ω| R
//                                           ψ = C − D + 3 B               elsewhere
//
// (Z. Farkas, G. Bartels, T. Unger, D. E. Wolf, Phys. Rev. Lett. 90 (2003) 248302, eq. 3 and 4, in
// integrals without a difference of nearly equal numbers.) They are evaluated to rounding by the
// arithmetic-geometric mean; their error is below 1e-14 of μ N and μ N R.
//
// Friction is the derivative of the convex dissipation Ψ(v, ω) = Σ μ N_i |v_i|, so that for given
// loads the twist after a step is unique. A step linearises it about a twist û (SupportState),
// where its derivative H = Ψ'' is symmetric and positive semi-definite:
//
//   f_i ≈ −μ N_i (d + (d⊥ · v_i) d⊥ / |v̂_i|),   d = v̂_i / |v̂_i|
//
// a force and a damper across it. At the solution v_i = v̂_i, so that the damper gives nothing but
// the derivative. A point that does not slide is held by two rows, a body at rest by three.
//
// Between events a velocity tells the direction of its friction, but where it is small friction
// turns it into that of what pushes it at the rate μ N / (m |v|), without bound as it vanishes. A
// body that starts has the friction of its acceleration a; one that creeps, pushed by little less
// than its friction, that of v + τ a, its velocity a time τ later: motions of that length are
// stable, and what τ neglects is v / (μ N / m) of the turn of what pushes.

#include <cmath>
#include <vector>

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// Friction of a disc of a radius (m) that presses evenly, for μ N = 1: force (2) and torque (m) at
/// a twist; 0 at rest.
template <typename T>
void DiscFriction(const T& radius, const T twist[3], T friction[3]);

/// Of a disc with μ N = 1 at a twist that is not 0: Ψ'' as Σ weight rowᵀ row over three rows.
void DiscDampers(double radius, const double twist[3], double rows[3][3], double weights[3]);

/// Friction of a disc with μ N = 1 as dampers, the quotients of −friction and twist (−f / v, N s/m,
/// and −torque / ω, N m s), whose parts count at least as `secant`, m/s, of the rim.
void DiscSecant(double radius, const double twist[3], double secant, double dampers[3]);

/// The largest torque of a support about the centre of mass, over μ N, m.
template <typename T>
double SupportArm(const Model<T>& model, const SupportIndex& support) {
  const T* x = &model.parameters[support.numbers];
  if (support.kind == SupportIndex::kDisc) return 2.0 / 3.0 * ValueOf(x[SupportIndex::kRadius]);
  double arm = 0.0;
  for (int i = 0; support.kind == SupportIndex::kPoints && i < support.num_points; ++i) {
    const T* point = &model.parameters[support.Point(i)];
    arm += ValueOf(point[2]) * std::hypot(ValueOf(point[0]), ValueOf(point[1]));
  }
  return arm;
}

/// The velocity of a point at an arm from the centre of mass, at a twist.
template <typename T, typename U>
Vector2<T> VelocityAtArm(const Vector2<T>& arm, const U twist[3]) {
  return Vector2<T>(twist[0] - twist[2] * arm.y(), twist[1] + twist[2] * arm.x());
}

/// The speed of the same; 0 at rest, without derivatives.
template <typename T, typename U>
T SpeedAtArm(const Vector2<T>& arm, const U twist[3]) {
  using std::sqrt;
  const T square = VelocityAtArm(arm, twist).squaredNorm();
  return ValueOf(square) > 0.0 ? T(sqrt(square)) : T(0.0);
}

/// A point on which a body stands: its arm from the centre of mass, in the world's directions, m,
/// and μ N_i, N, or μ N_i h, N s.
struct SupportPoint {
  double arm[2];
  double limit;

  /// The velocity of the point at a twist.
  void VelocityAt(const double twist[3], double velocity[2]) const {
    velocity[0] = twist[0] - twist[2] * arm[1];
    velocity[1] = twist[1] + twist[2] * arm[0];
  }
};

/// Whether a support keeps its body's centre of mass where it is: it holds all of the body, or its
/// friction acts there.
inline bool HoldsCentre(const SupportIndex& support, const SupportState& at) {
  return at.holds == SupportState::kBody ||
         (support.kind == SupportIndex::kCentre && at.holds != SupportState::kNothing);
}

/// The dissipation of a body's support at a pose, in doubles.
class SupportFriction {
 public:
  /// `weight` is a factor of all limits, such as the length of a step. The pose is that of
  /// `state`.
  void Set(const Model<double>& model, const State<double>& state, const SupportIndex& support,
           double weight);
  /// Leaves out all but one point.
  void KeepPoint(int point);

  const std::vector<SupportPoint>& points() const { return points_; }
  bool is_disc() const { return radius_ > 0.0; }
  double limit() const { return limit_; }  ///< the sum of all limits
  /// The length that turns a torque into a force and an angular velocity into a speed, m.
  double arm() const { return arm_; }

  /// The force and torque −Ψ' at a twist; a point at rest contributes nothing.
  void At(const double twist[3], double wrench[3]) const;
  /// Ψ'' there, 3 x 3 by rows.
  void Curvature(const double twist[3], double curvature[9]) const;
  /// Whether the support can balance a wrench: the body stays at rest. To some 1e-10 of the wrench.
  bool CanHold(const double wrench[3]) const;
  /// How much larger a wrench that it can balance may be, as a share of the larger one: 0 at the
  /// limit, near 1 for one that is next to nothing. To a factor of 2.
  double Reserve(const double wrench[3]) const;
  /// The motion u of a body that nothing but its support acts on, with momentum p:
  ///   min ½ uᵀ M u − pᵀ u + Ψ(u)
  /// and what is held in it. `mass` is the diagonal of M.
  SupportState SolveAlone(const double mass[3], const double momentum[3]) const;

 private:
  SupportState SolveCentre(const double mass[3], const double momentum[3]) const;
  SupportState SolveDisc(const double mass[3], const double momentum[3]) const;
  SupportState SolvePoints(const double mass[3], const double momentum[3]) const;
  bool HoldsByShares(const double momentum[3]) const;
  bool Slides(const double mass[3], const double momentum[3], double scale, double twist[3]) const;
  void Smoothed(const double twist[3], double epsilon, double* value, double gradient[3],
                double curvature[9]) const;

  SupportIndex::Kind kind_ = SupportIndex::kCentre;
  std::vector<SupportPoint> points_;
  double radius_ = 0.0;
  double limit_ = 0.0;
  double arm_ = 0.0;
};

}  // namespace tangible
