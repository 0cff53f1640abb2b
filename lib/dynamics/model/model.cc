// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/initial_state_inl.h"
#include "tangible/dynamics/model/model_seams.h"
#include "tangible/geometry/mass_properties.h"
#include "tangible/math/disjoint_sets.h"
#include "tangible/math/spline_curve.h"
#include "tangible/scene/coupling.h"

namespace tangible {
namespace {

int NumGeometryNumbers(JointType type) {
  switch (type) {
    case JointType::kPrismatic:
      return 7;
    case JointType::kCoupling:
    case JointType::kLimitedCoupling:
      return 2;
    case JointType::kFixedAngle:
      return 1;
    default:
      return 5;
  }
}

int NumRows(JointType type) {
  switch (type) {
    case JointType::kWeld:
      return 3;
    case JointType::kDistance:
    case JointType::kFixedAngle:
    case JointType::kCoupling:
      return 1;
    case JointType::kRope:
    case JointType::kLimitedCoupling:
      return 0;
    default:
      return 2;
  }
}

std::vector<bool> Matches(const std::vector<BodyIndex>& bodies, const std::string& pattern) {
  std::vector<bool> matches;
  matches.reserve(bodies.size());
  for (const BodyIndex& body : bodies) {
    matches.push_back(MatchesPattern(pattern, body.name));
  }
  return matches;
}

// Assigns places in the flat index, in the order in which FillNumbers appends.
class Places {
 public:
  int Take(int count) {
    const int place = next_;
    next_ += count;
    return place;
  }
  int next() const { return next_; }

 private:
  int next_ = 0;
};

// The index of a servo but for what it belongs to.
template <typename T>
ServoIndex* AddServo(const BasicServo<T>& servo, Places* places, ModelStructure* structure) {
  ServoIndex& index = structure->servos.emplace_back();
  index.has_limit = servo.limit.has_value();
  index.numbers = places->Take(index.size());
  if (servo.target_signal) {
    index.signal = static_cast<int>(structure->signals.size());
    structure->signals.push_back(*servo.target_signal);
  }
  return &index;
}

// Appends its numbers.
template <typename T>
void FillServo(const std::optional<BasicServo<T>>& servo, std::vector<T>* numbers) {
  if (!servo) return;
  numbers->insert(numbers->end(), {servo->target, servo->stiffness, servo->damping});
  if (servo->limit) numbers->push_back(*servo->limit);
}

// The index of the support of the body that is added next.
template <typename T>
void AddSupport(const BasicSupport<T>& support, Places* places, ModelStructure* structure) {
  SupportIndex& index = structure->supports.emplace_back();
  index.body = structure->num_bodies();
  if (!support.points.empty()) {
    index.kind = SupportIndex::kPoints;
    index.num_points = static_cast<int>(support.points.size());
  } else if (support.radius) {
    index.kind = SupportIndex::kDisc;
  }
  index.numbers = places->Take(index.size());
}

template <typename T>
void AddBodies(const BasicScene<T>& scene, Places* places, ModelStructure* structure) {
  for (const BasicBody<T>& body : scene.bodies) {
    BodyIndex index;
    index.name = body.name;
    index.motion = body.motion;
    index.shape = body.shape.type;
    index.num_shape_numbers =
        static_cast<int>(body.shape.numbers.size()) + (body.shape.closed ? 2 : 0);
    if (body.shape.type == ShapeType::kSpline) index.num_shape_numbers *= 2;
    index.shape_numbers = places->Take(index.num_shape_numbers);
    index.num_contact_points = static_cast<int>(body.contact_points.size());
    index.contact_points = places->Take(2 * index.num_contact_points);
    index.friction = places->Take(1);
    index.restitution = places->Take(1);
    if (body.motion == Motion::kMoving) {
      index.block = structure->num_blocks();
      structure->moving.push_back(static_cast<int>(structure->bodies.size()));
      index.mass = places->Take(1);
      index.inertia = places->Take(1);
      index.linear_damping = places->Take(1);
      index.angular_damping = places->Take(1);
      index.quadratic_drag = body.quadratic_drag ? places->Take(1) : -1;
    }
    index.kinetic_friction = body.kinetic_friction ? places->Take(2) : -1;
    structure->friction_decays = structure->friction_decays || body.kinetic_friction;
    index.rolling_friction = body.rolling_friction ? places->Take(1) : -1;
    structure->has_rolling_friction = structure->has_rolling_friction || body.rolling_friction;
    if (body.support) AddSupport(*body.support, places, structure);
    if (body.driven) {
      structure->paths.push_back(
          {structure->num_bodies(), places->Take(kNumPathNumbers), body.driven->path});
    }
    structure->bodies.push_back(index);
  }
  BodyIndex world;
  world.name = "world";
  structure->bodies.push_back(world);
}

// An infinite limit limits nothing.
template <typename T>
bool Limits(const T& limit) {
  return std::isfinite(ValueOf(limit));
}

// The type of a joint in a model.
template <typename T>
JointType ModelType(const BasicJoint<T>& joint) {
  if (!joint.limits) return joint.type;
  return joint.type == JointType::kDistance   ? JointType::kRope
         : joint.type == JointType::kCoupling ? JointType::kLimitedCoupling
                                              : joint.type;
}

// Whether rows of joints may be dependent. All fixed bodies are one node of a graph in which a
// joint may close a cycle. Where none does, the coordinates of the joints are independent, and
// couplings are if they close no cycle among these. A rope has no rows, but a coordinate, which is
// independent if the rope closes no cycle.
bool HasJointLoops(const ModelStructure& structure) {
  DisjointSets nodes, coordinates;
  nodes.AddAll(structure.bodies.size());
  coordinates.AddAll(structure.joints.size());
  const auto node = [&](int body) {
    return structure.bodies[body].block >= 0 ? body : structure.world();
  };
  bool loops = false;
  std::vector<bool> is_coupled(structure.joints.size(), false);
  for (const JointIndex& joint : structure.joints) {
    for (const int coupled : joint.coupled) {
      if (coupled >= 0) is_coupled[coupled] = true;
    }
  }
  for (size_t j = 0; j < structure.joints.size(); ++j) {
    const JointIndex& joint = structure.joints[j];
    if (joint.rows == 0 && !(joint.type == JointType::kRope && is_coupled[j])) continue;
    const bool joins = joint.type == JointType::kCoupling
                           ? coordinates.Join(joint.coupled[0], joint.coupled[1])
                           : nodes.Join(node(joint.a), node(joint.b));
    loops = loops || !joins;
  }
  return loops;
}

template <typename T>
void AddJoints(const BasicScene<T>& scene, Places* places, ModelStructure* structure) {
  const int world = structure->world();
  for (const BasicJoint<T>& joint : scene.joints) {
    JointIndex index;
    index.name = joint.name;
    index.type = ModelType(joint);
    index.is_angular = joint.type == JointType::kRevolute;
    int ends[4] = {joint.bodies[0], joint.bodies[1], -1, -1};
    if (joint.type == JointType::kCoupling) {
      std::copy_n(EndsOf(scene, joint).bodies, 4, ends);
      std::copy_n(joint.coupled, 2, index.coupled);
      index.is_angular = scene.joints[joint.coupled[0]].type == JointType::kRevolute;
    }
    index.a = ends[0] < 0 ? world : ends[0];
    index.b = ends[1] < 0 ? world : ends[1];
    index.c = ends[2];
    index.d = ends[2] >= 0 && ends[3] < 0 ? world : ends[3];
    index.rows = NumRows(index.type);
    index.num_geometry = NumGeometryNumbers(index.type);
    index.geometry = places->Take(index.num_geometry);
    if (joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic) {
      index.damping = places->Take(1);
      index.effort = places->Take(1);
      index.stiffness = joint.stiffness ? places->Take(2) : -1;
      index.has_decay = joint.friction && joint.kinetic_friction;
      index.friction = joint.friction ? places->Take(index.has_decay ? 3 : 1) : -1;
      index.motor = joint.motor ? places->Take(2) : -1;
      if (joint.effort_servo) {
        AddServo(*joint.effort_servo, places, structure)->joint =
            static_cast<int>(structure->joints.size());
      }
    }
    if (joint.until) {
      index.until = places->Take(1);
      structure->has_releases = true;
    }
    if (joint.limits) {
      index.low = Limits(joint.limits->first) ? places->Take(1) : -1;
      index.high = Limits(joint.limits->second) ? places->Take(1) : -1;
      index.limit_restitution = joint.limit_restitution ? places->Take(1) : -1;
    }
    if (joint.effort_signal) {
      index.effort_signal = static_cast<int>(structure->signals.size());
      structure->signals.push_back(*joint.effort_signal);
    }
    structure->AddJoint(index);
    if (!joint.contact) {
      structure->joined.emplace_back(std::min(index.a, index.b), std::max(index.a, index.b));
    }
  }
  std::sort(structure->joined.begin(), structure->joined.end());
  structure->joint_loops = HasJointLoops(*structure);
}

template <typename T>
void AddForcesAndPairs(const BasicScene<T>& scene, Places* places, ModelStructure* structure) {
  const int world = structure->world();
  for (const BasicSpring<T>& spring : scene.springs) {
    const auto body = [&](int i) { return i < 0 ? world : i; };
    structure->springs.push_back(
        {spring.name, body(spring.bodies[0]), body(spring.bodies[1]), places->Take(7)});
  }
  for (const BasicForce<T>& force : scene.forces) {
    ForceIndex index;
    index.name = force.name;
    index.body = force.body;
    index.numbers = places->Take(5);
    index.start = force.start ? places->Take(1) : -1;
    index.end = force.end ? places->Take(1) : -1;
    const auto add_signal = [&](const std::optional<Signal>& signal) {
      if (!signal) {
        return -1;
      }
      structure->signals.push_back(*signal);
      return static_cast<int>(structure->signals.size()) - 1;
    };
    index.force_signal = add_signal(force.force_signal);
    index.torque_signal = add_signal(force.torque_signal);
    const auto add_servo = [&](const std::optional<BasicServo<T>>& servo, ServoIndex::Axis axis) {
      if (!servo) return;
      ServoIndex* const added = AddServo(*servo, places, structure);
      added->force = static_cast<int>(structure->forces.size());
      added->axis = axis;
    };
    add_servo(force.force_servos[0], ServoIndex::kX);
    add_servo(force.force_servos[1], ServoIndex::kY);
    add_servo(force.torque_servo, ServoIndex::kAngle);
    structure->forces.push_back(index);
  }
  for (const BasicPair<T>& pair : scene.pairs) {
    PairIndex index;
    index.first = Matches(structure->bodies, pair.bodies[0]);
    index.second = Matches(structure->bodies, pair.bodies[1]);
    index.friction = pair.friction ? places->Take(1) : -1;
    index.restitution = pair.restitution ? places->Take(1) : -1;
    index.kinetic_friction = pair.kinetic_friction ? places->Take(2) : -1;
    structure->friction_decays = structure->friction_decays || pair.kinetic_friction;
    index.rolling_friction = pair.rolling_friction ? places->Take(1) : -1;
    structure->has_rolling_friction = structure->has_rolling_friction || pair.rolling_friction;
    structure->pairs.push_back(index);
  }
  for (const auto& [first, second] : scene.no_contact) {
    structure->no_contact.emplace_back(Matches(structure->bodies, first),
                                       Matches(structure->bodies, second));
  }
}

template <typename T>
void Append(const Vector2<T>& v, std::vector<T>* numbers) {
  numbers->push_back(v.x());
  numbers->push_back(v.y());
}

template <typename T>
ShapeView<T> ViewOf(const BasicShape<T>& shape) {
  return {shape.type, shape.numbers.data(), static_cast<int>(shape.numbers.size())};
}

// Appends the numbers of a shape. The points of a polyline or spline are ordered so that the solid
// is to the left, and the first one is repeated where it is closed (geometry/outline.h). The second
// derivatives of a spline follow (geometry/curve.h).
template <typename T>
void AppendShape(const BasicShape<T>& shape, std::vector<T>* numbers) {
  const auto first = static_cast<std::ptrdiff_t>(numbers->size());
  numbers->insert(numbers->end(), shape.numbers.begin(), shape.numbers.end());
  if (shape.closed) {
    numbers->insert(numbers->end(), shape.numbers.begin(), shape.numbers.begin() + 2);
  }
  if (shape.solid == SolidSide::kRight) {
    std::reverse(numbers->begin() + first, numbers->end());
    for (size_t i = static_cast<size_t>(first); i + 1 < numbers->size(); i += 2) {
      std::swap((*numbers)[i], (*numbers)[i + 1]);
    }
  }
  if (shape.type == ShapeType::kSpline) {
    const std::vector<T> curvatures =
        SplineCurvatures(std::vector<T>(numbers->begin() + first, numbers->end()));
    numbers->insert(numbers->end(), curvatures.begin(), curvatures.end());
  }
}

// Appends the numbers of a body's support. A load that is left out follows the mass, and shares are
// divided by their sum.
template <typename T>
void FillSupport(const BasicSupport<T>& support, const T& mass, std::vector<T>* numbers) {
  numbers->push_back(support.friction);
  numbers->push_back(support.load ? *support.load : T(kStandardGravity * mass));
  T sum(0.0);
  for (const T& share : support.shares) sum += share;
  for (size_t i = 0; i < support.points.size(); ++i) {
    Append(support.points[i], numbers);
    numbers->push_back(support.shares.empty() ? T(1.0 / static_cast<double>(support.points.size()))
                                              : T(support.shares[i] / sum));
  }
  if (support.points.empty() && support.radius) numbers->push_back(*support.radius);
}

// Appends the parameters of the bodies, in the order of AddBodies.
template <typename T>
void FillBodies(const BasicScene<T>& scene, std::vector<T>* numbers) {
  for (const BasicBody<T>& body : scene.bodies) {
    AppendShape(body.shape, numbers);
    for (const Vector2<T>& point : body.contact_points) {
      Append(point, numbers);
    }
    numbers->push_back(body.friction);
    numbers->push_back(body.restitution);
    if (body.motion == Motion::kMoving) {
      numbers->push_back(body.mass);
      numbers->push_back(body.inertia ? *body.inertia
                                      : UniformInertia(ViewOf(body.shape), body.mass));
      numbers->push_back(body.linear_damping);
      numbers->push_back(body.angular_damping);
      if (body.quadratic_drag) {
        numbers->push_back(*body.quadratic_drag);
      }
    }
    if (body.kinetic_friction) {
      numbers->push_back(*body.kinetic_friction);
      numbers->push_back(body.stribeck_speed);
    }
    if (body.rolling_friction) numbers->push_back(*body.rolling_friction);
    if (body.support) FillSupport(*body.support, body.mass, numbers);
    if (body.driven) {
      numbers->push_back(body.driven->delay);
      numbers->push_back(body.driven->scale);
      Append(body.driven->offset, numbers);
      numbers->push_back(body.driven->offset_angle);
    }
  }
}

// The geometry of a joint as JointIndex lists it. The value of a coupling at time 0 is set where
// joints have been turned.
template <typename T>
void FillGeometry(const BasicJoint<T>& joint, const State<T>& drawn, int world,
                  std::vector<T>* numbers) {
  using std::sqrt;
  if (joint.type == JointType::kCoupling) {
    numbers->push_back(joint.ratio);
    numbers->push_back(T(0.0));
    return;
  }
  const int a = joint.bodies[0] < 0 ? world : joint.bodies[0];
  const int b = joint.bodies[1] < 0 ? world : joint.bodies[1];
  const Pose<T> pose_a = drawn.PoseOf(a);
  const Pose<T> pose_b = drawn.PoseOf(b);
  if (joint.type != JointType::kFixedAngle) {
    Append(pose_a.Inverse(joint.anchors[0]), numbers);
    Append(pose_b.Inverse(joint.anchors[joint.type == JointType::kDistance ? 1 : 0]), numbers);
  }
  if (joint.type == JointType::kPrismatic) {
    const T length = sqrt(joint.axis.squaredNorm());
    Append(Vector2<T>(pose_b.rotation.Inverse(joint.axis) / length), numbers);
  }
  if (joint.type == JointType::kDistance && joint.limits) {
    numbers->push_back(T(0.0));  // no distance to keep
  } else if (joint.type == JointType::kDistance) {
    numbers->push_back(sqrt((joint.anchors[0] - joint.anchors[1]).squaredNorm()));
  } else {
    numbers->push_back(pose_a.angle - pose_b.angle);
  }
}

template <typename T>
void FillJoints(const BasicScene<T>& scene, const State<T>& drawn, int world,
                std::vector<T>* numbers) {
  for (const BasicJoint<T>& joint : scene.joints) {
    FillGeometry(joint, drawn, world, numbers);
    if (joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic) {
      numbers->push_back(joint.damping);
      numbers->push_back(joint.effort);
      if (joint.stiffness) {
        numbers->push_back(*joint.stiffness);
        numbers->push_back(joint.rest);
      }
      if (joint.friction) {
        numbers->push_back(*joint.friction);
        if (joint.kinetic_friction) {
          numbers->push_back(*joint.kinetic_friction);
          numbers->push_back(joint.stribeck_speed);
        }
      }
      if (joint.motor) {
        numbers->push_back(joint.motor->speed);
        numbers->push_back(joint.motor->limit);
      }
      FillServo(joint.effort_servo, numbers);
    }
    if (joint.until) numbers->push_back(*joint.until);
    if (joint.limits) {
      if (Limits(joint.limits->first)) numbers->push_back(joint.limits->first);
      if (Limits(joint.limits->second)) numbers->push_back(joint.limits->second);
      if (joint.limit_restitution) numbers->push_back(*joint.limit_restitution);
    }
  }
}

// The coordinate of a joint at time 0: of a hinge or slider that with which it starts, of a rope
// the distance of its ends.
template <typename T>
T InitialCoordinate(const Model<T>& model, const State<T>& state, const BasicJoint<T>& joint,
                    const JointIndex& index) {
  using std::sqrt;
  if (index.type != JointType::kRope) return joint.angle;
  const T* x = &model.parameters[index.geometry];
  const Vector2<T> apart = state.PoseOf(index.a) * Vector2<T>(x[0], x[1]) -
                           state.PoseOf(index.b) * Vector2<T>(x[2], x[3]);
  const T squared = apart.squaredNorm();
  return ValueOf(squared) > 0.0 ? T(sqrt(squared)) : T(0.0);
}

// The value that a coupling keeps, or that its limits are measured from.
template <typename T>
void SetCoupledValues(const BasicScene<T>& scene, const State<T>& state, Model<T>* model) {
  const std::vector<JointIndex>& joints = model->structure->joints;
  for (const JointIndex& joint : joints) {
    if (!joint.IsCoupling()) continue;
    const auto coordinate = [&](int k) {
      const int of = joint.coupled[k];
      return InitialCoordinate(*model, state, scene.joints[of], joints[of]);
    };
    T* const numbers = &model->parameters[joint.geometry];
    numbers[1] = coordinate(0) + numbers[0] * coordinate(1);
  }
}

template <typename T>
void FillForcesAndPairs(const BasicScene<T>& scene, const State<T>& drawn, int world,
                        std::vector<T>* numbers) {
  for (const BasicSpring<T>& spring : scene.springs) {
    for (int k = 0; k < 2; ++k) {
      const int body = spring.bodies[k] < 0 ? world : spring.bodies[k];
      Append(drawn.PoseOf(body).Inverse(spring.anchors[k]), numbers);
    }
    numbers->push_back(spring.stiffness);
    numbers->push_back(spring.damping);
    numbers->push_back(spring.rest_length);
  }
  for (const BasicForce<T>& force : scene.forces) {
    Append(force.at, numbers);
    Append(force.force, numbers);
    numbers->push_back(force.torque);
    for (const std::optional<T>& time : {force.start, force.end}) {
      if (time) {
        numbers->push_back(*time);
      }
    }
    for (const auto& servo : force.force_servos) FillServo(servo, numbers);
    FillServo(force.torque_servo, numbers);
  }
  for (const BasicPair<T>& pair : scene.pairs) {
    for (const std::optional<T>& coefficient : {pair.friction, pair.restitution}) {
      if (coefficient) {
        numbers->push_back(*coefficient);
      }
    }
    if (pair.kinetic_friction) {
      numbers->push_back(*pair.kinetic_friction);
      numbers->push_back(pair.stribeck_speed);
    }
    if (pair.rolling_friction) numbers->push_back(*pair.rolling_friction);
  }
}

template <typename T>
State<T> DrawnState(const BasicScene<T>& scene) {
  State<T> state;
  for (const BasicBody<T>& body : scene.bodies) {
    Append(body.position, &state.pose);
    state.pose.push_back(body.angle);
    Append(body.velocity, &state.twist);
    state.twist.push_back(body.angular_velocity);
  }
  state.pose.insert(state.pose.end(), 3, T(0.0));
  state.twist.insert(state.twist.end(), 3, T(0.0));
  return state;
}

// Puts driven bodies where they are at time 0.
template <typename T>
void StartPaths(const Model<T>& model, State<T>* state) {
  const ModelStructure& structure = *model.structure;
  if (structure.settings.stepping == Stepping::kFixed) {
    FollowPathsOverStep(model, 0.0, structure.settings.dt, state);
  } else {
    FollowPaths(model, T(0.0), BesideInstant(structure, 0.0, PathSide::kAfter), state);
  }
}

bool MatchesEither(const std::vector<bool>& first, const std::vector<bool>& second, int i, int j) {
  return (first[i] && second[j]) || (first[j] && second[i]);
}

}  // namespace

bool ModelStructure::MayCollide(int i, int j) const {
  const BodyIndex& a = bodies[i];
  const BodyIndex& b = bodies[j];
  if ((a.block < 0 && b.block < 0) || !a.HasContacts() || !b.HasContacts() ||
      (a.shape == ShapeType::kNone && b.shape == ShapeType::kNone)) {
    return false;
  }
  if (std::binary_search(joined.begin(), joined.end(),
                         std::make_pair(std::min(i, j), std::max(i, j)))) {
    return false;
  }
  for (const auto& [first, second] : no_contact) {
    if (MatchesEither(first, second, i, j)) {
      return false;
    }
  }
  return true;
}

const PairIndex* ModelStructure::FindPair(int i, int j) const {
  for (size_t k = pairs.size(); k-- > 0;) {
    if (MatchesEither(pairs[k].first, pairs[k].second, i, j)) {
      return &pairs[k];
    }
  }
  return nullptr;
}

template <typename T>
std::shared_ptr<const ModelStructure> BuildStructure(const BasicScene<T>& scene) {
  auto structure = std::make_shared<ModelStructure>();
  structure->scene_name = scene.name;
  structure->settings = scene.simulation;
  Places places;
  places.Take(2);  // gravity
  AddBodies(scene, &places, structure.get());
  AddJoints(scene, &places, structure.get());
  AddForcesAndPairs(scene, &places, structure.get());
  structure->num_parameters = places.next();
  return structure;
}

template <typename T>
void BuildModelWithStructure(const BasicScene<T>& scene,
                             const std::shared_ptr<const ModelStructure>& structure,
                             Model<T>* model, State<T>* state) {
  model->structure = structure;
  const int world = model->structure->world();
  *state = DrawnState(scene);
  model->parameters.clear();
  model->parameters.reserve(model->structure->num_parameters);
  Append(scene.gravity, &model->parameters);
  FillBodies(scene, &model->parameters);
  StartPaths(*model, state);
  FillJoints(scene, *state, world, &model->parameters);
  FillForcesAndPairs(scene, *state, world, &model->parameters);
  ApplyInitialJoints(scene, state);
  SetCoupledValues(scene, *state, model);
  if constexpr (std::is_same_v<T, double>) {
    FindModelSeams(*state, model);
  }
}

template <typename T>
void BuildModel(const BasicScene<T>& scene, Model<T>* model, State<T>* state) {
  BuildModelWithStructure(scene, BuildStructure(scene), model, state);
}

#define TANGIBLE_INSTANTIATE(T)                                                                  \
  template std::shared_ptr<const ModelStructure> BuildStructure<T>(const BasicScene<T>&);        \
  template void BuildModelWithStructure<T>(                                                      \
      const BasicScene<T>&, const std::shared_ptr<const ModelStructure>&, Model<T>*, State<T>*); \
  template void BuildModel<T>(const BasicScene<T>&, Model<T>*, State<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
