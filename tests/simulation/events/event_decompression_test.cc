// SPDX-License-Identifier: Apache-2.0
//
// Poisson's impact law: closed forms, energy, and derivatives of both phases.
#include <gtest/gtest.h>

#include <cmath>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

struct DecompressedRun {
  RolloutReport report;
  State<double> final;
  double energy_gain = 0.0;  ///< J, of the run
};

DecompressedRun Simulate(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  DecompressedRun run;
  run.report = Rollout(model, state, nullptr, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  run.energy_gain = KineticEnergy(model, run.final) - KineticEnergy(model, state);
  return run;
}

std::string Number(double x) { return std::to_string(x); }

std::string Settings(const std::string& law, double duration) {
  return R"("simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01,
      "impact_law": ")" +
         law + R"(", "duration": )" + Number(duration) + "}";
}

constexpr double kRadius = 0.01;

// A rod of length 1 at 45 degrees, its lower cap 5 mm above the floor; mass 1, inertia 1/12.
std::string Rod(const std::string& law, double e, double friction,
                const std::string& velocity = "[0.5, -1]", double duration = 0.02) {
  return R"({"gravity": [0, 0], "bodies": [
      {"name": "rod", "shape": {"capsule": {"length": 1, "radius": )" +
         Number(kRadius) + R"(}}, "mass": 1, "inertia": 0.083333333333333333,
       "position": [0, )" +
         std::to_string(0.35355339 + kRadius + 0.005) +
         R"(], "angle": 0.78539816339744831, "velocity": )" + velocity + R"(},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["rod", "floor"], "restitution": )" +
         Number(e) + R"(, "friction": )" + Number(friction) + "}], " + Settings(law, duration) +
         "}";
}

// One contact of a free body in coordinates (n, t): W = J M⁻¹ Jᵀ.
struct OneContact {
  double nn, nt, tt;
  double vn, vt;
  double friction;
  double normal = 0.0, tangent = 0.0;  ///< all impulses so far

  void Add(double n, double t) {
    normal += n;
    tangent += t;
    vn += nn * n + nt * t;
    vt += nt * n + tt * t;
  }
  void Compress() {
    const double det = nn * tt - nt * nt;
    double n = (-vn * tt + vt * nt) / det;
    double t = (-vt * nn + vn * nt) / det;
    if (std::abs(t) > friction * n) {
      const double sign = t > 0.0 ? 1.0 : -1.0;
      n = -vn / (nn + sign * friction * nt);
      t = sign * friction * n;
    }
    Add(n, t);
  }
  void Decompress(double n) {
    const double t = -(vt + nt * n) / tt;
    Add(n, std::abs(t) > friction * n ? (t > 0.0 ? friction * n : -friction * n) : t);
  }
};

OneContact RodContact(double vx, double vy, double friction) {
  const double rx = -0.5 * std::sqrt(0.5);
  const double ry = rx - kRadius;
  return {1.0 + 12.0 * rx * rx, -12.0 * rx * ry, 1.0 + 12.0 * ry * ry, vy, vx, friction};
}

TEST(EventDecompressionTest, TheRodsImpactIsThatByHandInBothPhases) {
  struct {
    double e, friction;
    const char* velocity;
    double vx, vy;
  } const cases[] = {{1.0, 0.5, "[0.5, -1]", 0.5, -1.0},    // sticks, then slides
                     {0.6, 0.5, "[0.5, -1]", 0.5, -1.0},    // the same
                     {1.0, 0.8, "[0.5, -1]", 0.5, -1.0},    // sticks, then sticks
                     {0.8, 0.2, "[-0.9, -1]", -0.9, -1.0},  // slides left in both
                     {0.8, 0.1, "[0.9, -1]", 0.9, -1.0},    // right, and back
                     {0.9, 0.0, "[0.5, -1]", 0.5, -1.0}};
  for (const auto& c : cases) {
    OneContact contact = RodContact(c.vx, c.vy, c.friction);
    contact.Compress();
    const double compression = contact.normal;
    contact.Decompress(c.e * compression);
    EXPECT_GT(contact.vn, 0.0);
    const DecompressedRun run = Simulate(SceneOf(Rod("poisson", c.e, c.friction, c.velocity)));
    EXPECT_EQ(run.report.events, 1);
    // The gap is not 0 to the last bit.
    EXPECT_NEAR(run.final.twist[0], c.vx + contact.tangent, 1e-13) << c.e << " " << c.friction;
    EXPECT_NEAR(run.final.twist[1], c.vy + contact.normal, 1e-13) << c.e << " " << c.friction;
    const double rx = -0.5 * std::sqrt(0.5);
    EXPECT_NEAR(run.final.twist[2], 12.0 * (rx * contact.normal - (rx - kRadius) * contact.tangent),
                1e-12);
  }
}

TEST(EventDecompressionTest, TheRodGainsEnergyByNewtonsLawAndNotByPoissons) {
  const DecompressedRun newton = Simulate(SceneOf(Rod("newton", 1.0, 0.5)));
  const DecompressedRun poisson = Simulate(SceneOf(Rod("poisson", 1.0, 0.5)));
  constexpr double kBefore = 0.625;  // J
  EXPECT_NEAR(newton.energy_gain / kBefore, 0.175, 0.02);
  EXPECT_NEAR(newton.report.impact_energy_gain, newton.energy_gain, 1e-14);
  EXPECT_LT(poisson.energy_gain, -0.01 * kBefore);
  EXPECT_EQ(poisson.report.impact_energy_gain, 0.0);
}

TEST(EventDecompressionTest, ASingleContactNeverGains) {
  for (const double e : {0.3, 1.0}) {
    for (const double friction : {0.1, 0.5, 1.2}) {
      for (const char* velocity : {"[-2, -1]", "[-0.3, -1]", "[0.4, -1]", "[1.5, -1]"}) {
        const DecompressedRun run = Simulate(SceneOf(Rod("poisson", e, friction, velocity)));
        EXPECT_LT(run.energy_gain, 1e-14) << e << " " << friction << " " << velocity;
        EXPECT_LT(run.report.impact_energy_gain, 1e-14);
      }
    }
  }
}

TEST(EventDecompressionTest, ADiscBouncesAsByNewtonsLaw) {
  // Normal and tangent do not meet: in all, friction is the same.
  for (const char* spin : {"30", "4", "-2"}) {
    const auto scene = [&](const char* law) {
      return SceneOf(R"({"bodies": [
        {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1.3, "position": [0, 0.3],
         "velocity": [0.4, -0.5], "angular_velocity": )" +
                     std::string(spin) + R"(, "restitution": 0.7, "friction": 0.3},
        {"name": "floor", "static": true, "restitution": 0.7, "friction": 0.3,
         "shape": {"half_plane": {"normal": [0.2, 1], "offset": 0}}}], )" +
                     Settings(law, 0.7) + "}");
    };
    const DecompressedRun newton = Simulate(scene("newton"));
    const DecompressedRun poisson = Simulate(scene("poisson"));
    EXPECT_EQ(newton.report.events, poisson.report.events);
    EXPECT_GE(poisson.report.events, 1);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(poisson.final.twist[i], newton.final.twist[i], 1e-11) << spin;
      EXPECT_NEAR(poisson.final.pose[i], newton.final.pose[i], 1e-11) << spin;
    }
  }
}

TEST(EventDecompressionTest, AContactThatDidNotApproachDoesNotRebound) {
  // A ball falls on a disc that rests: its floor is as rigid, and gives nothing back.
  const DecompressedRun run = Simulate(SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.2}}, "mass": 2, "position": [0, 0.2]},
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.8],
       "velocity": [0, -1]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["disc", "floor"], "restitution": 0.9},
              {"bodies": ["disc", "ball"], "restitution": 0.3}], )" +
                                               Settings("poisson", 0.5) + "}"));
  EXPECT_NEAR(run.final.twist[1], 0.0, 1e-14);
  EXPECT_NEAR(run.final.pose[1], 0.2, 1e-14);
  EXPECT_NEAR(run.final.twist[4], 0.3, 1e-14);
}

TEST(EventDecompressionTest, ABoxThatRocksComesToRest) {
  for (const double e : {0.0, 0.4}) {
    const DecompressedRun run =
        Simulate(SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1.3, "position": [0, 0.16],
       "angle": 0.05},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["box", "floor"], "friction": 0.4, "restitution": )" +
                         Number(e) + "}], " + Settings("poisson", 2.5) + "}"));
    EXPECT_NEAR(run.final.pose[1], 0.1, 1e-10) << e;
    EXPECT_NEAR(run.final.pose[2], 0.0, 1e-10) << e;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(run.final.twist[i], 0.0, 1e-10) << e;
    }
  }
}

TEST(EventDecompressionTest, TwoEqualElasticBallsSwap) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [1, 0], "restitution": 1},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0],
       "restitution": 1}], )" +
                              Settings("poisson", 1.5) + "}");
  for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint}) {
    const GradientResult r =
        Jacobian(scene, {"bodies/a/velocity/x", "bodies/b/velocity/x"}, method);
    EXPECT_NEAR(r.jacobian(3, 0), 0.0, 1e-14);
    EXPECT_NEAR(r.jacobian(9, 0), 1.0, 1e-14);
    EXPECT_NEAR(r.jacobian(3, 1), 1.0, 1e-14);
    EXPECT_NEAR(r.jacobian(9, 1), 0.0, 1e-14);
  }
}

// The five methods on a scene.
void ExpectAllAgree(const std::string& text, const std::vector<std::string>& paths,
                    const std::string& verdict = "trustworthy") {
  const Scene scene = SceneOf(text);
  const GradientResult adjoint = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(adjoint.certificate.verdict.substr(0, verdict.size()), verdict)
      << adjoint.certificate.verdict;
  for (Eigen::Index c = 0; c < adjoint.jacobian.cols(); ++c) {
    EXPECT_GT(adjoint.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-3) << paths[c];
  }
  testing::ExpectOthersAgree(scene, paths, adjoint);
}

TEST(EventDecompressionTest, DrivenAndSliding) {
  ExpectAllAgree(Rod("poisson", 0.9, 0.45),
                 {"pairs/rod:floor/restitution", "pairs/rod:floor/friction", "bodies/rod/angle",
                  "bodies/rod/inertia", "bodies/rod/position/y", "bodies/rod/velocity/x",
                  "bodies/rod/velocity/y", "bodies/rod/angular_velocity", "bodies/rod/shape/length",
                  "bodies/floor/shape/normal/x"});
}

TEST(EventDecompressionTest, DrivenAndSticking) {
  ExpectAllAgree(Rod("poisson", 0.9, 0.8),
                 {"pairs/rod:floor/restitution", "bodies/rod/angle", "bodies/rod/inertia",
                  "bodies/rod/mass", "bodies/rod/position/y", "bodies/rod/velocity/x",
                  "bodies/rod/velocity/y", "bodies/floor/shape/normal/x"});
}

// A disc that falls into a groove of walls 120 degrees apart in their normals, and touches both at
// once: one rebounds more than the other, which it closes again.
TEST(EventDecompressionTest, DrivenOnOneSideAndClosedAgainOnTheOther) {
  for (const char* friction : {"0", "0.1"}) {
    const std::string text = R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1.3, "position": [0, 0.4]},
      {"name": "left", "static": true,
       "shape": {"half_plane": {"normal": [0.86602540378443865, 0.5], "offset": 0}}},
      {"name": "right", "static": true,
       "shape": {"half_plane": {"normal": [-0.86602540378443865, 0.5], "offset": 0}}}],
    "pairs": [{"bodies": ["disc", "left"], "restitution": 0.9, "friction": )" +
                             std::string(friction) + R"(},
              {"bodies": ["disc", "right"], "restitution": 0.1, "friction": )" +
                             friction + R"(}],
    )" + Settings("poisson", 0.25) +
                             "}";
    const DecompressedRun run = Simulate(SceneOf(text));
    // It goes up along the right wall: closed, its impulse beyond e times that of compression.
    EXPECT_NEAR(-0.86602540378443865 * run.final.twist[0] + 0.5 * run.final.twist[1], 0.0, 1e-12);
    EXPECT_GT(run.final.twist[0], 0.1);
    ExpectAllAgree(text,
                   {"pairs/disc:left/restitution", "bodies/disc/position/y",
                    "bodies/disc/velocity/y", "bodies/disc/shape/radius", "gravity/y"},
                   "discontinuous");
  }
}

TEST(EventDecompressionTest, AJoinedChainOnAMovingPlate) {
  ExpectAllAgree(
      R"({"bodies": [
      {"name": "lower", "shape": {"capsule": {"length": 0.4, "radius": 0.03}}, "mass": 0.8,
       "position": [0, 0.4], "angle": 1.2, "velocity": [0.5, -1]},
      {"name": "upper", "shape": {"capsule": {"length": 0.4, "radius": 0.03}}, "mass": 0.5,
       "position": [0.072471550895334, 0.78640781719344], "angle": 1.9, "velocity": [0.5, -1]},
      {"name": "plate", "kinematic": true, "shape": {"box": {"size": [3, 0.1]}},
       "position": [0, -0.05], "velocity": [0.3, 0.2]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["upper", "lower"],
                "anchor": [0.07, 0.59], "damping": 0.01}],
    "pairs": [{"bodies": ["lower", "plate"], "restitution": 0.7, "friction": 0.3}], )" +
          Settings("poisson", 0.2) + "}",
      {"pairs/lower:plate/restitution", "pairs/lower:plate/friction", "bodies/lower/mass",
       "bodies/upper/mass", "bodies/*er/position/y", "bodies/plate/velocity/y",
       "bodies/plate/velocity/x", "joints/pin/damping", "gravity/y"});
}

TEST(EventDecompressionTest, FrictionAtItsLimitInDecompressionIsAKink) {
  // The impulse that sticking needs is the limit: t = −nt n / tt = μ n.
  const OneContact contact = RodContact(0.5, -1.0, 0.0);
  const double limit = -contact.nt / contact.tt;
  const auto certificate = [](double friction) {
    std::string text = Rod("poisson", 0.9, 0.5);
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.17g", friction);
    const std::string was = Number(0.5) + "}";
    text.replace(text.find("\"friction\": " + was), 12 + was.size(),
                 "\"friction\": " + std::string(digits) + "}");
    return Jacobian(SceneOf(text), {"pairs/rod:floor/friction"}, GradientMethod::kTangent)
        .certificate;
  };
  const Certificate at_limit = certificate(limit);
  EXPECT_EQ(at_limit.verdict.substr(0, 11), "near a kink") << at_limit.verdict;
  EXPECT_NE(at_limit.margin_where.find("decompression, driven and "), std::string::npos)
      << at_limit.margin_where;
  EXPECT_EQ(certificate(limit - 0.05).verdict, "trustworthy");
  EXPECT_EQ(certificate(limit + 0.05).verdict, "trustworthy");
}

TEST(EventDecompressionTest, ImpactsElsewhereHaveNoDecompression) {
  // Two discs land at once, far from each other; the second does not rebound. Both are as alone.
  const auto scene = [](const char* law) {
    return SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.6]},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [2, 0.6]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["a", "floor"], "restitution": 0.5}], )" +
                   Settings(law, 0.4) + "}");
  };
  const GradientResult poisson =
      Jacobian(scene("poisson"), {"bodies/a/velocity/x"}, GradientMethod::kTangent);
  EXPECT_EQ(poisson.certificate.degenerate_rows, 0);
  const DecompressedRun run = Simulate(scene("poisson"));
  EXPECT_NEAR(run.final.pose[4], 0.1, 1e-12);
  EXPECT_GT(run.final.pose[1], 0.15);
}

}  // namespace
}  // namespace tangible
