// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/shards.h"

#include <gtest/gtest.h>

#include <vector>

namespace tangible {
namespace {

TEST(ShardTest, EachRowBelongsToOneShard) {
  for (const long rows : {0, 1, 2, 7, 9, 30}) {
    for (const long count : {1, 2, 3, 10}) {
      std::vector<int> times(static_cast<size_t>(rows), 0);
      for (long index = 0; index < count; ++index) {
        const Shard shard{index, count};
        for (long i = 0; i < shard.NumRows(rows); ++i) {
          const long row = shard.RowOf(i);
          ASSERT_LT(row, rows);
          EXPECT_EQ(row % count, index);
          EXPECT_TRUE(shard.Has(row));
          EXPECT_FALSE(count > 1 && shard.Has(row + 1));
          ++times[static_cast<size_t>(row)];
        }
      }
      EXPECT_EQ(times, std::vector<int>(static_cast<size_t>(rows), 1)) << rows << ", " << count;
    }
  }
}

TEST(ReadShardFlagsTest, TakesANumberOfANumber) {
  ShardPlan plan;
  EXPECT_EQ(ReadShardFlags("", "", &plan), "");
  EXPECT_EQ(plan.part, ShardPlan::Part::kAll);
  EXPECT_EQ(ReadShardFlags("2/30", "", &plan), "");
  EXPECT_TRUE(plan.IsShard());
  EXPECT_EQ(plan.shard.index, 2);
  EXPECT_EQ(plan.shard.count, 30);
  for (const char* text : {"x", "2/2", "3/2", "-1/2", "1", "1/", "/2", "0/0", "1/2/3", "1 /2",
                           "+0/2", "0/1.5", "0/1000001", "0/99999999999999999999", "/"}) {
    ShardPlan bad;
    EXPECT_EQ(ReadShardFlags(text, "", &bad),
              "--shard: expected I/N with I from 0 to N - 1, got '" + std::string(text) + "'");
  }
}

TEST(ReadShardFlagsTest, TakesFilesToMerge) {
  ShardPlan plan;
  EXPECT_EQ(ReadShardFlags("", "a.csv,b.csv", &plan), "");
  EXPECT_TRUE(plan.IsMerge());
  EXPECT_EQ(plan.files, (std::vector<std::string>{"a.csv", "b.csv"}));
  EXPECT_EQ(ReadShardFlags("0/2", "a.csv", &plan), "--shard: not with --merge");
  EXPECT_EQ(ReadShardFlags("", "a.csv,,b.csv", &plan),
            "--merge: expected files, separated by commas, got 'a.csv,,b.csv'");
  EXPECT_EQ(ReadShardFlags("0/2", "", "", &plan),
            "--shard: needs --out, the file that keeps its rows");
  EXPECT_EQ(ReadShardFlags("0/2", "", "r.json", &plan), "");
}

}  // namespace
}  // namespace tangible
