// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The path of a body whose motion is given by a file: x, y and angle over time.
//
// Knots t_0 < ... < t_n with the values of each column; the columns are independent of each other.
//   kLinear   straight between knots: the rate jumps at each of them
//   kCubic    the cubic spline with not-a-knot ends (math/cubic_spline.h)
// Both are polynomials on each piece, and both are held before t_0 and after t_n, so that rates
// jump at the ends. A path may be evaluated on a piece beyond the piece's ends: the caller names
// the piece by a time inside it, because rates and accelerations are one-sided at knots.

#include <string>
#include <utility>
#include <vector>

namespace tangible {

enum class PathInterpolation { kLinear, kCubic };

/// What a file of a path holds. A column that the file does not have is empty.
struct PathSeries {
  std::string file;  ///< as written in the scene; empty: the series stands in the scene
  PathInterpolation interpolation = PathInterpolation::kCubic;
  std::vector<double> time;         ///< s, increasing
  std::vector<double> x, y, angle;  ///< m, m, rad

  const std::vector<double>& Column(int i) const { return i == 0 ? x : i == 1 ? y : angle; }
};

class RecordedPath {
 public:
  static constexpr int kNumColumns = 3;  ///< x, y, angle

  /// At least one time, increasing; each column is empty or has as many values (the caller has
  /// checked them).
  explicit RecordedPath(PathSeries series);

  const PathSeries& series() const { return series_; }
  bool Has(int column) const { return !pieces_[column].empty(); }
  const std::vector<double>& times() const { return series_.time; }

  /// A column and its first three derivatives at `time`, on the piece that `inside` lies in; a time
  /// on a knot names the piece after it.
  struct Point {
    double value = 0.0, rate = 0.0, acceleration = 0.0, jerk = 0.0;
  };
  Point At(int column, double time, double inside) const;

  /// Whether a rate jumps at knot k.
  bool JumpsAt(int k) const;
  /// A bound on |rate| of a column over [from, to].
  double LargestRate(int column, double from, double to) const;

 private:
  /// The piece of a time: −1 before the first knot, the last knot's index after it.
  int PieceOf(double inside) const;
  /// value + rate s + acceleration s² / 2 + jerk s³ / 6, s from the piece's knot.
  std::vector<Point> pieces_[kNumColumns];
  PathSeries series_;
};

/// Reads the columns of a file: `time` (s, strictly increasing) and at least one of `x`, `y` (m)
/// and `angle` (rad). On failure sets one line "file: line 3: what, expected, got".
bool ReadPath(const std::string& file, PathSeries* series, std::string* error);

}  // namespace tangible
