// SPDX-License-Identifier: Apache-2.0
//
// Contacts that let go together. Where rows share forces that are not determined (a box on two
// tiles, between a floor and a ceiling, in front of a wall) no contact's own force tells when it
// opens or slides: nothing moves before all are at their limits. Held modes are right as long as
// accelerations without them are the same. From the instant t* on these differ by Δa, a mechanism
// along which all rows that hold go on to hold, and the work of forces and of friction's limits
//
//   g = Σ (n·Δa) λn + Σ (μ |t·Δa| λn + (t·Δa) λt)
//
// reaches 0 at t*. Forces that balance each other do no work along Δa, so that g is the same for
// all shares; and for the forces without held modes each term is 0, so that the derivative of g by
// Δa is too.
#include <algorithm>
#include <cmath>

#include "tangible/lcp/system/contact_conditioning.h"
#include "tangible/simulation/events/event_search_inl.h"
#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// How often an earlier release is looked for before the one that has been found.
constexpr int kMostReleases = 8;
// As a multiple of the accelerations that loads cause: keeps sliding contacts sliding.
constexpr double kKeepsSliding = 1e4;

// Whether loads, or forces, change by more than rounding.
bool Differ(const std::vector<double>& x, const std::vector<double>& y) {
  double largest = 0.0, change = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    largest = std::max({largest, std::abs(x[i]), std::abs(y[i])});
    change = std::max(change, std::abs(x[i] - y[i]));
  }
  return change > kForceTolerance * largest;
}

// Whether all contacts are inside their limits with held modes, by this share of them: then
// accelerations without held modes are the same.
constexpr double kAmple = 0.001;
bool AreInside(const Segment& segment, const ContactSolution<double>& held) {
  double largest = 0.0;
  for (const double force : held.normal_impulse) largest = std::max(largest, force);
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const double normal = held.normal_impulse[i];
    if (!segment.contacts[i].IsPureFriction() && !(normal > kAmple * largest)) return false;
    const double limit = segment.friction[i].value * normal;
    if (segment.modes[i] == ContactMode::kSticking &&
        !(std::abs(held.tangent_impulse[i]) < (1.0 - kAmple) * limit)) {
      return false;
    }
  }
  return true;
}

double ScaleOf(const ContactProblem<double>& problem) {
  return std::max({LoadAcceleration(problem), LimitAcceleration(problem), kNoScale});
}

double RateAlong(const std::vector<double>& change, int block, const RowPart<double>& row) {
  double rate = 0.0;
  for (int i = 0; block >= 0 && i < 3; ++i) rate += row[i] * change[3 * block + i];
  return rate;
}

}  // namespace

SolvedNode* EventSearch::EndOf(const Model<double>& model, Sample* sample) {
  const Segment& motion = sample->motion;
  if (!sample->good) return nullptr;
  sample->has_end = sample->has_end || flow_.Accelerate(model, motion, motion.after,
                                                        motion.time + motion.length, &sample->end);
  return sample->has_end ? &sample->end : nullptr;
}

// Accelerations without held modes, but that what slides slides on.
bool EventSearch::SolveFree(const Model<double>& model, ContactProblem<double>* problem,
                            ContactSolution<double>* free) {
  const double scale = ScaleOf(*problem);
  SizeGuess(*problem, free);
  free->modes = segment_->modes;
  for (size_t i = 0; i < problem->contacts.size(); ++i) {
    problem->contacts[i].c_t += SlidingSign(free->modes[i]) * kKeepsSliding * scale;
  }
  ContactSolverOptions options = SolverOptionsOf(model.structure->settings);
  options.last_resort = false;
  return solver_.Solve(*problem, options, free).solved;
}

bool EventSearch::Departs(const Model<double>& model, double length,
                          std::vector<ReleaseRate>* rates) {
  rates->clear();
  const SolvedNode* const end = EndOf(model, At(model, length));
  if (end == nullptr) return false;
  ContactProblem<double> problem = end->problem;
  const double scale = std::max({LoadAcceleration(problem), LimitAcceleration(problem), kNoScale});
  ContactSolution<double> free;
  SizeGuess(problem, &free);
  free.modes = segment_->modes;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    problem.contacts[i].c_t += SlidingSign(free.modes[i]) * kKeepsSliding * scale;
  }
  ContactSolverOptions options = SolverOptionsOf(model.structure->settings);
  options.last_resort = false;
  if (!solver_.Solve(problem, options, &free).solved) return false;
  std::vector<double> change = free.motion;
  for (size_t i = 0; i < change.size(); ++i) change[i] -= end->solution.motion[i];
  double largest = 0.0;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    ReleaseRate& rate = rates->emplace_back();
    if (!segment_->contacts[i].IsPureFriction()) {
      rate.opens = RateAlong(change, contact.a, contact.normal_a) +
                   RateAlong(change, contact.b, contact.normal_b);
    }
    if (segment_->modes[i] == ContactMode::kSticking) {
      rate.slides = RateAlong(change, contact.a, contact.tangent_a) +
                    RateAlong(change, contact.b, contact.tangent_b);
    }
    largest = std::max({largest, rate.opens, std::abs(rate.slides)});
  }
  if (!(largest > kDeparts * scale)) return false;
  for (ReleaseRate& rate : *rates) {
    rate.opens = rate.opens > kSmallRate * largest ? rate.opens / largest : 0.0;
    rate.slides = std::abs(rate.slides) > kSmallRate * largest ? rate.slides / largest : 0.0;
  }
  return true;
}

double EventSearch::WorkLeft(const Model<double>& model, double length,
                             const std::vector<ReleaseRate>& rates) {
  const SolvedNode* const end = EndOf(model, At(model, length));
  if (end == nullptr) return std::numeric_limits<double>::quiet_NaN();
  Segment mechanism;
  mechanism.release = rates;
  return mechanism.WorkLeft<double>([&](size_t i) { return segment_->friction[i].value; },
                                    end->solution);
}

// The event of contacts that let go after the motion of this length; 0: as it starts.
void EventSearch::TakeRelease(const std::vector<ReleaseRate>& rates, double length, Event* event) {
  const auto size = [](const ReleaseRate& r) { return std::max(r.opens, std::abs(r.slides)); };
  const auto most = std::max_element(
      rates.begin(), rates.end(), [&](const auto& x, const auto& y) { return size(x) < size(y); });
  Event trial;
  trial.at_start = length == 0.0;
  trial.length = length > 0.0 ? std::min(length, event->length) : event->length;
  trial.index = static_cast<int>(most - rates.begin());
  trial.contact = segment_->contacts[static_cast<size_t>(trial.index)];
  trial.kind = most->slides != 0.0 ? EventKind::kSlipBegins : EventKind::kLiftOff;
  trial.sign = most->slides > 0.0 ? -1.0 : 1.0;
  trial.release = rates;
  *event = trial;
}

bool EventSearch::SharesChange(const Model<double>& model, double length) {
  const std::vector<ActiveContact>& contacts = segment_->contacts;
  if (keeps_starts_ || contacts.empty() || contacts.size() >= kManyContacts ||
      !model.structure->supports.empty() ||
      std::any_of(contacts.begin(), contacts.end(), [](const auto& c) { return c.is_rolling; })) {
    return false;
  }
  // The two ends of a face, alone, are one function (Segment::SticksWith).
  const ModelStructure& structure = *model.structure;
  if (structure.joints.empty() && std::all_of(contacts.begin(), contacts.end(), [&](const auto& c) {
        return c.IsBetweenTheSame(contacts.front());
      })) {
    return false;
  }
  const SolvedNode* const end = EndOf(model, At(model, length));
  if (end == nullptr || AreInside(*segment_, end->solution)) return false;
  const SolvedNode& start = At(model, length)->motion.stages[0];
  // Of bodies without joints, as in a heap at rest, forces change with loads alone, but for
  // rounding.
  const ContactSolution<double>& first = start.solution;
  const ContactSolution<double>& last = end->solution;
  const bool change =
      !structure.paths.empty() || Differ(start.problem.load, end->problem.load) ||
      (!structure.joints.empty() && (Differ(first.normal_impulse, last.normal_impulse) ||
                                     Differ(first.tangent_impulse, last.tangent_impulse)));
  return change && CountRedundantRows(start.problem, segment_->modes) > 0;
}

// Contacts that would open, or that pull with held modes: where accelerations are the same at the
// motion's start without them they share forces of others, but bear nothing that others could not.
bool EventSearch::AreUnneeded(const Model<double>& model, double length,
                              std::vector<ReleaseRate>* rates) {
  std::vector<ReleaseRate> opens(rates->size());
  const std::vector<double>& normal = EndOf(model, At(model, length))->solution.normal_impulse;
  double largest = 0.0;
  for (const double force : normal) largest = std::max(largest, std::abs(force));
  for (size_t i = 0; i < opens.size(); ++i) {
    const bool pulls = !segment_->contacts[i].IsPureFriction() && normal[i] < -kIdleShare * largest;
    opens[i].opens = (*rates)[i].opens > 0.0 || pulls ? 1.0 : 0.0;
  }
  const SolvedNode& start = At(model, segment_->length)->motion.stages[0];
  ContactProblem<double> problem = start.problem;
  bool any = false;
  for (size_t i = 0; i < opens.size(); ++i) {
    if (opens[i].opens == 0.0) continue;
    any = true;
    problem.contacts[i].c_n += kKeepsSliding * ScaleOf(problem);
  }
  if (!any) return false;
  ContactSolution<double> free;
  if (!SolveFree(model, &problem, &free)) return false;
  for (size_t i = 0; i < free.motion.size(); ++i) {
    if (std::abs(free.motion[i] - start.solution.motion[i]) > kDeparts * ScaleOf(start.problem)) {
      return false;
    }
  }
  rates->swap(opens);
  return true;
}

void EventSearch::SearchRelease(const Model<double>& model, Event* event) {
  if (!shares_) return;
  const SolvedNode& start = At(model, segment_->length)->motion.stages[0];
  double scale = 0.0;
  for (const double load : start.problem.load) scale = std::max(scale, std::abs(load));
  const double tolerance = kForceTolerance * scale;
  // An event at the end of the motion is told by what follows it.
  double high = event->length * (1.0 + kPastEnd);
  std::vector<ReleaseRate> rates, earlier;
  if (!Departs(model, high, &rates)) return;
  if (AreUnneeded(model, high, &rates)) {
    TakeRelease(rates, 0.0, event);
    return;
  }
  for (int k = 0; k < kMostReleases; ++k) {
    double fb = WorkLeft(model, high, rates);
    if (!(fb < 0.0)) return;
    double a = 0.0, fa = WorkLeft(model, 0.0, rates);
    for (const double share : {0.5, 0.125, 0x1p-6, 0x1p-9}) {
      if (fa > tolerance) break;
      a = share * high;
      fa = WorkLeft(model, a, rates);
    }
    double root = 0.0;
    if (fa > tolerance) {
      const auto work = [&](const Sample& sample) { return WorkLeft(model, sample.length, rates); };
      root = Refine(model, work, kLocatedOfSize * scale, a, fa, high, fb);
      if (Departs(model, (1.0 - kBeforeRelease) * root, &earlier)) {
        high = (1.0 - kBeforeRelease) * root;
        rates.swap(earlier);
        continue;
      }
    } else if (!Departs(model, a, &rates)) {
      return;
    }
    // At the end of the motion within the rounding of forces the event is there.
    if (root > 0.0) {
      const double left = WorkLeft(model, event->length, rates);
      if (left > tolerance) return;
      if (left >= -tolerance) root = event->length;
    }
    TakeRelease(rates, root, event);
    return;
  }
}

bool EventStepper::Releases(const Model<double>& model, const Segment& segment) {
  if (search_.ends_at_start() && segment.event == EventKind::kSlipEnds) {
    // It would slide backwards at once: what moves it has only just reached its limit.
    released_.clear();
    resting_.push_back(segment.event_contact);
    SwitchMode(segment);
  } else if (search_.ends_at_start() && !segment.release.empty()) {
    ReleaseTogether(segment);
  } else if (search_.ends_at_start()) {
    // What slides backwards when it is let go, and holds with more than its limit, jams: it opens,
    // or is held where it would close again.
    const ActiveContact& event = segment.event_contact;
    const auto has_event = [&](const std::vector<ActiveContact>& contacts) {
      return std::any_of(contacts.begin(), contacts.end(),
                         [&](const ActiveContact& one) { return one.SameAs(event); });
    };
    const bool jams = segment.event == EventKind::kSlipBegins && has_event(resting_);
    if (jams && (event.IsPureFriction() || has_event(jammed_))) {
      released_.clear();
      search_.KeepStarts(true);
      --record_.num_parts;
      return true;
    }
    if (jams) jammed_.push_back(event);
    const bool opens = jams || segment.event == EventKind::kLiftOff;
    for (const ActiveContact& contact : segment.contacts) {
      if (opens ? contact.SameAs(segment.event_contact)
                : contact.IsBetweenTheSame(segment.event_contact)) {
        released_.push_back({contact, opens ? 0.0 : -segment.event_sign});
      }
    }
  } else {
    const double slow = search_.SpeedTolerance(model, segment.after);
    const bool all_go = std::all_of(released_.begin(), released_.end(), [&](const EndingSlip& one) {
      const ContactSpeeds speeds = SpeedsOf(model, segment.after, one.contact);
      return (one.sign == 0.0 ? speeds.normal : one.sign * speeds.slip) >= -slow;
    });
    released_.clear();
    search_.KeepStarts(!all_go);
    if (all_go) return false;
  }
  --record_.num_parts;
  return true;
}

void EventStepper::ReleaseTogether(const Segment& segment) {
  for (size_t i = 0; i < segment.release.size(); ++i) {
    const ReleaseRate& rate = segment.release[i];
    if (rate.opens == 0.0 && rate.slides == 0.0) continue;
    const double sign = rate.opens > 0.0 ? 0.0 : rate.slides > 0.0 ? 1.0 : -1.0;
    released_.push_back({segment.contacts[i], sign});
    for (size_t k = 0; k < guess_.contacts.size(); ++k) {
      if (!guess_.contacts[k].SameAs(segment.contacts[i])) continue;
      guess_.modes[k] = sign == 0.0  ? ContactMode::kOpen
                        : sign > 0.0 ? ContactMode::kSlidingPositive
                                     : ContactMode::kSlidingNegative;
    }
  }
}

void EventStepper::OpenIdle(const Model<double>& model, Segment* segment,
                            ContactSolution<double>* solution) {
  const ModelStructure& s = *model.structure;
  if (segment->contacts.size() >= kManyContacts || (s.signals.empty() && s.springs.empty())) return;
  double largest = 0.0;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    if (!segment->contacts[i].IsPureFriction()) {
      largest = std::max(largest, solution->normal_impulse[i]);
    }
  }
  const double idle = kForceTolerance * largest;
  const auto is_idle = [&](size_t i) {
    return solution->modes[i] != ContactMode::kOpen && !segment->contacts[i].IsPureFriction() &&
           solution->normal_impulse[i] <= idle;
  };
  bool any = false;
  for (size_t i = 0; i < segment->contacts.size(); ++i) any = any || is_idle(i);
  if (!any || !(largest > 0.0)) return;
  segment->modes = solution->modes;
  const bool held = flow_.Accelerate(model, *segment, segment->before, segment->time, &idle_);
  segment->modes.clear();
  if (!held) return;
  for (size_t i = 0; i < segment->contacts.size(); ++i) {
    const double share = std::max(std::abs(idle_.solution.normal_impulse[i]),
                                  std::abs(idle_.solution.tangent_impulse[i]));
    if (is_idle(i) && share > kIdleShare * largest) solution->modes[i] = ContactMode::kOpen;
  }
}

}  // namespace tangible
