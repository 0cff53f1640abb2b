// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where the derivative of a run by fixed steps is that of the discrete map x_k+1 = F(x_k, p) and
// not of the motion: where a restitution acts, a contact or limit is made or broken, or a slip
// turns back: of a contact, of its rolling, of a joint with friction or a motor, or of a support.
//
// The motion has the event at a time t*(p), and the derivative of the positions jumps there by
// (v⁻ − v⁺) dt*/dp. The discrete map has it at a step, which does not follow p. After an impact
// with restitution e the two differ by (1 + e) (n·v) dt*/dp, whatever dt: a ball that falls from
// the height h and bounces with e = 1 has dy/dh = +1 in the map where the motion has −1 at first.
// After a landing without restitution the next step, which sets the gap to 0, makes up for the jump
// along the normal, to first order in dt, but not for that of a slip which the landing ends.
//
// A contact that exists from the start, without a gap and without approaching, is not made; where a
// face and a corner of the same shapes continue one another without an impact nothing is made or
// broken, nor where a body passes from one flush face to another of the same normal, which are one
// surface; and a slip that ends changes no contact.
//
// A slip that turns back (a block slides up a slope and down again) has the acceleration a₁ before
// and a₂ after the instant at which its speed is 0, and the motion's derivative of the speed by an
// earlier one is a₂ / a₁ from then on. The map's is 1, or 0 where a step ends at rest meanwhile.

#include <array>
#include <string>
#include <vector>

#include "tangible/dynamics/elements/support.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

struct ContactChange {
  enum class Kind : unsigned char { kMade, kBroken, kRestitution, kReversed };
  Kind kind = Kind::kMade;
  ActiveContact contact;
};

/// Where it happened, and what: "made", "broken", "an impact with restitution" or "a slip that
/// turns back".
std::string TextOf(const ModelStructure& structure, long step, double time,
                   const ContactChange& change);

/// Looks at fixed steps one after another.
class DiscreteMapWatch {
 public:
  explicit DiscreteMapWatch(const Model<double>& model) : lengths_(model) {}

  /// The changes in this step, valid until the next call. Costs O(n log n) for n contacts.
  const std::vector<ContactChange>& AddStep(const Model<double>& model, const StepRecord& record);

 private:
  // A contact that carries an impulse or touches without one, and whether it continues.
  struct Touch {
    ActiveContact contact;
    Vector2<double> normal;
    bool continues = false;
  };
  Touch* FindLast(const ActiveContact& contact);
  // A contact of the last step, of the same shapes, that does not continue otherwise.
  Touch* FindReplaced(const ActiveContact& contact);
  // In a model with seams, a contact of the last step of the same body with another one that no
  // force moves, of the same normal, that does not continue otherwise.
  Touch* FindHandedOver(const Model<double>& model, const Touch& touch);
  bool ExistsAtStart(const Model<double>& model, const StepRecord& record, size_t contact) const;
  // The direction of a slip in this step, 0 for none, or the last one of a slip that the step
  // before this one ended.
  struct Slide {
    ActiveContact contact;
    double sign = 0.0;
    bool ended = false;
  };
  void AddSlides(const StepRecord& record);
  /// The same of supports, by the twists of their bodies: against the last one in all.
  struct SupportSlide {
    std::array<double, 3> twist{};  ///< 0: it did not slide
    bool ended = true;
  };
  void AddSupportSlides(const Model<double>& model, const StepRecord& record);

  Lengths lengths_;
  bool first_ = true;
  std::vector<Touch> last_, now_;  // ordered by their bodies
  std::vector<Slide> slides_, slides_now_;
  std::vector<SupportSlide> support_slides_;
  SupportFriction support_;
  std::vector<size_t> without_last_;  // closed contacts of this step that were not in the last
  std::vector<ContactChange> changes_;
};

}  // namespace tangible
