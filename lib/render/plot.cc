// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/plot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "tangible/render/html.h"
#include "tangible/render/tolerances.h"

namespace tangible {
namespace {

constexpr int kNumColours = 8;  // of style.css

// The colours of the page if there is one, else those of its light style.
constexpr char kStyle[] =
    "<style>.plot text{font:12px system-ui,sans-serif;fill:var(--text,#1b2330)}"
    ".plot .title{font-size:14px;font-weight:600}.plot "
    ".tick{font-size:11px;fill:var(--muted,#5a6675)}"
    ".plot .back{fill:var(--panel,#fff)}.plot .grid{stroke:var(--grid,#e8ecf1)}"
    ".plot .frame{fill:none;stroke:var(--line,#d5dbe3)}.plot .curve{fill:none;stroke-width:1.8;"
    "stroke-linejoin:round}.plot .band{opacity:.16;stroke:none}.plot .bar{stroke-width:1}"
    ".plot .s0{--c:var(--series-0,#2463d1)}.plot .s1{--c:var(--series-1,#cf6a0a)}"
    ".plot .s2{--c:var(--series-2,#16845a)}.plot .s3{--c:var(--series-3,#8745c4)}"
    ".plot .s4{--c:var(--series-4,#c9334b)}.plot .s5{--c:var(--series-5,#0c8797)}"
    ".plot .s6{--c:var(--series-6,#7a6a10)}.plot .s7{--c:var(--series-7,#a8407f)}"
    ".plot .curve,.plot .bar{stroke:var(--c)}.plot .dot,.plot .band{fill:var(--c)}</style>";

/// One axis: data to pixels.
struct Axis {
  AxisScale scale = AxisScale::kLinear;
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double pixel_low = 0.0;
  double pixel_high = 1.0;

  double Map(double value) const {
    return scale == AxisScale::kLogarithmic ? std::log10(value) : value;
  }
  bool Accepts(double value) const {
    return std::isfinite(value) && (scale == AxisScale::kLinear || value > 0.0);
  }
  void Include(double value) {
    if (Accepts(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  /// Leaves room around the data, and widens an empty interval or one of a single value.
  void Pad(double fraction) {
    if (!(low <= high)) {
      low = scale == AxisScale::kLogarithmic ? 0.1 : 0.0;
      high = 1.0;
    }
    if (scale == AxisScale::kLogarithmic) {
      const double factor = low < high ? std::pow(high / low, fraction) : 2.0;
      low /= factor;
      high *= factor;
      return;
    }
    // Values that differ only by rounding are drawn as one value, so that a plot does not show
    // rounding.
    const double magnitude = std::max(std::abs(low), std::abs(high));
    const double pad = high - low > kOneValue * magnitude ? fraction * (high - low)
                       : magnitude > 0.0                  ? 0.1 * magnitude
                                                          : 1.0;
    low -= pad;
    high += pad;
  }
  double Pixel(double value) const {
    return pixel_low + (pixel_high - pixel_low) * (Map(value) - Map(low)) / (Map(high) - Map(low));
  }
};

struct Point {
  double x;
  double y;
  double error;
};

bool Shows(const Axis& x_axis, const Axis& y_axis, const Point& point) {
  return x_axis.Accepts(point.x) && y_axis.Accepts(point.y);
}

std::vector<Point> PointsOf(const PlotSeries& series) {
  std::vector<Point> points;
  const std::size_t size = std::min(series.x.size(), series.y.size());
  for (std::size_t i = 0; i < size; ++i) {
    points.push_back({series.x[i], series.y[i], i < series.error.size() ? series.error[i] : 0.0});
  }
  return points;
}

std::string Px(double value) { return CompactNumber(std::round(10.0 * value) / 10.0, 6); }

std::string Attribute(const char* name, double value) {
  return std::string(" ") + name + "=\"" + Px(value) + "\"";
}

std::string Text(double x, double y, const char* attributes, const std::string& text) {
  return "<text" + Attribute("x", x) + Attribute("y", y) + " " + attributes + ">" +
         HtmlEscape(text) + "</text>\n";
}

std::string Line(double x1, double y1, double x2, double y2, const std::string& classes) {
  return "<line" + Attribute("x1", x1) + Attribute("y1", y1) + Attribute("x2", x2) +
         Attribute("y2", y2) + " class=\"" + classes + "\"/>\n";
}

/// Runs of points that a line connects; the line has a gap where a point is left out.
std::vector<std::vector<Point>> Runs(const std::vector<Point>& points, const Axis& x,
                                     const Axis& y) {
  std::vector<std::vector<Point>> runs(1);
  for (const Point& point : points) {
    if (Shows(x, y, point)) {
      runs.back().push_back(point);
    } else if (!runs.back().empty()) {
      runs.emplace_back();
    }
  }
  if (runs.back().empty()) {
    runs.pop_back();
  }
  return runs;
}

/// A value on the axis, at least its low end: a bar that reaches below 0 on a logarithmic axis ends
/// there.
double Clamp(const Axis& axis, double value) {
  return axis.Accepts(value) ? std::clamp(value, axis.low, axis.high) : axis.low;
}

std::string Polyline(const std::vector<Point>& run, const Axis& x, const Axis& y) {
  std::string path;
  for (const Point& point : run) {
    path += (path.empty() ? "M" : "L") + Px(x.Pixel(point.x)) + " " + Px(y.Pixel(point.y));
  }
  return path;
}

std::string Band(const std::vector<Point>& run, const Axis& x, const Axis& y) {
  std::string path;
  for (const Point& point : run) {
    path += (path.empty() ? "M" : "L") + Px(x.Pixel(point.x)) + " " +
            Px(y.Pixel(Clamp(y, point.y + point.error)));
  }
  for (auto point = run.rbegin(); point != run.rend(); ++point) {
    path += "L" + Px(x.Pixel(point->x)) + " " + Px(y.Pixel(Clamp(y, point->y - point->error)));
  }
  return path + "Z";
}

std::string SeriesCurve(const PlotSeries& series, const std::string& colour, const Axis& x,
                        const Axis& y) {
  const std::vector<Point> points = PointsOf(series);
  std::string svg = "<g class=\"" + colour + "\">\n";
  if (series.style != PlotStyle::kPoints) {
    for (const std::vector<Point>& run : Runs(points, x, y)) {
      if (!series.error.empty() && series.style == PlotStyle::kLine) {
        svg += "<path class=\"band\" d=\"" + Band(run, x, y) + "\"/>\n";
      }
      svg += "<path class=\"curve\" d=\"" + Polyline(run, x, y) + "\"/>\n";
    }
  }
  for (const Point& point : points) {
    if (series.style == PlotStyle::kLine || !Shows(x, y, point)) {
      continue;
    }
    const double px = x.Pixel(point.x);
    if (std::isfinite(point.error) && point.error > 0.0) {
      svg += Line(px, y.Pixel(Clamp(y, point.y - point.error)), px,
                  y.Pixel(Clamp(y, point.y + point.error)), "bar");
    }
    svg += "<circle" + Attribute("cx", px) + Attribute("cy", y.Pixel(point.y)) +
           (points.size() > 200 ? " r=\"1.6\"" : " r=\"2.8\"") + " class=\"dot\"/>\n";
  }
  return svg + "</g>\n";
}

Axis AxisOf(const std::vector<PlotSeries>& series, const PlotOptions& options,
            double Point::*member) {
  const Axis x{options.x_scale};
  const Axis y{options.y_scale};
  const bool is_y = member == &Point::y;
  Axis axis = is_y ? y : x;
  for (const PlotSeries& one : series) {
    for (const Point& point : PointsOf(one)) {
      if (!Shows(x, y, point)) {
        continue;
      }
      axis.Include(point.*member);
      if (is_y && std::isfinite(point.error)) {
        axis.Include(point.y - point.error);
        axis.Include(point.y + point.error);
      }
    }
  }
  axis.Pad(is_y ? 0.06 : 0.02);
  return axis;
}

/// Tick labels with only as many digits as distinguish neighbours.
std::string TickLabel(double tick, double step) {
  if (std::abs(tick) <= kTickRounding * step) {
    return "0";
  }
  const double digits = std::ceil(std::log10(std::abs(tick) / step) + kTickRounding) + 1.0;
  std::string label = CompactNumber(tick, static_cast<int>(std::clamp(digits, 1.0, 12.0)));
  const std::size_t exponent = label.find('e');  // 1e+04 is written 1e4
  if (exponent == std::string::npos) {
    return label;
  }
  const std::size_t first =
      std::min(label.find_first_not_of("+-0", exponent + 1), label.size() - 1);
  return label.substr(0, exponent + 1) + (label[exponent + 1] == '-' ? "-" : "") +
         label.substr(first);
}

std::string Axes(const PlotOptions& options, const Axis& x, const Axis& y) {
  std::string svg;
  const std::vector<double> x_ticks = PlotTicks(
      x.low, x.high, x.scale, std::max(2, static_cast<int>((x.pixel_high - x.pixel_low) / 80)));
  const std::vector<double> y_ticks = PlotTicks(
      y.low, y.high, y.scale, std::max(2, static_cast<int>((y.pixel_low - y.pixel_high) / 45)));
  const auto step = [](const Axis& axis, const std::vector<double>& ticks, double tick) {
    return axis.scale == AxisScale::kLogarithmic || ticks.size() < 2 ? tick : ticks[1] - ticks[0];
  };
  for (const double tick : x_ticks) {
    const double px = x.Pixel(tick);
    svg += Line(px, y.pixel_low, px, y.pixel_high, "grid");
    svg += Text(px, y.pixel_low + 16, "class=\"tick\" text-anchor=\"middle\"",
                TickLabel(tick, step(x, x_ticks, tick)));
  }
  for (const double tick : y_ticks) {
    const double px = y.Pixel(tick);
    svg += Line(x.pixel_low, px, x.pixel_high, px, "grid");
    svg += Text(x.pixel_low - 7, px + 4, "class=\"tick\" text-anchor=\"end\"",
                TickLabel(tick, step(y, y_ticks, tick)));
  }
  svg += "<rect" + Attribute("x", x.pixel_low) + Attribute("y", y.pixel_high) +
         Attribute("width", x.pixel_high - x.pixel_low) +
         Attribute("height", y.pixel_low - y.pixel_high) + " class=\"frame\"/>\n";
  svg += Text(0.5 * (x.pixel_low + x.pixel_high), options.height - 8, "text-anchor=\"middle\"",
              options.x_label);
  const std::string middle = Px(0.5 * (y.pixel_low + y.pixel_high));
  svg += "<text transform=\"translate(16 " + middle + ") rotate(-90)\" text-anchor=\"middle\">" +
         HtmlEscape(options.y_label) + "</text>\n";
  return svg;
}

/// Entries from left to right above the frame, in rows where they do not fit.
struct Legend {
  std::string svg;
  int rows = 0;
};

Legend MakeLegend(const PlotOptions& options, const std::vector<PlotSeries>& series, double left,
                  double top) {
  Legend legend;
  double at = left;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].label.empty()) {
      continue;
    }
    // 12 px letters are about 7 px wide.
    const double width = 34.0 + 7.0 * static_cast<double>(series[i].label.size());
    if (legend.rows == 0 || at + width > options.width - 10) {
      ++legend.rows;
      at = left;
    }
    const double y = top + 18.0 * (legend.rows - 1);
    legend.svg += "<g class=\"s" + std::to_string(i % kNumColours) + "\">";
    if (series[i].style != PlotStyle::kPoints) {
      legend.svg += Line(at, y - 4, at + 20, y - 4, "curve");
    }
    if (series[i].style != PlotStyle::kLine) {
      legend.svg += "<circle" + Attribute("cx", at + 10) + Attribute("cy", y - 4) +
                    " r=\"2.8\" class=\"dot\"/>";
    }
    legend.svg += "</g>" + Text(at + 26, y, "", series[i].label);
    at += width + 8.0;
  }
  return legend;
}

}  // namespace

PlotSeries Thinned(const PlotSeries& series, int buckets) {
  const std::size_t size = std::min(series.x.size(), series.y.size());
  if (size <= 2 * static_cast<std::size_t>(buckets) + 2) {
    return series;
  }
  const auto finite = [&](std::size_t i) {
    return std::isfinite(series.x[i]) && std::isfinite(series.y[i]);
  };
  double low = HUGE_VAL;
  double high = -HUGE_VAL;
  for (std::size_t i = 0; i < size; ++i) {
    if (finite(i)) {
      low = std::min(low, series.x[i]);
      high = std::max(high, series.x[i]);
    }
  }
  struct Bucket {
    std::size_t lowest = 0, highest = 0;
    bool any = false;
  };
  std::vector<Bucket> all(static_cast<std::size_t>(buckets));
  std::vector<std::size_t> kept = {0, size - 1};
  for (std::size_t i = 0; i < size; ++i) {
    if (!finite(i)) {
      continue;
    }
    const double part = high > low ? (series.x[i] - low) / (high - low) : 0.0;
    Bucket& bucket =
        all[static_cast<std::size_t>(std::min(buckets - 1, static_cast<int>(part * buckets)))];
    if (!bucket.any || series.y[i] < series.y[bucket.lowest]) {
      bucket.lowest = i;
    }
    if (!bucket.any || series.y[i] > series.y[bucket.highest]) {
      bucket.highest = i;
    }
    bucket.any = true;
  }
  for (const Bucket& bucket : all) {
    if (bucket.any) {
      kept.push_back(bucket.lowest);
      kept.push_back(bucket.highest);
    }
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  PlotSeries thin{series.label, {}, {}, series.style, {}};
  for (const std::size_t i : kept) {
    if (!finite(i)) {
      continue;
    }
    thin.x.push_back(series.x[i]);
    thin.y.push_back(series.y[i]);
    if (i < series.error.size()) {
      thin.error.push_back(series.error[i]);
    }
  }
  return thin;
}

std::string PlotSvg(const PlotOptions& options, const std::vector<PlotSeries>& series) {
  const double left = 74.0;
  double top = options.title.empty() ? 14.0 : 32.0;
  const Legend legend = MakeLegend(options, series, left, top + 8.0);
  top += 20.0 * legend.rows;
  Axis x = AxisOf(series, options, &Point::x);
  Axis y = AxisOf(series, options, &Point::y);
  x.pixel_low = left;
  x.pixel_high = options.width - 16.0;
  y.pixel_low = options.height - 46.0;
  y.pixel_high = top;
  const std::string size = std::to_string(options.width) + " " + std::to_string(options.height);
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\"" +
                    Attribute("width", options.width) + Attribute("height", options.height) +
                    " viewBox=\"0 0 " + size + "\" role=\"img\">\n" + kStyle +
                    "\n<rect class=\"back\" width=\"100%\" height=\"100%\"/>\n";
  if (!options.title.empty()) {
    svg += Text(left, 20, "class=\"title\"", options.title);
  }
  svg += legend.svg;
  svg += Axes(options, x, y);
  for (std::size_t i = 0; i < series.size(); ++i) {
    svg += SeriesCurve(series[i], "s" + std::to_string(i % kNumColours), x, y);
  }
  return svg + "</svg>\n";
}

}  // namespace tangible
