// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/parameter_map.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// Poses, twists and numbers of a scene in one vector.
VectorX<double> Variables(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  VectorX<double> w(model.structure->num_variables());
  const Eigen::Index n = static_cast<Eigen::Index>(state.pose.size());
  w.head(n) = Eigen::Map<const VectorX<double>>(state.pose.data(), n);
  w.segment(n, n) = Eigen::Map<const VectorX<double>>(state.twist.data(), n);
  w.tail(model.structure->num_parameters) =
      Eigen::Map<const VectorX<double>>(model.parameters.data(), model.structure->num_parameters);
  return w;
}

TEST(ParameterMapTest, IsTheDerivativeOfTheModel) {
  long nonzero = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Scene scene = RandomScene(seed);
    const auto structure = BuildStructure(scene);
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
    std::vector<ParameterDirection> directions;
    for (size_t i = 0; i < numbers.size(); ++i) {
      directions.push_back({SetNumber{static_cast<int>(i), 1.0}});
    }
    const Eigen::SparseMatrix<double> jacobian = VariableJacobian(scene, structure, directions);
    nonzero += jacobian.nonZeros();
    for (size_t i = 0; i < numbers.size(); ++i) {
      const double value = *numbers[i].value;
      // Rounding 1e-16 / h and curvature h² are both below 1e-9.
      const double h = 1e-5;
      *numbers[i].value = value + h;
      const VectorX<double> high = Variables(scene);
      *numbers[i].value = value - h;
      const VectorX<double> low = Variables(scene);
      *numbers[i].value = value;
      const VectorX<double> difference = (high - low) / (2.0 * h);
      const VectorX<double> column = jacobian.col(static_cast<Eigen::Index>(i));
      EXPECT_LT((difference - column).cwiseAbs().maxCoeff(), 1e-8 * (1.0 + column.norm()))
          << seed << " " << numbers[i].path;
      EXPECT_GT(column.norm(), 0.0) << numbers[i].path;
    }
  }
  EXPECT_GT(nonzero, 1000);
}

TEST(ParameterMapTest, ScalesAndSumsOfSeveralNumbers) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  ParameterPath path;
  std::string error;
  ASSERT_TRUE(ResolveParameter(scene, "bodies/*/mass", &path, &error)) << error;
  ParameterDirection direction = DirectionOf(path);
  ASSERT_EQ(direction.size(), 3u);
  direction[1].scale = -2.0;
  const auto structure = BuildStructure(scene);
  const Eigen::SparseMatrix<double> jacobian = VariableJacobian(scene, structure, {direction});
  const ModelStructure& s = *structure;
  EXPECT_EQ(jacobian.coeff(s.ParameterVariable(s.bodies[0].mass), 0), 1.0);
  EXPECT_EQ(jacobian.coeff(s.ParameterVariable(s.bodies[1].mass), 0), -2.0);
  // The ball's inertia follows its mass, m r²/2; the crate's is its own number.
  EXPECT_NEAR(jacobian.coeff(s.ParameterVariable(s.bodies[0].inertia), 0), 0.005, 1e-15);
  EXPECT_EQ(jacobian.coeff(s.ParameterVariable(s.bodies[1].inertia), 0), 0.0);
}

}  // namespace
}  // namespace tangible
