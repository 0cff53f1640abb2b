// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/observed_state.h"

#include <gtest/gtest.h>

#include <numbers>

#include "../../support/fit_scenes.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/joint_projection.h"

namespace tangible {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr char kTwoLinks[] = R"({"name": "two links", "bodies": [
  {"name": "upper", "mass": 1, "inertia": 0.1, "position": [0, -0.5]},
  {"name": "lower", "mass": 1, "inertia": 0.1, "position": [0, -1.5]}],
  "joints": [
   {"name": "pin", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
    "angle": 0.7, "rate": 1.5},
   {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"], "anchor": [0, -1],
    "angle": -0.4, "rate": -2}],
  "simulation": {"dt": 0.001, "duration": 0.5, "joint_correction": "projection"}})";

/// The state of the scene's run at a time.
State<double> StateAt(const Scene& scene, double time) {
  Model<double> model;
  State<double> initial;
  State<double> found;
  State<double> final;
  BuildModel(scene, &model, &initial);
  Rollout(
      model, initial,
      [&](long, double t, const State<double>& state, Stepper*) {
        if (t <= time + 1e-9) found = state;
      },
      &final);
  return found;
}

/// The largest speed at which a joint opens.
double OpeningSpeed(const Model<double>& model, const State<double>& state) {
  double largest = 0.0;
  for (const JointIndex& joint : model.structure->joints) {
    JointRows<double> rows;
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.parameters[joint.geometry], &rows);
    for (int k = 0; k < rows.rows; ++k) {
      double speed = 0.0;
      for (int j = 0; j < 3; ++j) {
        speed += rows.row_a[k][j] * state.twist[3 * joint.a + j] +
                 rows.row_b[k][j] * state.twist[3 * joint.b + j];
      }
      largest = std::max(largest, std::abs(speed));
    }
  }
  return largest;
}

TEST(ObservedStateTest, AParabolaGivesValueAndRate) {
  Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations;
  for (int i = 0; i < 12; ++i) {
    const double t = 0.05 * i;
    observations.push_back({t, 0, -1, Coordinate::kY, 1.0 + 2.0 * t - 5.0 * t * t, 0.01});
  }
  const RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("gravity/y", -9.0)}, observations);
  const std::vector<SmoothedSeries> series = SmoothAt(residuals, 0.3);
  ASSERT_EQ(series.size(), 1u);
  EXPECT_EQ(series[0].samples, 12);  // all are explained
  EXPECT_NEAR(series[0].value, 1.0 + 0.6 - 0.45, 1e-12);
  EXPECT_NEAR(series[0].rate, 2.0 - 3.0, 1e-11);
  // A kick after the fifth: no more than those before it are used at the start.
  for (size_t i = 5; i < observations.size(); ++i) observations[i].value += 3.0;
  const std::vector<SmoothedSeries> kicked =
      SmoothAt(MakeResiduals(scene, {}, {Parameter("gravity/y", -9.0)}, observations), 0.0);
  EXPECT_EQ(kicked[0].samples, 5);
  EXPECT_NEAR(kicked[0].rate, 2.0, 1e-11);
}

TEST(ObservedStateTest, IsOnTheJointsAndNearTheTruth) {
  const Scene scene = MakeScene(kTwoLinks);
  const double sigma = 0.002;
  const RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("gravity/y", -9.0)}, Observe(scene, 5, sigma, 3));
  const State<double> truth = StateAt(scene, 0.25);
  // From where the run begins, a quarter of a second off.
  const State<double> found =
      StateFromObservations(residuals, 0.25, residuals.scene().initial_state());
  const Model<double>& model = residuals.scene().model();
  EXPECT_LT(JointDrift(model, found), 1e-8 * sigma);
  EXPECT_LT(OpeningSpeed(model, found), 1e-6 * sigma);
  for (int body = 0; body < 2; ++body) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found.pose[3 * body + i], truth.pose[3 * body + i], 3.0 * sigma);
      // A rate from samples 5 ms apart over some 50 ms.
      EXPECT_NEAR(found.twist[3 * body + i], truth.twist[3 * body + i], 0.3);
    }
  }
  // What projection must put right: the observations alone are not on the joints.
  EXPECT_GT(std::abs(found.pose[3] - residuals.observations()[0].value), 0.0);
}

// The angles alone, the lower one relative to the upper link: positions follow from the joints.
TEST(ObservedStateTest, JointAnglesAndRatesFromAngles) {
  const Scene scene = MakeScene(kTwoLinks);
  std::vector<Channel> channels(2);
  channels[1].to_body = 0;
  std::vector<Observation> observations;
  const std::vector<Observation> exact = Observe(scene, 5, 0.0, 1);
  for (size_t i = 0; i < exact.size(); ++i) {
    if (exact[i].coordinate != Coordinate::kAngle) continue;
    Observation observation = exact[i];
    observation.sigma = 1e-4;
    if (observation.body == 1) {
      observation.value -= exact[i - 3].value;
      observation.channel = 1;
    }
    observations.push_back(observation);
  }
  ParameterizedScene parameterized;
  ParameterError error;
  const std::vector<FitParameter> parameters = {
      Parameter("joints/pin/angle", 0.1), Parameter("joints/pin/rate", 0.0),
      Parameter("joints/elbow/angle", 0.3), Parameter("joints/elbow/rate", 0.5),
      Parameter("bodies/lower/mass", 1.5)};
  ASSERT_TRUE(parameterized.Create(scene, {}, parameters, &error)) << error.what;
  std::vector<bool> free;
  for (const FitParameter& parameter : parameters)
    free.push_back(IsOfInitialState(scene, parameter));
  EXPECT_EQ(free, (std::vector<bool>{true, true, true, true, false}));
  const Eigen::VectorXd p =
      ParametersFromObservations(RolloutResiduals(parameterized, observations, channels), free);
  EXPECT_NEAR(p[0], 0.7, 1e-3);
  EXPECT_NEAR(p[1], 1.5, 0.1);
  EXPECT_NEAR(p[2], -0.4, 1e-3);
  EXPECT_NEAR(p[3], -2.0, 0.1);
  EXPECT_EQ(p[4], 1.5);
}

// A cart on a rail: its place and speed are the joint's. Where it is drawn is where its anchor is,
// of a free body the start.
TEST(ObservedStateTest, ACartsDisplacementIsOfItsStart) {
  const Scene scene = MakeScene(R"({"bodies": [
      {"name": "cart", "mass": 1, "inertia": 1, "position": [0, 0]},
      {"name": "free", "mass": 1, "inertia": 1, "position": [0, 1]}],
    "joints": [{"name": "rail", "type": "prismatic", "bodies": ["cart", "world"],
                "anchor": [0, 0], "axis": [1, 0]}],
    "simulation": {"dt": 0.01, "duration": 0.1}})");
  const auto is_start = [&](const std::string& path) {
    return IsOfInitialState(scene, Parameter(path, 0.0));
  };
  EXPECT_TRUE(is_start("joints/rail/displacement"));
  EXPECT_TRUE(is_start("joints/rail/rate"));
  EXPECT_TRUE(is_start("bodies/free/position/x"));
  EXPECT_TRUE(is_start("bodies/cart/velocity/x"));
  EXPECT_FALSE(is_start("bodies/cart/position/x"));
  EXPECT_FALSE(is_start("bodies/*/position/x"));
  EXPECT_FALSE(is_start("joints/rail/damping"));
}

// A ball that rests on the floor is seen 2 mm in it, and 3 mm beside where the file has it.
// One row, near where x is largest: a step of the linearised problem is a thousand radians there.
TEST(ObservedStateTest, AnglesStayWithinHalfATurnOfWhereTheyWere) {
  for (const double below : {1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3}) {
    Scene scene = MakeScene(kPendulum);
    scene.joints[0].angle = 0.5 * kPi - below;
    const RolloutResiduals residuals =
        MakeResiduals(scene, {}, {Parameter("joints/pin/angle", 0.5 * kPi - below)},
                      {{0.0, 0, -1, Coordinate::kX, 0.9, 1e-3}});
    const double found = ParametersFromObservations(residuals, {true})[0];
    // The anchor of 1e4 of the angle's scale moves x by far less than its sigma.
    EXPECT_NEAR(std::sin(found), 0.9, 1e-5) << below;
    EXPECT_LE(std::abs(found - 0.5 * kPi), kPi) << below;
    // The pose itself, of which the joint keeps the position.
    State<double> state = residuals.scene().initial_state();
    state = StateFromObservations(residuals, 0.0, state);
    EXPECT_NEAR(state.pose[0], 0.9, 1e-5) << below;
    EXPECT_LE(std::abs(state.pose[2] - 0.5 * kPi), kPi + 1e-9) << below;
  }
}

// Where angles are observed, turns count.
TEST(ObservedStateTest, ObservedTurnsAreKept) {
  const Scene scene = MakeScene(kPendulum);
  const RolloutResiduals residuals = MakeResiduals(scene, {}, {Parameter("joints/pin/angle", 1.0)},
                                                   {{0.0, 0, -1, Coordinate::kAngle, 20.0, 1e-3}});
  EXPECT_NEAR(ParametersFromObservations(residuals, {true})[0], 20.0, 1e-5);
}

TEST(ObservedStateTest, PenetratesNothing) {
  const Scene scene = MakeScene(R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.3]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 1}})");
  std::vector<Observation> observations;
  for (int i = 0; i < 8; ++i) {
    observations.push_back({0.01 * i, 0, -1, Coordinate::kX, 0.003, 1e-3});
    observations.push_back({0.01 * i, 0, -1, Coordinate::kY, 0.098, 1e-3});
  }
  const RolloutResiduals residuals = MakeResiduals(
      scene, {},
      {Parameter("bodies/ball/position/x", 0.0), Parameter("bodies/ball/position/y", 0.3)},
      observations);
  const Eigen::VectorXd p = ParametersFromObservations(residuals, {true, true});
  EXPECT_NEAR(p[0], 0.003, 1e-9);
  // The row of the gap has a kink where the ball touches: within a thousandth of sigma.
  EXPECT_NEAR(p[1], 0.1, 1e-6);
  const State<double> state =
      StateFromObservations(residuals, 0.03, residuals.scene().initial_state());
  EXPECT_LT(DeepestPenetration(residuals.scene().model(), state), 1e-9);
  EXPECT_NEAR(state.pose[1], 0.1, 1e-6);
  EXPECT_EQ(state.pose[2], residuals.scene().initial_state().pose[2]);  // never observed
}

}  // namespace
}  // namespace tangible
