// SPDX-License-Identifier: Apache-2.0
//
// The cost of finding and evaluating a contact for each pair of shapes, and the saving by the broad
// phase.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tangible/geometry/broad_phase.h"
#include "tangible/geometry/collide.h"

namespace tangible {
namespace {

struct Body {
  ShapeType type;
  std::vector<double> numbers;
  ShapeView<double> View() const {
    return {type, numbers.data(), static_cast<int>(numbers.size())};
  }
};

Body RegularPolygon(int num_vertices) {
  Body body{ShapeType::kPolygon, {}};
  for (int i = 0; i < num_vertices; ++i) {
    const double angle = 2.0 * M_PI * i / num_vertices;
    body.numbers.push_back(std::cos(angle));
    body.numbers.push_back(std::sin(angle));
  }
  return body;
}

const Body kCircle{ShapeType::kCircle, {0.5}};
const Body kBox{ShapeType::kBox, {1.0, 1.0}};
const Body kCapsule{ShapeType::kCapsule, {1.0, 0.5}};
const Body kHalfPlane{ShapeType::kHalfPlane, {0.0, 1.0, 0.0}};

/// The second body is above the first, alternately a little nearer and farther, so that no branch
/// can be predicted.
void FindFeatures(benchmark::State& state, const Body& a, const Body& b, double distance,
                  double angle, double max_gap) {
  std::vector<Pose<double>> poses;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-0.01, 0.01);
  for (int i = 0; i < 256; ++i) {
    const double x = noise(random);
    poses.emplace_back(Vector2<double>(x + 0.1, distance + noise(random)), angle + noise(random));
  }
  const Pose<double> pose_a;
  std::size_t i = 0;
  int count = 0;
  for ([[maybe_unused]] auto _ : state) {
    ContactFeature features[2];
    count += FindContactFeatures(a.View(), pose_a, b.View(), poses[i++ % poses.size()], max_gap,
                                 features);
    benchmark::DoNotOptimize(features);
  }
  state.counters["contacts"] =
      benchmark::Counter(static_cast<double>(count), benchmark::Counter::kAvgIterations);
}

BENCHMARK_CAPTURE(FindFeatures, circle_circle, kCircle, kCircle, 1.0, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, circle_half_plane, kHalfPlane, kCircle, 0.5, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, box_half_plane, kHalfPlane, kBox, 0.5, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, capsule_circle, kCapsule, kCircle, 1.0, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, box_circle, kBox, kCircle, 1.0, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, capsule_capsule, kCapsule, kCapsule, 1.0, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, box_box_faces, kBox, kBox, 1.0, 0.0, 0.1);
BENCHMARK_CAPTURE(FindFeatures, box_box_corner, kBox, kBox, 1.2, 0.8, 0.1);
BENCHMARK_CAPTURE(FindFeatures, box_box_apart, kBox, kBox, 1.5, 0.8, 0.1);
BENCHMARK_CAPTURE(FindFeatures, polygon_polygon_8, RegularPolygon(8), RegularPolygon(8), 2.0, 0.1,
                  0.1);
BENCHMARK_CAPTURE(FindFeatures, polygon_polygon_64, RegularPolygon(64), RegularPolygon(64), 2.0,
                  0.1, 0.1);

template <typename T>
void Evaluate(benchmark::State& state) {
  const std::vector<T> numbers = {T(1.0), T(1.0)};
  const ShapeView<T> box{ShapeType::kBox, numbers.data(), 2};
  Pose<T> pose_a(Vector2<T>(T(0.0), T(0.0)), T(0.0));
  const Pose<T> pose_b(Vector2<T>(T(0.1), T(1.0)), T(0.1));
  const ContactFeature feature{FeatureKind::kEdgeVertex, 2, 0};
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(pose_a);
    benchmark::DoNotOptimize(EvaluateContact(feature, box, pose_a, box, pose_b));
  }
}
BENCHMARK_TEMPLATE(Evaluate, double);
BENCHMARK_TEMPLATE(Evaluate, LocalJet);

/// Unit boxes scattered so that each meets about one other, in 16 states of a slow motion.
class Scatter {
 public:
  explicit Scatter(int count) : frames_(16) {
    const double extent = std::sqrt(2.0 * count);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(0.0, extent);
    std::uniform_real_distribution<double> speed(-0.01, 0.01);
    for (int i = 0; i < count; ++i) {
      const double x = place(random);
      const double y = place(random);
      const double v = speed(random);
      for (int k = 0; k < 16; ++k) {
        const double at = x + v * (k < 8 ? k : 16 - k);
        frames_[k].push_back({at, y, at + 1.0, y + 1.0});
      }
    }
  }
  const std::vector<Aabb>& Next() { return frames_[next_++ % frames_.size()]; }

 private:
  std::vector<std::vector<Aabb>> frames_;
  std::size_t next_ = 0;
};

void SortAndSweep(benchmark::State& state) {
  Scatter scatter(static_cast<int>(state.range(0)));
  BroadPhase broad_phase;
  std::vector<std::pair<int, int>> pairs;
  for ([[maybe_unused]] auto _ : state) {
    broad_phase.FindPairs(
        scatter.Next(), [](int, int) { return true; }, &pairs);
    benchmark::DoNotOptimize(pairs.data());
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
}
BENCHMARK(SortAndSweep)->RangeMultiplier(2)->Range(8, 4096);

void AllPairs(benchmark::State& state) {
  Scatter scatter(static_cast<int>(state.range(0)));
  std::vector<std::pair<int, int>> pairs;
  for ([[maybe_unused]] auto _ : state) {
    const std::vector<Aabb>& boxes = scatter.Next();
    pairs.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = i + 1; j < boxes.size(); ++j) {
        if (boxes[i].min_x <= boxes[j].max_x && boxes[j].min_x <= boxes[i].max_x &&
            boxes[i].min_y <= boxes[j].max_y && boxes[j].min_y <= boxes[i].max_y) {
          pairs.emplace_back(static_cast<int>(i), static_cast<int>(j));
        }
      }
    }
    benchmark::DoNotOptimize(pairs.data());
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
}
BENCHMARK(AllPairs)->RangeMultiplier(2)->Range(8, 4096);

}  // namespace
}  // namespace tangible
