// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/noise_output.h"

#include <gtest/gtest.h>

#include <fstream>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/report.h"

namespace tangible {
namespace {

/// A pendulum that is pushed, observed at each step to 1.5 s and then predicted.
class NoiseOutputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir();
    Write("noise_scene.json", kPendulum);
    Scene real = MakeScene(kPendulum);
    real.joints[0].effort = 0.4;
    std::string rows = "time,body,angle\n";
    for (const Observation& one : Observe(real, 1, 1e-3, 3)) {
      if (one.coordinate != Coordinate::kAngle) continue;
      char row[80];
      std::snprintf(row, sizeof row, "%.17g,bob,%.17g\n", one.time, one.value);
      rows += row;
    }
    Write("noise_rows.csv", rows);
  }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
  }

  std::string File(const std::string& noise, const std::string& more = "") const {
    return R"({"scene": "noise_scene.json", "observations": [{"file": "noise_rows.csv",
      "sigma": 0.001}], "parameters": ["joints/pin/angle", "joints/pin/rate"],
      "process_noise": )" +
           noise + more + "}";
  }

  std::string ErrorOf(const std::string& noise, const std::string& more = "") const {
    FitFile file;
    std::string error;
    EXPECT_FALSE(ParseFit(File(noise, more), folder_ + "/fit.json", &file, &error));
    return error.substr(std::min(error.size(), folder_.size() + 1));
  }

  std::string folder_;
};

constexpr char kTerm[] =
    R"([{"joint": "pin", "coordinate": "angle", "intensity": 0.4, "correlation_time": 0.5}])";

TEST_F(NoiseOutputTest, TheResultHasForcesAndStates) {
  FitFile file;
  std::string error;
  ASSERT_TRUE(ParseFit(File(kTerm), folder_ + "/fit.json", &file, &error)) << error;
  std::vector<Observation> later = TakeLater(1.5, &file.run().observations);
  const std::unique_ptr<RecordingsProblem> problem = MakeProblem(file, &error);
  ASSERT_NE(problem, nullptr) << error;
  VarianceComponents components;
  const FitResult result = FitWithComponents(file.run().options, problem.get(), {}, &components);
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  FitFindings findings{&components};
  const PredictedRecordings predicted =
      PredictLater(file.input, *problem, result.estimate, 1.5, {later});
  findings.later = &predicted;
  const OrderedJson json = ResultToJson(*problem, result, findings);
  const OrderedJson& force = json["process_noise"][0];
  EXPECT_EQ(force["joint"], "pin");
  EXPECT_EQ(force["coordinate"], "angle");
  EXPECT_EQ(force["intensity"], 0.4);
  EXPECT_EQ(force["unit"], "N m");
  EXPECT_EQ(force["estimated"], false);
  EXPECT_TRUE(force["interval_95"].is_null());
  const OrderedJson& course = force["forces"][0];
  ASSERT_EQ(course["time"].size(), 150u);
  EXPECT_EQ(course["force"].size(), 150u);
  EXPECT_NEAR(course["force"][75].get<double>(), 0.4,
              4.0 * course["standard_deviation"][75].get<double>());
  EXPECT_LT(course["standard_deviation"][75].get<double>(), 0.2);
  const OrderedJson& states = json["smoothed_states"][0];
  EXPECT_EQ(states["time"].size(), 151u);
  EXPECT_EQ(states["states"]["bob/angle"].size(), 151u);
  EXPECT_EQ(states["standard_deviations"]["bob/omega"].size(), 151u);
  EXPECT_EQ(course["coordinate"][10], states["states"]["bob/angle"][10]);
  EXPECT_EQ(course["rate"][10], states["states"]["bob/omega"][10]);
  // The first prediction is from the smoothed state: 0.01 s on, without the force.
  EXPECT_LT(std::abs(predicted.runs[0].residuals[0]), 5.0);
  EXPECT_NEAR(result.residuals.size(), 151, 0);

  const std::string report = FitReport("fit.json", *problem, result, findings);
  EXPECT_NE(report.find("Random forces"), std::string::npos);
  EXPECT_NE(report.find("angular velocity (rad/s)"), std::string::npos);
  EXPECT_NE(DescribeProcessNoise(components).find("random force of joint 'pin' angle: 0.4 N m"),
            std::string::npos);
}

TEST_F(NoiseOutputTest, BadInputIsOneLine) {
  const auto with = [](const std::string& term) { return "[{" + term + "}]"; };
  const std::string pin = R"("joint": "pin", "coordinate": "angle", )";
  EXPECT_EQ(ErrorOf(with(pin + R"("intensity": -1)")),
            "fit.json: /process_noise/0/intensity: expected a number > 0, got -1");
  EXPECT_EQ(ErrorOf(with(pin + R"("intensity": "guess")")),
            "fit.json: /process_noise/0/intensity: expected \"estimate\" or a number > 0, got "
            "\"guess\"");
  EXPECT_EQ(ErrorOf(with(R"("joint": "pin", "coordinate": "angle")")),
            "fit.json: /process_noise/0/intensity: missing, expected \"estimate\" or a number > 0");
  EXPECT_EQ(ErrorOf(with(pin + R"("intensity": 1, "correlation_time": -1)")),
            "fit.json: /process_noise/0/correlation_time: expected a number >= 0, got -1");
  EXPECT_EQ(ErrorOf(with(pin + R"("intensity": 1, "body": "bob")")),
            "fit.json: /process_noise/0: expected one of body and joint, got both");
  EXPECT_EQ(ErrorOf(with(R"("coordinate": "x", "intensity": 1)")),
            "fit.json: /process_noise/0: expected one of body and joint, got none");
  EXPECT_EQ(ErrorOf(with(R"("body": "bab", "coordinate": "x", "intensity": 1)")),
            "fit.json: /process_noise/0/body: expected a body of the scene, got bab");
  EXPECT_EQ(ErrorOf(with(R"("joint": "pan", "coordinate": "angle", "intensity": 1)")),
            "fit.json: /process_noise/0/joint: expected a joint of the scene, got pan");
  EXPECT_EQ(ErrorOf(with(R"("joint": "pin", "coordinate": "x", "intensity": 1)")),
            "fit.json: /process_noise/0/coordinate: expected angle of this joint, got x");
  EXPECT_NE(ErrorOf(with(R"("joint": "pin", "coordinate": "z", "intensity": 1)"))
                .find("/process_noise/0/coordinate: expected one of x, y, angle, displacement"),
            std::string::npos);
  const std::string twice = pin + R"("intensity": 1)";
  EXPECT_EQ(ErrorOf("[{" + twice + "}, {" + twice + "}]"),
            "fit.json: /process_noise/1: expected each force once, got joint 'pin' angle twice");
  EXPECT_EQ(ErrorOf("{}"),
            "fit.json: /process_noise: expected an array of {body or joint, "
            "coordinate, intensity}, got an object");
  EXPECT_EQ(ErrorOf(kTerm, R"(, "derivatives": "adjoint")"),
            "fit.json: /derivatives: expected tangent beside process_noise");
  EXPECT_EQ(ErrorOf(kTerm, R"(, "segments": 4)"),
            "fit.json: /segments: expected 1 beside process_noise");
  EXPECT_EQ(ErrorOf(kTerm, R"(, "approach": "windows")"),
            "fit.json: /approach: expected auto or plain beside process_noise");
}

}  // namespace
}  // namespace tangible
