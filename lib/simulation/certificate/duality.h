// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The test of a rollout's derivative J by its two sweeps: for output i, an entry of the final
// state, and direction d
//
//   a = (eᵢᵀ J) d  by the adjoint,   b = eᵢᵀ (J d)  by the tangent
//
// Both use the same factorisations, but sum in opposite order: their difference shows the rounding
// error of the derivative, however small each residual is. The difference of an entry is relative
// to the entry and to the rounding of the state, which does not depend on the parameter:
//
//   gap = |a − b| / (|b| + 1e-4 S)                                                    (1)
//
// S, per unit of the parameter, in m or m/s, at the radius of gyration for an angle:
// the largest change of a pose (of a twist) of any body that the direction causes during the run,
// or, if that is more, the largest coordinate (speed) of any body during the run, over the
// parameter's size. The speed of the free motion counts too: the speed that gravity or a motor
// would add in a step to a body at rest and that contacts or supports cancel.
//
// So gap ≤ 1e-10 means |a − b| ≤ 1e-10 |b| + 1e-14 S: for a change of the parameter by its whole
// size the second term is 1e-14 of the output. The magnitudes of an adjoint's terms, |w̄|ᵀ |d|, are
// not part of S: where they cancel (a chain that is turned as a whole, a heavy load) the adjoint
// loses digits that the tangent keeps.
//
// Up to kMostDualityColumns outputs have a column of the adjoint each. If there are more, up to
// half of the columns belong to single outputs that have an entry of rounding size; the other
// outputs share the remaining columns in groups whose |b| + 1e-4 S are similar along every
// direction, with weights 1 / (|b| + 1e-4 S) and alternating signs. The denominator of (1) is then
// the root of the sum of squares.

#include <memory>

#include "tangible/simulation/derivatives/rollout_adjoint.h"

namespace tangible {

namespace internal {
class RunExtents;
}

inline constexpr int kMostDualityColumns = 64;

/// A run with its tangent along directions (num_variables x columns) and its tape.
class DualityTest {
 public:
  DualityTest(const Model<double>& model, const State<double>& initial,
              const RowMatrixXd& directions);
  ~DualityTest();
  /// How far the directions contradict redundant rows, up to where the run ends or fails
  /// (StepTangent::ApplyAndMeasure).
  double contradiction() const { return contradiction_; }
  /// The largest gap (1), at most 1, over outputs and directions; `sizes`: how large each
  /// direction's parameter is, > 0, in its own unit; empty: 1 each. Infinite where the run fails or
  /// a derivative is not finite; 0 without directions. Cost: an adjoint of up to
  /// kMostDualityColumns columns.
  double Gap(const std::vector<double>& sizes = {});

 private:
  const Model<double>& model_;
  const RowMatrixXd& directions_;
  RowMatrixXd w_dot_;
  std::unique_ptr<internal::RunExtents> extents_;
  RolloutTape tape_;
  StepStatus status_ = StepStatus::kDone;
  double contradiction_ = 0.0;
};

/// DualityTest::Gap of a run.
double DualityGap(const Model<double>& model, const State<double>& initial,
                  const RowMatrixXd& directions, const std::vector<double>& sizes = {});

/// Whether a model's masses (or inertias) differ by a factor of 1e3, so that the test is worth its
/// time.
bool HasWideMasses(const Model<double>& model);

}  // namespace tangible
