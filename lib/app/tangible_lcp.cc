// SPDX-License-Identifier: Apache-2.0
//
// tangible-lcp: solves one mixed LCP read from a JSON file and differentiates its solution.

#include <gflags/gflags.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/lcp/derivative.h"
#include "tangible/lcp/solver.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/json_writer.h"

DEFINE_string(solver, "auto", "auto, interior_point or lemke");
DEFINE_double(tolerance, 1e-10, "largest scaled residual of a solution");
DEFINE_int32(max_iterations, 100, "of each interior-point run");
DEFINE_string(out, "", "file of the result; empty: stdout");

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
struct ProblemInput {
  MixedLcp<double> problem;
  LcpVector loss_gradient;
  bool has_loss = false;
};

/// Reads the problem from the root of a file; faults end up in the reader's errors.
class ProblemReader {
 public:
  explicit ProblemReader(const JsonReader& root) : root_(root) {}

  ProblemInput Read() const {
    ProblemInput input;
    root_.ExpectKeys({"M", "p", "A", "b", "G", "F", "c", "dl_dv", "dl_dz", "dl_dy"});
    CheckTogether("M", "p");
    CheckTogether("A", "b");
    CheckRequired("F");
    CheckRequired("c");
    if (root_.ok()) ReadBlocks(input);
    return input;
  }

 private:
  void CheckRequired(const char* key) const {
    if (root_.Has(key)) return;
    root_.At(key).Fail("missing (F and c are needed; M, p, G and A, b may be absent)");
  }

  void CheckTogether(const char* first, const char* second) const {
    if (root_.Has(first) == root_.Has(second)) return;
    const bool has_first = root_.Has(first);
    root_.At(has_first ? second : first)
        .Fail(std::string("missing, expected together with ") + (has_first ? first : second));
  }

  void ReadBlocks(ProblemInput& input) const {
    MixedLcp<double>& problem = input.problem;
    problem.p = ReadVector("p", -1);
    problem.b = ReadVector("b", -1);
    problem.c = ReadVector("c", -1);
    const Index nv = problem.num_v();
    const Index ny = problem.num_y();
    const Index nz = problem.num_z();
    problem.M = ReadMatrix("M", nv, nv);
    problem.A = ReadMatrix("A", ny, nv);
    problem.G = ReadMatrix("G", nz, nv);
    problem.F = ReadMatrix("F", nz, nz);
    if (nv > 0 && nz > 0 && !root_.Has("G")) {
      root_.At("G").Fail("missing, expected " + Shape(nz, nv) + " beside M and p");
    }
    CheckSymmetric(problem.M);
    if (root_.ok()) CheckDefinite(problem);
    input.has_loss = root_.Has("dl_dv") || root_.Has("dl_dz") || root_.Has("dl_dy");
    input.loss_gradient = {ReadVector("dl_dv", nv), ReadVector("dl_dy", ny),
                           ReadVector("dl_dz", nz)};
  }

  static std::string Shape(Index rows, Index cols) {
    return std::to_string(rows) + " x " + std::to_string(cols);
  }

  // Absent: zeros of the expected size (none if that is -1).
  VectorXd ReadVector(const char* key, Index size) const {
    const JsonReader list = root_.At(key);
    if (!list.exists()) return VectorXd::Zero(std::max<Index>(size, 0));
    VectorXd vector = list.Vector();
    if (size < 0 || vector.size() == size) return vector;
    list.Fail("expected " + std::to_string(size) + " numbers, got " +
              std::to_string(vector.size()));
    return VectorXd::Zero(size);
  }

  // Absent: zeros. A matrix without entries may be written [], whatever its rows.
  MatrixXd ReadMatrix(const char* key, Index rows, Index cols) const {
    const JsonReader list = root_.At(key);
    const bool empty = list.IsArray() && list.Size() == 0 && rows * cols == 0;
    if (!list.exists() || empty) return MatrixXd::Zero(rows, cols);
    MatrixXd matrix = list.Matrix();
    if (matrix.rows() == rows && matrix.cols() == cols) return matrix;
    list.Fail("expected " + Shape(rows, cols) + ", got " + Shape(matrix.rows(), matrix.cols()));
    return MatrixXd::Zero(rows, cols);
  }

  // M is symmetric by definition: the adjoint's formulas rely on it.
  void CheckSymmetric(const MatrixXd& M) const {
    if (M.size() == 0) return;
    Index row = 0;
    Index col = 0;
    const double difference = (M - M.transpose()).cwiseAbs().maxCoeff(&row, &col);
    if (difference <= 1e-9 * M.cwiseAbs().maxCoeff()) return;
    root_.At("M")
        .At(static_cast<int>(row))
        .At(static_cast<int>(col))
        .Fail("expected a symmetric matrix, got " + FormatNumber(M(row, col)) + " and " +
              FormatNumber(M(col, row)));
  }

  // M is positive definite where A v = 0: v is then unique given z, and (1) is the motion of least
  // energy, not a saddle of it. Beyond A's null space any M will do. Each v is scaled by M's
  // diagonal, so that masses of any ratio pass.
  void CheckDefinite(const MixedLcp<double>& problem) const {
    const Index n = problem.num_v();
    if (n == 0) return;
    const VectorXd scale = problem.M.diagonal().unaryExpr(
        [](double m) { return m == 0.0 ? 1.0 : 1.0 / std::sqrt(std::abs(m)); });
    MatrixXd basis = MatrixXd::Identity(n, n);
    if (problem.A.rows() > 0) {
      MatrixXd A = problem.A * scale.asDiagonal();
      A.rowwise().normalize();  // a row of zeros stays
      const Eigen::ColPivHouseholderQR<MatrixXd> qr(A.transpose());
      const MatrixXd q = qr.householderQ();
      basis = q.rightCols(n - qr.rank());
    }
    if (basis.cols() == 0) return;
    basis = scale.asDiagonal() * basis;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(basis.transpose() * problem.M * basis);
    const double rounding =
        1e-15 * static_cast<double>(n) * eigen.eigenvalues().cwiseAbs().maxCoeff();
    if (eigen.eigenvalues()[0] > rounding) return;
    const VectorXd v = (basis * eigen.eigenvectors().col(0)).normalized();
    root_.At("M").Fail("expected a matrix that is positive definite where A v = 0, got v' M v = " +
                       FormatNumber(v.dot(problem.M * v)) + " for a unit v");
  }

  JsonReader root_;
};

// Empty, or one line.
std::string ReadProblem(const std::string& file, ProblemInput* input) {
  Json json;
  std::string error;
  if (!ParseJsonFile(file, &json, &error)) return error;
  JsonErrors errors(file);
  *input = ProblemReader(JsonReader(json, &errors)).Read();
  return errors.message();
}

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

OrderedJson Describe(const ProblemInput& input, const LcpSolution<double>& solution) {
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
  if (input.has_loss) result["gradient"] = ToJson(derivative.Adjoint(input.loss_gradient));
  Certificate certificate = derivative.certificate();
  const bool planned =
      solution.solver == LcpSolver::kGuess || solution.solver == LcpSolver::kInteriorPoint;
  certificate.fallbacks = planned || FLAGS_solver != "auto" ? 0 : 1;
  result["certificate"] = tangible::ToJson(certificate);
  return result;
}

int Run(const std::string& file) {
  LcpOptions options;
  options.tolerance = FLAGS_tolerance;
  options.max_iterations = FLAGS_max_iterations;
  if (FLAGS_solver == "interior_point") options.solver = SolverChoice::kInteriorPoint;
  if (FLAGS_solver == "lemke") options.solver = SolverChoice::kLemke;

  ProblemInput input;
  std::string error = ReadProblem(file, &input);
  if (!error.empty()) return ReportError(error);
  const LcpSolution<double> solution = SolveLcp(input.problem, options);
  error = WriteResult(FLAGS_out, JsonText(Describe(input, solution)));
  if (!error.empty()) return ReportError(error);
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
