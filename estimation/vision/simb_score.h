// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The benchmark's measure for predictions of SimB, over every window of 4 seen frames and the 40
// frames that follow:
//
//   error(frame) = mean over discs of ((x̂ − x)² + (ŷ − y)²) / 64²
//   near         = 1000 mean of error over the last seen frame and the T = 20 after it
//   far          = 1000 mean of error over the 20 after those
//
// with predictions x̂, ŷ clamped to the picture.

#include <functional>
#include <vector>

#include "tangible/estimation/vision/disc_data.h"

namespace tangible {

inline constexpr int kSimbSeen = 4;
inline constexpr int kSimbHorizon = 20;

/// The mean over all windows, and the quartiles of the means of sequences.
struct ScoreSummary {
  double mean = 0.0, lower_quartile = 0.0, median = 0.0, upper_quartile = 0.0;
};

struct SimbScore {
  ScoreSummary near, far;
  long windows = 0;
  long unsolved = 0;  ///< windows that the engine could not run: the last seen positions stand
};

enum class SimbPredictor { kEngine, kConstantVelocity, kLastFrame };

/// Gives the positions of all discs, (n, 2), in a frame of a sequence, estimated or true.
using SeenPositions = std::function<const double*(int sequence, int frame)>;

/// Scores predictions from the positions that `seen` gives in 4 frames: by the engine from the
/// state of window_state.h, or as the baselines.
SimbScore ScoreSimb(const DiscData& data, SimbPredictor predictor, const SeenPositions& seen,
                    int threads);

/// The score of the engine from the true state at the last seen frame, which is the floor.
SimbScore ScoreSimbFromTruth(const DiscData& data, int threads);

}  // namespace tangible
