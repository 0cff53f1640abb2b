// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The intensities of random forces (process_noise.h), estimated beside the parameters, and what a
// fit with them says.
//
// The intensities s are the mode of the restricted likelihood of the problem linearised at the
// estimate, with all forces and parameters integrated out, by (5) of noise_sweep.h and the factor F
// of what is left of all recordings and priors over the free parameters:
//
//   −ln L(s) = least cost + Σ ln |det E_k| + ln |det F|                                     (1)
//   −∂ ln L / ∂ ln s_i = Σ_k (1 − E[ε_ik²])         E: given the observations               (2)
//
// (2) is exact, because s_i does nothing but scale. Newton's method in ln s, with differences of
// (2), alternates with fits until no intensity changes by more than 1e-3 of its deviation
// (variance_components.h). The deviation of ln s is that of the curvature, and the interval of s is
// symmetric in ln s. Where the observations show no such force, ln L has no mode: the intensity
// falls until it has no effect, and has no interval.
//
// Reference: H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445; R. H. Shumway and D. S.
// Stoffer, J. Time Series Analysis 3 (1982) 253 (the expectations).

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/problem/process_noise.h"
#include "tangible/estimation/uncertainty/uncertainty.h"

namespace tangible {

struct NoiseIntensity {
  NoiseTerm term;
  double intensity = 0.0;
  bool estimated = false;
  ConfidenceInterval interval;  ///< 95 %; none where it was given, or no such force is seen
  bool seen = true;
};

/// Forces and states over time, given all observations.
struct SmoothedRun {
  std::string recording;      ///< its name
  std::vector<double> times;  ///< s, of the knots
  RowMatrixXd forces;         ///< one row less than knots x terms: from each knot to the next
  RowMatrixXd force_deviations;
  RowMatrixXd coordinates, rates;  ///< of the forces, at the starts of their intervals
  std::vector<std::string> names;  ///< of the numbers of a state: "ball/x", ...
  RowMatrixXd states;              ///< knots x numbers
  RowMatrixXd state_deviations;
};

/// The problem linearised at an estimate, as a function of the intensities.
class NoiseLikelihood {
 public:
  /// Whether the parameters are integrated out too, or held where they are.
  enum class Parameters { kFree, kHeld };
  /// Evaluates the problem at the estimate; false with a message where that fails, or there are
  /// more than kMostNoiseParameters parameters.
  bool Create(const FitOptions& options, const Eigen::VectorXd& estimate, Parameters parameters,
              RecordingsProblem* problem, std::string* message);

  /// (1), without constants, and (2).
  struct Value {
    double minus_log = 0.0;
    Eigen::VectorXd score;
  };
  Value At(const Eigen::VectorXd& intensities) const;
  /// Of each recording.
  std::vector<NoiseMoments> MomentsAt(const Eigen::VectorXd& intensities) const;
  /// Σ_k 1 of each force.
  double num_intervals() const { return num_intervals_; }

 private:
  struct Whole;
  Whole SweepAll(const Eigen::VectorXd& intensities) const;
  double Eliminate(const Eigen::MatrixXd& stacked, Whole* whole) const;

  RecordingsProblem* problem_ = nullptr;
  int threads_ = 0;
  std::vector<std::vector<int>> columns_;  ///< of each recording's parameter, that of F, or −1
  RowMatrixXd priors_;                     ///< rows x [free parameters | 1]
  double constant_ = 0.0;                  ///< of the rows of slopes, which the cost has not
  int num_free_ = 0;
  double num_intervals_ = 0.0;
};

/// Of more parameters the intensities are not estimated: F is a dense matrix.
inline constexpr int kMostNoiseParameters = 1000;

/// The random forces of a problem; empty where there are none.
std::vector<NoiseIntensity> IntensitiesOf(const RecordingsProblem& problem);

/// Forgets earlier evaluations, and sets the intensities that are to be estimated to where the
/// search begins: a force as large as would accelerate a body by 10 m/s² or 100 rad/s², which
/// follows any observations.
void BeginIntensities(RecordingsProblem* problem);
/// Lets them become those of the largest likelihood at the initial parameters, held, from where few
/// fits are needed. Nothing is done where no run is possible there.
void SettleIntensities(const FitOptions& options, RecordingsProblem* problem,
                       std::vector<NoiseIntensity>* intensities);

/// Sets those that are to be estimated to next to none: the model has to explain all.
void BeginWithoutForces(RecordingsProblem* problem);
void SetIntensities(const std::vector<NoiseIntensity>& intensities, RecordingsProblem* problem);

/// Finds the intensities that are to be estimated at the result of a fit, and sets them in
/// `problem`. `largest` is raised to the largest change in multiples of its deviation; `minus_log`
/// becomes (1), unless it is null. False, with a message, where that is not possible.
bool UpdateIntensities(const FitOptions& options, const FitResult& result,
                       RecordingsProblem* problem, std::vector<NoiseIntensity>* intensities,
                       double* largest, std::string* message, double* minus_log = nullptr);

/// Forces and states at an estimate; empty, with a message, where that is not possible.
std::vector<SmoothedRun> SmoothedRuns(const FitOptions& options, const Eigen::VectorXd& estimate,
                                      RecordingsProblem* problem, std::string* message);

}  // namespace tangible
