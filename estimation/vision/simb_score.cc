// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/simb_score.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <stdexcept>

#include "tangible/estimation/vision/window_state.h"

namespace tangible {
namespace {

constexpr int kAhead = 2 * kSimbHorizon;

// The value below which a share of `values` lies; they are sorted.
double Quantile(const std::vector<double>& values, double share) {
  const double at = share * static_cast<double>(values.size() - 1);
  const auto low = static_cast<size_t>(at);
  const size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

ScoreSummary Summarize(std::vector<double> means) {
  std::sort(means.begin(), means.end());
  return {std::accumulate(means.begin(), means.end(), 0.0) / static_cast<double>(means.size()),
          Quantile(means, 0.25), Quantile(means, 0.5), Quantile(means, 0.75)};
}

// Near and far error of one window, summed over frames.
class Window {
 public:
  Window(const DiscData& data, int sequence, int last)
      : data_(data), sequence_(sequence), last_(last) {}
  void Add(int ahead, const std::function<double(int disc, int c)>& position) {
    const double* truth = data_.State(sequence_, last_ + ahead);
    double error = 0.0;
    for (int i = 0; i < data_.world.size(); ++i) {
      for (int c = 0; c < 2; ++c) {
        const double x = std::clamp(position(i, c) / kPictureSize, 0.0, 1.0);
        const double off = x - truth[4 * i + c] / kPictureSize;
        error += off * off / data_.world.size();
      }
    }
    (ahead <= kSimbHorizon ? near_ : far_) += error;
  }
  double near() const { return 1000.0 * near_ / (kSimbHorizon + 1); }
  double far() const { return 1000.0 * far_ / kSimbHorizon; }

 private:
  const DiscData& data_;
  int sequence_, last_;
  double near_ = 0.0, far_ = 0.0;
};

// States at the last seen frame of a window, (n, 4).
using StateOfWindow = std::function<std::vector<double>(WindowState*, int sequence, int last)>;

SimbScore Score(const DiscData& data, SimbPredictor predictor, const StateOfWindow& state_of,
                int threads) {
  const int n = data.world.size();
  const RolloutFunction function = RolloutOf(data.world, kAhead);
  const int windows = data.frames - kSimbSeen - kAhead + 1;
  if (windows < 1) {
    throw std::invalid_argument("SimB: expected sequences of at least " +
                                std::to_string(kSimbSeen + kAhead) + " frames, got " +
                                std::to_string(data.frames));
  }
  std::vector<double> near(data.num_sequences()), far(data.num_sequences());
  std::atomic<long> unsolved{0};
  ForEachRollout(function, data.num_sequences(), threads, [&](RolloutWorker* worker, long s) {
    WindowState reader(data.world);
    for (int first = 0; first < windows; ++first) {
      const int last = first + kSimbSeen - 1;
      const std::vector<double> state = state_of(&reader, static_cast<int>(s), last);
      Window window(data, static_cast<int>(s), last);
      RolloutOutput output;
      if (predictor == SimbPredictor::kEngine) {
        RolloutInput input;
        input.state = EngineState(state.data(), n);
        output = worker->Run(input);
        unsolved += output.status == RolloutStatus::kDone ? 0 : 1;
      }
      for (int k = 0; k <= kAhead; ++k) {
        window.Add(k, [&](int i, int c) {
          if (predictor == SimbPredictor::kEngine && output.status == RolloutStatus::kDone) {
            return output.states(k, 6 * i + c);
          }
          const bool moves = predictor == SimbPredictor::kConstantVelocity;
          return state[4 * i + c] + (moves ? k * state[4 * i + 2 + c] : 0.0);
        });
      }
      near[s] += window.near() / windows;
      far[s] += window.far() / windows;
    }
  });
  return {Summarize(near), Summarize(far), static_cast<long>(windows) * data.num_sequences(),
          unsolved};
}

}  // namespace

SimbScore ScoreSimb(const DiscData& data, SimbPredictor predictor, const SeenPositions& seen,
                    int threads) {
  const int n = data.world.size();
  return Score(
      data, predictor,
      [&](WindowState* reader, int sequence, int last) {
        std::vector<double> positions;
        for (int k = last - kSimbSeen + 1; k <= last; ++k) {
          const double* frame = seen(sequence, k);
          positions.insert(positions.end(), frame, frame + 2 * static_cast<std::ptrdiff_t>(n));
        }
        return (*reader)(positions, kSimbSeen);
      },
      threads);
}

SimbScore ScoreSimbFromTruth(const DiscData& data, int threads) {
  const auto size = 4 * static_cast<std::ptrdiff_t>(data.world.size());
  return Score(
      data, SimbPredictor::kEngine,
      [&](WindowState*, int sequence, int last) {
        const double* state = data.State(sequence, last);
        return std::vector<double>(state, state + size);
      },
      threads);
}

}  // namespace tangible
