// SPDX-License-Identifier: Apache-2.0
//
// The search for the gaps of one pair of bodies: those that close, those that touch and return, and
// contacts whose feature gives way to the next one.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/dynamics/elements/contacts_ahead.h"
#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/events/event_search_inl.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// The contact of a vertex that leaves an edge at its end changes its feature when the vertex meets
// the vertex there, not when the gap of the next feature is reached, whose edge has another end:
// this returns the contact of these two vertices. It returns `next` where the pair has none, or
// where rounded corners continue the contact smoothly.
ActiveContact NextAt(const Model<double>& model, const State<double>& state,
                     const ActiveContact& lost, const ActiveContact& next) {
  if (lost.feature.places > 0) return next;
  const bool of_first = lost.feature.kind == FeatureKind::kVertexEdge;
  if (!of_first && lost.feature.kind != FeatureKind::kEdgeVertex) {
    return next;
  }
  const ShapeView<double> shapes[2] = {ShapeOfA(model, lost), ShapeOfB(model, lost)};
  if (IsRound(shapes[0]) || IsRound(shapes[1])) {
    return next;
  }
  const int edge = of_first ? lost.feature.b : lost.feature.a;
  const ShapeView<double>& with_edge = shapes[of_first ? 1 : 0];
  const int ends[2] = {edge, (edge + 1) % NumVertices(with_edge.type, with_edge.num_numbers)};
  const double length = (Vertex(with_edge, ends[0]) - Vertex(with_edge, ends[1])).norm();
  for (const int end : ends) {
    ActiveContact corners = next;
    corners.feature = lost.feature;
    corners.feature.kind = FeatureKind::kVertexVertex;
    (of_first ? corners.feature.b : corners.feature.a) = end;
    ContactRows<double> rows;
    EvaluateContactRows(model, state, corners, &rows);
    corners.gap = rows.geometry.gap;
    if (corners.gap <= kCorner * length) {
      return corners;
    }
  }
  return next;
}

// Whether a contact of a rounded corner passes from an edge to a corner, or back, where both have
// the same normal.
bool PassesSmoothly(const Model<double>& model, const State<double>& state,
                    const ActiveContact& lost, const ActiveContact& next) {
  const auto is_of_corners = [](const ActiveContact& contact) {
    return contact.feature.kind == FeatureKind::kVertexVertex;
  };
  if (is_of_corners(lost) == is_of_corners(next) ||
      !(IsRound(ShapeOfA(model, lost)) || IsRound(ShapeOfB(model, lost)))) {
    return false;
  }
  ContactRows<double> before, after;
  EvaluateContactRows(model, state, lost, &before);
  EvaluateContactRows(model, state, next, &after);
  return before.geometry.normal.dot(after.geometry.normal) > 0.0 &&
         std::abs(SineBetween(before.geometry, after.geometry)) <= kSameNormal;
}

// Of a run's gap: an end that is nearer by less is the vertex over the run.
constexpr double kNearerEnd = 0.001;

// The closest features of a pair.
struct Features {
  ContactFeature of[2];
  int count = 0;
  bool Have(const ContactFeature& feature) const {
    return std::find(of, of + count, feature) != of + count;
  }
};

}  // namespace

class EventSearch::PairSearch {
 public:
  PairSearch(EventSearch* search, const Model<double>& model, int a, int b, PartPair parts,
             Event* event)
      : search_(*search),
        model_(model),
        a_(a),
        b_(b),
        parts_(parts),
        event_(*event),
        segment_(*search->segment_),
        touching_(*search->touching_),
        touch_(search->lengths_.Touch(segment_.before, a, b)),
        located_(search->GapTolerance(segment_.before, a, b)),
        closed_(std::any_of(segment_.contacts.begin(), segment_.contacts.end(),
                            [&](const ActiveContact& c) { return IsOfPair(c); })),
        touches_(std::any_of(touching_.begin(), touching_.end(),
                             [&](const ActiveContact& c) { return IsOfPair(c); })),
        outline_a_(model.OutlineOf(a, parts.a)),
        outline_b_(model.OutlineOf(b, parts.b)),
        curve_a_(model.CurveOf(a, parts.a)),
        curve_b_(model.CurveOf(b, parts.b)),
        may_hide_(model.seams != nullptr && !RestsAtSeams()) {}

  /// The pair's contact that is handed over where the event is, if there is one.
  void AddHandOver(std::vector<HandOver>* found) {
    if (!closed_) return;
    const Sample& sample = *search_.At(model_, event_.length);
    if (const ActiveContact* lost = LostAt(sample.motion.after)) {
      found->push_back({*lost, NextOf(sample)});
    }
  }
  void Run() {
    SearchFrom(0.0, 0.0, Counts::kUntouched);
    if (SearchTouching() && closed_) {
      SearchHandOver();
    }
  }

 private:
  // Which of the pair's contacts that are not closed count: those that touch and leave count only
  // with kAll, and never in penetration, where the sign of their speed marks the return.
  enum class Counts { kUntouched, kAll };

  Features FeaturesAt(const State<double>& state) const {
    Features found;
    // Of a curve whatever the segment may reach counts, which is a part of it.
    const double reach = IsAtCurve() ? search_.reach_[a_] + search_.reach_[b_] + touch_ : kInfinity;
    found.count =
        FindFeatures(model_, a_, state.PoseOf(a_), b_, state.PoseOf(b_), parts_, reach, found.of);
    return found;
  }
  bool IsAtCurve() const { return curve_a_ != nullptr || curve_b_ != nullptr; }
  // A contact of the pair as it is at a state: along a curve it moves.
  ActiveContact AtState(const ActiveContact& contact, const State<double>& state) const {
    ActiveContact moved = contact;
    if (contact.feature.places > 0 && IsOfPair(contact)) {
      moved.feature = FeatureAt(contact.feature, ShapeOfA(model_, contact), state.PoseOf(a_),
                                ShapeOfB(model_, contact), state.PoseOf(b_));
    }
    return moved;
  }
  // Whether one of the contacts is this one at a state.
  bool HaveAt(const std::vector<ActiveContact>& contacts, const ActiveContact& contact,
              const State<double>& state) const {
    if (!IsAtCurve()) return Contains(contacts, contact);
    return std::any_of(contacts.begin(), contacts.end(), [&](const ActiveContact& other) {
      return AtState(other, state).SameAs(contact);
    });
  }
  bool IsOfPair(const ActiveContact& contact) const {
    return contact.IsOfShapes() && contact.a == a_ && contact.b == b_ &&
           contact.feature.part_a == parts_.a && contact.feature.part_b == parts_.b;
  }
  bool IsClosed(const ActiveContact& contact, const State<double>& state) const {
    return HaveAt(segment_.contacts, contact, state);
  }
  bool IsDeep(const ActiveContact& contact, const State<double>& state) const {
    return std::any_of(touching_.begin(), touching_.end(), [&](const ActiveContact& other) {
      return other.gap < -kDeepTouches * touch_ && AtState(other, state).SameAs(contact);
    });
  }
  // Whether one of the pair's bodies rests beside a seam of the other one, on which it may go on.
  bool RestsAtSeams() const;
  // The distance of a pair whose nearest features seams hide, which bounds the gaps that it has
  // before and after; sets nearest_.
  double HiddenGap(const State<double>& state);
  // The same for a run of an outline that the other body is not over; infinite where they touch,
  // from behind.
  double HiddenRunGap(const State<double>& state, ActiveContact contact);
  // The same for a spline.
  double HiddenCurveGap(const State<double>& state, ActiveContact contact);
  // Whether a vertex of the other body is in the solid behind the run.
  bool IsInRun(const State<double>& state) const;
  // The gap of a run with features over it.
  double GapOfRun(const State<double>& state, double of_features);
  // Makes a contact the nearest.
  void TakeNearest(const ActiveContact& contact, const ContactGeometry<double>& geometry);
  // The smallest gap of the contacts that count; sets nearest_.
  double Gap(const Sample& sample, Counts counts, bool handed_over = false);
  // Bound on how fast the gap closes over an interval.
  double ClosingSpeed(double from, double to, Counts counts);
  double BeyondEnds(double from, double to) const;
  KnownCourse CourseOver(double from, double fa, double to, double fb, double allowed,
                         Counts counts);
  // Searches for the first time at which gap + allowed closes, and sets the event to it.
  void SearchFrom(double from, double allowed, Counts counts);
  // Whether the nearest contact is of corners of a pair that touches, and does not approach.
  bool Keeps(const State<double>& state) const;
  // Whether it is one, and passes by.
  bool NearestPassesBy(const State<double>& state) const;
  // The acceleration of the gap that the turning of an ellipse gives, m/s²; 0 where neither is one.
  double TurningAcceleration(const State<double>& end) const;
  // Searches for the return of contacts that touch and open; false where one returns at once.
  bool SearchTouching();
  // The closed contact whose feature is no longer the closest, or nullptr.
  const ActiveContact* LostAt(const State<double>& state) const;
  // The contact that replaces it.
  ActiveContact NextOf(const Sample& sample);
  void SearchHandOver();
  double AlignedWithin() const;
  // Whether one of the shapes is a disc, which has no ends that could be aligned with others.
  bool HasDisc() const {
    return model_.Shape(a_, parts_.a).type == ShapeType::kCircle ||
           model_.Shape(b_, parts_.b).type == ShapeType::kCircle;
  }
  bool HasPassed(const State<double>& state) const;
  bool Continues(const State<double>& state, const ActiveContact& contact,
                 const Features& features) const;

  EventSearch& search_;
  const Model<double>& model_;
  const int a_, b_;
  const PartPair parts_;
  Event& event_;
  const Segment& segment_;
  const std::vector<ActiveContact>& touching_;
  const double touch_;    ///< gap below which the pair touches, m
  const double located_;  ///< tolerance of the location of the pair's gaps, m
  const bool closed_;     ///< the pair has closed contacts
  const bool touches_;    ///< it touches as the segment starts
  ActiveContact nearest_;
  Vector2<double> normal_{0.0, 0.0};
  bool on_face_ = false;  ///< the normal is a face's, not that of the line between two points
  /// Of polylines and concave polygons; null: the part is another one.
  const Outline* const outline_a_;
  const Outline* const outline_b_;
  const Curve* const curve_a_;  ///< of a spline, or null
  const Curve* const curve_b_;
  const bool may_hide_;  ///< a gap that ends at a seam or a run's end counts
};

void EventSearch::SearchPair(const Model<double>& model, int a, int b, PartPair parts,
                             Event* event) {
  PairSearch(this, model, a, b, parts, event).Run();
}

// The distance along two faces up to which their ends certainly count as one above the other, m. It
// is a power of two as in collide_core.cc.
double EventSearch::PairSearch::AlignedWithin() const {
  return std::ldexp(kAlignedRadii,
                    std::ilogb(search_.lengths_.radius(a_) + search_.lengths_.radius(b_)));
}

// Whether a pair has moved since the segment's start by more than that.
bool EventSearch::PairSearch::HasPassed(const State<double>& state) const {
  const std::vector<double>& before = segment_.before.pose;
  const auto moved = [&](int k) {
    return std::abs(state.pose[3 * a_ + k] - before[3 * a_ + k] - state.pose[3 * b_ + k] +
                    before[3 * b_ + k]);
  };
  const double size = search_.lengths_.Size(a_, b_);
  return moved(0) + moved(1) + moved(2) * size > kPassed * size + 2.0 * AlignedWithin();
}

// Whether one of the features found is equivalent to a closed contact: for a vertex above a vertex
// rounding decides which of the two is found. The feature changes only when the vertices have moved
// apart.
bool EventSearch::PairSearch::Continues(const State<double>& state, const ActiveContact& contact,
                                        const Features& features) const {
  ContactRows<double> rows;
  EvaluateContactRows(model_, state, contact, &rows);
  const ContactGeometry<double> of_closed = rows.geometry;
  const double within = HasDisc() ? 0.0 : AlignedWithin();
  return std::any_of(features.of, features.of + features.count, [&](const ContactFeature& feature) {
    ActiveContact other = contact;
    other.feature = feature;
    EvaluateContactRows(model_, state, other, &rows);
    return (rows.geometry.point - of_closed.point).norm() <= within &&
           (rows.geometry.normal - of_closed.normal).norm() <= kSameNormal;
  });
}

bool EventSearch::PairSearch::RestsAtSeams() const {
  if (outline_a_ != nullptr || outline_b_ != nullptr || IsAtCurve()) {
    return std::any_of(segment_.contacts.begin(), segment_.contacts.end(),
                       [&](const auto& c) { return c.IsOfShapes() && c.a == a_ && c.b == b_; });
  }
  const bool first = model_.SeamsOf(a_, parts_.a) != nullptr;
  if (!first && model_.SeamsOf(b_, parts_.b) == nullptr) {
    return true;
  }
  const int moving = first ? b_ : a_;
  return std::any_of(segment_.contacts.begin(), segment_.contacts.end(), [&](const auto& contact) {
    return contact.IsOfShapes() &&
           ((contact.a == moving && model_.HasSeams(contact.b, contact.feature.part_b)) ||
            (contact.b == moving && model_.HasSeams(contact.a, contact.feature.part_a)));
  });
}

void EventSearch::PairSearch::TakeNearest(const ActiveContact& contact,
                                          const ContactGeometry<double>& geometry) {
  nearest_ = contact;
  nearest_.gap = geometry.gap;
  normal_ = geometry.normal;
  on_face_ = contact.feature.kind != FeatureKind::kVertexVertex && contact.feature.places == 0;
}

double EventSearch::PairSearch::HiddenGap(const State<double>& state) {
  ActiveContact contact;
  contact.a = a_;
  contact.b = b_;
  if (IsAtCurve()) return HiddenCurveGap(state, contact);
  if (outline_a_ != nullptr || outline_b_ != nullptr) {
    return HiddenRunGap(state, contact);
  }
  ContactFeature features[2];
  if (FindContactFeatures(model_.Shape(a_, parts_.a), state.PoseOf(a_), model_.Shape(b_, parts_.b),
                          state.PoseOf(b_), kInfinity, features) == 0) {
    return kInfinity;
  }
  contact.feature = features[0];
  contact.feature.part_a = parts_.a;
  contact.feature.part_b = parts_.b;
  ContactRows<double> rows;
  EvaluateContactRows(model_, state, contact, &rows);
  TakeNearest(contact, rows.geometry);
  // What is hidden does not close.
  return std::max(rows.geometry.gap, touch_);
}

double EventSearch::PairSearch::HiddenCurveGap(const State<double>& state, ActiveContact contact) {
  const Pose<double> pose_a = state.PoseOf(a_);
  const Pose<double> pose_b = state.PoseOf(b_);
  const PairAtCurve pair =
      curve_a_ != nullptr ? PairAtCurve{curve_a_, pose_a, b_, parts_.b, pose_b, SeamSide::kFirst}
                          : PairAtCurve{curve_b_, pose_b, a_, parts_.a, pose_a, SeamSide::kSecond};
  const double gap = DistanceAtCurve(model_, pair, &contact.feature);
  if (!std::isfinite(gap) || !(gap > touch_)) return kInfinity;
  contact.feature.part_a = parts_.a;
  contact.feature.part_b = parts_.b;
  ContactRows<double> rows;
  EvaluateContactRows(model_, state, contact, &rows);
  TakeNearest(contact, rows.geometry);
  return gap;
}

double EventSearch::PairSearch::HiddenRunGap(const State<double>& state, ActiveContact contact) {
  ContactFeature& feature = contact.feature;
  const Pose<double> pose_a = state.PoseOf(a_);
  const Pose<double> pose_b = state.PoseOf(b_);
  const int run_a = model_.structure->bodies[a_].RunOfPart(parts_.a);
  const int run_b = model_.structure->bodies[b_].RunOfPart(parts_.b);
  if ((outline_a_ != nullptr && outline_a_->IsHidden(run_a)) ||
      (outline_b_ != nullptr && outline_b_->IsHidden(run_b))) {
    return kInfinity;
  }
  double gap = kInfinity;
  if (outline_a_ != nullptr && outline_b_ != nullptr) {
    gap = DistanceOfRuns({*outline_a_, run_a, pose_a}, {*outline_b_, run_b, pose_b}, &feature.a,
                         &feature.b);
  } else if (outline_a_ != nullptr) {
    gap = DistanceOfRun(*outline_a_, run_a, pose_a, model_.Shape(b_, parts_.b), pose_b, &feature.a,
                        &feature.b);
  } else {
    gap = DistanceOfRun(*outline_b_, run_b, pose_b, model_.Shape(a_, parts_.a), pose_a, &feature.b,
                        &feature.a);
  }
  if (!(gap > touch_)) return kInfinity;
  feature.part_a = parts_.a;
  feature.part_b = parts_.b;
  ContactRows<double> rows;
  EvaluateContactRows(model_, state, contact, &rows);
  TakeNearest(contact, rows.geometry);
  return gap;
}

double EventSearch::PairSearch::Gap(const Sample& sample, Counts counts, bool handed_over) {
  if (!sample.good) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const State<double>& state = sample.motion.after;
  const Features features = FeaturesAt(state);
  // The next feature of a closed contact whose feature is no longer the closest does not count
  // here, because its gap is rounding: SearchHandOver finds it.
  const bool hands_over =
      closed_ && !handed_over &&
      std::any_of(segment_.contacts.begin(), segment_.contacts.end(), [&](const auto& c) {
        return IsOfPair(c) && !features.Have(AtState(c, state).feature);
      });
  double smallest = kInfinity;
  for (int k = 0; k < features.count; ++k) {
    ActiveContact contact;
    contact.a = a_;
    contact.b = b_;
    contact.feature = features.of[k];
    contact.law = ContactLaw::kInelastic;
    ContactRows<double> rows;
    EvaluateContactRows(model_, state, contact, &rows);
    const double gap = rows.geometry.gap;
    if (gap < smallest && !IsClosed(contact, state) &&
        (counts == Counts::kAll ? !IsDeep(contact, state) : !HaveAt(touching_, contact, state)) &&
        !(hands_over && std::abs(gap) <= touch_ && !HaveAt(touching_, contact, state))) {
      smallest = gap;
      TakeNearest(contact, rows.geometry);
    }
  }
  if (features.count == 0) return may_hide_ ? HiddenGap(state) : smallest;
  return outline_a_ != nullptr || outline_b_ != nullptr ? GapOfRun(state, smallest) : smallest;
}

bool EventSearch::PairSearch::IsInRun(const State<double>& state) const {
  const auto is_in = [&](const Outline* outline, int body, int part, int other, int other_part) {
    return outline != nullptr &&
           IsInSolidBehind(*outline, model_.structure->bodies[body].RunOfPart(part),
                           state.PoseOf(body), model_.Shape(other, other_part), state.PoseOf(other),
                           kDeepTouches * touch_);
  };
  if (outline_a_ != nullptr && outline_b_ != nullptr) return false;
  return is_in(outline_a_, a_, parts_.a, b_, parts_.b) ||
         is_in(outline_b_, b_, parts_.b, a_, parts_.a);
}

// The features of a run are those over it. The body may be nearer to one of its ends, or cross it
// elsewhere, where another run is nearer: then its gap is unknown, as it is behind the run. Of a
// body that touches the run elsewhere the distance tells nothing, but a corner in the solid does.
double EventSearch::PairSearch::GapOfRun(const State<double>& state, double of_features) {
  if (!std::isfinite(of_features) || !(of_features > touch_)) return of_features;
  if (touches_ || !may_hide_) return IsInRun(state) ? kInfinity : of_features;
  const ActiveContact nearest = nearest_;
  const Vector2<double> normal = normal_;
  const bool on_face = on_face_;
  ActiveContact contact;
  contact.a = a_;
  contact.b = b_;
  const double gap = HiddenRunGap(state, contact);
  const auto is_ellipse = [&](int body, int part) {
    return model_.Shape(body, part).type == ShapeType::kEllipse;
  };
  // Of an ellipse the distance is only a bound.
  const bool is_bound = is_ellipse(a_, parts_.a) || is_ellipse(b_, parts_.b);
  if (std::isinf(gap) || (!is_bound && gap < (1.0 - kNearerEnd) * of_features)) return gap;
  nearest_ = nearest;
  normal_ = normal;
  on_face_ = on_face;
  return of_features;
}

// The bound is the speed of all points; where both ends have the same face, the speed along its
// normal plus the effect of rotation.
double EventSearch::PairSearch::ClosingSpeed(double from, double to, Counts counts) {
  const double any = search_.closing_[a_] + search_.closing_[b_];
  const Sample& first = *search_.From(model_, from);
  if (!std::isfinite(Gap(first, counts))) {
    return any;
  }
  const ActiveContact start = nearest_;
  const Vector2<double> along(normal_.x(), normal_.y());  // the next call moves it
  const bool face = on_face_;
  const State<double> before = first.motion.after;
  const Sample& last = *search_.At(model_, to);
  if (!face || !std::isfinite(Gap(last, counts)) || !(nearest_.feature == start.feature)) {
    return any;
  }
  const State<double>& after = last.motion.after;
  double closing = 0.0;
  double speed = 0.0;
  double turning = 0.0;
  for (const State<double>* state : {&before, &after}) {
    const Vector2<double> relative(state->twist[3 * a_] - state->twist[3 * b_],
                                   state->twist[3 * a_ + 1] - state->twist[3 * b_ + 1]);
    speed = std::max(speed, relative.norm());
    double turn = 0.0;
    double swept = 0.0;
    for (const int body : {a_, b_}) {
      const double omega = std::abs(state->twist[3 * body + 2]);
      const int part = body == a_ ? parts_.a : parts_.b;
      const bool is_circle = model_.structure->bodies[body].Part(part).type == ShapeType::kCircle;
      turn += is_circle ? 0.0 : omega;
      swept += is_circle ? 0.0 : omega * search_.lengths_.radius(body);
    }
    closing = std::max(closing, std::abs(along.dot(relative)) + swept);
    turning = std::max(turning, turn);
  }
  return std::min(any, 1.05 * closing + 1.5 * turning * (to - from) * speed + BeyondEnds(from, to));
}

// By how much the speeds of driven bodies may leave the range of those at both ends: their rates
// are parabolas, which leave the line through two points by an eighth of their slope's change.
double EventSearch::PairSearch::BeyondEnds(double from, double to) const {
  const Segment& segment = *search_.segment_;
  if (model_.structure->paths.empty()) return 0.0;
  std::vector<double> a, b;
  GivenAccelerations(model_, segment.time + from, segment.middle, &a);
  GivenAccelerations(model_, segment.time + to, segment.middle, &b);
  double change = 0.0;
  for (const int k : {3 * a_, 3 * b_}) {
    change += std::hypot(b[k] - a[k], b[k + 1] - a[k + 1]) +
              std::abs(b[k + 2] - a[k + 2]) * search_.lengths_.radius(k / 3);
  }
  return 0.125 * change * (to - from);
}

// Where the same features are closest at both ends and the bodies turn and move little between them
// the gap's rate changes monotonically.
KnownCourse EventSearch::PairSearch::CourseOver(double from, double fa, double to, double fb,
                                                double allowed, Counts counts) {
  // Without a gap at both ends there is no contact whose rate could be used.
  Sample* const first = search_.From(model_, from);
  if (!std::isfinite(fa) || !std::isfinite(fb) || Gap(*first, counts) + allowed != fa) {
    return {};
  }
  const ActiveContact start = nearest_;
  const double rate_a = SpeedsOf(model_, first->motion.after, start).normal;
  const State<double> before = first->motion.after;
  Sample* const last = search_.At(model_, to);
  if (Gap(*last, counts) + allowed != fb ||
      !(nearest_.feature == AtState(start, last->motion.after).feature) ||
      !search_.MovesLittle(model_, before, last->motion.after, to - from, a_, b_)) {
    return {};
  }
  const double rate_b = SpeedsOf(model_, last->motion.after, nearest_).normal;
  return {CourseOf(to - from, fa, rate_a, fb, rate_b), rate_a, rate_b};
}

void EventSearch::PairSearch::SearchFrom(double from, double allowed, Counts counts) {
  if (!(from < event_.length)) {
    return;
  }
  if (Gap(*search_.From(model_, from), counts) > touch_) {
    allowed = 0.0;  // it has left
  }
  const bool all = counts == Counts::kAll;
  // A contact that has touched all the time returns only if it approaches: the poses of the
  // first-order integrator may pass the gap although its twists do not close it.
  const auto shifted = [&](const Sample& sample) {
    const double value = Gap(sample, counts) + allowed;
    if (!std::isfinite(value)) {
      return value;
    }
    if (!all && touches_ && value <= touch_ &&
        (Keeps(sample.motion.after) || NearestPassesBy(sample.motion.after))) {
      return touch_;
    }
    const bool approaches = value > 0.0 || !all ||
                            !HaveAt(touching_, nearest_, sample.motion.after) ||
                            SpeedsOf(model_, sample.motion.after, nearest_).normal < -search_.slow_;
    return approaches ? value : touch_;
  };
  const auto rate = [&](double x, double y) { return ClosingSpeed(x, y, counts); };
  const auto course = [&](double x, double fx, double y, double fy) {
    return CourseOver(x, fx, y, fy, allowed, counts);
  };
  double root;
  if (search_.FirstRoot(model_, shifted, rate, course, located_, from, event_.length, &root) &&
      root > 0.0) {
    event_.length = root;
    const Sample& at_root = *search_.At(model_, root);
    const bool cut_in = Gap(at_root, counts) < -kDeepTouches * touch_;
    // If only the poses have passed the gap, the event is the reversal of the speed.
    event_.kind = cut_in && all && HaveAt(touching_, nearest_, at_root.motion.after)
                      ? EventKind::kReturn
                      : EventKind::kTouch;
    event_.contact = nearest_;
  }
}

// Of corners that meet rounding chooses the features: where they move along with each other nothing
// touches.
bool EventSearch::PairSearch::Keeps(const State<double>& state) const {
  return HaveCorners(*model_.structure, nearest_) &&
         SpeedsOf(model_, state, nearest_).normal >= -search_.slow_;
}

// At the instant at which a corner passes another one rounding chooses the nearest features: those
// which the pair is listed with may be others than those that close.
bool EventSearch::PairSearch::NearestPassesBy(const State<double>& state) const {
  const Lengths& lengths = search_.lengths_;
  const double size = std::min(lengths.radius(a_), lengths.radius(b_));
  if (size == 0.0 || !HaveCorners(*model_.structure, nearest_)) return false;
  const double approach = SpeedsOf(model_, state, nearest_).normal;
  return approach < -search_.slow_ &&
         PassesBy(model_, state, nearest_, approach, size, search_.slow_);
}

// The height of an ellipse with semi-axes a ≥ b has a second derivative of at most a² / b with
// respect to the direction, which turns with both bodies and as they pass each other.
double EventSearch::PairSearch::TurningAcceleration(const State<double>& end) const {
  double height = 0.0;
  for (const auto& [body, part] : {std::pair(a_, parts_.a), std::pair(b_, parts_.b)}) {
    const ShapeView<double> shape = model_.Shape(body, part);
    if (shape.type != ShapeType::kEllipse) continue;
    const auto [small, large] = std::minmax(shape.numbers[0], shape.numbers[1]);
    height += large * (large / small);
  }
  if (height == 0.0) return 0.0;
  double turning = 0.0;
  for (const State<double>* state : {&segment_.before, &end}) {
    const double* a = &state->twist[3 * a_];
    const double* b = &state->twist[3 * b_];
    turning =
        std::max(turning, std::abs(a[2]) + std::abs(b[2]) +
                              std::hypot(a[0] - b[0], a[1] - b[1]) / search_.lengths_.Size(a_, b_));
  }
  return 2.0 * turning * turning * height;
}

bool EventSearch::PairSearch::SearchTouching() {
  double from = kInfinity;
  double allowed = touch_;
  for (const ActiveContact& contact : touching_) {
    if (!IsOfPair(contact) || IsClosed(contact, segment_.before)) {
      continue;
    }
    if (contact.gap < -kDeepTouches * touch_) {
      search_.SearchReturn(model_, contact, touch_, &event_);
      if (event_.kind == EventKind::kAtOnce) {
        return false;
      }
    }
    const Sample& end = *search_.At(model_, event_.length);
    const double speed = SpeedsOf(model_, segment_.before, contact).normal;
    const double change =
        end.good ? std::abs(SpeedsOf(model_, end.motion.after, contact).normal - speed) : 0.0;
    from = std::min(from, search_.TouchStart(speed, 2.0 * change / event_.length +
                                                        TurningAcceleration(end.motion.after)));
    allowed = std::max(allowed, touch_ - contact.gap);
  }
  SearchFrom(from, allowed, Counts::kAll);
  return true;
}

// Where corners meet, the feature of a closed contact may not be the closest at the start of the
// segment, but is once they have passed each other.
const ActiveContact* EventSearch::PairSearch::LostAt(const State<double>& state) const {
  const Features features = FeaturesAt(state);
  for (const ActiveContact& contact : segment_.contacts) {
    if (IsOfPair(contact) && !features.Have(AtState(contact, state).feature) &&
        (HasPassed(state) || FeaturesAt(segment_.before).Have(contact.feature)) &&
        !Continues(state, contact, features)) {
      return &contact;
    }
  }
  return nullptr;
}

// Searches for the time at which a closed contact's feature is no longer the pair's closest and the
// next one replaces it.
void EventSearch::PairSearch::SearchHandOver() {
  const auto is_lost = [&](double length) {
    return LostAt(search_.At(model_, length)->motion.after) != nullptr;
  };
  if (!is_lost(event_.length)) {
    return;
  }
  double low = 0.0;
  double high = event_.length;
  while (high - low > kTimeRounding * event_.length) {
    const double middle = 0.5 * (low + high);
    (is_lost(middle) ? high : low) = middle;
  }
  if (high < event_.length) {
    event_.kind = EventKind::kTouch;
    event_.length = high;
    const Sample& sample = *search_.At(model_, high);
    event_.contact = NextOf(sample);
    event_.lost = *LostAt(sample.motion.after);
    event_.hands_over_at = high;
    event_.passes = PassesSmoothly(model_, sample.motion.after, event_.lost, event_.contact);
  }
}

ActiveContact EventSearch::PairSearch::NextOf(const Sample& sample) {
  const bool next = std::isfinite(Gap(sample, Counts::kAll, true));
  const ActiveContact lost = *LostAt(sample.motion.after);
  return NextAt(model_, sample.motion.after, lost, next ? nearest_ : lost);
}

// Of the pairs other than the event's.
void EventSearch::FindHandOvers(const Model<double>& model, Event* event) {
  for (const auto& [first, second] : pairs_) {
    const int a = first, b = second;
    if (event->contact.IsOfShapes() && event->contact.a == a && event->contact.b == b) continue;
    ForEachNearPart(model, a, b, [&](PartPair parts) {
      PairSearch(this, model, a, b, parts, event).AddHandOver(&hand_overs_);
    });
  }
}

}  // namespace tangible
