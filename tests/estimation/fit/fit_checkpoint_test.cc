// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit_checkpoint.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../../support/block_problem.h"
#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/discretisation.h"
#include "tangible/math/bit_hash.h"

namespace tangible {
namespace {

/// Three starts, multiple shooting, Huber's loss.
FitProblem PendulumProblem() {
  FitProblem problem;
  problem.scene = MakeScene(kPendulum);
  problem.parameters = {Parameter("joints/pin/angle", 0.8), Parameter("joints/pin/damping", 0.01)};
  problem.observations = Observe(problem.scene, 20, 0.01, 1);
  problem.options.starts = 3;
  problem.options.approach = FitApproach::kSegments;
  problem.options.segments = 2;
  problem.options.huber = 1.5;
  problem.options.seed = 7;
  return problem;
}

RolloutResiduals ResidualsOf(const FitProblem& problem) {
  return MakeResiduals(problem.scene, problem.points, problem.parameters, problem.observations);
}

/// All of a result but its seconds.
std::string HashOf(const FitResult& fit) {
  BitHash hash;
  hash.Add(static_cast<int>(fit.status));
  hash.Add(fit.message);
  hash.AddAll(fit.estimate);
  hash.AddAll(fit.uncertainty.covariance);
  hash.AddAll(std::array<double, 2>{fit.initial_cost, fit.final_cost});
  for (const FitIteration& iteration : fit.iterations) {
    hash.AddAll(std::array<double, 2>{iteration.cost, iteration.gradient_norm});
    hash.AddAll(iteration.parameters);
  }
  for (const FitStart& start : fit.starts) {
    hash.AddAll(start.initial);
    hash.Add(start.cost);
    hash.Add(start.iterations);
    hash.Add(start.approach_iterations);
    hash.Add(start.status);
  }
  hash.AddAll(fit.residuals);
  hash.Add(static_cast<int>(fit.rollouts));
  hash.Add(fit.certificate.verdict);
  return hash.Text();
}

// An interruption after every third iteration that was accepted or part that ended.
TEST(FitCheckpointTest, EndsAtTheSameBitsWhereverItWasInterrupted) {
  const FitProblem problem = PendulumProblem();
  RolloutResiduals residuals = ResidualsOf(problem);
  const FitResult whole = Fit(problem.options, &residuals, {});
  ASSERT_EQ(whole.status, FitStatus::kConverged) << whole.message;

  std::vector<FitLog> interruptions;
  FitLog log;
  const auto keep = [&] { interruptions.push_back(log); };
  log.on_end = keep;
  log.search.OnIteration(keep);
  log.start.OnIteration(keep);
  RolloutResiduals logged = ResidualsOf(problem);
  EXPECT_EQ(HashOf(Fit(problem.options, &logged, {}, &log)), HashOf(whole));
  ASSERT_GT(interruptions.size(), 40u);

  for (size_t i = 0; i < interruptions.size(); i += 3) {
    FitCheckpoint written(InputOf(problem), {});
    *written.Next() = interruptions[i];
    FitCheckpoint read(InputOf(problem), [](const std::string&) { return ""; });
    ASSERT_EQ(read.Restore(written.Text(), "c.json"), "");
    EXPECT_EQ(read.Text(), written.Text());
    RolloutResiduals again = ResidualsOf(problem);
    ASSERT_EQ(HashOf(Fit(problem.options, &again, {}, read.Next())), HashOf(whole)) << i;
    ASSERT_EQ(read.mismatch(), 0);
  }
}

/// Runs a fit, and then again from every checkpoint that it wrote; all end with the same bits.
template <typename FitOnce>
void ExpectTheSameBitsFromEveryCheckpoint(const FitOnce& fit) {
  const FitProblem any = PendulumProblem();
  std::vector<std::string> texts;
  FitCheckpoint checkpoint(InputOf(any), {});
  FitLog* const log = checkpoint.Next();
  const auto keep = [&] { texts.push_back(checkpoint.Text()); };
  log->on_end = keep;
  log->search.OnIteration(keep);
  log->start.OnIteration(keep);
  const std::string whole = fit(log);
  ASSERT_GT(texts.size(), 3u);
  for (size_t i = 0; i < texts.size(); ++i) {
    FitCheckpoint read(InputOf(any), [](const std::string&) { return ""; });
    ASSERT_EQ(read.Restore(texts[i], "c.json"), "");
    ASSERT_EQ(fit(read.Next()), whole) << i << " of " << texts.size();
    ASSERT_EQ(read.mismatch(), 0);
  }
}

// Through an impact two further starts are made. Whether they are is asked by a run that is
// counted once.
TEST(FitCheckpointTest, TheStartsThatAnImpactAsksForAreCountedOnce) {
  FitProblem problem;
  problem.scene = MakeScene(R"({"name": "bounce", "bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.6],
     "velocity": [0.5, 0], "restitution": 0.6},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  problem.options.starts = 0;
  problem.parameters = {Parameter("bodies/ball/restitution", 0.3)};
  problem.observations = Observe(problem.scene, 5, 0.002, 3);
  int starts = 0;
  ExpectTheSameBitsFromEveryCheckpoint([&](FitLog* log) {
    RolloutResiduals residuals = ResidualsOf(problem);
    const FitResult fit = Fit(problem.options, &residuals, {}, log);
    starts = static_cast<int>(fit.starts.size());
    return HashOf(fit);
  });
  EXPECT_EQ(starts, 3);
}

/// One residual that does not depend on the parameter p below 0.05 and has a minimum above it that
/// costs more: 1, and 2 + (p − 0.5)².
class FlatStartProblem : public LeastSquaresProblem {
 public:
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 1; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return 2; }
  int num_observation_rows(int /*block*/) const override { return 2; }
  std::vector<RowPlace> Places(int /*block*/) const override {
    return {{0, 0.0, 0.0}, {0, 1.0, 0.0}};
  }
  std::string BlockName(int /*block*/) const override { return "block 0: "; }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
    evaluation->rollouts = 1;
    const bool flat = p[0] < 0.05;
    const double offset = p[0] - 0.5;
    evaluation->residuals =
        flat ? Eigen::Vector2d(1.0, 0.5) : Eigen::Vector2d(2.0 + offset * offset, offset);
    if (derivatives == BlockDerivatives::kCompute) {
      evaluation->jacobian.setZero(2, 1);
      if (!flat) evaluation->jacobian << 2.0 * offset, 1.0;
    }
    return true;
  }

 private:
  std::vector<ParameterEntry> entries_ = {{"p", 0.0, 0.0, 1.0, false, 1.0}};
};

TEST(FitCheckpointTest, GoesOnWhereTheInitialValuesAreMinimisedFromAfterAll) {
  FitOptions options;
  options.starts = 1;
  double cost = 0.0;
  ExpectTheSameBitsFromEveryCheckpoint([&](FitLog* log) {
    FlatStartProblem problem;
    const FitResult fit = Fit(options, &problem, {}, log);
    cost = fit.final_cost;
    return HashOf(fit);
  });
  EXPECT_EQ(cost, 0.625);
}

// A finished fit needs no run but the one at the estimate, of which nothing is kept.
TEST(FitCheckpointTest, WhatIsDoneIsNotDoneAgain) {
  FitProblem problem = PendulumProblem();
  problem.options.certificate = CertificatePass::kSkip;
  problem.options.profile_pass = ProfilePass::kSkip;
  FitLog log;
  RolloutResiduals residuals = ResidualsOf(problem);
  const FitResult whole = Fit(problem.options, &residuals, {}, &log);
  log.search.Restore(log.search.evaluations());
  log.start.Restore(log.start.evaluations());
  int progress = 0;
  RolloutResiduals others = ResidualsOf(problem);
  const FitResult again = Fit(
      problem.options, &others, [&](int, int, const FitIteration&) { ++progress; }, &log);
  EXPECT_EQ(HashOf(again), HashOf(whole));
  EXPECT_EQ(progress, 0);
  EXPECT_EQ(others.rollouts(), 1);
}

// The blocks' factors are kept as well as those of one run, for any number of threads.
TEST(FitCheckpointTest, AFitOfSeveralRecordingsEndsAtTheSameBits) {
  FitOptions options;
  options.starts = 2;
  options.huber = 2.0;
  options.threads = 1;
  DecayProblem problem(6, 3);
  const FitResult whole = Fit(options, &problem, {});
  ASSERT_EQ(whole.status, FitStatus::kConverged) << whole.message;
  std::vector<FitLog> interruptions;
  FitLog log;
  const auto keep = [&] { interruptions.push_back(log); };
  log.on_end = keep;
  log.search.OnIteration(keep);
  log.start.OnIteration(keep);
  options.threads = 3;
  EXPECT_EQ(HashOf(Fit(options, &problem, {}, &log)), HashOf(whole));
  ASSERT_GT(interruptions.size(), 10u);
  const FitProblem any = PendulumProblem();
  for (const FitLog& interrupted : interruptions) {
    FitCheckpoint written(InputOf(any), {});
    *written.Next() = interrupted;
    FitCheckpoint read(InputOf(any), [](const std::string&) { return ""; });
    ASSERT_EQ(read.Restore(written.Text(), "c.json"), "");
    ASSERT_EQ(HashOf(Fit(options, &problem, {}, read.Next())), HashOf(whole));
  }
}

TEST(FitCheckpointTest, TheCheckAtHalfTheStepGoesOnToo) {
  FitProblem problem = PendulumProblem();
  problem.options.starts = 1;
  RolloutResiduals residuals = ResidualsOf(problem);
  const FitResult fit = Fit(problem.options, &residuals, {});
  const DiscretisationCheck whole = CheckDiscretisation(InputOf(problem), {}, fit);
  ASSERT_EQ(whole.status, FitStatus::kConverged) << whole.message;
  std::vector<std::string> texts;
  FitCheckpoint checkpoint(InputOf(problem), [&](const std::string& text) {
    texts.push_back(text);
    return "";
  });
  CheckDiscretisation(InputOf(problem), {}, fit, checkpoint.Next());
  ASSERT_GT(texts.size(), 1u);
  for (const std::string& text : texts) {
    FitCheckpoint read(InputOf(problem), [](const std::string&) { return ""; });
    ASSERT_EQ(read.Restore(text, "c.json"), "");
    const DiscretisationCheck again = CheckDiscretisation(InputOf(problem), {}, fit, read.Next());
    EXPECT_EQ(again.estimate_half_step, whole.estimate_half_step);
    EXPECT_EQ(again.rollouts, whole.rollouts);
  }
}

TEST(FitCheckpointTest, AnotherFitsEvaluationsAreNoticed) {
  const FitProblem problem = PendulumProblem();
  FitLog log;
  FitLog kept;
  log.start.OnIteration([&] { kept = log; });
  RolloutResiduals residuals = ResidualsOf(problem);
  Fit(problem.options, &residuals, {}, &log);
  std::vector<Evaluation> evaluations = kept.start.evaluations();
  ASSERT_GT(evaluations.size(), 2u);
  evaluations[0].residuals *= 1.5;
  kept.start.Restore(evaluations);
  kept.search.Restore(kept.search.evaluations());
  int ends = 0;
  kept.on_end = [&] { ++ends; };
  RolloutResiduals again = ResidualsOf(problem);
  EXPECT_EQ(Fit(problem.options, &again, {}, &kept).status, FitStatus::kFailed);
  EXPECT_GT(kept.mismatch(), 1);
  EXPECT_EQ(ends, 0) << "nothing of it is written";
}

TEST(FitCheckpointTest, RefusesWhatIsDamagedOrOfAnotherFit) {
  const FitProblem problem = PendulumProblem();
  FitCheckpoint checkpoint(InputOf(problem), [](const std::string&) { return ""; });
  RolloutResiduals residuals = ResidualsOf(problem);
  Fit(problem.options, &residuals, {}, checkpoint.Next());
  const std::string text = checkpoint.Text();
  const auto refused = [&](const std::string& damaged, const FitProblem& of) {
    FitCheckpoint other(InputOf(of), {});
    return other.Restore(damaged, "c.json");
  };
  EXPECT_EQ(refused(text, problem), "");
  for (size_t length : {size_t{0}, text.size() / 3, text.size() / 2, text.size() - 3}) {
    EXPECT_NE(refused(text.substr(0, length), problem).find("c.json: "), std::string::npos);
  }
  std::string flipped = text;
  const size_t digit = text.find("residuals") + 20;
  flipped[digit] = static_cast<char>(text[digit] ^ 1);
  EXPECT_NE(refused(flipped, problem).find("c.json: "), std::string::npos);
  const std::string deep(1'000'000, '\x81');
  for (const std::string& other :
       {std::string("{}"), std::string("[]"), std::string(), std::string("\xff\xff"), deep}) {
    EXPECT_EQ(refused(other, problem).rfind("c.json: expected a \"tangible-fit checkpoint 7\"", 0),
              0U);
  }

  std::vector<FitProblem> others(7, problem);
  others[0].scene.bodies[0].mass = 0.51;
  others[1].parameters[0].initial = 0.81;
  others[2].parameters[1].lower = 0.001;
  others[3].observations[3].value += 1e-15;
  others[4].observations.pop_back();
  others[5].options.starts = 4;
  others[6].options.derivatives = GradientMethod::kAdjoint;
  for (const FitProblem& other : others) {
    const std::string error = refused(text, other);
    EXPECT_NE(error.find("c.json: /problem: a checkpoint of another fit"), std::string::npos)
        << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0);
  }
}

// A disk that is full after a while: the fit goes on, and says so in the end.
TEST(FitCheckpointTest, AFileThatCannotBeWrittenStopsNothing) {
  const FitProblem problem = PendulumProblem();
  int writes = 0;
  FitCheckpoint checkpoint(InputOf(problem), [&](const std::string&) {
    return ++writes < 3 ? std::string() : std::string("c.json: no space");
  });
  RolloutResiduals residuals = ResidualsOf(problem);
  EXPECT_EQ(Fit(problem.options, &residuals, {}, checkpoint.Next()).status, FitStatus::kConverged);
  EXPECT_EQ(checkpoint.error(), "c.json: no space");
  EXPECT_EQ(writes, 3);
}

}  // namespace
}  // namespace tangible
