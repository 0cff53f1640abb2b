// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The No-U-Turn sampler: draws from a density of which the logarithm and its gradient are known,
//
//   x = c + L z,   H(z, r) = −ln π(c + L z) + 1/2 rᵀ r                                    (1)
//   r += ε/2 Lᵀ ∇ln π(x),   x += ε L r,   r += ε/2 Lᵀ ∇ln π(x)       one leapfrog step     (2)
//
// with momenta r of unit mass. L, a factor of the covariance that is expected, takes the place of
// the mass matrix. A transition doubles its trajectory forwards or backwards, at random, until the
// trajectory turns back,
//
//   r_first · Σ r ≤ 0   or   r_last · Σ r ≤ 0                                             (3)
//
// over it, or over two neighbouring halves with the first state of the next half; the next draw is
// one of its states with the weights exp(−H), later halves preferred. A state whose H is above the
// first by kDivergent ends the trajectory: the density changes there within a step, and draws from
// such places may be missing ("divergence").
//
// Warm-up: dual averaging of ln ε until the mean acceptance is the target, and L anew from the
// draws of windows, each twice as long as the one before, drawn towards the L before it where the
// draws are few.
//
// Where the density has several modes a chain seldom leaves the one in which it began. With K
// temperatures it consists of K replicas, of π^β with β = 1, 1/2, 1/4, ...: hot ones pass between
// modes. After each transition neighbours i and i + 1, with i even and odd in turn, exchange their
// points with the probability
//
//   min(1, exp((β_i − β_{i+1}) (ln π(x_{i+1}) − ln π(x_i))))                                (4)
//
// which keeps all of their densities; the draws are those of the first.
//
// One chain uses one stream of random numbers, made here, so that the same seed gives the same
// bits wherever and beside whatever other chains it runs.
//
// References: M. D. Hoffman and A. Gelman, Journal of Machine Learning Research 15 (2014) 1593
// (the sampler, dual averaging); M. Betancourt, arXiv 1701.02434 (2017), appendix A (weights of
// states, (3)); Stan Reference Manual 2.30, "HMC Algorithm Parameters" (windows of the warm-up);
// C. J. Geyer, Computing Science and Statistics 23 (1991) 156 (replicas, (4)).

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <random>
#include <string>

namespace tangible {

/// ln π(x), up to a constant, and its gradient. False where the density is 0 or not known.
using LogDensity =
    std::function<bool(const Eigen::VectorXd& x, double* value, Eigen::VectorXd* gradient)>;

/// Random numbers whose bits do not depend on the library.
class RandomStream {
 public:
  RandomStream(std::uint32_t seed, std::uint32_t stream);
  double Uniform();  ///< in (0, 1)
  double Normal();
  Eigen::VectorXd Normals(Eigen::Index size);

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

struct NutsOptions {
  int warm_up = 200;     ///< transitions whose draws are not kept
  int draws = 250;       ///< that are kept
  int max_depth = 10;    ///< a transition has at most 2^max_depth − 1 steps
  double target = 0.8;   ///< mean acceptance, in (0, 1)
  int temperatures = 1;  ///< K
  /// Called after each transition; false ends the chain early. May be empty.
  std::function<bool()> progress;
};

struct NutsChain {
  Eigen::MatrixXd draws;        ///< a row each; fewer than asked for where it ended early
  Eigen::VectorXd log_density;  ///< of each draw
  int divergences = 0;          ///< of the transitions that are kept
  int saturated = 0;            ///< of these that ended at max_depth
  double step = 0.0;            ///< ε after the warm-up
  double acceptance = 0.0;      ///< mean, of the transitions that are kept
  /// The share of exchanges that were accepted, after the warm-up, of the neighbours with the
  /// least; 1 with one temperature.
  double exchanged = 1.0;
  long evaluations = 0;
  std::string message;  ///< why there are no draws, or empty
};

/// One chain from `start`, at which the density is positive, with the first L, n x n.
NutsChain SampleNuts(const LogDensity& density, const Eigen::VectorXd& start,
                     const Eigen::MatrixXd& factor, const NutsOptions& options,
                     RandomStream* random);

}  // namespace tangible
