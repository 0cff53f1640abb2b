// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// From the user's parameters to the variables of a model: the initial poses and twists, and the
// parameters in their flat index.
//
// A parameter p sets several values of the scene, each to scale · p + offset. The map from scene to
// model is smooth but not linear (an inertia follows from mass and shape, joint angles turn
// subtrees), so its sparse Jacobian is evaluated at the given scene.

#include <Eigen/SparseCore>
#include <string>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/scene/parameter.h"

namespace tangible {

/// One value of a scene that a parameter sets.
struct SetNumber {
  int number = 0;  ///< index into EnumerateNumbers
  double scale = 1.0;
};

/// The values that one parameter changes, to first order.
using ParameterDirection = std::vector<SetNumber>;

/// The direction of a resolved path: each of its values with scale 1.
ParameterDirection DirectionOf(const ParameterPath& path);

/// The structure of a scene for derivatives by parameters: bodies whose outlines have points that
/// one of these moves are marked.
std::shared_ptr<const ModelStructure> WithFreePoints(
    const Scene& scene, const std::shared_ptr<const ModelStructure>& structure,
    const std::vector<ParameterDirection>& parameters);

/// d [poses | twists | the model's parameters] / d the scene's parameters: num_variables x
/// num_parameters, column-major.
Eigen::SparseMatrix<double> VariableJacobian(const Scene& scene,
                                             const std::shared_ptr<const ModelStructure>& structure,
                                             const std::vector<ParameterDirection>& parameters);

/// The scene in Jets, whose derivative k is that with respect to parameters[first + k].
template <typename T>
BasicScene<T> SeededScene(const Scene& scene, const std::vector<ParameterDirection>& parameters,
                          int first);

}  // namespace tangible
