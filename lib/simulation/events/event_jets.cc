// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_jets.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/servo.h"
#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/implicit_stage.h"
#include "tangible/simulation/events/mode_elimination_inl.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/solve_jets_inl.h"
#include "tangible/simulation/events/support_bounds.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

constexpr int kMostLocations = 8;

template <typename T>
class EventReplay {
  static constexpr int kWidth = NumDerivatives<T>::value;

 public:
  EventReplay(const Model<T>& model, const Model<double>& values, JetRoute route)
      : model_(model), values_(values), s_(*model.structure), route_(route) {}

  void Run(EventRecord* record, State<T>* state) {
    bool started = false;
    T now(0.0);
    for (int p = 0; p < record->num_parts; ++p) {
      EventPart& part = *record->parts[p];
      if (!started) {
        now = T(part.is_impulses ? part.impulses.time : part.segment.time);
        started = true;
      }
      FollowPaths(model_, now, part.inside(), state);
      const State<double>& before = part.is_impulses ? part.impulses.before : part.segment.before;
      state->servo_modes = before.servo_modes;
      state->released = before.released;
      state->supports = before.supports;
      if (part.is_impulses) {
        RunImpulses(&part.impulses, state);
      } else {
        RunSegment(&part.segment, &now, state);
      }
    }
    state->servo_modes.clear();
    state->supports.clear();
  }

 private:
  // Solves a problem whose solution in double is known, for bodies, joints and contacts.
  void Solve(const ContactProblem<T>& problem, const ContactProblem<double>& in_double,
             const ContactSolution<double>& solution, const std::vector<double>& signs,
             ContactSystem* system, ContactSolution<T>* out) {
    if (route_ == JetRoute::kUnrolled) {
      ModeElimination<T>::Solve(problem, solution.modes, signs, out);
      return;
    }
    SolveImplicitly(problem, in_double, solution, signs, system, out);
  }

  void RunImpulses(Impulses* impulses, State<T>* state, bool is_impact = true) {
    ContactSolution<T> solution;
    SolveImpulses(impulses, *state, is_impact, &solution);
    SpreadTwists(s_, solution.motion, &state->twist);
    compression_ = solution.normal_impulse;
  }

  // Sets the offsets of a decompression: e times the impulses of the part before.
  void SetOffsets(const Impulses& impulses, ContactProblem<T>* problem) const {
    for (size_t i = 0; i < impulses.contacts.size(); ++i) {
      ContactBlock<T>& contact = problem->contacts[i];
      contact.driven = impulses.problem.contacts[i].driven;
      if (contact.driven) {
        const T e = EvaluateCoefficient(impulses.restitution[i], model_.parameters);
        contact.offset = e * compression_[impulses.compressed[i]];
      }
    }
  }

  void SolveImpulses(Impulses* impulses, const State<T>& state, bool is_impact,
                     ContactSolution<T>* solution) {
    ContactProblem<T> problem;
    AssembleInJets(model_, *impulses, state, &problem);
    if (impulses->decompression) {
      SetOffsets(*impulses, &problem);
    } else if (route_ == JetRoute::kUnrolled && is_impact && !impulses->holds) {
      const bool converged = SolveUnrolled(problem, impulses->solution, solution);
      double difference = 0.0;
      double size = 0.0;
      for (size_t i = 0; i < impulses->solution.motion.size(); ++i) {
        difference = std::max(
            difference, std::abs(ValueOf(solution->motion[i]) - impulses->solution.motion[i]));
        size = std::max(size, std::abs(impulses->solution.motion[i]));
      }
      // Where impulses are not unique, or the interior point stalls, the mode system of the double
      // step is solved by elimination.
      if (converged && difference <= kUnrolledAgrees * size) {
        return;
      }
    }
    Solve(problem, impulses->problem, impulses->solution,
          SlidingSigns(impulses->problem, impulses->solution), &impulses->system, solution);
  }

  // Accelerations at a state with the segment's modes.
  void Accelerate(const Segment& segment, const State<T>& state, const T& time, SolvedNode* node,
                  ContactSolution<T>* out) {
    ContactProblem<T> problem;
    AssemblyScratch<T> scratch;
    AssembleAcceleration(model_, state, time, segment.middle, segment.contacts, segment.friction,
                         &scratch, &problem);
    std::vector<double> signs(segment.contacts.size(), 0.0);
    for (size_t i = 0; i < signs.size(); ++i) {
      signs[i] = SlidingSign(segment.modes[i]);
      if (segment.modes[i] == ContactMode::kClosed && segment.contacts[i].IsOfShapes()) {
        ContactRows<double> rows;
        EvaluateContactRows(values_, node->state, segment.contacts[i], &rows);
        signs[i] = SlipSign(node->state, segment.contacts[i], rows);
      }
    }
    Solve(problem, node->problem, node->solution, signs, &node->system, out);
  }

  // Values in the first column, then derivatives.
  static void ToColumns(const std::vector<T>& jets, RowMatrixXd* columns) {
    columns->resize(static_cast<Eigen::Index>(jets.size()), kWidth + 1);
    for (size_t k = 0; k < jets.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      (*columns)(row, 0) = jets[k].a;
      columns->row(row).tail(kWidth) = jets[k].v.transpose();
    }
  }
  static void FromColumns(const RowMatrixXd& columns, std::vector<T>* jets) {
    jets->resize(static_cast<size_t>(columns.rows()));
    for (size_t k = 0; k < jets->size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      (*jets)[k].a = columns(row, 0);
      (*jets)[k].v = columns.row(row).tail(kWidth).transpose();
    }
  }

  void Map(Segment* segment, const State<T>& before, const T& time, const T& tau, State<T>* after) {
    const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(s_.settings));
    std::vector<ContactSolution<T>> stages(tableau.stages);
    const auto stage = [&](int j) -> const std::vector<T>& { return stages[j].motion; };
    State<T> state;
    for (int i = 0; i < tableau.stages; ++i) {
      const auto evaluate = [&](int terms, ContactSolution<T>* next) {
        PlaceStage(s_, before, tau, tableau.c[i], tableau.a[i], tableau.a_hat[i], terms, stage,
                   &state);
        FollowPaths(model_, T(time + tableau.c[i] * tau), segment->middle, &state);
        Accelerate(*segment, state, T(time + tableau.c[i] * tau), &segment->stages[i], next);
      };
      if (!tableau.last_is_implicit || i + 1 < tableau.stages) {
        evaluate(i, &stages[i]);
        continue;
      }
      // The values are known; derivatives at nearby values would differ.
      RowMatrixXd own;
      ToColumns(stages[i - 1].motion, &own);
      own.col(0) =
          Eigen::Map<const Eigen::VectorXd>(segment->stages[i].solution.motion.data(), own.rows());
      const auto map = [&](const RowMatrixXd& at, RowMatrixXd* next) {
        FromColumns(at, &stages[i].motion);
        ContactSolution<T> solution;
        evaluate(i + 1, &solution);
        ToColumns(solution.motion, next);
      };
      implicit_.SolveDerivative(values_, segment, ImplicitStage::Direction::kForward, map, &own);
      FromColumns(own, &stages[i].motion);
    }
    PlaceStage(s_, before, tau, 1.0, tableau.b, tableau.b_hat, tableau.stages, stage, after);
    FollowPaths(model_, T(time + tau), segment->middle, after);
    Correct(segment, tau, after);
    if (segment->projects_twists) {
      RunImpulses(&segment->projection, after, false);
    }
  }

  void Correct(Segment* segment, const T& tau, State<T>* after) {
    for (int k = 0; k < segment->num_corrections; ++k) {
      SolvedNode& node = segment->corrections[k];
      ContactProblem<T> problem;
      AssemblyScratch<T> scratch;
      AssembleCorrection(model_, *after, segment->contacts, segment->friction,
                         k == 0 ? T(s_.settings.recovery_speed * tau) : T(0.0), &scratch, &problem);
      // A gap that is rounding is left as it is (SegmentFlow::LeaveRounding).
      for (size_t i = 0; i < problem.contacts.size(); ++i) {
        T& gap = problem.contacts[i].c_n;
        if (node.problem.contacts[i].c_n == 0.0) gap -= ValueOf(gap);
      }
      ContactSolution<T> correction;
      Solve(problem, node.problem, node.solution,
            std::vector<double>(segment->contacts.size(), 0.0), &node.system, &correction);
      AddBodies(s_, T(1.0), correction.motion, &after->pose);
    }
  }

  // The event's equation at the state after.
  T Equation(Segment* segment, const State<T>& after, const T& time) {
    const ActiveContact& contact = segment->event_contact;
    if (segment->event == EventKind::kServoBound) {
      const int k = segment->event_index;
      const T& limit = model_.parameters[s_.servos[k].Number(ServoIndex::kLimit)];
      return limit -
             segment->event_sign * UnboundedEffort(model_, after, k, {time, segment->middle, 0.0});
    }
    if (segment->event == EventKind::kSupportStops) {
      const int k = segment->event_index;
      return SupportProgress(model_, after, k, segment->before.supports[static_cast<size_t>(k)]);
    }
    if (segment->event == EventKind::kSupportLetsGo) {
      const auto k = static_cast<size_t>(segment->event_index);
      ContactSolution<T> solution;
      Accelerate(*segment, after, time, &segment->end, &solution);
      return SupportReserve(model_, after, segment->event_index, segment->before.supports[k].holds,
                            segment->event_support.twist,
                            &solution.joint_impulse[3 * (s_.joints.size() + k)]);
    }
    if (segment->event == EventKind::kLiftOff || segment->event == EventKind::kSlipBegins) {
      ContactSolution<T> solution;
      Accelerate(*segment, after, time, &segment->end, &solution);
      if (!segment->release.empty()) {
        return segment->WorkLeft<T>(
            [&](size_t i) { return EvaluateCoefficient(segment->friction[i], model_.parameters); },
            solution);
      }
      if (segment->event == EventKind::kLiftOff) {
        return solution.normal_impulse[segment->event_index];
      }
      return segment->FrictionLeft<T>(
          segment->event_index, EvaluateCoefficient(segment->event_friction, model_.parameters),
          segment->event_sign, solution);
    }
    ContactRows<T> rows;
    EvaluateActiveRows(model_, after, contact, &rows);
    if (segment->passes) {
      ContactRows<T> lost;
      EvaluateContactRows(model_, after, segment->event_lost, &lost);
      return SineBetween(lost.geometry, rows.geometry);
    }
    return segment->event == EventKind::kTouch ? rows.geometry.gap
           : segment->event == EventKind::kReturn
               ? RelativeSpeed(after, contact.a, rows.normal_a, contact.b, rows.normal_b)
               : SlipOf(after, contact, rows);
  }

  // The rate at which the event's equation changes with the segment's length, and the sum of the
  // magnitudes of its terms.
  struct Rate {
    double value = 0.0;
    double terms = 0.0;
  };

  // The rate from the map and the equation themselves: first with the length as the only variable
  // of the map, then with the time and each part of the state that the length changes as a variable
  // of the equation.
  Rate RateOf(Segment* segment) const {
    const Model<T> constant{model_.structure, JetsOf(values_.parameters)};
    EventReplay replay(constant, values_, route_);
    State<T> by_length;
    T tau(segment->length);
    tau.v[0] = 1.0;
    replay.Map(segment, JetsOf(segment->before), T(segment->time), tau, &by_length);
    State<T> after = JetsOf(segment->after);
    T time(segment->time + segment->length);
    std::vector<std::pair<T*, double>> moving = {{&time, 1.0}};
    for (size_t i = 0; i < after.pose.size(); ++i) {
      if (ReadsBody(*segment, static_cast<int>(i / 3))) {
        moving.emplace_back(&after.pose[i], by_length.pose[i].v[0]);
        moving.emplace_back(&after.twist[i], by_length.twist[i].v[0]);
      }
    }
    Rate rate;
    for (size_t first = 0; first < moving.size(); first += kWidth) {
      const size_t last = std::min(first + kWidth, moving.size());
      for (size_t i = first; i < last; ++i) {
        moving[i].first->v[static_cast<int>(i - first)] = moving[i].second;
      }
      const T equation = replay.Equation(segment, after, time);
      rate.value += equation.v.sum();
      rate.terms += equation.v.cwiseAbs().sum();
      for (size_t i = first; i < last; ++i) {
        moving[i].first->v.setZero();
      }
    }
    return rate;
  }

  // Whether the equation of a segment's event depends on a body's pose and twist: accelerations
  // depend on all.
  static bool ReadsBody(const Segment& segment, int body) {
    return segment.event == EventKind::kLiftOff || segment.event == EventKind::kSlipBegins ||
           segment.event == EventKind::kSupportLetsGo || body == segment.event_contact.a ||
           body == segment.event_contact.b;
  }

  static std::vector<T> JetsOf(const std::vector<double>& values) {
    return std::vector<T>(values.begin(), values.end());
  }
  static State<T> JetsOf(const State<double>& state) {
    State<T> jets;
    jets.pose = JetsOf(state.pose);
    jets.twist = JetsOf(state.twist);
    jets.servo_modes = state.servo_modes;
    jets.released = state.released;
    jets.supports = state.supports;
    return jets;
  }

  // The length at whose end the event's equation holds, and the state there: Newton's iteration for
  // the derivatives of `tau`, whose value the step in double has found.
  void LocateEvent(Segment* segment, const State<T>& before, const T& now, T* tau,
                   State<T>* after) {
    const Rate rate = RateOf(segment);
    Map(segment, before, now, *tau, after);
    if (!segment->HasRate(rate.value, rate.terms)) return;
    using Derivatives = Eigen::Array<double, kWidth, 1>;
    Derivatives first;
    double last = HUGE_VAL;
    for (int k = 0; k < kMostLocations; ++k) {
      const Derivatives change = Equation(segment, *after, T(now + *tau)).v.array() / rate.value;
      first = k == 0 ? Derivatives(change.abs()) : first;
      const double share = (first > 0.0).select(change.abs() / first, 0.0).maxCoeff();
      // A change that no longer falls is rounding.
      if (share <= kLocatedDerivative || share > 0.5 * last) {
        return;
      }
      last = share;
      tau->v -= change.matrix();
      Map(segment, before, now, *tau, after);
    }
  }

  // Between two edges at one instant: x⁺ = x + (v, a) τ with the accelerations that are known.
  void PassEdge(const Segment& segment, const T& tau, State<T>* state) const {
    for (size_t i = 0; i < state->pose.size(); ++i) {
      state->pose[i].v += segment.before.twist[i] * tau.v;
    }
    const std::vector<double>& a = segment.stages[0].solution.motion;
    for (int k = 0; k < s_.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        state->twist[3 * s_.moving[k] + i].v += a[3 * k + i] * tau.v;
      }
    }
  }

  void RunSegment(Segment* segment, T* now, State<T>* state) {
    const double end = segment->time + segment->length;
    T tau(segment->length);
    State<T> after;
    if (segment->IsEventLocated()) {
      LocateEvent(segment, *state, *now, &tau, &after);
    } else {
      if (segment->event_number >= 0) {
        tau = model_.parameters[segment->event_number] - *now;
      } else if (!segment->IsEventAtOnce()) {
        tau = end - *now;
      }
      tau.a = segment->length;
      if (segment->further_edges.empty()) {
        Map(segment, *state, *now, tau, &after);
      } else {
        after = *state;
        PassEdge(*segment, tau, &after);
      }
    }
    *now += tau;
    now->a = end;
    segment->end_dot = now->v.transpose();
    *state = std::move(after);
  }

  const Model<T>& model_;
  const Model<double>& values_;
  const ModelStructure& s_;
  const JetRoute route_;
  ImplicitStage implicit_;
  std::vector<T> compression_;  // normal impulses of the last impact
};

}  // namespace

template <typename T>
void EventStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                     EventRecord* record, State<T>* state) {
  EventReplay<T>(model, values, route).Run(record, state);
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                           \
  template void EventStepInJets<Jet<N>>(const Model<Jet<N>>&, const Model<double>&, JetRoute, \
                                        EventRecord*, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
