// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/engine_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/certificate/discrete_map.h"

namespace tangible {
namespace {

Model<double> ModelOf(const RolloutFunction& function, State<double>* start) {
  Model<double> model;
  BuildModel(function.scene(), &model, start);
  return model;
}

// Whether impulses change a twist enough to count as an impact.
bool Jumps(const Impulses& impulses, double threshold) {
  for (size_t i = 0; i < impulses.new_twist.size(); ++i) {
    if (std::abs(impulses.new_twist[i] - impulses.before.twist[i]) > threshold) return true;
  }
  return false;
}

// Indices of the model's numbers that describe damping.
std::vector<int> DampingOf(const ModelStructure& structure) {
  std::vector<int> numbers;
  for (const BodyIndex& body : structure.bodies) {
    for (const int number : {body.linear_damping, body.angular_damping, body.quadratic_drag}) {
      numbers.push_back(number);
    }
  }
  for (const JointIndex& joint : structure.joints) numbers.push_back(joint.damping);
  // The index among the seven numbers of a spring.
  for (const SpringIndex& spring : structure.springs) numbers.push_back(spring.numbers + 5);
  numbers.erase(std::remove(numbers.begin(), numbers.end(), -1), numbers.end());
  return numbers;
}

// Whether any contact or limit can be reached.
bool MayTouch(const ModelStructure& structure) {
  if (structure.has_limits) return true;
  for (int i = 0; i < structure.num_bodies(); ++i) {
    for (int j = i + 1; j < structure.num_bodies(); ++j) {
      if (structure.MayCollide(i, j)) return true;
    }
  }
  return false;
}

}  // namespace

// The scene in which some bodies pass through each other, and its steps.
struct EngineStep::Reduced {
  RolloutFunction function;
  std::unique_ptr<EngineStep> step;
};

EngineStep::EngineStep(const RolloutFunction& function)
    : function_(function), model_(ModelOf(function, &start_)), stepper_(model_), joints_(model_) {
  const ModelStructure& s = *model_.structure;
  controls_.setZero(s.num_variables(), num_controls());
  for (size_t j = 0; j < function.control_numbers().size(); ++j) {
    controls_(s.ParameterVariable(function.control_numbers()[j]), function.control_of_number()[j]) =
        1.0;
  }
  tangent_.FixNumbers(s, controls_);
}

State<double> EngineStep::StateOf(long k, const VectorX<double>& x) const {
  State<double> state = start_;
  const ModelStructure& s = *model_.structure;
  const double t = static_cast<double>(k) * s.settings.dt;
  // Bodies of prescribed motion keep their speed.
  for (size_t i = 0; i < state.pose.size(); ++i) state.pose[i] += t * state.twist[i];
  if (s.settings.stepping == Stepping::kFixed) {
    FollowPathsOverStep(model_, t, s.settings.dt, &state);
  } else {
    FollowPaths(model_, t, BesideInstant(s, t, PathSide::kAfter), &state);
  }
  function_.SetState(x, &state);
  return state;
}

bool EngineStep::Set(long k, const VectorX<double>& x, const VectorX<double>& u,
                     std::string* error) {
  for (size_t j = 0; j < function_.control_numbers().size(); ++j) {
    model_.parameters[function_.control_numbers()[j]] = u[function_.control_of_number()[j]];
  }
  if (x.allFinite() && u.allFinite()) return true;
  *error = "step " + std::to_string(k) + ": expected finite states and controls";
  return false;
}

bool EngineStep::Advance(long k, const VectorX<double>& x, const VectorX<double>& u,
                         VectorX<double>* next, std::string* error) {
  if (!Set(k, x, u, error)) return false;
  State<double> state = StateOf(k, x);
  const double h = model_.structure->settings.dt;
  const double t = static_cast<double>(k) * h;
  stepper_.ClearGuess();
  const StepReport report = stepper_.Step(model_, t, h, &state);
  if (report.status != StepStatus::kDone) {
    *error = FailureMessage(report, t, k);
    return false;
  }
  FindImpacts();
  *next = function_.StateOf(state);
  return true;
}

bool EngineStep::StepBack(long k, const VectorX<double>& next, const VectorX<double>& u,
                          VectorX<double>* x) {
  std::string error;
  // A path leads forwards alone.
  if (!model_.structure->paths.empty() || !Set(k, next, u, &error)) return false;
  const auto turn_twists = [](State<double>* state) {
    for (double& speed : state->twist) speed = -speed;
  };
  Model<double> turned = model_;
  for (const int number : DampingOf(*model_.structure)) {
    turned.parameters[number] = -turned.parameters[number];
  }
  State<double> state = StateOf(k + 1, next);
  turn_twists(&state);
  const double h = model_.structure->settings.dt;
  stepper_.ClearGuess();
  const StepReport report = stepper_.Step(turned, static_cast<double>(k) * h, h, &state);
  if (report.status != StepStatus::kDone) return false;
  turn_twists(&state);
  *x = function_.StateOf(state);
  return true;
}

void EngineStep::FindImpacts() {
  impacts_.clear();
  const double threshold = model_.structure->settings.restitution_threshold;
  stepper_.parts().ForEachPart([&](const IslandRecord& island, const EventPart& part) {
    if (!part.is_impulses || !Jumps(part.impulses, threshold)) return;
    const Impulses& impulses = part.impulses;
    std::vector<Meeting> kind;
    for (size_t c = 0; c < impulses.contacts.size(); ++c) {
      const ActiveContact contact = island.InWhole(impulses.contacts[c]);
      if (contact.IsPureFriction() || impulses.solution.normal_impulse[c] <= 0.0) continue;
      kind.push_back({contact.a, contact.b, contact.joint});
    }
    // The decompression belongs to the same impact as the compression.
    if (kind.empty() || impulses.decompression) return;
    std::sort(kind.begin(), kind.end());
    kind.erase(std::unique(kind.begin(), kind.end()), kind.end());
    const auto found = std::find(kinds_.begin(), kinds_.end(), kind);
    impacts_.push_back(static_cast<int>(found - kinds_.begin()));
    if (found == kinds_.end()) kinds_.push_back(kind);
  });
}

StepMap* EngineStep::Without(int impact) {
  std::shared_ptr<Reduced>& reduced = without_[impact];
  if (reduced == nullptr) {
    reduced = std::make_shared<Reduced>();
    Scene scene = function_.scene();
    for (const Meeting& meeting : kinds_[impact]) {
      if (meeting.joint >= 0) {
        // A rope without limits would be a rod.
        BasicJoint<double>& joint = scene.joints[meeting.joint];
        joint.limits.reset();
        if (joint.type == JointType::kDistance) {
          joint.limits = {0.0, std::numeric_limits<double>::infinity()};
        }
      } else {
        scene.no_contact.emplace_back(scene.bodies[meeting.a].name, scene.bodies[meeting.b].name);
      }
    }
    std::vector<std::string> controls;
    for (const ParameterPath& path : function_.controls()) controls.push_back(path.path);
    if (reduced->function.Create(scene, {}, controls, {}).empty()) {
      reduced->step = std::make_unique<EngineStep>(reduced->function);
    }
  }
  return reduced->step.get();
}

JointState::Outcome EngineStep::ProjectOntoJoints(long k, VectorX<double>* x, double* error) {
  State<double> state = StateOf(k, *x);
  const JointState::Outcome outcome = joints_.Project(&state);
  *error = joints_.error();
  if (outcome == JointState::Outcome::kProjected) *x = function_.StateOf(state);
  return outcome;
}

MatrixX<double> EngineStep::JointProjector(long k, const VectorX<double>& x) const {
  const MatrixX<double> of_twists = joints_.Projector(StateOf(k, x));
  MatrixX<double> projector = MatrixX<double>::Zero(x.size(), x.size());
  // Of each body the pose, then the twist.
  for (Eigen::Index i = 0; i < of_twists.rows(); i += 3) {
    for (Eigen::Index j = 0; j < of_twists.cols(); j += 3) {
      const auto block = of_twists.block<3, 3>(i, j);
      projector.block<3, 3>(2 * i, 2 * j) = block;
      projector.block<3, 3>(2 * i + 3, 2 * j + 3) = block;
    }
  }
  return projector;
}

std::string EngineStep::DiscreteMapOf(long first, const RowMatrixXd& states,
                                      const RowMatrixXd& controls) {
  const ModelStructure& s = *model_.structure;
  if (s.settings.stepping != Stepping::kFixed || !MayTouch(s)) return "";
  DiscreteMapWatch watch(model_);
  VectorX<double> next;
  std::string error;
  for (Eigen::Index i = 0; i < controls.rows(); ++i) {
    const long k = first + i;
    if (!Advance(k, states.row(i).transpose(), controls.row(i).transpose(), &next, &error)) break;
    const std::vector<ContactChange>& changes = watch.AddStep(model_, stepper_.record());
    if (!changes.empty()) return TextOf(s, k, stepper_.record().time, changes.front());
  }
  return "";
}

bool EngineStep::Step(long k, const VectorX<double>& x, const VectorX<double>& u,
                      VectorX<double>* next, std::string* error) {
  return Advance(k, x, u, next, error);
}

bool EngineStep::Linearise(long k, const VectorX<double>& x, const VectorX<double>& u,
                           VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                           std::string* error) {
  return LineariseAlong(k, x, u, MatrixX<double>::Identity(num_states(), num_states()), next, a, b,
                        error);
}

bool EngineStep::LineariseAlong(long k, const VectorX<double>& x, const VectorX<double>& u,
                                const MatrixX<double>& columns, VectorX<double>* next,
                                MatrixX<double>* a, MatrixX<double>* b, std::string* error) {
  if (!Advance(k, x, u, next, error)) return false;
  w_dot_.setZero(controls_.rows(), columns.cols() + num_controls());
  w_dot_.rightCols(num_controls()) = controls_;
  for (int i = 0; i < num_states(); ++i) {
    w_dot_.row(function_.output_variables()[i]).head(columns.cols()) = columns.row(i);
  }
  tangent_.Apply(model_, &stepper_, &w_dot_);
  a->resize(num_states(), columns.cols());
  b->resize(num_states(), num_controls());
  for (int i = 0; i < num_states(); ++i) {
    const auto row = w_dot_.row(function_.output_variables()[i]);
    a->row(i) = row.head(columns.cols());
    b->row(i) = row.tail(num_controls());
  }
  if (a->allFinite() && b->allFinite()) return true;
  *error = "step " + std::to_string(k) + ": its derivative is not finite";
  return false;
}

}  // namespace tangible
