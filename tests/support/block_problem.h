// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A least-squares problem of several blocks in closed form, for tests of the minimiser.
//
//   r_bi = (a_b exp(−k t_i) + c − y_bi) / σ      shared: k > 0 and c; own: a_b
//
// and behind the blocks one prior on k, of one row.

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"

namespace tangible {

class DecayProblem : public LeastSquaresProblem {
 public:
  static constexpr double kRate = 0.8;
  static constexpr double kOffset = -0.3;
  static constexpr double kSigma = 0.01;

  DecayProblem(int num_recordings, unsigned seed, int num_rows = 30)
      : num_recordings_(num_recordings), num_rows_(num_rows) {
    constexpr double kInfinity = HUGE_VAL;
    entries_ = {{"k", 2.0, 0.01, 100.0, true, 2.0}, {"c", 0.1, -kInfinity, kInfinity, false, 1.0}};
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, kSigma);
    for (int b = 0; b < num_recordings; ++b) {
      entries_.push_back({"a" + std::to_string(b), 1.0, -kInfinity, kInfinity, false, 1.0});
      observed_.emplace_back(num_rows);
      for (int i = 0; i < num_rows; ++i) {
        observed_.back()[i] = Amplitude(b) * std::exp(-kRate * Time(i)) + kOffset + normal(random);
      }
    }
  }

  static double Amplitude(int block) { return 1.0 + 0.1 * block; }
  double Time(int i) const { return 3.0 * i / num_rows_; }
  std::vector<Eigen::VectorXd>& observed() { return observed_; }
  std::vector<ParameterEntry>& mutable_entries() { return entries_; }

  std::vector<int> failing;     ///< blocks
  std::vector<double> weights;  ///< of the first blocks
  double prior_sigma = 0.5;     ///< of ln k, around ln kRate

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 2; }
  int num_blocks() const override { return num_recordings_ + 1; }
  int num_own(int block) const override { return block < num_recordings_ ? 1 : 0; }
  int num_rows(int block) const override { return block < num_recordings_ ? num_rows_ : 1; }
  int num_observation_rows(int block) const override {
    return block < num_recordings_ ? num_rows_ : 0;
  }
  double weight(int block) const override {
    return block < static_cast<int>(weights.size()) ? weights[block] : 1.0;
  }
  std::vector<RowPlace> Places(int block) const override {
    std::vector<RowPlace> places;
    for (int i = 0; i < num_observation_rows(block); ++i) {
      places.push_back({0, Time(i), 0.0});
    }
    return places;
  }
  std::string BlockName(int block) const override {
    return "block " + std::to_string(block) + ": ";
  }

  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
    evaluation->rollouts = 1;
    if (std::find(failing.begin(), failing.end(), block) != failing.end()) {
      evaluation->message = "fails";
      return false;
    }
    const int rows = num_rows(block);
    evaluation->residuals.resize(rows);
    if (derivatives == BlockDerivatives::kCompute) {
      evaluation->jacobian.setZero(rows, 2 + num_own(block));
    }
    for (int i = 0; i < rows; ++i) {
      EvaluateRow(block, i, p, evaluation);
    }
    return true;
  }

 private:
  void EvaluateRow(int block, int i, const Eigen::VectorXd& p, BlockEvaluation* evaluation) const {
    const bool derivatives = evaluation->jacobian.size() > 0;
    if (block == num_recordings_) {
      evaluation->residuals[i] = std::log(p[0] / kRate) / prior_sigma;
      if (derivatives) {
        evaluation->jacobian(i, 0) = 1.0 / (p[0] * prior_sigma);
      }
      return;
    }
    const double decay = std::exp(-p[0] * Time(i));
    evaluation->residuals[i] = (p[2] * decay + p[1] - observed_[block][i]) / kSigma;
    if (derivatives) {
      evaluation->jacobian.row(i) =
          Eigen::RowVector3d(-p[2] * Time(i) * decay, 1.0, decay) / kSigma;
    }
  }

  int num_recordings_;
  int num_rows_;
  std::vector<ParameterEntry> entries_;
  std::vector<Eigen::VectorXd> observed_;
};

}  // namespace tangible
