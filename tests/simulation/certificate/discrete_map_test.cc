// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/discrete_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

std::string Exact(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g", x);
  return text;
}

// A ball of radius 0.125 beside a floor, with what else is given of the two and of the scene.
struct Ball {
  double y = 0.125, speed = 0.0;
  const char* ball = "";
  const char* floor = "";
  const char* more = "";
  const char* simulation = R"("dt": 0.01, "duration": 0.3)";

  std::string Text() const {
    return R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.125}}, "mass": 2,
        "position": [0, )" +
           Exact(y) + R"(], "velocity": [0.5, )" + Exact(speed) + "]" + ball +
           R"(}, {"name": "floor", "static": true,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}})" +
           floor + "}]" + more + R"(, "simulation": {)" + simulation + "}}";
  }
};

Certificate CertificateOf(const std::string& text) {
  Model<double> model;
  State<double> initial;
  BuildModel(SceneOf(text), &model, &initial);
  return CertifyRollout(model, initial);
}

// The certificate of a run whose first change is `kind` in the given step.
void ExpectChange(const std::string& text, const std::string& what, long step) {
  const Certificate c = CertificateOf(text);
  EXPECT_EQ(c.verdict.rfind("of the discrete map: ", 0), 0u) << c.verdict << text;
  EXPECT_EQ(c.discrete_map.rfind("step " + std::to_string(step) + ", t = ", 0), 0u)
      << c.discrete_map << text;
  EXPECT_EQ(c.discrete_map.substr(c.discrete_map.rfind(", ") + 2), what) << text;
}

void ExpectNone(const std::string& text) {
  const Certificate c = CertificateOf(text);
  EXPECT_EQ(c.discrete_map, "") << text;
  EXPECT_EQ(c.discrete_impact, "") << text;
  EXPECT_NE(c.verdict.rfind("of the discrete map: ", 0), 0u) << c.verdict;
}

TEST(DiscreteMapTest, ABallThatFliesRestsSlidesOrRollsIsNoChange) {
  ExpectNone(Ball{.y = 5.0}.Text());
  ExpectNone(Ball{.y = 5.0, .ball = R"(, "restitution": 1)"}.Text());
  ExpectNone(Ball{}.Text());
  ExpectNone(Ball{.ball = R"(, "restitution": 0.5)", .floor = R"(, "restitution": 0.5)"}.Text());
  // The slip ends within the run: rolling is no change of the contact.
  const Ball rolls{.ball = R"(, "friction": 0.5)", .floor = R"(, "friction": 0.5)"};
  ExpectNone(rolls.Text());
  ExpectNone(Ball{.y = 0.125 + 1e-14}.Text());
  // It is thrown up: the contact never closes.
  ExpectNone(Ball{.speed = 2.0}.Text());
  ExpectNone(Ball{.simulation = R"("dt": 0.01, "duration": 0)"}.Text());
}

TEST(DiscreteMapTest, ByEventsThereIsNone) {
  for (const char* e : {"0", "0.7"}) {
    const std::string restitution = std::string(R"(, "restitution": )") + e;
    ExpectNone(Ball{.y = 0.2,
                    .ball = restitution.c_str(),
                    .floor = restitution.c_str(),
                    .simulation = R"("dt": 0.01, "duration": 0.3, "stepping": "event")"}
                   .Text());
  }
}

// Free fall from 0.05 m takes 9.6 steps of 0.01 s.
TEST(DiscreteMapTest, ALandingIsAContactThatIsMade) {
  ExpectNone(Ball{.y = 0.175, .simulation = R"("dt": 0.01, "duration": 0.09)"}.Text());
  ExpectChange(Ball{.y = 0.175, .simulation = R"("dt": 0.01, "duration": 0.1)"}.Text(), "made", 9);
  ExpectChange(Ball{.y = 0.175}.Text(), "made", 9);
  ExpectChange(Ball{.y = 0.1251}.Text(), "made", 0);
  // An impact at the start: the contact was not there before.
  ExpectChange(Ball{.speed = -1.0}.Text(), "made", 0);
}

// Where a step ends on the surface to the last bit, the contact is made in the next one.
TEST(DiscreteMapTest, ALandingOnAStepsEndIsMadeInTheNextStep) {
  const Ball ball{.y = 1.125,
                  .speed = -1.0,
                  .more = R"(, "gravity": [0, 0])",
                  .simulation = R"("dt": 0.125, "duration": 2)"};
  ExpectChange(ball.Text(), "made", 8);
}

TEST(DiscreteMapTest, AnImpactWithRestitution) {
  const char* e = R"(, "restitution": 0.5)";
  ExpectChange(Ball{.y = 0.325, .ball = e, .floor = e}.Text(), "an impact with restitution", 19);
  ExpectChange(Ball{.speed = -2.0, .ball = e, .floor = e}.Text(), "an impact with restitution", 0);
  // Below the threshold it lands.
  ExpectChange(Ball{.y = 0.1251, .ball = e, .floor = e}.Text(), "made", 0);
}

TEST(DiscreteMapTest, AContactThatOpensIsBroken) {
  ExpectChange(Ball{.more = R"(, "forces": [{"name": "f", "body": "ball", "force": [0, 40],
                                             "start": 0.1, "end": 0.2}])"}
                   .Text(),
               "broken", 10);
}

std::string Arm(const char* limits) {
  return std::string(R"({"bodies": [{"name": "arm", "shape": {"box": {"size": [1, 0.1]}}, "mass": 1,
      "position": [0.5, 0]}], "joints": [{"name": "hinge", "type": "revolute",
      "bodies": ["arm", "world"], "anchor": [0, 0], "limits": )") +
         limits + R"(}], "simulation": {"dt": 0.01, "duration": 0.5}})";
}

// φ'' = −(3 / 2) g / l: −0.5 rad after 0.26 s.
TEST(DiscreteMapTest, ALimitThatIsReachedIsMadeAndOneThatCarriesFromTheStartNot) {
  ExpectChange(Arm("[-0.5, 0.5]"), "made", 25);
  ExpectNone(Arm("[0, 0.5]"));
  ExpectNone(Arm("[-3, 3]"));
}

std::string Boxes(double offset, const char* velocity) {
  std::string text = R"({"bodies": [)";
  for (int k = 0; k < 4; ++k) {
    text +=
        R"({"name": "box)" + std::to_string(k) +
        R"(", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "friction": 0.2, "position": [)" +
        Exact(k * offset) + ", " + Exact(0.1 + 0.2 * k) + R"(], "velocity": )" + velocity + "},";
  }
  return text + R"({"name": "floor", "static": true, "friction": 0.2,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.5}})";
}

// With this friction a stack that slides does not tip. Rows of boxes at rest are redundant, and of
// equal boxes the corners of either can be the ends of a face: which row carries nothing, or which
// corner is taken, is no change of the contact.
TEST(DiscreteMapTest, StacksAtRestOrSlidingAreNoChange) {
  for (const double offset : {0.0, 0.03}) {
    ExpectNone(Boxes(offset, "[0, 0]"));
    ExpectNone(Boxes(offset, "[0.7, 0]"));
  }
}

// A box whose middle passes the edge of a table turns: its corner leaves the table's face.
TEST(DiscreteMapTest, ABoxThatTipsOverAnEdgeBreaksAContact) {
  const std::string text = R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1],
       "velocity": [1, 0]},
      {"name": "table", "static": true, "shape": {"box": {"size": [0.6, 0.2]}},
       "position": [0, -0.1]}], "simulation": {"dt": 0.01, "duration": )";
  ExpectNone(text + "0.27}}");
  EXPECT_NE(CertificateOf(text + "0.4}}").discrete_map, "");
}

// A fit warns where the restitution acts, or where the last step makes a contact.
// Two flush tiles are one surface; from one tile a ball or box falls onto a lower one.
TEST(DiscreteMapTest, FromTileToFlushTileNothingIsMadeOrBroken) {
  const auto on_tiles = [](const std::string& shape, double y, double height) {
    const std::string tile =
        R"(, "static": true, "friction": 0.5, "shape": {"box": {"size": [1, 0.25]}}, "position": )";
    return R"({"bodies": [{"name": "left")" + tile + R"([-0.5, -0.125]}, {"name": "right")" + tile +
           "[0.5, " + Exact(height - 0.125) + R"(]}, {"name": "body", "shape": )" + shape +
           R"(, "mass": 2, "friction": 0.5, "position": [-0.3125, )" + Exact(y) +
           R"(], "velocity": [2, 0]}], "simulation": {"dt": 0.01, "duration": 0.3}})";
  };
  for (const char* shape :
       {R"({"circle": {"radius": 0.125}})", R"({"box": {"size": [0.25, 0.25]}})"}) {
    ExpectNone(on_tiles(shape, 0.125, 0.0));
    EXPECT_EQ(
        CertificateOf(on_tiles(shape, 0.125, -0.01)).verdict.rfind("of the discrete map: ", 0), 0u)
        << shape;
  }
}

// A block that is thrown up a slope, in its own directions; it stops after 0.5 s at v = 4 and with
// friction 0.25, and slides back: x'' = −8, then −4.
std::string OnASlope(double v, const char* friction, double duration, const char* stepping) {
  return R"({"gravity": [-6, -8], "bodies": [{"name": "b", "shape": {"box": {"size": [0.4, 0.2]}},
      "mass": 1, "position": [0, 0.1], "velocity": [)" +
         Exact(v) + R"(, 0], "friction": )" + friction +
         R"(}, {"name": "floor", "static": true, "friction": )" + friction +
         R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "stepping": ")" +
         stepping + R"(", "duration": )" + Exact(duration) + "}}";
}

TEST(DiscreteMapTest, ASlipThatTurnsBack) {
  for (const double v : {3.99, 4.0, 4.03, 4.05}) {
    const Certificate back = CertificateOf(OnASlope(v, "0.25", 0.9, "fixed"));
    EXPECT_EQ(back.discrete_map.substr(back.discrete_map.rfind(", ") + 2), "a slip that turns back")
        << v;
    EXPECT_EQ(back.verdict.rfind("of the discrete map: ", 0), 0u) << v << back.verdict;
    ExpectNone(OnASlope(v, "0.25", 0.45, "fixed"));
    ExpectNone(OnASlope(v, "0.25", 0.9, "event"));
    // It rests where it stops.
    ExpectNone(OnASlope(v, "1", 0.9, "fixed"));
  }
}

// What the prefix is for: dx/dv is 0.7 in the motion, and in the map 0.9, or 0.5 where a step ends
// at rest.
TEST(DiscreteMapTest, TheMapsDerivativeBehindASlipThatTurnsBackIsNotTheMotions) {
  for (const double v : {4.01, 4.07}) {
    const auto derivative = [&](const char* stepping) {
      const GradientResult result =
          testing::Jacobian(SceneOf(OnASlope(v, "0.25", 0.9, stepping)), {"bodies/b/velocity/x"},
                            GradientMethod::kAdjoint);
      EXPECT_TRUE(result.done) << result.message;
      return result.jacobian(0, 0);
    };
    EXPECT_NEAR(derivative("event"), v / 8 + 0.5 * (0.9 - v / 8), 1e-9) << v;
    EXPECT_GT(std::abs(derivative("fixed") - derivative("event")), 0.15) << v;
  }
}

TEST(DiscreteMapTest, WhereASmallerStepDoesNotHelp) {
  const char* e = R"(, "restitution": 0.5)";
  const Certificate bounces = CertificateOf(Ball{.y = 0.325, .ball = e, .floor = e}.Text());
  EXPECT_EQ(bounces.discrete_impact, bounces.discrete_map);
  EXPECT_EQ(CertificateOf(Ball{.y = 0.175}.Text()).discrete_impact, "");
  const Certificate last =
      CertificateOf(Ball{.y = 0.175, .simulation = R"("dt": 0.01, "duration": 0.1)"}.Text());
  EXPECT_NE(last.discrete_impact.find("made in the last step"), std::string::npos)
      << last.discrete_impact;
}

// What the prefix is for. A ball is dropped from the height H above the floor and bounces with
// e = 1: at T the motion has y = r + v s − g s² / 2 with v = √(2 g H), s = T − √(2 H / g), of which
// the derivative is negative just after the impact. The map's is +1, by every method.
TEST(DiscreteMapTest, TheMapsDerivativeThroughABounceHasTheOtherSign) {
  const char* e = R"(, "restitution": 1)";
  Ball ball{.y = 1.125, .ball = e, .floor = e};
  ball.simulation = R"("dt": 0.01, "duration": 0.6)";
  Ball motion = ball;
  motion.simulation = R"("dt": 0.01, "duration": 0.6, "stepping": "event")";
  const double g = 9.81, height = 1.0, v = std::sqrt(2.0 * g * height);
  const double fall = v / g, s = 0.6 - fall;
  const double exact = g / v * s - (v - g * s) / v;
  for (const auto& [name, method] : kGradientMethodNames) {
    if (!testing::HaveJets() && std::string(name).find("jet") == 0) continue;
    const GradientResult map =
        testing::Jacobian(SceneOf(ball.Text()), {"bodies/ball/position/y"}, method);
    const GradientResult event =
        testing::Jacobian(SceneOf(motion.Text()), {"bodies/ball/position/y"}, method);
    ASSERT_TRUE(map.done && event.done) << map.message << event.message;
    EXPECT_EQ(map.certificate.verdict, "of the discrete map: trustworthy") << name;
    EXPECT_EQ(event.certificate.verdict, "trustworthy") << name;
    // The tolerance of the unrolled Jets, which are as exact as the interior point.
    EXPECT_NEAR(map.jacobian(1, 0), 1.0, 1e-6) << name;
    EXPECT_NEAR(event.jacobian(1, 0), exact, 1e-6) << name;
  }
}

Certificate OfThe(const std::string& path, const std::string& text) {
  const Scene scene = SceneOf(text);
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  ParameterPath number;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &number, &error)) << error;
  return CertifyDerivative(
      model, initial, RowMatrixXd(VariableJacobian(scene, model.structure, {DirectionOf(number)})),
      {path});
}

Certificate OfTheStart(const std::string& text) { return OfThe("forces/f/start", text); }

// A box at rest with friction under it, on a floor, a table or a rail, is pushed from 0.103 s on:
// the motion's derivative of its speed by that time is −(F − friction) / m, that of the map −F / m
// or 0.
TEST(DiscreteMapTest, APushThatStartsWithinAStepAsFrictionLetsGo) {
  const auto box = [](double start, const std::string& body, const std::string& rest) {
    return R"({"gravity": [0, -10], "bodies": [{"name": "b", "mass": 1, "friction": 0.5,
        "shape": {"box": {"size": [0.4, 0.2]}}, "position": [0, 0.1])" +
           body + R"(}], "forces": [{"name": "f", "body": "b", "force": [8, 0], "start": )" +
           Exact(start) + R"(}], "simulation": {"dt": 0.01, "duration": 0.2})" + rest + "}";
  };
  const std::string floor = R"(}, {"name": "floor", "static": true, "friction": 0.5,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}})";
  const std::string table = R"(, "support": {"friction": 0.5})";
  const std::string rail = R"(, "joints": [{"name": "r", "type": "prismatic", "axis": [1, 0],
      "bodies": ["b", "world"], "anchor": [0, 0.1], "friction": 5}])";
  for (const double start : {0.103, 0.107}) {
    for (const std::string& text : {box(start, floor, ""), box(start, "", rail)}) {
      const Certificate c = OfTheStart(text);
      EXPECT_EQ(c.verdict.rfind("of the discrete map: ", 0), 0u) << c.verdict << text;
      EXPECT_NE(c.discrete_map.find("start of force f, as friction lets go"), std::string::npos)
          << c.discrete_map;
    }
    // With 4 N it stays; on ice there is no friction that lets go.
    std::string held = box(start, floor, "");
    held.replace(held.find("[8, 0]"), 6, "[4, 0]");
    EXPECT_EQ(OfTheStart(held).discrete_map, "");
  }
  std::string seen_from_above = box(0.103, table, "");
  seen_from_above.replace(seen_from_above.find("[0, -10]"), 8, "[0, 0]");
  EXPECT_NE(OfTheStart(seen_from_above).discrete_map.find("start of force f"), std::string::npos);
  std::string without = box(0.103, "", rail);
  without.replace(without.find("\"friction\": 5}"), 14, "\"friction\": 0}");
  EXPECT_EQ(OfTheStart(without).discrete_map, "");
}

// The same where the push sets in on a step's end, a disc's rolling friction lets go, or the path
// of what carries a body begins.
TEST(DiscreteMapTest, WhateverLetsFrictionGoIsTheMaps) {
  const char* const disc = R"({"gravity": [0, -10], "bodies": [{"name": "b", "mass": 1,
      "shape": {"circle": {"radius": 0.1}}, "position": [0, 0.1], "friction": 0.5,
      "rolling_friction": 0.02}, {"name": "floor", "static": true, "friction": 0.5,
      "rolling_friction": 0.02, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "forces": [{"name": "f", "body": "b", "force": [4, 0], "start": )";
  for (const double start : {0.1, 0.103}) {
    const std::string text =
        disc + Exact(start) + R"(}], "simulation": {"dt": 0.01, "duration": 0.3}})";
    EXPECT_NE(OfTheStart(text).discrete_map.find("start of force f, as friction lets go"),
              std::string::npos)
        << start;
  }
  for (const double dt : {0.01, 0.0073}) {
    const Certificate c = OfThe("bodies/belt/motion/delay", R"({"gravity": [0, -10], "bodies": [
        {"name": "belt", "kinematic": true, "position": [0, -0.05], "friction": 0.4,
         "shape": {"box": {"size": [20, 0.1]}}, "motion": {"time": [0, 0.5, 1.5],
         "x": [0, 0, 2], "interpolation": "linear", "delay": 0}},
        {"name": "b", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0.05],
         "friction": 0.4}], "simulation": {"dt": )" + Exact(dt) +
                                                                R"(, "duration": 1.25}})");
    EXPECT_NE(c.discrete_map.find("jump of the path of belt, as friction lets go"),
              std::string::npos)
        << c.discrete_map << dt;
  }
}

// Friction other than of a contact's slip turns back too, with other accelerations on either side.
TEST(DiscreteMapTest, RollingJointsAndSupportsTurnBack) {
  const std::string steps = R"(, "simulation": {"dt": 0.01, "duration": )";
  const std::string slope = R"({"gravity": [-3, -10], "bodies": [
      {"name": "floor", "static": true, "friction": 0.5, "rolling_friction": 0.01,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1],
       "velocity": [1.03, 0], "angular_velocity": -10.3, "friction": 0.5,
       "rolling_friction": 0.01}])" +
                            steps;
  const std::string table = R"({"gravity": [0, 0], "forces": [
      {"name": "p", "body": "b", "force": [-4, 0]}], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1.03, 0],
       "support": {"friction": 0.1, "load": 10}}])" +
                            steps;
  const std::string lift = R"({"gravity": [0, -10], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}], "joints": [
      {"name": "j", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
       "axis": [0, 1], "friction": 2, "rate": 1}])" +
                           steps;
  for (const std::string& text : {slope, table, lift}) {
    EXPECT_NE(CertificateOf(text + "0.8}}").discrete_map.find("a slip that turns back"),
              std::string::npos)
        << text;
    ExpectNone(text + "0.05}}");
  }
}

// At rest, and moved by its load at once: set off against it, it has the other friction first.
TEST(DiscreteMapTest, WhatItsLoadSetsOffFromRestIsNamed) {
  const std::string pushed = R"({"gravity": [5, -10], "bodies": [
      {"name": "floor", "static": true, "friction": 0.2,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "inertia": 1000,
       "position": [0, 0.1], "friction": 0.2}], "simulation": {"dt": 0.01, "duration": 0.5}})";
  const std::string table = R"({"gravity": [0, 0], "forces": [
      {"name": "p", "body": "b", "force": [2, 0]}], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
       "support": {"friction": 0.1, "load": 10}}], "simulation": {"dt": 0.01, "duration": 0.5}})";
  for (const std::string& text : {pushed, table}) {
    const auto verdict = [&](const char* path) {
      return testing::Jacobian(SceneOf(text), {path}, GradientMethod::kTangent).certificate.verdict;
    };
    EXPECT_EQ(verdict("bodies/b/velocity/x").rfind("of the discrete map: ", 0), 0u) << text;
    EXPECT_EQ(verdict("bodies/b/mass"), "trustworthy") << text;
  }
}

}  // namespace
}  // namespace tangible
