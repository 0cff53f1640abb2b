// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/parameter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "scene_texts.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

class ParameterTest : public ::testing::Test {
 protected:
  void SetUp() override { Load(kFullScene); }

  void Load(const std::string& text) {
    std::string error;
    ASSERT_TRUE(ParseScene(text, "s.json", "", &scene_, &error)) << error;
    paths_.clear();
    for (const auto& number : EnumerateNumbers(&scene_)) paths_.push_back(number.path);
  }

  ParameterPath Resolved(const std::string& path) {
    ParameterPath parameter;
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene_, path, &parameter, &error)) << error;
    return parameter;
  }

  std::vector<std::string> Matches(const std::string& path) {
    std::vector<std::string> matches;
    for (const int i : Resolved(path).numbers) matches.push_back(paths_[i]);
    return matches;
  }

  std::string Error(const std::string& path) {
    ParameterPath parameter;
    std::string error;
    EXPECT_FALSE(ResolveParameter(scene_, path, &parameter, &error)) << path;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  }

  Scene scene_;
  std::vector<std::string> paths_;
};

using Strings = std::vector<std::string>;

TEST_F(ParameterTest, EveryNumberOnceInOrder) {
  const Strings expected = {
      "gravity/x", "gravity/y",
      // ball
      "bodies/ball/mass", "bodies/ball/inertia", "bodies/ball/position/x", "bodies/ball/position/y",
      "bodies/ball/angle", "bodies/ball/velocity/x", "bodies/ball/velocity/y",
      "bodies/ball/angular_velocity", "bodies/ball/friction", "bodies/ball/restitution",
      "bodies/ball/linear_damping", "bodies/ball/angular_damping", "bodies/ball/shape/radius",
      // rod: its inertia follows
      "bodies/rod/mass", "bodies/rod/position/x", "bodies/rod/position/y", "bodies/rod/angle",
      "bodies/rod/velocity/x", "bodies/rod/velocity/y", "bodies/rod/angular_velocity",
      "bodies/rod/friction", "bodies/rod/restitution", "bodies/rod/linear_damping",
      "bodies/rod/angular_damping", "bodies/rod/shape/length", "bodies/rod/shape/radius",
      // hull
      "bodies/hull/mass", "bodies/hull/position/x", "bodies/hull/position/y", "bodies/hull/angle",
      "bodies/hull/velocity/x", "bodies/hull/velocity/y", "bodies/hull/angular_velocity",
      "bodies/hull/friction", "bodies/hull/restitution", "bodies/hull/linear_damping",
      "bodies/hull/angular_damping", "bodies/hull/shape/vertices/0/x",
      "bodies/hull/shape/vertices/0/y", "bodies/hull/shape/vertices/1/x",
      "bodies/hull/shape/vertices/1/y", "bodies/hull/shape/vertices/2/x",
      "bodies/hull/shape/vertices/2/y",
      // floor: static
      "bodies/floor/position/x", "bodies/floor/position/y", "bodies/floor/angle",
      "bodies/floor/friction", "bodies/floor/restitution", "bodies/floor/shape/normal/x",
      "bodies/floor/shape/normal/y", "bodies/floor/shape/offset",
      // paddle: kinematic
      "bodies/paddle/position/x", "bodies/paddle/position/y", "bodies/paddle/angle",
      "bodies/paddle/velocity/x", "bodies/paddle/velocity/y", "bodies/paddle/angular_velocity",
      "bodies/paddle/friction", "bodies/paddle/restitution", "bodies/paddle/shape/size/x",
      "bodies/paddle/shape/size/y",
      // mass: no shape
      "bodies/mass/mass", "bodies/mass/inertia", "bodies/mass/position/x", "bodies/mass/position/y",
      "bodies/mass/angle", "bodies/mass/velocity/x", "bodies/mass/velocity/y",
      "bodies/mass/angular_velocity", "bodies/mass/friction", "bodies/mass/restitution",
      "bodies/mass/linear_damping", "bodies/mass/angular_damping",
      // joints
      "joints/hinge/anchor/x", "joints/hinge/anchor/y", "joints/hinge/angle", "joints/hinge/rate",
      "joints/hinge/damping", "joints/hinge/limits/0", "joints/hinge/limits/1",
      "joints/hinge/limit_restitution", "joints/hinge/motor/speed", "joints/hinge/motor/limit",
      "joints/hinge/effort", "joints/slider/anchor/x", "joints/slider/anchor/y",
      "joints/slider/axis/x", "joints/slider/axis/y", "joints/slider/displacement",
      "joints/slider/rate", "joints/slider/damping", "joints/slider/limits/0",
      "joints/slider/limits/1", "joints/slider/effort", "joints/glue/anchor/x",
      "joints/glue/anchor/y", "joints/rope/anchors/0/x", "joints/rope/anchors/0/y",
      "joints/rope/anchors/1/x", "joints/rope/anchors/1/y",
      // springs
      "springs/s/anchors/0/x", "springs/s/anchors/0/y", "springs/s/anchors/1/x",
      "springs/s/anchors/1/y", "springs/s/stiffness", "springs/s/damping", "springs/s/rest_length",
      "springs/t/anchors/0/x", "springs/t/anchors/0/y", "springs/t/anchors/1/x",
      "springs/t/anchors/1/y", "springs/t/stiffness", "springs/t/damping", "springs/t/rest_length",
      // forces
      "forces/push/force/x", "forces/push/force/y", "forces/push/torque", "forces/push/at/x",
      "forces/push/at/y", "forces/push/start", "forces/push/end", "forces/thrust/force/x",
      "forces/thrust/force/y", "forces/thrust/torque", "forces/thrust/at/x", "forces/thrust/at/y",
      // pairs
      "pairs/ball:floor/friction", "pairs/ball:floor/restitution", "pairs/h*:*/friction"};
  EXPECT_EQ(paths_, expected);
  // Each path's pointer is its own number.
  std::set<double*> values;
  for (const auto& number : EnumerateNumbers(&scene_)) values.insert(number.value);
  EXPECT_EQ(values.size(), expected.size());
}

TEST_F(ParameterTest, PathsFollowTheFile) {
  // Where a path can be walked in the file, it leads to the same number.
  const Json file = Json::parse(kFullScene);
  int walked = 0;
  for (const auto& number : EnumerateNumbers(&scene_)) {
    const std::size_t first = number.path.find('/');
    const std::size_t second = number.path.find('/', first + 1);
    if (second == std::string::npos) continue;
    const std::string kind = number.path.substr(0, first);
    const std::string name = number.path.substr(first + 1, second - first - 1);
    if (kind == "pairs") continue;
    std::string rest = number.path.substr(second);
    for (const Json& item : file[kind]) {
      if (item["name"] != name) continue;
      // The file has the type of the shape, and points as arrays.
      if (rest.rfind("/shape/", 0) == 0) {
        rest.insert(6, "/" + std::string(item["shape"].begin().key()));
      }
      if (rest.ends_with("/x")) rest.replace(rest.size() - 1, 1, "0");
      if (rest.ends_with("/y")) rest.replace(rest.size() - 1, 1, "1");
      const Json::json_pointer pointer(rest);
      if (!item.contains(pointer)) continue;
      EXPECT_EQ(item[pointer].get<double>(), *number.value) << number.path;
      ++walked;
    }
  }
  EXPECT_GT(walked, 60);
}

TEST_F(ParameterTest, WhatASignalReplacesIsNoParameter) {
  scene_.joints[0].effort_signal.emplace();
  scene_.forces[0].force_signal.emplace();
  scene_.forces[0].torque_signal.emplace();
  for (const auto& number : EnumerateNumbers(&scene_)) {
    EXPECT_NE(number.path, "joints/hinge/effort");
    EXPECT_NE(number.path, "forces/push/force/x");
    EXPECT_NE(number.path, "forces/push/torque");
  }
}

TEST_F(ParameterTest, WildcardsMatchWithinAComponent) {
  EXPECT_EQ(Matches("bodies/ball/mass"), Strings{"bodies/ball/mass"});
  EXPECT_EQ(Matches("bodies/*/mass"), (Strings{"bodies/ball/mass", "bodies/rod/mass",
                                               "bodies/hull/mass", "bodies/mass/mass"}));
  EXPECT_EQ(Matches("bodies/*l*/mass"), (Strings{"bodies/ball/mass", "bodies/hull/mass"}));
  EXPECT_EQ(Matches("bodies/ball/position/*"),
            (Strings{"bodies/ball/position/x", "bodies/ball/position/y"}));
  EXPECT_EQ(Matches("bodies/hull/shape/vertices/*/y").size(), 3u);
  EXPECT_EQ(Matches("gravity/*").size(), 2u);
  EXPECT_NE(Error("bodies/*"), "");
  EXPECT_NE(Error("*"), "");
}

TEST_F(ParameterTest, PairsByTheNameThatWasWritten) {
  EXPECT_EQ(Matches("pairs/ball:floor/friction"), Strings{"pairs/ball:floor/friction"});
  EXPECT_EQ(Matches("pairs/h*:*/friction"), Strings{"pairs/h*:*/friction"});
  EXPECT_EQ(Matches("pairs/*/friction").size(), 2u);
  // A name as written means its pair alone, even where it would match another as a pattern.
  scene_.pairs[1].bodies[0] = "b*";
  scene_.pairs[1].bodies[1] = "f*";
  paths_.back() = "pairs/b*:f*/friction";
  EXPECT_EQ(Matches("pairs/b*:f*/friction"), Strings{"pairs/b*:f*/friction"});
}

TEST_F(ParameterTest, ValueKindAndDimension) {
  const ParameterPath mass = Resolved("bodies/hull/mass");
  EXPECT_EQ(mass.path, "bodies/hull/mass");
  EXPECT_EQ(mass.value, 3.0);
  EXPECT_EQ(mass.kind, NumberKind::kPositive);
  EXPECT_STREQ(UnitOf(mass.dimension), "kg");
  EXPECT_EQ(Resolved("bodies/*/friction").value, 0.3);
  EXPECT_EQ(Resolved("bodies/ball/friction").kind, NumberKind::kNonNegative);
  EXPECT_EQ(Resolved("pairs/ball:floor/restitution").kind, NumberKind::kFraction);
  EXPECT_EQ(Resolved("bodies/ball/position/x").kind, NumberKind::kFree);
  // The most restrictive of several.
  EXPECT_EQ(Resolved("bodies/ball/*").kind, NumberKind::kFraction);
  EXPECT_STREQ(UnitOf(Resolved("joints/hinge/damping").dimension), "N m s");
  EXPECT_STREQ(UnitOf(Resolved("joints/slider/damping").dimension), "N s/m");
  EXPECT_STREQ(UnitOf(Resolved("joints/slider/rate").dimension), "m/s");
}

TEST_F(ParameterTest, ScalesAreTypicalMagnitudes) {
  // The largest size is the hull's (2 m), the largest mass 4 kg.
  EXPECT_EQ(Resolved("bodies/ball/position/x").scale, 2.0);
  EXPECT_EQ(Resolved("bodies/ball/mass").scale, 1.5);
  EXPECT_EQ(Resolved("bodies/*/mass").scale, 1.5);
  EXPECT_EQ(Resolved("bodies/ball/shape/radius").scale, 0.1);
  EXPECT_EQ(Resolved("bodies/ball/friction").scale, 1.0);
  EXPECT_EQ(Resolved("bodies/ball/restitution").scale, 1.0);
  EXPECT_EQ(Resolved("bodies/rod/linear_damping").scale, 4.0);
  EXPECT_EQ(Resolved("bodies/ball/linear_damping").scale, 0.01);
  EXPECT_EQ(Resolved("springs/t/stiffness").scale, 4.0);
  EXPECT_EQ(Resolved("forces/push/start").scale, 3.0);
  EXPECT_EQ(Resolved("joints/hinge/angle").scale, 1.0);
  for (const std::string& path : paths_) EXPECT_GT(Resolved(path).scale, 0.0) << path;
}

TEST_F(ParameterTest, MessagesThatHelp) {
  EXPECT_EQ(Error("bodies/bal/mass"),
            "parameter bodies/bal/mass: matches no number of the scene; bodies are: ball, rod, "
            "hull, floor, paddle, mass");
  EXPECT_EQ(Error("springs/u/stiffness"),
            "parameter springs/u/stiffness: matches no number of the scene; springs are: s, t");
  EXPECT_EQ(Error("pairs/floor:ball/friction"),
            "parameter pairs/floor:ball/friction: matches no number of the scene; pairs are: "
            "ball:floor, h*:*");
  EXPECT_EQ(Error("body/ball/mass"),
            "parameter body/ball/mass: matches no number of the scene, expected a path that starts "
            "with gravity, bodies, joints, springs, forces or pairs, got \"body\"");
  EXPECT_EQ(Error("bodies/floor/mass"),
            "parameter bodies/floor/mass: matches no number of the scene: body floor has no number "
            "\"mass\"; it has: position/x, position/y, angle, friction, restitution, "
            "shape/normal/x, shape/normal/y, shape/offset");
  EXPECT_EQ(Error("gravity"), "parameter gravity: expected gravity/x or gravity/y");
  EXPECT_EQ(Error("simulation/dt"),
            "parameter simulation/dt: the numbers of simulation are no parameters, expected "
            "gravity, bodies, joints, springs, forces or pairs");
  for (const char* path : {"", "/", "bodies", "bodies/", "bodies//mass", "bodies/ball",
                           "bodies/ball/", "bodies/ball/mass/", "a\nb", "joints/hinge/angle/x"}) {
    EXPECT_NE(Error(path), "") << path;
  }
}

TEST_F(ParameterTest, AnInertiaThatFollowsIsNoParameter) {
  const std::string expected =
      ": body rod has no inertia of its own: it follows mass and shape; write \"inertia\" in the "
      "scene to make it a parameter";
  EXPECT_EQ(Error("bodies/rod/inertia"), "parameter bodies/rod/inertia" + expected);
  // Not left out in silence where others have one.
  EXPECT_EQ(Error("bodies/*/inertia"), "parameter bodies/*/inertia" + expected);
  EXPECT_EQ(Resolved("bodies/ball/inertia").value, 0.005);
}

TEST_F(ParameterTest, AnAngleThatNothingCanTurnIsNoParameter) {
  Json json = Json::parse(kFullScene);
  json["joints"][0]["angle"] = json["joints"][0]["rate"] = 0;
  json["joints"][1]["displacement"] = json["joints"][1]["rate"] = 0;
  json["joints"][0]["bodies"] = {"world", "ball"};
  Load(json.dump());
  EXPECT_EQ(Error("joints/hinge/rate"),
            "parameter joints/hinge/rate: the first body of joint hinge is attached to the world, "
            "which cannot be turned; swap the joint's two bodies");
  json["joints"][3]["bodies"] = {"hull", "floor"};
  Load(json.dump());
  EXPECT_EQ(
      Error("joints/slider/displacement"),
      "parameter joints/slider/displacement: joint slider is part of a closed loop, which "
      "cannot be turned at one joint; use the positions, angles and velocities of its bodies");
  EXPECT_EQ(Resolved("joints/slider/damping").value, 0.8);
}

TEST_F(ParameterTest, CastKeepsEverything) {
  Scene copy = CastScene<double>(scene_);
  EXPECT_EQ(SceneToJson(copy), SceneToJson(scene_));
  EXPECT_EQ(copy.path, scene_.path);
}

template <int N>
void ExpectJetsAgree(Scene* scene) {
  BasicScene<Jet<N>> jets = CastScene<Jet<N>>(*scene);
  const auto numbers = EnumerateNumbers(scene);
  const auto jet_numbers = EnumerateNumbers(&jets);
  ASSERT_EQ(numbers.size(), jet_numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    EXPECT_EQ(numbers[i].path, jet_numbers[i].path);
    EXPECT_EQ(*numbers[i].value, jet_numbers[i].value->a) << numbers[i].path;
    EXPECT_TRUE(jet_numbers[i].value->v.isZero(0.0)) << numbers[i].path;
  }
  EXPECT_EQ(jets.no_contact, scene->no_contact);
  EXPECT_EQ(jets.simulation.dt, scene->simulation.dt);
  EXPECT_EQ(jets.joints[1].bodies[0], scene->joints[1].bodies[0]);
  EXPECT_EQ(jets.joints[1].contact, scene->joints[1].contact);
}

TEST_F(ParameterTest, JetsHaveTheSameNumbersInTheSameOrder) {
#define TANGIBLE_CHECK(N) ExpectJetsAgree<N>(&scene_);
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_CHECK)
#undef TANGIBLE_CHECK
}

// The first body of `fixed` is held by the world: neither its angle nor its rate can be chosen.
TEST(JointThatMayNotStartTurnedTest, HasNeitherAngleNorRate) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(ParseScene(R"({"bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]},
      {"name": "b", "mass": 1, "inertia": 1, "position": [2, 0]}],
    "joints": [
      {"name": "free", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0]},
      {"name": "fixed", "type": "revolute", "bodies": ["world", "b"], "anchor": [2, 0]}]})",
                         "s.json", "", &scene, &error))
      << error;
  std::set<std::string> paths;
  for (const auto& number : EnumerateNumbers(&scene)) paths.insert(number.path);
  for (const std::string number : {"angle", "rate"}) {
    EXPECT_EQ(paths.count("joints/free/" + number), 1u);
    EXPECT_EQ(paths.count("joints/fixed/" + number), 0u);
  }
}

}  // namespace
}  // namespace tangible
