// SPDX-License-Identifier: Apache-2.0
// Any bytes as a problem file: refused with one line, or solved and differentiated without a number
// that is not finite; what is said to be solved is.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tangible/app/lcp_file.h"
#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/solver.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr Eigen::Index kMostRows = 16;
  tangible::Json json;
  tangible::LcpFile file;
  std::string error;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (tangible::ParseJson(text, "lcp.json", &json, &error)) {
    error = tangible::ReadLcp(json, "lcp.json", &file);
    if (error.find('\n') != std::string::npos) std::abort();
  } else if (error.empty()) {
    std::abort();
  }
  const tangible::MixedLcp<double>& problem = file.problem;
  if (!error.empty() || problem.num_v() + problem.num_y() + problem.num_z() > kMostRows) return 0;
  const tangible::LcpSolution<double> solution = tangible::SolveLcp(problem);
  if (!solution.v.allFinite() || !solution.y.allFinite() || !solution.z.allFinite()) std::abort();
  if (solution.status != tangible::LcpStatus::kSolved) return 0;
  const double residual = tangible::ScaledResidual(problem, solution.v, solution.y, solution.z);
  if (!(residual <= 1e-10)) std::abort();
  const tangible::LcpDerivative derivative(problem, {solution.v, solution.y, solution.z});
  if (file.has_loss) (void)derivative.Adjoint(file.loss_gradient);
  if (std::isnan(derivative.certificate().margin_min)) std::abort();
  return 0;
}
