// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The rules of the source tree: which module may include which, and what every file has.
//
// The checks work on texts, so that tests can plant violations.

#include <functional>
#include <string>
#include <vector>

namespace tangible {

/// A file: path relative to the top of the tree, with forward slashes.
struct SourceFile {
  std::string path;
  std::string text;
};

/// What a file breaks, one line each, "path:line: what"; empty if nothing:
///  - an include of a module that its own module may not see;
///  - ceres in lib other than ceres/jet.h in lib/math/scalar.h; gflags outside mains; torch outside
///    estimation/vision;
///  - a quoted include that is not "tangible/..." (within tests also a header of the same folder
///    or of tests/support);
///  - an `_inl.h` included by a header that is not one itself;
///  - a first line that is not the SPDX tag; a header without `#pragma once`;
///  - a comment line of more than 100 characters;
///  - an equation or a table in a comment that a formatter has wrapped like running text: a line
///    indented by three spaces that begins with a word for which the line before it had no room, or
///    a wrapped line without punctuation before a line that is indented further;
///  - in lib and estimation, outside of a tolerances.h: a number with a negative exponent, the unit
///    of rounding, or a constant named Rounding or Tolerance, but for a list of what is none;
///  - more than 800 lines.
std::vector<std::string> CheckSource(const SourceFile& file);

/// A constant of a tolerances.h, its value as the README's table has it: ε is the unit of rounding.
struct Tolerance {
  std::string name;
  std::string value;
};

std::vector<Tolerance> TolerancesOf(const std::string& header);

/// The names of those of a tolerances.h that are not in a row of the README's table.
std::vector<std::string> UndocumentedTolerances(const std::string& header,
                                                const std::string& readme);

/// The names that rows of a README's tables begin with, "| `kName` | ...".
std::vector<std::string> NamesInTables(const std::string& readme);

/// What is wrong with the rows of the table "equation | file | function" of lib/README.md: a file
/// that `read` knows no text of, or a function or class that none of the row's files has. In the
/// table `.cc` stands for the last file's name with that extension, a file without a folder is in
/// the last one's, and one without `estimation/` is below lib.
std::vector<std::string> WrongIndexRows(
    const std::string& readme, const std::function<std::string(const std::string& path)>& read);

/// The headers (paths relative to the folder of the CMakeLists.txt) that tangible_module(...) does
/// not list under HEADERS. Empty if there is no tangible_module. `_inl.h` need not be listed.
std::vector<std::string> UnlistedHeaders(const std::string& cmake_lists,
                                         const std::vector<std::string>& headers);

}  // namespace tangible
