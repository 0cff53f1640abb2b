// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/nuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

constexpr double kInfiniteEnergy = std::numeric_limits<double>::infinity();

/// ln(exp(a) + exp(b)).
double LogSum(double a, double b) {
  const double high = std::max(a, b);
  return std::isinf(high) ? high : high + std::log1p(std::exp(std::min(a, b) - high));
}

/// A point with what is known of it.
struct Place {
  Eigen::VectorXd x;
  double value = 0.0;  ///< ln π
  Eigen::VectorXd gradient;
};

/// A state of (1).
struct PhasePoint {
  Place place;
  Eigen::VectorXd r;
};

/// States that follow each other in time.
struct Trajectory {
  Eigen::VectorXd near;      ///< r of the state where it began
  Eigen::VectorXd far;       ///< r of the last one
  Eigen::VectorXd momentum;  ///< Σ r
  double log_weight = 0.0;   ///< ln Σ exp(H_0 − H)
  Place proposal;
};

bool GoesOn(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& momentum) {
  return a.dot(momentum) > 0.0 && b.dot(momentum) > 0.0;
}

/// (3) of a trajectory from state a_far by a_near and b_near to b_far, where it consists of two
/// neighbouring ones with these sums of momenta.
bool GoesOnOver(const Eigen::VectorXd& a_far, const Eigen::VectorXd& a_near,
                const Eigen::VectorXd& b_near, const Eigen::VectorXd& b_far,
                const Eigen::VectorXd& a_sum, const Eigen::VectorXd& b_sum) {
  return GoesOn(a_far, b_far, a_sum + b_sum) && GoesOn(a_far, b_near, a_sum + b_near) &&
         GoesOn(a_near, b_far, b_sum + a_near);
}

/// Of Hoffman and Gelman, section 3.2.
class DualAveraging {
 public:
  explicit DualAveraging(double target) : target_(target) {}

  void Restart(double step) {
    towards_ = std::log(10.0 * step);
    mean_error_ = 0.0;
    mean_log_ = 0.0;
    count_ = 0;
  }
  /// The step of the next transition after one with this acceptance.
  double Learn(double acceptance) {
    constexpr double kShrinkage = 0.05, kDelay = 10.0, kDecay = 0.75;
    ++count_;
    const double share = 1.0 / (count_ + kDelay);
    mean_error_ = (1.0 - share) * mean_error_ + share * (target_ - std::min(1.0, acceptance));
    const double logarithm = towards_ - mean_error_ * std::sqrt(count_) / kShrinkage;
    const double weight = std::pow(count_, -kDecay);
    mean_log_ = weight * logarithm + (1.0 - weight) * mean_log_;
    return std::exp(logarithm);
  }
  double MeanStep() const { return std::exp(mean_log_); }
  bool HasLearnt() const { return count_ > 0.0; }

 private:
  double target_;
  double towards_ = 0.0, mean_error_ = 0.0, mean_log_ = 0.0, count_ = 0.0;
};

/// The warm-up's transitions after which L is computed anew: the ends of windows that double, with
/// the first 15 % and the last 10 % left to the step alone.
std::vector<int> EndsOfWindows(int warm_up) {
  constexpr int kLeast = 20, kFirstWindow = 25;
  if (warm_up < kLeast) return {};
  const int first = std::min(75, (15 * warm_up) / 100);
  const int last = warm_up - std::min(50, warm_up / 10);
  std::vector<int> ends;
  int at = first;
  for (int width = kFirstWindow; at < last; width *= 2) {
    // A window that leaves no room for the next one takes the rest.
    const int end = at + 3 * width > last ? last : at + width;
    ends.push_back(end);
    at = end;
  }
  return ends;
}

/// One replica, of π^β.
class Sampler {
 public:
  Sampler(const LogDensity& density, double beta, const Eigen::MatrixXd& factor,
          const NutsOptions& options, RandomStream* random)
      : density_(density),
        beta_(beta),
        options_(options),
        random_(random),
        factor_(factor / std::sqrt(beta)),
        ends_(EndsOfWindows(options.warm_up)),
        averaging_(options.target) {}

  /// False where the density is 0 or not known there.
  bool Begin(const Eigen::VectorXd& start) {
    now_.x = start;
    if (!Evaluate(&now_)) return false;
    step_ = FirstStep(1.0);
    averaging_.Restart(step_);
    return true;
  }

  /// Transition i of the warm-up, which learns.
  void WarmUp(int i) {
    Transition(step_);
    step_ = averaging_.Learn(Acceptance());
    if (i >= std::min(75, (15 * options_.warm_up) / 100)) window_.push_back(now_.x);
    if (next_end_ < ends_.size() && i + 1 == ends_[next_end_]) {
      Learn(window_);
      window_.clear();
      ++next_end_;
      step_ = FirstStep(averaging_.MeanStep());
      averaging_.Restart(step_);
    }
  }

  void EndWarmUp() {
    if (averaging_.HasLearnt()) step_ = averaging_.MeanStep();
  }

  void Draw() { Transition(step_); }

  /// (4). Whether it was accepted.
  static bool Exchange(Sampler* a, Sampler* b, RandomStream* random) {
    const double gain = (a->beta_ - b->beta_) * (b->log_density() - a->log_density());
    if (!(std::log(random->Uniform()) < gain)) return false;
    std::swap(a->now_, b->now_);
    for (Sampler* const one : {a, b}) {
      // What the other one knew is of its own power.
      const double power = one->beta_ / (one == a ? b : a)->beta_;
      one->now_.value *= power;
      one->now_.gradient *= power;
    }
    return true;
  }

  const Eigen::VectorXd& x() const { return now_.x; }
  double log_density() const { return now_.value / beta_; }  ///< ln π
  double step() const { return step_; }
  double Acceptance() const { return steps_ > 0 ? acceptance_ / steps_ : 0.0; }
  bool diverged() const { return diverged_; }
  bool saturated() const { return depth_ == options_.max_depth; }
  long evaluations() const { return evaluations_; }

 private:
  bool Evaluate(Place* place) {
    ++evaluations_;
    if (!density_(place->x, &place->value, &place->gradient) || !std::isfinite(place->value) ||
        !place->gradient.allFinite()) {
      return false;
    }
    place->value *= beta_;
    place->gradient *= beta_;
    return true;
  }

  static double Energy(const PhasePoint& point) {
    return 0.5 * point.r.squaredNorm() - point.place.value;
  }

  /// (2). False where the density is 0.
  bool Leap(double step, PhasePoint* point) {
    const auto upper = factor_.transpose().triangularView<Eigen::Upper>();
    point->r += upper * (0.5 * step * point->place.gradient);
    point->place.x += factor_.triangularView<Eigen::Lower>() * (step * point->r);
    if (!Evaluate(&point->place)) return false;
    point->r += upper * (0.5 * step * point->place.gradient);
    return true;
  }

  /// 2^depth further states beyond `edge`, which becomes the last one. False where one diverges or
  /// they turn back.
  bool Extend(int depth, double step, PhasePoint* edge, Trajectory* made) {
    if (depth == 0) {
      ++steps_;
      const bool possible = Leap(step, edge);
      const double rise = possible ? Energy(*edge) - energy_ : kInfiniteEnergy;
      if (!(rise < kDivergent)) {
        diverged_ = true;
        return false;
      }
      acceptance_ += std::min(1.0, std::exp(-rise));
      *made = {edge->r, edge->r, edge->r, -rise, edge->place};
      return true;
    }
    Trajectory second;
    if (!Extend(depth - 1, step, edge, made) || !Extend(depth - 1, step, edge, &second)) {
      return false;
    }
    const double both = LogSum(made->log_weight, second.log_weight);
    if (random_->Uniform() < std::exp(second.log_weight - both)) {
      made->proposal = std::move(second.proposal);
    }
    const bool goes_on =
        GoesOnOver(made->near, made->far, second.near, second.far, made->momentum, second.momentum);
    made->far = std::move(second.far);
    made->momentum += second.momentum;
    made->log_weight = both;
    return goes_on;
  }

  /// One transition with this step; `now_` becomes the next draw.
  void Transition(double step) {
    PhasePoint ends[2];  // backwards, forwards
    ends[0] = ends[1] = {now_, random_->Normals(now_.x.size())};
    energy_ = Energy(ends[0]);
    Eigen::VectorXd momentum = ends[0].r;
    double log_weight = 0.0;
    acceptance_ = 0.0;
    steps_ = 0;
    diverged_ = false;
    depth_ = 0;
    for (bool goes_on = true; goes_on && depth_ < options_.max_depth; ++depth_) {
      const int side = random_->Uniform() < 0.5 ? 0 : 1;
      const Eigen::VectorXd near = ends[side].r;
      Trajectory half;
      if (!Extend(depth_, side == 1 ? step : -step, &ends[side], &half)) return;
      if (random_->Uniform() < std::exp(half.log_weight - log_weight)) {
        now_ = std::move(half.proposal);
      }
      log_weight = LogSum(log_weight, half.log_weight);
      goes_on = GoesOnOver(ends[1 - side].r, near, half.near, half.far, momentum, half.momentum);
      momentum += half.momentum;
    }
  }

  /// A step at which one leapfrog step is accepted about as often as wanted, near `step`.
  double FirstStep(double step) {
    constexpr int kMostDoublings = 60;
    double direction = 0.0;
    for (int i = 0; i < kMostDoublings; ++i) {
      PhasePoint point{now_, random_->Normals(now_.x.size())};
      const double before = Energy(point);
      const double rise = Leap(step, &point) ? Energy(point) - before : kInfiniteEnergy;
      const double wanted = -rise > std::log(options_.target) ? 1.0 : -1.0;
      if (direction == 0.0) direction = wanted;
      if (wanted != direction) break;
      step *= direction > 0.0 ? 2.0 : 0.5;
    }
    return step;
  }

  /// L from draws of a window: their covariance, with the one before counted as P + 5 draws.
  void Learn(const std::vector<Eigen::VectorXd>& window) {
    const auto n = static_cast<Eigen::Index>(window.size());
    const Eigen::Index size = factor_.rows();
    if (n < 2) return;
    Eigen::MatrixXd z(size, n);
    for (Eigen::Index i = 0; i < n; ++i) z.col(i) = window[static_cast<size_t>(i)];
    z.colwise() -= z.rowwise().mean().eval();
    factor_.triangularView<Eigen::Lower>().solveInPlace(z);
    const double before = static_cast<double>(size) + 5.0;
    Eigen::MatrixXd covariance = z * z.transpose();
    covariance.diagonal().array() += before;
    covariance /= static_cast<double>(n - 1) + before;
    const Cholesky cholesky(covariance);
    if (!cholesky.succeeded()) return;
    factor_ = (factor_.triangularView<Eigen::Lower>() * cholesky.Lower()).eval();
  }

  const LogDensity& density_;
  const double beta_;
  const NutsOptions& options_;
  RandomStream* random_;
  Eigen::MatrixXd factor_;
  Place now_;
  double step_ = 1.0;
  long evaluations_ = 0;
  // Of the warm-up.
  std::vector<int> ends_;
  size_t next_end_ = 0;
  DualAveraging averaging_;
  std::vector<Eigen::VectorXd> window_;
  // Of the transition under way.
  double energy_ = 0.0, acceptance_ = 0.0;
  int steps_ = 0, depth_ = 0;
  bool diverged_ = false;
};

/// The replicas of a chain.
class Replicas {
 public:
  Replicas(const LogDensity& density, const Eigen::MatrixXd& factor, const NutsOptions& options,
           RandomStream* random)
      : options_(options), random_(random) {
    samplers_.reserve(static_cast<size_t>(options.temperatures));
    for (int k = 0; k < options.temperatures; ++k) {
      samplers_.emplace_back(density, std::ldexp(1.0, -k), factor, options, random);
    }
    accepted_.assign(samplers_.size(), 0);
    tried_.assign(samplers_.size(), 0);
  }

  NutsChain Run(const Eigen::VectorXd& start) {
    NutsChain chain;
    for (Sampler& sampler : samplers_) {
      if (!sampler.Begin(start)) {
        chain.message = "the density at the start is 0 or not known";
        return chain;
      }
    }
    if (WarmUp()) Draw(&chain);
    chain.step = samplers_.front().step();
    for (const Sampler& sampler : samplers_) chain.evaluations += sampler.evaluations();
    return chain;
  }

 private:
  /// False where the caller ends it.
  bool WarmUp() {
    for (int i = 0; i < options_.warm_up; ++i) {
      for (Sampler& sampler : samplers_) sampler.WarmUp(i);
      Exchange(i);
      if (options_.progress && !options_.progress()) return false;
    }
    for (Sampler& sampler : samplers_) sampler.EndWarmUp();
    accepted_.assign(samplers_.size(), 0);
    tried_.assign(samplers_.size(), 0);
    return true;
  }

  void Exchange(int i) {
    for (size_t k = static_cast<size_t>(i % 2); k + 1 < samplers_.size(); k += 2) {
      ++tried_[k];
      accepted_[k] += Sampler::Exchange(&samplers_[k], &samplers_[k + 1], random_) ? 1 : 0;
    }
  }

  void Draw(NutsChain* chain) {
    Sampler& first = samplers_.front();
    chain->draws.resize(options_.draws, first.x().size());
    chain->log_density.resize(options_.draws);
    int made = 0;
    while (made < options_.draws) {
      for (Sampler& sampler : samplers_) sampler.Draw();
      chain->divergences += first.diverged() ? 1 : 0;
      chain->saturated += first.saturated() ? 1 : 0;
      chain->acceptance += first.Acceptance();
      Exchange(made);
      chain->draws.row(made) = first.x();
      chain->log_density[made++] = first.log_density();
      if (options_.progress && !options_.progress()) break;
    }
    chain->draws.conservativeResize(made, Eigen::NoChange);
    chain->log_density.conservativeResize(made);
    chain->acceptance /= std::max(1, made);
    for (size_t k = 0; k + 1 < samplers_.size(); ++k) {
      chain->exchanged =
          std::min(chain->exchanged, static_cast<double>(accepted_[k]) / std::max(1, tried_[k]));
    }
  }

  const NutsOptions& options_;
  RandomStream* random_;
  std::vector<Sampler> samplers_;
  std::vector<int> accepted_, tried_;  ///< of the replicas k and k + 1
};

}  // namespace

RandomStream::RandomStream(std::uint32_t seed, std::uint32_t stream) {
  std::seed_seq sequence{seed, stream};
  engine_.seed(sequence);
}

double RandomStream::Uniform() {
  // The middles of 2^52 equal parts, which are doubles and neither 0 nor 1.
  return (static_cast<double>(engine_() >> 12) + 0.5) * 0x1p-52;
}

double RandomStream::Normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2.0 * std::log(Uniform()));
  const double angle = 2.0 * M_PI * Uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

Eigen::VectorXd RandomStream::Normals(Eigen::Index size) {
  Eigen::VectorXd values(size);
  for (double& value : values) value = Normal();
  return values;
}

NutsChain SampleNuts(const LogDensity& density, const Eigen::VectorXd& start,
                     const Eigen::MatrixXd& factor, const NutsOptions& options,
                     RandomStream* random) {
  return Replicas(density, factor, options, random).Run(start);
}

}  // namespace tangible
