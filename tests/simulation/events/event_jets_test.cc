// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_jets.h"

#include <gtest/gtest.h>

#include "../../support/gradients.h"
#include "../../support/jets.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

constexpr char kBounce[] = R"({"gravity": [0, -10], "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 0.45],
     "velocity": [1, -3], "restitution": 0.5},
    {"name": "floor", "static": true, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.3, "duration": 0.3}})";

// One step of a scene in double, and the same in Jets of which `seed` sets the derivatives.
template <int N, typename Seed>
State<Jet<N>> StepInJets(const std::string& text, JetRoute route, const Seed& seed) {
  Model<double> model;
  State<double> start;
  BuildModel(test_scenes::SceneOf(text), &model, &start);
  const double dt = model.structure->settings.dt;
  Stepper stepper(model);
  State<double> after = start;
  const StepReport report = stepper.Step(model, 0.0, dt, &after);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  Model<Jet<N>> jets;
  jets.structure = model.structure;
  for (const double number : model.parameters) jets.parameters.push_back(Jet<N>(number));
  State<Jet<N>> state;
  for (size_t i = 0; i < start.pose.size(); ++i) {
    state.pose.push_back(Jet<N>(start.pose[i]));
    state.twist.push_back(Jet<N>(start.twist[i]));
  }
  seed(&jets, &state);
  IslandStepInJets(jets, model, route, &stepper.mutable_parts(), &state);
  for (size_t i = 0; i < start.pose.size(); ++i) {
    EXPECT_NEAR(state.pose[i].a, after.pose[i], 1e-9) << i;
    EXPECT_NEAR(state.twist[i].a, after.twist[i], 1e-9) << i;
  }
  return state;
}

// One step through an impact at t = 0.1 s with v⁻ = −4 and v⁺ = 2 m/s. From a height greater by dz
// it is later by dz / 4.
template <int N>
void ExpectImpactsMoveInTime(JetRoute route) {
  const State<Jet<N>> state =
      StepInJets<N>(kBounce, route, [](auto*, auto* start) { start->pose[1].v[0] = 1.0; });
  // v⁻ falls by g dz / 4 = 2.5 dz, v⁺ = −e v⁻ grows by 1.25 dz; then gravity acts dz / 4 less.
  EXPECT_NEAR(state.twist[1].v[0], 1.25 + 2.5, 1e-9);
  // z(T) = r + v⁺ s − ½ g s², s = 0.2 − dz / 4: 1.25 · 0.2 − (2 − 10 · 0.2) / 4.
  EXPECT_NEAR(state.pose[1].v[0], 0.25, 1e-9);
  EXPECT_NEAR(state.pose[0].v[0], 0.0, 1e-12);
}

// A disc that does not turn, on a floor; `more` bodies, joints and so on.
std::string DiscOnFloor(const std::string& velocity, const std::string& gravity,
                        const std::string& bodies, const std::string& more) {
  return R"({"gravity": )" + gravity + R"(, "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1],
       "velocity": )" +
         velocity + R"(, "friction": 0.5},
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})" +
         bodies + R"(],
    "joints": [{"name": "guide", "type": "fixed_angle", "bodies": ["disc", "world"]}])" +
         more + R"(,
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 1, "duration": 1}})";
}

// Up a slope the disc slides with a deceleration of 8 + 0.5 · 6 = 11 to rest at t = 0.5 s, and back
// with 8 − 3 = 5 m/s²: v(T) = −5 (T − v0 / 11).
template <int N>
void ExpectEndsOfSlidingMoveInTime(JetRoute route) {
  const std::string text = DiscOnFloor("[5.5, 0]", "[-8, -6]", "", "");
  const State<Jet<N>> state =
      StepInJets<N>(text, route, [](auto*, auto* start) { start->twist[0].v[0] = 1.0; });
  EXPECT_NEAR(state.twist[0].a, -2.5, 1e-12);
  EXPECT_NEAR(state.twist[0].v[0], 5.0 / 11.0, 1e-9);
  // x(T) = v0² / 22 − ½ 5 (T − v0 / 11)².
  EXPECT_NEAR(state.pose[0].v[0], 0.5 + 5.0 / 11.0 * 0.5, 1e-9);
}

// A hand pulls with a force that grows by `rate` N a second, and begins to move the disc of 1 kg as
// that reaches what holds it, at t = T − τ = hold / rate. No force is left there, so that the
// trapezoidal rule gives q = τ² a / 4, v = τ a / 2 with a = rate (τ − q).
template <int N>
void ExpectForcesThatGiveWayMoveInTime(JetRoute route, const std::string& pull, double rate,
                                       double friction, int component) {
  const bool sideways = component == 0;
  const std::string hand = sideways ? "[1, 0.1]" : "[0, 1.1]";
  const std::string text = DiscOnFloor(
      "[0, 0]", "[0, -10]",
      R"(, {"name": "hand", "kinematic": true, "velocity": )" + pull + R"(, "position": )" + hand +
          "}",
      R"(, "springs": [{"name": "s", "bodies": ["disc", "hand"], "anchors": [[0, 0.1], )" + hand +
          R"(], "stiffness": )" + std::to_string(rate) + R"(, "rest_length": 1}])");
  const State<Jet<N>> state = StepInJets<N>(
      text, route, [](auto* model, auto*) { model->parameters[kGravityY].v[0] = 1.0; });
  const double tau = 1.0 - friction * 10.0 / rate;
  const double stiffer = 1.0 + 0.25 * rate * tau * tau;
  EXPECT_NEAR(state.twist[component].a, 0.5 * rate * tau * tau / stiffer, 1e-9);
  // Less gravity holds less: ∂τ/∂g = friction / rate.
  EXPECT_NEAR(state.twist[component].v[0], friction * tau / (stiffer * stiffer), 1e-9);
  const double dq_dtau =
      rate * tau * tau * (0.75 * stiffer - 0.125 * rate * tau * tau) / (stiffer * stiffer);
  EXPECT_NEAR(state.pose[component].v[0], friction / rate * dq_dtau, 1e-9);
}

// A slider runs up to its limit at 1 m, at t = 0.25 s and 3 m/s, stops there and falls back:
// v(T) = −8 (T − t), with ∂t/∂v0 = −t / 3 and ∂t/∂limit = 1 / 3.
template <int N>
void ExpectLimitsMoveInTime(JetRoute route) {
  const std::string text = R"({"gravity": [-8, 0], "bodies": [
      {"name": "slider", "mass": 2, "inertia": 0.1, "position": [0, 0], "velocity": [5, 0]}],
    "joints": [{"name": "rail", "type": "prismatic", "bodies": ["slider", "world"],
                "anchor": [0, 0], "axis": [1, 0], "limits": [-9, 1]}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.5, "duration": 0.5}})";
  const State<Jet<N>> by_speed =
      StepInJets<N>(text, route, [](auto*, auto* start) { start->twist[0].v[0] = 1.0; });
  EXPECT_NEAR(by_speed.twist[0].a, -2.0, 1e-9);
  EXPECT_NEAR(by_speed.twist[0].v[0], -8.0 * 0.25 / 3.0, 1e-9);
  const State<Jet<N>> by_limit = StepInJets<N>(text, route, [](auto* model, auto*) {
    model->parameters[model->structure->joints[0].high].v[0] = 1.0;
  });
  EXPECT_NEAR(by_limit.twist[0].v[0], 8.0 / 3.0, 1e-9);
  // x(T) = limit − ½ 8 (T − t)².
  EXPECT_NEAR(by_limit.pose[0].v[0], 1.0 + 8.0 * 0.25 / 3.0, 1e-9);
}

// Of the events' equations alone: a step in Jets is not given what the tangent knows of events.
TEST(EventJetsTest, EventsMoveInTime) {
  constexpr int kWidth = testing::WidestJet();
  if constexpr (kWidth > 0) {
    for (const JetRoute route : {JetRoute::kImplicit, JetRoute::kUnrolled}) {
      ExpectImpactsMoveInTime<kWidth>(route);
      ExpectEndsOfSlidingMoveInTime<kWidth>(route);
      ExpectForcesThatGiveWayMoveInTime<kWidth>(route, "[1, 0]", 10.0, 0.5, 0);
      ExpectForcesThatGiveWayMoveInTime<kWidth>(route, "[0, 1]", 15.0, 1.0, 1);
      ExpectLimitsMoveInTime<kWidth>(route);
    }
  } else {
    GTEST_SKIP() << "built without Jets";
  }
}

// Two bars on two parallel pins, hung up: one row is redundant, and what elimination leaves of its
// pivot is some thousand ε.
TEST(EventJetsTest, UnrolledJetsLeaveOutWhatIsRoundingOfARedundantRow) {
  if (!testing::HaveJets()) {
    GTEST_SKIP() << "built without Jets";
  }
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "bar1", "mass": 1.38398080916717, "inertia": 0.01263542322458177,
       "position": [2.534148383215356, 0.24777896412583356]},
      {"name": "bar2", "mass": 1.762951663950894, "inertia": 0.027847165625632702,
       "position": [2.534148383215356, 0.07277896412583355], "angle": 0.165148677414627}],
    "joints": [
      {"name": "joint0", "type": "revolute", "bodies": ["bar1", "bar2"],
       "anchor": [2.434148383215356, 0.14777896412583355]},
      {"name": "joint1", "type": "revolute", "bodies": ["bar1", "bar2"],
       "anchor": [2.634148383215356, 0.14777896412583355]},
      {"name": "joint2", "type": "revolute", "bodies": ["bar1", "world"],
       "anchor": [2.384148383215356, 0.24777896412583356]}],
    "simulation": {"dt": 0.002, "duration": 0.02, "stepping": "event",
                   "integrator": "trapezoidal", "joint_correction": "projection"}})");
  const std::vector<std::string> paths = {"bodies/*/mass", "joints/joint1/anchor/y"};
  const GradientResult adjoint = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
  const GradientResult jets = testing::Jacobian(scene, paths, GradientMethod::kJet);
  EXPECT_LT((jets.jacobian - adjoint.jacobian).cwiseAbs().maxCoeff(), 1e-8);
}

// A tall box whose sliding all but jams: its implicit stage does not contract, and Newton's method
// is for the derivatives alone, as values are known.
TEST(EventJetsTest, AStageThatDoesNotContractIsDifferentiatedAtItsValues) {
  if (!testing::HaveJets()) {
    GTEST_SKIP() << "no width of Jets is built";
  }
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "floor", "static": true, "friction": 1.2324094627714344,
       "shape": {"half_plane": {"normal": [0.24567553698649075, 0.9693521189569864],
                                "offset": 0}}},
      {"name": "box", "shape": {"box": {"size": [0.25097734287150597, 0.6386085223226504]}},
       "mass": 2.190264286950023, "inertia": 0.07644385413189067,
       "position": [0.07844524582288326, 0.3095182621487256], "angle": -0.248216526409452,
       "velocity": [-2.3506602388176296, 0.5957584505676823], "friction": 1.2324094627714344}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.005,
                   "duration": 0.005}})");
  const std::vector<std::string> paths = {"bodies/*/friction", "bodies/box/mass"};
  const RowMatrixXd tangent =
      testing::Jacobian(scene, paths, GradientMethod::kTangent, CertificatePass::kSkip).jacobian;
  const RowMatrixXd jets =
      testing::Jacobian(scene, paths, GradientMethod::kJetImplicit, CertificatePass::kSkip)
          .jacobian;
  EXPECT_GT(tangent.cwiseAbs().maxCoeff(), 0.1);
  for (Eigen::Index k = 0; k < tangent.cols(); ++k) {
    EXPECT_LE((jets - tangent).col(k).cwiseAbs().maxCoeff(),
              1e-11 * tangent.col(k).cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace tangible
