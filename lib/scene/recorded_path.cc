// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/recorded_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tangible/math/cubic_spline.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/tolerances.h"

namespace tangible {
namespace {

std::vector<RecordedPath::Point> PiecesOf(const PathSeries& series,
                                          const std::vector<double>& values) {
  std::vector<RecordedPath::Point> pieces;
  if (values.empty()) return pieces;
  const std::vector<double>& time = series.time;
  const CubicSpline<double> spline(time, values);
  for (std::size_t i = 0; i < time.size(); ++i) {
    RecordedPath::Point& piece = pieces.emplace_back();
    piece.value = values[i];
    if (i + 1 == time.size()) break;
    const double length = time[i + 1] - time[i];
    if (series.interpolation == PathInterpolation::kLinear) {
      piece.rate = (values[i + 1] - values[i]) / length;
      continue;
    }
    const double inside = time[i] + 0.5 * length;
    const SplinePoint<double> start = spline.At(time[i], inside);
    piece.rate = start.rate;
    piece.acceleration = start.acceleration;
    piece.jerk = (spline.At(time[i + 1], inside).acceleration - start.acceleration) / length;
  }
  return pieces;
}

}  // namespace

RecordedPath::RecordedPath(PathSeries series) : series_(std::move(series)) {
  for (int i = 0; i < kNumColumns; ++i) pieces_[i] = PiecesOf(series_, series_.Column(i));
}

int RecordedPath::PieceOf(double inside) const {
  const std::vector<double>& time = series_.time;
  return static_cast<int>(std::upper_bound(time.begin(), time.end(), inside) - time.begin()) - 1;
}

RecordedPath::Point RecordedPath::At(int column, double time, double inside) const {
  const int piece = PieceOf(inside);
  if (piece < 0) return {pieces_[column].front().value};
  const Point& p = pieces_[column][static_cast<std::size_t>(piece)];
  const double s = time - series_.time[static_cast<std::size_t>(piece)];
  return {p.value + s * (p.rate + s * (0.5 * p.acceleration + s * p.jerk / 6.0)),
          p.rate + s * (p.acceleration + 0.5 * s * p.jerk), p.acceleration + s * p.jerk, p.jerk};
}

bool RecordedPath::JumpsAt(int k) const {
  const int last = static_cast<int>(series_.time.size()) - 1;
  if (series_.interpolation != PathInterpolation::kLinear && k > 0 && k < last) return false;
  for (int column = 0; column < kNumColumns; ++column) {
    if (!Has(column)) continue;
    const auto i = static_cast<std::size_t>(k);
    const double before = k > 0 ? At(column, series_.time[i], series_.time[i - 1]).rate : 0.0;
    const double after = k < last ? pieces_[column][i].rate : 0.0;
    if (std::abs(after - before) > kEqualRates * std::max(std::abs(before), std::abs(after))) {
      return true;
    }
  }
  return false;
}

double RecordedPath::LargestRate(int column, double from, double to) const {
  double largest = 0.0;
  const int last = static_cast<int>(series_.time.size()) - 1;
  for (int piece = std::max(PieceOf(from), 0); piece < last; ++piece) {
    const double begin = std::max(from, series_.time[static_cast<std::size_t>(piece)]);
    const double end = std::min(to, series_.time[static_cast<std::size_t>(piece) + 1]);
    if (begin > end) break;
    const double inside = series_.time[static_cast<std::size_t>(piece)];
    const Point a = At(column, begin, inside);
    const Point b = At(column, end, inside);
    // A parabola leaves the range of its ends by at most an eighth of the change of its slope.
    largest =
        std::max(largest, std::max(std::abs(a.rate), std::abs(b.rate)) +
                              0.125 * std::abs(b.acceleration - a.acceleration) * (end - begin));
  }
  return largest;
}

bool ReadPath(const std::string& file, PathSeries* series, std::string* error) {
  CsvTable table;
  if (!ReadCsv(file, {"time"}, {"time", "x", "y", "angle"}, &table, error)) return false;
  const auto fail = [&](const std::string& what) {
    *error = OneLine(file + ": " + what);
    return false;
  };
  if (table.columns.size() < 2) {
    return fail("line " + std::to_string(table.header_line) +
                ": missing columns, expected x, y or angle beside time");
  }
  if (table.rows.empty()) {
    return fail("line " + std::to_string(table.header_line + 1) +
                ": expected at least one row, got none");
  }
  const auto read = [&](const std::string& name, std::vector<double>* values) {
    const int column = table.Column(name);
    if (column < 0) return true;
    values->resize(table.rows.size());
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      if (!ReadCell(table, static_cast<int>(i), column, &(*values)[i], error)) return false;
    }
    return true;
  };
  if (!read("time", &series->time) || !read("x", &series->x) || !read("y", &series->y) ||
      !read("angle", &series->angle)) {
    return false;
  }
  for (std::size_t i = 1; i < series->time.size(); ++i) {
    if (series->time[i] > series->time[i - 1]) continue;
    return fail("line " + std::to_string(table.lines[i]) + ": time: expected a number > " +
                Json(series->time[i - 1]).dump() + " (the time before), got " +
                Json(series->time[i]).dump());
  }
  return true;
}

}  // namespace tangible
