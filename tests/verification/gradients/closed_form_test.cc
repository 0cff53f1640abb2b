// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/closed_form.h"

#include <gtest/gtest.h>

#include "../support/sliding_box.h"

namespace tangible {
namespace {

ClosedForm Known(const std::string& scene, double value) {
  return [=](const Scene& of,
             const std::vector<ParameterPath>& parameters) -> std::optional<ClosedFormJacobian> {
    if (of.name != scene) return std::nullopt;
    const auto columns = static_cast<Eigen::Index>(parameters.size());
    return ClosedFormJacobian{MatrixX<double>::Constant(6, columns, value), 1e-7};
  };
}

TEST(ClosedFormTest, TheFirstThatKnowsTheSceneAnswers) {
  Scene scene = SlidingBox("0.3");
  scene.name = "known";
  const std::vector<ParameterPath> parameters = {PathTo(scene, "bodies/box/mass")};
  EXPECT_FALSE(FindClosedForm(scene, parameters));
  RegisterClosedForm("other", Known("another", 1.0));
  RegisterClosedForm("first", Known("known", 2.0));
  RegisterClosedForm("second", Known("known", 3.0));
  ASSERT_TRUE(FindClosedForm(scene, parameters));
  EXPECT_EQ(FindClosedForm(scene, parameters)->jacobian(5, 0), 2.0);
  EXPECT_EQ(FindClosedForm(scene, parameters)->tolerance, 1e-7);
  RegisterClosedForm("first", Known("known", 4.0));  // replaces
  EXPECT_EQ(FindClosedForm(scene, parameters)->jacobian(0, 0), 4.0);
  for (const char* name : {"other", "first", "second", "none"}) RemoveClosedForm(name);
  EXPECT_FALSE(FindClosedForm(scene, parameters));
}

}  // namespace
}  // namespace tangible
