// SPDX-License-Identifier: Apache-2.0
//
// Events that fall exactly on the end of a step, or on the start of a run: values and derivatives
// are those of closed forms, by all methods and from both sides, for steps that divide the event's
// time and for steps that do not.

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "../../support/exact_runs.h"

namespace tangible {
namespace {

using namespace exact_runs;  // NOLINT(google-build-using-namespace)
using test_scenes::SceneOf;

// x = v² / (2 μ g).
TEST(EventCoincidencesTest, ABlockStops) {
  ExpectExact(Of("[0, -10]", Box("b", 0.0, 1.0, 0.2) + "," + Floor(0.2), 0.75),
              {"bodies/b/velocity/x", "bodies/*/friction"}, {{0, 0.25, {0.5, -1.25}}});
}

// Two blocks that have nothing to do with each other stop at once.
TEST(EventCoincidencesTest, TwoBlocksStopAtOnce) {
  ExpectExact(Of("[0, -10]",
                 Box("b", 0.0, 1.0, 0.2) + "," + Box("c", 3.0, -1.0, 0.2) + "," + Floor(0.2), 0.75),
              {"bodies/b/velocity/x", "bodies/c/velocity/x", "bodies/*/friction"},
              {{0, 0.25, {0.5, 0.0, -1.25}}, {6, 2.75, {0.0, 0.5, 1.25}}});
}

// Up a slope and back: a1 = 6 + 8 μ, a2 = 6 − 8 μ, x = v² / (2 a1) − a2 (T − v / a1)² / 2.
TEST(EventCoincidencesTest, ABlockTurnsBackOnASlope) {
  ExpectExact(Of("[-6, -8]", Box("b", 0.0, 4.0, 0.25) + "," + Floor(0.25), 0.9),
              {"bodies/b/velocity/x", "bodies/*/friction"},
              {{0, 0.68, {0.7, -1.16}}, {3, -1.6, {0.5, 1.2}}});
}

// x = v t − μ g t² / 2 + 2 v / 3 (T − t) with t = v / (3 μ g).
TEST(EventCoincidencesTest, ADiscRolls) {
  ExpectExact(Of("[0, -10]", Disc("b", 0.0, 0.1, 1.5, 0.1) + "," + Floor(0.1), 0.8),
              {"bodies/b/velocity/x", "bodies/*/friction"},
              {{0, 0.925, {0.7, -1.25}}, {3, 1.0, {2.0 / 3.0, 0.0}}});
}

// k t reaches μ m g at t0: x = k (T − t0)³ / (6 m).
TEST(EventCoincidencesTest, ABlockBreaksLoose) {
  const Scene scene = Of("[0, -10]", Box("b", 0.0, 0.0, 0.5) + "," + Floor(0.5), 1.0, kForce);
  ExpectExact(WithRamp(scene, 0.0, 10.0, false), {"bodies/*/friction", "bodies/b/mass"},
              {{0, 10.0 / 48.0, {-1.25, -10.0 / 48.0 - 0.625}}, {3, 1.25, {-5.0, -3.75}}});
  // The force is at the limit as the run starts, and at once beyond: x = k T³ / (6 m).
  ExpectExact(WithRamp(scene, 5.0, 10.0, false), {"bodies/*/friction", "bodies/b/mass"},
              {{0, 10.0 / 6.0, {-5.0, -2.5 - 10.0 / 6.0}}, {3, 5.0, {-10.0, -10.0}}});
}

// Two blocks at rest, pushed with 2 μ m g from the same instant s on: x = μ g (T − s)² / 2, and the
// start of the one's force does not move the other.
TEST(EventCoincidencesTest, TwoWindowsOpenAtOneInstant) {
  const Scene scene = Of(
      "[0, -10]", Box("b", 0.0, 0.0, 0.5) + "," + Box("c", 3.0, 0.0, 0.5) + "," + Floor(0.5), 1.0,
      R"(, "forces": [{"name": "f", "body": "b", "force": [10, 0], "start": 0.5, "end": 9},
                         {"name": "g", "body": "c", "force": [10, 0], "start": 0.5, "end": 9}])");
  ExpectExact(scene, {"forces/f/start", "forces/g/start"},
              {{0, 0.625, {-2.5, 0.0}}, {6, 3.625, {0.0, -2.5}}, {9, 2.5, {0.0, -5.0}}});
}

// k t reaches m g at t0: y = r + k (T − t0)³ / (6 m).
TEST(EventCoincidencesTest, ADiscIsLiftedOff) {
  const Scene scene = Of("[0, -10]", Disc("b", 0.0, 0.1, 0.0, 0.5) + "," + Floor(0.5), 1.0, kForce);
  ExpectExact(WithRamp(scene, 0.0, 20.0, true), {"bodies/b/mass"},
              {{1, 0.1 + 20.0 / 48.0, {-20.0 / 48.0 - 1.25}}, {4, 2.5, {-7.5}}});
}

// A disc dropped from h above the floor bounces as a block stops elsewhere, t0 = √(2 h / g):
// y = r + e g t0 (T − t0) − g (T − t0)² / 2, ∂y/∂h = (1 + e) (T − t0) / t0 − e.
TEST(EventCoincidencesTest, ADiscBouncesAsABlockStops) {
  ExpectExact(
      Of("[0, -10]",
         Box("b", 0.0, 1.0, 0.2) + "," + Disc("c", 3.0, 1.35, 0.0, 0.2) + "," + Floor(0.2), 0.7),
      {"bodies/b/velocity/x", "bodies/c/position/y", "bodies/*/friction"},
      {{0, 0.25, {0.5, 0.0, -1.25}}, {7, 0.4, {0.0, 0.1, 0.0}}});
}

// A slider that is driven onto its limit stays there.
TEST(EventCoincidencesTest, ASliderMeetsItsLimit) {
  ExpectExact(
      Of("[2, 0]",
         R"({"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [0.75, 0]})",
         0.75, R"(, "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"],
             "anchor": [0, 0], "axis": [1, 0], "limits": [-1, 0.625]}])"),
      {"bodies/b/velocity/x"}, {{0, 0.625, {0.0}}, {3, 0.0, {0.0}}});
}

// A gap that closes under a constant acceleration and bounces once, and what changes it.
struct Rebound {
  enum { kGap, kSpeed, kAcceleration, kRestitution, kCount };

  Rebound(double gap, double speed, double a, double e, double duration) {
    const double impact = -std::sqrt(speed * speed - 2.0 * a * gap);
    const double t = (impact - speed) / a;
    const double rest = duration - t;
    // Without rebound the gap stays closed.
    const double after = e == 0.0 ? 0.0 : a;
    value = -e * impact * rest + 0.5 * after * rest * rest;
    rate = -e * impact + after * rest;
    const double own[kCount] = {1.0, t, 0.5 * t * t, 0.0};
    for (int k = 0; k < kCount; ++k) {
      const double dt = -own[k] / impact;
      const double d_impact = (k == kSpeed ? 1.0 : k == kAcceleration ? t : 0.0) + a * dt;
      const double d_after = k == kAcceleration && e != 0.0 ? 1.0 : 0.0;
      const double de = k == kRestitution ? 1.0 : 0.0;
      d_rate[k] = -de * impact - e * d_impact + d_after * rest - after * dt;
      d_value[k] = (-de * impact - e * d_impact) * rest + e * impact * dt +
                   0.5 * d_after * rest * rest - after * rest * dt;
    }
  }
  double value = 0.0, rate = 0.0;
  double d_value[kCount], d_rate[kCount];
};

// A disc without friction that meets the floor and a wall at the same instant, 0.5 s, in axes that
// are turned by an angle.
Scene Corner(double e_wall, double e_floor, double angle, const std::string& law) {
  std::ostringstream text;
  text.precision(17);
  const auto turned = [&](double x, double y) {
    text << "[" << std::cos(angle) * x - std::sin(angle) * y << ", "
         << std::sin(angle) * x + std::cos(angle) * y << "]";
  };
  text << R"({"gravity": )";
  turned(0.4, -10.0);
  text << R"(, "bodies": [{"name": "b", "shape": {"circle": {"radius": 0.125}}, "mass": 1,
      "angular_velocity": 3, "position": )";
  turned(0.0, 0.875);
  text << R"(, "velocity": )";
  turned(1.65, 1.0);
  text
      << R"(}, {"name": "floor", "static": true, "shape": {"half_plane": {"offset": 0, "normal": )";
  turned(0.0, 1.0);
  text
      << R"(}}}, {"name": "wall", "static": true, "shape": {"half_plane": {"offset": -1, "normal": )";
  turned(-1.0, 0.0);
  text << R"(}}}], "pairs": [{"bodies": ["b", "floor"], "friction": 0, "restitution": )" << e_floor
       << R"(}, {"bodies": ["b", "wall"], "friction": 0, "restitution": )" << e_wall
       << R"(}], "simulation": {"stepping": "event", "duration": 0.75, "impact_law": ")" << law
       << R"("}})";
  return SceneOf(text.str());
}

// Each impact changes the speed along its own normal alone, so that both coordinates are motions of
// their own, whichever impact is first.
void ExpectCorner(double e_wall, double e_floor, double angle, const std::string& law) {
  SCOPED_TRACE(law + ", wall " + std::to_string(e_wall) + ", floor " + std::to_string(e_floor) +
               ", angle " + std::to_string(angle));
  const Rebound x(0.875, -1.65, -0.4, e_wall, 0.75);
  const Rebound y(0.75, 1.0, -10.0, e_floor, 0.75);
  // Rows x, y, vx, vy; columns positions, velocities, gravity, restitutions.
  Eigen::Matrix<double, 4, 8> jacobian = Eigen::Matrix<double, 4, 8>::Zero();
  for (int k = 0; k < 3; ++k) {
    jacobian(0, 2 * k) = x.d_value[k];
    jacobian(2, 2 * k) = x.d_rate[k];
    jacobian(1, 2 * k + 1) = y.d_value[k];
    jacobian(3, 2 * k + 1) = y.d_rate[k];
  }
  jacobian(0, 6) = -x.d_value[Rebound::kRestitution];
  jacobian(2, 6) = -x.d_rate[Rebound::kRestitution];
  jacobian(1, 7) = y.d_value[Rebound::kRestitution];
  jacobian(3, 7) = y.d_rate[Rebound::kRestitution];
  Eigen::Vector4d values(1.0 - 0.125 - x.value, 0.125 + y.value, -x.rate, y.rate);
  Eigen::Matrix2d turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  for (int k = 0; k < 4; k += 2) {
    values.segment<2>(k) = (turn * values.segment<2>(k)).eval();
    jacobian.middleRows<2>(k) = (turn * jacobian.middleRows<2>(k)).eval();
  }
  for (int k = 0; k < 6; k += 2) {
    jacobian.middleCols<2>(k) = (jacobian.middleCols<2>(k) * turn.transpose()).eval();
  }
  // At 0 a restitution has one derivative alone.
  std::vector<std::string> paths = {"bodies/b/position/x", "bodies/b/position/y",
                                    "bodies/b/velocity/x", "bodies/b/velocity/y",
                                    "gravity/x",           "gravity/y"};
  if (e_wall > 0.0) paths.emplace_back("pairs/b:wall/restitution");
  if (e_floor > 0.0) paths.emplace_back("pairs/b:floor/restitution");
  std::vector<Exact> exact;
  for (int row = 0; row < 4; ++row) {
    Exact e{row < 2 ? row : row + 1, values[row], {}};
    for (int k = 0; k < 8; ++k) {
      if ((k == 6 && e_wall == 0.0) || (k == 7 && e_floor == 0.0)) continue;
      e.derivatives.push_back(jacobian(row, k));
    }
    exact.push_back(e);
  }
  ExpectExact(Corner(e_wall, e_floor, angle, law), paths, exact);
}

// Each impact changes the speed along its own normal alone, so that both coordinates are motions of
// their own, whichever impact is first.
TEST(EventCoincidencesTest, ADiscMeetsAFloorAndAWall) {
  ExpectCorner(0.5, 0.8, 0.0, "newton");
  ExpectCorner(0.8, 0.0, 0.0, "newton");
  ExpectCorner(0.0, 0.5, 0.3, "newton");
  ExpectCorner(0.0, 0.0, 0.0, "newton");
  ExpectCorner(0.5, 0.8, 0.3, "poisson");
}

// A force on a box begins as a disc elsewhere meets a floor and a wall: whatever delays the disc
// leaves the box as it is.
TEST(EventCoincidencesTest, AForceBeginsAsADiscMeetsAFloorAndAWall) {
  ExpectExact(
      Of("[0, 0]",
         R"({"name": "disc", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "restitution": 0.5,
             "position": [0, 0.625], "velocity": [1.75, -1]}, )" +
             Floor(0.0) +
             R"(, {"name": "wall", "static": true, "restitution": 0.5,
                  "shape": {"half_plane": {"normal": [-1, 0], "offset": -1}}},
                 {"name": "b", "mass": 2, "inertia": 1, "position": [9, 9]})",
         0.75,
         R"(, "forces": [{"name": "f", "body": "b", "force": [16, 0], "start": 0.5, "end": 9}])"),
      {"bodies/disc/velocity/x", "bodies/disc/position/y", "forces/f/start"},
      {{1, 0.125 + 0.125, {0.0, -0.5, 0.0}},
       {3, -0.875, {-0.5, 0.0, 0.0}},
       {6, 9.25, {0.0, 0.0, -2.0}},
       {9, 2.0, {0.0, 0.0, -8.0}}});
}

// A force on a box ends as a disc elsewhere lands for the second time, on a step's end: the landing
// leaves the box as it is, and the end of the force has its derivative.
TEST(EventCoincidencesTest, AForceEndsAsADiscLandsElsewhere) {
  ExpectExact(
      Of("[0, -10]",
         R"({"name": "disc", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "restitution": 0.5,
             "position": [0, 1.375]}, )" +
             Floor(0.0) + R"(, {"name": "b", "mass": 2, "inertia": 1, "position": [9, 9]})",
         1.2,
         R"(, "forces": [{"name": "f", "body": "b", "force": [16, 20], "start": -1, "end": 1}])"),
      {"bodies/disc/position/y", "forces/f/end"},
      {{6, 9.0 + 4.0 + 1.6, {0.0, 1.6}}, {9, 8.0, {0.0, 8.0}}});
}

// A carriage on a rail with a cross slide, whose limits are met at one instant: each limit stops
// its own coordinate through the joints.
TEST(EventCoincidencesTest, TwoSlidersMeetTheirLimits) {
  ExpectExact(
      Of("[2, 2]",
         R"({"name": "a", "mass": 2, "inertia": 1, "position": [0, 0], "velocity": [0.75, 0]},
            {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [0.75, 0.75]})",
         0.75, R"(, "joints": [{"name": "j", "type": "prismatic", "bodies": ["a", "world"],
             "anchor": [0, 0], "axis": [1, 0], "limits": [-1, 0.625]},
             {"name": "k", "type": "prismatic", "bodies": ["b", "a"],
             "anchor": [0, 0], "axis": [0, 1], "limits": [-1, 0.625]}])"),
      {"bodies/b/velocity/y", "gravity/y"},
      {{0, 0.625, {0.0, 0.0}},
       {3, 0.0, {0.0, 0.0}},
       {7, 0.625, {0.0, 0.0}},
       {10, 0.0, {0.0, 0.0}}});
}

// A disc on two slides at right angles, the first of which carries the other: a wall and the limit
// of the second slide do not act on each other through the joints.
TEST(EventCoincidencesTest, ADiscOnSlidesMeetsAWallAndALimit) {
  const double e = 0.5;
  const Rebound x(0.875, -1.65, -0.4, e, 0.75);
  ExpectExact(
      Of("[0.4, 2]",
         R"({"name": "a", "mass": 2, "inertia": 1, "position": [0, 0], "velocity": [1.65, 0]},
            {"name": "b", "mass": 1, "position": [0, 0], "velocity": [1.65, 0.75],
             "restitution": 0.25, "shape": {"circle": {"radius": 0.125}}},
            {"name": "wall", "static": true, "restitution": 0.75,
             "shape": {"half_plane": {"normal": [-1, 0], "offset": -1}}})",
         0.75, R"(, "joints": [{"name": "j", "type": "prismatic", "bodies": ["a", "world"],
             "anchor": [0, 0], "axis": [1, 0]},
             {"name": "k", "type": "prismatic", "bodies": ["b", "a"],
             "anchor": [0, 0], "axis": [0, 1], "limits": [-1, 0.625]}])"),
      {"bodies/wall/restitution", "gravity/x", "gravity/y"},
      {{0,
        0.875 - x.value,
        {-0.5 * x.d_value[Rebound::kRestitution], x.d_value[Rebound::kAcceleration], 0.0}},
       {7, 0.625, {0.0, 0.0, 0.0}},
       {9,
        -x.rate,
        {-0.5 * x.d_rate[Rebound::kRestitution], x.d_rate[Rebound::kAcceleration], 0.0}},
       {10, 0.0, {0.0, 0.0, 0.0}}});
}

// A disc that rolls on a floor meets a wall without friction, which leaves its load and its spin as
// they are: x = W − e v τ + μ g τ² / 2 for τ after the impact, while it slides back.
TEST(EventCoincidencesTest, ADiscThatRollsMeetsAWall) {
  ExpectExact(
      Of("[0, -10]",
         R"({"name": "b", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "friction": 0.1,
             "position": [0, 0.125], "velocity": [1.75, 0], "angular_velocity": -14},
            {"name": "wall", "static": true,
             "shape": {"half_plane": {"normal": [-1, 0], "offset": -1}}}, )" +
             Floor(0.1),
         0.75, R"(, "pairs": [{"bodies": ["b", "wall"], "friction": 0, "restitution": 0.5}])"),
      {"bodies/b/position/x", "pairs/b:wall/restitution", "bodies/b/friction"},
      {{0, 0.875 - 0.21875 + 0.03125, {-0.5 + 0.25 / 1.75, -0.4375, 0.15625}},
       {3, -0.875 + 0.25, {1.0 / 1.75, -1.75, 1.25}}});
}

// A wheel whose friction is just overcome as the run starts, by an effort that grows by k:
// ω = k T² / (2 I), as for any friction nearby. Turned forwards it keeps its speed, turned back it
// first stops, at a deceleration of twice the friction.
TEST(EventCoincidencesTest, AWheelThatBreaksLooseAtTheStart) {
  Scene scene = Of("[0, 0]", R"({"name": "b", "mass": 1, "inertia": 2, "position": [0, 0]})", 0.5,
                   R"(, "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"],
             "anchor": [0, 0], "friction": 3}])");
  Signal ramp;
  ramp.interpolation = Signal::Interpolation::kLinear;
  ramp.time = {0.0, 10.0};
  ramp.value = {3.0, 83.0};
  scene.joints[0].effort_signal = ramp;
  ExpectExact(scene, {"joints/j/friction"}, {{5, 0.5, {-0.25}}});
  const std::vector<std::string> paths = {"bodies/b/angular_velocity"};
  const GradientResult both = testing::Jacobian(scene, paths, GradientMethod::kTangent);
  EXPECT_NE(both.certificate.verdict.find("friction limit"), std::string::npos)
      << both.certificate.verdict;
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const GradientResult one = FinalStateJacobian(
        scene, testing::Resolve(scene, paths), {.method = GradientMethod::kTangent, .side = side});
    ASSERT_TRUE(one.done) << one.message;
    EXPECT_NEAR(one.jacobian(5, 0), side == DerivativeSide::kPlus ? 1.0 : 0.0, 1e-6);
  }
}

// Where friction falls with the speed a motion has an integrator's error, in which an event on a
// step's end is a kink: beside it the event splits the one step or the other.
TEST(EventCoincidencesTest, AnEventOnAStepsEndSplitsEitherStep) {
  Scene scene = Of(
      "[0, 0]", R"({"name": "b", "mass": 1, "inertia": 0.5, "position": [0, 0]})", 0.3,
      R"(, "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"], "axis": [1, 0],
             "anchor": [0, 0], "friction": 2, "kinetic_friction": 1, "stribeck_speed": 0.5}])");
  Signal ramp;
  ramp.interpolation = Signal::Interpolation::kLinear;
  ramp.time = {0.0, 10.0};
  ramp.value = {0.0, 200.0};  // reaches the friction at 0.1 s
  scene.joints[0].effort_signal = ramp;
  const std::vector<std::string> paths = {"joints/j/friction"};
  for (const double dt : {0.05, 0.03}) {
    scene.simulation.dt = dt;
    const std::string verdict =
        testing::Jacobian(scene, paths, GradientMethod::kTangent).certificate.verdict;
    const bool is_named = verdict.find("splits either step") != std::string::npos;
    EXPECT_EQ(is_named, dt == 0.05) << verdict;
    EXPECT_EQ(verdict == "trustworthy", dt != 0.05) << verdict;
  }
  scene.joints[0].kinetic_friction.reset();
  scene.simulation.dt = 0.05;
  EXPECT_EQ(testing::Jacobian(scene, paths, GradientMethod::kTangent).certificate.verdict,
            "trustworthy");
}

// Friction F e^(−(v / u)²) stops a mass after ∫ m e^(v²) / F dv = 0.5 s, at
// x = m u² (e^((v0 / u)²) − 1) / (2 F). The steps are those whose error is rounding here.
TEST(EventCoincidencesTest, StribecksFrictionStopsASlider) {
  const double mass = 0.5 / 0.5449871041836222;
  const double e = std::exp(0.25);
  const double x = 0.5 * mass * (e - 1.0);
  Scene scene = Of("[0, 0]", R"({"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
                                 "velocity": [0.5, 0]})",
                   0.75, R"(, "joints": [{"name": "j", "type": "prismatic",
      "bodies": ["b", "world"], "anchor": [0, 0], "axis": [1, 0], "friction": 1,
      "kinetic_friction": 0, "stribeck_speed": 1}])");
  scene.bodies[0].mass = mass;
  ExpectExact(
      scene,
      {"bodies/b/velocity/x", "bodies/b/mass", "joints/j/friction", "joints/j/stribeck_speed"},
      {{0, x, {mass * 0.5 * e, x / mass, -x, 2.0 * x - mass * 0.25 * e}}}, {0.01, 0.005, 0.007});
}

// A mass on a belt at the speed v that a spring k pulls back at F = k v t0, and the friction that
// falls with the slip w, F_k + (F_s − F_k) e^(−(w / u)²): its place and speed at T, by steps of
// fourth order from t0 on that are so short that their error is rounding.
struct BeltEnd {
  double x, v;
};
BeltEnd OnABelt(double limit, double kinetic, double k, double belt, double u, double duration) {
  const double start = limit / (k * belt);
  constexpr int kSteps = 20000;
  const double h = (duration - start) / kSteps;
  double x = limit / k, w = 0.0;
  const auto rate = [&](double at, double slip) {
    return -k * at + kinetic + (limit - kinetic) * std::exp(-slip * slip / (u * u));
  };
  for (int i = 0; i < kSteps; ++i) {
    const double x1 = belt + w, w1 = rate(x, w);
    const double x2 = x1 + 0.5 * h * w1, w2 = rate(x + 0.5 * h * x1, w + 0.5 * h * w1);
    const double x3 = x1 + 0.5 * h * w2, w3 = rate(x + 0.5 * h * x2, w + 0.5 * h * w2);
    const double x4 = x1 + h * w3, w4 = rate(x + h * x3, w + h * w3);
    x += h * (x1 + 2.0 * x2 + 2.0 * x3 + x4) / 6.0;
    w += h * (w1 + 2.0 * w2 + 2.0 * w3 + w4) / 6.0;
  }
  return {x, belt + w};
}

// It breaks loose at 0.5 s, on a step's end and within a step. The engine's motions have an error
// of fourth order in dt, which an event on a step's end changes as it splits either step.
TEST(EventCoincidencesTest, AMassOnABeltBreaksLoose) {
  for (const double limit : {5.0, 4.5}) {
    const double k = 100.0, belt = limit / (0.5 * k), u = 0.05, kinetic = 3.0, duration = 0.7;
    std::ostringstream text;
    text.precision(17);
    text << R"({"gravity": [0, -9.81], "bodies": [
        {"name": "belt", "kinematic": true, "position": [0, 0], "velocity": [)"
         << belt << R"(, 0]},
        {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [)"
         << belt << R"(, 0]}],
      "joints": [{"name": "f", "type": "prismatic", "bodies": ["b", "belt"], "anchor": [0, 0],
                  "axis": [1, 0], "friction": )"
         << limit << R"(, "kinetic_friction": 3, "stribeck_speed": 0.05}],
      "springs": [{"name": "k", "bodies": ["b", "world"], "anchors": [[0, 0], [-1, 0]],
                   "stiffness": 100, "rest_length": 1}],
      "simulation": {"stepping": "event", "duration": 0.7}})";
    Scene scene = SceneOf(text.str());
    const BeltEnd end = OnABelt(limit, kinetic, k, belt, u, duration);
    constexpr double kBeside = 1e-4;
    const BeltEnd more = OnABelt(limit + kBeside, kinetic, k, belt, u, duration);
    const BeltEnd less = OnABelt(limit - kBeside, kinetic, k, belt, u, duration);
    const double dx = (more.x - less.x) / (2.0 * kBeside);
    const double dv = (more.v - less.v) / (2.0 * kBeside);
    for (const double dt : {0.002, 0.0025, 0.0017}) {
      scene.simulation.dt = dt;
      const std::vector<std::string> paths = {"joints/f/friction"};
      for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                          GradientMethod::kFiniteDifference}) {
        const GradientResult result =
            testing::Jacobian(scene, paths, method, CertificatePass::kSkip);
        const std::string what = "limit " + std::to_string(limit) + ", dt " + std::to_string(dt) +
                                 ", method " + std::to_string(static_cast<int>(method));
        EXPECT_NEAR(result.values[0], end.x, 1e-6) << what;
        EXPECT_NEAR(result.jacobian(0, 0), dx, 1e-4 * std::abs(dx) + 1e-6) << what;
        EXPECT_NEAR(result.jacobian(3, 0), dv, 1e-4 * std::abs(dv) + 1e-5) << what;
      }
      for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
        const GradientResult one =
            FinalStateJacobian(scene, testing::Resolve(scene, paths),
                               {.method = GradientMethod::kTangent, .side = side});
        ASSERT_TRUE(one.done) << one.message << ", dt " << dt;
        EXPECT_NEAR(one.jacobian(0, 0), dx, 1e-4 * std::abs(dx) + 1e-6) << dt;
      }
    }
  }
}

// A disc slides off the end of a face and falls from there: y = y0 − g (T − t0)² / 2 with
// t0 = s / v. A face counts as longer by a share of its length, but not for a disc.
TEST(EventCoincidencesTest, ADiscSlidesOffAFace) {
  ExpectExact(Of("[0, -10]",
                 Disc("b", 0.0, 0.1, 2.0, 0.0) +
                     R"(, {"name": "face", "static": true, "shape": {"box": {"size": [4, 0.5]}},
                           "position": [-1, -0.25]})",
                 0.75),
              {"bodies/b/velocity/x", "bodies/b/position/x", "gravity/y"},
              {{1, 0.1 - 0.3125, {-0.625, -1.25, 0.03125}}, {4, -2.5, {-2.5, -5.0, 0.25}}});
}

// The run ends as the disc reaches the end of the face, beyond which its speed falls; elsewhere on
// the face it does not, nor where the disc rests there.
TEST(EventCoincidencesTest, TheEndOfAFaceAtTheLastInstantIsAKink) {
  for (const auto& [speed, is_kink] : {std::pair(2.0, true), {1.9, false}, {0.0, false}}) {
    Scene scene = Of("[0, -10]",
                     Disc("b", speed == 0.0 ? 1.0 : 0.0, 0.1, speed, 0.0) +
                         R"(, {"name": "face", "static": true, "shape": {"box": {"size": [4, 0.5]}},
                               "position": [-1, -0.25]})",
                     0.5);
    for (const double dt : {0.5, 0.25, 0.01, 0.007}) {
      scene.simulation.dt = dt;
      const std::string verdict =
          testing::Jacobian(scene, {"bodies/b/velocity/x"}, GradientMethod::kTangent)
              .certificate.verdict;
      EXPECT_EQ(verdict.find("another corner or edge takes over") != std::string::npos, is_kink)
          << verdict << ", dt " << dt << ", speed " << speed;
    }
  }
}

// An event at the end of the run: positions are differentiable, the speed has another derivative on
// each side, which the verdict says.
TEST(EventCoincidencesTest, TheLastInstantOfARunIsAKink) {
  Scene scene = Of("[-6, -8]", Box("b", 0.0, 4.0, 0.25) + "," + Floor(0.25), 0.5);
  for (const double dt : {0.5, 0.25, 0.01, 0.007}) {
    scene.simulation.dt = dt;
    const std::vector<std::string> paths = {"bodies/b/velocity/x"};
    const GradientResult both = testing::Jacobian(scene, paths, GradientMethod::kTangent);
    EXPECT_NE(both.certificate.verdict.find("the run ends as it stops sliding"), std::string::npos)
        << both.certificate.verdict;
    EXPECT_NEAR(both.jacobian(0, 0), 0.5, kOfDerivative) << dt;
    for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
      const GradientResult one =
          FinalStateJacobian(scene, testing::Resolve(scene, paths),
                             {.method = GradientMethod::kTangent, .side = side});
      ASSERT_TRUE(one.done) << one.message;
      EXPECT_NEAR(one.jacobian(0, 0), 0.5, kOfDerivative) << dt;
      EXPECT_NEAR(one.jacobian(3, 0), side == DerivativeSide::kPlus ? 1.0 : 0.5, kOfDerivative);
    }
  }
  Scene ball = Of("[0, -10]", Disc("b", 0.0, 1.35, 0.0, 0.0) + "," + Floor(0.0), 0.5);
  for (const double dt : {0.5, 0.25, 0.01, 0.007}) {
    ball.simulation.dt = dt;
    const GradientResult both =
        testing::Jacobian(ball, {"bodies/b/position/y"}, GradientMethod::kTangent);
    EXPECT_NE(both.certificate.verdict.find("discontinuous"), std::string::npos)
        << both.certificate.verdict;
  }
}

}  // namespace
}  // namespace tangible
