// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/start_probe.h"

#include <gtest/gtest.h>

#include "../../support/gradients.h"
#include "../../support/starts.h"

namespace tangible {
namespace {

using test_scenes::JammingFriction;
using test_scenes::SceneOf;
using test_scenes::SlidingRod;

std::string VerdictOf(const Scene& scene, const std::string& path) {
  return testing::Jacobian(scene, {path}, GradientMethod::kTangent).certificate.verdict;
}

TEST(StartProbeTest, ARodThatJamsAtItsStartIsAtAKinkForWhatOpensItsContact) {
  const Scene scene = SlidingRod(3.0, -2.0);
  for (const char* path : {"bodies/rod/velocity/y", "bodies/rod/angular_velocity"}) {
    EXPECT_EQ(VerdictOf(scene, path),
              std::string("one-sided: contact of floor and rod jams at the start, ") + path +
                  " opens it");
  }
  for (const char* path : {"bodies/rod/velocity/x", "bodies/rod/mass", "gravity/y"}) {
    EXPECT_EQ(VerdictOf(scene, path), "trustworthy") << path;
  }
}

// Below the coefficient at which it jams a change of its vertical speed is carried by the contact,
// thrown up or pressed down; so it is when it slides the other way, or not at all.
TEST(StartProbeTest, WhatCannotJamIsTrustworthy) {
  const double critical = JammingFriction();
  EXPECT_NEAR(critical, 1.51, 0.01);
  for (const double share : {0.2, 0.7, 0.95, 0.98}) {
    // Near it accelerations change so fast that steps have to be short to be integrated.
    Scene scene = SlidingRod(share * critical, -2.0);
    scene.simulation.dt = 1e-4;
    scene.simulation.duration = 5e-3;
    EXPECT_EQ(VerdictOf(scene, "bodies/rod/velocity/y"), "trustworthy") << share;
  }
  for (const double share : {1.02, 1.1, 2.0}) {
    const std::string verdict =
        VerdictOf(SlidingRod(share * critical, -2.0), "bodies/rod/velocity/y");
    EXPECT_EQ(verdict.find("one-sided: contact of floor and rod jams at the start"), 0u)
        << share << ": " << verdict;
    EXPECT_EQ(VerdictOf(SlidingRod(share * critical, 2.0), "bodies/rod/velocity/y"), "trustworthy")
        << share;
  }
  EXPECT_EQ(VerdictOf(SlidingRod(1.0, 0.0), "bodies/rod/velocity/y"), "trustworthy");
  EXPECT_EQ(VerdictOf(SlidingRod(0.0, -2.0), "bodies/rod/velocity/y"), "trustworthy");
}

// As fast as it turns its foot would rise by itself, and yet friction could press it down: which of
// both goes on is decided by whether it slides at all.
TEST(StartProbeTest, ASlipThatWouldJamARisingFootIsAKink) {
  const Scene scene = SceneOf(R"({"bodies": [{"name": "floor", "static": true, "friction": 3.5,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "body", "shape": {"capsule": {"length": 0.8715707612767226,
        "radius": 0.027330959735684363}}, "mass": 1.85, "inertia": 0.105,
       "position": [0, 0.4484262717080275], "angle": -1.3104099988826334,
       "velocity": [-2.1696661512425557, -0.5428426435766127],
       "angular_velocity": 4.83840106641931, "friction": 3.5}],
    "simulation": {"dt": 0.005, "duration": 0.025, "stepping": "event",
                   "integrator": "runge_kutta_4"}})");
  EXPECT_NE(VerdictOf(scene, "bodies/body/velocity/x").find("sets it sliding"), std::string::npos)
      << VerdictOf(scene, "bodies/body/velocity/x");
}

// A box that a force just tips over the corner at which friction holds it: set sliding one way
// friction goes on to tip it, the other way it sets the box back. Unpushed it comes to rest.
TEST(StartProbeTest, ASlipThatDecidesWhetherABoxTipsIsAKink) {
  const auto scene = [](const std::string& force) {
    return SceneOf(R"({"bodies": [{"name": "floor", "static": true, "friction": 1,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "box", "shape": {"box": {"size": [0.2, 0.4]}}, "mass": 1, "position": [0, 0.2],
       "friction": 1}],
    "forces": [{"name": "push", "body": "box", "force": [)" +
                   force + R"(, 0]}],
    "simulation": {"dt": 0.001, "duration": 0.04, "stepping": "event"}})");
  };
  EXPECT_EQ(VerdictOf(scene("5"), "bodies/box/velocity/x"),
            "one-sided: contact of floor and box touches at the start, bodies/box/velocity/x sets "
            "it sliding");
  EXPECT_EQ(VerdictOf(scene("0"), "bodies/box/velocity/x"), "trustworthy");
}

TEST(StartProbeTest, BodiesThatTouchAndSlideInOrdinaryFrictionAreTrustworthy) {
  const auto scene = [](const std::string& body, double friction) {
    Scene made = SceneOf(R"({"bodies": [{"name": "floor", "static": true,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}, )" +
                         body + R"(], "simulation": {"dt": 0.01, "duration": 0.1,
        "stepping": "event", "integrator": "runge_kutta_4"}})");
    for (BasicBody<double>& each : made.bodies) each.friction = friction;
    return made;
  };
  const std::string box = R"({"name": "body", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1,
      "position": [0, 0.1], "velocity": [1.5, 0]})";
  const std::string disc = R"({"name": "body", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
      "position": [0, 0.1], "velocity": [1.5, 0]})";
  for (const double friction : {0.0, 0.1, 0.5, 0.8}) {
    for (const std::string& body : {box, disc}) {
      for (const char* path :
           {"bodies/body/velocity/x", "bodies/body/velocity/y", "bodies/body/angular_velocity"}) {
        EXPECT_EQ(VerdictOf(scene(body, friction), path), "trustworthy") << friction << ' ' << path;
      }
    }
  }
}

// The disc's own contact cannot jam, but what it spares the box under it, whose does.
TEST(StartProbeTest, WhatRestsOnABodyThatJamsIsLookedAtToo) {
  const Scene scene = SceneOf(R"({"bodies": [{"name": "belt", "kinematic": true, "friction": 3.02,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}, "velocity": [-0.36, 0]},
      {"name": "box", "shape": {"box": {"size": [0.174, 0.336]}}, "mass": 2.5, "inertia": 0.0224,
       "position": [0, 0.168], "velocity": [0.4, 0], "friction": 3.02},
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1.9, "inertia": 0.00756,
       "position": [0, 0.436], "velocity": [0.4, 0], "friction": 3.02}],
    "simulation": {"dt": 0.005, "duration": 0.02, "stepping": "event",
                   "integrator": "runge_kutta_4"}})");
  const std::string verdict = VerdictOf(scene, "bodies/disc/velocity/y");
  EXPECT_NE(verdict.find("touches at the start, bodies/disc/velocity/y"), std::string::npos)
      << verdict;
}

// Links that lie on the floor end as they are whichever is turned: there is nothing but rounding to
// compare.
TEST(StartProbeTest, WhereNothingDependsOnADirectionRoundingIsNoJump) {
  std::string bodies = R"({"name": "floor", "static": true, "friction": 0.8,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
  std::string joints;
  for (int i = 0; i < 12; ++i) {
    const std::string name = "link" + std::to_string(i);
    bodies += R"(, {"name": ")" + name +
              R"(", "shape": {"capsule": {"length": 0.2, "radius": 0.03}}, "mass": 1,
        "friction": 0.8, "velocity": [0.5, 0], "position": [)" +
              std::to_string(0.2 * i) + ", 0.03]}";
    if (i > 0) {
      joints += (i > 1 ? ", " : "") + std::string(R"({"name": "pin)") + std::to_string(i) +
                R"(", "type": "revolute", "bodies": [")" + name + R"(", "link)" +
                std::to_string(i - 1) + R"("], "anchor": [)" + std::to_string(0.2 * i - 0.1) +
                ", 0.03]}";
    }
  }
  const Scene scene = SceneOf(R"({"bodies": [)" + bodies + R"(], "joints": [)" + joints +
                              R"(], "no_contact": [["link*", "link*"]], "simulation":
      {"dt": 0.01, "duration": 0.05, "stepping": "event", "integrator": "runge_kutta_4"}})");
  EXPECT_EQ(VerdictOf(scene, "bodies/link8/angular_velocity"), "trustworthy");
}

TEST(StartProbeTest, OnlyContactsWhoseFrictionMayHoldThemAreLookedAt) {
  const auto may_jam = [](const Scene& scene) {
    Model<double> model;
    State<double> start;
    BuildModel(scene, &model, &start);
    std::vector<ActiveContact> contacts;
    EventSearch(model).FindContacts(model, start, 1e-9, &contacts);
    EXPECT_EQ(contacts.size(), 1u);
    return MayJam(model, start, contacts, contacts.front());
  };
  const double critical = JammingFriction();
  EXPECT_FALSE(may_jam(SlidingRod(0.0, -2.0)));
  EXPECT_FALSE(may_jam(SlidingRod(0.85 * critical, -2.0)));
  EXPECT_TRUE(may_jam(SlidingRod(0.95 * critical, -2.0)));
  EXPECT_TRUE(may_jam(SlidingRod(0.95 * critical, 2.0)));
}

}  // namespace
}  // namespace tangible
