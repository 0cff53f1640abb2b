// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "../support/scenes.h"
#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleGradientTest : public ProgramTest {
 protected:
  ProgramRun Differentiate(const std::string& flags,
                           const std::string& scene = test_scenes::Mixture()) const {
    return Run("tangible-gradient", "'" + Write("scene.json", scene) + "' " + flags);
  }
};

bool HaveJets() {
  int widths = 0;
#define TANGIBLE_COUNT(N) ++widths;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_COUNT)
#undef TANGIBLE_COUNT
  return widths > 0;
}

TEST_F(TangibleGradientTest, AllMethodsWriteTheSameJacobian) {
  json reference;
  for (const char* method : {"adjoint", "tangent", "jet_implicit", "jet", "finite_difference"}) {
    const ProgramRun run = Differentiate(
        std::string("--parameters='bodies/ball/mass,bodies/*/friction' --repeat=2 --method=") +
        method);
    if (!HaveJets() && std::string(method).find("jet") == 0) {
      ExpectOneLine(run, 1, "TANGIBLE_JET_WIDTHS");
      continue;
    }
    ASSERT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(run.error, "");
    const json result = json::parse(run.out);
    EXPECT_EQ(result["method"], method);
    EXPECT_EQ(result["parameters"], json::array({"bodies/ball/mass", "bodies/*/friction"}));
    ASSERT_EQ(result["outputs"].size(), 18u);
    EXPECT_EQ(result["outputs"][0], "ball/x");
    EXPECT_EQ(result["outputs"][17], "rod/omega");
    EXPECT_EQ(result["values"].size(), 18u);
    EXPECT_GT(result["seconds"], 0.0);
    EXPECT_GT(result["rollout_seconds"], 0.0);
    EXPECT_EQ(result["certificate"]["verdict"], "of the discrete map: trustworthy");
    EXPECT_EQ(result["certificate"]["discrete_map"], true);
    EXPECT_NE(result["certificate"]["advice"].get<std::string>().find(R"("stepping": "event")"),
              std::string::npos);
    if (reference.is_null()) reference = result["jacobian"];
    ASSERT_EQ(result["jacobian"].size(), 18u);
    for (size_t i = 0; i < 18; ++i) {
      for (size_t j = 0; j < 2; ++j) {
        const double a = result["jacobian"][i][j];
        const double b = reference[i][j];
        EXPECT_NEAR(a, b, 1e-5 * std::abs(b) + 2e-8) << method << " " << i << " " << j;
      }
    }
  }
  double largest = 0.0;
  for (const json& row : reference) largest = std::max(largest, std::abs(row[1].get<double>()));
  EXPECT_GT(largest, 0.01);
}

// The rules of --method=auto, the default; the result says what was asked and what was used.
TEST_F(TangibleGradientTest, TheMethodIsChosenUnlessItIsAskedFor) {
  const std::string loss = Write("loss.json", R"({"terms": [{"output": "ball/x"}]})");
  const std::string of_loss = " --loss='" + loss + "'";
  const std::string few = "--parameters=bodies/ball/mass";
  std::string many = few;  // than the 18 outputs
  for (const char* body : {"ball", "crate", "rod"}) {
    for (const char* number : {"position/x", "position/y", "velocity/x", "velocity/y", "friction",
                               "restitution", "linear_damping", "angular_damping"}) {
      if (std::string(body) != "rod" || std::string(number).find("position") != 0) {
        many += std::string(",bodies/") + body + "/" + number;
      }
    }
  }
  struct Case {
    std::string flags, requested, used;
  };
  for (const Case& c :
       std::initializer_list<Case>{{few, "auto", "tangent"},
                                   {few + " --method=auto", "auto", "tangent"},
                                   {many, "auto", "adjoint"},
                                   {few + of_loss, "auto", "adjoint"},
                                   {many + of_loss, "auto", "adjoint"},
                                   {few + " --side=plus", "auto", "tangent"},
                                   {few + of_loss + " --side=minus", "auto", "tangent"},
                                   {few + " --side=plus --checkpoint=every:3", "auto", "tangent"},
                                   {few + " --checkpoint=all", "auto", "adjoint"},
                                   {few + " --factorisations=recompute", "auto", "adjoint"},
                                   {few + " --method=adjoint", "adjoint", "adjoint"},
                                   {few + of_loss + " --method=tangent", "tangent", "tangent"}}) {
    const ProgramRun run = Differentiate(c.flags);
    ASSERT_EQ(run.exit_status, 0) << c.flags << run.error;
    const json result = json::parse(run.out);
    EXPECT_EQ(result["requested_method"], c.requested) << c.flags;
    EXPECT_EQ(result["method"], c.used) << c.flags;
    EXPECT_EQ(result.contains("tape_bytes"), c.used == "adjoint") << c.flags;
  }
}

TEST_F(TangibleGradientTest, WritesTheGradientOfALoss) {
  const std::string loss =
      Write("loss.json", R"({"terms": [{"output": "ball/x", "target": 1, "weight": 2},
                                 {"output": "rod/angle"}]})");
  const std::string parameters = "--parameters=bodies/ball/velocity/x,joints/pin/damping ";
  const json jacobian = json::parse(Differentiate(parameters).out);
  const ProgramRun run =
      Differentiate(parameters + "--loss='" + loss + "' --out='" + Path("g.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out, "");
  const json result = json::parse(Read(Path("g.json")));
  EXPECT_FALSE(result.contains("jacobian"));
  const double x = jacobian["values"][0];
  const double angle = jacobian["values"][14];
  EXPECT_NEAR(result["loss"], 2.0 * (x - 1.0) * (x - 1.0) + angle * angle, 1e-12);
  for (size_t k = 0; k < 2; ++k) {
    const double expected = 4.0 * (x - 1.0) * jacobian["jacobian"][0][k].get<double>() +
                            2.0 * angle * jacobian["jacobian"][14][k].get<double>();
    EXPECT_NE(expected, 0.0);
    EXPECT_NEAR(result["gradient"][k], expected, 1e-9 * std::abs(expected));
  }
}

// v = t F / m of 1e-200 kg: the derivative is −1e399.
TEST_F(TangibleGradientTest, SaysThatADerivativeOverflows) {
  for (const char* method : {"adjoint", "tangent", "finite_difference"}) {
    const ProgramRun run = Differentiate(
        std::string("--parameters=bodies/a/mass --out='") + Path("g.json") + "' --method=" + method,
        R"({"gravity": [0, 0], "bodies": [
          {"name": "a", "mass": 1e-200, "inertia": 1, "position": [0, 0]}],
          "forces": [{"name": "f", "body": "a", "force": [1, 0]}],
          "simulation": {"dt": 0.01, "duration": 0.1}})");
    ExpectOneLine(run, 1, "the derivative is not finite");
    EXPECT_FALSE(std::filesystem::exists(Path("g.json")));
  }
}

TEST_F(TangibleGradientTest, SaysWhereADifferenceIsOneSided) {
  const ProgramRun run = Differentiate(
      "--parameters=bodies/ball/restitution --method=finite_difference --step=1e-5",
      R"({"bodies": [
        {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.2],
         "restitution": 1}, )" +
          std::string(test_scenes::kFloor) + R"(], "simulation": {"dt": 0.01, "duration": 0.3}})");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  ASSERT_EQ(result["notes"].size(), 1u);
  EXPECT_EQ(result["notes"][0].get<std::string>().find("one-sided difference below"), 0u);
}

// A box pushed with exactly its friction, μ m g = 4 N: more force slides it, less does not.
TEST_F(TangibleGradientTest, OneSidedColumnsAtAKink) {
  const auto scene = [](const std::string& stepping) {
    return R"({"gravity": [0, -8], "bodies": [
        {"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1, "position": [0, 0.25],
         "friction": 0.5},
        {"name": "floor", "static": true, "friction": 0.5,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "forces": [{"name": "push", "body": "box", "force": [4, 0]}],
        "simulation": {"dt": 0.0078125, "duration": 0.0625)" +
           stepping + "}}";
  };
  const std::string flags =
      "--parameters=forces/push/force/x,bodies/*/friction --method=tangent --side=";
  const auto of = [&](const std::string& side) {
    const ProgramRun run = Differentiate(flags + side, scene(""));
    EXPECT_EQ(run.exit_status, 0) << run.error;
    return json::parse(run.out);
  };
  const json plus = of("plus");
  EXPECT_EQ(plus["certificate"]["verdict"].get<std::string>().find("near a kink: kink of 16 rows"),
            0u);
  // v = t (ΔF − m g Δμ) / m at the end of the sliding, t = 0.0625 s.
  EXPECT_NEAR(plus["jacobian"][3][0], 0.0625, 1e-14);
  EXPECT_NEAR(plus["jacobian"][3][1], 0.0, 1e-14);
  const json minus = of("minus");
  EXPECT_NEAR(minus["jacobian"][3][0], 0.0, 1e-14);
  EXPECT_NEAR(minus["jacobian"][3][1], -0.5, 1e-14);
  const json both = of("both");
  for (int k = 0; k < 2; ++k) {
    const double x = both["jacobian"][3][k];
    const double a = plus["jacobian"][3][k];
    const double b = minus["jacobian"][3][k];
    EXPECT_GE(x, std::min(a, b) - 1e-14);
    EXPECT_LE(x, std::max(a, b) + 1e-14);
  }
  // By events: from derivatives beside the kink.
  const ProgramRun by_events = Differentiate(
      flags + "minus", scene(R"(, "stepping": "event", "integrator": "trapezoidal")"));
  ASSERT_EQ(by_events.exit_status, 0) << by_events.error;
  const json events = json::parse(by_events.out);
  EXPECT_EQ(events["certificate"]["verdict"].get<std::string>().find("near a kink"), 0u);
  EXPECT_NEAR(events["jacobian"][3][0], 0.0, 1e-10);
  EXPECT_NEAR(events["jacobian"][3][1], -0.5, 1e-10);
  EXPECT_EQ(events["notes"][0].get<std::string>().find("one-sided derivatives are limits"), 0u);
}

TEST_F(TangibleGradientTest, BadInputIsOneLine) {
  const std::string parameters = "--parameters=bodies/ball/mass ";
  ExpectOneLine(Run("tangible-gradient", parameters + "/nonexistent.json"), 1, "/nonexistent.json");
  ExpectOneLine(Differentiate("--parameters=bodies/bal/mass"), 1,
                "scene.json: parameter bodies/bal/mass: ");
  ExpectOneLine(Differentiate("--parameters=bodies/ball/inertia"), 1, "follows mass and shape");
  ExpectOneLine(Differentiate(parameters + "--out=/nonexistent/g.json"), 1, "/nonexistent/g.json");
  ExpectOneLine(Differentiate(parameters, R"({"bodies": [{"name": "ball", "mass": 1, "inertia": 1,
      "position": [0, 0]}], "simulation": {"integrator": "trapezoidal"}})"),
                1, "scene.json: /simulation/integrator: ");
  const std::string loss = " --loss='" + Path("loss.json") + "'";
  for (const auto& [text, what] : std::initializer_list<std::pair<const char*, const char*>>{
           {R"({"terms": [{"output": "bal/x"}]})", "loss.json: /terms/0/output: "},
           {R"({"terms": [{"output": "ball/x", "weight": "1"}]})", "loss.json: /terms/0/weight: "},
           {R"({"terms": [{"output": "ball/x", "goal": 1}]})", "loss.json: /terms/0/goal: "},
           {R"({"terms": [1]})", "loss.json: /terms/0: "},
           {R"({"terms": []})", "loss.json: /terms: "},
           {R"({"term": []})", "loss.json: /term: "},
           {"3", "loss.json: expected an object"},
           {R"({"terms": [)", "loss.json: "}}) {
    Write("loss.json", text);
    ExpectOneLine(Differentiate(parameters + loss), 1, what);
  }
}

TEST_F(TangibleGradientTest, CheckpointsBoundTheMemoryAndChangeNothing) {
  const std::string parameters = "--parameters=bodies/ball/mass,bodies/*/friction ";
  const json all = json::parse(Differentiate(parameters + "--checkpoint=all").out);
  EXPECT_EQ(all["steps_again"], 0);
  for (const char* checkpoint : {"every:7", "budget:0.05"}) {
    const ProgramRun run = Differentiate(parameters + "--checkpoint=" + checkpoint);
    ASSERT_EQ(run.exit_status, 0) << run.error;
    const json result = json::parse(run.out);
    EXPECT_EQ(result["jacobian"], all["jacobian"]) << checkpoint;
    EXPECT_GT(result["steps_again"], 0) << checkpoint;
    EXPECT_LT(result["tape_bytes"], all["tape_bytes"]) << checkpoint;
  }
  ExpectOneLine(Differentiate(parameters + "--checkpoint=budget:0.001"), 1, "budget of 1049 bytes");
}

TEST_F(TangibleGradientTest, AStepWithoutDifferencesIsWarnedOf) {
  const ProgramRun run = Differentiate("--parameters=bodies/ball/mass --step=1e-6");
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_NE(run.error.find("--step does nothing without --method=finite_difference"),
            std::string::npos)
      << run.error;
}

TEST_F(TangibleGradientTest, WrongFlagsAreUsage) {
  const std::string parameters = "--parameters=bodies/ball/mass ";
  ExpectOneLine(Differentiate(""), 2, "--parameters");
  ExpectOneLine(Differentiate("--parameters=bodies/ball/mass,,gravity/y"), 2, "--parameters");
  ExpectOneLine(Differentiate(parameters + "--method=newton"), 2, "--method");
  ExpectOneLine(Differentiate(parameters + "--step=-1"), 2, "--step");
  ExpectOneLine(Differentiate(parameters + "--side=left --method=tangent"), 2, "--side");
  for (const char* method : {"adjoint", "jet", "jet_implicit", "finite_difference"}) {
    ExpectOneLine(Differentiate(parameters + "--side=plus --method=" + method), 2, "--side");
  }
  ExpectOneLine(Differentiate(parameters + "--step=nan"), 2, "--step");
  ExpectOneLine(Differentiate(parameters + "--repeat=0"), 2, "--repeat");
  ExpectOneLine(Differentiate(parameters + "--factorisations=some"), 2, "--factorisations");
  for (const char* checkpoint : {"", "some", "every:0", "every:2.5", "every:", "every:-1",
                                 "budget:0", "budget:nan", "budget:1e300", "budget:1MiB"}) {
    ExpectOneLine(Differentiate(parameters + "--checkpoint='" + checkpoint + "'"), 2,
                  "--checkpoint");
  }
}

// A ball of radius r is dropped from the height H above the floor and bounces elastically: with
// v = √(2 g H) and s = T − v / g the motion ends at r + v s − g s² / 2.
std::string Bounce(const std::string& simulation) {
  return R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.25}}, "mass": 2, "position": [0, 1.25],
       "restitution": 1},
      {"name": "floor", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], "simulation": {)" +
         simulation + "}}";
}

TEST_F(TangibleGradientTest, SaysHowFarTheMapIsFromTheMotion) {
  const double g = 9.81, v = std::sqrt(2.0 * g), s = 0.56 - v / g;
  const double exact = g / v * s - (v - g * s) / v;
  ASSERT_LT(exact, -0.1);
  const double relative = (1.0 - exact) / std::max(1.0, -exact);
  for (const char* method : {"adjoint", "tangent", "jet_implicit", "finite_difference"}) {
    if (!HaveJets() && std::string(method).find("jet") == 0) continue;
    const ProgramRun run = Differentiate(
        std::string("--parameters=bodies/ball/position/y --compare_motion --method=") + method,
        Bounce(R"("dt": 0.01, "duration": 0.56)"));
    ASSERT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(run.error, "");
    const json result = json::parse(run.out);
    EXPECT_EQ(result["certificate"]["verdict"], "of the discrete map: trustworthy");
    // The tolerance of differences of a smooth motion (lib/simulation).
    EXPECT_NEAR(result["jacobian"][1][0], 1.0, 1e-6) << method;
    const json& motion = result["motion"];
    EXPECT_NEAR(motion["jacobian"][1][0], exact, 1e-6) << method;
    EXPECT_EQ(motion["verdict"], "trustworthy");
    // The speed after the bounce: 0 of the map, and of the motion dv/dH − g ds/dH = 2 g / v.
    EXPECT_GE(motion["difference_max"].get<double>(), relative - 1e-6) << method;
    EXPECT_LE(motion["difference_max"].get<double>(), 2.0) << method;
    EXPECT_EQ(motion["difference_at"]["parameter"], "bodies/ball/position/y");
  }
}

TEST_F(TangibleGradientTest, ComparesTheGradientOfALossWithTheMotions) {
  const std::string loss = Write("loss.json", R"({"terms": [{"output": "ball/y"}]})");
  const std::string flags =
      "--parameters=bodies/ball/position/y --compare_motion --loss='" + loss + "'";
  const ProgramRun run = Differentiate(flags, Bounce(R"("dt": 0.01, "duration": 0.56)"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(run.out);
  const double map = result["gradient"][0], motion = result["motion"]["gradient"][0];
  EXPECT_GT(map, 0.0);
  EXPECT_LT(motion, 0.0);
  EXPECT_NEAR(result["motion"]["difference_max"],
              (map - motion) / std::max(std::abs(map), std::abs(motion)), 1e-12);
  EXPECT_FALSE(result["motion"]["difference_at"].contains("output"));
  // Without contact the map's derivative is the motion's, to the first order of a step.
  const ProgramRun falls = Differentiate(flags, Bounce(R"("dt": 0.01, "duration": 0.3)"));
  EXPECT_LT(json::parse(falls.out)["motion"]["difference_max"].get<double>(), 0.02);
  EXPECT_EQ(json::parse(falls.out)["certificate"]["discrete_map"], false);
}

TEST_F(TangibleGradientTest, SaysWhyThereIsNoMotionToCompare) {
  const std::string flags = "--parameters=bodies/ball/mass --compare_motion";
  ExpectOneLine(
      Differentiate(flags, Bounce(R"("dt": 0.01, "duration": 0.56, "stepping": "event")")), 1,
      "/simulation/stepping: expected fixed with --compare_motion");
  // By events a motion in which a hinge opens fails; a fixed step is projected back.
  const ProgramRun run = Differentiate(flags, R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "mass": 1, "inertia": 0.01, "position": [1, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["ball", "world"], "anchor": [0, 0],
                "rate": 1e4}],
    "simulation": {"dt": 0.05, "duration": 0.1, "joint_correction": "projection"}})");
  ExpectOneLine(run, 1, "--compare_motion: by events: ");
  const json result = json::parse(run.out);
  EXPECT_EQ(result["jacobian"].size(), 6u);
  EXPECT_NE(result["motion"]["message"], "");
}

}  // namespace
}  // namespace tangible
