// SPDX-License-Identifier: Apache-2.0
//
// Rolling friction, whose limit ρ λn is known only with the solution. All methods see problems with
// given limits; they are solved for limits that follow the normal impulses of the last solution,
//
//   λn ← λn(limits ρ λn),
//
// until the modes found, or modes near them, also solve the problem itself, whose mode system has
// the torque at its limit as a part of λn's column: then the solution is exact and not the limit of
// an iteration. A torque changes normal impulses only through other contacts and joints, mostly by
// a small share, so that two rounds are the rule. In a crowd the iteration may turn in circles:
// then pivots on the problem itself follow.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tangible/lcp/contact/contact_mode_change.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {
namespace {

constexpr int kMostRollingRounds = 60;
// Rounds of mode changes in the problem itself, and how many of a contact are made beside others.
constexpr int kMostModeRounds = 20;
constexpr int kMostChangesTogether = 3;
// Pivots a contact, proximal steps that follow them, and after how many rounds they are tried again
// over other shifts.
constexpr int kPivotsOfWhole = 20;
constexpr int kMostPivotRounds = 6;
constexpr int kPivotEvery = 4;
// Where two limits follow each other in turns, the mean of both is tried from this round on; every
// so many rounds half of the change is left out once more.
constexpr int kFirstMeanRound = 3;
constexpr int kRoundsOfShare = 14;

// The block of rolling friction with the limit of given normal impulses, and a mode that fits it: a
// contact without load has no friction.
void GiveLimit(const ContactBlock<double>& whole, double normal, ContactBlock<double>* block,
               ContactMode* mode) {
  block->rolls = false;
  block->offset = std::max(0.0, normal);
  block->has_friction = whole.has_friction && block->offset > 0.0;
  if (!block->has_friction) {
    *mode = ContactMode::kClosed;
  } else if (*mode == ContactMode::kClosed || *mode == ContactMode::kOpen) {
    *mode = ContactMode::kSticking;
  }
}

// The mode of rolling friction in the whole problem. It holds where no motion is known (v is null),
// as at the start.
ContactMode WholeMode(const ContactProblem<double>& problem, size_t i, ContactMode mode,
                      ContactMode of_contact, const double* v) {
  const ContactBlock<double>& c = problem.contacts[i];
  if (of_contact == ContactMode::kOpen) return ContactMode::kOpen;
  if (!c.has_friction) return ContactMode::kClosed;
  if (mode != ContactMode::kClosed) return mode;
  if (v == nullptr) return ContactMode::kSticking;
  return RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) + c.c_t < 0.0
             ? ContactMode::kSlidingNegative
             : ContactMode::kSlidingPositive;
}

// Whether a guess has the loads of its rolling friction; one of zeros knows no directions.
bool StartsLoaded(const ContactProblem<double>& problem, const ContactSolution<double>& guess) {
  for (size_t i = 1; i < problem.contacts.size(); ++i) {
    if (problem.contacts[i].rolls && guess.modes[i - 1] != ContactMode::kOpen &&
        !(guess.normal_impulse[i - 1] > 0.0)) {
      return false;
    }
  }
  return true;
}

// Whether all rolling friction that was given no limit has no load in the solution either. Its
// direction is not known otherwise: a body that rests would be taken for one that turns.
bool FollowsLoads(const ContactProblem<double>& problem, const ContactProblem<double>& given,
                  const ContactSolution<double>& solution) {
  for (size_t i = 1; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& block = problem.contacts[i];
    if (block.rolls && block.has_friction && !(given.contacts[i].offset > 0.0) &&
        solution.normal_impulse[i - 1] > 0.0) {
      return false;
    }
  }
  return true;
}

}  // namespace

void ContactSolver::StartWhole(const ContactProblem<double>& problem,
                               const ContactSolution<double>& solution) {
  rolled_ = solution;
  const bool knows_motion = solution.motion.size() == problem.load.size();
  const double* const v = knows_motion ? solution.motion.data() : nullptr;
  for (size_t i = 1; i < problem.contacts.size(); ++i) {
    if (!problem.contacts[i].rolls) continue;
    rolled_.modes[i] = WholeMode(problem, i, solution.modes[i], solution.modes[i - 1], v);
    rolled_.normal_impulse[i] = rolled_.normal_impulse[i - 1];
  }
  whole_ = problem;
}

bool ContactSolver::SettleWhole(const ContactSolverOptions& options,
                                ContactSolution<double>* solution, ContactSolverReport* report) {
  changes_.assign(whole_.contacts.size(), 0);
  SetCentre(rolled_);
  for (int round = 0; round < kMostModeRounds; ++round) {
    if (!SolveWithModes(whole_, &rolled_, report)) return false;
    TakeRollingLimits(rolled_, &whole_);
    if (ChangeRollingModes(options)) continue;
    report->residual =
        BalancedResidual(whole_, options.tolerance, &rolled_, &report->worst_contact);
    if (!(report->residual <= options.tolerance)) return false;
    std::swap(*solution, rolled_);
    return true;
  }
  return false;
}

bool ContactSolver::PivotWhole(const ContactProblem<double>& problem,
                               const ContactSolverOptions& options, ContactPivoting::From from,
                               ContactSolution<double>* solution, ContactSolverReport* report) {
  StartWhole(problem, *solution);
  ++report->fallbacks.pivoting;
  double regularisation = kFirstRegularisation;
  const int most = kPivotsOfWhole * (1 + static_cast<int>(problem.contacts.size()));
  for (int round = 0; round < kMostPivotRounds; ++round) {
    if (!pivoting_.Solve(whole_, round == 0 ? from : ContactPivoting::From::kModes, regularisation,
                         most, &system_, &rolled_, &report->factorisations)) {
      return false;
    }
    trial_ = rolled_;
    if (SettleWhole(options, solution, report)) return true;
    std::swap(rolled_, trial_);
    regularisation = std::max(kLeastRegularisation, 0.1 * regularisation);
  }
  return false;
}

bool ContactSolver::ChangeRollingModes(const ContactSolverOptions& options) {
  scales_.Compute(whole_, rolled_);
  bool changed = false;
  int worst = -1;
  ModeChange worst_change{ContactMode::kOpen};
  const auto change = [&](size_t i, ContactMode mode) {
    changed = true;
    rolled_.modes[i] = mode;
    if (i + 1 >= rolled_.modes.size() || !whole_.contacts[i + 1].rolls) return;
    // Rolling friction opens and closes with its contact.
    ContactMode& of_rolling = rolled_.modes[i + 1];
    if (mode == ContactMode::kOpen || of_rolling == ContactMode::kOpen) {
      of_rolling = WholeMode(whole_, i + 1, ContactMode::kClosed, mode, rolled_.motion.data());
    }
  };
  for (size_t i = 0; i < whole_.contacts.size(); ++i) {
    const ContactBlock<double>& c = whole_.contacts[i];
    if (c.rolls && (rolled_.modes[i] == ContactMode::kOpen || c.offset <= 0.0)) continue;
    const ContactValues values = Evaluate(whole_, scales_, c, rolled_.motion.data());
    const ModeChange found =
        Contradiction(c, values, rolled_.modes[i], rolled_.normal_impulse[i],
                      rolled_.tangent_impulse[i], scales_.impulse, options.tolerance);
    if (found.violation == 0.0) continue;
    if (changes_[i] < kMostChangesTogether) {
      ++changes_[i];
      change(i, found.mode);
    } else if (found.violation > worst_change.violation) {
      worst = static_cast<int>(i);
      worst_change = found;
    }
  }
  if (worst >= 0) change(static_cast<size_t>(worst), worst_change.mode);
  return changed;
}

ContactSolverReport ContactSolver::SolveRolling(const ContactProblem<double>& problem,
                                                const ContactSolverOptions& options,
                                                ContactSolution<double>* solution) {
  ContactSolverReport all;
  // The last step's modes are mostly right, or nearly.
  StartWhole(problem, *solution);
  all.rung = Rung::kModeChanges;
  all.solved = StartsLoaded(problem, *solution) && SettleWhole(options, solution, &all);
  if (all.solved) return all;
  for (int round = 0; round < kMostRollingRounds; ++round) {
    given_ = problem;
    given_.has_rolling = false;
    const double share = round < kFirstMeanRound
                             ? 1.0
                             : std::ldexp(0.5, -(round - kFirstMeanRound) / kRoundsOfShare);
    loads_.resize(problem.contacts.size());
    for (size_t i = 1; i < given_.contacts.size(); ++i) {
      if (!problem.contacts[i].rolls) continue;
      const double load = std::max(0.0, solution->normal_impulse[i - 1]);
      loads_[i] = share == 1.0 ? load : loads_[i] + share * (load - loads_[i]);
      GiveLimit(problem.contacts[i], loads_[i], &given_.contacts[i], &solution->modes[i]);
    }
    const ContactSolverReport report = RunPortfolio(given_, options, solution);
    all.factorisations += report.factorisations;
    all.iterations += report.iterations;
    all.fallbacks.Add(report.fallbacks);
    all.rung = std::max(all.rung, report.rung);
    all.residual = report.residual;
    all.worst_contact = report.worst_contact;
    if (!report.solved) break;
    if (!FollowsLoads(problem, given_, *solution)) continue;
    StartWhole(problem, *solution);
    all.solved = SettleWhole(options, solution, &all);
    if (!all.solved && round >= kFirstMeanRound && (round - kFirstMeanRound) % kPivotEvery == 0) {
      pivoting_.SetScatter(static_cast<std::uint64_t>(round - kFirstMeanRound));
      all.solved = PivotWhole(problem, options, ContactPivoting::From::kModes, solution, &all) ||
                   PivotWhole(problem, options, ContactPivoting::From::kOpen, solution, &all);
      pivoting_.SetScatter(0);
    }
    if (all.solved) return all;
  }
  all.rung = Rung::kNone;
  return all;
}

}  // namespace tangible
