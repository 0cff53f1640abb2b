// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace tangible {
namespace {

std::mutex files_read_mutex;
std::set<std::string>& FilesReadSet() {
  static std::set<std::string> files;
  return files;
}

FileReader& Reader() {
  static FileReader reader;
  return reader;
}

/// A file that is open for reading.
class OpenFile {
 public:
  /// Without O_NONBLOCK a pipe without a writer would keep the program waiting here.
  explicit OpenFile(const std::string& file)
      : number_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
  ~OpenFile() {
    if (number_ >= 0) ::close(number_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

std::string WhatItIs(mode_t mode) {
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISCHR(mode)) return "a device or terminal";
  if (S_ISBLK(mode)) return "a block device";
  return S_ISSOCK(mode) ? "a socket" : "another kind of file";
}

std::string TooLarge() {
  return "expected at most " + std::to_string(kMaxFileSize >> 20) + " MiB, got more";
}

// Why it cannot be read, or empty.
std::string ReadAll(const std::string& file, std::string* content) {
  // The system would use the name only up to there, and read another file.
  if (file.find('\0') != std::string::npos) return "expected a name without a zero byte";
  const OpenFile opened(file);
  struct stat status {};
  if (opened.number() < 0 || ::fstat(opened.number(), &status) != 0) {
    // This is the error for a socket.
    return errno == ENXIO ? "expected a regular file, got a socket or a device"
                          : std::strerror(errno);
  }
  if (S_ISDIR(status.st_mode)) return std::strerror(EISDIR);
  if (!S_ISREG(status.st_mode)) {
    return "expected a regular file, got " + WhatItIs(status.st_mode);
  }
  if (status.st_size > static_cast<off_t>(kMaxFileSize)) return TooLarge();
  // The size may be 0 for files that the system generates (/proc), and another program may be
  // writing.
  constexpr std::size_t kPart = std::size_t{1} << 16;
  content->resize(static_cast<std::size_t>(status.st_size) + 1);
  std::size_t size = 0;
  for (;;) {
    if (size == content->size()) content->resize(size + kPart);
    const ssize_t got = ::read(opened.number(), content->data() + size, content->size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::strerror(errno);
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
    if (size > kMaxFileSize) return TooLarge();
  }
  content->resize(size);
  return "";
}

/// A character of UTF-8, or a byte that is not part of one.
struct Character {
  std::uint32_t code = 0;
  std::size_t size = 1;
  bool valid = false;
};

Character FirstOf(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t size = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < size) return {lead, 1, false};
  std::uint32_t code = lead & (0xffU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return {lead, 1, false};
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::uint32_t kLeast[] = {0x80, 0x800, 0x10000};  // of characters of 2, 3 and 4 bytes
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  if (code < kLeast[size - 2] || code > 0x10ffff || surrogate) return {lead, 1, false};
  return {code, size, true};
}

// Control characters (C0, DEL, C1), and those that end a line or turn the direction of writing.
bool IsControl(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code <= 0x9f) || code == 0x61c ||
         (code >= 0x200e && code <= 0x200f) || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2066 && code <= 0x2069) || code == 0xfeff;
}

std::string Escaped(const Character& character) {
  char text[8];
  std::snprintf(text, sizeof text,
                !character.valid || character.code < 0x80 ? "\\x%02x" : "\\u%04x",
                static_cast<unsigned>(character.code));
  return text;
}

}  // namespace

std::vector<std::string> FilesRead() {
  const std::lock_guard<std::mutex> lock(files_read_mutex);
  return {FilesReadSet().begin(), FilesReadSet().end()};
}

void SetFileReader(FileReader reader) { Reader() = std::move(reader); }

bool ReadTextFile(const std::string& file, std::string* text, std::string* error) {
  std::string content;
  std::optional<std::string> elsewhere = Reader() ? Reader()(file, &content) : std::nullopt;
  const std::string reason = elsewhere ? *std::move(elsewhere) : ReadAll(file, &content);
  if (!reason.empty()) {
    *error = OneLine(file + ": cannot be read: " + reason);
    return false;
  }
  *text = std::move(content);
  const std::lock_guard<std::mutex> lock(files_read_mutex);
  FilesReadSet().insert(file);
  return true;
}

std::string_view WithoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return text.substr(0, kMark.size()) == kMark ? text.substr(kMark.size()) : text;
}

std::string WhyNotText(std::string_view bytes) {
  const auto begins = [&](std::string_view mark) { return bytes.substr(0, mark.size()) == mark; };
  const std::size_t nul = bytes.find('\0');
  const bool beside_letter = nul == 0 || (nul == 1 && bytes[0] != '\0');
  const bool wide =
      beside_letter && bytes.size() > 3 && bytes.size() % 2 == 0 && bytes[2 + nul % 2] == '\0';
  if (begins("\xff\xfe") || begins("\xfe\xff") || begins({"\0\0\xfe\xff", 4}) || wide) {
    return "expected text in UTF-8, got UTF-16 or UTF-32: save it as UTF-8";
  }
  if (nul == std::string_view::npos) return "";
  const std::string_view before = bytes.substr(0, nul);
  return "line " + std::to_string(1 + std::count(before.begin(), before.end(), '\n')) +
         ", column " + std::to_string(nul - (before.rfind('\n') + 1) + 1) +
         ": expected text, got a NUL byte";
}

std::string FolderOf(const std::string& file) {
  const std::size_t slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash + 1);
}

std::string JoinPath(const std::string& folder, const std::string& path) {
  if (folder.empty() || (!path.empty() && path[0] == '/')) return path;
  return folder.back() == '/' ? folder + path : folder + "/" + path;
}

std::string OneLine(std::string_view text) {
  // Both ends are written as they will be read: an escaped character has up to six bytes.
  constexpr std::string_view kLeftOut = " … ";
  constexpr std::size_t kHalf = (kMaxMessage - kLeftOut.size()) / 2;
  const auto written = [](std::string_view part) {
    std::vector<std::string> characters;
    while (!part.empty()) {
      const Character character = FirstOf(part);
      const bool space = character.code >= '\t' && character.code <= '\r';
      const bool shown = character.valid && !IsControl(character.code);
      characters.push_back(space   ? " "
                           : shown ? std::string(part.substr(0, character.size))
                                   : Escaped(character));
      part.remove_prefix(character.size);
    }
    return characters;
  };
  const auto joined = [](auto begin, auto end) {
    std::string line;
    for (; begin != end; ++begin) line += *begin;
    return line;
  };
  const bool is_long = text.size() > kMaxMessage;
  std::vector<std::string> head = written(is_long ? text.substr(0, kHalf + 4) : text);
  if (std::string line = joined(head.begin(), head.end()); !is_long && line.size() <= kMaxMessage) {
    return line;
  }
  std::size_t from = is_long ? text.size() - kHalf : 0;
  for (int k = 0; k < 3 && (static_cast<unsigned char>(text[from]) & 0xc0U) == 0x80U; ++k) ++from;
  const std::vector<std::string> tail = written(text.substr(from));
  std::size_t size = 0;
  const auto fits = [&size](const std::string& character) {
    size += character.size();
    return size <= kHalf;
  };
  const auto first_left_out = std::find_if_not(head.begin(), head.end(), fits);
  size = 0;
  const auto last_left_out = std::find_if_not(tail.rbegin(), tail.rend(), fits).base();
  return joined(head.begin(), first_left_out) + std::string(kLeftOut) +
         joined(last_left_out, tail.end());
}

}  // namespace tangible
