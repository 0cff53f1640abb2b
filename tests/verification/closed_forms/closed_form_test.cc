// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/closed_form.h"

#include "bounds.h"
#include "tangible/scene/parameter.h"

namespace tangible::closed_forms {
namespace {

// Jets through the formulas against differences of the formulas: five points, error of order h⁴.
TEST(ClosedForm, DerivativesAreThoseOfTheFormula) {
  for (const ClosedForm& form : AllClosedForms()) {
    const Outcome exact = Exact(form);
    const double scale =
        exact.jacobian.array().isNaN().select(0.0, exact.jacobian).cwiseAbs().maxCoeff();
    EXPECT_GT(scale, 0.0) << form.name;
    for (size_t k = 0; k < form.parameters.size(); ++k) {
      if (exact.jacobian.col(static_cast<Eigen::Index>(k)).hasNaN()) continue;
      const double h = 1e-4 * std::max(0.1, std::abs(form.parameters[k].second));
      const auto at = [&](double shift) {
        ClosedForm moved = form;
        moved.parameters[k].second += shift * h;
        return Exact(moved).values;
      };
      // One-sided in nothing: parameters at the end of their range (restitution 1, friction) are
      // numbers like others to a formula.
      const Eigen::VectorXd slope = (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * h);
      const double error =
          (slope - exact.jacobian.col(static_cast<Eigen::Index>(k))).cwiseAbs().maxCoeff();
      EXPECT_LE(error, 1e-8 * scale) << form.name << ", " << form.parameters[k].first;
    }
  }
}

TEST(ClosedForm, SceneHasTheParametersNumbers) {
  const ClosedForm form = FormNamed("slope, stops");
  const PreparedScene prepared = Prepare(form);
  Scene scene = prepared.scene;
  EXPECT_EQ(scene.simulation.duration, 1.1);
  std::map<std::string, int> index;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
  for (size_t i = 0; i < numbers.size(); ++i) index[numbers[i].path] = static_cast<int>(i);
  EXPECT_EQ(*numbers[index.at("bodies/block/angle")].value, -0.22);
  EXPECT_EQ(*numbers[index.at("bodies/plane/shape/normal/x")].value, std::sin(0.22));
  // The slope's angle turns the plane and the block, and moves it: s = 0 keeps half its height.
  std::map<int, double> weights;
  for (const auto& [number, weight] : prepared.directions[2]) weights[number] = weight;
  EXPECT_EQ(weights.at(index.at("bodies/block/angle")), -1.0);
  EXPECT_EQ(weights.at(index.at("bodies/plane/shape/normal/x")), std::cos(0.22));
  EXPECT_EQ(weights.at(index.at("bodies/plane/shape/normal/y")), -std::sin(0.22));
  EXPECT_NEAR(weights.at(index.at("bodies/block/position/x")), 0.05 * std::cos(0.22), 1e-17);
}

TEST(ClosedForm, DropsDerivativesOfOneParameter) {
  const Number p(2.0, 3);
  std::vector<Number> numbers = {Number(1.0, 2), p};
  DropDerivative(p, &numbers);
  EXPECT_TRUE(std::isnan(numbers[0].v[3]));
  EXPECT_EQ(numbers[0].v[2], 1.0);
  EXPECT_EQ(numbers[1].a, 2.0);
}

}  // namespace
}  // namespace tangible::closed_forms
