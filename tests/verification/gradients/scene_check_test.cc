// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/scene_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "../../support/scenes.h"
#include "../support/sliding_box.h"
#include "tangible/verification/gradients/closed_form.h"
#include "tangible/verification/gradients/verify_run.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

SceneCheck CheckBox(const std::string& mu, const std::vector<std::string>& paths,
                    KeepJacobians keep = KeepJacobians::kNo) {
  const Scene scene = SlidingBox(mu);
  std::vector<ParameterPath> parameters;
  parameters.reserve(paths.size());
  for (const std::string& path : paths) {
    parameters.push_back(PathTo(scene, path));
  }
  return CheckScene(scene, parameters, keep);
}

SceneCheck CheckRandom(unsigned seed, Stepping stepping = Stepping::kFixed) {
  RandomSceneOptions options;
  options.stepping = stepping;
  const Scene scene = RandomScene(seed, options);
  return CheckScene(scene, RandomParameters(scene, seed), KeepJacobians::kNo);
}

TEST(SceneCheckTest, TheErrorOfAnEntryIsTheToleranceAtWhichItWouldHold) {
  EXPECT_DOUBLE_EQ(EntryError(1.0 + 1e-6, 1.0, 1e-9, 0.0, 0.0), (1.0 + 1e-6) - 1.0);
  EXPECT_EQ(EntryError(2.0, 2.0, 1e-9, 0.0, 0.0), 0.0);
  // There is no absolute tolerance: beside 0 without contributions nothing is near.
  EXPECT_EQ(EntryError(1e-300, 0.0, 1e-9, 0.0, 0.0), HUGE_VAL);
  // 1e-13 of the contributions is at the bound, and so is the method's own estimate.
  EXPECT_NEAR(EntryError(1e-13, 0.0, 1e-9, 1.0, 0.0), 1e-9, 1e-21);
  EXPECT_NEAR(EntryError(1e-4, 0.0, 1e-5, 0.0, 1e-4), 1e-5, 1e-17);
  // The estimate counts where it is larger than the tolerance's share, not besides it.
  EXPECT_NEAR(EntryError(1.0 + 1e-5, 1.0, 1e-5, 0.0, 1e-6), 1e-5, 1e-15);
  EXPECT_EQ(EntryError(NAN, 1.0, 1e-9, 1.0, 0.0), HUGE_VAL);
  EXPECT_EQ(EntryError(1.0, NAN, 1e-9, 1.0, 0.0), HUGE_VAL);
}

// A wheel at rest whose friction can change a speed by 2e-5 of the interior point's unit: what
// that leaves of other derivatives is its own error. With more friction nothing is left.
TEST(SceneCheckTest, SmallFrictionInAJointIsWithinTheErrorOfTheInteriorPoint) {
  for (const char* friction : {"0.001", "10"}) {
    const Scene scene = test_scenes::SceneOf(R"({"gravity": [0, 0],
        "bodies": [{"name": "wheel", "mass": 2, "inertia": 0.5, "position": [0, 3]}],
        "joints": [{"name": "axle", "type": "revolute", "bodies": ["wheel", "world"],
                    "anchor": [0, 3], "friction": )" +
                                             std::string(friction) + R"(}],
        "simulation": {"stepping": "fixed", "dt": 0.01, "duration": 0.06}})");
    const MethodJacobians run = RunMethods(scene, {PathTo(scene, "joints/axle/effort")});
    EXPECT_DOUBLE_EQ(run.friction_share, std::min(1.0, 0.02 * std::stod(friction)));
    const SceneCheck check =
        CheckScene(scene, {PathTo(scene, "joints/axle/effort")}, KeepJacobians::kNo);
    ASSERT_TRUE(check.done) << check.message;
    for (const CheckedException& exception : check.exceptions) {
      EXPECT_FALSE(exception.unexplained()) << exception.what;
    }
    EXPECT_EQ(check.total.named > 0, run.friction_share < 0.01);
  }
}

TEST(SceneCheckTest, KindsArePathsWithoutNamesAndIndices) {
  EXPECT_EQ(KindOf("gravity/y"), "gravity/y");
  EXPECT_EQ(KindOf("bodies/ball/mass"), "bodies/mass");
  EXPECT_EQ(KindOf("bodies/hull/shape/vertices/2/y"), "bodies/shape/vertices/y");
  EXPECT_EQ(KindOf("springs/s/anchors/0/x"), "springs/anchors/x");
  EXPECT_EQ(KindOf("pairs/ball:floor/friction"), "pairs/friction");
}

TEST(SceneCheckTest, CoarseDifferencesAreThoseThatSayLittle) {
  EXPECT_TRUE(IsCoarse(1.0, 2e-3, 1.0));
  EXPECT_FALSE(IsCoarse(1.0, 0.5e-3, 1.0));
  EXPECT_FALSE(IsCoarse(1e-9, 0.5e-6, 1.0));  // little beside its column
  EXPECT_FALSE(IsCoarse(0.0, 1e-9, 0.0));     // a column of zeros
}

TEST(SceneCheckTest, ASceneThatIsSmoothHasNoExceptions) {
  const SceneCheck check =
      CheckBox("0.3", {"pairs/box:floor/friction", "bodies/box/velocity/x", "bodies/box/mass"});
  ASSERT_TRUE(check.done) << check.message;
  EXPECT_TRUE(check.exceptions.empty());
  EXPECT_EQ(check.bodies, 1);
  EXPECT_EQ(check.steps, 10);
  EXPECT_EQ(check.sliding, 20);
  ASSERT_EQ(check.rows.size(), 3u);
  EXPECT_EQ(check.rows[1].kind, "bodies/velocity/x");
  EXPECT_EQ(check.rows[1].entries, 6);
  EXPECT_EQ(check.total.entries, 18);
  EXPECT_LE(check.total.error[0], 1e-9);
  EXPECT_LE(check.worst.size(), static_cast<size_t>(kMostWorst));
  for (size_t i = 1; i < check.worst.size(); ++i) {
    EXPECT_GE(check.worst[i - 1].ratio, check.worst[i].ratio);
  }
  EXPECT_TRUE(check.outputs.empty());
}

TEST(SceneCheckTest, ColumnsOfZerosAreNamed) {
  const SceneCheck check = CheckBox("0.3", {"bodies/box/restitution", "bodies/floor/friction"});
  ASSERT_TRUE(check.done) << check.message;
  // The pair's own friction replaces the floor's.
  EXPECT_EQ(check.total.zero_columns,
            (std::vector<std::string>{"bodies/floor/friction", "bodies/box/restitution"}));
}

TEST(SceneCheckTest, AnExceptionThatTheCertificateNamedIsExplained) {
  // Friction 0 is the end of its range: no rows for it, so that unrolled Jets see nothing of it.
  const SceneCheck check = CheckBox("0", {"pairs/box:floor/friction"});
  ASSERT_TRUE(check.done) << check.message;
  EXPECT_EQ(check.total.unexplained, 0);
  for (const CheckedException& exception : check.exceptions) {
    EXPECT_NE(exception.named.find("friction is 0"), std::string::npos) << exception.named;
    EXPECT_EQ(kMethodPairs[exception.pair].a, kByUnrolledJets);
  }
  EXPECT_EQ(check.exceptions.size(), std::isnan(check.total.error[2]) ? 0u : 1u);  // no Jets: none
}

TEST(SceneCheckTest, AWrongDerivativeIsUnexplained) {
  RegisterClosedForm("wrong", [](const Scene&, const std::vector<ParameterPath>&) {
    // d v_x / d v_x is 1.
    MatrixX<double> jacobian = MatrixX<double>::Constant(6, 1, NAN);
    jacobian(3, 0) = 1.0 + 1e-8;
    return std::optional<ClosedFormJacobian>({jacobian, 1e-9});
  });
  const SceneCheck check = CheckBox("0.3", {"bodies/box/velocity/x"});
  RemoveClosedForm("wrong");
  ASSERT_EQ(check.exceptions.size(), 1u);
  EXPECT_EQ(kMethodPairs[check.exceptions[0].pair].a, kByClosedForm);
  EXPECT_TRUE(check.exceptions[0].unexplained());
  EXPECT_EQ(check.total.unexplained, 1);
  EXPECT_NEAR(check.exceptions[0].error, 1e-8, 1e-10);
}

TEST(SceneCheckTest, JacobiansAreKeptIfAskedFor) {
  const SceneCheck check =
      CheckBox("0.3", {"bodies/box/velocity/x", "gravity/x"}, KeepJacobians::kYes);
  ASSERT_EQ(check.outputs.size(), 6u);
  EXPECT_EQ(check.parameter_paths,
            (std::vector<std::string>{"bodies/box/velocity/x", "gravity/x"}));
  EXPECT_EQ(check.jacobian[kByTangent].cols(), 2);
  EXPECT_EQ(check.contributions.rows(), 6);
  EXPECT_GT(check.ridders_error(3, 1), 0.0);
}

// Bodies that two joints hold the same way, with joints projected: the derivative was solved with
// the regularised matrix, and lost five digits.
TEST(SceneCheckTest, LoopsOfJointsAreDifferentiatedToRounding) {
  for (const unsigned seed : {286u, 1929u}) {
    const SceneCheck check = CheckRandom(seed);
    ASSERT_TRUE(check.done) << check.message;
    EXPECT_GT(check.certificate.redundant_rows, 0) << seed;
    EXPECT_EQ(check.total.unexplained, 0) << seed;
    EXPECT_LE(check.total.error[0], 1e-9) << seed;
  }
}

// Event stepping: seed 3 is pushed out of penetration while its sliding ends, so that the way out
// depends on the event's time; 24 and 70 start in contacts that a speed opens.
TEST(SceneCheckTest, RecoveryAndStartsOfEventSteppingAreExplained) {
  for (const unsigned seed : {3u, 24u, 70u}) {
    const SceneCheck check = CheckRandom(seed, Stepping::kEvent);
    ASSERT_TRUE(check.done) << check.message;
    EXPECT_EQ(check.total.unexplained, 0) << seed;
    EXPECT_EQ(check.total.named > 0, seed != 3u) << seed;
  }
}

}  // namespace
}  // namespace tangible
