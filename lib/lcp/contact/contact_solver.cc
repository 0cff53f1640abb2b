// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tangible/lcp/contact/contact_mode_change.h"
#include "tangible/lcp/contact/tolerances.h"

namespace tangible {
namespace {

constexpr int kMaxRounds = 20;
// If more modes are contradicted than in the round before, and more than this, mode changes are
// given up.
constexpr int kFewContradicted = 2;
// Limits of pivots: from the guess (to which half the number of contacts is added), and as
// multiples of the number of contacts.
constexpr int kPivotsFromGuess = 40;
constexpr int kPivotsFromInteriorPoint = 2;
constexpr int kPivotsFromOpen = 20;
// Up to this many contacts the first attempts of the dense portfolio take milliseconds.
constexpr size_t kFewContacts = 20;
// Maximum number of proximal steps at a path's end.
constexpr int kMaxProximalRounds = 40;
// Contacts whose modes have been changed this often are changed one at a time, the worst first.
constexpr int kMaxChangesTogether = 3;
// From this number of contacts on a guess of which more than a few impulses are beyond their limits
// is given up for a descent. With fewer contacts pivots are as fast.
constexpr size_t kLeastContactsOfDescent = 12;
constexpr int kFewBeyond = 4;

}  // namespace

const char* NameOf(Rung rung) {
  switch (rung) {
    case Rung::kDirect:
      return "direct";
    case Rung::kModeChanges:
      return "mode_changes";
    case Rung::kDescent:
      return "descent";
    case Rung::kPivotingFromDescent:
      return "pivoting_from_descent";
    case Rung::kPivotingFromGuess:
      return "pivoting_from_guess";
    case Rung::kInteriorPoint:
      return "interior_point";
    case Rung::kPivotingFromInteriorPoint:
      return "pivoting_from_interior_point";
    case Rung::kPivotingFromOpen:
      return "pivoting_from_open";
    case Rung::kRestarts:
      return "restarts";
    case Rung::kDense:
      return "dense";
    case Rung::kLemke:
      return "lemke";
    case Rung::kNone:
      break;
  }
  return "none";
}

void ContactFallbacks::Add(const ContactFallbacks& other) {
  pivoting += other.pivoting;
  interior_point += other.interior_point;
  lemke += other.lemke;
  dense += other.dense;
  restarts += other.restarts;
  extrapolation += other.extrapolation;
  regularised += other.regularised;
  whole_system += other.whole_system;
  islands_together += other.islands_together;
}

void ContactSolver::Reserve(int num_bodies, int num_joints, int num_contacts) {
  const int blocks = num_bodies + num_joints + num_contacts;
  const int edges = 2 * (num_joints + num_contacts) + num_joints;
  system_.Reserve(blocks, edges);
  interior_point_.lu.Reserve(blocks, edges);
  descent_.Reserve(num_bodies, num_joints, num_contacts);
  pivoting_.Reserve(blocks, num_contacts);
  interior_point_.edges.reserve(edges);
  for (std::vector<double>* x :
       {&interior_point_.v, &interior_point_.y, &interior_point_.z, &interior_point_.s,
        &interior_point_.step, &interior_point_.affine, &interior_point_.ds,
        &interior_point_.ds_affine, &interior_point_.target, &interior_point_.residual,
        &interior_point_.unit_z, &interior_point_.unit_s, &interior_point_.rhs,
        &interior_point_.correction}) {
    x->reserve(3 * blocks);
  }
  mode_solve_.Reserve(3 * static_cast<size_t>(blocks));
  for (ContactSolution<double>* solution : {&trial_, &entry_, &last_, &centre_}) {
    solution->motion.reserve(3 * num_bodies);
    solution->joint_impulse.reserve(3 * num_joints);
    solution->normal_impulse.reserve(num_contacts);
    solution->tangent_impulse.reserve(num_contacts);
    solution->modes.reserve(num_contacts);
  }
  changes_.reserve(num_contacts);
  scales_.speed.reserve(num_bodies);
  scales_.lever.reserve(num_bodies);
}

void ContactSolver::SetCentre(const ContactSolution<double>& solution) {
  centre_.joint_impulse = solution.joint_impulse;
  centre_.normal_impulse = solution.normal_impulse;
  centre_.tangent_impulse = solution.tangent_impulse;
}

bool ContactSolver::SolveWithModes(const ContactProblem<double>& problem,
                                   ContactSolution<double>* solution, ContactSolverReport* report,
                                   int most_beyond) {
  ++report->factorisations;
  // The solve starts from the last impulses where impulses may not be unique.
  const auto open = std::count(solution->modes.begin(), solution->modes.end(), ContactMode::kOpen);
  const bool choice = static_cast<long>(solution->modes.size()) - open > 1 ||
                      (problem.redundant_joints && !problem.joints.empty());
  return mode_solve_.Solve(problem, choice ? &centre_ : nullptr, &system_, solution, most_beyond);
}

bool ContactSolver::SolveByModeChanges(const ContactProblem<double>& problem,
                                       const ContactSolverOptions& options,
                                       ContactSolution<double>* solution,
                                       ContactSolverReport* report, int most_beyond) {
  const size_t num_contacts = problem.contacts.size();
  changes_.assign(num_contacts, 0);
  SetCentre(*solution);
  int last_contradicted = static_cast<int>(num_contacts);
  double last_residual = HUGE_VAL;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!SolveWithModes(problem, solution, report, most_beyond)) {
      return false;
    }
    scales_.Compute(problem, *solution);
    int contradicted = 0;
    int worst = -1;
    ModeChange worst_change{ContactMode::kOpen};
    for (size_t i = 0; i < num_contacts; ++i) {
      const ContactValues values =
          Evaluate(problem, scales_, problem.contacts[i], solution->motion.data());
      const ModeChange change = Contradiction(
          problem.contacts[i], values, solution->modes[i], solution->normal_impulse[i],
          solution->tangent_impulse[i], scales_.impulse, options.tolerance);
      if (change.violation == 0.0) {
        continue;
      }
      ++contradicted;
      if (changes_[i] < kMaxChangesTogether) {
        ++changes_[i];
        solution->modes[i] = change.mode;
      } else if (change.violation > worst_change.violation) {
        worst = static_cast<int>(i);
        worst_change = change;
      }
    }
    if (worst >= 0) {
      ++changes_[worst];
      solution->modes[worst] = worst_change.mode;
    }
    if (contradicted == 0) {
      report->residual =
          BalancedResidual(problem, options.tolerance, solution, &report->worst_contact);
      if (report->residual <= options.tolerance) {
        return true;
      }
      if (report->residual > 0.5 * last_residual) {
        return false;
      }
      last_residual = report->residual;
      SetCentre(*solution);  // another proximal step removes the effect of δ
    } else if (contradicted > std::max(last_contradicted, kFewContradicted)) {
      return false;  // too many changes: pivoting changes one at a time
    }
    last_contradicted = contradicted > 0 ? contradicted : static_cast<int>(num_contacts);
  }
  return false;
}

bool ContactSolver::SolveByDescent(const ContactProblem<double>& problem,
                                   const ContactSolverOptions& options,
                                   ContactSolution<double>* solution, ContactSolverReport* report) {
  *solution = entry_;
  descent_.Solve(problem, &system_, solution, &report->factorisations);
  trial_ = *solution;
  report->rung = Rung::kDescent;
  if (SolveByModeChanges(problem, options, &trial_, report)) {
    std::swap(*solution, trial_);
    return true;
  }
  ++report->fallbacks.pivoting;
  report->rung = Rung::kPivotingFromDescent;
  return SolveByPivoting(problem, options, ContactPivoting::From::kModes, kPivotsFromGuess,
                         kMaxProximalRounds, solution, report);
}

bool ContactSolver::Polish(const ContactProblem<double>& problem,
                           const ContactSolverOptions& options, ContactSolution<double>* solution,
                           ContactSolverReport* report) {
  const std::vector<ContactMode> given = solution->modes;
  bool polished = false;
  int worst = -1;
  double before = NaturalResidual(problem, *solution, &worst);
  // The first round may show that the mode of a row near its limit was wrong; two more rounds
  // correct it or give up.
  for (int round = 0; round < 3; ++round) {
    trial_ = *solution;
    SetCentre(*solution);
    if (!SolveWithModes(problem, &trial_, report)) {
      break;
    }
    int trial_worst = -1;
    const double after = BalancedResidual(problem, options.tolerance, &trial_, &trial_worst);
    if (after <= before || after <= 0.01 * options.tolerance) {
      *solution = trial_;
      before = after;
      worst = trial_worst;
      polished = true;
      break;
    }
    scales_.Compute(problem, trial_);
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      const ContactValues values =
          Evaluate(problem, scales_, problem.contacts[i], trial_.motion.data());
      solution->modes[i] =
          Contradiction(problem.contacts[i], values, trial_.modes[i], trial_.normal_impulse[i],
                        trial_.tangent_impulse[i], scales_.impulse, options.tolerance)
              .mode;
    }
  }
  report->residual = before;
  report->worst_contact = worst;
  if (polished || before > options.tolerance) {
    return before <= options.tolerance;
  }
  // The given solution was good enough. The attempts have left another system and other modes
  // behind; the derivative needs those of the solution.
  solution->modes = given;
  ++report->factorisations;
  return system_.Factor(problem, given);
}

bool ContactSolver::SolveByInteriorPoint(const ContactProblem<double>& problem,
                                         const ContactSolverOptions& options,
                                         ContactSolution<double>* solution,
                                         ContactSolverReport* report) {
  ContactInteriorPointOptions interior_point;
  interior_point.max_iterations = options.max_iterations;
  // Most modes can be read early. Where margins are small the modes become visible later, if
  // rounding lets the iteration go on.
  for (const double goal : kInteriorPointGoals) {
    interior_point.complementarity = goal;
    // At the end the steps are small, and the error of the proximal term in the equations must
    // vanish.
    interior_point.proximal = goal < kContactComplementarity ? kLastProximal : kProximal;
    const InteriorPointOutcome outcome =
        SolveContactsByInteriorPoint(problem, interior_point, &interior_point_, solution);
    report->iterations += outcome.iterations;
    if (Polish(problem, options, solution, report)) {
      report->rung = Rung::kInteriorPoint;
      return true;
    }
    if (outcome.complementarity > kNotArrived) {
      break;  // not converged, and more iterations would not help
    }
    interior_point.resume = true;
  }
  // Where rows are almost redundant only pivots can determine the modes.
  ++report->fallbacks.pivoting;
  report->rung = Rung::kPivotingFromInteriorPoint;
  return SolveByPivoting(problem, options, ContactPivoting::From::kModes,
                         kPivotsFromInteriorPoint * (1 + static_cast<int>(problem.contacts.size())),
                         kMaxProximalRounds, solution, report);
}

void ContactSolver::MeasureWithoutContacts(const ContactProblem<double>& problem,
                                           ContactSolution<double>* solution,
                                           ContactSolverReport* report) {
  solution->modes.assign(problem.contacts.size(), ContactMode::kOpen);
  solution->normal_impulse.assign(problem.contacts.size(), 0.0);
  solution->tangent_impulse.assign(problem.contacts.size(), 0.0);
  if (!SolveWithModes(problem, solution, report)) {
    solution->motion.resize(problem.load.size());
    for (size_t i = 0; i < solution->motion.size(); ++i) {
      solution->motion[i] = problem.load[i] / problem.mass[i];
    }
    solution->joint_impulse.assign(3 * problem.joints.size(), 0.0);
  }
  report->residual = NaturalResidual(problem, *solution, &report->worst_contact);
}

bool ContactSolver::SolveByLemke(const ContactProblem<double>& problem,
                                 const ContactSolverOptions& options,
                                 ContactSolution<double>* solution, ContactSolverReport* report) {
  int iterations = 0;
  if (options.choice == SolverChoice::kLemke) {
    const bool by_lemke = SolveContactsByLemke(problem, solution, &iterations);
    report->iterations += iterations;
    if (!by_lemke) {
      MeasureWithoutContacts(problem, solution, report);
      return false;
    }
    report->rung = Rung::kLemke;
    return Polish(problem, options, solution, report);
  }
  const auto by_dense = [&] {
    if (!FitsDensePortfolio(problem)) {
      return false;
    }
    ++report->fallbacks.dense;
    report->rung = Rung::kDense;
    const bool dense = SolveContactsDense(problem, options, solution, &iterations);
    report->iterations += iterations;
    return dense && Polish(problem, options, solution, report);
  };
  const auto by_restarts = [&] {
    report->rung = Rung::kRestarts;
    return SolveByRestarts(problem, options, solution, report);
  };
  if (!options.last_resort) return problem.contacts.size() <= kFewContacts && by_dense();
  // The cheaper method comes first.
  return problem.contacts.size() <= kFewContacts ? by_dense() || by_restarts()
                                                 : by_restarts() || by_dense();
}

namespace {

// Opens the contacts by which what cannot move presses a body from both sides, those of the side
// that presses less, or of both; whether there are any.
bool OpenSqueezed(const ContactProblem<double>& problem, ContactSolution<double>* solution) {
  const auto presses = [&](size_t i) {
    const ContactBlock<double>& c = problem.contacts[i];
    return !c.limit_given && (c.a < 0) != (c.b < 0) && solution->modes[i] != ContactMode::kOpen &&
           solution->normal_impulse[i] > 0.0;
  };
  const auto body = [&](size_t i) {
    return std::max(problem.contacts[i].a, problem.contacts[i].b);
  };
  const auto normal = [&](size_t i) {
    const ContactBlock<double>& c = problem.contacts[i];
    return c.a < 0 ? c.normal_b : c.normal_a;
  };
  const size_t size = problem.contacts.size();
  std::vector<size_t> opened;
  for (size_t i = 0; i < size; ++i) {
    if (!presses(i)) continue;
    double own = 0.0, against = 0.0;
    for (size_t k = 0; k < size; ++k) {
      if (!presses(k) || body(k) != body(i)) continue;
      const double cosine = normal(i)[0] * normal(k)[0] + normal(i)[1] * normal(k)[1];
      if (cosine > kSameSide) own += solution->normal_impulse[k];
      if (cosine < -kSameSide) against += solution->normal_impulse[k];
    }
    if (against > 0.0 && own <= against * (1.0 + kSqueezeMatters)) opened.push_back(i);
  }
  for (const size_t i : opened) solution->modes[i] = ContactMode::kOpen;
  return !opened.empty();
}

double SumOf(const std::vector<double>& impulses) {
  return std::accumulate(impulses.begin(), impulses.end(), 0.0);
}

}  // namespace

// Both faces of a slot may press on the body between them by any equal impulses. Those of the last
// step would go on for ever, and friction with them, after the load that caused them has ended; or
// places that are rounded would cause them. Takes the solution with the least that is found.
void ContactSolver::ReleaseSqueeze(const ContactProblem<double>& problem,
                                   const ContactSolverOptions& options,
                                   ContactSolution<double>* solution, ContactSolverReport* report) {
  if (!system_.is_regularised()) return;
  int sliding = 0;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    sliding += SlidingSign(solution->modes[i]) != 0.0 && solution->normal_impulse[i] != 0.0 ? 1 : 0;
  }
  const auto without_centre = [&] {
    for (std::vector<double>* impulses :
         {&centre_.joint_impulse, &centre_.normal_impulse, &centre_.tangent_impulse}) {
      std::fill(impulses->begin(), impulses->end(), 0.0);
    }
  };
  const auto is_better = [&] {
    scales_.Compute(problem, *solution);
    bool differs = false;
    for (size_t k = 0; k < trial_.motion.size(); ++k) {
      const double speed = scales_.speed[k / 3];
      const double scale = k % 3 == 2 ? speed / scales_.lever[k / 3] : speed;
      differs =
          differs || std::abs(trial_.motion[k] - solution->motion[k]) > kSqueezeMatters * scale;
    }
    if (!differs || SumOf(trial_.normal_impulse) > SumOf(solution->normal_impulse)) return false;
    int worst = -1;
    const double residual = BalancedResidual(problem, options.tolerance, &trial_, &worst);
    if (!(residual <= options.tolerance)) return false;
    std::swap(*solution, trial_);
    report->residual = residual;
    report->worst_contact = worst;
    return true;
  };
  trial_ = *solution;
  if (OpenSqueezed(problem, &trial_)) {
    const std::vector<ContactMode> opened = trial_.modes;
    without_centre();
    if (SolveWithModes(problem, &trial_, report) && is_better()) return;
    trial_ = *solution;
    trial_.modes = opened;
    if (SolveByModeChanges(problem, options, &trial_, report) && is_better()) return;
    // The factors are those of the solution again.
    trial_ = *solution;
    SetCentre(*solution);
    SolveWithModes(problem, &trial_, report);
  }
  if (sliding < 2) return;
  trial_ = *solution;
  without_centre();
  if (SolveWithModes(problem, &trial_, report)) is_better();
}

ContactSolverReport ContactSolver::Solve(const ContactProblem<double>& problem,
                                         const ContactSolverOptions& options,
                                         ContactSolution<double>* solution) {
  const int expansions = system_.expansions();
  const int regularised = system_.regularised_steps();
  ContactSolverReport report = problem.has_rolling ? SolveRolling(problem, options, solution)
                                                   : RunPortfolio(problem, options, solution);
  if (report.solved && !problem.has_rolling) ReleaseSqueeze(problem, options, solution, &report);
  report.fallbacks.whole_system = system_.expansions() - expansions;
  report.fallbacks.regularised = system_.regularised_steps() - regularised;
  return report;
}

ContactSolverReport ContactSolver::RunPortfolio(const ContactProblem<double>& problem,
                                                const ContactSolverOptions& options,
                                                ContactSolution<double>* solution) {
  ContactSolverReport report;
  const auto done = [&](Rung rung) {
    report.solved = true;
    report.rung = rung;
    return report;
  };
  const auto failed = [&] {
    report.rung = Rung::kNone;
    return report;
  };
  if (problem.contacts.empty()) {
    SetCentre(*solution);
    if (SolveWithModes(problem, solution, &report)) {
      report.residual = NaturalResidual(problem, *solution, &report.worst_contact);
      if (report.residual <= options.tolerance) {
        return done(Rung::kDirect);
      }
    } else {
      MeasureWithoutContacts(problem, solution, &report);
    }
    return failed();
  }
  entry_ = *solution;
  const bool any = options.choice == SolverChoice::kAuto;
  const bool many = problem.contacts.size() >= kLeastContactsOfDescent;
  const int most_beyond = many ? kFewBeyond : std::numeric_limits<int>::max();
  if (any && SolveByModeChanges(problem, options, solution, &report, most_beyond)) {
    return done(Rung::kModeChanges);
  }
  if (any && many && SolveByDescent(problem, options, solution, &report)) {
    return done(report.rung);
  }
  const int num_contacts = static_cast<int>(problem.contacts.size());
  if (any) {
    *solution = entry_;
    ++report.fallbacks.pivoting;
    if (SolveByPivoting(problem, options, ContactPivoting::From::kModes,
                        kPivotsFromGuess + num_contacts / 2, kMaxProximalRounds, solution,
                        &report)) {
      return done(Rung::kPivotingFromGuess);
    }
    *solution = entry_;
    ++report.fallbacks.interior_point;
  }
  if (options.choice != SolverChoice::kLemke &&
      SolveByInteriorPoint(problem, options, solution, &report)) {
    return done(report.rung);
  }
  if (options.choice != SolverChoice::kInteriorPoint) {
    *solution = entry_;
    report.fallbacks.lemke += any ? 1 : 0;
    if (SolveByPivoting(problem, options, ContactPivoting::From::kOpen,
                        kPivotsFromOpen * (1 + num_contacts), kMaxProximalRounds, solution,
                        &report)) {
      return done(Rung::kPivotingFromOpen);
    }
  }
  if (options.choice != SolverChoice::kInteriorPoint &&
      SolveByLemke(problem, options, solution, &report)) {
    return done(report.rung);
  }
  return failed();
}

}  // namespace tangible
