// SPDX-License-Identifier: Apache-2.0
#include "layout_rules.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace tangible {
namespace {

constexpr int kMaxLines = 800;
constexpr std::size_t kMaxCommentWidth = 100;
constexpr char kSpdx[] = "// SPDX-License-Identifier: Apache-2.0";

bool StartsWith(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// What each module includes directly. `config` is seen by all, and a module sees what those see
/// that it includes. A folder of lib that is not listed is an error.
const std::map<std::string, std::set<std::string>>& DirectDependencies() {
  static const std::map<std::string, std::set<std::string>> direct = {
      {"math", {}},
      {"lcp/certificate", {"math"}},
      {"lcp/dense", {"lcp/certificate"}},
      {"lcp/system", {"math"}},
      {"lcp/contact", {"lcp/dense", "lcp/system"}},
      {"geometry", {"math"}},
      {"scene", {"math"}},
      {"dynamics/model", {"lcp/contact", "geometry", "scene"}},
      {"dynamics/elements", {"dynamics/model"}},
      {"dynamics/assembly", {"dynamics/elements"}},
      {"dynamics/jacobian", {"dynamics/assembly"}},
      {"simulation/events", {"dynamics/jacobian"}},
      {"simulation/islands", {"simulation/events"}},
      {"simulation/stepping", {"simulation/islands"}},
      {"simulation/derivatives", {"simulation/stepping"}},
      {"simulation/certificate", {"simulation/derivatives"}},
      {"simulation/gradient", {"simulation/certificate"}},
      {"control", {"simulation/gradient"}},
      {"render", {"simulation/gradient"}},
      {"tangible.h", {"control", "render"}},
      {"estimation/problem", {"control", "render"}},
      {"estimation/uncertainty", {"estimation/problem"}},
      {"estimation/fit", {"estimation/uncertainty"}},
      {"estimation/results", {"estimation/fit"}},
      {"estimation/experiments", {"estimation/results"}},
      {"estimation/app", {"estimation/experiments"}},
      {"estimation/vision", {"estimation/results"}},
      {"verification", {"estimation/experiments"}},
      // The one part of lib that sees estimation; nothing sees it.
      {"python", {"estimation/results"}}};
  return direct;
}

/// What each module sees directly or through others, itself aside.
const std::map<std::string, std::set<std::string>>& VisibleModules() {
  static const std::map<std::string, std::set<std::string>> all = [] {
    std::map<std::string, std::set<std::string>> visible = DirectDependencies();
    for (bool grows = true; grows;) {
      grows = false;
      for (auto& [module, seen] : visible) {
        for (const std::string& next : std::set<std::string>(seen)) {
          for (const std::string& further : visible[next]) {
            grows = seen.insert(further).second || grows;
          }
        }
      }
    }
    return visible;
  }();
  return all;
}

/// Programs, and the Python package, see what their folder sees, and what programs share (lib/app).
bool IsMain(const std::string& path) {
  return Contains(path, "/app/") || StartsWith(path, "lib/python/") ||
         (StartsWith(path, "verification/") && EndsWith(path, ".cc"));
}

/// The module of a header by its name behind "tangible/", or of a file of lib by its path behind
/// "lib/": its folder, or the first two where they are listed as a module, as lcp/dense is.
std::string ModuleOf(const std::string& file) {
  const std::size_t slash = file.find('/');
  const std::size_t second = slash == std::string::npos ? slash : file.find('/', slash + 1);
  const std::string two = second == std::string::npos ? "" : file.substr(0, second);
  return DirectDependencies().count(two) > 0 ? two : file.substr(0, slash);
}

/// Empty if the source `path` may include the header `name`, tangible/...
std::string WrongModule(const std::string& path, const std::string& name) {
  const std::string own = ModuleOf(StartsWith(path, "lib/") ? path.substr(4) : path);
  const std::string module = ModuleOf(name.substr(std::string("tangible/").size()));
  if (own == "tests" || module == own || module == "config") {
    return "";
  }
  if (module == "app") {
    return IsMain(path) ? "" : "only programs include tangible/app";
  }
  // The programs of lib see all of lib.
  const auto visible = VisibleModules().find(own == "app" ? "estimation/problem" : own);
  if (visible == VisibleModules().end()) {
    return "module " + own + " is not in the list of modules";
  }
  return visible->second.count(module) > 0 ? ""
                                           : "module " + own + " may not include module " + module;
}

/// Empty if `path` may include the header `name` of another project.
std::string WrongLibrary(const std::string& path, const std::string& name) {
  if (StartsWith(name, "ceres/") && StartsWith(path, "lib/") &&
      !(path == "lib/math/scalar.h" && name == "ceres/jet.h")) {
    return "lib sees of Ceres only ceres/jet.h, in lib/math/scalar.h";
  }
  if (StartsWith(name, "gflags/") && !IsMain(path)) {
    return "gflags belongs in programs";
  }
  // Another engine's binding is for comparison alone.
  if (StartsWith(name, "pybind11/") && !StartsWith(path, "lib/python/") &&
      !StartsWith(path, "verification/python/")) {
    return "pybind11 belongs in lib/python";
  }
  if (StartsWith(name, "torch/") && !StartsWith(path, "estimation/vision/") &&
      !StartsWith(path, "tests/estimation/vision/")) {
    return "torch belongs in estimation/vision";
  }
  return "";
}

std::string WrongQuoted(const std::string& path, const std::string& name) {
  if (StartsWith(name, "tangible/")) {
    std::string problem = WrongModule(path, name);
    if (problem.empty() && EndsWith(name, "_inl.h") && EndsWith(path, ".h") &&
        !EndsWith(path, "_inl.h")) {
      return "a header may not include an _inl.h";
    }
    return problem;
  }
  // tests/support, from the folder of a module or from one below it.
  const bool deep = std::count(path.begin(), path.end(), '/') > 2;
  if (StartsWith(path, "tests/") && (!Contains(name, "/") || StartsWith(name, "../support/") ||
                                     (deep && StartsWith(name, "../../support/")))) {
    return "";
  }
  return "headers of the project are included as \"tangible/<module>/<file>.h\"";
}

/// Why `path` may not have this line; empty if it may, or if it is no include.
std::string WrongInclude(const std::string& path, const std::string& line) {
  std::istringstream words(line);
  std::string directive;
  std::string name;
  words >> directive;
  if (directive == "#") {
    words >> name;
    directive += name;
  }
  if (directive != "#include" || !(words >> name) || name.size() < 3) {
    return "";
  }
  const std::string inside = name.substr(1, name.size() - 2);
  std::string problem = WrongLibrary(path, inside);
  if (problem.empty() && name.front() == '"') {
    problem = WrongQuoted(path, inside);
  } else if (problem.empty() && StartsWith(inside, "tangible/") && StartsWith(path, "lib/")) {
    problem = "headers of the project are included in quotes";
  }
  return problem.empty() ? "" : inside + ": " + problem;
}

/// A comment that has a line to itself: how far its text is indented behind the slashes, the text,
/// and the width of the whole line. No text: not such a comment, or an empty one.
struct CommentLine {
  std::size_t indent = 0;
  std::size_t width = 0;
  std::string text;
};

/// Characters, without the combining ones (U+0300 to U+036F), of a text in UTF-8.
std::size_t Width(const std::string& text) {
  std::size_t width = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool continues = (byte & 0xC0) == 0x80;
    const bool combines = byte == 0xCC || (byte == 0xCD && i + 1 < text.size() &&
                                           static_cast<unsigned char>(text[i + 1]) < 0xB0);
    width += continues || combines ? 0 : 1;
  }
  return width;
}

CommentLine ReadComment(const std::string& line) {
  CommentLine comment;
  const std::size_t slashes = line.find_first_not_of(' ');
  if (slashes == std::string::npos || line.compare(slashes, 2, "//") != 0) {
    return comment;
  }
  const std::size_t behind = line.find_first_not_of('/', slashes);
  const std::size_t text =
      behind == std::string::npos ? behind : line.find_first_not_of(' ', behind);
  if (text != std::string::npos) {
    comment = {text - behind, Width(line), line.substr(text)};
  }
  return comment;
}

/// Whether `line` may be the rest of a line that a formatter found too long: its first word has no
/// room on the line before.
bool TakesUp(const CommentLine& before, const CommentLine& line) {
  const std::string word = line.text.substr(0, line.text.find(' '));
  return !before.text.empty() && !line.text.empty() &&
         before.width + 1 + Width(word) > kMaxCommentWidth;
}

/// What is wrong with `line` between its neighbours; empty if nothing.
std::string WrongComment(const CommentLine& before, const CommentLine& line,
                         const CommentLine& after) {
  constexpr std::size_t kDisplayIndent = 3;
  if (line.width > kMaxCommentWidth) {
    return "a comment of more than " + std::to_string(kMaxCommentWidth) + " characters";
  }
  if (!TakesUp(before, line)) {
    return "";
  }
  if (before.indent == kDisplayIndent && line.indent == kDisplayIndent) {
    return "a displayed line that takes up the one before it: indent it, or shorten that one";
  }
  const bool ends = std::string(".,:;").find(line.text.back()) != std::string::npos;
  if (!ends && !after.text.empty() && after.indent > line.indent) {
    return "a wrapped line without punctuation before an indented one";
  }
  return "";
}

/// A number of lib or estimation that looks like a tolerance and is none.
struct NoTolerance {
  const char* path;
  const char* text;  // in its line
};
constexpr NoTolerance kNoTolerances[] = {
    // Defaults of the file format, which lib/scene/README.md lists.
    {"lib/scene/scene.h", "double joint_tolerance ="},
    {"lib/scene/scene.h", "double restitution_threshold ="},
    {"lib/scene/scene.h", "double contact_margin ="},
    {"lib/scene/scene.h", "double lcp_tolerance ="},
    // What Eigen asks of a scalar.
    {"lib/math/dual.h", "static Real dummy_precision()"},
    {"lib/math/dual.h", "static Real epsilon()"},
    // Rates of learning, and the bound of an example that stands alone.
    {"estimation/experiments/cartpole/learned_step.cc", "for (const double rate : {"},
    {"estimation/experiments/cartpole/perceptron.h", "double rate ="},
    {"estimation/vision/study.cc", "training.learning_rate ="},
    {"estimation/vision/training_options.h", "double learning_rate ="},
    {"estimation/vision/examples/learn_restitution.cc", "restitution.item<double>() - 0.8"},
};

/// The code of a line, without what stands in quotes and comments.
std::string CodeOf(const std::string& line) {
  std::string code;
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote == 0 && line.compare(i, 2, "//") == 0) {
      break;
    }
    if (quote != 0 && line[i] == '\\') {
      ++i;
    } else if (line[i] == '"') {
      quote = quote == 0 ? '"' : 0;
    } else if (quote == 0) {
      code += line[i];
    }
  }
  return code;
}

/// Whether a line of lib or estimation has a tolerance outside of a tolerances.h: a number with a
/// negative exponent, the unit of rounding, or a constant that calls itself a tolerance.
bool HasTolerance(const std::string& path, const std::string& line) {
  if (!(StartsWith(path, "lib/") || StartsWith(path, "estimation/")) ||
      EndsWith(path, "/tolerances.h") ||
      std::any_of(std::begin(kNoTolerances), std::end(kNoTolerances), [&](const NoTolerance& none) {
        return path == none.path && Contains(line, none.text);
      })) {
    return false;
  }
  static const std::regex kTolerance(
      "[0-9.]e-[0-9]|numeric_limits<double>::epsilon\\(\\)|DBL_EPSILON|"
      "constexpr double k\\w*(Rounding|Tolerance)\\w* *=");
  return std::regex_search(CodeOf(line), kTolerance);
}

}  // namespace

std::vector<std::string> CheckSource(const SourceFile& file) {
  std::vector<std::string> problems;
  std::istringstream lines(file.text);
  std::string line;
  int number = 0;
  bool has_pragma = false;
  CommentLine before_last, last;
  const auto report = [&](int at, const std::string& what) {
    problems.push_back(file.path + ":" + std::to_string(at) + ": " + what);
  };
  while (std::getline(lines, line)) {
    ++number;
    if (number == 1 && line != kSpdx) {
      report(1, "expected " + std::string(kSpdx));
    }
    has_pragma = has_pragma || line == "#pragma once";
    const std::string problem = WrongInclude(file.path, line);
    if (!problem.empty()) {
      report(number, problem);
    }
    if (HasTolerance(file.path, line)) {
      report(number, "a tolerance outside of its module's tolerances.h");
    }
    const CommentLine comment = ReadComment(line);
    const std::string wrong = WrongComment(before_last, last, comment);
    if (!wrong.empty()) {
      report(number - 1, wrong);
    }
    before_last = last;
    last = comment;
  }
  const std::string wrong = WrongComment(before_last, last, {});
  if (!wrong.empty()) {
    report(number, wrong);
  }
  if (number == 0) {
    report(1, "empty file");
  }
  if (EndsWith(file.path, ".h") && !has_pragma) {
    report(1, "expected #pragma once");
  }
  if (number > kMaxLines) {
    report(number, "more than " + std::to_string(kMaxLines) + " lines");
  }
  return problems;
}

std::vector<Tolerance> TolerancesOf(const std::string& header) {
  std::vector<Tolerance> tolerances;
  std::istringstream lines(header);
  for (std::string line; std::getline(lines, line);) {
    const std::string start = "inline constexpr double ";
    if (!StartsWith(line, start)) {
      continue;
    }
    for (std::string more; !Contains(line, ";") && std::getline(lines, more);) {
      line += ' ' + more.substr(more.find_first_not_of(' '));
    }
    const std::string name =
        line.substr(start.size(), line.find_first_of(" [", start.size()) - start.size());
    const std::size_t equals = line.find("= ");
    std::string value = line.substr(equals + 2, line.find(';') - equals - 2);
    value.erase(
        std::remove_if(value.begin(), value.end(), [](char c) { return c == '{' || c == '}'; }),
        value.end());
    // The table says ε for it.
    const std::string unit = "std::numeric_limits<double>::epsilon()";
    for (std::size_t at = value.find(unit); at != std::string::npos; at = value.find(unit)) {
      const std::size_t start_of_unit = at >= 2 && value[at - 2] == '*' ? at - 2 : at;
      value.replace(start_of_unit, at - start_of_unit + unit.size(), "ε");
    }
    tolerances.push_back({name, value});
  }
  return tolerances;
}

std::vector<std::string> UndocumentedTolerances(const std::string& header,
                                                const std::string& readme) {
  std::vector<std::string> missing;
  for (const Tolerance& tolerance : TolerancesOf(header)) {
    if (!Contains(readme, "| `" + tolerance.name + "` | " + tolerance.value + " |")) {
      missing.push_back(tolerance.name);
    }
  }
  return missing;
}

std::vector<std::string> NamesInTables(const std::string& readme) {
  std::vector<std::string> names;
  std::istringstream lines(readme);
  const std::string start = "| `k";
  for (std::string line; std::getline(lines, line);) {
    if (!StartsWith(line, start) || std::islower(line[start.size()]) != 0) continue;
    names.push_back(line.substr(start.size() - 1, line.find('`', start.size()) - start.size() + 1));
  }
  return names;
}

namespace {

/// What stands between backticks.
std::vector<std::string> Quoted(const std::string& text) {
  std::vector<std::string> quoted;
  for (std::size_t at = text.find('`'); at != std::string::npos; at = text.find('`', at + 1)) {
    const std::size_t end = text.find('`', at + 1);
    if (end == std::string::npos) {
      break;
    }
    quoted.push_back(text.substr(at + 1, end - at - 1));
    at = end;
  }
  return quoted;
}

std::vector<std::string> Cells(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream in(row);
  for (std::string cell; std::getline(in, cell, '|');) {
    cells.push_back(cell);
  }
  return cells;
}

/// A file of the table in full, after the file `last`.
std::string FullPath(const std::string& name, const std::string& last) {
  if (StartsWith(name, ".")) {
    return last.substr(0, last.rfind('.')) + name;
  }
  if (!Contains(name, "/")) {
    return last.substr(0, last.rfind('/') + 1) + name;
  }
  return StartsWith(name, "estimation/") ? name : "lib/" + name;
}

bool HasWord(const std::string& text, const std::string& word) {
  const auto is_part = [&](std::size_t i) {
    return i < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '_');
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    if ((at == 0 || !is_part(at - 1)) && !is_part(at + word.size())) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<std::string> WrongIndexRows(
    const std::string& readme, const std::function<std::string(const std::string& path)>& read) {
  std::vector<std::string> problems;
  std::istringstream lines(readme);
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    inside = StartsWith(line, "| equation |") || (inside && StartsWith(line, "|"));
    const std::vector<std::string> cells = Cells(line);
    if (!inside || cells.size() < 4) {
      continue;
    }
    std::string texts;
    std::string last;
    for (const std::string& name : Quoted(cells[2])) {
      if (name == "lib") {
        continue;  // the head of the table
      }
      last = FullPath(name, last);
      const std::string text = read(last);
      if (text.empty()) {
        problems.push_back(last + " does not exist:" + cells[1]);
      }
      texts += text;
    }
    for (const std::string& name : Quoted(cells[3])) {
      const std::size_t scope = name.rfind("::");
      if (!HasWord(texts, scope == std::string::npos ? name : name.substr(scope + 2))) {
        problems.push_back(name + " is in none of the files of the row" + cells[1]);
      }
    }
  }
  return problems;
}

std::vector<std::string> UnlistedHeaders(const std::string& cmake_lists,
                                         const std::vector<std::string>& headers) {
  const std::string call = "tangible_module(";
  std::size_t module = cmake_lists.find(call);
  if (module == std::string::npos) {
    return {};
  }
  const std::set<std::string> keywords = {"SOURCES", "DEPENDS", "LINK", "PRIVATE_LINK"};
  std::set<std::string> listed;
  for (; module != std::string::npos; module = cmake_lists.find(call, module + 1)) {
    const std::size_t begin = module + call.size();
    std::istringstream words(cmake_lists.substr(begin, cmake_lists.find(')', begin) - begin));
    std::string word;
    bool in_headers = false;
    while (words >> word) {
      if (word == "HEADERS" || keywords.count(word) > 0) {
        in_headers = word == "HEADERS";
      } else if (in_headers) {
        listed.insert(word);
      }
    }
  }
  std::vector<std::string> unlisted;
  for (const std::string& header : headers) {
    if (!EndsWith(header, "_inl.h") && listed.count(header) == 0) {
      unlisted.push_back(header);
    }
  }
  return unlisted;
}

}  // namespace tangible
