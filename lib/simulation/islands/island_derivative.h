// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tangent and adjoint of a step by events from those of its islands.
//
// The poses and twists of an island's moving bodies after the step depend on the variables of its
// part alone, so that the step's derivative is one block for each island. Fixed and kinematic
// bodies and numbers are variables of several islands: their columns add up, and kinematic bodies
// move by q⁺ = q + h v besides.

#include "tangible/simulation/events/event_derivative.h"
#include "tangible/simulation/islands/island_record.h"

namespace tangible {

/// The rows of a part's variables out of those of the whole model's.
void GatherRows(const ModelStructure& whole, const ModelPart& part, const RowMatrixXd& rows,
                RowMatrixXd* own);

class IslandDerivative {
 public:
  /// As EventDerivative::Tangent, with the variables of the whole model.
  double Tangent(const Model<double>& model, IslandRecords* records, RowMatrixXd* w_dot);
  /// As EventDerivative::Adjoint.
  void Adjoint(const Model<double>& model, IslandRecords* records, RowMatrixXd* w_bar);
  /// The derivatives of one island.
  EventDerivative& of_island() { return derivative_; }

 private:
  EventDerivative derivative_;
  Model<double> model_;
  RowMatrixXd own_;
};

}  // namespace tangible
