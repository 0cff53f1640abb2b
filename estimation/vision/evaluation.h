// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Measures the predictions of a trained model on sequences that it was not trained on.

#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/vision/training.h"

namespace tangible {

/// The predictor: the trained dynamics from the estimated state; the estimated state with constant
/// velocities, or at rest; or the engine with the true parameters from the true state.
enum class Predictor { kModel, kConstantVelocity, kLastFrame, kTruth };
/// "model", "constant velocity", "last frame", "true state".
const char* NameOf(Predictor predictor);

/// By frames ahead, 1 to F.
struct HorizonErrors {
  std::vector<double> position;  ///< mean over windows and discs of (Δx² + Δy²), pixels²
  std::vector<double> position_median;  ///< median over windows
  std::vector<double> picture;          ///< mean square of a value of the decoded picture
  long windows = 0;
  long unsolved = 0;  ///< windows that the engine could not run; the last state stands
};

/// Windows begin at each `stride`-th frame.
HorizonErrors Evaluate(Trainer* trainer, const DiscData& data, Predictor predictor, int stride);

/// The positions that the encoder estimates in all frames: (sequences, frames, n, 2).
std::vector<double> SeePositions(Trainer* trainer, const DiscData& data,
                                 const std::function<void(int sequence)>& progress = {});

/// The root mean square error of these positions over all coordinates.
double SeenError(const std::vector<double>& seen, const DiscData& data);

/// Pictures of one window: those of the data (seen and ahead), and those decoded from the
/// prediction, as bytes in three planes.
struct PictureRows {
  std::vector<std::string> truth, predicted;
};
PictureRows DecodeWindow(Trainer* trainer, const DiscData& data, int sequence);

}  // namespace tangible
