// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/disjoint_sets.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(DisjointSetsTest, ASetIsNamedByItsSmallestNumber) {
  DisjointSets sets;
  sets.AddAll(6);
  EXPECT_TRUE(sets.Join(4, 5));
  EXPECT_TRUE(sets.Join(1, 3));
  EXPECT_TRUE(sets.Join(5, 3));
  EXPECT_FALSE(sets.Join(4, 1));
  const int roots[] = {0, 1, 2, 1, 1, 1};
  for (int i = 0; i < 6; ++i) EXPECT_EQ(sets.Root(i), roots[i]) << i;
}

TEST(DisjointSetsTest, HasWhatWasAddedSinceItWasCleared) {
  DisjointSets sets;
  sets.AddAll(3);
  sets.Clear(2);
  sets.Add(1);
  EXPECT_FALSE(sets.Has(0));
  EXPECT_TRUE(sets.Has(1));
  EXPECT_EQ(sets.Root(1), 1);
}

}  // namespace
}  // namespace tangible
