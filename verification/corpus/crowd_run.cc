// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/crowd_run.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <numeric>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/math/cpu_time.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/verification/corpus/corpus_run.h"
#include "tangible/verification/corpus/crowd_scene.h"

namespace tangible::corpus {
namespace {

struct CrowdResult {
  RolloutReport report;
  std::vector<double> seconds;  // of each step
};

CrowdResult RunCrowd(const Scene& scene) {
  CrowdResult result;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  double last = ThreadCpuSeconds();
  const auto watch = [&](long, double, const State<double>&, Stepper*) {
    const double now = ThreadCpuSeconds();
    result.seconds.push_back(now - last);
    last = now;
  };
  result.report = Rollout(model, state, watch, &state);
  return result;
}

void AddTo(CrowdRow* row, const CrowdResult& result, const std::string& name) {
  const RolloutReport& report = result.report;
  ++row->scenes;
  row->steps += report.steps;
  row->contacts_max = std::max(row->contacts_max, report.contacts_max);
  if (report.status == StepStatus::kDone) {
    row->residual_max = std::max(row->residual_max, report.residual);
    return;
  }
  if (report.message.find("cannot yield") != std::string::npos) {
    ++row->crushed;
  } else {
    row->unsolved.push_back(name + ": " + report.message);
  }
}

}  // namespace

std::vector<CrowdRow> RunCrowds(const CrowdOptions& options) {
  const size_t kinds = CrowdKinds().size();
  std::vector<CrowdResult> results(kinds * static_cast<size_t>(options.scenes));
  WorkerPool pool(options.threads);
  std::atomic<long> done{0};
  pool.Run(results.size(), options.threads, [&](size_t i, int /*thread*/) {
    results[i] =
        RunCrowd(CrowdScene(options.seed, options.first + static_cast<int>(i / kinds),
                            static_cast<int>(i % kinds), options.most_bodies, options.steps));
    if (options.progress) options.progress(++done);
  });
  std::vector<CrowdRow> rows(kinds);
  for (size_t kind = 0; kind < kinds; ++kind) {
    CrowdRow& row = rows[kind];
    row.kind = CrowdKinds()[kind];
    std::vector<double> seconds;
    for (size_t i = kind; i < results.size(); i += kinds) {
      const std::string number = std::to_string(options.first + static_cast<int>(i / kinds));
      AddTo(&row, results[i], row.kind + " " + number);
      seconds.insert(seconds.end(), results[i].seconds.begin(), results[i].seconds.end());
    }
    if (seconds.empty()) continue;
    row.seconds_mean =
        std::accumulate(seconds.begin(), seconds.end(), 0.0) / static_cast<double>(seconds.size());
    const auto late = seconds.begin() + static_cast<std::ptrdiff_t>(0.99 * (seconds.size() - 1.0));
    std::nth_element(seconds.begin(), late, seconds.end());
    row.seconds_late = *late;
  }
  return rows;
}

std::string TableText(const std::vector<CrowdRow>& rows) {
  char line[256];
  std::snprintf(line, sizeof(line), "%-10s %7s %9s %9s %9s %9s %9s %8s %9s\n", "crowd", "scenes",
                "steps", "contacts", "residual", "ms/step", "99 %", "crushed", "unsolved");
  std::string text = line;
  for (const CrowdRow& row : rows) {
    std::snprintf(line, sizeof(line), "%-10s %7d %9ld %9d %9.0e %9.3f %9.3f %8d %9zu\n",
                  row.kind.c_str(), row.scenes, row.steps, row.contacts_max, row.residual_max,
                  1e3 * row.seconds_mean, 1e3 * row.seconds_late, row.crushed, row.unsolved.size());
    text += line;
  }
  for (const CrowdRow& row : rows) {
    for (const std::string& unsolved : row.unsolved) text += unsolved + "\n";
  }
  return text;
}

OrderedJson ToJson(const std::vector<CrowdRow>& rows) {
  OrderedJson json = OrderedJson::array();
  for (const CrowdRow& row : rows) {
    json.push_back({{"kind", row.kind},
                    {"scenes", row.scenes},
                    {"steps", row.steps},
                    {"contacts_max", row.contacts_max},
                    {"residual_max", row.residual_max},
                    {"seconds_mean", row.seconds_mean},
                    {"seconds_99_percent", row.seconds_late},
                    {"crushed", row.crushed},
                    {"unsolved", row.unsolved}});
  }
  return json;
}

std::string FirstFailure(const std::vector<CrowdRow>& rows) {
  for (const CrowdRow& row : rows) {
    if (!row.unsolved.empty()) return row.unsolved[0];
    if (!(row.residual_max <= kResidualBound)) {
      return row.kind + ": expected residuals of at most 1e-10, got larger ones";
    }
  }
  return "";
}

}  // namespace tangible::corpus
