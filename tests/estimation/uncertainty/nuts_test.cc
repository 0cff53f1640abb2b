// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/nuts.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "tangible/estimation/uncertainty/chain_statistics.h"

namespace tangible {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Sampled {
  std::vector<NutsChain> chains;
  /// One quantity: a row each draw, a column each chain.
  template <typename Function>
  MatrixXd Of(const Function& quantity) const {
    MatrixXd values(chains[0].draws.rows(), static_cast<Eigen::Index>(chains.size()));
    for (size_t j = 0; j < chains.size(); ++j) {
      for (Eigen::Index i = 0; i < values.rows(); ++i) {
        values(i, static_cast<Eigen::Index>(j)) = quantity(VectorXd(chains[j].draws.row(i)));
      }
    }
    return values;
  }
};

Sampled Sample(const LogDensity& density, const VectorXd& start, const MatrixXd& factor,
               const NutsOptions& options) {
  Sampled sampled;
  for (unsigned chain = 0; chain < 4; ++chain) {
    RandomStream random(5, chain);
    sampled.chains.push_back(SampleNuts(density, start, factor, options, &random));
    EXPECT_EQ(sampled.chains.back().message, "");
  }
  return sampled;
}

/// The mean of a quantity is what it should be, to four of its standard errors.
void ExpectMean(const MatrixXd& values, double expected, const char* what) {
  const ChainStatistics of = DescribeChains(values);
  EXPECT_LT(of.r_hat, 1.02) << what;
  EXPECT_NEAR(of.mean, expected, 4.0 * of.deviation / std::sqrt(of.ess_bulk)) << what;
}

/// ln π = −1/2 (x − m)ᵀ A (x − m).
LogDensity GaussianDensity(const VectorXd& mean, const MatrixXd& covariance) {
  const MatrixXd inverse = covariance.inverse();
  return [mean, inverse](const VectorXd& x, double* value, VectorXd* gradient) {
    *gradient = -inverse * (x - mean);
    *value = 0.5 * gradient->dot(x - mean);
    return true;
  };
}

// Two modes, sixteen deviations apart, of which one has seven tenths: a chain never leaves the one
// in which it began, but with temperatures, which leave the density as it is.
TEST(NutsTest, TemperaturesPassBetweenModes) {
  const VectorXd modes[2] = {Eigen::Vector2d(-8.0, 0.0), Eigen::Vector2d(8.0, 2.0)};
  const double shares[2] = {0.3, 0.7};
  const LogDensity density = [&](const VectorXd& x, double* value, VectorXd* gradient) {
    double sum = 0.0;
    gradient->setZero(2);
    // About the nearer mode, so that neither underflows.
    const double least = std::min((x - modes[0]).squaredNorm(), (x - modes[1]).squaredNorm());
    for (int k = 0; k < 2; ++k) {
      const VectorXd off = x - modes[k];
      const double part = shares[k] * std::exp(0.5 * (least - off.squaredNorm()));
      sum += part;
      *gradient -= part * off;
    }
    *gradient /= sum;
    *value = std::log(sum) - 0.5 * least;
    return true;
  };
  NutsOptions options;
  options.warm_up = 500;
  options.draws = 4000;
  const auto is_second = [](const VectorXd& x) { return x[0] > 0.0 ? 1.0 : 0.0; };
  const MatrixXd factor = MatrixXd::Identity(2, 2);
  EXPECT_EQ(Sample(density, modes[0], factor, options).Of(is_second).sum(), 0.0);
  options.temperatures = 7;
  const Sampled sampled = Sample(density, modes[0], factor, options);
  ExpectMean(sampled.Of(is_second), 0.7, "the share of a mode");
  ExpectMean(
      sampled.Of([&](const VectorXd& x) { return (x - modes[x[0] > 0.0 ? 1 : 0]).squaredNorm(); }),
      2.0, "the width of the modes");
  for (const NutsChain& chain : sampled.chains) {
    EXPECT_GT(chain.exchanged, 0.2);
    EXPECT_LT(chain.exchanged, 1.0);
  }
}

// Deviations from 0.01 to 100 with correlations, from a factor that knows nothing of them: the
// windows of the warm-up find it. Moments and quantiles are those of the distribution.
TEST(NutsTest, GaussianWithCorrelations) {
  const VectorXd mean = Eigen::Vector3d(1.0, -200.0, 0.05);
  MatrixXd covariance(3, 3);
  covariance << 1.0, 90.0, 0.001, 90.0, 1e4, -0.2, 0.001, -0.2, 1e-4;
  NutsOptions options;
  options.warm_up = 1000;
  options.draws = 2000;
  const Sampled sampled =
      Sample(GaussianDensity(mean, covariance), mean, MatrixXd::Identity(3, 3), options);
  for (int i = 0; i < 3; ++i) {
    ExpectMean(sampled.Of([i](const VectorXd& x) { return x[i]; }), mean[i], "mean");
    for (int j = 0; j <= i; ++j) {
      ExpectMean(sampled.Of([&](const VectorXd& x) { return (x[i] - mean[i]) * (x[j] - mean[j]); }),
                 covariance(i, j), "covariance");
    }
    const double edge = mean[i] - 1.959964 * std::sqrt(covariance(i, i));
    ExpectMean(sampled.Of([&](const VectorXd& x) { return x[i] < edge ? 1.0 : 0.0; }), 0.025,
               "tail");
  }
  for (const NutsChain& chain : sampled.chains) {
    EXPECT_EQ(chain.divergences, 0);
    EXPECT_EQ(chain.saturated, 0);
    // Dual averaging learns from trajectories, and ends a little above its target.
    EXPECT_GT(chain.acceptance, options.target - 0.05);
    EXPECT_LT(chain.acceptance, options.target + 0.15);
    // The factor was found: a transition takes a few steps, and not those of a condition of 1e4.
    EXPECT_LT(chain.evaluations, 60 * 3000);
  }
}

// With the true factor few draws of a warm-up do no harm, in a hundred dimensions too.
TEST(NutsTest, TheFactorThatIsGivenIsOfUse) {
  const Eigen::Index n = 100;
  VectorXd deviations(n);
  for (Eigen::Index i = 0; i < n; ++i) deviations[i] = std::exp(0.1 * static_cast<double>(i) - 5.0);
  NutsOptions options;
  options.warm_up = 100;
  options.draws = 200;
  const Sampled sampled =
      Sample(GaussianDensity(VectorXd::Zero(n), deviations.array().square().matrix().asDiagonal()),
             VectorXd::Zero(n), deviations.asDiagonal(), options);
  for (const Eigen::Index i : {Eigen::Index{0}, n / 2, n - 1}) {
    ExpectMean(sampled.Of([&](const VectorXd& x) { return x[i] / deviations[i]; }), 0.0, "mean");
    ExpectMean(sampled.Of([&](const VectorXd& x) { return std::pow(x[i] / deviations[i], 2); }),
               1.0, "variance");
  }
  for (const NutsChain& chain : sampled.chains) EXPECT_LT(chain.evaluations, 300 * 20);
}

// A banana: x normal, y = x² + 0.5 e with normal e.
TEST(NutsTest, Banana) {
  const LogDensity density = [](const VectorXd& x, double* value, VectorXd* gradient) {
    const double rest = (x[1] - x[0] * x[0]) / 0.25;
    *value = -0.5 * x[0] * x[0] - 0.5 * rest * (x[1] - x[0] * x[0]);
    *gradient = Eigen::Vector2d(-x[0] + 2.0 * x[0] * rest, -rest);
    return true;
  };
  NutsOptions options;
  options.warm_up = 500;
  options.draws = 20000;
  options.target = 0.9;
  const Sampled sampled =
      Sample(density, Eigen::Vector2d(1.0, 1.0), MatrixXd::Identity(2, 2), options);
  ExpectMean(sampled.Of([](const VectorXd& x) { return x[0]; }), 0.0, "x");
  ExpectMean(sampled.Of([](const VectorXd& x) { return x[0] * x[0]; }), 1.0, "x²");
  ExpectMean(sampled.Of([](const VectorXd& x) { return x[1]; }), 1.0, "y");
  ExpectMean(sampled.Of([](const VectorXd& x) { return std::abs(x[0]) > 2.0 ? 1.0 : 0.0; }),
             std::erfc(std::sqrt(2.0)), "tails of x");
  const auto rest = [](const VectorXd& x) { return (x[1] - x[0] * x[0]) / 0.5; };
  ExpectMean(sampled.Of(rest), 0.0, "e");
  ExpectMean(sampled.Of([&](const VectorXd& x) { return std::pow(rest(x), 2); }), 1.0, "e²");
  // It is independent of x, in the tails too.
  ExpectMean(sampled.Of([&](const VectorXd& x) {
    return std::abs(x[0]) > 1.5 ? std::pow(rest(x), 2) - 1.0 : 0.0;
  }),
             0.0, "e² where x is large");
}

// A funnel, in which a step that is right in the wide part is too long in the neck: it is said.
TEST(NutsTest, DivergencesOfAFunnelAreCounted) {
  const LogDensity density = [](const VectorXd& x, double* value, VectorXd* gradient) {
    // v normal of deviation 3; nine others normal of variance exp(v).
    const double precision = std::exp(-x[0]);
    const double squares = x.tail(9).squaredNorm();
    *value = -x[0] * x[0] / 18.0 - 4.5 * x[0] - 0.5 * precision * squares;
    gradient->resize(10);
    (*gradient)[0] = -x[0] / 9.0 - 4.5 + 0.5 * precision * squares;
    gradient->tail(9) = -precision * x.tail(9);
    return true;
  };
  NutsOptions options;
  options.warm_up = 300;
  options.draws = 1000;
  const Sampled sampled = Sample(density, VectorXd::Zero(10), MatrixXd::Identity(10, 10), options);
  int divergences = 0;
  for (const NutsChain& chain : sampled.chains) divergences += chain.divergences;
  EXPECT_GT(divergences, 0);
}

// |x| of a normal x by its logarithm, with the term of the Jacobian: moments sqrt(2 / π) and 1.
TEST(NutsTest, HalfNormalByItsLogarithm) {
  const LogDensity density = [](const VectorXd& x, double* value, VectorXd* gradient) {
    const double p = std::exp(x[0]);
    *value = -0.5 * p * p + x[0];
    *gradient = VectorXd::Constant(1, -p * p + 1.0);
    return true;
  };
  NutsOptions options;
  options.warm_up = 300;
  options.draws = 3000;
  const Sampled sampled = Sample(density, VectorXd::Zero(1), MatrixXd::Identity(1, 1), options);
  ExpectMean(sampled.Of([](const VectorXd& x) { return std::exp(x[0]); }), std::sqrt(2.0 / M_PI),
             "mean");
  ExpectMean(sampled.Of([](const VectorXd& x) { return std::exp(2.0 * x[0]); }), 1.0, "square");
  // P(|x| < 0.1) = erf(0.1 / sqrt 2)
  ExpectMean(sampled.Of([](const VectorXd& x) { return x[0] < std::log(0.1) ? 1.0 : 0.0; }),
             std::erf(0.1 / std::sqrt(2.0)), "near the bound");
}

// Where the density ends trajectories end too, and none of the draws lies beyond.
TEST(NutsTest, NoDrawWhereTheDensityIsZero) {
  const LogDensity density = [](const VectorXd& x, double* value, VectorXd* gradient) {
    *value = -0.5 * x.squaredNorm();
    *gradient = -x;
    return x[0] > 0.0;
  };
  NutsOptions options;
  options.draws = 2000;
  const Sampled sampled =
      Sample(density, VectorXd::Constant(1, 1.0), MatrixXd::Identity(1, 1), options);
  int divergences = 0;
  for (const NutsChain& chain : sampled.chains) {
    EXPECT_GT(chain.draws.minCoeff(), 0.0);
    divergences += chain.divergences;
  }
  EXPECT_GT(divergences, 0);
  RandomStream random(5, 0);
  const NutsChain none =
      SampleNuts(density, VectorXd::Constant(1, -1.0), MatrixXd::Identity(1, 1), options, &random);
  EXPECT_NE(none.message, "");
  EXPECT_EQ(none.draws.rows(), 0);
}

TEST(NutsTest, TheSameSeedGivesTheSameBits) {
  const LogDensity density = GaussianDensity(VectorXd::Zero(2), MatrixXd::Identity(2, 2));
  const auto draw = [&](unsigned seed, unsigned stream) {
    RandomStream random(seed, stream);
    return SampleNuts(density, VectorXd::Zero(2), MatrixXd::Identity(2, 2), {}, &random).draws;
  };
  EXPECT_EQ(draw(1, 0), draw(1, 0));
  EXPECT_NE(draw(1, 0), draw(2, 0));
  EXPECT_NE(draw(1, 0), draw(1, 1));
}

TEST(NutsTest, EndsEarlyWhereAskedTo) {
  NutsOptions options;
  int transitions = 0;
  options.progress = [&] { return ++transitions < 250; };
  RandomStream random(1, 0);
  const NutsChain chain = SampleNuts(GaussianDensity(VectorXd::Zero(1), MatrixXd::Identity(1, 1)),
                                     VectorXd::Zero(1), MatrixXd::Identity(1, 1), options, &random);
  EXPECT_EQ(transitions, 250);
  EXPECT_EQ(chain.draws.rows(), 50);
  EXPECT_EQ(chain.log_density.size(), 50);
}

}  // namespace
}  // namespace tangible
