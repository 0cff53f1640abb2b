// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/validity_radius.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

// The run on one side of the parameter, with the same choices.
struct Side {
  bool ran = false;
  double shift = 0.0;
  ChoiceList choices;
  const Choice* differs = nullptr;  // in `choices` or in those of the run itself
};

// The nearest changes down (0) and up (1).
struct Nearest {
  std::array<double, 2> distance{HUGE_VAL, HUGE_VAL};
  std::array<const Choice*, 2> choice{};

  void Add(const Choice& of, double rate) {
    const int side = rate < 0.0 ? 1 : 0;
    const double at = std::max(of.slack, 0.0) / std::abs(rate);
    if (!(at < distance[side])) return;
    distance[side] = at;
    choice[side] = &of;
  }
};

Side Look(const ChoiceList& own, const ChoicesAt& choices_at, double size, double sign) {
  Side side;
  for (const double step : {kRadiusStep, kRadiusStep * kSmallerStep}) {
    side.shift = sign * step * size;
    side.differs = nullptr;  // of the choices that are found anew
    side.ran = choices_at(side.shift, &side.choices);
    if (!side.ran) return side;
    side.differs = FirstDifference(own, side.choices);
    if (side.differs == nullptr) return side;
  }
  return side;
}

const Choice* Find(const ChoiceList& list, const ChoiceKey& key) {
  const auto found =
      std::lower_bound(list.begin(), list.end(), key,
                       [](const Choice& choice, const ChoiceKey& k) { return choice.key < k; });
  return found != list.end() && found->key == key ? &*found : nullptr;
}

// The structure of a run that goes on behind its end, where its next events are looked for. A fixed
// step's choices do not depend on what follows.
std::shared_ptr<const ModelStructure> Longer(
    const std::shared_ptr<const ModelStructure>& structure) {
  if (structure->settings.stepping == Stepping::kFixed) return structure;
  auto longer = std::make_shared<ModelStructure>(*structure);
  SimulationSettings& settings = longer->settings;
  const double end = settings.duration;
  settings.duration += kBehindEnd * end;
  if (!settings.step_times.empty()) {
    const auto steps = static_cast<long>(std::ceil(kBehindEnd * end / settings.dt));
    for (long k = 1; k < steps; ++k) {
      settings.step_times.push_back(end + static_cast<double>(k) * settings.dt);
    }
    settings.step_times.push_back(settings.duration);
  }
  return longer;
}

// The largest singular value, by the power method on AᵀA; the largest two need not differ much.
double LargestSingularValue(const RowMatrixXd& a) {
  constexpr int kIterations = 200;
  VectorX<double> x = VectorX<double>::LinSpaced(a.cols(), 1.0, 2.0);
  double value = 0.0;
  for (int i = 0; i < kIterations && x.norm() > 0.0; ++i) {
    x /= x.norm();
    const VectorX<double> y = a * x;
    value = y.norm();
    x = a.transpose() * y;
  }
  return value;
}

ControlledModel<double> Controlled(const Model<double>& model, const Controls* controls) {
  return controls == nullptr ? ControlledModel<double>(model)
                             : ControlledModel<double>(model, *controls);
}

}  // namespace

bool ChoicesOf(const Model<double>& model, const Controls* controls, const State<double>& initial,
               ChoiceList* choices) {
  const double end = model.structure->settings.duration;
  Model<double> longer = model;
  longer.structure = Longer(model.structure);
  ChoiceWatch watch(end);
  Stepper stepper(longer);
  State<double> final;
  const RolloutReport report = Rollout(
      Controlled(longer, controls), initial,
      [&](long k, double, const State<double>&, Stepper* done) {
        if (done != nullptr) watch.AddStep(longer, k - 1, done);
      },
      &stepper, &final);
  *choices = watch.Finish(longer);
  // It may fail behind the end, which is no part of the run.
  return !watch.is_full() && (report.status == StepStatus::kDone || report.time >= end);
}

ValidityRadius ValidityRadiusOf(const ModelStructure& structure, const ChoiceList& own,
                                const ChoicesAt& choices_at, double size) {
  const std::array<Side, 2> sides = {Look(own, choices_at, size, -1.0),
                                     Look(own, choices_at, size, 1.0)};
  Nearest nearest;
  for (const Choice& choice : own) {
    if (!std::isfinite(choice.slack)) continue;
    // Slacks and places on both sides, or on one side and here.
    std::array<double, 2> slack{choice.slack, choice.slack};
    std::array<double, 2> at{0.0, 0.0};
    for (int k = 0; k < 2; ++k) {
      if (!sides[k].ran || sides[k].differs != nullptr) continue;
      const Choice* other = Find(sides[k].choices, choice.key);
      if (other == nullptr) continue;
      slack[k] = other->slack;
      at[k] = sides[k].shift;
    }
    if (at[0] == at[1]) continue;
    const double change = slack[1] - slack[0];
    if (std::abs(change) <= kSlackRounding * choice.scale) continue;
    nearest.Add(choice, change / (at[1] - at[0]));
  }
  ValidityRadius radius;
  const auto set = [&](int k, double* distance, std::string* where) {
    const Choice* choice = nearest.choice[k];
    *distance = nearest.distance[k];
    if (sides[k].differs != nullptr) {
      *distance = 0.0;
      choice = sides[k].differs;
    }
    if (!(*distance <= kFarthestRadius * size)) {
      *distance = HUGE_VAL;
      return;
    }
    if (choice != nullptr) *where = NameOf(structure, *choice);
  };
  set(0, &radius.down, &radius.down_where);
  set(1, &radius.up, &radius.up_where);
  return radius;
}

double GrowthOf(const Model<double>& model, const Controls* controls,
                const State<double>& initial) {
  const ModelStructure& s = *model.structure;
  if (s.num_blocks() > kMostGrowthBodies) return kNaN;
  // Entries of the flow: x, y, angle, vx, vy, omega of each moving body.
  std::vector<int> variables;
  for (const int body : s.moving) {
    for (int i = 0; i < 6; ++i) {
      variables.push_back(i < 3 ? s.PoseVariable(body, i) : s.TwistVariable(body, i - 3));
    }
  }
  const auto states = static_cast<int>(variables.size());
  RowMatrixXd w_dot = RowMatrixXd::Zero(s.num_variables(), states);
  for (int i = 0; i < states; ++i) w_dot(variables[i], i) = 1.0;
  Stepper stepper(model);
  State<double> final;
  const RolloutReport report =
      RolloutTangent(Controlled(model, controls), initial, {}, {}, &stepper, &w_dot, &final);
  if (report.status != StepStatus::kDone || states == 0) return kNaN;
  // The size of the scene: how far bodies are from each other and from where they end.
  double low[2] = {HUGE_VAL, HUGE_VAL};
  double high[2] = {-HUGE_VAL, -HUGE_VAL};
  double length = 0.0;
  for (const int body : s.moving) {
    length = std::max(length, 2.0 * RadiusOf(model, body));
    for (const State<double>* state : std::array<const State<double>*, 2>{&initial, &final}) {
      for (int i = 0; i < 2; ++i) {
        const double x = state->pose[3 * static_cast<size_t>(body) + static_cast<size_t>(i)];
        low[i] = std::min(low[i], x);
        high[i] = std::max(high[i], x);
      }
    }
  }
  length = std::max(length, std::hypot(high[0] - low[0], high[1] - low[1]));
  if (!(length > 0.0)) length = 1.0;
  const double duration = std::max(report.time, s.settings.dt);
  const auto unit = [&](int i) {
    const double place = i % 3 == 2 ? 1.0 : length;
    return i % 6 < 3 ? place : place / duration;
  };
  RowMatrixXd flow(states, states);
  for (int i = 0; i < states; ++i) {
    for (int k = 0; k < states; ++k) flow(i, k) = w_dot(variables[i], k) * unit(k) / unit(i);
  }
  return flow.allFinite() ? LargestSingularValue(flow) : HUGE_VAL;
}

}  // namespace tangible
