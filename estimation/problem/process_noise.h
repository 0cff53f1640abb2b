// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Error of the model as a part of the model: random forces on bodies or in joints, which a fit
// finds together with the parameters.
//
//   minimise over p and ε   1/2 Σ ρ(r_i²) + 1/2 ‖ε‖²      F = F(ε) by (1) of noise_sweep.h
//
// A force acts along x or y at a body's centre of mass, is a torque on the body, or an effort of a
// joint; it is constant between knots, which are steps at equal distances: the median distance in
// time of the observations, and not more than the correlation time. At given p the forces are found
// by Gauss-Newton: a run and its tangent in pieces from knot to knot, a sweep from the end to the
// start (noise_sweep.h), and a run in which each force answers to where the state then is,
//
//   ε_k = ε̄_k + α (step of least cost) + (gain) (x_k − x̄_k)
//
// so that the run does not drift from the last one where the motion is chaotic, and has no jumps.
// Time and memory are linear in the number of knots. A fit sees the residuals at these forces, and
// ε as further rows; their derivatives are those of the least cost,
//
//   dr/dp = ∂r/∂p + ∂r/∂ε dε/dp                                                              (1)
//
// so that Jᵀ J is the Schur complement of the whole problem's, and Jᵀ r the gradient of the least
// cost. Forces begin at those of the last evaluation with derivatives, and are found up to
// kSmoothedForces; evaluations of equal bits need an equal history, which does not depend on
// threads.
//
// The p of least cost is the mode of parameters and forces together, which favours a p by which
// forces move the system more: a damping that is too small, the more so the longer it is observed.
// With the forces integrated out by (5) of noise_sweep.h the cost of p is higher by D(p) =
// Σ_k ln |det E_k|. A fit takes its slope into account as one more row (fit/noise_slope.h),
//
//   r = √(2 (c + ∇D·(p − p_0))),   r²/2 = D(p) + constant to first order                       (2)
//
// where c is so large that r is nearly linear, and the row adds no curvature.
//
// References: Y. Trémolet, Q. J. R. Meteorol. Soc. 132 (2006) 2483 (weak constraints); G. H. Golub
// and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413 (variable projection); W. Li and E. Todorov,
// ICINCO (2004) 222 (runs with gains).

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/estimation/problem/noise_sweep.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/stepping/controlled_model.h"

namespace tangible {

class RolloutResiduals;

enum class NoiseCoordinate { kX, kY, kAngle, kDisplacement };

/// "x", "y", "angle", "displacement".
const char* NameOf(NoiseCoordinate coordinate);

/// A random force as the user writes it.
struct NoiseTerm {
  std::string body;   ///< a moving body, or
  std::string joint;  ///< a hinge (angle) or slider (displacement)
  NoiseCoordinate coordinate = NoiseCoordinate::kX;
  /// White: N √s or N m √s; with a correlation time the standard deviation, N or N m. None: it is
  /// estimated.
  std::optional<double> intensity;
  double correlation_time = 0.0;  ///< s; 0: white

  bool IsTorque() const { return coordinate == NoiseCoordinate::kAngle; }
};

/// "body 'ball' x".
std::string NameOf(const NoiseTerm& term);

/// What is wrong with one of the terms.
struct NoiseFault {
  int term = 0;
  std::string key;  ///< of the term
  std::string what;
};
std::optional<NoiseFault> CheckNoise(const std::vector<NoiseTerm>& terms, const Scene& scene);

/// Empty, or why a run whose scene is WithNoiseForces can have no random forces.
std::string WhyNoNoise(const RolloutResiduals& run);

/// The scene with forces, of 0, that the terms drive; they come after the scene's own.
Scene WithNoiseForces(const std::vector<NoiseTerm>& terms, const Scene& scene);

/// What smoothing found, at one point p.
struct NoisePath {
  Eigen::VectorXd p;
  RowMatrixXd states;   ///< knots (one more than intervals) x n, as OutputVariables orders them
  RowMatrixXd forces;   ///< intervals x m
  RowMatrixXd u;        ///< forces in units of their size
  RowMatrixXd epsilon;  ///< innovations
  Eigen::VectorXd residuals;
  double cost = 0.0;
};

/// c of (2).
inline constexpr double kSlopeOffset = 1e4;

/// Forces that act in a run as they were found in another one of the same scene; after its end
/// there are none.
struct FollowedForces {
  std::vector<int> numbers;   ///< of the model
  std::vector<double> times;  ///< s, of the knots
  RowMatrixXd forces;         ///< intervals x numbers

  Controls In(const Model<double>& model) const;
};

class ProcessNoise {
 public:
  /// Of a run whose scene is WithNoiseForces. The terms are right.
  ProcessNoise(std::vector<NoiseTerm> terms, const RolloutResiduals& run);

  const std::vector<NoiseTerm>& terms() const { return terms_; }
  int num_terms() const { return static_cast<int>(terms_.size()); }
  int num_intervals() const { return static_cast<int>(knots_.size()) - 1; }
  int num_rows() const { return num_terms() * num_intervals(); }
  /// Steps 0 = first < ... < last.
  const std::vector<long>& knots() const { return knots_; }
  std::vector<double> KnotTimes(const RolloutResiduals& run) const;

  const Eigen::VectorXd& intensities() const { return intensities_; }
  void SetIntensities(const Eigen::VectorXd& intensities);
  /// Forgets earlier evaluations and the slope, so that the next begins without forces.
  void Forget() {
    now_.valid = false;
    kept_.valid = false;
    slope_.resize(0);
  }
  /// Adds the row (2); `slope` is ∇D at p_0 = `at`.
  void SetSlope(const Eigen::VectorXd& at, const Eigen::VectorXd& slope) {
    slope_at_ = at;
    slope_ = slope;
  }
  /// Empty: there is no such row.
  const Eigen::VectorXd& slope() const { return slope_; }
  int num_slope_rows() const { return slope_.size() > 0 ? 1 : 0; }
  /// D at the point of the last evaluation, with the weights of a robust loss that is linearised.
  double LogDeterminant() const;
  /// Huber's bound of the cost that is minimised; 0: plain squares.
  void SetHuber(double huber);

  /// Residuals of the observations, then ε interval by interval and (2); `jacobian` may be null.
  /// False where no run is possible: `message`.
  bool Evaluate(const Eigen::VectorXd& p, RolloutResiduals* run, Eigen::VectorXd* residuals,
                RowMatrixXd* jacobian, std::string* message);

  long rollouts() const { return rollouts_; }

  /// The run at the point of the last evaluation, its linearisation and sweep.
  const NoisePath& path() const { return now_.path; }
  const std::vector<NoiseInterval>& intervals() const { return now_.intervals; }
  const NoiseSweep& sweep() const { return now_.sweep; }
  const RowMatrixXd& start() const { return now_.start; }
  FollowedForces Found(const RolloutResiduals& run) const;
  /// The linearisation of the last evaluation as it would be with other intensities.
  std::vector<NoiseInterval> WithIntensities(const Eigen::VectorXd& intensities) const;
  /// The cost of the forces and observations at this path.
  double Cost(const NoisePath& path) const;

 private:
  /// A run with its linearisation, and the sweep that goes to the least cost.
  struct Smoothed {
    NoisePath path;
    std::vector<NoiseInterval> intervals;
    RowMatrixXd start;
    NoiseSweep sweep;
    Eigen::VectorXd rows;  ///< of Evaluate
    bool valid = false;
  };
  class Runner;
  enum class Weights { kReweighted, kCurved };

  void MakeKnots(const RolloutResiduals& run);
  void FindNumbers(const RolloutResiduals& run);
  void SetScale(const Eigen::VectorXd& intensities, std::vector<NoiseInterval>* intervals) const;
  void SetWeights(Weights weights, std::vector<NoiseInterval>* intervals) const;
  void Sweep(Weights weights, Smoothed* smoothed) const;
  bool Run(const Eigen::VectorXd& p, const Smoothed* from, double step, RolloutResiduals* run,
           Smoothed* to, std::string* message);
  bool Begin(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed,
             std::string* message);
  void Smooth(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed);
  bool Improve(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed);

  std::vector<NoiseTerm> terms_;
  Eigen::VectorXd intensities_;
  Eigen::VectorXd slope_at_, slope_;
  double huber_ = 0.0;
  std::vector<long> knots_;
  std::vector<double> lengths_;  ///< s, of the intervals
  std::vector<int> variables_;   ///< of a state
  std::vector<int> numbers_;     ///< of the model
  std::vector<int> term_of_number_;
  std::vector<double> sign_of_number_;
  long rollouts_ = 0;
  Smoothed now_;   ///< of the last evaluation
  Smoothed kept_;  ///< of the last with derivatives, from which others begin
};

}  // namespace tangible
