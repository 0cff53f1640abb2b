// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/convex_core.h"

#include <gtest/gtest.h>

#include <random>

#include "random_shapes.h"

namespace tangible::testing {
namespace {

using internal::ConvexCore;
using internal::CoreEdge;
using internal::CoreFace;

TEST(ConvexCore, EdgesGoRoundWithTheirNormalsOutward) {
  const TestShape box = Box(2, 4);
  const ConvexCore core(box.View(), At(1, 1, 0.5 * std::numbers::pi), Vector2<double>(1, 1));
  ASSERT_EQ(core.Size(), 4);
  // Turned by 90° the lower edge looks to +x.
  const CoreEdge edge = core.Edge(0);
  EXPECT_NEAR((edge.Normal() - Vector2<double>(1, 0)).norm(), 0.0, kTolerance);
  EXPECT_NEAR((edge.start - Vector2<double>(2, -1)).norm(), 0.0, kTolerance);
  EXPECT_NEAR(edge.length, 2.0, kTolerance);
  EXPECT_NEAR(edge.Height(Vector2<double>(5, 7)), 3.0, kTolerance);
  EXPECT_NEAR((core.Edge(3).Normal() - Vector2<double>(0, -1)).norm(), 0.0, kTolerance);
}

TEST(ConvexCore, CapsuleHasTwoEdges) {
  const TestShape capsule = Capsule(2, 0.5);
  const ConvexCore core(capsule.View(), At(0, 0), Vector2<double>(0, 0));
  EXPECT_EQ(core.Edge(0).Normal(), Vector2<double>(0, -1));
  EXPECT_EQ(core.Edge(1).Normal(), Vector2<double>(0, 1));
  EXPECT_EQ(core.Radius(), 0.5);
}

TEST(ConvexCore, CollinearEdgesAreOneFace) {
  const TestShape polygon = Polygon({-1, 0, -0.5, 0, 0.3, 0, 1, 0, 1, 1, -1, 1});
  std::mt19937 random(20240601);
  for (int sample = 0; sample < 100; ++sample) {
    const ConvexCore core(polygon.View(), RandomPose(&random, 1.0), Vector2<double>(0, 0));
    for (int edge = 0; edge < 3; ++edge) {
      const CoreFace face = internal::FaceOfEdge(core, edge, core.Edge(edge));
      EXPECT_EQ(face.first, 0);
      EXPECT_EQ(face.last, 3);
      EXPECT_NEAR(face.line.length, 2.0, kTolerance);
    }
    EXPECT_EQ(internal::FaceOfEdge(core, 3, core.Edge(3)).last, 4);
  }
}

TEST(ConvexCore, FaceAgainstADirection) {
  const TestShape box = Box(2, 2);
  const ConvexCore core(box.View(), At(0, 0), Vector2<double>(0, 0));
  // At the lower left vertex: the lower edge looks against +y, the left one against +x.
  EXPECT_EQ(internal::FaceAgainst(core, 0, Vector2<double>(0.6, 0.8)).edge, 0);
  EXPECT_EQ(internal::FaceAgainst(core, 0, Vector2<double>(0.8, 0.6)).edge, 3);
  const TestShape circle = Circle(1);
  const ConvexCore point(circle.View(), At(0, 0), Vector2<double>(0, 0));
  EXPECT_EQ(internal::FaceAgainst(point, 0, Vector2<double>(0, 1)).edge, -1);
}

TEST(ConvexCore, VerticesBeyondTheBufferArePlacedAlike) {
  std::vector<double> vertices;
  for (int i = 0; i < 40; ++i) {
    vertices.push_back(std::cos(0.05 * std::numbers::pi * i));
    vertices.push_back(std::sin(0.05 * std::numbers::pi * i));
  }
  const TestShape polygon = Polygon(vertices);
  const Pose<double> pose = At(0.5, -0.25, 0.7);
  const ConvexCore core(polygon.View(), pose, Vector2<double>(0, 0));
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(core.VertexAt(i), pose * Vertex(polygon.View(), i));
  }
}

}  // namespace
}  // namespace tangible::testing
