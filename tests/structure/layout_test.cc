// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "layout_rules.h"

namespace tangible {
namespace {

namespace fs = std::filesystem;

const fs::path kTop = TANGIBLE_SOURCE_DIR;
constexpr char kHead[] = "// SPDX-License-Identifier: Apache-2.0\n#pragma once\n";

std::string ReadText(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Every file of the source folders with one of the extensions, sorted.
std::vector<fs::path> Files(const std::set<std::string>& extensions) {
  std::vector<fs::path> files;
  for (const char* folder : {"lib", "estimation", "verification", "tests"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kTop / folder)) {
      if (entry.is_regular_file() && extensions.count(entry.path().extension().string()) > 0) {
        files.push_back(entry.path());
      }
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The number of problems of a file with these lines after its head.
std::size_t NumProblems(const std::string& path, const std::string& lines) {
  return CheckSource({path, kHead + lines}).size();
}

TEST(LayoutRules, ModulesSeeThoseBelow) {
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.h", "#include \"tangible/math/scalar.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/lcp/system/a.cc", "#include \"tangible/config/jet_widths.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/lcp/contact/a.cc", "#include \"tangible/lcp/dense/lemke.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/dynamics/model/a.h", "#include \"tangible/scene/scene.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/simulation/events/a.h", "#include \"tangible/scene/scene.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/simulation/stepping/a.h",
                        "#include \"tangible/simulation/events/event_step.h\"\n"),
            0U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include \"tangible/render/view.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include \"tangible/simulation/gradient/batch.h\"\n"), 0U);
  EXPECT_EQ(
      NumProblems("estimation/fit/a.cc", "#include \"tangible/estimation/problem/residual.h\"\n"),
      0U);
  EXPECT_EQ(NumProblems("estimation/app/a.cc", "#include \"tangible/app/program.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("estimation/app/a.cc", "#include \"tangible/estimation/fit/fit.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("verification/a.cc", "#include \"tangible/estimation/fit/fit.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("tests/app/a.cc", "#include \"tangible/verification/a.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/python/a.h", "#include <pybind11/numpy.h>\n"), 0U);
  EXPECT_EQ(NumProblems("lib/python/a.cc", "#include \"tangible/estimation/fit/fit.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/python/a.cc", "#include \"tangible/app/run_summary.h\"\n"), 0U);
}

TEST(LayoutRules, ModulesDoNotSeeThoseAbove) {
  EXPECT_EQ(NumProblems("lib/math/a.h", "#include \"tangible/lcp/dense/problem.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.h", "#include \"tangible/scene/scene.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.h", "#include \"tangible/lcp/system/block_lu.h\"\n"), 1U);
  EXPECT_EQ(
      NumProblems("lib/lcp/system/a.h", "#include \"tangible/lcp/contact/contact_solver.h\"\n"),
      1U);
  EXPECT_EQ(NumProblems("lib/scene/a.cc", "#  include \"tangible/geometry/shape.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/geometry/a.cc", "# include \"tangible/scene/scene.h\"\n"), 1U);
  EXPECT_EQ(
      NumProblems("lib/dynamics/model/a.h", "#include \"tangible/simulation/stepping/step.h\"\n"),
      1U);
  EXPECT_EQ(NumProblems("lib/dynamics/elements/a.h",
                        "#include \"tangible/dynamics/assembly/assembly.h\"\n"),
            1U);
  EXPECT_EQ(NumProblems("lib/simulation/events/a.h",
                        "#include \"tangible/simulation/stepping/step.h\"\n"),
            1U);
  EXPECT_EQ(NumProblems("lib/simulation/stepping/a.cc", "#include \"tangible/render/view.h\"\n"),
            1U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include \"tangible/estimation/fit/fit.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include \"tangible/python/binding.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("verification/a.cc", "#include \"tangible/python/binding.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/simulation/gradient/a.h", "#include <pybind11/numpy.h>\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/fit/a.cc", "#include \"tangible/verification/a.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/problem/a.cc", "#include \"tangible/estimation/fit/fit.h\"\n"),
            1U);
  EXPECT_EQ(NumProblems("estimation/fit/a.cc", "#include \"tangible/app/program.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/attic/a.cc", "#include \"tangible/math/scalar.h\"\n"), 1U);
}

TEST(LayoutRules, OtherLibrariesHaveTheirPlaces) {
  EXPECT_EQ(NumProblems("lib/math/scalar.h", "#include <ceres/jet.h>\n"), 0U);
  EXPECT_EQ(NumProblems("lib/math/scalar.h", "#include <ceres/ceres.h>\n"), 1U);
  EXPECT_EQ(NumProblems("lib/dynamics/model/a.h", "#include \"ceres/jet.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include <ceres/ceres.h>\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/fit/fit.cc", "#include <ceres/ceres.h>\n"), 0U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "#include <gflags/gflags.h>\n"), 0U);
  EXPECT_EQ(NumProblems("verification/a.cc", "#include <gflags/gflags.h>\n"), 0U);
  EXPECT_EQ(NumProblems("lib/simulation/stepping/a.cc", "#include <gflags/gflags.h>\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/fit/fit.cc", "#include <gflags/gflags.h>\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/vision/a.cc", "#include <torch/torch.h>\n"), 0U);
  EXPECT_EQ(NumProblems("estimation/fit/fit.cc", "#include <torch/torch.h>\n"), 1U);
}

TEST(LayoutRules, ProjectHeadersAreIncludedByTheirInstalledName) {
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "#include \"problem.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "#include \"../math/scalar.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "#include <tangible/math/scalar.h>\n"), 1U);
  EXPECT_EQ(NumProblems("tests/lcp/a.cc", "#include \"random_problem.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("tests/lcp/a.cc", "#include \"../support/counter.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("tests/lcp/a.cc", "#include \"../../support/counter.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("tests/lcp/b/a.cc", "#include \"../../support/counter.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("tests/lcp/a.cc", "#include \"../scene/helper.h\"\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "#include \"tangible/lcp/dense/a_inl.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/b_inl.h", "#include \"tangible/lcp/dense/a_inl.h\"\n"), 0U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/b.h", "#include \"tangible/lcp/dense/a_inl.h\"\n"), 1U);
}

TEST(LayoutRules, EveryFileHasItsHead) {
  EXPECT_EQ(CheckSource({"lib/math/a.cc", "// SPDX-License-Identifier: Apache-2.0\n"}).size(), 0U);
  EXPECT_EQ(CheckSource({"lib/math/a.cc", "int a;\n"}).size(), 1U);
  EXPECT_EQ(CheckSource({"lib/math/a.cc", ""}).size(), 1U);
  EXPECT_EQ(CheckSource({"lib/math/a.h", "// SPDX-License-Identifier: Apache-2.0\n"}).size(), 1U);
  EXPECT_EQ(NumProblems("lib/math/a.h", std::string(798, '\n')), 0U);
  EXPECT_EQ(NumProblems("lib/math/a.h", std::string(799, '\n')), 1U);
}

TEST(LayoutRules, EquationsInCommentsAreNotWrapped) {
  const auto problems = [](const std::string& lines) { return NumProblems("lib/math/a.h", lines); };
  // Equations that clang-format had reflowed into one another.
  EXPECT_EQ(
      problems("//   M v − Aᵀ y − Σ_contacts (nᵀ λn + tᵀ λt) = p                 momentum; M "
               "block diagonal plus\n"
               "//   dampers A v = b                                                  "
               "    joints s_n = n v + c_n ≥\n"
               "//   0,   λn ≥ 0,   s_n λn = 0                  each contact w = t v + c_t\n"),
      2U);
  EXPECT_EQ(problems("//   M v = p                momentum; M block diagonal plus dampers\n"
                     "//   A v = b                joints\n"),
            0U);
  // The rest of a row of a table is indented further.
  const std::string row = "//   spring  " + std::string(86, 'x') + "\n";
  EXPECT_EQ(problems(row + "//   its damping is implicit\n"), 1U);
  EXPECT_EQ(problems(row + "//           its damping is implicit\n"), 0U);
  // A word that a formatter has put between two lines of a list.
  const std::string item = "// 4. Lemke's method " + std::string(76, 'x') + "\n";
  EXPECT_EQ(problems(item + "// problems\n//    that are not proved infeasible\n"), 1U);
  EXPECT_EQ(problems(item + "// problems:\n//    that are not proved infeasible\n"), 0U);
  EXPECT_EQ(problems("// " + std::string(98, 'x') + "\n"), 1U);
  EXPECT_EQ(problems("// " + std::string(97, 'x') + "\n"), 0U);
  EXPECT_EQ(problems("// λ̇" + std::string(96, 'x') + "\n"), 0U);
}

TEST(LayoutRules, TolerancesHaveAHeaderAndATable) {
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "if (x < 1e-9) {}\n"), 1U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/a.cc", "if (x < 1e9) {}  // not 1e-9\n"), 0U);
  EXPECT_EQ(NumProblems("lib/geometry/a.cc", "if (x < 1.5e-9) {}\n"), 1U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "Print(\"a \\\"--tolerance=1e-9\"); // 1e-9\n"), 0U);
  EXPECT_EQ(NumProblems("lib/app/a.cc", "Print(\"a\", 1e-9);\n"), 1U);
  EXPECT_EQ(NumProblems("lib/dynamics/a.cc", "x = 4.0 * std::numeric_limits<double>::epsilon();\n"),
            1U);
  EXPECT_EQ(NumProblems("lib/dynamics/a.cc", "constexpr double kFarTolerance = 0.01;\n"), 1U);
  EXPECT_EQ(NumProblems("lib/scene/scene.h", "double contact_margin = 1e-4;\n"), 0U);
  EXPECT_EQ(NumProblems("lib/scene/scene.cc", "double contact_margin = 1e-4;\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/fit/a.cc", "if (x < 1e-9) {}\n"), 1U);
  EXPECT_EQ(NumProblems("estimation/fit/tolerances.h", "inline constexpr double kA = 1e-9;\n"), 0U);
  EXPECT_EQ(NumProblems("verification/a.cc", "if (x < 1e-9) {}\n"), 0U);
  EXPECT_EQ(NumProblems("lib/lcp/dense/tolerances.h", "inline constexpr double kA = 1e-9;\n"), 0U);
  const std::string header =
      "inline constexpr double kA = 1e-9;\n"
      "inline constexpr double kB[] = {1e-6, 1e-9};\n";
  EXPECT_TRUE(UndocumentedTolerances(header, "| `kA` | 1e-9 |\n| `kB` | 1e-6, 1e-9 |\n").empty());
  EXPECT_TRUE(UndocumentedTolerances(
                  "inline constexpr double kA = 4.0 * std::numeric_limits<double>::epsilon();\n"
                  "inline constexpr double kB = std::numeric_limits<double>::epsilon();\n",
                  "| `kA` | 4.0 ε |\n| `kB` | ε |\n")
                  .empty());
  EXPECT_EQ(UndocumentedTolerances(header, "| `kA` | 1e-8 |\n| `kB` | 1e-6, 1e-9 |\n"),
            (std::vector<std::string>{"kA"}));
  EXPECT_EQ(
      NamesInTables(
          "| name | of `kC` |\n| `kinematic` | x |\n| `kA` | 1e-8 |\nx\n| `kBc` | of `kA` |\n"),
      (std::vector<std::string>{"kA", "kBc"}));
}

TEST(LayoutRules, RowsOfTheIndexNameWhatIsThere) {
  const auto read = [](const std::string& path) {
    return path == "lib/a/b.h" || path == "lib/a/b.cc" || path == "estimation/c.h" ? "Solve(x)"
                                                                                   : "";
  };
  const auto problems = [&](const std::string& row) {
    return WrongIndexRows("| equation | file, below `lib` | function |\n|---|---|---|\n" + row,
                          read)
        .size();
  };
  EXPECT_EQ(problems("| x | `a/b.h`, `.cc` | `A::Solve` |\n"), 0U);
  EXPECT_EQ(problems("| x | `a/b.h`, `b.cc`; `estimation/c.h` | `Solve` |\n"), 0U);
  EXPECT_EQ(problems("| x | `a/d.h` | `Solve` |\n"), 2U);
  EXPECT_EQ(problems("| x | `a/b.h` | `Solv` |\n"), 1U);
  EXPECT_EQ(problems("| x | `a/b.h` | `Solve` |\n\n| y | `z` | `w` |\n"), 0U);
}

TEST(LayoutRules, EveryHeaderOfAModuleIsInstalled) {
  const std::string lists =
      "tangible_module(lcp\n  SOURCES a.cc\n  HEADERS a.h sub/b.h\n  DEPENDS c.h)\nother(HEADERS "
      "d.h)\n";
  EXPECT_TRUE(UnlistedHeaders(lists, {"a.h", "sub/b.h", "a_inl.h"}).empty());
  EXPECT_EQ(UnlistedHeaders(lists, {"a.h", "c.h", "d.h"}),
            (std::vector<std::string>{"c.h", "d.h"}));
  EXPECT_TRUE(UnlistedHeaders("add_library(app a.cc)", {"a.h"}).empty());
  EXPECT_EQ(UnlistedHeaders("tangible_module(lcp)", {"a.h"}).size(), 1U);
}

TEST(Layout, EverySource) {
  const std::vector<fs::path> files = Files({".h", ".cc"});
  ASSERT_GT(files.size(), 10U);
  for (const fs::path& path : files) {
    const std::string relative = path.lexically_relative(kTop).generic_string();
    for (const std::string& problem : CheckSource({relative, ReadText(path)})) {
      ADD_FAILURE() << problem;
    }
  }
}

/// The README with the table of a tolerances.h: in lib that of the module, in estimation the
/// nearest one above the header.
fs::path ReadmeOfTolerances(const fs::path& header) {
  if (*header.begin() == "lib") {
    return fs::path("lib") / *std::next(header.begin()) / "README.md";
  }
  fs::path folder = header.parent_path();
  while (!folder.empty() && !fs::exists(kTop / folder / "README.md")) {
    folder = folder.parent_path();
  }
  return folder / "README.md";
}

TEST(Layout, EveryToleranceStandsInTheTable) {
  int headers = 0;
  std::map<std::string, fs::path> headers_of;
  std::set<fs::path> tables;
  for (const fs::path& path : Files({".h"})) {
    const fs::path header = path.lexically_relative(kTop);
    if (header.filename() != "tolerances.h") {
      continue;
    }
    ++headers;
    const fs::path table = ReadmeOfTolerances(header);
    tables.insert(table);
    const std::string text = ReadText(path);
    const std::vector<Tolerance> tolerances = TolerancesOf(text);
    ASSERT_FALSE(tolerances.empty()) << header;
    for (const std::string& name : UndocumentedTolerances(text, ReadText(kTop / table))) {
      ADD_FAILURE() << name << " of " << header << " has no row with its value in " << table;
    }
    for (const Tolerance& tolerance : tolerances) {
      const auto [first, is_new] = headers_of.emplace(tolerance.name, header);
      EXPECT_TRUE(is_new) << tolerance.name << " stands in " << first->second << " and in "
                          << header;
    }
  }
  for (const fs::path& table : tables) {
    for (const std::string& name : NamesInTables(ReadText(kTop / table))) {
      EXPECT_EQ(headers_of.count(name), 1U)
          << table << " has a row for " << name << ", which no tolerances.h has";
    }
  }
  EXPECT_GE(headers, 20);
}

TEST(Layout, TheIndexOfEquations) {
  // A name with * is all files that begin and end like it.
  const auto read = [](const std::string& path) {
    const std::size_t star = path.find('*');
    if (star == std::string::npos) return fs::exists(kTop / path) ? ReadText(kTop / path) : "";
    const std::size_t name = path.rfind('/') + 1;
    const std::string start = path.substr(name, star - name);
    const std::string end = path.substr(star + 1);
    std::string texts;
    for (const fs::directory_entry& entry : fs::directory_iterator(kTop / path.substr(0, name))) {
      const std::string file = entry.path().filename().string();
      if (file.rfind(start, 0) == 0 && file.size() > end.size() &&
          file.compare(file.size() - end.size(), end.size(), end) == 0) {
        texts += ReadText(entry.path());
      }
    }
    return texts;
  };
  const std::string readme = ReadText(kTop / "lib/README.md");
  ASSERT_NE(readme.find("| equation |"), std::string::npos);
  for (const std::string& problem : WrongIndexRows(readme, read)) {
    ADD_FAILURE() << problem;
  }
}

TEST(Layout, EveryHeaderIsInstalled) {
  std::map<fs::path, std::vector<std::string>>
      headers;  // by the folder of the CMakeLists.txt in charge
  for (const fs::path& path : Files({".h"})) {
    fs::path folder = path.parent_path();
    while (folder != kTop && !fs::exists(folder / "CMakeLists.txt")) {
      folder = folder.parent_path();
    }
    headers[folder].push_back(path.lexically_relative(folder).generic_string());
  }
  ASSERT_GE(headers.size(), 4U);
  for (const auto& [folder, names] : headers) {
    for (const std::string& name : UnlistedHeaders(ReadText(folder / "CMakeLists.txt"), names)) {
      ADD_FAILURE() << (folder / name) << " is not in HEADERS of its tangible_module";
    }
  }
}

TEST(Layout, TopLevelHasWhatIsAgreed) {
  const std::set<std::string> agreed = {
      "CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "lib",
      "estimation",     "verification",      "tests",     "data"};
  for (const fs::directory_entry& entry : fs::directory_iterator(kTop)) {
    const std::string name = entry.path().filename().string();
    const bool is_output =
        name.rfind("build", 0) == 0 || name == "out" || name == "compile_commands.json";
    EXPECT_TRUE(name.front() == '.' || is_output || agreed.count(name) > 0) << name;
  }
}

}  // namespace
}  // namespace tangible
