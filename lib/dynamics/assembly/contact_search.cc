// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/contact_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/elements/part_pairs.h"
#include "tangible/dynamics/elements/seam_contacts.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/math/disjoint_sets.h"

namespace tangible {
namespace {

// Boxes that are kept reach as much farther than those of one step: for that many steps at the
// present speed.
constexpr double kRoomOfBoxes = 8.0;
// Up to so many bodies a search has memory for all pairs from its start on.
constexpr size_t kFewBodies = 32;

// The rate of a joint's coordinate, rad/s or m/s.
double CoordinateRate(const JointIndex& joint, const JointRows<double>& rows, const double* twist) {
  double rate = 0.0;
  for (int i = 0; i < 3; ++i) {
    rate += rows.coordinate_a[i] * twist[3 * joint.a + i] +
            rows.coordinate_b[i] * twist[3 * joint.b + i];
  }
  return std::abs(rate);
}

// Whether the recovery speed limits the constant of the gap.
ContactLaw GapLaw(double gap, double h, const SimulationSettings& settings) {
  return gap / h < -settings.recovery_speed ? ContactLaw::kRecovery : ContactLaw::kGap;
}

// Removes the contacts from `first` on of a body that is exactly above a seam, where it touches the
// other body of the seam already: its force is one, and how two contacts shared it would be left
// open.
void RemoveSecondOwners(const Model<double>& model, const AssemblyScratch<double>& scratch,
                        size_t first, std::vector<ActiveContact>* contacts) {
  const auto geometry_of = [&](const ActiveContact& contact) {
    ContactRows<double> rows;
    EvaluateContactRows(model, scratch.poses, contact, &rows);
    return rows.geometry;
  };
  const auto begin = contacts->begin() + static_cast<std::ptrdiff_t>(first);
  const auto is_second = [&](const ActiveContact& contact) {
    return std::any_of(contacts->begin(), begin, [&](const ActiveContact& earlier) {
      return AreOfOneSeam(model, earlier, geometry_of(earlier), contact, geometry_of(contact));
    });
  };
  contacts->erase(std::remove_if(begin, contacts->end(), is_second), contacts->end());
}

}  // namespace

ContactSearch::ContactSearch(const Model<double>& model) : lengths_(model) {
  const ModelStructure& structure = *model.structure;
  const size_t n = structure.bodies.size();
  bound_.assign(n, 0.0);
  limits_.reserve(2 * structure.joints.size());
  limit_bound_.assign(structure.joints.size(), 0.0);
  boxes_.resize(n);
  free_twist_.assign(3 * n, 0.0);
  kept_.reserve(n);
  larger_.assign(n, Aabb{0.0, 0.0, 0.0, 0.0});
  boxed_.reserve(n);
  pairs_.reserve(8 * n);
  candidates_.reserve(8 * n);
  if (n > kFewBodies) return;
  // Of few bodies all may meet: with boxes at one place the vectors of the sweep grow to their end.
  broad_phase_.FindPairs(
      larger_, [](int, int) { return true; }, &candidates_);
  pairs_.reserve(candidates_.size());
}

void ContactSearch::SetBounds(const Model<double>& model, const State<double>& state,
                              const ContactProblem<double>& problem,
                              const AssemblyScratch<double>& scratch) {
  const ModelStructure& structure = *model.structure;
  // A run may have shapes of other sizes than the run before it.
  if (kept_.empty()) lengths_ = Lengths(model);
  for (int body = 0; body < structure.num_bodies(); ++body) {
    const int block = structure.bodies[body].block;
    const double* twist = &state.twist[3 * body];
    double* free = &free_twist_[3 * body];
    for (int i = 0; i < 3; ++i) {
      free[i] = block < 0 ? twist[i] : problem.load[3 * block + i] / problem.mass[3 * block + i];
    }
    bound_[body] =
        std::max(SpeedOf(twist, lengths_.radius(body)), SpeedOf(free, lengths_.radius(body)));
  }
  for (size_t j = 0; structure.has_limits && j < structure.joints.size(); ++j) {
    const JointIndex& joint = structure.joints[j];
    if (joint.HasLimits()) {
      limit_bound_[j] = std::max(CoordinateRate(joint, scratch.joints[j], state.twist.data()),
                                 CoordinateRate(joint, scratch.joints[j], free_twist_.data()));
    }
  }
}

bool ContactSearch::CheckBounds(const Model<double>& model, const std::vector<double>& twist,
                                const AssemblyScratch<double>& scratch) {
  bool exceeded = false;
  const size_t limited = model.structure->has_limits ? model.structure->joints.size() : 0;
  for (size_t j = 0; j < limited; ++j) {
    const JointIndex& joint = model.structure->joints[j];
    if (!joint.HasLimits()) {
      continue;
    }
    const double rate = CoordinateRate(joint, scratch.joints[j], twist.data());
    if (rate > limit_bound_[j] * (1.0 + kSpeedBound)) {
      exceeded = true;
      limit_bound_[j] = 1.5 * rate;
    }
  }
  for (const int body : model.structure->moving) {
    const double speed = SpeedOf(&twist[3 * body], lengths_.radius(body));
    if (speed > bound_[body] * (1.0 + kSpeedBound) && model.structure->bodies[body].HasContacts()) {
      exceeded = true;
      bound_[body] = 1.5 * speed;  // with room, so that few searches are repeated
    }
  }
  return exceeded;
}

// Whether a contact that approaches faster than the threshold closes in the step, so that it
// rebounds. In penetration the constant that separates the bodies faster is taken.
bool ContactSearch::Rebounds(const Model<double>& model, const State<double>& state, double h,
                             const ActiveContact& contact, const ContactRows<double>& rows) const {
  const SimulationSettings& settings = model.structure->settings;
  const double approach = RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b);
  if (!(approach < -settings.restitution_threshold)) return false;
  double free_approach = 0.0;
  for (int i = 0; i < 3; ++i) {
    free_approach += rows.normal_a[i] * free_twist_[3 * contact.a + i] +
                     rows.normal_b[i] * free_twist_[3 * contact.b + i];
  }
  if (!(contact.gap + h * free_approach < settings.contact_margin)) return false;
  const double e = RestitutionOf(model, contact).value;
  return e > 0.0 &&
         (contact.gap >= 0.0 || e * approach < std::max(contact.gap / h, -settings.recovery_speed));
}

void ContactSearch::FindLimits(const Model<double>& model, const State<double>& state, double h,
                               const AssemblyScratch<double>& scratch,
                               std::vector<ActiveContact>* contacts) {
  const ModelStructure& structure = *model.structure;
  limits_.clear();
  AppendLimits(model, state, &limits_);
  for (ActiveContact limit : limits_) {
    const JointIndex& joint = structure.joints[limit.joint];
    ContactRows<double> rows;
    EvaluateLimitRows(model.parameters[LimitNumber(joint, limit)], scratch.joints[limit.joint],
                      limit, &rows);
    limit.gap = rows.geometry.gap;
    const double reach =
        kListedBeyond * (structure.settings.contact_margin + h * limit_bound_[limit.joint]);
    if (limit.gap <= reach) {
      limit.law = GapLaw(limit.gap, h, structure.settings);
      if (Rebounds(model, state, h, limit, rows)) limit.law = ContactLaw::kRestitution;
      contacts->push_back(limit);
    }
  }
}

// m/s: a speed that is no larger than the error of a closed contact's gap over the step is not an
// approach.
double ContactSearch::SlowApproach(const State<double>& state, const ActiveContact& contact,
                                   double h) const {
  return kNoApproach * (bound_[contact.a] + bound_[contact.b]) +
         lengths_.Rounding(state, contact.a, contact.b) / h;
}

double ContactSearch::SmallerRadius(const ActiveContact& contact) const {
  return std::min(lengths_.radius(contact.a), lengths_.radius(contact.b));
}

// Replaces a contact with a corner ahead by those of bodies that pass by each other, as a box that
// slides over flush tiles.
ContactsAhead ContactSearch::FindPassed(const Model<double>& model, const State<double>& state,
                                        const ActiveContact& contact, double approach,
                                        double h) const {
  const double slow = SlowApproach(state, contact, h);
  const double size = SmallerRadius(contact);
  if (!(approach < -slow) || size == 0.0) {
    return ContactsAhead();
  }
  const double touch = lengths_.Touch(state, contact.a, contact.b);
  if (contact.gap < -touch) {
    return ContactsAhead();
  }
  const ContactsAhead ahead = FindContactsAhead(model, state, contact, approach, size, touch, slow);
  for (int k = 0; k < ahead.count; ++k) {
    if (ahead.speed[k] < -slow) {
      return ContactsAhead();
    }
  }
  return ahead;
}

// Whether a corner passes another one by before it comes down to the face that ends there.
bool ContactSearch::PassesCorner(const Model<double>& model, const State<double>& state,
                                 const ActiveContact& contact, double approach, double h) const {
  if (!HaveCorners(*model.structure, contact)) return false;
  const double slow = SlowApproach(state, contact, h);
  const double size = SmallerRadius(contact);
  return approach < -slow && contact.gap + h * approach < 0.0 &&
         contact.gap >= -lengths_.Touch(state, contact.a, contact.b) &&
         PassesBy(model, state, contact, approach, size, slow);
}

// How far a body's box reaches beyond its shape, m: so that boxes of bodies that may touch overlap.
double ContactSearch::GrowthOf(const Model<double>& model, double h, int body) const {
  return kListedBeyond * (0.5 * model.structure->settings.contact_margin + h * bound_[body]);
}

Aabb ContactSearch::BoxAt(const Model<double>& model, const State<double>& state,
                          const AssemblyScratch<double>& scratch, int body, double growth) const {
  if (model.structure->bodies[body].shape == ShapeType::kHalfPlane &&
      state.twist[3 * body + 2] != 0.0) {
    // A half-plane that turns may reach any place.
    const double infinity = std::numeric_limits<double>::infinity();
    return {-infinity, -infinity, infinity, infinity};
  }
  return BoxOf(model, body, scratch.poses[body], growth);
}

// Whether every shape, grown by its reach, is still inside the larger box that was kept of it.
bool ContactSearch::BoxesHold(const Model<double>& model, const State<double>& state,
                              double h) const {
  if (kept_.empty()) return false;
  const ModelStructure& structure = *model.structure;
  for (int body = 0; body < structure.num_bodies(); ++body) {
    if (!structure.bodies[body].HasContacts()) continue;
    const KeptBox& kept = kept_[body];
    const double* pose = &state.pose[3 * body];
    const double turned = std::abs(pose[2] - kept.pose[2]);
    const bool is_plane = structure.bodies[body].shape == ShapeType::kHalfPlane;
    if (is_plane && !kept.turns && (turned != 0.0 || state.twist[3 * body + 2] != 0.0)) {
      return false;
    }
    const double moved =
        std::max(std::abs(pose[0] - kept.pose[0]), std::abs(pose[1] - kept.pose[1])) +
        turned * lengths_.radius(body);
    if (!(moved + GrowthOf(model, h, body) <= kept.growth)) return false;
  }
  return true;
}

// The pairs of bodies that may have contacts. Boxes with room for some steps are sorted and swept,
// and until a body leaves its own only the pairs that they have are compared.
void ContactSearch::FindPairs(const Model<double>& model, const State<double>& state, double h,
                              const AssemblyScratch<double>& scratch) {
  const ModelStructure& structure = *model.structure;
  compared_ = 0;
  if (!BoxesHold(model, state, h)) {
    kept_.resize(structure.num_bodies());
    larger_.resize(structure.num_bodies());
    for (int body = 0; body < structure.num_bodies(); ++body) {
      const double* pose = &state.pose[3 * body];
      const double growth = kRoomOfBoxes * GrowthOf(model, h, body);
      kept_[body] = {{pose[0], pose[1], pose[2]}, growth, state.twist[3 * body + 2] != 0.0};
      larger_[body] = BoxAt(model, state, scratch, body, growth);
    }
    broad_phase_.FindPairs(
        larger_, [&](int i, int j) { return structure.MayCollide(i, j); }, &candidates_);
    compared_ = broad_phase_.num_compared();
  }
  compared_ += static_cast<int>(candidates_.size());
  boxed_.assign(structure.num_bodies(), false);
  pairs_.clear();
  for (const std::pair<int, int>& pair : candidates_) {
    for (const int body : {pair.first, pair.second}) {
      if (boxed_[body]) continue;
      boxed_[body] = true;
      boxes_[body] = BoxAt(model, state, scratch, body, GrowthOf(model, h, body));
    }
    if (Overlap(boxes_[pair.first], boxes_[pair.second])) pairs_.push_back(pair);
  }
}

// The gap below which two bodies may touch within the step, m.
double ContactSearch::ReachOf(const Model<double>& model, const State<double>& state, double h,
                              int a, int b) const {
  const ModelStructure& structure = *model.structure;
  double reach = kListedBeyond * (structure.settings.contact_margin + h * (bound_[a] + bound_[b]));
  for (const int body : {a, b}) {
    if (structure.bodies[body].shape == ShapeType::kHalfPlane) {
      const double distance = std::hypot(state.pose[3 * a] - state.pose[3 * b],
                                         state.pose[3 * a + 1] - state.pose[3 * b + 1]);
      const int other = body == a ? b : a;
      reach += h * std::abs(state.twist[3 * body + 2]) * (distance + lengths_.radius(other));
    }
  }
  return reach;
}

// The contacts of one part of each of two bodies.
void ContactSearch::FindContacts(const Model<double>& model, const State<double>& state, double h,
                                 const AssemblyScratch<double>& scratch, ActiveContact contact,
                                 PartPair parts, std::vector<ActiveContact>* contacts) const {
  const SimulationSettings& settings = model.structure->settings;
  const int a = contact.a;
  const int b = contact.b;
  ContactFeature features[2];
  int count = FindFeatures(model, a, scratch.poses[a], b, scratch.poses[b], parts,
                           ReachOf(model, state, h, a, b), features);
  bool passes_by = false;
  for (int k = 0; k < count; ++k) {
    contact.feature = features[k];
    ContactRows<double> rows;
    EvaluateContactRows(model, scratch.poses, contact, &rows);
    const double gap = rows.geometry.gap;
    contact.gap = gap;
    contact.law = GapLaw(gap, h, settings);
    const double approach = RelativeSpeed(state, a, rows.normal_a, b, rows.normal_b);
    if (!passes_by && gap + h * approach < settings.contact_margin) {
      const ContactsAhead ahead = FindPassed(model, state, contact, approach, h);
      if (ahead.count > 0) {
        passes_by = true;
        count = ahead.count;
        features[0] = ahead.contacts[0].feature;
        features[1] = ahead.contacts[1].feature;
        k = -1;
        continue;
      }
      if (PassesCorner(model, state, contact, approach, h)) continue;
    }
    if (Rebounds(model, state, h, contact, rows)) {
      contact.law = ContactLaw::kRestitution;
      contacts->push_back(contact);
      continue;
    }
    // A pusher that arrives as the step ends would move a body on its support by rounding, in a
    // direction that friction cannot have.
    const double touch = lengths_.Touch(state, a, b);
    if (!model.structure->supports.empty() && gap > kArrives * touch &&
        std::abs(gap + h * approach) <= touch) {
      continue;
    }
    contacts->push_back(contact);
  }
  if (count < 2 && model.seams != nullptr && HaveCorners(*model.structure, contact)) {
    AddReached(model, state, h, scratch, contact, parts, {features, features + count}, contacts);
  }
}

// A corner that slides along one face towards another one, which meets it in a concave corner, is
// over that face only when it has come through: the contacts of where bodies would be as the step
// ends. Now it is on the free side of both.
void ContactSearch::AddReached(const Model<double>& model, const State<double>& state, double h,
                               const AssemblyScratch<double>& scratch, ActiveContact contact,
                               PartPair parts, std::span<const ContactFeature> listed,
                               std::vector<ActiveContact>* contacts) const {
  const int a = contact.a, b = contact.b;
  const auto may_hide = [&](int body, int part) {
    return model.OutlineOf(body, part) != nullptr || model.HasSeams(body, part);
  };
  if (!may_hide(a, parts.a) && !may_hide(b, parts.b)) return;
  const double touch = lengths_.Touch(state, a, b);
  const double way = h * (SpeedOf(&state.twist[3 * a], lengths_.radius(a)) +
                          SpeedOf(&state.twist[3 * b], lengths_.radius(b)));
  if (way <= touch) return;
  ContactFeature features[2];
  const int count = FindFeatures(model, a, PoseAfter(state, a, h), b, PoseAfter(state, b, h), parts,
                                 0.0, features);
  for (int k = 0; k < count; ++k) {
    contact.feature = features[k];
    const bool is_listed =
        std::any_of(listed.begin(), listed.end(), [&](const ContactFeature& feature) {
          ActiveContact other = contact;
          other.feature = feature;
          return other.SameAs(contact);
        });
    if (is_listed) continue;
    ContactRows<double> rows;
    EvaluateContactRows(model, scratch.poses, contact, &rows);
    contact.gap = rows.geometry.gap;
    const double approach = RelativeSpeed(state, a, rows.normal_a, b, rows.normal_b);
    if (!(contact.gap >= -touch && contact.gap + h * approach < 0.0)) continue;
    contact.law = GapLaw(contact.gap, h, model.structure->settings);
    if (Rebounds(model, state, h, contact, rows)) contact.law = ContactLaw::kRestitution;
    contacts->push_back(contact);
  }
}

void ContactSearch::AddRolling(const Model<double>& model, std::vector<ActiveContact>* contacts,
                               std::vector<CoefficientSource>* friction,
                               std::vector<CoefficientSource>* restitution) {
  without_rolling_.swap(*contacts);
  contacts->clear();
  friction->clear();
  restitution->clear();
  for (const ActiveContact& contact : without_rolling_) {
    contacts->push_back(contact);
    AppendRolling(model, contacts);
  }
  for (const ActiveContact& contact : *contacts) {
    friction->push_back(FrictionOf(model, contact));
    restitution->push_back(RestitutionOf(model, contact));
  }
}

void ContactSearch::Find(const Model<double>& model, const State<double>& state, double h,
                         const AssemblyScratch<double>& scratch,
                         std::vector<ActiveContact>* contacts,
                         std::vector<CoefficientSource>* friction,
                         std::vector<CoefficientSource>* restitution) {
  contacts->clear();
  friction->clear();
  restitution->clear();
  FindPairs(model, state, h, scratch);
  beyond_reach_ = 0;
  for (const auto& pair : pairs_) {
    ActiveContact contact;
    contact.a = pair.first;
    contact.b = pair.second;
    const double reach = kListedBeyond * (0.5 * model.structure->settings.contact_margin +
                                          h * std::max(bound_[contact.a], bound_[contact.b]));
    ForEachPartNear(model, contact.a, scratch.poses[contact.a], boxes_[contact.a], contact.b,
                    scratch.poses[contact.b], boxes_[contact.b], reach, [&](PartPair parts) {
                      FindContacts(model, state, h, scratch, contact, parts, contacts);
                    });
    if (model.seams != nullptr) {
      RemoveSecondOwners(model, scratch, friction->size(), contacts);
    }
    if (contacts->size() == friction->size()) {
      ++beyond_reach_;
      continue;
    }
    friction->resize(contacts->size(), MixedFriction(model, contact.a, contact.b));
    restitution->resize(contacts->size(), MixedRestitution(model, contact.a, contact.b));
  }
  if (model.structure->has_rolling_friction) AddRolling(model, contacts, friction, restitution);
  FindLimits(model, state, h, scratch, contacts);
  friction->resize(contacts->size());
  for (size_t i = restitution->size(); i < contacts->size(); ++i) {
    restitution->push_back(RestitutionOf(model, (*contacts)[i]));
  }
  AppendJointFriction(model, state, contacts);
  for (size_t i = friction->size(); i < contacts->size(); ++i) {
    friction->push_back(FrictionOf(model, (*contacts)[i]));
  }
  restitution->resize(contacts->size());
}

bool ContactSearch::GiveUpRebounds(const Model<double>& model, double h, int contact,
                                   std::vector<ActiveContact>* contacts) {
  const ModelStructure& structure = *model.structure;
  DisjointSets bodies;
  bodies.AddAll(structure.bodies.size());
  const auto join = [&](int a, int b) {
    if (structure.bodies[a].block >= 0 && structure.bodies[b].block >= 0) bodies.Join(a, b);
  };
  for (const JointIndex& joint : structure.joints) {
    join(joint.a, joint.b);
    if (joint.c < 0) continue;
    join(joint.a, joint.c);
    join(joint.a, joint.d);
  }
  for (const ActiveContact& c : *contacts) join(c.a, c.b);
  const auto set_of = [&](const ActiveContact& c) {
    return bodies.Root(structure.bodies[c.a].block >= 0 ? c.a : c.b);
  };
  const int wanted = contact < 0 ? -1 : set_of((*contacts)[contact]);
  bool any = false;
  for (ActiveContact& c : *contacts) {
    if (c.law != ContactLaw::kRestitution || (wanted >= 0 && set_of(c) != wanted)) continue;
    c.law = GapLaw(c.gap, h, structure.settings);
    any = true;
  }
  return any;
}

void ContactSearch::KeepGivenUp(const Model<double>& model, double h,
                                const std::vector<ActiveContact>& earlier,
                                std::vector<ActiveContact>* contacts) {
  for (ActiveContact& c : *contacts) {
    if (c.law != ContactLaw::kRestitution) continue;
    const bool is_given_up =
        std::any_of(earlier.begin(), earlier.end(), [&](const ActiveContact& other) {
          return other.SameAs(c) && other.law != ContactLaw::kRestitution;
        });
    if (is_given_up) c.law = GapLaw(c.gap, h, model.structure->settings);
  }
}

}  // namespace tangible
