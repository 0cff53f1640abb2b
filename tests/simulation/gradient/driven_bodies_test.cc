// SPDX-License-Identifier: Apache-2.0
//
// Bodies that follow recorded paths, against closed forms and an independent integration; their
// derivatives by all methods.
#include "tangible/dynamics/model/driven_bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectOthersAgree;
using testing::Jacobian;
using testing::JacobianOf;

// "time": [...], "x": [...] and so on.
std::string Series(const std::vector<double>& times,
                   const std::vector<std::pair<std::string, std::function<double(double)>>>& of) {
  const auto list = [&](const std::function<double(double)>& f) {
    std::string text;
    for (const double t : times) text += (text.empty() ? "[" : ", ") + Text(f(t));
    return text + "]";
  };
  std::string text = R"("time": )" + list([](double t) { return t; });
  for (const auto& [name, f] : of) text += ", \"" + name + "\": " + list(f);
  return text;
}

std::string DrivenFor(const std::string& stepping, double dt, double duration,
                      const std::string& more = "") {
  return R"(, "simulation": {"stepping": ")" + stepping + R"(", "dt": )" + Text(dt) +
         R"(, "duration": )" + Text(duration) + more + "}}";
}

struct Finished {
  RolloutReport report;
  State<double> final;
};

Finished DrivenRun(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Finished run;
  run.report = Rollout(model, state, {}, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

// A box on a plate that is moved along x = s t³ / 5, which a cubic spline reproduces.
Scene Carried(const std::string& stepping, double dt, const std::string& more = "") {
  const std::string path =
      Series({-1.0, 0.5, 1.1, 2.0, 2.9, 4.0}, {{"x", [](double t) { return 0.2 * t * t * t; }}});
  return SceneOf(R"({"bodies": [
      {"name": "plate", "kinematic": true, "shape": {"box": {"size": [40, 0.2]}},
       "position": [0, -0.1], "friction": 0.3, "motion": {)" +
                 path + R"(}},
      {"name": "box", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "friction": 0.3}])" +
                 DrivenFor(stepping, dt, 3.5, more));
}

// It sticks until s 6 t / 5 = μ g, and slides then:
// x = s t₁³ / 5 + 3 s t₁² (T − t₁) / 5 + μ g (T − t₁)² / 2.
TEST(DrivenBodiesTest, ABoxIsCarriedUntilItSlides) {
  const Scene scene = Carried("event", 0.02);
  // Both bodies' friction, of which the mean acts.
  const std::vector<std::string> paths = {"bodies/*/friction", "bodies/plate/motion/scale",
                                          "bodies/plate/motion/delay",
                                          "bodies/plate/motion/offset/x"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double a = 0.3 * kGravity, t = a / 1.2, rest = 3.5 - t;
  EXPECT_NEAR(result.values[0], 0.2 * t * t * t + 0.6 * t * t * rest + 0.5 * a * rest * rest,
              1e-11);
  EXPECT_NEAR(result.values[3], 0.6 * t * t + a * rest, 1e-11);
  EXPECT_NEAR(result.jacobian(0, 0), 0.5 * kGravity * rest * rest, 1e-8);
  EXPECT_NEAR(result.jacobian(0, 1), 0.2 * t * t * t + 0.6 * t * t * rest, 1e-8);
  EXPECT_NEAR(result.jacobian(0, 2), -0.6 * t * t - 1.2 * t * rest, 1e-8);
  EXPECT_NEAR(result.jacobian(0, 3), 0.0, 1e-12);
  EXPECT_NEAR(result.jacobian(3, 2), -1.2 * t, 1e-8);
  ExpectOthersAgree(scene, paths, result);
  const Scene trapezoidal = Carried("event", 0.05, R"(, "integrator": "trapezoidal")");
  const GradientResult other = Jacobian(trapezoidal, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(other.jacobian(0, 2), result.jacobian(0, 2), 1e-3);
  ExpectOthersAgree(trapezoidal, paths, other);
}

TEST(DrivenBodiesTest, FixedStepsOfACarriedBoxConvergeAtFirstOrder) {
  const double a = 0.3 * kGravity, t = a / 1.2, rest = 3.5 - t;
  const double x = 0.2 * t * t * t + 0.6 * t * t * rest + 0.5 * a * rest * rest;
  double error[2];
  for (int k = 0; k < 2; ++k) {
    const Finished run = DrivenRun(Carried("fixed", k == 0 ? 0.02 : 0.01));
    error[k] = std::abs(run.final.pose[3] - x);
    // The plate is where its path leads.
    EXPECT_NEAR(run.final.pose[0], 0.2 * 3.5 * 3.5 * 3.5, 1e-12);
  }
  EXPECT_LT(error[1], 0.02);
  EXPECT_LT(error[1], 0.6 * error[0]);
  const Scene scene = Carried("fixed", 0.02);
  const std::vector<std::string> paths = {"bodies/*/friction", "bodies/plate/motion/scale",
                                          "bodies/plate/motion/delay"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.jacobian(0, 2), -0.6 * t * t - 1.2 * t * rest, 0.05);
  ExpectOthersAgree(scene, paths, result);
}

// A rod of 1 m and 1 kg whose upper end follows a cubic, on which a knot falls inside of steps.
Scene Shaken(const std::string& stepping, double dt, const std::string& more = "") {
  const std::string path = Series({-0.5, 0.213, 0.707, 1.303, 1.551, 2.5},
                                  {{"x", [](double t) { return 0.3 * t * t - 0.2 * t * t * t; }},
                                   {"y", [](double t) { return 0.1 * t - 0.1 * t * t * t; }}});
  return SceneOf(R"({"bodies": [
      {"name": "hand", "kinematic": true, "motion": {)" +
                 path + R"(}},
      {"name": "rod", "shape": {"box": {"size": [0.1, 1]}}, "mass": 1, "inertia": 0.08,
       "position": [0, -0.5]}],
      "joints": [{"name": "grip", "type": "revolute", "bodies": ["rod", "hand"], "anchor": [0, 0],
                  "angle": 0.4}])" +
                 DrivenFor(stepping, dt, 1.5, more));
}

// (I + m l²) θ'' = −m l ((g + y'') sin θ + x'' cos θ) by a classical Runge-Kutta rule of its own.
double ShakenAngle(double end) {
  const double inertia = 0.08 + 0.25;
  const auto rate = [&](double t, double angle) {
    const double ax = 0.6 - 1.2 * t, ay = -0.6 * t;
    return -0.5 * ((kGravity + ay) * std::sin(angle) + ax * std::cos(angle)) / inertia;
  };
  // The hand starts at (0, 0.1) m/s: the impulse that the rod's grip is given has no torque about
  // the grip but that of m l v_y sin θ, of the rod's centre.
  double angle = 0.4;
  double speed = 0.0;
  {
    // At rest before: the grip's impulse J gives v = J / m, ω = r × J / I with r from the centre to
    // the grip, and v + ω r⊥ = (0, 0.1).
    const double rx = -0.5 * std::sin(angle), ry = 0.5 * std::cos(angle);
    // ω = (rx Jy − ry Jx) / I; v − ω ry = 0, Jy + ω rx = 0.1.
    // Jx = ω ry, Jy = 0.1 − ω rx: ω I = rx 0.1 − ω rx² − ω ry².
    speed = 0.1 * rx / (0.08 + rx * rx + ry * ry);
  }
  const int steps = 20000;
  const double h = end / steps;
  for (int k = 0; k < steps; ++k) {
    const double t = k * h;
    const double k1 = rate(t, angle), v1 = speed;
    const double k2 = rate(t + 0.5 * h, angle + 0.5 * h * v1), v2 = speed + 0.5 * h * k1;
    const double k3 = rate(t + 0.5 * h, angle + 0.5 * h * v2), v3 = speed + 0.5 * h * k2;
    const double k4 = rate(t + h, angle + h * v3), v4 = speed + h * k3;
    angle += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    speed += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return angle;
}

TEST(DrivenBodiesTest, AShakenPendulumByEventsIsOfFourthOrder) {
  const double angle = ShakenAngle(1.5);
  const double coarse = DrivenRun(Shaken("event", 0.008)).final.pose[5] - angle;
  const double fine = DrivenRun(Shaken("event", 0.004)).final.pose[5] - angle;
  EXPECT_LT(std::abs(fine), 1e-9);
  EXPECT_LT(std::abs(fine), std::abs(coarse) / 10.0);
}

TEST(DrivenBodiesTest, AShakenPendulumByFixedStepsIsOfFirstOrder) {
  const double angle = ShakenAngle(1.5);
  const double coarse = DrivenRun(Shaken("fixed", 0.002)).final.pose[5] - angle;
  const double fine = DrivenRun(Shaken("fixed", 0.001)).final.pose[5] - angle;
  EXPECT_LT(std::abs(fine), 5e-3);
  EXPECT_LT(std::abs(fine), 0.6 * std::abs(coarse));
}

TEST(DrivenBodiesTest, DerivativesOfAShakenPendulumAgree) {
  const std::vector<std::string> paths = {"bodies/hand/motion/delay", "bodies/hand/motion/scale",
                                          "bodies/rod/inertia",       "joints/grip/angle",
                                          "bodies/rod/position/x",    "gravity/y"};
  for (const char* stepping : {"event", "fixed"}) {
    for (const std::string more : {"", R"(, "joint_correction": "projection")"}) {
      const Scene scene = Shaken(stepping, 0.01, more);
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      for (Eigen::Index c = 0; c < result.jacobian.cols(); ++c) {
        EXPECT_GT(result.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-3) << paths[c];
      }
      ExpectOthersAgree(scene, paths, result);
    }
  }
  const Scene scene = Shaken("event", 0.02, R"(, "integrator": "trapezoidal")");
  ExpectOthersAgree(scene, paths, Jacobian(scene, paths, GradientMethod::kAdjoint));
}

// A mallet that starts to move at 0.2 s, with a speed of 2 m/s, and a puck without gravity.
Scene Struck(double gap, double dt, const std::string& stepping = "event",
             const std::string& more = "") {
  const std::string path =
      Series({-1.0, 0.2, 1.5}, {{"x", [](double t) { return t < 0.2 ? 0.0 : 2.0 * (t - 0.2); }}});
  return SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "mallet", "kinematic": true, "shape": {"circle": {"radius": 0.1}},
       "restitution": 0.5, "motion": {"interpolation": "linear", )" +
                 path + R"(}},
      {"name": "puck", "shape": {"circle": {"radius": 0.1}}, "mass": 0.3, "restitution": 0.5,
       "position": [)" +
                 Text(0.2 + gap) + ", 0]}]" + DrivenFor(stepping, dt, 1.0, more));
}

// The puck leaves with (1 + e) v from the instant at which the mallet has crossed the gap. With no
// gap that is the jump of the mallet's speed itself.
TEST(DrivenBodiesTest, AMalletStrikesAPuck) {
  const std::vector<std::string> paths = {"bodies/mallet/motion/delay",
                                          "bodies/mallet/motion/scale", "bodies/*/restitution",
                                          "bodies/mallet/motion/offset/x"};
  // The jump falls on a step's end, inside of a step, and on an end that decimals cannot hold.
  for (const double dt : {0.1, 0.07, 0.04, 0.125}) {
    for (const std::string more : {"", R"(, "impact_law": "poisson")"}) {
      for (const double gap : {0.0, 0.5}) {
        const Scene scene = Struck(gap, dt, "event", more);
        // With an offset the mallet would be inside the puck or not touch it.
        const std::vector<std::string> few(paths.begin(), paths.end() - (gap == 0.0 ? 1 : 0));
        const GradientResult result = Jacobian(scene, few, GradientMethod::kAdjoint);
        const double t = 0.2 + gap / 2.0;
        SCOPED_TRACE(Text(dt) + " " + Text(gap) + more);
        EXPECT_NEAR(result.values[0], 0.2 + gap + 3.0 * (1.0 - t), 1e-10);
        EXPECT_NEAR(result.values[3], 3.0, 1e-12);
        EXPECT_NEAR(result.jacobian(0, 0), -3.0, 1e-8);
        // The touch is earlier by gap / 2 for a scale of 1, at which the speed is 3.
        EXPECT_NEAR(result.jacobian(0, 1), 3.0 * (1.0 - t) + 3.0 * gap / 2.0, 1e-8);
        EXPECT_NEAR(result.jacobian(3, 1), 3.0, 1e-9);
        EXPECT_NEAR(result.jacobian(0, 2), 2.0 * (1.0 - t), 1e-8);
        if (gap > 0.0) {
          EXPECT_NEAR(result.jacobian(0, 3), 1.5, 1e-8);
        }
        ExpectOthersAgree(scene, few, result);
      }
    }
  }
}

// A hand that starts to move at once sets the rod that it holds turning.
TEST(DrivenBodiesTest, AJumpActsThroughAJoint) {
  const std::string path =
      Series({-1.0, 0.3, 2.0}, {{"x", [](double t) { return t < 0.3 ? 0.0 : 0.5 * (t - 0.3); }}});
  const std::vector<std::string> paths = {"bodies/hand/motion/delay", "bodies/hand/motion/scale",
                                          "bodies/rod/inertia"};
  for (const double dt : {0.01, 0.07}) {
    const Scene scene = SceneOf(
        R"({"gravity": [0, 0], "bodies": [
      {"name": "hand", "kinematic": true, "motion": {"interpolation": "linear", )" +
        path + R"(}},
      {"name": "rod", "mass": 1, "inertia": 0.08, "position": [0, -0.5]}],
      "joints": [{"name": "grip", "type": "revolute", "bodies": ["rod", "hand"], "anchor": [0, 0]}])" +
        DrivenFor("event", dt, 1.0));
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    // The grip is given V: ω (I + m l²) = −m l V about it.
    const double omega = -0.5 * 0.5 / (0.08 + 0.25);
    EXPECT_NEAR(result.values[5], omega, 1e-8);
    EXPECT_NEAR(result.values[2], omega * 0.7, 1e-8);
    EXPECT_NEAR(result.jacobian(2, 0), -omega, 1e-7);
    EXPECT_NEAR(result.jacobian(2, 1), omega * 0.7, 1e-7);
    EXPECT_NEAR(result.jacobian(2, 2), -omega / 0.33 * 0.7, 1e-7);
    ExpectOthersAgree(scene, paths, result);
  }
}

// A floor that is turned by a file: the box on it begins to slide.
TEST(DrivenBodiesTest, AFloorTilts) {
  const std::string path =
      Series({-1.0, 0.4, 0.9, 1.5, 3.0},
             {{"angle", [](double t) { return 0.1 + 0.2 * t + 0.1 * t * t; }}});
  const std::vector<std::string> paths = {"bodies/floor/motion/delay",
                                          "bodies/floor/motion/offset_angle", "bodies/*/friction",
                                          "bodies/box/position/x"};
  for (const char* shape :
       {R"({"half_plane": {"normal": [0, 1], "offset": 0}})", R"({"box": {"size": [9, 0.4]}})"}) {
    const bool is_box = std::string(shape).find("box") != std::string::npos;
    const Scene scene = SceneOf(
        R"({"bodies": [
      {"name": "floor", "kinematic": true, "friction": 0.4, "shape": )" +
        std::string(shape) + R"(, "position": [0, )" + (is_box ? "-0.2" : "0") +
        R"(], "motion": {)" + path + R"(}},
      {"name": "box", "mass": 1, "shape": {"circle": {"radius": 0.1}}, "inertia": 0.01,
       "friction": 0.4, "position": [0.8, 0.35]}])" +
        DrivenFor("event", 0.01, 1.2));
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_GT(result.jacobian.col(0).cwiseAbs().maxCoeff(), 0.1);
    ExpectOthersAgree(scene, paths, result);
  }
}

// Pairs of a mallet and a puck far from each other, whose events fall into one step: islands.
TEST(DrivenBodiesTest, IslandsFollowTheirPaths) {
  std::string bodies;
  for (int k = 0; k < 3; ++k) {
    const double start = 0.11 + 0.003 * k;
    const std::string path = Series(
        {-1.0, start, 1.5}, {{"x", [&](double t) { return t < start ? 0.0 : 2.0 * (t - start); }}});
    const std::string n = std::to_string(k), y = std::to_string(5 * k);
    bodies += std::string(k > 0 ? ", " : "") + R"({"name": "mallet)" + n +
              R"(", "kinematic": true, "shape": {"circle": {"radius": 0.1}}, "position": [0, )" +
              y + R"(], "restitution": 0.5, "motion": {"interpolation": "linear", )" + path +
              R"(}}, {"name": "puck)" + n +
              R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 0.3, "restitution": 0.5,
       "position": [0.3, )" +
              y + R"(]}, {"name": "wall)" + n +
              R"(", "static": true, "restitution": 0.5, "shape": {"box": {"size": [0.2, 1]}},
       "position": [0.6, )" +
              y + "]}";
  }
  const Scene scene =
      SceneOf(R"({"gravity": [0, 0], "bodies": [)" + bodies + "]" + DrivenFor("event", 0.1, 0.2));
  const std::vector<std::string> paths = {"bodies/mallet1/motion/delay",
                                          "bodies/mallet2/motion/scale", "bodies/*/restitution"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  ExpectOthersAgree(scene, paths, result);
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  bool divided = false;
  Rollout(
      model, state,
      [&](long, double, const State<double>&, Stepper* done) {
        divided = divided || (done != nullptr && done->parts().num_islands > 1);
      },
      &stepper, &state);
  EXPECT_TRUE(divided);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(state.pose[9 * k], 2.0 * (0.09 - 0.003 * k), 1e-14);
}

// Two mallets jump at one instant; what they drive is apart (driven_pairs_test.cc).
TEST(DrivenBodiesTest, JumpsAtOneInstantOfBodiesApart) {
  const std::string path =
      Series({-1.0, 0.2, 1.5}, {{"x", [](double t) { return t < 0.2 ? 0.0 : 2.0 * (t - 0.2); }}});
  const auto mallet = [&](const char* name, double y) {
    return R"({"name": ")" + std::string(name) +
           R"(", "kinematic": true, "shape": {"circle": {"radius": 0.1}}, "position": [0, )" +
           Text(y) + R"(], "motion": {"interpolation": "linear", )" + path + "}}, ";
  };
  const Scene scene = SceneOf(
      R"({"gravity": [0, 0], "bodies": [)" + mallet("a", 0.0) + mallet("b", 1.0) +
      R"({"name": "puck", "shape": {"circle": {"radius": 0.1}}, "mass": 0.3, "position": [0.3, 0]}])" +
      DrivenFor("event", 0.05, 1.0));
  const GradientResult result =
      JacobianOf(scene, {"bodies/a/motion/delay"}, GradientMethod::kAdjoint);
  ASSERT_TRUE(result.done) << result.message;
  EXPECT_NEAR(result.jacobian(0, 0), -2.0, 1e-9);
  EXPECT_TRUE(JacobianOf(scene, {"bodies/a/motion/scale"}, GradientMethod::kAdjoint).done);
}

// The certificate names the jumps at which the derivative by a delay has two sides.
TEST(DrivenBodiesTest, JumpsOnGivenTimesAreNamed) {
  const std::vector<std::string> delay = {"bodies/mallet/motion/delay"};
  const auto one_sided = [&](const Scene& scene) {
    return Jacobian(scene, delay, GradientMethod::kTangent).certificate.one_sided;
  };
  // Inside of a step, and on a step's end.
  EXPECT_EQ(one_sided(Struck(0.5, 0.07, "fixed")), "");
  EXPECT_EQ(one_sided(Struck(0.5, 0.1, "fixed")),
            "jump of the path of mallet at 0.2 s is on a step's boundary");
  EXPECT_EQ(one_sided(Struck(0.5, 0.1, "event")), "");
  Scene scene = Struck(0.5, 0.1);
  // What it does not touch as the run starts does not see the jump there.
  scene.bodies[0].driven->delay = -0.2;
  EXPECT_EQ(one_sided(scene), "");
  const GradientResult free = Jacobian(scene, delay, GradientMethod::kTangent);
  EXPECT_NEAR(free.jacobian(0, 0), -3.0, 1e-9);  // −(1 + e) v
  ExpectOthersAgree(scene, delay, free);
  for (const char* stepping : {"fixed", "event"}) {
    Scene touches = Struck(0.0, 0.1, stepping);
    touches.bodies[0].driven->delay = -0.2;
    EXPECT_NE(one_sided(touches), "") << stepping;
    touches = Struck(0.5, 0.1, stepping);
    touches.bodies[0].driven->delay = -0.2;
    EXPECT_EQ(one_sided(touches), "");
  }
  scene.bodies[0].driven->delay = 0.8;
  EXPECT_EQ(one_sided(scene), "jump of the path of mallet at 1 s is the end of the run");
}

// The rows of driven bodies in tangent and adjoint are those of Jets.
TEST(DrivenBodiesTest, FormulasAgreeWithJets) {
  const Scene scene = SceneOf(
      R"({"bodies": [{"name": "b", "kinematic": true, "motion": {"time": [0, 0.3, 0.7, 1, 1.2],
          "x": [0, 1, -1, 2, 3], "angle": [1, 2, 2, 0, 1], "delay": 0.1, "scale": 1.5,
          "offset": [0.2, 0], "offset_angle": -0.3}}], "simulation": {"stepping": "event"}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const ModelStructure& s = *model.structure;
  for (const double time : {0.35, 0.9, 1.25, 1.4}) {
    RowMatrixXd w = RowMatrixXd::Zero(s.num_variables() + 1, kNumPathNumbers + 1);
    Model<LocalJet> jets{model.structure, {}};
    for (int i = 0; i < s.num_parameters; ++i) jets.parameters.emplace_back(model.parameters[i]);
    for (int k = 0; k < kNumPathNumbers; ++k) {
      jets.parameters[s.paths[0].numbers + k].v[k] = 1.0;
      w(s.ParameterVariable(s.paths[0].numbers + k), k) = 1.0;
    }
    w(s.num_variables(), kNumPathNumbers) = 1.0;
    LocalJet t(time);
    t.v[kNumPathNumbers] = 1.0;
    State<LocalJet> follows{std::vector<LocalJet>(6, LocalJet(0.0)),
                            std::vector<LocalJet>(6, LocalJet(0.0))};
    FollowPaths(jets, t, time, &follows);
    FollowPathsTangent(model, time, time, &w);
    const double beside = time + 1e-6;
    State<double> at = state, after = state;
    FollowPaths(model, time, time, &at);
    FollowPaths(model, beside, time, &after);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR((after.pose[i] - at.pose[i]) / 1e-6, at.twist[i], 1e-4);
      for (int k = 0; k <= kNumPathNumbers; ++k) {
        EXPECT_NEAR(w(s.PoseVariable(0, i), k), follows.pose[i].v[k], 1e-13);
        EXPECT_NEAR(w(s.TwistVariable(0, i), k), follows.twist[i].v[k], 1e-13);
      }
    }
  }
}

// What is welded to a path that has stopped rests, while its speeds decay by their rounding at each
// step until they are no numbers with digits any more.
TEST(DrivenBodiesTest, WhatHangsOnAPathThatStopsComesToRest) {
  for (const double dt : {0.01, 0.05}) {
    const Finished run = DrivenRun(SceneOf(
        R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "shape": {"circle": {"radius": 0.5}}, "position": [-1, 2]},
        {"name": "k", "kinematic": true, "shape": {"circle": {"radius": 0.5}}, "position": [0, 0],
         "motion": {)" +
        Series({0.0, 0.5}, {{"x", [](double t) { return -1.0 + t; }}}) +
        R"(, "interpolation": "linear"}}],
        "joints": [{"name": "j", "type": "weld", "bodies": ["b", "k"], "anchor": [-1, 0]}])" +
        DrivenFor("fixed", dt, 3.0)));
    EXPECT_NEAR(run.final.pose[0], -0.5, 1e-9);
    EXPECT_NEAR(run.final.pose[1], 2.0, 1e-9);
  }
}

// A pusher stops as a ball comes to it: met a little earlier the ball is struck by what still
// moves. Where the pusher becomes faster instead, an inelastic ball leaves with the later speed
// whichever comes first, after two impacts or one.
TEST(DrivenBodiesTest, WhatAPathThatJumpsMeetsIsDiscontinuous) {
  for (const double later : {0.0, 3.0}) {
    const Scene scene = SceneOf(
        R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "shape": {"circle": {"radius": 0.5}}, "position": [2, 0],
         "velocity": [-1, 0]},
        {"name": "k", "kinematic": true, "shape": {"circle": {"radius": 0.5}}, "position": [0, 0],
         "motion": {)" +
        Series({0.0, 0.5, 1.0},
               {{"x", [&](double t) { return t < 0.6 ? t : 0.5 + later * 0.5; }}}) +
        R"(, "interpolation": "linear"}}])" + DrivenFor("event", 0.01, 0.8));
    const std::string verdict =
        JacobianOf(scene, {"bodies/b/position/x"}, GradientMethod::kAuto).certificate.verdict;
    const std::string jumps = "as the speed of body k jumps";
    const std::string first = verdict.substr(0, verdict.find("; near a kink"));
    EXPECT_EQ(first.find("discontinuous: ") == 0 && first.find(jumps) != std::string::npos,
              later == 0.0)
        << verdict;
  }
}

// A wall that turns back just where a ball has no room left crushes nothing. It reaches the ball on
// a step's end, within a step, and as the run ends.
TEST(DrivenBodiesTest, AWallThatTurnsBackAtABodyDoesNotCrushIt) {
  for (const double dt : {0.01, 0.07}) {
    for (const double duration : {2.0, 1.0}) {
      const Finished run = DrivenRun(SceneOf(
          R"({"gravity": [0, 0], "bodies": [
          {"name": "b", "mass": 1, "shape": {"circle": {"radius": 0.1}}, "position": [0, 0]},
          {"name": "k", "kinematic": true, "shape": {"half_plane": {"normal": [1, 0], "offset": 0}},
           "motion": {)" +
          Series({0.0, 1.0, 2.0}, {{"x", [](double t) { return t == 1.0 ? -0.1 : -0.5; }}}) +
          R"(, "interpolation": "linear"}},
          {"name": "w", "static": true, "shape": {"half_plane": {"normal": [-1, 0],
           "offset": -0.1}}}])" +
          DrivenFor("event", dt, duration)));
      EXPECT_EQ(run.final.pose[0], 0.0) << dt;
      EXPECT_EQ(run.final.twist[0], 0.0) << dt;
    }
  }
}

}  // namespace
}  // namespace tangible
