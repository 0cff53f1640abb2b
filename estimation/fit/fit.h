// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The fit: parameters that minimise the sum of squared residuals (residual.h) within their bounds,
//
//   cost(p) = 1/2 Σ ρ(r_i(p)²),     ρ(s) = s, or Huber's 2 b sqrt(s) − b² where |r| > b
//
// of a problem in blocks (least_squares.h), by Levenberg-Marquardt on q(p) (parameter_entry.h,
// minimise.h). Blocks are evaluated on several threads, and the result has the same bits for any
// number of threads. Final Gauss-Newton steps improve the estimate until it no longer depends on
// the start, because the cost is constant to rounding while p still has few exact digits. With
// Huber's loss, plain squares lead to the neighbourhood of the minimum and Newton's method to the
// minimum. A parameter whose derivative is 0 at the initial values is moved inwards first. Where an
// evaluation fails, Ceres takes a shorter step.

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/evaluation_log.h"
#include "tangible/estimation/problem/recordings.h"
#include "tangible/estimation/problem/residual.h"
#include "tangible/estimation/uncertainty/held_parameters.h"
#include "tangible/estimation/uncertainty/uncertainty.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {

/// The method that leads a start to the minimum where minimising the whole run at once does not.
enum class FitApproach {
  kAuto,      ///< growing windows, where the plain fit does not explain the observations or makes
              ///< no progress at first
  kPlain,     ///< nothing
  kWindows,   ///< growing windows (windows.h)
  kSegments,  ///< multiple shooting (shooting.h), with FitOptions::segments
  kTrial,     ///< of kAuto: kPlain, which gives up where its first iterations show no progress
};

/// "auto", "plain", "windows", "segments".
const char* NameOf(FitApproach approach);

/// Whether profiles (profile.h) are made that nobody asks for, of parameters whose intervals by
/// derivatives may be wrong.
enum class ProfilePass { kWhereNeeded, kSkip };

/// Whether it is asked what would explain the residuals (missing.h), by what calls the fit.
enum class MissingPass { kRun, kSkip };

struct FitOptions {
  GradientMethod derivatives = GradientMethod::kTangent;
  double huber = 0.0;  ///< b, in multiples of sigma; 0: plain squares
  /// If a start does not reach the minimum by it, it is also minimised plainly, after kSegments
  /// with growing windows as well, and the best minimum is taken.
  FitApproach approach = FitApproach::kAuto;
  int segments = 1;  ///< of multiple shooting
  /// Further starts are drawn within the bounds. 0: one, and where impacts or sticking act or the
  /// loss is robust two more, at the estimate with restitution and friction shifted up and down.
  int starts = 1;
  unsigned seed = 0;        ///< of these draws
  int max_iterations = 50;  ///< of each start
  int threads = 0;  ///< that evaluate blocks; 0: one a core. The result does not depend on it
  /// Whether a certificate of the derivatives at the estimate is computed, which takes one more
  /// rollout.
  CertificatePass certificate = CertificatePass::kRun;
  /// Whether held parameters of the scene are tested where the model does not fit or a parameter is
  /// at its bound, which takes one more run with a column for each of them.
  HeldTest held_test = HeldTest::kRun;
  ProfilePass profile_pass = ProfilePass::kWhereNeeded;
  MissingPass missing = MissingPass::kSkip;
  std::vector<std::string> profiles;  ///< names of parameters whose profiles are made in any case
  /// Whether each residual's leverage is computed (Uncertainty::leverages).
  Leverages leverages = Leverages::kSkip;
};

/// One run as the user describes it, in memory.
struct FitProblem {
  Scene scene;
  std::vector<BodyPoint> points;
  std::vector<FitParameter> parameters;
  std::vector<Observation> observations;
  Instruments instruments;
  std::vector<Channel> channels;   ///< of the observations; empty: they are made directly
  std::vector<std::string> files;  ///< of the channels, as written
  FitOptions options;
  std::vector<NoiseTerm> process_noise;  ///< random forces, the same in all recordings
};

/// A run that is fitted with others.
struct RecordingInput {
  std::string name;  ///< empty: the only one
  double weight = 1.0;
  FitProblem problem;  ///< what it would be alone; options are those of the fit
};

/// What the user asks for, in memory.
struct FitInput {
  std::vector<RecordingInput> recordings;  ///< at least one
  std::vector<ParameterScope> scopes;      ///< of each parameter

  const FitOptions& options() const { return recordings.front().problem.options; }
};

/// The fit of one run.
FitInput InputOf(FitProblem problem);

/// The residuals of one run, with its random forces; none with `error` where a parameter is wrong.
std::optional<RolloutResiduals> MakeRun(const FitProblem& problem, ParameterError* error);

/// The residuals of an input; null with `error` where a parameter of recording `fault` is wrong.
std::unique_ptr<RecordingsProblem> MakeProblem(const FitInput& input, ParameterError* error,
                                               int* fault);

struct FitIteration {
  double cost = 0.0;
  double gradient_norm = 0.0;      ///< ‖dcost/dq‖, dimensionless: relative changes of p
  std::vector<double> parameters;  ///< p
  double seconds = 0.0;            ///< since the fit began
};

/// The end of one start.
struct FitStart {
  std::vector<double> initial;
  double cost = 0.0;  ///< NaN where it failed
  int iterations = 0;
  int approach_iterations = 0;  ///< of what led to it
  std::string status;
  std::string approach = "plain";  ///< what led to it: "plain", "windows", "segments"
  double plain_cost = NAN;  ///< of the plain fit from the same point; NaN: not made, or failed
  std::string tried;  ///< another approach that was made but not taken: "windows", ...; or empty
  double tried_cost = NAN;       ///< where it led; NaN: it failed
  std::string message;           ///< of what led to it, where that ended early
  std::vector<double> estimate;  ///< where it ended; empty where it failed
};

struct ProfilePoint {
  double value = 0.0;
  double cost = 0.0;  ///< infinite where no run is possible
};

/// Values of a parameter in one piece; an end that is none is not limited on that side.
struct ProfileBranch {
  std::optional<double> low, high;
};

struct Profile {
  int parameter = -1;
  std::string why;                      ///< it was made
  double rise = 0.0;                    ///< of the cost at the ends
  std::vector<ProfilePoint> points;     ///< by value
  std::vector<ProfileBranch> branches;  ///< by value, at least one
};

/// The 95 % interval that is printed first.
struct FinalInterval {
  bool exists = false;
  std::optional<double> low, high;  ///< within the range; none: not limited on that side
  std::string method;  ///< "robust", "profile", "posterior", or where there is none "sigma"
};

enum class FitStatus {
  kConverged,
  kNotConverged,  ///< max_iterations; estimates are those of the last iteration
  kFailed,        ///< no run at the initial point; nothing is estimated
  kNoEffect,      ///< a parameter changes no residual
};

/// "converged", "not_converged", "failed", "no_effect".
const char* NameOf(FitStatus status);

/// Where one start ended.
struct Minimum {
  FitStatus status = FitStatus::kFailed;
  std::string message;
  Eigen::VectorXd parameters;
  double cost = 0.0;
  std::vector<FitIteration> iterations;
  long rollouts = 0;
  FitApproach approach = FitApproach::kPlain;  ///< what led to where it began; kTrial: gave up
  bool gave_up = false;                        ///< for lack of progress
  int approach_iterations = 0;
  std::string approach_message;  ///< why that ended early, or empty
};

struct FitResult {
  FitStatus status = FitStatus::kFailed;
  std::string message;  ///< why, one line; of a converged fit what Ceres said
  int parameter = -1;   ///< the culprit of kNoEffect
  Eigen::VectorXd estimate;
  Uncertainty uncertainty;
  std::vector<HeldParameter> held;  ///< numbers of the scene that the observations contradict
  double initial_cost = NAN;        ///< at the initial values
  double final_cost = 0.0;
  std::vector<FitIteration> iterations;  ///< of the best start; begins with the initial point
  std::vector<FitStart> starts;
  std::string agreement;                 ///< of several starts, one sentence; else empty
  std::vector<Profile> profiles;         ///< those that were asked for or needed
  std::vector<FinalInterval> intervals;  ///< of each parameter; empty without an estimate
  Eigen::VectorXd residuals;  ///< of the observations at the estimate, in multiples of sigma
  long rollouts = 0;          ///< without the certificate's
  double seconds = 0.0;       ///< without the certificate's
  /// The certificate of the derivatives at the estimate. Where its verdict is not `trustworthy`,
  /// the message and a warning of `uncertainty` say so, because the intervals depend on these
  /// derivatives.
  Certificate certificate;
};

/// Called after each iteration of each start.
using FitProgress = std::function<void(int start, int iteration, const FitIteration&)>;

/// The point at which an approach to the fit ended, where the minimiser continues.
struct FitApproachResult {
  Eigen::VectorXd parameters;
  int iterations = 0;
  long rollouts = 0;
  std::string message = "";  ///< why it ended early, or empty
};

/// Multiple shooting, which needs more than a least-squares problem (kSegments). Its evaluations go
/// through the log unless that is null.
using FitShooting =
    std::function<FitApproachResult(const Eigen::VectorXd& start, EvaluationLog* log)>;

/// Adds the certificate of the derivatives at the estimate to a result, with a warning where it is
/// not `trustworthy`.
void Certify(LeastSquaresProblem* problem, FitResult* result);

struct FitLog;  // fit_checkpoint.h

/// Runs the fit; `progress` and, unless the approach is kSegments, `shooting` may be empty. With a
/// log it continues from the evaluations in the log, adds its own to it, and has the same bits as
/// without; if the log belongs to another fit the result is invalid (FitLog::mismatch).
FitResult Fit(const FitOptions& options, LeastSquaresProblem* problem, const FitProgress& progress,
              FitLog* log = nullptr, const FitShooting& shooting = {});

/// The fit of recordings with the priors of their parameters, and with the spreads of those that
/// vary as they are.
FitResult Fit(const FitOptions& options, RecordingsProblem* problem, const FitProgress& progress,
              FitLog* log = nullptr);

/// The fit of one run with the priors of its parameters.
FitResult Fit(const FitOptions& options, RolloutResiduals* residuals, const FitProgress& progress,
              FitLog* log = nullptr);

}  // namespace tangible
