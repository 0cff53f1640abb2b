// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/noise_intensity.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tangible/dynamics/model/state_variable.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

// Newton's steps between two fits, the longest of them in ln s, and the distance of differences.
constexpr int kNewtonSteps = 8;
constexpr double kLongestStep = 1.5;
constexpr double kDifference = 0.05;
// A step in ln s after which the curvature is nearly what it was.
constexpr double kChordStep = 0.2;
// Smoothings at the initial parameters before the first fit.
constexpr int kRoundsAtStart = 4;
// A deviation of ln s above which no force is seen: a factor of 1e4 changes nothing.
constexpr double kUnseen = 9.2;

double Quantile95() { return 1.959963984540054; }

Eigen::VectorXd VectorOf(const std::vector<NoiseIntensity>& all) {
  Eigen::VectorXd intensities(static_cast<Eigen::Index>(all.size()));
  for (size_t i = 0; i < all.size(); ++i) {
    intensities[static_cast<Eigen::Index>(i)] = all[i].intensity;
  }
  return intensities;
}

void SetAll(const Eigen::VectorXd& intensities, RecordingsProblem* problem) {
  for (int b = 0; b < problem->num_blocks(); ++b) {
    problem->run(b)->noise()->SetIntensities(intensities);
  }
}

/// Of the larger of a joint's bodies' inertias or masses.
double FirstIntensity(const NoiseTerm& term, const RolloutResiduals& run) {
  constexpr double kAcceleration = 10.0;
  constexpr double kAngularAcceleration = 100.0;
  const Model<double>& model = run.scene().model();
  const ModelStructure& s = *model.structure;
  double force = 0.0;
  const auto add = [&](const BodyIndex& body) {
    if (body.mass < 0) return;
    force = std::max(force, term.IsTorque() ? kAngularAcceleration * model.parameters[body.inertia]
                                            : kAcceleration * model.parameters[body.mass]);
  };
  for (const BodyIndex& body : s.bodies) {
    if (body.name == term.body) add(body);
  }
  for (const JointIndex& joint : s.joints) {
    if (!term.body.empty() || joint.name != term.joint) continue;
    add(s.bodies[joint.a]);
    add(s.bodies[joint.b]);
  }
  if (term.correlation_time > 0.0) return force;
  const std::vector<double> times = run.noise()->KnotTimes(run);
  return force * std::sqrt(times[1] - times[0]);
}

}  // namespace

/// What the sweeps of all recordings give at one set of intensities.
struct NoiseLikelihood::Whole {
  std::vector<std::vector<NoiseInterval>> intervals;
  std::vector<NoiseSweep> sweeps;
  double minus_log = 0.0;
  std::vector<Eigen::VectorXd> steps;    ///< of each recording's parameters to the least cost
  std::vector<RowMatrixXd> covariances;  ///< of them
};

bool NoiseLikelihood::Create(const FitOptions& options, const Eigen::VectorXd& estimate,
                             Parameters parameters, RecordingsProblem* problem,
                             std::string* message) {
  problem_ = problem;
  threads_ = options.threads;
  const std::vector<ParameterEntry>& entries = problem->entries();
  if (entries.size() > kMostNoiseParameters) {
    *message = "with random forces expected at most " + std::to_string(kMostNoiseParameters) +
               " parameters, those of all recordings counted, got " +
               std::to_string(entries.size());
    return false;
  }
  std::vector<int> free(entries.size(), -1);
  for (size_t k = 0; k < entries.size(); ++k) {
    const bool held = parameters == Parameters::kHeld ||
                      IsAtBound(entries[k], estimate[static_cast<Eigen::Index>(k)]);
    if (!held) free[k] = num_free_++;
  }
  ProblemWithPriors whole(problem, problem->effects());
  Linearizer linearizer(&whole, options.derivatives, options.threads, nullptr);
  std::vector<BlockEvaluation> blocks;
  whole.SetHuber(options.huber);
  if (!linearizer.Rows(estimate, BlockDerivatives::kCompute, &blocks)) {
    *message = linearizer.message();
    return false;
  }
  for (int b = 0; b < whole.num_blocks(); ++b) {
    const BlockEvaluation& block = blocks[static_cast<size_t>(b)];
    const Eigen::Index first = whole.num_observation_rows(b) + whole.num_noise_rows(b);
    const double root = std::sqrt(whole.weight(b));
    for (Eigen::Index i = first; i < block.residuals.size(); ++i) {
      priors_.conservativeResize(priors_.rows() + 1, num_free_ + 1);
      auto row = priors_.row(priors_.rows() - 1);
      row.setZero();
      for (Eigen::Index j = 0; j < block.jacobian.cols(); ++j) {
        const int k = free[linearizer.layout().ParameterOf(b, static_cast<int>(j))];
        if (k >= 0) row[k] += root * block.jacobian(i, j);
      }
      row[num_free_] = root * block.residuals[i];
    }
  }
  for (int b = 0; b < problem->num_blocks(); ++b) {
    const RolloutResiduals& run = *problem->run(b);
    std::vector<int>& columns = columns_.emplace_back();
    for (int i = 0; i < run.num_parameters(); ++i) {
      const int k = problem->ParameterOf(b, i);
      columns.push_back(free[k]);
    }
    num_intervals_ += run.noise()->num_intervals();
    constant_ += problem->weight(b) * kSlopeOffset * run.noise()->num_slope_rows();
  }
  return true;
}

NoiseLikelihood::Whole NoiseLikelihood::SweepAll(const Eigen::VectorXd& intensities) const {
  const int count = problem_->num_blocks();
  Whole whole;
  whole.intervals.resize(static_cast<size_t>(count));
  whole.sweeps.resize(static_cast<size_t>(count));
  ForEachOnThreads(threads_, count, [&](int b) {
    const ProcessNoise& noise = *problem_->run(b)->noise();
    whole.intervals[b] = noise.WithIntensities(intensities);
    whole.sweeps[b] = SweepNoise(whole.intervals[b], noise.start());
  });
  Eigen::Index rows = priors_.rows();
  for (const NoiseSweep& sweep : whole.sweeps) rows += sweep.border.rows();
  Eigen::MatrixXd stacked = Eigen::MatrixXd::Zero(rows, num_free_ + 1);
  if (priors_.rows() > 0) stacked.bottomRows(priors_.rows()) = priors_;
  double twice = 0.0;
  Eigen::Index at = 0;
  for (size_t b = 0; b < whole.sweeps.size(); ++b) {
    const NoiseSweep& sweep = whole.sweeps[b];
    const double root = std::sqrt(problem_->weight(static_cast<int>(b)));
    for (size_t i = 0; i < columns_[b].size(); ++i) {
      if (columns_[b][i] < 0) continue;
      stacked.col(columns_[b][i]).segment(at, sweep.border.rows()) =
          root * sweep.border.col(static_cast<Eigen::Index>(i));
    }
    stacked.col(num_free_).segment(at, sweep.border.rows()) = root * sweep.border.rightCols(1);
    at += sweep.border.rows();
    twice += root * root * sweep.remainder;
    whole.minus_log += sweep.log_determinant;
  }
  whole.minus_log += 0.5 * twice + Eliminate(stacked, &whole) - constant_;
  return whole;
}

/// Adds the steps and covariances of the parameters; what they add to (1).
double NoiseLikelihood::Eliminate(const Eigen::MatrixXd& stacked, Whole* whole) const {
  double sum = 0.0;
  // A direction that nothing determines stays where it is, whatever the intensities are. Columns
  // have unit length, so that units of parameters do not matter.
  if (num_free_ == 0) {
    for (const std::vector<int>& columns : columns_) {
      const auto size = static_cast<Eigen::Index>(columns.size());
      whole->steps.emplace_back(Eigen::VectorXd::Zero(size));
      whole->covariances.emplace_back(RowMatrixXd::Zero(size, size));
    }
    return 0.5 * stacked.squaredNorm();
  }
  const Eigen::VectorXd lengths = stacked.leftCols(num_free_).colwise().norm().transpose();
  const Eigen::VectorXd scale = (lengths.array() > 0.0).select(lengths, 1.0).cwiseInverse();
  const Eigen::MatrixXd scaled = stacked.leftCols(num_free_) * scale.asDiagonal();
  OrthogonalDecomposition factor;
  factor.SetThreshold(kJacobianRank);
  factor.Compute(scaled);
  const Eigen::VectorXd scaled_step = -factor.Solve(Eigen::VectorXd(stacked.col(num_free_)));
  const Eigen::VectorXd step = scale.cwiseProduct(scaled_step);
  sum += 0.5 * (scaled * scaled_step + stacked.col(num_free_)).squaredNorm();
  for (Eigen::Index i = 0; i < factor.rank(); ++i) {
    sum += std::log(std::abs(factor.triangle()(i, i)));
  }
  sum -= scale.array().log().sum();
  const Eigen::MatrixXd inverse = scale.asDiagonal() * factor.PseudoInverse();
  const Eigen::MatrixXd covariance = inverse * inverse.transpose();
  for (const std::vector<int>& columns : columns_) {
    const auto size = static_cast<Eigen::Index>(columns.size());
    Eigen::VectorXd& local = whole->steps.emplace_back(Eigen::VectorXd::Zero(size));
    RowMatrixXd& spread = whole->covariances.emplace_back(RowMatrixXd::Zero(size, size));
    for (Eigen::Index i = 0; i < size; ++i) {
      const int k = columns[static_cast<size_t>(i)];
      if (k < 0) continue;
      local[i] = step[k];
      for (Eigen::Index j = 0; j < size; ++j) {
        const int l = columns[static_cast<size_t>(j)];
        if (l >= 0) spread(i, j) = covariance(k, l);
      }
    }
  }
  return sum;
}

std::vector<NoiseMoments> NoiseLikelihood::MomentsAt(const Eigen::VectorXd& intensities) const {
  const Whole whole = SweepAll(intensities);
  std::vector<NoiseMoments> moments(whole.sweeps.size());
  ForEachOnThreads(threads_, static_cast<int>(moments.size()), [&](int b) {
    moments[b] =
        MomentsOfNoise(whole.intervals[b], whole.sweeps[b], problem_->run(b)->noise()->start(),
                       whole.steps[b], whole.covariances[b]);
  });
  return moments;
}

NoiseLikelihood::Value NoiseLikelihood::At(const Eigen::VectorXd& intensities) const {
  const Whole whole = SweepAll(intensities);
  std::vector<Eigen::VectorXd> squares(whole.sweeps.size());
  ForEachOnThreads(threads_, static_cast<int>(squares.size()), [&](int b) {
    squares[b] =
        MomentsOfNoise(whole.intervals[b], whole.sweeps[b], problem_->run(b)->noise()->start(),
                       whole.steps[b], whole.covariances[b])
            .squares;
  });
  Value value;
  value.minus_log = whole.minus_log;
  value.score = Eigen::VectorXd::Constant(intensities.size(), num_intervals_);
  for (const Eigen::VectorXd& one : squares) value.score -= one;
  return value;
}

std::vector<NoiseIntensity> IntensitiesOf(const RecordingsProblem& problem) {
  std::vector<NoiseIntensity> all;
  const ProcessNoise* const noise = problem.recordings().front().residuals.noise();
  for (int i = 0; noise != nullptr && i < noise->num_terms(); ++i) {
    const NoiseTerm& term = noise->terms()[i];
    all.push_back({term, noise->intensities()[i], !term.intensity, std::nullopt, true});
  }
  return all;
}

namespace {

/// Those that are to be estimated become a share of the first ones.
void BeginAt(double share, RecordingsProblem* problem) {
  const RolloutResiduals& run = *problem->run(0);
  Eigen::VectorXd intensities = run.noise()->intensities();
  for (int i = 0; i < run.noise()->num_terms(); ++i) {
    const NoiseTerm& term = run.noise()->terms()[i];
    if (!term.intensity) intensities[i] = share * FirstIntensity(term, run);
  }
  for (int b = 0; b < problem->num_blocks(); ++b) problem->run(b)->noise()->Forget();
  SetAll(intensities, problem);
}

}  // namespace

void BeginIntensities(RecordingsProblem* problem) { BeginAt(1.0, problem); }
void BeginWithoutForces(RecordingsProblem* problem) { BeginAt(kNextToNone, problem); }

void SetIntensities(const std::vector<NoiseIntensity>& intensities, RecordingsProblem* problem) {
  SetAll(VectorOf(intensities), problem);
}

namespace {

/// Newton's method of (2) over the intensities that are estimated.
class IntensitySearch {
 public:
  IntensitySearch(const NoiseLikelihood& likelihood, std::vector<NoiseIntensity>* all)
      : likelihood_(likelihood), all_(all), log_(static_cast<Eigen::Index>(all->size())) {
    for (size_t i = 0; i < all->size(); ++i) {
      log_[static_cast<Eigen::Index>(i)] = std::log((*all)[i].intensity);
      if ((*all)[i].estimated) free_.push_back(static_cast<Eigen::Index>(i));
    }
  }

  Eigen::VectorXd Intensities() const { return log_.array().exp(); }

  void Go() {
    const Eigen::VectorXd start = log_;
    for (int i = 0; i < kNewtonSteps; ++i) {
      const double moved = Step();
      if (moved < kSettledChange) break;
    }
    Conclude(start);
  }

  /// The largest change in multiples of its deviation.
  double largest() const { return largest_; }

 private:
  Eigen::VectorXd Score(const Eigen::VectorXd& log) const {
    const Eigen::VectorXd all = likelihood_.At(log.array().exp()).score;
    Eigen::VectorXd score(static_cast<Eigen::Index>(free_.size()));
    for (size_t i = 0; i < free_.size(); ++i) score[static_cast<Eigen::Index>(i)] = all[free_[i]];
    return score;
  }

  void Differentiate(const Eigen::VectorXd& score) {
    curvature_.resize(score.size(), score.size());
    for (Eigen::Index j = 0; j < score.size(); ++j) {
      Eigen::VectorXd beside = log_;
      beside[free_[static_cast<size_t>(j)]] += kDifference;
      curvature_.col(j) = (Score(beside) - score) / kDifference;
    }
    curvature_ = (0.5 * (curvature_ + curvature_.transpose())).eval();
  }

  /// One step; returns its length in deviations.
  double Step() {
    const auto size = static_cast<Eigen::Index>(free_.size());
    const Eigen::VectorXd score = Score(log_);
    if (!keeps_curvature_) Differentiate(score);
    const Cholesky factor(curvature_);
    const bool convex = factor.succeeded();
    Eigen::VectorXd step(size);
    if (convex) step = -factor.Solve(score);
    // Else towards E[ε²] = 1, as the expectation-maximisation goes, but faster.
    if (!convex) step = -score;
    const double longest = step.cwiseAbs().maxCoeff();
    step = step.cwiseMax(-kLongestStep).cwiseMin(kLongestStep);
    // A chord goes on where a step was short.
    keeps_curvature_ = convex && longest < kChordStep;
    deviations_ = Eigen::VectorXd::Constant(size, HUGE_VAL);
    if (convex) {
      deviations_ = factor.Solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size)))
                        .diagonal()
                        .cwiseSqrt();
    }
    double moved = 0.0;
    for (Eigen::Index j = 0; j < size; ++j) {
      // Nothing is left of the force: what else it does is rounding.
      unseen_ = std::abs(score[j]) < kUnseenScore && !(deviations_[j] < kUnseen);
      if (unseen_) step[j] = 0.0;
      log_[free_[static_cast<size_t>(j)]] += step[j];
      if (!unseen_) moved = std::max(moved, std::abs(step[j]) / std::min(deviations_[j], 1.0));
    }
    return moved;
  }

  void Conclude(const Eigen::VectorXd& start) {
    for (size_t i = 0; i < free_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      NoiseIntensity& one = (*all_)[static_cast<size_t>(free_[i])];
      one.intensity = std::exp(log_[free_[i]]);
      one.seen = deviations_[at] < kUnseen;
      one.interval.reset();
      if (one.seen) {
        const double factor = std::exp(Quantile95() * deviations_[at]);
        one.interval = {one.intensity / factor, one.intensity * factor};
      }
      const double change = std::abs(log_[free_[i]] - start[free_[i]]);
      if (one.seen) largest_ = std::max(largest_, change / std::min(deviations_[at], 1.0));
      if (!one.seen && change > kLongestStep) largest_ = std::max(largest_, 1.0);
    }
  }

  const NoiseLikelihood& likelihood_;
  std::vector<NoiseIntensity>* all_;
  Eigen::VectorXd log_, deviations_;
  Eigen::MatrixXd curvature_;
  bool keeps_curvature_ = false;
  std::vector<Eigen::Index> free_;
  bool unseen_ = false;
  double largest_ = 0.0;
};

/// The coordinate along which a force acts and its rate, in a state.
std::pair<double, double> PlaceOf(const NoiseTerm& term, const Model<double>& model,
                                  const State<double>& state) {
  const ModelStructure& s = *model.structure;
  const auto number = [&](int body, int axis) {
    const size_t at = 3 * static_cast<size_t>(body) + static_cast<size_t>(axis);
    return std::pair(state.pose[at], state.twist[at]);
  };
  for (size_t i = 0; i < s.bodies.size(); ++i) {
    if (!term.body.empty() && s.bodies[i].name == term.body) {
      return number(static_cast<int>(i), static_cast<int>(term.coordinate));
    }
  }
  for (const JointIndex& joint : s.joints) {
    if (joint.name != term.joint) continue;
    const auto [angle_a, rate_a] = number(joint.a, 2);
    const auto [angle_b, rate_b] = number(joint.b, 2);
    if (term.IsTorque()) return {angle_a - angle_b, rate_a - rate_b};
    // Along the axis, which turns with b: r = a's anchor − b's, rate ṙ·e + r·(ω × e).
    const double* const g = &model.parameters[joint.geometry];
    const auto turned = [](double angle, double x, double y) {
      return Vector2<double>(std::cos(angle) * x - std::sin(angle) * y,
                             std::sin(angle) * x + std::cos(angle) * y);
    };
    const Vector2<double> on_a = turned(angle_a, g[0], g[1]);
    const Vector2<double> on_b = turned(angle_b, g[2], g[3]);
    const Vector2<double> axis = turned(angle_b, g[4], g[5]);
    const Vector2<double> r(
        number(joint.a, 0).first + on_a[0] - number(joint.b, 0).first - on_b[0],
        number(joint.a, 1).first + on_a[1] - number(joint.b, 1).first - on_b[1]);
    const Vector2<double> v(
        number(joint.a, 0).second - rate_a * on_a[1] - number(joint.b, 0).second + rate_b * on_b[1],
        number(joint.a, 1).second + rate_a * on_a[0] - number(joint.b, 1).second -
            rate_b * on_b[0]);
    return {r[0] * axis[0] + r[1] * axis[1],
            v[0] * axis[0] + v[1] * axis[1] + rate_b * (r[1] * axis[0] - r[0] * axis[1])};
  }
  return {NAN, NAN};
}

void FillPlaces(const RolloutResiduals& run, SmoothedRun* smoothed) {
  const Model<double>& model = run.scene().model();
  const std::vector<int> variables = OutputVariables(*model.structure);
  const std::vector<NoiseTerm>& terms = run.noise()->terms();
  const auto count = static_cast<Eigen::Index>(terms.size());
  smoothed->coordinates.resize(smoothed->forces.rows(), count);
  smoothed->rates.resize(smoothed->forces.rows(), count);
  State<double> state = run.scene().initial_state();
  for (Eigen::Index k = 0; k < smoothed->forces.rows(); ++k) {
    for (size_t i = 0; i < variables.size(); ++i) {
      StateNumber(&state, variables[i]) = smoothed->states(k, static_cast<Eigen::Index>(i));
    }
    for (Eigen::Index i = 0; i < count; ++i) {
      std::tie(smoothed->coordinates(k, i), smoothed->rates(k, i)) =
          PlaceOf(terms[static_cast<size_t>(i)], model, state);
    }
  }
}

}  // namespace

namespace {

/// Far below its mode the likelihood does not change with an intensity, and a search there sees no
/// force. Sets those of which none was seen to the share of the first ones that has the largest
/// likelihood; whether it is larger than what was found.
bool BeginWhereSeen(const NoiseLikelihood& likelihood, const RolloutResiduals& run,
                    const std::vector<NoiseIntensity>& found, std::vector<NoiseIntensity>* begin) {
  constexpr double kLarger = 0.5;  // nats
  const auto minus_log = [&](const std::vector<NoiseIntensity>& all) {
    return likelihood.At(VectorOf(all)).minus_log;
  };
  if (std::all_of(found.begin(), found.end(),
                  [](const NoiseIntensity& one) { return one.seen || !one.estimated; })) {
    return false;
  }
  double least = minus_log(found) - kLarger;
  bool any = false;
  constexpr int kDecades = 4;
  double share = 1.0;
  for (int decade = 0; decade < kDecades; ++decade, share *= 0.1) {
    std::vector<NoiseIntensity> trial = found;
    for (NoiseIntensity& one : trial) {
      if (one.estimated && !one.seen) one.intensity = share * FirstIntensity(one.term, run);
    }
    if (const double now = minus_log(trial); now < least) {
      least = now;
      *begin = trial;
      any = true;
    }
  }
  return any;
}

}  // namespace

bool UpdateIntensities(const FitOptions& options, const FitResult& result,
                       RecordingsProblem* problem, std::vector<NoiseIntensity>* intensities,
                       double* largest, std::string* message, double* minus_log) {
  NoiseLikelihood likelihood;
  if (!likelihood.Create(options, result.estimate, NoiseLikelihood::Parameters::kFree, problem,
                         message))
    return false;
  std::vector<NoiseIntensity> begun = *intensities;
  IntensitySearch search(likelihood, intensities);
  search.Go();
  Eigen::VectorXd found = search.Intensities();
  if (BeginWhereSeen(likelihood, *problem->run(0), *intensities, &begun)) {
    IntensitySearch again(likelihood, &begun);
    again.Go();
    found = again.Intensities();
    *intensities = begun;
    *largest = std::max(*largest, 1.0);
  }
  if (!found.allFinite()) {
    *message = "the likelihood of the random forces' intensities is not finite";
    return false;
  }
  SetAll(found, problem);
  *largest = std::max(*largest, search.largest());
  if (minus_log != nullptr) *minus_log = likelihood.At(found).minus_log;
  return true;
}

void SettleIntensities(const FitOptions& options, RecordingsProblem* problem,
                       std::vector<NoiseIntensity>* intensities) {
  for (int round = 0; round < kRoundsAtStart; ++round) {
    NoiseLikelihood likelihood;
    std::string none;
    if (!likelihood.Create(options, InitialOf(problem->entries()),
                           NoiseLikelihood::Parameters::kHeld, problem, &none)) {
      return;
    }
    IntensitySearch search(likelihood, intensities);
    search.Go();
    if (!search.Intensities().allFinite()) return;
    SetAll(search.Intensities(), problem);
    if (search.largest() < 1.0) return;
  }
}

std::vector<SmoothedRun> SmoothedRuns(const FitOptions& options, const Eigen::VectorXd& estimate,
                                      RecordingsProblem* problem, std::string* message) {
  std::vector<SmoothedRun> runs;
  NoiseLikelihood likelihood;
  if (!likelihood.Create(options, estimate, NoiseLikelihood::Parameters::kFree, problem, message))
    return runs;
  const std::vector<NoiseMoments> moments =
      likelihood.MomentsAt(problem->run(0)->noise()->intensities());
  for (int b = 0; b < problem->num_blocks(); ++b) {
    const RolloutResiduals& run = *problem->run(b);
    const NoiseMoments& of = moments[static_cast<size_t>(b)];
    SmoothedRun& smoothed = runs.emplace_back();
    smoothed.recording = problem->recordings()[b].name;
    smoothed.times = run.noise()->KnotTimes(run);
    smoothed.forces = run.noise()->path().forces;
    smoothed.force_deviations = of.force_deviation;
    smoothed.names = OutputNames(*run.scene().model().structure);
    smoothed.states = run.noise()->path().states;
    smoothed.state_deviations = of.state_deviation;
    FillPlaces(run, &smoothed);
  }
  return runs;
}

}  // namespace tangible
