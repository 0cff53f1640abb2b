// SPDX-License-Identifier: Apache-2.0
//
// The recordings of real pendulums: residuals, ratios, predictions. They are no part of the
// project; without them the tests are skipped.
#include "tangible/estimation/experiments/pendulums.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

namespace tangible {
namespace {

const std::string kRecordings = TANGIBLE_SOURCE_DIR "/../shared/data";

class PendulumsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kRecordings)) {
      GTEST_SKIP() << "no recordings in " << kRecordings;
    }
    // The fit files look for scenes and observations beside their own folder.
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("pendulums_") + info->name() + "." + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::filesystem::copy(TANGIBLE_SOURCE_DIR "/data", folder_ / "data",
                          std::filesystem::copy_options::recursive);
  }
  void TearDown() override {
    if (!folder_.empty()) {
      std::filesystem::remove_all(folder_);
    }
  }

  PendulumResult Run(int job) const {
    PendulumResult result;
    std::string error;
    EXPECT_TRUE(RunPendulum(PendulumJobs(kRecordings)[job], (folder_ / "data/fits").string(),
                            (folder_ / "out").string(), &result, &error))
        << error;
    return result;
  }

  std::filesystem::path folder_;
};

/// All parameters and ratios have intervals, and the step's bias is within them but for dampings.
void ExpectIntervals(const PendulumResult& result) {
  for (size_t k = 0; k < result.parameters.size(); ++k) {
    EXPECT_TRUE(result.fit.uncertainty.confidence_95[k].has_value()) << result.parameters[k].name;
    if (result.parameters[k].name.find("damping") == std::string::npos) {
      const auto i = static_cast<Eigen::Index>(k);
      EXPECT_LT(std::abs(result.check.bias[i]), result.fit.uncertainty.standard_deviation[i])
          << result.parameters[k].name;
    }
  }
  for (size_t i = 0; i < result.derived.size(); ++i) {
    const DerivedQuantity& derived = result.derived[i];
    EXPECT_GT(derived.standard_deviation, 0.0) << derived.name;
    EXPECT_LT(derived.standard_deviation, 0.05 * std::abs(derived.estimate)) << derived.name;
  }
}

/// The markers are found to a tenth of a pixel; rigid links on a plane explain them to a few times
/// that.
void ExpectResiduals(const PendulumResult& result, double multiple) {
  EXPECT_LT(result.recording.noise / result.recording.metres_per_pixel, 0.12);
  EXPECT_LT(result.residual_rms, multiple * result.recording.noise);
  EXPECT_GT(result.residual_rms, 0.5 * result.recording.noise);
  EXPECT_NEAR(result.recording.length_ratio, 1.307, 0.003);
  EXPECT_LE(result.fit.iterations.size(), 31u);
}

TEST_F(PendulumsTest, SinglePendulumIsPredictedBetterThanByThePublishedParameters) {
  const PendulumResult result = Run(0);
  // Of the published parameters, integrated from the measured state.
  const double published[] = {0.021, 0.072, 0.132};
  ASSERT_EQ(result.predictions.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(result.predictions[i].error, 0.3 * published[i]);
  }
  // Published, with the inertia 1.0912e-4: 0.15276 m.
  EXPECT_NEAR(result.derived[0].estimate, 0.15276, 0.005 * 0.15276);
}

TEST_F(PendulumsTest, FirstDoublePendulum) {
  const PendulumResult result = Run(1);
  ExpectResiduals(result, 4.0);
  ExpectIntervals(result);
}

TEST_F(PendulumsTest, SecondDoublePendulum) {
  const PendulumResult result = Run(2);
  ExpectResiduals(result, 2.5);
  ExpectIntervals(result);
}

}  // namespace
}  // namespace tangible
