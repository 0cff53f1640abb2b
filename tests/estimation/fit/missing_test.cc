// SPDX-License-Identifier: Apache-2.0
//
// Faults are planted in simulated recordings of a double pendulum, and looked for by a model that
// does not have them.
#include "tangible/estimation/fit/missing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {
namespace {

constexpr char kDoublePendulum[] = R"({"name": "double pendulum", "bodies": [
  {"name": "upper", "mass": 0.4, "inertia": 0.004, "position": [0, -0.15]},
  {"name": "lower", "mass": 0.3, "inertia": 0.003, "position": [0, -0.45]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
              "angle": 0.9, "damping": 0.002},
             {"name": "elbow", "type": "revolute", "bodies": ["lower", "upper"],
              "anchor": [0, -0.3], "angle": -0.5, "damping": 0.001}],
  "simulation": {"dt": 0.005, "duration": 3, "integrator": "trapezoidal",
                 "joint_correction": "projection"}})";

/// Two bars of which one is welded to the other, on a pin.
constexpr char kWelded[] = R"({"name": "welded", "bodies": [
  {"name": "upper", "mass": 0.4, "inertia": 0.004, "position": [0, -0.15]},
  {"name": "lower", "mass": 0.3, "inertia": 0.003, "position": [0.1, -0.45]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["upper", "world"], "anchor": [0, 0],
              "angle": 0.9, "damping": 0.002},
             {"name": "elbow", "type": "weld", "bodies": ["lower", "upper"],
              "anchor": [0, -0.3]}],
  "simulation": {"dt": 0.005, "duration": 3, "integrator": "trapezoidal",
                 "joint_correction": "projection"}})";

const std::vector<BodyPoint> kPoints = {{"knee", 0, {0.0, -0.15}}, {"tip", 1, {0.0, -0.15}}};

/// What a camera of 60 pictures a second sees of the points of a scene.
std::vector<Observation> Watch(const Scene& scene,
                               const std::function<Vector2<double>(double x, double y)>& image,
                               double rate = 60.0) {
  std::vector<Observation> observations;
  for (int k = 0; k / rate <= scene.simulation.duration - 0.02; ++k) {
    for (int point = 0; point < 2; ++point) {
      for (int axis = 0; axis < 2; ++axis) {
        observations.push_back({k / rate, point, point, static_cast<Coordinate>(axis), 0.0, 1e-3});
      }
    }
  }
  FitParameter none = Parameter("gravity/y", -9.81);
  none.initial.reset();
  RolloutResiduals run = MakeResiduals(scene, kPoints, {none}, observations);
  Eigen::VectorXd predicted;
  EXPECT_TRUE(run.Evaluate(run.scene().Initial(), GradientMethod::kTangent, &predicted, nullptr))
      << run.message();
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1e-3);
  for (size_t i = 0; i < observations.size(); i += 2) {
    const auto at = static_cast<Eigen::Index>(i);
    const Vector2<double> seen = image(1e-3 * predicted[at], 1e-3 * predicted[at + 1]);
    for (int axis = 0; axis < 2; ++axis) observations[i + axis].value = seen[axis] + normal(random);
  }
  return observations;
}

Vector2<double> AsItIs(double x, double y) { return {x, y}; }

struct Found {
  FitResult fit;
  MissingResult missing;
};

/// Fits and asks what is missing.
Found FitAndAsk(FitInput input) {
  for (RecordingInput& recording : input.recordings) {
    recording.problem.options.profile_pass = ProfilePass::kSkip;
    recording.problem.options.certificate = CertificatePass::kSkip;
    recording.problem.options.held_test = HeldTest::kSkip;
  }
  ParameterError error;
  int fault = 0;
  const std::unique_ptr<RecordingsProblem> recordings = MakeProblem(input, &error, &fault);
  EXPECT_NE(recordings, nullptr) << error.what;
  Found found;
  found.fit = Fit(input.options(), recordings.get(), {});
  EXPECT_EQ(found.fit.status, FitStatus::kConverged) << found.fit.message;
  found.missing = FindMissing({}, input, found.fit, recordings.get());
  return found;
}

/// The same of one recording by a model.
Found FitAndAsk(const Scene& model, const std::vector<std::string>& parameters,
                std::vector<Observation> observations) {
  FitProblem problem;
  problem.scene = model;
  problem.points = kPoints;
  for (const std::string& path : parameters) {
    FitParameter one = Parameter(path, 0.0);
    one.initial.reset();
    problem.parameters.push_back(one);
  }
  problem.observations = std::move(observations);
  return FitAndAsk(InputOf(problem));
}

std::string Table(const Found& found) {
  std::string text = "rms " + std::to_string(found.fit.uncertainty.residual_rms) + ", " +
                     std::to_string(found.missing.tested) + " tested, " +
                     std::to_string(found.missing.seconds) + " s, " +
                     std::to_string(found.missing.rollouts) + " runs\n";
  for (const MissingRow& row : found.missing.rows) {
    text += row.candidate + ": share " + std::to_string(row.cost_share) + " refitted " +
            std::to_string(row.refitted_share) + " gain " + std::to_string(row.held_out_gain) +
            (row.confirmed ? " confirmed" : "");
    for (size_t k = 0; k < row.parameters.size(); ++k) {
      text += "; " + row.parameters[k] + " " + std::to_string(row.first_order[k]);
      if (row.refitted) text += " -> " + std::to_string(row.values[k]);
    }
    text += "; as";
    for (const std::string& name : row.equivalent) text += " " + name;
    text += "\n";
  }
  return text;
}

/// Whether the first row, or what is equivalent to it, is one of these, and a fit confirms it.
bool IsFirst(const Found& found, const std::vector<std::string>& truths) {
  if (found.missing.rows.empty() || !found.missing.rows.front().confirmed) return false;
  const MissingRow& first = found.missing.rows.front();
  return std::any_of(truths.begin(), truths.end(), [&](const std::string& truth) {
    return first.candidate == truth || std::find(first.equivalent.begin(), first.equivalent.end(),
                                                 truth) != first.equivalent.end();
  });
}

const std::vector<std::string> kUsual = {
    "joints/pin/angle",   "joints/elbow/angle",   "joints/pin/rate",     "joints/elbow/rate",
    "joints/pin/damping", "joints/elbow/damping", "bodies/lower/inertia"};

TEST(MissingTest, DryFrictionThatTheSceneHolds) {
  Scene truth = MakeScene(kDoublePendulum);
  truth.joints[0].friction = 0.01;
  Scene model = truth;
  model.joints[0].friction = 0.0;
  const Found found = FitAndAsk(model, kUsual, Watch(truth, AsItIs));
  EXPECT_TRUE(IsFirst(found, {"joints/pin/friction"})) << Table(found);
}

TEST(MissingTest, DryFrictionThatTheSceneDoesNotHave) {
  Scene truth = MakeScene(kDoublePendulum);
  truth.joints[0].friction = 0.01;
  const Found found = FitAndAsk(MakeScene(kDoublePendulum), kUsual, Watch(truth, AsItIs));
  EXPECT_TRUE(IsFirst(found, {"joints/pin/friction"})) << Table(found);
}

TEST(MissingTest, TiltOfTwoDegrees) {
  Scene truth = MakeScene(kDoublePendulum);
  const double tilt = 2.0 * M_PI / 180.0;
  truth.gravity = {9.81 * std::sin(tilt), -9.81 * std::cos(tilt)};
  const Found found = FitAndAsk(MakeScene(kDoublePendulum), kUsual, Watch(truth, AsItIs));
  EXPECT_TRUE(IsFirst(found, {"gravity/x"})) << Table(found);
}

TEST(MissingTest, ClockThatIsSlow) {
  // Pictures are taken 59.94 times a second, and their times count 60.
  std::vector<Observation> seen = Watch(MakeScene(kDoublePendulum), AsItIs, 59.94);
  for (Observation& one : seen) one.time *= 59.94 / 60.0;
  const Found found = FitAndAsk(MakeScene(kDoublePendulum), kUsual, seen);
  EXPECT_TRUE(IsFirst(found, {"clocks/clock/rate"})) << Table(found);
}

TEST(MissingTest, PixelsThatAreNotSquare) {
  const Found found = FitAndAsk(MakeScene(kDoublePendulum), kUsual,
                                Watch(MakeScene(kDoublePendulum), [](double x, double y) {
                                  return Vector2<double>(1.02 * x, y);
                                }));
  EXPECT_TRUE(IsFirst(found, {"cameras/camera/aspect"})) << Table(found);
}

TEST(MissingTest, LensThatBends) {
  const auto lens = [](double x, double y) {
    const double factor = 1.0 + 0.02 * (x * x + y * y) / (0.6 * 0.6);
    return Vector2<double>(factor * x, factor * y);
  };
  const Found found =
      FitAndAsk(MakeScene(kDoublePendulum), kUsual, Watch(MakeScene(kDoublePendulum), lens));
  EXPECT_TRUE(IsFirst(found, {"cameras/camera/radial"})) << Table(found);
}

TEST(MissingTest, WeldInThePlaceOfAHinge) {
  const Scene model = MakeScene(kWelded);
  Scene truth = model;
  truth.joints[1].type = JointType::kRevolute;
  truth.joints[1].stiffness = 5.0;
  truth.joints[1].damping = 0.01;
  const Found found = FitAndAsk(
      model, {"joints/pin/angle", "joints/pin/rate", "joints/pin/damping", "bodies/lower/inertia"},
      Watch(truth, AsItIs));
  EXPECT_TRUE(IsFirst(found, {"joints/elbow as a hinge with stiffness"})) << Table(found);
}

TEST(MissingTest, PivotThatGives) {
  const Scene model = MakeScene(kDoublePendulum);
  Scene truth = model;
  // The pivot hangs from springs of its own.
  BasicBody<double> carrier;
  carrier.name = "bracket";
  carrier.mass = 0.02;
  carrier.inertia = 1.0;
  truth.bodies.push_back(carrier);
  truth.joints[0].bodies[1] = 2;
  BasicJoint<double> guide;
  guide.name = "guide";
  guide.type = JointType::kFixedAngle;
  guide.bodies[0] = 2;
  truth.joints.push_back(guide);
  BasicForce<double> springs;
  springs.name = "springs";
  springs.body = 2;
  for (auto& servo : springs.force_servos) {
    servo.emplace();
    servo->stiffness = 1500.0;
    servo->damping = 3.0;
  }
  truth.forces.push_back(springs);
  const Found found = FitAndAsk(model, kUsual, Watch(truth, AsItIs));
  EXPECT_TRUE(IsFirst(found, {"joints/pin as an elastic pivot"})) << Table(found);
}

TEST(MissingTest, RecordingsWithStartsOfTheirOwnShareWhatIsMissing) {
  FitInput input;
  for (const double angle : {0.9, 0.5}) {
    Scene truth = MakeScene(kDoublePendulum);
    truth.joints[0].angle = angle;
    truth.joints[1].rate = angle - 0.6;
    RecordingInput& recording = input.recordings.emplace_back();
    recording.name = angle > 0.6 ? "high" : "low";
    recording.problem.scene = truth;
    recording.problem.points = kPoints;
    recording.problem.parameters = {Parameter("joints/pin/angle", angle),
                                    Parameter("joints/pin/damping", 0.002)};
    recording.problem.parameters[1].prior = Prior{PriorKind::kLogNormal, 0.002, 2.0};
    truth.bodies[1].quadratic_drag = 0.02;
    recording.problem.observations = Watch(truth, AsItIs);
  }
  input.scopes.resize(2);
  input.scopes[0].kind = ParameterScope::Kind::kOwn;
  const Found found = FitAndAsk(input);
  EXPECT_TRUE(IsFirst(found, {"bodies/lower/quadratic_drag"})) << Table(found);
  // What differs from one recording to the other has no value that both could share.
  for (const MissingRow& row : found.missing.rows) {
    EXPECT_NE(row.candidate, "joints/elbow/rate");
  }
}

TEST(MissingTest, NothingIsMissingInTheTrueModel) {
  const Found found =
      FitAndAsk(MakeScene(kDoublePendulum), kUsual, Watch(MakeScene(kDoublePendulum), AsItIs));
  for (const MissingRow& row : found.missing.rows) EXPECT_FALSE(row.confirmed) << Table(found);
  EXPECT_GT(found.missing.tested, 20);
}

}  // namespace
}  // namespace tangible
