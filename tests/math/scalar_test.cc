// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/scalar.h"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>
#include <vector>

namespace tangible {
namespace {

TEST(ValueOf, IsTheValueWithoutDerivatives) {
  EXPECT_EQ(ValueOf(-2.5), -2.5);
  Jet<3> x(1.5, 1);
  x.v[0] = std::numeric_limits<double>::quiet_NaN();  // must not matter
  EXPECT_EQ(ValueOf(x), 1.5);
  static_assert(std::is_same_v<decltype(ValueOf(x)), double>);
}

TEST(NumDerivatives, IsTheWidth) {
  static_assert(NumDerivatives<double>::value == 0);
  static_assert(NumDerivatives<Jet<1>>::value == 1);
  static_assert(NumDerivatives<Jet<16>>::value == 16);
}

TEST(JetWidths, ListIsWellFormed) {
  std::vector<int> widths;
#define TANGIBLE_ADD_WIDTH(N) widths.push_back(N);
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_ADD_WIDTH)
  const std::vector<int> listed = widths;
  widths.clear();
  TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_ADD_WIDTH)
#undef TANGIBLE_ADD_WIDTH
  for (const int width : listed) {
    EXPECT_GT(width, 0);
  }
  int num_local = 0;
  for (const int width : widths) {
    num_local += width == TANGIBLE_LOCAL_JET_WIDTH ? 1 : 0;
  }
  EXPECT_EQ(num_local, 1);  // instantiated twice it would not link
  EXPECT_GE(widths.size(), listed.size());
}

TEST(RowMatrix, RowsAreContiguous) {
  RowMatrixXd matrix(2, 3);
  matrix << 1, 2, 3, 4, 5, 6;
  EXPECT_EQ(matrix.data()[1], 2.0);
  EXPECT_EQ(matrix.data()[3], 4.0);
}

}  // namespace
}  // namespace tangible
