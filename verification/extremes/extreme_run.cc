// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

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

CaseResult RunCase(const ExtremeCase& extreme_case, Length length) {
  CaseResult result;
  result.group = extreme_case.group;
  result.name = extreme_case.name;
  result.stepping = extreme_case.stepping;
  result.known_reason = extreme_case.known_reason;
  cost::Budget budget;
  budget.seconds = extreme_case.seconds * (length == Length::kLong ? kLongFactor : 1.0);
  budget.bytes = kBytes;
  const auto start = std::chrono::steady_clock::now();
  const cost::ChildOutcome outcome = cost::RunTextInChild(
      budget,
      [&](const cost::ChildLimits&, std::string*) { return Serialise(extreme_case.run(length)); });
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.message = WhyNot(outcome, budget);
  if (result.message.empty() && !Deserialise(outcome.text, &result.finding)) {
    result.message = "ended without a result";
  }
  return result;
}

std::vector<CaseResult> RunCases(const std::vector<ExtremeCase>& cases, const RunOptions& options,
                                 const std::function<void(long done)>& progress) {
  std::vector<CaseResult> results(cases.size());
  std::atomic<size_t> next{0};
  std::mutex mutex;
  long done = 0;
  const auto work = [&] {
    for (size_t i = next++; i < cases.size(); i = next++) {
      results[i] = RunCase(cases[i], options.length);
      const std::lock_guard<std::mutex> lock(mutex);
      ++done;
      if (progress) progress(done);
    }
  };
  std::vector<std::thread> others;
  for (int i = 1; i < options.threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
  return results;
}

}  // namespace tangible::extremes
