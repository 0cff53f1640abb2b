// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/coincidences.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/verification/support/coincidence_maker.h"

namespace tangible {
namespace {

constexpr char kAtAStepsEnd[] = "coincidence: at a step's end";
constexpr char kAtTheStart[] = "coincidence: at the start";
constexpr char kAtTheEndOfTheRun[] = "coincidence: at the end of the run";
constexpr char kSymmetric[] = "coincidence: two at one instant, symmetric";
constexpr char kPoisson[] = "coincidence: Poisson's phases";
constexpr char kOfTwoKinds[] = "coincidence: two at one instant, of two kinds";

// Of the parameter: the longest way to where derivatives are taken. The next kink is mostly a step
// away. Where derivatives change on the way, or the outputs by more than these say, it is within
// it, and a shorter way is tried.
constexpr long double kWay = 1e-6L;
constexpr long double kShorter = 1e-2L;
constexpr int kMostWays = 3;
constexpr long double kBent = 1e-4L;
// The size of a parameter that is 0: where a coincidence moves with the square of the way (that of
// the speed at the top of a fall), the square must exceed the rounding of the scene's numbers.
constexpr long double kSizeOfZero = 1.0L;
// At most that of a coordinate, m: how far from the origin an element stands says nothing of it.
constexpr long double kSizeOfPlace = 10.0L;
// Between two elements, m.
constexpr double kApart = 100.0;
// Of the output: what is left after the derivative over that way is a jump.
constexpr long double kJump = 1e-8L;

using Map = std::map<std::string, Real>;

std::vector<Real> Outputs(const Coincidence& coincidence, const Map& numbers) {
  return coincidence.outputs([&](const std::string& path) { return numbers.at(path); });
}

long double LargestOf(const std::vector<long double>& x) {
  long double largest = 0.0L;
  for (const long double one : x) largest = std::max(largest, std::abs(one));
  return largest;
}

// The derivative on one side: those beside the parameter, extrapolated to it by a parabola. NaN
// where an output jumps at the parameter.
VectorX<double> Side(const Coincidence& coincidence, const Map& at, const std::vector<Real>& values,
                     const std::string& path, long double sign) {
  const Real value = at.at(path);
  const bool is_place = path.find("/position/") != std::string::npos;
  const long double size = value.value == 0.0L ? kSizeOfZero
                           : is_place          ? std::min(std::abs(value.value), kSizeOfPlace)
                                               : std::abs(value.value);
  constexpr long double kPoints[3] = {1.0L, 0.5L, 0.25L};
  constexpr long double kWeights[3] = {1.0L / 3.0L, -2.0L, 8.0L / 3.0L};
  constexpr long double kBends[3] = {1.0L, -3.0L, 2.0L};  // 0 for rates along a straight line
  long double way = sign * kWay * size;
  std::vector<long double> sum;
  std::vector<Real> outputs;  // in the end those of the nearest point
  for (int tries = 1;; ++tries) {
    std::vector<long double> bend(values.size(), 0.0L);
    sum.assign(values.size(), 0.0L);
    for (int k = 0; k < 3; ++k) {
      Map beside = at;
      beside[path] = Real(value.value + kPoints[k] * way, 1.0L);
      outputs = Outputs(coincidence, beside);
      for (size_t i = 0; i < outputs.size(); ++i) {
        sum[i] += kWeights[k] * outputs[i].rate;
        bend[i] += kBends[k] * outputs[i].rate;
      }
    }
    std::vector<long double> apart(values.size());
    for (size_t i = 0; i < outputs.size(); ++i) {
      apart[i] = outputs[i].value - values[i].value - kPoints[2] * way * sum[i];
    }
    const long double most = kBent * LargestOf(sum);
    const bool bends = LargestOf(bend) > most || LargestOf(apart) > most * std::abs(way);
    if (!bends || tries == kMostWays) break;
    way *= kShorter;
  }
  VectorX<double> side(static_cast<Eigen::Index>(sum.size()));
  for (size_t i = 0; i < sum.size(); ++i) {
    const long double expected = values[i].value + kPoints[2] * way * sum[i];
    const bool jumps =
        std::abs(outputs[i].value - expected) > kJump * std::max(1.0L, std::abs(values[i].value));
    side[static_cast<Eigen::Index>(i)] =
        jumps ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(sum[i]);
  }
  return side;
}

}  // namespace

namespace internal {

Map NumbersOf(const Scene& scene) {
  Scene copy = scene;
  Map numbers;
  for (const SceneNumber<double>& number : EnumerateNumbers(&copy)) {
    numbers[number.path] = *number.value;
  }
  return numbers;
}

CoincidenceMaker::CoincidenceMaker(unsigned seed, Stepping stepping)
    : random_(0xc01dULL + 0x9e3779b97f4a7c15ULL * seed) {
  made_.scene.name = "coincidence " + std::to_string(seed);
  made_.scene.simulation.stepping = stepping;
}

Coincidence CoincidenceMaker::Make() {
  Settings();
  const std::vector<Element>& elements = ElementsOf(group_);
  const auto draw = [&] { return random_.Integer(0, static_cast<int>(elements.size()) - 1); };
  const int first = draw();
  const RandomNumbers before = random_;
  Add(elements[first]);
  if (random_.Chance(0.25)) {
    random_ = before;
    mirror_ = -1.0;
    Add(elements[first]);
    made_.kinds.emplace_back(kSymmetric);
  } else if (random_.Chance(0.35)) {
    Add(elements[draw()]);
    made_.kinds.emplace_back(kOfTwoKinds);
  }
  made_.kinds.emplace_back(count_ == 0   ? kAtTheStart
                           : after_ == 0 ? kAtTheEndOfTheRun
                                         : kAtAStepsEnd);
  if (made_.scene.simulation.stepping == Stepping::kEvent && !varies_ && random_.Chance(0.3)) {
    made_.scene.simulation.integrator = Integrator::kTrapezoidal;
  }
  std::sort(made_.kinds.begin(), made_.kinds.end());
  made_.kinds.erase(std::unique(made_.kinds.begin(), made_.kinds.end()), made_.kinds.end());
  Finish();
  return std::move(made_);
}

void CoincidenceMaker::Settings() {
  SimulationSettings& s = made_.scene.simulation;
  s.dt = Pick({0.25, 0.125, 0.1, 0.05, 0.02, 0.01});
  count_ = random_.Chance(0.12) ? 0 : random_.Integer(1, 5);
  after_ = count_ > 0 && random_.Chance(0.12) ? 0 : random_.Integer(1, 6);
  at_ = count_ * s.dt;
  s.duration = (count_ + after_) * s.dt;
  if (after_ > 1 && random_.Chance(0.2)) s.duration -= 0.4 * s.dt;
  course_.stepping = s.stepping;
  course_.dt = s.dt;
  course_.duration = s.duration;
  course_.steps = count_ + after_;
  if (s.stepping == Stepping::kEvent && random_.Chance(0.25)) s.impact_law = ImpactLaw::kPoisson;
  group_ = static_cast<Group>(random_.Integer(0, 3));
  gravity_ = group_ == Group::kNoGravity ? 0.0 : Pick({10.0, 8.0, 5.0, 2.0});
  made_.scene.gravity = Vector2<double>(0.0, -gravity_);
  if (is_slope()) {
    friction_ = Pick({0.25, 0.5, 0.1, 0.2});
    made_.scene.gravity.x() = (group_ == Group::kSteep ? 2.0 : 0.5) * friction_ * gravity_;
  }
  if (group_ != Group::kNoGravity) {
    BasicBody<double> floor;
    floor.name = "floor";
    floor.motion = Motion::kStatic;
    floor.shape = {ShapeType::kHalfPlane, {0.0, 1.0, 0.0}};
    made_.scene.bodies.push_back(floor);
    paths_.emplace_back("gravity/y");
  }
  if (is_slope()) paths_.emplace_back("gravity/x");
}

void CoincidenceMaker::Add(const Element& element) {
  made_.kinds.push_back(std::string("coincidence: ") + element.kind);
  // Farther apart than they come in a run, so that one's closed form knows nothing of the other.
  place_ = kApart * number_;
  (this->*element.add)();
  ++number_;
}

void CoincidenceMaker::NameLaw() {
  if (made_.scene.simulation.impact_law == ImpactLaw::kPoisson) made_.kinds.emplace_back(kPoisson);
}

void CoincidenceMaker::KeepClear(const std::string& body,
                                 const std::function<bool(const NumberAt&)>& is_clear) {
  Map numbers = NumbersOf(made_.scene);
  Real& inertia = numbers.at(body + "inertia");
  const auto at = [&numbers](const std::string& path) { return numbers.at(path); };
  while (!is_clear(at)) inertia = 2.0L * inertia;
  for (BasicBody<double>& one : made_.scene.bodies) {
    if ("bodies/" + one.name + "/" == body) one.inertia = static_cast<double>(inertia);
  }
}

void CoincidenceMaker::Finish() {
  for (const std::string& path : paths_) {
    std::string error;
    ParameterPath parameter;
    if (ResolveParameter(made_.scene, path, &parameter, &error)) {
      made_.parameters.push_back(std::move(parameter));
    }
  }
  if (unknown_) return;
  made_.outputs = [parts = parts_](const NumberAt& at) {
    std::vector<Real> all;
    for (const auto& part : parts) {
      const std::vector<Real> outputs = part(at);
      all.insert(all.end(), outputs.begin(), outputs.end());
    }
    return all;
  };
}

}  // namespace internal

Coincidence RandomCoincidence(unsigned seed, Stepping stepping) {
  return internal::CoincidenceMaker(seed, stepping).Make();
}

const std::vector<std::string>& CoincidenceKinds() {
  static const std::vector<std::string> kinds = [] {
    std::vector<std::string> all = {kAtAStepsEnd, kAtTheStart, kAtTheEndOfTheRun,
                                    kSymmetric,   kOfTwoKinds, kPoisson};
    for (const auto group : {internal::Group::kLevel, internal::Group::kSteep,
                             internal::Group::kShallow, internal::Group::kNoGravity}) {
      for (const auto& element : internal::CoincidenceMaker::ElementsOf(group)) {
        all.push_back(std::string("coincidence: ") + element.kind);
      }
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }();
  return kinds;
}

KnownSides SidesOf(const Coincidence& coincidence) {
  KnownSides sides;
  if (!coincidence.outputs) return sides;
  const Map numbers = internal::NumbersOf(coincidence.scene);
  const std::vector<Real> values = Outputs(coincidence, numbers);
  const auto rows = static_cast<Eigen::Index>(values.size());
  sides.values.resize(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    sides.values[i] = static_cast<double>(values[static_cast<size_t>(i)]);
  }
  const auto columns = static_cast<Eigen::Index>(coincidence.parameters.size());
  sides.plus.resize(rows, columns);
  sides.minus.resize(rows, columns);
  for (Eigen::Index k = 0; k < columns; ++k) {
    const std::string& path = coincidence.parameters[static_cast<size_t>(k)].path;
    sides.plus.col(k) = Side(coincidence, numbers, values, path, 1.0L);
    sides.minus.col(k) = Side(coincidence, numbers, values, path, -1.0L);
  }
  return sides;
}

}  // namespace tangible
