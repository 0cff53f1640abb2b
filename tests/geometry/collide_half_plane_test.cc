// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "random_shapes.h"
#include "tangible/geometry/collide.h"

namespace tangible::testing {
namespace {

TEST(CollideHalfPlaneRandom, LowestVerticesInBothOrders) {
  std::mt19937 random(20240501);
  for (int sample = 0; sample < 5000; ++sample) {
    const TestShape shape = RandomShape(&random);
    const Pose<double> pose = RandomPose(&random, 2.0);
    const double x = Uniform(&random, -2.0, 2.0);
    const double y = Uniform(&random, 0.5, 2.0);
    const TestShape plane = HalfPlane(x, y, Uniform(&random, -2.0, 2.0));
    const Pose<double> plane_pose = RandomPose(&random, 2.0);
    const Contacts forward = Collide(shape, pose, plane, plane_pose);
    const Contacts backward = Collide(plane, plane_pose, shape, pose);

    const double norm = std::hypot(x, y);
    const Vector2<double> normal = plane_pose.rotation * Vector2<double>(x / norm, y / norm);
    const int num_vertices = NumVertices(shape.type, static_cast<int>(shape.numbers.size()));
    std::vector<double> gaps;
    gaps.reserve(num_vertices);
    for (int i = 0; i < num_vertices; ++i) {
      gaps.push_back(normal.dot(pose * Vertex(shape.View(), i) - plane_pose.position) -
                     plane.numbers[2] / norm - CoreRadius(shape.View()));
    }
    std::sort(gaps.begin(), gaps.end());
    ASSERT_EQ(forward.count, gaps.size() > 1 ? 2 : 1);
    ASSERT_EQ(backward.count, forward.count);
    ASSERT_NEAR(forward.geometry[0].gap, gaps[0], kTolerance);
    for (int i = 0; i < forward.count; ++i) {
      ASSERT_EQ(forward.features[i], Mirrored(backward.features[i]));
      ASSERT_NEAR(forward.geometry[i].gap, backward.geometry[i].gap, kTolerance);
      ASSERT_NEAR((forward.geometry[i].normal - normal).norm(), 0.0, kTolerance);
      ASSERT_NEAR((backward.geometry[i].normal + normal).norm(), 0.0, kTolerance);
      ASSERT_NEAR((forward.geometry[i].point - backward.geometry[i].point).norm(), 0.0, kTolerance);
      // Midway: half the gap above the surface.
      ASSERT_NEAR(
          normal.dot(forward.geometry[i].point - plane_pose.position) - plane.numbers[2] / norm,
          0.5 * forward.geometry[i].gap, kTolerance);
    }
  }
}

TEST(CollideHalfPlane, SecondContactOnlyWithinTheGap) {
  const TestShape plane = HalfPlane(0, 1, 0);
  // Turned by 0.1: the other lower corner is 2 sin 0.1 = 0.19967 higher.
  const double lowest = 2.0 - std::sin(0.1) - std::cos(0.1);
  EXPECT_EQ(Collide(Box(2, 2), At(0, 2, 0.1), plane, At(0, 0), lowest - 1e-12).count, 0);
  EXPECT_EQ(Collide(Box(2, 2), At(0, 2, 0.1), plane, At(0, 0), lowest + 1e-12).count, 1);
  EXPECT_EQ(Collide(Box(2, 2), At(0, 2, 0.1), plane, At(0, 0), lowest + 0.1996).count, 1);
  EXPECT_EQ(Collide(Box(2, 2), At(0, 2, 0.1), plane, At(0, 0), lowest + 0.1997).count, 2);
}

// Not the next lowest vertex, which is at the same tip.
TEST(CollideHalfPlane, TheOtherEndOfANeedleIsTheSecondContact) {
  const double thickness = 1e-9;
  const Contacts contacts =
      Collide(Box(1, thickness), At(0, 0.4, 0.3), HalfPlane(0, 1, 0), At(0, 0), 10.0);
  ASSERT_EQ(contacts.count, 2);
  EXPECT_NEAR(contacts.geometry[1].gap - contacts.geometry[0].gap, std::sin(0.3), 1e-15);
  // Upright, the other end out of reach: the tip is the face.
  const Contacts upright =
      Collide(Box(1, thickness), At(0, 0.6, 1.5), HalfPlane(0, 1, 0), At(0, 0), 0.5);
  ASSERT_EQ(upright.count, 2);
  EXPECT_NEAR(upright.geometry[1].gap - upright.geometry[0].gap, thickness * std::cos(1.5), 1e-15);
}

TEST(CollideHalfPlane, WhatHasNoLengthIsAPoint) {
  const TestShape plane = HalfPlane(0, 1, 0);
  EXPECT_EQ(Collide(Capsule(0, 0.5), At(0, 2, 0.3), plane, At(0, 0)).count, 1);
  EXPECT_EQ(Collide(Polygon({0, 0, 0, 0, 0, 0}), At(0, 2, 0.3), plane, At(0, 0)).count, 1);
  // A vertex written twice is passed over.
  const Contacts contacts = Collide(Polygon({0, 0, 0, 0, 1, 0, 0, 1}), At(0, 0), plane, At(0, 0));
  ASSERT_EQ(contacts.count, 2);
  EXPECT_EQ(std::abs(contacts.geometry[0].point.x() - contacts.geometry[1].point.x()), 1.0);
}

TEST(CollideHalfPlane, WithoutANormalThereIsNoContact) {
  EXPECT_EQ(Collide(Box(2, 2), At(0, 2), HalfPlane(0, 0, 1), At(0, 0)).count, 0);
}

}  // namespace
}  // namespace tangible::testing
