// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The engine's model of cart and pole: a scene of two bodies, a slider and a hinge. Its masses,
// length and frictions are estimated from a recording, and plans are made over its steps. The
// structure is known, and the parameters are learned.

#include <optional>
#include <string>
#include <vector>

#include "tangible/control/engine_step.h"
#include "tangible/estimation/experiments/cartpole/cart_pole.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// The scene, with the pole upright at rest; the force on the cart is the effort of the joint
/// "rail".
Scene CartPoleScene(const CartPole& numbers);

/// The state of the scene's bodies.
void SetCartPoleState(const CartPole& numbers, const CartPoleState& x, State<double>* state);

/// The engine's step in joint coordinates: states as CartPoleState, the force as the control.
class CartPoleStep : public StepMap {
 public:
  explicit CartPoleStep(const CartPole& numbers);

  int num_states() const override { return 4; }
  int num_controls() const override { return 1; }
  bool Step(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
            std::string* error) override;
  bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u, VectorX<double>* next,
                 MatrixX<double>* a, MatrixX<double>* b, std::string* error) override;

 private:
  double arm_;  // from the hinge to the pole's centre, m
  RolloutFunction function_;
  std::optional<EngineStep> engine_;
  VectorX<double> next_;
  MatrixX<double> a_, b_;
};

/// The measurements of a plant under known forces: sample k is at the time k kCartPoleStep.
struct CartPoleRecording {
  std::vector<double> forces;        ///< N, held from sample k to k + 1
  RowMatrixXd positions;             ///< x (m), φ (rad) with noise: samples x 2
  std::vector<CartPoleState> truth;  ///< the same without noise

  int samples() const { return static_cast<int>(positions.rows()); }
  /// The first samples of the recording.
  CartPoleRecording Head(int samples) const;
};

inline constexpr double kPositionNoise = 0.001;  ///< m
inline constexpr double kAngleNoise = 0.002;     ///< rad

/// Records the plant, which hangs at rest at first, under uniformly random forces that are held for
/// 0.1 s each, without interruption.
CartPoleRecording RecordRandomly(CartPolePlant* plant, int samples, unsigned seed);

struct CartPoleEstimate {
  CartPole numbers;
  std::vector<std::string> names;  ///< of the five numbers
  FitResult fit;
  bool ok = false;
};

/// Fits masses, length, frictions and the state at the start, from wrong initial values: masses 1
/// kg, length 1 m, dampings 0.02.
CartPoleEstimate EstimateCartPole(const CartPoleRecording& recording);

/// The five parameters in the order of the estimate.
std::vector<double> NumbersOf(const CartPole& numbers);

}  // namespace tangible
