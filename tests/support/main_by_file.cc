// SPDX-License-Identifier: Apache-2.0
// The main function of a test program of several files: --file=NAME.cc runs the tests that this
// file defines, so that one program, compiled at once, is an entry of ctest for each of its files.
#include <gtest/gtest.h>

#include <iostream>
#include <string>
#include <string_view>

namespace {

// The filter that names all tests of a file, or an empty one if there are none.
std::string TestsOf(std::string_view file) {
  const std::string ending = "/" + std::string(file);
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  std::string filter;
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const testing::TestInfo& test = *suite.GetTestInfo(k);
      if (std::string_view(test.file()).ends_with(ending)) {
        filter += std::string(filter.empty() ? "" : ":") + suite.name() + "." + test.name();
      }
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  constexpr std::string_view kFlag = "--file=";
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    const std::string filter =
        argument.starts_with(kFlag) ? TestsOf(argument.substr(kFlag.size())) : "";
    if (filter.empty()) {
      std::cerr << argv[0] << ": " << argument
                << ": expected --file=NAME.cc of a file with tests\n";
      return 2;
    }
    testing::GTEST_FLAG(filter) = filter;
  }
  return RUN_ALL_TESTS();
}
