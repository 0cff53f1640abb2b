// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_run.h"

#include <gtest/gtest.h>

#include "../support/sliding_box.h"
#include "tangible/verification/gradients/verify_json.h"
#include "tangible/verification/gradients/verify_text.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

VerifyJob BoxJob() {
  VerifyJob job;
  job.scene = SlidingBox("0.3");
  job.scene.path = "box.json";
  job.parameters = AllParameters(job.scene);
  return job;
}

TEST(VerifyRunTest, RandomJobsAreSeedsInEachStepping) {
  const std::vector<VerifyJob> jobs =
      RandomJobs(RandomList::kScenes, 5, 2, {Stepping::kFixed, Stepping::kEvent});
  ASSERT_EQ(jobs.size(), 4u);
  EXPECT_EQ(*jobs[0].seed, 5u);
  EXPECT_EQ(jobs[1].stepping, Stepping::kEvent);
  EXPECT_EQ(*jobs[3].seed, 6u);
  EXPECT_EQ(SceneOf(jobs[1]).simulation.stepping, Stepping::kEvent);
}

TEST(VerifyRunTest, StartsAreAListOfTheirOwn) {
  const std::vector<VerifyJob> jobs = RandomJobs(RandomList::kStarts, 3, 2, {Stepping::kEvent});
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(SceneOf(jobs[1]).name, "start 4");
  const VerifyResult result = RunVerification(jobs, 1, KeepJacobians::kNo, {});
  EXPECT_EQ(result.not_run, 0);
  EXPECT_EQ(result.exceptions_unexplained, 0);
  EXPECT_EQ(result.scenes[1].replay, "tangible-verify --starts=1 --seed=4 --stepping=event");
}

TEST(VerifyRunTest, ParametersAreAllNumbersOrAChoiceThatTheSeedMakes) {
  const Scene scene = RandomScene(8);
  const std::vector<ParameterPath> all = AllParameters(scene);
  const std::vector<ParameterPath> some = RandomParameters(scene, 8);
  EXPECT_GT(all.size(), 26u);
  ASSERT_EQ(some.size(), 26u);
  EXPECT_EQ(some[24].path, "bodies/*/mass");
  EXPECT_GT(some[25].numbers.size(), 1u);
  const std::vector<ParameterPath> again = RandomParameters(scene, 8);
  for (size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].path, again[i].path);
}

TEST(VerifyRunTest, ThreadsDoNotChangeABit) {
  std::vector<VerifyJob> jobs = RandomJobs(RandomList::kScenes, 20, 6, {Stepping::kFixed});
  jobs.push_back(BoxJob());
  long last = 0;
  const VerifyResult one = RunVerification(jobs, 1, KeepJacobians::kYes, {});
  const VerifyResult three =
      RunVerification(jobs, 3, KeepJacobians::kYes, [&](long done) { last = done; });
  EXPECT_EQ(last, 7);
  EXPECT_EQ(JsonText(ToJson(one)), JsonText(ToJson(three)));
  EXPECT_EQ(TableText(one), TableText(three));
}

TEST(VerifyRunTest, ScenesAreSummedUp) {
  const std::vector<VerifyJob> jobs = {BoxJob(), BoxJob()};
  const VerifyResult result = RunVerification(jobs, 1, KeepJacobians::kNo, {});
  ASSERT_EQ(result.scenes.size(), 2u);
  EXPECT_EQ(result.scenes[0].replay, "tangible-verify box.json");
  EXPECT_EQ(result.total.entries, 2 * result.scenes[0].total.entries);
  EXPECT_EQ(result.total.parameters, static_cast<int>(2 * jobs[0].parameters.size()));
  EXPECT_EQ(result.kinds.size(), result.scenes[0].rows.size());
  EXPECT_EQ(result.coverage.at("friction sliding"), 2);
  EXPECT_EQ(result.worst.size(), static_cast<size_t>(kMostWorst));
  for (const auto& [scene, entry] : result.worst) {
    EXPECT_EQ(result.worst_scenes.count(scene), 1u);
  }
  EXPECT_EQ(BrokenBound(jobs, result), "");
}

TEST(VerifyRunTest, WhatIsBrokenIsOneLineWithTheCommandThatShowsIt) {
  std::vector<VerifyJob> jobs = RandomJobs(RandomList::kScenes, 3, 100, {Stepping::kFixed});
  VerifyResult result;
  result.scenes.resize(jobs.size());
  for (SceneCheck& scene : result.scenes) scene.done = true;
  EXPECT_EQ(BrokenBound(jobs, result), "");
  CheckedException exception;
  exception.parameter = "bodies/a/mass";
  exception.what = "a/x: 1 against 2";
  exception.named = "near a kink";
  result.scenes[4].exceptions.push_back(exception);
  EXPECT_EQ(BrokenBound(jobs, result), "");
  exception.named = "";
  exception.other_solution = true;
  result.scenes[4].exceptions.push_back(exception);
  EXPECT_EQ(BrokenBound(jobs, result), "");
  exception.other_solution = false;
  result.scenes[5].name = "random 8";
  result.scenes[5].replay = "tangible-verify --random=1 --seed=8";
  result.scenes[5].exceptions.push_back(exception);
  const std::string line = BrokenBound(jobs, result);
  for (const char* part : {"random 8", "bodies/a/mass", "a/x: 1 against 2", "--seed=8"}) {
    EXPECT_NE(line.find(part), std::string::npos) << line;
  }
  EXPECT_EQ(line.find('\n'), std::string::npos);
  result.scenes[5].exceptions.clear();
  for (int i = 0; i < 3; ++i) result.scenes[i].done = false;
  EXPECT_EQ(BrokenBound(jobs, result), "");  // 3 % of 100
  result.scenes[3].done = false;
  EXPECT_NE(BrokenBound(jobs, result).find("4 of 100"), std::string::npos);
}

TEST(VerifyRunTest, ASceneOfTheUserThatDoesNotRunIsBroken) {
  VerifyJob job;
  job.scene = PressedBox();
  job.parameters = AllParameters(job.scene);
  const VerifyResult result = RunVerification({job}, 1, KeepJacobians::kNo, {});
  EXPECT_EQ(result.not_run, 1);
  EXPECT_NE(BrokenBound({job}, result).find("press.json"), std::string::npos);
}

}  // namespace
}  // namespace tangible
