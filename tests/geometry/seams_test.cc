// SPDX-License-Identifier: Apache-2.0
#include "tangible/geometry/seams.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tangible/geometry/outline.h"
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

// What one body leaves of the first; outlines where they are given.
ShapeSeams SeamsOf(const Body& body, const Outline* outline, const Body& neighbour,
                   const Outline* other) {
  PlacedShape placed = body.Placed();
  placed.outline = outline;
  PlacedShape beside = neighbour.Placed();
  beside.outline = other;
  ShapeSeams seams;
  FlushSteps steps;
  EXPECT_TRUE(FindSeams(placed, {beside}, &seams, &steps));
  EXPECT_EQ(steps.count, 0);
  return seams;
}

// A line up, along and down, which is solid below, beside a box as high as it and one half as high.
TEST(SeamsTest, OfAPolylineBesideABox) {
  // Against the way of the points the solid would be on the right: they go from right to left.
  const Body line{ShapeType::kPolyline, {3.0, 0.0, 3.0, 1.0, 0.0, 1.0, 0.0, 0.0}};
  const Outline outline(line.Placed().shape);
  ASSERT_EQ(outline.num_runs(), 3);
  const ShapeSeams flush = SeamsOf(line, &outline, Tile(-0.5, 1.0, 1.0, 1.0), nullptr);
  ASSERT_EQ(flush.edges.size(), 3u);
  ASSERT_EQ(flush.vertices.size(), 4u);
  EXPECT_TRUE(flush.edges[0].is_whole);
  EXPECT_TRUE(flush.edges[1].is_whole);
  EXPECT_TRUE(flush.edges[2].IsHidden());
  EXPECT_FALSE(flush.vertices[1].is_bounded);
  EXPECT_TRUE(flush.vertices[2].is_bounded);
  EXPECT_FALSE(flush.vertices[2].is_open);
  const ShapeSeams lower = SeamsOf(line, &outline, Tile(-0.5, 0.5, 1.0, 0.5), nullptr);
  EXPECT_FALSE(lower.vertices[2].is_bounded);
  ASSERT_EQ(lower.edges[2].parts.size(), 1u);
  EXPECT_DOUBLE_EQ(lower.edges[2].parts[0].from, 0.0);
  EXPECT_NEAR(lower.edges[2].parts[0].to, 0.5, 1e-7);

  // What the line leaves of the boxes: nothing of the sides that it covers.
  const ShapeSeams box = SeamsOf(Tile(-0.5, 1.0, 1.0, 1.0), nullptr, line, &outline);
  int hidden = 0, closed = 0;
  for (int i = 0; i < 4; ++i) {
    hidden += box.edges[i].IsHidden() ? 1 : 0;
    closed += box.vertices[i].is_open ? 0 : 1;
    if (box.edges[i].IsHidden()) {
      EXPECT_GT(box.edges[i].normal.x(), 0.9);
    }
    if (!box.vertices[i].is_open) {
      EXPECT_GT(box.edges[i].start.x(), 0.0);
    }
  }
  EXPECT_EQ(hidden, 1);
  EXPECT_GE(closed, 1);
}

// A line that begins at a box's corner and goes on at its height: behind it everything is solid.
TEST(SeamsTest, OfABoxAtTheEndOfALine) {
  const Body line{ShapeType::kPolyline, {3.0, 1.0, 0.0, 1.0}};
  const Outline outline(line.Placed().shape);
  const ShapeSeams box = SeamsOf(Tile(-0.5, 1.0, 1.0, 1.0), nullptr, line, &outline);
  for (int i = 0; i < 4; ++i) {
    const bool is_right = box.edges[i].normal.x() > 0.9;
    EXPECT_EQ(box.edges[i].IsHidden(), is_right);
    EXPECT_EQ(box.vertices[i].is_open, box.edges[i].start.x() < 0.0);
  }
  const ShapeSeams of_line = SeamsOf(line, &outline, Tile(-0.5, 1.0, 1.0, 1.0), nullptr);
  ASSERT_EQ(of_line.vertices.size(), 2u);
  EXPECT_TRUE(of_line.vertices[0].is_open);
  EXPECT_FALSE(of_line.vertices[1].is_open);
  EXPECT_TRUE(of_line.edges[0].is_whole);
}

// A polygon with a notch whose floor lies on a box's level: its wall is hidden below that level.
TEST(SeamsTest, OfABoxInTheNotchOfAPolygon) {
  const Body notched{
      ShapeType::kPolygon,
      {0.0, 0.0, 3.0, 0.0, 3.0, 1.0, 2.0, 1.0, 2.0, 0.5, 1.0, 0.5, 1.0, 1.0, 0.0, 1.0}};
  const Outline outline(notched.Placed().shape);
  const Body box = Tile(1.5, 1.0, 1.0, 0.5);
  const ShapeSeams of_box = SeamsOf(box, nullptr, notched, &outline);
  int hidden = 0;
  for (int i = 0; i < 4; ++i) {
    hidden += of_box.edges[i].IsHidden() ? 1 : 0;
    EXPECT_FALSE(of_box.vertices[i].is_open) << i;
  }
  EXPECT_EQ(hidden, 3);
  const ShapeSeams of_notched = SeamsOf(notched, &outline, box, nullptr);
  for (int run = 0; run < outline.num_runs(); ++run) {
    const Vector2<double> middle =
        outline.run(run).start + 0.5 * outline.run(run).length * outline.run(run).tangent;
    const bool covered = middle.x() >= 1.0 && middle.x() <= 2.0 && middle.y() > 0.4;
    EXPECT_EQ(of_notched.edges[run].IsHidden(), covered) << run;
  }
}

}  // namespace
}  // namespace tangible
