// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/learned_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/estimation/experiments/cartpole/tolerances.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

constexpr int kInputs = 5;
constexpr int kAhead = 10;                // steps, of the comparison of candidates
constexpr double kValidationShare = 0.2;  // of the recording, at its end

Eigen::VectorXd InputOf(const VectorX<double>& x, double u) {
  Eigen::VectorXd input(kInputs);
  input << std::sin(x[1]), std::cos(x[1]), x[2], x[3], u;
  return input;
}

// The state after a step at constant speeds.
VectorX<double> Coasting(const VectorX<double>& x) {
  VectorX<double> next = x;
  next.head(2) += kCartPoleStep * x.tail(2);
  return next;
}

Eigen::VectorXd DeviationOf(const Eigen::MatrixXd& columns, const Eigen::VectorXd& mean) {
  const Eigen::VectorXd variance =
      (columns.colwise() - mean).rowwise().squaredNorm() / static_cast<double>(columns.cols());
  return variance.cwiseSqrt().cwiseMax(kLeastDeviation);
}

// Squared errors in multiples of the noise over all windows of the last part, kAhead steps each.
double ValidationError(StepMap* step, const CartPoleRecording& recording, int first,
                       int half_window) {
  const RowMatrixXd states = SmoothedStates(recording, half_window);
  double sum = 0.0;
  int count = 0;
  std::string error;
  for (int start = first; start + kAhead < recording.samples(); ++start) {
    VectorX<double> x = states.row(start), next;
    if (!x.allFinite()) continue;
    for (int k = start; k < start + kAhead; ++k) {
      if (!step->Step(k, x, VectorX<double>::Constant(1, recording.forces[k]), &next, &error)) {
        return std::numeric_limits<double>::infinity();
      }
      x = next;
    }
    const Eigen::Vector2d off = recording.positions.row(start + kAhead).transpose() - x.head<2>();
    sum += std::pow(off[0] / kPositionNoise, 2) + std::pow(off[1] / kAngleNoise, 2);
    ++count;
  }
  return std::sqrt(sum / std::max(1, count));
}

}  // namespace

RowMatrixXd SmoothedStates(const CartPoleRecording& recording, int half_window) {
  // From the normal equations of a quadratic over j = −w … w, by symmetry: the slope is Σ j y / Σ
  // j², the value (Σ j⁴ Σ y − Σ j² Σ j² y) / (n Σ j⁴ − (Σ j²)²).
  const int w = half_window, n = 2 * w + 1;
  double second = 0.0, fourth = 0.0;
  for (int j = -w; j <= w; ++j) {
    second += j * j;
    fourth += static_cast<double>(j) * j * j * j;
  }
  RowMatrixXd states =
      RowMatrixXd::Constant(recording.samples(), 4, std::numeric_limits<double>::quiet_NaN());
  for (int k = w; k + w < recording.samples(); ++k) {
    for (int i = 0; i < 2; ++i) {
      double sum = 0.0, slope = 0.0, curve = 0.0;
      for (int j = -w; j <= w; ++j) {
        const double y = recording.positions(k + j, i);
        sum += y;
        slope += j * y;
        curve += j * j * y;
      }
      states(k, i) = (fourth * sum - second * curve) / (n * fourth - second * second);
      states(k, 2 + i) = slope / second / kCartPoleStep;
    }
  }
  return states;
}

LearnedStep::LearnedStep(const CartPoleRecording& recording, const LearnedStepOptions& options) {
  const RowMatrixXd states = SmoothedStates(recording, options.half_window);
  std::vector<int> usable;
  for (int k = 0; k + 1 < recording.samples(); ++k) {
    if (states.row(k).allFinite() && states.row(k + 1).allFinite()) usable.push_back(k);
  }
  const auto samples = static_cast<Eigen::Index>(usable.size());
  Eigen::MatrixXd inputs(kInputs, samples), targets(4, samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const int k = usable[i];
    inputs.col(i) = InputOf(states.row(k).transpose(), recording.forces[k]);
    targets.col(i) = states.row(k + 1).transpose() - Coasting(states.row(k));
  }
  mean_ = inputs.rowwise().mean();
  scale_ = DeviationOf(inputs, mean_);
  target_mean_ = targets.rowwise().mean();
  target_scale_ = DeviationOf(targets, target_mean_);
  inputs = scale_.cwiseInverse().asDiagonal() * (inputs.colwise() - mean_);
  targets = target_scale_.cwiseInverse().asDiagonal() * (targets.colwise() - target_mean_);
  for (int member = 0; member < options.members; ++member) {
    PerceptronOptions one = options.perceptron;
    one.seed = options.perceptron.seed + static_cast<unsigned>(member);
    Perceptron& perceptron = members_.emplace_back(kInputs, 4, one);
    Eigen::MatrixXd drawn_inputs = inputs, drawn_targets = targets;
    std::mt19937_64 random = Generator(one.seed, 2);
    for (Eigen::Index i = 0; i < samples && options.members > 1; ++i) {
      const auto j = static_cast<Eigen::Index>(static_cast<double>(samples) * Uniform(&random));
      drawn_inputs.col(i) = inputs.col(j);
      drawn_targets.col(i) = targets.col(j);
    }
    perceptron.Train(drawn_inputs, drawn_targets);
  }
}

bool LearnedStep::Step(long k, const VectorX<double>& x, const VectorX<double>& u,
                       VectorX<double>* next, std::string* error) {
  const Eigen::MatrixXd input = (InputOf(x, u[0]) - mean_).cwiseQuotient(scale_);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(4);
  for (const Perceptron& member : members_) change += member.Evaluate(input).col(0);
  change /= static_cast<double>(members_.size());
  *next = Coasting(x) + target_mean_ + target_scale_.cwiseProduct(change);
  if (next->allFinite()) return true;
  *error = "step " + std::to_string(k) + ": the prediction is not finite";
  return false;
}

bool LearnedStep::Linearise(long k, const VectorX<double>& x, const VectorX<double>& u,
                            VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                            std::string* error) {
  const Eigen::VectorXd input = (InputOf(x, u[0]) - mean_).cwiseQuotient(scale_);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(4);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(4, kInputs), one;
  for (const Perceptron& member : members_) {
    change += member.Evaluate(input, &one);
    sum += one;
  }
  const double share = 1.0 / static_cast<double>(members_.size());
  *next = Coasting(x) + target_mean_ + share * target_scale_.cwiseProduct(change);
  sum = share * target_scale_.asDiagonal() * sum * scale_.cwiseInverse().asDiagonal();
  a->setIdentity(4, 4);
  (*a)(0, 2) = (*a)(1, 3) = kCartPoleStep;
  a->col(1) += sum.col(0) * std::cos(x[1]) - sum.col(1) * std::sin(x[1]);
  a->col(2) += sum.col(2);
  a->col(3) += sum.col(3);
  *b = sum.col(4);
  if (next->allFinite()) return true;
  *error = "step " + std::to_string(k) + ": the prediction is not finite";
  return false;
}

LearnedStepOptions TuneLearnedStep(const CartPoleRecording& recording, int updates, int* tried) {
  const int first = static_cast<int>((1.0 - kValidationShare) * recording.samples());
  const CartPoleRecording head = recording.Head(first);
  LearnedStepOptions best;
  double least = std::numeric_limits<double>::infinity();
  *tried = 0;
  const auto compare = [&](LearnedStepOptions candidate) {
    candidate.perceptron.updates = updates;
    LearnedStep step(head, candidate);
    const double off = ValidationError(&step, recording, first, candidate.half_window);
    ++*tried;
    if (off >= least) return;
    least = off;
    best = candidate;
  };
  for (const int width : {8, 16, 32, 64}) {
    for (const int depth : {1, 2}) {
      for (const double rate : {3e-3, 1e-2}) {
        LearnedStepOptions candidate;
        candidate.perceptron.width = width;
        candidate.perceptron.depth = depth;
        candidate.perceptron.rate = rate;
        compare(candidate);
      }
    }
  }
  for (const int half_window : {1, 3, 4}) {
    LearnedStepOptions candidate = best;
    candidate.half_window = half_window;
    compare(candidate);
  }
  best.perceptron.updates = updates;
  return best;
}

}  // namespace tangible
