// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_derivative.h"

#include <algorithm>

namespace tangible {
namespace {

// Calls visit(row of the part, row of the whole, whether it is of a moving body) for the variables
// of a part.
template <typename Visit>
void ForEachVariable(const ModelStructure& whole, const ModelPart& part, const Visit& visit) {
  const ModelStructure& own = *part.structure;
  for (int k = 0; k < own.num_bodies(); ++k) {
    const int body = part.bodies[k];
    const bool moves = own.bodies[k].block >= 0;
    for (int i = 0; i < 3; ++i) {
      visit(own.PoseVariable(k, i), whole.PoseVariable(body, i), moves);
      visit(own.TwistVariable(k, i), whole.TwistVariable(body, i), moves);
    }
  }
  for (int k = 0; k < own.num_parameters; ++k) {
    visit(own.ParameterVariable(k), whole.ParameterVariable(part.numbers[k]), false);
  }
}

// Calls visit(row of the pose, row of the twist) for the kinematic bodies.
template <typename Visit>
void ForEachKinematic(const ModelStructure& s, const Visit& visit) {
  for (int body = 0; body < s.num_bodies(); ++body) {
    for (int i = 0; i < 3 && s.bodies[body].motion == Motion::kKinematic; ++i) {
      visit(s.PoseVariable(body, i), s.TwistVariable(body, i));
    }
  }
}

}  // namespace

void GatherRows(const ModelStructure& whole, const ModelPart& part, const RowMatrixXd& rows,
                RowMatrixXd* own) {
  own->resize(part.structure->num_variables(), rows.cols());
  ForEachVariable(whole, part,
                  [&](int row, int of_whole, bool) { own->row(row) = rows.row(of_whole); });
}

double IslandDerivative::Tangent(const Model<double>& model, IslandRecords* records,
                                 RowMatrixXd* w_dot) {
  if (records->IsWhole()) {
    return derivative_.Tangent(model, &records->islands[0]->events, w_dot);
  }
  const ModelStructure& s = *model.structure;
  double residual = 0.0;
  for (int k = 0; k < records->num_islands; ++k) {
    IslandRecord& island = *records->islands[k];
    const Model<double>& own = island.ModelOf(model, &model_);
    GatherRows(s, *island.part, *w_dot, &own_);
    residual = std::max(residual, derivative_.Tangent(own, &island.events, &own_));
    ForEachVariable(s, *island.part, [&](int row, int of_whole, bool moves) {
      if (moves) w_dot->row(of_whole) = own_.row(row);
    });
  }
  ForEachKinematic(
      s, [&](int pose, int twist) { w_dot->row(pose) += records->h * w_dot->row(twist); });
  FollowPathsTangent(model, records->end(), records->before_end(s), w_dot);
  return residual;
}

void IslandDerivative::Adjoint(const Model<double>& model, IslandRecords* records,
                               RowMatrixXd* w_bar) {
  if (records->IsWhole()) {
    derivative_.Adjoint(model, &records->islands[0]->events, w_bar);
    return;
  }
  const ModelStructure& s = *model.structure;
  FollowPathsAdjoint(model, records->end(), records->before_end(s), w_bar);
  ForEachKinematic(
      s, [&](int pose, int twist) { w_bar->row(twist) += records->h * w_bar->row(pose); });
  for (int k = 0; k < records->num_islands; ++k) {
    IslandRecord& island = *records->islands[k];
    const Model<double>& own = island.ModelOf(model, &model_);
    own_.setZero(own.structure->num_variables(), w_bar->cols());
    ForEachVariable(s, *island.part, [&](int row, int of_whole, bool moves) {
      if (moves) own_.row(row) = w_bar->row(of_whole);
    });
    derivative_.Adjoint(own, &island.events, &own_);
    ForEachVariable(s, *island.part, [&](int row, int of_whole, bool moves) {
      if (moves) {
        w_bar->row(of_whole) = own_.row(row);
      } else {
        w_bar->row(of_whole) += own_.row(row);
      }
    });
  }
}

}  // namespace tangible
