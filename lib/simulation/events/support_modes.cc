// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/support_modes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// Motions at supports end at multiples of dt / 2^k with k up to this.
constexpr int kMostSupportHalvings = 30;

// The speed of a part of a support at a twist: of all of it, as a body, or of a point, m/s.
double SpeedOfPart(const SupportFriction& friction, int part, const double twist[3]) {
  if (friction.is_disc()) return std::hypot(twist[0], twist[1], friction.arm() * twist[2]);
  double speed = 0.0;
  for (size_t i = 0; i < friction.points().size(); ++i) {
    if (part != SupportState::kBody && part != static_cast<int>(i)) continue;
    double v[2];
    friction.points()[i].VelocityAt(twist, v);
    speed = std::max(speed, std::hypot(v[0], v[1]));
  }
  return speed;
}

// The acceleration of a point on a body, m/s².
void AccelerationOf(const SupportPoint& point, const double acceleration[3], double turn,
                    double out[2]) {
  point.VelocityAt(acceleration, out);
  for (int i = 0; i < 2; ++i) out[i] -= turn * turn * point.arm[i];
}

// The product of the motions of all of a support at two twists, over its points.
double ProductOf(const SupportFriction& friction, const double u[3], const double w[3]) {
  if (friction.is_disc()) {
    return u[0] * w[0] + u[1] * w[1] + friction.arm() * friction.arm() * u[2] * w[2];
  }
  double product = 0.0;
  for (const SupportPoint& point : friction.points()) {
    double v[2], x[2];
    point.VelocityAt(u, v);
    point.VelocityAt(w, x);
    product += v[0] * x[0] + v[1] * x[1];
  }
  return product;
}

// How fast a part of a support gains speed along its motion, m²/s³.
double GainOfPart(const SupportFriction& friction, int part, const double twist[3],
                  const double acceleration[3]) {
  if (friction.is_disc()) {
    const double arm = friction.arm();
    return twist[0] * acceleration[0] + twist[1] * acceleration[1] +
           arm * arm * twist[2] * acceleration[2];
  }
  double gain = 0.0;
  for (size_t i = 0; i < friction.points().size(); ++i) {
    if (part != SupportState::kBody && part != static_cast<int>(i)) continue;
    double v[2], a[2];
    friction.points()[i].VelocityAt(twist, v);
    AccelerationOf(friction.points()[i], acceleration, twist[2], a);
    gain += v[0] * a[0] + v[1] * a[1];
  }
  return gain;
}

// What is held of a support where all of a part of it is: a single point does not keep its body
// from turning.
int WholeOf(const SupportIndex& support, int part) {
  const bool one = support.kind == SupportIndex::kCentre ||
                   (support.kind == SupportIndex::kPoints && support.num_points == 1);
  return one ? 0 : part;
}

const double* NumbersOfBlock(const Model<double>& model, int k, const std::vector<double>& values) {
  const ModelStructure& s = *model.structure;
  return &values[3 * static_cast<size_t>(s.bodies[s.supports[k].body].block)];
}

}  // namespace

void SupportModes::StartStep(const ModelStructure& structure, double t) {
  start_ = t;
  dt_ = structure.settings.dt;
  rested_.clear();
  let_go_.assign(structure.supports.size(), SupportState());
  unsettled_start_.assign(structure.supports.size(), 0);
  speeds_.assign(structure.supports.size(), 0.0);
  last_speeds_ = speeds_;
}

void SupportModes::TakeEvent(const Segment& segment) {
  if (segment.event == EventKind::kSupportStops) {
    rested_.push_back({segment.event_index,
                       segment.before.supports[static_cast<size_t>(segment.event_index)].slow});
  } else if (segment.event == EventKind::kSupportLetsGo) {
    let_go_[static_cast<size_t>(segment.event_index)] = segment.event_support;
  }
}

void SupportModes::Stopped() {
  rested_.clear();
  for (size_t k = 0; k < speeds_.size(); ++k) {
    if (speeds_[k] == 0.0) last_speeds_[k] = 0.0;
  }
}

void SupportModes::Moved(bool has_length) {
  rested_.clear();
  last_speeds_ = speeds_;
  if (!has_length) return;
  for (SupportState& one : let_go_) one.slow = SupportState::kNothing;
}

SupportModes::Course SupportModes::CourseOf(const Model<double>& model, int k, double slow,
                                            const Segment& segment, SupportState* at) {
  const SupportIndex& support = model.structure->supports[k];
  *at = SupportState();
  if (!(friction_.limit() > 0.0)) return Course::kFree;
  if (let_go_[k].slow != SupportState::kNothing) {
    *at = let_go_[k];
    return Course::kReleased;
  }
  const double* twist = &segment.before.twist[3 * static_cast<size_t>(support.body)];
  const double unit =
      friction_.limit() / model.parameters[model.structure->bodies[support.body].mass];
  const double stops = std::max(slow, kSlowSupport * unit * dt_);
  const auto rest_of = [&](int part) {
    const bool found = std::any_of(rested_.begin(), rested_.end(), [&](const Rested& one) {
      return one.support == k && (one.part == part || one.part == SupportState::kBody);
    });
    return found ? 2.0 * stops : std::max(slow, kStandingPoint * unit * dt_);
  };
  const auto rests = [&](int part) { return SpeedOfPart(friction_, part, twist) <= rest_of(part); };
  const double speed = SpeedOfPart(friction_, SupportState::kBody, twist);
  speeds_[k] = speed;
  const int whole = WholeOf(support, SupportState::kBody);
  if (rests(whole)) {
    const BodyIndex& body = model.structure->bodies[support.body];
    const double lever = std::sqrt(model.parameters[body.inertia] / model.parameters[body.mass]);
    turns_[k] = lever * std::abs(twist[2]) > rest_of(whole) ? 1 : 0;
    if (turns_[k] != 0 && support.kind == SupportIndex::kPoints && whole == 0) {
      std::copy_n(twist, 3, at->twist.begin());
      at->holds = 0;
      return Course::kTurns;
    }
    return Course::kRests;
  }
  std::copy_n(twist, 3, at->twist.begin());
  for (int i = 0; support.kind == SupportIndex::kPoints && i < support.num_points; ++i) {
    if (rests(i)) at->holds = i;
  }
  if (speed <= stops) {
    at->slow = SupportState::kBody;
    return Course::kStops;
  }
  if (at->holds != SupportState::kNothing) return Course::kTurns;
  // Whether it starts, its acceleration from rest tells. What was faster before does not.
  const bool has_slowed = speed < last_speeds_[k];
  const bool may_start = !has_slowed && unsettled_start_[k] == 0;
  if (speed <= kStartingSupport * unit * dt_ && may_start) return Course::kStarts;
  return CourseOfPoints(support, stops, kStartingSupport * unit * dt_, at);
}

// Of a body that is not at rest and does not start: whether its slowest point is slow.
SupportModes::Course SupportModes::CourseOfPoints(const SupportIndex& support, double stops,
                                                  double starts, SupportState* at) {
  double least = std::max(stops, starts);
  for (int i = 0; support.kind == SupportIndex::kPoints && i < support.num_points; ++i) {
    const double speed = SpeedOfPart(friction_, i, at->twist.data());
    if (speed > least || (speed == least && at->slow != SupportState::kNothing)) continue;
    at->slow = i;
    least = speed;
  }
  if (at->slow == SupportState::kNothing) return Course::kSlides;
  return least <= stops ? Course::kStops : Course::kPasses;
}

void SupportModes::Begin(const Model<double>& model, double slow, Segment* segment) {
  const ModelStructure& s = *model.structure;
  State<double>& before = segment->before;
  before.supports.assign(s.supports.size(), SupportState());
  courses_.assign(s.supports.size(), Course::kFree);
  sought_.assign(s.supports.size(), SupportState::kNothing);
  turns_.assign(s.supports.size(), 0);
  turned_.assign(s.supports.size(), 0);
  horizons_.assign(s.supports.size(), 0.0);
  may_creep_ = true;
  times_gone_on_ = 0;
  changes_ = 0;
  times_let_go_ = 0;
  unsettled_ = -1;
  started_ = false;
  for (int k = 0; k < static_cast<int>(s.supports.size()); ++k) {
    friction_.Set(model, before, s.supports[k], 1.0);
    SupportState& at = before.supports[k];
    courses_[k] = CourseOf(model, k, slow, *segment, &at);
    if (courses_[k] == Course::kRests || courses_[k] == Course::kStarts) {
      Seek(k, SupportState::kBody, &at);
    } else if (!segment->contacts.empty() || !s.joints.empty()) {
      // Others may share what holds its point, or start with it.
      if (courses_[k] == Course::kTurns) Seek(k, at.holds, &at);
      if (courses_[k] == Course::kPasses) Seek(k, at.slow, &at);
    }
  }
}

// A body that is slow slides on by its velocity.
void SupportModes::GoOn(const Model<double>& model, int k, State<double>* before) {
  const SupportIndex& support = model.structure->supports[k];
  const double* twist = &before->twist[3 * static_cast<size_t>(support.body)];
  friction_.Set(model, *before, support, 1.0);
  const double unit =
      friction_.limit() / model.parameters[model.structure->bodies[support.body].mass] * dt_;
  horizons_[k] = 0.0;
  SupportState& at = before->supports[k];
  at = SupportState();
  std::copy_n(twist, 3, at.twist.begin());
  started_ = false;
  for (int i = 0; support.kind == SupportIndex::kPoints && i < support.num_points; ++i) {
    if (SpeedOfPart(friction_, i, twist) <= kStandingPoint * unit) at.holds = i;
  }
  if (at.holds != SupportState::kNothing) {
    courses_[k] = Course::kTurns;
    return Seek(k, at.holds, &at);
  }
  courses_[k] = CourseOfPoints(support, kSlowSupport * unit, kStartingSupport * unit, &at);
  sought_[k] = SupportState::kNothing;
}

bool SupportModes::LetGo(const Model<double>& model, State<double>* before) {
  if (!started_ || ++times_let_go_ > kMostLetGo) return false;
  bool any = false;
  for (int k = 0; k < static_cast<int>(before->supports.size()); ++k) {
    SupportState& at = before->supports[k];
    if (sought_[k] == SupportState::kNothing || at.holds == SupportState::kNothing) continue;
    any = true;
    // What a driven body pushes may start along that push, at any friction.
    if (HasBegun(k) && times_let_go_ > 1) {
      GoOn(model, k, before);
      continue;
    }
    at = SupportState();
    at.slow = sought_[k];
    at.is_sought = true;
  }
  return any;
}

bool SupportModes::GoOnInstead(const Model<double>& model, State<double>* before) {
  bool any = false;
  if (changes_ <= kMostOfSlow || times_gone_on_ >= kMostGoneOn) return any;
  for (int k = 0; k < static_cast<int>(before->supports.size()); ++k) {
    const bool creeps = courses_[k] == Course::kCreeps && changes_ > kMostOfCreeping;
    if (!HasBegun(k) && !creeps) continue;
    GoOn(model, k, before);
    // Where the friction of its slow point does not settle again, its velocity tells that too.
    if (times_gone_on_ > 0) SlideOn(k, &before->supports[k]);
    unsettled_start_[k] = 1;
    any = true;
    may_creep_ = may_creep_ && !creeps;
  }
  times_gone_on_ += any ? 1 : 0;
  if (any) changes_ = 0;
  return any;
}

void SupportModes::SlideOn(int k, SupportState* at) {
  sought_[k] = SupportState::kNothing;
  at->slow = SupportState::kNothing;
  at->is_sought = false;
  if (courses_[k] == Course::kPasses) courses_[k] = Course::kSlides;
}

// At first it has none.
void SupportModes::Seek(int k, int part, SupportState* at) {
  sought_[k] = part;
  started_ = false;
  *at = SupportState();
  at->slow = part;
  at->is_sought = true;
  at->horizon = horizons_[k];
}

long SupportModes::NumSought() const {
  return std::count_if(sought_.begin(), sought_.end(),
                       [](int part) { return part != SupportState::kNothing; });
}

bool SupportModes::Accept(const Model<double>& model, const ContactProblem<double>& problem,
                          const ContactSolution<double>& solution, Segment* segment) {
  return AcceptAll(model, problem, solution, segment) && !FindCreeping(model, solution, segment);
}

bool SupportModes::FindCreeping(const Model<double>& model, const ContactSolution<double>& solution,
                                Segment* segment) {
  const ModelStructure& s = *model.structure;
  if (!may_creep_ || (s.joints.empty() && segment->contacts.empty())) return false;
  bool any = false;
  for (int k = 0; k < static_cast<int>(s.supports.size()); ++k) {
    const Course course = courses_[k];
    if (course != Course::kSlides && course != Course::kTurns && course != Course::kPasses) {
      continue;
    }
    // A single point that rests is a pivot, and has no speed.
    if (segment->before.supports[k].holds == WholeOf(s.supports[k], SupportState::kBody)) continue;
    friction_.Set(model, segment->before, s.supports[k], 1.0);
    const BodyIndex& body = s.bodies[s.supports[k].body];
    const double unit = friction_.limit() / model.parameters[body.mass];
    const double* acceleration = NumbersOfBlock(model, k, solution.motion);
    if (speeds_[k] > kCreepingSpeed * unit * dt_ ||
        SpeedOfPart(friction_, SupportState::kBody, acceleration) > kCreeping * unit) {
      continue;
    }
    const double* twist = &segment->before.twist[3 * static_cast<size_t>(s.supports[k].body)];
    const double loss = -GainOfPart(friction_, SupportState::kBody, twist, acceleration);
    const double square = ProductOf(friction_, twist, twist);
    // By much less than would stop it; near states have the same.
    double horizon = kMostHorizon * dt_;
    while (loss * horizon > kHorizonOfRest * square) horizon *= kShorterHorizon;
    courses_[k] = Course::kCreeps;
    horizons_[k] = horizon;
    SeekCreeping(model, k, acceleration, &segment->before);
    any = true;
  }
  if (any) StartAtGuess(model, segment->before);
  return any;
}

void SupportModes::SeekCreeping(const Model<double>& model, int k, const double* acceleration,
                                State<double>* before) {
  SupportState& at = before->supports[k];
  const int holds = at.holds;
  Seek(k, SupportState::kBody, &at);
  // A point at rest stays the pivot.
  if (holds >= 0 && holds != WholeOf(model.structure->supports[k], SupportState::kBody)) {
    at.holds = holds;
  }
  const size_t first = 3 * static_cast<size_t>(model.structure->supports[k].body);
  for (size_t i = 0; i < 3; ++i) {
    at.twist[i] = acceleration[i] + before->twist[first + i] / horizons_[k];
  }
}

void SupportModes::StartAtGuess(const Model<double>& model, const State<double>& before) {
  iteration_.StartAt(model, 1.0, sought_, before);
  started_ = true;
}

void SupportModes::ShortenHorizon(const Model<double>& model, int k, State<double>* before) {
  SupportState& at = before->supports[k];
  horizons_[k] *= kShorterHorizon;
  if (horizons_[k] > kLeastHorizon * dt_) {
    constexpr double kNoAcceleration[3] = {0.0, 0.0, 0.0};
    SeekCreeping(model, k, kNoAcceleration, before);
    return StartAtGuess(model, *before);
  }
  horizons_[k] = 0.0;
  may_creep_ = false;
  const SupportIndex& support = model.structure->supports[k];
  friction_.Set(model, *before, support, 1.0);
  const BodyIndex& body = model.structure->bodies[support.body];
  if (speeds_[k] <= kSlowSupport * friction_.limit() / model.parameters[body.mass] * dt_) {
    courses_[k] = Course::kRests;  // it has hardly begun to move
    return Seek(k, SupportState::kBody, &at);
  }
  at = SupportState();
  at.slow = SupportState::kBody;
  std::copy_n(&before->twist[3 * static_cast<size_t>(support.body)], 3, at.twist.begin());
  courses_[k] = Course::kStops;
  sought_[k] = SupportState::kNothing;
  started_ = false;
}

bool SupportModes::AcceptAll(const Model<double>& model, const ContactProblem<double>& problem,
                             const ContactSolution<double>& solution, Segment* segment) {
  const ModelStructure& s = *model.structure;
  State<double>& before = segment->before;
  ++changes_;
  bool accepted = true;
  const long sought = NumSought();
  for (int k = 0; k < static_cast<int>(s.supports.size()); ++k) {
    if (AcceptOne(model, k, solution, segment)) continue;
    accepted = false;
    unsettled_ = k;
  }
  if (NumSought() != sought) return false;
  if (sought == 0) return accepted;
  bool settled = false;
  if (!std::exchange(started_, true)) {
    // Everything but the supports, with the impulses of contacts and joints, is in M a.
    pushed_.mass = problem.mass;
    pushed_.load.resize(problem.load.size());
    for (size_t i = 0; i < pushed_.load.size(); ++i) {
      pushed_.load[i] = problem.mass[i] * solution.motion[i];
    }
    iteration_.Start(model, 1.0, pushed_, sought_, &before);
  } else {
    settled = iteration_.Accept(model, problem, solution, &before);
  }
  const bool may_share = !segment->contacts.empty() || !s.joints.empty();
  if (settled && may_share && HoldSharing(model, solution, segment)) return false;
  for (int k = 0; k < static_cast<int>(s.supports.size()); ++k) {
    if (sought_[k] == SupportState::kNothing) continue;
    SupportState& at = before.supports[k];
    at.slow = sought_[k];
    // A body that starts keeps the derivative of its direction.
    at.is_sought = true;
    if (sought_[k] >= 0 && at.holds != SupportState::kNothing) {
      at.slow = SupportState::kNothing;
      at.is_sought = false;
    }
    if (!settled) unsettled_ = k;
    if (settled && courses_[k] == Course::kCreeps &&
        at.holds == WholeOf(s.supports[k], SupportState::kBody)) {
      ShortenHorizon(model, k, &before);
      accepted = false;
    }
    if (!settled || !HasBegun(k)) continue;
    // What is slow, but does not move along the acceleration that it would have at rest, comes to
    // rest or turns.
    friction_.Set(model, before, s.supports[k], 1.0);
    if (sought_[k] >= 0) friction_.KeepPoint(sought_[k]);
    if (at.holds == SupportState::kNothing && StartsAlong(model, k, before)) continue;
    GoOn(model, k, &before);
    accepted = false;
  }
  return accepted && settled;
}

// Whether a slow velocity is along the acceleration with which friction has been sought. Where
// points start with it the direction turns from the first on, and what is across it, which friction
// takes away at once, counts by its size.
bool SupportModes::StartsAlong(const Model<double>& model, int k,
                               const State<double>& before) const {
  const SupportIndex& support = model.structure->supports[k];
  const double* twist = &before.twist[3 * static_cast<size_t>(support.body)];
  const double* goes = before.supports[k].twist.data();
  const double along = ProductOf(friction_, twist, goes);
  const double speeds = ProductOf(friction_, twist, twist);
  const double sizes = std::sqrt(speeds * ProductOf(friction_, goes, goes));
  if (!(sizes > 0.0)) return false;
  const double unit =
      friction_.limit() / model.parameters[model.structure->bodies[support.body].mass];
  // 1 − cos is half of the square of a small angle.
  double within = 1.0 - kStartingAlong;
  if (std::any_of(sought_.begin(), sought_.end(), [](int part) { return part >= 0; })) {
    within /= std::max(speeds / std::pow(kStartingSupport * unit * dt_, 2), kLeastOfStart);
  }
  return sizes - along <= within * sizes;
}

bool SupportModes::HoldSharing(const Model<double>& model, const ContactSolution<double>& solution,
                               Segment* segment) {
  const ModelStructure& s = *model.structure;
  std::vector<int> still;
  bool any = false;
  for (int k = 0; k < static_cast<int>(s.supports.size()); ++k) {
    if (sought_[k] == SupportState::kNothing || HasBegun(k)) continue;
    if (courses_[k] == Course::kCreeps) continue;
    friction_.Set(model, segment->before, s.supports[k], 1.0);
    const double unit = friction_.limit() / model.parameters[s.bodies[s.supports[k].body].mass];
    const double* acceleration = NumbersOfBlock(model, k, solution.motion);
    double size = SpeedOfPart(friction_, SupportState::kBody, acceleration);
    if (sought_[k] >= 0) {
      double of_point[2];
      AccelerationOf(friction_.points()[static_cast<size_t>(sought_[k])], acceleration,
                     segment->before.twist[3 * static_cast<size_t>(s.supports[k].body) + 2],
                     of_point);
      size = std::hypot(of_point[0], of_point[1]);
    }
    if (!(size <= kStandingPoint * unit)) continue;
    still.push_back(k);
    any = any || segment->before.supports[k].holds != WholeOf(s.supports[k], sought_[k]);
  }
  if (!any) return false;
  for (const int k : still) {
    SupportState& at = segment->before.supports[k];
    at = SupportState();
    at.holds = WholeOf(s.supports[k], sought_[k]);
    courses_[k] = Course::kShares;
    sought_[k] = SupportState::kNothing;
  }
  started_ = false;
  return true;
}

// Of a point at rest on a body that turns: whether friction holds it, or else the direction in
// which it starts.
bool SupportModes::AcceptPoint(int point, const double acceleration[3], double turn,
                               const double* held, int* changes, SupportState* at) const {
  constexpr int kMostDirections = 40;
  const SupportPoint& of = friction_.points()[static_cast<size_t>(point)];
  double way[2];
  if (at->holds == point) {
    const double size = std::hypot(held[0], held[1]);
    if (size <= (1.0 + kForceTolerance) * of.limit) return true;
    for (int i = 0; i < 2; ++i) way[i] = -held[i] / size;
    at->holds = SupportState::kNothing;
    at->slow = point;
  } else {
    double of_point[2];
    AccelerationOf(of, acceleration, turn, of_point);
    const double size = std::hypot(of_point[0], of_point[1]);
    if (!(size > 0.0) || *changes > kMostDirections) return true;
    for (int i = 0; i < 2; ++i) way[i] = of_point[i] / size;
    if (std::hypot(way[0] - at->twist[0], way[1] - at->twist[1]) <= kSupportDirection) return true;
  }
  ++*changes;
  at->twist = {way[0], way[1], 0.0};
  return false;
}

bool SupportModes::AcceptOne(const Model<double>& model, int k,
                             const ContactSolution<double>& solution, Segment* segment) {
  const ModelStructure& s = *model.structure;
  const Course course = courses_[k];
  if (course != Course::kStops && course != Course::kTurns && course != Course::kPasses) {
    return true;
  }
  SupportState& at = segment->before.supports[k];
  const double* acceleration = NumbersOfBlock(model, k, solution.motion);
  const double* twist = &segment->before.twist[3 * static_cast<size_t>(s.supports[k].body)];
  friction_.Set(model, segment->before, s.supports[k], 1.0);
  if (sought_[k] != SupportState::kNothing) return true;
  if (course == Course::kTurns) {
    const int point = at.holds >= 0 ? at.holds : at.slow;
    return AcceptPoint(point, acceleration, twist[2],
                       &solution.joint_impulse[3 * (s.joints.size() + static_cast<size_t>(k))],
                       &turned_[k], &at);
  }
  const double gain = GainOfPart(friction_, at.slow, twist, acceleration);
  if (course == Course::kStops) {
    if (gain < 0.0) return true;
    // It does not slow down: it has begun to move, or only passes a low speed.
    courses_[k] = at.slow == SupportState::kBody ? Course::kStarts : Course::kPasses;
    const bool may_share = !segment->contacts.empty() || !s.joints.empty();
    if (at.slow == SupportState::kBody || may_share) Seek(k, at.slow, &at);
    return false;
  }
  const int point = at.slow;
  double of_point[2];
  AccelerationOf(friction_.points()[static_cast<size_t>(point)], acceleration, twist[2], of_point);
  const double along = SpeedOfPart(friction_, point, twist) * std::hypot(of_point[0], of_point[1]);
  if (gain > kStartingAlong * along) {
    return AcceptPoint(point, acceleration, twist[2], nullptr, &turned_[k], &at);
  }
  at = SupportState();
  courses_[k] = Course::kSlides;
  return false;
}

bool SupportModes::IsAtRest(const Model<double>& model, const State<double>& before,
                            int body) const {
  if (body < 0) return true;
  const ModelStructure& s = *model.structure;
  for (size_t k = 0; k < s.supports.size(); ++k) {
    if (s.supports[k].body == body) return courses_[k] == Course::kRests && turns_[k] == 0;
  }
  const double* twist = &before.twist[3 * static_cast<size_t>(body)];
  return s.bodies[body].mass < 0 && twist[0] == 0.0 && twist[1] == 0.0 && twist[2] == 0.0;
}

bool SupportModes::HasToStop(const Model<double>& model, const Segment& segment) const {
  const ModelStructure& s = *model.structure;
  for (size_t k = 0; k < s.supports.size(); ++k) {
    const SupportState& at = segment.before.supports[k];
    if (at.holds == SupportState::kNothing) continue;
    if (courses_[k] == Course::kReleased) continue;
    const double* twist = &segment.before.twist[3 * static_cast<size_t>(s.supports[k].body)];
    // Where the event of another body is at the instant at which this one stops, its speed may be 0
    // to the bit, and the derivative of its speed is not.
    if (HoldsCentre(s.supports[k], at) && speeds_[k] == 0.0 && last_speeds_[k] > 0.0) return true;
    if (at.holds == SupportState::kBody) {
      if (twist[0] != 0.0 || twist[1] != 0.0 || twist[2] != 0.0) return true;
    } else if (s.supports[k].kind == SupportIndex::kCentre) {
      const bool turns_by_rounding = twist[2] != 0.0 && std::abs(twist[2]) < kNoTurn;
      if (twist[0] != 0.0 || twist[1] != 0.0 || turns_by_rounding) return true;
    } else if (std::any_of(rested_.begin(), rested_.end(),
                           [&](const Rested& one) { return one.support == static_cast<int>(k); })) {
      return true;
    }
  }
  return false;
}

bool SupportModes::HoldsStarting(const Segment& segment) const {
  for (size_t k = 0; k < courses_.size(); ++k) {
    if ((courses_[k] == Course::kStarts || courses_[k] == Course::kCreeps) &&
        segment.before.supports[k].holds != SupportState::kNothing) {
      return true;
    }
  }
  return false;
}

// Friction turns a velocity into the direction of motion at the rate M⁻¹ Ψ'', and of that rate
// joints and contacts leave this share: none of a hinge's body, which can turn its velocity by no
// other motion than its own. By traces, where it is far from 1.
double SupportModes::ShareOfDecay(const Model<double>& model, int k, const Segment& segment,
                                  SolvedNode* start) {
  const ModelStructure& s = *model.structure;
  if (s.joints.empty() && segment.contacts.empty()) return 1.0;
  const SupportIndex& support = s.supports[k];
  const size_t first = 3 * static_cast<size_t>(s.bodies[support.body].block);
  const double* twist = &segment.before.twist[3 * static_cast<size_t>(support.body)];
  const SupportState& at = segment.before.supports[k];
  double alone = 0.0, joined = 0.0;
  const auto add = [&](const double row[3], double weight) {
    response_.assign(3 * static_cast<size_t>(start->system.num_blocks()), 0.0);
    std::copy_n(row, 3, &response_[first]);
    start->system.Solve(start->problem, start->solution.modes, response_.data(), 1);
    for (int i = 0; i < 3; ++i) {
      alone += weight * row[i] * row[i] / start->problem.mass[first + i];
      joined += weight * row[i] * response_[first + i];
    }
  };
  if (friction_.is_disc()) {
    double rows[3][3], weights[3];
    DiscDampers(1.5 * friction_.arm(), twist, rows, weights);
    for (int i = 0; i < 3; ++i) add(rows[i], weights[i]);
  }
  for (size_t i = 0; !friction_.is_disc() && i < friction_.points().size(); ++i) {
    if (static_cast<int>(i) == at.holds || static_cast<int>(i) == at.slow) continue;
    const SupportPoint& point = friction_.points()[i];
    double v[2];
    point.VelocityAt(twist, v);
    const double speed = std::hypot(v[0], v[1]);
    if (!(speed > 0.0)) continue;
    const double across[2] = {-v[1] / speed, v[0] / speed};
    const double row[3] = {across[0], across[1],
                           point.arm[0] * across[1] - point.arm[1] * across[0]};
    add(row, point.limit / speed);
  }
  const double share = joined / alone;
  return share >= -kMostLeft && share <= kMostLeft ? std::max(share, 0.0) : 1.0;
}

// The longest motion that a support allows, s.
double SupportModes::LongestOf(const Model<double>& model, int k, const Segment& segment,
                               SolvedNode* start) {
  const double* acceleration = NumbersOfBlock(model, k, start->solution.motion);
  const ModelStructure& s = *model.structure;
  const SupportIndex& support = s.supports[k];
  const BodyIndex& body = s.bodies[support.body];
  const SupportState& at = segment.before.supports[k];
  const double* twist = &segment.before.twist[3 * static_cast<size_t>(support.body)];
  if (courses_[k] == Course::kFree || HoldsCentre(support, at)) return HUGE_VAL;
  friction_.Set(model, segment.before, support, 1.0);
  const double speed = SpeedOfPart(friction_, SupportState::kBody, twist);
  const double size = SpeedOfPart(friction_, SupportState::kBody, acceleration);
  if (courses_[k] == Course::kCreeps) return horizons_[k];
  if (at.slow == SupportState::kBody) {
    const double least = kFirstOfSupport * dt_;
    if (courses_[k] == Course::kStops) return size > 0.0 ? 4.0 * speed / size : least;
    return size > 0.0 ? std::max(least, speed / size) : least;
  }
  const double mass = model.parameters[body.mass];
  const double inertia = model.parameters[body.inertia];
  double longest = HUGE_VAL;
  double share = -1.0;  // ShareOfDecay, where it matters
  const auto limit = [&](double v, double a, double weight, double arm) {
    double decay = weight * (1.0 / mass + arm * arm / inertia) / kSupportDecay;
    if (decay > a / kSupportTurn && v < decay * std::min(longest, segment.length)) {
      if (share < 0.0) share = ShareOfDecay(model, k, segment, start);
      decay *= share;
    }
    longest = std::min(longest, v / std::max(a / kSupportTurn, decay));
  };
  if (friction_.is_disc()) {
    limit(speed, size, friction_.limit(), friction_.arm());
    return longest;
  }
  for (size_t i = 0; i < friction_.points().size(); ++i) {
    const SupportPoint& point = friction_.points()[i];
    if (static_cast<int>(i) == at.holds) continue;
    double v[2], a[2];
    point.VelocityAt(twist, v);
    AccelerationOf(point, acceleration, twist[2], a);
    if (static_cast<int>(i) == at.slow) {
      const double change = std::hypot(a[0], a[1]);
      const double least = kFirstOfSupport * dt_;
      const double to_rest = change > 0.0 ? std::hypot(v[0], v[1]) / change : 0.0;
      longest = std::min(longest, courses_[k] == Course::kStops && change > 0.0
                                      ? 4.0 * to_rest
                                      : std::max(least, to_rest));
      continue;
    }
    limit(std::hypot(v[0], v[1]), std::hypot(a[0], a[1]), point.limit,
          std::hypot(point.arm[0], point.arm[1]));
  }
  return longest;
}

void SupportModes::Shorten(const Model<double>& model, SolvedNode* start, Segment* segment) {
  double longest = HUGE_VAL;
  for (int k = 0; k < static_cast<int>(model.structure->supports.size()); ++k) {
    longest = std::min(longest, LongestOf(model, k, *segment, start));
  }
  if (!(segment->length > longest)) return;
  double spacing = dt_;
  for (int k = 1; k <= kMostSupportHalvings && spacing > longest; ++k) {
    spacing = std::ldexp(dt_, -k);
  }
  // The slack is that of the time's rounding.
  const double since = (segment->time - start_) / spacing;
  const double next = start_ + (std::floor(since + kSupportGridSlack) + 1.0) * spacing;
  const double length = next - segment->time;
  if (!(length > 0.0) || length >= segment->length - kSupportGridSlack * spacing) return;
  segment->length = length;
  segment->middle = segment->time + 0.5 * length;
}

}  // namespace tangible
