// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Line and scatter plots as SVG, alone or within a page of HtmlPage (whose colours they then take).

#include <string>
#include <vector>

namespace tangible {

enum class PlotStyle { kLine, kPoints, kLineAndPoints };

/// One curve. x and y have the same length; `error` is empty or has that length too, and is then
/// drawn as bars y ± error (points) or as a band (lines). A point that is not finite, or not
/// positive on a logarithmic axis, is left out; a line has a gap there.
struct PlotSeries {
  std::string label;  ///< for the legend; empty: not listed
  std::vector<double> x;
  std::vector<double> y;
  PlotStyle style = PlotStyle::kLine;
  std::vector<double> error;
};

enum class AxisScale { kLinear, kLogarithmic };

struct PlotOptions {
  std::string title;
  std::string x_label;  ///< with unit: "time (s)"
  std::string y_label;
  AxisScale x_scale = AxisScale::kLinear;
  AxisScale y_scale = AxisScale::kLinear;
  int width = 720;   ///< px
  int height = 360;  ///< px
};

/// The positions of the ticks of an axis: at most about `count` of them within [low, high], at
/// multiples of 1, 2 or 5 times a power of ten, or (logarithmic) at powers of ten, and where these
/// are fewer than three at 1, 2 and 5 times them. Requires low < high, and low > 0 if logarithmic.
std::vector<double> PlotTicks(double low, double high, AxisScale scale, int count);

/// Thins a series that has so many points that they would hide each other: the range of x is cut
/// into `buckets` > 0 of equal width; the smallest and the largest y of each are kept, and the
/// first and last point of all, in the order of the series. Extremes stay visible. A series of at
/// most 2 buckets + 2 points is returned unchanged. Points that are not finite are left out of a
/// thinned series.
PlotSeries Thinned(const PlotSeries& series, int buckets);

/// The plot as one <svg> element. It does not CHECK its input: of vectors of different lengths as
/// many entries are read as the shortest has.
std::string PlotSvg(const PlotOptions& options, const std::vector<PlotSeries>& series);

}  // namespace tangible
