// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_counts.h"

#include <gtest/gtest.h>

#include "active_contact.h"

namespace tangible {
namespace {

using testing::Contact;

TEST(EventCountsTest, CountsPairsAndJointsApart) {
  EventCounts counts;
  EXPECT_EQ(counts.Of(Contact(1, 2)), 0);
  EXPECT_EQ(counts.Add(Contact(1, 2)), 1);
  EXPECT_EQ(counts.Add(Contact(0, 2)), 1);
  EXPECT_EQ(counts.Add(Contact(1, 2)), 2);
  EXPECT_EQ(counts.Add(Contact(1, 2, 4)), 1);
  EXPECT_EQ(counts.Of(Contact(0, 2)), 1);
  EXPECT_EQ(counts.Of(Contact(1, 2)), 2);
  EXPECT_EQ(counts.Of(Contact(2, 1)), 0);
  EXPECT_EQ(counts.num_pairs(), 3);
  counts.Clear();
  EXPECT_EQ(counts.Of(Contact(1, 2)), 0);
  EXPECT_EQ(counts.num_pairs(), 0);
}

}  // namespace
}  // namespace tangible
