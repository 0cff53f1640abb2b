// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/app/fit_shards.h"

#include <optional>
#include <utility>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/row_archive.h"

namespace tangible {
namespace {

/// How many rows a fit has: chains, starts, or profiles.
long RowsOf(const FitOptions& options, int chains) {
  if (chains > 0) return chains;
  return NumStarts(options) > 1 ? NumStarts(options) : static_cast<long>(options.profiles.size());
}

std::string NothingToDivide() {
  return "expected a fit with \"starts\" above 1, --profile or --posterior, as these are divided; "
         "got none of them";
}

/// The rows of a shard that are chains; what is wrong with the file or empty.
std::string WriteChains(const ChainsOfFit& chains, const Shard& shard, const std::string& out) {
  std::vector<int> numbers;
  for (long i = 0; i < shard.NumRows(chains.count); ++i) {
    numbers.push_back(static_cast<int>(shard.RowOf(i)));
  }
  std::vector<FinishedChain> made;
  if (!numbers.empty()) made = chains.make(numbers);
  OrderedJson json = {{"chains", OrderedJson::array()}};
  for (size_t i = 0; i < made.size(); ++i) {
    json["chains"].push_back({{"chain", numbers[i]},
                              {"draws", made[i].costs.size()},
                              {"divergences", made[i].divergences},
                              {"step", made[i].step}});
  }
  // Without an estimate there are no chains to take over.
  std::vector<std::optional<FinishedChain>> rows(numbers.size());
  for (size_t i = 0; i < made.size(); ++i) rows[i] = std::move(made[i]);
  json["shard"] = ShardJson(shard, chains.count, ToRows(rows));
  return WriteResult(out, JsonText(json));
}

/// What is said of the rows of a shard: where starts ended, and which profiles there are.
OrderedJson Told(const std::vector<std::optional<FinishedStart>>& starts,
                 const std::vector<std::optional<FinishedProfile>>& profiles,
                 const FitOptions& options, const Shard& shard) {
  OrderedJson json = {{"starts", OrderedJson::array()}, {"profiles", OrderedJson::array()}};
  for (size_t i = 0; i < starts.size(); ++i) {
    json["starts"].push_back({{"start", shard.RowOf(static_cast<long>(i))}});
    if (!starts[i]) continue;
    const FitStart& told = starts[i]->told;
    json["starts"].back().update({{"initial", told.initial},
                                  {"status", told.status},
                                  {"cost", told.cost},
                                  {"iterations", told.iterations},
                                  {"estimate", told.estimate}});
  }
  for (size_t i = 0; i < profiles.size(); ++i) {
    const size_t row = static_cast<size_t>(shard.RowOf(static_cast<long>(i)));
    json["profiles"].push_back({{"parameter", options.profiles[row]}});
    if (!profiles[i]) continue;
    json["profiles"].back()["points"] = profiles[i]->profile.points.size();
  }
  return json;
}

}  // namespace

std::string WriteFitShard(const FitOptions& options, const ChainsOfFit& chains,
                          const ShardPlan& plan, const std::string& out,
                          RecordingsProblem* problem) {
  const long rows_in_all = RowsOf(options, chains.count);
  if (rows_in_all == 0) return "--shard: " + NothingToDivide();
  if (chains.count > 0) return WriteChains(chains, plan.shard, out);
  const long rows = plan.shard.NumRows(rows_in_all);
  std::vector<std::optional<FinishedStart>> starts;
  std::vector<std::optional<FinishedProfile>> profiles;
  if (NumStarts(options) > 1) {
    std::vector<int> numbers;
    for (long i = 0; i < rows; ++i) numbers.push_back(static_cast<int>(plan.shard.RowOf(i)));
    starts = MakeStarts(options, problem, numbers);
  } else if (rows > 0) {
    std::vector<std::string> names;
    for (long i = 0; i < rows; ++i) {
      names.push_back(options.profiles[static_cast<size_t>(plan.shard.RowOf(i))]);
    }
    std::map<std::string, FinishedProfile> made = MakeProfiles(options, problem, {}, names);
    for (const std::string& name : names) {
      std::optional<FinishedProfile>& one = profiles.emplace_back();
      if (made.count(name) > 0) one = std::move(made[name]);
    }
  }
  OrderedJson json = Told(starts, profiles, options, plan.shard);
  std::vector<Json> kept = ToRows(starts);
  for (Json& row : ToRows(profiles)) kept.push_back(std::move(row));
  json["shard"] = ShardJson(plan.shard, rows_in_all, kept);
  return WriteResult(out, JsonText(json));
}

std::string MergeFitShards(const FitOptions& options, int chains, const ShardPlan& plan,
                           FitParts* parts) {
  const long rows_in_all = RowsOf(options, chains);
  if (rows_in_all == 0) return "--merge: " + NothingToDivide();
  MergedShards merged;
  std::string error = MergeShards(plan, rows_in_all, &merged);
  if (!error.empty()) return error;
  if (chains > 0) {
    std::vector<std::optional<FinishedChain>> made;
    if (!FromRows(merged.rows, &made, &error)) return error;
    for (size_t i = 0; i < made.size(); ++i) {
      if (made[i]) parts->chains[static_cast<int>(i)] = std::move(*made[i]);
    }
    return "";
  }
  if (NumStarts(options) > 1) {
    std::vector<std::optional<FinishedStart>> starts;
    if (!FromRows(merged.rows, &starts, &error)) return error;
    for (size_t i = 0; i < starts.size(); ++i) {
      if (starts[i]) parts->starts[static_cast<int>(i)] = std::move(*starts[i]);
    }
    return "";
  }
  std::vector<std::optional<FinishedProfile>> profiles;
  if (!FromRows(merged.rows, &profiles, &error)) return error;
  for (size_t i = 0; i < profiles.size(); ++i) {
    if (profiles[i]) parts->profiles[options.profiles[i]] = std::move(*profiles[i]);
  }
  return "";
}

}  // namespace tangible
