// SPDX-License-Identifier: Apache-2.0
//
// One-sided derivatives of event stepping at a kink, and of fixed steps where a force's window ends
// on a step's end, at kinks of supports and servos, and where another corner takes over: limits of
// the derivative on one side,
//
//   lim D(p + τ) for τ → 0 from one side,     D(p + τ): the tangent at p + τ, exact there
//
// from three τ, extrapolated by a parabola. Where the map is continuous at p and smooth beside it,
// that is the one-sided derivative (by the mean value theorem). Both are checked: the
// extrapolations of first and second order must agree, and the values at p + τ must be those at p
// and the integral of the derivative between. A square root (a gap that just closes) fails the
// first check, a jump (a flat landing) the second. Where they fail close to p they are tried again
// farther away: the landing of a body that rises by less than the touching tolerance is found late,
// by √(2 tolerance / g), which matters where it then jams.
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "tangible/dynamics/model/tolerances.h"
#include "tangible/simulation/gradient/gradient_methods.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible::internal {
namespace {

constexpr double kFarther = 8.0;  // factor of each further attempt
constexpr int kMostWays = 3;

// The outputs at p + τ, and their derivative.
struct AtSide {
  VectorX<double> values;
  VectorX<double> derivative;
};

class OneSided {
 public:
  OneSided(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
           GradientResult* result)
      : problem_(problem),
        sign_(side == DerivativeSide::kPlus ? 1.0 : -1.0),
        worker_(worker),
        result_(*result) {}

  // The derivative with respect to a parameter; false with a message where there is none from this
  // side.
  bool Column(int k, VectorX<double>* column) {
    const ParameterPath& parameter = problem_.parameter(k);
    const double first = kSideWay * std::max(std::abs(parameter.value), parameter.scale);
    std::string message;
    for (int i = 0; i < kMostWays; ++i) {
      if (Extrapolate(k, first, std::pow(kFarther, i), column)) {
        result_.message.clear();
        return true;
      }
      // The message of the nearest attempt is reported.
      message = i == 0 ? result_.message : message;
    }
    result_.message = message;
    return false;
  }

  // The difference between the two orders of extrapolation, relative to a column's largest entry.
  double apart() const { return apart_; }

 private:
  // Extrapolates from p + τ, p + τ / 2, p + τ / 4 with τ = `times` the first distance.
  bool Extrapolate(int k, double first_way, double times, VectorX<double>* column) {
    const ParameterPath& parameter = problem_.parameter(k);
    const double way = sign_ * times * first_way;
    std::array<AtSide, 3> at;
    for (int i = 0; i < 3; ++i) {
      if (!Evaluate(k, way / (1 << i), &at[i])) {
        return false;
      }
    }
    const VectorX<double> first = 2.0 * at[2].derivative - at[1].derivative;
    *column = (at[0].derivative - 6.0 * at[1].derivative + 8.0 * at[2].derivative) / 3.0;
    // Scenes have sizes of about 1 in SI units, so that values of rounding alone are none.
    const double values = std::max(1.0, result_.values.cwiseAbs().maxCoeff());
    const double none = kNoDerivative * kSideWay * values / first_way;
    const double size = std::max(column->cwiseAbs().maxCoeff(), none);
    const double apart = (first - *column).cwiseAbs().maxCoeff();
    // Where bodies rest and nothing depends on the parameter, the derivatives are rounding.
    if (!(apart <= kSidesConverged * size + none)) {
      return Fail(parameter, "derivatives beside it do not converge: its largest is " + Text(size) +
                                 " or differs by " + Text(apart));
    }
    // Simpson's rule.
    const VectorX<double> expected =
        result_.values + way / 6.0 * (*column + 4.0 * at[1].derivative + at[0].derivative);
    for (Eigen::Index i = 0; i < expected.size(); ++i) {
      const double missed = std::abs(at[0].values[i] - expected[i]);
      const double bound = kContinuous * first_way * size + kValueRounding * values;
      if (!(missed <= bound)) {
        return Fail(parameter, result_.outputs[i] + " jumps by " + Text(missed));
      }
    }
    apart_ = std::max(apart_, size > 0.0 ? apart / size : 0.0);
    return true;
  }

  static std::string Text(double x) {
    std::ostringstream text;
    text << x;
    return text.str();
  }

  bool Fail(const ParameterPath& parameter, const std::string& reason) {
    result_.message = "parameter " + parameter.path + ": no derivative from " +
                      (sign_ > 0.0 ? "above: " : "below: ") + reason +
                      "; the certificate: " + result_.certificate.verdict;
    return false;
  }

  bool Evaluate(int k, double shift, AtSide* at) {
    const ParameterPath& parameter = problem_.parameter(k);
    const RolloutOutput output = worker_->TangentBeside(problem_.input, k, shift, &at->derivative);
    if (output.status == RolloutStatus::kRefused) {
      return Fail(parameter, "its range ends within " + Text(std::abs(shift)) + ", expected " +
                                 Describe(parameter.kind));
    }
    result_.message = FailureOf(problem_, output);
    if (!result_.message.empty()) {
      result_.message += ", with " + parameter.path + " changed by " + Text(shift);
      return false;
    }
    at->values = output.states.row(0).transpose();
    return true;
  }

  const GradientProblem& problem_;
  double sign_;
  RolloutWorker* worker_;
  GradientResult& result_;
  double apart_ = 0.0;
};

// Whether a parameter sets an end of a force's window that is an end of a step.
bool IsEdgeOnAStep(const GradientProblem& problem, const ParameterPath& parameter) {
  const SimulationSettings& settings = problem.settings();
  Scene scene = problem.scene();
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
  return std::any_of(parameter.numbers.begin(), parameter.numbers.end(), [&](int number) {
    const std::string& path = numbers[number].path;
    const std::string last = path.substr(path.rfind('/') + 1);
    if (path.rfind("forces/", 0) != 0 || (last != "start" && last != "end")) return false;
    const double time = *numbers[number].value;
    const double nearest =
        std::clamp(std::round(time / settings.dt), 0.0, static_cast<double>(NumSteps(settings)));
    return std::abs(time - StepTime(settings, std::lround(nearest))) <= kSameTime * settings.dt;
  });
}

}  // namespace

bool EdgesBySides(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
                  GradientResult* result) {
  OneSided sides(problem, side, worker, result);
  for (int k = 0; k < problem.num_parameters(); ++k) {
    const ParameterPath& parameter = problem.parameter(k);
    if (!IsEdgeOnAStep(problem, parameter)) continue;
    VectorX<double> column;
    if (!sides.Column(k, &column)) return false;
    result->jacobian.col(k) = column;
    result->notes.push_back(parameter.path +
                            " is a step's end: its one-sided derivative is the limit of those "
                            "beside it, extrapolated");
  }
  return true;
}

bool JacobianBySides(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
                     GradientResult* result) {
  if (!Take(problem, worker->Run(problem.input), result)) return false;
  result->jacobian.resize(result->values.size(), problem.num_parameters());
  OneSided sides(problem, side, worker, result);
  for (int k = 0; k < problem.num_parameters(); ++k) {
    VectorX<double> column;
    if (!sides.Column(k, &column)) return false;
    result->jacobian.col(k) = column;
  }
  std::ostringstream note;
  note << "one-sided derivatives are limits of those beside the kink, extrapolated; orders of "
          "extrapolation differ by "
       << sides.apart() << " of a column";
  result->notes.push_back(note.str());
  return true;
}

}  // namespace tangible::internal
