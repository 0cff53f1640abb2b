// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/window_state.h"

#include <algorithm>
#include <cmath>

namespace tangible {
namespace {

// A line through positions x[first], ..., x[last] of one coordinate: value at `last` and slope.
std::pair<double, double> Line(const std::vector<double>& x, int first, int last) {
  const int count = last - first + 1;
  double mean = 0.0, slope = 0.0, square = 0.0;
  for (int k = first; k <= last; ++k) mean += x[k] / count;
  for (int k = first; k <= last; ++k) {
    const double t = k - 0.5 * (first + last);
    slope += t * (x[k] - mean);
    square += t * t;
  }
  slope /= square;
  return {mean + slope * 0.5 * (count - 1), slope};
}

// One disc's positions in a window.
class Track {
 public:
  Track(const std::vector<double>& seen, int frames, int disc, int discs) : last_(frames - 1) {
    for (int k = 0; k < frames; ++k) {
      x_.push_back(seen[2 * (k * discs + disc)]);
      y_.push_back(seen[2 * (k * discs + disc) + 1]);
    }
  }
  /// Whether the motion around frame k, 0 < k < frames − 1, is uniform.
  bool Uniform(int k) const {
    return std::hypot(x_[k + 1] - 2.0 * x_[k] + x_[k - 1], y_[k + 1] - 2.0 * y_[k] + y_[k - 1]) <
           kUniformMotion;
  }
  /// The first frame of the uniform motion that ends at frame `end`.
  int UniformFrom(int end) const {
    int first = end - 1;
    while (first > 0 && Uniform(first)) --first;
    return first;
  }
  /// The state at frame `end` by a line from frame `first`.
  void Put(int first, int end, double* state) const {
    std::tie(state[0], state[2]) = Line(x_, first, end);
    std::tie(state[1], state[3]) = Line(y_, first, end);
    if (end - first < 2 || std::hypot(state[2], state[3]) > kRests) return;
    for (int c = 0; c < 2; ++c) {
      state[c] -= 0.5 * (end - first) * state[2 + c];
      state[2 + c] = 0.0;
    }
  }
  /// Something was met between the last two frames, and nothing just before.
  bool MetAtEnd() const {
    return last_ >= 2 && !Uniform(last_ - 1) && (last_ == 2 || Uniform(last_ - 2));
  }
  double x() const { return x_[last_]; }
  double y() const { return y_[last_]; }

 private:
  int last_;
  std::vector<double> x_, y_;
};

}  // namespace

WindowState::WindowState(const DiscWorld& world)
    : function_(RolloutOf(world, 1)), worker_(function_), discs_(world.size()) {}

std::vector<double> WindowState::operator()(const std::vector<double>& seen, int frames) {
  std::vector<double> states(4 * static_cast<size_t>(discs_));
  std::vector<double> before = states;
  std::vector<Track> tracks;
  bool met = false;
  for (int i = 0; i < discs_; ++i) {
    const Track& track = tracks.emplace_back(seen, frames, i, discs_);
    track.Put(track.UniformFrom(frames - 1), frames - 1, &states[4 * i]);
    if (track.MetAtEnd()) {
      track.Put(track.UniformFrom(frames - 2), frames - 2, &before[4 * i]);
      met = true;
    } else {
      for (int c = 0; c < 2; ++c) {
        before[4 * i + c] = states[4 * i + c] - states[4 * i + 2 + c];
        before[4 * i + 2 + c] = states[4 * i + 2 + c];
      }
    }
  }
  if (!met) return states;
  RolloutInput input;
  input.state = EngineState(before.data(), discs_);
  const RolloutOutput output = worker_.Run(input);
  if (output.status != RolloutStatus::kDone) return states;
  for (int i = 0; i < discs_; ++i) {
    if (!tracks[i].MetAtEnd()) continue;
    const double* found = output.states.row(1).data() + 6 * static_cast<std::ptrdiff_t>(i);
    if (std::hypot(found[0] - tracks[i].x(), found[1] - tracks[i].y()) > kImpactMissed) continue;
    states[4 * i + 2] = found[3];
    states[4 * i + 3] = found[4];
  }
  return states;
}

}  // namespace tangible
