// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The model: the parameters of a scene as numbers of type T with one flat index, and the structure
// that says what each of them is.
//
// The structure (which bodies are joined, which shapes they have, where each parameter stands) is
// built once and does not depend on T. The variables of a step are numbered:
//   [ poses (3 a body) | twists (3 a body) | parameters ]
// and each contact, joint, spring, force and body depends on only a few of them
// (equation_jacobian.h).

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tangible/dynamics/model/state.h"
#include "tangible/geometry/curve.h"
#include "tangible/geometry/outline.h"
#include "tangible/geometry/seams.h"
#include "tangible/geometry/shape.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// A shape of a body: its type and the places of its parameters.
struct PartIndex {
  ShapeType type = ShapeType::kNone;
  int numbers = -1;
  int num_numbers = 0;
};

/// Places of a body's parameters; −1 where it has none. Part 0 of a body is its shape; the parts
/// from 1 on are its contact points, each a polygon with one vertex. The runs of a polyline or
/// concave polygon (outline.h) are parts too: the first one is part 0, the others follow the
/// contact points.
struct BodyIndex {
  std::string name;
  Motion motion = Motion::kStatic;
  int block = -1;  ///< among the moving bodies: its three unknowns in a step; −1: not moving
  int mass = -1, inertia = -1, linear_damping = -1, angular_damping = -1;
  int quadratic_drag = -1;  ///< −1: none
  int friction = -1, restitution = -1;
  int kinetic_friction = -1;  ///< then Stribeck's speed; −1: the friction does not decay
  int rolling_friction = -1;  ///< −1: none
  ShapeType shape = ShapeType::kNone;
  int shape_numbers = -1;
  int num_shape_numbers = 0;
  int contact_points = -1;  ///< two coordinates each
  int num_contact_points = 0;
  bool has_free_points = false;  ///< derivatives by points of its shape are taken (WithFreePoints)

  PartIndex Part(int part) const {
    return part == 0 || part > num_contact_points
               ? PartIndex{shape, shape_numbers, num_shape_numbers}
               : PartIndex{ShapeType::kPolygon, contact_points + 2 * (part - 1), 2};
  }
  int PartOfRun(int run) const { return run == 0 ? 0 : num_contact_points + run; }
  int RunOfPart(int part) const { return part == 0 ? 0 : part - num_contact_points; }
  bool IsContactPoint(int part) const { return part > 0 && part <= num_contact_points; }
  bool HasContacts() const { return shape != ShapeType::kNone || num_contact_points > 0; }
};

/// One part of each body of a pair.
struct PartPair {
  int a = 0, b = 0;
};

/// Places of a joint's parameters. Geometry, by type, from `geometry` on:
///   kRevolute, kWeld  anchor in a's frame (2), in b's frame (2), angle as drawn
///   kPrismatic        anchor in a's frame (2), in b's (2), unit axis in b's (2), angle
///   kDistance, kRope  anchor in a's frame (2), in b's frame (2), length
///   kFixedAngle       angle as drawn
///   kCoupling, kLimitedCoupling  ratio, value at time 0
/// The angle as drawn is angle_a − angle_b at time 0, before the joint's initial angle is applied.
struct JointIndex {
  std::string name;
  JointType type = JointType::kRevolute;
  int a = -1, b = -1;         ///< bodies; the world has an index too
  int coupled[2] = {-1, -1};  ///< of a coupling: two joints
  int c = -1, d = -1;         ///< of a coupling that is kept: the third and fourth of its bodies
  int rows = 0;
  int geometry = -1;
  int num_geometry = 0;
  int damping = -1, effort = -1;  ///< −1: none of this type
  int low = -1, high = -1;        ///< −1: not limited on that side
  int limit_restitution = -1;     ///< −1: 0
  int until = -1;                 ///< the time from which it does nothing; −1: none
  int motor = -1;                 ///< its speed, then its limit; −1: none
  int stiffness = -1;             ///< then the coordinate at rest; −1: no spring
  /// The force or torque at which it slides; −1: none. With Stribeck's decay the kinetic friction
  /// and Stribeck's speed follow.
  int friction = -1;
  bool has_decay = false;
  int effort_signal = -1;   ///< into signals; replaces effort
  bool is_angular = false;  ///< whether its coordinate is an angle, rad; else it is a length, m
  bool HasLimits() const { return low >= 0 || high >= 0; }
  bool IsCoupling() const {
    return type == JointType::kCoupling || type == JointType::kLimitedCoupling;
  }
};

/// Local anchors (2 + 2), stiffness, damping, rest length: seven parameters from `numbers` on.
struct SpringIndex {
  enum Place { kStiffness = 4, kDamping = 5, kRestLength = 6 };  ///< counted from `numbers`
  std::string name;
  int a = -1, b = -1;
  int numbers = -1;
};

/// at (2), force (2), torque: five parameters from `numbers` on.
struct ForceIndex {
  std::string name;
  int body = -1;
  int numbers = -1;
  int start = -1, end = -1;                   ///< −1: not bounded
  int force_signal = -1, torque_signal = -1;  ///< into signals; replace force, torque
};

/// A servo along the coordinate of a joint, or of a force's point or body: target, stiffness,
/// damping and, if it has one, limit from `numbers` on (servo.h).
struct ServoIndex {
  enum Place { kTarget, kStiffness, kDamping, kLimit };  ///< counted from `numbers`
  enum Axis { kX, kY, kAngle };
  int joint = -1;  ///< −1: of a force
  int force = -1;
  Axis axis = kX;  ///< of a force
  int numbers = -1;
  bool has_limit = false;
  int signal = -1;  ///< into signals; replaces the target
  int size() const { return has_limit ? 4 : 3; }
  int Number(Place place) const { return numbers + place; }
};

/// A pair's own coefficients, for bodies that match the two patterns.
struct PairIndex {
  std::vector<bool> first, second;      ///< a body: matches the pattern
  int friction = -1, restitution = -1;  ///< −1: mixed as usual
  int kinetic_friction = -1;            ///< then Stribeck's speed; −1: none of its own
  int rolling_friction = -1;
};

/// A body that follows a path: delay, scale, offset (2) and offset of the angle from `numbers` on
/// (driven_bodies.h).
struct PathIndex {
  int body = -1;
  int numbers = -1;
  std::shared_ptr<const RecordedPath> path;
};

/// The friction of a body on the plane of motion: friction and load from `numbers` on, then x, y
/// and the share of the load (of a sum of 1) of each point, or the radius of a disc (support.h).
struct SupportIndex {
  enum Kind : unsigned char { kCentre, kPoints, kDisc };
  enum Place { kFriction, kLoad, kRadius };  ///< counted from `numbers`
  int body = -1;
  Kind kind = kCentre;
  int numbers = -1;
  int num_points = 1;  ///< of kCentre 1, without numbers of its own
  int size() const { return kind == kPoints ? 2 + 3 * num_points : kind == kDisc ? 3 : 2; }
  int Point(int i) const { return numbers + 2 + 3 * i; }
};

struct ModelStructure {
  std::string scene_name;
  SimulationSettings settings;
  std::vector<BodyIndex> bodies;  ///< in scene order, then the world
  std::vector<JointIndex> joints;
  std::vector<SpringIndex> springs;
  std::vector<ForceIndex> forces;
  std::vector<ServoIndex> servos;
  std::vector<PairIndex> pairs;
  std::vector<Signal> signals;
  std::vector<SupportIndex> supports;  ///< in ascending order of their bodies
  std::vector<PathIndex> paths;        ///< in ascending order of their bodies
  std::vector<std::pair<std::vector<bool>, std::vector<bool>>> no_contact;
  std::vector<std::pair<int, int>> joined;  ///< bodies with a joint without contact, ascending
  std::vector<int> moving;                  ///< body of each block
  bool joint_loops = false;
  bool has_releases = false;          ///< whether joints end at a time
  bool friction_decays = false;       ///< whether the friction of some contact may (contact.h)
  bool has_rolling_friction = false;  ///< whether some body or pair has it
  bool has_limits = false;            ///< whether some joint has
  bool has_joint_friction = false;    ///< whether some joint has friction or a motor
  int num_parameters = 0;

  JointIndex& AddJoint(const JointIndex& joint) {
    has_limits = has_limits || joint.HasLimits();
    has_joint_friction = has_joint_friction || joint.friction >= 0 || joint.motor >= 0;
    return joints.emplace_back(joint);
  }
  int num_bodies() const { return static_cast<int>(bodies.size()); }
  int world() const { return num_bodies() - 1; }
  int num_blocks() const { return static_cast<int>(moving.size()); }
  /// Index of a variable: component i of body's pose or twist, a number.
  int PoseVariable(int body, int i) const { return 3 * body + i; }
  int TwistVariable(int body, int i) const { return 3 * num_bodies() + 3 * body + i; }
  int ParameterVariable(int number) const { return 6 * num_bodies() + number; }
  int num_variables() const { return 6 * num_bodies() + num_parameters; }
  /// Calls visit(PartPair) for the parts of two bodies that may touch: both shapes, and the contact
  /// points of each with the shape of the other. Two points never touch.
  template <typename Visit>
  void ForEachPartPair(int i, int j, const Visit& visit) const {
    visit(PartPair{0, 0});
    for (int k = 1; k <= bodies[i].num_contact_points; ++k) {
      visit(PartPair{k, 0});
    }
    for (int k = 1; k <= bodies[j].num_contact_points; ++k) {
      visit(PartPair{0, k});
    }
  }
  /// Whether contacts between two bodies are searched.
  bool MayCollide(int i, int j) const;
  /// The pair entry for two bodies, or nullptr; of several entries the last one in the scene.
  const PairIndex* FindPair(int i, int j) const;
};

/// Places of gravity among the parameters.
inline constexpr int kGravityX = 0;
inline constexpr int kGravityY = 1;

/// The seams of bodies that do not move, or that move alike, and the outlines of polylines and
/// concave polygons and the curves of splines (model_seams.h).
struct ModelSeams {
  std::vector<ShapeSeams> shapes;
  std::vector<Outline> outlines;
  std::vector<Curve> curves;
  FlushSteps steps;
};

template <typename T>
struct Model {
  std::shared_ptr<const ModelStructure> structure;
  std::vector<T> parameters;
  std::shared_ptr<const ModelSeams> seams{};  ///< of a model in double; null: there are none
  /// Of each body the place in seams->shapes, seams->outlines and seams->curves; −1: it has none.
  std::vector<int> seams_of{}, outline_of{}, curve_of{};

  ShapeView<T> Shape(int body, int part = 0) const {
    const PartIndex index = structure->bodies[body].Part(part);
    return {index.type, parameters.data() + (index.num_numbers > 0 ? index.numbers : 0),
            index.num_numbers};
  }
  /// The seams of a shape, or nullptr. Contact points have none.
  const ShapeSeams* SeamsOf(int body, int part) const {
    return seams == nullptr || part != 0 || seams_of[body] < 0 ? nullptr
                                                               : &seams->shapes[seams_of[body]];
  }
  /// The outline of a body that is a polyline or a concave polygon, or nullptr.
  const Outline* OutlineOf(int body) const {
    return seams == nullptr || outline_of[body] < 0 ? nullptr : &seams->outlines[outline_of[body]];
  }
  /// The same for a part that is not a contact point.
  const Outline* OutlineOf(int body, int part) const {
    return structure->bodies[body].IsContactPoint(part) ? nullptr : OutlineOf(body);
  }
  /// Whether neighbours leave less of a part of a body than its shape: SeamsOf, or the seams of an
  /// outline.
  bool HasSeams(int body, int part) const {
    const Outline* const outline = OutlineOf(body, part);
    return outline != nullptr ? outline->HasSeams() : SeamsOf(body, part) != nullptr;
  }
  /// The curve of a body that is a spline, or nullptr; of a part that is not a contact point.
  const Curve* CurveOf(int body, int part = 0) const {
    return seams == nullptr || part != 0 || curve_of[body] < 0 ? nullptr
                                                               : &seams->curves[curve_of[body]];
  }
};

/// The model and the initial state of a valid scene. Derivatives of the scene's parameters flow
/// through anchors, inertias that follow mass and shape, and initial joint angles and rates.
template <typename T>
void BuildModel(const BasicScene<T>& scene, Model<T>* model, State<T>* state);

/// As BuildModel with other parameters, but reuses `structure`, which was built from the same
/// scene.
template <typename T>
void BuildModelWithStructure(const BasicScene<T>& scene,
                             const std::shared_ptr<const ModelStructure>& structure,
                             Model<T>* model, State<T>* state);

/// Builds the structure alone.
template <typename T>
std::shared_ptr<const ModelStructure> BuildStructure(const BasicScene<T>& scene);

}  // namespace tangible
