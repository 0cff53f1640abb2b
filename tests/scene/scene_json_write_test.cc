// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "scene_texts.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

// The bits of every number, with its path.
std::vector<std::pair<std::string, std::string>> Bits(Scene* scene) {
  std::vector<std::pair<std::string, std::string>> bits;
  for (const auto& number : EnumerateNumbers(scene)) {
    bits.emplace_back(number.path,
                      std::string(reinterpret_cast<const char*>(number.value), sizeof(double)));
  }
  return bits;
}

Scene Parsed(const std::string& text) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(text, "s.json", ::testing::TempDir(), &scene, &error)) << error;
  return scene;
}

TEST(SceneToJsonTest, AllThatWasReadIsWritten) {
  // The text that was read is contained in the text that is written, key by key; so nothing is lost
  // that the reader's tests have seen arrive.
  const Json before = Json::parse(kFullScene);
  const Json after = Json::parse(SceneToJson(Parsed(kFullScene)));
  const Json flat_before = before.flatten();
  const Json flat_after = after.flatten();
  for (const auto& item : flat_before.items()) {
    ASSERT_TRUE(flat_after.contains(item.key())) << item.key();
    EXPECT_EQ(flat_after[item.key()], item.value()) << item.key();
  }
}

// Servos of an effort, of one component of a force, and of a torque that follows a series.
constexpr char kServos[] =
    R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
  "joints": [{"name": "h", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
    "effort": {"target": 0.5, "stiffness": 3, "damping": 0.25, "limit": 2}}],
  "forces": [{"name": "f", "body": "a", "force": [1, {"target": 2, "stiffness": 4}],
    "torque": {"target": {"time": [0, 1], "value": [0, 2], "interpolation": "linear"},
               "stiffness": 5}}]})";

TEST(SceneToJsonTest, ServosAreReadAndWritten) {
  const Scene scene = Parsed(kServos);
  const Json joint = Json::parse(SceneToJson(scene)).at("joints").at(0);
  EXPECT_EQ(joint.at("effort"), Json::parse(kServos).at("joints").at(0).at("effort"));
  const Json force = Json::parse(SceneToJson(scene)).at("forces").at(0);
  EXPECT_EQ(force.at("force").at(0), 1.0);
  EXPECT_EQ(force.at("force").at(1),
            Json::parse(R"({"target": 2.0, "stiffness": 4.0, "damping": 0.0})"));
  EXPECT_EQ(force.at("torque").at("target"),
            Json::parse(kServos).at("forces").at(0).at("torque").at("target"));
  EXPECT_EQ(SceneToJson(Parsed(SceneToJson(scene))), SceneToJson(scene));
  // A model in Jets has the same numbers, and paths name them.
  BasicScene<Jet<kLocalJetWidth>> cast = CastScene<Jet<kLocalJetWidth>>(scene);
  std::vector<std::string> paths;
  for (const auto& number : EnumerateNumbers(&cast)) {
    if (number.path.rfind("forces/f/", 0) == 0) paths.push_back(number.path);
    if (number.path == "joints/h/effort/limit") {
      EXPECT_EQ(number.value->a, 2.0);
    }
    if (number.path == "forces/f/torque/stiffness") {
      EXPECT_EQ(number.value->a, 5.0);
    }
  }
  EXPECT_EQ(paths, (std::vector<std::string>{
                       "forces/f/force/x", "forces/f/force/y/target", "forces/f/force/y/stiffness",
                       "forces/f/force/y/damping", "forces/f/torque/stiffness",
                       "forces/f/torque/damping", "forces/f/at/x", "forces/f/at/y"}));
  EXPECT_EQ(cast.forces[0].torque_servo->target_signal->value, (std::vector<double>{0.0, 2.0}));
}

TEST(SceneToJsonTest, SupportsAreReadAndWritten) {
  const char text[] = R"({"bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0], "support": {"friction": 0.3}},
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
       "support": {"friction": 0.3, "load": 4.5, "points": [[0.1, 0.0], [-0.1, 0.25]],
                   "shares": [1.0, 2.0]}},
      {"name": "c", "mass": 1, "inertia": 1, "position": [0, 0],
       "support": {"friction": 0.0, "radius": 0.5}}]})";
  const Scene scene = Parsed(text);
  const Json before = Json::parse(text);
  const Json after = Json::parse(SceneToJson(scene));
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(after["bodies"][i]["support"], before["bodies"][i]["support"]);
  }
  BasicScene<Jet<kLocalJetWidth>> cast = CastScene<Jet<kLocalJetWidth>>(scene);
  std::vector<std::string> paths;
  for (const auto& number : EnumerateNumbers(&cast)) {
    if (number.path.find("/support/") != std::string::npos) paths.push_back(number.path);
  }
  EXPECT_EQ(
      paths,
      (std::vector<std::string>{
          "bodies/a/support/friction", "bodies/b/support/friction", "bodies/b/support/load",
          "bodies/b/support/points/0/x", "bodies/b/support/points/0/y",
          "bodies/b/support/points/1/x", "bodies/b/support/points/1/y", "bodies/b/support/shares/0",
          "bodies/b/support/shares/1", "bodies/c/support/friction", "bodies/c/support/radius"}));
}

TEST(SceneToJsonTest, ALimitThatLimitsNothingIsNull) {
  Json text = Json::parse(kFullScene);
  text["joints"][3]["limits"] = {0.0, nullptr};
  text["joints"][0]["limits"] = {nullptr, 1.0};
  const Json after = Json::parse(SceneToJson(Parsed(text.dump())));
  EXPECT_EQ(after["joints"][3]["limits"], Json::parse("[0.0, null]"));
  EXPECT_EQ(after["joints"][0]["limits"], Json::parse("[null, 1.0]"));
}

TEST(SceneToJsonTest, RoundTripBitForBit) {
  Scene scene = Parsed(kFullScene);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.1, 0.9);
  for (const auto& number : EnumerateNumbers(&scene)) {
    // The outline must not cross itself and the limits in order.
    if (number.path.find("vertices") != std::string::npos) continue;
    if (number.path.find("limits/0") != std::string::npos) continue;
    if (number.path.find("/start") != std::string::npos) continue;
    *number.value = uniform(random) + (number.path.find("/end") != std::string::npos ? 1.0 : 0.0);
  }
  scene.bodies[0].velocity.x() = -0.0;
  scene.bodies[0].velocity.y() = 5e-324;
  scene.simulation.dt = 0.1 / 3.0;
  Scene back = Parsed(SceneToJson(scene));
  EXPECT_EQ(Bits(&scene), Bits(&back));
  EXPECT_EQ(back.simulation.dt, scene.simulation.dt);
  EXPECT_TRUE(std::signbit(back.bodies[0].velocity.x()));
  EXPECT_EQ(SceneToJson(back), SceneToJson(scene));
}

TEST(SceneToJsonTest, FrictionInJointsReadsBack) {
  const std::string text =
      R"({"bodies": [{"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
      "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                  "friction": 2, "kinetic_friction": 0.5, "stribeck_speed": 5e-324}]})";
  Scene scene = Parsed(text);
  Scene back = Parsed(SceneToJson(scene));
  EXPECT_EQ(back.joints[0].friction, 2.0);
  EXPECT_EQ(back.joints[0].kinetic_friction, 0.5);
  EXPECT_EQ(back.joints[0].stribeck_speed, 5e-324);
  EXPECT_EQ(Bits(&scene), Bits(&back));
}

TEST(SceneToJsonTest, EllipsesAndContactPointsReadBack) {
  const std::string text =
      R"({"bodies": [{"name": "foot", "shape": {"ellipse": {"radii": [0.1, 0.3]}},
      "contact_points": [[0.1, -0.2], [0.3, 5e-324]], "mass": 1, "position": [0, 0]}]})";
  Scene scene = Parsed(text);
  Scene back = Parsed(SceneToJson(scene));
  ASSERT_EQ(back.bodies[0].contact_points.size(), 2U);
  EXPECT_EQ(back.bodies[0].contact_points[1], Vector2<double>(0.3, 5e-324));
  EXPECT_EQ(Bits(&scene), Bits(&back));
  EXPECT_EQ(SceneToJson(back), SceneToJson(scene));
  std::vector<std::string> paths;
  for (const auto& number : EnumerateNumbers(&scene)) {
    paths.push_back(number.path);
  }
  const std::vector<std::string> last(paths.end() - 6, paths.end());
  EXPECT_EQ(last, (std::vector<std::string>{
                      "bodies/foot/shape/radii/x", "bodies/foot/shape/radii/y",
                      "bodies/foot/contact_points/0/x", "bodies/foot/contact_points/0/y",
                      "bodies/foot/contact_points/1/x", "bodies/foot/contact_points/1/y"}));
  // A copy in another scalar keeps the points.
  EXPECT_EQ(CastScene<double>(scene).bodies[0].contact_points[0], Vector2<double>(0.1, -0.2));
}

// Every combination, of what is set and what follows the stepping, reads back as it was.
TEST(SceneToJsonTest, IntegratorAndCorrectionOfJointsReadBackTheSame) {
  Scene scene = Parsed(kFullScene);
  const std::optional<Integrator> integrators[] = {std::nullopt, Integrator::kSemiImplicitEuler,
                                                   Integrator::kRungeKutta4};
  const std::optional<JointCorrection> corrections[] = {std::nullopt, JointCorrection::kNone,
                                                        JointCorrection::kProjection};
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    for (const auto& integrator : integrators) {
      for (const auto& correction : corrections) {
        scene.simulation.stepping = stepping;
        scene.simulation.integrator = integrator;
        scene.simulation.joint_correction = correction;
        const SimulationSettings back = Parsed(SceneToJson(scene)).simulation;
        EXPECT_EQ(back.stepping, stepping);
        EXPECT_EQ(back.integrator, integrator);
        EXPECT_EQ(back.joint_correction, correction);
      }
    }
  }
}

TEST(SceneToJsonTest, SignalsAreWrittenAsTheirFile) {
  std::ofstream(::testing::TempDir() + "tangible_signal.csv") << "time,x,value\n0,1,2\n";
  const std::string text = R"({
    "bodies": [{"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
    "forces": [{"name": "f", "body": "b",
                "force": {"file": "tangible_signal.csv", "interpolation": "linear"},
                "torque": {"file": "tangible_signal.csv"}}]})";
  const Scene back = Parsed(SceneToJson(Parsed(text)));
  ASSERT_TRUE(back.forces[0].force_signal.has_value());
  EXPECT_EQ(back.forces[0].force_signal->interpolation, Signal::Interpolation::kLinear);
  EXPECT_EQ(back.forces[0].force_signal->x, std::vector<double>{1.0});
  ASSERT_TRUE(back.forces[0].torque_signal.has_value());
  EXPECT_EQ(back.forces[0].torque_signal->value, std::vector<double>{2.0});
  const std::string whole = SceneWithSignalsToJson(back);
  EXPECT_EQ(whole.find("tangible_signal.csv"), std::string::npos);
  const Scene moved = Parsed(whole);
  EXPECT_EQ(moved.forces[0].force_signal->x, std::vector<double>{1.0});
  EXPECT_EQ(moved.forces[0].force_signal->interpolation, Signal::Interpolation::kLinear);
  EXPECT_EQ(moved.forces[0].torque_signal->value, std::vector<double>{2.0});
  EXPECT_EQ(SceneToJson(moved), whole);
}

}  // namespace
}  // namespace tangible
