// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit_parts.h"

#include <algorithm>
#include <utility>

#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {

FitPartLogs::FitPartLogs(FitParts* parts) : parts_(parts) {}

FitPartLogs::~FitPartLogs() = default;

FitLog* FitPartLogs::Next() {
  if (!logs_.empty()) parts_->starts.clear();
  FitLog& log = logs_.emplace_back();
  log.parts = parts_;
  return &log;
}

int NumStarts(const FitOptions& options) { return std::max(1, options.starts); }

std::map<std::string, FinishedProfile> MakeProfiles(const FitOptions& options,
                                                    RecordingsProblem* problem,
                                                    std::map<int, FinishedStart> starts,
                                                    const std::vector<std::string>& names) {
  FitParts parts;
  parts.starts = std::move(starts);
  parts.is_wanted = [&names](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  // What else is found out about the estimate changes none of them.
  FitOptions search = options;
  search.certificate = CertificatePass::kSkip;
  search.held_test = HeldTest::kSkip;
  search.profile_pass = ProfilePass::kSkip;
  FitPartLogs logs(&parts);
  VarianceComponents components;
  FitWithComponents(search, problem, {}, &components, [&logs] { return logs.Next(); });
  return std::move(parts.made);
}

}  // namespace tangible
