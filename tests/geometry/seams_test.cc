// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/seams.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tangible/geometry/tolerances.h"

namespace tangible {
namespace {

struct Body {
  ShapeType type;
  std::vector<double> numbers;
  Vector2<double> position{0.0, 0.0};
  double angle = 0.0;
  PlacedShape Placed() const {
    return {{type, numbers.data(), static_cast<int>(numbers.size())},
            Pose<double>(position, angle)};
  }
};

Body Tile(double x, double top, double width = 1.0, double height = 0.4) {
  return {ShapeType::kBox, {width, height}, {x, top - 0.5 * height}};
}

// The features of `moving` with the second of two tiles that lie side by side.
struct Found {
  ContactFeature features[2];
  int count = 0;
  std::vector<ContactGeometry<double>> contacts;
};

Found FindAt(const Body& tile, const std::vector<Body>& neighbours, const Body& moving,
             SeamSide side = SeamSide::kFirst) {
  std::vector<PlacedShape> placed;
  for (const Body& body : neighbours) {
    placed.push_back(body.Placed());
  }
  ShapeSeams seams;
  FlushSteps steps;
  EXPECT_TRUE(FindSeams(tile.Placed(), placed, &seams, &steps));
  const PlacedShape a = side == SeamSide::kFirst ? tile.Placed() : moving.Placed();
  const PlacedShape b = side == SeamSide::kFirst ? moving.Placed() : tile.Placed();
  Found found;
  found.count = FindContactFeaturesAtSeams(a.shape, a.pose, b.shape, b.pose, seams, side, 10.0,
                                           found.features);
  for (int k = 0; k < found.count; ++k) {
    found.contacts.push_back(EvaluateContact(found.features[k], a.shape, a.pose, b.shape, b.pose));
  }
  return found;
}

TEST(SeamsTest, AFlushVertexHasNeitherACornerNorAnEnd) {
  const Body left = Tile(-0.5, 0.0);
  const Body right = Tile(0.5, 0.0);
  ShapeSeams seams;
  FlushSteps steps;
  ASSERT_TRUE(FindSeams(right.Placed(), {left.Placed()}, &seams, &steps));
  // The vertices on the left, lower and upper, and the edge between them.
  EXPECT_TRUE(seams.vertices[0].is_bounded);
  EXPECT_FALSE(seams.vertices[0].is_open);
  EXPECT_TRUE(seams.vertices[3].is_bounded);
  EXPECT_FALSE(seams.vertices[3].is_open);
  EXPECT_FALSE(seams.vertices[1].is_bounded);
  EXPECT_FALSE(seams.vertices[2].is_bounded);
  EXPECT_TRUE(seams.edges[3].parts.empty() && !seams.edges[3].is_whole);
  EXPECT_TRUE(seams.edges[0].is_whole && seams.edges[1].is_whole && seams.edges[2].is_whole);
  EXPECT_EQ(steps.count, 0);
}

TEST(SeamsTest, ABallHasOneContactWithTheTileBelowIt) {
  const Body left = Tile(-0.5, 0.0);
  const Body right = Tile(0.5, 0.0);
  for (const SeamSide side : {SeamSide::kFirst, SeamSide::kSecond}) {
    for (const double x : {-0.3, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 0.3}) {
      const Body ball = {ShapeType::kCircle, {0.1}, {x, 0.1}};
      EXPECT_EQ(FindAt(right, {left}, ball, side).count, x >= 0.0 ? 1 : 0) << x;
      EXPECT_EQ(FindAt(left, {right}, ball, side).count, x <= 0.0 ? 1 : 0) << x;
      const Body ellipse = {ShapeType::kEllipse, {0.2, 0.1}, {x, 0.1}};
      EXPECT_EQ(FindAt(right, {left}, ellipse, side).count, x >= 0.0 ? 1 : 0) << x;
    }
  }
}

// Before, on and beyond a seam whose right side is a little higher or lower, and a wall.
TEST(SeamsTest, ABoxHasTheContactsOfItsOwnCorners) {
  for (const double step : {0.0, 1e-16, -1e-16, 1e-12, -1e-12, 8e-10, -8e-10, 9.9e-9, -9.9e-9}) {
    const Body left = Tile(-0.5, 0.0);
    const Body right = Tile(0.5, step);
    for (const double x : {-0.3, -0.2, -0.2 + 1e-12, -0.2 + 1e-10, -0.1, 0.0, 0.2 - 1e-10, 0.2}) {
      const Body box = {ShapeType::kBox, {0.4, 0.2}, {x, 0.1 + 1e-17}};
      const Found on_right = FindAt(right, {left}, box);
      const Found on_left = FindAt(left, {right}, box);
      int corners = 0;
      for (const Found* found : {&on_left, &on_right}) {
        for (const ContactGeometry<double>& contact : found->contacts) {
          EXPECT_NEAR(std::abs(contact.normal.y()), 1.0, 1e-15) << step << " " << x;
          EXPECT_NEAR(std::abs(contact.point.x() - x), 0.2, 1e-9) << step << " " << x;
          EXPECT_NEAR(contact.gap, 0.0, 1e-8) << step << " " << x;
          ++corners;
        }
      }
      EXPECT_GE(corners, 2) << step << " " << x;
      EXPECT_LE(corners, 3) << step << " " << x;
    }
  }
}

TEST(SeamsTest, AHigherStepIsAWall) {
  const Body left = Tile(-0.5, 0.0);
  const Body right = Tile(0.5, 3e-8);
  const Body box = {ShapeType::kBox, {0.4, 0.2}, {-0.25, 0.1}};
  const Found found = FindAt(right, {left}, box);
  ASSERT_GE(found.count, 1);
  EXPECT_NEAR(std::abs(found.contacts[0].normal.x()), 1.0, 1e-12);
  EXPECT_NEAR(found.contacts[0].gap, 0.05, 1e-12);
  // A wall that stands beside the floor stops a corner that is below the floor's surface too.
  const Body wall = Tile(0.5, 1.0, 1.0, 1.6);
  const Body low = {ShapeType::kBox, {0.4, 0.2}, {-0.2, 0.1 - 1e-5}};
  const Found at_wall = FindAt(wall, {left}, low);
  ASSERT_EQ(at_wall.count, 2);
  EXPECT_NEAR(std::abs(at_wall.contacts[0].normal.x()), 1.0, 1e-12);
}

TEST(SeamsTest, StepsBeyondRoundingAreCounted) {
  ShapeSeams seams;
  FlushSteps steps;
  const Body left = Tile(-0.5, 0.0);
  const Body right = Tile(0.5, 2e-9);
  FindSeams(left.Placed(), {right.Placed()}, &seams, &steps);
  FindSeams(right.Placed(), {left.Placed()}, &seams, &steps);
  EXPECT_EQ(steps.count, 2);  // above and below
  EXPECT_NEAR(steps.highest, 2e-9, 1e-15);
}

// A thin tile beside a thick one hides the upper part of its side alone.
TEST(SeamsTest, ASideIsHiddenWhereTheNeighbourCoversIt) {
  const Body thin = Tile(-0.5, 0.0, 1.0, 0.1);
  const Body thick = Tile(0.5, 0.0, 1.0, 0.4);
  ShapeSeams seams;
  FlushSteps steps;
  ASSERT_TRUE(FindSeams(thick.Placed(), {thin.Placed()}, &seams, &steps));
  // Edge 3 runs downwards.
  ASSERT_EQ(seams.edges[3].parts.size(), 1u);
  EXPECT_NEAR(seams.edges[3].parts[0].from, 0.1, 1e-12);
  EXPECT_NEAR(seams.edges[3].parts[0].to, 0.4, 1e-12);
  // From below the side is a wall, from above it is not there.
  const Body above = {ShapeType::kBox, {0.4, 0.2}, {-0.201, 0.1 - 1e-6}};
  EXPECT_EQ(FindAt(thick, {thin}, above).count, 0);
  const Body below = {ShapeType::kBox, {0.4, 0.2}, {-0.201, -0.25}};
  EXPECT_EQ(FindAt(thick, {thin}, below).count, 2);
}

// Where faces meet at an angle, a vertex has the normals between theirs, or none in a valley.
TEST(SeamsTest, VerticesOfRidgesAndValleys) {
  const Body left = Tile(-0.5, 0.0);
  const double slope = 0.2;
  for (const double sign : {1.0, -1.0}) {
    const double rise = sign * std::tan(slope);
    const Body right = {ShapeType::kPolygon, {0.0, -0.4, 1.0, -0.4, 1.0, rise, 0.0, 0.0}};
    ShapeSeams seams;
    FlushSteps steps;
    ASSERT_TRUE(FindSeams(right.Placed(), {left.Placed()}, &seams, &steps));
    EXPECT_TRUE(seams.vertices[3].is_bounded);
    EXPECT_EQ(seams.vertices[3].is_open, sign < 0.0);
    for (const double angle : {-0.4, -0.1, 0.1, 0.3}) {
      // A ball whose centre lies in this direction from the vertex, to the right of the upright.
      const Body ball = {ShapeType::kCircle, {0.1}, {0.1 * std::sin(angle), 0.1 * std::cos(angle)}};
      const Found found = FindAt(right, {left}, ball);
      const bool within = sign < 0.0 && angle > 0.0 && angle < slope;
      const bool of_vertex =
          found.count == 1 && found.features[0].kind == FeatureKind::kVertexVertex;
      EXPECT_EQ(of_vertex, within) << sign << " " << angle;
    }
  }
}

TEST(SeamsTest, FarFromTheOriginAndTurned) {
  for (const double angle : {0.3, -1.2, 3.0}) {
    const Rotation<double> turn(angle);
    const Vector2<double> origin(5e3, -2e3);
    const auto placed = [&](Body body) {
      body.position = origin + turn * body.position;
      body.angle = angle;
      return body;
    };
    const Body left = placed(Tile(-0.5, 0.0));
    const Body right = placed(Tile(0.5, 0.0));
    EXPECT_EQ(FindAt(right, {left}, placed({ShapeType::kCircle, {0.1}, {-0.01, 0.1}})).count, 0);
    EXPECT_EQ(FindAt(right, {left}, placed({ShapeType::kCircle, {0.1}, {0.01, 0.1}})).count, 1);
    EXPECT_EQ(FindAt(right, {left}, placed({ShapeType::kBox, {0.4, 0.2}, {0.1, 0.1}})).count, 1);
    EXPECT_EQ(FindAt(right, {left}, placed({ShapeType::kCapsule, {0.4, 0.1}, {0.1, 0.1}})).count,
              1);
  }
}

TEST(SeamsTest, WhereNothingIsHiddenTheFeaturesAreTheSame) {
  const Body left = Tile(-0.5, 0.0);
  const Body right = Tile(0.5, 0.0);
  for (const Body& body : std::vector<Body>{{ShapeType::kCircle, {0.1}, {1.05, 0.05}},
                                            {ShapeType::kBox, {0.4, 0.2}, {0.9, 0.1}, 0.01},
                                            {ShapeType::kBox, {0.4, 0.2}, {1.3, -0.1}},
                                            {ShapeType::kCapsule, {0.4, 0.1}, {0.9, 0.1}}}) {
    const Found found = FindAt(right, {left}, body);
    const PlacedShape a = right.Placed();
    const PlacedShape b = body.Placed();
    ContactFeature features[2];
    ASSERT_EQ(FindContactFeatures(a.shape, a.pose, b.shape, b.pose, 10.0, features), found.count);
    for (int k = 0; k < found.count; ++k) {
      EXPECT_EQ(features[k], found.features[k]);
    }
  }
}

}  // namespace
}  // namespace tangible
