// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/breakout/agent/paddle_model.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/fit/fit.h"

namespace tangible {
namespace {

constexpr size_t kMostSteps = 400;   // kept to learn from
constexpr int kLeastSteps = 8;       // of which some move
constexpr double kSigma = 0.5;       // pixels, of a position that is seen in whole ones
constexpr double kPriorShare = 3.0;  // deviation of the numbers' prior over its value
constexpr double kForget = 0.98;     // of what is left
constexpr int kMostCounted = 20;     // means and variances are those of about so many steps
constexpr double kUnknown = 100.0;   // pixels²: of a situation that was never seen
constexpr int kLeastVaried = 5;      // steps that a variance of its own takes

template <typename T>
struct Law {
  T gain, drag, free_drag, keep;
  T low, high;

  void Frame(const T& u, T* x, T* v) const {
    using std::abs;
    if (u * *v < T(0.0)) *v *= keep;
    *v = (T(1.0) - free_drag - (drag - free_drag) * abs(u)) * *v + gain * u;
    *x += *v;
    if (*x < low) *x = low, *v = T(0.0);
    if (*x > high) *x = high, *v = T(0.0);
  }
};

template <typename T>
Law<T> LawOf(const PaddleNumbers& numbers, double low, double high) {
  return {T(numbers.gain), T(numbers.drag), T(numbers.free_drag), T(numbers.keep), T(low), T(high)};
}

}  // namespace

std::array<double, kNumPaddleNumbers> NumbersOf(const PaddleNumbers& numbers) {
  return {numbers.gain, numbers.drag, numbers.free_drag, numbers.keep};
}

int DirectionOf(Button button) {
  return button == Button::kRight ? 1 : button == Button::kLeft ? -1 : 0;
}

Button ButtonOf(int direction) {
  return direction > 0 ? Button::kRight : direction < 0 ? Button::kLeft : Button::kNone;
}

// The errors of all recorded steps, as a least-squares problem in the four parameters.
class PaddleWays : public LeastSquaresProblem {
 public:
  explicit PaddleWays(const PaddleModel& model) : model_(model) {
    const std::array<double, kNumPaddleNumbers> guess = NumbersOf(PaddleNumbers());
    const std::array<double, kNumPaddleNumbers> now = NumbersOf(model.numbers());
    const double upper[] = {20.0, 0.99, 0.99, 1.0};
    const double lower[] = {0.05, 0.0, 0.0, 0.0};
    for (int i = 0; i < kNumPaddleNumbers; ++i) {
      entries_.push_back({kPaddleNumberNames[i], std::clamp(now[i], lower[i], upper[i]), lower[i],
                          upper[i], false, guess[i]});
    }
  }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return kNumPaddleNumbers; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return model_.num_steps() + kNumPaddleNumbers; }
  int num_observation_rows(int /*block*/) const override { return model_.num_steps(); }
  std::vector<RowPlace> Places(int /*block*/) const override {
    std::vector<RowPlace> places;
    places.reserve(model_.steps_.size());
    for (int i = 0; i < model_.num_steps(); ++i) places.push_back({0, kFrameSkip / 60.0 * i, 0.0});
    return places;
  }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    using Number = Jet<kNumPaddleNumbers>;
    const Law<Number> law = {Number(p[0], 0), Number(p[1], 1),      Number(p[2], 2),
                             Number(p[3], 3), Number(model_.low()), Number(model_.high())};
    evaluation->residuals.resize(num_rows(0));
    evaluation->jacobian.resize(num_rows(0), kNumPaddleNumbers);
    Number v(0.0);
    for (int i = 0; i < model_.num_steps(); ++i) {
      const PaddleModel::Seen& step = model_.steps_[i];
      if (step.begins) v = Number(0.0);
      Number x(step.before.x);
      for (int frame = 0; frame < kFrameSkip; ++frame) law.Frame(Number(step.direction), &x, &v);
      // A step that ends at a wall carries no information about the law.
      const bool at_wall = model_.AtWall(step.to) || model_.AtWall(step.before.x);
      const Number error = at_wall ? Number(0.0) : (x - step.to) / kSigma;
      evaluation->residuals[i] = error.a;
      evaluation->jacobian.row(i) = error.v.transpose();
    }
    for (int i = 0; i < kNumPaddleNumbers; ++i) {
      const int row = model_.num_steps() + i;
      const double guess = entries_[i].scale;
      evaluation->residuals[row] = (p[i] - guess) / (kPriorShare * guess);
      evaluation->jacobian.row(row).setZero();
      evaluation->jacobian(row, i) = 1.0 / (kPriorShare * guess);
    }
    evaluation->rollouts = 1;
    return evaluation->residuals.allFinite();
  }

 private:
  const PaddleModel& model_;
  std::vector<ParameterEntry> entries_;
};

PaddleModel::Situation PaddleModel::SituationOf(const PaddleState& state, int direction) const {
  Situation situation;
  // Left and right are exchanged where necessary, so that the last press is to the right.
  const int press = direction != 0 ? direction : state.last != 0 ? state.last : state.before;
  if (press < 0) situation.sign = -1.0;
  const int sign = press < 0 ? -1 : 1;
  const int wall = state.x <= low_ ? -sign : state.x >= high_ ? sign : 0;
  situation.beside =
      9 * (sign * state.before + 1) + 3 * (sign * state.last + 1) + sign * direction + 1;
  situation.number = kSequences * (wall + 1 + (state.from_wall ? 3 : 0)) + situation.beside;
  situation.beside += kSequences;
  return situation;
}

const PaddleModel::Rest& PaddleModel::RestOf(const Situation& situation) const {
  const Rest& own = rests_[situation.number];
  return own.count > 0 ? own : rests_[situation.beside];
}

void PaddleModel::Rest::Add(double error) {
  // The mean over all residuals, but over at most about kMostCounted.
  count = std::min(count + 1, kMostCounted);
  const double off = error - mean;
  mean += off / count;
  variance += (off * off - variance) / count;
}

PaddleState PaddleModel::After(const PaddleState& state, int direction, int frames) const {
  const Law<double> law = LawOf<double>(numbers_, low_, high_);
  PaddleState after = state;
  for (int i = 0; i < frames; ++i) law.Frame(direction, &after.x, &after.v);
  const Situation situation = SituationOf(state, direction);
  const double mean = situation.sign * RestOf(situation).mean;
  after.x = std::clamp(after.x + mean * frames / kFrameSkip, low_, high_);
  after.before = state.last;
  after.last = direction;
  after.from_wall = AtWall(state.x);
  return after;
}

double PaddleModel::Variance(const PaddleState& state, int direction) const {
  const Rest& rest = rests_[SituationOf(state, direction).number];
  return rest.count >= kLeastVaried ? rest.variance : rest.count > 0 ? rest_ : kUnknown;
}

PaddleState PaddleModel::Learn(const PaddleState& before, int direction, double x) {
  if (steps_.size() >= kMostSteps) steps_.erase(steps_.begin(), steps_.begin() + kMostSteps / 4);
  steps_.push_back({before, x, direction, sequence_begins_ || steps_.empty()});
  sequence_begins_ = false;
  const Law<double> law = LawOf<double>(numbers_, low_, high_);
  PaddleState after = After(before, direction);
  if (!AtWall(x)) {
    double by_law = before.x, v = before.v;
    for (int i = 0; i < kFrameSkip; ++i) law.Frame(direction, &by_law, &v);
    const Situation situation = SituationOf(before, direction);
    const double error = x - after.x;
    if (rests_[situation.number].count > 0) {
      rest_ = kForget * rest_ + (1.0 - kForget) * error * error;
    }
    rests_[situation.number].Add(situation.sign * (x - by_law));
  } else {
    after.v = 0.0;
  }
  after.x = x;
  return after;
}

void PaddleModel::Average() {
  rests_ = {};
  const Law<double> law = LawOf<double>(numbers_, low_, high_);
  double v = 0.0;
  for (Seen& step : steps_) {
    if (step.begins) v = 0.0;
    step.before.v = v;
    double x = step.before.x;
    for (int i = 0; i < kFrameSkip; ++i) law.Frame(step.direction, &x, &v);
    if (AtWall(step.to)) {
      v = 0.0;
    } else {
      const Situation situation = SituationOf(step.before, step.direction);
      rests_[situation.number].Add(situation.sign * (step.to - x));
    }
  }
}

bool PaddleModel::Fit() {
  int moving = 0;
  for (const Seen& step : steps_) moving += step.direction != 0 ? 1 : 0;
  if (moving < kLeastSteps) return false;
  PaddleWays problem(*this);
  FitOptions options;
  options.approach = FitApproach::kPlain;
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.profile_pass = ProfilePass::kSkip;
  options.threads = 1;
  const FitResult fit = tangible::Fit(options, &problem, {});
  if (fit.estimate.size() != kNumPaddleNumbers || !fit.estimate.allFinite()) return false;
  numbers_ = {fit.estimate[0], fit.estimate[1], fit.estimate[2], fit.estimate[3]};
  Average();
  return true;
}

double PaddleModel::Way(int first, int second, int third) const {
  PaddleState state;
  state.x = 0.5 * (low_ + high_);
  state = After(After(state, first), second);
  const double middle = 0.5 * (low_ + high_);
  state.x = middle;
  state.from_wall = false;
  return After(state, third).x - middle;
}

double PaddleModel::Uncertainty() const { return std::sqrt(rest_); }

bool PaddleStep::Step(long /*k*/, const VectorX<double>& x, const VectorX<double>& u,
                      VectorX<double>* next, std::string* /*error*/) {
  const Law<double> law = LawOf<double>(model_.numbers(), model_.low(), model_.high());
  double position = x[0], speed = x[1];
  for (int i = 0; i < kFrameSkip; ++i) law.Frame(u[0], &position, &speed);
  *next = Eigen::Vector2d(position, speed);
  return true;
}

bool PaddleStep::Linearise(long /*k*/, const VectorX<double>& x, const VectorX<double>& u,
                           VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                           std::string* /*error*/) {
  using Number = Jet<3>;
  const Law<Number> law = LawOf<Number>(model_.numbers(), model_.low(), model_.high());
  Number position(x[0], 0), speed(x[1], 1);
  const Number press(u[0], 2);
  for (int i = 0; i < kFrameSkip; ++i) law.Frame(press, &position, &speed);
  *next = Eigen::Vector2d(position.a, speed.a);
  a->resize(2, 2);
  b->resize(2, 1);
  *a << position.v[0], position.v[1], speed.v[0], speed.v[1];
  *b << position.v[2], speed.v[2];
  return true;
}

}  // namespace tangible
