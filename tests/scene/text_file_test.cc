// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/text_file.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

namespace tangible {
namespace {

class ReadTextFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("text_file_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  // Why it is not read, without "file: cannot be read: ".
  static std::string Refusal(const std::string& file) {
    std::string text = "untouched";
    std::string error;
    EXPECT_FALSE(ReadTextFile(file, &text, &error)) << file;
    EXPECT_EQ(text, "untouched");
    const std::string before = file + ": cannot be read: ";
    EXPECT_EQ(error.find(before), 0u) << error;
    return error.substr(std::min(before.size(), error.size()));
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(ReadTextFileTest, ReadsAWholeFileAsItIs) {
  std::string content =
      "\xef\xbb\xbf"
      "a\r\n";
  content += '\0';
  content += std::string(300000, 'b');
  std::ofstream(Path("file"), std::ios::binary) << content;
  std::string text;
  std::string error;
  ASSERT_TRUE(ReadTextFile(Path("file"), &text, &error)) << error;
  EXPECT_EQ(text, content);
  const std::vector<std::string> read = FilesRead();
  EXPECT_NE(std::find(read.begin(), read.end(), Path("file")), read.end());
  std::ofstream(Path("empty")).close();
  ASSERT_TRUE(ReadTextFile(Path("empty"), &text, &error)) << error;
  EXPECT_EQ(text, "");
  // The system says that it is empty, and it is not.
  ASSERT_TRUE(ReadTextFile("/proc/self/status", &text, &error)) << error;
  EXPECT_NE(text.find("Name:"), std::string::npos);
}

TEST_F(ReadTextFileTest, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(Refusal("/nowhere/at/all.json"), "No such file or directory");
  EXPECT_EQ(Refusal("/"), "Is a directory");
  std::ofstream(Path("file")) << "{}";
  std::string text;
  std::string error;
  EXPECT_FALSE(ReadTextFile(Path("file") + std::string("\0x", 2), &text, &error));
  EXPECT_NE(error.find("expected a name without a zero byte"), std::string::npos) << error;
}

// Each of these would keep a program waiting, or fill its memory.
TEST_F(ReadTextFileTest, ReadsRegularFilesOnly) {
  ASSERT_EQ(::mkfifo(Path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(Refusal(Path("pipe")), "expected a regular file, got a pipe");
  for (const char* device : {"/dev/zero", "/dev/null", "/dev/urandom"}) {
    EXPECT_EQ(Refusal(device), "expected a regular file, got a device or terminal");
  }
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  EXPECT_EQ(Refusal("/dev/fd/" + std::to_string(ends[0])), "expected a regular file, got a pipe");
  ::close(ends[0]);
  ::close(ends[1]);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = Path("socket");
  ASSERT_LT(name.size(), sizeof address.sun_path);
  std::strcpy(address.sun_path, name.c_str());
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_NE(Refusal(name).find("got a socket"), std::string::npos);
  ::close(socket);
}

TEST_F(ReadTextFileTest, HasALimitOfSize) {
  // Without a byte on the disk.
  std::ofstream(Path("large")).close();
  ASSERT_EQ(::truncate(Path("large").c_str(), static_cast<off_t>(kMaxFileSize) + 1), 0);
  EXPECT_EQ(Refusal(Path("large")), "expected at most 1024 MiB, got more");
}

TEST(ByteOrderMarkTest, StandsAtTheBeginning) {
  EXPECT_EQ(WithoutByteOrderMark("\xef\xbb\xbf{}"), "{}");
  EXPECT_EQ(WithoutByteOrderMark("{}"), "{}");
  EXPECT_EQ(WithoutByteOrderMark("\xef\xbb"), "\xef\xbb");
  EXPECT_EQ(WithoutByteOrderMark(""), "");
}

TEST(WhyNotTextTest, NamesOtherEncodingsAndTheFirstNulByte) {
  EXPECT_EQ(WhyNotText(""), "");
  EXPECT_EQ(WhyNotText("\xef\xbb\xbf a\xc3\xa9"), "");
  const auto bytes = [](const char* text, size_t size) {
    return WhyNotText(std::string(text, size));
  };
  const std::string wide = "expected text in UTF-8, got UTF-16 or UTF-32: save it as UTF-8";
  // "ab", little and big endian, of 16 and 32 bits, with and without a mark.
  EXPECT_EQ(bytes("\xff\xfe"
                  "a\0b\0",
                  6),
            wide);
  EXPECT_EQ(bytes("\xfe\xff\0a\0b", 6), wide);
  EXPECT_EQ(bytes("a\0b\0", 4), wide);
  EXPECT_EQ(bytes("\0a\0b", 4), wide);
  EXPECT_EQ(bytes("\xff\xfe\0\0a\0\0\0b\0\0\0", 12), wide);
  EXPECT_EQ(bytes("\0\0\xfe\xff\0\0\0a\0\0\0b", 12), wide);
  EXPECT_EQ(bytes("a\0\0\0b\0\0\0", 8), wide);
  EXPECT_EQ(bytes("a\nbc\0", 5), "line 2, column 3: expected text, got a NUL byte");
  EXPECT_EQ(bytes("a\0bc", 4), "line 1, column 2: expected text, got a NUL byte");
}

TEST(PathTest, FoldersAndRelativePaths) {
  EXPECT_EQ(FolderOf("a/b/c.json"), "a/b/");
  EXPECT_EQ(FolderOf("c.json"), "");
  EXPECT_EQ(JoinPath("a/b/", "c.csv"), "a/b/c.csv");
  EXPECT_EQ(JoinPath("a", "c.csv"), "a/c.csv");
  EXPECT_EQ(JoinPath("", "c.csv"), "c.csv");
  EXPECT_EQ(JoinPath("a/", "/c.csv"), "/c.csv");
}

TEST(OneLineTest, KeepsTextAndWritesOutWhatATerminalWouldObey) {
  EXPECT_EQ(OneLine("plain: 1 \\ ~"), "plain: 1 \\ ~");
  EXPECT_EQ(OneLine("Ünïcode ∇ 日本 🙂"), "Ünïcode ∇ 日本 🙂");
  EXPECT_EQ(OneLine("a\nb\tc\r\nd"), "a b c  d");
  EXPECT_EQ(OneLine(std::string("\x1b[31m\x07\0\x7f", 8)), "\\x1b[31m\\x07\\x00\\x7f");
  // Control characters of the upper half, as bytes and in UTF-8.
  EXPECT_EQ(OneLine("\x9b"
                    "2J"),
            "\\x9b2J");
  EXPECT_EQ(OneLine("\xc2\x9b"
                    "2J"),
            "\\u009b2J");
  // Turned writing, and line ends of Unicode.
  EXPECT_EQ(OneLine("\xe2\x80\xae"
                    "abc\xe2\x80\xa8"),
            "\\u202eabc\\u2028");
  // Cut, overlong, surrogates, too large.
  EXPECT_EQ(OneLine("\xe2\x80"), "\\xe2\\x80");
  EXPECT_EQ(OneLine("\xc0\xaf"), "\\xc0\\xaf");
  EXPECT_EQ(OneLine("\xe0\x80\xaf"), "\\xe0\\x80\\xaf");
  EXPECT_EQ(OneLine("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(OneLine("\xf5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");
  const std::string once = OneLine("\x1b\xff\n");
  EXPECT_EQ(OneLine(once), once);
  // Long ones, also where only the escapes are, and characters at the cut stay whole.
  for (const std::string& middle : {std::string(1000000, 'x'), std::string(400, '\x1b'),
                                    std::string(1000, '\x80'), std::string(1000, '\0')}) {
    const std::string cut = OneLine("begin" + middle + "end");
    EXPECT_LE(cut.size(), kMaxMessage);
    EXPECT_GT(cut.size(), kMaxMessage - 20);
    EXPECT_EQ(cut.find("begin"), 0u);
    EXPECT_NE(cut.find(" … "), std::string::npos);
    EXPECT_EQ(cut.substr(cut.size() - 3), "end");
    EXPECT_EQ(OneLine(cut), cut);
  }
  for (int shift = 0; shift < 4; ++shift) {
    std::string text(static_cast<size_t>(shift), 'a');
    for (int k = 0; k < 300; ++k) text += "∇🙂";
    EXPECT_EQ(OneLine(text).find('\\'), std::string::npos) << shift;
  }
}

}  // namespace
}  // namespace tangible
