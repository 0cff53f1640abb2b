// SPDX-License-Identifier: Apache-2.0
//
// How far a derivative reaches (validity_radius.h), and how much the flow multiplies.
#include <algorithm>
#include <cmath>

#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/certificate/validity_radius.h"
#include "tangible/simulation/gradient/rollout_beside.h"

namespace tangible {
namespace {

bool IsInRange(Scene* scene, const ParameterPath& parameter, double shift) {
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(scene);
  return std::all_of(parameter.numbers.begin(), parameter.numbers.end(),
                     [&](int i) { return IsAllowed(numbers[i].kind, *numbers[i].value + shift); });
}

}  // namespace

bool RolloutWorker::RunChoices(ChoiceList* choices) {
  return ChoicesOf(model_, f_.num_controls() == 0 ? nullptr : &controls_, initial_, choices);
}

bool RolloutWorker::Choices(const RolloutInput& input, int parameter, double shift,
                            ChoiceList* choices) {
  RolloutOutput output;
  if (!Set(input, &output)) return false;
  const Beside moved(this, parameter, shift);
  return !moved.is_refused() && RunChoices(choices);
}

std::vector<ValidityRadius> RolloutWorker::Radii(const RolloutInput& input) {
  RolloutOutput output;
  ChoiceList own;
  if (!Set(input, &output) || !RunChoices(&own)) return {};
  std::vector<ValidityRadius> radii;
  for (size_t p = 0; p < f_.parameters_.size(); ++p) {
    const ParameterPath& parameter = f_.parameters_[p];
    const double set = parameters_[static_cast<Eigen::Index>(p)];
    const double value = std::isnan(set) ? parameter.value : set;
    const auto beside = [&](double shift, ChoiceList* choices) {
      const Beside moved(this, static_cast<Eigen::Index>(p), shift);
      return !moved.is_refused() && RunChoices(choices);
    };
    ValidityRadius radius =
        ValidityRadiusOf(*f_.structure_, own, beside, std::max(std::abs(value), parameter.scale));
    radius.parameter = parameter.path;
    const auto clip = [&](double sign, double* distance, std::string* where) {
      if (std::isinf(*distance) ||
          IsInRange(&scene_, parameter, sign * (1.0 + kRangeEnd) * *distance)) {
        return;
      }
      *distance = HUGE_VAL;
      where->clear();
    };
    clip(-1.0, &radius.down, &radius.down_where);
    clip(1.0, &radius.up, &radius.up_where);
    radii.push_back(std::move(radius));
  }
  return radii;
}

double RolloutWorker::Growth(const RolloutInput& input) {
  RolloutOutput output;
  if (!Set(input, &output)) return kNaN;
  return GrowthOf(model_, f_.num_controls() == 0 ? nullptr : &controls_, initial_);
}

}  // namespace tangible
