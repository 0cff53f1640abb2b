// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/parameterized_scene.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tangible/math/scalar.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/validate.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

std::string Text(double x) {
  std::ostringstream text;
  text.precision(10);
  text << x;
  return text.str();
}

/// The values that a number of a kind may have.
struct Range {
  double low = -kInfinity;
  double high = kInfinity;
  bool low_excluded = false;
  bool high_excluded = false;
};

Range RangeOf(NumberKind kind) {
  switch (kind) {
    case NumberKind::kFree:
      return {};
    case NumberKind::kPositive:
      return {.low = 0.0, .low_excluded = true};
    case NumberKind::kNonNegative:
      return {.low = 0.0};
    case NumberKind::kFraction:
      return {.low = 0.0, .high = 1.0};
  }
  return {};
}

/// The values of p for which scale · p + offset is in the range.
Range Preimage(const Range& range, double scale, double offset) {
  Range p{(range.low - offset) / scale, (range.high - offset) / scale, range.low_excluded,
          range.high_excluded};
  if (scale < 0.0) {
    std::swap(p.low, p.high);
    std::swap(p.low_excluded, p.high_excluded);
  }
  return p;
}

void Intersect(const Range& other, Range* range) {
  if (other.low > range->low || (other.low == range->low && other.low_excluded)) {
    range->low = other.low;
    range->low_excluded = other.low_excluded;
  }
  if (other.high < range->high || (other.high == range->high && other.high_excluded)) {
    range->high = other.high;
    range->high_excluded = other.high_excluded;
  }
}

std::string Describe(const Range& range) {
  return (range.low_excluded || range.low == -kInfinity ? "(" : "[") + Text(range.low) + ", " +
         Text(range.high) + (range.high_excluded || range.high == kInfinity ? ")" : "]");
}

bool Contains(const Range& range, double x) {
  return (range.low_excluded ? x > range.low : x >= range.low) &&
         (range.high_excluded ? x < range.high : x <= range.high);
}

/// Whether a path names a number of a point or an instrument, and not of the scene.
bool IsOfMeasurement(const std::string& path) {
  for (const char* kind : {"points/", "sensors/", "cameras/", "clocks/"}) {
    if (path.rfind(kind, 0) == 0) {
      return true;
    }
  }
  return false;
}

constexpr const char* kAtNames[2] = {"/at/x", "/at/y"};

}  // namespace

bool ParameterizedScene::Create(const Scene& scene, const std::vector<BodyPoint>& points,
                                const std::vector<FitParameter>& parameters, ParameterError* error,
                                const Instruments& instruments) {
  scene_ = scene;
  points_ = points;
  instruments_ = instruments;
  num_scene_numbers_ = static_cast<int>(EnumerateNumbers(&scene_).size());
  entries_.clear();
  numbers_.clear();
  for (const FitParameter& parameter : parameters) {
    if (!AddParameter(parameter, error)) {
      return false;
    }
  }
  if (entries_.empty()) {
    *error = {-1, -1, "", "expected at least one parameter, got none"};
    return false;
  }
  CollectTargets();
  return Finish(error);
}

bool ParameterizedScene::Add(const FitParameter& parameter, ParameterError* error) {
  // The numbers of the scene are those of the last Set by now, and no base for what adds to them.
  const std::vector<Target> before = targets_;
  if (!AddParameter(parameter, error)) {
    return false;
  }
  CollectTargets();
  for (Target& target : targets_) {
    for (const Target& old : before) {
      if (old.number == target.number) {
        target.base = old.base;
      }
    }
  }
  return Finish(error);
}

/// Derivatives and structure of what was added, and the model at the initial values.
bool ParameterizedScene::Finish(ParameterError* error) {
  directions_.assign(entries_.size(), {});
  const std::vector<InstrumentNumber> measured = MeasurementNumbers();
  const int num_point_numbers = 2 * static_cast<int>(points_.size());
  point_derivatives_ = RowMatrixXd::Zero(num_point_numbers, size());
  instrument_derivatives_ =
      RowMatrixXd::Zero(static_cast<Eigen::Index>(measured.size()) - num_point_numbers, size());
  moves_times_ = false;
  for (const NumberSet& set : numbers_) {
    const int number = set.number - num_scene_numbers_;
    if (number < 0) {
      directions_[set.parameter].push_back({set.number, set.scale});
    } else if (number < num_point_numbers) {
      point_derivatives_(number, set.parameter) = set.scale;
    } else {
      instrument_derivatives_(number - num_point_numbers, set.parameter) = set.scale;
      moves_times_ = moves_times_ || measured[number].moves_time;
    }
  }
  structure_ = WithFreePoints(scene_, BuildStructure(scene_), directions_);
  if (!Set(Initial())) {
    const std::string reason = Validate(scene_, "the scene with these values");
    *error = {-1, -1, "",
              "the initial values give a number that is not allowed" +
                  (reason.empty() ? "" : ": " + reason)};
    return false;
  }
  const std::string rates = CoupledRatesFault(scene_, "the scene with the initial values");
  if (!rates.empty()) {
    *error = {-1, -1, "", rates};
    return false;
  }
  const std::string refused = structure_->paths.empty() && !structure_->has_releases
                                  ? ""
                                  : CoincidingEdges(model_, VariableDerivatives());
  if (!refused.empty()) *error = {-1, -1, "", refused};
  return refused.empty();
}

bool ParameterizedScene::AddParameter(const FitParameter& parameter, ParameterError* error) {
  *error = {static_cast<int>(entries_.size()), -1, "", ""};
  for (const Entry& entry : entries_) {
    if (entry.name == parameter.name) {
      error->key = "name";
      error->what = "expected names that differ, got \"" + parameter.name + "\" twice";
      return false;
    }
  }
  if (parameter.sets.empty()) {
    error->key = "sets";
    error->what = "expected at least one path, got none";
    return false;
  }
  Entry entry;
  entry.name = parameter.name;
  double value = 0.0;
  for (size_t i = 0; i < parameter.sets.size(); ++i) {
    error->set = static_cast<int>(i);
    const ParameterSet& set = parameter.sets[i];
    double set_value = 0.0;
    double set_scale = 1.0;
    if (!AddSet(set, &set_value, &set_scale, error)) {
      return false;
    }
    const auto ends_in = [&set](const std::string& key) {
      return set.path.size() >= key.size() &&
             set.path.compare(set.path.size() - key.size(), key.size(), key) == 0;
    };
    entry.of_contact = entry.of_contact || ends_in("/restitution") || ends_in("/friction");
    if (i == 0) {
      value = set.mode == SetMode::kAdd ? 0.0 : (set_value - set.offset) / set.scale;
      entry.scale = set_scale / std::abs(set.scale);
    }
  }
  error->set = -1;
  entry.initial = parameter.initial.value_or(value);
  if (!SetBounds(parameter, &entry, error) || !SetScaleAndPrior(parameter, &entry, error)) {
    return false;
  }
  entry.scale = std::max(std::abs(entry.initial), entry.scale);
  entries_.push_back(entry);
  return true;
}

bool ParameterizedScene::AddSet(const ParameterSet& set, double* value, double* scale,
                                ParameterError* error) {
  if (!std::isfinite(set.scale) || set.scale == 0.0) {
    error->key = "scale";
    error->what = "expected a number other than 0, got " + Text(set.scale);
    return false;
  }
  error->key = "path";
  if (!IsOfMeasurement(set.path)) {
    ParameterPath path;
    if (!ResolveParameter(scene_, set.path, &path, &error->what)) {
      return false;
    }
    *value = path.value;
    *scale = path.scale;
    const auto numbers = EnumerateNumbers(&scene_);
    for (const int number : path.numbers) {
      if (!AddNumber(number, numbers[number].kind, numbers[number].path, set, error)) {
        return false;
      }
    }
    return true;
  }
  return AddMeasurementSet(set, value, scale, error);
}

bool ParameterizedScene::AddMeasurementSet(const ParameterSet& set, double* value, double* scale,
                                           ParameterError* error) {
  bool matched = false;
  std::string names;
  const std::vector<InstrumentNumber> numbers = MeasurementNumbers();
  for (size_t i = 0; i < numbers.size(); ++i) {
    names += (i == 0 ? "" : ", ") + numbers[i].path;
    if (!MatchesPath(set.path, numbers[i].path)) {
      continue;
    }
    if (numbers[i].needs != nullptr) {
      error->what = "parameter " + set.path + ": " + numbers[i].path + " needs a " +
                    numbers[i].needs + " beside it, expected one > 0, got none";
      return false;
    }
    if (!matched) {
      *value = *numbers[i].value;
      // The typical size of a time is a step.
      *scale = numbers[i].moves_time && numbers[i].kind == NumberKind::kFree ? scene_.simulation.dt
                                                                             : 1.0;
    }
    matched = true;
    const int number = num_scene_numbers_ + static_cast<int>(i);
    if (!AddNumber(number, numbers[i].kind, numbers[i].path, set, error)) {
      return false;
    }
  }
  error->what = "parameter " + set.path + ": matches no number; of points, sensors, cameras and " +
                "clocks there are: " + (names.empty() ? "none" : names);
  return matched;
}

/// The numbers of the points, then those of the instruments.
std::vector<InstrumentNumber> ParameterizedScene::MeasurementNumbers() {
  std::vector<InstrumentNumber> numbers;
  for (BodyPoint& point : points_) {
    for (int axis = 0; axis < 2; ++axis) {
      numbers.push_back(
          {"points/" + point.name + kAtNames[axis], &point.at[axis], NumberKind::kFree});
    }
  }
  for (const InstrumentNumber& number : EnumerateNumbers(&instruments_)) {
    numbers.push_back(number);
  }
  return numbers;
}

bool ParameterizedScene::AddNumber(int number, NumberKind kind, const std::string& path,
                                   const ParameterSet& set, ParameterError* error) {
  for (const NumberSet& other : numbers_) {
    if (other.number != number) {
      continue;
    }
    const bool same = other.parameter == error->parameter;
    if (!same && (set.mode == SetMode::kAdd || other.mode == SetMode::kAdd)) {
      continue;
    }
    error->what = path + " is set twice, expected one parameter a number, also set by " +
                  (same ? "this parameter" : "\"" + entries_[other.parameter].name + "\"");
    return false;
  }
  numbers_.push_back({error->parameter, number, kind, set.scale, set.offset, set.mode});
  return true;
}

bool ParameterizedScene::SetBounds(const FitParameter& parameter, Entry* entry,
                                   ParameterError* error) const {
  const auto fail = [error](const char* key, const std::string& what) {
    error->key = key;
    error->what = what;
    return false;
  };
  Range allowed;
  for (const NumberSet& set : numbers_) {
    // An added value may have any sign; Set refuses a sum that is not allowed.
    if (set.parameter == error->parameter && set.mode == SetMode::kAssign) {
      Intersect(Preimage(RangeOf(set.kind), set.scale, set.offset), &allowed);
    }
  }
  // A logarithm never reaches an excluded bound at 0; for other excluded bounds the user has to
  // give a bound that is near enough.
  const bool open_at_zero = allowed.low_excluded && allowed.low == 0.0;
  entry->lower = parameter.lower.value_or(allowed.low);
  entry->upper = parameter.upper.value_or(allowed.high);
  if (parameter.lower ? !Contains(allowed, *parameter.lower)
                      : allowed.low_excluded && !open_at_zero) {
    return fail("lower", "expected a number in " + Describe(allowed) +
                             ", where what it sets is allowed, got " +
                             (parameter.lower ? Text(*parameter.lower) : "none"));
  }
  if (parameter.upper ? !Contains(allowed, *parameter.upper) : allowed.high_excluded) {
    return fail("upper", "expected a number in " + Describe(allowed) +
                             ", where what it sets is allowed, got " +
                             (parameter.upper ? Text(*parameter.upper) : "none"));
  }
  if (!(entry->lower < entry->upper)) {
    return fail("lower",
                "expected lower < upper, got " + Text(entry->lower) + " and " + Text(entry->upper));
  }
  const Range bounds{entry->lower, entry->upper, !parameter.lower && open_at_zero, false};
  if (!Contains(bounds, entry->initial)) {
    return fail("initial", "expected a number within the bounds " + Describe(bounds) + ", got " +
                               Text(entry->initial));
  }
  entry->logarithmic = entry->lower > 0.0 || bounds.low_excluded;
  return true;
}

bool ParameterizedScene::SetScaleAndPrior(const FitParameter& parameter, Entry* entry,
                                          ParameterError* error) {
  const bool positive = entry->lower >= 0.0 && entry->initial > 0.0;
  if (parameter.scale == ParameterScale::kLogarithmic && !positive) {
    error->key = "scale";
    error->what = "expected linear for a parameter that may be negative or starts at 0, got log";
    return false;
  }
  if (parameter.scale != ParameterScale::kByBounds) {
    entry->logarithmic = parameter.scale == ParameterScale::kLogarithmic;
  }
  entry->prior = parameter.prior;
  if (entry->prior && entry->prior->kind == PriorKind::kLogNormal && !positive) {
    error->key = "prior";
    error->what =
        "expected gaussian for a parameter that may be negative or starts at 0, got log_normal";
    return false;
  }
  return true;
}

std::vector<bool> ParameterizedScene::NumbersSet() const {
  std::vector<bool> set(num_scene_numbers_, false);
  for (const NumberSet& number : numbers_) {
    if (number.number < num_scene_numbers_) {
      set[number.number] = true;
    }
  }
  return set;
}

void ParameterizedScene::CollectTargets() {
  const auto numbers = EnumerateNumbers(&scene_);
  const std::vector<InstrumentNumber> measured = MeasurementNumbers();
  targets_.clear();
  for (size_t i = 0; i < numbers_.size(); ++i) {
    const NumberSet& set = numbers_[i];
    auto target = std::find_if(targets_.begin(), targets_.end(),
                               [&](const Target& other) { return other.number == set.number; });
    if (target == targets_.end()) {
      const int other = set.number - num_scene_numbers_;
      const double own = other < 0 ? *numbers[set.number].value : *measured[other].value;
      target = targets_.insert(target, {set.number, set.kind, own, {}});
    }
    target->sets.push_back(static_cast<int>(i));
    if (set.mode == SetMode::kAssign) {
      target->base = 0.0;
    }
  }
}

bool ParameterizedScene::Set(const Eigen::VectorXd& p) {
  const auto numbers = EnumerateNumbers(&scene_);
  const std::vector<InstrumentNumber> measured = MeasurementNumbers();
  for (const Target& target : targets_) {
    double value = target.base;
    for (const int i : target.sets) {
      value += numbers_[i].scale * p[numbers_[i].parameter] + numbers_[i].offset;
    }
    if (!IsAllowed(target.kind, value)) {
      return false;
    }
    if (target.number < num_scene_numbers_) {
      *numbers[target.number].value = value;
    } else {
      *measured[target.number - num_scene_numbers_].value = value;
    }
  }
  if (!Validate(scene_, "").empty()) {
    return false;
  }
  BuildModelWithStructure(scene_, structure_, &model_, &state_);
  return true;
}

void ParameterizedScene::SetInitial(const Eigen::VectorXd& p) {
  for (size_t k = 0; k < entries_.size(); ++k) {
    entries_[k].initial =
        std::clamp(p[static_cast<Eigen::Index>(k)], entries_[k].lower, entries_[k].upper);
  }
}

void ParameterizedScene::SetSimulation(const SimulationSettings& settings) {
  scene_.simulation = settings;
  structure_ = WithFreePoints(scene_, BuildStructure(scene_), directions_);
  BuildModelWithStructure(scene_, structure_, &model_, &state_);
}

RowMatrixXd ParameterizedScene::VariableDerivatives() const {
  return RowMatrixXd(VariableJacobian(scene_, structure_, directions_));
}

template <typename T>
void ParameterizedScene::SeededModel(int first, Model<T>* model, State<T>* state) const {
  BuildModelWithStructure(SeededScene<T>(scene_, directions_, first), structure_, model, state);
}

#define TANGIBLE_INSTANTIATE_JET(N) \
  template void ParameterizedScene::SeededModel<Jet<N>>(int, Model<Jet<N>>*, State<Jet<N>>*) const;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
