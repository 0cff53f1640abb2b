// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/provenance.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(ProvenanceTest, SaysWhatWasBuiltAndWhereItRan) {
  const auto parts = Provenance();
  ASSERT_EQ(parts.size(), 5u);
  const char* const kNames[] = {"commit", "compiler", "flags", "cpu", "date"};
  for (size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(parts[i].first, kNames[i]);
    EXPECT_FALSE(parts[i].second.empty()) << kNames[i];
  }
  EXPECT_NE(parts[2].second.find("-ffp-contract=off"), std::string::npos) << parts[2].second;
  EXPECT_EQ(parts[4].second.size(), 20u) << parts[4].second;  // 2024-05-01T12:00:00Z
  EXPECT_EQ(ProvenanceLine().rfind("commit " + parts[0].second + "; compiler ", 0), 0u);
}

}  // namespace
}  // namespace tangible
