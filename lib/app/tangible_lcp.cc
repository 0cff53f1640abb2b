// SPDX-License-Identifier: Apache-2.0
//
// tangible-lcp: solves one mixed LCP read from a JSON file and differentiates its solution.

#include <gflags/gflags.h>

#include <string>

#include "tangible/app/certificate_json.h"
#include "tangible/app/lcp_file.h"
#include "tangible/app/program.h"
#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/solver.h"
#include "tangible/lcp/dense/tolerances.h"
#include "tangible/scene/json_writer.h"

DEFINE_string(solver, "auto", "auto, interior_point or lemke");
DEFINE_double(tolerance, tangible::kLcpTolerance, "largest scaled residual of a solution");
DEFINE_int32(max_iterations, 100, "of each interior-point run");
DEFINE_string(out, "", "file of the result; empty: stdout");

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

OrderedJson ToJson(const VectorXd& vector) {
  OrderedJson list = OrderedJson::array();
  for (const double x : vector) list.push_back(x);
  return list;
}

OrderedJson ToJson(const MatrixXd& matrix) {
  OrderedJson rows = OrderedJson::array();
  for (Index i = 0; i < matrix.rows(); ++i) rows.push_back(ToJson(RowOf(matrix, i)));
  return rows;
}

OrderedJson ToJson(const MixedLcp<double>& gradient) {
  return {{"p", ToJson(gradient.p)}, {"M", ToJson(gradient.M)}, {"G", ToJson(gradient.G)},
          {"c", ToJson(gradient.c)}, {"F", ToJson(gradient.F)}, {"A", ToJson(gradient.A)},
          {"b", ToJson(gradient.b)}};
}

bool IsFinite(const MixedLcp<double>& gradient) {
  return gradient.p.allFinite() && gradient.M.allFinite() && gradient.G.allFinite() &&
         gradient.c.allFinite() && gradient.F.allFinite() && gradient.A.allFinite() &&
         gradient.b.allFinite();
}

// `overflows`: whether the gradient overflows, in which case none is written.
OrderedJson Describe(const LcpFile& input, const LcpSolution<double>& solution, bool* overflows) {
  OrderedJson result = {{"status", ToString(solution.status)},
                        {"v", ToJson(solution.v)},
                        {"y", ToJson(solution.y)},
                        {"z", ToJson(solution.z)},
                        {"s", ToJson(solution.s)},
                        {"residual", solution.residual},
                        {"solver", ToString(solution.solver)},
                        {"iterations", solution.iterations},
                        {"farkas", nullptr}};
  if (!solution.message.empty()) result["message"] = solution.message;
  if (solution.status == LcpStatus::kInfeasible) result["farkas"] = ToJson(solution.farkas);
  if (solution.status != LcpStatus::kSolved) return result;
  const LcpDerivative derivative(input.problem, {solution.v, solution.y, solution.z});
  if (input.has_loss) {
    const MixedLcp<double> gradient = derivative.Adjoint(input.loss_gradient);
    *overflows = !IsFinite(gradient);
    result["gradient"] = *overflows ? OrderedJson(nullptr) : ToJson(gradient);
  }
  Certificate certificate = derivative.certificate();
  const bool planned =
      solution.solver == LcpSolver::kGuess || solution.solver == LcpSolver::kInteriorPoint;
  certificate.fallbacks = planned || FLAGS_solver != "auto" ? 0 : 1;
  if (*overflows) certificate.verdict = "near a kink: the gradient is not finite";
  result["certificate"] = tangible::ToJson(certificate);
  return result;
}

int Run(const std::string& file) {
  LcpOptions options;
  options.tolerance = FLAGS_tolerance;
  options.max_iterations = FLAGS_max_iterations;
  if (FLAGS_solver == "interior_point") options.solver = SolverChoice::kInteriorPoint;
  if (FLAGS_solver == "lemke") options.solver = SolverChoice::kLemke;

  LcpFile input;
  std::string error = ReadLcpFile(file, &input);
  if (!error.empty()) return ReportError(error);
  const LcpSolution<double> solution = SolveLcp(input.problem, options);
  bool overflows = false;
  error = WriteResult(FLAGS_out, JsonText(Describe(input, solution, &overflows)));
  if (!error.empty()) return ReportError(error);
  if (overflows) {
    return ReportError(file +
                       ": the gradient is not finite: it overflows, or the problem is too "
                       "badly scaled");
  }
  if (solution.status == LcpStatus::kSolved) return kExitDone;
  return ReportError(file + ": " + ToString(solution.status) + ": " + solution.message +
                     ", scaled residual " + FormatNumber(solution.residual));
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-lcp",
       .synopsis = "PROBLEM.json [--solver=auto|interior_point|lemke] [--tolerance=1e-10] "
                   "[--out=S.json]",
       .description = "Solves one mixed linear complementarity problem\n"
                      "  M v - A' y - G' z = p,  A v = b,  s = G v + F z + c,  s, z >= 0, s'z = 0\n"
                      "given as {\"M\", \"p\", \"A\", \"b\", \"G\", \"F\", \"c\", \"dl_dv\", "
                      "\"dl_dz\", \"dl_dy\"} and writes its solution,\n"
                      "a certificate and, where a dl_ is given, the gradient.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__});
  if (line.exit_status) return *line.exit_status;
  if (FLAGS_solver != "auto" && FLAGS_solver != "interior_point" && FLAGS_solver != "lemke") {
    return ReportError(
        "tangible-lcp: --solver: expected auto, interior_point or lemke, "
        "got '" +
            FLAGS_solver + "'",
        kExitUsage);
  }
  if (!(FLAGS_tolerance > 0.0 && FLAGS_tolerance < 1.0)) {
    return ReportError("tangible-lcp: --tolerance: expected a number in (0, 1), got " +
                           FormatNumber(FLAGS_tolerance),
                       kExitUsage);
  }
  if (FLAGS_max_iterations < 1) {
    return ReportError("tangible-lcp: --max_iterations: expected a number >= 1, got " +
                           std::to_string(FLAGS_max_iterations),
                       kExitUsage);
  }
  return Run(line.positional[0]);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
