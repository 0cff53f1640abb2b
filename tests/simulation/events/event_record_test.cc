// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_record.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(EventRecordTest, KeepsItsPartsMemory) {
  EventRecord record;
  EXPECT_EQ(record.bytes(), 0U);
  EventPart* first = record.Add();
  first->segment.before.pose.resize(30);
  EXPECT_NE(record.Add(), first);
  EXPECT_EQ(record.num_parts, 2);
  EXPECT_GE(record.bytes(), 2 * sizeof(EventPart) + 30 * sizeof(double));
  const size_t bytes = record.bytes();
  record.Clear();
  EXPECT_EQ(record.num_parts, 0);
  EXPECT_EQ(record.bytes(), bytes);  // it is still held
  EXPECT_EQ(record.Add(), first);
  EXPECT_EQ(record.num_parts, 1);
}

}  // namespace
}  // namespace tangible
