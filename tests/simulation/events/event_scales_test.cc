// SPDX-License-Identifier: Apache-2.0
//
// The equations have no length and no time of their own: a motion is the same one in other units,
// and elsewhere. Tolerances that are not shares of the lengths at hand would show here.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/rescaled.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::Rescaled;
using test_scenes::Units;

/// A half-plane stands at its own position: moved, the floor is below what stands on it.
constexpr char kFloor[] =
    R"({"name": "floor", "static": true, "friction": 0.5, "restitution": 0.6,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";

struct NamedScene {
  std::string name;
  Scene scene;
};

std::string Events(const std::string& bodies, const std::string& more, double duration) {
  return R"({"bodies": [)" + bodies + "]" + more +
         R"(, "simulation": {"stepping": "event", "dt": 0.01, "duration": )" +
         std::to_string(duration) + "}}";
}

std::vector<NamedScene> Scenes() {
  const std::string floor = kFloor;
  std::vector<NamedScene> scenes;
  const auto add = [&](const std::string& name, const std::string& bodies, const std::string& more,
                       double duration) {
    scenes.push_back({name, test_scenes::SceneOf(Events(bodies, more, duration))});
  };
  add("a disc bounces",
      R"({"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "friction": 0.5,
          "restitution": 0.6, "position": [0, 0.6], "velocity": [1, 0], "angular_velocity": 3}, )" +
          floor,
      "", 1.0);
  add("a box slides until it stops",
      R"({"name": "box", "shape": {"box": {"size": [0.5, 0.3]}}, "mass": 1, "friction": 0.5,
          "position": [0, 0.15], "velocity": [2, 0]}, )" +
          floor,
      "", 0.6);
  add("a pendulum meets its limit",
      R"({"name": "bob", "mass": 1, "inertia": 0.05, "position": [0.5, 0]})",
      R"(, "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"],
          "anchor": [0, 0], "limits": [-0.9, 0.5]}])",
      1.0);
  add("a slider meets its limit",
      R"({"name": "bob", "mass": 1, "inertia": 0.05, "position": [0, 0]})",
      R"(, "joints": [{"name": "rail", "type": "prismatic", "bodies": ["bob", "world"],
          "anchor": [0, 0], "axis": [0.6, 0.8], "limits": [-0.4, 0.5], "rate": 1.5}])",
      1.0);
  add("a box that touches is thrown up",
      R"({"name": "box", "shape": {"box": {"size": [0.5, 0.3]}}, "mass": 1, "friction": 0.5,
          "position": [0, 0.15], "velocity": [0.5, 1.5]}, )" +
          floor,
      "", 0.6);
  add("a box tips over its corner",
      R"({"name": "box", "shape": {"box": {"size": [0.3, 0.5]}}, "mass": 1, "friction": 0.9,
          "position": [0, 0.25]}, )" +
          floor,
      R"(, "forces": [{"name": "push", "body": "box", "force": [7, 0], "at": [0, 0.2],
          "start": 0.05, "end": 0.153}])",
      0.4);
  // Its highest point is 1e-4 of a metre above where it touches.
  add("a disc grazes a ceiling",
      R"({"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "friction": 0.2,
          "restitution": 0.5, "position": [0, 0.5], "velocity": [1, 2.0]},
         {"name": "ceiling", "static": true, "friction": 0.2, "restitution": 0.5,
          "shape": {"box": {"size": [4, 0.2]}}, "position": [0, 0.9037736]})",
      "", 0.4);
  Scene mixture = test_scenes::SceneOf(test_scenes::Mixture());
  mixture.simulation.stepping = Stepping::kEvent;
  mixture.simulation.integrator.reset();
  scenes.push_back({"a mixture", mixture});
  for (size_t i = 0, count = scenes.size(); i < count; ++i) {
    scenes.push_back({scenes[i].name + ", in fixed steps", scenes[i].scene});
    scenes.back().scene.simulation.stepping = Stepping::kFixed;
  }
  return scenes;
}

struct Course {
  std::string events;
  State<double> final;  ///< in the first units
};

/// The events of a run; of fixed steps how many contacts are closed in each.
Course RunIn(const Scene& scene, const Units& units) {
  Model<double> model;
  State<double> initial;
  BuildModel(Rescaled(scene, units), &model, &initial);
  Course course;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long, double, const State<double>&, Stepper* stepper) {
        if (stepper == nullptr) return;
        if (!stepper->by_events()) {
          long closed = 0;
          for (const ContactMode mode : stepper->record().solution.modes) {
            closed += mode != ContactMode::kOpen ? 1 : 0;
          }
          course.events += std::to_string(closed) + " ";
          return;
        }
        const IslandRecords& records = stepper->parts();
        for (int k = 0; k < records.num_islands; ++k) {
          const EventRecord& record = records.islands[k]->events;
          for (int p = 0; p < record.num_parts; ++p) {
            const EventPart& part = *record.parts[p];
            const bool named = !part.is_impulses && part.segment.event != EventKind::kStepEnd;
            course.events += part.is_impulses ? "impact " : named ? NameOf(part.segment.event) : "";
            course.events += named ? ", " : "";
          }
        }
      },
      &course.final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  for (int body = 0; body < model.structure->num_bodies(); ++body) {
    for (int i = 0; i < 3; ++i) {
      double& pose = course.final.pose[3 * body + i];
      double& twist = course.final.twist[3 * body + i];
      pose = i < 2 ? (pose - units.origin[i]) / units.length : pose;
      twist *= i < 2 ? units.time / units.length : units.time;
    }
  }
  return course;
}

void ExpectNear(const Scene& scene, const Course& got, const Course& expected, double precision,
                const std::string& what) {
  EXPECT_EQ(got.events, expected.events) << what;
  for (size_t body = 0; body < scene.bodies.size(); ++body) {
    for (size_t i = 3 * body; i < 3 * body + 3 && scene.bodies[body].motion == Motion::kMoving;
         ++i) {
      EXPECT_NEAR(got.final.pose[i], expected.final.pose[i], precision) << what;
      EXPECT_NEAR(got.final.twist[i], expected.final.twist[i], 10.0 * precision) << what;
    }
  }
}

std::string Text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

// Powers of two round nothing: the same but for the last digits, which the regularisation of
// redundant rows and where Newton's iterations end decide.
TEST(EventScalesTest, TheSameInUnitsOfPowersOfTwo) {
  for (const auto& [name, scene] : Scenes()) {
    const Course unit = RunIn(scene, {});
    EXPECT_NE(unit.events, "") << name;
    for (const int power : {-14, 14}) {
      const double length = std::ldexp(1.0, power);
      for (const double time : {1.0, std::ldexp(1.0, power / 2)}) {
        ExpectNear(scene, RunIn(scene, {length, time}), unit, 1e-13,
                   name + ", length " + Text(length) + ", time " + Text(time));
      }
    }
  }
}

// Of 1e-4 and 1e4 m, with gravity as it is (times follow) and with times as they are.
TEST(EventScalesTest, TheSameMotionInOtherUnits) {
  for (const auto& [name, scene] : Scenes()) {
    const Course unit = RunIn(scene, {});
    for (const double length : {1e-4, 1e4}) {
      for (const double time : {1.0, std::sqrt(length)}) {
        ExpectNear(scene, RunIn(scene, {length, time}), unit, 1e-10,
                   name + ", length " + Text(length) + ", time " + Text(time));
      }
    }
  }
}

// Where positions round to a share of the lengths they are off by some of that, the time of an
// impact by it over the approach speed, and what turns by it over the radius: of a graze at
// 0.04 m/s by a disc of 0.1 m, 250 times.
TEST(EventScalesTest, TheSameMotionFarFromTheOrigin) {
  for (const auto& [name, scene] : Scenes()) {
    const Course unit = RunIn(scene, {});
    for (const double length : {1e-4, 1.0, 1e4}) {
      for (const double shift : {1.0, 1e3, 1e6}) {
        Units units{length, 1.0, {shift * length, -0.3 * shift * length}};
        ExpectNear(scene, RunIn(scene, units), unit, 1e-10 + 16.0 * 250.0 * 2.3e-16 * shift,
                   name + ", length " + Text(length) + ", shifted by " + Text(shift));
      }
    }
  }
}

}  // namespace
}  // namespace tangible
