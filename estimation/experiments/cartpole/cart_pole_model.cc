// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/cart_pole_model.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kForceSamples = 5;  // a random force is held for so many samples
// A wrong initial value of masses (kg) and length (m), and of dampings; estimates stay within a
// factor of kRange of it.
constexpr double kGuess = 1.0, kDampingGuess = 0.02, kRange = 100.0;

// d(world state) / d(joint coordinates), and the world state: cart, then pole, each x, y, angle,
// vx, vy, omega.
void ToWorld(const VectorX<double>& x, double arm, VectorX<double>* world, MatrixX<double>* d) {
  const double sine = std::sin(x[1]), cosine = std::cos(x[1]);
  const double v = x[2], omega = x[3];
  world->setZero(12);
  *world << x[0], 0.0, 0.0, v, 0.0, 0.0, x[0] - arm * sine, arm * cosine, x[1],
      v - arm * cosine * omega, -arm * sine * omega, omega;
  if (d == nullptr) return;
  d->setZero(12, 4);
  (*d)(0, 0) = (*d)(3, 2) = (*d)(6, 0) = (*d)(8, 1) = (*d)(9, 2) = (*d)(11, 3) = 1.0;
  (*d)(6, 1) = (*d)(9, 3) = -arm * cosine;
  (*d)(7, 1) = (*d)(10, 3) = -arm * sine;
  (*d)(9, 1) = arm * sine * omega;
  (*d)(10, 1) = -arm * cosine * omega;
}

// Of the world state, the joint coordinates' rows.
constexpr int kJointRows[] = {0, 8, 3, 11};

VectorX<double> ToJoints(const VectorX<double>& world) {
  return Eigen::Vector4d(world[kJointRows[0]], world[kJointRows[1]], world[kJointRows[2]],
                         world[kJointRows[3]]);
}

FitParameter Positive(const char* name, double guess, std::vector<ParameterSet> sets) {
  FitParameter parameter;
  parameter.name = name;
  parameter.initial = guess;
  parameter.lower = guess / kRange;
  parameter.upper = guess * kRange;
  parameter.sets = std::move(sets);
  return parameter;
}

FitParameter Free(const char* name, double initial, const char* path) {
  FitParameter parameter;
  parameter.name = name;
  parameter.initial = initial;
  parameter.sets = {{path}};
  return parameter;
}

Scene SceneOf(const CartPoleRecording& recording) {
  CartPole guess;
  guess.cart_mass = guess.pole_mass = guess.length = kGuess;
  guess.cart_damping = guess.pole_damping = kDampingGuess;
  Scene scene = CartPoleScene(guess);
  scene.simulation.duration = (recording.samples() - 1) * kCartPoleStep;
  Signal force;
  for (size_t k = 0; k < recording.forces.size(); ++k) {
    force.time.push_back(static_cast<double>(k) * kCartPoleStep);
  }
  force.value = recording.forces;
  scene.joints[0].effort_signal = force;
  scene.joints[1].angle = recording.positions(0, 1);
  scene.joints[0].angle = recording.positions(0, 0);
  return scene;
}

std::vector<Observation> ObservationsOf(const CartPoleRecording& recording) {
  std::vector<Observation> observations;
  for (int k = 0; k < recording.samples(); ++k) {
    const double time = k * kCartPoleStep;
    observations.push_back(
        {time, 0, -1, Coordinate::kX, recording.positions(k, 0), kPositionNoise});
    observations.push_back(
        {time, 1, -1, Coordinate::kAngle, recording.positions(k, 1), kAngleNoise});
  }
  return observations;
}

}  // namespace

Scene CartPoleScene(const CartPole& numbers) {
  Scene scene;
  scene.name = "cart and pole";
  scene.bodies.resize(2);
  BasicBody<double>& cart = scene.bodies[0];
  cart.name = "cart";
  cart.shape = {ShapeType::kBox, {0.3, 0.15}};
  cart.mass = numbers.cart_mass;
  BasicBody<double>& pole = scene.bodies[1];
  pole.name = "pole";
  pole.shape = {ShapeType::kBox, {kPoleWidth, numbers.length}};
  pole.mass = numbers.pole_mass;
  pole.position = {0.0, 0.5 * numbers.length};
  scene.joints.resize(2);
  BasicJoint<double>& rail = scene.joints[0];
  rail.name = "rail";
  rail.type = JointType::kPrismatic;
  rail.bodies[0] = 0;
  rail.damping = numbers.cart_damping;
  BasicJoint<double>& hinge = scene.joints[1];
  hinge.name = "hinge";
  hinge.bodies[0] = 1;
  hinge.bodies[1] = 0;
  hinge.damping = numbers.pole_damping;
  scene.simulation.dt = kCartPoleStep;
  scene.simulation.stepping = Stepping::kEvent;
  return scene;
}

void SetCartPoleState(const CartPole& numbers, const CartPoleState& x, State<double>* state) {
  VectorX<double> world;
  ToWorld(x, 0.5 * numbers.length, &world, nullptr);
  for (int body = 0; body < 2; ++body) {
    std::copy_n(world.data() + 6 * body, 3, state->pose.data() + 3 * body);
    std::copy_n(world.data() + 6 * body + 3, 3, state->twist.data() + 3 * body);
  }
}

CartPoleStep::CartPoleStep(const CartPole& numbers) : arm_(0.5 * numbers.length) {
  const std::string error =
      function_.Create(CartPoleScene(numbers), {}, {"joints/rail/effort"}, {});
  CHECK(error.empty()) << error;
  engine_.emplace(function_);
}

bool CartPoleStep::Step(long k, const VectorX<double>& x, const VectorX<double>& u,
                        VectorX<double>* next, std::string* error) {
  VectorX<double> world;
  ToWorld(x, arm_, &world, nullptr);
  if (!engine_->Step(k, world, u, &next_, error)) return false;
  *next = ToJoints(next_);
  return true;
}

bool CartPoleStep::Linearise(long k, const VectorX<double>& x, const VectorX<double>& u,
                             VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                             std::string* error) {
  VectorX<double> world;
  MatrixX<double> d_world;
  ToWorld(x, arm_, &world, &d_world);
  if (!engine_->LineariseAlong(k, world, u, d_world, &next_, &a_, &b_, error)) return false;
  *next = ToJoints(next_);
  a->resize(4, 4);
  b->resize(4, 1);
  for (int i = 0; i < 4; ++i) {
    a->row(i) = a_.row(kJointRows[i]);
    b->row(i) = b_.row(kJointRows[i]);
  }
  return true;
}

CartPoleRecording CartPoleRecording::Head(int samples) const {
  CartPoleRecording head;
  head.forces.assign(forces.begin(), forces.begin() + (samples - 1));
  head.positions = positions.topRows(samples);
  head.truth.assign(truth.begin(), truth.begin() + samples);
  return head;
}

CartPoleRecording RecordRandomly(CartPolePlant* plant, int samples, unsigned seed) {
  std::mt19937_64 random = Generator(seed, 0);
  CartPoleRecording recording;
  recording.positions.resize(samples, 2);
  CartPoleState state(0.0, std::numbers::pi, 0.0, 0.0);
  double force = 0.0;
  for (int k = 0; k < samples; ++k) {
    recording.truth.push_back(state);
    recording.positions(k, 0) = state[0] + kPositionNoise * Normal(&random);
    recording.positions(k, 1) = state[1] + kAngleNoise * Normal(&random);
    if (k + 1 == samples) break;
    if (k % kForceSamples == 0) force = Uniform(-kCartPoleForce, kCartPoleForce, &random);
    recording.forces.push_back(force);
    state = plant->Advance(state, force, kCartPoleStep);
  }
  return recording;
}

CartPoleEstimate EstimateCartPole(const CartPoleRecording& recording) {
  const std::vector<FitParameter> parameters = {
      Positive("cart mass", kGuess, {{"bodies/cart/mass"}}),
      Positive("pole mass", kGuess, {{"bodies/pole/mass"}}),
      Positive("length", kGuess, {{"bodies/pole/shape/size/y"}, {"bodies/pole/position/y", 0.5}}),
      Positive("cart damping", kDampingGuess, {{"joints/rail/damping"}}),
      Positive("pole damping", kDampingGuess, {{"joints/hinge/damping"}}),
      Free("x at the start", recording.positions(0, 0), "joints/rail/displacement"),
      Free("angle at the start", recording.positions(0, 1), "joints/hinge/angle"),
      Free("speed at the start", 0.0, "joints/rail/rate"),
      Free("rate at the start", 0.0, "joints/hinge/rate")};
  CartPoleEstimate estimate;
  ParameterizedScene scene;
  ParameterError error;
  CHECK(scene.Create(SceneOf(recording), {}, parameters, &error)) << error.what;
  RolloutResiduals residuals(std::move(scene), ObservationsOf(recording));
  FitOptions options;
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.profile_pass = ProfilePass::kSkip;
  options.threads = 1;
  estimate.fit = Fit(options, &residuals, {});
  estimate.names = {"cart mass", "pole mass", "length", "cart damping", "pole damping"};
  const Eigen::VectorXd& p = estimate.fit.estimate;
  estimate.ok = p.size() == 9 && p.allFinite();
  if (estimate.ok) estimate.numbers = {p[0], p[1], p[2], p[3], p[4]};
  return estimate;
}

std::vector<double> NumbersOf(const CartPole& numbers) {
  return {numbers.cart_mass, numbers.pole_mass, numbers.length, numbers.cart_damping,
          numbers.pole_damping};
}

}  // namespace tangible
