// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/disc_data.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tangible/estimation/vision/checksum.h"

namespace tangible {
namespace {

const DiscData& Billiards() {
  static const DiscData data =
      MakeDiscData({.kind = DiscKind::kBilliards, .sequences = 12, .frames = 25, .seed = 4});
  return data;
}

const DiscData& Simb() {
  static const DiscData data =
      MakeDiscData({.kind = DiscKind::kSimb, .sequences = 12, .frames = 100, .seed = 4});
  return data;
}

double Energy(const DiscData& data, int sequence, int frame) {
  double energy = 0.0;
  for (int i = 0; i < data.world.size(); ++i) {
    const double* state = data.State(sequence, frame) + 4 * static_cast<std::ptrdiff_t>(i);
    energy += 0.5 * data.world.masses[i] * (state[2] * state[2] + state[3] * state[3]);
  }
  return energy;
}

TEST(DiscDataTest, BilliardsLoseEnergyStayInTheBoxAndMeet) {
  const DiscData& data = Billiards();
  int met = 0;
  for (int s = 0; s < data.num_sequences(); ++s) {
    for (int k = 0; k < data.frames; ++k) {
      const double* state = data.State(s, k);
      for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < 2; ++c) {
          EXPECT_GE(state[4 * i + c], data.world.low + data.world.radii[i] - 1e-9);
          EXPECT_LE(state[4 * i + c], data.world.high - data.world.radii[i] + 1e-9);
        }
        for (int j = 0; j < i; ++j) {
          EXPECT_GE(std::hypot(state[4 * i] - state[4 * j], state[4 * i + 1] - state[4 * j + 1]),
                    10.0 - 1e-9);
        }
      }
      if (k == 0) continue;
      // Damping alone takes the share 1 − exp(−2 c / m) of each disc, at most that of the lightest.
      EXPECT_LT(Energy(data, s, k), Energy(data, s, k - 1));
      met += Energy(data, s, k) < Energy(data, s, k - 1) * std::exp(-2.0 * 0.02 / 0.5) ? 1 : 0;
    }
  }
  EXPECT_GT(met, 10);
}

// As the benchmark's generator: elastic, one disc moves at first, at one of five speeds.
TEST(DiscDataTest, SimbKeepsItsRules) {
  const DiscData& data = Simb();
  std::set<long> speeds;
  int kept = 0, steps = 0;
  for (int s = 0; s < data.num_sequences(); ++s) {
    int moving = 0;
    for (int i = 0; i < 3; ++i) {
      const double* state = data.State(s, 0) + 4 * static_cast<std::ptrdiff_t>(i);
      const double speed = std::hypot(state[2], state[3]);
      if (speed == 0.0) continue;
      ++moving;
      EXPECT_NEAR(speed, std::round(speed), 1e-12);
      speeds.insert(std::lround(speed));
      const double direction = std::atan2(state[3], state[2]) * 6.0 / M_PI;
      EXPECT_NEAR(direction, std::round(direction), 1e-12);
    }
    EXPECT_EQ(moving, 1);
    for (int k = 1; k < data.frames; ++k, ++steps) {
      EXPECT_NEAR(Energy(data, s, k), Energy(data, s, 0), 1e-9);
      for (int i = 0; i < 3; ++i) {
        for (int c = 0; c < 2; ++c) {
          const double x = data.State(s, k)[4 * i + c];
          // A fifth of a frame's way beyond the wall at most, before the speed turns.
          EXPECT_GE(x, 2.0 - 1.2 - 1e-9);
          EXPECT_LE(x, 61.0 + 1.2 + 1e-9);
        }
      }
      kept += data.State(s, k)[2] == data.State(s, k - 1)[2] ? 1 : 0;
    }
  }
  EXPECT_GE(*speeds.begin(), 2);
  EXPECT_LE(*speeds.rbegin(), 6);
  EXPECT_GT(speeds.size(), 2U);
  EXPECT_GT(kept, steps / 2);
  EXPECT_LT(kept, steps);
}

TEST(DiscDataTest, PicturesShowTheDiscsWhereTheyAre) {
  for (const DiscData* data : {&Billiards(), &Simb()}) {
    const DiscWorld& world = data->world;
    std::vector<unsigned char> pixels(kPictureBytes);
    for (int s = 0; s < 4; ++s) {
      ASSERT_TRUE(Decompress(data->sequences[s].pictures[7], pixels.data()));
      const double* state = data->State(s, 7);
      for (int i = 0; i < world.size(); ++i) {
        // The centre of the disc's share of a picture with this disc alone.
        const std::vector<double> centre = {state[4 * i], state[4 * i + 1]};
        DiscWorld alone = world;
        alone.colours = {world.colours[i]};
        alone.radii = {world.radii[i]};
        const std::string picture = DrawDiscs(alone, centre);
        double weight = 0.0, x = 0.0, y = 0.0;
        for (int k = 0; k < kPicturePixels; ++k) {
          const double cloth = std::round(255.0 * world.cloth[0]);
          const double share = std::abs(static_cast<unsigned char>(picture[k]) - cloth) +
                               static_cast<unsigned char>(picture[2 * kPicturePixels + k]) -
                               std::round(255.0 * world.cloth[2]) +
                               static_cast<unsigned char>(picture[kPicturePixels + k]) -
                               std::round(255.0 * world.cloth[1]);
          weight += share;
          x += share * (k % kPictureSize + 0.5);
          y += share * (k / kPictureSize + 0.5);
        }
        EXPECT_NEAR(x / weight, centre[0], 0.05);
        EXPECT_NEAR(y / weight, centre[1], 0.05);
        // The whole picture has the disc's colour at its centre.
        const int pixel = static_cast<int>(centre[1]) * kPictureSize + static_cast<int>(centre[0]);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(pixels[c * kPicturePixels + pixel], 255.0 * world.colours[i][c], 3.0);
        }
      }
    }
  }
}

TEST(DiscDataTest, TheSameSeedGivesTheSameDataAndMoreOfThem) {
  const DiscDataOptions options{
      .kind = DiscKind::kBilliards, .sequences = 3, .frames = 6, .seed = 9};
  DiscDataOptions more = options;
  more.sequences = 5;
  more.threads = 3;
  DiscDataOptions other = options;
  other.seed = 10;
  const DiscData one = MakeDiscData(options), five = MakeDiscData(more),
                 another = MakeDiscData(other);
  for (int s = 0; s < 3; ++s) {
    EXPECT_EQ(one.sequences[s].states, five.sequences[s].states);
    EXPECT_EQ(one.sequences[s].pictures, five.sequences[s].pictures);
    EXPECT_NE(one.sequences[s].states, another.sequences[s].states);
  }
}

TEST(DiscDataTest, AFileReadsBackAndADamagedOneIsOneLine) {
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kSimb, .sequences = 2, .frames = 3, .seed = 5});
  const std::string bytes = SerializeDiscData(data);
  DiscData read;
  std::string error;
  ASSERT_TRUE(ParseDiscData(bytes, "d.bin", &read, &error)) << error;
  EXPECT_EQ(read.kind, DiscKind::kSimb);
  EXPECT_EQ(read.seed, 5U);
  for (int s = 0; s < 2; ++s) {
    EXPECT_EQ(read.sequences[s].states, data.sequences[s].states);
    EXPECT_EQ(read.sequences[s].pictures, data.sequences[s].pictures);
  }
  const auto refuse = [&](std::string damaged, const std::string& what) {
    error.clear();
    EXPECT_FALSE(ParseDiscData(damaged, "d.bin", &read, &error));
    EXPECT_EQ(error.rfind("d.bin: ", 0), 0U) << error;
    EXPECT_NE(error.find(what), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  };
  refuse("", "another file");
  refuse("{}", "another file");
  refuse(bytes.substr(0, 40), "the file's end");
  refuse(bytes.substr(0, bytes.size() - 1), "bytes behind the header");
  refuse(bytes + "x", "bytes behind the header");
  std::string flipped = bytes;
  flipped[flipped.size() / 2] ^= 1;
  refuse(flipped, "damaged");
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string other = bytes;
    return other.replace(other.find(from), from.size(), to);
  };
  // The checksum is that of the header too.
  refuse(replaced("\"simb\"", "\"billiards\""), "damaged");
  refuse(replaced("\"seed\":5", "\"seed\":6"), "damaged");
  refuse(replaced("\"frames\":3", "\"frames\":4"), "damaged");
  refuse(replaced("\"sequences\":2", "\"sequences\":1"), "damaged");
  refuse(replaced("\"seed\":5", "\"seed\":5,\"more\":1"), "damaged");
  refuse(replaced("\"bytes\":", "\"bytes\":1"), "bytes behind the header");
  refuse(replaced("discs 2", "discs 1"), "make it again");
  EXPECT_FALSE(LoadDiscData("/no/such/file", &read, &error));
}

// Files with a right checksum whose contents are not those of a data set.
TEST(DiscDataTest, AForgedFileIsOneLine) {
  const DiscData data =
      MakeDiscData({.kind = DiscKind::kSimb, .sequences = 2, .frames = 3, .seed = 5});
  DiscData read;
  std::string error;
  // The bytes with a change of the header and the checksum of these.
  const auto forged = [&](const std::string& from, const std::string& to) {
    std::string bytes = SerializeDiscData(data);
    bytes.replace(bytes.find(from), from.size(), to);
    const size_t end = bytes.find('\n', bytes.find('\n') + 1), begin = bytes.find('\n') + 1;
    nlohmann::json header = nlohmann::json::parse(bytes.substr(begin, end - begin));
    header.erase("crc32");
    header["crc32"] = Checksum({header.dump(), "\n", std::string_view(bytes).substr(end + 1)});
    return bytes.substr(0, begin) + header.dump() + bytes.substr(end);
  };
  const auto refuse = [&](const std::string& bytes, const std::string& what) {
    error.clear();
    EXPECT_FALSE(ParseDiscData(bytes, "d.bin", &read, &error));
    EXPECT_EQ(error.rfind("d.bin: ", 0), 0U) << error;
    EXPECT_NE(error.find(what), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  };
  EXPECT_TRUE(ParseDiscData(forged("\"seed\":5", "\"seed\":6"), "d.bin", &read, &error)) << error;
  refuse(forged("simb", "sumo"), "/kind");
  refuse(forged("\"frames\":3", "\"frames\":4"), "ends within it");
  refuse(forged("\"frames\":3", "\"frames\":100000"), "ends within it");
  refuse(forged("\"frames\":3", "\"frames\":100001"), "expected 1 to");
  refuse(forged("\"sequences\":2", "\"sequences\":1"), "expected the file's end");
  refuse(forged("\"frames\":3", "\"frames\":-3"), "/frames");
  refuse(forged("\"frames\":3", "\"frames\":0"), "expected 1 to");
  refuse(forged("\"frames\":3", "\"fr\":3"), "/frames");
  DiscData bad = data;
  bad.sequences[1].states[7] = NAN;
  refuse(SerializeDiscData(bad), "sequence 1: expected finite states");
  bad = data;
  bad.sequences[0].pictures[2][20] ^= 4;
  refuse(SerializeDiscData(bad), "sequence 0: expected pictures, got one that is damaged");
  bad.sequences[0].pictures[2].clear();
  refuse(SerializeDiscData(bad), "sequence 0: expected pictures, got one that is damaged");
}

// Each of these would keep a program waiting, or fill its memory.
TEST(DiscDataTest, OnlyRegularFilesAreRead) {
  DiscData read;
  for (const char* file : {"/dev/zero", "/dev/null", "/"}) {
    std::string error;
    EXPECT_FALSE(LoadDiscData(file, &read, &error));
    EXPECT_NE(error.find("cannot be read"), std::string::npos) << error;
  }
  const std::string pipe = ::testing::TempDir() + "disc_data_pipe." + std::to_string(::getpid());
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::string error;
  EXPECT_FALSE(LoadDiscData(pipe, &read, &error));
  EXPECT_NE(error.find("got a pipe"), std::string::npos) << error;
  ::unlink(pipe.c_str());
}

}  // namespace
}  // namespace tangible
