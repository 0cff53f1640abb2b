// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_derivative.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/jacobian/contact_gradient.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/events/event_rows_inl.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

using Row = Eigen::RowVectorXd;

Eigen::Vector3d BlockOf(const std::vector<double>& values, int block) {
  return Eigen::Vector3d(values[3 * block], values[3 * block + 1], values[3 * block + 2]);
}

// The rows of the state at stage i: the derivatives of x + c τ v + τ² Σ â A and so on. `a_dot[j]`
// are the stages' derivatives, one for each of `terms`.
void PlaceTangent(const Model<double>& model, const Segment& segment, double c, const double* a,
                  const double* a_hat, int terms, const Row& tau_dot, const RowMatrixXd& x,
                  const RowMatrixXd* a_dot, RowMatrixXd* out) {
  const ModelStructure& s = *model.structure;
  const double tau = segment.length;
  const int time = TimeVariable(s);
  // The model's numbers are the same in all stages.
  if (out->rows() != x.rows() || out->cols() != x.cols()) *out = x;
  out->topRows(s.ParameterVariable(0)) = x.topRows(s.ParameterVariable(0));
  out->row(time) = x.row(time) + c * tau_dot;
  for (int body = 0; body < s.num_bodies(); ++body) {
    if (s.bodies[body].motion == Motion::kStatic) {
      continue;
    }
    auto pose = PoseRows(s, body, *out);
    const Eigen::Vector3d v = BlockOf(segment.before.twist, body);
    pose += c * tau * TwistRows(s, body, x) + c * v * tau_dot;
    const int block = s.bodies[body].block;
    if (block < 0) {
      continue;
    }
    auto twist = TwistRows(s, body, *out);
    for (int j = 0; j < terms; ++j) {
      const Eigen::Vector3d value = BlockOf(segment.stages[j].solution.motion, block);
      if (a[j] != 0.0) {
        twist += a[j] * (tau * BlockRows(block, a_dot[j]) + value * tau_dot);
      }
      if (a_hat[j] != 0.0) {
        pose += a_hat[j] * (tau * tau * BlockRows(block, a_dot[j]) + 2.0 * tau * value * tau_dot);
      }
    }
  }
  FollowPathsTangent(model, segment.time + c * tau, segment.middle, out);
}

}  // namespace

template <typename Sink>
void EventDerivative::Visit(const Model<double>& model, const Segment& segment,
                            const SolvedNode& node, bool correction, const Sink& sink) {
  if (listed_ != &node) {
    VisitJacobian(model, ViewOf(segment, node, correction), JacobianRoute::kByHand, &scratch_,
                  sink);
    return;
  }
  for (const JacobianEntry& entry : entries_) {
    sink(entry.row, entry.variable, entry.value);
  }
}

void EventDerivative::List(const Model<double>& model, const Segment& segment,
                           const SolvedNode* node) {
  listed_ = node;
  entries_.clear();
  if (node != nullptr) {
    VisitJacobian(model, ViewOf(segment, *node, false), JacobianRoute::kByHand, &scratch_,
                  EntryListSink{&entries_});
  }
}

double EventDerivative::NodeTangent(const Model<double>& model, const Segment& segment,
                                    SolvedNode* node, bool correction, const RowMatrixXd& x,
                                    RowMatrixXd* solved, const Row* tau_dot) {
  const int columns = static_cast<int>(x.cols());
  solved->setZero(3 * static_cast<Eigen::Index>(node->system.num_blocks()), columns);
  Visit(model, segment, *node, correction,
        TangentSink{x.data(), solved->data(), columns, fixed_.empty() ? nullptr : fixed_.data()});
  // A contact in penetration moves by recovery_speed times the segment's length, in the first
  // correction.
  for (size_t i = 0; tau_dot != nullptr && i < segment.contacts.size(); ++i) {
    const int block = node->system.contact_block()[i];
    if (segment.contacts[i].law == ContactLaw::kRecovery && block >= 0) {
      solved->row(3 * block) += model.structure->settings.recovery_speed * *tau_dot;
    }
  }
  return node->system.Solve(node->problem, node->solution.modes, solved->data(), columns);
}

double EventDerivative::NodeAdjoint(const Model<double>& model, const Segment& segment,
                                    SolvedNode* node, bool correction, RowMatrixXd* seed,
                                    RowMatrixXd* w_bar) {
  const int columns = static_cast<int>(w_bar->cols());
  const double residual =
      node->system.SolveTransposed(node->problem, node->solution.modes, seed->data(), columns);
  if (columns == 1) {
    Visit(model, segment, *node, correction, SingleAdjointSink{seed->data(), w_bar->data()});
  } else {
    Visit(model, segment, *node, correction, AdjointSink{seed->data(), w_bar->data(), columns});
  }
  return residual;
}

// The tangent of the map of a given length: x of the state before on entry, after on return;
// tau_dot has an entry for each column.
double EventDerivative::SegmentTangent(const Model<double>& model, Segment* segment, RowMatrixXd* x,
                                       const Row& tau_dot) {
  const ModelStructure& s = *model.structure;
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(s.settings));
  RowMatrixXd a_dot[NystromTableau::kMost];
  RowMatrixXd place, solved;
  double left = 0.0;
  for (int i = 0; i < tableau.stages; ++i) {
    const bool implicit = tableau.last_is_implicit && i + 1 == tableau.stages;
    const auto evaluate = [&](int terms, RowMatrixXd* next) {
      PlaceTangent(model, *segment, tableau.c[i], tableau.a[i], tableau.a_hat[i], terms, tau_dot,
                   *x, a_dot, &place);
      left =
          std::max(left, NodeTangent(model, *segment, &segment->stages[i], false, place, &solved));
      *next = solved.topRows(3 * s.num_blocks());
    };
    if (!implicit) {
      evaluate(i, &a_dot[i]);
      continue;
    }
    List(model, *segment, &segment->stages[i]);
    RowMatrixXd own = a_dot[i - 1];
    const auto map = [&](const RowMatrixXd& at, RowMatrixXd* next) {
      a_dot[i] = at;
      evaluate(i + 1, next);
    };
    // A derivative that has not converged is used, and the certificate reports it.
    left = std::max(left, implicit_.SolveDerivative(model, segment,
                                                    ImplicitStage::Direction::kForward, map, &own));
    a_dot[i].swap(own);
  }
  List(model, *segment, nullptr);
  PlaceTangent(model, *segment, 1.0, tableau.b, tableau.b_hat, tableau.stages, tau_dot, *x, a_dot,
               &place);
  x->swap(place);
  for (int k = 0; k < segment->num_corrections; ++k) {
    RowMatrixXd correction;
    left = std::max(left, NodeTangent(model, *segment, &segment->corrections[k], true, *x,
                                      &correction, k == 0 ? &tau_dot : nullptr));
    for (int block = 0; block < s.num_blocks(); ++block) {
      PoseRows(s, s.moving[block], *x) += BlockRows(block, correction);
    }
  }
  if (segment->projects_twists) {
    left = std::max(left, ImpulsesTangent(model, &segment->projection, x));
  }
  return left;
}

// ∇g over all variables and the time, of the event that ends the segment.
double EventDerivative::EventGradient(const Model<double>& model, Segment* segment,
                                      Eigen::VectorXd* gradient) {
  const ModelStructure& s = *model.structure;
  double residual = 0.0;
  gradient->setZero(s.num_variables() + 1);
  std::vector<JacobianEntry> entries;
  if (segment->passes) {
    AddPassingGradient(model, segment->after, segment->event_lost, segment->event_contact,
                       &scratch_, &entries);
  } else if (segment->event == EventKind::kTouch) {
    AddGapGradient(model, segment->after, segment->event_contact, &scratch_, &entries);
  } else if (segment->event == EventKind::kReturn) {
    AddApproachGradient(model, segment->after, segment->event_contact, &scratch_, &entries);
  } else if (segment->event == EventKind::kSlipEnds) {
    AddSlipGradient(model, segment->after, segment->event_contact, &scratch_, &entries);
  } else if (segment->event == EventKind::kServoBound) {
    AddServoGradient(model, segment->after, segment->event_index, segment->event_sign,
                     segment->time + segment->length, segment->middle, &scratch_, &entries);
  } else if (segment->event == EventKind::kSupportStops) {
    AddSupportProgressGradient(model, segment->after, segment->event_index,
                               segment->before.supports[static_cast<size_t>(segment->event_index)],
                               &scratch_, &entries);
  } else if (segment->event == EventKind::kSupportLetsGo) {
    residual = AddLetsGoGradient(model, segment, gradient, &entries);
  } else {
    // Lift-off has g = λn; slip begins at g = Σ (μ λn − sign λt) over contacts that stick together.
    SolvedNode& node = segment->end;
    RowMatrixXd seed =
        RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(node.system.num_blocks()), 1);
    const std::vector<int>& block_of = node.system.contact_block();
    const auto add_friction = [&](const CoefficientSource& friction, double force) {
      for (int k = 0; k < 2; ++k) {
        if (friction.numbers[k] < 0) continue;
        entries.push_back(
            {0, s.ParameterVariable(friction.numbers[k]), friction.derivatives[k] * force});
      }
    };
    for (size_t i = 0; i < segment->release.size(); ++i) {
      const ReleaseRate& rate = segment->release[i];
      if (rate.opens == 0.0 && rate.slides == 0.0) continue;
      const double slides = std::abs(rate.slides);
      seed(3 * block_of[segment->NormalOf(i)], 0) +=
          rate.opens + slides * segment->friction[i].value;
      if (slides == 0.0) continue;
      seed(3 * block_of[i] + 1, 0) = rate.slides;
      add_friction(segment->friction[i], slides * node.solution.normal_impulse[i]);
    }
    const bool is_single = segment->release.empty();
    if (is_single && segment->event == EventKind::kLiftOff) {
      seed(3 * block_of[segment->event_index], 0) = 1.0;
    }
    for (size_t i = 0; i < segment->contacts.size(); ++i) {
      if (!is_single || segment->event != EventKind::kSlipBegins ||
          !segment->SticksWith(i, segment->event_index)) {
        continue;
      }
      const CoefficientSource& friction = segment->event_friction;
      seed(3 * block_of[segment->NormalOf(i)], 0) += friction.value;
      seed(3 * block_of[i] + 1, 0) = -segment->event_sign;
      add_friction(friction, node.solution.normal_impulse[i]);
    }
    RowMatrixXd w_bar = RowMatrixXd::Zero(s.num_variables() + 1, 1);
    residual = NodeAdjoint(model, *segment, &node, false, &seed, &w_bar);
    *gradient += w_bar.col(0);
  }
  for (const JacobianEntry& entry : entries) {
    (*gradient)(entry.variable) += entry.value;
  }
  return residual;
}

// Of what is left of what a support can hold, by the forces of its rows.
double EventDerivative::AddLetsGoGradient(const Model<double>& model, Segment* segment,
                                          Eigen::VectorXd* gradient,
                                          std::vector<JacobianEntry>* entries) {
  const ModelStructure& s = *model.structure;
  SolvedNode& node = segment->end;
  const int k = segment->event_index;
  const int joint = static_cast<int>(s.joints.size()) + k;
  double by_wrench[3];
  AddSupportReserveGradient(
      model, segment->after, k, segment->before.supports[static_cast<size_t>(k)].holds,
      segment->event_support, &node.solution.joint_impulse[3 * static_cast<size_t>(joint)],
      &scratch_, by_wrench, entries);
  RowMatrixXd seed = RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(node.system.num_blocks()), 1);
  for (int r = 0; r < node.problem.joints[static_cast<size_t>(joint)].rows; ++r) {
    seed(3 * (s.num_blocks() + joint) + r, 0) = by_wrench[r];
  }
  RowMatrixXd w_bar = RowMatrixXd::Zero(s.num_variables() + 1, 1);
  const double residual = NodeAdjoint(model, *segment, &node, false, &seed, &w_bar);
  *gradient += w_bar.col(0);
  return residual;
}

EventDerivative::Rate EventDerivative::EventRate(const Model<double>& model, Segment* segment) {
  Rate rate;
  if (!segment->IsEventLocated()) {
    return rate;
  }
  fixed_.clear();
  RowMatrixXd by_length = RowMatrixXd::Zero(model.structure->num_variables() + 1, 1);
  SegmentTangent(model, segment, &by_length, Row::Ones(1));
  Eigen::VectorXd gradient;
  rate.residual = EventGradient(model, segment, &gradient);
  rate.terms = gradient.cwiseAbs().dot(by_length.col(0).cwiseAbs());
  rate.value = gradient.dot(by_length.col(0));
  return rate;
}

RowMatrixXd EventDerivative::AlongSegment(const Model<double>& model, Segment* segment,
                                          const RowMatrixXd& directions) {
  RowMatrixXd x = RowMatrixXd::Zero(model.structure->num_variables() + 1, directions.cols());
  x.topRows(directions.rows()) = directions;
  fixed_.clear();
  SegmentTangent(model, segment, &x, Row::Zero(directions.cols()));
  return x.topRows(directions.rows());
}

double EventDerivative::Tangent(const Model<double>& model, EventRecord* record,
                                RowMatrixXd* w_dot) {
  const ModelStructure& s = *model.structure;
  const Eigen::Index columns = w_dot->cols();
  const int time = TimeVariable(s);
  // One more column holds the derivative with respect to the segment's length.
  RowMatrixXd x = RowMatrixXd::Zero(s.num_variables() + 1, columns + 1);
  x.topLeftCorner(s.num_variables(), columns) = *w_dot;
  // Numbers of the model stay as they are through the step.
  fixed_.assign(static_cast<size_t>(x.rows()), 0);
  for (int variable = s.ParameterVariable(0); variable < s.num_variables(); ++variable) {
    fixed_[variable] = (w_dot->row(variable).array() == 0.0).all() ? 1 : 0;
  }
  Row length_seed = Row::Zero(columns + 1);
  length_seed(columns) = 1.0;
  double residual = 0.0;
  for (int p = 0; p < record->num_parts; ++p) {
    EventPart& part = *record->parts[p];
    FollowPathsTangent(model, part.time(), part.inside(), &x);
    if (part.is_impulses) {
      residual = std::max(residual, ImpulsesTangent(model, &part.impulses, &x));
      continue;
    }
    Segment& segment = part.segment;
    x.col(columns).setZero();
    const Row start = x.row(time);
    residual = std::max(residual, SegmentTangent(model, &segment, &x, length_seed));
    Row tau_dot = Row::Zero(columns + 1);
    if (segment.IsEventLocated()) {
      Eigen::VectorXd gradient;
      residual = std::max(residual, EventGradient(model, &segment, &gradient));
      const Row g_dot = gradient.transpose() * x;
      const double terms = gradient.cwiseAbs().dot(x.col(columns).cwiseAbs());
      if (segment.HasRate(g_dot(columns), terms)) {
        tau_dot = -g_dot / g_dot(columns);
      }
    } else if (!segment.IsEventAtOnce()) {
      tau_dot = -start;
      if (segment.event_number >= 0) {
        tau_dot += x.row(s.ParameterVariable(segment.event_number));
      }
    }
    tau_dot(columns) = 0.0;
    // ẋ⁺ = Ṡ|τ + S_τ τ̇
    x += (x.col(columns) * tau_dot).eval();
    segment.end_dot = x.row(time).head(columns);
  }
  *w_dot = x.topLeftCorner(s.num_variables(), columns);
  return residual;
}

// The reverse sweep through the stages: w_bar of the integrated state on entry, of the state before
// on return.
void EventDerivative::StagesAdjoint(const Model<double>& model, Segment* segment,
                                    RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  const NystromTableau& tableau = NystromTableau::Of(IntegratorOf(s.settings));
  const Eigen::Index columns = w_bar->cols();
  const double tau = segment->length;
  FollowPathsAdjoint(model, segment->time + tau, segment->middle, w_bar);
  // Adds the contribution of A_j to the adjoint at q + τ² Σ â_j A_j, v + τ Σ a_j A_j.
  const auto add_share = [&](double a, double a_hat, const RowMatrixXd& from, RowMatrixXd* bar) {
    for (int k = 0; k < s.num_blocks(); ++k) {
      BlockRows(k, *bar) += tau * tau * a_hat * PoseRows(s, s.moving[k], from) +
                            tau * a * TwistRows(s, s.moving[k], from);
    }
  };
  RowMatrixXd a_bar[NystromTableau::kMost];
  for (int j = 0; j < tableau.stages; ++j) {
    a_bar[j].setZero(3 * s.num_blocks(), columns);
    add_share(tableau.b[j], tableau.b_hat[j], *w_bar, &a_bar[j]);
  }
  // v̄ = v̄⁺ + c τ q̄, for all moving bodies.
  const auto add_to_twist = [&](double factor, const RowMatrixXd& from) {
    for (int body = 0; body < s.num_bodies(); ++body) {
      if (s.bodies[body].motion != Motion::kStatic) {
        TwistRows(s, body, *w_bar) += factor * PoseRows(s, body, from);
      }
    }
  };
  add_to_twist(tau, RowMatrixXd(*w_bar));
  for (int i = tableau.stages - 1; i >= 0; --i) {
    SolvedNode& stage = segment->stages[i];
    const bool implicit = tableau.last_is_implicit && i + 1 == tableau.stages;
    const auto solve = [&](const RowMatrixXd& of_bodies, RowMatrixXd* stage_bar) {
      RowMatrixXd seed =
          RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(stage.system.num_blocks()), columns);
      seed.topRows(3 * s.num_blocks()) = of_bodies;
      stage_bar->setZero(s.num_variables() + 1, columns);
      NodeAdjoint(model, *segment, &stage, false, &seed, stage_bar);
    };
    RowMatrixXd stage_bar;
    RowMatrixXd own = a_bar[i];
    if (implicit) {
      // The stage depends on its own acceleration: ā = ā₀ + (τ² â q̄ + τ a v̄)(ā), a fixed point.
      List(model, *segment, &stage);
      const auto map = [&](const RowMatrixXd& at, RowMatrixXd* next) {
        solve(at, &stage_bar);
        *next = a_bar[i];
        add_share(tableau.a[i][i], tableau.a_hat[i][i], stage_bar, next);
      };
      implicit_.SolveDerivative(model, segment, ImplicitStage::Direction::kTransposed, map, &own);
    }
    solve(own, &stage_bar);
    List(model, *segment, nullptr);
    FollowPathsAdjoint(model, segment->time + tableau.c[i] * tau, segment->middle, &stage_bar);
    for (int j = 0; j < i; ++j) {
      add_share(tableau.a[i][j], tableau.a_hat[i][j], stage_bar, &a_bar[j]);
    }
    add_to_twist(tableau.c[i] * tau, stage_bar);
    *w_bar += stage_bar;
  }
}

void EventDerivative::SegmentAdjoint(const Model<double>& model, Segment* segment,
                                     bool starts_anywhere, RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  const Eigen::Index columns = w_bar->cols();
  const bool located = segment->IsEventLocated();
  if (segment->end_bar.size() == columns) w_bar->row(TimeVariable(s)) += segment->end_bar;
  segment->end_bar.resize(0);
  RowMatrixXd by_length = RowMatrixXd::Zero(s.num_variables() + 1, 1);
  Row alpha = Row::Zero(columns);
  if (located || segment->event_number >= 0 || starts_anywhere) {
    SegmentTangent(model, segment, &by_length, Row::Ones(1));
    alpha = by_length.col(0).transpose() * *w_bar;
  }
  if (located) {
    Eigen::VectorXd gradient;
    EventGradient(model, segment, &gradient);
    const double rate = gradient.dot(by_length.col(0));
    const double terms = gradient.cwiseAbs().dot(by_length.col(0).cwiseAbs());
    if (segment->HasRate(rate, terms)) {
      *w_bar -= gradient * (alpha / rate);
    }
  } else if (!segment->IsEventAtOnce()) {
    w_bar->row(TimeVariable(s)) -= alpha;
    if (segment->event_number >= 0) {
      w_bar->row(s.ParameterVariable(segment->event_number)) += alpha;
    }
  }
  if (segment->projects_twists) {
    ImpulsesAdjoint(model, &segment->projection, w_bar);
  }
  for (int k = segment->num_corrections - 1; k >= 0; --k) {
    SolvedNode& node = segment->corrections[k];
    RowMatrixXd seed =
        RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(node.system.num_blocks()), columns);
    for (int block = 0; block < s.num_blocks(); ++block) {
      BlockRows(block, seed) = PoseRows(s, s.moving[block], *w_bar);
    }
    NodeAdjoint(model, *segment, &node, true, &seed, w_bar);
  }
  StagesAdjoint(model, segment, w_bar);
}

void EventDerivative::Adjoint(const Model<double>& model, EventRecord* record, RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  RowMatrixXd bar = RowMatrixXd::Zero(s.num_variables() + 1, w_bar->cols());
  bar.topRows(s.num_variables()) = *w_bar;
  compression_bar_.resize(0, 0);
  int first_moving = record->num_parts;  // the first segment whose end's time is not given
  for (int p = record->num_parts - 1; p >= 0; --p) {
    const EventPart& part = *record->parts[p];
    if (!part.is_impulses && (part.segment.IsEventLocated() || part.segment.event_number >= 0)) {
      first_moving = p;
    }
  }
  for (int p = record->num_parts - 1; p >= 0; --p) {
    EventPart& part = *record->parts[p];
    if (part.is_impulses) {
      ImpulsesAdjoint(model, &part.impulses, &bar);
    } else {
      SegmentAdjoint(model, &part.segment, p > first_moving, &bar);
    }
    FollowPathsAdjoint(model, part.time(), part.inside(), &bar);
  }
  *w_bar = bar.topRows(s.num_variables());
}

}  // namespace tangible
