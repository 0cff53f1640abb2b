// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/problem_folder.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "tangible/app/lcp_file.h"

namespace tangible::corpus {
namespace {

bool Says(const Json& json, const char* key) {
  return json.contains("props") && json["props"].is_object() &&
         json["props"].value(key, Json(false)) == Json(true);
}

// Whether all friction coefficients are given, and at most 2.
bool LittleFriction(const Json& json) {
  if (!json.contains("contact") || !json["contact"].is_object()) return false;
  const Json mu = json["contact"].value("mu", Json());
  return mu.is_array() && !mu.empty() && std::all_of(mu.begin(), mu.end(), [](const Json& one) {
           return one.is_number() && one.get<double>() <= 2.0;
         });
}

void Classify(const Json& json, FileCase* one) {
  const Json status = json.value("status", Json());
  if (status == "infeasible") {
    one->kind = "file, infeasible";
    one->known = Known::kInfeasible;
  } else if (status == "feasible_unsolvable") {
    one->kind = "file, no solution";
    one->known = Known::kUnsolvable;
  } else if (status != "solvable") {
    one->kind = "file, not known";
  } else if (Says(json, "psd") || Says(json, "P")) {
    one->kind = "file, monotone or P";
    one->known = Known::kSolvable;
  } else if (LittleFriction(json)) {
    one->kind = "file, friction <= 2";
    one->known = Known::kSolvable;
  } else {
    one->kind = "file, other";
    one->known = Known::kHardlySolvable;
  }
}

// A published plain LCP, whose further keys only describe it.
std::string ReadPlain(const Json& json, const std::string& file, MixedLcp<double>* problem) {
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  problem->c = root.At("q").Vector();
  problem->F = root.At("M").Matrix();
  const Eigen::Index n = problem->c.size();
  if (errors.ok() && (problem->F.rows() != n || problem->F.cols() != n)) {
    root.At("M").Fail("expected " + std::to_string(n) + " x " + std::to_string(n) + ", got " +
                      std::to_string(problem->F.rows()) + " x " +
                      std::to_string(problem->F.cols()));
  }
  ConformEmptyBlocks(*problem);
  return errors.message();
}

}  // namespace

std::string ReadProblemFolder(const std::string& folder, std::vector<FileCase>* cases) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    if (entries->path().extension() == ".json") paths.push_back(entries->path());
  }
  if (error) return folder + ": cannot be read: " + error.message();
  if (paths.empty()) return folder + ": expected problem files (*.json), got none";
  std::sort(paths.begin(), paths.end());
  for (const std::filesystem::path& path : paths) {
    FileCase one;
    one.name = path.filename().string();
    Json json;
    std::string wrong;
    if (!ParseJsonFile(path.string(), &json, &wrong)) return wrong;
    if (json.is_object() && json.contains("q")) {
      wrong = ReadPlain(json, path.string(), &one.problem);
      Classify(json, &one);
    } else {
      LcpFile file;
      wrong = ReadLcp(json, path.string(), &file);
      one.problem = file.problem;
      one.kind = "file, not known";
    }
    if (!wrong.empty()) return wrong;
    cases->push_back(std::move(one));
  }
  return "";
}

}  // namespace tangible::corpus
