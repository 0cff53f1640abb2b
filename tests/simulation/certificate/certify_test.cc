// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/certify.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"

namespace tangible {
namespace {

using test_scenes::FallingBall;
using test_scenes::SceneOf;

// Certifies a scene; numbers of the first body's friction and restitution are wanted if asked for.
Certificate Certify(const std::string& text, const std::vector<std::string>& wanted = {}) {
  const Scene scene = SceneOf(text);
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  CertifyOptions options;
  const BodyIndex& body = model.structure->bodies[0];
  for (const std::string& name : wanted) {
    options.numbers.push_back(name == "friction"      ? body.friction
                              : name == "restitution" ? body.restitution
                              : name == "end"         ? model.structure->forces[0].end
                                                      : model.structure->forces[0].start);
  }
  RolloutReport report;
  Certificate certificate = CertifyRollout(model, initial, options, &report);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return certificate;
}

bool StartsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

// Free fall of 0.05 m takes 9.6 steps of 0.01 s: it lands in the tenth.
TEST(CertifyRollout, FreeFallIsTrustworthy) {
  const Certificate c = Certify(FallingBall(0.05, R"({"dt": 0.01, "duration": 0.09})"));
  EXPECT_EQ(c.verdict, "trustworthy");
  EXPECT_GE(c.condition, 1.0);
  EXPECT_EQ(c.redundant_rows, 0);
  EXPECT_EQ(c.mode_switches, 0);
}

// Without forces a ball beside the floor touches it at a gap of rounding: whether it closes is
// open.
TEST(CertifyRollout, ATouchWithoutForceIsAKinkThoughItsTermsAreAllRounding) {
  const auto ball = [](const std::string& y) {
    return R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.3, )" +
           y + R"(]},
      {"name": "floor", "static": true,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.02}})";
  };
  for (const char* y : {"0.1", "0.10000000000000002"}) {
    const Certificate touches = Certify(ball(y));
    EXPECT_TRUE(StartsWith(touches.verdict, "near a kink: kink of 2 rows")) << touches.verdict;
    EXPECT_EQ(touches.margin_min, 0.0);
  }
  const Certificate apart = Certify(ball("0.1000001"));
  EXPECT_EQ(apart.verdict, "trustworthy");
  EXPECT_EQ(apart.degenerate_rows, 0);
}

// A slider whose spring, 0.3 m long without a load, is fixed beside its rail, or on it: then the
// force jumps where the slider passes, and its derivatives lack what that adds.
TEST(CertifyRollout, ASpringThatHasNoLengthOnTheWayIsNamed) {
  const auto slider = [](const char* anchor, const char* rest_length, const char* stepping) {
    return std::string(R"({"gravity": [0, 0], "bodies": [
      {"name": "slider", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [-1, 0],
       "velocity": [3, 0]}],
      "joints": [{"name": "rail", "type": "prismatic", "bodies": ["slider", "world"],
                  "anchor": [0, 0], "axis": [1, 0]}],
      "springs": [{"name": "spring", "bodies": ["slider", "world"],
                   "anchors": [[-1, 0], )") +
           anchor + R"(], "stiffness": 2, "rest_length": )" + rest_length +
           R"(}], "simulation": {"dt": 0.01, "duration": 0.8, "stepping": ")" + stepping + "\"}}";
  };
  for (const char* stepping : {"fixed", "event"}) {
    const Certificate passes = Certify(slider("[0, 0]", "0.3", stepping));
    EXPECT_TRUE(StartsWith(passes.verdict, "discontinuous: spring spring has no length at t = "))
        << passes.verdict;
    EXPECT_EQ(Certify(slider("[0, 0]", "0", stepping)).verdict, "trustworthy");
    EXPECT_EQ(Certify(slider("[0, 0.2]", "0.3", stepping)).verdict, "trustworthy");
    EXPECT_EQ(Certify(slider("[9, 0]", "0.3", stepping)).verdict, "trustworthy");
  }
}

TEST(CertifyRollout, LandingInTheLastStepIsFlaggedAndOneStepLaterNot) {
  const Certificate landing = Certify(FallingBall(0.05, R"({"dt": 0.01, "duration": 0.1})"));
  EXPECT_TRUE(
      StartsWith(landing.verdict, "of the discrete map: discontinuous: landing in the last step"))
      << landing.verdict;
  EXPECT_NE(landing.verdict.find("step 9, t = 0.09 s: contact of ball and floor"),
            std::string::npos)
      << landing.verdict;
  const Certificate later = Certify(FallingBall(0.05, R"({"dt": 0.01, "duration": 0.11})"));
  EXPECT_EQ(later.verdict, "of the discrete map: trustworthy");
  EXPECT_EQ(later.mode_switches, 1);
  EXPECT_NE(later.margin_where.find("contact of ball and floor, sticking"), std::string::npos)
      << later.margin_where;
}

// A disc that cannot turn, pushed sideways with `push` times its weight; friction 0.5.
std::string PushedDisc(double push) {
  return R"({"gravity": [0, -8], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5],
       "friction": 0.5},
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "joints": [{"name": "upright", "type": "fixed_angle", "bodies": ["disc", "world"]}],
    "forces": [{"name": "push", "body": "disc", "force": [)" +
         std::to_string(8.0 * push) + R"(, 0]}],
    "simulation": {"dt": 0.0078125, "duration": 0.0078125}})";
}

TEST(CertifyRollout, MarginIsTheDistanceFromTheLimitOfFriction) {
  // (μ λn − |λt|) / ζ_t with λn = m g h, λt = push m g h. The contact's scale of speed counts
  // rotation at the radius of gyration ρ = r / √2, so ζ_t = √2 μ λn.
  for (const double push : {0.1, 0.375, 0.49999975}) {
    const Certificate c = Certify(PushedDisc(push));
    EXPECT_NEAR(c.margin_min, (0.5 - push) / (0.5 * std::sqrt(2.0)), 1e-12);
    EXPECT_EQ(c.degenerate_rows, 0);
    EXPECT_EQ(c.verdict == "trustworthy", push < 0.49) << c.verdict;
  }
  const Certificate kink = Certify(PushedDisc(0.5));
  EXPECT_EQ(kink.degenerate_rows, 1);
  EXPECT_TRUE(StartsWith(kink.verdict, "near a kink: kink of 1 rows at step 0, t = 0 s"))
      << kink.verdict;
  const Certificate sliding = Certify(PushedDisc(0.6));
  EXPECT_EQ(sliding.verdict, "trustworthy");
  EXPECT_EQ(sliding.degenerate_rows, 0);
}

// A ball in contact that moves sideways, with the friction and mixing given.
std::string SlidingDisc(double friction, double of_floor, const std::string& mixing) {
  return R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5],
       "velocity": [3, 0], "friction": )" +
         std::to_string(friction) + R"(},
      {"name": "floor", "static": true,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}, "friction": )" +
         std::to_string(of_floor) + R"(}],
    "simulation": {"dt": 0.01, "duration": 0.05, "friction_mixing": ")" +
         mixing + R"("}})";
}

TEST(CertifyRollout, KinksOfCoefficientsCountOnlyWhereTheyAreWanted) {
  for (const auto& [of_floor, mixing, word] : {std::tuple{0.0, "average", "friction is 0"},
                                               std::tuple{0.25, "geometric_mean", "mixing"}}) {
    const std::string text = SlidingDisc(0.0, of_floor, mixing);
    EXPECT_EQ(Certify(text).verdict, "trustworthy") << text;
    const std::string verdict = Certify(text, {"friction"}).verdict;
    EXPECT_TRUE(StartsWith(verdict, "one-sided: ")) << verdict;
    EXPECT_NE(verdict.find(word), std::string::npos) << verdict;
  }
  EXPECT_EQ(Certify(SlidingDisc(0.2, 0.25, "geometric_mean"), {"friction"}).verdict, "trustworthy");
}

// A ball that meets the floor at `speed` in the first step.
std::string Impact(double speed, double restitution) {
  char text[600];
  std::snprintf(text, sizeof(text), R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.505],
       "velocity": [0, %.17g], "restitution": %.17g},
      {"name": "floor", "static": true, "restitution": %.17g,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.02, "restitution_threshold": 1}})",
                -speed, restitution, restitution);
  return text;
}

TEST(CertifyRollout, RestitutionDecisionsAreJumps) {
  EXPECT_EQ(Certify(Impact(1.5, 0.5)).verdict, "of the discrete map: trustworthy");
  EXPECT_EQ(Certify(Impact(0.8, 0.5)).verdict, "of the discrete map: trustworthy");
  for (const double off : {-1e-8, 1e-8}) {
    const std::string verdict = Certify(Impact(1.0 + off, 0.5)).verdict;
    EXPECT_TRUE(StartsWith(verdict, "of the discrete map: discontinuous: ")) << verdict;
    EXPECT_NE(verdict.find("threshold"), std::string::npos) << verdict;
  }
  EXPECT_EQ(Certify(Impact(1.0 + 1e-8, 0.0)).verdict, "of the discrete map: trustworthy");
}

TEST(CertifyRollout, RestitutionThatLeavesZeroIsAJumpWhereItIsWanted) {
  EXPECT_EQ(Certify(Impact(1.5, 0.0)).verdict, "of the discrete map: trustworthy");
  const std::string verdict = Certify(Impact(1.5, 0.0), {"restitution"}).verdict;
  EXPECT_TRUE(StartsWith(verdict, "of the discrete map: discontinuous: ")) << verdict;
}

TEST(CertifyRollout, CountsRedundantRows) {
  // A box that rests on two corners: four rows on three unknowns, in each of five steps.
  const Certificate c = Certify(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [0, 0.5],
       "friction": 0.5}, )" + std::string(test_scenes::kFloor) +
                                R"(], "simulation": {"dt": 0.01, "duration": 0.05}})");
  EXPECT_EQ(c.redundant_rows, 5);
  EXPECT_EQ(c.verdict, "trustworthy");
  // The right-hand side is consistent, so the regularised and refined solve is exact.
  EXPECT_LT(c.linear_residual, 1e-12);
}

// Of the derivative along one parameter.
Certificate CertifyAlong(const Scene& scene, const std::string& path) {
  ParameterPath parameter;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  return CertifyDerivative(
      model, initial,
      RowMatrixXd(VariableJacobian(scene, model.structure, {DirectionOf(parameter)})), {path},
      {1.0});
}

// Of two floors under one ball one cannot rise alone; both can.
TEST(CertifyDerivativeTest, SaysThatADirectionContradictsRedundantRows) {
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "again", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.05}})");
  for (const auto& [path, reason] :
       {std::pair{"bodies/floor/shape/offset", kContradictingRows},
        std::pair{"bodies/*/shape/offset", ""}, std::pair{"bodies/ball/mass", ""}}) {
    const Certificate c = CertifyAlong(scene, path);
    EXPECT_EQ(c.redundant_rows, 5) << path;
    EXPECT_EQ(c.one_sided, reason) << path;
    EXPECT_EQ(c.verdict == "trustworthy", c.one_sided.empty()) << c.verdict;
  }
}

// Two equal boxes that are pushed along side by side: their corners are level with each other, and
// another one takes over as soon as one box turns. Pushes and masses turn none.
TEST(CertifyDerivativeTest, AChangeOfCornersThatNoDirectionMovesIsLeftOut) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"box": {"size": [0.5, 0.5]}}, "mass": 1, "position": [0, 0]},
      {"name": "b", "shape": {"box": {"size": [0.5, 0.5]}}, "mass": 2, "position": [0.5, 0]}],
    "forces": [{"name": "push", "body": "b", "force": [-2, 0]}],
    "simulation": {"dt": 0.1, "duration": 0.6}})");
  for (const auto& [path, trusted] :
       {std::pair{"bodies/b/mass", true}, std::pair{"forces/push/force/x", true},
        std::pair{"bodies/b/velocity/x", true}, std::pair{"bodies/b/angle", false},
        std::pair{"bodies/a/shape/size/y", false}}) {
    const std::string verdict = CertifyAlong(scene, path).verdict;
    EXPECT_EQ(verdict == "trustworthy", trusted) << path << ": " << verdict;
  }
}

// Two boxes side by side that slide together: friction between them shifts their weight from one to
// the other, which their equal friction on the floor does not show. The derivative by the friction
// of one of them is that of its share; by both, and by the push, there is one.
TEST(CertifyDerivativeTest, SaysThatSharedLoadsLeaveAFrictionUndetermined) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
        {"name": "floor", "static": true, "friction": 0.5,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
        {"name": "a", "shape": {"box": {"size": [0.25, 0.25]}}, "mass": 1, "position": [0, 0.125],
         "friction": 0.5},
        {"name": "b", "shape": {"box": {"size": [0.25, 0.25]}}, "mass": 2,
         "position": [0.25, 0.125], "friction": 0.5}],
        "pairs": [{"bodies": ["a", "b"], "friction": 0.25}],
        "forces": [{"name": "push", "body": "a", "force": [30, 0]}],
        "simulation": {"stepping": ")" +
                                std::string(stepping) + R"(", "dt": 0.03125, "duration": 0.1}})");
    for (const auto& [path, reason] :
         {std::pair{"bodies/a/friction", kUndeterminedFriction},
          std::pair{"bodies/b/friction", kUndeterminedFriction}, std::pair{"bodies/*/friction", ""},
          std::pair{"forces/push/force/x", ""}}) {
      const Certificate c = CertifyAlong(scene, path);
      EXPECT_EQ(c.one_sided, reason) << stepping << " " << path << " " << c.verdict;
    }
  }
}

// A box that is pushed with exactly its friction, beside one that slides.
TEST(CertifyDerivativeTest, AKinkThatNoDirectionMovesIsLeftOut) {
  const Scene scene = SceneOf(R"({"gravity": [0, -8], "bodies": [
      {"name": "still", "shape": {"box": {"size": [0.5, 0.25]}}, "mass": 1,
       "position": [0, 0.125], "friction": 0.5},
      {"name": "slides", "shape": {"box": {"size": [0.5, 0.25]}}, "mass": 1,
       "position": [2, 0.125], "velocity": [1, 0], "friction": 0.25},
      {"name": "floor", "static": true, "friction": 0,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["still", "floor"], "friction": 0.5},
              {"bodies": ["slides", "floor"], "friction": 0.25}],
    "forces": [{"name": "push", "body": "still", "force": [4, 0]}],
    "simulation": {"dt": 0.0625, "duration": 0.25}})");
  const auto certify = [&scene](const std::string& path) { return CertifyAlong(scene, path); };
  for (const char* path : {"bodies/slides/velocity/x", "pairs/slides:floor/friction",
                           "bodies/slides/mass", "bodies/still/position/x"}) {
    const Certificate c = certify(path);
    EXPECT_EQ(c.verdict, "trustworthy") << path;
    EXPECT_EQ(c.degenerate_rows, 0) << path;
    EXPECT_GT(c.margin_min, 1e-3) << path;
  }
  for (const char* path : {"forces/push/force/x", "bodies/still/velocity/x", "bodies/still/mass",
                           "pairs/still:floor/friction", "gravity/y"}) {
    const Certificate c = certify(path);
    EXPECT_TRUE(StartsWith(c.verdict, "near a kink: kink of ")) << path << ": " << c.verdict;
    EXPECT_GT(c.degenerate_rows, 0) << path;
    EXPECT_LT(c.margin_min, 1e-9) << path;
  }
}

TEST(CertifyRollout, EdgesOfForceWindowsOnStepsCountOnlyWhereTheyAreWanted) {
  const auto scene = [](double start) {
    return R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
      "forces": [{"name": "push", "body": "a", "force": [1, 0], "start": )" +
           std::to_string(start) + R"(, "end": 1}],
      "simulation": {"dt": 0.01, "duration": 0.1}})";
  };
  EXPECT_EQ(Certify(scene(0.03)).verdict, "trustworthy");
  EXPECT_EQ(Certify(scene(0.033), {"start"}).verdict, "trustworthy");
  const std::string verdict = Certify(scene(0.03), {"start"}).verdict;
  EXPECT_TRUE(StartsWith(verdict, "one-sided: start of force push at 0.03 s")) << verdict;
}

// By events both sides of a boundary of two steps agree; at the run's ends there is only one.
TEST(CertifyRollout, ByEventsAnEdgeIsAKinkAtTheRunsEnds) {
  const auto verdict = [](const std::string& window, const std::string& wanted) {
    return Certify(R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "forces": [{"name": "f", "body": "a", "force": [1, 0], )" +
                       window + R"(}], "simulation": {"dt": 0.01, "duration": 0.1,
        "stepping": "event"}})",
                   {wanted})
        .verdict;
  };
  EXPECT_EQ(verdict(R"("start": 0.05)", "start"), "trustworthy");
  EXPECT_EQ(verdict(R"("start": 0.05, "end": 0.07)", "end"), "trustworthy");
  EXPECT_TRUE(StartsWith(verdict(R"("start": 0)", "start"),
                         "one-sided: start of force f at 0 s is the start of the run"));
  EXPECT_TRUE(StartsWith(verdict(R"("end": 0.1)", "end"),
                         "one-sided: end of force f at 0.1 s is the end of the run"));
  EXPECT_TRUE(StartsWith(verdict(R"("start": 0.05, "end": 0.05)", "end"),
                         "one-sided: the window of force f is empty"));
}

// What counts as on a step's boundary is a share of the step: of a microsecond's steps a half of a
// thousandth is beside it, of a second's a hundredth of a millionth is on it.
TEST(CertifyRollout, AWindowsEdgeIsOnAStepsBoundaryByAShareOfTheStep) {
  const auto verdict = [](const std::string& start, const std::string& settings) {
    return Certify(R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "forces": [{"name": "f", "body": "a", "force": [1, 0], "start": )" +
                       start + R"(}], "simulation": )" + settings + "}",
                   {"start"})
        .verdict;
  };
  EXPECT_EQ(verdict("5.0005e-6", R"({"dt": 1e-6, "duration": 1e-5})"), "trustworthy");
  EXPECT_TRUE(StartsWith(verdict("5e-6", R"({"dt": 1e-6, "duration": 1e-5})"), "one-sided: "));
  EXPECT_TRUE(StartsWith(verdict("2.00000001", R"({"dt": 1, "duration": 5})"), "one-sided: "));
  EXPECT_EQ(verdict("2.001", R"({"dt": 1, "duration": 5})"), "trustworthy");
}

}  // namespace
}  // namespace tangible
