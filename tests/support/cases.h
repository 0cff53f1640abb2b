// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The published and exact problems of ../shared/cases, read at run time where they are present.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"

namespace tangible {

inline std::filesystem::path CaseFolder() {
  return std::filesystem::path(TANGIBLE_SOURCE_DIR) / ".." / "shared" / "cases";
}

inline bool CasesArePresent() { return std::filesystem::exists(CaseFolder() / "lcp"); }

inline nlohmann::json ReadJson(const std::filesystem::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

inline VectorX<double> ToVector(const nlohmann::json& list) {
  VectorX<double> vector(static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index i = 0; i < vector.size(); ++i) vector[i] = list[i].get<double>();
  return vector;
}

/// An array of rows; `cols` where there are none.
inline MatrixX<double> ToMatrix(const nlohmann::json& rows, Eigen::Index cols) {
  MatrixX<double> matrix(static_cast<Eigen::Index>(rows.size()), cols);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix.row(i) = ToVector(rows[i]).transpose();
  return matrix;
}

/// The plain LCP of a file in cases/lcp, its z and w named as in problem.h.
inline MixedLcp<double> PlainProblem(const nlohmann::json& data) {
  MixedLcp<double> problem;
  problem.c = ToVector(data["q"]);
  problem.F = ToMatrix(data["M"], problem.c.size());
  ConformEmptyBlocks(problem);
  return problem;
}

/// All files of cases/lcp, by name.
inline std::vector<nlohmann::json> PlainCases() {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(CaseFolder() / "lcp")) {
    if (entry.path().extension() == ".json") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<nlohmann::json> cases;
  for (const auto& path : paths) cases.push_back(ReadJson(path));
  return cases;
}

}  // namespace tangible
