// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/corpus_run.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <random>
#include <utility>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/lcp/dense/solver.h"
#include "tangible/math/cpu_time.h"
#include "tangible/math/median.h"
#include "tangible/verification/corpus/plain_case.h"
#include "tangible/verification/corpus/recomputed.h"

namespace tangible::corpus {
namespace {

void JudgeSolved(double residual, Answer* answer) {
  answer->residual = residual;
  answer->wrong = !(residual <= kResidualBound) || answer->known == Known::kInfeasible ||
                  answer->known == Known::kUnsolvable;
}

// `contacts`: the contact problem of which the problem is the one-sided form; its residual then
// counts too.
Answer ByGeneral(const std::string& kind, const std::string& name, Known known,
                 const MixedLcp<double>& problem, const ContactProblem<double>* contacts) {
  Answer answer{.kind = kind, .name = name, .known = known, .way = Way::kGeneral};
  const double start = ThreadCpuSeconds();
  const LcpSolution<double> solution = SolveLcp(problem);
  answer.seconds = ThreadCpuSeconds() - start;
  answer.solver = ToString(solution.solver);
  answer.solved = solution.status == LcpStatus::kSolved;
  answer.infeasible = solution.status == LcpStatus::kInfeasible;
  if (answer.solved) {
    double residual = RecomputedResidual(problem, solution.v, solution.y, solution.z);
    if (contacts != nullptr) {
      residual =
          std::max(residual, RecomputedResidual(*contacts, FromOneSided(*contacts, solution)));
    }
    JudgeSolved(residual, &answer);
  }
  if (answer.infeasible) {
    answer.solver = "farkas";
    answer.wrong = known == Known::kSolvable || known == Known::kHardlySolvable ||
                   !ProvesInfeasible(problem, solution.farkas);
  }
  return answer;
}

ContactSolution<double> Guess(const ContactProblem<double>& problem, Way way, std::uint64_t seed) {
  const size_t contacts = problem.contacts.size();
  ContactSolution<double> guess;
  guess.motion.assign(problem.mass.size(), 0.0);
  guess.joint_impulse.assign(3 * problem.joints.size(), 0.0);
  guess.normal_impulse.assign(contacts, 0.0);
  guess.tangent_impulse.assign(contacts, 0.0);
  guess.modes.assign(contacts, ContactMode::kOpen);
  if (way == Way::kContact) return guess;
  std::mt19937_64 random(seed);
  const auto draw = [&] { return 2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0; };
  for (size_t i = 0; i < contacts; ++i) {
    constexpr ContactMode kModes[] = {ContactMode::kOpen, ContactMode::kSticking,
                                      ContactMode::kSlidingPositive, ContactMode::kSlidingNegative};
    guess.modes[i] = kModes[random() % 4];
    if (guess.modes[i] == ContactMode::kOpen) continue;
    if (!problem.contacts[i].has_friction) guess.modes[i] = ContactMode::kClosed;
    guess.normal_impulse[i] = 100.0 * std::abs(draw());
    if (problem.contacts[i].has_friction) guess.tangent_impulse[i] = 100.0 * draw();
  }
  return guess;
}

Answer ByContacts(const ContactCase& one, Way way, std::uint64_t seed) {
  Answer answer{.kind = one.kind, .name = one.name, .known = one.known, .way = way};
  ContactSolution<double> solution = Guess(one.problem, way, seed);
  ContactSolver solver;
  const double start = ThreadCpuSeconds();
  const ContactSolverReport report = solver.Solve(one.problem, {}, &solution);
  answer.seconds = ThreadCpuSeconds() - start;
  answer.solver = NameOf(report.rung);
  answer.solved = report.solved;
  if (answer.solved) JudgeSolved(RecomputedResidual(one.problem, solution), &answer);
  return answer;
}

std::vector<Answer> ByAll(const std::string& kind, int index, const RunOptions& options) {
  if (kind == kSmallIntegers) {
    const PlainCase one = MakeSmallIntegers(options.seed, index);
    return {ByGeneral(kind, one.name, Known::kHardlySolvable, one.problem, nullptr)};
  }
  const ContactCase one = MakeContactCase(kind, options.seed, index, options.most_contacts);
  std::vector<Answer> answers = {ByContacts(one, Way::kContact, 0),
                                 ByContacts(one, Way::kMisled, options.seed + index)};
  if (static_cast<int>(one.problem.contacts.size()) <= options.most_dense) {
    answers.push_back(
        ByGeneral(kind, one.name, one.known, OneSidedForm(one.problem), &one.problem));
  }
  return answers;
}

void Add(const Answer& answer, Row* row) {
  ++row->problems;
  row->right += answer.right() ? 1 : 0;
  row->wrong += answer.wrong ? 1 : 0;
  if (answer.solved) row->residual_max = std::max(row->residual_max, answer.residual);
  row->seconds_max = std::max(row->seconds_max, answer.seconds);
  ++row->solvers[answer.solver];
  if (!answer.right()) row->missed.push_back(answer.name);
}

// Rows in the order in which their kinds come, the ways of a kind together.
std::vector<Row> Collect(const std::vector<std::vector<Answer>>& answers) {
  std::vector<Row> rows;
  std::vector<std::vector<double>> seconds;
  for (const std::vector<Answer>& of_problem : answers) {
    for (const Answer& answer : of_problem) {
      size_t at = 0;
      while (at < rows.size() && (rows[at].kind != answer.kind || rows[at].way != answer.way)) ++at;
      if (at == rows.size()) {
        rows.push_back({.kind = answer.kind, .known = answer.known, .way = answer.way});
        seconds.emplace_back();
      }
      Add(answer, &rows[at]);
      seconds[at].push_back(answer.seconds);
    }
  }
  for (size_t i = 0; i < rows.size(); ++i) rows[i].seconds_median = UpperMedian(seconds[i]);
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.kind == b.kind && a.way < b.way; });
  return rows;
}

}  // namespace

const char* ToString(Way way) {
  return way == Way::kContact ? "contact" : way == Way::kMisled ? "misled" : "general";
}

bool Answer::right() const {
  if (wrong) return false;
  switch (known) {
    case Known::kSolvable:
    case Known::kHardlySolvable:
      return solved;
    case Known::kInfeasible:
      return way == Way::kGeneral ? infeasible : !solved;
    case Known::kUnsolvable:
    case Known::kUnknown:
      break;
  }
  return true;
}

const std::vector<std::string>& RandomKinds() {
  static const std::vector<std::string> kKinds = [] {
    std::vector<std::string> kinds = ContactKinds();
    kinds.emplace_back(kSmallIntegers);
    return kinds;
  }();
  return kKinds;
}

CorpusResult RunCorpus(const std::vector<FileCase>& files, const RunOptions& options) {
  const std::vector<std::string> kinds =
      options.only.empty() ? RandomKinds() : std::vector<std::string>{options.only};
  const size_t total = files.size() + kinds.size() * static_cast<size_t>(options.random);
  std::vector<std::vector<Answer>> answers(total);
  std::mutex mutex;
  long done = 0;
  WorkerPool pool(options.threads);
  pool.Run(total, options.threads, [&](size_t i, int /*thread*/) {
    if (i < files.size()) {
      const FileCase& file = files[i];
      answers[i] = {ByGeneral(file.kind, file.name, file.known, file.problem, nullptr)};
    } else {
      const size_t k = i - files.size();
      const size_t each = static_cast<size_t>(options.random);
      answers[i] = ByAll(kinds[k / each], options.first + static_cast<int>(k % each), options);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (options.progress) options.progress(done);
  });
  return {Collect(answers), static_cast<int>(total)};
}

std::string FirstFailure(const CorpusResult& result) {
  struct Share {
    int right = 0, problems = 0;
    std::string missed{};
  };
  std::map<std::pair<double, Way>, Share> shares;  // with the requirement for each
  for (const Row& row : result.rows) {
    const std::string what = row.kind + ", " + ToString(row.way) + ": ";
    if (row.wrong > 0) {
      return what + "expected no wrong answer, got " + std::to_string(row.wrong) + ", first " +
             row.missed[0];
    }
    const double asked = row.known == Known::kHardlySolvable ? kHardShare : 1.0;
    if (asked == 1.0 && row.right < row.problems) {
      return what + "expected all, got " + std::to_string(row.right) + " of " +
             std::to_string(row.problems) + ", first without " + row.missed[0];
    }
    Share& share = shares[{asked, row.way}];
    share.right += row.right;
    share.problems += row.problems;
    if (share.missed.empty() && !row.missed.empty()) share.missed = row.missed[0];
  }
  for (const auto& [asked, share] : shares) {
    if (share.right < asked.first * share.problems) {
      return std::string(ToString(asked.second)) + ": expected " +
             std::to_string(std::lround(100.0 * asked.first)) + " % solved, got " +
             std::to_string(share.right) + " of " + std::to_string(share.problems) +
             ", first without " + share.missed;
    }
  }
  return "";
}

}  // namespace tangible::corpus
