// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The scene: the content of the user's file, as plain data without any dynamics.
//
// Every number of a scene outside `simulation` is a possible parameter, so the structs are
// templated on the number type: BasicScene<double> is what is read from a file, BasicScene<Jet<N>>
// the same scene whose numbers carry derivatives with respect to parameters. SI units; x right, y
// up; angles counter-clockwise in radians.

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tangible/math/scalar.h"
#include "tangible/math/shape_type.h"
#include "tangible/scene/recorded_path.h"

namespace tangible {

enum class SolidSide { kLeft, kRight };

/// A shape in the body frame; `numbers` holds, by type:
///   kCircle    radius
///   kBox       width, height
///   kEllipse   semi-axes along body x and y
///   kCapsule   length between the cap centres (along body x), radius
///   kPolygon   x0, y0, x1, y1, ...: counter-clockwise, convex or not
///   kPolyline  x0, y0, x1, y1, ...: as in the file
///   kSpline    the same: the points that the curve goes through
///   kHalfPlane normal x, normal y, offset: solid where normal·r ≤ offset; not necessarily unit
template <typename T>
struct BasicShape {
  ShapeType type = ShapeType::kNone;
  std::vector<T> numbers;
  bool closed = false;  ///< of a polyline or spline: the last point is joined to the first
  SolidSide solid = SolidSide::kLeft;  ///< of the same, going along its points
};

enum class Motion { kMoving, kStatic, kKinematic };

/// The motion of a body along a recorded path: at t it is at offset + scale · path(t − delay), and
/// its angle is offset_angle + the path's. A coordinate that the path does not have stays as drawn.
template <typename T>
struct BasicDrivenMotion {
  std::shared_ptr<const RecordedPath> path;
  T delay{0.0};  ///< s
  T scale{1.0};
  Vector2<T> offset{T(0.0), T(0.0)};  ///< m
  T offset_angle{0.0};                ///< rad
};

/// m/s², of the load of a support that the scene leaves out: mass · 9.81.
inline constexpr double kStandardGravity = 9.81;

/// Coulomb friction of a moving body on the plane of motion, as of a table seen from above. At each
/// of the points |f_i| ≤ friction · N_i, N_i = load · share_i / Σ shares; with a radius the body
/// stands on a disc about its centre of mass that presses evenly; with neither the friction acts at
/// the centre of mass and gives no torque.
template <typename T>
struct BasicSupport {
  T friction{0.0};                 ///< Coulomb coefficient, ≥ 0
  std::optional<T> load;           ///< N, > 0; absent: mass · kStandardGravity
  std::vector<Vector2<T>> points;  ///< body frame, m
  std::vector<T> shares;           ///< > 0, one for each point; empty: equal
  std::optional<T> radius;         ///< m, > 0; excludes points
};

template <typename T>
struct BasicBody {
  std::string name;
  Motion motion = Motion::kMoving;
  BasicShape<T> shape;
  std::vector<Vector2<T>> contact_points;  ///< body frame, m: each touches as a corner does
  T mass{0.0};                             ///< kg, > 0; moving bodies only
  std::optional<T> inertia;  ///< kg m² about the centre of mass; absent: follows mass and shape
  Vector2<T> position{T(0.0), T(0.0)};  ///< m, centre of mass
  T angle{0.0};
  Vector2<T> velocity{T(0.0), T(0.0)};
  T angular_velocity{0.0};
  /// Of a kinematic body, in the place of its velocities: which way it moves.
  std::optional<BasicDrivenMotion<T>> driven;
  T friction{0.0};  ///< Coulomb coefficient, ≥ 0
  /// Of Stribeck's decay, ≥ 0: the coefficient far above `stribeck_speed`. None: it does not decay.
  std::optional<T> kinetic_friction;
  T stribeck_speed{1.0};              ///< m/s, > 0; only with a kinetic friction
  std::optional<T> rolling_friction;  ///< m, ≥ 0: |torque| ≤ ρ λn at each contact; none: 0
  T restitution{0.0};                 ///< in [0, 1]
  T linear_damping{0.0};              ///< N s/m, ≥ 0: force −c v
  T angular_damping{0.0};             ///< N m s, ≥ 0
  std::optional<T> quadratic_drag;    ///< N s²/m², ≥ 0: force −c |v| v
  std::optional<BasicSupport<T>> support;
};

/// kRope is what a model makes of a distance joint with limits, which keeps no distance, and
/// kLimitedCoupling what it makes of a coupling with limits.
enum class JointType {
  kRevolute,
  kPrismatic,
  kWeld,
  kDistance,
  kFixedAngle,
  kCoupling,
  kRope,
  kLimitedCoupling
};

/// A series (time, value) read from a file, which a force, torque or effort follows instead of a
/// constant.
struct Signal {
  std::string file;  ///< as written in the scene
  enum class Interpolation { kConstant, kLinear } interpolation = Interpolation::kConstant;
  std::vector<double> time;   ///< s, increasing
  std::vector<double> x;      ///< N; empty unless the file has that column
  std::vector<double> y;      ///< N
  std::vector<double> value;  ///< N m, or N for a prismatic effort
};

/// In the place of a force, torque or effort: the bounded spring and damper
///   −stiffness (x − target) − damping (ẋ − the target's rate), within ± limit
/// about a coordinate x, which is that of the joint, of the force's point along x or y, or the
/// angle of the torque's body.
template <typename T>
struct BasicServo {
  T target{0.0};                        ///< m or rad
  std::optional<Signal> target_signal;  ///< replaces target
  T stiffness{0.0};                     ///< N/m or N m/rad, ≥ 0
  T damping{0.0};                       ///< N s/m or N m s, ≥ 0
  std::optional<T> limit;               ///< N or N m, > 0; absent: no bound
};

/// A motor of a hinge or slider: up to `limit` it does what keeps the rate of the coordinate at
/// `speed`.
template <typename T>
struct BasicMotor {
  T speed{0.0};  ///< rad/s or m/s
  T limit{0.0};  ///< N m or N, ≥ 0
};

/// A joint of bodies[0] against bodies[1]; −1 is the world. Anchors are world points at time 0,
/// before `angle` and `rate` are applied. Which fields a type has:
///   kRevolute   anchors[0], angle, rate, damping (N m s), limits (rad), effort (N m), friction and
///               motor (N m), stiffness (N m/rad) with rest (rad)
///   kPrismatic  anchors[0], axis (world at time 0, fixed in bodies[1]), angle = displacement (m),
///               rate (m/s), damping (N s/m), limits (m), effort (N), friction and motor (N),
///               stiffness (N/m) with rest (m)
///   kWeld       anchors[0]
///   kDistance   anchors[0] on bodies[0], anchors[1] on bodies[1]; limits (m) take the place of the
///               distance as drawn
///   kFixedAngle none
///   kCoupling   coupled and ratio in place of bodies: keeps coordinate(coupled[0]) + ratio ·
///               coordinate(coupled[1]) as it is at time 0, or within limits of it (coupling.h)
template <typename T>
struct BasicJoint {
  std::string name;
  JointType type = JointType::kRevolute;
  int bodies[2] = {-1, -1};  ///< index into BasicScene::bodies, −1: world
  Vector2<T> anchors[2] = {Vector2<T>(T(0.0), T(0.0)), Vector2<T>(T(0.0), T(0.0))};
  Vector2<T> axis{T(1.0), T(0.0)};
  T angle{0.0};
  T rate{0.0};
  T damping{0.0};
  int coupled[2] = {-1, -1};              ///< of a coupling: index into BasicScene::joints
  T ratio{1.0};                           ///< of a coupling
  std::optional<std::pair<T, T>> limits;  ///< an infinite one limits nothing
  std::optional<T> limit_restitution;     ///< of impacts at the limits, 0 to 1; absent: 0
  std::optional<T> stiffness;  ///< of a spring along the coordinate: −k (coordinate − rest)
  T rest{0.0};                 ///< rad or m; only with a stiffness
  std::optional<T> friction;   ///< the torque or force at which it slides, ≥ 0
  /// Of Stribeck's decay, ≥ 0: the friction far above `stribeck_speed`. None: Coulomb's friction.
  std::optional<T> kinetic_friction;
  T stribeck_speed{1.0};  ///< rad/s or m/s, > 0; only with a kinetic friction
  std::optional<BasicMotor<T>> motor;
  T effort{0.0};
  std::optional<Signal> effort_signal;        ///< replaces effort
  std::optional<BasicServo<T>> effort_servo;  ///< replaces effort
  std::optional<T> until;                     ///< s: from then on the joint does nothing
  bool contact = false;                       ///< whether the joined bodies may collide
};

template <typename T>
struct BasicSpring {
  std::string name;
  int bodies[2] = {-1, -1};
  Vector2<T> anchors[2] = {Vector2<T>(T(0.0), T(0.0)),
                           Vector2<T>(T(0.0), T(0.0))};  ///< world, time 0
  T stiffness{0.0};                                      ///< N/m
  T damping{0.0};                                        ///< N s/m, along the spring
  T rest_length{0.0};
};

/// A force in the world's directions at a point of the body, within [start, end].
template <typename T>
struct BasicForce {
  std::string name;
  int body = -1;
  Vector2<T> force{T(0.0), T(0.0)};
  T torque{0.0};
  std::optional<Signal> force_signal;            ///< replaces force
  std::optional<Signal> torque_signal;           ///< replaces torque
  std::optional<BasicServo<T>> force_servos[2];  ///< each replaces a component of force
  std::optional<BasicServo<T>> torque_servo;     ///< replaces torque
  Vector2<T> at{T(0.0), T(0.0)};                 ///< body frame
  std::optional<T> start;                        ///< s; absent: the whole run
  std::optional<T> end;                          ///< s; absent: the whole run
};

/// Friction and restitution of pairs of bodies; names may contain `*`, which matches within a name.
template <typename T>
struct BasicPair {
  std::string bodies[2];
  std::optional<T> friction;
  std::optional<T> restitution;
  std::optional<T> kinetic_friction;  ///< as of a body
  T stribeck_speed{1.0};
  std::optional<T> rolling_friction;  ///< m
};

enum class Stepping { kFixed, kEvent };
enum class Integrator { kSemiImplicitEuler, kTrapezoidal, kRungeKutta4 };
enum class JointCorrection { kNone, kProjection };
enum class Mixing { kAverage, kGeometricMean };
enum class ImpactLaw { kNewton, kPoisson };

/// How the scene is simulated; none of its numbers is a parameter.
struct SimulationSettings {
  double dt = 0.01;       ///< s
  double duration = 1.0;  ///< s
  /// If not empty: the times of the steps' ends, 0 first, instead of k dt. It is not a key of the
  /// scene file: observations between steps add their times (event stepping).
  std::vector<double> step_times;
  Stepping stepping = Stepping::kFixed;
  /// These two follow the stepping as long as they are not set: a program that sets only `stepping
  /// = Stepping::kEvent` gets the same settings as a file with that one key. IntegratorOf and
  /// JointCorrectionOf return the settings that a run uses.
  std::optional<Integrator> integrator;
  std::optional<JointCorrection> joint_correction;
  double joint_tolerance = 1e-10;  ///< m or rad, of `projection`
  Mixing friction_mixing = Mixing::kAverage;
  Mixing restitution_mixing = Mixing::kAverage;
  ImpactLaw impact_law = ImpactLaw::kNewton;
  double restitution_threshold = 1e-3;  ///< m/s, approach speed below which an impact is inelastic
  double recovery_speed = 3.0;          ///< m/s, at most, out of penetration
  double contact_margin = 1e-4;         ///< m
  int max_events_per_step = 100;
  double lcp_tolerance = 1e-10;  ///< scaled natural residual
  int lcp_max_iterations = 100;
};

/// The integrator of a run: the one that is set, else `semi_implicit_euler` with fixed stepping and
/// `runge_kutta_4` with event stepping (by events the former would gain energy without bound, and
/// is refused).
inline Integrator IntegratorOf(const SimulationSettings& settings) {
  return settings.integrator.value_or(settings.stepping == Stepping::kEvent
                                          ? Integrator::kRungeKutta4
                                          : Integrator::kSemiImplicitEuler);
}

/// The correction of joints of a run: the one that is set, else `none` with fixed stepping and
/// `projection` with event stepping.
inline JointCorrection JointCorrectionOf(const SimulationSettings& settings) {
  return settings.joint_correction.value_or(settings.stepping == Stepping::kEvent
                                                ? JointCorrection::kProjection
                                                : JointCorrection::kNone);
}

template <typename T>
struct BasicScene {
  std::string name;
  std::string path;                      ///< of the file, for messages; empty when made in memory
  Vector2<T> gravity{T(0.0), T(-9.81)};  ///< m/s²
  std::vector<BasicBody<T>> bodies;
  std::vector<BasicJoint<T>> joints;
  std::vector<BasicSpring<T>> springs;
  std::vector<BasicForce<T>> forces;
  std::vector<BasicPair<T>> pairs;
  std::vector<std::pair<std::string, std::string>> no_contact;
  SimulationSettings simulation;
};

using Scene = BasicScene<double>;

/// Whether `name` matches `pattern`, in which each `*` stands for any characters.
bool MatchesPattern(const std::string& pattern, const std::string& name);

/// The same for paths such as `bodies/link*/mass`: a `*` stands for any characters except `/`.
bool MatchesPath(const std::string& pattern, const std::string& path);

}  // namespace tangible
