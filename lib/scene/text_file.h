// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Reading whole text files, and text that goes into messages.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tangible {

/// Larger files are refused: 1 GiB.
inline constexpr std::size_t kMaxFileSize = std::size_t{1} << 30;

/// Longer messages are cut in the middle: the beginning says where and what, the end what was got.
inline constexpr std::size_t kMaxMessage = 500;

/// Reads a whole file; false and "file: cannot be read: why" if that fails. All inputs of all
/// programs are read here. Only regular files of at most kMaxFileSize are read: a pipe, a device, a
/// socket or a terminal could keep the program waiting or never end, and is refused before anything
/// is read from it (/dev/stdin is taken where it is redirected from a regular file).
bool ReadTextFile(const std::string& file, std::string* text, std::string* error);

/// Reads a file's content from elsewhere than the disk: returns why it cannot be read or empty, or
/// nothing where the file is to be read from the disk. Null: all are.
using FileReader =
    std::function<std::optional<std::string>(const std::string& file, std::string* content)>;
void SetFileReader(FileReader reader);

/// The files that ReadTextFile has read, each once. A program does not write over its inputs,
/// including those that another file names.
std::vector<std::string> FilesRead();

/// The text after the byte-order mark of UTF-8, which some editors and spreadsheets write first.
std::string_view WithoutByteOrderMark(std::string_view text);

/// Why bytes are no text that the readers of CSV and JSON take, or empty: "line 3: expected text,
/// got a NUL byte", or that it is UTF-16 or UTF-32, by its byte-order mark or by the NUL bytes that
/// these have beside each letter.
std::string WhyNotText(std::string_view bytes);

/// The folder of a file as a prefix of relative paths: "a/b.json" gives "a/", "b.json" gives "".
std::string FolderOf(const std::string& file);

/// `path` itself when absolute or when folder is empty, else folder + path.
std::string JoinPath(const std::string& folder, const std::string& path);

/// The text as a terminal can show it on one line. Line breaks and tabs become spaces; other
/// control characters, characters that change the direction of writing, and bytes that are not
/// UTF-8 are written as \x1b, \u202e and \xff. The middle of a line of more than kMaxMessage bytes,
/// as written, is left out (…).
std::string OneLine(std::string_view text);

}  // namespace tangible
