// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/disc_data.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tangible/estimation/vision/disc_rollout.h"

namespace tangible {
namespace {

// Random numbers of a sequence, which are the same on every platform (those of the standard
// library's distributions are not).
class Draw {
 public:
  Draw(std::uint64_t seed, int sequence) {
    std::seed_seq all{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(sequence)};
    random_.seed(all);
  }
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  int Below(int count) { return std::min(static_cast<int>(Uniform(0.0, count)), count - 1); }

 private:
  std::mt19937_64 random_;
};

bool Apart(const DiscWorld& world, const std::vector<double>& x, double room) {
  for (int i = 0; i < world.size(); ++i) {
    for (int j = 0; j < i; ++j) {
      const double d = std::hypot(x[4 * i] - x[4 * j], x[4 * i + 1] - x[4 * j + 1]);
      if (d < world.radii[i] + world.radii[j] + room) return false;
    }
  }
  return true;
}

// Draws centres within the box, apart from each other, at rest.
std::vector<double> Place(const DiscWorld& world, double room, Draw* draw) {
  std::vector<double> x(4 * static_cast<size_t>(world.size()));
  do {
    for (int i = 0; i < world.size(); ++i) {
      const double inside = world.radii[i] + room;
      x[4 * i] = draw->Uniform(world.low + inside, world.high - inside);
      x[4 * i + 1] = draw->Uniform(world.low + inside, world.high - inside);
    }
  } while (!Apart(world, x, room));
  return x;
}

std::vector<double> BilliardStart(const DiscWorld& world, Draw* draw) {
  std::vector<double> x = Place(world, 0.5, draw);
  for (int i = 0; i < world.size(); ++i) {
    const double speed = draw->Uniform(0.5, 3.0);
    const double angle = draw->Uniform(0.0, 2.0 * M_PI);
    x[4 * i + 2] = speed * std::cos(angle);
    x[4 * i + 3] = speed * std::sin(angle);
  }
  return x;
}

// Runs a start by event stepping; returns false where the engine cannot continue.
bool RunBilliards(const std::vector<double>& start, int frames, RolloutWorker* worker,
                  std::vector<double>* states) {
  const auto discs = static_cast<int>(start.size() / 4);
  RolloutInput input;
  input.state = EngineState(start.data(), discs);
  const RolloutOutput output = worker->Run(input);
  if (output.status != RolloutStatus::kDone) return false;
  states->resize(static_cast<size_t>(frames) * start.size());
  for (int k = 0; k < frames; ++k) {
    for (int i = 0; i < discs; ++i) {
      double* at = states->data() + k * start.size() + 4 * i;
      at[0] = output.states(k, 6 * i);
      at[1] = output.states(k, 6 * i + 1);
      at[2] = output.states(k, 6 * i + 3);
      at[3] = output.states(k, 6 * i + 4);
    }
  }
  return true;
}

// One substep's collisions of discs, whose masses are equal: the normal speeds are exchanged.
void ExchangeNormalSpeeds(const DiscWorld& world, std::vector<double>* state,
                          std::vector<bool>* met) {
  std::vector<double>& x = *state;
  for (int i = 0; i < world.size(); ++i) {
    for (int j = 0; j < i; ++j) {
      const double dx = x[4 * i] - x[4 * j], dy = x[4 * i + 1] - x[4 * j + 1];
      const double d = std::hypot(dx, dy);
      if (d >= world.radii[i] + world.radii[j] || (*met)[i * world.size() + j]) continue;
      (*met)[i * world.size() + j] = true;
      const double exchanged =
          ((x[4 * j + 2] - x[4 * i + 2]) * dx + (x[4 * j + 3] - x[4 * i + 3]) * dy) / (d * d);
      x[4 * i + 2] += exchanged * dx;
      x[4 * i + 3] += exchanged * dy;
      x[4 * j + 2] -= exchanged * dx;
      x[4 * j + 3] -= exchanged * dy;
    }
  }
}

std::vector<double> RunSimb(const DiscWorld& world, int frames, Draw* draw) {
  constexpr int kSubsteps = 5;
  std::vector<double> x = Place(world, 0.0, draw);
  const int moving = draw->Below(world.size());
  const double angle = 2.0 * M_PI * draw->Below(12) / 12.0;
  const double speed = 2.0 + draw->Below(5);
  x[4 * moving + 2] = speed * std::cos(angle);
  x[4 * moving + 3] = speed * std::sin(angle);
  std::vector<double> states;
  for (int k = 0; k < frames; ++k) {
    states.insert(states.end(), x.begin(), x.end());
    std::vector<bool> met(static_cast<size_t>(world.size()) * world.size(), false);
    for (int substep = 0; substep < kSubsteps; ++substep) {
      for (int i = 0; i < world.size(); ++i) {
        for (int c = 0; c < 2; ++c) {
          double& at = x[4 * i + c];
          double& v = x[4 * i + 2 + c];
          at += v / kSubsteps;
          if (at - world.radii[i] < world.low) v = std::abs(v);
          if (at + world.radii[i] > world.high) v = -std::abs(v);
        }
      }
      ExchangeNormalSpeeds(world, &x, &met);
    }
  }
  return states;
}

std::string Compress(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
            reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 6);
  // The bound is sixty times the size of usual pictures.
  packed.resize(size);
  packed.shrink_to_fit();
  return packed;
}

}  // namespace

const char* NameOf(DiscKind kind) { return kind == DiscKind::kSimb ? "simb" : "billiards"; }

DiscWorld WorldOf(DiscKind kind) { return kind == DiscKind::kSimb ? SimbWorld() : BilliardWorld(); }

bool Decompress(const std::string& picture, unsigned char* pixels) {
  uLongf size = kPictureBytes;
  const int status =
      uncompress(pixels, &size, reinterpret_cast<const Bytef*>(picture.data()), picture.size());
  return status == Z_OK && size == kPictureBytes;
}

DiscData MakeDiscData(const DiscDataOptions& options) {
  DiscData data{options.kind, options.seed, options.frames, WorldOf(options.kind), {}};
  data.sequences.resize(options.sequences);
  const RolloutFunction function = RolloutOf(data.world, std::max(1, options.frames - 1));
  ForEachRollout(function, options.sequences, options.threads, [&](RolloutWorker* worker, long s) {
    DiscSequence& sequence = data.sequences[s];
    Draw draw(options.seed, static_cast<int>(s));
    if (options.kind == DiscKind::kSimb) {
      sequence.states = RunSimb(data.world, options.frames, &draw);
    } else {
      while (!RunBilliards(BilliardStart(data.world, &draw), options.frames, worker,
                           &sequence.states)) {
      }
    }
    for (int k = 0; k < options.frames; ++k) {
      std::vector<double> centres;
      for (int i = 0; i < data.world.size(); ++i) {
        centres.push_back(data.State(static_cast<int>(s), k)[4 * i]);
        centres.push_back(data.State(static_cast<int>(s), k)[4 * i + 1]);
      }
      sequence.pictures.push_back(Compress(DrawDiscs(data.world, centres)));
    }
  });
  return data;
}

}  // namespace tangible
