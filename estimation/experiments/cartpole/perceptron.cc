// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/perceptron.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tangible/estimation/experiments/cartpole/tolerances.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

// The constants of Adam, as its authors recommend them.
constexpr double kFirstMoment = 0.9, kSecondMoment = 0.999;

}  // namespace

Perceptron::Perceptron(int inputs, int outputs, const PerceptronOptions& options)
    : options_(options) {
  Eigen::Index first = 0;
  for (int i = 0; i <= options.depth; ++i) {
    const Layer layer{i == 0 ? inputs : options.width, i == options.depth ? outputs : options.width,
                      first};
    layers_.push_back(layer);
    first += static_cast<Eigen::Index>(layer.outputs) * (layer.inputs + 1);
  }
  weights_.setZero(first);
  std::mt19937_64 random = Generator(options.seed, 0);
  for (const Layer& layer : layers_) {
    for (int i = 0; i < layer.inputs * layer.outputs; ++i) {
      weights_[layer.first + i] = Normal(&random) / std::sqrt(layer.inputs);
    }
  }
}

Eigen::MatrixXd Perceptron::Evaluate(const Eigen::MatrixXd& inputs) const {
  Eigen::MatrixXd a = inputs;
  for (const Layer& layer : layers_) {
    a = ((Matrix(layer) * a).colwise() + Eigen::VectorXd(Bias(layer))).eval();
    if (&layer != &layers_.back()) a = a.array().tanh();
  }
  return a;
}

Eigen::VectorXd Perceptron::Evaluate(const Eigen::VectorXd& input,
                                     Eigen::MatrixXd* jacobian) const {
  Eigen::VectorXd a = input;
  for (const Layer& layer : layers_) {
    a = (Matrix(layer) * a + Bias(layer)).eval();
    *jacobian = &layer == &layers_.front() ? Eigen::MatrixXd(Matrix(layer))
                                           : Eigen::MatrixXd(Matrix(layer) * *jacobian);
    if (&layer == &layers_.back()) break;
    a = a.array().tanh();
    *jacobian = (1.0 - a.array().square()).matrix().asDiagonal() * *jacobian;
  }
  return a;
}

double Perceptron::Loss(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                        Eigen::VectorXd* gradient) const {
  std::vector<Eigen::MatrixXd> activations = {inputs};
  for (const Layer& layer : layers_) {
    activations.emplace_back((Matrix(layer) * activations.back()).colwise() +
                             Eigen::VectorXd(Bias(layer)));
    if (&layer != &layers_.back()) activations.back() = activations.back().array().tanh();
  }
  gradient->resize(weights_.size());
  Eigen::MatrixXd bar = (activations.back() - targets) / static_cast<double>(inputs.cols());
  const double loss =
      0.5 * (activations.back() - targets).squaredNorm() / static_cast<double>(inputs.cols());
  for (size_t i = layers_.size(); i-- > 0;) {
    const Layer& layer = layers_[i];
    Eigen::Map<Eigen::MatrixXd>(gradient->data() + layer.first, layer.outputs, layer.inputs) =
        bar * activations[i].transpose();
    gradient->segment(layer.first + layer.outputs * layer.inputs, layer.outputs) =
        bar.rowwise().sum();
    if (i == 0) break;
    bar = (Matrix(layer).transpose() * bar)
              .cwiseProduct((1.0 - activations[i].array().square()).matrix());
  }
  return loss;
}

void Perceptron::Train(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets) {
  std::mt19937_64 random = Generator(options_.seed, 1);
  const auto samples = static_cast<int>(inputs.cols());
  const int batch = std::min(options_.batch, samples);
  Eigen::MatrixXd x(inputs.rows(), batch), y(targets.rows(), batch);
  Eigen::VectorXd gradient, first = Eigen::VectorXd::Zero(weights_.size()), second = first;
  double first_left = 1.0, second_left = 1.0;
  for (int update = 0; update < options_.updates; ++update) {
    for (int i = 0; i < batch; ++i) {
      const int j = batch == samples ? i : static_cast<int>(samples * Uniform(&random));
      x.col(i) = inputs.col(j);
      y.col(i) = targets.col(j);
    }
    Loss(x, y, &gradient);
    first = kFirstMoment * first + (1.0 - kFirstMoment) * gradient;
    second = kSecondMoment * second + (1.0 - kSecondMoment) * gradient.cwiseAbs2();
    first_left *= kFirstMoment;
    second_left *= kSecondMoment;
    const double rate =
        0.5 * options_.rate * (1.0 + std::cos(std::numbers::pi * update / options_.updates));
    weights_.array() -= rate * first.array() / (1.0 - first_left) /
                        ((second.array() / (1.0 - second_left)).sqrt() + kAdamDivisor);
  }
}

}  // namespace tangible
