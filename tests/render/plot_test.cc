// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

namespace tangible {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

/// The values of an attribute of every element of a class, in order.
std::vector<double> Values(const std::string& svg, const std::string& element,
                           const std::string& attribute) {
  std::vector<double> values;
  for (std::size_t at = svg.find("<" + element); at != std::string::npos;
       at = svg.find("<" + element, at + 1)) {
    const std::size_t value = svg.find(" " + attribute + "=\"", at) + attribute.size() + 3;
    values.push_back(std::strtod(svg.c_str() + value, nullptr));
  }
  return values;
}

TEST(PlotSvg, PointsStandWhereTheyShould) {
  const std::string svg =
      PlotSvg({}, {{"", {0.0, 1.0, 2.0}, {5.0, 7.0, 6.0}, PlotStyle::kPoints, {}}});
  const std::vector<double> x = Values(svg, "circle", "cx");
  const std::vector<double> y = Values(svg, "circle", "cy");
  ASSERT_EQ(x.size(), 3U);
  // Pixels are written to 0.1, so a difference of two is within 0.1 and a mean within 0.1.
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.21);
  EXPECT_GT(x[1], x[0]);
  EXPECT_LT(y[1], y[2]);  // y grows downwards on the screen
  EXPECT_LT(y[2], y[0]);
  EXPECT_NEAR(y[2], 0.5 * (y[0] + y[1]), 0.11);
}

TEST(PlotSvg, LogarithmicAxisSpacesDecadesEvenly) {
  PlotOptions options;
  options.y_scale = AxisScale::kLogarithmic;
  const std::string svg =
      PlotSvg(options, {{"", {0.0, 1.0, 2.0}, {1e-6, 1e-3, 1.0}, PlotStyle::kPoints, {}}});
  const std::vector<double> y = Values(svg, "circle", "cy");
  ASSERT_EQ(y.size(), 3U);
  EXPECT_NEAR(y[0] - y[1], y[1] - y[2], 0.21);
}

TEST(PlotSvg, LeavesOutWhatIsNotFinite) {
  const std::vector<double> x = {0, 1, 2, 3, 4, 5};
  const std::vector<double> y = {1, 2, kNaN, 3, std::numeric_limits<double>::infinity(), 2};
  const std::string svg = PlotSvg({}, {{"", x, y, PlotStyle::kLineAndPoints, {}}});
  EXPECT_EQ(Count(svg, "<circle"), 4);
  EXPECT_EQ(Count(svg, "class=\"curve\""), 3);  // 0 to 1, 3 alone, 5 alone
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  EXPECT_EQ(svg.find("null"), std::string::npos);
}

TEST(PlotSvg, NonPositiveIsLeftOutOfALogarithmicAxis) {
  PlotOptions options;
  options.y_scale = AxisScale::kLogarithmic;
  const std::string svg =
      PlotSvg(options, {{"", {0, 1, 2}, {1.0, 0.0, -1.0}, PlotStyle::kPoints, {}}});
  EXPECT_EQ(Count(svg, "<circle"), 1);
}

TEST(PlotSvg, ErrorsAreBarsOfPointsAndABandOfALine) {
  const std::vector<double> x = {0, 1, 2};
  const std::string bars = PlotSvg({}, {{"", x, {1, 2, 3}, PlotStyle::kPoints, {0.1, 0.0, kNaN}}});
  EXPECT_EQ(Count(bars, "class=\"bar\""), 1);
  const std::string band = PlotSvg({}, {{"", x, {1, 2, 3}, PlotStyle::kLine, {0.1, 0.2, 0.3}}});
  EXPECT_EQ(Count(band, "class=\"band\""), 1);
}

TEST(PlotSvg, DegenerateDataStillPlots) {
  for (const std::vector<double>& y :
       {std::vector<double>{}, std::vector<double>{3.0}, std::vector<double>{kNaN},
        std::vector<double>{2.0, 2.0}, std::vector<double>{1.0, 1.0 + 1e-16},
        std::vector<double>{0.0, 0.0}}) {
    for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
      PlotOptions options;
      options.y_scale = scale;
      const std::string svg =
          PlotSvg(options, {{"a", std::vector<double>(y.size(), 1.0), y, {}, {}}});
      EXPECT_EQ(svg.find("null"), std::string::npos);
      EXPECT_NE(svg.find("</svg>"), std::string::npos);
    }
  }
}

TEST(PlotSvg, TextIsEscaped) {
  PlotOptions options;
  options.title = "<t>";
  options.x_label = "a&b";
  const std::string svg = PlotSvg(options, {{"\"l\"", {0, 1}, {0, 1}, {}, {}}});
  EXPECT_NE(svg.find("&lt;t&gt;"), std::string::npos);
  EXPECT_NE(svg.find("a&amp;b"), std::string::npos);
  EXPECT_NE(svg.find("&quot;l&quot;"), std::string::npos);
}

TEST(Thinned, ThinnedSeriesKeepTheirExtremes) {
  PlotSeries series{"s", {}, {}, PlotStyle::kPoints, {}};
  for (int i = 0; i < 10000; ++i) {
    series.x.push_back(0.01 * i);
    series.y.push_back(std::sin(0.01 * i));
  }
  series.y[4321] = 50.0;
  series.y[4322] = -60.0;
  series.y[7000] = NAN;
  const PlotSeries thin = Thinned(series, 100);
  EXPECT_EQ(thin.label, "s");
  EXPECT_EQ(thin.style, PlotStyle::kPoints);
  EXPECT_LE(thin.x.size(), 202u);
  EXPECT_GT(thin.x.size(), 190u);
  EXPECT_EQ(thin.x.front(), 0.0);
  EXPECT_EQ(thin.x.back(), series.x.back());
  EXPECT_TRUE(std::is_sorted(thin.x.begin(), thin.x.end()));
  EXPECT_EQ(*std::max_element(thin.y.begin(), thin.y.end()), 50.0);
  EXPECT_EQ(*std::min_element(thin.y.begin(), thin.y.end()), -60.0);
  // In each hundredth of the range of x the extremes are those of all points.
  double lowest = HUGE_VAL;
  for (size_t i = 0; i < series.x.size() && series.x[i] < 0.99; ++i) {
    lowest = std::min(lowest, series.y[i]);
  }
  EXPECT_EQ(thin.y[0], lowest);
}

TEST(Thinned, FewPointsAreNotThinned) {
  const PlotSeries series{"s", {3.0, 1.0, 2.0}, {1.0, 2.0, 3.0}, PlotStyle::kLine, {0.1, 0.2, 0.3}};
  const PlotSeries thin = Thinned(series, 2);
  EXPECT_EQ(thin.x, series.x);
  EXPECT_EQ(thin.error, series.error);
  // All at one place.
  const PlotSeries same{
      "", std::vector<double>(10, 1.0), {5, 4, 3, 2, 9, 8, 7, 6, 5, 5}, PlotStyle::kLine, {}};
  EXPECT_EQ(Thinned(same, 2).y, (std::vector<double>{5, 2, 9, 5}));
}

}  // namespace
}  // namespace tangible
