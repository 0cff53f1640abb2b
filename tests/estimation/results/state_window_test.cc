// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/state_window.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/variance_components.h"
#include "tangible/estimation/results/held_out.h"

namespace tangible {
namespace {

/// A pendulum of which one recording identifies the damping, and others are predicted from 2 s on.
struct Kept {
  FitInput input;
  std::vector<HeldOutRecording> held_out;

  /// `friction`: of the hinge, N m, which the model does not have.
  explicit Kept(double friction, const std::string& text = Text()) {
    Scene scene = MakeScene(text);
    FitProblem problem;
    problem.scene = scene;
    problem.parameters = {Parameter("joints/pin/angle", 0.9), Parameter("joints/pin/rate", 0.2),
                          Parameter("joints/pin/damping", 0.02)};
    input.scopes.assign(3, {ParameterScope::Kind::kOwn, PriorKind::kGaussian, {}});
    input.scopes[2].kind = ParameterScope::Kind::kShared;
    scene.joints[0].friction = friction;
    for (int i = 0; i < 4; ++i) {
      scene.joints[0].angle = 1.2 - 0.15 * i;
      RecordingInput recording;
      recording.name = std::string(1, static_cast<char>('a' + i));
      recording.problem = problem;
      recording.problem.observations = Observe(scene, 1, 1e-3, static_cast<unsigned>(20 + i));
      if (i == 0) {
        input.recordings.push_back(recording);
        continue;
      }
      HeldOutRecording& kept = held_out.emplace_back();
      kept.state_from = 2.0;
      kept.later = TakeLater(2.0, &recording.problem.observations);
      kept.recording = recording;
      kept.place = i;
    }
  }

  static std::string Text() {
    std::string text = kPendulum;
    text.replace(text.find("\"duration\": 2"), 13, "\"duration\": 4");
    return text;
  }

  HeldOutRuns Runs() {
    ParameterError error;
    int fault = 0;
    problem_ = MakeProblem(input, &error, &fault);
    EXPECT_NE(problem_, nullptr) << error.what;
    VarianceComponents components;
    result_ = FitWithComponents(input.options(), problem_.get(), {}, &components);
    EXPECT_EQ(result_.status, FitStatus::kConverged) << result_.message;
    return PredictHeldOut(input, *problem_, result_.estimate, {}, held_out);
  }

  std::string Table(const HeldOutRuns& runs) const {
    return PredictionCsv(*problem_, result_.residuals, nullptr, &runs);
  }
  HeldOutRun Whole(size_t i) const {
    return PredictOne(input, input.options(), *problem_, result_.estimate, held_out[i], 0.0);
  }

 private:
  std::unique_ptr<RecordingsProblem> problem_;
  FitResult result_;
};

TEST(StateWindowTest, AWrongModelHasItsStateFromTheLastObservations) {
  Kept kept(0.06);
  const HeldOutRuns runs = kept.Runs();
  ASSERT_FALSE(runs.window.tried.empty());
  EXPECT_GT(runs.window.seconds, 0.0);
  EXPECT_LE(runs.window.seconds, 0.5);
  EXPECT_EQ(runs.window.tried[0].seconds, 0.0);
  for (size_t i = 0; i < runs.runs.size(); ++i) {
    const HeldOutRun& run = runs.runs[i];
    const HeldOutRun whole = kept.Whole(i);
    // The run begins with the window, and counts the recording's time where it is shown.
    EXPECT_NEAR(run.begins, 2.0 - runs.window.seconds, 0.011);
    EXPECT_EQ(run.used.size() + run.unused.size(), whole.used.size());
    EXPECT_NEAR(run.used.front().time, run.begins, 1e-12);
    EXPECT_EQ(static_cast<size_t>(run.residuals.size()), run.used.size());
    EXPECT_EQ(run.later.observations.front().time, whole.later.observations.front().time);
    EXPECT_EQ(run.later.score.from, 2.0);
    EXPECT_NEAR(run.later.score.all.to, 2.0, 1e-9);
    // What is predicted first tells the state.
    EXPECT_LT(run.later.score.horizons.front().rms_in_sigma,
              0.7 * whole.later.score.horizons.front().rms_in_sigma);
  }
  const std::string table = kept.Table(runs);
  EXPECT_NE(table.find("b,0.01,bob,,x,,,unused,"), std::string::npos);
  EXPECT_NE(table.find("b,2,bob,,x,,,state,"), std::string::npos);
  EXPECT_NE(table.find("b,2.5,bob,,x,,,prediction,"), std::string::npos);
  EXPECT_NE(Describe(runs).find("states are fitted to the last "), std::string::npos)
      << Describe(runs);
}

TEST(StateWindowTest, ARightModelHasItFromAll) {
  Kept kept(0.0);
  const HeldOutRuns runs = kept.Runs();
  EXPECT_TRUE(runs.window.tried.empty());
  for (const HeldOutRun& run : runs.runs) EXPECT_EQ(run.begins, 0.0);
}

// A run whose load depends on time cannot begin later, nor one whose start has too few parameters.
TEST(StateWindowTest, ARunThatCannotBeginLaterHasItFromAll) {
  std::string text = Kept::Text();
  const std::string before = "\"simulation\"";
  text.insert(text.find(before),
              "\"forces\": [{\"name\": \"push\", \"body\": \"bob\", \"force\": [0.3, 0], "
              "\"start\": 0.5}],\n  ");
  EXPECT_TRUE(Kept(0.06, text).Runs().window.tried.empty());
  // The spring's anchors are points of the world at the start: a later start makes another spring.
  std::string sprung = Kept::Text();
  sprung.insert(sprung.find(before),
                "\"springs\": [{\"name\": \"pull\", \"bodies\": [\"bob\", \"world\"], "
                "\"anchors\": [[0, -1], [1, -1]], \"rest_length\": 1, \"stiffness\": 0.1}],\n  ");
  EXPECT_TRUE(Kept(0.06, sprung).Runs().window.tried.empty());
  Kept fewer(0.06);
  for (RecordingInput& one : fewer.input.recordings) {
    one.problem.parameters.erase(one.problem.parameters.begin() + 1);
  }
  for (HeldOutRecording& one : fewer.held_out) {
    one.recording.problem.parameters.erase(one.recording.problem.parameters.begin() + 1);
  }
  fewer.input.scopes.erase(fewer.input.scopes.begin());
  EXPECT_TRUE(fewer.Runs().window.tried.empty());
}

}  // namespace
}  // namespace tangible
