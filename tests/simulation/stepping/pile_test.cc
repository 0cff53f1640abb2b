// SPDX-License-Identifier: Apache-2.0
//
// Piles while they fall and settle: many contacts, most of them redundant, every step solved to the
// residual recomputed from its data.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "tangible/lcp/system/contact_residual.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

constexpr double kTolerance = 1e-10;

BasicBody<double> Wall(const std::string& name, double nx, double ny, double offset,
                       double friction) {
  BasicBody<double> body;
  body.name = name;
  body.motion = Motion::kStatic;
  body.shape = {ShapeType::kHalfPlane, {nx, ny, offset}};
  body.friction = friction;
  return body;
}

struct Grain {
  BasicShape<double> shape;
  double mass = 1.0;
  std::array<double, 2> position;
  double angle = 0.0;
};

void Add(const Grain& grain, double friction, Scene* scene) {
  BasicBody<double> body;
  body.name = "b" + std::to_string(scene->bodies.size());
  body.shape = grain.shape;
  body.mass = grain.mass;
  body.position = {grain.position[0], grain.position[1]};
  body.angle = grain.angle;
  body.friction = friction;
  scene->bodies.push_back(body);
}

// Equal discs that fall into a box in columns.
Scene Discs(int n, long steps) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(n)));
  const double width = 0.25 * columns;
  Scene scene;
  scene.bodies = {Wall("floor", 0.0, 1.0, 0.0, 0.5), Wall("left", 1.0, 0.0, -0.5 * width, 0.5),
                  Wall("right", -1.0, 0.0, -0.5 * width, 0.5)};
  for (int i = 0; i < n; ++i) {
    const int row = i / columns;
    Add({{ShapeType::kCircle, {0.1}},
         1.0,
         {-0.5 * width + 0.125 + 0.25 * (i % columns) + 0.01 * std::sin(12.9898 * i),
          0.15 + 0.22 * row}},
        0.5, &scene);
  }
  scene.simulation.dt = 0.002;
  scene.simulation.duration = 0.002 * static_cast<double>(steps);
  return scene;
}

// Discs and boxes of masses from 1 to mass_ratio, thrown together in a box.
Scene Mixture(unsigned seed, int n, double friction, double mass_ratio) {
  std::mt19937_64 random(seed);
  const auto draw = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
  };
  const int columns = static_cast<int>(std::ceil(std::sqrt(n)));
  const double width = 0.5 * columns + 0.2;
  Scene scene;
  scene.bodies = {Wall("floor", 0.0, 1.0, 0.0, friction),
                  Wall("left", 1.0, 0.0, -0.5 * width, friction),
                  Wall("right", -1.0, 0.0, -0.5 * width, friction)};
  for (int i = 0; i < n; ++i) {
    Grain grain;
    grain.shape = i % 2 == 0
                      ? BasicShape<double>{ShapeType::kCircle, {draw(0.1, 0.2)}}
                      : BasicShape<double>{ShapeType::kBox, {draw(0.15, 0.3), draw(0.15, 0.3)}};
    grain.mass = std::pow(mass_ratio, draw(0.0, 1.0));
    const int row = i / columns;
    grain.position = {-0.5 * width + 0.35 + 0.5 * (i % columns) + draw(-0.03, 0.03),
                      0.3 + 0.5 * row};
    grain.angle = draw(0.0, 6.0);
    Add(grain, friction, &scene);
  }
  scene.simulation.dt = 0.005;
  scene.simulation.duration = 1.5;
  return scene;
}

// Unit boxes in rows, each of which may be a box shorter than the one below.
Scene Boxes(int base, int rows, int shorter, double dt, long steps) {
  Scene scene;
  scene.bodies = {Wall("floor", 0.0, 1.0, 0.0, 0.5)};
  for (int row = 0; row < rows; ++row) {
    const int count = base - shorter * row;
    for (int i = 0; i < count; ++i) {
      Add({{ShapeType::kBox, {1.0, 1.0}}, 1.0, {1.125 * (i - 0.5 * (count - 1)), 0.5 + 1.05 * row}},
          0.5, &scene);
    }
  }
  scene.simulation.dt = dt;
  scene.simulation.duration = dt * static_cast<double>(steps);
  return scene;
}

RolloutReport RunChecked(const Scene& scene, State<double>* final) {
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  RolloutReport report = Rollout(
      model, initial,
      [](long k, double, const State<double>&, Stepper* stepper) {
        if (stepper != nullptr) {
          int worst = 0;
          const StepRecord& record = stepper->record();
          EXPECT_LE(NaturalResidual(record.problem, record.solution, &worst), kTolerance) << k;
        }
      },
      final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_LE(report.residual, kTolerance);
  return report;
}

TEST(PileTest, HundredDiscsSettleWithinTheirBox) {
  State<double> final;
  const RolloutReport report = RunChecked(Discs(100, 2500), &final);
  EXPECT_EQ(report.steps, 2500);
  EXPECT_GT(report.contacts_max, 140);
  EXPECT_GT(report.SolvedBy(Rung::kModeChanges, Rung::kPivotingFromGuess), 2300);
  double speed = 0.0;
  for (const double x : final.twist) {
    speed = std::max(speed, std::abs(x));
  }
  EXPECT_LT(speed, 1e-6);  // at rest
}

TEST(PileTest, FiftyDiscsHaveTheSameBitsTwice) {
  State<double> first, second;
  RunChecked(Discs(50, 700), &first);
  RunChecked(Discs(50, 700), &second);
  EXPECT_TRUE(first == second);
}

TEST(PileTest, FrictionAndMassRatiosAtTheExtremes) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    for (const double friction : {0.0, 0.8, 1.5}) {
      for (const double mass_ratio : {1.0, 1e4}) {
        SCOPED_TRACE(std::to_string(seed) + " " + std::to_string(friction) + " " +
                     std::to_string(mass_ratio));
        State<double> final;
        RunChecked(Mixture(seed, 25, friction, mass_ratio), &final);
      }
    }
  }
}

TEST(PileTest, StacksAndPyramidsOfBoxes) {
  State<double> final;
  RunChecked(Boxes(1, 10, 0, 1.0 / 60.0, 150), &final);
  RunChecked(Boxes(1, 50, 0, 0.002, 600), &final);
  RunChecked(Boxes(10, 10, 1, 1.0 / 60.0, 120), &final);
  RunChecked(Boxes(10, 10, 1, 0.002, 600), &final);
}

}  // namespace
}  // namespace tangible
