// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_run.h"

#include <algorithm>
#include <deque>

#include "tangible/verification/cost/child.h"

namespace tangible::extremes {
namespace {

constexpr double kLongFactor = 20.0;
constexpr size_t kBytes = 2ull << 30;

std::string WhyNot(const cost::ChildOutcome& outcome, const cost::Budget& budget) {
  switch (outcome.status) {
    case cost::ChildStatus::kOverSeconds:
      return "does not end within " + std::to_string(static_cast<long>(budget.seconds)) + " s";
    case cost::ChildStatus::kOverBytes:
      return "needs more than " + std::to_string(budget.bytes >> 20) + " MiB";
    case cost::ChildStatus::kFailed:
      return outcome.message.empty() ? "failed" : outcome.message;
    case cost::ChildStatus::kDone:
      break;
  }
  return "";
}

}  // namespace

const char* NameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return "holds";
    case Verdict::kKnown:
      return "known";
    case Verdict::kFailed:
      return "fails";
  }
  return "";
}

Verdict CaseResult::verdict() const {
  if (message.empty() && finding.holds()) return Verdict::kHolds;
  return known_reason.empty() ? Verdict::kFailed : Verdict::kKnown;
}

namespace {

// A case that runs in a child.
struct Running {
  size_t place;
  cost::Budget budget;
  cost::TextChild child;
};

Running Start(const std::vector<ExtremeCase>& cases, size_t place, Length length) {
  const ExtremeCase& extreme_case = cases[place];
  cost::Budget budget;
  budget.seconds = extreme_case.seconds * (length == Length::kLong ? kLongFactor : 1.0);
  budget.bytes = kBytes;
  return {place, budget, cost::TextChild(budget, [&](const cost::ChildLimits&, std::string*) {
            return Serialise(extreme_case.run(length));
          })};
}

CaseResult Finish(const ExtremeCase& extreme_case, Running* running) {
  CaseResult result;
  result.group = extreme_case.group;
  result.name = extreme_case.name;
  result.stepping = extreme_case.stepping;
  result.known_reason = extreme_case.known_reason;
  const cost::ChildOutcome outcome = running->child.Wait();
  result.seconds = outcome.cpu_seconds;
  result.message = WhyNot(outcome, running->budget);
  if (result.message.empty() && !Deserialise(outcome.text, &result.finding)) {
    result.message = "ended without a result";
  }
  return result;
}

}  // namespace

CaseResult RunCase(const ExtremeCase& extreme_case, Length length) {
  return RunCases({extreme_case}, {.length = length, .threads = 1}, nullptr)[0];
}

std::vector<CaseResult> RunCases(const std::vector<ExtremeCase>& cases, const RunOptions& options,
                                 const std::function<void(long done)>& progress) {
  std::vector<CaseResult> results(cases.size());
  std::deque<Running> running;
  const size_t most = static_cast<size_t>(std::max(1, options.threads));
  size_t next = 0;
  for (size_t done = 0; done < cases.size(); ++done) {
    while (next < cases.size() && running.size() < most) {
      running.push_back(Start(cases, next++, options.length));
    }
    Running& first = running.front();
    results[first.place] = Finish(cases[first.place], &first);
    running.pop_front();
    if (progress) progress(static_cast<long>(done + 1));
  }
  return results;
}

}  // namespace tangible::extremes
