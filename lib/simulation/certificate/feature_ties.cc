// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/feature_ties.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/flush_corners.h"

namespace tangible {
namespace {

// The continuation of a contact at a flush seam: one of the same moving body with a neighbour of
// the body whose shape has seams, with the same normal, friction and restitution.
class NextDoor {
 public:
  // `from`: the contact, where the first body is at `first`, which is then moved to `moved`.
  NextDoor(const Model<double>& model, const State<double>& state, const ActiveContact& contact,
           const Pose<double>& first, const Pose<double>& moved,
           const ContactGeometry<double>& from)
      : model_(model),
        state_(state),
        contact_(contact),
        tiled_is_first_(model.HasSeams(contact.a, contact.feature.part_a)),
        tiled_(tiled_is_first_ ? contact.a : contact.b),
        moving_(tiled_is_first_ ? contact.b : contact.a),
        first_(first),
        moved_(moved),
        from_(from) {}

  bool HasContact(double near) const {
    const ModelStructure& s = *model_.structure;
    const int part = tiled_is_first_ ? contact_.feature.part_a : contact_.feature.part_b;
    if (!model_.HasSeams(tiled_, part)) {
      return false;
    }
    for (int body = 0; body < s.num_bodies(); ++body) {
      if (body != tiled_ && s.bodies[body].block < 0 && s.bodies[body].shape != ShapeType::kNone &&
          s.MayCollide(moving_, body) && MovesAsTiled(body) && IsAlike(body) &&
          HasContactOf(body, near)) {
        return true;
      }
    }
    return false;
  }

 private:
  bool MovesAsTiled(int body) const {
    return std::equal(&state_.twist[3 * body], &state_.twist[3 * body] + 3,
                      &state_.twist[3 * tiled_]);
  }
  bool IsAlike(int body) const {
    return MixedFriction(model_, moving_, body).value ==
               MixedFriction(model_, moving_, tiled_).value &&
           MixedRestitution(model_, moving_, body).value ==
               MixedRestitution(model_, moving_, tiled_).value;
  }
  bool HasContactOf(int body, double near) const {
    Pose<double> neighbour = state_.PoseOf(body);
    if (tiled_is_first_) {
      // The neighbour moves with the first body.
      neighbour = Pose<double>(moved_ * first_.Inverse(neighbour.position),
                               neighbour.angle + moved_.angle - first_.angle);
    }
    ActiveContact other;
    other.a = std::min(moving_, body);
    other.b = std::max(moving_, body);
    const Pose<double> mover = tiled_is_first_ ? state_.PoseOf(moving_) : moved_;
    const bool neighbour_is_first = other.a == body;
    const Pose<double>& pose_a = neighbour_is_first ? neighbour : mover;
    const Pose<double>& pose_b = neighbour_is_first ? mover : neighbour;
    const int part = tiled_is_first_ ? contact_.feature.part_b : contact_.feature.part_a;
    const auto has_contact = [&](int of_neighbour) {
      const PartPair parts =
          neighbour_is_first ? PartPair{of_neighbour, part} : PartPair{part, of_neighbour};
      ContactFeature features[2];
      const int count =
          FindFeatures(model_, other.a, pose_a, other.b, pose_b, parts, kInfinity, features);
      return IsAmong(other, pose_a, pose_b, neighbour_is_first, features, count, near);
    };
    const Outline* const outline = model_.OutlineOf(body);
    if (outline == nullptr) return has_contact(0);
    const Vector2<double> at = neighbour.Inverse(from_.point);
    bool found = false;
    outline->ForEachRun({at.x() - near, at.y() - near, at.x() + near, at.y() + near}, [&](int run) {
      found = found || has_contact(model_.structure->bodies[body].PartOfRun(run));
    });
    return found;
  }

  // Whether one of the features is a contact at the same place.
  bool IsAmong(ActiveContact other, const Pose<double>& pose_a, const Pose<double>& pose_b,
               bool neighbour_is_first, const ContactFeature* features, int count,
               double near) const {
    const double sign = neighbour_is_first == tiled_is_first_ ? 1.0 : -1.0;
    return std::any_of(features, features + count, [&](const ContactFeature& feature) {
      other.feature = feature;
      const ContactGeometry<double> to = EvaluateContact(feature, ShapeOfA(model_, other), pose_a,
                                                         ShapeOfB(model_, other), pose_b);
      return (to.point - from_.point).norm() <= near && std::abs(to.gap - from_.gap) <= near &&
             (sign * to.normal - from_.normal).norm() <= kTurned;
    });
  }

  const Model<double>& model_;
  const State<double>& state_;
  const ActiveContact& contact_;
  const bool tiled_is_first_;
  const int tiled_, moving_;
  const Pose<double>& first_;
  const Pose<double>& moved_;
  const ContactGeometry<double>& from_;
};

class PairTies {
 public:
  PairTies(const Model<double>& model, const StepRecord& record, size_t first, size_t last,
           ContactSystem* system)
      : model_(model),
        record_(record),
        first_(first),
        last_(last),
        system_(*system),
        a_(record.contacts[first].a),
        b_(record.contacts[first].b),
        parts_(record.contacts[first].Parts()),
        moved_(record.before) {
    size_ = kInfinity;
    for (const int body : {a_, b_}) {
      if (model.structure->bodies[body].shape != ShapeType::kHalfPlane) {
        size_ = std::min(size_, RadiusOf(model, body));
      }
    }
    reach_ = 0.0;
    for (size_t i = first; i < last; ++i) {
      reach_ = std::max(reach_, record.contacts[i].gap);
    }
    reach_ += kReach * size_;
  }

  double Margin() {
    double margin = kInfinity;
    if (!(size_ > 0.0) || !std::isfinite(size_)) {
      return margin;
    }
    for (int direction = 0; direction < 3; ++direction) {
      for (const double sign : {1.0, -1.0}) {
        const double length = sign * kFeatureMargin;
        Move(direction, length);
        if (Changes() && Jumps(direction, sign)) {
          margin = std::min(margin, DistanceOfChange(direction, length));
        }
      }
    }
    return margin;
  }

 private:
  void MovePose(int direction, double length) {
    moved_.pose = record_.before.pose;
    moved_.pose[3 * a_ + direction] += direction < 2 ? length * size_ : length;
  }

  // Moves the first body relative to the second, and searches the features there.
  void Move(int direction, double length) {
    MovePose(direction, length);
    count_ = FindFeatures(model_, a_, moved_.PoseOf(a_), b_, moved_.PoseOf(b_), parts_, reach_,
                          features_);
  }

  bool Closed(size_t i) const { return record_.solution.modes[i] != ContactMode::kOpen; }

  bool Found(const ContactFeature& feature) const {
    return std::find(features_, features_ + count_, feature) != features_ + count_;
  }

  ContactRows<double> Rows(const State<double>& state, const ContactFeature& feature) const {
    ActiveContact contact;
    contact.a = a_;
    contact.b = b_;
    contact.feature = feature;
    ContactRows<double> rows;
    EvaluateContactRows(model_, state, contact, &rows);
    return rows;
  }

  // Whether the normal turns within the move, as for two vertices that almost coincide.
  bool Turns(const ContactFeature& feature) const {
    return (Rows(moved_, feature).geometry.normal - Rows(record_.before, feature).geometry.normal)
               .norm() > kTurned;
  }

  // Whether a closed contact has other features, or is not smooth, at the moved pose.
  bool Changes() const {
    for (size_t i = first_; i < last_; ++i) {
      const ContactFeature& feature = record_.contacts[i].feature;
      if (Closed(i) && (!Found(feature) || Turns(feature)) && !GoesOnNextDoor(i)) {
        return true;
      }
    }
    return false;
  }

  bool GoesOnNextDoor(size_t i) const {
    const ActiveContact& contact = record_.contacts[i];
    const ContactGeometry<double> from = Rows(record_.before, contact.feature).geometry;
    return NextDoor(model_, record_.before, contact, record_.before.PoseOf(a_), moved_.PoseOf(a_),
                    from)
        .HasContact(kContinues * kFeatureMargin * size_);
  }

  // The feature found that continues a contact; false where none does.
  bool Continuation(const ContactFeature& feature, ContactFeature* now) const {
    const ContactGeometry<double> from = Rows(record_.before, feature).geometry;
    const double near = kContinues * kFeatureMargin * size_;
    for (int k = 0; k < count_; ++k) {
      const ContactGeometry<double> to = Rows(moved_, features_[k]).geometry;
      if ((to.point - from.point).norm() <= near && std::abs(to.gap - from.gap) <= near &&
          (to.normal - from.normal).norm() <= kTurned) {
        *now = features_[k];
        return true;
      }
    }
    return false;
  }

  double Constant(size_t i, const ContactRows<double>& rows) const {
    switch (record_.contacts[i].law) {
      case ContactLaw::kGap:
        return rows.geometry.gap / record_.h;
      case ContactLaw::kRestitution:
        return record_.restitution[i].value *
               RelativeSpeed(record_.before, a_, rows.normal_a, b_, rows.normal_b);
      case ContactLaw::kRecovery:
      case ContactLaw::kInelastic:
      case ContactLaw::kPoisson:
        break;
    }
    return 0.0;
  }

  // rhs += weight (R − R') of a contact and its continuation, at the moved pose.
  void AddDifference(size_t i, const ContactFeature& continuation, double weight) {
    const ContactRows<double> old = Rows(moved_, record_.contacts[i].feature);
    const ContactRows<double> now = Rows(moved_, continuation);
    const double normal = record_.solution.normal_impulse[i];
    const double tangent = record_.solution.tangent_impulse[i];
    double speed = Constant(i, old) - Constant(i, now);
    double slip = 0.0;
    const auto add = [&](int body, const RowPart<double>& n, const RowPart<double>& n_new,
                         const RowPart<double>& t, const RowPart<double>& t_new) {
      const int block = model_.structure->bodies[body].block;
      for (int k = 0; k < 3; ++k) {
        speed += (n[k] - n_new[k]) * record_.new_twist[3 * body + k];
        slip += (t[k] - t_new[k]) * record_.new_twist[3 * body + k];
        if (block >= 0) {
          rhs_[3 * block + k] -=
              weight * ((n[k] - n_new[k]) * normal + (t[k] - t_new[k]) * tangent);
        }
      }
    };
    add(a_, old.normal_a, now.normal_a, old.tangent_a, now.tangent_a);
    add(b_, old.normal_b, now.normal_b, old.tangent_b, now.tangent_b);
    const int row = 3 * system_.contact_block()[i];
    rhs_[row] += weight * speed;
    if (record_.solution.modes[i] == ContactMode::kSticking) {
      rhs_[row + 1] += weight * slip;
    }
  }

  // Whether the derivative of the new twist differs between the choices: with J(x) the difference
  // after a move by x, (4 J(x / 2) − J(x)) / x has no term of second order.
  bool Jumps(int direction, double sign) {
    std::vector<std::pair<size_t, ContactFeature>> changed;
    for (size_t i = first_; i < last_; ++i) {
      const ContactFeature& feature = record_.contacts[i].feature;
      if (!Closed(i) || (Found(feature) && !Turns(feature)) || GoesOnNextDoor(i)) {
        continue;
      }
      ContactFeature now;
      if (Turns(feature) || !Continuation(feature, &now)) {
        return true;
      }
      changed.emplace_back(i, now);
    }
    rhs_.assign(3 * static_cast<size_t>(system_.num_blocks()), 0.0);
    for (const auto& [length, weight] : {std::pair{kDifference, -1.0}, {0.5 * kDifference, 4.0}}) {
      MovePose(direction, sign * length);
      for (const auto& [i, now] : changed) {
        AddDifference(i, now, weight);
      }
    }
    system_.Solve(record_.problem, record_.solution.modes, rhs_.data(), 1);
    const ModelStructure& s = *model_.structure;
    const ContactProblem<double>& p = record_.problem;
    double jump = 0.0;
    for (int k = 0; k < 3 * s.num_blocks(); ++k) {
      jump += p.mass[k] * rhs_[k] * rhs_[k];
    }
    double momentum = 0.0;
    double mass = 0.0;
    for (const int body : {a_, b_}) {
      const int block = s.bodies[body].block;
      if (block >= 0) {
        mass += p.mass[3 * block];
      }
      for (int k = 3 * block; k < 3 * block + 3 && block >= 0; ++k) {
        momentum += p.load[k] * p.load[k] / p.mass[k];
      }
    }
    // An impact has no time, and what it changes is its speeds.
    const double of_rate =
        record_.h > 0.0 ? kJumpOfRate * std::sqrt(mass) * size_ / record_.h : 0.0;
    return std::sqrt(jump) > kDifference * (kJump * std::sqrt(momentum) + of_rate);
  }

  // The smallest move that changes the choice, to a thousandth of `length`.
  double DistanceOfChange(int direction, double length) {
    double low = 0.0;
    double high = length;
    for (int i = 0; i < 10; ++i) {
      const double middle = 0.5 * (low + high);
      Move(direction, middle);
      (Changes() ? high : low) = middle;
    }
    return std::abs(low);
  }

  const Model<double>& model_;
  const StepRecord& record_;
  size_t first_, last_;
  ContactSystem& system_;
  int a_, b_;
  PartPair parts_;
  State<double> moved_;
  double size_ = 0.0;   ///< m, of the smaller shape
  double reach_ = 0.0;  ///< m
  ContactFeature features_[2];
  int count_ = 0;
  std::vector<double> rhs_;
};

}  // namespace

double FeatureChangeMargin(const Model<double>& model, const StepRecord& record, size_t first,
                           size_t last, ContactSystem* system) {
  const bool closed = std::any_of(record.solution.modes.begin() + static_cast<long>(first),
                                  record.solution.modes.begin() + static_cast<long>(last),
                                  [](ContactMode mode) { return mode != ContactMode::kOpen; });
  if (!closed || !record.contacts[first].IsOfShapes()) {
    return kInfinity;
  }
  return PairTies(model, record, first, last, system).Margin();
}

bool MeetsACorner(const Model<double>& model, const State<double>& state,
                  const ActiveContact& contact) {
  const int a = contact.a;
  const int b = contact.b;
  double size = kInfinity;
  for (const int body : {a, b}) {
    if (model.structure->bodies[body].shape == ShapeType::kHalfPlane) {
      return false;
    }
    size = std::min(size, RadiusOf(model, body));
  }
  const auto evaluate = [&](const Pose<double>& pose_a, const ContactFeature& feature) {
    const ShapeView<double> shape_a = ShapeOfA(model, contact);
    const ShapeView<double> shape_b = ShapeOfB(model, contact);
    const Pose<double> pose_b = state.PoseOf(b);
    return EvaluateContact(FeatureAt(feature, shape_a, pose_a, shape_b, pose_b), shape_a, pose_a,
                           shape_b, pose_b);
  };
  const Pose<double> first = state.PoseOf(a);
  const ContactGeometry<double> from = evaluate(first, contact.feature);
  const Vector2<double> n = from.normal;
  const Vector2<double> along(n.y(), -n.x());
  for (const Vector2<double>& direction : {along, Vector2<double>(-along), Vector2<double>(-n)}) {
    Pose<double> moved = state.PoseOf(a);
    moved.position += kFeatureMargin * size * direction;
    ContactFeature features[2];
    const int count =
        FindFeatures(model, a, moved, b, state.PoseOf(b), contact.Parts(), kInfinity, features);
    const bool continues = std::any_of(features, features + count, [&](const auto& feature) {
      return (evaluate(moved, feature).normal - n).norm() <= kTurned;
    });
    if (!continues && !NextDoor(model, state, contact, first, moved, from)
                           .HasContact(kContinues * kFeatureMargin * size)) {
      return true;
    }
  }
  return false;
}

namespace {

bool HasDisc(const Model<double>& model, const ActiveContact& contact) {
  return contact.IsOfShapes() && (ShapeOfA(model, contact).type == ShapeType::kCircle ||
                                  ShapeOfB(model, contact).type == ShapeType::kCircle);
}

// Whether the contact is among the closest features of its pair with the poses of its bodies, or on
// the same face of an outline as one of them.
bool IsClosest(const Model<double>& model, const ActiveContact& contact, const Pose<double>& a,
               const Pose<double>& b) {
  ContactFeature features[2];
  const int count =
      FindFeatures(model, contact.a, a, contact.b, b, contact.Parts(), kInfinity, features);
  return count == 0 || std::any_of(features, features + count, [&](const auto& feature) {
           ActiveContact other = contact;
           other.feature = feature;
           return feature == contact.feature || AreOnOneFace(model, other, contact);
         });
}

}  // namespace

bool IsHandedOver(const Model<double>& model, const State<double>& state,
                  const ActiveContact& contact, double time) {
  if (!HasDisc(model, contact)) return false;
  const auto beside = [&](int body, double after) {
    Pose<double> pose = state.PoseOf(body);
    const double* twist = &state.twist[3 * static_cast<size_t>(body)];
    pose.position.x() += after * twist[0];
    pose.position.y() += after * twist[1];
    pose.angle += after * twist[2];
    return pose;
  };
  for (const double after : {-time, time}) {
    if (!IsClosest(model, contact, beside(contact.a, after), beside(contact.b, after))) return true;
  }
  return false;
}

bool IsAtEndOfFace(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact) {
  if (!HasDisc(model, contact)) return false;
  ContactRows<double> rows;
  EvaluateContactRows(model, state, contact, &rows);
  const Vector2<double> normal = rows.geometry.normal;
  const double move =
      kFeatureMargin * std::min(RadiusOf(model, contact.a), RadiusOf(model, contact.b));
  for (const double side : {move, -move}) {
    Pose<double> moved = state.PoseOf(contact.a);
    moved.position += side * Vector2<double>(normal.y(), -normal.x());
    if (!IsClosest(model, contact, moved, state.PoseOf(contact.b))) return true;
  }
  return false;
}

}  // namespace tangible
