// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_descent.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace {

// Sweeps of a cycle, twice as many in the second round.
constexpr int kSweeps = 10;
constexpr int kRounds = 2;
constexpr int kMaxCycles = 20;
// A round of cycles ends once sweeps change no more modes than this after a solve within the
// limits.
constexpr int kFewChanges = 1;
// Limits of solves: of all together, to which a fraction of the number of contacts is added, of a
// cycle, and of the active-set method with one δ.
constexpr int kMaxSolves = 48;
constexpr int kContactsOfSolve = 16;
constexpr int kMaxSolvesOfCycle = 4;
constexpr int kMaxSolvesOfSettling = 30;
// Shorter projected ways are not tried, but the first limit.
constexpr double kShortestWay = 0.05;
constexpr double kShortening = 0.25;
// The factors of δ after a solve within the limits, after a projected way, and after the first
// limit: its solution lies the farther away the smaller δ is.
constexpr double kFactorOfSolved = 0.5;
constexpr double kFactorOfMoved = 0.7;
constexpr double kFactorOfBlocked = 4.0;
// Contacts whose modes have been changed this often with one δ are changed one at a time, the worst
// first; one that is changed this often moves in a cycle.
constexpr int kMostChangesOfOne = 2;
constexpr int kMaxChanges = 4;

double Limited(double value, double limit) { return std::min(std::max(value, -limit), limit); }

}  // namespace

void ContactDescent::Reserve(int num_bodies, int num_joints, int num_contacts) {
  const size_t blocks = static_cast<size_t>(num_bodies) + num_joints + num_contacts;
  bilaterals_.reserve(6 * static_cast<size_t>(num_joints));
  contacts_.reserve(num_contacts);
  modes_.reserve(num_contacts);
  changes_.reserve(num_contacts);
  inverse_mass_.reserve(3 * static_cast<size_t>(num_bodies));
  v_.reserve(3 * static_cast<size_t>(num_bodies) + 3);
  momenta_.reserve(3 * static_cast<size_t>(num_bodies) + 3);
  x_.reserve(3 * blocks);
}

void ContactDescent::SetRow(int a, const RowPart<double>& row_a, int b,
                            const RowPart<double>& row_b, double constant, Row* row) const {
  const int fixed = problem_->num_bodies;
  row->a = a < 0 ? fixed : a;
  row->b = b < 0 ? fixed : b;
  row->constant = constant;
  row->mobility = 0.0;
  for (int i = 0; i < 3; ++i) {
    row->row[i] = a < 0 ? 0.0 : row_a[i];
    row->row[3 + i] = b < 0 ? 0.0 : row_b[i];
    row->scaled[i] = a < 0 ? 0.0 : row_a[i] * inverse_mass_[3 * a + i];
    row->scaled[3 + i] = b < 0 ? 0.0 : row_b[i] * inverse_mass_[3 * b + i];
    row->mobility += row->row[i] * row->scaled[i] + row->row[3 + i] * row->scaled[3 + i];
  }
}

void ContactDescent::SetRows(const ContactSolution<double>& solution) {
  const ContactProblem<double>& p = *problem_;
  SizeScratch(p.mass.size(), &inverse_mass_);
  for (size_t i = 0; i < p.mass.size(); ++i) {
    inverse_mass_[i] = 1.0 / p.mass[i];
  }
  bilaterals_.clear();
  Bilateral bilateral;
  for (size_t j = 0; j < p.joints.size(); ++j) {
    const JointBlock<double>& joint = p.joints[j];
    for (int k = 0; k < joint.rows; ++k) {
      SetRow(joint.a, joint.row_a[k], joint.b, joint.row_b[k], -joint.rhs[k], &bilateral.row);
      bilateral.compliance = 0.0;
      bilateral.impulse = solution.joint_impulse[3 * j + k];
      bilaterals_.push_back(bilateral);
    }
  }
  for (const DamperBlock<double>& damper : p.dampers) {
    if (damper.weight > 0.0) {
      SetRow(damper.a, damper.row_a, damper.b, damper.row_b, 0.0, &bilateral.row);
      bilateral.compliance = 1.0 / damper.weight;
      bilateral.impulse = 0.0;
      bilaterals_.push_back(bilateral);
    }
  }
  contacts_.resize(p.contacts.size());
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const ContactBlock<double>& c = p.contacts[i];
    Contact& contact = contacts_[i];
    SetRow(c.a, c.normal_a, c.b, c.normal_b, c.c_n, &contact.normal);
    SetRow(c.a, c.tangent_a, c.b, c.tangent_b, c.c_t, &contact.tangent);
    const bool open = solution.modes[i] == ContactMode::kOpen;
    contact.friction = c.has_friction ? c.friction : 0.0;
    contact.driven = c.driven;
    contact.normal_impulse = c.driven ? c.offset
                             : open   ? 0.0
                                      : std::max(0.0, solution.normal_impulse[i]);
    contact.tangent_impulse = Limited(open ? 0.0 : solution.tangent_impulse[i],
                                      contact.friction * contact.normal_impulse);
  }
}

double ContactDescent::Speed(const Row& row) const {
  const double* a = &v_[3 * static_cast<size_t>(row.a)];
  const double* b = &v_[3 * static_cast<size_t>(row.b)];
  return row.row[0] * a[0] + row.row[1] * a[1] + row.row[2] * a[2] + row.row[3] * b[0] +
         row.row[4] * b[1] + row.row[5] * b[2] + row.constant;
}

void ContactDescent::Push(const Row& row, double impulse) {
  double* a = &v_[3 * static_cast<size_t>(row.a)];
  double* b = &v_[3 * static_cast<size_t>(row.b)];
  for (int i = 0; i < 3; ++i) {
    a[i] += row.scaled[i] * impulse;
    b[i] += row.scaled[3 + i] * impulse;
  }
}

void ContactDescent::SetSpeeds() {
  const ContactProblem<double>& p = *problem_;
  v_.assign(p.load.size() + 3, 0.0);
  for (size_t i = 0; i < p.load.size(); ++i) {
    v_[i] = p.load[i] * inverse_mass_[i];
  }
  for (const Bilateral& bilateral : bilaterals_) {
    Push(bilateral.row, bilateral.impulse);
  }
  for (const Contact& c : contacts_) {
    Push(c.normal, c.normal_impulse);
    Push(c.tangent, c.tangent_impulse);
  }
}

// Returns how many modes differ after the sweeps.
int ContactDescent::Sweep(int count) {
  SetSpeeds();
  for (int sweep = 0; sweep < count; ++sweep) {
    for (Bilateral& b : bilaterals_) {
      const double yields = b.row.mobility + b.compliance;
      // A row that moves nothing has no impulse of its own.
      if (!(yields > 0.0)) continue;
      const double change = -(Speed(b.row) + b.compliance * b.impulse) / yields;
      b.impulse += change;
      Push(b.row, change);
    }
    const size_t n = contacts_.size();
    for (size_t k = 0; k < n; ++k) {
      Contact& c = contacts_[sweep % 2 == 0 ? k : n - 1 - k];
      if (!c.driven) {
        const double impulse =
            std::max(0.0, c.normal_impulse - Speed(c.normal) / c.normal.mobility);
        if (impulse != c.normal_impulse) {
          Push(c.normal, impulse - c.normal_impulse);
          c.normal_impulse = impulse;
        }
      }
      if (c.friction > 0.0 && (c.normal_impulse > 0.0 || c.tangent_impulse != 0.0)) {
        const double impulse = Limited(c.tangent_impulse - Speed(c.tangent) / c.tangent.mobility,
                                       c.friction * c.normal_impulse);
        Push(c.tangent, impulse - c.tangent_impulse);
        c.tangent_impulse = impulse;
      }
    }
  }
  return ReadModes();
}

// The modes of impulses at or within their limits; returns how many differ from the last ones.
int ContactDescent::ReadModes() {
  int changed = 0;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    const double limit = c.friction * c.normal_impulse;
    const ContactMode mode = !c.driven && c.normal_impulse == 0.0 ? ContactMode::kOpen
                             : c.friction == 0.0                  ? ContactMode::kClosed
                             : c.tangent_impulse >= limit         ? ContactMode::kSlidingNegative
                             : c.tangent_impulse <= -limit        ? ContactMode::kSlidingPositive
                                                                  : ContactMode::kSticking;
    changed += mode != modes_[i] ? 1 : 0;
    modes_[i] = mode;
  }
  return changed;
}

// Solves for the present modes; false where the solution is not finite.
bool ContactDescent::SolveSubspace(double delta) {
  const ContactProblem<double>& p = *problem_;
  ++*factorisations_;
  --solves_left_;
  if (!system_->Factor(p, modes_, delta)) {
    return false;
  }
  const std::vector<int>& block_of = system_->contact_block();
  const std::vector<double>& regularisation = system_->regularisation();
  x_.assign(3 * static_cast<size_t>(system_->num_blocks()), 0.0);
  std::copy(p.load.begin(), p.load.end(), x_.begin());
  size_t bilateral = 0;
  for (size_t j = 0; j < p.joints.size(); ++j) {
    for (int r = 0; r < p.joints[j].rows; ++r, ++bilateral) {
      const size_t row = 3 * (static_cast<size_t>(p.num_bodies) + j) + r;
      x_[row] = p.joints[j].rhs[r] + regularisation[row] * bilaterals_[bilateral].impulse;
    }
  }
  for (size_t i = 0; i < modes_.size(); ++i) {
    if (block_of[i] < 0) {
      continue;
    }
    const ContactBlock<double>& c = p.contacts[i];
    const size_t row = 3 * static_cast<size_t>(block_of[i]);
    x_[row] = c.driven ? c.offset : regularisation[row] * contacts_[i].normal_impulse - c.c_n;
    if (modes_[i] == ContactMode::kSticking) {
      x_[row + 1] = regularisation[row + 1] * contacts_[i].tangent_impulse - c.c_t;
    }
  }
  if (delta > kUnrefined) {
    system_->SolveUnrefined(p, modes_, x_.data(), 1);
  } else {
    system_->SolveRegularised(p, modes_, x_.data(), 1);
  }
  for (size_t i = 0; i < modes_.size(); ++i) {
    Contact& c = contacts_[i];
    c.normal_target = c.tangent_target = 0.0;
    if (block_of[i] >= 0) {
      const double* lambda = &x_[3 * static_cast<size_t>(block_of[i])];
      c.normal_target = lambda[0];
      c.tangent_target = modes_[i] == ContactMode::kSticking
                             ? lambda[1]
                             : -SlidingSign(modes_[i]) * c.friction * lambda[0];
    }
  }
  return std::all_of(x_.begin(), x_.end(), [](double x) { return std::isfinite(x); });
}

// The fraction of the way to the target at which the first impulse reaches its limit, at most 1.
double ContactDescent::FirstLimit(int* contact, ContactMode* next) const {
  double first = 1.0;
  *contact = -1;
  const auto reaches = [&](size_t i, double from, double to, ContactMode beyond) {
    from = std::max(0.0, from);
    if (to < 0.0 && from < first * (from - to)) {
      first = from / (from - to);
      *contact = static_cast<int>(i);
      *next = beyond;
    }
  };
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    if (modes_[i] == ContactMode::kSticking) {
      const double from = c.friction * c.normal_impulse;
      const double to = c.friction * c.normal_target;
      reaches(i, from - c.tangent_impulse, to - c.tangent_target, ContactMode::kSlidingNegative);
      reaches(i, from + c.tangent_impulse, to + c.tangent_target, ContactMode::kSlidingPositive);
    } else if (modes_[i] != ContactMode::kOpen && !c.driven) {
      reaches(i, c.normal_impulse, c.normal_target, ContactMode::kOpen);
    }
  }
  return first;
}

// q at the projected point of the way to the target.
double ContactDescent::Objective(double alpha) const {
  const ContactProblem<double>& p = *problem_;
  momenta_.assign(p.load.begin(), p.load.end());
  momenta_.resize(p.load.size() + 3, 0.0);
  double q = 0.0;
  const auto push = [&](const Row& row, double impulse) {
    q += row.constant * impulse;
    for (int i = 0; i < 3; ++i) {
      momenta_[3 * static_cast<size_t>(row.a) + i] += row.row[i] * impulse;
      momenta_[3 * static_cast<size_t>(row.b) + i] += row.row[3 + i] * impulse;
    }
  };
  for (const Bilateral& b : bilaterals_) {
    push(b.row, b.impulse);
    q += 0.5 * b.compliance * b.impulse * b.impulse;
  }
  for (const Contact& c : contacts_) {
    const double normal =
        std::max(0.0, c.normal_impulse + alpha * (c.normal_target - c.normal_impulse));
    push(c.normal, normal);
    push(c.tangent, Limited(c.tangent_impulse + alpha * (c.tangent_target - c.tangent_impulse),
                            c.friction * normal));
  }
  for (size_t i = 0; i < p.load.size(); ++i) {
    q += 0.5 * momenta_[i] * momenta_[i] * inverse_mass_[i];
  }
  return q;
}

void ContactDescent::Move(double alpha) {
  for (Contact& c : contacts_) {
    c.normal_impulse =
        std::max(0.0, c.normal_impulse + alpha * (c.normal_target - c.normal_impulse));
    c.tangent_impulse = Limited(c.tangent_impulse + alpha * (c.tangent_target - c.tangent_impulse),
                                c.friction * c.normal_impulse);
  }
}

// Joints and dampers have no limits: their impulses become those of the solution at once.
void ContactDescent::TakeBilaterals() {
  const ContactProblem<double>& p = *problem_;
  size_t bilateral = 0;
  for (size_t j = 0; j < p.joints.size(); ++j) {
    for (int r = 0; r < p.joints[j].rows; ++r, ++bilateral) {
      bilaterals_[bilateral].impulse = x_[3 * (static_cast<size_t>(p.num_bodies) + j) + r];
    }
  }
  for (; bilateral < bilaterals_.size(); ++bilateral) {
    Bilateral& damper = bilaterals_[bilateral];
    double speed = 0.0;
    for (int i = 0; i < 3; ++i) {
      speed += damper.row.a < p.num_bodies ? damper.row.row[i] * x_[3 * damper.row.a + i] : 0.0;
      speed += damper.row.b < p.num_bodies ? damper.row.row[3 + i] * x_[3 * damper.row.b + i] : 0.0;
    }
    damper.impulse = -speed / damper.compliance;
  }
}

ContactDescent::Outcome ContactDescent::Subspace(double delta) {
  if (!SolveSubspace(delta)) {
    return Outcome::kFailed;
  }
  TakeBilaterals();
  int blocking = -1;
  ContactMode next = ContactMode::kOpen;
  const double limit = FirstLimit(&blocking, &next);
  if (blocking < 0) {
    Move(1.0);
    return Outcome::kSolved;
  }
  const double before = Objective(0.0);
  for (double alpha = 1.0; alpha > std::max(limit, kShortestWay); alpha *= kShortening) {
    if (Objective(alpha) <= before) {
      Move(alpha);
      return Outcome::kMoved;
    }
  }
  Move(limit);
  modes_[blocking] = next;
  return Outcome::kBlocked;
}

// Changes modes that the speeds of the solved modes contradict; returns how many, −1 where that
// goes in a cycle.
int ContactDescent::ChangeContradicted(double delta) {
  const ContactProblem<double>& p = *problem_;
  v_.assign(x_.begin(), x_.begin() + 3 * static_cast<std::ptrdiff_t>(p.num_bodies));
  v_.resize(p.load.size() + 3, 0.0);
  double speed = 0.0;
  for (size_t i = 0; i < p.load.size(); ++i) {
    if (i % 3 != 2)
      speed = std::max({speed, std::abs(v_[i]), std::abs(p.load[i] * inverse_mass_[i])});
  }
  const double rounding = (delta > kUnrefined ? kSolveRounding / delta : kModeTolerance) * speed;
  int changed = 0;
  double worst = 0.0;
  int worst_contact = -1;
  ContactMode worst_mode = ContactMode::kOpen;
  for (size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    double violation = 0.0;
    ContactMode next = modes_[i];
    if (modes_[i] == ContactMode::kOpen) {
      violation = -Speed(c.normal);
      const double slip = Speed(c.tangent);
      next = c.friction == 0.0 ? ContactMode::kClosed
             : std::abs(slip) / c.tangent.mobility <= c.friction * violation / c.normal.mobility
                 ? ContactMode::kSticking
             : slip > 0.0 ? ContactMode::kSlidingPositive
                          : ContactMode::kSlidingNegative;
    } else if (SlidingSign(modes_[i]) != 0.0) {
      violation = -SlidingSign(modes_[i]) * Speed(c.tangent);
      next = ContactMode::kSticking;
    }
    if (violation <= std::max(rounding, p.contacts[i].rounding)) {
      continue;
    }
    ++changed;
    if (changes_[i] < kMostChangesOfOne) {
      ++changes_[i];
      modes_[i] = next;
    } else if (violation > worst) {
      worst = violation;
      worst_contact = static_cast<int>(i);
      worst_mode = next;
    }
  }
  if (worst_contact >= 0) {
    modes_[worst_contact] = worst_mode;
    if (++changes_[worst_contact] == kMaxChanges) {
      return -1;
    }
  }
  return changed;
}

// The active-set method with one δ.
bool ContactDescent::Settle(double delta) {
  changes_.assign(contacts_.size(), 0);
  for (int k = 0; k < kMaxSolvesOfSettling && solves_left_ > 0; ++k) {
    const Outcome outcome = Subspace(delta);
    if (outcome == Outcome::kFailed) {
      return false;
    }
    if (outcome == Outcome::kMoved) {
      ReadModes();
    } else if (outcome == Outcome::kSolved) {
      const int changed = ChangeContradicted(delta);
      if (changed <= 0) {
        return changed == 0;
      }
    }
  }
  return false;
}

// Cycles of sweeps and subspace solves, until sweeps hardly change a mode.
bool ContactDescent::Descend(int sweeps) {
  double delta = kDescentRegularisation;
  Outcome outcome = Outcome::kMoved;
  for (int cycle = 0; cycle < kMaxCycles && solves_left_ > 0; ++cycle) {
    if (Sweep(sweeps) <= kFewChanges && outcome == Outcome::kSolved) {
      break;
    }
    outcome = Outcome::kBlocked;
    for (int k = 0; k < kMaxSolvesOfCycle && outcome == Outcome::kBlocked; ++k) {
      outcome = Subspace(delta);
    }
    if (outcome == Outcome::kFailed) {
      return false;
    }
    delta =
        std::min(kDescentRegularisation, delta * (outcome == Outcome::kSolved  ? kFactorOfSolved
                                                  : outcome == Outcome::kMoved ? kFactorOfMoved
                                                                               : kFactorOfBlocked));
  }
  return true;
}

bool ContactDescent::Solve(const ContactProblem<double>& problem, ContactSystem* system,
                           ContactSolution<double>* solution, int* factorisations) {
  problem_ = &problem;
  system_ = system;
  factorisations_ = factorisations;
  solves_left_ = kMaxSolves + static_cast<int>(problem.contacts.size()) / kContactsOfSolve;
  modes_.assign(solution->modes.begin(), solution->modes.end());
  SetRows(*solution);
  bool settled = false;
  for (int round = 0; round < kRounds && !settled && solves_left_ > 0; ++round) {
    settled = Descend(kSweeps << round);
    for (const double delta : kSettlingRegularisation) {
      settled = settled && Settle(delta);
    }
  }
  solution->modes.assign(modes_.begin(), modes_.end());
  for (size_t i = 0; i < contacts_.size(); ++i) {
    solution->normal_impulse[i] = contacts_[i].normal_impulse;
    solution->tangent_impulse[i] = contacts_[i].tangent_impulse;
  }
  size_t bilateral = 0;
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    for (int r = 0; r < problem.joints[j].rows; ++r, ++bilateral) {
      solution->joint_impulse[3 * j + r] = bilaterals_[bilateral].impulse;
    }
  }
  return settled;
}

}  // namespace tangible
