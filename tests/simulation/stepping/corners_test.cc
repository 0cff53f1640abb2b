// SPDX-License-Identifier: Apache-2.0
//
// Corners that pass each other, and corners that run into a face: a corner that comes down to the
// height of a face as it passes the face's end is no impact, and one that slides along one face
// towards another is stopped where they meet. In both steppings, on ground of any shape.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::Text;

struct CornerRun {
  double dt, duration;
  const char* gravity = "0, -9.81";
  const char* stepping = "fixed";
};

Scene SceneOfRun(const std::string& bodies, const CornerRun& run) {
  return test_scenes::SceneOf(R"({"gravity": [)" + std::string(run.gravity) + R"(], "bodies": [)" +
                              bodies + R"(], "simulation": {"stepping": ")" + run.stepping +
                              R"(", "dt": )" + Text(run.dt) + R"(, "duration": )" +
                              Text(run.duration) + "}}");
}

// The pose and twist of the first body at the end.
std::vector<double> EndNumbersOf(const Scene& scene) {
  Model<double> model;
  State<double> state, final;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, nullptr, &final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return {final.pose[0],  final.pose[1],  final.pose[2],
          final.twist[0], final.twist[1], final.twist[2]};
}

std::string StaticGround(const std::string& shape, const std::string& more = "") {
  return R"(, {"name": "ground", "static": true, "shape": )" + shape + more + "}";
}

// A box slides off an edge at 1.5 m/s without friction and tips. An integration of the box on the
// edge, written apart, leaves it with ω = −2.41985.
TEST(CornersTest, ABoxTipsOverAnEdgeOfAnyShape) {
  const std::string box = R"({"name": "b", "mass": 1, "shape": {"box": {"size": [0.4, 0.2]}},
      "position": [0, 0.1], "velocity": [1.5, 0]})";
  const std::vector<std::string> edges = {
      StaticGround(R"({"box": {"size": [2, 0.5]}})", R"(, "position": [-1, -0.25])"),
      StaticGround(R"({"polyline": {"points": [[-2, 0], [0, 0], [0, -1]], "solid": "right"}})"),
      StaticGround(R"({"polygon": {"vertices": [[0, 0], [-2, 0], [-2, -1], [-0.5, -1], [-0.5, -0.6],
                 [-0.2, -0.6], [-0.2, -1], [0, -1]]}})"),
      StaticGround(R"({"box": {"size": [2, 0.5]}})", R"(, "position": [-1, -0.25])") +
          R"(, {"name": "slope", "static": true, "shape": {"box": {"size": [2, 0.5]}},
              "position": [0.8814564374602711, -0.534354328942741], "angle": -0.3})"};
  for (const std::string& edge : edges) {
    EXPECT_NEAR(EndNumbersOf(SceneOfRun(box + edge, {0.001, 0.16, "0, -9.81", "event"}))[5],
                -2.41985, 1e-4)
        << edge;
    for (const double dt : {1e-3, 7e-4, 3e-4, 1.1e-4}) {
      EXPECT_NEAR(EndNumbersOf(SceneOfRun(box + edge, {dt, 0.16}))[5], -2.41985, 8.0 * dt)
          << dt << edge;
    }
  }
}

// Concave bodies glide along a face and past its end, on nothing, in gravity of 0.
TEST(CornersTest, AConcaveBodyPassesTheEndOfAFace) {
  const std::string diamond = R"({"name": "m", "mass": 1, "inertia": 0.1, "position": [0.9, 0.5],
      "velocity": [1, 0], "shape": {"polygon": {"vertices": [[0, -0.5], [0.5, 0], [0.1, 0.4],
      [0, 0.2], [-0.1, 0.4], [-0.5, 0]]}}})";
  const std::string notched =
      StaticGround(R"({"polygon": {"vertices": [[-1, -0.5], [1, -0.5], [1, 0.5],
      [0.6, 0.5], [0.5, 0.4], [0.4, 0.5], [-1, 0.5]]}})",
                   R"(, "position": [0, -0.5])");
  for (const char* stepping : {"event", "fixed"}) {
    const std::vector<double> end =
        EndNumbersOf(SceneOfRun(diamond + notched, {0.01, 0.2, "0, 0", stepping}));
    EXPECT_NEAR(end[0], 1.1, 1e-12) << stepping;
    EXPECT_NEAR(end[3], 1.0, 1e-12) << stepping;
    EXPECT_NEAR(end[4], 0.0, 1e-12) << stepping;
    EXPECT_NEAR(end[5], 0.0, 1e-12) << stepping;
  }
}

// The lowest corner of a tilted body glides along a face and past its end, on nothing: at the
// instant at which both corners meet rounding chooses the nearest features.
TEST(CornersTest, ATiltedBodyPassesTheEndOfAFace) {
  const std::vector<std::pair<double, double>> vertices = {{-0.5, -0.2}, {0.5, -0.2}, {0.5, 0.2},
                                                           {0.0, 0.2},   {0.0, 0.0},  {-0.5, 0.0}};
  std::string list;
  for (const auto& [x, y] : vertices) {
    list += (list.empty() ? "[" : ", [") + Text(x) + ", " + Text(y) + "]";
  }
  for (const double angle : {0.5, 0.25 * M_PI, 1.0}) {
    for (const double start : {0.9, 0.95}) {
      const double x = start + 0.5 * std::cos(angle) - 0.2 * std::sin(angle);
      const double y = 0.5 * std::sin(angle) + 0.2 * std::cos(angle);
      const std::string body = R"({"name": "m", "mass": 1, "inertia": 0.1, "velocity": [1, 0],
          "shape": {"polygon": {"vertices": [)" +
                               list + R"(]}}, "angle": )" + Text(angle) + R"(, "position": [)" +
                               Text(x) + ", " + Text(y) + "]}";
      const std::string box =
          StaticGround(R"({"box": {"size": [2, 1]}})", R"(, "position": [0, -0.5])");
      for (const double dt : {0.01, 0.05}) {
        for (const char* stepping : {"event", "fixed"}) {
          const std::vector<double> end =
              EndNumbersOf(SceneOfRun(body + box, {dt, 0.5, "0, 0", stepping}));
          EXPECT_NEAR(end[0], x + 0.5, 1e-12) << angle << " " << start << " " << stepping;
          EXPECT_NEAR(end[1], y, 1e-12) << angle << " " << start << " " << stepping;
          EXPECT_NEAR(end[5], 0.0, 1e-12) << angle << " " << start << " " << stepping;
        }
      }
    }
  }
}

// A face that comes down on one of the same width: the corners of both are one above the other, and
// each is beside the other body as soon as it is behind its face.
TEST(CornersTest, AFaceRestsOnOneOfTheSameWidth) {
  const std::vector<std::string> grounds = {
      R"({"polyline": {"points": [[-1, -1], [-0.3, -1], [-0.3, 0.4], [0.3, 0.4], [0.3, -1],
          [1, -1]], "solid": "right"}})",
      R"({"polygon": {"vertices": [[-0.3, -1], [-0.1, -1], [0, -0.5], [0.1, -1], [0.3, -1],
          [0.3, 0.4], [-0.3, 0.4]]}})",
      R"({"box": {"size": [0.6, 0.8]}})"};
  for (const std::string& ground : grounds) {
    for (const double width : {0.6, 0.6 - 1e-9, 0.6 - 1e-7, 0.6 + 1e-9}) {
      const std::string box = R"({"name": "b", "mass": 1, "position": [0, 0.8],
          "shape": {"box": {"size": [)" +
                              Text(width) + ", 0.2]}}}";
      for (const double dt : {0.01, 0.003}) {
        for (const char* stepping : {"event", "fixed"}) {
          const std::vector<double> end =
              EndNumbersOf(SceneOfRun(box + StaticGround(ground), {dt, 0.6, "0, -9.81", stepping}));
          EXPECT_NEAR(end[0], 0.0, 1e-9) << stepping << " " << dt << " " << width << ground;
          EXPECT_NEAR(end[1], 0.5, 1e-9) << stepping << " " << dt << " " << width << ground;
          EXPECT_NEAR(end[2], 0.0, 1e-9) << stepping << " " << dt << " " << width << ground;
        }
      }
    }
  }
}

// A box, or a body with a notch, that begins to turn on a face of its own width rocks from corner
// to corner and comes to rest: no corner of it belongs to the walls below the face, however near
// these are. Without friction nothing pushes it aside.
TEST(CornersTest, ABodyRocksOnAFaceOfItsOwnWidth) {
  const std::vector<std::string> shapes = {
      R"({"box": {"size": [0.6, 0.2]}})",
      R"({"polygon": {"vertices": [[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [0, 0.05], [-0.3, 0.1]]}})"};
  const std::vector<std::string> grounds = {
      R"({"polyline": {"points": [[-0.3, -0.4], [0.3, -0.4], [0.3, 0.4], [-0.3, 0.4]],
          "closed": true}})",
      R"({"polygon": {"vertices": [[-0.3, -0.4], [0, 0], [0.3, -0.4], [0.3, 0.4], [-0.3, 0.4]]}})",
      R"({"polyline": {"points": [[-0.3, 0.4], [0.3, 0.4]], "solid": "right"}})",
      R"({"polyline": {"points": [[-0.3, 0.4], [0.3, 0.4], [0.4, -0.5]], "solid": "right"}})",
      R"({"box": {"size": [0.6, 0.8]}})"};
  for (const std::string& ground : grounds) {
    for (const std::string& shape : shapes) {
      for (const double rate : {0.5, -0.2}) {
        const std::string body = R"({"name": "b", "mass": 1, "inertia": 0.033, "friction": 0,
            "position": [0, 0.5], "shape": )" +
                                 shape + R"(, "angular_velocity": )" + Text(rate) + "}";
        for (const auto& [dt, stepping] :
             {std::pair{0.01, "event"}, std::pair{0.01, "fixed"}, std::pair{0.0007, "fixed"}}) {
          const std::vector<double> end = EndNumbersOf(SceneOfRun(
              body + StaticGround(ground, R"(, "friction": 0)"), {dt, 0.6, "0, -10", stepping}));
          EXPECT_NEAR(end[0], 0.0, 1e-5) << dt << shape << ground;
          EXPECT_NEAR(end[1], 0.5, 1e-6) << dt << shape << ground;
          EXPECT_NEAR(end[2], 0.0, 1e-6) << dt << shape << ground;
        }
      }
    }
  }
}

// Equal faces of free bodies meet centrally, e = 0.5.
TEST(CornersTest, EqualFacesOfFreeBodiesCollide) {
  const std::string bodies = R"({"name": "l", "mass": 1, "inertia": 0.01, "restitution": 0.5,
      "position": [0, 0], "shape": {"polygon": {"vertices": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1],
      [0, 0.1], [0, 0], [-0.1, 0]]}}},
      {"name": "b", "mass": 1, "inertia": 0.01, "restitution": 0.5, "position": [0.5, 0],
       "velocity": [-1, 0], "shape": {"box": {"size": [0.2, 0.2]}}})";
  for (const double dt : {0.01, 0.007, 0.1}) {
    for (const char* stepping : {"event", "fixed"}) {
      const std::vector<double> end = EndNumbersOf(SceneOfRun(bodies, {dt, 0.5, "0, 0", stepping}));
      EXPECT_NEAR(end[3], -0.75, 1e-9) << stepping << " " << dt;
      EXPECT_NEAR(end[5], 0.0, 1e-9) << stepping << " " << dt;
    }
  }
}

// An L slides over a slot in the ground whose far side is as high as the near one, and falls along
// a wall past a window in it.
TEST(CornersTest, AConcaveBodyPassesASlotAndAWindow) {
  const std::string shape = R"("mass": 1, "inertia": 0.2, "shape": {"polygon": {"vertices":
      [[-0.5, -0.2], [0.5, -0.2], [0.5, 0.2], [0.3, 0.2], [0.3, 0], [-0.5, 0]]}}})";
  const std::vector<std::string> slots = {
      R"({"polygon": {"vertices": [[-5, -1], [5, -1], [5, 0], [0.5, 0], [0.5, -0.5], [0.3, -0.5],
          [0.3, 0], [-5, 0]]}})",
      R"({"polyline": {"points": [[-5, 0], [0.3, 0], [0.3, -0.5], [0.5, -0.5], [0.5, 0], [5, 0]],
          "solid": "right"}})"};
  const std::string window = R"({"polyline": {"points": [[0, 5], [0, 0.5], [-0.3, 0.5],
      [-0.3, 0.3], [0, 0.3], [0, -5]], "solid": "right"}})";
  for (const char* stepping : {"event", "fixed"}) {
    for (const std::string& slot : slots) {
      const std::vector<double> end =
          EndNumbersOf(SceneOfRun(R"({"name": "m", "position": [-0.6, 0.2], "velocity": [2, 0], )" +
                                      shape + StaticGround(slot),
                                  {0.01, 0.8, "0, -9.81", stepping}));
      EXPECT_NEAR(end[0], 1.0, 1e-9) << stepping << slot;
      EXPECT_NEAR(end[3], 2.0, 1e-9) << stepping << slot;
    }
    const std::vector<double> fallen = EndNumbersOf(
        SceneOfRun(R"({"name": "m", "position": [0.5, 1.2], )" + shape + StaticGround(window),
                   {0.01, 0.8, "0, -9.81", stepping}));
    EXPECT_NEAR(fallen[0], 0.5, 1e-9) << stepping;
    EXPECT_NEAR(fallen[2], 0.0, 1e-9) << stepping;
    EXPECT_NEAR(fallen[4], -9.81 * 0.8, 1e-9) << stepping;
  }
}

// A box slides along the floor into the foot of a ramp, drawn as a box in the floor: the impact is
// that of events whatever part of a step it falls on; also where it falls on a step's end.
TEST(CornersTest, ACornerRunsIntoAConcaveCorner) {
  const std::string box = R"({"name": "b", "mass": 1, "shape": {"box": {"size": [0.3, 0.1]}},
      "position": [-0.3, 0.05], "velocity": [1.5, 0]})";
  const std::string ramp = StaticGround(R"({"half_plane": {"normal": [0, 1], "offset": 0}})") +
                           R"(, {"name": "ramp", "static": true, "angle": 0.3,
      "shape": {"box": {"size": [4, 0.5]}}, "position": [0.07388005166533489, -0.2388341222814015]})";
  const double omega = EndNumbersOf(SceneOfRun(box + ramp, {0.001, 0.11, "0, -9.81", "event"}))[5];
  EXPECT_NEAR(omega, 1.5534, 1e-3);
  for (const double dt : {1e-3, 1.1e-3, 5e-4, 3.7e-4, 1e-4, 1.1e-4}) {
    EXPECT_NEAR(EndNumbersOf(SceneOfRun(box + ramp, {dt, 0.11}))[5], omega, 20.0 * dt) << dt;
  }
  // Down a slope onto the level, as one line: it lies flat as its trailing corner has come down.
  const std::string slides = R"({"name": "b", "mass": 1, "shape": {"box": {"size": [0.3, 0.1]}},
      "position": [-0.44105957988601, 0.24076222085446952], "angle": -0.4,
      "velocity": [0.9210609940028851, -0.3894183423086505]})";
  const std::string line = StaticGround(R"({"polyline": {"points": [[-1.8421219880057702,
      0.778836684617301], [0, 0], [3, 0]], "solid": "right"}})");
  for (const double dt : {1e-3, 1.1e-3, 1e-4, 1.03e-4}) {
    const std::vector<double> end = EndNumbersOf(SceneOfRun(slides + line, {dt, 0.385}));
    EXPECT_NEAR(end[2], 0.0, 1e-9) << dt;
    EXPECT_NEAR(end[4], 0.0, 10.0 * dt) << dt;
    EXPECT_NEAR(end[5], 0.0, 1e-9) << dt;
  }
}

// A ball rolls, or slides, up the parabola y = 0.15 x² and nearly to its turning point, by events.
// The curve is drawn as lines of ever shorter pieces; drawn as a spline it ends with these speeds.
TEST(CornersTest, ABallOnAFineCurveMovesAsOnASmoothOne) {
  const std::vector<std::pair<double, double>> cases = {{0.3, 0.0381}, {0.0, -0.0587}};
  for (const auto& [friction, speed] : cases) {
    for (const double piece : {0.005, 0.002, 0.001, 0.0005}) {
      std::string points;
      for (int k = 0; k <= std::lround(1.4 / piece); ++k) {
        const double x = -0.6 + piece * k;
        points += (k == 0 ? "[" : ", [") + Text(x) + ", " + Text(0.15 * x * x) + "]";
      }
      const std::string of_both = R"(, "friction": )" + Text(friction);
      const std::string ball = R"({"name": "b", "mass": 1, "shape": {"circle": {"radius": 0.2}},
          "position": [0, 0.2], "velocity": [0.3, 0], "angular_velocity": -1.5)" +
                               of_both + "}";
      const std::vector<double> end = EndNumbersOf(SceneOfRun(
          ball + StaticGround(R"({"polyline": {"points": [)" + points + R"(], "solid": "right"}})",
                              of_both),
          {0.01, 1.0, "0, -9.81", "event"}));
      EXPECT_NEAR(end[3], speed, 1e-3) << friction << " " << piece;
    }
  }
}

}  // namespace
}  // namespace tangible
