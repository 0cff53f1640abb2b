// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/observed_state.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/model/state_variable.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/invariants.h"

namespace tangible {
namespace {

// The first number of samples of a parabola; few, so that no impact is likely to lie between them.
constexpr size_t kFewest = 5;
constexpr int kIterations = 50;

/// One sample of a series.
struct SeriesSample {
  double time = 0.0;  // from t₀
  double value = 0.0;
  double sigma = 1.0;
};

/// The parabola through the first `count` samples; `explains`: whether it does.
SmoothedSeries FitParabola(const std::vector<SeriesSample>& samples, size_t count, bool* explains) {
  std::vector<double> times;
  times.reserve(count);
  for (size_t i = 0; i < count; ++i) times.push_back(samples[i].time);
  std::sort(times.begin(), times.end());
  const auto distinct = std::unique(times.begin(), times.end()) - times.begin();
  const double unit = std::max(std::abs(times.front()), std::abs(*(times.begin() + distinct - 1)));
  const double second = unit > 0.0 ? unit : 1.0;
  const auto rows = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd terms(rows, std::min<Eigen::Index>(distinct, 3));
  Eigen::VectorXd values(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const SeriesSample& sample = samples[static_cast<size_t>(i)];
    double power = 1.0 / sample.sigma;
    for (Eigen::Index j = 0; j < terms.cols(); ++j) {
      terms(i, j) = power;
      power *= sample.time / second;
    }
    values[i] = sample.value / sample.sigma;
  }
  const UnpivotedQr qr(terms);
  const Eigen::VectorXd found = qr.Solve(values);
  const Eigen::MatrixXd r = qr.UpperFactor();
  const Eigen::MatrixXd inverse =
      r.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(r.rows(), r.cols()));
  const double squares = (values - terms * found).squaredNorm();
  const double freedom = static_cast<double>(rows - terms.cols());
  *explains = squares <= kExplained * (freedom + 2.0 * std::sqrt(freedom));
  // The standard deviations increase where the parabola does not explain the samples.
  const double factor = freedom > 0.0 ? std::sqrt(std::max(1.0, squares / freedom)) : 1.0;
  SmoothedSeries series;
  series.samples = static_cast<int>(count);
  series.value = found[0];
  series.value_sigma = factor * inverse.row(0).norm();
  series.rate = terms.cols() > 1 ? found[1] / second : 0.0;
  series.rate_sigma = terms.cols() > 1 ? factor * inverse.row(1).norm() / second : HUGE_VAL;
  return series;
}

SmoothedSeries Smooth(std::vector<SeriesSample> samples) {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const SeriesSample& a, const SeriesSample& b) {
                     return std::abs(a.time) < std::abs(b.time);
                   });
  bool explains = false;
  size_t count = std::min(samples.size(), kFewest);
  SmoothedSeries best = FitParabola(samples, count, &explains);
  while (explains && count < samples.size()) {
    count = std::min(samples.size(), 2 * count);
    const SmoothedSeries longer = FitParabola(samples, count, &explains);
    if (explains) best = longer;
  }
  return best;
}

bool IsVelocity(Coordinate coordinate) {
  return coordinate == Coordinate::kVx || coordinate == Coordinate::kVy ||
         coordinate == Coordinate::kOmega;
}

/// The least-squares problem of the state; `state_of` makes a state from the unknowns.
class StateProblem : public LeastSquaresProblem {
 public:
  /// Returns false where the unknowns give no state.
  using StateOf = std::function<bool(const Eigen::VectorXd& x, State<double>* state)>;

  /// `model` is that of the state that was made last.
  StateProblem(const RolloutResiduals& residuals, const Model<double>& model,
               std::vector<SmoothedSeries> series, std::vector<ParameterEntry> entries,
               StateOf state_of)
      : residuals_(residuals),
        model_(model),
        series_(std::move(series)),
        entries_(std::move(entries)),
        state_of_(std::move(state_of)) {
    for (const SmoothedSeries& one : series_) {
      smallest_ = std::min(smallest_, one.value_sigma);
    }
  }

  void SetStage(double weight) { weight_ = weight; }

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return static_cast<int>(entries_.size()); }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override {
    return 2 * static_cast<int>(series_.size()) + num_joint_rows() + 1 + num_shared();
  }
  std::vector<RowPlace> Places(int /*block*/) const override { return {}; }

  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
    if (!Rows(p, &evaluation->residuals)) {
      evaluation->message = "there is no such state";
      return false;
    }
    if (derivatives == BlockDerivatives::kSkip) return true;
    evaluation->jacobian.resize(evaluation->residuals.size(), p.size());
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const ParameterEntry& entry = entries_[static_cast<size_t>(k)];
      const double h = kStateDifference * entry.scale;
      Eigen::VectorXd moved[2] = {p, p};
      moved[0][k] = std::max(p[k] - h, entry.lower);
      moved[1][k] = std::min(p[k] + h, entry.upper);
      Eigen::VectorXd rows[2];
      if (!Rows(moved[0], &rows[0]) || !Rows(moved[1], &rows[1])) {
        evaluation->message = "there is no such state";
        return false;
      }
      evaluation->jacobian.col(k) = (rows[1] - rows[0]) / (moved[1][k] - moved[0][k]);
    }
    return true;
  }

 private:
  // There are up to three equations and as many rates of them; those that a joint does not have are
  // 0.
  int num_joint_rows() const {
    return 6 * static_cast<int>(residuals_.scene().model().structure->joints.size());
  }

  bool Rows(const Eigen::VectorXd& p, Eigen::VectorXd* rows) const {
    State<double> state;
    if (!state_of_(p, &state)) return false;
    rows->setZero(num_rows(0));
    Eigen::Index row = 0;
    for (const SmoothedSeries& series : series_) {
      AddSeries(series, state, &row, rows);
    }
    AddJoints(state, &row, rows);
    (*rows)[row] = weight_ / smallest_ * DeepestPenetration(model_, state);
    ++row;
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const ParameterEntry& entry = entries_[static_cast<size_t>(k)];
      (*rows)[row++] = (p[k] - entry.initial) / (kStatePrior * entry.scale);
    }
    return rows->allFinite();
  }

  void AddSeries(const SmoothedSeries& series, const State<double>& state, Eigen::Index* row,
                 Eigen::VectorXd* rows) const {
    const Prediction prediction = residuals_.PredictionIn(series.observation, state);
    (*rows)[(*row)++] = (prediction.value - series.value) / series.value_sigma;
    const Coordinate coordinate = residuals_.observations()[series.observation].coordinate;
    if (!IsVelocity(coordinate) && std::isfinite(series.rate_sigma)) {
      double rate = 0.0;
      const std::array<int, kPlaces> bodies = residuals_.BodiesOf(series.observation);
      for (int place = 0; place < kPlaces; ++place) {
        for (int j = 0; j < 3 && bodies[place] >= 0; ++j) {
          rate += prediction.by_state[place][j] * state.twist[3 * bodies[place] + j];
        }
      }
      (*rows)[*row] = (rate - series.rate) / series.rate_sigma;
    }
    ++*row;
  }

  void AddJoints(const State<double>& state, Eigen::Index* row, Eigen::VectorXd* rows) const {
    for (const JointIndex& joint : model_.structure->joints) {
      JointRows<double> equations;
      EvaluateJoint(model_, state, joint, &equations);
      for (int k = 0; k < equations.rows; ++k) {
        double rate =
            RelativeSpeed(state, joint.a, equations.row_a[k], joint.b, equations.row_b[k]);
        if (joint.c >= 0) {
          rate += RelativeSpeed(state, joint.c, equations.row_c, joint.d, equations.row_d);
        }
        (*rows)[*row + 2 * k] = weight_ / smallest_ * equations.error[k];
        (*rows)[*row + 2 * k + 1] = weight_ / smallest_ * rate;
      }
      *row += 6;
    }
  }

  const RolloutResiduals& residuals_;
  const Model<double>& model_;
  std::vector<SmoothedSeries> series_;
  std::vector<ParameterEntry> entries_;
  StateOf state_of_;
  double smallest_ = HUGE_VAL;  ///< σ_a
  double weight_ = 0.0;
};

/// Whole turns away from the initial values that change no row are taken back: of all unknowns
/// together, as bodies that joints hold at an angle turn together, then of each.
void TakeTurnsBack(StateProblem* problem, Eigen::VectorXd* x) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  const Eigen::VectorXd initial = InitialOf(entries);
  BlockEvaluation rows;
  const auto cost = [&](const Eigen::VectorXd& at) {
    const bool done =
        problem->EvaluateBlock(0, at, GradientMethod::kTangent, BlockDerivatives::kSkip, &rows);
    return done ? rows.residuals.squaredNorm() : HUGE_VAL;
  };
  double least = cost(*x);
  for (Eigen::Index one = -1; one < x->size(); ++one) {
    Eigen::VectorXd back = *x;
    for (Eigen::Index k = 0; k < x->size(); ++k) {
      const ParameterEntry& entry = entries[static_cast<size_t>(k)];
      if (one < 0 || one == k) {
        const double near =
            initial[k] + std::remainder(back[k] - initial[k], 2.0 * std::numbers::pi);
        back[k] = std::clamp(near, entry.lower, entry.upper);
      }
    }
    const double here = back == *x ? HUGE_VAL : cost(back);
    if (here <= least) {
      *x = back;
      least = here;
    }
  }
}

/// The unknowns that minimise all stages, from the entries' initial values.
Eigen::VectorXd Solve(StateProblem* problem) {
  FitOptions options;
  options.max_iterations = kIterations;
  options.threads = 1;
  Eigen::VectorXd x = InitialOf(problem->entries());
  for (const double stage : kJointWeights) {
    problem->SetStage(stage);
    const Minimum minimum = Minimise(
        options, x, [] { return 0.0; }, {}, problem);
    if (minimum.status == FitStatus::kFailed || !minimum.parameters.allFinite()) break;
    x = minimum.parameters;
  }
  TakeTurnsBack(problem, &x);
  return x;
}

/// Whether joints keep the place of their anchor on a body of this name, "*" matching within it.
bool IsHeldByJoint(const Scene& scene, const std::string& pattern) {
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const BasicJoint<double>& one) {
    const bool holds = one.type == JointType::kRevolute || one.type == JointType::kPrismatic ||
                       one.type == JointType::kWeld || one.type == JointType::kDistance;
    return holds && std::any_of(one.bodies, one.bodies + 2, [&](int body) {
             return body >= 0 &&
                    MatchesPattern(pattern, scene.bodies[static_cast<size_t>(body)].name);
           });
  });
}

/// Whether a path "bodies/NAME/..." or "joints/NAME/..." ends with a component of a pose or twist.
bool IsOfState(const Scene& scene, const std::string& path) {
  const size_t first = path.find('/');
  const size_t second = path.find('/', first + 1);
  if (first == std::string::npos || second == std::string::npos) return false;
  const std::string kind = path.substr(0, first);
  const std::string what = path.substr(second + 1);
  if (kind == "joints") return what == "angle" || what == "displacement" || what == "rate";
  if (kind != "bodies") return false;
  if (what.rfind("velocity", 0) == 0 || what == "angular_velocity") return true;
  const bool is_pose = what.rfind("position", 0) == 0 || what == "angle";
  return is_pose && !IsHeldByJoint(scene, path.substr(first + 1, second - first - 1));
}

}  // namespace

std::vector<SmoothedSeries> SmoothAt(const RolloutResiduals& residuals, double time) {
  const std::vector<Observation>& observations = residuals.observations();
  const ObservationSeries index = IndexSeries(observations);
  std::vector<std::vector<SeriesSample>> samples(static_cast<size_t>(index.size()));
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    const double at = RunTime(residuals.scene().instruments(), residuals.ChannelOf(observation),
                              observation.time);
    samples[static_cast<size_t>(index.of[i])].push_back(
        {at - time, observation.value, observation.sigma});
  }
  std::vector<SmoothedSeries> all;
  for (size_t i = 0; i < samples.size(); ++i) {
    // Events, accelerations and forces say nothing about a state alone.
    const Observation& one = observations[index.first[i]];
    if (one.event >= 0 || IsAcceleration(one.coordinate) || IsForce(one.coordinate)) continue;
    all.push_back(Smooth(std::move(samples[i])));
    all.back().observation = index.first[i];
  }
  return all;
}

State<double> StateFromObservations(const RolloutResiduals& residuals, double time,
                                    const State<double>& guess) {
  const std::vector<int> variables = OutputVariables(*residuals.scene().model().structure);
  State<double> found = guess;
  std::vector<ParameterEntry> entries;
  for (const int variable : variables) {
    const double initial = StateNumber(found, variable);
    entries.push_back({"", initial, -HUGE_VAL, HUGE_VAL, false, std::max(1.0, std::abs(initial))});
  }
  const auto state_of = [&](const Eigen::VectorXd& x, State<double>* state) {
    *state = guess;
    for (int i = 0; i < static_cast<int>(x.size()); ++i) StateNumber(state, variables[i]) = x[i];
    return true;
  };
  StateProblem problem(residuals, residuals.scene().model(), SmoothAt(residuals, time), entries,
                       state_of);
  const Eigen::VectorXd x = Solve(&problem);
  for (int i = 0; i < static_cast<int>(x.size()); ++i) StateNumber(&found, variables[i]) = x[i];
  return found;
}

Eigen::VectorXd ParametersFromObservations(const RolloutResiduals& residuals,
                                           const std::vector<bool>& free) {
  const std::vector<ParameterEntry>& all = residuals.entries();
  Eigen::VectorXd p = InitialOf(all);
  std::vector<ParameterEntry> entries;
  std::vector<int> indices;
  for (size_t k = 0; k < all.size(); ++k) {
    if (free[k]) {
      entries.push_back(all[k]);
      indices.push_back(static_cast<int>(k));
    }
  }
  if (entries.empty()) return p;
  ParameterizedScene scene = residuals.scene();
  const auto state_of = [&](const Eigen::VectorXd& x, State<double>* state) {
    Eigen::VectorXd at = p;
    at(indices) = x;
    if (!scene.Set(at)) return false;
    *state = scene.initial_state();
    return true;
  };
  StateProblem problem(residuals, scene.model(), SmoothAt(residuals, 0.0), entries, state_of);
  const Eigen::VectorXd x = Solve(&problem);
  p(indices) = x;
  return p;
}

bool IsOfInitialState(const Scene& scene, const FitParameter& parameter) {
  return std::all_of(parameter.sets.begin(), parameter.sets.end(),
                     [&](const ParameterSet& set) { return IsOfState(scene, set.path); });
}

}  // namespace tangible
