// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A model of cart and pole whose only mechanical prior is that speeds change positions: perceptrons
// map (sin φ, cos φ, v, ω, u) to the change of (x, φ, v, ω) over a step beyond that at constant
// speeds. Inputs and outputs are scaled by their standard deviations in the recording. Speeds,
// which are not measured, are the slopes of quadratic polynomials that are fitted to the positions
// around each sample (Savitzky, Golay 1964). The prediction of an ensemble is the mean of those of
// its members, which are trained on bootstrap samples.

#include <string>
#include <vector>

#include "tangible/control/step_map.h"
#include "tangible/estimation/experiments/cartpole/cart_pole_model.h"
#include "tangible/estimation/experiments/cartpole/perceptron.h"

namespace tangible {

struct LearnedStepOptions {
  PerceptronOptions perceptron;
  int members = 1;      ///< of the ensemble
  int half_window = 2;  ///< samples on each side for the slopes, >= 1
};

class LearnedStep : public StepMap {
 public:
  /// Trains on all samples of the recording except those at its ends.
  LearnedStep(const CartPoleRecording& recording, const LearnedStepOptions& options);

  int num_states() const override { return 4; }
  int num_controls() const override { return 1; }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override;
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override;

 private:
  std::vector<Perceptron> members_;
  Eigen::VectorXd mean_, scale_, target_mean_, target_scale_;
};

/// States with smoothed positions and slopes; NaN where the window leaves the recording.
RowMatrixXd SmoothedStates(const CartPoleRecording& recording, int half_window);

/// The width, depth, rate of Adam and window with the best predictions on the last fifth of the
/// recording after training on the rest: ten steps ahead from smoothed states, compared with
/// observed positions in multiples of their noise. `tried` gets the number of candidates.
LearnedStepOptions TuneLearnedStep(const CartPoleRecording& recording, int updates, int* tried);

}  // namespace tangible
