// SPDX-License-Identifier: Apache-2.0
//
// Certificates of event steps: impacts, and contacts that begin to support a body, at the same
// time.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/certificate/contact_coupling.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/events/coupled_bodies.h"

namespace tangible {
namespace {

// Bodies that an impact's impulses move, with those joined to them, which are added one by one.
std::vector<bool> Struck(const ModelStructure& s, const Impulses& impact) {
  std::vector<bool> struck(s.bodies.size(), false);
  const auto moves = [&](int body) { return s.bodies[body].block >= 0; };
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    if (impact.solution.normal_impulse[i] > 0.0) {
      for (const int body : {impact.contacts[i].a, impact.contacts[i].b}) {
        struck[body] = struck[body] || moves(body);
      }
    }
  }
  for (bool more = true; more;) {
    more = false;
    for (const JointIndex& joint : s.joints) {
      if (moves(joint.a) && moves(joint.b) && struck[joint.a] != struck[joint.b]) {
        struck[joint.a] = struck[joint.b] = more = true;
      }
    }
  }
  return struck;
}

// Whether a contact of an impact closes with a speed: what slides along a face that it touches
// approaches it by rounding.
bool Approaches(const Model<double>& model, const Impulses& impact, size_t i) {
  const ActiveContact& c = impact.contacts[i];
  const ContactBlock<double>& block = impact.problem.contacts[i];
  const double normal = RelativeSpeed(impact.before, c.a, block.normal_a, c.b, block.normal_b);
  const double slip = RelativeSpeed(impact.before, c.a, block.tangent_a, c.b, block.tangent_b);
  return normal < -Negligible(model, std::hypot(normal, slip));
}

}  // namespace

// The time, in steps, since the last impact that moved a body of a contact that approaches.
double RolloutCertifier::SinceLastStrike(const ModelStructure& s, const Impulses& impact,
                                         const std::vector<size_t>& approaching) const {
  double last = -std::numeric_limits<double>::infinity();
  for (const size_t i : approaching) {
    last = std::max({last, struck_at_[impact.contacts[i].a], struck_at_[impact.contacts[i].b]});
  }
  return (impact.time - last) / s.settings.dt;
}

// Whether the contacts of an impact act on those of the impacts shortly before it.
Coupling RolloutCertifier::CouplingWithStrikes(const Model<double>& model,
                                               const Impulses& impact) const {
  std::vector<ActiveContact> before;
  for (const Strike& strike : strikes_) {
    const ActiveContact contact =
        island_ != nullptr ? island_->InIsland(strike.contact) : strike.contact;
    if (contact.a >= 0 && contact.b >= 0) before.push_back(contact);
  }
  return CouplingOf(model, impact.before, impact.time, before, impact.contacts, {}, Directions());
}

// Keeps the contacts of an impact, and those of earlier ones as long as they are near.
void RolloutCertifier::AddStrikes(const ModelStructure& s, const Impulses& impact) {
  std::erase_if(strikes_, [&](const Strike& strike) {
    return impact.time - strike.time > kNearJumpMargin * s.settings.dt;
  });
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    if (!(impact.solution.normal_impulse[i] > 0.0)) continue;
    const ActiveContact& contact = impact.contacts[i];
    strikes_.push_back({island_ != nullptr ? island_->InWhole(contact) : contact, impact.time});
  }
}

// A contact that stops sliding as coupled bodies meet: a little later it would still pull as they
// do, and a little earlier no longer.
void RolloutCertifier::AddEndsOfSlips(const Model<double>& model, long step,
                                      const Impulses& impact) {
  const ModelStructure& s = *model.structure;
  for (const Strike& slip : slips_ended_) {
    const double distance = (impact.time - slip.time) / s.settings.dt;
    const ActiveContact contact =
        island_ != nullptr ? island_->InIsland(slip.contact) : slip.contact;
    if (!(distance < kNearJumpMargin) || contact.a < 0 || contact.b < 0) continue;
    std::vector<ActiveContact> contacts = impact.contacts;
    contacts.push_back(contact);
    CoupledBodies coupled;
    coupled.Connect(s, contacts);
    for (size_t i = 0; i < impact.contacts.size(); ++i) {
      const ActiveContact& struck = impact.contacts[i];
      if (Approaches(model, impact, i) && coupled.GroupOf(struck) == coupled.GroupOf(contact)) {
        AddMargin(distance, {&s, step, impact.time, i, &struck, impact.solution.modes[i]},
                  "an impact as a contact stops sliding");
      }
    }
  }
}

// Impacts on the same bodies at (nearly) the same time: the result depends on their order. Impacts
// of contacts that do not act on each other may be in any order, and are separate impacts
// (events/impact_groups.h).
void RolloutCertifier::AddSimultaneous(const Model<double>& model, long step,
                                       const Impulses& impact) {
  const ModelStructure& s = *model.structure;
  const std::vector<bool> struck = Struck(s, impact);
  std::vector<size_t> approaching;
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    if (Approaches(model, impact, i)) approaching.push_back(i);
  }
  if (approaching.empty()) {
    return;
  }
  const ActiveContact& first = impact.contacts[approaching[0]];
  const Place place{
      &s, step, impact.time, approaching[0], &first, impact.solution.modes[approaching[0]]};
  // Several contacts approach at once, and the impulse of one moves bodies of another.
  for (size_t k = 0; k < approaching.size(); ++k) {
    for (size_t l = 0; l < k; ++l) {
      const ActiveContact& x = impact.contacts[approaching[k]];
      const ActiveContact& y = impact.contacts[approaching[l]];
      if (impact.time > 0.0 && (x.a != y.a || x.b != y.b || !x.IsOfShapes() || !y.IsOfShapes())) {
        AddMargin(0.0, place, "two contacts touch at the same time");
      }
      // What touches as the run starts meets at once beside it too, unless a gap is changed.
      if (impact.time <= 0.0 && !MovesGap(model, impact.before, x) &&
          !MovesGap(model, impact.before, y)) {
        continue;
      }
      for (const int body : {x.a, x.b}) {
        if (s.bodies[body].block >= 0 && (body == y.a || body == y.b)) {
          AddJump(0.0, place, "two contacts of " + s.bodies[body].name + " touch at once");
        }
      }
    }
  }
  const double margin = SinceLastStrike(s, impact, approaching);
  const Coupling coupling =
      margin < kNearJumpMargin ? CouplingWithStrikes(model, impact) : Coupling::kActs;
  if (coupling == Coupling::kActs) {
    AddJump(margin, place,
            "impacts follow each other within " + Short(margin * s.settings.dt) + " s");
  } else if (coupling == Coupling::kBeside) {
    AddMargin(margin, place, "two contacts touch at the same time");
  }
  for (size_t body = 0; body < struck.size(); ++body) {
    struck_at_[body] = struck[body] ? impact.time : struck_at_[body];
  }
  AddStrikes(s, impact);
}

namespace {

// Whether both bodies of a contact have no speed, and those that move are on supports, which hold
// them where they are: their gap is that of the start.
bool RestsOnSupports(const ModelStructure& s, const State<double>& state,
                     const ActiveContact& contact) {
  const auto rests = [&](int body) {
    const double* v = &state.twist[3 * static_cast<size_t>(body)];
    if (v[0] != 0.0 || v[1] != 0.0 || v[2] != 0.0) return false;
    return s.bodies[body].block < 0 ||
           std::any_of(s.supports.begin(), s.supports.end(),
                       [&](const SupportIndex& support) { return support.body == body; });
  };
  return rests(contact.a) && rests(contact.b);
}

}  // namespace

// A contact that only touches, without force, takes part in the impact of another contact: with a
// gap, however small, it would have a separate impact later.
void RolloutCertifier::AddUnloaded(const Model<double>& model, long step, const Impulses& impact) {
  double largest = 0.0;
  for (const double normal : impact.solution.normal_impulse) {
    largest = std::max(largest, normal);
  }
  // The impact of another contact; one that approaches by rounding alone does not count.
  const auto speed = [&](size_t i) {
    const ActiveContact& c = impact.contacts[i];
    const ContactBlock<double>& block = impact.problem.contacts[i];
    return RelativeSpeed(impact.before, c.a, block.normal_a, c.b, block.normal_b);
  };
  bool any = false;
  for (size_t i = 0; i < impact.contacts.size(); ++i) {
    any = any || speed(i) < -Negligible(model, speed(i));
  }
  for (size_t i = 0; any && i < impact.contacts.size(); ++i) {
    const ActiveContact& c = impact.contacts[i];
    if (c.is_rolling) continue;
    const double before = speed(i);
    const bool loaded = Has(loaded_, c);
    if (!(impact.solution.normal_impulse[i] > kLoaded * largest) ||
        before < -Negligible(model, before)) {
      continue;
    }
    // As the run starts it has been loaded for no time: what opens it takes it from the impact.
    const bool jumps = impact.time <= 0.0
                           ? MovesAtStart(model, impact.before, c)
                           : !loaded && (!RestsOnSupports(*model.structure, impact.before, c) ||
                                         MovesGap(model, impact.before, c));
    if (jumps) {
      const Place place{model.structure.get(), step, impact.time, i, &c, impact.solution.modes[i]};
      AddJump(0.0, place,
              loaded ? "it is pressed when another impact moves it"
                     : "it only touches when another impact moves it");
    }
  }
}

// Whether the contacts that an impact loads do not act on the normal of contact i, which is closed
// and loaded before: it neither opens nor gets an impulse (the floor under a disc that meets a
// wall).
bool RolloutCertifier::StaysUnloaded(const Model<double>& model, const Impulses& impact,
                                     size_t i) const {
  const ActiveContact& contact = impact.contacts[i];
  const ContactBlock<double>& block = impact.problem.contacts[i];
  const double speed =
      RelativeSpeed(impact.before, contact.a, block.normal_a, contact.b, block.normal_b);
  const bool is_loaded = Has(loaded_, contact);
  if (!is_loaded || speed < -Negligible(model, speed)) return false;
  double largest = 0.0;
  for (const double normal : impact.solution.normal_impulse) {
    largest = std::max(largest, normal);
  }
  std::vector<ActiveContact> others;
  for (size_t k = 0; k < impact.contacts.size(); ++k) {
    if (impact.solution.normal_impulse[k] > kLoaded * largest) others.push_back(impact.contacts[k]);
  }
  return CouplingOf(model, impact.before, impact.time, {contact}, others, {}, Directions(),
                    FrictionOfFirst::kLeftOut) == Coupling::kNone;
}

// Contacts of different pairs that begin to support a body at the same time: if one were earlier,
// it would support the body alone until the other closes. Contacts that do not act on each other
// support it in ways of their own.
void RolloutCertifier::AddClosedAtOnce(const Model<double>& model, long step,
                                       const Segment& segment) {
  const ModelStructure& s = *model.structure;
  std::vector<size_t> begun;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    const ActiveContact& contact = segment.contacts[i];
    const bool is_loaded = Has(loaded_, contact);
    if (!contact.IsOfShapes() || !is_loaded || HasPair(closed_, contact)) {
      continue;
    }
    for (const size_t k : begun) {
      const ActiveContact& other = segment.contacts[k];
      for (const int body : {contact.a, contact.b}) {
        const bool shares = body == other.a || body == other.b;
        if (shares && s.bodies[body].block >= 0 &&
            !(contact.a == other.a && contact.b == other.b) &&
            CouplingOf(model, segment.before, segment.time, {contact}, {other}, segment.contacts,
                       Directions()) != Coupling::kNone) {
          AddMargin(0.0, {&s, step, segment.time, i, &contact, segment.modes[i]},
                    "two contacts of " + s.bodies[body].name + " close at once");
        }
      }
    }
    begun.push_back(i);
  }
}

}  // namespace tangible
