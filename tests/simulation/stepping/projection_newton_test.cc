// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/projection_newton.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

// A random scene's iterate, its poses pushed off the joints; false where it has none.
bool Disturbed(unsigned seed, double size, Model<double>* model,
               ProjectionIterate<double>* iterate) {
  State<double> state;
  BuildModel(RandomScene(seed), model, &state);
  RandomNumbers random(seed);
  for (const int body : model->structure->moving) {
    for (int i = 0; i < 3; ++i) {
      state.pose[3 * body + i] += size * random.Uniform(-1.0, 1.0);
    }
  }
  iterate->from = iterate->at = state;
  return !model->structure->joints.empty();
}

double Dot(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    sum += x[i] * y[i];
  }
  return sum;
}

// Stationary: M (q − q̃) is orthogonal to every direction in which the joints let the bodies move.
// Such directions are taken from K: K [d; ·] = [r; 0] has A d = 0 for any r.
TEST(ProjectionNewtonTest, TheMoveIsOrthogonalToWhatTheJointsAllow) {
  int checked = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Model<double> model;
    ProjectionIterate<double> p;
    if (!Disturbed(seed, 0.02, &model, &p) || model.structure->joint_loops) {
      continue;
    }
    ASSERT_TRUE(IterateProjection(model, 0, &p)) << seed;
    EXPECT_LE(p.error, model.structure->settings.joint_tolerance);
    ASSERT_TRUE(FactorProjection(model, &p));
    const ModelStructure& s = *model.structure;
    const int bodies = 3 * s.num_blocks();
    std::vector<double> force(bodies + 3 * s.joints.size(), 0.0);
    for (int k = 0; k < s.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        const int q = 3 * s.moving[k] + i;
        const BodyIndex& body = s.bodies[s.moving[k]];
        force[3 * k + i] =
            model.parameters[i < 2 ? body.mass : body.inertia] * (p.at.pose[q] - p.from.pose[q]);
      }
    }
    RandomNumbers random(seed + 100);
    for (int trial = 0; trial < 3; ++trial) {
      std::vector<double> direction(force.size(), 0.0);
      for (int i = 0; i < bodies; ++i) {
        direction[i] = random.Uniform(-1.0, 1.0);
      }
      p.lu.Solve(direction.data(), 1);
      std::fill(direction.begin() + bodies, direction.end(), 0.0);
      EXPECT_LE(std::abs(Dot(force, direction)),
                1e-11 * std::sqrt(Dot(force, force) * Dot(direction, direction)))
          << seed;
    }
    EXPECT_GT(Dot(force, force), 1e-12);
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

TEST(ProjectionNewtonTest, TheMatrixIsThatOfTheProduct) {
  int checked = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Model<double> model;
    ProjectionIterate<double> p;
    if (!Disturbed(seed, 0.02, &model, &p) || model.structure->joint_loops ||
        !IterateProjection(model, 0, &p) || !FactorProjection(model, &p) || p.shifted) {
      continue;
    }
    const ModelStructure& s = *model.structure;
    RandomNumbers random(seed);
    const size_t size = 2 * 3 * (s.num_blocks() + s.joints.size());
    std::vector<double> rhs(size);
    for (double& value : rhs) {
      value = random.Uniform(-1.0, 1.0);
    }
    std::vector<double> x = rhs;
    p.lu.Solve(x.data(), 2);
    SubtractProjectionMatrix(model, p, x.data(), 2, rhs.data());
    EXPECT_LT(Dot(rhs, rhs), 1e-20 * (1.0 + Dot(x, x))) << seed;
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

// A rod on a pin through its end, drawn away along itself by d: W has inertia − m d l / 2 at its
// angle.
void DrawnRod(double d, Model<double>* model, State<double>* state) {
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "rod", "mass": 3, "inertia": 0.25, "position": [0.5, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0]}]})");
  BuildModel(scene, model, state);
  state->pose[3 * model->structure->moving[0]] += d;
}

TEST(ProjectionNewtonTest, ASingularBlockIsShiftedAndStillConverges) {
  // Inertia 0.25, arm 0.5, mass 3: singular at d = 1 / 6.
  for (const double d : {1.0 / 6.0, -1.0 / 6.0, 0.4}) {
    Model<double> model;
    ProjectionIterate<double> p;
    DrawnRod(d, &model, &p.from);
    const int body = model.structure->moving[0];
    p.from.pose[3 * body + 1] = 1e-5;  // a nudge off the line
    p.at = p.from;
    ASSERT_TRUE(IterateProjection(model, 0, &p)) << d;
    ASSERT_TRUE(FactorProjection(model, &p));
    EXPECT_LE(p.error, 1e-10);
  }
}

// Links of 0.1 kg about one of 10 kg, drawn far apart: Newton's full step overshoots.
TEST(ProjectionNewtonTest, LargeDriftConverges) {
  Model<double> model;
  State<double> initial;
  BuildModel(test_scenes::SceneOf(test_scenes::WhippingChain(0.5)), &model, &initial);
  RandomNumbers random(7);
  for (int trial = 0; trial < 200; ++trial) {
    ProjectionIterate<double> p;
    p.from = initial;
    for (const int body : model.structure->moving) {
      for (int i = 0; i < 3; ++i) {
        p.from.pose[3 * body + i] += 0.3 * random.Uniform(-1.0, 1.0);
      }
    }
    p.at = p.from;
    EXPECT_TRUE(IterateProjection(model, 0, &p)) << trial << " " << p.error;
    EXPECT_LE(p.error, 1e-10);
  }
}

}  // namespace
}  // namespace tangible
