// SPDX-License-Identifier: Apache-2.0
//
// Jacobians of residuals by Jets: passes of the chosen width.
#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "../../support/jets.h"

namespace tangible {
namespace {

using testing::WidestJet;

TEST(ResidualJets, AreAvailableWhereAWidthIsBuilt) {
  EXPECT_EQ(IsAvailable(GradientMethod::kJet), WidestJet() > 0);
  EXPECT_EQ(IsAvailable(GradientMethod::kJetImplicit), WidestJet() > 0);
  EXPECT_TRUE(IsAvailable(GradientMethod::kTangent));
}

RowMatrixXd Jacobian(const std::vector<FitParameter>& parameters, GradientMethod method,
                     long* rollouts) {
  const Scene scene = MakeScene(kSmallChain);
  RolloutResiduals residuals =
      MakeResiduals(scene, {{"tip", 0, {0.1, -0.02}}}, parameters, Observe(scene, 5, 0.001, 4));
  Eigen::VectorXd r;
  RowMatrixXd jacobian;
  EXPECT_TRUE(residuals.Evaluate(residuals.scene().Initial(), method, &r, &jacobian))
      << residuals.message();
  *rollouts = residuals.rollouts();
  return jacobian;
}

// A column does not depend on the pass that it is in.
TEST(ResidualJets, EveryPassFillsItsColumns) {
  if (WidestJet() == 0) {
    GTEST_SKIP() << "built without Jets";
  }
  std::vector<FitParameter> parameters;
  for (const char* path : {"bodies/link0/mass", "bodies/link1/mass", "bodies/link2/mass",
                           "bodies/ball/velocity/y", "joints/j1/angle", "joints/j0/damping",
                           "bodies/ball/velocity/x", "gravity/y", "bodies/ball/mass"}) {
    parameters.push_back(Parameter(path, 0.7));
    parameters.back().initial.reset();
  }
  for (const GradientMethod method : {GradientMethod::kJet, GradientMethod::kJetImplicit}) {
    long rollouts = 0;
    const RowMatrixXd all = Jacobian(parameters, method, &rollouts);
    long of_one = 0;
    for (size_t k = 0; k < parameters.size(); ++k) {
      const RowMatrixXd one = Jacobian({parameters[k]}, method, &of_one);
      const double scale = one.cwiseAbs().maxCoeff();
      EXPECT_GT(scale, 1e-3) << parameters[k].name;
      EXPECT_LE((all.col(static_cast<Eigen::Index>(k)) - one.col(0)).cwiseAbs().maxCoeff(),
                1e-12 * scale)
          << parameters[k].name;
    }
    // A run in double and one a pass.
    EXPECT_EQ(of_one, 2);
    if (WidestJet() < static_cast<int>(parameters.size())) {
      const int passes = (static_cast<int>(parameters.size()) + WidestJet() - 1) / WidestJet();
      EXPECT_EQ(rollouts, 1 + passes);
    }
  }
}

}  // namespace
}  // namespace tangible
