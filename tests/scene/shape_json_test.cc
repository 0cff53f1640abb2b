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
  EXPECT_EQ(PolygonMessage({{0, 0}, {2, 0}, {0.5, 0.5}, {0, 2}}),
            place + "/2: expected a convex polygon, got a corner that turns inward");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 0}, {2, 0}, {0, 2}}),
            place + "/1: expected a convex polygon, got a vertex on the line of its neighbours");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 0}, {1, 0}, {0, 2}}),
            place + "/2: expected a convex polygon, got the same vertex twice");
  EXPECT_EQ(PolygonMessage({{1, 1}, {1, 1}, {1, 1}}),
            place + "/0: expected a convex polygon, got the same vertex twice");
  EXPECT_EQ(PolygonMessage({{0, 0}, {1, 1}, {2, 2}}),
            place + "/0: expected a convex polygon, got a vertex on the line of its neighbours");
  // A pentagram: every corner turns left.
  EXPECT_EQ(PolygonMessage(RegularPolygon(5, 2, 1.0, 0.0)),
            place + ": expected a convex polygon, got one that crosses itself");
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
