// SPDX-License-Identifier: Apache-2.0
//
// Changes of corners and edges, by fixed steps, that no direction moves: equal boxes that are
// pushed along side by side do not turn against each other, whatever the push.

#include <algorithm>
#include <cmath>

#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/events/flush_corners.h"

namespace tangible {
namespace {

// Whether a column of derivatives changes the pose of one body in the frame of another, or their
// shapes. A body on a path moves by numbers that the column of its pose has not.
bool MovesPair(const Model<double>& model, const State<double>& state, const FeatureTie& tie,
               const RowMatrixXd& w_dot, Eigen::Index column) {
  const ModelStructure& s = *model.structure;
  const auto rate = [&](int body, int i) { return w_dot(s.PoseVariable(body, i), column); };
  const Pose<double> a = state.PoseOf(tie.a), b = state.PoseOf(tie.b);
  const Vector2<double> arm = b.position - a.position;
  const double turn_a = rate(tie.a, 2), turn_b = rate(tie.b, 2);
  const Vector2<double> moved(rate(tie.b, 0) - rate(tie.a, 0) + turn_a * arm.y(),
                              rate(tie.b, 1) - rate(tie.a, 1) - turn_a * arm.x());
  const double size = std::abs(rate(tie.a, 0)) + std::abs(rate(tie.a, 1)) +
                      std::abs(rate(tie.b, 0)) + std::abs(rate(tie.b, 1)) +
                      (std::abs(turn_a) + std::abs(turn_b)) * (1.0 + arm.norm());
  if (moved.norm() > kUnmoved * size || std::abs(turn_b - turn_a) > kUnmoved * size) return true;
  const auto changes = [&](int body) {
    const BodyIndex& index = s.bodies[body];
    for (int k = 0; k < index.num_shape_numbers; ++k) {
      if (w_dot(s.ParameterVariable(index.shape_numbers + k), column) != 0.0) return true;
    }
    return std::any_of(s.paths.begin(), s.paths.end(),
                       [&](const PathIndex& path) { return path.body == body; });
  };
  return changes(tie.a) || changes(tie.b);
}

}  // namespace

bool RolloutCertifier::LeaveOutFeatures(const Model<double>& model, const State<double>& initial,
                                        Certificate* certificate) const {
  if (feature_ties_.empty() || !(margin_but_features_ >= kNearKinkMargin)) return false;
  RowMatrixXd w_dot = options_.directions;
  StepTangent tangent;
  tangent.FixNumbers(*model.structure, w_dot);
  auto tie = feature_ties_.begin();
  bool moves = false;
  State<double> final;
  Rollout(
      model, initial,
      [&](long k, double, const State<double>& state, Stepper* stepper) {
        if (moves) return;
        if (stepper != nullptr) tangent.Apply(model, stepper, &w_dot);
        for (; tie != feature_ties_.end() && tie->step == k; ++tie) {
          for (Eigen::Index c = 0; c < w_dot.cols(); ++c) {
            moves = moves || MovesPair(model, state, *tie, w_dot, c);
          }
        }
      },
      &final);
  if (moves) return false;
  certificate->margin_min = margin_but_features_;
  certificate->margin_where = where_but_features_;
  SetVerdict(*certificate);
  return true;
}

// A face across a flush corner: raised, the corner carries it; lowered, the ends of the face do.
void RolloutCertifier::AddFacesAcross(const Model<double>& model, const State<double>& state,
                                      const std::vector<ActiveContact>& contacts,
                                      const std::vector<ContactMode>& modes, double time) {
  for (size_t i = 1; i < contacts.size(); ++i) {
    if (modes[i] == ContactMode::kOpen || !contacts[i].IsOfShapes()) continue;
    const FacePlace place = PlaceOnFace(model, state, contacts[i]);
    for (size_t k = 0; place.is_found && k < i; ++k) {
      if (modes[k] == ContactMode::kOpen || !contacts[k].IsOfTheSameShapes(contacts[i])) continue;
      const FacePlace other = PlaceOnFace(model, state, contacts[k]);
      if (!other.is_found || other.edge == place.edge) continue;
      OneSided("a face lies across a flush corner, " + ContactName(*model.structure, contacts[i]) +
               " at t = " + Short(time) + " s, whose points are parameters");
    }
  }
}

void RolloutCertifier::AddFlushCorner(const Model<double>& model, const State<double>& state,
                                      const ActiveContact& contact, double time) {
  if (!IsOverFlushCorner(model, state, contact)) return;
  OneSided(ContactName(*model.structure, contact) +
           " is over a flush corner at t = " + Short(time) + " s, whose points are parameters");
}

}  // namespace tangible
