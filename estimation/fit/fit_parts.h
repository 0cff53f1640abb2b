// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Parts of a fit that other processes do: starts, profiles that are asked for, and chains of draws
// from the posterior. They depend on the problem alone and on no other of them, so that a fit that
// takes them over has the bits of one that does all itself. The recordings of one fit are no such
// parts: each evaluation needs all of them.

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct FitLog;

/// What progress was told on the way.
struct SaidIteration {
  int number = 0;
  FitIteration values;
};

/// A start and where it ended.
struct FinishedStart {
  Minimum minimum;
  FitStart told;
  long rollouts = 0;
  std::vector<SaidIteration> said;
};

/// The profile of a parameter around an estimate.
struct FinishedProfile {
  Eigen::VectorXd estimate;
  Profile profile;
  Eigen::VectorXd better;  ///< as MakeProfile has it
  long rollouts = 0;
};

/// A chain of draws from the posterior around an estimate (posterior.h).
struct FinishedChain {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd parameters;  ///< of each draw, a row each
  Eigen::VectorXd costs;       ///< of these
  int divergences = 0;
  int saturated = 0;
  double step = 0.0;
  double acceptance = 0.0;
  double exchanged = 1.0;
  long evaluations = 0;
  std::string message;  ///< why there are no draws, or empty
};

/// What a fit takes over instead of doing it.
struct FitParts {
  std::map<int, FinishedStart> starts;  ///< by number; of the first of several fits
  /// By the parameter's name. One around another estimate is not taken.
  std::map<std::string, FinishedProfile> profiles;
  /// If set, no other profiles are made than those it wants; they are kept in `made`, and nothing
  /// else is found out about the estimate.
  std::function<bool(const std::string& name)> is_wanted{};
  std::map<std::string, FinishedProfile> made{};
  std::map<int, FinishedChain> chains{};  ///< by number. One around another estimate is not taken
};

/// The logs of fits that follow each other (variance_components.h) and take over parts.
class FitPartLogs {
 public:
  /// `parts` must outlive this object; its starts are those of the first fit.
  explicit FitPartLogs(FitParts* parts);
  ~FitPartLogs();
  FitPartLogs(const FitPartLogs&) = delete;
  FitPartLogs& operator=(const FitPartLogs&) = delete;
  FitLog* Next();

 private:
  FitParts* parts_;
  std::deque<FitLog> logs_;  ///< logs do not move
};

/// The starts that a fit makes one after the other, of which others may do some.
int NumStarts(const FitOptions& options);

/// Some of these starts; none of any where no start can be made: no run at the initial values, or a
/// parameter without effect, which the fit itself finds too.
std::vector<std::optional<FinishedStart>> MakeStarts(const FitOptions& options,
                                                     RecordingsProblem* problem,
                                                     const std::vector<int>& numbers);

/// The profiles of these parameters, around the estimate to which the starts lead, those of `parts`
/// and others; empty where there is no estimate.
std::map<std::string, FinishedProfile> MakeProfiles(const FitOptions& options,
                                                    RecordingsProblem* problem,
                                                    std::map<int, FinishedStart> starts,
                                                    const std::vector<std::string>& names);

// Every field, for files and messages (app/row_archive.h). A structured binding names all of them,
// so that the compiler sees where one is left out.

template <typename Visitor>
void VisitFields(FitIteration& iteration, const Visitor& visit) {
  auto& [cost, gradient_norm, parameters, seconds] = iteration;
  visit("cost", cost);
  visit("gradient_norm", gradient_norm);
  visit("parameters", parameters);
  visit("seconds", seconds);
}

template <typename Visitor>
void VisitFields(SaidIteration& said, const Visitor& visit) {
  auto& [number, values] = said;
  visit("number", number);
  visit("values", values);
}

template <typename Visitor>
void VisitFields(Minimum& minimum, const Visitor& visit) {
  auto& [status, message, parameters, cost, iterations, rollouts, approach, gave_up,
         approach_iterations, approach_message] = minimum;
  visit("status", status);
  visit("message", message);
  visit("parameters", parameters);
  visit("cost", cost);
  visit("iterations", iterations);
  visit("rollouts", rollouts);
  visit("approach", approach);
  visit("gave_up", gave_up);
  visit("approach_iterations", approach_iterations);
  visit("approach_message", approach_message);
}

template <typename Visitor>
void VisitFields(FitStart& start, const Visitor& visit) {
  auto& [initial, cost, iterations, approach_iterations, status, approach, plain_cost, tried,
         tried_cost, message, estimate] = start;
  visit("initial", initial);
  visit("cost", cost);
  visit("iterations", iterations);
  visit("approach_iterations", approach_iterations);
  visit("status", status);
  visit("approach", approach);
  visit("plain_cost", plain_cost);
  visit("tried", tried);
  visit("tried_cost", tried_cost);
  visit("message", message);
  visit("estimate", estimate);
}

template <typename Visitor>
void VisitFields(FinishedStart& start, const Visitor& visit) {
  auto& [minimum, told, rollouts, said] = start;
  visit("minimum", minimum);
  visit("told", told);
  visit("rollouts", rollouts);
  visit("said", said);
}

template <typename Visitor>
void VisitFields(ProfilePoint& point, const Visitor& visit) {
  auto& [value, cost] = point;
  visit("value", value);
  visit("cost", cost);
}

template <typename Visitor>
void VisitFields(ProfileBranch& branch, const Visitor& visit) {
  auto& [low, high] = branch;
  visit("low", low);
  visit("high", high);
}

template <typename Visitor>
void VisitFields(Profile& profile, const Visitor& visit) {
  auto& [parameter, why, rise, points, branches] = profile;
  visit("parameter", parameter);
  visit("why", why);
  visit("rise", rise);
  visit("points", points);
  visit("branches", branches);
}

template <typename Visitor>
void VisitFields(FinishedProfile& profile, const Visitor& visit) {
  auto& [estimate, found, better, rollouts] = profile;
  visit("estimate", estimate);
  visit("profile", found);
  visit("better", better);
  visit("rollouts", rollouts);
}

template <typename Visitor>
void VisitFields(FinishedChain& chain, const Visitor& visit) {
  auto& [estimate, parameters, costs, divergences, saturated, step, acceptance, exchanged,
         evaluations, message] = chain;
  visit("estimate", estimate);
  visit("parameters", parameters);
  visit("costs", costs);
  visit("divergences", divergences);
  visit("saturated", saturated);
  visit("step", step);
  visit("acceptance", acceptance);
  visit("exchanged", exchanged);
  visit("evaluations", evaluations);
  visit("message", message);
}

}  // namespace tangible
