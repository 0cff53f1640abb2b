// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/corpus_report.h"

#include <cstdio>

namespace tangible::corpus {
namespace {

constexpr size_t kMostNames = 8;

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

std::string Solvers(const Row& row) {
  std::string list;
  for (const auto& [solver, count] : row.solvers) {
    list += (list.empty() ? "" : ", ") + solver + " " + std::to_string(count);
  }
  return list;
}

const char* ToString(Known known) {
  switch (known) {
    case Known::kSolvable:
      return "solvable";
    case Known::kHardlySolvable:
      return "solvable, hard";
    case Known::kInfeasible:
      return "infeasible";
    case Known::kUnsolvable:
      return "no solution";
    case Known::kUnknown:
      break;
  }
  return "not known";
}

}  // namespace

std::string TableText(const CorpusResult& result) {
  std::string text = Format("%-20s %-8s %8s %6s %6s %9s %9s %9s  %s\n", "kind", "way", "problems",
                            "right", "wrong", "residual", "median", "longest", "solver");
  int answers = 0, right = 0, wrong = 0;
  for (const Row& row : result.rows) {
    text += Format("%-20s %-8s %8d %6d %6d %9.0e %6.2f ms %6.0f ms  %s\n", row.kind.c_str(),
                   corpus::ToString(row.way), row.problems, row.right, row.wrong, row.residual_max,
                   1e3 * row.seconds_median, 1e3 * row.seconds_max, Solvers(row).c_str());
    answers += row.problems;
    right += row.right;
    wrong += row.wrong;
  }
  for (const Row& row : result.rows) {
    if (row.missed.empty()) continue;
    text += "not right, " + row.kind + ", " + corpus::ToString(row.way) + ":";
    for (size_t i = 0; i < row.missed.size() && i < kMostNames; ++i) {
      text += (i == 0 ? " " : ", ") + row.missed[i];
    }
    text += row.missed.size() > kMostNames ? ", ...\n" : "\n";
  }
  return text + Format("%d problems, %d answers: %d right, %d wrong, %d not found\n",
                       result.problems, answers, right, wrong, answers - right - wrong);
}

OrderedJson ToJson(const CorpusResult& result) {
  OrderedJson rows = OrderedJson::array();
  for (const Row& row : result.rows) {
    OrderedJson solvers = OrderedJson::object();
    for (const auto& [solver, count] : row.solvers) solvers[solver] = count;
    rows.push_back({{"kind", row.kind},
                    {"known", ToString(row.known)},
                    {"way", corpus::ToString(row.way)},
                    {"problems", row.problems},
                    {"right", row.right},
                    {"wrong", row.wrong},
                    {"residual_max", row.residual_max},
                    {"seconds_median", row.seconds_median},
                    {"seconds_max", row.seconds_max},
                    {"solver", solvers},
                    {"missed", row.missed}});
  }
  return {{"problems", result.problems}, {"rows", rows}};
}

}  // namespace tangible::corpus
