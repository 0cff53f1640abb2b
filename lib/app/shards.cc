// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/shards.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "tangible/app/program.h"
#include "tangible/math/bit_hash.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

// More shards than these are a mistake.
constexpr long kMostShards = 1'000'000;
// Shards that one message names.
constexpr std::size_t kMostNamed = 10;

constexpr std::string_view kMark = "# shard ";

bool ReadCount(std::string_view text, long* value) {
  const std::from_chars_result read =
      std::from_chars(text.data(), text.data() + text.size(), *value);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() && *value >= 0;
}

/// Of each input, by its name, the hash of its content.
std::map<std::string, std::string>& HashesOfInputs() {
  static std::map<std::string, std::string> hashes;
  return hashes;
}

/// The flags that may change a result and are not at their defaults.
std::map<std::string, std::string> FlagsOfRun() {
  const ProgramInfo& info = ParsedProgram();
  const auto is_one_of = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  std::map<std::string, std::string> values;
  std::vector<gflags::CommandLineFlagInfo> flags;
  gflags::GetAllFlags(&flags);
  for (const gflags::CommandLineFlagInfo& flag : flags) {
    if (flag.filename != info.source_file || flag.current_value == flag.default_value ||
        flag.name == "shard" || flag.name == "merge" || is_one_of(info.outputs, flag.name) ||
        is_one_of(info.inputs, flag.name) || is_one_of(info.without_effect, flag.name)) {
      continue;
    }
    values[flag.name] = flag.current_value;
  }
  return values;
}

/// As JSON on one line; bytes that are no text are replaced.
template <typename AnyJson>
std::string LineOf(const AnyJson& json) {
  return json.dump(-1, ' ', false, AnyJson::error_handler_t::replace);
}

std::string HashOf(std::string_view text, const Json& rows) {
  BitHash hash;
  hash.Add(text);
  hash.Add(std::string_view(LineOf(rows)));
  return hash.Text();
}

/// "shard 1", "shards 1, 2 and 3", "shards 0, 1, ... (57)".
std::string NamesOf(const std::vector<long>& shards) {
  std::string names = shards.size() == 1 ? "shard " : "shards ";
  for (std::size_t i = 0; i < std::min(shards.size(), kMostNamed); ++i) {
    const bool last = i > 0 && i + 1 == shards.size();
    names += (i == 0 ? "" : last ? " and " : ", ") + std::to_string(shards[i]);
  }
  return shards.size() > kMostNamed ? names + ", ... (" + std::to_string(shards.size()) + ")"
                                    : names;
}

/// A file of --merge.
struct ShardFile {
  std::string name;
  std::string text;                                          ///< before "# shard"
  std::shared_ptr<Json> content = std::make_shared<Json>();  ///< of the key "shard"
  Shard shard;
};

/// The header and rows of a file; an error or empty.
std::string ReadShardFile(const std::string& name, ShardFile* file) {
  file->name = name;
  std::string error;
  if (!ReadTextFile(name, &file->text, &error)) return error;
  std::string none =
      name + ": expected a file that --shard wrote, got another one, or one that is cut off";
  Json json;
  const std::size_t begin = file->text.rfind("\n" + std::string(kMark));
  if (begin != std::string::npos && file->text.back() == '\n') {
    const std::string line = file->text.substr(begin + 1 + kMark.size());
    file->text.resize(begin + 1);
    if (!ParseJson(line, name, file->content.get(), &error)) return none;
  } else {
    if (!ParseJson(file->text, name, &json, &error) || !json.is_object() ||
        !json.contains("shard")) {
      return none;
    }
    file->text.clear();
    *file->content = std::move(json["shard"]);
  }
  if (!file->content->is_object()) return none;
  return "";
}

std::string Differs(const ShardFile& file, const std::string& what, const std::string& expected,
                    const std::string& got) {
  return file.name + ": /shard/" + what + ": expected " + expected + ", got " + got;
}

/// An error unless the flags are those of this run.
std::string CheckFlagsOf(const ShardFile& file) {
  const auto got = file.content->at("flags").get<std::map<std::string, std::string>>();
  const std::map<std::string, std::string> expected = FlagsOfRun();
  std::map<std::string, std::string> all = expected;
  all.insert(got.begin(), got.end());
  for (const auto& flag : all) {
    const std::string& name = flag.first;
    const auto value = [&name](const std::map<std::string, std::string>& values) {
      const auto found = values.find(name);
      return found == values.end() ? std::string("the default") : found->second;
    };
    if (value(expected) != value(got)) {
      return Differs(file, "flags/" + name, value(expected),
                     value(got) + ": a shard of another command line");
    }
  }
  return "";
}

/// An error unless the inputs have the content of those of this run; their names may differ.
std::string CheckInputsOf(const ShardFile& file) {
  const auto got = file.content->at("inputs").get<std::map<std::string, std::string>>();
  std::vector<std::string> hashes;
  for (const auto& [name, hash] : got) hashes.push_back(hash);
  for (const auto& [name, hash] : HashesOfInputs()) {
    const auto found = std::find(hashes.begin(), hashes.end(), hash);
    if (found == hashes.end()) {
      return Differs(file, "inputs", name + " as it is now",
                     "another content: a shard of other inputs");
    }
    hashes.erase(found);
  }
  if (hashes.empty()) return "";
  return Differs(file, "inputs", std::to_string(HashesOfInputs().size()) + " files",
                 std::to_string(got.size()) + ": a shard of other inputs");
}

/// An error unless the header is of this run, with as many shards as `first` has.
std::string CheckHeader(const ShardFile& first, long rows_in_all, ShardFile* file) {
  const Json& header = *file->content;
  const ProgramInfo& info = ParsedProgram();
  for (const auto& [what, expected] :
       {std::pair<std::string, std::string>("program", info.name), {"version", info.version}}) {
    const std::string got = header.at(what);
    if (got != expected) return Differs(*file, what, expected, got);
  }
  std::string error = CheckFlagsOf(*file);
  if (error.empty()) error = CheckInputsOf(*file);
  if (!error.empty()) return error;
  file->shard = {header.at("index"), header.at("of")};
  const Shard& shard = file->shard;
  if (shard.count != first.content->at("of").get<long>()) {
    return Differs(*file, "of", first.content->at("of").dump() + " as in " + first.name,
                   std::to_string(shard.count));
  }
  if (header.at("rows_in_all") != rows_in_all) {
    return Differs(*file, "rows_in_all", std::to_string(rows_in_all),
                   header.at("rows_in_all").dump());
  }
  const Json& rows = header.at("rows");
  if (shard.count < 1 || shard.index < 0 || shard.index >= shard.count || !rows.is_array() ||
      static_cast<long>(rows.size()) != shard.NumRows(rows_in_all) ||
      header.at("hash") != HashOf(file->text, rows)) {
    return file->name + ": /shard: damaged: its content is not what --shard wrote";
  }
  return "";
}

}  // namespace

std::string ReadShardFlags(const std::string& shard, const std::string& merge, ShardPlan* plan) {
  if (!shard.empty() && !merge.empty()) return "--shard: not with --merge";
  if (!merge.empty()) {
    plan->part = ShardPlan::Part::kMerge;
    plan->files = SplitAtCommas(merge);
    const bool empty = std::count(plan->files.begin(), plan->files.end(), "") > 0;
    return empty ? "--merge: expected files, separated by commas, got '" + merge + "'" : "";
  }
  if (shard.empty()) return "";
  plan->part = ShardPlan::Part::kShard;
  const std::size_t slash = shard.find('/');
  const std::string_view text = shard;
  if (slash == std::string::npos || !ReadCount(text.substr(0, slash), &plan->shard.index) ||
      !ReadCount(text.substr(slash + 1), &plan->shard.count) || plan->shard.count > kMostShards ||
      plan->shard.index >= plan->shard.count) {
    return "--shard: expected I/N with I from 0 to N - 1, got '" + shard + "'";
  }
  return "";
}

std::string ReadShardFlags(const std::string& shard, const std::string& merge,
                           const std::string& out, ShardPlan* plan) {
  std::string wrong = ReadShardFlags(shard, merge, plan);
  if (wrong.empty() && plan->IsShard() && out.empty()) {
    wrong = "--shard: needs --out, the file that keeps its rows";
  }
  return wrong;
}

std::string HashInputs() {
  std::map<std::string, std::string>& hashes = HashesOfInputs();
  hashes.clear();
  for (const std::string& file : FilesRead()) {
    std::string text;
    std::string error;
    if (!ReadTextFile(file, &text, &error)) return error;
    BitHash hash;
    hash.Add(text);
    hashes[file] = hash.Text();
  }
  return "";
}

OrderedJson ShardJson(const Shard& shard, long rows_in_all, const std::vector<Json>& rows,
                      std::string_view text) {
  const ProgramInfo& info = ParsedProgram();
  return {{"program", info.name},       {"version", info.version},          {"index", shard.index},
          {"of", shard.count},          {"rows_in_all", rows_in_all},       {"flags", FlagsOfRun()},
          {"inputs", HashesOfInputs()}, {"hash", HashOf(text, Json(rows))}, {"rows", rows}};
}

std::string WithShard(std::string text, const Shard& shard, long rows_in_all,
                      const std::vector<Json>& rows) {
  const std::string line = LineOf(ShardJson(shard, rows_in_all, rows, text));
  return text.append(kMark).append(line).append("\n");
}

std::string MergeShards(const ShardPlan& plan, long rows_in_all, MergedShards* merged) {
  std::vector<ShardFile> files(plan.files.size());
  std::map<long, const ShardFile*> by_index;
  merged->rows.assign(static_cast<std::size_t>(rows_in_all), Json());
  for (std::size_t i = 0; i < files.size(); ++i) {
    ShardFile& file = files[i];
    std::string error = ReadShardFile(plan.files[i], &file);
    if (!error.empty()) return error;
    try {
      error = CheckHeader(files.front(), rows_in_all, &file);
    } catch (const Json::exception&) {
      error = file.name + ": /shard: damaged: its content is not what --shard wrote";
    }
    if (!error.empty()) return error;
    const auto [place, is_new] = by_index.emplace(file.shard.index, &file);
    if (!is_new) {
      return file.name + ": shard " + std::to_string(file.shard.index) + " of " +
             std::to_string(file.shard.count) + " is given twice, first by " + place->second->name;
    }
    Json& rows = (*file.content)["rows"];
    for (std::size_t r = 0; r < rows.size(); ++r) {
      merged->rows[static_cast<std::size_t>(file.shard.RowOf(static_cast<long>(r)))] =
          std::move(rows[r]);
    }
    rows.clear();
  }
  const long count = files.front().shard.count;
  std::vector<long> missing;
  for (long i = 0; i < count; ++i) {
    if (by_index.count(i) == 0) missing.push_back(i);
  }
  if (!missing.empty()) {
    return "--merge: " + NamesOf(missing) + " of " + std::to_string(count) +
           (missing.size() == 1 ? " is missing" : " are missing");
  }
  for (const auto& [index, file] : by_index) merged->texts.push_back(file->text);
  return "";
}

}  // namespace tangible
