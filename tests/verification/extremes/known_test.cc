// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/known.h"

#include <gtest/gtest.h>

namespace tangible::extremes {
namespace {

TEST(KnownTest, EveryEntryIsACaseAndHasAReason) {
  const std::vector<ExtremeCase> cases = AllCases();
  for (const KnownCase& known : KnownCases()) {
    EXPECT_FALSE(known.reason.empty());
    int found = 0;
    for (const ExtremeCase& one : cases) {
      found += one.name == known.name && one.stepping == known.stepping ? 1 : 0;
    }
    EXPECT_EQ(found, 1) << known.name << ", " << known.stepping;
  }
}

TEST(KnownTest, AllCasesAreMarked) {
  size_t marked = 0;
  for (const ExtremeCase& one : AllCases()) marked += one.known_reason.empty() ? 0 : 1;
  EXPECT_EQ(marked, KnownCases().size());
}

}  // namespace
}  // namespace tangible::extremes
