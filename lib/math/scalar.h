// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The scalar list: the number types T for which the engine is instantiated.
//
//   T = double                 the simulation itself
//   T = ceres::Jet<double, N>  a value a and N derivatives v: a + v·ε, ε² = 0 (dual numbers)
//
// The widths N are a CMake option (TANGIBLE_JET_WIDTHS). This header is the only place of lib that
// sees Ceres, and of Ceres it sees ceres/jet.h alone, which needs no more than Eigen.
//
// Discrete choices (which feature, which mode, which pivot) read ValueOf(x): on either side of a
// choice the derivative is that of the chosen branch.

#include <ceres/jet.h>

#include <Eigen/Core>
#include <limits>

#include "tangible/config/jet_widths.h"

namespace tangible {

template <int N>
using Jet = ceres::Jet<double, N>;

/// The Jet in which one contact, joint or force is evaluated for its local derivatives; functions
/// that such an evaluation calls are instantiated for it whatever the widths listed.
inline constexpr int kLocalJetWidth = TANGIBLE_LOCAL_JET_WIDTH;
using LocalJet = Jet<kLocalJetWidth>;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The value of a scalar, without its derivatives.
inline double ValueOf(double x) { return x; }
template <int N>
double ValueOf(const Jet<N>& x) {
  return x.a;
}

/// Number of derivatives a scalar carries: 0 for double, N for Jet<N>.
template <typename T>
struct NumDerivatives {
  static constexpr int value = 0;
};
template <int N>
struct NumDerivatives<Jet<N>> {
  static constexpr int value = N;
};

template <typename T>
using Vector2 = Eigen::Matrix<T, 2, 1>;
template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using VectorX = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <typename T>
using MatrixX = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;
/// Row-major, so that the columns of one row (derivatives of one number) are contiguous.
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace tangible
