// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_pivoting.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace {

// Maximum number of rounds in which sliding contacts that would pull are opened before the start.
constexpr int kMaxStartRounds = 30;
// Rounds in which shifts of torques' limits are raised.
constexpr int kMaxRaises = 8;
// From this number of contacts on refinement costs a path more than digits that it does not need.
constexpr size_t kLeastContactsUnrefined = 12;

bool Slides(ContactMode mode) {
  return mode == ContactMode::kSlidingPositive || mode == ContactMode::kSlidingNegative;
}

}  // namespace

void ContactPivoting::Reserve(int num_blocks, int num_contacts) {
  modes_.reserve(num_contacts);
  shifts_.reserve(num_contacts);
  x_.reserve(6 * static_cast<size_t>(num_blocks));
  joint_centre_.reserve(3 * static_cast<size_t>(num_blocks));
}

// Numbers in [0.5, 1) from the sequence of the golden ratio, which no symmetry of a scene repeats;
// with a seed in [0.1, 10), log-uniform.
double ContactPivoting::Scatter(size_t contact, int kind) const {
  const size_t at = 3 * contact + static_cast<size_t>(kind);
  if (scatter_ != 0) {
    std::mt19937_64 random(scatter_ + at);
    return std::pow(10.0, static_cast<double>(random() >> 11) * 0x1p-52 - 1.0);
  }
  const double x = 0.6180339887498949 * static_cast<double>(at + 1);
  return 0.5 + 0.5 * (x - std::floor(x));
}

// Solves for the value and the rate of all unknowns with the present modes.
bool ContactPivoting::SolveSystem() {
  const ContactProblem<double>& p = *problem_;
  ++*factorisations_;
  if (!system_->Factor(p, modes_, regularisation_)) {
    return false;
  }
  const std::vector<int>& block_of = system_->contact_block();
  const std::vector<double>& delta = system_->regularisation();
  const int nb = p.num_bodies;
  x_.assign(6 * static_cast<size_t>(system_->num_blocks()), 0.0);
  for (int i = 0; i < 3 * nb; ++i) {
    x_[2 * i] = p.load[i];
  }
  for (size_t j = 0; j < p.joints.size(); ++j) {
    for (int r = 0; r < p.joints[j].rows; ++r) {
      const size_t row = 3 * (nb + j) + r;
      x_[2 * row] = p.joints[j].rhs[r] + delta[row] * joint_centre_[3 * j + r];
    }
  }
  // Adds the known impulses of a contact to its bodies.
  const auto push = [&](int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
                        double rate) {
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) {
        x_[2 * (3 * a + i) + 1] += row_a[i] * rate;
      }
      if (b >= 0) {
        x_[2 * (3 * b + i) + 1] += row_b[i] * rate;
      }
    }
  };
  for (size_t i = 0; i < p.contacts.size(); ++i) {
    const ContactBlock<double>& c = p.contacts[i];
    const Shift& shift = shifts_[i];
    const ContactMode mode = modes_[i];
    if (mode == ContactMode::kOpen) {
      push(c.a, c.normal_a, c.b, c.normal_b, -shift.b);
      continue;
    }
    if (Slides(mode)) {
      const double b = c.rolls ? shifts_[i - 1].b : shift.b;
      push(c.a, c.tangent_a, c.b, c.tangent_b, -SlidingSign(mode) * c.friction * b);
    }
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    x_[2 * row] = c.rolls ? 0.0 : c.limit_given ? c.offset : delta[row] * shift.centre_n - c.c_n;
    x_[2 * row + 1] = c.limit_given ? 0.0 : -shift.a_n;
    if (mode == ContactMode::kSticking) {
      x_[2 * row + 2] = delta[row + 1] * shift.centre_t - c.c_t;
      x_[2 * row + 3] = -shift.a_t;
    }
  }
  if (regularisation_ > kUnrefined && modes_.size() >= kLeastContactsUnrefined) {
    system_->SolveUnrefined(p, modes_, x_.data(), 2);
  } else {
    system_->SolveRegularised(p, modes_, x_.data(), 2);
  }
  return std::all_of(x_.begin(), x_.end(), [](double x) { return std::isfinite(x); });
}

// s'.
ContactPivoting::Test ContactPivoting::Normal(int contact) const {
  const ContactBlock<double>& c = problem_->contacts[contact];
  const Shift& shift = shifts_[contact];
  const double delta =
      regularisation_ * RowMobility(problem_->mass, c.a, c.normal_a, c.b, c.normal_b);
  Test test{c.c_n - delta * shift.centre_n, shift.a_n - delta * shift.b};
  const auto add = [&](int block, const RowPart<double>& row) {
    for (int i = 0; i < 3 && block >= 0; ++i) {
      test.value += row[i] * x_[2 * (3 * block + i)];
      test.rate += row[i] * x_[2 * (3 * block + i) + 1];
    }
  };
  add(c.a, c.normal_a);
  add(c.b, c.normal_b);
  return test;
}

// w'.
ContactPivoting::Test ContactPivoting::Sliding(int contact) const {
  const ContactBlock<double>& c = problem_->contacts[contact];
  const Shift& shift = shifts_[contact];
  const double delta =
      regularisation_ * RowMobility(problem_->mass, c.a, c.tangent_a, c.b, c.tangent_b);
  Test test{c.c_t - delta * shift.centre_t, shift.a_t};
  const auto add = [&](int block, const RowPart<double>& row) {
    for (int i = 0; i < 3 && block >= 0; ++i) {
      test.value += row[i] * x_[2 * (3 * block + i)];
      test.rate += row[i] * x_[2 * (3 * block + i) + 1];
    }
  };
  add(c.a, c.tangent_a);
  add(c.b, c.tangent_b);
  const Test friction = Friction(contact);
  test.value += delta * friction.value;
  test.rate += delta * friction.rate;
  return test;
}

// λ'; 0 for open contacts.
ContactPivoting::Test ContactPivoting::Impulse(int contact) const {
  if (problem_->contacts[contact].rolls) --contact;  // whose impulse limits it
  const int block = system_->contact_block()[contact];
  if (block < 0) {
    return {};
  }
  return {x_[6 * static_cast<size_t>(block)],
          x_[6 * static_cast<size_t>(block) + 1] + shifts_[contact].b};
}

// λt.
ContactPivoting::Test ContactPivoting::Friction(int contact) const {
  const ContactMode mode = modes_[contact];
  if (mode == ContactMode::kSticking) {
    const size_t at = 6 * static_cast<size_t>(system_->contact_block()[contact]) + 2;
    return {x_[at], x_[at + 1]};
  }
  const double along = -SlidingSign(mode) * problem_->contacts[contact].friction;
  const Test impulse = Impulse(contact);
  return {along * impulse.value, along * impulse.rate};
}

// The inequalities of a contact's mode, at most two.
int ContactPivoting::Tests(int contact, Test* tests) const {
  const ContactMode mode = modes_[contact];
  if (mode == ContactMode::kOpen && problem_->contacts[contact].rolls) return 0;
  if (mode == ContactMode::kOpen) {
    tests[0] = Normal(contact);
    tests[0].next =
        problem_->contacts[contact].has_friction ? ContactMode::kSticking : ContactMode::kClosed;
    return 1;
  }
  if (mode == ContactMode::kSticking) {
    const double mu = problem_->contacts[contact].friction;
    const Test impulse = Impulse(contact);
    const Test friction = Friction(contact);
    tests[0] = {mu * impulse.value - friction.value, mu * impulse.rate - friction.rate,
                ContactMode::kSlidingNegative};
    tests[1] = {mu * impulse.value + friction.value, mu * impulse.rate + friction.rate,
                ContactMode::kSlidingPositive};
    return 2;
  }
  int count = 0;
  if (!problem_->contacts[contact].limit_given) {
    tests[0] = Impulse(contact);
    tests[0].next = ContactMode::kOpen;
    count = 1;
  }
  if (mode != ContactMode::kClosed) {
    const Test sliding = Sliding(contact);
    const double sign = SlidingSign(mode);
    tests[count] = {sign * sliding.value, sign * sliding.rate, ContactMode::kSticking};
    ++count;
  }
  return count;
}

// Chooses the shifts with which the present modes solve the problem at τ = 1.
bool ContactPivoting::Start(From from) {
  for (int round = 0; round < kMaxStartRounds; ++round) {
    if (!SolveSystem()) {
      return false;
    }
    // The friction of a sliding contact is proportional to its normal impulse, so that a shift of a
    // negative one would change the solution: such a contact is opened instead.
    bool opened = false;
    for (size_t i = 0; i < modes_.size(); ++i) {
      if (Slides(modes_[i]) && !problem_->contacts[i].limit_given &&
          Impulse(static_cast<int>(i)).At(1.0) <= 0.0) {
        SetMode(i, ContactMode::kOpen, 1.0);
        opened = true;
      }
      opened = TurnsAtLimit(i) || opened;
    }
    if (!opened) {
      RaiseInequalities(from);
      return !problem_->has_rolling || RaiseFurther();
    }
  }
  return false;
}

// Rolling friction that would exceed its limit at the start turns there: a shift of the limit would
// be one of the contact's impulse.
bool ContactPivoting::TurnsAtLimit(size_t i) {
  const ContactBlock<double>& c = problem_->contacts[i];
  if (!c.rolls || modes_[i] != ContactMode::kSticking) return false;
  const double friction = Friction(static_cast<int>(i)).At(1.0);
  if (std::abs(friction) < c.friction * Impulse(static_cast<int>(i)).At(1.0)) return false;
  modes_[i] = friction < 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
  return true;
}

// Torques at their limits follow the shifts of impulses, so that the solution for these differs
// from that for which they were found.
bool ContactPivoting::RaiseFurther() {
  for (int round = 0; round < kMaxRaises; ++round) {
    if (!SolveSystem()) return false;
    bool raised = false;
    for (size_t k = 0; k < modes_.size(); ++k) {
      Test tests[2];
      const int count = Tests(static_cast<int>(k), tests);
      for (int t = 0; t < count; ++t) {
        const double lacks = -tests[t].At(1.0);
        if (!(lacks > 0.0)) continue;
        raised = true;
        Shift& shift = shifts_[k];
        const bool of_speed = Slides(modes_[k]) && tests[t].next == ContactMode::kSticking;
        if (modes_[k] == ContactMode::kOpen) {
          shift.a_n += 2.0 * lacks;
        } else if (of_speed) {
          shift.a_t += 2.0 * SlidingSign(modes_[k]) * lacks;
        } else {
          const double share =
              modes_[k] == ContactMode::kSticking ? problem_->contacts[k].friction : 1.0;
          shifts_[problem_->contacts[k].rolls ? k - 1 : k].b += 2.0 * lacks / share;
        }
      }
    }
    if (!raised) return true;
  }
  return false;
}

// Sets a contact's mode, with which its rolling friction opens and closes.
void ContactPivoting::SetMode(size_t contact, ContactMode mode, double tau) {
  const bool opens_or_closes =
      (modes_[contact] == ContactMode::kOpen) != (mode == ContactMode::kOpen);
  modes_[contact] = mode;
  const size_t next = contact + 1;
  if (!opens_or_closes || next >= modes_.size() || !problem_->contacts[next].rolls) return;
  modes_[next] = mode == ContactMode::kOpen                      ? ContactMode::kOpen
                 : !problem_->contacts[next].has_friction        ? ContactMode::kClosed
                 : Sliding(static_cast<int>(next)).At(tau) > 0.0 ? ContactMode::kSlidingPositive
                                                                 : ContactMode::kSlidingNegative;
}

void ContactPivoting::RaiseInequalities(From from) {
  const ContactProblem<double>& p = *problem_;
  double speed = 0.0;
  double impulse_scale = 0.0;
  for (int i = 0; i < 3 * p.num_bodies; ++i) {
    speed = std::max(speed, i % 3 == 2 ? 0.0 : std::abs(x_[2 * i] + x_[2 * i + 1]));
    speed = std::max(speed, i % 3 == 2 ? 0.0 : std::abs(p.load[i] / p.mass[i]));
  }
  for (size_t i = 0; i < modes_.size(); ++i) {
    impulse_scale = std::max(impulse_scale, std::abs(Impulse(static_cast<int>(i)).At(1.0)));
  }
  const auto needed = [](double have, double scale, double scatter) {
    const double slack = scatter * std::max(-have, kLeastSlack * scale);
    return std::max(0.0, slack - have);
  };
  for (size_t k = 0; k < modes_.size(); ++k) {
    const int i = static_cast<int>(k);
    Shift& shift = shifts_[k];
    const ContactMode mode = modes_[k];
    if (mode == ContactMode::kOpen) {
      const double s = Normal(i).At(1.0);
      shift.a_n += from == From::kOpen ? std::max(0.0, -s) + speed * Scatter(k, 0)
                                       : needed(s, speed, Scatter(k, 0));
      continue;
    }
    const double impulse = Impulse(i).At(1.0);
    if (Slides(mode)) {
      const double sign = SlidingSign(mode);
      shift.a_t += sign * needed(sign * Sliding(i).At(1.0), speed, Scatter(k, 1));
    } else if (p.contacts[k].rolls) {
      continue;  // TurnsAtLimit
    } else if (mode == ContactMode::kSticking) {
      const double friction = std::abs(Friction(i).At(1.0)) / p.contacts[k].friction;
      shift.b = needed(impulse - friction, impulse_scale, Scatter(k, 2));
    } else if (!p.contacts[k].limit_given) {
      shift.b = needed(impulse, impulse_scale, Scatter(k, 2));
    }
  }
}

void ContactPivoting::Extract(ContactSolution<double>* solution) const {
  const ContactProblem<double>& p = *problem_;
  const size_t nb = p.num_bodies;
  solution->modes = modes_;
  for (size_t i = 0; i < 3 * nb; ++i) {
    solution->motion[i] = x_[2 * i];
  }
  for (size_t j = 0; j < 3 * p.joints.size(); ++j) {
    solution->joint_impulse[j] = x_[2 * (3 * nb + j)];
  }
  for (size_t i = 0; i < modes_.size(); ++i) {
    solution->normal_impulse[i] = Impulse(static_cast<int>(i)).value;
    solution->tangent_impulse[i] = Friction(static_cast<int>(i)).value;
  }
}

void ContactPivoting::SetCentre(const ContactSolution<double>& solution) {
  const ContactProblem<double>& p = *problem_;
  joint_centre_ = solution.joint_impulse;
  shifts_.assign(modes_.size(), Shift());
  const double shift = regularisation_ * kCentreShift * ImpulseScale(solution.normal_impulse);
  for (size_t i = 0; i < modes_.size(); ++i) {
    // The shift of the centre by τ is written as a shift of the rows.
    const ContactBlock<double>& c = p.contacts[i];
    shifts_[i].centre_n = std::max(0.0, solution.normal_impulse[i]);
    shifts_[i].a_n = shift * Scatter(i, 0) * RowMobility(p.mass, c.a, c.normal_a, c.b, c.normal_b);
    if (c.has_friction) {
      shifts_[i].centre_t = solution.tangent_impulse[i];
      shifts_[i].a_t =
          shift * Scatter(i, 1) * RowMobility(p.mass, c.a, c.tangent_a, c.b, c.tangent_b);
    }
  }
}

// The next inequality that becomes tight; if there are several, the one that falls fastest.
ContactPivoting::Event ContactPivoting::NextEvent(double tau, double direction) const {
  Event event;
  event.distance = direction < 0.0 ? tau : HUGE_VAL;
  double steepest = 0.0;
  for (size_t i = 0; i < modes_.size(); ++i) {
    Test tests[2];
    const int count = Tests(static_cast<int>(i), tests);
    for (int k = 0; k < count; ++k) {
      const double rate = tests[k].rate * direction;
      if (!(rate < 0.0)) {
        continue;
      }
      const double distance = std::max(0.0, tests[k].At(tau)) / -rate;
      if (distance < event.distance ||
          (distance == event.distance && event.contact >= 0 && rate < steepest)) {
        event = {static_cast<int>(i), distance, tests[k].next};
        steepest = rate;
      }
    }
  }
  return event;
}

// Changes a contact's mode at τ; returns the direction in which the path goes on, 0 where the
// system has no solution.
double ContactPivoting::Pivot(int contact, ContactMode next, double tau, double direction) {
  const ContactMode before = modes_[contact];
  if (before == ContactMode::kOpen && next == ContactMode::kSticking) {
    // At λ' = 0 the sign of the sliding speed determines which side of the cone is tight.
    next = Sliding(contact).At(tau) > 0.0 ? ContactMode::kSlidingPositive
                                          : ContactMode::kSlidingNegative;
  }
  SetMode(static_cast<size_t>(contact), next, tau);
  if (!SolveSystem()) {
    return 0.0;
  }
  // The inequality that replaces the tight one grows along the path.
  Test tests[2];
  const int count = Tests(contact, tests);
  int opposite = 0;
  if (next == ContactMode::kSticking) {
    opposite = before == ContactMode::kSlidingNegative ? 0 : 1;
  } else if (before == ContactMode::kSticking) {
    opposite = count - 1;  // sliding, at speed 0
  }
  const double rate = tests[opposite].rate;
  return rate == 0.0 ? direction : rate > 0.0 ? 1.0 : -1.0;
}

bool ContactPivoting::Solve(const ContactProblem<double>& problem, From from, double regularisation,
                            int max_pivots, ContactSystem* system,
                            ContactSolution<double>* solution, int* factorisations) {
  problem_ = &problem;
  regularisation_ = regularisation;
  system_ = system;
  factorisations_ = factorisations;
  modes_ = solution->modes;
  if (from == From::kOpen) {
    modes_.assign(modes_.size(), ContactMode::kOpen);
  }
  for (size_t i = 0; i < modes_.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    if (contact.limit_given && !contact.rolls && modes_[i] == ContactMode::kOpen) {
      modes_[i] = contact.has_friction ? ContactMode::kSlidingPositive : ContactMode::kClosed;
    }
  }
  SetCentre(*solution);
  if (!Start(from)) {
    return false;
  }
  double tau = 1.0;
  double direction = -1.0;
  for (int pivot = 0; pivot <= max_pivots && direction != 0.0; ++pivot) {
    const Event event = NextEvent(tau, direction);
    if (event.contact < 0) {
      if (direction > 0.0) {
        return false;  // a ray
      }
      SizeScratch(3 * static_cast<size_t>(problem.num_bodies), &solution->motion);
      Extract(solution);
      return true;
    }
    tau += direction * event.distance;
    direction = Pivot(event.contact, event.next, tau, direction);
  }
  return false;
}

}  // namespace tangible
