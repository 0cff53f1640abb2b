// SPDX-License-Identifier: Apache-2.0
// The inputs from which fuzzing begins, and those that it once found to fail, each run once. What is
// not as expected ends the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tangible/scene/text_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace tangible {
namespace {

TEST(FuzzTest, SeedsGiveWhatIsExpected) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(TANGIBLE_FUZZ_SEEDS)) {
    files.push_back(entry.path().string());
  }
  ASSERT_FALSE(files.empty());
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) {
    SCOPED_TRACE(file);
    std::string bytes;
    std::string error;
    ASSERT_TRUE(ReadTextFile(file, &bytes, &error)) << error;
    EXPECT_EQ(
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()),
        0);
  }
}

}  // namespace
}  // namespace tangible
