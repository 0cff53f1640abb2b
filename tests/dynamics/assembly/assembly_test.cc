// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/assembly.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

struct Assembled {
  Model<double> model;
  State<double> state;
  AssemblyScratch<double> scratch;
  ContactProblem<double> problem;
};

Assembled Assemble(const Scene& scene, double t, double h) {
  Assembled a;
  BuildModel(scene, &a.model, &a.state);
  AssembleWithoutContacts(a.model, a.state, t, h, &a.problem, &a.scratch);
  return a;
}

TEST(AssemblyTest, AFreeBodyByHand) {
  const Scene scene = SceneOf(R"({"gravity": [1, -10], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [0, 0], "velocity": [3, 4],
       "angular_velocity": 6, "linear_damping": 0.7, "angular_damping": 0.9}],
    "forces": [{"name": "f", "body": "a", "force": [5, 0], "torque": 2, "at": [0, 1],
                "end": 0.05}]})");
  const Assembled a = Assemble(scene, 0.0, 0.1);
  const ContactProblem<double>& p = a.problem;
  EXPECT_DOUBLE_EQ(p.mass[0], 2.07);  // damping is implicit
  EXPECT_DOUBLE_EQ(p.mass[2], 0.59);
  EXPECT_DOUBLE_EQ(p.load[0], 2.0 * (3.0 + 0.1) + 0.25);  // half of the step's force
  EXPECT_DOUBLE_EQ(p.load[1], 2.0 * (4.0 - 1.0));
  EXPECT_DOUBLE_EQ(p.load[2], 3.0 - 0.25 + 0.1);
  EXPECT_TRUE(p.dampers.empty());
  EXPECT_TRUE(p.contacts.empty());
}

TEST(AssemblyTest, SpringsPullAndDampAlongTheirLine) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [2, 0]},
      {"name": "k", "kinematic": true, "position": [0, 0], "velocity": [0.5, 0]}],
    "springs": [{"name": "s", "bodies": ["a", "k"], "anchors": [[2, 0], [0, 0]], "stiffness": 10,
                 "damping": 3, "rest_length": 1.5}]})");
  const ContactProblem<double> p = Assemble(scene, 0.0, 0.1).problem;
  // −h k (ℓ − L0) and the damper's share of the carrier's prescribed speed, h c v.
  EXPECT_DOUBLE_EQ(p.load[0], -0.5 + 0.15);
  ASSERT_EQ(p.dampers.size(), 1u);
  EXPECT_DOUBLE_EQ(p.dampers[0].weight, 0.3);
  EXPECT_EQ(p.dampers[0].b, -1);
  EXPECT_DOUBLE_EQ(p.dampers[0].row_a[0], 1.0);
}

TEST(AssemblyTest, JointsWithPrescribedTwistsAndDrives) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [1, 0]},
      {"name": "k", "kinematic": true, "position": [0, 0], "velocity": [0.5, 0.25],
       "angular_velocity": 2}],
    "joints": [{"name": "j", "type": "revolute", "bodies": ["a", "k"], "anchor": [0.5, 0],
                "damping": 0.4, "effort": 7}]})");
  Assembled a = Assemble(scene, 0.0, 0.1);
  a.state.pose[0] += 0.01;  // drift, which a step does not correct
  AssembleWithoutContacts(a.model, a.state, 0.0, 0.1, &a.problem, &a.scratch);
  const JointBlock<double>& joint = a.problem.joints[0];
  // The anchor of k moves at (0.5, 0.25) + 2 (0, 0.5).
  EXPECT_NEAR(joint.rhs[0], 0.5, 1e-15);
  EXPECT_NEAR(joint.rhs[1], 1.25, 1e-15);
  EXPECT_DOUBLE_EQ(joint.row_a[1][2], -0.5);
  EXPECT_EQ(joint.b, -1);
  // Effort h 7 on a, damping h 0.4 of the relative rate with k's part known.
  EXPECT_NEAR(a.problem.load[2], 0.7 + 0.04 * 2.0, 1e-15);
  EXPECT_DOUBLE_EQ(a.problem.dampers[0].weight, 0.04);
}

TEST(AssemblyTest, ContactsHaveOnlyTheRowsTheyNeed) {
  Scene scene = test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.1})"));
  scene.bodies[0].velocity.y() = -2.0;
  scene.bodies[1].motion = Motion::kKinematic;
  scene.bodies[1].velocity = Vector2<double>(0.3, 0.2);
  Assembled a = Assemble(scene, 0.0, 0.1);
  ActiveContact contact;
  contact.a = 0;
  contact.b = 1;
  contact.feature.kind = FeatureKind::kVertexPlane;
  CoefficientSource friction, restitution;
  restitution.value = 0.5;
  for (const ContactLaw law : {ContactLaw::kGap, ContactLaw::kRestitution}) {
    for (const double mu : {0.0, 0.3}) {
      contact.law = law;
      friction.value = mu;
      AssembleContacts(a.model, a.state, 0.1, {contact}, {friction}, {restitution}, &a.scratch,
                       &a.problem);
      const ContactBlock<double>& block = a.problem.contacts[0];
      EXPECT_EQ(block.has_friction, mu > 0.0);
      EXPECT_EQ(block.b, -1);
      // The floor rises at 0.2; it approaches at 2.2 and would be thrown back with half of that.
      EXPECT_NEAR(block.c_n, (law == ContactLaw::kGap ? 0.0 : -1.1) - 0.2, 1e-15);
      EXPECT_NEAR(block.c_t, -0.3, 1e-15);
    }
  }
}

// The problem of accelerations at t = 0.
ContactProblem<double> AssembleAccelerations(const std::string& text) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(text), &model, &state);
  AssemblyScratch<double> scratch;
  ContactProblem<double> problem;
  AssembleAcceleration(model, state, 0.0, 0.005, {}, {}, &scratch, &problem);
  return problem;
}

// K x = (f, −rates), by the mode system.
std::vector<double> Accelerations(const ContactProblem<double>& p) {
  ContactSystem system;
  EXPECT_TRUE(system.Factor(p, {}));
  std::vector<double> x(3 * system.num_blocks(), 0.0);
  std::copy(p.load.begin(), p.load.end(), x.begin());
  for (size_t j = 0; j < p.joints.size(); ++j) {
    std::copy_n(p.joints[j].rhs, p.joints[j].rows, &x[3 * (p.num_bodies + j)]);
  }
  system.Solve(p, {}, x.data(), 1);
  return x;
}

TEST(AssembleAccelerationTest, ForcesOfAFreeBody) {
  const ContactProblem<double> p = AssembleAccelerations(R"({"gravity": [1, -9], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [0, 0], "angle": 0.5, "velocity": [3, -1],
       "angular_velocity": 2, "linear_damping": 0.1, "angular_damping": 0.2}],
    "springs": [{"name": "s", "bodies": ["a", "world"], "anchors": [[0, 0], [2, 0]], "stiffness": 4,
                 "damping": 0.5, "rest_length": 1.5}],
    "forces": [{"name": "on", "body": "a", "force": [0, 6], "torque": 0.3, "at": [0.5, 0]},
               {"name": "off", "body": "a", "force": [100, 0], "start": 0.1}]})");
  // m g − c v + k (ℓ − L0) − c_s (d·v) + F; the spring shortens at 3 m/s.
  EXPECT_NEAR(p.load[0], 2 * 1 - 0.1 * 3 + 4 * 0.5 - 0.5 * 3, 1e-14);
  EXPECT_NEAR(p.load[1], 2 * -9 + 0.1 + 6, 1e-14);
  EXPECT_NEAR(p.load[2], -0.2 * 2 + 0.3 + 0.5 * std::cos(0.5) * 6, 1e-14);
}

TEST(AssembleAccelerationTest, APendulumsAngularAcceleration) {
  // θ'' = −m g ℓ sin θ / (I + m ℓ²) − c θ' / (I + m ℓ²) + effort / (I + m ℓ²).
  const ContactProblem<double> p =
      AssembleAccelerations(R"({"bodies": [{"name": "a", "mass": 2, "inertia": 0.3,
      "position": [0.8, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "damping": 0.1, "effort": 0.7, "rate": 1.5}]})");
  const double about_pin = 0.3 + 2 * 0.64;
  const double alpha = (-2 * 9.81 * 0.8 - 0.1 * 1.5 + 0.7) / about_pin;
  const std::vector<double> x = Accelerations(p);
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
  AssemblyScratch<double> scratch;
  ContactProblem<double> problem;
  AssembleCorrection(model, state, {contact}, {CoefficientSource()}, 1.0, &scratch, &problem);
  EXPECT_NEAR(problem.contacts[0].c_n, -1e-3, 1e-15);
  // Out of deep penetration no faster than allowed.
  contact.law = ContactLaw::kRecovery;
  AssembleCorrection(model, state, {contact}, {CoefficientSource()}, 1e-4, &scratch, &problem);
  EXPECT_DOUBLE_EQ(problem.contacts[0].c_n, -1e-4);
}

}  // namespace
}  // namespace tangible
