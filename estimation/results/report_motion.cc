// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/report_motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "tangible/estimation/results/residual_summary.h"
#include "tangible/math/decompositions.h"
#include "tangible/render/recorder/view_recorder.h"

namespace tangible {
namespace {

// Frames beside those at observations, over the run.
constexpr double kLeastFrames = 300.0;
// m from the centre of a body without joints: the end of it that shows an angle.
constexpr double kArm = 0.1;

/// Follows a run, and keeps the latest observation of each place.
class MarkKeeper {
 public:
  /// `values`: the residuals of the run's observations, in multiples of sigma.
  MarkKeeper(const RolloutResiduals& run, Eigen::VectorXd values)
      : run_(run), values_(std::move(values)), order_(run.observations().size()) {
    std::iota(order_.begin(), order_.end(), 0);
    for (size_t i = 0; i < order_.size(); ++i) {
      const Observation& one = run.observations()[i];
      times_.push_back(one.event >= 0
                           ? HUGE_VAL
                           : RunTime(run.scene().instruments(), run.ChannelOf(one), one.time));
      placed_[one.body] = placed_[one.body] || IsPlace(one.coordinate);
    }
    std::stable_sort(order_.begin(), order_.end(),
                     [this](int a, int b) { return times_[a] < times_[b]; });
  }

  /// Whether anything was observed since the last call, up to t.
  bool Add(double t, const State<double>& state) {
    bool any = false;
    while (next_ < order_.size() && times_[order_[next_]] <= t) {
      // The rows of a place at one time belong together.
      const int first = order_[next_];
      std::map<std::pair<int, int>, std::vector<int>> places;
      for (; next_ < order_.size() && times_[order_[next_]] == times_[first]; ++next_) {
        const Observation& one = run_.observations()[order_[next_]];
        if (one.body >= 0) places[{one.body, one.point}].push_back(order_[next_]);
      }
      for (const auto& [place, rows] : places) any = Mark(place, rows, t, state) || any;
    }
    return any;
  }

  std::vector<ViewMark> marks() const {
    std::vector<ViewMark> all;
    for (const auto& [place, mark] : marks_) all.push_back(mark);
    return all;
  }

 private:
  static bool IsPlace(Coordinate coordinate) {
    return coordinate == Coordinate::kX || coordinate == Coordinate::kY;
  }

  bool Mark(const std::pair<int, int>& place, const std::vector<int>& rows, double t,
            const State<double>& state) {
    const auto body = static_cast<size_t>(place.first);
    const double back = times_[rows.front()] - t;
    Vector3<double> pose;
    for (size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      pose[k] = state.pose[3 * body + i] + back * state.twist[3 * body + i];
    }
    const bool by_angle = !placed_[place.first];
    Vector2<double> at = by_angle ? Arm(place.first) : Vector2<double>(0.0, 0.0);
    if (place.second >= 0 && !by_angle) {
      at = run_.scene().points()[static_cast<size_t>(place.second)].at;
    }
    const auto placed = [&](double angle) -> Vector2<double> {
      return {pose[0] + std::cos(angle) * at.x() - std::sin(angle) * at.y(),
              pose[1] + std::sin(angle) * at.x() + std::cos(angle) * at.y()};
    };
    ViewMark mark;
    mark.fitted = placed(pose[2]);
    RowMatrixXd by_place = RowMatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), 2);
    Eigen::VectorXd differences = Eigen::VectorXd::Zero(by_place.rows());
    bool any = false;
    for (size_t i = 0; i < rows.size(); ++i) {
      const Observation& one = run_.observations()[rows[i]];
      const double difference = values_[rows[i]] * one.sigma;
      if (by_angle && one.coordinate == Coordinate::kAngle) {
        mark.observed = placed(pose[2] - difference);
        marks_[place] = mark;
        return true;
      }
      if (!IsPlace(one.coordinate)) continue;
      const Prediction prediction = run_.PredictionIn(rows[i], state);
      const auto k = static_cast<Eigen::Index>(i);
      by_place.row(k) << prediction.by_state[0][0], prediction.by_state[0][1];
      differences[k] = difference;
      any = true;
    }
    if (!any) return false;
    const OrthogonalDecomposition solver(by_place);
    mark.observed = mark.fitted - Vector2<double>(solver.Solve(differences));
    marks_[place] = mark;
    return true;
  }

  // The joint that is farthest from the body's centre, in its frame.
  Vector2<double> Arm(int body) const {
    const Scene& scene = run_.scene().scene();
    Vector2<double> arm(kArm, 0.0);
    double longest = 0.0;
    for (const BasicJoint<double>& joint : scene.joints) {
      if (joint.bodies[0] != body && joint.bodies[1] != body) continue;
      const BasicBody<double>& of = scene.bodies[static_cast<size_t>(body)];
      const Vector2<double> from = joint.anchors[0] - of.position;
      if (!(from.norm() > longest)) continue;
      longest = from.norm();
      // The end that is away from the joint moves most.
      arm = {-std::cos(of.angle) * from.x() - std::sin(of.angle) * from.y(),
             std::sin(of.angle) * from.x() - std::cos(of.angle) * from.y()};
    }
    return arm;
  }

  const RolloutResiduals& run_;
  Eigen::VectorXd values_;
  std::vector<int> order_;      ///< observations by time
  std::vector<double> times_;   ///< in the run, of each
  std::map<int, bool> placed_;  ///< whether a place of a body is measured
  size_t next_ = 0;
  std::map<std::pair<int, int>, ViewMark> marks_;
};

}  // namespace

int WorstRecording(const RecordingsProblem& problem, const FitResult& result) {
  int worst = 0;
  double largest = -1.0;
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const double rms = RmsOfRecording(problem, result.residuals, b);
    if (rms > largest) {
      largest = rms;
      worst = b;
    }
  }
  return worst;
}

std::optional<ViewData> ObservedMotion(const RecordingsProblem& problem, const FitResult& result,
                                       int recording) {
  if (problem.HasNoise()) return std::nullopt;
  const RolloutResiduals& fitted = problem.recordings()[static_cast<size_t>(recording)].residuals;
  RolloutResiduals run(fitted.scene(), fitted.observations(), fitted.channels());
  if (!run.SetParameters(problem.ParametersOf(recording, result.estimate))) return std::nullopt;
  Eigen::Index first = 0;
  for (int b = 0; b < recording; ++b) first += problem.num_observation_rows(b);
  const Model<double>& model = run.scene().model();
  ViewRecorder view(run.scene().scene(), model);
  MarkKeeper keeper(run, result.residuals.segment(first, run.num_residuals()));
  const double spacing = model.structure->settings.duration / kLeastFrames;
  double due = 0.0;
  State<double> final;
  const RolloutReport report = Rollout(
      model, run.scene().initial_state(),
      [&](long /*k*/, double t, const State<double>& state, Stepper* stepper) {
        if (!keeper.Add(t, state) && t < due) return;
        due = t + spacing;
        view.Add(model, t, state, stepper == nullptr ? nullptr : &stepper->record());
        view.mutable_data()->frames.back().marks = keeper.marks();
      },
      &final);
  if (report.status != StepStatus::kDone) return std::nullopt;
  return std::move(*view.mutable_data());
}

}  // namespace tangible
