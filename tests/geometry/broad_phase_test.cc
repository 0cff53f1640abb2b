// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/broad_phase.h"

#include <gtest/gtest.h>

#include <random>

#include "../support/allocation_counter.h"
#include "random_shapes.h"
#include "tangible/math/scalar.h"

namespace tangible::testing {
namespace {

using Pairs = std::vector<std::pair<int, int>>;
constexpr auto kAll = [](int, int) { return true; };

bool Meet(const Aabb& a, const Aabb& b) {
  if (a.min_x > a.max_x || b.min_x > b.max_x) {
    return false;  // empty
  }
  return a.min_x <= b.max_x && b.min_x <= a.max_x && a.min_y <= b.max_y && b.min_y <= a.max_y;
}

Pairs AllPairs(const std::vector<Aabb>& boxes) {
  Pairs pairs;
  for (int i = 0; i < static_cast<int>(boxes.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(boxes.size()); ++j) {
      if (Meet(boxes[i], boxes[j])) {
        pairs.emplace_back(i, j);
      }
    }
  }
  return pairs;
}

/// Sometimes empty, sometimes infinite.
Aabb RandomBox(std::mt19937* random) {
  const int kind = std::uniform_int_distribution<int>(0, 19)(*random);
  if (kind == 0) {
    return {kInfinity, kInfinity, -kInfinity, -kInfinity};  // empty
  }
  if (kind == 1) {
    return {-kInfinity, -kInfinity, kInfinity, Uniform(random, -1.0, 1.0)};  // a floor
  }
  if (kind == 2) {
    return {-kInfinity, -kInfinity, kInfinity, kInfinity};
  }
  const double x = Uniform(random, -3.0, 3.0);
  const double y = Uniform(random, -3.0, 3.0);
  return {x, y, x + Uniform(random, 0.0, 1.0), y + Uniform(random, 0.0, 1.0)};
}

TEST(BroadPhase, FindsThePairsThatAllPairsFind) {
  std::mt19937 random(20240401);
  BroadPhase broad_phase;  // kept: its history must not matter
  std::size_t num_pairs = 0;
  for (int sample = 0; sample < 500; ++sample) {
    std::vector<Aabb> boxes(std::uniform_int_distribution<int>(0, 60)(random));
    for (Aabb& box : boxes) {
      box = RandomBox(&random);
    }
    for (int motion = 0; motion < 5; ++motion) {
      Pairs pairs = {{7, 7}};  // replaced
      broad_phase.FindPairs(boxes, kAll, &pairs);
      ASSERT_EQ(pairs, AllPairs(boxes));
      num_pairs += pairs.size();
      for (Aabb& box : boxes) {
        const double dx = Uniform(&random, -0.3, 0.3);
        box.min_x += dx;
        box.max_x += dx;
      }
    }
  }
  EXPECT_GT(num_pairs, 10000u);
}

// Unit boxes scattered over a square so that each meets about one other, or in a row or a stack.
TEST(BroadPhase, ComparesLessThanAllPairsFrom32BodiesOn) {
  std::mt19937 random(20240404);
  for (int n = 32; n <= 1024; n *= 2) {
    for (const bool wide : {false, true}) {
      for (const bool tall : {false, true}) {
        std::vector<Aabb> boxes(n);
        for (Aabb& box : boxes) {
          const double x = Uniform(&random, 0.0, wide ? n : std::sqrt(2.0 * n));
          const double y = Uniform(&random, 0.0, tall ? n : std::sqrt(2.0 * n));
          box = {x, y, x + 1.0, y + 1.0};
        }
        BroadPhase broad_phase;
        Pairs pairs;
        broad_phase.FindPairs(boxes, kAll, &pairs);
        ASSERT_EQ(pairs, AllPairs(boxes));
        EXPECT_GE(broad_phase.num_compared(), static_cast<int>(pairs.size()));
        // On an axis of extent E a box meets 2 n / E others, each pair once: n² / E, E = √(2 n).
        EXPECT_LT(broad_phase.num_compared(), 1.5 * n * std::sqrt(0.5 * n));
        EXPECT_LT(broad_phase.num_compared(), n * (n - 1) / 4);
      }
    }
  }
}

TEST(BroadPhase, OnlyAllowedPairs) {
  const std::vector<Aabb> boxes(4, Aabb{0, 0, 1, 1});
  BroadPhase broad_phase;
  Pairs pairs;
  broad_phase.FindPairs(
      boxes,
      [](int i, int j) {
        EXPECT_LT(i, j);
        return (i + j) % 2 == 1;
      },
      &pairs);
  EXPECT_EQ(pairs, (Pairs{{0, 1}, {0, 3}, {1, 2}, {2, 3}}));
}

TEST(BroadPhase, TouchingBoxesOverlap) {
  BroadPhase broad_phase;
  Pairs pairs;
  broad_phase.FindPairs({{0, 0, 1, 1}, {1, 1, 2, 2}}, kAll, &pairs);
  EXPECT_EQ(pairs, (Pairs{{0, 1}}));
}

TEST(BroadPhase, AllocatesNothingOnceItHasGrown) {
  std::mt19937 random(20240402);
  std::vector<Aabb> boxes(200);
  for (Aabb& box : boxes) {
    box = RandomBox(&random);
  }
  BroadPhase broad_phase;
  Pairs pairs;
  broad_phase.FindPairs(boxes, kAll, &pairs);
  const long before = NumAllocations();
  for (int i = 0; i < 10; ++i) {
    for (Aabb& box : boxes) {
      box.min_y += 0.01;
    }
    broad_phase.FindPairs(boxes, kAll, &pairs);
  }
  EXPECT_EQ(NumAllocations(), before);
  EXPECT_GT(before, 0);
}

TEST(Collide, AllocatesNothing) {
  std::vector<double> vertices;
  for (int i = 0; i < 100; ++i) {
    vertices.push_back(std::cos(0.02 * std::numbers::pi * i));
    vertices.push_back(std::sin(0.02 * std::numbers::pi * i));
  }
  const std::vector<TestShape> shapes = {Circle(1), Box(1, 1), Capsule(1, 1), Polygon(vertices),
                                         HalfPlane(0, 1, 0)};
  const long before = NumAllocations();
  for (const TestShape& a : shapes) {
    for (const TestShape& b : shapes) {
      Collide(a, At(0, 1, 0.3), b, At(1, 0));
    }
  }
  EXPECT_EQ(NumAllocations(), before);
}

TEST(ComputeAabb, HoldsTheShapeAndItsMargin) {
  std::mt19937 random(20240403);
  for (int sample = 0; sample < 1000; ++sample) {
    const TestShape shape = RandomShape(&random);
    const Pose<double> pose = RandomPose(&random, 2.0);
    const Aabb box = ComputeAabb(shape.View(), pose, 0.25);
    // The box's sides are half-planes a margin away from the shape.
    const auto distance = [&](double x, double y, double offset) {
      return Collide(shape, pose, HalfPlane(x, y, offset), At(0, 0)).geometry[0].gap;
    };
    EXPECT_NEAR(distance(1, 0, box.min_x), 0.25, 1e-14);
    EXPECT_NEAR(distance(0, 1, box.min_y), 0.25, 1e-14);
    EXPECT_NEAR(distance(-1, 0, -box.max_x), 0.25, 1e-14);
    EXPECT_NEAR(distance(0, -1, -box.max_y), 0.25, 1e-14);
  }
}

TEST(ComputeAabb, EllipseIsHeldTightly) {
  const TestShape ellipse = Ellipse(0.5, 0.2);
  const Pose<double> pose = At(1.0, -2.0, 0.7);
  const Aabb box = ComputeAabb(ellipse.View(), pose, 0.1);
  double reach[4] = {};
  for (int k = 0; k < 10000; ++k) {
    const double anomaly = 6.283185307179586e-4 * k;
    const Vector2<double> p =
        pose.rotation * Vector2<double>(0.5 * std::cos(anomaly), 0.2 * std::sin(anomaly));
    const double along[4] = {-p.x(), -p.y(), p.x(), p.y()};
    for (int i = 0; i < 4; ++i) {
      reach[i] = std::max(reach[i], along[i]);
    }
  }
  // The nearest of 10000 points is off by (3e-4)² / 2 of its size.
  EXPECT_NEAR(box.min_x, 1.0 - reach[0] - 0.1, 1e-7);
  EXPECT_NEAR(box.min_y, -2.0 - reach[1] - 0.1, 1e-7);
  EXPECT_NEAR(box.max_x, 1.0 + reach[2] + 0.1, 1e-7);
  EXPECT_NEAR(box.max_y, -2.0 + reach[3] + 0.1, 1e-7);
}

TEST(ComputeAabb, HalfPlaneIsBoundedAlongAnAxisAlone) {
  const Aabb floor = ComputeAabb(HalfPlane(0, 2, 1).View(), At(5, 3), 0.25);
  EXPECT_EQ(floor.max_y, 3.75);
  EXPECT_EQ(floor.min_y, -kInfinity);
  EXPECT_EQ(floor.min_x, -kInfinity);
  EXPECT_EQ(floor.max_x, kInfinity);
  EXPECT_EQ(ComputeAabb(HalfPlane(0, -2, 1).View(), At(5, 3), 0.25).min_y, 2.25);
  EXPECT_EQ(ComputeAabb(HalfPlane(2, 0, 1).View(), At(5, 3), 0.25).max_x, 5.75);
  EXPECT_EQ(ComputeAabb(HalfPlane(-2, 0, 1).View(), At(5, 3), 0.25).min_x, 4.25);
  const Aabb slope = ComputeAabb(HalfPlane(1, 1, 0).View(), At(0, 0), 0.0);
  EXPECT_EQ(slope.max_y, kInfinity);
}

TEST(ComputeAabb, NoShapeIsEmpty) {
  const Aabb box = ComputeAabb(ShapeView<double>{}, At(1, 2), 0.5);
  EXPECT_GT(box.min_x, box.max_x);
  EXPECT_GT(box.min_y, box.max_y);
}

}  // namespace
}  // namespace tangible::testing
