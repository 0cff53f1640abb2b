// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Solves every problem in every way, and checks each answer from the data (recomputed.h).

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tangible/verification/corpus/problem_folder.h"

namespace tangible::corpus {

/// Ways to solve a problem.
enum class Way {
  kContact,  ///< the solver of the engine's steps, from all contacts open
  kMisled,   ///< the same, from modes and impulses that are unrelated to the solution
  kGeneral,  ///< the general solver, on the dense one-sided form
};
const char* ToString(Way way);

/// The largest scaled residual of a solution.
inline constexpr double kResidualBound = 1e-10;
/// The least fraction of solved problems among those of Known::kHardlySolvable.
inline constexpr double kHardShare = 0.95;

struct RunOptions {
  int random = 0;           ///< problems of each kind
  std::uint64_t seed = 1;   ///< of their generator
  int first = 0;            ///< number of the first one
  std::string only{};       ///< only this kind; empty: all
  int most_contacts = 100;  ///< in one problem
  int most_dense = 30;      ///< contacts up to which the general solver takes part
  int threads = 1;
  std::function<void(long)> progress{};  ///< called with the number of finished problems
};

struct Answer {
  std::string kind, name;
  Known known = Known::kUnknown;
  Way way = Way::kGeneral;
  bool solved = false;      ///< the solver reports a solution
  bool infeasible = false;  ///< the solver reports infeasibility
  bool wrong = false;       ///< the data contradict the answer
  double residual = 0.0;    ///< recomputed, where a solution is reported
  std::string solver{};     ///< the part of the portfolio that solved it
  double seconds = 0.0;     ///< of CPU time

  /// Whether the answer agrees with what is known: solved, proved infeasible by the general solver,
  /// or not solved.
  bool right() const;
};

/// The results of one kind of problem by one way.
struct Row {
  std::string kind;
  Known known = Known::kUnknown;
  Way way = Way::kGeneral;
  int problems = 0, right = 0, wrong = 0;
  double residual_max = 0.0;
  double seconds_median = 0.0, seconds_max = 0.0;
  std::map<std::string, int> solvers{};
  std::vector<std::string> missed{};  ///< names of those not answered rightly
};

struct CorpusResult {
  std::vector<Row> rows;
  int problems = 0;
};

/// The kinds of random problems, in the order in which they are listed.
const std::vector<std::string>& RandomKinds();

/// Problems of files, and random ones.
CorpusResult RunCorpus(const std::vector<FileCase>& files, const RunOptions& options);

/// The first bound that does not hold as one line, or empty: no wrong answer; all solved, or 95 %
/// of those of Known::kHardlySolvable in each way; all infeasible ones proved.
std::string FirstFailure(const CorpusResult& result);

}  // namespace tangible::corpus
