// SPDX-License-Identifier: Apache-2.0
//
// Splines: motions in bowls, loops and half-pipes against closed forms, the orders at which curves
// through more points, facets and fixed steps approach them, and derivatives by every method.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectAllAgree;
using testing::ExpectNear;
using testing::Jacobian;

struct RunOnSpline {
  RolloutReport report;
  State<double> final;
};

RunOnSpline RollOnSpline(const Scene& scene) {
  Model<double> model;
  State<double> start;
  RunOnSpline run;
  BuildModel(scene, &model, &start);
  run.report = Rollout(model, start, nullptr, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

struct OnTrack {
  std::string stepping = "event";
  double dt = 0.01;
  double duration = 1.0;
  double friction = 0.0;
  double restitution = 0.0;
};

Scene OnGround(const std::string& body, const std::string& ground, const OnTrack& with) {
  const std::string law =
      R"("friction": )" + Text(with.friction) + R"(, "restitution": )" + Text(with.restitution);
  return SceneOf(R"({"bodies": [{"name": "b", "mass": 2, )" + law + ", " + body +
                 R"(}, {"name": "ground", "static": true, )" + law + R"(, "shape": {)" + ground +
                 R"(}}], "simulation": {"stepping": ")" + with.stepping + R"(", "dt": )" +
                 Text(with.dt) + R"(, "duration": )" + Text(with.duration) + "}}");
}

/// A track of `count` points at equal distances of a parameter, with the free side on the left of
/// the way along it.
std::string Track(const std::string& type, int count, double low, double high, bool closed,
                  const std::function<Vector2<double>(double)>& at) {
  std::string points;
  for (int i = 0; i < count; ++i) {
    const Vector2<double> p = at(low + (high - low) * i / (closed ? count : count - 1));
    points += (i > 0 ? ", [" : "[") + Text(p.x()) + ", " + Text(p.y()) + "]";
  }
  return "\"" + type + R"(": {"points": [)" + points + R"(], "solid": "right", "closed": )" +
         (closed ? "true" : "false") + "}";
}

Vector2<double> OnCircle(double angle) {
  return Vector2<double>(std::sin(angle), -std::cos(angle));
}

const char kParabola[] = R"("spline": {"points": [[-1, 1], [0, 0], [1, 1]], "solid": "right"})";
const char kPoint[] = R"("inertia": 1, "contact_points": [[0, 0]], )";

/// A quarter of the period of a point on y = x² that starts at rest at x = a: the integral of
/// √(1 + 4 a² sin² θ) / √(2 g) over a quarter of a turn, by the trapezoidal rule, whose error is
/// exponentially small.
double QuarterOnParabola(double a, double g) {
  constexpr int kParts = 64;
  double sum = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double sine = std::sin(0.5 * std::numbers::pi * (i + 0.5) / kParts);
    sum += std::sqrt(1.0 + 4.0 * a * a * sine * sine);
  }
  return 0.5 * std::numbers::pi * sum / kParts / std::sqrt(2.0 * g);
}

// A spline through three points is a parabola. A point that starts on it at rest is at the bottom
// after a quarter of its period, with all of its energy.
TEST(SplineTest, APointOnAParabola) {
  const double a = 0.6, quarter = QuarterOnParabola(a, kGravity);
  const std::string body =
      kPoint + std::string(R"("position": [)") + Text(a) + ", " + Text(a * a) + "]";
  const Scene scene = OnGround(body, kParabola, {.dt = quarter / 400.0, .duration = quarter});
  const RunOnSpline run = RollOnSpline(scene);
  EXPECT_EQ(run.report.events, 0);
  const double speed = std::sqrt(2.0 * kGravity) * a;
  EXPECT_NEAR(run.final.pose[0], 0.0, 1e-9);
  EXPECT_NEAR(run.final.pose[1], 0.0, 1e-9);
  EXPECT_NEAR(run.final.twist[0], -speed, 1e-9);
  // x = −speed (t − quarter) near the bottom, and the quarter goes with g⁻¹ᐟ².
  const double by_gravity = speed * 0.5 * quarter / kGravity;
  for (const GradientMethod method :
       {GradientMethod::kAdjoint, GradientMethod::kTangent, GradientMethod::kFiniteDifference,
        GradientMethod::kJetImplicit, GradientMethod::kJet}) {
    if (!testing::HaveJets() &&
        (method == GradientMethod::kJetImplicit || method == GradientMethod::kJet)) {
      continue;
    }
    const GradientResult result = Jacobian(scene, {"gravity/y"}, method);
    EXPECT_NEAR(result.jacobian(0, 0), by_gravity, 1e-7) << static_cast<int>(method);
    EXPECT_NEAR(result.jacobian(3, 0), speed * 0.5 / kGravity, 1e-7) << static_cast<int>(method);
  }
}

// Two points are a line, on which a disc bounces, slides and rolls as on a polyline's edge; the
// derivatives by the points are the same.
TEST(SplineTest, TwoPointsAreTheEdgeOfAPolyline) {
  const std::string points = R"(": {"points": [[-2, 0.8], [3, -0.9]], "solid": "right"})";
  const std::vector<std::string> paths = {
      "bodies/b/position/x", "bodies/b/shape/radius", "bodies/ground/shape/points/0/y",
      "bodies/ground/shape/points/1/x", "bodies/ground/shape/points/1/y"};
  for (const char* shape : {R"("circle": {"radius": 0.1})", R"("box": {"size": [0.3, 0.2]})"}) {
    const std::string body = R"("shape": {)" + std::string(shape) +
                             R"(}, "position": [-1, 0.75], "velocity": [0.4, 0], "angle": 0.1)";
    for (const char* stepping : {"fixed", "event"}) {
      SCOPED_TRACE(shape + std::string(" ") + stepping);
      const OnTrack with{stepping, 0.01, 0.9, 0.3, 0.4};
      const bool is_disc = shape[1] == 'c';
      std::vector<std::string> own = paths;
      if (!is_disc) own[1] = "bodies/b/shape/size/x";
      const Scene line = OnGround(body, "\"polyline" + points, with);
      const Scene curve = OnGround(body, "\"spline" + points, with);
      ExpectNear(RollOnSpline(line).final, RollOnSpline(curve).final, 1e-10);
      const GradientResult of_line = Jacobian(line, own, GradientMethod::kAdjoint);
      const GradientResult of_curve = Jacobian(curve, own, GradientMethod::kAdjoint);
      EXPECT_LT((of_line.jacobian - of_curve.jacobian).cwiseAbs().maxCoeff(),
                1e-7 * (1.0 + of_line.jacobian.cwiseAbs().maxCoeff()));
    }
  }
}

/// Whether a disc that starts at the bottom of a closed round track of 400 points stays on it.
bool GoesRound(double square, double friction, bool rolls) {
  const double radius = 0.1, centre = 1.0 - radius;
  const double speed = std::sqrt(square * kGravity * centre);
  const std::string body = R"("shape": {"circle": {"radius": 0.1}}, "position": [0, )" +
                           Text(-centre) + R"(], "velocity": [)" + Text(speed) +
                           R"(, 0], "angular_velocity": )" + Text(rolls ? -speed / radius : 0.0);
  const Scene scene =
      OnGround(body, Track("spline", 400, 0.0, 2.0 * std::numbers::pi, true, OnCircle),
               {.dt = 0.002, .duration = 0.9, .friction = friction});
  const RunOnSpline run = RollOnSpline(scene);
  return run.report.events == 0;
}

// With R the radius of the circle of its centre, a disc stays on the track if v² > 5 g R where it
// slides without friction, and v² > 11/3 g R where it rolls.
TEST(SplineTest, TheLeastSpeedInALoop) {
  constexpr double kShare = 1e-4;
  EXPECT_TRUE(GoesRound(5.0 * (1.0 + kShare), 0.0, false));
  EXPECT_FALSE(GoesRound(5.0 * (1.0 - kShare), 0.0, false));
  EXPECT_TRUE(GoesRound(11.0 / 3.0 * (1.0 + kShare), 1000.0, true));
  EXPECT_FALSE(GoesRound(11.0 / 3.0 * (1.0 - kShare), 1000.0, true));
}

/// A disc that slides and rolls inside of a round track: the angle of its centre from the lowest
/// point, its speed along the track and its angular velocity.
struct InLoop {
  double angle = 0.0, speed = 0.0, omega = 0.0;
};

/// An integrator of its own: the equations of sliding and rolling in these coordinates by RK4, with
/// the instant at which the slip ends.
InLoop IntegrateInLoop(InLoop at, double centre, double radius, double friction, double duration) {
  bool rolls = false;
  const auto slip = [&](const InLoop& x) { return x.speed + radius * x.omega; };
  const auto normal = [&](const InLoop& x) {
    return x.speed * x.speed / centre + kGravity * std::cos(x.angle);
  };
  const auto rate = [&](const InLoop& x) {
    // Of unit mass. Without slip a third of gravity's part along the track holds the rolling.
    const double force =
        rolls ? kGravity * std::sin(x.angle) / 3.0 : -std::copysign(friction * normal(x), slip(at));
    return InLoop{x.speed / centre, force - kGravity * std::sin(x.angle), 2.0 * force / radius};
  };
  const auto moved = [](const InLoop& x, const InLoop& by, double h) {
    return InLoop{x.angle + h * by.angle, x.speed + h * by.speed, x.omega + h * by.omega};
  };
  const auto step = [&](const InLoop& x, double h) {
    const InLoop a = rate(x), b = rate(moved(x, a, 0.5 * h)), c = rate(moved(x, b, 0.5 * h)),
                 d = rate(moved(x, c, h));
    return moved(moved(moved(moved(x, a, h / 6.0), b, h / 3.0), c, h / 3.0), d, h / 6.0);
  };
  for (double left = duration; left > 0.0;) {
    double h = std::min(left, 1e-4);
    InLoop next = step(at, h);
    if (!rolls && slip(next) * slip(at) <= 0.0) {
      double low = 0.0, high = h;
      for (int k = 0; k < 60; ++k) {
        h = 0.5 * (low + high);
        (slip(step(at, h)) * slip(at) > 0.0 ? low : high) = h;
      }
      next = step(at, h);
      rolls = true;
    }
    at = next;
    left -= h;
    EXPECT_GT(normal(at), 0.0);
    if (rolls) {
      EXPECT_LT(kGravity * std::abs(std::sin(at.angle)) / 3.0, friction * normal(at));
    }
  }
  EXPECT_TRUE(rolls);
  return at;
}

// It starts at the bottom without spin, slides, comes to roll, and passes the top.
TEST(SplineTest, SlidingAndRollingInALoopAsByAnotherIntegrator) {
  const double radius = 0.1, centre = 1.0 - radius, duration = 0.6;
  const double speed = std::sqrt(14.0 * kGravity * centre);
  for (const double friction : {0.5, 1.0}) {
    SCOPED_TRACE(friction);
    const std::string body = R"("shape": {"circle": {"radius": 0.1}}, "position": [0, )" +
                             Text(-centre) + R"(], "velocity": [)" + Text(speed) + ", 0]";
    const RunOnSpline run = RollOnSpline(
        OnGround(body, Track("spline", 400, 0.0, 2.0 * std::numbers::pi, true, OnCircle),
                 {.dt = 0.0005, .duration = duration, .friction = friction}));
    const InLoop exact = IntegrateInLoop({0.0, speed, 0.0}, centre, radius, friction, duration);
    EXPECT_GT(exact.angle, 3.5);
    EXPECT_NEAR(run.final.pose[0], centre * std::sin(exact.angle), 1e-7);
    EXPECT_NEAR(run.final.pose[1], -centre * std::cos(exact.angle), 1e-7);
    EXPECT_NEAR(run.final.twist[0], exact.speed * std::cos(exact.angle), 1e-6);
    EXPECT_NEAR(run.final.twist[2], exact.omega, 1e-5);
  }
}

// On a cycloid the way along it from the bottom, σ = 4 a sin(φ/2), swings with ω = √(g/(4a)),
// however far. A curve through n points of it is wrong by O(n⁻⁴), and so is the time to the bottom
// of a point that comes with a speed. At a point of rest, where the speed is √ of the height, half
// an order is lost.
TEST(SplineTest, ACycloidIsOfFourthOrder) {
  const double a = 0.25, frequency = std::sqrt(kGravity / (4.0 * a)), from = -1.82;
  const auto at = [&](double phi) {
    return Vector2<double>(a * (phi + std::sin(phi)), a * (1.0 - std::cos(phi)));
  };
  const double way = 4.0 * a * std::sin(0.5 * from);
  const auto error = [&](int count, double speed) {
    const Vector2<double> start = at(from);
    const double duration = std::atan2(-way * frequency, speed) / frequency;
    const std::string body = kPoint + std::string(R"("position": [)") + Text(start.x()) + ", " +
                             Text(start.y()) + R"(], "velocity": [)" +
                             Text(speed * std::cos(0.5 * from)) + ", " +
                             Text(speed * std::sin(0.5 * from)) + "]";
    const Scene scene = OnGround(body, Track("spline", count, -2.6, 2.6, false, at),
                                 {.dt = duration / 2000.0, .duration = duration});
    const RunOnSpline run = RollOnSpline(scene);
    // How late it is, as a share.
    return run.final.pose[0] / run.final.twist[0] / duration;
  };
  for (const double speed : {0.0, 2.0}) {
    const double ratio = speed > 0.0 ? 16.0 : std::pow(2.0, 3.5);
    const double e[3] = {error(101, speed), error(201, speed), error(401, speed)};
    EXPECT_LT(std::abs(e[0]), speed > 0.0 ? 1e-10 : 1e-7);
    EXPECT_NEAR(e[0] / e[1], ratio, 1.5) << e[0] << " " << e[1];
    if (speed > 0.0) {
      EXPECT_LT(std::abs(e[2]), 1e-12);  // the rounding of a run
    } else {
      EXPECT_NEAR(e[1] / e[2], ratio, 1.5) << e[1] << " " << e[2];
    }
  }
}

// In a round half-pipe a disc that rolls swings as a pendulum of length 3/2 R, with R the radius of
// the circle of its centre: through the bottom after a quarter of the period, 4 √(ℓ/g) K(sin θ/2).
TEST(SplineTest, ARollingDiscInAHalfPipe) {
  const double radius = 0.1, centre = 1.0 - radius, angle = 1.2;
  double arithmetic = 1.0, geometric = std::cos(0.5 * angle);
  for (int k = 0; k < 6; ++k) {
    const double mean = 0.5 * (arithmetic + geometric);
    geometric = std::sqrt(arithmetic * geometric);
    arithmetic = mean;
  }
  const double quarter = 0.5 * std::numbers::pi / arithmetic * std::sqrt(1.5 * centre / kGravity);
  const Vector2<double> start = centre * OnCircle(angle);
  const Scene scene = OnGround(
      R"("shape": {"circle": {"radius": 0.1}}, "position": [)" + Text(start.x()) + ", " +
          Text(start.y()) + "]",
      Track("spline", 400, -0.5 * std::numbers::pi, 0.5 * std::numbers::pi, false, OnCircle),
      {.dt = quarter / 400.0, .duration = quarter, .friction = 1000.0});
  const RunOnSpline run = RollOnSpline(scene);
  const double speed = std::sqrt(4.0 / 3.0 * kGravity * centre * (1.0 - std::cos(angle)));
  EXPECT_NEAR(run.final.twist[0], -speed, 1e-7);
  EXPECT_NEAR(run.final.twist[2], speed / radius, 1e-6);
  EXPECT_NEAR(run.final.pose[0], 0.0, 1e-7);
}

// Facets take speed from a disc at each of their joints, in proportion to the square of the angle,
// so that the error is O(1/n).
TEST(SplineTest, AFacettedBowlConverges) {
  const auto swing = [](const std::string& type, int count) {
    const Vector2<double> start = 0.9 * OnCircle(-0.9);
    const RunOnSpline run =
        RollOnSpline(OnGround(R"("shape": {"circle": {"radius": 0.1}}, "position": [)" +
                                  Text(start.x()) + ", " + Text(start.y()) + "]",
                              Track(type, count + 1, -1.4, 1.4, false, OnCircle),
                              {.dt = 0.005, .duration = 0.7, .friction = 0.0}));
    return run.final;
  };
  const State<double> smooth = swing("spline", 200);
  const auto error = [&](int count) {
    const State<double> faceted = swing("polyline", count);
    return std::hypot(faceted.pose[0] - smooth.pose[0], faceted.pose[1] - smooth.pose[1]);
  };
  const double e[3] = {error(40), error(80), error(160)};
  EXPECT_LT(e[0], 0.1);
  EXPECT_NEAR(e[0] / e[1], 2.0, 0.4) << e[0] << " " << e[1];
  EXPECT_NEAR(e[1] / e[2], 2.0, 0.4) << e[1] << " " << e[2];
}

// Fixed steps approach the motion by events at first order, with the curve's normal at each step.
TEST(SplineTest, FixedStepsConverge) {
  const Vector2<double> start = 0.9 * OnCircle(-0.9);
  const auto swing = [&](const std::string& stepping, double dt) {
    return RollOnSpline(OnGround(R"("shape": {"circle": {"radius": 0.1}}, "position": [)" +
                                     Text(start.x()) + ", " + Text(start.y()) + "]",
                                 Track("spline", 60, -1.4, 1.4, false, OnCircle),
                                 {stepping, dt, 0.6, 0.3}))
        .final;
  };
  const State<double> exact = swing("event", 0.002);
  const auto error = [&](double dt) {
    return std::abs(swing("fixed", dt).pose[0] - exact.pose[0]);
  };
  const double e[3] = {error(0.004), error(0.002), error(0.001)};
  EXPECT_LT(e[0], 0.05);
  EXPECT_NEAR(e[0] / e[1], 2.0, 0.5) << e[0] << " " << e[1];
  EXPECT_NEAR(e[1] / e[2], 2.0, 0.5) << e[1] << " " << e[2];
}

// A large disc rests on both sides of a parabola, its centre half above the square of where it
// touches.
TEST(SplineTest, ALargeDiscRestsOnBothSides) {
  const double x = 0.4, centre = x * x + 0.5;
  const double radius = std::hypot(x, centre - x * x);
  for (const char* stepping : {"fixed", "event"}) {
    const RunOnSpline run =
        RollOnSpline(OnGround(R"("shape": {"circle": {"radius": )" + Text(radius) +
                                  R"(}}, "position": [0.05, 0.9], "angular_damping": 0.5)",
                              kParabola, {stepping, 0.01, 3.0, 0.3}));
    EXPECT_NEAR(run.final.pose[0], 0.0, 1e-6) << stepping;
    EXPECT_NEAR(run.final.pose[1], centre, 1e-6) << stepping;
    EXPECT_NEAR(run.final.twist[0], 0.0, 1e-6) << stepping;
  }
}

// Off an open end, and from deep in the solid.
TEST(SplineTest, EndsAndDepth) {
  const char flat[] = R"("spline": {"points": [[-2, 0], [-1, 0], [0, 0]], "solid": "right"})";
  const RunOnSpline off =
      RollOnSpline(OnGround(R"("shape": {"circle": {"radius": 0.1}}, "position": [-0.5, 0.1],
                  "velocity": [2, 0])",
                            flat, {.duration = 0.5}));
  EXPECT_NEAR(off.final.pose[0], 0.5, 1e-12);
  EXPECT_NEAR(off.final.pose[1], 0.1 - 0.5 * kGravity * 0.25 * 0.25, 1e-9);
  const RunOnSpline deep =
      RollOnSpline(OnGround(R"("shape": {"circle": {"radius": 0.1}}, "position": [-0.5, -0.5])",
                            flat, {.stepping = "fixed", .duration = 2.0}));
  EXPECT_NEAR(deep.final.pose[1], 0.1, 1e-6);
}

// A curve that rises carries what is on it; a box stands on its corners.
TEST(SplineTest, KinematicSplinesAndCorners) {
  const char flat[] =
      R"("spline": {"points": [[-2, 0], [-1, 0], [0.3, 0], [2, 0]], "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    Scene scene = OnGround(R"("shape": {"box": {"size": [0.4, 0.2]}}, "position": [0, 0.1],
                              "velocity": [0, 0.5])",
                           flat, {stepping, 0.01, 1.0, 0.5});
    scene.bodies[1].motion = Motion::kKinematic;
    scene.bodies[1].velocity = Vector2<double>(0.0, 0.5);
    const RunOnSpline run = RollOnSpline(scene);
    EXPECT_NEAR(run.final.pose[1], 0.6, 1e-9) << stepping;
    EXPECT_NEAR(run.final.pose[2], 0.0, 1e-9) << stepping;
  }
}

// A disc drops into a bowl, rebounds, slides and rolls.
TEST(SplineTest, DerivativesOfAllMethodsAgree) {
  const char bowl[] = R"("spline": {"points": [[-2, 1], [-0.8, 0.2], [0, 0], [1, 0.3], [3, 1.6]],
                                    "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    for (const char* shape : {R"("circle": {"radius": 0.1})", R"("box": {"size": [0.3, 0.2]})",
                              R"("ellipse": {"radii": [0.2, 0.1]})"}) {
      SCOPED_TRACE(stepping + std::string(" ") + shape);
      const std::string size = shape[1] == 'c' ? "radius" : shape[1] == 'b' ? "size/x" : "radii/x";
      ExpectAllAgree(OnGround(R"("shape": {)" + std::string(shape) +
                                  R"(}, "position": [-0.95, 0.75], "velocity": [0.5, 0])",
                              bowl, {stepping, 0.01, 0.5, 0.3, 0.3}),
                     {"bodies/b/position/x", "bodies/b/shape/" + size,
                      "bodies/ground/shape/points/0/y", "bodies/ground/shape/points/1/x",
                      "bodies/ground/shape/points/2/y", "bodies/ground/shape/points/4/y"});
    }
  }
}

// The first point of a closed curve, which its last piece reads too.
TEST(SplineTest, DerivativesByPointsOfAClosedCurve) {
  const char room[] = R"("spline": {"points": [[0.3, -0.2], [2, 1.5], [0, 2], [-1.5, 1]],
                                    "closed": true, "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    ExpectAllAgree(OnGround(R"("shape": {"circle": {"radius": 0.1}}, "position": [-0.2, 0.6],
                    "velocity": [0.2, 0])",
                            room, {stepping, 0.01, 0.45, 0.3, 0.2}),
                   {"bodies/ground/shape/points/0/x", "bodies/ground/shape/points/0/y",
                    "bodies/ground/shape/points/3/y"});
  }
}

}  // namespace
}  // namespace tangible
