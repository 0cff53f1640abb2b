// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/certify_grazing.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/seam_contacts.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/events/event_search.h"
#include "tangible/simulation/events/flush_corners.h"

namespace tangible {
namespace {

struct GapCourse {
  double gap = 0.0;
  double speed = 0.0;
};

GapCourse CourseAt(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact) {
  ContactRows<double> rows;
  EvaluateActiveRows(model, state, contact, &rows);
  return {rows.geometry.gap,
          RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b)};
}

// The smallest value on [0, length] of the cubic with these end values; the gap closes at the start
// and opens at the end.
double Least(const GapCourse& start, const GapCourse& end, double length) {
  // ġ(s) = ġ0 + b s + c s², s in [0, 1], per length.
  const double v0 = start.speed * length;
  const double v1 = end.speed * length;
  const double rise = end.gap - start.gap;
  const double b = 6.0 * rise - 4.0 * v0 - 2.0 * v1;
  const double c = 3.0 * (v0 + v1) - 6.0 * rise;
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (v0 + middle * (b + middle * c) < 0.0 ? low : high) = middle;
  }
  const double s = 0.5 * (low + high);
  return start.gap + s * (v0 + s * (0.5 * b + s * c / 3.0));
}

// Whether the pair has closed contacts, or the joint is at its limit.
bool Closed(const Segment& segment, const ActiveContact& contact) {
  return std::any_of(
      segment.contacts.begin(), segment.contacts.end(), [&](const ActiveContact& other) {
        return contact.IsOfShapes()
                   ? other.IsOfShapes() && other.a == contact.a && other.b == contact.b
                   : other.SameAs(contact);
      });
}

// Whether the contact has a gap: shapes, or a joint and its limit.
bool HasGap(const ActiveContact& contact) {
  return contact.IsOfShapes() || !contact.IsPureFriction();
}

class GrazeFinder {
 public:
  GrazeFinder(const Model<double>& model, double most, double missed, std::vector<Graze>* grazes)
      : model_(model), search_(model), most_(most), missed_(missed), grazes_(*grazes) {}

  void Add(const Segment& segment) {
    if (segment.event == EventKind::kTouch && HasGap(segment.event_contact) &&
        !TakesOver(segment)) {
      AddTouch(segment);
    }
    AddSlips(segment);
    if (segment.length > 0.0) last_ = &segment;
    const double reach = segment.length * FastestApproach(segment);
    if (!(reach > 0.0) || !std::isfinite(reach)) {
      return;
    }
    search_.FindContacts(model_, segment.after, reach, &near_);
    AppendLimits(model_, segment.after, &near_);
    for (const ActiveContact& contact : near_) {
      const bool touches =
          segment.event == EventKind::kTouch && contact.SameAs(segment.event_contact);
      if (!touches && !Closed(segment, contact)) {
        AddMiss(segment, contact);
      }
    }
  }

 private:
  // The fastest approach of any two points, m/s.
  double FastestApproach(const Segment& segment) const {
    double fastest = 0.0;
    for (const State<double>* state : {&segment.before, &segment.after}) {
      for (int body = 0; body < model_.structure->num_bodies(); ++body) {
        const double* twist = &state->twist[3 * static_cast<size_t>(body)];
        fastest = std::max(fastest, std::hypot(twist[0], twist[1]) +
                                        std::abs(twist[2]) * search_.lengths().radius(body));
      }
    }
    return 2.0 * fastest;
  }

  // Whether the touch is that of a feature at the point where another one of the same shapes, or
  // of the neighbour at a flush seam, has touched until now, as the corner at the end of a face:
  // nothing new touches, and its speed is 0.
  // Its gap is within the tolerance of the touch where the points of both are √(2 size tolerance)
  // apart along a curve.
  bool TakesOver(const Segment& segment) const {
    const ActiveContact& next = segment.event_contact;
    const double same = std::sqrt(2.0 * search_.lengths().Size(next.a, next.b) *
                                  search_.TouchTolerance(model_, segment.after, next));
    const auto geometry_of = [&](const ActiveContact& contact) {
      ContactRows<double> rows;
      EvaluateContactRows(model_, segment.after, contact, &rows);
      return rows.geometry;
    };
    if (!next.IsOfShapes()) return false;
    const ContactGeometry<double> of_next = geometry_of(next);
    return std::any_of(segment.contacts.begin(), segment.contacts.end(),
                       [&](const ActiveContact& closed) {
                         if (!closed.IsOfShapes()) return false;
                         const ContactGeometry<double> of_closed = geometry_of(closed);
                         return (next.IsOfTheSameShapes(closed) &&
                                 (of_closed.point - of_next.point).norm() <= same) ||
                                AreOfOneSeam(model_, closed, of_closed, next, of_next);
                       });
  }

  void AddTouch(const Segment& segment) {
    // What touches at the start of a motion does so by the motion before it.
    const Segment& motion = segment.length > 0.0 || last_ == nullptr ? segment : *last_;
    const GapCourse start = CourseAt(model_, motion.before, segment.event_contact);
    const GapCourse end = CourseAt(model_, segment.after, segment.event_contact);
    // The last rebounds of a body that comes to rest are slow, but they are not grazing.
    const bool from_above =
        start.gap > search_.TouchTolerance(model_, motion.before, segment.event_contact);
    const double gained =
        from_above && motion.length > 0.0
            ? std::abs(end.speed - start.speed) / motion.length * model_.structure->settings.dt
            : 0.0;
    const double scale = std::max(std::abs(start.speed) + std::abs(end.speed), gained);
    const double ratio = scale > 0.0 ? end.speed / scale : 0.0;
    const double turns = motion.length > 0.0 ? (end.speed - start.speed) / motion.length : 0.0;
    // What would turn around within a step; a parabola tells nothing of a longer way.
    const bool near = turns > 0.0 && -end.speed <= turns * model_.structure->settings.dt;
    const double depth = near ? 0.5 * end.speed * end.speed / turns : HUGE_VAL;
    const double margin = std::min(ratio * ratio, MarginOfMissed(segment.event_contact, depth));
    List({margin, 0.0, segment.event_contact, true, depth}, segment);
  }

  void AddMiss(const Segment& segment, const ActiveContact& contact) {
    const GapCourse start = CourseAt(model_, segment.before, contact);
    const GapCourse end = CourseAt(model_, segment.after, contact);
    // A body that starts at rest on the surface is a contact that opens.
    const double rest = search_.SpeedTolerance(model_, segment.before);
    if (!(start.speed < -rest && end.speed >= -rest)) {
      return;
    }
    const double acceleration = (end.speed - start.speed) / segment.length;
    const double dt = model_.structure->settings.dt;
    const double height =
        std::max(0.5 * start.speed * start.speed / acceleration, 0.5 * acceleration * dt * dt);
    // A minimum just below 0 is rounding: the bodies did not touch.
    const double least = std::abs(Least(start, end, segment.length));
    List({std::min(least / height, MarginOfMissed(contact, least)), 0.0, contact, false, least},
         segment);
  }

  // Below the limit of margins where the motions may have missed so much.
  double MarginOfMissed(const ActiveContact& contact, double slack) const {
    const bool is_angle = contact.joint >= 0 && model_.structure->joints[contact.joint].is_angular;
    const double size = is_angle ? 1.0 : search_.lengths().Size(contact.a, contact.b);
    return missed_ > 0.0 ? kNearKinkMargin * slack / (missed_ * size) : HUGE_VAL;
  }

  // A slip whose speed falls to 0, or nearly, and would rise again: friction that has stopped it
  // must let go at once.
  void AddSlips(const Segment& segment) {
    if (!(segment.length > 0.0) || segment.num_stages == 0) return;
    const double dt = model_.structure->settings.dt;
    const double rest = std::max(search_.SpeedTolerance(model_, segment.before),
                                 search_.SpeedTolerance(model_, segment.after));
    for (size_t i = 0; i < segment.contacts.size(); ++i) {
      const ActiveContact& contact = segment.contacts[i];
      const double sign = SlidingSign(segment.modes[i]);
      if (sign == 0.0) continue;
      const auto speed = [&](const State<double>& state) {
        return sign * SpeedsOf(model_, state, contact).slip;
      };
      const auto rate = [&](const State<double>& state, double time, int stage) {
        return sign * SlipRate(model_, state, time, segment.middle,
                               segment.stages[stage].solution.motion, contact);
      };
      // As of a gap, with speeds for heights and accelerations for speeds.
      const GapCourse start{speed(segment.before), rate(segment.before, segment.time, 0)};
      const GapCourse end{speed(segment.after), rate(segment.after, segment.time + segment.length,
                                                     segment.num_stages - 1)};
      if (!(start.gap > rest && start.speed < 0.0)) continue;
      const double turns = (end.speed - start.speed) / segment.length;
      const double fastest = std::max(std::abs(start.speed), turns * dt);
      if (segment.event == EventKind::kSlipEnds && contact.SameAs(segment.event_contact)) {
        if (!(turns > 0.0)) continue;
        const double ratio = end.speed / fastest;
        List({ratio * ratio, 0.0, contact, true, 0.5 * end.speed * end.speed / turns, true},
             segment);
      } else if (end.speed > 0.0) {
        const double least = std::abs(Least(start, end, segment.length));
        List({least / (0.5 * fastest * fastest / turns), 0.0, contact, false, least, true},
             segment);
      }
    }
  }

  void List(Graze graze, const Segment& segment) {
    if (!(graze.margin < most_)) return;
    graze.time = segment.time + segment.length;
    grazes_.push_back(graze);
  }

  const Model<double>& model_;
  EventSearch search_;
  double most_;
  double missed_;
  const Segment* last_ = nullptr;  ///< of some length
  std::vector<ActiveContact> near_;
  std::vector<Graze>& grazes_;
};

}  // namespace

double MissedBy(const Segment& motion) {
  double fastest = 0.0;
  for (size_t i = 2; i < motion.before.twist.size(); i += 3) {
    fastest = std::max(fastest, std::abs(motion.before.twist[i]));
  }
  const double turn = fastest * motion.length;
  return kMissedOfTurn * turn * turn * turn * turn * turn;
}

void FindGrazes(const Model<double>& model, const EventRecord& record, double most, double missed,
                std::vector<Graze>* grazes) {
  grazes->clear();
  GrazeFinder finder(model, most, missed, grazes);
  for (int p = 0; p < record.num_parts; ++p) {
    if (!record.parts[p]->is_impulses) {
      finder.Add(record.parts[p]->segment);
    }
  }
}

namespace {

// The contacts that touch and do not move along their normals at a state.
std::vector<ActiveContact> AtRest(const Model<double>& model, const State<double>& state) {
  EventSearch search(model);
  double reach = 0.0;
  for (int body = 0; body < model.structure->num_bodies(); ++body) {
    reach = std::max(reach, search.lengths().Touch(state, body, body));
  }
  std::vector<ActiveContact> found;
  search.FindContacts(model, state, reach, &found);
  std::erase_if(found, [&](const ActiveContact& contact) {
    const double normal = SpeedsOf(model, state, contact).normal;
    return contact.gap > search.lengths().Touch(state, contact.a, contact.b) ||
           std::abs(normal) > Negligible(model, normal);
  });
  return found;
}

}  // namespace

// What reaches two limits at once moves along the way of one of them, or of both: beside it along
// that of the first. A box whose friction is the ratio of its sides slides under a push that it
// cannot hold; with any more it would tip. A contact that the last motion held, and that no event
// has opened, opens with no speed then; or one that stuck slides as another one is lifted off.
void RolloutCertifier::AddTwoLimits(const Model<double>& model, long step, const Segment& segment) {
  const double end = segment.time + segment.length;
  const auto in_whole = [&](const ActiveContact& contact) {
    return island_ != nullptr ? island_->InWhole(contact) : contact;
  };
  if (!(segment.length > 0.0)) {
    if (!segment.starts) return;
    for (const ActiveContact& contact : AtRest(model, segment.before)) {
      held_.push_back({in_whole(contact), end});
    }
    return;
  }
  const auto add = [&](double margin, const ActiveContact& contact, const char* what) {
    AddMargin(margin, {model.structure.get(), step, segment.time, 0, &contact, ContactMode::kOpen},
              what);
  };
  const auto speed = [](const State<double>& state, int body) {
    return std::hypot(state.twist[3 * body], state.twist[3 * body + 1]);
  };
  const auto opens = [&](const ActiveContact& contact) {
    if (std::any_of(segment.contacts.begin(), segment.contacts.end(), [&](const auto& other) {
          return other.SameAs(contact) || AreOnOneFace(model, other, contact);
        })) {
      return;
    }
    const ContactSpeeds before = SpeedsOf(model, segment.before, contact);
    const ContactSpeeds after = SpeedsOf(model, segment.after, contact);
    const double moved =
        std::abs(after.slip - before.slip) + std::abs(after.normal) +
        std::abs(speed(segment.after, contact.a) - speed(segment.before, contact.a)) +
        std::abs(speed(segment.after, contact.b) - speed(segment.before, contact.b));
    if (moved > Negligible(model, moved) && std::abs(before.normal) <= kNearKinkMargin * moved) {
      add(std::abs(after.normal) / moved, contact, "opens");
    }
  };
  const auto slides = [&](const ActiveContact& contact) {
    for (size_t i = 0; i < segment.contacts.size(); ++i) {
      if (segment.contacts[i].SameAs(contact) && SlidingSign(segment.modes[i]) != 0.0) {
        add(0.0, contact, "friction limit");
      }
    }
  };
  // Takes those of the bodies that are looked at; what comes later than the last motion is new.
  const auto take = [&](std::vector<Strike>* list, const auto& look) {
    std::erase_if(*list, [&](const Strike& one) {
      const ActiveContact contact =
          island_ != nullptr ? island_->InIsland(one.contact) : one.contact;
      if (contact.a < 0 || contact.b < 0) return false;
      if (std::abs(segment.time - one.time) <= kSameTime * model.structure->settings.dt) {
        look(contact);
      }
      return true;
    });
  };
  take(&held_, opens);
  take(&stuck_, slides);
  const bool lifts = segment.release.empty() && segment.event == EventKind::kLiftOff;
  // An event that opens contacts of a pair, or hands one over to another feature. Several that let
  // go together move as they were seen to.
  const auto is_changed = [&](const ActiveContact& contact) {
    return segment.release.empty() && contact.IsBetweenTheSame(segment.event_contact) &&
           (lifts || segment.event == EventKind::kTouch);
  };
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact& contact = segment.contacts[i];
    if (!contact.IsOfShapes()) continue;
    if (!is_changed(contact) && Has(loaded_, contact)) held_.push_back({in_whole(contact), end});
    if (lifts && segment.modes[i] == ContactMode::kSticking) {
      stuck_.push_back({in_whole(contact), end});
    }
  }
}

}  // namespace tangible
