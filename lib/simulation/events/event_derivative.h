// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tangent and adjoint of an event step.
//
// Each segment is a map x⁺ = S(x, w, t, τ) of its length τ. The event at its end, g(x⁺, w, t + τ) =
// 0, makes τ a function of the other variables (implicit function theorem):
//   τ̇ = −(∇g · Ṡ|τ) / (∇g · S_τ),   ẋ⁺ = Ṡ|τ + S_τ τ̇
// and the time t + τ at which the next segment starts moves with it, so that the segment that ends
// the step has τ̇ = −ṫ. In the limit of small segments this is the saltation matrix of hybrid
// systems (Leine, Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, ch.
// 7), which for an event g and an impact x⁺ = R(x⁻) that do not depend on time is:
//   Ξ = R_x + (f⁺ − R_x f⁻) ∇gᵀ / (∇g · f⁻)
// Here ∇g is EventGradient, f⁻ the column S_τ, R_x ImpulsesTangent, and f⁺ comes from the later
// start of the next segment. The adjoint is the transpose.

#include "tangible/math/scalar.h"
#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/implicit_stage.h"
#include "tangible/simulation/events/solve_derivative.h"

namespace tangible {

class EventDerivative {
 public:
  /// w_dot: num_variables x columns, of the state before the step on entry, after it on return.
  /// Returns the largest relative residual of the linear solves.
  double Tangent(const Model<double>& model, EventRecord* record, RowMatrixXd* w_dot);
  /// Has the solves of Tangent's impulses observed, until null is given.
  void Observe(const SolveObserver* observer) { observer_ = observer; }
  /// w_bar: num_variables x columns, of the state after the step on entry, before it on return.
  void Adjoint(const Model<double>& model, EventRecord* record, RowMatrixXd* w_bar);

  /// The images of directions of the state before a segment of given length (num_variables x
  /// columns, both).
  RowMatrixXd AlongSegment(const Model<double>& model, Segment* segment,
                           const RowMatrixXd& directions);

  /// How fast the event's equation g changes with the segment's length. All 0 where the segment
  /// ends at a given time.
  struct Rate {
    double value = 0.0;     ///< ∇g · S_τ
    double terms = 0.0;     ///< the sum of the magnitudes of its terms
    double residual = 0.0;  ///< of the solve for ∇g: large where g itself is not determined,
                            ///< such as the share of a redundant contact in a force
  };
  Rate EventRate(const Model<double>& model, Segment* segment);

 private:
  double SegmentTangent(const Model<double>& model, Segment* segment, RowMatrixXd* x,
                        const Eigen::RowVectorXd& tau_dot);
  double ImpulsesTangent(const Model<double>& model, Impulses* impulses, RowMatrixXd* x);
  /// `starts_anywhere`: the time of an earlier event in the step varies.
  void SegmentAdjoint(const Model<double>& model, Segment* segment, bool starts_anywhere,
                      RowMatrixXd* w_bar);
  void StagesAdjoint(const Model<double>& model, Segment* segment, RowMatrixXd* w_bar);
  void KeepCompression(const Impulses& impulses);
  void AddOffsetsTangent(const Impulses& impulses);
  void KeepOffsetsAdjoint(const Impulses& impulses);
  void ImpulsesAdjoint(const Model<double>& model, Impulses* impulses, RowMatrixXd* w_bar);
  /// Returns the relative residual of its linear solve.
  double EventGradient(const Model<double>& model, Segment* segment, Eigen::VectorXd* gradient);
  double AddLetsGoGradient(const Model<double>& model, Segment* segment, Eigen::VectorXd* gradient,
                           std::vector<JacobianEntry>* entries);
  double NodeTangent(const Model<double>& model, const Segment& segment, SolvedNode* node,
                     bool correction, const RowMatrixXd& x, RowMatrixXd* solved,
                     const Eigen::RowVectorXd* tau_dot = nullptr);
  /// Returns the relative residual of the linear solve.
  double NodeAdjoint(const Model<double>& model, const Segment& segment, SolvedNode* node,
                     bool correction, RowMatrixXd* seed, RowMatrixXd* w_bar);

  /// Visits ∂R/∂w of a node with a sink, from the list of entries if `listed_` is that node.
  template <typename Sink>
  void Visit(const Model<double>& model, const Segment& segment, const SolvedNode& node,
             bool correction, const Sink& sink);
  /// Lists the entries of a node that an iteration reads repeatedly; null clears the list.
  void List(const Model<double>& model, const Segment& segment, const SolvedNode* node);

  std::vector<char> fixed_;  ///< 1: a variable that no column varies; empty: not known
  LocalJacobianScratch scratch_;
  const SolvedNode* listed_ = nullptr;
  std::vector<JacobianEntry> entries_;
  ImplicitStage implicit_;
  SolveDerivative solve_;
  const SolveObserver* observer_ = nullptr;
  // For Poisson's law, between an impact's two parts: derivatives of the compression's normal
  // impulses, and of the losses with respect to them; a row for each contact of the compression.
  RowMatrixXd compression_dot_, compression_bar_;
};

}  // namespace tangible
