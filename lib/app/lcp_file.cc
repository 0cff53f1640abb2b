// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/lcp_file.h"

#include <algorithm>
#include <cmath>

#include "tangible/app/program.h"
#include "tangible/app/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Reads the problem from the root of a file; faults are added to the reader's errors.
class ProblemReader {
 public:
  explicit ProblemReader(const JsonReader& root) : root_(root) {}

  LcpFile Read() const {
    LcpFile input;
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

  void ReadBlocks(LcpFile& input) const {
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

  // If absent: zeros of the expected size (none if that is -1).
  VectorXd ReadVector(const char* key, Index size) const {
    const JsonReader list = root_.At(key);
    if (!list.exists()) return VectorXd::Zero(std::max<Index>(size, 0));
    VectorXd vector = list.Vector();
    if (size < 0 || vector.size() == size) return vector;
    list.Fail("expected " + std::to_string(size) + " numbers, got " +
              std::to_string(vector.size()));
    return VectorXd::Zero(size);
  }

  // If absent: zeros. A matrix without entries may be written [], whatever its number of rows.
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
    if (difference <= kSymmetric * M.cwiseAbs().maxCoeff()) return;
    root_.At("M")
        .At(static_cast<int>(row))
        .At(static_cast<int>(col))
        .Fail("expected a symmetric matrix, got " + FormatNumber(M(row, col)) + " and " +
              FormatNumber(M(col, row)));
  }

  // M is positive definite where A v = 0: v is then unique given z, and (1) is the motion of least
  // energy, not a saddle of it. Outside A's null space M is not restricted. Each v is scaled by M's
  // diagonal, so that masses of any ratio are accepted.
  void CheckDefinite(const MixedLcp<double>& problem) const {
    const Index n = problem.num_v();
    if (n == 0) return;
    const VectorXd scale = problem.M.diagonal().unaryExpr(
        [](double m) { return m == 0.0 ? 1.0 : 1.0 / std::sqrt(std::abs(m)); });
    MatrixXd basis = MatrixXd::Identity(n, n);
    if (problem.A.rows() > 0) {
      MatrixXd A = problem.A * scale.asDiagonal();
      for (Index i = 0; i < A.rows(); ++i) {
        A.row(i).normalize();  // a row of zeros remains
      }
      const PivotedQr qr(A.transpose());
      basis = qr.Q().rightCols(n - qr.rank());
    }
    if (basis.cols() == 0) return;
    basis = scale.asDiagonal() * basis;
    const SymmetricEigen eigen(basis.transpose() * problem.M * basis);
    const double rounding =
        kDefiniteRounding * static_cast<double>(n) * eigen.values().cwiseAbs().maxCoeff();
    if (eigen.values()[0] > rounding) return;
    const VectorXd v = (basis * eigen.vectors().col(0)).normalized();
    root_.At("M").Fail("expected a matrix that is positive definite where A v = 0, got v' M v = " +
                       FormatNumber(v.dot(problem.M * v)) + " for a unit v");
  }

  JsonReader root_;
};

}  // namespace

std::string ReadLcp(const Json& json, const std::string& name, LcpFile* input) {
  JsonErrors errors(name);
  *input = ProblemReader(JsonReader(json, &errors)).Read();
  return errors.message();
}

std::string ReadLcpFile(const std::string& file, LcpFile* input) {
  Json json;
  std::string error;
  if (!ParseJsonFile(file, &json, &error)) return error;
  return ReadLcp(json, file, input);
}

}  // namespace tangible
