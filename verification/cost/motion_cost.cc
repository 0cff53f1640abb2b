// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/motion_cost.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "tangible/math/cpu_time.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/verification/cost/benchmark_scenes.h"

namespace tangible::cost {
namespace {

constexpr double kHighShare = 0.99;
constexpr double kMicrosecond = 1e6;  // in a second

Scene Bouncing(int discs) {
  Scene scene = DiscsScene(discs);
  scene.simulation.stepping = Stepping::kEvent;
  for (BasicBody<double>& body : scene.bodies) body.restitution = 0.5;
  return scene;
}

std::string TimesText(const StepTimes& times) {
  char text[64];
  std::snprintf(text, sizeof(text), "%10.1f %10.1f", times.mean, times.high);
  return text;
}

OrderedJson ToJson(const StepTimes& times) {
  return {{"mean_us", times.mean}, {"percentile_99_us", times.high}};
}

}  // namespace

StepTimes TimesOf(std::vector<double> times) {
  if (times.empty()) return {};
  const double sum = std::accumulate(times.begin(), times.end(), 0.0);
  const auto rank =
      static_cast<std::ptrdiff_t>(std::ceil(kHighShare * static_cast<double>(times.size())));
  std::nth_element(times.begin(), times.begin() + rank - 1, times.end());
  return {sum / static_cast<double>(times.size()), times[static_cast<size_t>(rank) - 1]};
}

MotionRow MeasureMotion(const std::string& name, const Scene& scene, const MotionOptions& options) {
  MotionRow row;
  row.scene = name;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  row.bodies = model.structure->num_blocks();
  Stepper stepper(model);
  const double dt = scene.simulation.dt;
  const long settled = static_cast<long>(options.moving_steps) + options.settling_steps;
  std::vector<double> moving_times, settled_times;
  double in_events = 0.0;
  for (long k = 0; k < settled + options.moving_steps; ++k) {
    const double start = ThreadCpuSeconds();
    const double t = static_cast<double>(k) * dt;
    const StepReport report = stepper.Step(model, t, dt, &state);
    const double time = kMicrosecond * (ThreadCpuSeconds() - start);
    if (report.status != StepStatus::kDone) {
      row.message = FailureMessage(report, t, k);
      break;
    }
    row.residual_max = std::max(row.residual_max, report.residual);
    if (k < options.moving_steps) {
      moving_times.push_back(time);
      row.events += report.events;
      in_events += time;
    } else if (k >= settled) {
      settled_times.push_back(time);
    }
  }
  row.moving = TimesOf(std::move(moving_times));
  row.settled = TimesOf(std::move(settled_times));
  if (row.events > 0) row.event_time = in_events / static_cast<double>(row.events);
  return row;
}

int NumMotionRows(const MotionOptions& options) {
  return static_cast<int>(options.discs.size() + options.bouncing.size() + options.pyramids.size());
}

std::vector<MotionRow> MeasureAllMotion(const MotionOptions& options,
                                        const std::function<void(long)>& done) {
  std::vector<MotionRow> rows;
  const auto add = [&](const std::string& name, const Scene& scene) {
    rows.push_back(MeasureMotion(name, scene, options));
    done(static_cast<long>(rows.size()));
  };
  for (const int n : options.discs) add(std::to_string(n) + " discs that fall", DiscsScene(n));
  for (const int n : options.pyramids) {
    add("pyramid of " + std::to_string(n * (n + 1) / 2) + " boxes", PyramidScene(n));
  }
  for (const int n : options.bouncing) {
    add(std::to_string(n) + " discs that bounce, by events", Bouncing(n));
  }
  return rows;
}

std::string MotionText(const std::vector<MotionRow>& rows) {
  char line[160];
  std::snprintf(line, sizeof(line), "%-34s %21s %21s %8s %10s %9s\n", "CPU time of a step, us",
                "in motion: mean   99 %", "settled: mean   99 %", "events", "an event", "residual");
  std::string text = line;
  for (const MotionRow& row : rows) {
    std::snprintf(line, sizeof(line), "%-34s ", row.scene.c_str());
    text += line + TimesText(row.moving) + " " + TimesText(row.settled);
    if (row.events > 0) {
      std::snprintf(line, sizeof(line), " %8ld %10.1f", row.events, row.event_time);
    } else {
      std::snprintf(line, sizeof(line), " %8s %10s", "-", "-");
    }
    text += line;
    std::snprintf(line, sizeof(line), " %9.1e", row.residual_max);
    text += line + (row.message.empty() ? "" : "  " + row.message) + "\n";
  }
  return text;
}

OrderedJson ToJson(const std::vector<MotionRow>& rows) {
  OrderedJson json = OrderedJson::array();
  for (const MotionRow& row : rows) {
    OrderedJson one = {{"scene", row.scene},
                       {"bodies", row.bodies},
                       {"in_motion", ToJson(row.moving)},
                       {"settled", ToJson(row.settled)},
                       {"residual_max", row.residual_max},
                       {"message", row.message}};
    if (row.events > 0) {
      one["events"] = row.events;
      one["event_us"] = row.event_time;
    }
    json.push_back(std::move(one));
  }
  return json;
}

}  // namespace tangible::cost
