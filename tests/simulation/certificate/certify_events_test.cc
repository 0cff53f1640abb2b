// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "../../support/gradients.h"
#include "../../support/rescaled.h"
#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

Certificate CertificateOf(const std::string& bodies, double duration, const std::string& more = "",
                          const std::string& integrator = "trapezoidal") {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf("{" + bodies + R"(, "simulation": {"stepping": "event",
      "integrator": ")" +
                     integrator + R"(", "dt": 0.01, "duration": )" + std::to_string(duration) +
                     more + "}}"),
             &model, &state);
  return CertifyRollout(model, state);
}

std::string Floor() {
  return R"({"name": "floor", "static": true, "friction": 0.3, "restitution": 0.5,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
}

TEST(CertifyEventsTest, ABounceIsTrustworthy) {
  const Certificate c = CertificateOf(R"("bodies": [{"name": "ball",
      "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1], "restitution": 0.5}, )" +
                                          Floor() + "]",
                                      0.6);
  EXPECT_EQ(c.verdict, "trustworthy");
  EXPECT_EQ(c.events, 1);
}

// A box that is moved out of penetration turns until its other lower corner is the nearest, in
// penetration as well: its gap does not tell when, so that the derivative is not that of the
// motion.
TEST(CertifyEventsTest, ACornerThatBecomesTheNearestInPenetrationIsNamed) {
  const auto verdict = [](double duration) {
    return CertificateOf(R"("bodies": [{"name": "box", "mass": 0.8, "friction": 0.1,
        "restitution": 0.5, "shape": {"box": {"size": [0.05, 0.24]}}, "position": [0, -0.096],
        "angle": -0.8223, "angular_velocity": -2.302}, )" +
                             Floor() + "]",
                         duration, "", "runge_kutta_4")
        .verdict;
  };
  EXPECT_EQ(verdict(0.038), "trustworthy");
  EXPECT_NE(verdict(0.0395).find("another feature becomes the nearest in penetration"),
            std::string::npos)
      << verdict(0.0395);
}

// Two discs dropped from one height, or sliding at one speed. By themselves each has events of its
// own; a strut between them makes their impacts one, and an end of sliding that of both.
TEST(CertifyEventsTest, EventsOfCoupledBodiesAtTheSameTimeAreNamed) {
  const auto verdict = [](double height_a, double height_b, double speed, bool strut) {
    const auto disc = [&](const char* name, double x, double y) {
      return R"({"name": ")" + std::string(name) +
             R"(", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "friction": 0.3,
          "restitution": 0.5, "position": [)" +
             std::to_string(x) + ", " + std::to_string(y) + R"(], "velocity": [)" +
             std::to_string(speed) + ", 0]}";
    };
    return CertificateOf(R"("bodies": [)" + disc("a", 0.0, height_a) + ", " +
                             disc("b", 1.0, height_b) + ", " + Floor() + "]" +
                             (strut ? R"(, "joints": [{"name": "strut", "type": "distance",
                                 "bodies": ["a", "b"], "anchors": [[0, )" +
                                          std::to_string(height_a) + "], [1, " +
                                          std::to_string(height_b) + "]]}]"
                                    : ""),
                         0.2)
        .verdict;
  };
  EXPECT_EQ(verdict(0.2, 0.2, 0.0, false), "trustworthy");
  EXPECT_EQ(verdict(0.2, 0.19, 0.0, false), "trustworthy");
  EXPECT_EQ(verdict(0.125, 0.125, 0.3, false), "trustworthy");
  const std::string touch = verdict(0.2, 0.2, 0.0, true);
  EXPECT_NE(touch.find("two contacts touch at the same time"), std::string::npos) << touch;
  const std::string slip = verdict(0.125, 0.125, 0.3, true);
  EXPECT_NE(slip.find("two contacts stop sliding at the same time"), std::string::npos) << slip;
}

// A disc that meets a floor and a wall at once: without friction neither impact acts on the other;
// with friction at the floor the order decides in which direction that acts.
TEST(CertifyEventsTest, AFloorAndAWallMetAtOnceAreNamedWhereTheyActOnEachOther) {
  const auto verdict = [](const char* friction) {
    return CertificateOf(
               std::string(R"("gravity": [0, 0], "bodies": [{"name": "disc",
        "shape": {"circle": {"radius": 0.125}}, "mass": 1, "restitution": 0.5,
        "position": [0, 0.625], "velocity": [1, -1]}, )") +
                   Floor() +
                   R"(, {"name": "wall", "static": true, "shape": {"box": {"size": [1, 4]}},
        "position": [1.125, 0]}], "pairs": [
        {"bodies": ["disc", "wall"], "friction": 0, "restitution": 0.5},
        {"bodies": ["disc", "floor"], "friction": )" +
                   friction + R"(, "restitution": 0.8}])",
               0.7)
        .verdict;
  };
  EXPECT_EQ(verdict("0"), "trustworthy");
  EXPECT_NE(verdict("0.3").find("discontinuous"), std::string::npos) << verdict("0.3");
}

// A ball that meets two others at right angles: in another place the angle is another one, and the
// order of the impacts matters.
TEST(CertifyEventsTest, BallsMetAtRightAnglesAreAKink) {
  const auto ball = [](const char* name, const char* place) {
    return R"({"name": ")" + std::string(name) +
           R"(", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "restitution": 0.5, )" + place +
           "}";
  };
  const std::string verdict =
      CertificateOf(R"("gravity": [0, 0], "bodies": [)" +
                        ball("a", R"("position": [0, 0], "velocity": [1, 1])") + ", " +
                        ball("b", R"("position": [0.75, 0.5])") + ", " +
                        ball("c", R"("position": [0.5, 0.75])") + "]",
                    0.7)
          .verdict;
  EXPECT_EQ(verdict.find("discontinuous"), std::string::npos) << verdict;
  EXPECT_NE(verdict.find("two contacts touch at the same time"), std::string::npos) << verdict;
}

// A ball on a floor whose bounces follow each other ever faster: most of them within one step.
TEST(CertifyEventsTest, ASeriesThatRoundingEndsIsNamed) {
  const auto of = [](const char* more) {
    return CertificateOf(R"("bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}},
      "mass": 1, "position": [0, 0.1], "velocity": [0, 0.01], "restitution": 0.5}, )" +
                             Floor() + "]",
                         0.01, more);
  };
  const Certificate series = of(R"(, "restitution_threshold": 1e-16, "max_events_per_step": 4)");
  EXPECT_EQ(series.verdict.find("near a kink: "), 0u) << series.verdict;
  EXPECT_NE(series.verdict.find("events in a step"), std::string::npos) << series.verdict;
  EXPECT_EQ(of("").verdict.find("events in a step"), std::string::npos);
  // With as many events as the series has until its rest is next to nothing it ends at its limit.
  EXPECT_EQ(of(R"(, "restitution_threshold": 1e-16)").verdict.find("events in a step"),
            std::string::npos);
}

// Without another body nothing only touches when another impact moves it.
TEST(CertifyEventsTest, ABallThatComesToRestAloneIsNoDiscontinuity) {
  const Certificate c = CertificateOf(R"("bodies": [
      {"name": "floor", "static": true, "restitution": 0.3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.15],
       "velocity": [1, 0], "restitution": 0.3}])",
                                      1.0, "", "trapezoidal");
  EXPECT_EQ(c.verdict.find("discontinuous"), std::string::npos) << c.verdict;
}

// A disc sunk between two boxes that part, as deep in the one as in the other: which one it would
// leave first is either side's choice.
TEST(CertifyEventsTest, ContactsThatCloseAtOnceAreAKink) {
  const auto verdict = [](const char* x) {
    return CertificateOf(std::string(R"("bodies": [
        {"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "friction": 0.3,
         "position": [)") + x +
                             R"(, 0.1]},
        {"name": "left", "kinematic": true, "shape": {"box": {"size": [1, 1]}}, "friction": 0.3,
         "position": [-0.55, -0.5], "velocity": [-0.5, 0]},
        {"name": "right", "kinematic": true, "shape": {"box": {"size": [1, 1]}}, "friction": 0.3,
         "position": [0.55, -0.5], "velocity": [0.5, 0]}])",
                         0.1)
        .verdict;
  };
  EXPECT_NE(verdict("0").find("two contacts of disc close at once"), std::string::npos)
      << verdict("0");
  EXPECT_EQ(verdict("0.01").find("close at once"), std::string::npos) << verdict("0.01");
}

TEST(CertifyEventsTest, AFlatLandingIsADiscontinuity) {
  const Certificate c = CertificateOf(R"("bodies": [{"name": "box",
      "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 1]}, )" +
                                          Floor() + "]",
                                      0.6);
  EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
  EXPECT_NE(c.verdict.find("box touch at once"), std::string::npos) << c.verdict;
}

// Also on a table, whose friction holds the balls at rest without a force between them.
TEST(CertifyEventsTest, ATouchingCradleIsADiscontinuity) {
  for (const char* support : {"", R"(, "support": {"friction": 0.1})"}) {
    const auto ball = [&](const char* name, const char* place) {
      return std::string(R"({"name": ")") + name + R"(", "shape": {"circle": {"radius": 0.1}},
          "mass": 1, "restitution": 1, "position": )" +
             place + support + "}";
    };
    const Certificate c = CertificateOf(
        R"("gravity": [0, 0], "bodies": [)" + ball("a", R"([-0.5, 0], "velocity": [1, 0])") + ", " +
            ball("b", "[0, 0]") + ", " + ball("c", "[0.2, 0]") + "]",
        1.0);
    EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
  }
}

TEST(CertifyEventsTest, AnApproachAtTheThresholdIsADiscontinuity) {
  const Certificate c = CertificateOf(R"("gravity": [0, 0], "bodies": [{"name": "ball",
      "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1005], "velocity": [0, -1e-3],
      "restitution": 0.5}, )" + Floor() + "]",
                                      0.8);
  EXPECT_EQ(c.verdict.find("discontinuous: "), 0u) << c.verdict;
  EXPECT_NE(c.verdict.find("threshold"), std::string::npos) << c.verdict;
}

// Of the derivatives with respect to some paths.
Certificate CertificateFor(const std::string& bodies, const std::vector<std::string>& paths) {
  const Scene scene = SceneOf("{" + bodies + R"(, "simulation": {"stepping": "event",
      "integrator": "trapezoidal", "dt": 0.01, "duration": 0.05}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  std::vector<ParameterDirection> directions;
  for (const std::string& path : paths) {
    ParameterPath parameter;
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
    directions.push_back(DirectionOf(parameter));
  }
  return CertifyDerivative(
      model, state, RowMatrixXd(VariableJacobian(scene, model.structure, directions)), paths);
}

// The box stands on the floor: higher it falls first, deeper it is pushed out. What moves it along
// the floor, or sets speeds and forces, has both sides.
TEST(CertifyEventsTest, ATouchAtTheStartIsOneSidedForWhatChangesItsGap) {
  const auto box = [](const std::string& y) {
    return R"("bodies": [{"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1,
        "position": [0.5, )" +
           y + R"(], "friction": 0.3}, )" + Floor() + "]";
  };
  for (const char* path : {"bodies/box/position/y", "bodies/box/angle", "bodies/box/shape/size/y",
                           "bodies/floor/shape/offset"}) {
    const std::string verdict = CertificateFor(box("0.1"), {"bodies/box/mass", path}).verdict;
    EXPECT_EQ(verdict.find("one-sided: contact of box and floor touches at the start, "), 0u)
        << verdict;
    EXPECT_NE(verdict.find(path), std::string::npos) << verdict;
    EXPECT_EQ(CertificateFor(box("0.2"), {path}).verdict, "trustworthy") << path;
  }
  EXPECT_EQ(CertificateFor(box("0.1"), {"bodies/box/position/x", "bodies/box/velocity/x",
                                        "bodies/box/velocity/y", "bodies/box/mass", "gravity/y",
                                        "bodies/box/friction"})
                .verdict,
            "trustworthy");
}

// A hundredth of a ball's radius is a gap, also of a ball of 10 nm.
TEST(CertifyEventsTest, WhatTouchesAtTheStartIsAShareOfTheBodies) {
  const auto verdict = [](double y, double length) {
    const Scene scene = test_scenes::Rescaled(
        SceneOf(R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
            "position": [0, )" +
                std::to_string(y) + "]}, " + Floor() +
                R"(], "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.01}})"),
        {length, 1.0});
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    const RowMatrixXd directions =
        RowMatrixXd::Identity(model.structure->num_variables(), 3);  // the ball's pose
    return CertifyDerivative(model, state, directions, {"x", "y", "angle"}).verdict;
  };
  for (const double length : {1e-7, 1.0, 1e6}) {
    EXPECT_EQ(verdict(0.101, length), "trustworthy") << length;
    EXPECT_EQ(verdict(0.1, length).find("one-sided: contact of ball and floor touches"), 0u)
        << length << ": " << verdict(0.1, length);
  }
}

TEST(CertifyEventsTest, ALimitAtTheStartIsOneSidedToo) {
  const std::string arm = R"("bodies": [{"name": "arm", "shape": {"box": {"size": [0.4, 0.05]}},
      "mass": 1, "position": [0.2, 0]}], "joints": [{"name": "pin", "type": "revolute",
      "bodies": ["arm", "world"], "anchor": [0, 0], "limits": [0, 1]}])";
  const std::string verdict = CertificateFor(arm, {"joints/pin/angle"}).verdict;
  EXPECT_EQ(verdict.find("one-sided: low limit of joint pin touches at the start"), 0u) << verdict;
  EXPECT_EQ(CertificateFor(arm, {"bodies/arm/mass"}).verdict, "trustworthy");
}

// What a load takes away from a limit, or from a contact whose load begins at 0 and grows, opens at
// once: a speed against it is stopped, one along with the load is not.
TEST(CertifyEventsTest, WhatOpensAtTheStartIsOneSidedForItsSpeed) {
  const auto cart = [](const std::string& load) {
    return load + R"(, "bodies": [{"name": "cart", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "joints": [{"name": "rail", "type": "prismatic", "bodies": ["cart", "world"],
        "anchor": [0, 0], "axis": [1, 0], "limits": [0, 9]}])";
  };
  const std::string grows =
      R"("force": {"time": [0, 4], "x": [0, 40], "y": [0, 40], "interpolation": "linear"}}])";
  const std::string ball = R"("gravity": [0, 0], "bodies": [{"name": "ball", "mass": 1,
      "shape": {"circle": {"radius": 0.25}}, "position": [0, 0.25]}, )" +
                           Floor() + R"(], "forces": [{"name": "f", "body": "ball", )" + grows;
  struct Case {
    std::string scene;
    const char* speed;
    const char* load;
    const char* reason;
  };
  const std::string rail = "one-sided: low limit of joint rail touches at the start, ";
  const std::string floor = "one-sided: contact of ball and floor touches at the start, ";
  for (const Case& c :
       {Case{cart(R"("gravity": [2, 0])"), "joints/rail/rate", "bodies/cart/mass", rail.c_str()},
        Case{cart(R"("gravity": [0, 0], "forces": [{"name": "f", "body": "cart", )" + grows),
             "joints/rail/rate", "bodies/cart/mass", rail.c_str()},
        Case{ball, "bodies/ball/velocity/y", "bodies/ball/mass", floor.c_str()}}) {
    const std::string verdict = CertificateFor(c.scene, {c.speed}).verdict;
    EXPECT_EQ(verdict, std::string(c.reason) + c.speed + " changes the speed at which it opens");
    EXPECT_EQ(CertificateFor(c.scene, {c.load}).verdict, "trustworthy") << c.scene;
  }
}

TEST(CertifyEventsTest, FrictionAtItsLimitIsAKink) {
  // tan of the slope = μ exactly.
  const Certificate c = CertificateOf(R"("gravity": [2.4, -8], "bodies": [{"name": "box",
      "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1], "friction": 0.3}, )" +
                                          Floor() + "]",
                                      0.1);
  EXPECT_EQ(c.verdict.find("near a kink: "), 0u) << c.verdict;
  EXPECT_GT(c.degenerate_rows, 0);
}

// A disc slides off the end of a face as the run starts: placed farther back it leaves it later.
TEST(CertifyEventsTest, ADiscAtTheEndOfAFaceAtTheStartIsOneSided) {
  const auto disc = [](double x) {
    return R"("bodies": [{"name": "disc", "shape": {"circle": {"radius": 0.25}}, "mass": 1,
        "position": [)" +
           std::to_string(x) + R"(, 0.25], "velocity": [3, 0]}, {"name": "ledge", "static": true,
        "shape": {"box": {"size": [10, 0.5]}}, "position": [-5, -0.25]}])";
  };
  for (const char* path :
       {"bodies/disc/position/x", "bodies/ledge/position/x", "bodies/ledge/shape/size/x"}) {
    EXPECT_EQ(CertificateFor(disc(0.0), {path})
                  .verdict.find("one-sided: contact of disc and ledge is at the end of a face"),
              0u)
        << path << ": " << CertificateFor(disc(0.0), {path}).verdict;
    EXPECT_EQ(CertificateFor(disc(-0.01), {path}).verdict, "trustworthy") << path;
  }
  EXPECT_EQ(CertificateFor(disc(0.0), {"bodies/disc/velocity/x"}).verdict, "trustworthy");
}

// At rest above the end it stays on one side and tips over on the other, whatever moves it.
TEST(CertifyEventsTest, ADiscAtRestAboveACornerIsOneSided) {
  const char disc[] = R"("bodies": [{"name": "disc", "shape": {"circle": {"radius": 0.25}},
      "mass": 1, "position": [0, 0.25]}, {"name": "ledge", "static": true,
      "shape": {"box": {"size": [10, 0.5]}}, "position": [-5, -0.25]}])";
  for (const char* path : {"bodies/disc/position/x", "bodies/disc/velocity/x"}) {
    EXPECT_EQ(CertificateFor(disc, {path})
                  .verdict.find("one-sided: contact of disc and ledge is at the end of a face"),
              0u)
        << path << ": " << CertificateFor(disc, {path}).verdict;
  }
  EXPECT_EQ(CertificateFor(disc, {"bodies/disc/mass"}).verdict, "trustworthy");
}

// A slider whose motor reaches its speed as it meets its limit: faster it would still be driven
// there. It matters in which order both come, whatever the restitution.
TEST(CertifyEventsTest, AnImpactAsAMotorReachesItsSpeedIsAKink) {
  const auto slider = [](const char* limit) {
    return std::string(R"("gravity": [0, 0], "bodies": [{"name": "b", "mass": 1, "inertia": 0.01,
        "position": [0, 0]}], "joints": [{"name": "j", "type": "prismatic",
        "bodies": ["b", "world"], "anchor": [0, 0], "axis": [1, 0], "limits": [-1, )") +
           limit + R"(], "limit_restitution": 1, "motor": {"speed": 1, "limit": 40}}])";
  };
  EXPECT_NE(CertificateFor(slider("0.0125"), {"joints/j/motor/speed"})
                .verdict.find("an impact as a contact stops sliding"),
            std::string::npos)
      << CertificateFor(slider("0.0125"), {"joints/j/motor/speed"}).verdict;
  EXPECT_EQ(CertificateFor(slider("0.02"), {"joints/j/motor/speed"}).verdict, "trustworthy");
}

// Joint friction that is exactly at its limit beside a motor that turns: the motor's force is
// determined, so that friction has no other share.
TEST(CertifyEventsTest, FrictionAtItsLimitBesideAMotorIsAKink) {
  const auto slider = [](const char* effort) {
    return std::string(R"("gravity": [0, 0], "bodies": [{"name": "b", "mass": 1, "inertia": 0.01,
        "position": [0, 0]}], "joints": [{"name": "j", "type": "prismatic",
        "bodies": ["b", "world"], "anchor": [0, 0], "axis": [1, 0], "friction": 1,
        "effort": )") +
           effort + R"(, "motor": {"speed": 1, "limit": 2}}])";
  };
  EXPECT_EQ(CertificateFor(slider("-1"), {"joints/j/motor/limit"}).verdict.find("near a kink"), 0u)
      << CertificateFor(slider("-1"), {"joints/j/motor/limit"}).verdict;
  EXPECT_EQ(CertificateFor(slider("-1.5"), {"joints/j/motor/limit"}).verdict, "trustworthy");
}

// The friction of a cube at rest is the ratio of its sides: a push that it cannot hold lets it
// slide upright, with less friction too, and with more it tips.
TEST(CertifyEventsTest, ACubeThatSlidesAtTheLimitOfTippingIsAtAKink) {
  const auto certified = [](double friction, double start) {
    const std::string mu = test_scenes::Text(friction);
    return testing::Jacobian(
               test_scenes::SceneOf(R"({"gravity": [0, -10], "bodies": [
                   {"name": "floor", "static": true, "friction": )" +
                                    mu +
                                    R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
                   {"name": "b", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1,
                    "position": [0, 0.1], "friction": )" +
                                    mu +
                                    R"(}], "forces": [{"name": "n", "body": "b", "force": [20, 0],
                    "start": )" + test_scenes::Text(start) +
                                    R"(}], "simulation": {"dt": 0.01, "duration": 0.5,
                    "stepping": "event"}})"),
               {"bodies/*/friction"}, GradientMethod::kTangent)
        .certificate.verdict;
  };
  for (const double start : {0.3, 0.295}) {
    EXPECT_EQ(certified(1.0, start).rfind("near a kink", 0), 0u) << certified(1.0, start);
    EXPECT_EQ(certified(0.9, start), "trustworthy");
    EXPECT_EQ(certified(1.1, start), "trustworthy");
  }
}

// A car whose rail's friction of 2 N stops it on a step's end, as what it carries begins to slide
// on it with the same friction: it stays, or is taken along where its own is a little smaller.
TEST(CertifyEventsTest, AStopAtTheLimitOfWhatBeginsToSlideIsAKink) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "car", "mass": 1, "inertia": 1, "position": [0, 0]},
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
      "joints": [{"name": "j0", "type": "prismatic", "bodies": ["car", "world"], "anchor": [0, 0],
                  "axis": [1, 0], "friction": 2, "rate": 1},
                 {"name": "r", "type": "prismatic", "bodies": ["b", "car"], "anchor": [0, 0],
                  "axis": [1, 0], "friction": 2}],
      "forces": [{"name": "f", "body": "b", "force": [-3, 0]}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  const auto by = [&](const char* path, DerivativeSide side) {
    return FinalStateJacobian(scene, testing::Resolve(scene, {path}),
                              {.method = GradientMethod::kTangent, .side = side});
  };
  const GradientResult plus = by("joints/j0/friction", DerivativeSide::kPlus);
  EXPECT_EQ(plus.certificate.verdict.rfind("near a kink", 0), 0u) << plus.certificate.verdict;
  ASSERT_TRUE(plus.done) << plus.message;
  EXPECT_NEAR(plus.jacobian(0, 0), -0.04, 1e-6);
  EXPECT_NEAR(by("joints/j0/friction", DerivativeSide::kMinus).jacobian(0, 0), 0.14, 1e-6);
  EXPECT_NEAR(by("joints/r/friction", DerivativeSide::kPlus).jacobian(0, 0), -0.18, 1e-6);
  EXPECT_NEAR(by("joints/r/friction", DerivativeSide::kMinus).jacobian(0, 0), 0.0, 1e-6);
}

}  // namespace
}  // namespace tangible
