// SPDX-License-Identifier: Apache-2.0
//
// Every pair of shapes with values computed by hand, in both orders.
#include "tangible/geometry/collide.h"

#include <gtest/gtest.h>

#include <cmath>

#include "random_shapes.h"

namespace tangible::testing {
namespace {

struct Expected {
  ContactFeature feature;
  double gap;
  Vector2<double> normal;
  Vector2<double> point;
};

/// Expects these contacts in any order, and their mirror images when the bodies are swapped.
void ExpectContacts(const TestShape& a, const Pose<double>& pose_a, const TestShape& b,
                    const Pose<double>& pose_b, double max_gap,
                    const std::vector<Expected>& expected) {
  const Contacts forward = Collide(a, pose_a, b, pose_b, max_gap);
  const Contacts backward = Collide(b, pose_b, a, pose_a, max_gap);
  ASSERT_EQ(forward.count, static_cast<int>(expected.size()));
  ASSERT_EQ(backward.count, forward.count);
  for (const Expected& contact : expected) {
    int num_found = 0;
    for (int i = 0; i < forward.count; ++i) {
      if (forward.features[i] == contact.feature) {
        ++num_found;
        EXPECT_NEAR(forward.geometry[i].gap, contact.gap, kTolerance);
        EXPECT_NEAR((forward.geometry[i].normal - contact.normal).norm(), 0.0, kTolerance);
        EXPECT_NEAR((forward.geometry[i].point - contact.point).norm(), 0.0, kTolerance);
      }
      if (backward.features[i] == Mirrored(contact.feature)) {
        ++num_found;
        EXPECT_NEAR(backward.geometry[i].gap, contact.gap, kTolerance);
        EXPECT_NEAR((backward.geometry[i].normal + contact.normal).norm(), 0.0, kTolerance);
        EXPECT_NEAR((backward.geometry[i].point - contact.point).norm(), 0.0, kTolerance);
      }
    }
    EXPECT_EQ(num_found, 2) << "kind " << static_cast<int>(contact.feature.kind) << ", "
                            << contact.feature.a << ", " << contact.feature.b;
  }
}

constexpr FeatureKind kVertexVertex = FeatureKind::kVertexVertex;
constexpr FeatureKind kVertexEdge = FeatureKind::kVertexEdge;
constexpr FeatureKind kEdgeVertex = FeatureKind::kEdgeVertex;
constexpr FeatureKind kVertexPlane = FeatureKind::kVertexPlane;

TEST(Collide, CircleCircle) {
  // Centres 5 apart along (3, 4); the surfaces 5 − 1 − 2 = 2 apart, midway 2 + 1 from b.
  ExpectContacts(Circle(1.0), At(3, 4), Circle(2.0), At(0, 0), 3.0,
                 {{{kVertexVertex, 0, 0}, 2.0, {0.6, 0.8}, {1.8, 2.4}}});
  ExpectContacts(Circle(3.0), At(3, 4), Circle(4.0), At(0, 0), 3.0,
                 {{{kVertexVertex, 0, 0}, -2.0, {0.6, 0.8}, {1.8, 2.4}}});
  EXPECT_EQ(Collide(Circle(1.0), At(3, 4), Circle(2.0), At(0, 0), 2.0).count, 0);
}

TEST(Collide, CoincidentCirclesHaveANormal) {
  const Contacts contacts = Collide(Circle(1.0), At(1, 1), Circle(2.0), At(1, 1));
  ASSERT_EQ(contacts.count, 1);
  EXPECT_EQ(contacts.geometry[0].gap, -3.0);
  EXPECT_EQ(contacts.geometry[0].normal, Vector2<double>(0.0, 1.0));
}

TEST(Collide, CircleCapsule) {
  const TestShape capsule = Capsule(2.0, 0.5);
  // Above the segment (edge 1), below it (edge 0), beyond its ends.
  ExpectContacts(Circle(0.25), At(0.5, 1), capsule, At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 1}, 0.25, {0, 1}, {0.5, 0.625}}});
  ExpectContacts(Circle(0.25), At(0.5, -1), capsule, At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 0}, 0.25, {0, -1}, {0.5, -0.625}}});
  ExpectContacts(Circle(0.25), At(4, 4), capsule, At(0, 0), 9.0,
                 {{{kVertexVertex, 0, 1}, 4.25, {0.6, 0.8}, {2.575, 2.1}}});
  ExpectContacts(Circle(0.25), At(-2, 0), capsule, At(0, 0), 9.0,
                 {{{kVertexVertex, 0, 0}, 0.25, {-1, 0}, {-1.625, 0}}});
}

TEST(Collide, CircleBox) {
  const TestShape box = Box(4.0, 2.0);
  ExpectContacts(Circle(0.5), At(1, 2), box, At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 2}, 0.5, {0, 1}, {1, 1.25}}});
  ExpectContacts(Circle(0.5), At(5, 5), box, At(0, 0), 9.0,
                 {{{kVertexVertex, 0, 2}, 4.5, {0.6, 0.8}, {3.35, 2.8}}});
  // The centre inside: through the face of least penetration, here the right one.
  ExpectContacts(Circle(0.5), At(1.75, 0.5), box, At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 1}, -0.75, {1, 0}, {1.625, 0.5}}});
}

TEST(Collide, CirclePolygon) {
  // The hypotenuse from (3, 0) to (0, 4) has the normal (4, 3)/5 and passes 12/5 from the origin.
  const TestShape triangle = Polygon({0, 0, 3, 0, 0, 4});
  const Vector2<double> normal(0.8, 0.6);
  const Vector2<double> foot(1.5, 2.0);
  const Vector2<double> centre = foot + 1.0 * normal;
  ExpectContacts(Circle(0.5), At(centre.x(), centre.y()), triangle, At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 1}, 0.5, normal, foot + 0.25 * normal}});
}

TEST(Collide, ShapesOnAHalfPlane) {
  // Normal (0, 2), offset 1: the surface at y = 0.5.
  const TestShape plane = HalfPlane(0, 2, 1);
  ExpectContacts(Circle(0.5), At(3, 1.25), plane, At(0, 0), 1.0,
                 {{{kVertexPlane, 0, 0}, 0.25, {0, 1}, {3, 0.625}}});
  ExpectContacts(Box(2, 1), At(3, 1.25), plane, At(0, 0), 1.0,
                 {{{kVertexPlane, 0, 0}, 0.25, {0, 1}, {2, 0.625}},
                  {{kVertexPlane, 1, 0}, 0.25, {0, 1}, {4, 0.625}}});
  ExpectContacts(Capsule(2, 0.5), At(3, 1.25), plane, At(0, 0), 1.0,
                 {{{kVertexPlane, 0, 0}, 0.25, {0, 1}, {2, 0.625}},
                  {{kVertexPlane, 1, 0}, 0.25, {0, 1}, {4, 0.625}}});
  ExpectContacts(Polygon({0, 0, 1, 1, -1, 1}), At(3, 0.25), plane, At(0, 0), 0.5,
                 {{{kVertexPlane, 0, 0}, -0.25, {0, 1}, {3, 0.375}}});
}

TEST(Collide, HalfPlaneMovesWithItsBody) {
  // Turned by 90° its normal (0, 1) is (−1, 0); the surface is 1 before the body's origin at x = 3.
  const Contacts contacts =
      Collide(Circle(0.5), At(0, 7), HalfPlane(0, 1, 1), At(3, 0, 0.5 * std::numbers::pi), 9.0);
  ASSERT_EQ(contacts.count, 1);
  EXPECT_NEAR(contacts.geometry[0].gap, 1.5, kTolerance);
  EXPECT_NEAR((contacts.geometry[0].normal - Vector2<double>(-1, 0)).norm(), 0.0, kTolerance);
  EXPECT_NEAR((contacts.geometry[0].point - Vector2<double>(1.25, 7)).norm(), 0.0, kTolerance);
}

TEST(Collide, CapsuleCapsuleSideBySide) {
  // Axes 1.5 apart, overlapping from x = 0 to x = 1: an end of each on the other's side.
  ExpectContacts(Capsule(2, 0.5), At(1, 1.5), Capsule(2, 0.5), At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 1}, 0.5, {0, 1}, {0, 0.75}},
                  {{kEdgeVertex, 0, 1}, 0.5, {0, 1}, {1, 0.75}}});
}

TEST(Collide, CapsuleCapsuleEndToEndAndCrossed) {
  ExpectContacts(Capsule(2, 0.5), At(3.5, 0), Capsule(2, 0.5), At(0, 0), 1.0,
                 {{{kVertexVertex, 0, 1}, 0.5, {1, 0}, {1.75, 0}}});
  // An upright one whose lower end is 0.25 below the other's axis: least way out is up.
  const Contacts crossed = Collide(Capsule(2, 0.5), At(0.25, 0.75, 0.5 * std::numbers::pi),
                                   Capsule(2, 0.5), At(0, 0), 0.0);
  ASSERT_EQ(crossed.count, 1);
  EXPECT_EQ(crossed.features[0], (ContactFeature{kVertexEdge, 0, 1}));
  EXPECT_NEAR(crossed.geometry[0].gap, -1.25, kTolerance);
}

TEST(Collide, CapsuleBox) {
  // A capsule lying across the right edge of the box's top.
  ExpectContacts(Capsule(2, 0.5), At(1, 2), Box(2, 2), At(0, 0), 1.0,
                 {{{kVertexEdge, 0, 2}, 0.5, {0, 1}, {0, 1.25}},
                  {{kEdgeVertex, 0, 2}, 0.5, {0, 1}, {1, 1.25}}});
}

TEST(Collide, CapsulePolygon) {
  ExpectContacts(Capsule(1, 0.5), At(0, 1), Polygon({-3, -1, 3, -1, 3, 0, -3, 0}), At(0, 0), 0.75,
                 {{{kVertexEdge, 0, 2}, 0.5, {0, 1}, {-0.5, 0.25}},
                  {{kVertexEdge, 1, 2}, 0.5, {0, 1}, {0.5, 0.25}}});
}

TEST(Collide, BoxBoxOffsetStack) {
  ExpectContacts(Box(2, 2), At(0.5, 2.25), Box(2, 2), At(0, 0), 0.5,
                 {{{kVertexEdge, 0, 2}, 0.25, {0, 1}, {-0.5, 1.125}},
                  {{kEdgeVertex, 0, 2}, 0.25, {0, 1}, {1, 1.125}}});
  ExpectContacts(Box(1, 2), At(0.25, 1.75), Box(4, 2), At(0, 0), 0.5,
                 {{{kVertexEdge, 0, 2}, -0.25, {0, 1}, {-0.25, 0.875}},
                  {{kVertexEdge, 1, 2}, -0.25, {0, 1}, {0.75, 0.875}}});
}

TEST(Collide, EqualBoxesStackedExactly) {
  // Vertex over vertex: one contact at each end, whatever rounding says and in either order.
  for (const double shift : {0.0, 1e-16, -1e-13, 1e-11}) {
    for (const double height : {1.0, 1.0 + 1e-16, 1.0 - 1e-13, 1.25}) {
      for (const double turn : {0.0, 1e-13, -1e-13}) {
        const Contacts contacts = Collide(Box(1, 1), At(shift, height, turn), Box(1, 1), At(0, 0));
        ASSERT_EQ(contacts.count, 2);
        const bool left_first = contacts.geometry[0].point.x() < 0.0;
        const ContactGeometry<double>& left = contacts.geometry[left_first ? 0 : 1];
        const ContactGeometry<double>& right = contacts.geometry[left_first ? 1 : 0];
        EXPECT_EQ(contacts.features[left_first ? 0 : 1], (ContactFeature{kVertexEdge, 0, 2}));
        EXPECT_EQ(contacts.features[left_first ? 1 : 0], (ContactFeature{kVertexEdge, 1, 2}));
        const double tolerance = kTolerance + 2.0 * (std::abs(shift) + std::abs(turn));
        EXPECT_NEAR(left.point.x(), -0.5, tolerance);
        EXPECT_NEAR(right.point.x(), 0.5, tolerance);
        EXPECT_NEAR(left.gap, height - 1.0, tolerance);
        EXPECT_NEAR(right.gap, height - 1.0, tolerance);
      }
    }
  }
}

TEST(Collide, NearlyAlignedFacesHaveTheSameEndsWhicheverIsTheReference) {
  // Faces of 1 m whose ends are up to some 2e-9 m beside each other, at which vertices stop
  // counting as one above the other. A tilt of rounding makes either face the reference; what is
  // found does not flicker with it.
  for (const double shift : {2e-10, 0.6e-9, 1.1e-9, 1.5e-9, 1.9e-9, 2.1e-9, 5e-9}) {
    for (const double side : {1.0, -1.0}) {
      const Contacts level = Collide(Box(1, 1), At(side * shift, 1.0), Box(1, 1), At(0, 0));
      ASSERT_EQ(level.count, 2);
      for (const double turn : {1e-16, -1e-16, 3e-16, -3e-16, 1e-15, -1e-15}) {
        for (const double height : {1.0, 1.0 + 2.3e-16, 1.0 - 2.3e-16}) {
          const Contacts tilted =
              Collide(Box(1, 1), At(side * shift, height, turn), Box(1, 1), At(0, 0));
          ASSERT_EQ(tilted.count, 2);
          for (const ContactFeature& feature : tilted.features) {
            EXPECT_TRUE(feature == level.features[0] || feature == level.features[1])
                << "shift " << side * shift << ", turn " << turn << ", height " << height;
          }
        }
      }
    }
  }
}

TEST(Collide, BoxCornerOnAFace) {
  // Turned by 45°: the lowest corner sqrt(2) below the centre; the next ones within reach only for
  // a large gap.
  const double angle = 0.25 * std::numbers::pi;
  const Contacts near = Collide(Box(2, 2), At(0.1, 2.5, angle), Box(8, 2), At(0, 0), 1.0);
  ASSERT_EQ(near.count, 1);
  EXPECT_EQ(near.features[0], (ContactFeature{kVertexEdge, 0, 2}));
  EXPECT_NEAR(near.geometry[0].gap, 1.5 - std::numbers::sqrt2, kTolerance);
  const Contacts far = Collide(Box(2, 2), At(0.1, 2.5, angle - 0.1), Box(8, 2), At(0, 0), 2.0);
  ASSERT_EQ(far.count, 2);
  EXPECT_EQ(far.features[1], (ContactFeature{kVertexEdge, 1, 2}));
}

TEST(Collide, BoxBoxCornerToCorner) {
  ExpectContacts(Box(2, 2), At(5, 6), Box(2, 2), At(0, 0), 9.0,
                 {{{kVertexVertex, 0, 2}, 5.0, {0.6, 0.8}, {2.5, 3.0}}});
}

TEST(Collide, OneBoxInsideAnother) {
  // Nearest face of the outer one: the right one, 2 − 0.75 from the centre and another 0.5 to the
  // far side.
  const Contacts contacts = Collide(Box(1, 1), At(0.75, 0), Box(4, 4), At(0, 0));
  ASSERT_EQ(contacts.count, 2);
  EXPECT_NEAR(contacts.geometry[0].gap, -1.75, kTolerance);
  EXPECT_NEAR((contacts.geometry[0].normal - Vector2<double>(1, 0)).norm(), 0.0, kTolerance);
  const Contacts concentric = Collide(Box(1, 1), At(0, 0), Box(1, 1), At(0, 0));
  ASSERT_EQ(concentric.count, 2);
  EXPECT_NEAR(concentric.geometry[0].gap, -1.0, kTolerance);
}

TEST(Collide, PolygonOnItsFaceOfSeveralEdges) {
  // The bottom has a vertex in its middle: the contacts are at its ends all the same.
  const TestShape polygon = Polygon({-1, 0, 0, 0, 1, 0, 1, 1, -1, 1});
  ExpectContacts(polygon, At(0, 0.25), HalfPlane(0, 1, 0), At(0, 0), 0.5,
                 {{{kVertexPlane, 0, 0}, 0.25, {0, 1}, {-1, 0.125}},
                  {{kVertexPlane, 2, 0}, 0.25, {0, 1}, {1, 0.125}}});
  const Contacts on_box = Collide(polygon, At(0, 0.25), Box(4, 2), At(0, -1), 0.5);
  ASSERT_EQ(on_box.count, 2);
  EXPECT_NEAR(std::abs(on_box.geometry[0].point.x() - on_box.geometry[1].point.x()), 2.0,
              kTolerance);
}

TEST(Collide, NoContacts) {
  EXPECT_EQ(Collide(HalfPlane(0, 1, 0), At(0, 0), HalfPlane(0, -1, 0), At(0, 0)).count, 0);
  EXPECT_EQ(Collide({ShapeType::kNone, {}}, At(0, 0), Circle(1), At(0, 0)).count, 0);
  EXPECT_EQ(Collide(Circle(1), At(0, 0), {ShapeType::kNone, {}}, At(0, 0)).count, 0);
  EXPECT_EQ(Collide({ShapeType::kNone, {}}, At(0, 0), HalfPlane(0, 1, 0), At(0, 0)).count, 0);
}

TEST(Collide, FarFromTheOriginPositionsCancelFirst) {
  // At 2^30 the coordinates are exact multiples of 2^-22; the gap must not be rounded to them.
  const double far = 1073741824.0;
  const Contacts contacts =
      Collide(Box(0.3, 0.3), At(far, far + 0.25), Box(0.1, 0.1), At(far, far));
  ASSERT_EQ(contacts.count, 2);
  EXPECT_NEAR(contacts.geometry[0].gap, 0.05, kTolerance);
}

// Beyond 1e154 m squares of distances overflow: there is no nearest pair of vertices, and no edge
// below any. Whatever is found exists.
TEST(Collide, DistancesThatOverflow) {
  const TestShape triangle = Polygon({-1, 0, 1, 0, 0, 1});
  for (const double far : {1e150, 1e156, 1e200, 1e307}) {
    for (const bool swapped : {false, true}) {
      const Contacts contacts = swapped ? Collide(Box(2, 2), At(far, 0), triangle, At(0, 0))
                                        : Collide(triangle, At(0, 0), Box(2, 2), At(far, 0));
      for (int i = 0; i < contacts.count; ++i) {
        EXPECT_GE(contacts.features[i].a, 0);
        EXPECT_GE(contacts.features[i].b, 0);
        EXPECT_LT(contacts.features[i].a, 4);
        EXPECT_LT(contacts.features[i].b, 4);
      }
    }
  }
}

}  // namespace
}  // namespace tangible::testing
