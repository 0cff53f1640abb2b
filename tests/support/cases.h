// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Problems with known solutions in tests/lcp/data (README.md there).

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"

namespace tangible {

/// The list in a file of tests/lcp/data.
inline nlohmann::json ReadCases(const std::string& name) {
  std::ifstream file(std::string(TANGIBLE_SOURCE_DIR) + "/tests/lcp/data/" + name);
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

/// The plain LCPs w = M z + q ≥ 0, z ≥ 0, zᵀ w = 0.
inline nlohmann::json PlainCases() { return ReadCases("problems.json"); }

inline nlohmann::json PlainCase(const std::string& name) {
  for (const nlohmann::json& data : PlainCases()) {
    if (data["name"] == name) return data;
  }
  throw std::invalid_argument("no problem " + name);
}

/// A plain LCP, its z and w named as in problem.h.
inline MixedLcp<double> PlainProblem(const nlohmann::json& data) {
  MixedLcp<double> problem;
  problem.c = ToVector(data["q"]);
  problem.F = ToMatrix(data["M"], problem.c.size());
  ConformEmptyBlocks(problem);
  return problem;
}

}  // namespace tangible
