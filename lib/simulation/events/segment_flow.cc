// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/segment_flow.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/load_speed.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

constexpr int kMostCorrections = 12;

NystromTableau Trapezoidal() {
  NystromTableau t;
  t.stages = 2;
  t.c[1] = 1.0;
  for (int j = 0; j < 2; ++j) {
    t.a[1][j] = 0.5;
    t.a_hat[1][j] = 0.25;
    t.b[j] = 0.5;
    t.b_hat[j] = 0.25;
  }
  t.last_is_implicit = true;
  return t;
}

NystromTableau RungeKutta4() {
  NystromTableau t;
  t.stages = 4;
  const double c[4] = {0.0, 0.5, 0.5, 1.0};
  std::copy_n(c, 4, t.c);
  t.a[1][0] = 0.5;
  t.a[2][1] = 0.5;
  t.a[3][2] = 1.0;
  t.a_hat[2][0] = 0.25;
  t.a_hat[3][1] = 0.5;
  const double b[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  std::copy_n(b, 4, t.b);
  for (int j = 0; j < 3; ++j) {
    t.b_hat[j] = 1.0 / 6.0;
  }
  return t;
}

constexpr char kSingularStage[] = "accelerations with the contacts' modes held are singular";

// The state at which a segment's stage i is evaluated, from the first `terms` stages.
void PlaceStageOf(const Model<double>& model, const NystromTableau& tableau, const Segment& segment,
                  int i, int terms, State<double>* state) {
  PlaceStage(
      *model.structure, segment.before, segment.length, tableau.c[i], tableau.a[i],
      tableau.a_hat[i], terms,
      [&](int j) -> const std::vector<double>& { return segment.stages[j].solution.motion; },
      state);
  FollowPaths(model, segment.time + tableau.c[i] * segment.length, segment.middle, state);
}

// The sizes, as accelerations, of the terms in each component of
// M a = p + Aᵀ y + Σ (nᵀ λn + tᵀ λt): they cancel in a body at rest, whose acceleration is their
// rounding.
void SizesOfTerms(const SolvedNode& node, std::vector<double>* sizes) {
  const ContactProblem<double>& p = node.problem;
  sizes->assign(p.load.size(), 0.0);
  for (size_t i = 0; i < p.load.size(); ++i) {
    (*sizes)[i] = std::abs(p.load[i]);
  }
  const auto add = [&](int block, const RowPart<double>& row, double impulse) {
    for (int i = 0; block >= 0 && i < 3; ++i) {
      (*sizes)[3 * block + i] += std::abs(row[i] * impulse);
    }
  };
  ForEachImpulse(p, node.solution, add);
  for (size_t i = 0; i < sizes->size(); ++i) {
    (*sizes)[i] /= p.mass[i];
  }
}

// The largest acceleration, of bodies and of what pushes them.
double LargestAcceleration(const SolvedNode& node) {
  double most = 0.0;
  for (size_t i = 0; i < node.solution.motion.size(); ++i) {
    const double pushed = std::abs(node.problem.load[i]) / node.problem.mass[i];
    most = std::max({most, pushed, std::abs(node.solution.motion[i])});
  }
  return most;
}

// What its support holds of a body does not move, by the rounding of motions of this size neither.
void KeepHeld(const ModelStructure& s, const std::vector<SupportState>& supports, double size,
              std::vector<double>* motion) {
  for (size_t k = 0; k < supports.size(); ++k) {
    if (!HoldsCentre(s.supports[k], supports[k])) continue;
    double* const of_body = &(*motion)[3 * static_cast<size_t>(s.bodies[s.supports[k].body].block)];
    const int count = supports[k].holds == SupportState::kBody ? 3 : 2;
    const bool is_rounding = std::all_of(of_body, of_body + count, [&](double component) {
      return std::abs(component) <= 16.0 * kSettled * size;
    });
    if (is_rounding) std::fill_n(of_body, count, 0.0);
  }
}

// Whether in a correction's problem the points of some hinge have come apart by more than this
// fraction of its arms, after a motion that started with the hinge closed.
bool DriftsFar(const Model<double>& model, const ContactProblem<double>& correction) {
  constexpr double kShareOfArms = 0.1;
  for (size_t j = 0; j < model.structure->joints.size(); ++j) {
    const JointIndex& joint = model.structure->joints[j];
    const double* anchors = &model.parameters[joint.geometry];
    if (joint.type != JointType::kRevolute || correction.joints[j].rows == 0) {
      continue;
    }
    const double arms =
        std::hypot(anchors[0], anchors[1]) +
        (joint.b == model.structure->world() ? 0.0 : std::hypot(anchors[2], anchors[3]));
    const double* error = correction.joints[j].rhs;
    if (arms > 0.0 && std::hypot(error[0], error[1]) > kShareOfArms * arms) {
      return true;
    }
  }
  return false;
}

// Whether a correction moves a body by a tenth of its radius of gyration, or turns it by a tenth of
// a radian, for errors that are a million times less: then the solution is rounding, as between
// masses that differ by a factor of 1e40, and would throw the body out from between its neighbours.
bool ThrowsOut(const SolvedNode& node, double error) {
  constexpr double kShareOfBody = 0.1;
  constexpr double kMostOfError = 1e6;
  const std::vector<double>& mass = node.problem.mass;
  for (int k = 0; k < node.problem.num_bodies; ++k) {
    const double* moved = &node.solution.motion[3 * static_cast<size_t>(k)];
    const double radius = std::sqrt(mass[3 * k + 2] / mass[3 * k]);
    const double far = std::max(std::hypot(moved[0], moved[1]), radius * std::abs(moved[2]));
    if (far > std::max(kShareOfBody * radius, kMostOfError * error)) {
      return true;
    }
  }
  return false;
}

}  // namespace

const NystromTableau& NystromTableau::Of(Integrator integrator) {
  static const NystromTableau kTrapezoidal = Trapezoidal();
  static const NystromTableau kRungeKutta = RungeKutta4();
  return integrator == Integrator::kTrapezoidal ? kTrapezoidal : kRungeKutta;
}

std::string NameOfContradicted(const ModelStructure& structure, int joint) {
  const auto joints = static_cast<int>(structure.joints.size());
  return (joint >= joints ? "the support of body " +
                                structure.bodies[structure.supports[joint - joints].body].name
                          : "joint " + structure.joints[joint].name) +
         " contradicts the others: no twist satisfies all";
}

void AssembleImpulses(const Model<double>& model, AssemblyScratch<double>* scratch,
                      Impulses* impulses) {
  AssembleWithoutContacts(model, impulses->before, impulses->time, impulses->h, &impulses->problem,
                          scratch);
  AssembleContacts(model, impulses->before, impulses->h, impulses->contacts, impulses->friction,
                   impulses->restitution, scratch, &impulses->problem);
}

bool SegmentFlow::Solve(const std::vector<ContactMode>& modes, SolvedNode* node) {
  const int before = node->system.expansions();
  node->solution.modes = modes;
  const bool solved = mode_solve_.Solve(node->problem, nullptr, &node->system, &node->solution);
  counts_.whole_system += node->system.expansions() - before;
  TakeRollingLimits(node->solution, &node->problem);
  return solved && AllFinite(node->solution.motion) && AllFinite(node->solution.joint_impulse) &&
         AllFinite(node->solution.normal_impulse) && AllFinite(node->solution.tangent_impulse);
}

bool SegmentFlow::Accelerate(const Model<double>& model, const Segment& segment,
                             const State<double>& state, double time, SolvedNode* node) {
  node->state = state;
  node->time = time;
  AssembleAcceleration(model, state, time, segment.middle, segment.contacts, segment.friction,
                       &assembly_, &node->problem);
  AddEdgesToCome(model, segment, &node->problem);
  if (!Solve(segment.modes, node)) return false;
  if (!state.supports.empty()) {
    KeepHeld(*model.structure, state.supports, LargestAcceleration(*node), &node->solution.motion);
  }
  return true;
}

// Solves the last stage, which depends on its own accelerations (implicit_stage.h).
bool SegmentFlow::SolveImplicitStage(const Model<double>& model, Segment* segment,
                                     std::string* message) {
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(model.structure->settings));
  const int i = tableau.stages - 1;
  SolvedNode& stage = segment->stages[i];
  const std::vector<double>& start = segment->stages[i - 1].solution.motion;
  std::vector<double> acceleration = start;
  State<double> state;
  const auto evaluate = [&](const std::vector<double>& at, std::vector<double>* next) {
    stage.solution.motion = at;
    PlaceStageOf(model, tableau, *segment, i, i + 1, &state);
    const bool solved =
        AllFinite(state.pose) && AllFinite(state.twist) &&
        Accelerate(model, *segment, state, segment->time + tableau.c[i] * segment->length, &stage);
    *next = stage.solution.motion;
    return solved;
  };
  const auto arrived = [&](const std::vector<double>&, const std::vector<double>& at,
                           int iteration) { return HasConverged(stage, at, iteration); };
  const auto newton = [&](const std::vector<double>& next, int iteration, std::vector<double>* at) {
    counts_.newton_stages += iteration == kMostFixedPoints ? 1 : 0;
    implicit_.Factor(model, segment);
    const auto size = static_cast<Eigen::Index>(at->size());
    Eigen::Map<Eigen::VectorXd> x(at->data(), size);
    RowMatrixXd step = Eigen::Map<const Eigen::VectorXd>(next.data(), size) - x;
    implicit_.Solve(ImplicitStage::Direction::kForward, &step);
    x += step;
  };
  const StageOutcome outcome = IterateStage(evaluate, arrived, newton, &acceleration);
  if (outcome == StageOutcome::kSingular) {
    *message = kSingularStage;
  }
  if (outcome != StageOutcome::kNotConverged) {
    return outcome == StageOutcome::kSolved;
  }
  size_t worst = 0;
  for (size_t k = 1; k < start.size(); ++k) {
    worst = std::abs(acceleration[k] - start[k]) > std::abs(acceleration[worst] - start[worst])
                ? k
                : worst;
  }
  *message = "the trapezoidal rule's iteration does not converge (body " +
             model.structure->bodies[model.structure->moving[worst / 3]].name +
             "): dt is too large";
  return false;
}

bool SegmentFlow::HasConverged(const SolvedNode& stage, const std::vector<double>& last,
                               int iteration) {
  double size = 0.0;
  for (const double acceleration : last) {
    size = std::max(size, std::abs(acceleration));
  }
  // The acceleration of a body at rest cannot fall below the rounding of the terms that cancel in
  // it, and rounding may prevent the last digit: after some iterations a weaker criterion is
  // enough.
  const bool by_terms = iteration >= 3;
  if (by_terms) {
    SizesOfTerms(stage, &terms_);
  }
  const double tolerance = iteration < kMostFixedPoints + 5 ? kImplicitStage : 1e3 * kImplicitStage;
  for (size_t k = 0; k < last.size(); ++k) {
    const double change = std::abs(stage.solution.motion[k] - last[k]);
    if (!(change <= tolerance * (by_terms ? std::max(size, terms_[k]) : size))) {
      return false;
    }
  }
  return true;
}

bool SegmentFlow::Integrate(const Model<double>& model, Segment* segment, const SolvedNode* first,
                            std::string* message) {
  const ModelStructure& structure = *model.structure;
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(structure.settings));
  const double tau = segment->length;
  segment->num_stages = tableau.stages;
  if (static_cast<int>(segment->stages.size()) < tableau.stages) {
    segment->stages.resize(tableau.stages);
  }
  State<double> state;
  for (int i = 0; i < tableau.stages; ++i) {
    if (tableau.last_is_implicit && i + 1 == tableau.stages) {
      if (!SolveImplicitStage(model, segment, message)) {
        return false;
      }
      continue;
    }
    if (i == 0 && first != nullptr && tableau.c[0] == 0.0) {
      segment->stages[0] = *first;
      continue;
    }
    PlaceStageOf(model, tableau, *segment, i, i, &state);
    if (!AllFinite(state.pose) || !AllFinite(state.twist) ||
        !Accelerate(model, *segment, state, segment->time + tableau.c[i] * tau,
                    &segment->stages[i])) {
      *message = kSingularStage;
      return false;
    }
  }
  PlaceStage(
      structure, segment->before, tau, 1.0, tableau.b, tableau.b_hat, tableau.stages,
      [&](int j) -> const std::vector<double>& { return segment->stages[j].solution.motion; },
      &segment->after);
  FollowPaths(model, segment->time + tau, segment->middle, &segment->after);
  return true;
}

// Errors that a correction has to remove: those of joints, where these are corrected, and gaps.
struct SegmentFlow::PoseErrors {
  double share = 0.0;  ///< the largest, as a fraction of the allowed error
  double error = 0.0;  ///< that one, m or rad
  double allowed = 0.0;
  bool settled = true;  ///< all are rounding

  void Add(double new_error, double new_allowed, double rounding) {
    settled = settled && new_error <= rounding;
    // A value that is not a number counts as the largest.
    if (!(new_error <= share * new_allowed)) {
      share = new_error / new_allowed;
      error = new_error;
      allowed = new_allowed;
    }
  }
};

SegmentFlow::PoseErrors SegmentFlow::ErrorsOf(const Model<double>& model, const Segment& segment,
                                              const SolvedNode& node) const {
  PoseErrors errors;
  const ModelStructure& structure = *model.structure;
  const double least = structure.settings.joint_tolerance;
  const auto add_length = [&](double error, int a, int b) {
    const double size = lengths_.Size(a, b);
    const double place = lengths_.Coordinate(node.state, a, b);
    errors.Add(std::abs(error), std::max(least, kCorrected * size) + kCoordinateRounding * place,
               kSettled * (size + place));
  };
  const auto add_angle = [&](double error, int a, int b) {
    const double angle = AngleOf(node.state, a, b);
    errors.Add(std::abs(error), std::max(least, kCorrected) + kCoordinateRounding * angle,
               kSettled * (1.0 + angle));
  };
  for (size_t j = 0; j < structure.joints.size(); ++j) {
    const JointIndex& joint = structure.joints[j];
    const JointBlock<double>& block = node.problem.joints[j];
    for (int k = 0; k < block.rows; ++k) {
      if (IsAngle(joint, k)) {
        add_angle(block.rhs[k], joint.a, joint.b);
      } else {
        add_length(block.rhs[k], joint.a, joint.b);
      }
    }
  }
  for (size_t i = 0; i < node.problem.contacts.size(); ++i) {
    const ActiveContact& contact = segment.contacts[i];
    const double gap = node.problem.contacts[i].c_n;
    if (contact.is_rolling) continue;
    if (contact.joint >= 0 && structure.joints[contact.joint].is_angular) {
      add_angle(gap, contact.a, contact.b);
    } else {
      add_length(gap, contact.a, contact.b);
    }
  }
  return errors;
}

// Far from the origin, where all gaps are rounding, nothing corrects them: supports whose heights
// differ by rounding would turn a face that rests on several of them, in changing directions. Their
// derivative is corrected (it is that of the gaps in the correction's equations, whatever their
// values). Either all contacts are corrected or none, because correcting a single one would turn
// the face too.
void SegmentFlow::LeaveRounding(const Segment& segment, SolvedNode* node) const {
  const auto is_far = [&](size_t i, double* left) {
    const ActiveContact& contact = segment.contacts[i];
    *left = kLeftAlone * lengths_.Rounding(node->state, contact.a, contact.b);
    return contact.IsOfShapes() && contact.law != ContactLaw::kRecovery &&
           *left > kLeastLeft * lengths_.Size(contact.a, contact.b);
  };
  double left;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    if (is_far(i, &left) && !(std::abs(node->problem.contacts[i].c_n) <= left)) return;
  }
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    if (is_far(i, &left)) node->problem.contacts[i].c_n = 0.0;
  }
}

namespace {

constexpr char kStartsOffItsJoints[] =
    "joints are open by more than a tenth of their arms where the run starts: its initial poses "
    "are not on the joints";
constexpr char kDriftsOffItsJoints[] =
    "joints drift by more than a tenth of their arms in one motion: dt is too large";

constexpr char kThrown[] =
    "contacts nearly contradict each other, and throw bodies out in one motion: dt is too large";

std::string NotProjected(double allowed, double error, bool starts) {
  char text[256];
  std::snprintf(text, sizeof(text),
                "projection onto joints and contacts: expected an error of at most %.3g, got "
                "%.3g: %s",
                allowed, error,
                starts ? "where the run starts they contradict each other, as a body does that is "
                         "larger than its slot"
                       : "dt is too large");
  return text;
}

}  // namespace

bool SegmentFlow::CorrectPoses(const Model<double>& model, Segment* segment, std::string* message) {
  const ModelStructure& structure = *model.structure;
  const SimulationSettings& settings = structure.settings;
  segment->num_corrections = 0;
  const bool joints =
      !structure.joints.empty() && JointCorrectionOf(settings) != JointCorrection::kNone;
  if (segment->contacts.empty() && !joints) {
    return true;
  }
  // A body that recovers from penetration may move another contact off its surface; that error
  // remains.
  bool recovers = false;
  for (const ActiveContact& contact : segment->contacts) {
    recovers = recovers || contact.law == ContactLaw::kRecovery;
  }
  const std::vector<ContactMode> modes(segment->contacts.size(), ContactMode::kClosed);
  double last = HUGE_VAL;
  for (int k = 0; k < kMostCorrections; ++k) {
    if (static_cast<int>(segment->corrections.size()) <= k) {
      segment->corrections.emplace_back();
    }
    SolvedNode& node = segment->corrections[k];
    node.state = segment->after;
    node.time = segment->time + segment->length;
    // Contacts that recover from penetration move in the first correction; the other corrections
    // hold them.
    AssembleCorrection(model, node.state, segment->contacts, segment->friction,
                       k == 0 ? settings.recovery_speed * segment->length : 0.0, &assembly_,
                       &node.problem);
    if (k == 0 && JointCorrectionOf(settings) == JointCorrection::kProjection &&
        DriftsFar(model, node.problem)) {
      // This happens where links move faster than dt resolves, and where the implicit stage has
      // found a solution other than the one that continues the motion.
      *message = segment->starts ? kStartsOffItsJoints : kDriftsOffItsJoints;
      return false;
    }
    LeaveRounding(*segment, &node);
    const PoseErrors errors = ErrorsOf(model, *segment, node);
    // Newton's method squares the error; an error that is small and no longer falls is rounding.
    const bool shrinks = errors.share <= 0.1 * last;
    if (k > 0 && (errors.settled || (!shrinks && (recovers || errors.share <= 1.0)))) {
      break;
    }
    if (k > 0 && errors.share >= last && last <= 1.0) {
      // Rows that nearly depend on each other, as of balls that just fit between two walls, turn
      // rounding into motion: an error that was allowed before this correction stays.
      segment->after = segment->corrections[k - 1].state;
      segment->num_corrections = k - 1;
      return true;
    }
    if (k + 1 == kMostCorrections || (k > 0 && errors.share >= last)) {
      *message = NotProjected(errors.allowed, errors.error, segment->starts);
      return false;
    }
    last = errors.share;
    if (!Solve(modes, &node)) {
      *message = "projection onto joints and contacts is singular";
      return false;
    }
    if (ThrowsOut(node, errors.error)) {
      if (errors.share <= 1.0) break;
      *message =
          "projection onto joints and contacts: a body would move a million times farther than its "
          "rows are off: masses are too far apart";
      return false;
    }
    KeepHeld(structure, node.state.supports, errors.error, &node.solution.motion);
    AddBodies(structure, 1.0, node.solution.motion, &segment->after.pose);
    segment->num_corrections = k + 1;
  }
  return true;
}

void SetUpProjection(const Segment& segment, const State<double>& state, Impulses* projection) {
  projection->time = segment.time + segment.length;
  projection->inside = segment.middle;
  projection->h = 0.0;
  projection->decompression = projection->remainder = projection->holds = false;
  projection->before = state;
  projection->contacts = segment.contacts;
  projection->friction = segment.friction;
  projection->restitution.assign(segment.contacts.size(), CoefficientSource());
  projection->solution.modes = segment.modes;
  for (size_t i = 0; i < segment.contacts.size(); ++i) {
    projection->contacts[i].law = ContactLaw::kInelastic;
    const bool slides = SlidingSign(segment.modes[i]) != 0.0;
    if (segment.modes[i] != ContactMode::kSticking && !(slides && segment.starts)) {
      projection->friction[i] = CoefficientSource();
      projection->solution.modes[i] = ContactMode::kClosed;
    }
  }
}

namespace {

// Whether the projection of twists takes from a body of several contacts more than all speeds, and
// what loads give in the motion. Where contacts nearly contradict each other, as in a wall of
// bricks of which one has moved, their forces throw bodies out between two solves, and the
// projection and the correction of poses put these down elsewhere.
bool IsThrown(const Model<double>& model, const Lengths& lengths, const Segment& segment) {
  constexpr size_t kFewContacts = 3;
  if (segment.contacts.size() < kFewContacts || segment.num_stages == 0) return false;
  const ModelStructure& s = *model.structure;
  double usual = 0.0, taken = 0.0;
  for (int stage = 0; stage < segment.num_stages; ++stage) {
    usual = std::max(usual, segment.length * LoadAcceleration(segment.stages[stage].problem));
  }
  for (int block = 0; block < s.num_blocks(); ++block) {
    const size_t body = 3 * static_cast<size_t>(s.moving[block]);
    const double* projected = &segment.projection.solution.motion[3 * static_cast<size_t>(block)];
    for (int i = 0; i < 2; ++i) {
      const double speed = projected[i];
      usual = std::max({usual, std::abs(segment.before.twist[body + i]), std::abs(speed)});
      taken = std::max(taken, std::abs(segment.after.twist[body + i] - speed));
    }
  }
  for (const PathIndex& path : s.paths) {
    const double* twist = &segment.before.twist[3 * static_cast<size_t>(path.body)];
    usual = std::max({usual, std::abs(twist[0]), std::abs(twist[1]), std::abs(twist[2])});
  }
  return taken > usual && segment.length * taken > kThrownWay * lengths.smallest_radius();
}

}  // namespace

bool SegmentFlow::ProjectTwists(const Model<double>& model, Segment* segment,
                                std::string* message) {
  const std::vector<SupportState>& supports = segment->before.supports;
  segment->projects_twists =
      !segment->contacts.empty() || !model.structure->joints.empty() ||
      std::any_of(supports.begin(), supports.end(),
                  [](const SupportState& one) { return one.holds != SupportState::kNothing; });
  if (!segment->projects_twists) {
    return true;
  }
  SetUpProjection(*segment, segment->after, &segment->projection);
  if (!Project(model, &segment->projection)) {
    *message = "projection of twists is singular";
    return false;
  }
  const Impulses& projection = segment->projection;
  SizesOfTerms(segment->stages[segment->num_stages - 1], &terms_);
  const std::vector<double>& mass = projection.problem.mass;
  const std::vector<double>& v = projection.solution.motion;
  const auto lever = [&](size_t block) { return std::sqrt(mass[3 * block + 2] / mass[3 * block]); };
  double fastest = 0.0;
  for (size_t block = 0; 3 * block < v.size(); ++block) {
    fastest = std::max({fastest, std::abs(v[3 * block]), std::abs(v[3 * block + 1]),
                        std::abs(v[3 * block + 2]) * lever(block)});
  }
  // Where friction in joints has stopped all bodies, and no force acts, speeds are rounding.
  const double rest = kLoadShare * segment->length *
                      LimitAcceleration(segment->stages[segment->num_stages - 1].problem);
  const ModelStructure& s = *model.structure;
  for (size_t k = 0; k < terms_.size(); ++k) {
    const double speed = k % 3 == 2 ? fastest / lever(k / 3) : fastest;
    terms_[k] = segment->length * terms_[k] + std::abs(v[k]) + kSpeedOfTerms * speed + rest;
    // After an impact that has stopped all bodies too, where no force acts: a residual that moves a
    // body in a step by no more than the rounding of its coordinates contradicts nothing.
    const int body = s.moving[k / 3];
    const double unmoved = lengths_.Rounding(segment->before, body, body) / s.settings.dt;
    terms_[k] += (k % 3 == 2 ? unmoved / lever(k / 3) : unmoved) / kUnmetRow;
  }
  const int joint =
      segment->length > 0.0
          ? MostViolatedJoint(projection.problem, projection.solution.motion, terms_, kUnmetRow)
          : -1;
  if (joint >= 0) {
    *message = NameOfContradicted(*model.structure, joint);
    return false;
  }
  if (!segment->starts && IsThrown(model, lengths_, *segment)) {
    *message = kThrown;
    return false;
  }
  SpreadTwists(*model.structure, projection.solution.motion, &segment->after.twist);
  segment->projection.new_twist = segment->after.twist;
  return true;
}

bool SegmentFlow::Project(const Model<double>& model, Impulses* impulses) {
  Impulses& projection = *impulses;
  AssembleImpulses(model, &assembly_, &projection);
  // The same solve as for a node, whose members are stored elsewhere here.
  SolvedNode node;
  std::swap(node.problem, projection.problem);
  std::swap(node.system, projection.system);
  const std::vector<ContactMode> modes = projection.solution.modes;
  const bool solved = Solve(modes, &node);
  std::swap(node.problem, projection.problem);
  std::swap(node.system, projection.system);
  projection.solution = std::move(node.solution);
  return solved;
}

bool GainsEnergy(const Model<double>& model, const Segment& segment) {
  // Of what the loads give at the larger of the powers at both ends.
  constexpr double kSlack = 4.0;
  const ModelStructure& s = *model.structure;
  if (segment.contacts.empty()) return false;
  // What is slower than gravity makes it in a step may be rounding.
  const double slow =
      std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]) * s.settings.dt;
  for (const JointIndex& joint : s.joints) {
    if (joint.motor >= 0 && model.parameters[joint.motor] != 0.0) return false;
  }
  double before = 0.0, after = 0.0, power = 0.0, mass_of_all = 0.0;
  for (int body = 0; body < s.num_bodies(); ++body) {
    const BodyIndex& index = s.bodies[body];
    const double* v = &segment.before.twist[3 * body];
    const double* w = &segment.after.twist[3 * body];
    const auto moves = [](const double* of) {
      return of[0] != 0.0 || of[1] != 0.0 || of[2] != 0.0;
    };
    if (index.block < 0 && (moves(v) || moves(w))) return false;
    for (int i = 0; i < 3 && index.block >= 0; ++i) {
      const double mass = model.parameters[i < 2 ? index.mass : index.inertia];
      mass_of_all += i == 0 ? mass : 0.0;
      before += 0.5 * mass * v[i] * v[i];
      after += 0.5 * mass * w[i] * w[i];
      for (int stage = 0; stage < segment.num_stages; ++stage) {
        const double load = segment.stages[stage].problem.load[3 * index.block + i];
        power += std::abs(load) * std::max(std::abs(v[i]), std::abs(w[i]));
      }
    }
  }
  return after > 0.5 * mass_of_all * slow * slow &&
         after > 2.0 * before + kSlack * segment.length * power;
}

bool SegmentFlow::RunUncorrected(const Model<double>& model, Segment* segment,
                                 std::string* message) {
  segment->num_corrections = 0;
  segment->projects_twists = false;
  return Integrate(model, segment, nullptr, message);
}

bool SegmentFlow::Run(const Model<double>& model, Segment* segment, std::string* message,
                      const SolvedNode* first) {
  if (!Integrate(model, segment, first, message)) return false;
  if (CorrectPoses(model, segment, message)) return ProjectTwists(model, segment, message);
  // If no twist satisfies the joints, no poses do either, and the message names these joints.
  std::string why;
  if (!ProjectTwists(model, segment, &why)) *message = why;
  return false;
}

}  // namespace tangible
