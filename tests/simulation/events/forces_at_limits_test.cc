// SPDX-License-Identifier: Apache-2.0
//
// Loads that reach the limit of what holds a body, stay there, or fall below it again: slips that
// begin and end within a motion, peaks that only touch a limit, and impacts, windows and steps of
// signals at the same instant.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "../../support/exact_runs.h"

namespace tangible {
namespace {

using namespace exact_runs;  // NOLINT(google-build-using-namespace)

// The scene with a force on its body b along x or y that is linear between times, or constant.
Scene WithLoad(Scene scene, std::vector<double> times, std::vector<double> values, bool up,
               Signal::Interpolation interpolation = Signal::Interpolation::kLinear) {
  Signal load;
  load.interpolation = interpolation;
  load.time = std::move(times);
  load.x = std::vector<double>(load.time.size(), 0.0);
  load.y = load.x;
  (up ? load.y : load.x) = std::move(values);
  scene.forces[0].force_signal = load;
  return scene;
}

Scene BlockOnAFloor(double duration, const std::string& force = kForce) {
  return Of("[0, -10]", Box("b", 0.0, 0.0, 0.5) + "," + Floor(0.5), duration, force);
}

// A disc on a rail along x with friction of 5 N.
Scene Slider(const std::string& other, double v, double duration, const std::string& more = "") {
  return Of("[0, 0]", Disc("b", 0.0, 0.0, v, 0.0) + other, duration,
            R"(, "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"],
                 "anchor": [0, 0], "axis": [1, 0], "friction": 5}])" +
                more);
}

// F0 − s t is above the limit L = μ m g for 2 E / s with E = F0 − L: x = 2 E³ / (3 m s²).
TEST(ForcesAtLimitsTest, ASlipEndsInTheMotionInWhichItBegins) {
  ExpectExact(WithLoad(BlockOnAFloor(0.5), {0.0, 0.5}, {7.0, -3.0}, false),
              {"bodies/*/friction", "bodies/b/mass"},
              {{0, 0.04 / 3.0, {-0.2, -0.04 / 3.0 - 0.1}}, {3, 0.0, {0.0, 0.0}}});
  ExpectExact(WithLoad(Slider("", 0.0, 0.5, kForce), {0.0, 0.5}, {7.0, -3.0}, false),
              {"joints/j/friction"}, {{0, 0.04 / 3.0, {-0.02}}, {3, 0.0, {0.0}}});
}

// The same force from the instant on at which its window opens.
TEST(ForcesAtLimitsTest, AWindowOpensAndTheSlipEndsInTheSameMotion) {
  const std::string force =
      R"(, "forces": [{"name": "f", "body": "b", "force": [0, 0], "start": 0.25, "end": 9}])";
  ExpectExact(WithLoad(BlockOnAFloor(0.75, force), {0.0, 0.75}, {12.0, -3.0}, false),
              {"bodies/*/friction", "forces/f/start"},
              {{0, 0.04 / 3.0, {-0.2, -0.4}}, {3, 0.0, {0.0, 0.0}}});
}

// On one side it never reaches it, on the other it is above it for a time ε and moves ε³.
void ExpectRest(Scene scene, const std::string& path, int row, double value) {
  for (const double dt : {0.5, 0.25, 0.1, 0.02, 0.03}) {
    scene.simulation.dt = dt;
    for (const GradientMethod method : {GradientMethod::kAdjoint, GradientMethod::kTangent}) {
      const GradientResult result = testing::Jacobian(scene, {path}, method);
      EXPECT_NEAR(result.values[row], value, kOfValue) << dt;
      EXPECT_NEAR(result.values[row + 3], 0.0, kOfValue) << dt;
      EXPECT_NEAR(result.jacobian(row, 0), 0.0, kOfDerivative) << dt;
      EXPECT_NEAR(result.jacobian(row + 3, 0), 0.0, kOfDerivative) << dt;
    }
  }
}

TEST(ForcesAtLimitsTest, ALoadThatJustReachesItsLimitMovesNothing) {
  const std::vector<double> times = {0.0, 0.25, 0.5};
  ExpectRest(WithLoad(BlockOnAFloor(0.5), times, {0.0, 5.0, 0.0}, false), "bodies/*/friction", 0,
             0.0);
  ExpectRest(WithLoad(Slider("", 0.0, 0.5, kForce), times, {0.0, 5.0, 0.0}, false),
             "joints/j/friction", 0, 0.0);
  const Scene disc = Of("[0, -10]", Disc("b", 0.0, 0.1, 0.0, 0.5) + "," + Floor(0.5), 0.5, kForce);
  ExpectRest(WithLoad(disc, times, {0.0, 10.0, 0.0}, true), "bodies/b/mass", 1, 0.1);
}

// Less friction would let the block go.
TEST(ForcesAtLimitsTest, ALoadThatStaysAtItsLimitIsAKink) {
  for (const double dt : {0.25, 0.1, 0.02}) {
    Scene block =
        WithLoad(BlockOnAFloor(0.75), {0.0, 0.25, 0.5, 0.75}, {0.0, 5.0, 5.0, 0.0}, false);
    block.simulation.dt = dt;
    const GradientResult result =
        testing::Jacobian(block, {"bodies/*/friction"}, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[0], 0.0, kOfValue) << dt;
    EXPECT_NE(result.certificate.verdict, "trustworthy") << dt;
  }
}

// x = v² / (2 a) with a = μ g + F / m; behind the force's end the rest of its speed is 0.
TEST(ForcesAtLimitsTest, ABlockStopsAsItsForceEnds) {
  ExpectExact(
      Of("[0, -10]", Box("b", 0.0, 1.0, 0.15) + "," + Floor(0.15), 0.75,
         R"(, "forces": [{"name": "f", "body": "b", "force": [-0.5, 0], "start": 0, "end": 0.5}])"),
      {"bodies/b/velocity/x", "bodies/*/friction", "forces/f/end"},
      {{0, 0.25, {0.5, -1.25, 0.0}}, {3, 0.0, {0.0, 0.0, 0.0}}});
}

// v₁² = v² − 2 a d; the ball goes on with v₁, and the slider stays where it is.
TEST(ForcesAtLimitsTest, AnEqualBallStopsASlider) {
  Scene scene = Slider("," + Disc("ball", 1.075, 0.0, 0.0, 0.0), 3.0, 0.75);
  for (BasicBody<double>& body : scene.bodies) body.restitution = 1.0;
  // a = 5, d = 0.875: v₁ = 0.5, t₁ = 0.5.
  ExpectExact(scene, {"bodies/b/velocity/x"},
              {{0, 0.875, {0.0}}, {3, 0.0, {0.0}}, {6, 1.2, {6.0 * 0.25 + 0.5}}, {9, 0.5, {6.0}}});
}

// Of two bodies that have nothing to do with each other one's force has a step as the other's
// begins.
TEST(ForcesAtLimitsTest, AWindowOpensAsAnotherForceSteps) {
  Scene scene =
      Of("[0, 0]", Disc("b", 0.0, 0.0, 0.0, 0.0) + "," + Disc("c", 3.0, 0.0, 0.0, 0.0), 0.75,
         R"(, "forces": [{"name": "f", "body": "b", "force": [0, 0]},
                      {"name": "g", "body": "c", "force": [16, 0], "start": 0.5, "end": 9}])");
  scene =
      WithLoad(scene, {0.0, 0.5, 1.0}, {1.0, 4.0, 4.0}, false, Signal::Interpolation::kConstant);
  ExpectExact(scene, {"forces/g/start"},
              {{0, 0.125 + 0.5 * 0.25 + 0.125, {0.0}}, {3, 1.5, {0.0}}, {6, 3.5, {-4.0}}});
}

// A ball strikes the slider at the instant at which a growing force lets it go: v' = (1 + e) v / 2.
TEST(ForcesAtLimitsTest, ABallStrikesAsASliderIsLetGo) {
  const Scene scene = Slider("," + Disc("ball", -1.2, 0.0, 2.0, 0.0), 0.0, 0.75, kForce);
  ExpectExact(WithRamp(scene, 0.0, 10.0, false),
              {"bodies/ball/velocity/x", "bodies/ball/position/x"},
              {{0, 0.375 + 10.0 / 384.0, {0.5625, 0.75}}, {3, 1.5 + 0.3125, {0.75, 0.0}}});
}

// The slider is struck as the run starts, and slides on.
TEST(ForcesAtLimitsTest, ABallStrikesAsTheRunStarts) {
  ExpectExact(
      Slider("," + Disc("ball", -0.2, 0.0, 2.0, 0.0), 0.0, 0.25), {"bodies/ball/velocity/x"},
      {{0, 0.21875, {0.1875}}, {3, 0.25, {0.75}}, {9, 0.5, {0.25}}}, {0.25, 0.1, 0.05, 0.02, 0.01});
}

// A body that moves straight is turned by its hinge: ω = m v r / (I + m r²).
TEST(ForcesAtLimitsTest, AHingeWithFrictionTurnsABody) {
  ExpectExact(
      Of("[0, 0]",
         R"({"name": "b", "mass": 1, "inertia": 1, "position": [1, 0], "velocity": [0, 1]})", 1.0,
         R"(, "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"],
                          "anchor": [0, 0], "friction": 0.02}])"),
      {"bodies/b/velocity/y", "joints/j/friction"},
      {{2, 0.495, {0.5, -0.25}}, {5, 0.49, {0.5, -0.5}}}, {0.02, 0.01});
}

std::string Tile(const std::string& name, double x) {
  return R"({"name": ")" + name + R"(", "static": true, "friction": 0.5, "position": [)" +
         std::to_string(x) + R"(, -0.5], "shape": {"box": {"size": [1, 1]}}})";
}
std::string Plane(const std::string& name, const std::string& normal, double offset) {
  return R"({"name": ")" + name + R"(", "static": true, "friction": 0.5, "shape":
            {"half_plane": {"normal": )" +
         normal + R"(, "offset": )" + std::to_string(offset) + "}}}";
}

// Where forces are shared between several bodies no contact's own tells when it lets go:
// x = k (T − t0)³ / (6 m) with k t0 = μ m g.
void ExpectLetGo(const std::string& others, double x, double duration, double start = 0.0) {
  SCOPED_TRACE(others);
  const double rest = duration - 0.5 * (1.0 - start / 5.0);
  const Scene scene = Of("[0, -10]", Box("b", x, 0.0, 0.5) + "," + others, duration, kForce);
  ExpectExact(WithRamp(scene, start, 10.0, false), {"bodies/*/friction"},
              {{0, x + 10.0 / 6.0 * rest * rest * rest, {-5.0 * rest * rest}},
               {3, 5.0 * rest * rest, {-10.0 * rest}}});
}

TEST(ForcesAtLimitsTest, BodiesThatShareForcesLetGoTogether) {
  const std::string tiles = Tile("left", -0.5) + "," + Tile("right", 0.5);
  const std::string wall = Plane("wall", "[1, 0]", 0.0);
  ExpectLetGo(tiles, 0.0, 0.9);
  ExpectLetGo(Floor(0.5) + "," + wall, 0.1, 1.0);
  ExpectLetGo(Floor(0.5) + "," + Plane("ceiling", "[0, -1]", -0.1), 0.0, 1.0);
  // As the run starts, at the limit and just below it.
  ExpectLetGo(tiles, 0.0, 0.35, 5.0);
  ExpectLetGo(tiles, 0.0, 0.4, 4.0);
}

// Two blocks, the first of which pushes the second.
TEST(ForcesAtLimitsTest, ABlockPushesAnother) {
  const Scene scene =
      Of("[0, -10]", Box("b", 0.0, 0.0, 0.5) + "," + Box("c", 0.2, 0.0, 0.5) + "," + Floor(0.5),
         1.0, kForce);
  ExpectExact(WithRamp(scene, 0.0, 20.0, false), {"bodies/*/friction"},
              {{0, 0.625 / 3.0, {-1.25}}, {6, 0.2 + 0.625 / 3.0, {-1.25}}});
}

// A block between two walls that it touches without a load is lifted.
TEST(ForcesAtLimitsTest, ABlockIsLiftedBetweenWalls) {
  const Scene scene = Of("[0, -10]",
                         Box("b", 0.1, 0.0, 0.5) + "," + Floor(0.5) + "," +
                             Plane("left", "[1, 0]", 0.0) + "," + Plane("right", "[-1, 0]", -0.2),
                         1.0, kForce);
  // How hard the walls press is not determined, which the certificate says.
  for (const double dt : {0.5, 0.25, 0.1, 0.03}) {
    Scene lifted = WithRamp(scene, 0.0, 20.0, true);
    lifted.simulation.dt = dt;
    const GradientResult result =
        testing::Jacobian(lifted, {"bodies/b/mass"}, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[1], 0.05 + 20.0 / 48.0, kOfValue) << dt;
    EXPECT_NEAR(result.jacobian(1, 0), -20.0 / 48.0 - 1.25, kOfDerivative) << dt;
    EXPECT_NEAR(result.jacobian(4, 0), -7.5, kOfDerivative) << dt;
  }
}

}  // namespace
}  // namespace tangible
