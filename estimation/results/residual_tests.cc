// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/residual_tests.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "tangible/estimation/results/tolerances.h"
#include "tangible/estimation/uncertainty/binned_test.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/simulation/certificate/impact_times.h"

namespace tangible {
namespace {

constexpr int kResidualBins = 20;
constexpr int kResidualBuckets = 200;
// Rows of the table, and plots.
constexpr size_t kMostTested = 40;
constexpr size_t kMostDrawn = 12;
// Impacts that are marked.
constexpr size_t kMostImpacts = 60;
// Of more recordings the first are examined.
constexpr int kMostExamined = 100;

/// Residuals of one coordinate against one quantity.
struct Against {
  std::string coordinate, quantity, unit;
  std::vector<double> x, residuals;
  BinnedTest test{};
};

class AgainstAll {
 public:
  AgainstAll(const RecordingsProblem& problem, const FitResult& result)
      : problem_(problem), result_(result) {}

  std::vector<Against> Collect() {
    Eigen::Index first = 0;
    for (int b = 0; b < std::min(problem_.num_blocks(), kMostExamined); ++b) {
      AddRecording(b, first);
      first += problem_.num_observation_rows(b);
    }
    std::vector<Against> all;
    for (auto& [key, one] : by_key_) {
      const auto [low, high] = std::minmax_element(one.x.begin(), one.x.end());
      if (*high - *low <= kNoRange * std::max(std::abs(*low), std::abs(*high))) continue;
      one.test = TestBins(one.x, one.residuals, kResidualBins);
      if (!one.test.at.empty()) all.push_back(std::move(one));
    }
    std::stable_sort(all.begin(), all.end(), [](const Against& a, const Against& b) {
      return a.test.p_value != b.test.p_value ? a.test.p_value < b.test.p_value
                                              : a.test.share > b.test.share;
    });
    return all;
  }
  const std::vector<double>& impacts() const { return impacts_; }

 private:
  void AddRecording(int b, Eigen::Index first) {
    const RolloutResiduals& fitted = problem_.recordings()[static_cast<size_t>(b)].residuals;
    RolloutResiduals run(fitted.scene(), fitted.observations(), fitted.channels());
    if (!run.SetParameters(problem_.ParametersOf(b, result_.estimate))) return;
    const auto& observations = run.observations();
    std::vector<double> times;
    times.reserve(observations.size());
    for (const Observation& one : observations) {
      times.push_back(one.body < 0 || one.event >= 0
                          ? HUGE_VAL
                          : RunTime(run.scene().instruments(), run.ChannelOf(one), one.time));
    }
    std::vector<size_t> order(observations.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&times](size_t x, size_t y) { return times[x] < times[y]; });
    const Model<double>& model = run.scene().model();
    size_t next = 0;
    State<double> final;
    Rollout(
        model, run.scene().initial_state(),
        [&](long /*k*/, double t, const State<double>& state, Stepper* /*stepper*/) {
          for (; next < order.size() && times[order[next]] <= t; ++next) {
            const size_t i = order[next];
            AddOne(run, observations[i], times[i] - t, state,
                   result_.residuals[first + static_cast<Eigen::Index>(i)]);
          }
        },
        &final);
    if (problem_.num_blocks() > 1) return;
    for (const BodyImpact& impact : FindImpacts(model, run.scene().initial_state())) {
      if (impacts_.size() < kMostImpacts) impacts_.push_back(impact.time);
    }
  }

  void AddOne(const RolloutResiduals& run, const Observation& one, double back,
              const State<double>& state, double residual) {
    const auto body = static_cast<size_t>(one.body);
    const Scene& scene = run.scene().scene();
    const auto angle_of = [&](int of) {
      const size_t at = 3 * static_cast<size_t>(of) + 2;
      return state.pose[at] + back * state.twist[at];
    };
    const auto add = [&](const std::string& quantity, const char* unit, double x) {
      const std::string target =
          TargetName({scene, run.scene().points(), run.scene().instruments()}, one);
      const std::string coordinate = target + " " + NameOf(one.coordinate);
      Against& against = by_key_[coordinate + "|" + quantity];
      against.coordinate = coordinate;
      against.quantity = quantity;
      against.unit = unit;
      against.x.push_back(x);
      against.residuals.push_back(residual);
    };
    add("time", "s", one.time);
    add("angle of " + scene.bodies[body].name, "rad", angle_of(one.body));
    for (const BasicJoint<double>& joint : scene.joints) {
      const int other = joint.bodies[0] == one.body ? joint.bodies[1] : joint.bodies[0];
      if ((joint.bodies[0] != one.body && joint.bodies[1] != one.body) || other < 0) continue;
      const BasicBody<double>& beside = scene.bodies[static_cast<size_t>(other)];
      if (beside.motion == Motion::kStatic) continue;
      add("angle relative to " + beside.name, "rad", angle_of(one.body) - angle_of(other));
    }
    add("speed of " + scene.bodies[body].name, "m/s",
        std::hypot(state.twist[3 * body], state.twist[3 * body + 1]));
    if (one.coordinate != Coordinate::kX && one.coordinate != Coordinate::kY) return;
    const Channel& channel = run.ChannelOf(one);
    Vector2<double> centre(0.0, 0.0), at(0.0, 0.0);
    if (channel.camera >= 0) {
      centre = run.scene().instruments().cameras[static_cast<size_t>(channel.camera)].origin;
    }
    if (one.point >= 0) at = run.scene().points()[static_cast<size_t>(one.point)].at;
    const double angle = angle_of(one.body);
    add("image radius", "m",
        std::hypot(
            state.pose[3 * body] + std::cos(angle) * at.x() - std::sin(angle) * at.y() - centre.x(),
            state.pose[3 * body + 1] + std::sin(angle) * at.x() + std::cos(angle) * at.y() -
                centre.y()));
  }

  const RecordingsProblem& problem_;
  const FitResult& result_;
  std::map<std::string, Against> by_key_;
  std::vector<double> impacts_;
};

std::string PlotAgainst(const Against& one, const std::vector<double>& impacts) {
  std::vector<PlotSeries> series = {
      Thinned({"", one.x, one.residuals, PlotStyle::kPoints, {}}, kResidualBuckets),
      {"mean", one.test.at, one.test.mean, PlotStyle::kLineAndPoints, {}}};
  if (one.quantity == "time" && !impacts.empty()) {
    const auto [low, high] = std::minmax_element(one.residuals.begin(), one.residuals.end());
    PlotSeries marks{"impacts", {}, {}, PlotStyle::kLine, {}};
    for (const double time : impacts) {
      marks.x.insert(marks.x.end(), {time, time, time});
      marks.y.insert(marks.y.end(), {*low, *high, NAN});
    }
    series.push_back(std::move(marks));
  }
  return PlotSvg({.title = one.coordinate + " against " + one.quantity,
                  .x_label = one.quantity + " (" + one.unit + ")",
                  .y_label = "fitted − observed (sigma)",
                  .height = 240},
                 series);
}

}  // namespace

std::string ResidualTestsPart(const RecordingsProblem& problem, const FitResult& result) {
  if (problem.HasNoise()) return "";
  AgainstAll against(problem, result);
  const std::vector<Against> all = against.Collect();
  if (all.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  std::string plots;
  for (size_t i = 0; i < std::min(all.size(), kMostTested); ++i) {
    const Against& one = all[i];
    rows.push_back({one.coordinate, one.quantity, std::to_string(one.x.size()),
                    CompactNumber(100.0 * one.test.share, 3) + " %",
                    CompactNumber(one.test.p_value, 3)});
    if (i < kMostDrawn) plots += PlotAgainst(one, against.impacts());
  }
  return "<details>\n<summary><h2>Residuals against what moves</h2></summary>\n<p>The residuals of "
         "each coordinate in bins of a quantity: the share of their variance that lies between the "
         "bins, and the probability of as much by chance if they were independent. The clearest "
         "are "
         "drawn.</p>\n" +
         HtmlTable({"coordinate", "against", "measured", "between the bins", "by chance"}, rows) +
         plots + "</details>\n";
}

}  // namespace tangible
