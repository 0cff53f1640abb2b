// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/step.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/math/interrupt.h"
#include "tangible/simulation/events/crush.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// If a body turns out to be faster than its bound, the search is repeated; bounds grow by half each
// time.
constexpr int kMaxSearches = 12;
// Fewer contacts, or islands, are solved faster together than separately.
constexpr size_t kLeastContactsApart = 8;
constexpr int kLeastIslands = 2;

bool SameContacts(const std::vector<ActiveContact>& x, const std::vector<ActiveContact>& y) {
  return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                    [](const ActiveContact& a, const ActiveContact& b) { return a.SameAs(b); });
}

void FullTwist(const ModelStructure& structure, const State<double>& state,
               const std::vector<double>& solved, std::vector<double>* twist) {
  twist->assign(state.twist.begin(), state.twist.end());
  SpreadTwists(structure, solved, twist);
}

// Work of the contacts' impulses, impulse · mean of the speeds before and after.
double ImpulseWork(const StepRecord& r) {
  double work = 0.0;
  for (size_t i = 0; i < r.contacts.size(); ++i) {
    if (r.solution.modes[i] == ContactMode::kOpen || r.contacts[i].is_motor) {
      continue;
    }
    const ContactBlock<double>& c = r.problem.contacts[i];
    const auto speed = [&](const std::vector<double>& twist, const RowPart<double>& a,
                           const RowPart<double>& b) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) {
        sum += a[k] * twist[3 * r.contacts[i].a + k] + b[k] * twist[3 * r.contacts[i].b + k];
      }
      return sum;
    };
    const double normal =
        speed(r.before.twist, c.normal_a, c.normal_b) + speed(r.new_twist, c.normal_a, c.normal_b);
    const double tangent = speed(r.before.twist, c.tangent_a, c.tangent_b) +
                           speed(r.new_twist, c.tangent_a, c.tangent_b);
    work += 0.5 * (r.solution.normal_impulse[i] * normal + r.solution.tangent_impulse[i] * tangent);
  }
  return work;
}

}  // namespace

long NumSteps(const SimulationSettings& settings) {
  if (!settings.step_times.empty()) {
    return static_cast<long>(settings.step_times.size()) - 1;
  }
  return std::max(0L, std::lround(std::ceil(settings.duration / settings.dt - kSameTime)));
}

double StepTime(const SimulationSettings& settings, long k) {
  return settings.step_times.empty() ? std::min(k * settings.dt, settings.duration)
                                     : settings.step_times[k];
}

double StepLength(const SimulationSettings& settings, long k) {
  if (!settings.step_times.empty()) {
    return settings.step_times[k + 1] - settings.step_times[k];
  }
  if (k + 1 < NumSteps(settings)) {
    return settings.dt;
  }
  const double last = settings.duration - k * settings.dt;
  return std::abs(last - settings.dt) <= kSameTime * settings.dt ? settings.dt : last;
}

void AddStepTimes(const std::vector<double>& times, SimulationSettings* settings) {
  std::vector<double> all;
  for (long k = 0; k <= NumSteps(*settings); ++k) {
    all.push_back(StepTime(*settings, k));
  }
  const double near = kSameTime * settings->dt;
  std::vector<double> merged = all;
  for (const double time : times) {
    const auto next = std::lower_bound(all.begin(), all.end(), time);
    const bool known = (next != all.end() && *next - time <= near) ||
                       (next != all.begin() && time - *(next - 1) <= near);
    if (!known && time > 0.0 && time < all.back()) {
      merged.push_back(time);
    }
  }
  std::sort(merged.begin(), merged.end());
  merged.erase(
      std::unique(merged.begin(), merged.end(), [&](double x, double y) { return y - x <= near; }),
      merged.end());
  settings->step_times = std::move(merged);
}

Stepper::Stepper(const Model<double>& model, int threads)
    : search_(model), islands_(std::make_unique<IslandSolver>(threads)) {
  const ModelStructure& s = *model.structure;
  if (s.settings.stepping == Stepping::kEvent) {
    events_ = std::make_unique<IslandStepper>(model);
    return;
  }
  int shaped = 0;
  for (const BodyIndex& body : s.bodies) {
    shaped += (body.shape != ShapeType::kNone ? 1 : 0) + body.num_contact_points;
  }
  // Planar packings have at most about three neighbours a body, two points each.
  const int contacts = 6 * shaped + 2 * static_cast<int>(s.joints.size());
  const size_t joints = s.joints.size() + s.supports.size();
  solver_.Reserve(s.num_blocks(), static_cast<int>(joints), contacts);
  projection_.Reserve(s.num_blocks() + static_cast<int>(s.joints.size()),
                      3 * static_cast<int>(s.joints.size()));
  record_.contacts.reserve(contacts);
  last_contacts_.reserve(contacts);
  wider_contacts_.reserve(contacts);
  wider_friction_.reserve(contacts);
  wider_restitution_.reserve(contacts);
  record_.friction.reserve(contacts);
  record_.restitution.reserve(contacts);
  record_.problem.contacts.reserve(contacts);
  turning_.reserve(s.num_blocks());
  held_.reserve(contacts);
  record_.problem.dampers.reserve(s.joints.size() + s.springs.size());
  record_.problem.joints.reserve(joints);
  for (ContactSolution<double>* solution :
       {&record_.solution, &last_solution_, &narrow_solution_}) {
    solution->motion.reserve(3 * s.num_blocks());
    solution->joint_impulse.reserve(3 * joints);
    solution->normal_impulse.reserve(contacts);
    solution->tangent_impulse.reserve(contacts);
    solution->modes.reserve(contacts);
  }
}

void Stepper::ClearGuess() {
  if (events_) {
    events_->ClearGuess();
  }
  search_.Forget();
  last_contacts_.clear();
  last_solution_ = ContactSolution<double>();
}

void Stepper::SetGuess(const StepRecord& record) {
  search_.Forget();
  last_contacts_ = record.contacts;
  last_solution_ = record.solution;
}

void Stepper::SaveGuess(StepperGuess* guess) const {
  if (events_) {
    guess->events = events_->guess();
    return;
  }
  guess->contacts = last_contacts_;
  guess->solution.joint_impulse = last_solution_.joint_impulse;
  guess->solution.normal_impulse = last_solution_.normal_impulse;
  guess->solution.tangent_impulse = last_solution_.tangent_impulse;
  guess->solution.modes = last_solution_.modes;
}

void Stepper::SetGuess(const StepperGuess& guess) {
  if (events_) {
    events_->SetGuess(guess.events);
    return;
  }
  search_.Forget();
  last_contacts_ = guess.contacts;
  last_solution_ = guess.solution;
}

size_t StepperGuess::bytes() const {
  return sizeof(ActiveContact) * contacts.capacity() + events.bytes() + solution.bytes();
}

ContactMode Stepper::InitialMode(const ContactBlock<double>& contact) const {
  // The guess for a single contact: whether it would touch in the free motion, and whether it would
  // stick.
  const ContactProblem<double>& p = record_.problem;
  double normal = contact.c_n;
  double tangent = contact.c_t;
  const auto add = [&](int block, const RowPart<double>& n, const RowPart<double>& t) {
    for (int i = 0; i < 3 && block >= 0; ++i) {
      const double v = p.load[3 * block + i] / p.mass[3 * block + i];
      normal += n[i] * v;
      tangent += t[i] * v;
    }
  };
  add(contact.a, contact.normal_a, contact.tangent_a);
  add(contact.b, contact.normal_b, contact.tangent_b);
  if (normal >= 0.0 && !contact.limit_given) {
    return ContactMode::kOpen;
  }
  if (!contact.has_friction) {
    return ContactMode::kClosed;
  }
  const double available =
      contact.limit_given
          ? contact.friction * contact.offset
          : -contact.friction * normal /
                RowMobility(p.mass, contact.a, contact.normal_a, contact.b, contact.normal_b);
  const double needed = std::abs(tangent) / RowMobility(p.mass, contact.a, contact.tangent_a,
                                                        contact.b, contact.tangent_b);
  if (needed <= available) {
    return ContactMode::kSticking;
  }
  return tangent > 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
}

void Stepper::CarryGuess(const std::vector<ActiveContact>& contacts,
                         const ContactSolution<double>& solution, Guess from_where) {
  ContactSolution<double>& guess = record_.solution;
  const size_t n = record_.contacts.size();
  guess.modes.resize(n);
  guess.normal_impulse.assign(n, 0.0);
  guess.tangent_impulse.assign(n, 0.0);
  guess.joint_impulse.assign(3 * record_.problem.joints.size(), 0.0);
  if (solution.joint_impulse.size() == guess.joint_impulse.size()) {
    guess.joint_impulse.assign(solution.joint_impulse.begin(), solution.joint_impulse.end());
  }
  // Both lists are in the same order, so one pass finds the common ones; a list whose order differs
  // (a limit) is searched from where the last one was found.
  size_t from = 0;
  for (size_t i = 0; i < n; ++i) {
    const ContactBlock<double>& block = record_.problem.contacts[i];
    size_t found = contacts.size();
    for (size_t step = 0; step < contacts.size(); ++step) {
      const size_t k = (from + step) % contacts.size();
      if (contacts[k].SameAs(record_.contacts[i])) {
        found = k;
        break;
      }
      if (contacts[k].a > record_.contacts[i].a && step > 0 && k > from) {
        break;
      }
    }
    if (found == contacts.size()) {
      guess.modes[i] = from_where == Guess::kSameStep ? ContactMode::kOpen : InitialMode(block);
      continue;
    }
    from = found;
    const ContactMode last = solution.modes[found];
    // With other parameters friction may have become 0, or more than 0.
    const bool fits =
        last == ContactMode::kOpen || (last == ContactMode::kClosed) == !block.has_friction;
    const bool keeps = from_where == Guess::kSameStep || (last != ContactMode::kOpen && fits);
    guess.modes[i] = keeps ? last : InitialMode(block);
    guess.normal_impulse[i] = solution.normal_impulse[found];
    guess.tangent_impulse[i] = solution.tangent_impulse[found];
  }
}

void Stepper::Describe(const Model<double>& model, int contact, StepReport* report) const {
  const ModelStructure& s = *model.structure;
  report->message = NameOfContact(s, record_.contacts, contact);
  if (contact < 0) {
    const int joint =
        MostViolatedJoint(record_.problem, record_.solution.motion, record_.solution.motion, 0.0);
    const bool of_joint = joint >= 0 && joint < static_cast<int>(s.joints.size());
    report->message = !of_joint ? "momentum"
                                : "the joints' equations, most of all of joint " +
                                      s.joints[joint].name + " (are they contradictory?)";
  }
}

void Stepper::FillReport(const Model<double>& model, const ContactSolverReport& solved,
                         StepReport* report) {
  report->rung = solved.rung;
  report->factorisations = solved.factorisations;
  report->iterations = solved.iterations;
  report->residual = solved.residual;
  report->contacts = static_cast<long>(record_.contacts.size());
  report->pairs_compared = search_.num_compared();
  report->pairs_near = search_.num_pairs();
  report->beyond_reach = search_.num_beyond_reach();
  FindTurning(record_.problem, &turning_);
  report->angles_left_out = CountAnglesLeftOut(turning_);
  if (!solved.solved) {
    report->status = StepStatus::kUnsolved;
    if (report->message.empty()) Describe(model, solved.worst_contact, report);
    std::ostringstream residual;
    if (std::isfinite(solved.residual)) {
      residual << " (scaled residual " << solved.residual << ")";
    } else {
      residual << " (speeds or impulses beyond what numbers hold)";
    }
    report->message += residual.str();
    const std::string who =
        WhoCannotYield(*model.structure, record_.contacts, record_.problem, solved.worst_contact,
                       SolverOptionsOf(model.structure->settings));
    if (!who.empty()) report->message += ": " + who;
    return;
  }
  bool impact = false;
  size_t from = 0;
  held_.assign(record_.contacts.size(), ContactMode::kOpen);
  report->gap_min = HUGE_VAL;
  for (size_t i = 0; i < record_.contacts.size(); ++i) {
    const ContactBlock<double>& block = record_.problem.contacts[i];
    report->lcp_rows += block.has_friction ? 3 : 1;
    report->single_rows += block.has_friction ? 0 : 1;
    report->gap_min = std::min(report->gap_min, record_.contacts[i].gap);
    report->closed += record_.solution.modes[i] != ContactMode::kOpen ? 1 : 0;
    impact = impact || record_.contacts[i].law == ContactLaw::kRestitution;
    ContactMode last = ContactMode::kOpen;
    for (size_t k = from; k < last_contacts_.size(); ++k) {
      if (last_contacts_[k].SameAs(record_.contacts[i])) {
        last = last_solution_.modes[k];
        if (last_solution_.normal_impulse[k] > 0.0) held_[i] = last;
        from = k;
        break;
      }
      if (k > from && last_contacts_[k].a > record_.contacts[i].a) {
        break;
      }
    }
    report->mode_switches += last != record_.solution.modes[i] ? 1 : 0;
  }
  if (impact) {
    report->impact_energy_gain = ImpulseWork(record_);
  }
}

ContactSolverReport Stepper::SolveContacts(const ContactSolverOptions& options, int* islands) {
  ContactSolverReport report;
  const bool apart = record_.problem.contacts.size() >= kLeastContactsApart &&
                     islands_->Partition(record_.problem) >= kLeastIslands;
  *islands = 0;
  factored_ = true;
  if (apart && islands_->Solve(record_.problem, options, &record_.solution, &report)) {
    *islands = islands_->count();
    factored_ = false;
    TakeRollingLimits(record_.solution, &record_.problem);
    return report;
  }
  // The fallbacks of the islands count too.
  ContactFallbacks fallbacks = report.fallbacks;
  fallbacks.islands_together += apart ? 1 : 0;
  report = solver_.Solve(record_.problem, options, &record_.solution);
  report.fallbacks.Add(fallbacks);
  TakeRollingLimits(record_.solution, &record_.problem);
  return report;
}

void Stepper::KeepHeld() {
  bool any = false;
  for (size_t i = 0; i < record_.contacts.size(); ++i) {
    const ContactBlock<double>& c = record_.problem.contacts[i];
    if (record_.solution.modes[i] != ContactMode::kOpen || held_[i] == ContactMode::kOpen ||
        c.limit_given || (held_[i] == ContactMode::kClosed) == c.has_friction) {
      continue;
    }
    const double place = PlaceOf(record_.before, record_.contacts[i].a, record_.contacts[i].b);
    const double rounding = kCoordinateRounding * place / record_.h;
    const double* v = record_.solution.motion.data();
    const bool rests = std::abs(RowDot(c.a, c.normal_a, c.b, c.normal_b, v) + c.c_n) <= rounding;
    if (!rests) continue;
    const double slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) + c.c_t;
    record_.solution.modes[i] = !c.has_friction              ? ContactMode::kClosed
                                : std::abs(slip) <= rounding ? ContactMode::kSticking
                                : slip > 0.0                 ? ContactMode::kSlidingPositive
                                                             : ContactMode::kSlidingNegative;
    any = true;
  }
  if (any) factored_ = false;
}

void Stepper::ChooseImpulses() {
  if (chosen_ || events_) return;
  chosen_ = true;
  KeepHeld();
  if (inner_impulses_.Choose(record_.problem, kDegenerateTolerance, &record_.solution)) {
    factored_ = false;
  }
}

ContactSystem& Stepper::system() {
  if (!factored_) {
    solver_.system().Factor(record_.problem, record_.solution.modes);
    factored_ = true;
  }
  return solver_.system();
}

ContactSolverReport Stepper::SolveWithContacts(const Model<double>& model,
                                               const State<double>& state, double h, Guess from,
                                               StepReport* report) {
  const ModelStructure& structure = *model.structure;
  StepRecord& r = record_;
  search_.SetBounds(model, state, r.problem, scratch_);
  ContactSolverReport solved;
  search_.Find(model, state, h, scratch_, &r.contacts, &r.friction, &r.restitution);
  if (from == Guess::kSameStep) {
    ContactSearch::KeepGivenUp(model, h, wider_contacts_, &r.contacts);
  }
  for (int search = 0; search < kMaxSearches; ++search) {
    AssembleContacts(model, r.before, h, r.contacts, r.friction, r.restitution, &scratch_,
                     &r.problem);
    if (search == 0 && from == Guess::kLastStep) {
      CarryGuess(last_contacts_, last_solution_, Guess::kLastStep);
    } else {
      // The guess is the solution with fewer contacts, with the additional ones open: often that is
      // the solution.
      CarryGuess(wider_contacts_, narrow_solution_, Guess::kSameStep);
    }
    // That rebounds have no solution is dear to find out: they are given up before the solver's
    // last resorts, which come after all of them.
    const auto rebounds = [&](const ActiveContact& contact) {
      return contact.law == ContactLaw::kRestitution;
    };
    bool waits = std::any_of(r.contacts.begin(), r.contacts.end(), rebounds);
    const auto solve = [&] {
      const ContactSolverReport earlier = solved;
      ContactSolverOptions options = SolverOptionsOf(structure.settings);
      options.last_resort = !waits;
      solved = SolveContacts(options, &report->islands);
      solved.factorisations += earlier.factorisations;
      solved.iterations += earlier.iterations;
      report->solver.Add(solved.fallbacks);
    };
    solve();
    // Each set of bodies whose rebounds cannot be is given another chance.
    while (!solved.solved &&
           ContactSearch::GiveUpRebounds(model, h, solved.worst_contact, &r.contacts)) {
      ++report->given_up.rebounds_given_up;
      AssembleContacts(model, r.before, h, r.contacts, r.friction, r.restitution, &scratch_,
                       &r.problem);
      CarryGuess(last_contacts_, last_solution_, Guess::kLastStep);
      solve();
    }
    if (!solved.solved && waits) {
      waits = false;
      CarryGuess(last_contacts_, last_solution_, Guess::kLastStep);
      solve();
    }
    if (!solved.solved) {
      break;
    }
    FullTwist(structure, state, r.solution.motion, &r.new_twist);
    if (!search_.CheckBounds(model, r.new_twist, scratch_)) {
      break;
    }
    // A wider search that finds the same contacts changes nothing.
    search_.Find(model, state, h, scratch_, &wider_contacts_, &wider_friction_,
                 &wider_restitution_);
    if (SameContacts(r.contacts, wider_contacts_)) {
      break;
    }
    narrow_solution_ = r.solution;
    r.contacts.swap(wider_contacts_);
    r.friction.swap(wider_friction_);
    r.restitution.swap(wider_restitution_);
  }
  return solved;
}

ContactSolverReport Stepper::SolveWithSupports(const Model<double>& model,
                                               const State<double>& state, double h,
                                               StepReport* report) {
  Guess from = Guess::kLastStep;
  if (model.structure->supports.empty()) return SolveWithContacts(model, state, h, from, report);
  StepRecord& r = record_;
  supports_.Start(model, h, r.problem, {}, &r.before);
  for (;;) {
    AssembleWithoutContacts(model, r.before, r.time, h, &r.problem, &scratch_);
    ContactSolverReport solved = SolveWithContacts(model, state, h, from, report);
    if (!solved.solved && !supports_.has_given_up() && supports_.Release(model, &r.before))
      continue;
    if (!solved.solved) return solved;
    if (supports_.Accept(model, r.problem, r.solution, &r.before)) {
      SupportIteration::KeepAtRest(*model.structure, &r);
      return solved;
    }
    if (supports_.has_given_up()) {
      solved.solved = false;
      solved.residual = supports_.residual();
      report->message = "the support of body " +
                        model.structure->bodies[supports_.worst_body()].name +
                        ": its friction does not settle";
      return solved;
    }
    // Other modes may solve the same step: the next solve goes on from these.
    wider_contacts_ = r.contacts;
    narrow_solution_ = r.solution;
    from = Guess::kSameStep;
  }
}

StepReport Stepper::Step(const Model<double>& model, double t, double h, State<double>* state) {
  CheckInterrupt();
  if (events_) {
    return StepByEvents(model, t, h, state);
  }
  StepReport report;
  const ModelStructure& structure = *model.structure;
  StepRecord& r = record_;
  r.time = t;
  r.h = h;
  chosen_ = false;
  FollowPathsOverStep(model, t, h, state);
  SetReleased(model, ReleasedAtStep(structure, t), state);
  r.before.released.assign(state->released.begin(), state->released.end());
  r.before.pose.assign(state->pose.begin(), state->pose.end());
  r.before.twist.assign(state->twist.begin(), state->twist.end());
  r.before.supports.clear();
  AssembleWithoutContacts(model, r.before, t, h, &r.problem, &scratch_);
  if (!AllFinite(r.problem.load) || !AllFinite(r.problem.mass)) {
    report.status = StepStatus::kDiverged;
    report.message = "a force or momentum is not finite";
    return report;
  }
  FillReport(model, SolveWithSupports(model, *state, h, &report), &report);
  if (report.status != StepStatus::kDone) {
    return report;
  }
  state->twist.assign(r.new_twist.begin(), r.new_twist.end());
  MovePoses(structure, h, state);
  last_contacts_.assign(r.contacts.begin(), r.contacts.end());
  last_solution_ = r.solution;
  const bool projects = ProjectsOntoJoints(structure);
  const bool met = !projects || projection_.Project(model, r.before.pose, state);
  report.damped_projections = projects ? projection_.damped_steps() : 0;
  if (!met) {
    report.status = StepStatus::kUnsolved;
    std::ostringstream message;
    message << "projection of joint " << structure.joints[projection_.worst_joint()].name
            << ": error " << projection_.error();
    report.message = message.str();
  }
  if (!AllFinite(state->pose) || !AllFinite(state->twist)) {
    report.status = StepStatus::kDiverged;
    report.message = "a pose or twist is not finite";
  }
  return report;
}

void Stepper::Refactor(const Model<double>& model, StepRecord* record) {
  AssembleWithoutContacts(model, record->before, record->time, record->h, &record->problem,
                          &scratch_);
  AssembleContacts(model, record->before, record->h, record->contacts, record->friction,
                   record->restitution, &scratch_, &record->problem);
  TakeRollingLimits(record->solution, &record->problem);
  factored_ = true;
  solver_.system().Factor(record->problem, record->solution.modes);
}

}  // namespace tangible
