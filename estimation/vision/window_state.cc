// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/window_state.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tangible/estimation/vision/tolerances.h"

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

// The state of one disc `frames` later by uniform motion.
void Move(const double* from, double frames, double* to) {
  for (int c = 0; c < 2; ++c) {
    to[c] = from[c] + frames * from[2 + c];
    to[2 + c] = from[2 + c];
  }
}

}  // namespace

// The positions of one disc in a window.
class WindowState::Track {
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
  /// Whether the disc met something between the last two frames.
  bool MetAtEnd() const { return last_ >= 2 && !Uniform(last_ - 1); }
  /// Whether it also met something in the frames before.
  bool MetTwice() const { return last_ >= 3 && MetAtEnd() && !Uniform(last_ - 2); }
  Vector2<double> End() const { return {x_[last_], y_[last_]}; }
  Vector2<double> LastStep() const {
    return {x_[last_] - x_[last_ - 1], y_[last_] - y_[last_ - 1]};
  }

 private:
  int last_;
  std::vector<double> x_, y_;
};

WindowState::WindowState(const DiscWorld& world)
    : world_(world), function_(RolloutOf(world, 2)), worker_(function_) {}

RolloutOutput WindowState::Run(const States& start) {
  RolloutInput input;
  input.state = EngineState(start.data(), world_.size());
  return worker_.Run(input);
}

// The velocity of the disc by a run from `start` frames before the last, if that run ends nearer
// than `least` to the last position seen.
void WindowState::ByEngine(const Track& track, int disc, const RolloutOutput& found, int start,
                           double* least, double* state) {
  if (found.status != RolloutStatus::kDone) return;
  const auto at = [&](int frame, int first) -> Vector2<double> {
    return {found.states(frame, 6 * disc + first), found.states(frame, 6 * disc + first + 1)};
  };
  const double miss = (at(start, 0) - track.End()).norm();
  if (miss > *least) return;
  *least = miss;
  // The disc met something before the last two frames, which therefore show its velocity.
  const bool straight =
      start > 1 && (at(start, 0) - at(start - 1, 0) - at(start, 3)).norm() < kStraight;
  const Vector2<double> velocity = straight ? track.LastStep() : at(start, 3);
  state[2] = velocity.x();
  state[3] = velocity.y();
}

// The velocities of two discs that met each other and nothing else.
void WindowState::ByImpulse(const std::vector<Track>& tracks, const States& before,
                            States* states) const {
  std::vector<int> met;
  for (int i = 0; i < world_.size(); ++i) {
    if (tracks[i].MetAtEnd()) met.push_back(i);
  }
  if (met.size() != 2) return;
  const int i = met[0], j = met[1];
  // The momentum received, times the time since.
  const auto received = [&](int k) -> Vector2<double> {
    std::array<double, 4> free{};
    Move(&before[4 * k], 1.0, free.data());
    return world_.masses[k] * (tracks[k].End() - Vector2<double>(free[0], free[1]));
  };
  const Vector2<double> both = 0.5 * (received(i) - received(j));
  const double mass = std::min(world_.masses[i], world_.masses[j]);
  // One of them met something else too.
  if ((received(i) + received(j)).norm() > 2.0 * mass * kUniformMotion) return;
  if (both.norm() < mass * kImpulseSeen) return;
  const Vector2<double> n = both.normalized();
  const auto apart = [&](int c) { return before[4 * i + c] - before[4 * j + c]; };
  const Vector2<double> r(apart(0), apart(1)), v(apart(2), apart(3));
  const double impulse = -(1.0 + world_.disc_restitution) * v.dot(n) /
                         (1.0 / world_.masses[i] + 1.0 / world_.masses[j]);
  if (impulse <= 0.0) return;
  // If their free motion does not lead to each other, they met two walls.
  const double nearest = std::clamp(-r.dot(v) / v.squaredNorm(), 0.0, 1.0);
  if ((r + nearest * v).norm() > world_.radii[i] + world_.radii[j] + kUniformMotion) return;
  for (int c = 0; c < 2; ++c) {
    (*states)[4 * i + 2 + c] = before[4 * i + 2 + c] + impulse / world_.masses[i] * n[c];
    (*states)[4 * j + 2 + c] = before[4 * j + 2 + c] - impulse / world_.masses[j] * n[c];
  }
}

std::vector<double> WindowState::operator()(const std::vector<double>& seen, int frames) {
  const int n = world_.size(), last = frames - 1;
  // At the last frame, at the one before, and at the one before that.
  States states(4 * static_cast<size_t>(n)), before = states, early = states;
  std::vector<Track> tracks;
  bool met = false, twice = false;
  for (int i = 0; i < n; ++i) {
    const Track& track = tracks.emplace_back(seen, frames, i, n);
    track.Put(track.UniformFrom(last), last, &states[4 * i]);
    if (track.MetAtEnd()) {
      track.Put(track.UniformFrom(last - 1), last - 1, &before[4 * i]);
    } else {
      Move(&states[4 * i], -1.0, &before[4 * i]);
    }
    if (track.MetTwice()) {
      track.Put(track.UniformFrom(last - 2), last - 2, &early[4 * i]);
    } else {
      Move(&before[4 * i], -1.0, &early[4 * i]);
    }
    met = met || track.MetAtEnd();
    twice = twice || track.MetTwice();
  }
  if (!met) return states;
  const RolloutOutput by_late = Run(before);
  const RolloutOutput by_early = twice ? Run(early) : RolloutOutput();
  for (int i = 0; i < n; ++i) {
    if (!tracks[i].MetAtEnd()) continue;
    double least = kImpactMissed;
    ByEngine(tracks[i], i, by_late, 1, &least, &states[4 * i]);
    if (tracks[i].MetTwice()) ByEngine(tracks[i], i, by_early, 2, &least, &states[4 * i]);
  }
  if (!twice) ByImpulse(tracks, before, &states);
  return states;
}

}  // namespace tangible
