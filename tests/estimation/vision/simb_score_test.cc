// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/simb_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tangible/estimation/vision/window_state.h"

namespace tangible {
namespace {

// A disc that flies, one that meets the right wall between the last two frames, and one at rest.
TEST(WindowStateTest, VelocitiesAreThoseAfterTheImpact) {
  WindowState reader(SimbWorld());
  const std::vector<double> seen = {10, 10, 52.0, 30, 20, 50,  //
                                    12, 11, 55.0, 32, 20, 50,  //
                                    14, 12, 58.0, 34, 20, 50,  //
                                    16, 13, 61.0, 36, 20, 50};
  std::vector<double> uniform = seen;
  const std::vector<double> state = reader(uniform, 4);
  const std::vector<double> expected = {16, 13, 2, 1, 61, 36, 3, 2, 20, 50, 0, 0};
  for (size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(state[k], expected[k], 1e-12) << k;
  // From 59.5 the wall at 61 turns it after half a frame.
  std::vector<double> bounced = seen;
  for (int k = 0; k < 3; ++k) bounced[6 * k + 2] += 1.5;
  bounced[6 * 3 + 2] = 59.5;
  const std::vector<double> after = reader(bounced, 4);
  EXPECT_NEAR(after[4], 59.5, 1e-9);
  EXPECT_NEAR(after[6], -3.0, 1e-9);
  EXPECT_NEAR(after[7], 2.0, 1e-9);
  // Met earlier: the last frames alone count.
  std::vector<double> earlier = seen;
  earlier[2] = 54.0;
  earlier[3] = 40.0;
  const std::vector<double> later = reader(earlier, 4);
  EXPECT_NEAR(later[6], 3.0, 1e-12);
  EXPECT_NEAR(later[7], 2.0, 1e-12);
}

// The right wall turns a disc between the second frame and the third, the upper wall after it.
TEST(WindowStateTest, TwoImpactsInTwoFramesAreFollowedByTheEngine) {
  WindowState reader(SimbWorld());
  std::vector<double> seen;
  for (const auto& [x, y] :
       std::vector<std::pair<double, double>>{{55.5, 10}, {58.5, 7}, {60.5, 4}, {57.5, 3}}) {
    seen.insert(seen.end(), {x, y, 30, 30, 20, 50});
  }
  const std::vector<double> state = reader(seen, 4);
  EXPECT_NEAR(state[2], -3.0, 1e-9);
  EXPECT_NEAR(state[3], 3.0, 1e-9);
  // Far from the upper wall the last two frames alone show the velocity.
  for (int k = 0; k < 4; ++k) seen[6 * k + 1] = 40.0 - 3.0 * k;
  seen[6 * 3] = 57.6;
  seen[6 * 3 + 1] = 30.9;
  const std::vector<double> later = reader(seen, 4);
  EXPECT_NEAR(later[2], -2.9, 1e-9);
  EXPECT_NEAR(later[3], -3.1, 1e-9);
}

// Discs turn 0.6 frames after the third one, when they overlap by 0.74 pixels: positions show the
// direction of the impulse, which an impact in time would not have.
TEST(WindowStateTest, TheImpulseOfTwoDiscsIsSeen) {
  WindowState reader(SimbWorld());
  const double dx = -3.1, dy = -1.0, share = -4.0 * dx / (dx * dx + dy * dy);
  const double jx = share * dx, jy = share * dy;  // of equal masses: exchanged normal speeds
  std::vector<double> seen;
  for (int k = 0; k < 3; ++k) seen.insert(seen.end(), {2.0 + 4.0 * k, 20, 15.5, 21, 40, 50});
  seen.insert(seen.end(),
              {12.4 + 0.4 * (4.0 + jx), 20 + 0.4 * jy, 15.5 - 0.4 * jx, 21 - 0.4 * jy, 40, 50});
  const std::vector<double> state = reader(seen, 4);
  EXPECT_NEAR(state[2], 4.0 + jx, 1e-9);
  EXPECT_NEAR(state[3], jy, 1e-9);
  EXPECT_NEAR(state[6], -jx, 1e-9);
  EXPECT_NEAR(state[7], -jy, 1e-9);
  // Far apart the same positions are those of two impacts on something else.
  for (int k = 0; k < 4; ++k) seen[6 * k + 3] += 20.0;
  EXPECT_GT(std::abs(reader(seen, 4)[7] + jy), 0.1);
}

const DiscData& Data() {
  static const DiscData data =
      MakeDiscData({.kind = DiscKind::kSimb, .sequences = 40, .frames = 60, .seed = 2});
  return data;
}

// Exact events are not the benchmark's substeps, so that even the true state has an error; seen
// positions add to it, and the baselines are far off.
TEST(SimbScoreTest, TheEngineIsBestAndLosesLittleByNoise) {
  const DiscData& data = Data();
  const SimbScore truth = ScoreSimbFromTruth(data, 2);
  EXPECT_EQ(truth.windows, 40 * 17);
  EXPECT_EQ(truth.unsolved, 0);
  EXPECT_GT(truth.near.mean, 0.1);
  EXPECT_LT(truth.near.median, truth.near.mean);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<double> positions;
  for (int s = 0; s < data.num_sequences(); ++s) {
    for (int k = 0; k < data.frames; ++k) {
      for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < 2; ++c)
          positions.push_back(data.State(s, k)[4 * i + c] + noise(random));
      }
    }
  }
  const SeenPositions seen = [&](int sequence, int frame) {
    return positions.data() + 6 * (static_cast<std::ptrdiff_t>(sequence) * data.frames + frame);
  };
  const SimbScore noisy = ScoreSimb(data, SimbPredictor::kEngine, seen, 2);
  const SimbScore one_thread = ScoreSimb(data, SimbPredictor::kEngine, seen, 1);
  EXPECT_EQ(noisy.near.mean, one_thread.near.mean);
  EXPECT_LT(noisy.near.mean, truth.near.mean + 0.6);
  EXPECT_LT(noisy.far.mean, truth.far.mean + 8.0);
  const SimbScore straight = ScoreSimb(data, SimbPredictor::kConstantVelocity, seen, 2);
  const SimbScore still = ScoreSimb(data, SimbPredictor::kLastFrame, seen, 2);
  EXPECT_GT(straight.near.mean, 10.0 * noisy.near.mean);
  EXPECT_GT(still.near.mean, 10.0 * noisy.near.mean);
  EXPECT_GT(straight.far.mean, straight.near.mean);
}

}  // namespace
}  // namespace tangible
