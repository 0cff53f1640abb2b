// SPDX-License-Identifier: Apache-2.0
//
// Bodies on a table seen from above, by events: rest and start at instants, against closed forms
// and an integrator of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/dynamics/elements/support.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kStandardG = 9.81;

// One body "b" of 2 kg with these keys, and what the scene has beside it.
Scene TableByEvents(const std::string& keys, double dt, double duration,
                    const std::string& gravity = "0, 0", const std::string& rest = "") {
  return SceneOf(R"({"gravity": [)" + gravity + R"(], "bodies": [{"name": "b", "mass": 2, )" +
                 keys + "}" + rest + R"(], "simulation": {"stepping": "event", "dt": )" +
                 std::to_string(dt) + R"(, "duration": )" + std::to_string(duration) + "}}");
}

const char kSlidesFreely[] =
    R"("inertia": 0.1, "position": [0.5, 0.2], "velocity": [0.6, 0.8], "angular_velocity": 3,
       "support": {"friction": 0.25})";

// v² / (2 μ g) along its direction, then rest to the bit; friction without arm gives no torque.
TEST(SupportsByEventsTest, ABlockSlidesStraightAndStops) {
  for (const double dt : {0.01, 0.04}) {
    const double a = 0.25 * kStandardG;
    const Scene scene = TableByEvents(kSlidesFreely, dt, 1.0);
    const std::vector<std::string> paths = {"bodies/b/velocity/x", "bodies/b/support/friction",
                                            "bodies/b/mass", "bodies/b/angle"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double way = 0.5 / a;
    EXPECT_NEAR(result.values[0], 0.5 + 0.6 * way, 1e-10);
    EXPECT_NEAR(result.values[1], 0.2 + 0.8 * way, 1e-10);
    EXPECT_EQ(result.values[3], 0.0);
    EXPECT_EQ(result.values[4], 0.0);
    EXPECT_NEAR(result.values[5], 3.0, 1e-14);
    // Along its direction v / a, across it half of that.
    EXPECT_NEAR(result.jacobian(0, 0), (0.36 + 0.5 * 0.64) / a, 1e-7);
    EXPECT_NEAR(result.jacobian(1, 0), (0.48 - 0.5 * 0.48) / a, 1e-7);
    EXPECT_NEAR(result.jacobian(0, 1), -0.6 * way / 0.25, 1e-8);
    EXPECT_NEAR(result.jacobian(0, 2), 0.0, 1e-10);  // the load follows the mass
    EXPECT_NEAR(result.jacobian(3, 0), 0.0, 1e-12);
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    ExpectOthersAgree(scene, paths, result);
  }
}

// Up a tilted table and back: it turns at t = v / a1 = 0.5 s, on a step's end or within a step, and
// is at v² / (2 a1) − a2 (T − t)² / 2 in the end, with a1 = g + μ N / m and a2 = g − μ N / m.
TEST(SupportsByEventsTest, ABlockTurnsBackOnATiltedTable) {
  for (const double mu : {0.25, 0.3, 0.125}) {
    const double g = 8.0 - 8.0 * mu, a1 = 8.0, a2 = g - 8.0 * mu, rest = 0.4;
    for (const double dt : {0.5, 0.25, 0.1, 0.05, 0.02, 0.01, 0.03, 0.007}) {
      const Scene scene = TableByEvents(R"("inertia": 1, "position": [0, 0], "velocity": [4, 0],
              "support": {"load": 16, "friction": )" +
                                            std::to_string(mu) + "}",
                                        dt, 0.9, std::to_string(-g) + ", 0");
      const std::vector<std::string> paths = {"bodies/b/velocity/x", "bodies/b/support/friction"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      EXPECT_NEAR(result.values[0], 1.0 - 0.5 * a2 * rest * rest, 1e-9) << dt;
      EXPECT_NEAR(result.values[3], -a2 * rest, 1e-9) << dt;
      // t changes by 1 / a1 with v, and by −8 t / a1 with μ.
      EXPECT_NEAR(result.jacobian(0, 0), 0.5 + a2 * rest / a1, 1e-7) << dt;
      EXPECT_NEAR(result.jacobian(3, 0), a2 / a1, 1e-7) << dt;
      EXPECT_NEAR(result.jacobian(0, 1), -1.0 + 4.0 * rest * rest - 0.5 * a2 * rest, 1e-7) << dt;
      EXPECT_EQ(result.certificate.verdict, "trustworthy") << dt;
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// A run that ends as the support brings the body to rest: its speed has a derivative on each side.
TEST(SupportsByEventsTest, ARunEndsAsABlockStops) {
  for (const double dt : {0.5, 0.25, 0.1, 0.01, 0.03, 0.007}) {
    const Scene scene = TableByEvents(R"("inertia": 1, "position": [0, 0], "velocity": [1, 0],
            "support": {"load": 20, "friction": 0.2})",
                                      dt, 0.5);
    const std::vector<std::string> paths = {"bodies/b/velocity/x"};
    const GradientResult both = Jacobian(scene, paths, GradientMethod::kTangent);
    EXPECT_NE(both.certificate.verdict.find("the run ends as it stops sliding"), std::string::npos)
        << both.certificate.verdict << ", dt " << dt;
    EXPECT_NEAR(both.jacobian(0, 0), 0.5, 1e-7) << dt;
    for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
      const GradientResult one =
          FinalStateJacobian(scene, testing::Resolve(scene, paths),
                             {.method = GradientMethod::kTangent, .side = side});
      ASSERT_TRUE(one.done) << one.message << ", dt " << dt;
      EXPECT_NEAR(one.jacobian(3, 0), side == DerivativeSide::kPlus ? 1.0 : 0.0, 1e-6) << dt;
    }
  }
}

// On a tilted table it stays exactly where gravity is within the cone, and slides beyond.
TEST(SupportsByEventsTest, ATableThatIsTilted) {
  const std::string keys =
      R"("inertia": 0.1, "position": [0.3, 0.1], "support": {"friction": 0.25})";
  for (const char* support :
       {"0.25", "0.25, \"radius\": 0.2", "0.25, \"points\": [[1, 0], [0, 1]]"}) {
    std::string own = keys;
    own.replace(own.find("0.25"), 4, support);
    const bool turns = support[4] != '\0' && support[7] == 'p';
    const Scene below = TableByEvents(own, 0.01, 0.5, turns ? "0.5, -0.5" : "1.4, -2.0");
    const GradientResult rests = Jacobian(below, {"gravity/x"}, GradientMethod::kTangent);
    EXPECT_EQ(rests.values[0], 0.3) << support;
    EXPECT_EQ(rests.values[1], 0.1) << support;
    EXPECT_EQ(rests.values[2], 0.0) << support;
    EXPECT_EQ(rests.jacobian.cwiseAbs().maxCoeff(), 0.0);
  }
  const Scene above = TableByEvents(keys, 0.01, 1.0, "1.8, -2.4");
  const std::vector<std::string> paths = {"gravity/x", "gravity/y", "bodies/b/support/friction"};
  const GradientResult slides = Jacobian(above, paths, GradientMethod::kAdjoint);
  const double left = 3.0 - 0.25 * kStandardG;
  EXPECT_NEAR(slides.values[0], 0.3 + 0.6 * left * 0.5, 1e-10);
  EXPECT_NEAR(slides.values[1], 0.1 - 0.8 * left * 0.5, 1e-10);
  EXPECT_NEAR(slides.jacobian(0, 0), (0.36 + 0.64 * left / 3.0) * 0.5, 1e-6);
  EXPECT_NEAR(slides.jacobian(1, 2), 0.8 * kStandardG * 0.5, 1e-8);
  ExpectOthersAgree(above, paths, slides);
}

// A force on the body's centre with this signal.
BasicForce<double> PushBy(std::vector<double> times, std::vector<double> x, std::vector<double> y) {
  BasicForce<double> push;
  push.name = "push";
  push.body = 0;
  Signal signal;
  signal.interpolation = Signal::Interpolation::kLinear;
  signal.time = std::move(times);
  signal.x = std::move(x);
  signal.y = std::move(y);
  push.force_signal = signal;
  return push;
}

// A force that grows, c t: from t₀ = μ N / c on the body moves by c (t − t₀)³ / (6 m), in its
// direction; t₀ lies within a step or on its end.
TEST(SupportsByEventsTest, AGrowingForceBreaksItLoose) {
  for (const char* support : {"", R"(, "radius": 0.2)", R"(, "points": [[1, 0], [-1, 0]])"}) {
    for (const double rate : {11.0, 10.0}) {
      SCOPED_TRACE(std::string(support) + " " + std::to_string(rate));
      Scene scene = TableByEvents(std::string(R"("inertia": 0.1, "position": [0, 0],
          "support": {"friction": 0.25, "load": 20)") +
                                      support + "}",
                                  0.01, 1.0);
      scene.forces.push_back(PushBy({0.0, 1.0}, {0.0, 0.6 * rate}, {0.0, 0.8 * rate}));
      const std::vector<std::string> paths = {"bodies/b/support/friction", "bodies/b/mass"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      const double since = 1.0 - 5.0 / rate;
      const double way = rate * since * since * since / 12.0;
      EXPECT_NEAR(result.values[0], 0.6 * way, 1e-9);
      EXPECT_NEAR(result.values[1], 0.8 * way, 1e-9);
      EXPECT_NEAR(result.values[2], 0.0, 1e-12);
      EXPECT_NEAR(result.jacobian(0, 0), -0.6 * 20.0 * since * since / 4.0, 1e-6);
      EXPECT_NEAR(result.jacobian(1, 1), -0.8 * way / 2.0, 1e-7);
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// A body on a rail that a force pushes back: it stops, rests while friction holds it, and returns.
TEST(SupportsByEventsTest, ABodyOnARailTurnsRound) {
  Scene scene = TableByEvents(R"("inertia": 0.1, "position": [0, 0], "velocity": [1, 0],
      "support": {"friction": 0.25, "load": 20})",
                              0.01, 1.0);
  BasicJoint<double> rail;
  rail.name = "rail";
  rail.type = JointType::kPrismatic;
  rail.bodies[0] = 0;
  rail.axis = Vector2<double>(1.0, 0.0);
  scene.joints.push_back(rail);
  BasicForce<double> push;
  push.name = "push";
  push.body = 0;
  push.force = Vector2<double>(-8.0, 0.0);
  scene.forces.push_back(push);
  const std::vector<std::string> paths = {"joints/rail/rate", "bodies/b/support/friction",
                                          "forces/push/force/x"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  // Slower by (8 + 5) / 2 until it stops, then faster by (8 − 5) / 2.
  const double stops = 1.0 / 6.5, back = 1.0 - stops;
  EXPECT_NEAR(result.values[0], 0.5 * stops - 0.75 * back * back, 1e-10);
  EXPECT_NEAR(result.values[3], -1.5 * back, 1e-10);
  // By the rate: stops / 1 of the way there, and later by 1 / 6.5 afterwards.
  EXPECT_NEAR(result.jacobian(0, 0), stops + 1.5 * back / 6.5, 1e-8);
  EXPECT_NEAR(result.jacobian(3, 0), 1.5 / 6.5, 1e-8);
  ExpectOthersAgree(scene, paths, result);
}

// The motion of a disc of unit mass by its own integrator: of (v, ω) over σ with dt = |u| dσ, in
// which it comes to rest exponentially, by the classical rule with small steps.
void IntegrateDisc(double radius, double limit, double inertia, double x[6]) {
  const auto rates = [&](const double* at, double* rate) {
    const double size = std::hypot(at[3], at[4], radius * at[5]);
    double friction[3];
    DiscFriction(radius, at + 3, friction);
    for (int i = 0; i < 3; ++i) {
      rate[i] = size * at[3 + i];
      rate[3 + i] = size * limit * friction[i] / (i < 2 ? 1.0 : inertia);
    }
  };
  const double step = 2e-4 / limit;
  while (std::hypot(x[3], x[4], radius * x[5]) > 1e-9) {
    double k[4][6], at[6];
    rates(x, k[0]);
    for (int s = 1; s < 4; ++s) {
      for (int i = 0; i < 6; ++i) at[i] = x[i] + (s == 3 ? 1.0 : 0.5) * step * k[s - 1][i];
      rates(at, k[s]);
    }
    for (int i = 0; i < 6; ++i) {
      x[i] += step / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    }
  }
}

// A disc that slides and spins stops both at once, where an integrator written apart has it.
TEST(SupportsByEventsTest, ADiscThatSlidesAndSpinsStopsBothAtOnce) {
  const std::string disc = R"("shape": {"circle": {"radius": 0.1}}, "position": [0, 0],
      "velocity": [0.8, 0.3], "angular_velocity": 9,
      "support": {"friction": 0.25, "radius": 0.08, "load": 15})";
  const Scene scene = TableByEvents(disc, 0.002, 0.8);
  const std::vector<std::string> paths = {"bodies/b/support/friction", "bodies/b/support/radius",
                                          "bodies/b/support/load",     "bodies/b/mass",
                                          "bodies/b/velocity/y",       "bodies/b/angular_velocity"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  double x[6] = {0.0, 0.0, 0.0, 0.8, 0.3, 9.0};
  IntegrateDisc(0.08, 0.25 * 15.0 / 2.0, 0.5 * 0.01, x);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(result.values[i], x[i], 1e-9) << i;
  for (int i = 3; i < 6; ++i) EXPECT_EQ(result.values[i], 0.0) << i;
  ExpectOthersAgree(scene, paths, result);
}

// What its speeds tend to, whatever it started with: v / (R ω) of a disc of even mass.
TEST(SupportsByEventsTest, TheRatioOfADiscsSpeeds) {
  for (const char* start : {R"("velocity": [1, 0], "angular_velocity": 3)",
                            R"("velocity": [0.2, 0.1], "angular_velocity": 12)"}) {
    const Scene scene = TableByEvents(std::string(R"("shape": {"circle": {"radius": 0.1}},
        "position": [0, 0], "support": {"friction": 0.25, "radius": 0.1}, )") +
                                          start,
                                      1e-5, 1.0);
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    Stepper stepper(model);
    const auto speed = [&state] { return std::hypot(state.twist[0], state.twist[1]); };
    double now = 0.0;
    for (int k = 0; speed() > 1e-9; ++k) {
      ASSERT_LT(k, 10000);
      const double h = 0.1 * std::max(speed(), 0.1 * state.twist[2]) / (0.25 * kStandardG);
      ASSERT_EQ(stepper.Step(model, now, h, &state).status, StepStatus::kDone);
      now += h;
    }
    EXPECT_NEAR(speed() / (0.1 * state.twist[2]), 0.653, 1e-3) << start;
    ASSERT_EQ(stepper.Step(model, now, 0.01, &state).status, StepStatus::kDone);
    EXPECT_EQ(speed(), 0.0);
    EXPECT_EQ(state.twist[2], 0.0);
  }
}

// A rod on two feet that is pushed at one of them turns about the other, which rests; the torque of
// the first foot stops it once the force is gone.
TEST(SupportsByEventsTest, ARodTurnsAboutAFootThatRests) {
  Scene scene = TableByEvents(R"("inertia": 0.02, "position": [0, 0],
      "support": {"friction": 0.25, "load": 20, "points": [[0.3, 0], [-0.3, 0]],
                  "shares": [1, 9]})",
                              0.01, 1.0);
  BasicForce<double> push;
  push.name = "push";
  push.body = 0;
  push.at = Vector2<double>(0.3, 0.0);
  push.torque = 0.36;
  push.end = 0.5;
  scene.forces.push_back(push);
  const std::vector<std::string> paths = {"forces/push/torque", "bodies/b/support/friction",
                                          "bodies/b/inertia", "forces/push/end"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  // About the foot at −0.3: I = 0.02 + 2 · 0.09, friction 0.5 · 0.6.
  const double inertia = 0.02 + 2.0 * 0.09;
  const double gain = (0.36 - 0.3) / inertia, loss = 0.3 / inertia;
  const double fastest = 0.5 * gain;
  const double turn = 0.5 * fastest * 0.5 + 0.5 * fastest * fastest / loss;
  EXPECT_NEAR(result.values[2], turn, 1e-9);
  EXPECT_NEAR(result.values[0], 0.3 * (std::cos(turn) - 1.0), 1e-9);
  EXPECT_NEAR(result.values[1], 0.3 * std::sin(turn), 1e-9);
  EXPECT_EQ(result.values[5], 0.0);
  // The whole turn is M² … : ∂/∂torque of gain (0.125 + 0.125 gain / loss).
  EXPECT_NEAR(result.jacobian(2, 0), (0.125 + 0.25 * gain / loss) / inertia, 1e-6);
  ExpectOthersAgree(scene, paths, result);
}

// A spring whose end is driven away at 1 m/s pulls a block that its support and something else hold
// together: neither's share is determined, and both let go as the force reaches the sum of their
// limits, t0 = L / k; from there x = s − sin(ω s) / ω with s = t − t0, ω² = k / m.
TEST(SupportsByEventsTest, WhatHoldsTogetherLetsGoAtTheInstant) {
  const std::string hand = R"(, {"name": "hand", "kinematic": true, "position": [1, 0],
      "velocity": [1, 0]})";
  const std::string spring = R"(], "springs": [{"name": "s", "bodies": ["b", "hand"],
      "anchors": [[0, 0], [1, 0]], "stiffness": 4, "rest_length": 1})";
  const std::string other = R"(, {"name": "c", "mass": 2, "inertia": 1, "position": [0, 0.5],
      "support": {"friction": 0.1, "load": 10}})";
  struct Case {
    std::string beside, path;
    double mass;
  };
  const std::vector<Case> cases = {
      {hand + R"(], "joints": [{"name": "rail", "type": "prismatic", "bodies": ["b", "world"],
          "anchor": [0, 0], "axis": [1, 0], "friction": 1})" +
           spring,
       "joints/rail/friction", 2.0},
      {hand + other + R"(], "joints": [{"type": "weld", "name": "w", "bodies": ["b", "c"],
          "anchor": [0, 0.2]}, {"name": "rail", "type": "prismatic", "bodies": ["b", "world"],
          "anchor": [0, 0], "axis": [1, 0]})" +
           spring,
       "bodies/c/support/load", 4.0},
      {hand + R"(, {"name": "wall", "static": true, "friction": 1, "shape": {"half_plane":
          {"normal": [0, 1], "offset": -0.1}}}], "forces": [{"name": "down", "body": "b",
          "force": [0, -1]})" +
           spring,
       "bodies/wall/friction", 2.0}};
  for (const Case& one : cases) {
    for (const double dt : {0.25, 0.03}) {
      const Scene scene = TableByEvents(
          R"("shape": {"box": {"size": [0.6, 0.2]}}, "position": [0, 0], "friction": 1,
             "support": {"friction": 0.1, "load": 10})",
          dt, 1.0, "0, 0", one.beside);
      const double omega = std::sqrt(4.0 / one.mass);
      const std::vector<std::string> paths = {one.path, "springs/s/stiffness"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      EXPECT_NEAR(result.values[0], 0.5 - std::sin(0.5 * omega) / omega, 1e-8) << one.path << dt;
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// A block on three feet that another one pushes off its centre, with friction between them.
TEST(SupportsByEventsTest, BlocksThatPushEachOther) {
  const std::string block = R"("shape": {"box": {"size": [0.4, 0.3]}}, "position": [0, 0],
      "angle": 0.05, "friction": 0.2, "support": {"friction": 0.2,
      "points": [[0.15, 0.1], [-0.15, 0.1], [0, -0.12]], "shares": [2, 1, 1.5]})";
  Scene scene = TableByEvents(block, 0.01, 0.5, "0, 0", R"(,
      {"name": "p", "mass": 1, "shape": {"circle": {"radius": 0.1}}, "position": [-0.32, 0.06],
       "friction": 0.2, "support": {"friction": 0.3, "radius": 0.07}},
      {"name": "wall", "static": true, "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.5}}})");
  BasicForce<double> push;
  push.name = "push";
  push.body = 1;
  push.force = Vector2<double>(14.0, 1.0);
  push.end = 0.3;
  scene.forces.push_back(push);
  const std::vector<std::string> paths = {
      "bodies/b/support/friction", "bodies/b/support/points/1/y", "bodies/b/support/shares/2",
      "bodies/p/support/radius",   "forces/push/force/x",         "bodies/b/mass"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_GT(result.values[0], 0.05);  // it has been moved
  for (Eigen::Index c = 0; c < result.jacobian.cols(); ++c) {
    EXPECT_GT(result.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-6) << paths[c];
  }
  ExpectOthersAgree(scene, paths, result);
}

// Two blocks of 1 kg whose supports hold 1 N and `other` each, the first pushed with F: one alone
// could not hold it. The second touches it, or a hinge joins them.
TEST(SupportsByEventsTest, WhatOneSupportCannotHoldItsNeighbourShares) {
  for (const bool joined : {false, true}) {
    for (const double other : {1.0, 3.0}) {
      for (const double force : {1.5, 5.0}) {
        const std::string box = R"("mass": 1, "shape": {"box": {"size": [0.2, 0.2]}}, )";
        const Scene scene = SceneOf(
            R"({"gravity": [0, 0], "bodies": [{"name": "b", )" + box +
            R"("position": [0, 0], "support": {"friction": 0.5, "load": 2}}, {"name": "c", )" +
            box + R"("position": [0.2, 0], "support": {"friction": 0.5, "load": )" +
            std::to_string(2.0 * other) +
            R"(}}], "forces": [{"name": "f", "body": "b", "force": [)" + std::to_string(force) +
            ", 0]}]" +
            (joined ? R"(, "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "c"],
                                       "anchor": [0.1, 0]}])"
                    : "") +
            R"(, "simulation": {"stepping": "event", "dt": 0.1, "duration": 0.5}})");
        Model<double> model;
        State<double> state;
        BuildModel(scene, &model, &state);
        State<double> final;
        const RolloutReport report = Rollout(model, state, nullptr, &final);
        ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
        const double left = std::max(force - 1.0 - other, 0.0);
        const size_t c = 3 * static_cast<size_t>(model.structure->moving[1]);
        EXPECT_NEAR(final.pose[c], 0.2 + 0.25 * left * 0.25, 1e-9) << joined << other << force;
        EXPECT_EQ(std::abs(final.twist[c]) < 1e-30, left == 0.0);
      }
    }
  }
}

// An arm on a hinge with friction, whose bob slides on a table that is tilted: it starts from rest,
// or turns back, where joint and support hold it together up to their limits. Against steps of 1 us
// of I w' = -g cos a - sign(w) (joint + support).
TEST(SupportsByEventsTest, AnArmWithFrictionInItsHingeStartsAndTurnsBack) {
  struct Arm {
    double g, joint, support, rate;
  };
  for (const Arm& arm : {Arm{4.0, 2.0, 1.0, 0.0}, Arm{1.937, 0.271, 0.987, 0.533}}) {
    Scene scene = SceneOf(R"({"gravity": [0, -4], "bodies": [
        {"name": "b", "mass": 1, "inertia": 1, "position": [1, 0],
         "support": {"friction": 0.5, "load": 2}}],
        "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                    "rate": 0, "friction": 2}],
        "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
    scene.gravity.y() = -arm.g;
    scene.joints[0].friction = arm.joint;
    scene.joints[0].rate = arm.rate;
    scene.bodies[0].support->load = arm.support / 0.5;
    double angle = 0.0, rate = arm.rate;
    const double h = 1e-6;
    for (int k = 0; k < 1000000; ++k) {
      const auto turn = [&](double at, double w) {
        const double sign = w > 0.0 || (w == 0.0 && arm.rate > 0.0) ? 1.0 : -1.0;
        return 0.5 * (-arm.g * std::cos(at) - sign * (arm.joint + arm.support));
      };
      const double a = turn(angle, rate);
      const double middle = turn(angle + 0.5 * h * rate, rate + 0.5 * h * a);
      angle += h * (rate + 0.5 * h * a);
      rate += h * middle;
    }
    const std::vector<std::string> paths = {"joints/j/friction", "bodies/b/support/friction"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kTangent);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_NEAR(result.values[2], angle, 2e-6);
    EXPECT_NEAR(result.values[5], rate, 2e-6);
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

// The same without gravity in the plane: joint and support bring it to rest together, within a step
// or on a step's end, and hold it, which either could do alone. Angle w^2 / (2 a).
TEST(SupportsByEventsTest, AnArmWithFrictionInItsHingeComesToRest) {
  struct Arm {
    double joint, rate;
    const char* support;
  };
  const char centre[] = R"({"friction": 0.1})";
  // Of a = 2.5 rad/s² in the first: it stops at 0.2 s.
  for (const Arm& arm :
       {Arm{0.2057, 0.5, centre}, Arm{0.3, 1.0, centre}, Arm{0.05, 0.37, centre},
        Arm{0.3, 0.37, R"({"friction": 0.1, "radius": 0.1})"},
        Arm{0.05, 2.0, R"({"friction": 0.1, "points": [[0.1, 0], [-0.1, 0.05]]})"}}) {
    Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 0.5, "inertia": 0.02, "position": [0.6, 0], "support": )") +
                          arm.support + R"(}], "joints": [{"name": "j", "type": "revolute",
        "bodies": ["b", "world"], "anchor": [0, 0], "rate": 0, "friction": 0}],
        "simulation": {"dt": 0.01, "duration": 2, "stepping": "event"}})");
    scene.joints[0].friction = arm.joint;
    scene.joints[0].rate = arm.rate;
    const std::vector<std::string> paths = {"joints/j/rate", "joints/j/friction",
                                            "bodies/b/support/friction"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_EQ(result.values[3], 0.0);
    EXPECT_EQ(result.values[4], 0.0);
    EXPECT_EQ(result.values[5], 0.0);
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    if (arm.rate == 0.5 || arm.rate == 2.0) ExpectOthersAgree(scene, paths, result);
    if (arm.support != centre) continue;
    const double slows = (arm.joint + 0.1 * 0.5 * kStandardG * 0.6) / 0.2;
    const double angle = arm.rate * arm.rate / (2.0 * slows);
    EXPECT_NEAR(result.values[2], angle, 1e-9);
    EXPECT_NEAR(result.jacobian(2, 0), arm.rate / slows, 1e-7);
    EXPECT_NEAR(result.jacobian(2, 1), -angle / slows / 0.2, 1e-7);
  }
}

// An arm of two links, each on the table: one comes to rest while the other still turns, and both
// rest in the end.
TEST(SupportsByEventsTest, AnArmOfTwoLinksComesToRest) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 0.5, "inertia": 0.02, "position": [0.6, 0], "support": {"friction": 0.2}},
        {"name": "c", "mass": 0.3, "inertia": 0.01, "position": [1.2, 0], "support": {"friction": 0.3}}],
        "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                    "rate": 1, "friction": 0.05},
                   {"name": "k", "type": "revolute", "bodies": ["c", "b"], "anchor": [0.9, 0],
                    "rate": -0.7, "friction": 0.02}],
        "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  const std::vector<std::string> paths = {"joints/j/rate", "bodies/c/support/friction"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
  ASSERT_TRUE(result.done) << result.message;
  for (const int i : {3, 4, 5, 9, 10, 11}) EXPECT_EQ(result.values[i], 0.0) << i;
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  for (const GradientMethod method :
       {GradientMethod::kAdjoint, GradientMethod::kFiniteDifference}) {
    const GradientResult other = Jacobian(scene, paths, method);
    ASSERT_TRUE(other.done) << other.message;
    EXPECT_LT((other.jacobian - result.jacobian).norm(), 1e-6 * result.jacobian.norm());
  }
  scene.simulation.stepping = Stepping::kFixed;
  scene.simulation.dt = 2e-4;
  const GradientResult fixed = Jacobian(scene, {"joints/j/rate"}, GradientMethod::kTangent);
  ASSERT_TRUE(fixed.done) << fixed.message;
  EXPECT_NEAR(result.values[2], fixed.values[2], 4e-4);
  EXPECT_NEAR(result.values[8], fixed.values[8], 6e-4);
}

// It turns about its centre until one of its feet rests; that the other is slow does not matter.
TEST(SupportsByEventsTest, ARodThatSpinsAndBarelySlides) {
  for (const double speed : {1e-3, -1e-3, 1e-4, 1e-6}) {
    for (const int axis : {0, 1}) {
      Scene scene = TableByEvents(
          R"("inertia": 0.04, "position": [0, 0], "angular_velocity": 3,
             "support": {"friction": 0.2, "points": [[0.1, 0], [-0.1, 0]]})",
          0.01, 1.0);
      scene.bodies[0].velocity[axis] = speed;
      const std::vector<std::string> paths = {"bodies/b/angular_velocity",
                                              "bodies/b/support/friction"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
      ASSERT_TRUE(result.done) << speed << " along " << axis << ": " << result.message;
      EXPECT_EQ(result.values[5], 0.0);
      const double slows = 0.1 * 0.2 * 2.0 * kStandardG / 0.04;
      EXPECT_NEAR(result.values[2], 9.0 / (2.0 * slows), 3e-3 * std::abs(speed) + 1e-9);
      EXPECT_NEAR(result.jacobian(2, 0), 3.0 / slows, 3e-3 * std::abs(speed) + 1e-8);
    }
  }
}

// Pucks that are tied or touch stop together, also where one alone would stop a little earlier.
TEST(SupportsByEventsTest, PucksThatStopNearlyTogether) {
  const char tie[] = R"(, "joints": [{"name": "j", "type": "distance", "bodies": ["a", "b"],
                         "anchors": [[0, 0], [0.3, 0]]}])";
  const char weld[] = R"(, "joints": [{"name": "j", "type": "weld", "bodies": ["a", "b"],
                          "anchor": [0.15, 0]}])";
  for (const char* joined : {tie, weld, ""}) {
    for (const double more : {0.0, -2e-4}) {
      for (const double faster : {0.0, 6e-6}) {
        Scene scene = SceneOf(
            std::string(R"({"gravity": [0, 0], "bodies": [
            {"name": "a", "shape": {"circle": {"radius": 0.05}}, "mass": 0.2, "position": [0, 0],
             "velocity": [1, 0], "friction": 0.1, "support": {"friction": 0.2}},
            {"name": "b", "shape": {"circle": {"radius": 0.05}}, "mass": 0.2, "position": [0.3, 0],
             "velocity": [1, 0], "friction": 0.1, "support": {"friction": 0.2}}])") +
            joined + R"(, "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
        const bool is_tied = joined[0] != '\0';
        if (!is_tied) scene.bodies[1].position[0] = 0.1;
        scene.bodies[1].support->friction += more;
        scene.bodies[0].velocity[0] += faster;
        const GradientResult result =
            Jacobian(scene, {"bodies/b/support/friction"}, GradientMethod::kTangent);
        ASSERT_TRUE(result.done) << joined << more << " " << faster << ": " << result.message;
        EXPECT_EQ(result.values[3], 0.0);
        EXPECT_EQ(result.values[9], 0.0);
        const double speed = 1.0 + 0.5 * faster;
        if (is_tied) {
          EXPECT_NEAR(result.values[0], speed * speed / (2.0 * (0.2 + 0.5 * more) * kStandardG),
                      1e-7 + 2.0 * std::abs(faster));
        }
      }
    }
  }
}

// A spring pulls it back from where it stops, against the friction of joint and table, which could
// each hold it at any force if their shares were free. Against fixed steps of 0.1 ms.
TEST(SupportsByEventsTest, AnArmThatASpringPullsBack) {
  for (const double rate : {0.8, -0.8}) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 0.2, "inertia": 0.1, "position": [0.3, 0], "support": {"friction": 0.1}}],
        "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                    "rate": 0.8, "stiffness": 1, "friction": 0.02}],
        "simulation": {"dt": 0.02, "duration": 1, "stepping": "event"}})");
    scene.joints[0].rate = rate;
    const GradientResult result = Jacobian(scene, {"joints/j/rate"}, GradientMethod::kTangent);
    ASSERT_TRUE(result.done) << result.message;
    scene.simulation.stepping = Stepping::kFixed;
    scene.simulation.dt = 1e-4;
    const GradientResult fixed = Jacobian(scene, {"joints/j/rate"}, GradientMethod::kTangent);
    ASSERT_TRUE(fixed.done) << fixed.message;
    EXPECT_NEAR(result.values[2], fixed.values[2], 1e-4);
    EXPECT_NEAR(result.values[5], fixed.values[5], 2e-4);
    EXPECT_LT(result.values[5] * rate, -0.1);
  }
}

// A body without a speed of its own follows the other one to which it is joined, from the start on.
TEST(SupportsByEventsTest, AJointTakesABodyAlongFromTheStart) {
  for (const char* type : {"weld", "revolute"}) {
    const Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
        {"name": "a", "mass": 0.2, "inertia": 0.02, "position": [0.3, 0], "velocity": [0.5, -1],
         "support": {"friction": 0.1}},
        {"name": "b", "mass": 2, "inertia": 0.1, "position": [0.9, 0], "support": {"friction": 0.3}}],
        "joints": [{"name": "j", "type": ")") +
                                type + R"(", "bodies": ["b", "a"], "anchor": [0.6, 0]}],
        "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
    const GradientResult result =
        Jacobian(scene, {"bodies/a/velocity/x", "bodies/a/velocity/y"}, GradientMethod::kTangent);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_GT(result.values[6], 0.9 + 1e-4);
    Scene other = scene;
    other.simulation.stepping = Stepping::kFixed;
    other.simulation.dt = 1e-4;
    const GradientResult fixed = Jacobian(other, {"bodies/a/velocity/x"}, GradientMethod::kTangent);
    ASSERT_TRUE(fixed.done) << fixed.message;
    for (const int i : {0, 1, 2, 6, 7, 8}) EXPECT_NEAR(result.values[i], fixed.values[i], 5e-4);
    const GradientResult differences = Jacobian(
        scene, {"bodies/a/velocity/x", "bodies/a/velocity/y"}, GradientMethod::kFiniteDifference);
    EXPECT_LT((differences.jacobian - result.jacobian).norm(), 1e-6 * result.jacobian.norm());
  }
}

// A motor that is too weak to turn an arm on the table stands, with all that it has.
TEST(SupportsByEventsTest, AWeakMotorStands) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 0.01, "position": [0.3, 0],
       "support": {"friction": 0.2, "radius": 0.1}}],
      "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                  "rate": 0.5, "motor": {"speed": 1, "limit": 0.1}}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  const std::vector<std::string> paths = {"joints/j/rate", "joints/j/motor/limit"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
  ASSERT_TRUE(result.done) << result.message;
  EXPECT_GT(result.values[2], 0.0);
  for (const int i : {3, 4, 5}) EXPECT_EQ(result.values[i], 0.0);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, paths, result);
}

// Two bodies far apart on one table whose scene does the same with both: each has its own
// derivative, wherever the instant is rounded to.
Scene TwoOnATable(const std::string& keys, const std::string& forces, double dt) {
  return SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], )" +
                 keys + R"(}, {"name": "c", "mass": 1, "inertia": 1, "position": [0, 3], )" + keys +
                 R"(}], "forces": [)" + forces +
                 R"(], "simulation": {"stepping": "event", "duration": 1, "dt": )" +
                 std::to_string(dt) + "}}");
}

TEST(SupportsByEventsTest, TwoBodiesStopAtOneInstant) {
  const std::vector<std::string> paths = {"bodies/b/velocity/x", "bodies/c/velocity/x"};
  for (const auto& [v, mu, dt] :
       {std::tuple{1.5, 0.3, 0.03}, std::tuple{1.2, 0.2, 0.25}, std::tuple{2.0, 0.3, 0.03},
        std::tuple{1.0, 0.2, 0.1}, std::tuple{0.559016994, 0.1, 0.03}}) {
    const Scene scene =
        TwoOnATable(R"("velocity": [)" + std::to_string(v) +
                        R"(, 0], "support": {"load": 10, "friction": )" + std::to_string(mu) + "}",
                    "", dt);
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double own = v / (10.0 * mu);
    EXPECT_NEAR(result.jacobian(0, 0), own, 1e-6) << v << " " << dt;
    EXPECT_NEAR(result.jacobian(0, 1), 0.0, 1e-7) << v << " " << dt;
    EXPECT_NEAR(result.jacobian(6, 0), 0.0, 1e-7) << v << " " << dt;
    EXPECT_NEAR(result.jacobian(6, 1), own, 1e-6) << v << " " << dt;
    ExpectOthersAgree(scene, paths, result);
  }
}

// Under forces 2 t both let go at 0.5 s, and are 2 (T − 0.5)³ / 6 on in the end.
TEST(SupportsByEventsTest, TwoBodiesBreakLooseAtOneInstant) {
  const std::string ramp = R"("force": {"time": [0, 1], "x": [0, 2], "y": [0, 0],
      "interpolation": "linear"}})";
  const std::string forces =
      R"({"name": "fb", "body": "b", )" + ramp + R"(, {"name": "fc", "body": "c", )" + ramp;
  for (const char* more : {"", R"(, "radius": 0.2)", R"(, "points": [[0.1, 0], [-0.1, 0]])"}) {
    for (const double dt : {0.1, 0.07, 0.25}) {
      const Scene scene = TwoOnATable(
          R"("support": {"load": 10, "friction": 0.1)" + std::string(more) + "}", forces, dt);
      const GradientResult result =
          Jacobian(scene, {"bodies/b/support/friction", "bodies/c/support/friction"},
                   GradientMethod::kTangent);
      ASSERT_TRUE(result.done) << result.message;
      for (int body = 0; body < 2; ++body) {
        EXPECT_NEAR(result.values[6 * body], 0.125 / 3.0, 1e-9) << more << dt;
        EXPECT_NEAR(result.jacobian(6 * body, body), -1.25, 1e-6) << more << dt;
        EXPECT_NEAR(result.jacobian(6 * body, 1 - body), 0.0, 1e-9) << more << dt;
      }
    }
  }
}

// A limit just where the support stops the body: its way is the smaller one of both.
TEST(SupportsByEventsTest, ALimitWhereItStopsIsAKink) {
  for (const double dt : {0.1, 0.03}) {
    const Scene scene = TableByEvents(R"("inertia": 1, "position": [0, 0], "velocity": [1, 0],
            "support": {"load": 20, "friction": 0.2})",
                                      dt, 1.0, "0, 0", R"(], "joints": [{"name": "rail",
            "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0], "axis": [1, 0],
            "limits": [null, 0.25]})");
    const std::vector<std::string> paths = {"joints/rail/limits/1", "bodies/b/velocity/x"};
    const GradientResult both = Jacobian(scene, paths, GradientMethod::kTangent);
    EXPECT_NE(both.certificate.verdict.find("grazing touch"), std::string::npos)
        << both.certificate.verdict;
    for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
      const GradientResult one =
          FinalStateJacobian(scene, testing::Resolve(scene, paths),
                             {.method = GradientMethod::kTangent, .side = side});
      ASSERT_TRUE(one.done) << one.message;
      const bool grows = side == DerivativeSide::kPlus;
      EXPECT_NEAR(one.jacobian(0, 0), grows ? 0.0 : 1.0, 1e-5) << dt;
      EXPECT_NEAR(one.jacobian(0, 1), grows ? 0.0 : 0.5, 1e-5) << dt;
    }
  }
}

// A hinged body that turns by 3² / (2 · 0.6 / 0.23) rad until its support has stopped it, where the
// motion of each step misses its place by some 1e-11 rad.
TEST(SupportsByEventsTest, AHingesLimitWhereItStopsIsAKink) {
  for (const double limit : {1.725, 1.725 + 1e-9, 1.73}) {
    Scene scene = TableByEvents(R"("inertia": 0.05, "position": [0.3, 0], "velocity": [0, 0],
            "support": {"load": 10, "friction": 0.2})",
                                0.01, 2.0, "0, 0", R"(], "joints": [{"name": "h",
            "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0], "rate": 3,
            "limits": [-1, 2]})");
    scene.joints[0].limits->second = limit;
    const GradientResult both = Jacobian(scene, {"joints/h/rate"}, GradientMethod::kTangent);
    ASSERT_TRUE(both.done) << both.message;
    const std::string& verdict = both.certificate.verdict;
    if (limit > 1.7275) {
      EXPECT_EQ(verdict, "trustworthy");
      EXPECT_NEAR(both.jacobian(2, 0), 1.15, 1e-6);
      continue;
    }
    EXPECT_NE(verdict.find(", grazing"), std::string::npos) << limit << " " << verdict;
    const GradientResult slower =
        FinalStateJacobian(scene, testing::Resolve(scene, {"joints/h/rate"}),
                           {.method = GradientMethod::kTangent, .side = DerivativeSide::kMinus});
    ASSERT_TRUE(slower.done) << slower.message;
    EXPECT_NEAR(slower.jacobian(2, 0), 1.15, 1e-6);
  }
}

// Boxes that slide along side by side need no force between them, which rounding makes one: the
// derivative by the speed of the first is another one where it is slower.
TEST(SupportsByEventsTest, TouchingBoxesThatSlideAlongAreAKink) {
  std::string bodies;
  for (int i = 0; i < 3; ++i) {
    bodies += std::string(i > 0 ? ", " : "") + R"({"name": "d)" + std::to_string(i) +
              R"(", "mass": 1, "shape": {"box": {"size": [0.25, 0.25]}}, "velocity": [1, 0],
                  "support": {"friction": 0.2, "load": 10}, "position": [)" +
              std::to_string(0.25 * i) + ", 0]}";
  }
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [)" + bodies +
                              R"(], "simulation": {"dt": 0.01, "duration": 1,
                                  "stepping": "event"}})");
  const std::vector<std::string> paths = {"bodies/d0/velocity/x"};
  const GradientResult both = Jacobian(scene, paths, GradientMethod::kTangent);
  EXPECT_EQ(both.certificate.verdict.find("near a kink"), 0u) << both.certificate.verdict;
  const GradientResult slower =
      FinalStateJacobian(scene, testing::Resolve(scene, paths),
                         {.method = GradientMethod::kTangent, .side = DerivativeSide::kMinus});
  ASSERT_TRUE(slower.done) << slower.message;
  EXPECT_NEAR(slower.jacobian(0, 0), 0.5, 1e-6);
  EXPECT_NEAR(slower.jacobian(6, 0), 0.0, 1e-6);
}

// A trailer that a hinge drags sideways at 0.02 m/s turns about its own support, and then follows
// slowly: its friction is against its velocity, which is not along its acceleration. The values are
// those of an implicit integration (Radau, 1e-11).
TEST(SupportsByEventsTest, ASlowTrailerHasFrictionAgainstItsVelocity) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "k", "kinematic": true, "position": [0, 0], "velocity": [0, 0.02]},
      {"name": "b", "mass": 1, "inertia": 0.1, "position": [0.5, 0], "velocity": [0, 0.02],
       "support": {"friction": 0.2, "load": 10}}],
      "joints": [{"name": "h", "type": "revolute", "bodies": ["b", "k"], "anchor": [0, 0]}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  const GradientResult result =
      Jacobian(scene, {"bodies/b/support/friction"}, GradientMethod::kTangent);
  ASSERT_TRUE(result.done) << result.message;
  EXPECT_NEAR(result.values[2], -0.0397096, 3e-6);
  EXPECT_NEAR(result.values[5], -0.0399685, 4e-6);
  EXPECT_NEAR(result.jacobian(2, 0), -1.40e-3, 5e-5);
  EXPECT_NEAR(result.jacobian(5, 0), 2.4e-6, 2e-5);
}

}  // namespace
}  // namespace tangible
