// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/row_archive.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

namespace tangible {
namespace {

enum class Kind { kA, kB, kC };
struct Inner {
  double x = 0.0;
  std::optional<double> maybe;
};
struct Outer {
  Kind kind = Kind::kA;
  bool flag = false;
  long count = 0;
  std::string text;
  std::vector<Inner> inner;
  double fixed[3] = {};
  std::map<std::string, long> named;
  Eigen::Vector2d point{0.0, 0.0};
  Eigen::MatrixXd matrix;
};

template <typename Visitor>
void VisitFields(Inner& inner, const Visitor& visit) {
  visit("x", inner.x);
  visit("maybe", inner.maybe);
}
template <typename Visitor>
void VisitFields(Outer& outer, const Visitor& visit) {
  visit("kind", outer.kind);
  visit("flag", outer.flag);
  visit("count", outer.count);
  visit("text", outer.text);
  visit("inner", outer.inner);
  visit("fixed", outer.fixed);
  visit("named", outer.named);
  visit("point", outer.point);
  visit("matrix", outer.matrix);
}

/// Through the text of a file.
template <typename T>
T ThereAndBack(const T& value) {
  T read;
  FromRow(Json::parse(ToRow(value).dump()), &read);
  return read;
}

TEST(RowArchiveTest, DoublesComeBackBitForBit) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20000; ++i) {
    const auto value = std::bit_cast<double>(random());
    if (std::isnan(value)) continue;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(ThereAndBack(value)),
              std::bit_cast<std::uint64_t>(value));
  }
  EXPECT_TRUE(std::signbit(ThereAndBack(-0.0)));
  EXPECT_EQ(ThereAndBack(HUGE_VAL), HUGE_VAL);
  EXPECT_EQ(ThereAndBack(-HUGE_VAL), -HUGE_VAL);
  EXPECT_TRUE(std::isnan(ThereAndBack(std::nan(""))));
}

TEST(RowArchiveTest, FieldsOfAllKindsComeBack) {
  Outer outer;
  outer.kind = Kind::kC;
  outer.flag = true;
  outer.count = -(1L << 60);
  outer.text = "a \"b\"\n";
  outer.inner = {{1.0, 2.0}, {HUGE_VAL, std::nullopt}};
  outer.fixed[1] = 0.1;
  outer.named = {{"one", 1}, {"two", 2}};
  outer.point = {0.25, -0.5};
  outer.matrix.resize(2, 3);
  outer.matrix << 1, 2, 3, 4, 5, 6;
  const Outer read = ThereAndBack(outer);
  EXPECT_EQ(read.kind, outer.kind);
  EXPECT_EQ(read.flag, outer.flag);
  EXPECT_EQ(read.count, outer.count);
  EXPECT_EQ(read.text, outer.text);
  ASSERT_EQ(read.inner.size(), 2U);
  EXPECT_EQ(read.inner[0].maybe, std::optional(2.0));
  EXPECT_EQ(read.inner[1].x, HUGE_VAL);
  EXPECT_EQ(read.inner[1].maybe, std::nullopt);
  EXPECT_EQ(read.fixed[1], 0.1);
  EXPECT_EQ(read.named, outer.named);
  EXPECT_EQ(read.point, outer.point);
  EXPECT_EQ(read.matrix, outer.matrix);
}

TEST(RowArchiveTest, OtherRowsAreAnError) {
  std::vector<Outer> read;
  std::string error;
  EXPECT_FALSE(FromRows({Json::object()}, &read, &error));
  EXPECT_EQ(error, "--merge: expected the rows of this program, got others");
}

}  // namespace
}  // namespace tangible
