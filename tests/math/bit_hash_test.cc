// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/bit_hash.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace tangible {
namespace {

template <typename... Values>
std::string HashOf(const Values&... values) {
  BitHash hash;
  (hash.Add(values), ...);
  return hash.Text();
}

// FNV-1a of nothing is its offset basis; of the bytes "a", 0xff by the published recurrence.
TEST(BitHashTest, IsFnv1a) {
  EXPECT_EQ(BitHash().Text(), "cbf29ce484222325");
  std::uint64_t expected = 0xcbf29ce484222325ULL;
  for (const unsigned char byte : {'a', '\xff'}) {
    expected = (expected ^ byte) * 0x100000001b3ULL;
  }
  BitHash hash;
  hash.Add("a");
  EXPECT_EQ(hash.value(), expected);
}

TEST(BitHashTest, ChangesWithEveryBitAndTheOrder) {
  EXPECT_NE(HashOf(0.0), HashOf(-0.0));
  EXPECT_NE(HashOf(1.0), HashOf(std::nextafter(1.0, 2.0)));
  EXPECT_NE(HashOf(1.0, 2.0), HashOf(2.0, 1.0));
  EXPECT_NE(HashOf(std::string("ab"), std::string("c")),
            HashOf(std::string("a"), std::string("bc")));
  BitHash one;
  BitHash two;
  one.AddAll(std::vector<double>{1.0, 2.0});
  one.AddAll(std::vector<double>{});
  two.AddAll(std::vector<double>{1.0});
  two.AddAll(std::vector<double>{2.0});
  EXPECT_NE(one.Text(), two.Text());
}

}  // namespace
}  // namespace tangible
