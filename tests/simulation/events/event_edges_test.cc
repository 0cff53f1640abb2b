// SPDX-License-Identifier: Apache-2.0
//
// Derivatives with respect to the edges of forces' windows that fall on the boundary of two steps,
// or on each other, against closed forms: T is the end of a run, F the force, m = 1 kg.
#include "tangible/simulation/events/event_edges.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kEnd = 1.0;
// Row 0 is x and row 3 its speed.
constexpr int kX = 0, kSpeed = 3;

struct Window {
  double force, start, end;  ///< N, s, s; not given where they are no numbers
};

Scene PushedInWindows(const std::vector<Window>& windows, double dt, double friction = 0.0,
                      const std::string& more = R"("stepping": "event")", double speed = 0.0) {
  std::string forces;
  for (size_t i = 0; i < windows.size(); ++i) {
    const Window& window = windows[i];
    forces += (i > 0 ? ", " : "") + std::string(R"({"name": "f)") + std::to_string(i) +
              R"(", "body": "box", "force": [)" + Text(window.force) + ", 0]" +
              (std::isnan(window.start) ? "" : R"(, "start": )" + Text(window.start)) +
              (std::isnan(window.end) ? "" : R"(, "end": )" + Text(window.end)) + "}";
  }
  return SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "box", "shape": {"box": {"size": [0.5, 0.25]}}, "mass": 1, "position": [0, 0.125],
       "velocity": [)" +
                 Text(speed) + R"(, 0], "friction": )" + Text(friction) + R"(},
      {"name": "floor", "static": true, "friction": )" +
                 Text(friction) + R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "forces": [)" +
                 forces + R"(], "simulation": {"duration": 1, "dt": )" + Text(dt) + ", " + more +
                 "}}");
}

// The derivatives of the place and the speed with respect to an edge at s where the force and what
// it changes accelerate by `jump` more after it.
void ExpectEdge(const GradientResult& result, int column, double jump, double s) {
  EXPECT_NEAR(result.jacobian(kX, column), -jump * (kEnd - s), 1e-9) << s;
  EXPECT_NEAR(result.jacobian(kSpeed, column), -jump, 1e-9) << s;
}

// Values of dt that divide the edges, in decimals and binary, and one that does not.
struct Boundary {
  double start, end, dt;
};
const Boundary kBoundaries[] = {{0.5, 0.75, 0.01},  {0.5, 0.75, 0.25},    {0.43, 0.71, 0.01},
                                {0.3, 0.9, 0.1},    {0.125, 0.5, 0.0625}, {0.07, 0.14, 0.07},
                                {0.01, 0.99, 0.01}, {0.503, 0.7501, 0.01}};

// A window whose both ends are parameters, on a floor with `friction`.
void ExpectBothEdges(double friction, const std::string& stepping, double speed) {
  const std::vector<std::string> paths = {"forces/f0/start", "forces/f0/end"};
  for (const Boundary& b : kBoundaries) {
    const Scene scene = PushedInWindows({{4.0, b.start, b.end}}, b.dt, friction, stepping, speed);
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    ExpectEdge(result, 0, 4.0, b.start);
    ExpectEdge(result, 1, -4.0, b.end);
    ExpectOthersAgree(scene, paths, result);
  }
}

TEST(EventEdgesTest, AWindowOnTheBoundariesOfSteps) {
  for (const char* integrator : {"runge_kutta_4", "trapezoidal"}) {
    ExpectBothEdges(0.0, std::string(R"("stepping": "event", "integrator": ")") + integrator + '"',
                    0.0);
  }
}

TEST(EventEdgesTest, AWindowThatOpensWhileTheBoxSlides) {
  ExpectBothEdges(0.25, R"("stepping": "event")", 6.0);
}

// Friction holds the box before the edge and acts against the force after it.
TEST(EventEdgesTest, AWindowThatMovesABoxFromRest) {
  for (const Boundary& b : kBoundaries) {
    const Scene scene = PushedInWindows({{4.0, b.start, NAN}}, b.dt, 0.25);
    const GradientResult result = Jacobian(scene, {"forces/f0/start"}, GradientMethod::kAdjoint);
    ExpectEdge(result, 0, 4.0 - 2.5, b.start);
    ExpectOthersAgree(scene, {"forces/f0/start"}, result);
  }
}

TEST(EventEdgesTest, WindowsThatFollowEachOther) {
  for (const Boundary& b : kBoundaries) {
    const Scene scene =
        PushedInWindows({{4.0, NAN, b.start}, {-3.0, b.start, b.end}, {2.0, b.end, NAN}}, b.dt);
    const std::vector<std::string> paths = {"forces/f0/end", "forces/f1/start", "forces/f1/end",
                                            "forces/f2/start"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    ExpectEdge(result, 0, -4.0, b.start);
    ExpectEdge(result, 1, -3.0, b.start);
    ExpectEdge(result, 2, 3.0, b.end);
    ExpectEdge(result, 3, 2.0, b.end);
    ExpectOthersAgree(scene, paths, result);
  }
}

TEST(EventEdgesTest, BeforeAStartTheWindowDoesNotAct) {
  const Scene scene = PushedInWindows({{4.0, -0.25, 0.5}}, 0.01);
  const std::vector<std::string> paths = {"forces/f0/start", "forces/f0/end"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  ExpectEdge(result, 0, 0.0, 0.0);
  ExpectEdge(result, 1, -4.0, 0.5);
  ExpectOthersAgree(scene, paths, result);
}

// A fixed step's map has the mean of both sides, which differ by dt / 2 in the place.
TEST(EventEdgesTest, FixedStepsHaveTheMeanOfBothSides) {
  for (const Boundary& b : kBoundaries) {
    const Scene scene =
        PushedInWindows({{4.0, b.start, b.end}}, b.dt, 0.0, R"("stepping": "fixed")");
    const std::vector<std::string> paths = {"forces/f0/start", "forces/f0/end"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.jacobian(kSpeed, 0), -4.0, 1e-9);
    EXPECT_NEAR(result.jacobian(kSpeed, 1), 4.0, 1e-9);
    EXPECT_NEAR(result.jacobian(kX, 0), -4.0 * (kEnd - b.start), 4.0 * b.dt);
    EXPECT_NEAR(result.jacobian(kX, 1), 4.0 * (kEnd - b.end), 4.0 * b.dt);
    ExpectOthersAgree(scene, paths, result);
  }
}

// Two forces that begin at one instant move a box that each of them would leave at rest: its motion
// begins with the later one, whichever that is.
TEST(EventEdgesTest, TheOrderOfTwoWindowsThatMatters) {
  for (const double start : {0.5, 0.52}) {
    for (const double force : {3.0, 2.0}) {
      Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
          {"name": "box", "mass": 1, "shape": {"box": {"size": [0.5, 0.25]}},
           "position": [0, 0.125], "friction": 0.5},
          {"name": "floor", "static": true, "friction": 0.5,
           "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
          "forces": [{"name": "p", "body": "box", "force": [0, 0], "at": [0, -0.125], "start": 0},
                     {"name": "q", "body": "box", "force": [0, 0], "at": [0, -0.125], "start": 0}],
          "simulation": {"stepping": "event", "dt": 0.05, "duration": 1}})");
      for (BasicForce<double>& one : scene.forces) {
        one.force.x() = force;
        one.start = start;
      }
      const std::string verdict =
          Jacobian(scene, {"forces/p/start", "forces/q/start"}, GradientMethod::kTangent)
              .certificate.verdict;
      if (force == 3.0) {
        EXPECT_NE(verdict.find("one-sided: windows of two forces"), std::string::npos) << verdict;
      } else {
        EXPECT_EQ(verdict, "trustworthy");
      }
    }
  }
}

// Two opposite forces begin and end at one instant, each of which would move what rests: between
// the two edges it gains a speed of δ, which is stopped again after a time of δ. The place changes
// by δ² alone.
TEST(EventEdgesTest, WhatRestsBetweenAndBehindTwoEdgesStaysWhereItIs) {
  const std::string joint = R"("joints": [{"name": "s", "type": "prismatic", "axis": [1, 0],
      "bodies": ["c", "world"], "anchor": [0, 0], "friction": 2}])";
  const std::string hinge = R"("joints": [{"name": "s", "type": "revolute",
      "bodies": ["c", "world"], "anchor": [0, 0], "friction": 2}])";
  const struct {
    std::string body, bodies, rest, acts;
    double load;
  } cases[] = {
      {"", "", joint, "[%, 0]", 3.0},
      {R"("support": {"friction": 0.2, "load": 10}, "shape": {"circle": {"radius": 0.1}},)", "",
       R"("gravity": [0, 0])", "[%, 0]", 3.0},
      {R"("shape": {"box": {"size": [0.5, 0.25]}}, "friction": 0.2,)",
       R"(, {"name": "floor", "static": true, "friction": 0.2, "position": [0, -0.125],
            "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})",
       R"("gravity": [0, -10])", "[%, 0]", 2.5},
      {"", "", hinge, "torque", 3.0},
  };
  for (const auto& one : cases) {
    for (const auto& [start, end, dt] :
         {std::array{0.2, 0.6, 0.1}, std::array{0.2, 0.6, 0.01}, std::array{0.233, 0.571, 0.1},
          std::array{0.2, 0.5, 0.3}}) {
      std::string forces;
      for (const int k : {0, 1}) {
        const std::string load = Text(k == 0 ? one.load : -one.load);
        std::string acts = R"("torque": )" + load;
        if (one.acts != "torque") acts = R"("force": )" + std::string(one.acts);
        const size_t place = acts.find('%');
        if (place != std::string::npos) acts.replace(place, 1, load);
        forces += (k > 0 ? ", " : "") + std::string(R"({"name": "f)") + std::to_string(k) +
                  R"(", "body": "c", )" + acts + R"(, "start": )" + Text(start) + R"(, "end": )" +
                  Text(end) + "}";
      }
      const Scene scene = SceneOf(R"({"bodies": [{"name": "c", )" + one.body +
                                  R"("mass": 1, "inertia": 1, "position": [0, 0]})" + one.bodies +
                                  "], " + one.rest + R"(, "forces": [)" + forces +
                                  R"(], "simulation": {"stepping": "event", "duration": 0.7,
                                     "dt": )" +
                                  Text(dt) + "}}");
      const std::vector<std::string> paths = {"forces/f0/start", "forces/f0/end", "forces/f1/start",
                                              "forces/f1/end"};
      // Differences see δ².
      for (const GradientMethod method : {GradientMethod::kAdjoint, GradientMethod::kTangent,
                                          GradientMethod::kJetImplicit, GradientMethod::kJet}) {
        if (!IsAvailable(method)) continue;
        const GradientResult result = Jacobian(scene, paths, method);
        const std::string where = one.rest + one.body + ", dt " + Text(dt);
        EXPECT_LE(result.jacobian.cwiseAbs().maxCoeff(), 1e-12) << where;
        EXPECT_EQ(result.certificate.verdict, "trustworthy") << where;
      }
    }
  }
}

TEST(EventEdgesTest, EdgesAtOneInstantAreOneGroup) {
  const std::vector<Edge> edges = {{0.25, {3, 0, -1.0}},
                                   {0.5, {}},
                                   {0.5, {4, 0, 1.0}},
                                   {0.5 + 1e-17, {5, 1, -1.0}},
                                   {0.75, {6, 1, 1.0}}};
  const EdgeGroup group = NextEdges(edges, 0.25, 1e-16);
  EXPECT_TRUE(group.any);
  EXPECT_EQ(group.time, 0.5);
  EXPECT_EQ(group.window.number, 4);
  ASSERT_EQ(group.further.size(), 1u);
  EXPECT_EQ(group.further[0].number, 5);
  EXPECT_FALSE(NextEdges(edges, 0.75, 1e-16).any);
}

}  // namespace
}  // namespace tangible
