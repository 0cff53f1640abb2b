// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/start_probe.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

constexpr double kLeaves = 8.0;      // U over the speed that just leaves the tolerance
constexpr double kConfirmed = 16.0;  // factor by which U is reduced to confirm a kink
constexpr int kMostSteps = 16;       // for contacts to close again
constexpr double kFlights = 4.0;     // that a run lasts at least
// R(τ/2) / R(τ) is 1/4 for a smooth map, 1/2 at a kink and 1 at a jump.
constexpr double kJumps = 0.75;
// A slip that ends at once counts as jammed if it was this many times faster than U.
constexpr double kSlips = 10.0;

double Along(const std::vector<JacobianEntry>& gradient, const VectorX<double>& direction) {
  double rate = 0.0;
  for (const JacobianEntry& entry : gradient) {
    rate += entry.value * direction[entry.variable];
  }
  return rate;
}

// The run from the start with the direction added `shift` times.
class Course {
 public:
  Course(const Model<double>& model, const State<double>& start, const VectorX<double>& direction,
         double shift)
      : model_(model), state_(start), stepper_(model) {
    const ModelStructure& s = *model.structure;
    const auto add = [&](std::vector<double>* to, int first) {
      for (size_t i = 0; i < to->size(); ++i) {
        (*to)[i] += shift * direction[first + static_cast<Eigen::Index>(i)];
      }
    };
    add(&state_.pose, s.PoseVariable(0, 0));
    add(&state_.twist, s.TwistVariable(0, 0));
    add(&model_.parameters, s.ParameterVariable(0));
  }

  bool Step(long k) {
    const SimulationSettings& settings = model_.structure->settings;
    const bool done =
        stepper_.Step(model_, StepTime(settings, k), StepLength(settings, k), &state_).status ==
        StepStatus::kDone;
    if (done) Watch();
    return done;
  }

  const Model<double>& model() const { return model_; }
  const State<double>& state() const { return state_; }
  Stepper& stepper() { return stepper_; }

  /// Whether the pair of a contact is closed as the last step ends.
  bool HasClosed(const ActiveContact& contact) {
    const IslandRecords& records = stepper_.parts();
    for (int k = 0; k < records.num_islands; ++k) {
      const IslandRecord& island = *records.islands[k];
      const ActiveContact own = island.InIsland(contact);
      if (own.a < 0 || own.b < 0) continue;
      if (HasClosed(island.events, own)) return true;
    }
    return false;
  }

  /// The largest slip of a contact that ended at an instant so far, m/s.
  double Jammed(const ActiveContact& contact) const {
    double slip = 0.0;
    for (const auto& [of, speed] : jams_) {
      if (of.a == contact.a && of.b == contact.b) slip = std::max(slip, speed);
    }
    return slip;
  }

 private:
  static bool HasClosed(const EventRecord& record, const ActiveContact& contact) {
    for (int p = record.num_parts - 1; p >= 0; --p) {
      const EventPart& part = *record.parts[p];
      if (part.is_impulses || !(part.segment.length > 0.0)) continue;
      return std::any_of(part.segment.contacts.begin(), part.segment.contacts.end(),
                         [&](const ActiveContact& other) {
                           return other.IsOfShapes() && other.a == contact.a &&
                                  other.b == contact.b;
                         });
    }
    return false;
  }

  void Watch() {
    const IslandRecords& records = stepper_.parts();
    Model<double> memory;
    for (int k = 0; k < records.num_islands; ++k) {
      const IslandRecord& island = *records.islands[k];
      Watch(island.ModelOf(model_, &memory), island);
    }
  }

  void Watch(const Model<double>& model, const IslandRecord& island) {
    for (int p = 0; p < island.events.num_parts; ++p) {
      const EventPart& part = *island.events.parts[p];
      if (!part.is_impulses && part.segment.length > 0.0) continue;
      const State<double>& before = part.is_impulses ? part.impulses.before : part.segment.before;
      State<double> after = before;
      after.twist = part.is_impulses ? part.impulses.new_twist : part.segment.after.twist;
      for (const ActiveContact& contact :
           part.is_impulses ? part.impulses.contacts : part.segment.contacts) {
        if (!contact.IsOfShapes()) continue;
        const double slip = std::abs(SpeedsOf(model, before, contact).slip);
        if (std::abs(SpeedsOf(model, after, contact).slip) <= kEndedSlip * slip) {
          jams_.emplace_back(island.InWhole(contact), slip);
        }
      }
    }
  }

  Model<double> model_;
  State<double> state_;
  Stepper stepper_;
  std::vector<std::pair<ActiveContact, double>> jams_;
};

// The rates of a contact's speeds, per unit of a direction.
struct Rates {
  double approach = 0.0, slip = 0.0;  // m/s
  double touch = 0.0;                 // the tolerance within which it touches, m
};

class Probe {
 public:
  Probe(const Model<double>& model, const State<double>& start,
        const std::vector<ActiveContact>& contacts, const VectorX<double>& direction,
        double acceleration, const std::string& name)
      : model_(model),
        start_(start),
        contacts_(contacts),
        direction_(direction),
        name_(name),
        search_(model),
        acceleration_(acceleration) {
    const ModelStructure& s = *model.structure;
    LocalJacobianScratch scratch;
    for (const ActiveContact& contact : contacts) {
      std::vector<JacobianEntry> approach, slip;
      AddApproachGradient(model, start, contact, &scratch, &approach);
      AddSlipGradient(model, start, contact, &scratch, &slip);
      rates_.push_back({Along(approach, direction), Along(slip, direction),
                        search_.lengths().Touch(start, contact.a, contact.b)});
      speed_ = std::max({speed_, std::abs(rates_.back().approach), std::abs(rates_.back().slip)});
      touch_ = std::max(touch_, rates_.back().touch);
    }
    for (int body = 0; body < s.num_bodies(); ++body) {
      fastest_ = std::max(
          {fastest_, std::abs(direction[s.TwistVariable(body, 0)]),
           std::abs(direction[s.TwistVariable(body, 1)]),
           std::abs(direction[s.TwistVariable(body, 2)]) * search_.lengths().radius(body)});
    }
  }

  StartFinding Run() {
    StartFinding found;
    const double speed = std::max(kLeaves * std::sqrt(2.0 * acceleration_ * touch_),
                                  kOfStep * acceleration_ * model_.structure->settings.dt);
    if (!(acceleration_ > 0.0) || !(speed_ > kOpeningSpeed * fastest_) ||
        !Allowed(speed / speed_)) {
      return found;
    }
    for (const double sign : {1.0, -1.0}) {
      StartFinding one = Side(sign * speed / speed_, speed);
      if (one.kind == StartKind::kSmooth || one.kind <= found.kind ||
          Side(sign * speed / speed_ / kConfirmed, speed / kConfirmed).kind == StartKind::kSmooth) {
        continue;
      }
      found = std::move(one);
    }
    return found;
  }

 private:
  bool Allowed(double shift) const {
    const ModelStructure& s = *model_.structure;
    for (int i = 0; i < s.num_parameters; ++i) {
      const double change = std::abs(shift * direction_[s.ParameterVariable(i)]);
      if (change > kOfParameter * std::max(std::abs(model_.parameters[i]), 1.0)) return false;
    }
    return true;
  }

  // Speeds of all moving bodies, angular ones times the body's radius, and the mean speeds of the
  // changes of poses.
  VectorX<double> Speeds(const std::vector<double>& pose, const std::vector<double>& twist,
                         double time) const {
    const std::vector<int>& moving = model_.structure->moving;
    VectorX<double> speeds(static_cast<Eigen::Index>(6 * moving.size()));
    Eigen::Index k = 0;
    for (const int body : moving) {
      for (int i = 0; i < 3; ++i) {
        const double arm = i < 2 ? 1.0 : std::max(search_.lengths().radius(body), kNoScale);
        speeds[k++] = arm * twist[3 * static_cast<size_t>(body) + i];
        speeds[k++] = arm * pose[3 * static_cast<size_t>(body) + i] / time;
      }
    }
    return speeds;
  }

  StartFinding Side(double shift, double speed) {
    Course at(model_, start_, direction_, 0.0);
    Course whole(model_, start_, direction_, shift);
    Course half(model_, start_, direction_, 0.5 * shift);
    RowMatrixXd w_dot = direction_;
    StepTangent tangent;
    const SimulationSettings& settings = model_.structure->settings;
    const double flight = 2.0 * speed / acceleration_;
    bool closed = false;
    double time = 0.0;
    for (long k = 0; k < std::min<long>(kMostSteps, NumSteps(settings)); ++k) {
      if (!at.Step(k)) return {};
      tangent.Apply(model_, &at.stepper(), &w_dot);
      if (!whole.Step(k) || !half.Step(k)) {
        return {StartKind::kKink, contacts_.front(),
                "touches at the start, with " + name_ + " changed there is no motion"};
      }
      time = StepTime(settings, k + 1);
      closed = std::all_of(contacts_.begin(), contacts_.end(), [&](const ActiveContact& contact) {
        return !at.HasClosed(contact) || (whole.HasClosed(contact) && half.HasClosed(contact));
      });
      if (closed && time >= kFlights * flight) break;
    }
    const VectorX<double> derivative = DerivativeOf(w_dot, time);
    const VectorX<double> base = Speeds(at.state().pose, at.state().twist, time);
    const auto missed = [&](const Course& course, double by) {
      return VectorX<double>(Speeds(course.state().pose, course.state().twist, time) - base -
                             by * derivative);
    };
    const VectorX<double> of_whole = missed(whole, shift);
    const VectorX<double> of_half = missed(half, 0.5 * shift);
    const double apart = (4.0 * of_half - of_whole).cwiseAbs().maxCoeff() / std::abs(shift);
    const double size = std::max(derivative.cwiseAbs().maxCoeff(),
                                 of_whole.cwiseAbs().maxCoeff() / std::abs(shift));
    const double noise =
        kNoise * (touch_ / time + kSpeedRounding * base.cwiseAbs().maxCoeff()) / std::abs(shift);
    if (!(apart > std::max(kLeastKink * size, noise))) {
      return {};
    }
    const bool jumps = of_half.cwiseAbs().maxCoeff() > kJumps * of_whole.cwiseAbs().maxCoeff();
    return Describe(jumps ? StartKind::kJump : StartKind::kKink, shift, speed, &at, &whole);
  }

  VectorX<double> DerivativeOf(const RowMatrixXd& w_dot, double time) const {
    const ModelStructure& s = *model_.structure;
    const int size = 3 * s.num_bodies();
    std::vector<double> pose(size), twist(size);
    for (int i = 0; i < size; ++i) {
      pose[i] = w_dot(s.PoseVariable(0, 0) + i, 0);
      twist[i] = w_dot(s.TwistVariable(0, 0) + i, 0);
    }
    return Speeds(pose, twist, time);
  }

  // Names the contact that jams, or else one that does not close again, or else the one moved most.
  StartFinding Describe(StartKind kind, double shift, double speed, Course* at,
                        Course* beside) const {
    const auto jams = [&](const Course& course, size_t i) {
      return course.Jammed(contacts_[i]) > kSlips * speed;
    };
    const auto is_lost = [&](size_t i) {
      return at->HasClosed(contacts_[i]) && !beside->HasClosed(contacts_[i]);
    };
    size_t chosen = 0;
    double most = -1.0;
    for (size_t i = 0; i < contacts_.size(); ++i) {
      const double rank = (jams(*at, i) ? 8.0 : 0.0) + (jams(*beside, i) ? 4.0 : 0.0) +
                          (is_lost(i) ? 2.0 : 0.0) +
                          std::max(std::abs(rates_[i].approach), std::abs(rates_[i].slip)) / speed_;
      if (rank > most) {
        most = rank;
        chosen = i;
      }
    }
    const double opening = shift * rates_[chosen].approach;
    std::string what = jams(*at, chosen) ? "jams at the start, " : "touches at the start, ";
    what += name_;
    what += opening > 0.0 ? " opens it" : opening < 0.0 ? " closes it" : " sets it sliding";
    if (!jams(*at, chosen) && jams(*beside, chosen)) {
      what += " and it jams";
    } else if (is_lost(chosen)) {
      what += " and it does not come back";
    }
    return {kind, contacts_[chosen], what};
  }

  const Model<double>& model_;
  const State<double>& start_;
  const std::vector<ActiveContact>& contacts_;
  const VectorX<double>& direction_;
  const std::string& name_;
  EventSearch search_;
  std::vector<Rates> rates_;
  double acceleration_;   // of bodies whose contact opens, m/s²
  double speed_ = 0.0;    // of contacts, per unit of the direction
  double fastest_ = 0.0;  // of bodies, the same
  double touch_ = 0.0;
};

}  // namespace

bool MayJam(const Model<double>& model, const State<double>& start,
            const std::vector<ActiveContact>& touching, const ActiveContact& contact) {
  constexpr double kNear = 0.9;
  const ModelStructure& s = *model.structure;
  const double friction = MixedFriction(model, contact.a, contact.b).value;
  if (!(friction > 0.0)) {
    return false;
  }
  const auto moves = [&](int body) { return s.bodies[body].block >= 0; };
  const auto is_jointed = [&](int body) {
    return moves(body) && std::any_of(s.joints.begin(), s.joints.end(), [&](const auto& joint) {
             return joint.a == body || joint.b == body;
           });
  };
  if (is_jointed(contact.a) || is_jointed(contact.b)) {
    return true;
  }
  ContactRows<double> rows;
  EvaluateContactRows(model, start, contact, &rows);
  double normal = 0.0;
  double mixed = 0.0;
  const auto add = [&](int body, const RowPart<double>& n, const RowPart<double>& t) {
    const BodyIndex& index = s.bodies[body];
    for (int i = 0; moves(body) && i < 3; ++i) {
      const double mass = model.parameters[i < 2 ? index.mass : index.inertia];
      normal += n[i] * n[i] / mass;
      mixed += n[i] * t[i] / mass;
    }
  };
  add(contact.a, rows.normal_a, rows.tangent_a);
  add(contact.b, rows.normal_b, rows.tangent_b);
  if (friction * std::abs(mixed) >= kNear * normal) {
    return true;
  }
  // The body is wedged between faces that are not parallel.
  const Vector2<double> along = rows.geometry.normal;
  return std::any_of(touching.begin(), touching.end(), [&](const ActiveContact& other) {
    if (!other.IsOfShapes() || !(MixedFriction(model, other.a, other.b).value > 0.0)) return false;
    const auto shares = [&](int body) {
      return moves(body) && (body == other.a || body == other.b);
    };
    if (!shares(contact.a) && !shares(contact.b)) return false;
    EvaluateContactRows(model, start, other, &rows);
    const Vector2<double>& n = rows.geometry.normal;
    return std::abs(along.x() * n.y() - along.y() * n.x()) > kFreeSlide;
  });
}

StartFinding ProbeStart(const Model<double>& model, const State<double>& start,
                        const std::vector<ActiveContact>& contacts,
                        const VectorX<double>& direction, double acceleration,
                        const std::string& name) {
  return Probe(model, start, contacts, direction, acceleration, name).Run();
}

}  // namespace tangible
