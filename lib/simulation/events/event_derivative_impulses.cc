// SPDX-License-Identifier: Apache-2.0
//
// The derivatives of an event step's impulses: impacts in two parts, projections of twists.
#include <algorithm>

#include "tangible/simulation/events/event_derivative.h"

namespace tangible {

double EventDerivative::ImpulsesTangent(const Model<double>& model, Impulses* impulses,
                                        RowMatrixXd* x) {
  solve_.Assemble(model, *impulses, impulses->system, fixed_, *x);
  if (impulses->decompression) {
    AddOffsetsTangent(*impulses);
  }
  const auto observe = [&](SolveStage stage) {
    if (observer_ != nullptr) {
      (*observer_)(stage, impulses->problem, impulses->system, solve_.rates());
    }
  };
  observe(SolveStage::kAssembled);
  const double left = solve_.Solve(*impulses, &impulses->system);
  observe(SolveStage::kSolved);
  KeepCompression(*impulses);
  solve_.SpreadRates(*model.structure, x);
  return left;
}

void EventDerivative::ImpulsesAdjoint(const Model<double>& model, Impulses* impulses,
                                      RowMatrixXd* w_bar) {
  solve_.GatherRates(*model.structure, impulses->system, w_bar);
  // From the decompression that follows, if there is one.
  for (Eigen::Index i = 0; i < compression_bar_.rows(); ++i) {
    const int block = impulses->system.contact_block()[i];
    if (block >= 0) {
      solve_.rates().row(3 * static_cast<Eigen::Index>(block)) += compression_bar_.row(i);
    }
  }
  solve_.Apply(model, *impulses, &impulses->system, w_bar);
  KeepOffsetsAdjoint(*impulses);
}

void EventDerivative::KeepCompression(const Impulses& impulses) {
  compression_dot_.setZero(static_cast<Eigen::Index>(impulses.contacts.size()),
                           solve_.rates().cols());
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    const int block = impulses.system.contact_block()[i];
    if (block >= 0) {
      compression_dot_.row(static_cast<Eigen::Index>(i)) =
          solve_.rates().row(3 * static_cast<Eigen::Index>(block));
    }
  }
}

// λn = e λ¹n: e̊ λ¹n is among the entries of the step's Jacobian, e λ̊¹n is added here.
void EventDerivative::AddOffsetsTangent(const Impulses& impulses) {
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    if (impulses.problem.contacts[i].driven && !impulses.problem.contacts[i].rolls) {
      solve_.rates().row(3 * static_cast<Eigen::Index>(impulses.system.contact_block()[i])) +=
          impulses.restitution[i].value * compression_dot_.row(impulses.compressed[i]);
    }
  }
}

void EventDerivative::KeepOffsetsAdjoint(const Impulses& impulses) {
  compression_bar_.resize(0, solve_.rates().cols());
  if (!impulses.decompression) {
    return;
  }
  const int count = 1 + *std::max_element(impulses.compressed.begin(), impulses.compressed.end());
  compression_bar_.setZero(count, solve_.rates().cols());
  for (size_t i = 0; i < impulses.contacts.size(); ++i) {
    if (impulses.problem.contacts[i].driven && !impulses.problem.contacts[i].rolls) {
      compression_bar_.row(impulses.compressed[i]) =
          impulses.restitution[i].value *
          solve_.rates().row(3 * static_cast<Eigen::Index>(impulses.system.contact_block()[i]));
    }
  }
}

}  // namespace tangible
