// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene_json.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "scene_texts.h"

namespace tangible {
namespace {

using Point = Vector2<double>;

class FullSceneTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    ASSERT_TRUE(ParseScene(kFullScene, "full.json", "", &scene_, &error)) << error;
  }
  Scene scene_;
};

TEST_F(FullSceneTest, SceneAndBodies) {
  EXPECT_EQ(scene_.name, "everything");
  EXPECT_EQ(scene_.path, "full.json");
  EXPECT_EQ(scene_.gravity, Point(0.5, -1.62));
  ASSERT_EQ(scene_.bodies.size(), 6u);
  const auto& ball = scene_.bodies[0];
  EXPECT_EQ(ball.name, "ball");
  EXPECT_EQ(ball.motion, Motion::kMoving);
  EXPECT_EQ(ball.shape.type, ShapeType::kCircle);
  EXPECT_EQ(ball.shape.numbers, std::vector<double>{0.1});
  EXPECT_EQ(ball.mass, 1.5);
  EXPECT_EQ(ball.inertia, 0.005);
  EXPECT_EQ(ball.position, Point(0.25, 1));
  EXPECT_EQ(ball.angle, 0.125);
  EXPECT_EQ(ball.velocity, Point(1, 2));
  EXPECT_EQ(ball.angular_velocity, 3);
  EXPECT_EQ(ball.friction, 0.3);
  EXPECT_EQ(ball.restitution, 0.5);
  EXPECT_EQ(ball.linear_damping, 0.01);
  EXPECT_EQ(ball.angular_damping, 0.02);
  EXPECT_FALSE(scene_.bodies[1].inertia.has_value());
  EXPECT_EQ(scene_.bodies[3].motion, Motion::kStatic);
  EXPECT_EQ(scene_.bodies[3].shape.numbers, (std::vector<double>{0, 2, 0.1}));
  EXPECT_EQ(scene_.bodies[3].position, Point(0, 0));
  EXPECT_EQ(scene_.bodies[4].motion, Motion::kKinematic);
  EXPECT_EQ(scene_.bodies[4].velocity, Point(0, 1));
  EXPECT_EQ(scene_.bodies[5].shape.type, ShapeType::kNone);
}

TEST_F(FullSceneTest, Joints) {
  ASSERT_EQ(scene_.joints.size(), 5u);
  const auto& hinge = scene_.joints[0];
  EXPECT_EQ(hinge.name, "hinge");
  EXPECT_EQ(hinge.type, JointType::kRevolute);
  EXPECT_EQ(hinge.bodies[0], 0);
  EXPECT_EQ(hinge.bodies[1], -1);
  EXPECT_EQ(hinge.anchors[0], Point(0, 2));
  EXPECT_EQ(hinge.angle, 0.1);
  EXPECT_EQ(hinge.rate, -0.2);
  EXPECT_EQ(hinge.damping, 0.3);
  ASSERT_TRUE(hinge.limits.has_value());
  EXPECT_EQ(*hinge.limits, std::make_pair(-1.0, 2.0));
  EXPECT_EQ(hinge.effort, 0.4);
  EXPECT_FALSE(hinge.contact);
  const auto& slider = scene_.joints[1];
  EXPECT_EQ(slider.type, JointType::kPrismatic);
  EXPECT_EQ(slider.bodies[0], 1);
  EXPECT_EQ(slider.bodies[1], 0);
  EXPECT_EQ(slider.axis, Point(3, 4));
  EXPECT_EQ(slider.angle, 0.6);
  EXPECT_EQ(slider.rate, 0.7);
  EXPECT_TRUE(slider.contact);
  EXPECT_EQ(scene_.joints[2].type, JointType::kWeld);
  EXPECT_EQ(scene_.joints[2].anchors[0], Point(2, 3));
  EXPECT_EQ(scene_.joints[3].type, JointType::kDistance);
  EXPECT_EQ(scene_.joints[3].anchors[0], Point(-3, 0));
  EXPECT_EQ(scene_.joints[3].anchors[1], Point(5, 5));
  EXPECT_EQ(scene_.joints[4].type, JointType::kFixedAngle);
}

TEST_F(FullSceneTest, SpringsForcesPairs) {
  ASSERT_EQ(scene_.springs.size(), 2u);
  const auto& spring = scene_.springs[0];
  EXPECT_EQ(spring.bodies[0], 0);
  EXPECT_EQ(spring.bodies[1], -1);
  EXPECT_EQ(spring.anchors[0], Point(0, 1));
  EXPECT_EQ(spring.anchors[1], Point(0, 2));
  EXPECT_EQ(spring.stiffness, 10);
  EXPECT_EQ(spring.damping, 0.1);
  EXPECT_EQ(spring.rest_length, 1);
  ASSERT_EQ(scene_.forces.size(), 2u);
  const auto& force = scene_.forces[0];
  EXPECT_EQ(force.body, 0);
  EXPECT_EQ(force.force, Point(1, 2));
  EXPECT_EQ(force.torque, 3);
  EXPECT_EQ(force.at, Point(4, 5));
  EXPECT_EQ(force.start, 0.25);
  EXPECT_EQ(force.end, 0.5);
  EXPECT_FALSE(scene_.forces[1].start.has_value());
  ASSERT_EQ(scene_.pairs.size(), 2u);
  EXPECT_EQ(scene_.pairs[0].bodies[0], "ball");
  EXPECT_EQ(scene_.pairs[0].bodies[1], "floor");
  EXPECT_EQ(scene_.pairs[0].friction, 0.9);
  EXPECT_EQ(scene_.pairs[0].restitution, 0.8);
  EXPECT_FALSE(scene_.pairs[1].restitution.has_value());
  ASSERT_EQ(scene_.no_contact.size(), 2u);
  EXPECT_EQ(scene_.no_contact[1], std::make_pair(std::string("paddle"), std::string("*")));
}

TEST_F(FullSceneTest, Simulation) {
  const SimulationSettings& settings = scene_.simulation;
  EXPECT_EQ(settings.dt, 0.002);
  EXPECT_EQ(settings.duration, 3);
  EXPECT_EQ(settings.stepping, Stepping::kEvent);
  EXPECT_EQ(settings.integrator, Integrator::kTrapezoidal);
  EXPECT_EQ(settings.joint_correction, JointCorrection::kProjection);
  EXPECT_EQ(settings.joint_tolerance, 1e-9);
  EXPECT_EQ(settings.friction_mixing, Mixing::kAverage);
  EXPECT_EQ(settings.restitution_mixing, Mixing::kGeometricMean);
  EXPECT_EQ(settings.impact_law, ImpactLaw::kPoisson);
  EXPECT_EQ(settings.restitution_threshold, 0.01);
  EXPECT_EQ(settings.recovery_speed, 2);
  EXPECT_EQ(settings.contact_margin, 0.001);
  EXPECT_EQ(settings.max_events_per_step, 7);
  EXPECT_EQ(settings.lcp_tolerance, 1e-11);
  EXPECT_EQ(settings.lcp_max_iterations, 50);
}

TEST(ParseSceneTest, DefaultsOfWhatIsLeftOut) {
  Scene scene;
  std::string error;
  // What the scene held before must not show.
  scene.gravity = Point(1, 1);
  scene.joints.emplace_back();
  scene.simulation.dt = 7.0;
  ASSERT_TRUE(ParseScene(R"({"bodies": [{"name": "b", "shape": {"circle": {"radius": 1}}, "mass": 1,
                             "position": [0, 0]}]})",
                         "s.json", "", &scene, &error))
      << error;
  EXPECT_EQ(scene.gravity, Point(0, -9.81));
  EXPECT_TRUE(scene.joints.empty());
  const auto& body = scene.bodies[0];
  EXPECT_EQ(body.angle, 0);
  EXPECT_EQ(body.velocity, Point(0, 0));
  EXPECT_EQ(body.friction, 0);
  EXPECT_EQ(body.restitution, 0);
  EXPECT_EQ(scene.simulation.dt, 0.01);
  EXPECT_EQ(scene.simulation.duration, 1.0);
  EXPECT_EQ(scene.simulation.stepping, Stepping::kFixed);
  EXPECT_EQ(scene.simulation.max_events_per_step, 100);
}

SimulationSettings SettingsOf(const std::string& simulation) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(R"({"bodies": [], "simulation": )" + simulation + "}", "s.json", "",
                         &scene, &error))
      << error;
  return scene.simulation;
}

TEST(ParseSceneTest, IntegratorAndCorrectionOfJointsFollowTheSteppingUnlessWritten) {
  const SimulationSettings fixed = SettingsOf("{}");
  EXPECT_EQ(IntegratorOf(fixed), Integrator::kSemiImplicitEuler);
  EXPECT_EQ(JointCorrectionOf(fixed), JointCorrection::kNone);
  const SimulationSettings event = SettingsOf(R"({"stepping": "event"})");
  EXPECT_EQ(IntegratorOf(event), Integrator::kRungeKutta4);
  EXPECT_EQ(JointCorrectionOf(event), JointCorrection::kProjection);
}

// Earlier files wrote these out.
TEST(ParseSceneTest, WithdrawnKeysAreReadWhereTheySayWhatEveryRunDoes) {
  const SimulationSettings settings =
      SettingsOf(R"({"dt": 0.5, "baumgarte": 0.2, "solver": "auto", "smoothing": 0})");
  EXPECT_EQ(settings.dt, 0.5);
}

TEST(ParseSceneTest, WhatIsWrittenHoldsWhateverTheOrderOfKeys) {
  for (const char* text :
       {R"({"stepping": "event", "integrator": "semi_implicit_euler", "joint_correction": "none"})",
        R"({"joint_correction": "none", "integrator": "semi_implicit_euler", "stepping": "event"})",
        R"({"integrator": "semi_implicit_euler", "stepping": "event",
            "joint_correction": "none"})"}) {
    const SimulationSettings settings = SettingsOf(text);
    EXPECT_EQ(settings.stepping, Stepping::kEvent);
    EXPECT_EQ(IntegratorOf(settings), Integrator::kSemiImplicitEuler) << text;
    EXPECT_EQ(JointCorrectionOf(settings), JointCorrection::kNone) << text;
  }
  for (const char* text : {R"({"stepping": "event", "joint_correction": "none"})",
                           R"({"joint_correction": "none", "stepping": "event"})"}) {
    EXPECT_EQ(IntegratorOf(SettingsOf(text)), Integrator::kRungeKutta4) << text;
  }
}

TEST(LoadSceneTest, SignalFilesAreRelativeToTheScene) {
  const std::string folder = ::testing::TempDir();
  std::ofstream(folder + "tangible_push.csv") << "time,x,y\n0,1,2\n1,3,4\n";
  std::ofstream(folder + "tangible_twist.csv") << "time,value\n0,5\n";
  std::ofstream(folder + "tangible_scene.json") << R"({
    "bodies": [{"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
    "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                "effort": {"file": "tangible_twist.csv"}}],
    "forces": [{"name": "f", "body": "b",
                "force": {"file": "tangible_push.csv", "interpolation": "linear"},
                "torque": {"file": "tangible_twist.csv", "interpolation": "constant"}}],
    "simulation": {"duration": 0}})";
  Scene scene;
  std::string error;
  ASSERT_TRUE(LoadScene(folder + "tangible_scene.json", &scene, &error)) << error;
  EXPECT_EQ(scene.path, folder + "tangible_scene.json");
  EXPECT_EQ(scene.simulation.duration, 0.0);
  ASSERT_TRUE(scene.joints[0].effort_signal.has_value());
  EXPECT_EQ(scene.joints[0].effort_signal->value, std::vector<double>{5});
  ASSERT_TRUE(scene.forces[0].force_signal.has_value());
  const Signal& force = *scene.forces[0].force_signal;
  EXPECT_EQ(force.file, "tangible_push.csv");
  EXPECT_EQ(force.interpolation, Signal::Interpolation::kLinear);
  EXPECT_EQ(force.x, (std::vector<double>{1, 3}));
  EXPECT_EQ(force.y, (std::vector<double>{2, 4}));
  ASSERT_TRUE(scene.forces[0].torque_signal.has_value());
  EXPECT_EQ(scene.forces[0].torque_signal->interpolation, Signal::Interpolation::kConstant);
}

TEST(LoadSceneTest, AMissingFileIsAnError) {
  Scene scene;
  std::string error;
  EXPECT_FALSE(LoadScene("/nowhere/s.json", &scene, &error));
  EXPECT_EQ(error, "/nowhere/s.json: cannot be read: No such file or directory");
}

TEST(ParseSceneTest, EveryPrefixOfAFileIsAnErrorOfOneLine) {
  const std::string text = kFullScene;
  for (std::size_t length = 0; length < text.size(); ++length) {
    Scene scene;
    std::string error;
    ASSERT_FALSE(ParseScene(text.substr(0, length), "half.json", "", &scene, &error)) << length;
    ASSERT_EQ(error.rfind("half.json: line ", 0), 0u) << error;
    ASSERT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace tangible
