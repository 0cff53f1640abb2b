// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/control/bounce_study.h"

#include <gtest/gtest.h>

#include "tangible/scene/scene_json.h"

namespace tangible::bounce {
namespace {

class BounceStudyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string error;
    ASSERT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json", &scene_, &error))
        << error;
  }
  Scene scene_;
};

TEST_F(BounceStudyTest, ProblemsAreThoseOfTheirSeed) {
  const Problem a = Draw(scene_, 1, 5), b = Draw(scene_, 1, 5), c = Draw(scene_, 1, 6);
  EXPECT_EQ(a.effort, b.effort);
  EXPECT_EQ(a.cup, b.cup);
  EXPECT_NE(a.effort, c.effort);
  EXPECT_NE(a.cup, c.cup);
  // Where the ball is only if it was struck.
  EXPECT_GT(a.cup.x(), 0.9);
}

// A plan of event steps is played as it was made; one of fixed steps believes in another motion.
TEST_F(BounceStudyTest, FixedStepsBelieveInAnotherMotion) {
  const Problem problem = Draw(scene_, 1, 0);
  const Outcome exact = Solve(problem, Method::kExact, 10);
  EXPECT_NEAR(exact.distance, exact.believed, 1e-9);
  EXPECT_GT(exact.iterations, 0);
  const Outcome fixed = Solve(problem, Method::kFixed, 10);
  EXPECT_GT(std::abs(fixed.distance - fixed.believed), 1e-3);
}

TEST_F(BounceStudyTest, ResultsDoNotDependOnThreads) {
  StudyOptions options{.seed = 2, .problems = 2, .iterations = 3, .threads = 1};
  const std::vector<Row> one = bounce::Run(scene_, options, {});
  options.threads = 2;
  const std::vector<Row> two = bounce::Run(scene_, options, {});
  for (int i = 0; i < 2; ++i) {
    for (size_t method = 0; method < std::size(kMethods); ++method) {
      EXPECT_EQ(one[i].outcomes[method].distance, two[i].outcomes[method].distance);
    }
    EXPECT_EQ(one[i].fixed, two[i].fixed);
  }
}

}  // namespace
}  // namespace tangible::bounce
