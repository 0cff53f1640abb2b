// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/coincidences.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tangible/scene/scene_json.h"
#include "tangible/verification/support/trace.h"

namespace tangible {
namespace {

bool Has(const Coincidence& coincidence, const std::string& kind) {
  return std::find(coincidence.kinds.begin(), coincidence.kinds.end(), "coincidence: " + kind) !=
         coincidence.kinds.end();
}

// The seed of the first coincidence of a kind that happens at a step's end, alone in its scene.
unsigned FirstAtAStepsEnd(const std::string& kind, Stepping stepping) {
  for (unsigned seed = 1; seed < 2000; ++seed) {
    const Coincidence one = RandomCoincidence(seed, stepping);
    if (one.kinds.size() == 2 && Has(one, kind) && Has(one, "at a step's end")) return seed;
  }
  ADD_FAILURE() << kind;
  return 0;
}

TEST(CoincidencesTest, ASeedIsAScene) {
  EXPECT_EQ(SceneToJson(RandomCoincidence(5, Stepping::kEvent).scene),
            SceneToJson(RandomCoincidence(5, Stepping::kEvent).scene));
  Scene other = RandomCoincidence(6, Stepping::kEvent).scene;
  other.name = "coincidence 5";
  EXPECT_NE(SceneToJson(RandomCoincidence(5, Stepping::kEvent).scene), SceneToJson(other));
}

TEST(CoincidencesTest, EveryKindIsDrawn) {
  std::map<std::string, int> count;
  for (unsigned seed = 1; seed <= 600; ++seed) {
    for (const std::string& kind : RandomCoincidence(seed, Stepping::kEvent).kinds) ++count[kind];
  }
  for (const std::string& kind : CoincidenceKinds()) EXPECT_GE(count[kind], 4) << kind;
  EXPECT_EQ(count.size(), CoincidenceKinds().size());
}

// Where nothing changes between the steps of fixed stepping, runs end where the known motion ends.
TEST(CoincidencesTest, FixedStepsEndWhereTheKnownMotionEnds) {
  int checked = 0;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    const Coincidence one = RandomCoincidence(seed, Stepping::kFixed);
    if (Has(one, "feature change")) continue;
    ASSERT_TRUE(one.outputs) << seed;
    const RunTrace run = TraceRun(one.scene);
    ASSERT_TRUE(run.done) << seed << " " << run.message;
    const VectorX<double> known = SidesOf(one).values;
    // The solver's residual, scaled, is below 1e-10; a chain of steps keeps it.
    EXPECT_LE((run.values - known).cwiseAbs().maxCoeff(),
              1e-10 * std::max(1.0, known.cwiseAbs().maxCoeff()))
        << seed;
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(CoincidencesTest, EventsEndWhereTheKnownMotionEnds) {
  for (const char* kind : {"slip ends", "reversal", "rolling", "touch", "touch with a face",
                           "touch with a corner", "slip ends in an impact", "slow Stribeck, ends",
                           "corner of a joint's signal", "feature change, off a face"}) {
    const unsigned seed = FirstAtAStepsEnd(kind, Stepping::kEvent);
    const Coincidence one = RandomCoincidence(seed, Stepping::kEvent);
    const RunTrace run = TraceRun(one.scene);
    ASSERT_TRUE(run.done) << kind << " " << run.message;
    const VectorX<double> known = SidesOf(one).values;
    EXPECT_LE((run.values - known).cwiseAbs().maxCoeff(),
              1e-12 * std::max(1.0, known.cwiseAbs().maxCoeff()))
        << kind << " " << seed;
  }
}

// A block that stops: x = x0 + v²/(2 μ g) on both sides.
TEST(CoincidencesTest, BothSidesAgreeWhereABlockStops) {
  const Coincidence one =
      RandomCoincidence(FirstAtAStepsEnd("slip ends", Stepping::kEvent), Stepping::kEvent);
  const KnownSides sides = SidesOf(one);
  for (size_t k = 0; k < one.parameters.size(); ++k) {
    if (one.parameters[k].path.find("velocity/x") == std::string::npos) continue;
    const auto column = static_cast<Eigen::Index>(k);
    EXPECT_GT(std::abs(sides.plus(0, column)), 1e-3);
    EXPECT_NEAR(sides.plus(0, column), sides.minus(0, column),
                1e-10 * std::abs(sides.plus(0, column)));
  }
  // With fixed steps it slides for another step on one side.
  const Coincidence fixed =
      RandomCoincidence(FirstAtAStepsEnd("slip ends", Stepping::kFixed), Stepping::kFixed);
  const KnownSides apart = SidesOf(fixed);
  EXPECT_GT((apart.plus - apart.minus).cwiseAbs().maxCoeff(), 1e-3);
}

// x = x0 + v²/(2 μ g), with all its derivatives to rounding.
TEST(CoincidencesTest, KnownDerivativesAreExact) {
  unsigned seed = 1;
  const auto is_on_a_level = [](const Coincidence& one) {
    return one.kinds.size() == 2 && Has(one, "slip ends") && Has(one, "at a step's end") &&
           one.scene.gravity.x() == 0.0;
  };
  while (!is_on_a_level(RandomCoincidence(seed, Stepping::kEvent))) ++seed;
  const Coincidence one = RandomCoincidence(seed, Stepping::kEvent);
  const auto number = [&](const std::string& end) {
    for (const ParameterPath& path : one.parameters) {
      if (path.path.size() >= end.size() &&
          path.path.compare(path.path.size() - end.size(), end.size(), end) == 0) {
        return path.value;
      }
    }
    ADD_FAILURE() << end;
    return 0.0;
  };
  const KnownSides sides = SidesOf(one);
  const double v = number("velocity/x");
  const double mu = number("floor/friction");
  const double g = -number("gravity/y");
  const double way = std::abs(v) * v / (2.0 * mu * g);
  for (size_t k = 0; k < one.parameters.size(); ++k) {
    const std::string& path = one.parameters[k].path;
    const double expected = path.find("velocity/x") != std::string::npos   ? 2.0 * way / v
                            : path.find("friction") != std::string::npos   ? -way / mu
                            : path.find("gravity/y") != std::string::npos  ? way / g
                            : path.find("position/x") != std::string::npos ? 1.0
                                                                           : 0.0;
    for (const double side : {sides.plus(0, static_cast<Eigen::Index>(k)),
                              sides.minus(0, static_cast<Eigen::Index>(k))}) {
      EXPECT_NEAR(side, expected, 4e-16 * std::max(1.0, std::abs(expected))) << path;
    }
  }
}

// The derivative on a side is that before the next kink, which may be nearer than the way.
TEST(CoincidencesTest, SidesEndAtTheNextKink) {
  Coincidence one;
  std::string error;
  ASSERT_TRUE(
      ParseScene(R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1, "position": [0.5, 0]}],
                             "simulation": {"dt": 0.1, "duration": 1}})",
                 "test.json", ".", &one.scene, &error))
      << error;
  const std::string path = "bodies/a/position/x";
  ParameterPath parameter;
  ASSERT_TRUE(ResolveParameter(one.scene, path, &parameter, &error)) << error;
  one.parameters = {parameter};
  for (const long double kink : {1e-6L, 3e-7L, 2e-8L, 2e-10L}) {
    one.outputs = [&](const NumberAt& at) {
      const Real x = at(path);
      const Real beyond = Real(0.5L - kink) - x;
      return std::vector<Real>{beyond.value > 0.0L ? x + beyond * Real(5.0L) : x};
    };
    const KnownSides sides = SidesOf(one);
    EXPECT_DOUBLE_EQ(sides.plus(0, 0), 1.0);
    EXPECT_DOUBLE_EQ(sides.minus(0, 0), 1.0) << static_cast<double>(kink);
  }
}

}  // namespace
}  // namespace tangible
