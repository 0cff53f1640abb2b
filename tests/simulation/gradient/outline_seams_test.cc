// SPDX-License-Identifier: Apache-2.0
//
// A floor of two pieces of which one or both are polylines or concave polygons: what passes their
// seam moves as on one plane.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

struct Piece {
  const char* name;
  const char* shape;
  double x, y;  // m, of its position
};

// From −2 m to 0 and from 0 to 3 m, with their upper faces at y = 1 m.
const std::vector<Piece> kLeft = {
    {"box", R"({"box": {"size": [2, 1]}})", -1.0, 0.5},
    {"polygon", R"({"polygon": {"vertices": [[-2, 0], [0, 0], [0, 1], [-2, 1], [-1.8, 0.5]]}})",
     0.0, 0.0},
    {"closed", R"({"polyline": {"points": [[-2, 0], [-2, 1], [0, 1], [0, 0]], "solid": "right"}})",
     0.0, 0.0},
    {"open", R"({"polyline": {"points": [[-2, 1], [0, 1]], "solid": "right"}})", 0.0, 0.0}};
const std::vector<Piece> kRight = {
    {"box", R"({"box": {"size": [3, 1]}})", 1.5, 0.5},
    {"polygon",
     R"({"polygon": {"vertices": [[0, 0], [3, 0], [3, 1], [2.8, 0.6], [2.6, 1], [0, 1]]}})", 0.0,
     0.0},
    {"closed", R"({"polyline": {"points": [[0, 0], [0, 1], [3, 1], [3, 0]], "solid": "right"}})",
     0.0, 0.0},
    {"open", R"({"polyline": {"points": [[0, 1], [3, 1]], "solid": "right"}})", 0.0, 0.0}};
const std::vector<const char*> kShapes = {
    R"({"box": {"size": [0.2, 0.2]}})", R"({"circle": {"radius": 0.1}})",
    R"({"polygon": {"vertices": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [0, 0.02], [-0.1, 0.1]]}})"};

struct Pass {
  const char* shape;
  double way = 1.0;  // to the right; −1: to the left
  double friction = 0.0;
  double tilt = 0.0;  // rad, of everything
  double dt = 0.01;
  Stepping stepping = Stepping::kEvent;
};

// Everything is turned about the origin by the tilt; `left` null: one half-plane.
Scene SceneOf(const Pass& pass, const Piece* left, const Piece* right, double higher = 0.0) {
  Scene scene = test_scenes::SceneOf(
      std::string(
          R"({"gravity": [0, -10], "bodies": [{"name": "b", "mass": 1, "inertia": 0.01, "shape": )") +
      pass.shape + R"(, "position": [0, 1.1], "restitution": 0.5}, )" +
      (left == nullptr
           ? R"({"name": "floor", "static": true,
                 "shape": {"half_plane": {"normal": [0, 1], "offset": 1}}})"
           : std::string(R"({"name": "left", "static": true, "restitution": 0.5, "shape": )") +
                 left->shape + R"(}, {"name": "right", "static": true, "restitution": 0.5,
                                      "shape": )" +
                 right->shape + "}") +
      R"(], "simulation": {"duration": 0.9}})");
  const Rotation<double> turn(pass.tilt);
  scene.gravity = turn * scene.gravity;
  scene.simulation.dt = pass.dt;
  scene.simulation.stepping = pass.stepping;
  for (BasicBody<double>& body : scene.bodies) {
    if (body.name == "b") {
      body.position.x() = -0.5 * pass.way;
      body.velocity = turn * Vector2<double>(1.3 * pass.way, 0.0);
    } else if (left != nullptr) {
      const Piece& piece = body.name == "left" ? *left : *right;
      body.position = {piece.x, piece.y + (body.name == "right" ? higher : 0.0)};
    }
    body.position = turn * body.position;
    body.angle = pass.tilt;
    body.friction = pass.friction;
  }
  return scene;
}

GradientResult Derivative(const Scene& scene) {
  return FinalStateJacobian(scene, testing::Resolve(scene, {"bodies/b/velocity/x"}), {});
}

void ExpectSame(const GradientResult& seam, const GradientResult& plane, const std::string& what) {
  ASSERT_TRUE(seam.done) << what << ": " << seam.message;
  EXPECT_NEAR((seam.values - plane.values).cwiseAbs().maxCoeff(), 0.0, 1e-9) << what;
  EXPECT_NEAR((seam.jacobian - plane.jacobian).cwiseAbs().maxCoeff(), 0.0, 1e-8) << what;
  // Of a concave polygon the corner that passes a seam is another body's contact.
  if (what.find("[0, 0.02]") == std::string::npos) {
    EXPECT_EQ(seam.certificate.verdict, plane.certificate.verdict) << what;
  }
}

TEST(OutlineSeamsTest, WhatPassesFlushPiecesMovesAsOnOnePlane) {
  for (const char* shape : kShapes) {
    for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
      for (const double way : {1.0, -1.0}) {
        for (const double friction : {0.0, 0.1}) {
          Pass pass{shape, way, friction, 0.0, friction > 0.0 ? 0.1 : 0.01, stepping};
          const GradientResult plane = Derivative(SceneOf(pass, nullptr, nullptr));
          for (const Piece& left : kLeft) {
            for (const Piece& right : kRight) {
              ExpectSame(Derivative(SceneOf(pass, &left, &right)), plane,
                         std::string(left.name) + " " + right.name + " " + shape + ", " +
                             std::to_string(way) + ", friction " + std::to_string(friction) +
                             (stepping == Stepping::kEvent ? ", events" : ", fixed"));
            }
          }
        }
      }
    }
  }
}

TEST(OutlineSeamsTest, WhateverTheTilt) {
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const double tilt : {0.3, -1.1}) {
      const Pass pass{kShapes[0], 1.0, 0.1, tilt, 0.1, stepping};
      const GradientResult plane = Derivative(SceneOf(pass, nullptr, nullptr));
      for (const Piece& left : kLeft) {
        for (const Piece& right : kRight) {
          const GradientResult seam = Derivative(SceneOf(pass, &left, &right));
          const std::string what =
              std::string(left.name) + " " + right.name + ", tilt " + std::to_string(tilt);
          ASSERT_TRUE(seam.done) << what << ": " << seam.message;
          EXPECT_NEAR((seam.values - plane.values).cwiseAbs().maxCoeff(), 0.0, 1e-9) << what;
          EXPECT_NEAR((seam.jacobian - plane.jacobian).cwiseAbs().maxCoeff(), 0.0, 1e-8) << what;
        }
      }
    }
  }
}

// A body that lies over the seam and into it is pushed out as from one plane.
TEST(OutlineSeamsTest, WhatLiesInFlushPiecesIsPushedOutAsFromOnePlane) {
  for (const char* shape : {kShapes[0], kShapes[1]}) {
    for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
      const auto pushed = [&](const Piece* left, const Piece* right) {
        Scene scene = SceneOf({shape, 1.0, 0.1, 0.0, 0.01, stepping}, left, right);
        for (BasicBody<double>& body : scene.bodies) {
          if (body.name == "b") body.position = {0.03, 1.1 - 2e-4};
        }
        return Derivative(scene);
      };
      const GradientResult plane = pushed(nullptr, nullptr);
      for (const Piece& left : kLeft) {
        for (const Piece& right : kRight) {
          const GradientResult seam = pushed(&left, &right);
          const std::string what = std::string(left.name) + " " + right.name + " " + shape;
          ASSERT_TRUE(seam.done) << what << ": " << seam.message;
          EXPECT_NEAR((seam.values - plane.values).cwiseAbs().maxCoeff(), 0.0, 1e-9) << what;
        }
      }
    }
  }
}

// The right piece is higher or lower: up to 1e-8 m it is flush, higher it is a wall, and lower a
// fall.
TEST(OutlineSeamsTest, StepsUpAreWallsAndStepsDownAreFalls) {
  for (const char* shape : {kShapes[0], kShapes[1]}) {
    for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
      const Pass pass{shape, 1.0, 0.0, 0.0, 0.01, stepping};
      const GradientResult plane = Derivative(SceneOf(pass, nullptr, nullptr));
      for (const Piece& left : kLeft) {
        for (const Piece& right : kRight) {
          const bool alike = left.name == std::string(right.name);
          if (!alike && right.name != std::string("open")) continue;
          const std::string what = std::string(left.name) + " " + right.name + " " + shape +
                                   (stepping == Stepping::kEvent ? ", events" : ", fixed");
          const auto values = [&](double higher) {
            const GradientResult result = Derivative(SceneOf(pass, &left, &right, higher));
            EXPECT_TRUE(result.done) << what << ": " << result.message;
            return result.values;
          };
          EXPECT_NEAR((values(0.9e-8) - plane.values).cwiseAbs().maxCoeff(), 0.0, 1e-7) << what;
          EXPECT_NEAR((values(-1e-9) - plane.values).cwiseAbs().maxCoeff(), 0.0, 1e-7) << what;
          // Below the end of an open line, too, that of the lower piece is hidden: fixed steps
          // would meet it ahead of time.
          EXPECT_NEAR(values(-1e-3)[3], 1.3, 0.05) << what;
          const Eigen::VectorXd wall = values(shape == kShapes[0] ? 1e-3 : 0.05);
          EXPECT_LT(wall[3], 0.0) << what;
          EXPECT_LT(wall[0], -0.08) << what;
        }
      }
    }
  }
}

// A flat face on a corner of a line, whichever: it overhangs the left or the right edge of a table
// and rests, slides across a gap and a slot as on one plane, and is stopped by the end of an open
// line as by a step of that height.
Scene OnLines(const std::string& lines, double x, double speed, double friction, Stepping stepping,
              double duration) {
  Scene scene = test_scenes::SceneOf(
      R"({"bodies": [{"name": "b", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1,
          "position": [0, 0.1]}, )" +
      lines + R"(], "simulation": {"dt": 0.01}})");
  scene.simulation.stepping = stepping;
  scene.simulation.duration = duration;
  scene.bodies[0].position[0] = x;
  scene.bodies[0].velocity[0] = speed;
  for (BasicBody<double>& body : scene.bodies) body.friction = friction;
  return scene;
}

std::string Line(const std::string& name, const std::string& points, const std::string& more) {
  return R"({"name": ")" + name + R"(", "static": true, "shape": {"polyline": {"points": )" +
         points + ", " + more + "}}}";
}

TEST(OutlineSeamsTest, AFaceThatOverhangsAnEdgeRests) {
  const std::string closed = R"("closed": true, "solid": "left")";
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const std::string& line :
         {Line("t", "[[0, -1], [1, -1], [1, 0], [0, 0]]", closed),
          Line("t", "[[1, 0], [0, 0], [0, -1], [1, -1]]", closed),
          Line("t", "[[1, 0], [0, 0], [0, -0.05]]", R"("solid": "left")")}) {
      const GradientResult rests = Derivative(OnLines(line, 0.05, 0.0, 0.3, stepping, 0.1));
      ASSERT_TRUE(rests.done) << rests.message;
      EXPECT_NEAR(rests.values[0], 0.05, 1e-12);
      EXPECT_NEAR(rests.values[1], 0.1, 1e-12);
      EXPECT_NEAR(rests.values[2], 0.0, 1e-12);
    }
    const GradientResult right = Derivative(OnLines(
        Line("t", "[[0, -1], [1, -1], [1, 0], [0, 0]]", closed), 0.95, 0.0, 0.3, stepping, 0.1));
    ASSERT_TRUE(right.done) << right.message;
    EXPECT_NEAR(right.values[2], 0.0, 1e-12);
  }
}

// x = -0.5 + 2 t - mu g t^2 / 2.
TEST(OutlineSeamsTest, AFaceSlidesAcrossGapsAndSlots) {
  const std::string closed = R"("closed": true, "solid": "left")";
  const std::string gap = Line("l", "[[-1, -1], [0, -1], [0, 0], [-1, 0]]", closed) + ", " +
                          Line("r", "[[0.01, -1], [1, -1], [1, 0], [0.01, 0]]", closed);
  const std::string slot_points =
      "[[-1, -1], [1, -1], [1, 0], [0.01, 0], [0.01, -0.1], [0, -0.1], [0, 0], [-1, 0]]";
  const std::string polygon =
      R"({"name": "t", "static": true, "shape": {"polygon": {"vertices": )" + slot_points + "}}}";
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const std::string& lines : {gap, Line("t", slot_points, closed), polygon}) {
      for (const double friction : {0.0, 0.3}) {
        const GradientResult passes =
            Derivative(OnLines(lines, -0.5, 2.0, friction, stepping, 0.5));
        ASSERT_TRUE(passes.done) << lines << passes.message;
        const double way = stepping == Stepping::kEvent ? 0.125 : 0.1275;
        EXPECT_NEAR(passes.values[0], 0.5 - way * friction * 9.81, 1e-9) << lines;
        EXPECT_NEAR(passes.values[2], 0.0, 1e-9) << lines;
      }
    }
  }
}

TEST(OutlineSeamsTest, AnEndOfALineStopsAFaceAsAStepDoes) {
  const std::string floor =
      R"({"name": "f", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}, )";
  for (const double height : {0.001, 0.05, 0.1}) {
    const std::string at = std::to_string(height);
    const std::string open = Line("s", "[[0, " + at + "], [1, " + at + "]]", R"("solid": "right")");
    const std::string box = R"({"name": "s", "static": true, "position": [0.5, )" +
                            std::to_string(0.5 * height) + R"(], "shape": {"box": {"size": [1, )" +
                            at + "]}}}";
    for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
      const GradientResult line = Derivative(OnLines(floor + open, -0.5, 2.0, 0.3, stepping, 0.4));
      const GradientResult step = Derivative(OnLines(floor + box, -0.5, 2.0, 0.3, stepping, 0.4));
      ASSERT_TRUE(line.done) << at << line.message;
      ASSERT_TRUE(step.done) << at << step.message;
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(line.values[i], step.values[i], 1e-3) << at << i;
    }
  }
}

// A ball that rolls in under a shelf, 1 m above the floor, is not lifted onto it.
TEST(OutlineSeamsTest, WhatPassesBelowAShelfStaysBelow) {
  const std::string floor =
      R"({"name": "f", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}, )";
  const std::string shelf = Line("s", "[[0, 1], [1, 1]]", R"("solid": "right")");
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    const GradientResult below = Derivative(OnLines(floor + shelf, -0.5, 2.0, 0.0, stepping, 0.5));
    ASSERT_TRUE(below.done) << below.message;
    EXPECT_NEAR(below.values[0], 0.5, 1e-12);
    EXPECT_NEAR(below.values[1], 0.1, 1e-9);
  }
}

// The time at which a foot passes from one face to the other one is no event's: the gap to the next
// face closes with rounding alone. Without friction its derivative is that of a growing one.
TEST(OutlineSeamsTest, NothingDependsOnTheTimeOfPassingAJoint) {
  for (const double friction : {0.3, 0.0}) {
    for (const double start : {-0.3, -0.4, -0.5}) {
      SCOPED_TRACE(test_scenes::Text(friction) + " " + test_scenes::Text(start));
      const std::string law = R"("friction": )" + test_scenes::Text(friction);
      const Scene scene = test_scenes::SceneOf(
          R"({"bodies": [{"name": "m", "mass": 1, )" + law +
          R"(, "shape": {"capsule": {"length": 0.3, "radius": 0.2}}, "velocity": [2.5, 0],
              "position": [)" +
          test_scenes::Text(start) + R"(, 0.2]},
             {"name": "a", "static": true, )" +
          law +
          R"(, "shape": {"box": {"size": [1, 1]}}, "position": [-0.5, -0.5]},
             {"name": "b", "static": true, )" +
          law +
          R"(, "shape": {"box": {"size": [1, 1]}}, "position": [0.5, -0.5]}],
             "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.3}})");
      const std::vector<std::string> paths = {"bodies/m/shape/length", "bodies/m/friction",
                                              "bodies/m/velocity/x"};
      const GradientResult adjoint = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
      testing::ExpectOthersAgree(scene, paths, adjoint);
      // x = v T - mu g T² / 2, mu the mean of both bodies'
      EXPECT_NEAR(adjoint.jacobian(0, 0), 0.0, 1e-9);
      EXPECT_NEAR(adjoint.jacobian(0, 1), -0.25 * test_scenes::kGravity * 0.09, 1e-9);
    }
  }
}

}  // namespace
}  // namespace tangible
