// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Second derivatives of the joints' position errors C(q_a, q_b), contracted with multipliers μ:
//
//   Σ_r μ_r ∇²C_r = [aa  ab; abᵀ  bb],   each 3 x 3 over (x, y, θ)
//
// With arms r = R(θ) l, d = p_a − p_b (anchor to anchor), and joint.h's errors:
//
//   revolute, weld   θaθa: −μ·r_a            θbθb: μ·r_b              angle rows: none
//   distance         (J t)(J t)ᵀ μ / |d|,  t = n⊥, n = d/|d|, J t the row of t on both bodies;
//                    θaθa: −μ n·r_a          θbθb: μ n·r_b
//   prismatic        θaθa: −μ w·r_a          θbθb: −μ w·(p_a − x_b)   w = u⊥, fixed in b
//                    xaθb: μ w⊥              xbθb: −μ w⊥              θaθb: μ w·r_a
//   coupling         of its coordinates: of a slider as above with w = u, of a rope as of a
//                    distance
//
// These are the exact second derivatives; the projection onto the joints needs them, because the
// direction of its constraint forces turns with the bodies.

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// 3 x 3 row-major blocks; rows of `ab` belong to body a.
template <typename T>
struct JointCurvature {
  T aa[9], ab[9], bb[9];
};

/// How many shares a joint has in its rows: a coupling one of each coordinate.
inline int NumShares(const JointIndex& joint) { return joint.IsCoupling() ? 2 : 1; }

/// The joint on whose bodies share k is: the joint itself, or the one that is coupled.
inline const JointIndex& ShareOf(const ModelStructure& structure, const JointIndex& joint, int k) {
  return joint.IsCoupling() ? structure.joints[joint.coupled[k]] : joint;
}

/// Whether both bodies of a share move and its `ab` may differ from 0.
bool CouplesBodies(const ModelStructure& structure, const JointIndex& joint, int k);

/// Of share k of any joint of a model, at a state.
template <typename T>
void EvaluateJointCurvature(const Model<T>& model, const State<T>& state, const JointIndex& joint,
                            int k, const T* multipliers, JointCurvature<T>* out);

/// The same of a joint other than a coupling. `multipliers`: one for each row of the joint. For a
/// distance joint whose anchors coincide the term with t is 0.
template <typename T>
void EvaluateJointCurvature(JointType type, const Pose<T>& pose_a, const Pose<T>& pose_b,
                            const T* numbers, const T* multipliers, JointCurvature<T>* out);

}  // namespace tangible
