// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/shape_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace tangible {
namespace {

std::string Message(const Json& json, BasicShape<double>* shape) {
  JsonErrors errors("f");
  ReadShape(JsonReader(json, &errors), shape);
  return errors.message();
}

std::string PolygonMessage(const std::vector<std::vector<double>>& vertices) {
  BasicShape<double> shape;
  return Message(Json{{"polygon", {{"vertices", vertices}}}}, &shape);
}

std::vector<std::vector<double>> RegularPolygon(int corners, int winding, double size, double x) {
  std::vector<std::vector<double>> vertices;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * winding * i / corners;
    vertices.push_back({x + size * std::cos(angle), size * std::sin(angle)});
  }
  return vertices;
}

TEST(ReadShapeTest, NumbersOfEachType) {
  BasicShape<double> shape;
  EXPECT_EQ(Message(Json::parse(R"({"circle": {"radius": 0.5}})"), &shape), "");
  EXPECT_EQ(shape.type, ShapeType::kCircle);
  EXPECT_EQ(shape.numbers, (std::vector<double>{0.5}));
  shape = {};
  EXPECT_EQ(Message(Json::parse(R"({"ellipse": {"radii": [1, 1e-6]}})"), &shape), "");
  EXPECT_EQ(shape.type, ShapeType::kEllipse);
  EXPECT_EQ(shape.numbers, (std::vector<double>{1, 1e-6}));
  shape = {};
  EXPECT_EQ(Message(Json::parse(R"({"box": {"size": [1, 2]}})"), &shape), "");
  EXPECT_EQ(shape.type, ShapeType::kBox);
  EXPECT_EQ(shape.numbers, (std::vector<double>{1, 2}));
  shape = {};
  EXPECT_EQ(Message(Json::parse(R"({"capsule": {"length": 3, "radius": 0.1}})"), &shape), "");
  EXPECT_EQ(shape.type, ShapeType::kCapsule);
  EXPECT_EQ(shape.numbers, (std::vector<double>{3, 0.1}));
  shape = {};
  EXPECT_EQ(Message(Json::parse(R"({"polygon": {"vertices": [[0, 0], [1, 0], [0, 1]]}})"), &shape),
            "");
  EXPECT_EQ(shape.type, ShapeType::kPolygon);
  EXPECT_EQ(shape.numbers, (std::vector<double>{0, 0, 1, 0, 0, 1}));
  shape = {};
  EXPECT_EQ(Message(Json::parse(R"({"half_plane": {"normal": [3, 4], "offset": 5}})"), &shape), "");
  EXPECT_EQ(shape.type, ShapeType::kHalfPlane);
  EXPECT_EQ(shape.numbers, (std::vector<double>{3, 4, 5}));
}

TEST(ReadShapeTest, ConvexPolygonsOfAnySize) {
  for (const double size : {1e-200, 1e-3, 1.0, 1e200}) {
    for (const int corners : {3, 4, 5, 100}) {
      EXPECT_EQ(PolygonMessage(RegularPolygon(corners, 1, size, 3.0 * size)), "")
          << size << " " << corners;
    }
  }
}

TEST(ReadShapeTest, BadPolygons) {
  const std::string place = "f: /polygon/vertices";
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 0}}),
            place + ": expected an array of at least 3 points, got an array of 2");
  EXPECT_EQ(PolygonMessage({{0, 0}, {0, 1}, {1, 0}}),
            place + ": expected counter-clockwise vertices, got clockwise ones");
  // A corner may turn inward, unless an edge comes to lie on another one or nothing is inside.
  EXPECT_EQ(PolygonMessage({{0, 0}, {2, 0}, {0.5, 0.5}, {0, 2}}), "");
  EXPECT_EQ(PolygonMessage({{0, 0}, {2, 0}, {2, 1}, {2, 0.5}, {0, 2}}),
            place + "/2: expected a corner, got a vertex on the line of its neighbours");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 0}, {2, 0}, {0, 2}}),
            place + "/1: expected a corner, got a vertex on the line of its neighbours");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 0}, {1, 0}, {0, 2}}),
            place + "/2: expected a polygon of different vertices, got the same vertex twice");
  EXPECT_EQ(PolygonMessage({{1, 1}, {1, 1}, {1, 1}}),
            place + "/0: expected a polygon of different vertices, got the same vertex twice");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 1}, {2, 2}}),
            place + "/0: expected a corner, got a vertex on the line of its neighbours");
  // Vertices that are the same are said before their direction is.
  EXPECT_EQ(PolygonMessage({{0, 0}, {0, 1}, {0, 1}, {1, 0}}),
            place + "/2: expected a polygon of different vertices, got the same vertex twice");
}

std::string Crossing(int a, int a_next, int b, int b_next) {
  const auto edge = [](int from, int to) {
    return "the edge of vertices " + std::to_string(from) + " and " + std::to_string(to);
  };
  return "f: /polygon/vertices: expected an outline that does not cross or touch itself, got " +
         edge(a, a_next) + " that meets " + edge(b, b_next);
}

TEST(ReadShapeTest, AnOutlineThatCrossesItselfNamesTheTwoEdges) {
  // A bow tie of area 0; one whose clockwise loop is the larger one; one with the other larger.
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 1}, {1, 0}, {0, 1}}), Crossing(0, 1, 2, 3));
  EXPECT_EQ(PolygonMessage({{0, 0}, {3, 2}, {3, 0}, {0, 1}}), Crossing(0, 1, 2, 3));
  EXPECT_EQ(PolygonMessage({{0, 0}, {3, 1}, {3, 0}, {0, 2}}), Crossing(0, 1, 2, 3));
  EXPECT_EQ(PolygonMessage({{0, 0}, {4, 0}, {4, 4}, {2, -1}}), Crossing(0, 1, 2, 3));
  EXPECT_EQ(PolygonMessage({{0, 0}, {4, -1}, {4, 4}, {3, 4}, {3.5, -2}}), Crossing(0, 1, 3, 4));
  // A vertex on another edge, and an edge along another one. Several pairs meet there, of which the
  // one is named whose edges begin further to the left.
  EXPECT_EQ(PolygonMessage({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}), Crossing(0, 1, 3, 4));
  EXPECT_EQ(PolygonMessage({{0, 0}, {4, 0}, {4, 4}, {3, 0}, {1, 0}, {0, 4}}), Crossing(0, 1, 4, 5));
}

TEST(ReadShapeTest, CrossingsAreFoundWhateverTheFirstVertexIsAndTheSize) {
  // A pentagram: every corner turns left, and each edge meets two others.
  EXPECT_NE(PolygonMessage(RegularPolygon(5, 2, 1.0, 0.0)).find(" that meets the edge of "),
            std::string::npos);
  // The edges from (0, 0) to (3, 1) and from (3, 0) to (0, 2) cross.
  const std::vector<std::vector<double>> bow_tie = {{0, 0}, {3, 1}, {3, 0}, {0, 2}};
  for (const double size : {1e-200, 1.0, 1e200}) {
    for (std::size_t shift = 0; shift < 4; ++shift) {
      std::vector<std::vector<double>> vertices;
      for (std::size_t i = 0; i < 4; ++i) {
        const std::vector<double>& vertex = bow_tie[(i + shift) % 4];
        vertices.push_back({size * vertex[0], size * vertex[1]});
      }
      const int first = shift % 2 == 0 ? 0 : 1;
      EXPECT_EQ(PolygonMessage(vertices), Crossing(first, first + 1, first + 2, (first + 3) % 4))
          << size << " " << shift;
    }
  }
  // A triangle that is drawn twice lies on itself.
  EXPECT_NE(PolygonMessage({{0, 0}, {1, 0}, {0, 1}, {0, 0}, {1, 0}, {0, 1}}).find(" that meets "),
            std::string::npos);
}

// An outline of a concave polygon crosses nothing: a comb of n teeth is a polygon, and one with a
// notch that reaches through the back is refused for the edges that cross.
TEST(ReadShapeTest, ACombIsNoCrossing) {
  for (const int teeth : {2, 3, 2000}) {
    std::vector<std::vector<double>> comb = {{0, -1}, {2.0 * teeth, -1}};
    for (int i = teeth; i > 0; --i) {
      comb.push_back({2.0 * i - 0.5, 1});
      comb.push_back({2.0 * i - 1.5, 0});
    }
    EXPECT_EQ(PolygonMessage(comb), "") << teeth;
    // The notch that reaches through the back is the rightmost one. Both of its edges meet the
    // back; the one that is named begins further to the left.
    comb[3][1] = -2;
    EXPECT_EQ(PolygonMessage(comb), Crossing(0, 1, 3, 4)) << teeth;
  }
}

TEST(IsCentredTest, PolygonsAboutTheOriginAndOff) {
  const auto centred = [](const std::vector<std::vector<double>>& vertices) {
    BasicShape<double> shape;
    EXPECT_EQ(Message(Json{{"polygon", {{"vertices", vertices}}}}, &shape), "");
    return IsCentred(shape);
  };
  for (const double size : {1e-3, 1.0, 1e3}) {
    EXPECT_TRUE(centred(RegularPolygon(5, 1, size, 0.0)));
    EXPECT_TRUE(centred(RegularPolygon(5, 1, size, 1e-10 * size)));
    EXPECT_FALSE(centred(RegularPolygon(5, 1, size, 1e-8 * size)));
  }
  // The centroid of a triangle is the mean of its vertices.
  EXPECT_TRUE(centred({{-1, -1}, {2, -1}, {-1, 2}}));
  EXPECT_FALSE(centred({{0, 0}, {1, 0}, {0, 1}}));
  // That of four points is not.
  EXPECT_FALSE(centred({{-1, -1}, {1, -1}, {0.5, 1}, {-0.5, 1}}));
  EXPECT_TRUE(IsCentred(BasicShape<double>{ShapeType::kCircle, {1.0}}));
}

}  // namespace
}  // namespace tangible
