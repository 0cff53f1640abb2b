// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Multilayer perceptrons with tanh units, trained by Adam (Kingma, Ba 2015) on mean squared errors:
//
//   a_0 = z,   a_{i+1} = tanh(W_i a_i + b_i),   y = W_d a_d + b_d

#include <Eigen/Core>
#include <vector>

namespace tangible {

struct PerceptronOptions {
  int width = 32;
  int depth = 2;       ///< hidden layers
  double rate = 5e-3;  ///< of Adam at the start; falls to 0 along a cosine
  int updates = 3000;
  int batch = 64;
  unsigned seed = 1;  ///< of the weights and batches
};

class Perceptron {
 public:
  Perceptron(int inputs, int outputs, const PerceptronOptions& options);

  /// The outputs for a batch, a column for each sample.
  Eigen::MatrixXd Evaluate(const Eigen::MatrixXd& inputs) const;
  /// y and ∂y/∂z (outputs x inputs) of one sample.
  Eigen::VectorXd Evaluate(const Eigen::VectorXd& input, Eigen::MatrixXd* jacobian) const;
  /// Half the mean squared error over the batch, and its gradient with respect to all weights.
  double Loss(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
              Eigen::VectorXd* gradient) const;
  void Train(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets);

  /// All weights, layer by layer.
  const Eigen::VectorXd& weights() const { return weights_; }
  Eigen::VectorXd& weights() { return weights_; }

 private:
  struct Layer {
    int inputs, outputs;
    Eigen::Index first;  // of its weights: W, then b
  };
  Eigen::Map<const Eigen::MatrixXd> Matrix(const Layer& layer) const {
    return {weights_.data() + layer.first, layer.outputs, layer.inputs};
  }
  Eigen::Map<const Eigen::VectorXd> Bias(const Layer& layer) const {
    return {weights_.data() + layer.first + layer.outputs * layer.inputs, layer.outputs};
  }

  PerceptronOptions options_;
  std::vector<Layer> layers_;
  Eigen::VectorXd weights_;
};

}  // namespace tangible
