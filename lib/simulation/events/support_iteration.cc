// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/support_iteration.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The linearised friction of a point, per unit of its limit.
void LinearisedFriction(const double about[2], const double velocity[2], double friction[2]) {
  const double speed = std::hypot(about[0], about[1]);
  friction[0] = friction[1] = 0.0;
  if (!(speed > 0.0)) return;
  const double d[2] = {about[0] / speed, about[1] / speed};
  const double across = (d[0] * velocity[1] - d[1] * velocity[0]) / speed;
  friction[0] = -d[0] + d[1] * across;
  friction[1] = -d[1] - d[0] * across;
}

}  // namespace

void SupportIteration::StartAt(const Model<double>& model, double h, const std::vector<int>& sought,
                               const State<double>& before) {
  const size_t supports = model.structure->supports.size();
  h_ = h;
  iterations_ = 0;
  residual_ = before_dampers_ = HUGE_VAL;
  is_about_ = has_held_standing_ = false;
  times_released_ = 0;
  newton_left_ = kNewton;
  dampers_left_ = 0;
  dampers_ = kDampers;
  residuals_.resize(supports);
  turns_.assign(supports, 0);
  shares_.assign(supports, SupportState::kNothing);
  damped_.resize(supports);
  sought_ = sought;
  horizons_.resize(supports);
  for (size_t k = 0; k < supports; ++k) horizons_[k] = before.supports[k].horizon;
}

void SupportIteration::Start(const Model<double>& model, double h,
                             const ContactProblem<double>& problem, const std::vector<int>& sought,
                             State<double>* before) {
  const ModelStructure& s = *model.structure;
  before->supports.resize(s.supports.size());
  StartAt(model, h, sought, *before);
  for (size_t k = 0; k < s.supports.size(); ++k) {
    if (PartOf(k) == SupportState::kNothing) continue;
    const size_t row = 3 * static_cast<size_t>(s.bodies[s.supports[k].body].block);
    double shift[3];
    Set(model, *before, k, shift);
    double momentum[3];
    std::copy_n(&problem.load[row], 3, momentum);
    for (int i = 0; i < 3; ++i) momentum[i] += problem.mass[row + i] * shift[i];
    before->supports[k] = OfBody(k, friction_.SolveAlone(&problem.mass[row], momentum));
  }
}

void SupportIteration::Set(const Model<double>& model, const State<double>& before, size_t k,
                           double shift[3]) {
  const SupportIndex& support = model.structure->supports[k];
  friction_.Set(model, before, support, h_);
  const double* const twist = &before.twist[3 * static_cast<size_t>(support.body)];
  for (int i = 0; i < 3; ++i) shift[i] = horizons_[k] > 0.0 ? twist[i] / horizons_[k] : 0.0;
  const int part = PartOf(k);
  if (part < 0) return;
  friction_.KeepPoint(part);
  const double turn = twist[2];
  for (int i = 0; i < 2; ++i) shift[i] -= turn * turn * friction_.points()[0].arm[i];
}

SupportState SupportIteration::OfPart(size_t k, const SupportState& at) const {
  SupportState part = at;
  if (PartOf(k) >= 0) part.holds = at.holds == PartOf(k) ? 0 : SupportState::kNothing;
  return part;
}

SupportState SupportIteration::OfBody(size_t k, const SupportState& at) const {
  SupportState whole = at;
  whole.horizon = horizons_[k];
  if (PartOf(k) < 0) return whole;
  whole.holds = at.holds == SupportState::kNothing ? at.holds : PartOf(k);
  whole.slow = PartOf(k);
  whole.is_sought = true;
  return whole;
}

// The impulse that the linearised support gives its body in a solve; `held`: of its rows.
void SupportIteration::ImpulseOf(const SupportState& at, const double twist[3], const double* held,
                                 double impulse[3]) const {
  std::fill_n(impulse, 3, 0.0);
  if (at.holds == SupportState::kBody) {
    std::copy_n(held, 3, impulse);
    return;
  }
  if (friction_.is_disc()) {
    double curvature[9];
    friction_.At(at.twist.data(), impulse);
    friction_.Curvature(at.twist.data(), curvature);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) impulse[i] -= curvature[3 * i + j] * (twist[j] - at.twist[j]);
    }
    return;
  }
  for (size_t i = 0; i < friction_.points().size(); ++i) {
    const SupportPoint& point = friction_.points()[i];
    double f[2] = {0.0, 0.0};
    if (static_cast<int>(i) == at.holds) {
      std::copy_n(held, 2, f);
    } else {
      double about[2], velocity[2];
      point.VelocityAt(at.twist.data(), about);
      point.VelocityAt(twist, velocity);
      LinearisedFriction(about, velocity, f);
      for (double& component : f) component *= point.limit;
    }
    impulse[0] += f[0];
    impulse[1] += f[1];
    impulse[2] += point.arm[0] * f[1] - point.arm[1] * f[0];
  }
}

// How far the support is from Coulomb's law at the new twist, of μ N.
double SupportIteration::ResidualOf(const SupportState& at, bool has_share, const double mass[3],
                                    const double twist[3], const double* held) const {
  const double limit = friction_.limit();
  if (!(limit > 0.0) || (has_share && at.holds == SupportState::kBody)) return 0.0;
  const double slow = kStandingPoint * limit / mass[0];
  const double arm = friction_.arm();
  // How far an impulse goes beyond what the support can hold, by the motion it would give.
  const auto beyond = [&](const double impulse[3]) {
    if (friction_.CanHold(impulse)) return 0.0;
    const double unit[3] = {1.0, 1.0, arm > 0.0 ? arm * arm : 1.0};
    const SupportState alone = friction_.SolveAlone(unit, impulse);
    return std::hypot(alone.twist[0], alone.twist[1], arm * alone.twist[2]) / limit;
  };
  if (at.holds == SupportState::kBody) {
    const double impulse[3] = {-held[0], -held[1], -held[2]};
    return beyond(impulse);
  }
  if (friction_.is_disc()) {
    double impulse[3], law[3];
    ImpulseOf(at, twist, held, impulse);
    if (std::hypot(twist[0], twist[1], arm * twist[2]) <= slow) return beyond(impulse);
    friction_.At(twist, law);
    return std::hypot(impulse[0] - law[0], impulse[1] - law[1], (impulse[2] - law[2]) / arm) /
           limit;
  }
  double residual = 0.0;
  for (size_t i = 0; i < friction_.points().size(); ++i) {
    const SupportPoint& point = friction_.points()[i];
    if (static_cast<int>(i) == at.holds && has_share) continue;
    if (static_cast<int>(i) == at.holds) {
      double held_limit = 0.0;  // points at the same place are held together
      for (const SupportPoint& other : friction_.points()) {
        const bool same = other.arm[0] == point.arm[0] && other.arm[1] == point.arm[1];
        held_limit += same ? other.limit : 0.0;
      }
      residual = std::max(residual, (std::hypot(held[0], held[1]) - held_limit) / limit);
      continue;
    }
    double about[2], velocity[2], f[2];
    point.VelocityAt(at.twist.data(), about);
    point.VelocityAt(twist, velocity);
    LinearisedFriction(about, velocity, f);
    const double speed = std::hypot(velocity[0], velocity[1]);
    const double error = speed <= slow
                             ? std::hypot(f[0], f[1]) - 1.0
                             : std::hypot(f[0] + velocity[0] / speed, f[1] + velocity[1] / speed);
    residual = std::max(residual, error * point.limit / limit);
  }
  return residual;
}

// How far the velocities of what slides are from those about which its friction is linearised, as
// a share of them.
double SupportIteration::AwayFrom(const SupportState& at, const double mass[3],
                                  const double twist[3]) const {
  if (at.holds == SupportState::kBody || !(friction_.limit() > 0.0)) return 0.0;
  const double slow = kStandingPoint * friction_.limit() / mass[0];
  if (friction_.is_disc()) {
    const double arm = friction_.arm();
    const double speed = std::hypot(twist[0], twist[1], arm * twist[2]);
    const double away =
        std::hypot(twist[0] - at.twist[0], twist[1] - at.twist[1], arm * (twist[2] - at.twist[2]));
    return speed > slow ? away / speed : 0.0;
  }
  double most = 0.0;
  for (size_t i = 0; i < friction_.points().size(); ++i) {
    if (static_cast<int>(i) == at.holds) continue;
    double about[2], velocity[2];
    friction_.points()[i].VelocityAt(at.twist.data(), about);
    friction_.points()[i].VelocityAt(twist, velocity);
    const double speed = std::hypot(velocity[0], velocity[1]);
    if (!(speed > slow)) continue;
    most = std::max(most, std::hypot(velocity[0] - about[0], velocity[1] - about[1]) / speed);
  }
  return most;
}

void SupportIteration::Linearise(const double mass[3], const double twist[3], const double* held,
                                 bool has_share, int* turns, SupportState* at) const {
  // Held as a whole after so many turns, and again after as many.
  constexpr int kHeldAfter = 3;
  double impulse[3], momentum[3];
  ImpulseOf(*at, twist, held, impulse);
  for (int i = 0; i < 3; ++i) momentum[i] = mass[i] * twist[i] - impulse[i];
  if (at->holds == SupportState::kNothing && at->twist == SupportState().twist &&
      std::hypot(twist[0], twist[1], twist[2]) > 0.0) {
    std::copy_n(twist, 3, at->twist.begin());  // it has been let go
    return;
  }
  const SupportState alone = friction_.SolveAlone(mass, momentum);
  bool turns_round = !has_share && alone.holds != at->holds;
  if (friction_.is_disc()) {
    const double* u = at->twist.data();
    turns_round =
        turns_round ||
        !(mass[0] * (u[0] * twist[0] + u[1] * twist[1]) + mass[2] * u[2] * twist[2] > 0.0);
  }
  for (size_t i = 0; i < friction_.points().size(); ++i) {
    double about[2], velocity[2];
    friction_.points()[i].VelocityAt(at->twist.data(), about);
    friction_.points()[i].VelocityAt(twist, velocity);
    turns_round = turns_round || (static_cast<int>(i) != at->holds &&
                                  !(about[0] * velocity[0] + about[1] * velocity[1] > 0.0));
  }
  if (turns_round && ++*turns % kHeldAfter == 0) {
    const bool has_parts = friction_.is_disc() || friction_.points().size() > 1;
    *at = SupportState{has_parts ? static_cast<int>(SupportState::kBody) : 0, {}};
  } else if (turns_round) {
    *at = alone;
  } else {
    MoveAbout(mass, twist, at);
  }
}

void SupportIteration::MoveAbout(const double mass[3], const double twist[3],
                                 SupportState* at) const {
  std::copy_n(twist, 3, at->twist.begin());
  const double slow = kStandingPoint * friction_.limit() / mass[0];
  if (at->holds != SupportState::kNothing) return;
  if (friction_.is_disc()) {
    const double speed = std::hypot(twist[0], twist[1], friction_.arm() * twist[2]);
    if (speed <= slow) at->holds = SupportState::kBody;
    return;
  }
  for (size_t i = 0; i < friction_.points().size() && at->holds == SupportState::kNothing; ++i) {
    double velocity[2];
    friction_.points()[i].VelocityAt(twist, velocity);
    if (std::hypot(velocity[0], velocity[1]) <= slow) at->holds = static_cast<int>(i);
  }
}

void SupportIteration::KeepAtRest(const ModelStructure& structure, StepRecord* record) {
  for (size_t k = 0; k < structure.supports.size(); ++k) {
    const SupportIndex& support = structure.supports[k];
    const int holds = record->before.supports[k].holds;
    const bool holds_centre = support.kind == SupportIndex::kCentre && holds == 0;
    const std::ptrdiff_t components = holds == SupportState::kBody ? 3 : holds_centre ? 2 : 0;
    std::fill_n(record->new_twist.begin() + 3 * support.body, components, 0.0);
    std::fill_n(record->solution.motion.begin() + 3 * structure.bodies[support.body].block,
                components, 0.0);
  }
}

bool SupportIteration::Release(const Model<double>& model, State<double>* before) {
  const auto held = [&](size_t k) { return before->supports[k].holds != SupportState::kNothing; };
  size_t weakest = before->supports.size();
  double least = HUGE_VAL;
  bool any = false;
  for (size_t k = 0; k < before->supports.size(); ++k) {
    if (!held(k)) continue;
    friction_.Set(model, *before, model.structure->supports[k], h_);
    if (friction_.limit() < least) weakest = k;
    least = std::min(least, friction_.limit());
    any = true;
  }
  // What holds again without a solution presses against others that hold: the weakest gives way.
  const bool all = times_released_++ == 0;
  for (size_t k = 0; k < before->supports.size(); ++k) {
    if (held(k) && (all || k == weakest)) before->supports[k] = SupportState();
  }
  ++iterations_;
  residual_ = HUGE_VAL;
  return any;
}

template <typename Visit>
void SupportIteration::ForEach(const Model<double>& model, const ContactProblem<double>& problem,
                               const ContactSolution<double>& solution, State<double>* before,
                               const Visit& visit) {
  const ModelStructure& s = *model.structure;
  for (size_t k = 0; k < s.supports.size(); ++k) {
    if (PartOf(k) == SupportState::kNothing) continue;
    const size_t row = 3 * static_cast<size_t>(s.bodies[s.supports[k].body].block);
    double shift[3];
    Set(model, *before, k, shift);
    const double twist[3] = {solution.motion[row] + shift[0], solution.motion[row + 1] + shift[1],
                             solution.motion[row + 2] + shift[2]};
    SupportState at = OfPart(k, before->supports[k]);
    visit(k, &problem.mass[row], twist, &solution.joint_impulse[3 * (s.joints.size() + k)], &at);
    before->supports[k] = OfBody(k, at);
  }
}

// Of what slides; a body that has no friction slides without.
void SupportIteration::GoOnWithDampers(const Model<double>& model,
                                       const ContactProblem<double>& problem,
                                       const ContactSolution<double>& solution,
                                       State<double>* before) {
  // The first round begins at the last twists of Newton's method; others go on where it ended.
  const bool begins = dampers_left_ == 0;
  const bool is_first = begins ? dampers_ == kDampers : dampers_ == 2 * kDampers;
  if (begins) {
    before_dampers_ = residual_;
    dampers_left_ = std::exchange(dampers_, 2 * dampers_);
    smoothing_ = is_first ? 1.0 : kDamperSmoothing;
  } else {
    // What a contact pushes out of a small penetration slides more slowly than what is at rest
    // creeps at first.
    smoothing_ *= std::pow(kDamperSmoothing, is_first ? 1.0 / kDampers : 2.0 / dampers_);
    --dampers_left_;
  }
  bool settles = true;
  size_t part = 0;
  ratios_.swap(last_ratios_);
  ForEach(model, problem, solution, before,
          [&](size_t k, const double* mass, const double* twist, const double*, SupportState* of) {
            SupportState& at = *of;
            const size_t first = std::exchange(part, part + NumParts());
            if (!(friction_.limit() > 0.0)) return;
            if (ratios_.size() < part) ratios_.resize(part);
            if (last_ratios_.size() < part) last_ratios_.resize(part);
            for (size_t i = first; i < part; ++i) {
              ratios_[i] = begins ? 0.0 : RatioOf(at, i - first, twist);
            }
            if (!begins && dampers_left_ == 0) {
              std::copy_n(twist, 3, damped_[k].begin());
              settles = Classify(twist, &ratios_[first], &last_ratios_[first], &at) && settles;
              shares_[k] = at.holds;
              return;
            }
            at = SupportState();
            if (begins && !is_first) {
              at.twist = damped_[k];
            } else {
              std::copy_n(twist, 3, at.twist.begin());
            }
            at.secant = smoothing_ * friction_.limit() / mass[0];
          });
  if (dampers_left_ == 0) newton_left_ = kNewtonAfterwards;
  if (!settles) std::fill(shares_.begin(), shares_.end(), SupportState::kNothing);
  ++iterations_;
  residual_ = HUGE_VAL;
}

double SupportIteration::RatioOf(const SupportState& at, size_t part, const double twist[3]) const {
  const double* about = at.twist.data();
  if (friction_.is_disc()) {
    const double arm = friction_.arm();
    return std::hypot(twist[0], twist[1], arm * twist[2]) /
           std::hypot(std::hypot(about[0], about[1], arm * about[2]), at.secant);
  }
  double from[2], to[2];
  friction_.points()[part].VelocityAt(about, from);
  friction_.points()[part].VelocityAt(twist, to);
  return std::hypot(to[0], to[1]) / std::hypot(from[0], from[1], at.secant);
}

// What is held keeps its ratio, which is below 1, and slows down without end; that of what slides
// approaches 1.
bool SupportIteration::Classify(const double twist[3], const double* ratios, const double* before,
                                SupportState* at) const {
  SupportState next;
  std::copy_n(twist, 3, next.twist.begin());
  bool settles = true;
  int held = 0;
  for (size_t i = 0; i < NumParts(); ++i) {
    const double missing = 1.0 - ratios[i];
    if (missing >= 1.0 - kHeldByDampers &&
        std::abs(ratios[i] - before[i]) <= kSteadyRatio * missing) {
      ++held;
      next.holds = held == 1 ? static_cast<int>(i) : static_cast<int>(SupportState::kBody);
    } else {
      settles = settles && std::abs(missing) <= kSteadyRatio;
    }
  }
  if (friction_.is_disc() && held == 1) next.holds = SupportState::kBody;
  if (next.holds == SupportState::kBody || (held == 1 && friction_.points().size() == 1)) {
    next.twist = {};
  }
  *at = next;
  return settles;
}

bool SupportIteration::Stands(const SupportState& at, const double mass[3],
                              const double twist[3]) const {
  if (at.holds == SupportState::kBody || !(friction_.limit() > 0.0)) return false;
  const double slow = kStandingPoint * friction_.limit() / mass[0];
  if (friction_.is_disc()) {
    return std::hypot(twist[0], twist[1], friction_.arm() * twist[2]) <= slow;
  }
  if (at.holds == 0 && friction_.points().size() == 1) return false;
  return std::all_of(friction_.points().begin(), friction_.points().end(),
                     [&](const SupportPoint& point) {
                       double velocity[2];
                       point.VelocityAt(twist, velocity);
                       return std::hypot(velocity[0], velocity[1]) <= slow;
                     });
}

bool SupportIteration::HoldStanding(const Model<double>& model,
                                    const ContactProblem<double>& problem,
                                    const ContactSolution<double>& solution,
                                    State<double>* before) {
  if (std::exchange(has_held_standing_, true)) return false;
  bool any = false;
  ForEach(model, problem, solution, before,
          [&](size_t k, const double* mass, const double* twist, const double*, SupportState* of) {
            SupportState& at = *of;
            if (!Stands(at, mass, twist)) return;
            const bool is_point = !friction_.is_disc() && friction_.points().size() == 1;
            at = SupportState();
            at.holds = is_point ? 0 : static_cast<int>(SupportState::kBody);
            shares_[k] = at.holds;  // that of this solve
            any = true;
          });
  if (!any) return false;
  ++iterations_;
  residual_ = HUGE_VAL;
  return true;
}

bool SupportIteration::Accept(const Model<double>& model, const ContactProblem<double>& problem,
                              const ContactSolution<double>& solution, State<double>* before) {
  const ModelStructure& s = *model.structure;
  if (dampers_left_ > 0) {
    GoOnWithDampers(model, problem, solution, before);
    return false;
  }
  const double last = residual_;
  const auto visit = [&](const auto& of_support) {
    ForEach(model, problem, solution, before, of_support);
  };
  residual_ = 0.0;
  double away = 0.0;
  visit(
      [&](size_t k, const double* mass, const double* twist, const double* held, SupportState* at) {
        away = std::max(away, AwayFrom(*at, mass, twist));
        residuals_[k] = ResidualOf(*at, HasShare(k, *at), mass, twist, held);
        if (residuals_[k] < residual_) return;
        residual_ = residuals_[k];
        worst_body_ = s.supports[k].body;
      });
  if (residual_ <= kSupportSettled && (away <= kSupportAbout || is_about_)) {
    return !HoldStanding(model, problem, solution, before);
  }
  if (residual_ <= kSupportSettled) {
    is_about_ = true;
    ++iterations_;
    visit([&](size_t, const double* mass, const double* twist, const double*, SupportState* at) {
      if (AwayFrom(*at, mass, twist) > kSupportAbout) MoveAbout(mass, twist, at);
    });
    return false;
  }
  if (residual_ <= s.settings.lcp_tolerance && residual_ > 0.5 * last) {
    return !HoldStanding(model, problem, solution, before);
  }
  if (--newton_left_ <= 0) {
    GoOnWithDampers(model, problem, solution, before);
    return false;
  }
  ++iterations_;
  visit(
      [&](size_t k, const double* mass, const double* twist, const double* held, SupportState* at) {
        if (residuals_[k] > kSupportSettled)
          Linearise(mass, twist, held, HasShare(k, *at), &turns_[k], at);
      });
  return false;
}

}  // namespace tangible
