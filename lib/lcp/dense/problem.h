// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The mixed linear complementarity problem (LCP), its solution and the measure of success.
//
//   M v − Aᵀ y − Gᵀ z = p                                            (1)
//   A v = b                                                          (2)
//   s = G v + F z + c,   s ≥ 0,  z ≥ 0,  sᵀ z = 0                    (3)
//
//   M  nv x nv, symmetric       p  nv
//   A  ny x nv                  b  ny
//   G  nz x nv                  F  nz x nz, need not be symmetric   c  nz
//
// With nv = ny = 0 it is the plain LCP s = F z + c. This module knows nothing of bodies; where the
// problem is a time step, v holds twists (m/s, rad/s), y and z are impulses (N s) or sliding speeds
// (m/s), and s are speeds.

#include <limits>
#include <string>

#include "tangible/math/scalar.h"

namespace tangible {

template <typename T>
struct MixedLcp {
  MatrixX<T> M;
  VectorX<T> p;
  MatrixX<T> A;
  VectorX<T> b;
  MatrixX<T> G;
  MatrixX<T> F;
  VectorX<T> c;

  Eigen::Index num_v() const { return p.size(); }
  Eigen::Index num_y() const { return b.size(); }
  Eigen::Index num_z() const { return c.size(); }
};

enum class LcpStatus {
  kSolved,      ///< the scaled residual is at most the tolerance
  kUnsolved,    ///< no solution was found; there may be one
  kInfeasible,  ///< (1), (2) with s ≥ 0, z ≥ 0 has no solution: `farkas` proves it
};

enum class LcpSolver { kNone, kGuess, kInteriorPoint, kLemke, kEnumeration };

template <typename T>
struct LcpSolution {
  LcpStatus status = LcpStatus::kUnsolved;
  VectorX<T> v;                                                ///< nv
  VectorX<T> y;                                                ///< ny
  VectorX<T> z;                                                ///< nz, ≥ 0
  VectorX<T> s;                                                ///< nz, G v + F z + c recomputed
  double residual = std::numeric_limits<double>::quiet_NaN();  ///< ScaledResidual, dimensionless
  LcpSolver solver = LcpSolver::kNone;                         ///< which solver found the solution
  int iterations = 0;                                          ///< of all attempts together
  VectorX<double>
      farkas;           ///< kInfeasible: (u of (1), t of (2), w of (3)), see farkas.h; else empty
  std::string message;  ///< why it is unsolved or was refused; else empty
};

/// The names in the result file: solved, unsolved, infeasible; none, guess, interior_point, lemke,
/// enumeration.
const char* ToString(LcpStatus status);
const char* ToString(LcpSolver solver);

/// Gives empty blocks the shape that the other blocks require (an absent A becomes 0 x nv).
template <typename T>
void ConformEmptyBlocks(MixedLcp<T>& problem);

/// Describes what is wrong with the data (shapes that do not fit, or numbers that are not finite),
/// for example "M: expected 3 x 3, got 3 x 2"; empty if nothing is.
std::string ValidateProblem(const MixedLcp<double>& problem);

/// The values of a problem, without derivatives.
template <typename T>
MixedLcp<double> ValuesOf(const MixedLcp<T>& problem);

/// All equations of a problem as E (v, y, z, s) = f; E is n x (n + nz), n = nv + ny + nz.
struct LinearEquations {
  MatrixX<double> E;
  VectorX<double> f;
};
LinearEquations AllEquations(const MixedLcp<double>& problem);

/// The magnitude of the terms of each row, to which the rounding of the row is proportional.
struct LcpScales {
  VectorX<double> momentum;  ///< nv: (|M||v| + |A|ᵀ|y| + |G|ᵀ|z| + |p|) of the row
  VectorX<double> joint;     ///< ny: (|A| v̂ + |b|)
  VectorX<double> slack;     ///< nz: σ = |G| v̂ + |F||z| + |c|
  VectorX<double> force;     ///< nz: ζ = max(largest z of its kind, σᵢ / Wᵢᵢ)
};

/// v̂ⱼ = max(|vⱼ|, (|p| + |A|ᵀ|y| + |G|ᵀ|z|)ⱼ / Mⱼⱼ): a v that is the small difference of large
/// impulses is only as exact as those. The scale is limited to the speed that the energy of all v
/// and M⁻¹ p could cause, because rows that contradict each other can have impulses of any size,
/// which would hide the contradiction. Of y only the part outside the null space of Aᵀ counts, here
/// and in `momentum`: the part inside can grow without bound where joints contradict each other,
/// and would hide that A v = b does not hold. There are two kinds of rows: those whose row of G is
/// zero, and the others. W is the diagonal of F + G diag(M)⁻¹ Gᵀ; where Wᵢᵢ ≤ 0 (a sliding speed,
/// which changes only the slacks of other rows) the largest σₖ / |Fₖᵢ| stands for σᵢ / Wᵢᵢ.
LcpScales ComputeScales(const MixedLcp<double>& problem, const VectorX<double>& v,
                        const VectorX<double>& y, const VectorX<double>& z);

/// Row i of a matrix that may have no columns (for which Eigen's row() offsets a null pointer).
inline VectorX<double> RowOf(const MatrixX<double>& matrix, Eigen::Index i) {
  return VectorX<double>::NullaryExpr(matrix.cols(),
                                      [&matrix, i](Eigen::Index j) { return matrix(i, j); });
}

/// s = G v + F z + c.
VectorX<double> Slack(const MixedLcp<double>& problem, const VectorX<double>& v,
                      const VectorX<double>& z);

/// value / scale; 0 for a row without any terms, which holds exactly.
inline double Ratio(double value, double scale) { return value == 0.0 ? 0.0 : value / scale; }

/// The scaled natural residual: the largest of |min(zᵢ / ζᵢ, sᵢ / σᵢ)| over the rows of (3) and of
/// the residuals of (1) and (2) over their scales. Infinite if a number is not finite.
double ScaledResidual(const MixedLcp<double>& problem, const VectorX<double>& v,
                      const VectorX<double>& y, const VectorX<double>& z);

/// Whether a point of residual `residual` is a solution rather than merely large: large z and v on
/// a ray of the constraints satisfy s = G v + F z + c relative to |F||z| however wrong c is, but
/// then they satisfy the problem with p = b = c = 0 as well. True if `residual` is at most 1e-8 of
/// the residual of the point in that problem.
bool DependsOnData(const MixedLcp<double>& problem, const VectorX<double>& v,
                   const VectorX<double>& y, const VectorX<double>& z, double residual);

}  // namespace tangible
