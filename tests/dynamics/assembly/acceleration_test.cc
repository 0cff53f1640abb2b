// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/acceleration.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

struct Built {
  Model<double> model;
  State<double> state;
  ContactProblem<double> problem;
};

Built Assemble(const std::string& text, double t = 0.0, double middle = 0.005) {
  Built built;
  BuildModel(SceneOf(text), &built.model, &built.state);
  AccelerationScratch<double> scratch;
  AssembleAcceleration(built.model, built.state, t, middle, {}, {}, &scratch, &built.problem);
  return built;
}

// K x = (f, −rates), by the mode system.
std::vector<double> Accelerations(const ContactProblem<double>& p) {
  ContactSystem system;
  EXPECT_TRUE(system.Factor(p, {}));
  std::vector<double> x(3 * system.num_blocks(), 0.0);
  std::copy(p.momentum.begin(), p.momentum.end(), x.begin());
  for (size_t j = 0; j < p.joints.size(); ++j) {
    std::copy_n(p.joints[j].rhs, p.joints[j].rows, &x[3 * (p.num_bodies + j)]);
  }
  system.Solve(p, {}, x.data(), 1);
  return x;
}

TEST(AssembleAccelerationTest, ForcesOfAFreeBody) {
  const Built b = Assemble(R"({"gravity": [1, -9], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [0, 0], "angle": 0.5, "velocity": [3, -1],
       "angular_velocity": 2, "linear_damping": 0.1, "angular_damping": 0.2}],
    "springs": [{"name": "s", "bodies": ["a", "world"], "anchors": [[0, 0], [2, 0]], "stiffness": 4,
                 "damping": 0.5, "rest_length": 1.5}],
    "forces": [{"name": "on", "body": "a", "force": [0, 6], "torque": 0.3, "at": [0.5, 0]},
               {"name": "off", "body": "a", "force": [100, 0], "start": 0.1}]})");
  // m g − c v + k (ℓ − L0) − c_s (d·v) + F; the spring shortens at 3 m/s.
  EXPECT_NEAR(b.problem.momentum[0], 2 * 1 - 0.1 * 3 + 4 * 0.5 - 0.5 * 3, 1e-14);
  EXPECT_NEAR(b.problem.momentum[1], 2 * -9 + 0.1 + 6, 1e-14);
  EXPECT_NEAR(b.problem.momentum[2], -0.2 * 2 + 0.3 + 0.5 * std::cos(0.5) * 6, 1e-14);
}

TEST(AssembleAccelerationTest, APendulumsAngularAcceleration) {
  // θ'' = −m g ℓ sin θ / (I + m ℓ²) − c θ' / (I + m ℓ²) + effort / (I + m ℓ²).
  const Built b = Assemble(R"({"bodies": [{"name": "a", "mass": 2, "inertia": 0.3,
      "position": [0.8, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "damping": 0.1, "effort": 0.7, "rate": 1.5}]})");
  const double about_pin = 0.3 + 2 * 0.64;
  const double alpha = (-2 * 9.81 * 0.8 - 0.1 * 1.5 + 0.7) / about_pin;
  const std::vector<double> x = Accelerations(b.problem);
  EXPECT_NEAR(x[2], alpha, 1e-12);
  EXPECT_NEAR(x[1], 0.8 * alpha, 1e-12);
  EXPECT_NEAR(x[0], -0.8 * 1.5 * 1.5, 1e-12);  // towards the pin
}

TEST(AssembleCorrectionTest, ANewtonStepOntoTheSurface) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01})")), &model, &state);
  state.pose[1] -= 1e-3;
  ActiveContact contact;
  contact.a = 0;
  contact.b = 1;
  contact.feature = {FeatureKind::kVertexPlane, 0, 0};
  contact.law = ContactLaw::kInelastic;
  AccelerationScratch<double> scratch;
  ContactProblem<double> problem;
  AssembleCorrection(model, state, {contact}, {CoefficientSource()}, 1.0, &scratch, &problem);
  EXPECT_NEAR(problem.contacts[0].c_n, -1e-3, 1e-15);
  // Out of deep penetration no faster than allowed.
  contact.law = ContactLaw::kRecovery;
  AssembleCorrection(model, state, {contact}, {CoefficientSource()}, 1e-4, &scratch, &problem);
  EXPECT_DOUBLE_EQ(problem.contacts[0].c_n, -1e-4);
}

TEST(SignalAtTest, KeepsThePieceThatWasChosen) {
  Signal signal;
  signal.time = {0.0, 1.0, 2.0};
  signal.value = {1.0, 3.0, 0.0};
  double slope;
  EXPECT_EQ(SignalAt(signal, signal.value, 1.0, 0.5, &slope), 1.0);
  EXPECT_EQ(slope, 0.0);
  signal.interpolation = Signal::Interpolation::kLinear;
  EXPECT_EQ(SignalAt(signal, signal.value, 1.0, 0.5, &slope), 3.0);
  EXPECT_EQ(slope, 2.0);
  EXPECT_EQ(SignalAt(signal, signal.value, 1.5, 1.2, &slope), 1.5);
  EXPECT_EQ(slope, -3.0);
  EXPECT_EQ(SignalAt(signal, signal.value, 2.5, 2.5, &slope), 0.0);
}

}  // namespace
}  // namespace tangible
