// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/event_jets.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact_interior_point.h"
#include "tangible/lcp/dense_lu.h"
#include "tangible/simulation/implicit_residual_inl.h"
#include "tangible/simulation/segment_flow.h"

namespace tangible {
namespace {

constexpr int kMostIterations = 60;
constexpr double kNoRate = 1e-9;  // as in event_derivative.cc
// Pivots below this share of the largest: redundant rows, solved with δ and refined. Elimination
// leaves them at some thousand ε, and rounding over them is no derivative.
constexpr double kSingular = 1e-11;
constexpr double kRegularised = 1e-10;
constexpr int kRefinements = 4;
constexpr double kUnrolledComplementarity = 1e-17;

template <typename T>
double DerivativeSize(const T& x) {
  return x.v.cwiseAbs().maxCoeff();
}

template <typename T>
class EventReplay {
  static constexpr int kWidth = NumDerivatives<T>::value;

 public:
  EventReplay(const Model<T>& model, const Model<double>& values, JetRoute route,
              EventDerivative* derivative)
      : model_(model),
        values_(values),
        s_(*model.structure),
        route_(route),
        derivative_(*derivative) {}

  void Run(EventRecord* record, State<T>* state) {
    bool started = false;
    T now(0.0);
    for (int p = 0; p < record->num_parts; ++p) {
      EventPart& part = *record->parts[p];
      if (!started) {
        now = T(part.is_impulses ? part.impulses.time : part.segment.time);
        started = true;
      }
      if (part.is_impulses) {
        RunImpulses(&part.impulses, state);
      } else {
        RunSegment(&part.segment, &now, state);
      }
    }
  }

 private:
  // Solves a problem whose solution in double is known; of bodies, joints and contacts.
  void Solve(const ContactProblem<T>& problem, const ContactProblem<double>& in_double,
             const ContactSolution<double>& solution, const std::vector<double>& signs,
             ContactSystem* system, ContactSolution<T>* out) {
    if (route_ == JetRoute::kUnrolled) {
      SolveByElimination(problem, solution.modes, out);
      return;
    }
    std::vector<double> rhs(3 * static_cast<size_t>(system->num_blocks()) * kWidth, 0.0);
    const std::vector<int>& block_of = system->contact_block();
    ImplicitResidual<T>(problem, solution, signs, block_of, &rhs).Fill();
    system->Solve(in_double, solution.modes, rhs.data(), kWidth);
    const auto jet = [&](double value, size_t row) {
      T x(value);
      for (int d = 0; d < kWidth; ++d) {
        x.v[d] = rhs[row * kWidth + d];
      }
      return x;
    };
    const size_t bodies = solution.v.size();
    out->v.resize(bodies);
    for (size_t i = 0; i < bodies; ++i) {
      out->v[i] = jet(solution.v[i], i);
    }
    out->normal_impulse.assign(problem.contacts.size(), T(0.0));
    out->tangent_impulse.assign(problem.contacts.size(), T(0.0));
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      if (block_of[i] >= 0) {
        const size_t row = 3 * static_cast<size_t>(block_of[i]);
        out->normal_impulse[i] = jet(solution.normal_impulse[i], row);
        if (solution.modes[i] == ContactMode::kSticking) {
          out->tangent_impulse[i] = jet(solution.tangent_impulse[i], row + 1);
        }
      }
    }
  }

  // The mode system as a dense matrix in Jets; δ > 0 on its constraints' diagonal.
  MatrixX<T> DenseSystem(const ContactProblem<T>& p, const std::vector<ContactMode>& modes,
                         double delta, const std::vector<int>& row_of, int size) const {
    MatrixX<T> k = MatrixX<T>::Constant(size, size, T(0.0));
    const int bodies = 3 * p.num_bodies;
    for (int i = 0; i < bodies; ++i) {
      k(i, i) = p.mass[i];
    }
    for (const DamperBlock<T>& d : p.dampers) {
      AddProduct(d.a, d.row_a, d.b, d.row_b, d.weight, &k);
    }
    const auto add = [&](int row, int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b) {
      const double mobility = RowMobility(p.mass, a, row_a, b, row_b);
      k(row, row) += T(delta * mobility);
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) k(row, 3 * a + i) += row_a[i];
        if (b >= 0) k(row, 3 * b + i) += row_b[i];
      }
    };
    const auto add_force = [&](int column, int a, const RowPart<T>& row_a, int b,
                               const RowPart<T>& row_b, const T& factor) {
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) k(3 * a + i, column) -= factor * row_a[i];
        if (b >= 0) k(3 * b + i, column) -= factor * row_b[i];
      }
    };
    int row = bodies;
    for (const JointBlock<T>& joint : p.joints) {
      for (int r = 0; r < joint.rows; ++r, ++row) {
        add(row, joint.a, joint.row_a[r], joint.b, joint.row_b[r]);
        add_force(row, joint.a, joint.row_a[r], joint.b, joint.row_b[r], T(1.0));
      }
    }
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      const ContactBlock<T>& c = p.contacts[i];
      const int at = row_of[i];
      if (at < 0) {
        continue;
      }
      if (c.driven) {
        k(at, at) = T(1.0);
      } else {
        add(at, c.a, c.normal_a, c.b, c.normal_b);
      }
      add_force(at, c.a, c.normal_a, c.b, c.normal_b, T(1.0));
      if (modes[i] == ContactMode::kSticking) {
        add(at + 1, c.a, c.tangent_a, c.b, c.tangent_b);
        add_force(at + 1, c.a, c.tangent_a, c.b, c.tangent_b, T(1.0));
      } else {
        add_force(at, c.a, c.tangent_a, c.b, c.tangent_b, T(-SlidingSign(modes[i]) * c.friction));
      }
    }
    return k;
  }

  static void AddProduct(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b,
                         const T& weight, MatrixX<T>* k) {
    const int blocks[2] = {a, b};
    const RowPart<T>* rows[2] = {&row_a, &row_b};
    for (int x = 0; x < 2; ++x) {
      for (int y = 0; y < 2; ++y) {
        for (int i = 0; i < 3 && blocks[x] >= 0; ++i) {
          for (int j = 0; j < 3 && blocks[y] >= 0; ++j) {
            (*k)(3 * blocks[x] + i, 3 * blocks[y] + j) += weight * (*rows[x])[i] * (*rows[y])[j];
          }
        }
      }
    }
  }

  void SolveByElimination(const ContactProblem<T>& p, const std::vector<ContactMode>& modes,
                          ContactSolution<T>* out) {
    int size = 3 * p.num_bodies;
    for (const JointBlock<T>& joint : p.joints) {
      size += joint.rows;
    }
    std::vector<int> row_of(p.contacts.size(), -1);
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (modes[i] != ContactMode::kOpen) {
        row_of[i] = size;
        size += modes[i] == ContactMode::kSticking ? 2 : 1;
      }
    }
    VectorX<T> rhs(size);
    for (int i = 0; i < 3 * p.num_bodies; ++i) {
      rhs[i] = p.momentum[i];
    }
    int row = 3 * p.num_bodies;
    for (const JointBlock<T>& joint : p.joints) {
      for (int r = 0; r < joint.rows; ++r, ++row) {
        rhs[row] = joint.rhs[r];
      }
    }
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (row_of[i] >= 0) {
        rhs[row_of[i]] = p.contacts[i].driven ? p.contacts[i].offset : -p.contacts[i].c_n;
        if (modes[i] == ContactMode::kSticking) {
          rhs[row_of[i] + 1] = -p.contacts[i].c_t;
        }
      }
    }
    const MatrixX<T> exact = DenseSystem(p, modes, 0.0, row_of, size);
    DenseLu<T> lu;
    VectorX<T> x;
    if (lu.Compute(exact) && lu.pivot_ratio() > kSingular) {
      x = lu.Solve(rhs);
    } else {
      lu.Compute(DenseSystem(p, modes, kRegularised, row_of, size));
      x = lu.Solve(rhs);
      for (int k = 0; k < kRefinements; ++k) {
        VectorX<T> left(size);
        for (int i = 0; i < size; ++i) {
          left[i] = rhs[i];
          for (int j = 0; j < size; ++j) {
            left[i] -= exact(i, j) * x[j];
          }
        }
        x += lu.Solve(left);
      }
    }
    out->v.resize(3 * p.num_bodies);
    for (int i = 0; i < 3 * p.num_bodies; ++i) {
      out->v[i] = x[i];
    }
    out->normal_impulse.assign(p.contacts.size(), T(0.0));
    out->tangent_impulse.assign(p.contacts.size(), T(0.0));
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (row_of[i] >= 0) {
        out->normal_impulse[i] = x[row_of[i]];
        if (modes[i] == ContactMode::kSticking) {
          out->tangent_impulse[i] = x[row_of[i] + 1];
        }
      }
    }
  }

  void SetTwists(const std::vector<T>& solved, State<T>* state) const {
    for (int k = 0; k < s_.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        state->twist[3 * s_.moving[k] + i] = solved[3 * k + i];
      }
    }
  }

  void RunImpulses(Impulses* impulses, State<T>* state, bool is_impact = true) {
    ContactSolution<T> solution;
    SolveImpulses(impulses, *state, is_impact, &solution);
    SetTwists(solution.v, state);
    compression_ = solution.normal_impulse;
  }

  // Of a decompression: e times the impulses of the part before.
  void SetOffsets(const Impulses& impulses, ContactProblem<T>* problem) const {
    for (size_t i = 0; i < impulses.contacts.size(); ++i) {
      ContactBlock<T>& contact = problem->contacts[i];
      contact.driven = impulses.problem.contacts[i].driven;
      if (contact.driven) {
        const T e = EvaluateCoefficient(impulses.restitution[i], model_.numbers);
        contact.offset = e * compression_[impulses.compressed[i]];
      }
    }
  }

  void SolveImpulses(Impulses* impulses, const State<T>& state, bool is_impact,
                     ContactSolution<T>* solution) {
    ContactProblem<T> problem;
    AssemblyScratch<T> scratch;
    AssembleFree(model_, state, impulses->time, impulses->h, &problem, &scratch, false);
    AssembleContacts(model_, state, impulses->h, impulses->contacts, impulses->friction,
                     impulses->restitution, scratch, &problem);
    if (impulses->decompression) {
      SetOffsets(*impulses, &problem);
    } else if (route_ == JetRoute::kUnrolled && is_impact) {
      InteriorPointWorkspace<T> workspace;
      ContactInteriorPointOptions options;
      options.complementarity = kUnrolledComplementarity;
      const bool converged =
          SolveContactsByInteriorPoint(problem, options, &workspace, solution).converged;
      double difference = 0.0;
      double size = 0.0;
      for (size_t i = 0; i < impulses->solution.v.size(); ++i) {
        difference =
            std::max(difference, std::abs(ValueOf(solution->v[i]) - impulses->solution.v[i]));
        size = std::max(size, std::abs(impulses->solution.v[i]));
      }
      // Where impulses are not unique, or it stalls, the modes that the step found are eliminated.
      if (converged && difference <= 1e-9 * size) {
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
    AccelerationScratch<T> scratch;
    AssembleAcceleration(model_, state, time, segment.middle, segment.contacts, segment.friction,
                         &scratch, &problem);
    std::vector<double> signs(segment.contacts.size(), 0.0);
    for (size_t i = 0; i < signs.size(); ++i) {
      signs[i] = SlidingSign(segment.modes[i]);
      if (segment.modes[i] == ContactMode::kClosed && segment.contacts[i].joint < 0) {
        signs[i] = SlipSign(segment.contacts[i], node->state);
      }
    }
    Solve(problem, node->problem, node->solution, signs, &node->system, out);
  }

  double SlipSign(const ActiveContact& contact, const State<double>& state) const {
    constexpr double kRounding = 1e-12;
    ContactRows<double> rows;
    EvaluateContactRows(values_, state, contact, &rows);
    double slip = 0.0;
    double terms = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double on_a = rows.tangent_a[i] * state.twist[3 * contact.a + i];
      const double on_b = rows.tangent_b[i] * state.twist[3 * contact.b + i];
      slip += on_a + on_b;
      terms += std::abs(on_a) + std::abs(on_b);
    }
    return std::abs(slip) <= kRounding * terms ? 0.0 : slip > 0.0 ? 1.0 : -1.0;
  }

  void Place(const State<T>& before, const T& tau, double c, const double* a, const double* a_hat,
             int terms, const std::vector<ContactSolution<T>>& stages, State<T>* out) const {
    *out = before;
    for (size_t i = 0; i < out->pose.size(); ++i) {
      out->pose[i] += c * tau * before.twist[i];
    }
    for (int j = 0; j < terms; ++j) {
      for (int k = 0; k < s_.num_blocks(); ++k) {
        for (int i = 0; i < 3; ++i) {
          const int at = 3 * s_.moving[k] + i;
          out->pose[at] += a_hat[j] * tau * tau * stages[j].v[3 * k + i];
          out->twist[at] += a[j] * tau * stages[j].v[3 * k + i];
        }
      }
    }
  }

  // A ← A + (I − B)⁻¹ (N − A) of values and derivatives.
  void NewtonStep(const ContactSolution<T>& next, ContactSolution<T>* stage) const {
    RowMatrixXd step(static_cast<Eigen::Index>(next.v.size()), kWidth + 1);
    for (size_t k = 0; k < next.v.size(); ++k) {
      const T left = next.v[k] - stage->v[k];
      step(static_cast<Eigen::Index>(k), 0) = ValueOf(left);
      step.row(static_cast<Eigen::Index>(k)).tail(kWidth) = left.v.transpose();
    }
    implicit_.Solve(&step);
    for (size_t k = 0; k < next.v.size(); ++k) {
      T change(step(static_cast<Eigen::Index>(k), 0));
      change.v = step.row(static_cast<Eigen::Index>(k)).tail(kWidth).transpose();
      stage->v[k] += change;
    }
  }

  void Map(Segment* segment, const State<T>& before, const T& time, const T& tau, State<T>* after) {
    const NystromTableau& tableau = NystromTableau::Of(s_.settings.integrator);
    std::vector<ContactSolution<T>> stages(tableau.stages);
    State<T> state;
    for (int i = 0; i < tableau.stages; ++i) {
      const bool implicit = tableau.last_is_implicit && i + 1 == tableau.stages;
      if (implicit) {
        stages[i] = stages[i - 1];
      }
      FixedPoint fixed_point;
      for (int iteration = 0; iteration < kMostIterations; ++iteration) {
        Place(before, tau, tableau.c[i], tableau.a[i], tableau.a_hat[i], implicit ? i + 1 : i,
              stages, &state);
        ContactSolution<T> next;
        Accelerate(*segment, state, T(time + tableau.c[i] * tau), &segment->stages[i], &next);
        double change = 0.0;
        double size = 0.0;
        for (size_t k = 0; implicit && k < next.v.size(); ++k) {
          change = std::max({change, DerivativeSize(T(next.v[k] - stages[i].v[k])),
                             std::abs(ValueOf(next.v[k]) - ValueOf(stages[i].v[k]))});
          size = std::max({size, DerivativeSize(next.v[k]), std::abs(ValueOf(next.v[k]))});
        }
        if (!implicit || fixed_point.Arrived(change, size)) {
          stages[i] = next;
          break;
        }
        if (iteration < kMostFixedPoints) {
          stages[i] = next;
        } else if (iteration == kMostFixedPoints) {
          const double length = ValueOf(tau);
          implicit_.Factor(values_, *segment, &segment->stages[i], length * tableau.a[i][i],
                           length * length * tableau.a_hat[i][i]);
          stages[i] = stages[i - 1];  // the iteration may have diverged
        } else {
          NewtonStep(next, &stages[i]);
        }
      }
    }
    Place(before, tau, 1.0, tableau.b, tableau.b_hat, tableau.stages, stages, after);
    Correct(segment, tau, after);
    if (segment->projects_twists) {
      RunImpulses(&segment->projection, after, false);
    }
  }

  void Correct(Segment* segment, const T& tau, State<T>* after) {
    for (int k = 0; k < segment->num_corrections; ++k) {
      SolvedNode& node = segment->corrections[k];
      ContactProblem<T> problem;
      AccelerationScratch<T> scratch;
      AssembleCorrection(model_, *after, segment->contacts, segment->friction,
                         k == 0 ? T(s_.settings.recovery_speed * tau) : T(0.0), &scratch, &problem);
      ContactSolution<T> correction;
      Solve(problem, node.problem, node.solution,
            std::vector<double>(segment->contacts.size(), 0.0), &node.system, &correction);
      for (int b = 0; b < s_.num_blocks(); ++b) {
        for (int i = 0; i < 3; ++i) {
          after->pose[3 * s_.moving[b] + i] += correction.v[3 * b + i];
        }
      }
    }
  }

  // The event's equation at the state after.
  T Equation(Segment* segment, const State<T>& after, const T& time) {
    const ActiveContact& contact = segment->event_contact;
    if (segment->event == EventKind::kLiftOff || segment->event == EventKind::kSlipBegins) {
      ContactSolution<T> solution;
      Accelerate(*segment, after, time, &segment->end, &solution);
      if (segment->event == EventKind::kLiftOff) {
        return solution.normal_impulse[segment->event_index];
      }
      return segment->FrictionLeft<T>(segment->event_index,
                                      EvaluateCoefficient(segment->event_friction, model_.numbers),
                                      segment->event_sign, solution);
    }
    ContactRows<T> rows;
    if (contact.joint >= 0) {
      const JointIndex& joint = s_.joints[contact.joint];
      JointRows<T> joint_rows;
      EvaluateJoint(joint.type, after.PoseOf(joint.a), after.PoseOf(joint.b),
                    &model_.numbers[joint.geometry], &joint_rows);
      EvaluateLimitRows(model_, joint_rows, contact, &rows);
    } else {
      EvaluateContactRows(model_, after, contact, &rows);
    }
    return segment->event == EventKind::kTouch ? rows.geometry.gap
           : segment->event == EventKind::kReturn
               ? RelativeSpeed(after, contact.a, rows.normal_a, contact.b, rows.normal_b)
               : RelativeSpeed(after, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
  }

  void RunSegment(Segment* segment, T* now, State<T>* state) {
    const double end = segment->time + segment->length;
    T tau(segment->length);
    State<T> after;
    if (IsLocated(segment->event)) {
      double terms;
      const double rate = derivative_.EventRate(values_, segment, &terms);
      if (std::abs(rate) > kNoRate * terms) {
        Map(segment, *state, *now, tau, &after);
        tau -= (Equation(segment, after, T(*now + tau)) -
                ValueOf(Equation(segment, after, T(*now + tau)))) /
               rate;
      }
    } else if (segment->event_number >= 0) {
      tau = model_.numbers[segment->event_number] - *now;
    } else if (segment->event != EventKind::kAtOnce) {
      tau = end - *now;
    }
    tau.a = segment->length;
    Map(segment, *state, *now, tau, &after);
    *now += tau;
    now->a = end;
    *state = after;
  }

  const Model<T>& model_;
  const Model<double>& values_;
  const ModelStructure& s_;
  const JetRoute route_;
  EventDerivative& derivative_;
  ImplicitStage implicit_;
  std::vector<T> compression_;  // normal impulses of the last impact
};

}  // namespace

template <typename T>
void EventStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                     EventRecord* record, EventDerivative* derivative, State<T>* state) {
  EventReplay<T>(model, values, route, derivative).Run(record, state);
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                           \
  template void EventStepInJets<Jet<N>>(const Model<Jet<N>>&, const Model<double>&, JetRoute, \
                                        EventRecord*, EventDerivative*, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
