// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/support_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/elements/support_inl.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/event_search_inl.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// How often the motion that a support lets begin is sought anew.
constexpr int kMostDirectionsSought = 12;

template <typename T>
Vector2<T> ArmOfPoint(const Model<T>& model, const State<T>& state, const SupportIndex& support,
                      int point) {
  if (support.kind != SupportIndex::kPoints) return Vector2<T>(T(0.0), T(0.0));
  const T* at = &model.parameters[support.Point(point)];
  return state.PoseOf(support.body).rotation * Vector2<T>(at[0], at[1]);
}

// The largest progress (SupportProgress) at which what slows down has at most this speed.
double ProgressOfSpeed(const Model<double>& model, const State<double>& state, int k,
                       const SupportState& at, double speed) {
  const SupportIndex& support = model.structure->supports[k];
  if (support.kind == SupportIndex::kDisc) {
    const double radius = model.parameters[support.numbers + SupportIndex::kRadius];
    return speed * std::hypot(at.twist[0], at.twist[1], radius * at.twist[2]);
  }
  double sum = 0.0;
  for (int i = 0; i < support.num_points; ++i) {
    if (at.IsSlow(i)) sum += SpeedAtArm(ArmOfPoint(model, state, support, i), at.twist.data());
  }
  return speed * sum;
}

}  // namespace

template <typename T>
T SupportProgress(const Model<T>& model, const State<T>& state, int k, const SupportState& at) {
  const SupportIndex& support = model.structure->supports[k];
  const T* twist = &state.twist[3 * static_cast<size_t>(support.body)];
  if (support.kind == SupportIndex::kDisc) {
    const T& radius = model.parameters[support.numbers + SupportIndex::kRadius];
    return twist[0] * at.twist[0] + twist[1] * at.twist[1] +
           radius * radius * twist[2] * at.twist[2];
  }
  T progress(0.0);
  for (int i = 0; i < support.num_points; ++i) {
    if (!at.IsSlow(i)) continue;
    const Vector2<T> arm = ArmOfPoint(model, state, support, i);
    progress += VelocityAtArm(arm, twist).dot(VelocityAtArm(arm, at.twist.data()));
  }
  return progress;
}

template <typename T>
T SupportReserve(const Model<T>& model, const State<T>& state, int k, int holds,
                 const std::array<double, 3>& u, const T* wrench) {
  const SupportIndex& support = model.structure->supports[k];
  const T* x = &model.parameters[support.numbers];
  const T limit = x[SupportIndex::kFriction] * x[SupportIndex::kLoad];
  if (support.kind == SupportIndex::kDisc) {
    const T twist[3] = {T(u[0]), T(u[1]), T(u[2])};
    T friction[3];
    DiscFriction(x[SupportIndex::kRadius], twist, friction);
    T left(0.0);
    for (int i = 0; i < 3; ++i) left += (wrench[i] - limit * friction[i]) * u[i];
    return left;
  }
  T left(0.0);
  for (int i = 0; i < support.num_points; ++i) {
    if (holds >= 0 && holds != i) continue;
    const Vector2<T> arm = ArmOfPoint(model, state, support, i);
    const T share =
        support.kind == SupportIndex::kPoints ? model.parameters[support.Point(i) + 2] : T(1.0);
    left += limit * share * SpeedAtArm(arm, u.data());
    if (holds != i) continue;
    const Vector2<T> velocity = VelocityAtArm(arm, u.data());
    left += wrench[0] * velocity.x() + wrench[1] * velocity.y();
  }
  if (holds == SupportState::kBody) {
    for (int i = 0; i < 3; ++i) left += wrench[i] * u[i];
  }
  return left;
}

ActiveContact ContactOfSupport(const ModelStructure& structure, int support) {
  ActiveContact contact;
  contact.is_support = true;
  contact.a = structure.supports[support].body;
  contact.b = structure.world();
  return contact;
}

void EventSearch::SearchSupports(const Model<double>& model, Event* event) {
  const std::vector<SupportState>& supports = segment_->before.supports;
  for (int k = 0; k < static_cast<int>(supports.size()); ++k) {
    if (supports[k].slow != SupportState::kNothing) SearchStop(model, k, event);
    if (supports[k].holds != SupportState::kNothing) SearchLetsGo(model, k, event);
  }
}

// Searches for the time at which what slows down on a support comes to rest.
void EventSearch::SearchStop(const Model<double>& model, int support, Event* event) {
  const SupportState& at = segment_->before.supports[support];
  const auto value_of = [&](const Sample& sample) {
    if (!sample.good) return std::numeric_limits<double>::quiet_NaN();
    return SupportProgress(model, sample.motion.after, support, at);
  };
  double fa = SupportProgress(model, segment_->before, support, at);
  if (!(fa > 0.0)) return;
  const double tolerance = kLocatedOfSize * fa;
  // At the end of the motion a speed that is rounding has reached 0: the next motion would take it
  // for rest, and could not find the event.
  const SupportIndex& index = model.structure->supports[support];
  support_.Set(model, segment_->before, index, 1.0);
  const double gained = support_.limit() /
                        model.parameters[model.structure->bodies[index.body].mass] *
                        model.structure->settings.dt;
  const double at_end = ProgressOfSpeed(model, segment_->before, support, at,
                                        std::max(slow_, kStandingPoint * gained));
  Event trial;
  trial.kind = EventKind::kSupportStops;
  trial.contact = ContactOfSupport(*model.structure, support);
  trial.index = support;
  const double whole = event->length;
  double a = 0.0;
  for (const double share : {0.5, 1.0}) {
    const double b = share * whole;
    const double fb = value_of(*At(model, b));
    if (std::isnan(fb)) return;
    if (fb <= tolerance || (share == 1.0 && event->kind != trial.kind && fb <= at_end)) {
      trial.length = fb < -tolerance ? Refine(model, value_of, tolerance, a, fa, b, fb) : b;
      *event = trial;
      return;
    }
    a = b;
    fa = fb;
  }
}

// The forces of a support's rows at the end of a motion; null where there is none.
const double* EventSearch::HeldAt(const Model<double>& model, int support, Sample* sample) {
  const SolvedNode* const end = EndOf(model, sample);
  if (end == nullptr) return nullptr;
  const size_t row = model.structure->joints.size() + static_cast<size_t>(support);
  return &end->solution.joint_impulse[3 * row];
}

// What a support does where its rows would need these forces, if it cannot give them; `slow` tells.
SupportState EventSearch::LetsGoAt(const Model<double>& model, const State<double>& state,
                                   int support, const double* held) {
  const SupportIndex& index = model.structure->supports[support];
  const int holds = segment_->before.supports[support].holds;
  SupportState next;
  support_.Set(model, state, index, 1.0);
  if (holds == SupportState::kBody) {
    const double wrench[3] = {-held[0], -held[1], -held[2]};
    if (support_.CanHold(wrench)) return next;
    const double arm = support_.arm();
    const double unit[3] = {1.0, 1.0, arm > 0.0 ? arm * arm : 1.0};
    next = support_.SolveAlone(unit, wrench);
    next.slow = SupportState::kBody;
    return next;
  }
  const double size = std::hypot(held[0], held[1]);
  if (!(size > support_.points()[static_cast<size_t>(holds)].limit)) return next;
  next.slow = holds;
  next.twist = {-held[0] / size, -held[1] / size, 0.0};
  return next;
}

// Takes from the motion that a support lets begin what joints keep the body from, along which the
// share of the support is not determined, and returns whether anything is left. Of bodies that
// touch, or that joints connect, while their supports hold them no share is. Together they may hold
// what the share of one is too large for; whether they do is decided as the next motion starts, for
// all of them at once. The support has a larger proximal term than joints (kSupportGive), so that
// what cannot be met of a right-hand side stays in its rows.
bool EventSearch::TakeDeterminedShare(const Model<double>& model, int support, SolvedNode* node,
                                      SupportState* next) const {
  constexpr int kMostTimes = 4;
  const size_t joint = model.structure->joints.size() + static_cast<size_t>(support);
  const size_t row = 3 * (static_cast<size_t>(model.structure->num_blocks()) + joint);
  const int rows = node->problem.joints[joint].rows;
  std::vector<double> seed(3 * static_cast<size_t>(node->system.num_blocks()), 0.0);
  std::vector<double> left(seed.size());
  double size = 0.0, unmet = HUGE_VAL;
  for (int r = 0; r < rows; ++r) size = std::max(size, std::abs(next->twist[r]));
  for (int time = 0; time < kMostTimes; ++time) {
    std::copy_n(next->twist.begin(), rows, seed.begin() + static_cast<std::ptrdiff_t>(row));
    std::vector<double> x = seed;
    unmet = node->system.SolveTransposed(node->problem, node->solution.modes, x.data(), 1);
    if (unmet <= kFullyDetermined) break;
    node->system.Residual<true>(node->problem, node->solution.modes, seed.data(), x.data(), 1,
                                left.data());
    double remains = 0.0;
    for (int r = 0; r < rows; ++r) {
      next->twist[r] -= left[row + static_cast<size_t>(r)];
      remains = std::max(remains, std::abs(next->twist[r]));
    }
    if (!(remains > kLeastMotion * size)) return false;
  }
  return unmet <= kDetermined;
}

// Searches for the time at which a support can no longer hold what it holds.
void EventSearch::SearchLetsGo(const Model<double>& model, int support, Event* event) {
  const int holds = segment_->before.supports[support].holds;
  SupportState next;
  const auto value_of = [&](Sample& sample) {
    const double* held = HeldAt(model, support, &sample);
    if (held == nullptr) return std::numeric_limits<double>::quiet_NaN();
    return SupportReserve(model, sample.motion.after, support, holds, next.twist, held);
  };
  const auto tolerance_of = [&](double value) {
    return kSupportLocated *
           (std::abs(value) + support_.limit() * std::hypot(next.twist[0], next.twist[1],
                                                            support_.arm() * next.twist[2]));
  };
  double a = 0.0;
  for (const double share : {0.5, 1.0}) {
    double b = share * event->length;
    const double* held = HeldAt(model, support, At(model, b));
    if (held == nullptr) return;
    SupportState beyond = LetsGoAt(model, At(model, b)->motion.after, support, held);
    if (beyond.slow == SupportState::kNothing) {
      a = b;
      continue;
    }
    if (!TakeDeterminedShare(model, support, EndOf(model, At(model, b)), &beyond)) {
      lets_go_with_others_ = true;
      return;
    }
    next = beyond;
    const double left = value_of(*At(model, b));
    // More than it can hold is what joints hold as well, or the rest of what they should: a force
    // that is as large as the friction, and no larger, is held.
    if (left >= -tolerance_of(left)) {
      a = b;
      continue;
    }
    Event trial;
    trial.kind = EventKind::kSupportLetsGo;
    trial.contact = ContactOfSupport(*model.structure, support);
    trial.index = support;
    for (int i = 0; i < kMostDirectionsSought; ++i) {
      next = beyond;
      trial.support = next;
      const double fb = value_of(*At(model, b));
      const double fa = value_of(*At(model, a));
      if (std::isnan(fa) || std::isnan(fb)) return;
      const double tolerance = tolerance_of(fb);
      trial.length = fa <= tolerance    ? a
                     : fb >= -tolerance ? b
                                        : Refine(model, value_of, tolerance, a, fa, b, fb);
      if (trial.length >= b || trial.length <= a) break;
      b = trial.length;
      const Sample* at_root = At(model, b);
      beyond =
          LetsGoAt(model, at_root->motion.after, support, HeldAt(model, support, At(model, b)));
      if (beyond.slow == SupportState::kNothing) break;
      if (!TakeDeterminedShare(model, support, EndOf(model, At(model, b)), &beyond)) break;
    }
    *event = trial;
    return;
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                              \
  template T SupportProgress<T>(const Model<T>&, const State<T>&, int, const SupportState&); \
  template T SupportReserve<T>(const Model<T>&, const State<T>&, int, int,                   \
                               const std::array<double, 3>&, const T*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
