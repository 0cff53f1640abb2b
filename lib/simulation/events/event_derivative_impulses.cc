// SPDX-License-Identifier: Apache-2.0
//
// The derivatives of an event step's impulses: impacts in two parts, projections of twists.
#include <algorithm>

#include "tangible/simulation/events/event_derivative.h"
#include "tangible/simulation/events/event_rows_inl.h"

namespace tangible {

double EventDerivative::ImpulsesTangent(const Model<double>& model, Impulses* impulses,
                                        RowMatrixXd* x) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(x->cols());
  rhs_.setZero(3 * static_cast<Eigen::Index>(impulses->system.num_blocks()), columns);
  VisitJacobian(
      model, impulses->View(), JacobianRoute::kByHand, &scratch_,
      TangentSink{x->data(), rhs_.data(), columns, fixed_.empty() ? nullptr : fixed_.data()});
  if (impulses->decompression) {
    AddOffsetsTangent(*impulses);
  }
  const double left =
      impulses->system.Solve(impulses->problem, impulses->solution.modes, rhs_.data(), columns);
  KeepCompression(*impulses);
  for (int k = 0; k < s.num_blocks(); ++k) {
    TwistRows(s, s.moving[k], *x) = BlockRows(k, rhs_);
  }
  return left;
}

void EventDerivative::ImpulsesAdjoint(const Model<double>& model, Impulses* impulses,
                                      RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_bar->cols());
  rhs_.setZero(3 * static_cast<Eigen::Index>(impulses->system.num_blocks()), columns);
  for (int k = 0; k < s.num_blocks(); ++k) {
    BlockRows(k, rhs_) = TwistRows(s, s.moving[k], *w_bar);
    TwistRows(s, s.moving[k], *w_bar).setZero();
  }
  // Of the decompression that follows, if one does.
  for (Eigen::Index i = 0; i < compression_bar_.rows(); ++i) {
    const int block = impulses->system.contact_block()[i];
    if (block >= 0) {
      rhs_.row(3 * static_cast<Eigen::Index>(block)) += compression_bar_.row(i);
    }
  }
  impulses->system.SolveTransposed(impulses->problem, impulses->solution.modes, rhs_.data(),
                                   columns);
  if (columns == 1) {
    VisitJacobian(model, impulses->View(), JacobianRoute::kByHand, &scratch_,
                  SingleAdjointSink{rhs_.data(), w_bar->data()});
  } else {
    VisitJacobian(model, impulses->View(), JacobianRoute::kByHand, &scratch_,
                  AdjointSink{rhs_.data(), w_bar->data(), columns});
  }
  KeepOffsetsAdjoint(*impulses);
}

void EventDerivative::KeepCompression(const Impulses& impulses) {
  compression_dot_.setZero(static_cast<Eigen::Index>(impulses.contacts.size()), rhs_.cols());
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    const int block = impulses.system.contact_block()[i];
    if (block >= 0) {
      compression_dot_.row(static_cast<Eigen::Index>(i)) =
          rhs_.row(3 * static_cast<Eigen::Index>(block));
    }
  }
}

// λn = e λ¹n: e̊ λ¹n is among the entries of the step's Jacobian, e λ̊¹n is added here.
void EventDerivative::AddOffsetsTangent(const Impulses& impulses) {
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    if (impulses.problem.contacts[i].driven) {
      rhs_.row(3 * static_cast<Eigen::Index>(impulses.system.contact_block()[i])) +=
          impulses.restitution[i].value * compression_dot_.row(impulses.compressed[i]);
    }
  }
}

void EventDerivative::KeepOffsetsAdjoint(const Impulses& impulses) {
  compression_bar_.resize(0, rhs_.cols());
  if (!impulses.decompression) {
    return;
  }
  const int count = 1 + *std::max_element(impulses.compressed.begin(), impulses.compressed.end());
  compression_bar_.setZero(count, rhs_.cols());
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    if (impulses.problem.contacts[i].driven) {
      compression_bar_.row(impulses.compressed[i]) =
          impulses.restitution[i].value *
          rhs_.row(3 * static_cast<Eigen::Index>(impulses.system.contact_block()[i]));
    }
  }
}

}  // namespace tangible
