// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tangible/render/plot.h"

namespace tangible::closed_forms {
namespace {

constexpr char kTrapezoidal[] = "event, trapezoidal";
constexpr char kRungeKutta[] = "event, runge_kutta_4";

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

std::string OrderText(double order) { return std::isnan(order) ? "-" : Format("%.1f", order); }

// Three cells: errors of values and derivatives, and the order of the latter.
std::string Cells(const Study& study) {
  if (!study.message.empty()) return "  failed: " + study.message;
  const Errors& errors = study.errors.back();
  return Format("  %7.0e %7.0e %5s", errors.value, errors.derivative,
                OrderText(study.derivative_order).c_str());
}

OrderedJson OrNull(double value) {
  return std::isnan(value) ? OrderedJson(nullptr) : OrderedJson(value);
}

}  // namespace

std::vector<Study> RunAllStudies() {
  std::vector<Study> studies;
  for (const ClosedForm& form : AllClosedForms()) {
    for (const Scheme& scheme : AllSchemes()) {
      studies.push_back(RunStudy(form, scheme, {50, 100, 200, 400, 800}));
    }
  }
  return studies;
}

std::vector<std::string> BrokenBounds(const std::vector<Study>& studies) {
  std::vector<std::string> broken;
  for (const Study& study : studies) {
    const std::string name = study.form + ", " + study.scheme + ": ";
    if (!study.message.empty()) {
      broken.push_back(name + study.message);
      continue;
    }
    const bool trapezoidal = study.scheme == kTrapezoidal;
    if (!trapezoidal && study.scheme != kRungeKutta) continue;
    if (study.kind != Kind::kSmooth) {
      for (size_t i = 0; i < study.errors.size(); ++i) {
        const Errors& errors = study.errors[i];
        if (!(errors.over_bound <= 1.0)) {
          broken.push_back(
              name + errors.worst + " is off by " +
              Format("%.1e of its bound in %d steps", errors.over_bound, study.steps[i]));
        }
      }
      continue;
    }
    const double least = trapezoidal ? 1.9 : 3.8;
    if (!(std::min(study.value_order, study.derivative_order) >= least)) {
      broken.push_back(name + Format("orders %.2f and %.2f, expected %.1f", study.value_order,
                                     study.derivative_order, least));
    }
  }
  return broken;
}

std::string TableText(const std::vector<Study>& studies) {
  const std::vector<std::string> shown = {"fixed", kTrapezoidal, kRungeKutta};
  std::string text = Format("%-27s", "");
  for (const std::string& scheme : shown) text += Format("  %-21s", scheme.c_str());
  text += "\n" + Format("%-27s", "case");
  for (size_t i = 0; i < shown.size(); ++i) {
    text += Format("  %7s %7s %5s", "value", "deriv.", "order");
  }
  text += "\n";
  std::string form;
  for (const Study& study : studies) {
    if (study.form != form) {
      text += (form.empty() ? "" : "\n") + Format("%-27s", study.form.c_str());
      form = study.form;
    }
    if (std::find(shown.begin(), shown.end(), study.scheme) != shown.end()) text += Cells(study);
  }
  return text + "\n";
}

OrderedJson ToJson(const std::vector<Study>& studies) {
  OrderedJson list = OrderedJson::array();
  for (const Study& study : studies) {
    OrderedJson errors = OrderedJson::array();
    for (size_t i = 0; i < study.errors.size(); ++i) {
      errors.push_back({{"dt", study.dt[i]},
                        {"value", study.errors[i].value},
                        {"derivative", study.errors[i].derivative},
                        {"over_bound", study.errors[i].over_bound},
                        {"worst", study.errors[i].worst}});
    }
    list.push_back({{"case", study.form},
                    {"scheme", study.scheme},
                    {"message", study.message},
                    {"value_order", OrNull(study.value_order)},
                    {"derivative_order", OrNull(study.derivative_order)},
                    {"errors", errors}});
  }
  return {{"studies", list}, {"broken_bounds", BrokenBounds(studies)}};
}

std::string Picture(const std::vector<Study>& studies) {
  PlotOptions options;
  options.title = "Error of derivatives against closed forms";
  options.x_label = "dt (s)";
  options.y_label = "error / largest derivative";
  options.x_scale = AxisScale::kLogarithmic;
  options.y_scale = AxisScale::kLogarithmic;
  options.height = 420;
  std::vector<PlotSeries> series;
  for (const Study& study : studies) {
    const bool bounce = study.form == "drop, one bounce";
    if (!bounce && study.form != "double pendulum") continue;
    PlotSeries curve;
    curve.label = (bounce ? "bounce: " : "double pendulum: ") + study.scheme;
    curve.style = PlotStyle::kLineAndPoints;
    curve.x = study.dt;
    for (const Errors& errors : study.errors) curve.y.push_back(errors.derivative);
    series.push_back(curve);
  }
  return PlotSvg(options, series);
}

}  // namespace tangible::closed_forms
