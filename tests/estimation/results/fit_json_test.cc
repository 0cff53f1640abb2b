// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/fit_json.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "../../support/fit_scenes.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

class FitJsonTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = ::testing::TempDir() + "fit_json_" + info->name() + "/";
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ + "scene.json") << kFallingBall;
    std::ofstream(folder_ + "seen.csv") << "time,body,x,y\n0.5,ball,0.5,10.3\n1,ball,,8\n";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
};

TEST_F(FitJsonTest, ReadsWhatIsWritten) {
  FitFile fit;
  std::string error;
  ASSERT_TRUE(ParseFit(R"({"scene": "scene.json",
      "observations": [{"file": "seen.csv", "sigma": {"x": 0.1, "y": 0.2}}],
      "points": {"rim": {"body": "ball", "at": [0.1, 0]}},
      "parameters": ["gravity/y", {"name": "m", "initial": 3, "lower": 1, "upper": 5,
          "sets": [{"path": "bodies/ball/mass", "scale": 0.5, "offset": 0.25},
                   {"path": "bodies/ball/velocity/x", "add": true}]},
          {"path": "points/rim/at/x"}],
      "derivatives": "adjoint", "loss": {"huber": 1.5}, "segments": 4, "starts": 3, "seed": 9})",
                       folder_ + "fit.json", &fit, &error))
      << error;
  EXPECT_EQ(fit.path, folder_ + "fit.json");
  const FitProblem& problem = fit.run();
  EXPECT_EQ(problem.scene.name, "falling ball");
  ASSERT_EQ(problem.observations.size(), 3u);
  EXPECT_EQ(problem.observations[0].sigma, 0.1);
  EXPECT_EQ(problem.observations[2].sigma, 0.2);
  EXPECT_EQ(problem.observations[2].value, 8.0);
  ASSERT_EQ(problem.points.size(), 1u);
  EXPECT_EQ(problem.points[0].at.x(), 0.1);
  ASSERT_EQ(problem.parameters.size(), 3u);
  EXPECT_EQ(problem.parameters[0].sets[0].path, "gravity/y");
  EXPECT_FALSE(problem.parameters[0].initial);
  EXPECT_EQ(problem.parameters[1].initial, 3.0);
  EXPECT_EQ(problem.parameters[1].lower, 1.0);
  EXPECT_EQ(problem.parameters[1].upper, 5.0);
  EXPECT_EQ(problem.parameters[1].sets[0].scale, 0.5);
  EXPECT_EQ(problem.parameters[1].sets[0].offset, 0.25);
  EXPECT_EQ(problem.parameters[1].sets[0].mode, SetMode::kAssign);
  EXPECT_EQ(problem.parameters[1].sets[1].mode, SetMode::kAdd);
  EXPECT_EQ(problem.parameters[2].name, "points/rim/at/x");
  EXPECT_EQ(problem.options.derivatives, GradientMethod::kAdjoint);
  EXPECT_EQ(problem.options.huber, 1.5);
  EXPECT_EQ(problem.options.segments, 4);
  EXPECT_EQ(problem.options.starts, 3);
  EXPECT_EQ(problem.options.seed, 9u);
}

/// A right file but for one key.
std::string With(const std::string& key, const std::string& value) {
  OrderedJson json = OrderedJson::parse(R"({"scene": "scene.json",
      "observations": [{"file": "seen.csv", "sigma": 0.01}], "parameters": ["gravity/y"]})");
  json[key] = OrderedJson::parse(value);
  return json.dump();
}

TEST_F(FitJsonTest, APointIsAtTheCentreOfMassByDefault) {
  FitFile fit;
  std::string error;
  ASSERT_TRUE(ParseFit(With("points", R"({"tip.1": {"body": "ball"}})"), folder_ + "fit.json", &fit,
                       &error))
      << error;
  ASSERT_EQ(fit.run().points.size(), 1u);
  EXPECT_EQ(fit.run().points[0].name, "tip.1");
  EXPECT_EQ(fit.run().points[0].at, Vector2<double>(0.0, 0.0));
}

TEST_F(FitJsonTest, BadInputsAreOneLine) {
  const struct {
    std::string text;
    std::string message;
  } kCases[] = {
      {"[]", ": expected an object, got an array of 0"},
      {"{}", ": /scene: missing, expected a string"},
      {With("scene", "3"), ": /scene: expected a string, got 3"},
      {With("step", "1"),
       ": /step: unknown key, expected one of scene, observations, recordings, initial, points, "
       "sensors, cameras, clocks, events, links, parameters, derivatives, loss, approach, "
       "segments, "
       "starts, seed, process_noise, missing, "
       "got \"step\""},
      {With("parameters", R"([{"path": "gravity/y", "step": 1}])"),
       ": /parameters/0/step: unknown key of a parameter, expected one of name, initial, lower, "
       "upper, sets, path, scale, prior, per, varies, got \"step\""},
      {With("observations", "[]"),
       ": /observations: expected at least one {file, sigma}, got none"},
      {With("observations", R"([{"file": "seen.csv", "sigma": -1}])"),
       ": /observations/0/sigma: expected a number > 0, got -1"},
      {With("observations", R"([{"file": "seen.csv", "sigma": {"x": 0.1}}])"),
       ": /observations/0/sigma: expected a sigma of y, which seen.csv has"},
      {With("derivatives", R"("magic")"),
       ": /derivatives: expected one of tangent, adjoint, jet, jet_implicit, finite_difference, "
       "got \"magic\""},
      {With("loss", R"({"huber": 0})"), ": /loss/huber: expected a number > 0, got 0"},
      {With("starts", "0"), ": /starts: expected an integer in [1, 10000], got 0"},
      {With("segments", "1.5"), ": /segments: expected an integer in [1, 1000], got 1.5"},
      {With("seed", "-1"), ": /seed: expected an integer in [0, 2147483647], got -1"},
      {With("points", R"({"tip": {"body": "bal", "at": [0, 0]}})"),
       ": /points/tip/body: expected the name of a body (ball), got \"bal\""},
      {With("points", R"({"tip": {"body": "ball", "at": [1]}})"),
       ": /points/tip/at: expected an array of 2 numbers [x, y], got an array of 1"},
      {With("points", R"({"a*": {"body": "ball", "at": [0, 0]}})"),
       ": /points/a*: expected a name of letters, digits and _.- , got a*"},
      {With("points", R"({"a,b": {"body": "ball"}})"),
       ": /points/a,b: expected a name of letters, digits and _.- , got a,b"},
      {With("parameters", R"([{"path": "gravity/y", "scale": "cubic"}])"),
       ": /parameters/0/scale: expected one of linear, log, got \"cubic\""},
      {With("parameters", R"([{"path": "gravity/y", "scale": "log"}])"),
       ": /parameters/0/scale: expected linear for a parameter that may be negative or starts at "
       "0, got log"},
      {With("parameters",
            R"([{"path": "gravity/y", "prior": {"gaussian": {"mean": 1, "sigma": 0}}}])"),
       ": /parameters/0/prior/gaussian/sigma: expected a number > 0, got 0"},
      {With("parameters",
            R"([{"path": "gravity/y", "prior": {"gaussian": {"mean": 1, "sigma": -1}}}])"),
       ": /parameters/0/prior/gaussian/sigma: expected a number > 0, got -1"},
      {With("parameters", R"([{"path": "gravity/y", "prior": {}}])"),
       ": /parameters/0/prior: expected one of gaussian and log_normal, got none"},
      {With("parameters",
            R"([{"path": "gravity/y", "prior": {"log_normal": {"median": 1, "sigma": 1}}}])"),
       ": /parameters/0/prior: expected gaussian for a parameter that may be negative or starts at "
       "0, got log_normal"},
      {With("parameters", "{}"), ": /parameters: expected an array of parameters, got an object"},
      {With("parameters", R"([{"name": "m"}])"),
       ": /parameters/0/sets: missing, expected an array of {path, scale, offset}"},
      {With("parameters", R"([{"path": "gravity/y", "sets": []}])"),
       ": /parameters/0/sets: expected sets or path, got both"},
      {With("parameters", R"([{"name": "", "sets": []}])"),
       ": /parameters/0/name: expected a name, got \"\""},
      {With("parameters", R"([{"name": "m\u001b[31m", "sets": []}])"),
       ": /parameters/0/name: expected a name without control characters, got \"m\\u001b[31m\""},
      {With("parameters", R"([{"name": "m", "sets": [{"path": "gravity/y", "add": 1}]}])"),
       ": /parameters/0/sets/0/add: expected true or false, got 1"},
  };
  for (const auto& bad : kCases) {
    FitFile fit;
    std::string error;
    EXPECT_FALSE(ParseFit(bad.text, folder_ + "fit.json", &fit, &error)) << bad.text;
    EXPECT_EQ(error, folder_ + "fit.json" + bad.message);
  }
}

TEST_F(FitJsonTest, FaultsOfParametersAndOfOtherFilesNameTheirPlace) {
  const struct {
    std::string text;
    std::string start;
  } kCases[] = {
      {With("scene", R"("no.json")"), "no.json: cannot be read: "},
      {With("observations", R"([{"file": "no.csv", "sigma": 1}])"), "no.csv: cannot be read: "},
      {With("parameters", R"(["gravity/y", "gravity/z"])"), "fit.json: /parameters/1"},
      {With("parameters", R"(["gravity/y", "gravity/y"])"), "fit.json: /parameters/1"},
      {With("parameters", R"([{"path": "gravity/y", "lower": 2, "upper": 1}])"),
       "fit.json: /parameters/0/"},
      {"{", "fit.json: line 1, column 2: malformed JSON"},
  };
  for (const auto& bad : kCases) {
    FitFile fit;
    std::string error;
    EXPECT_FALSE(ParseFit(bad.text, folder_ + "fit.json", &fit, &error)) << bad.text;
    EXPECT_EQ(error.rfind(folder_ + bad.start, 0), 0u) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST_F(FitJsonTest, AFileThatIsNotThereIsSaid) {
  FitFile fit;
  std::string error;
  EXPECT_FALSE(LoadFit(folder_ + "fit.json", &fit, &error));
  EXPECT_EQ(error, folder_ + "fit.json: cannot be read: No such file or directory");
}

// A file with two recordings, one of which has other keys than the file.
TEST_F(FitJsonTest, MistakesInRecordingsNameTheRecordingOnlyWhereItHasThem) {
  const auto message = [this](const Json& file, const Json& own) {
    Json json = Json::parse(R"({"scene": "scene.json", "parameters": ["gravity/y"], "recordings": [
        {"name": "a", "observations": [{"file": "seen.csv", "sigma": 0.01}]},
        {"name": "b", "observations": [{"file": "seen.csv", "sigma": 0.01}]}]})");
    json.update(file);
    json["recordings"][1].update(own);
    FitFile fit;
    std::string error;
    EXPECT_FALSE(ParseFit(json.dump(), folder_ + "fit.json", &fit, &error)) << json;
    EXPECT_EQ(error.find(folder_ + "fit.json: "), 0u) << error;
    return error.substr(std::min(error.size(), folder_.size() + 10));
  };
  const Json none = Json::object();
  EXPECT_EQ(message({{"seed", -1}}, none), "/seed: expected an integer in [0, 2147483647], got -1");
  EXPECT_EQ(message({{"sead", 1}}, none).find("/sead: unknown key, expected one of scene, "), 0u);
  EXPECT_EQ(message({{"parameters", {"gravity/z"}}}, none).find("/parameters/0/sets/0/path: "), 0u);
  EXPECT_EQ(message({{"points", {{"p", {{"body", "bal"}}}}}}, none).find("/points/p/body: "), 0u);
  EXPECT_EQ(message({{"scene", nullptr}}, none), "/scene: expected a string, got null");
  EXPECT_EQ(message(none, {{"points", {{"p", {{"body", "bal"}}}}}})
                .find("recording 'b': /points/p/body: "),
            0u);
  EXPECT_EQ(message({{"parameters", {"points/p/at/x"}}, {"points", {{"p", {{"body", "ball"}}}}}},
                    {{"points", Json::object()}})
                .find("recording 'b': /parameters/0/sets/0/path: "),
            0u);
  EXPECT_EQ(message(none, {{"observations", {{{"file", "seen.csv"}}}}}),
            "recording 'b': /observations/0/sigma: missing, expected a number > 0");
  // Values that a parameter sets would be those of the parameter; what is added to them is not.
  EXPECT_EQ(message({{"parameters", {{{"name", "g"}, {"path", "gravity/*"}}}}},
                    {{"values", {{"gravity/y", -9}}}}),
            "/recordings/1/values/gravity~1y: expected a number that no parameter sets, got one "
            "that \"g\" sets (initial says where its value in a recording begins)");
  EXPECT_EQ(message(none, {{"values", {{"bodies/ball/mass", 2}, {"bodies/*/mass", 3}}}}),
            "/recordings/1/values/bodies~1ball~1mass: expected numbers that no other parameter "
            "sets, got bodies/ball/mass, which bodies/*/mass sets");
  EXPECT_EQ(message(none, {{"values", {{"bodies/ball/mass", 0}}}}),
            "/recordings/1/values/bodies~1ball~1mass: expected a number > 0, got 0.0");
  EXPECT_EQ(message(none, {{"values", {{"bodies/bal/mass", 0}}}})
                .find("/recordings/1/values/bodies~1bal~1mass: parameter bodies/bal/mass: matches"),
            0u);
  EXPECT_EQ(
      message({{"initial", "from_observations"}, {"parameters", {"bodies/ball/velocity/x"}}}, none),
      "/initial: expected parameters that set nothing but initial poses, twists, joint "
      "angles, displacements or rates, each per recording, got none");
  EXPECT_EQ(message(none, {{"initial", "from_observations"}}),
            "/recordings/1/initial: expected parameters that set nothing but initial poses, "
            "twists, joint angles, displacements or rates, each per recording, got none");
  const auto spread = [&](const Json& value) {
    return message({{"parameters",
                     {{{"path", "gravity/y"},
                       {"per", "recording"},
                       {"varies", {{"gaussian", {{"spread", value}}}}}}}}},
                   none);
  };
  const std::string place = "/parameters/0/varies/gaussian/spread: ";
  EXPECT_EQ(spread(0), place + "expected \"estimate\" or a number > 0, got 0");
  EXPECT_EQ(spread(true), place + "expected \"estimate\" or a number > 0, got true");
  EXPECT_EQ(spread("estimated"),
            place + "expected \"estimate\" or a number > 0, got \"estimated\"");
}

TEST_F(FitJsonTest, ValuesThatAParameterAddsToAreThoseOfTheRecording) {
  FitFile fit;
  std::string error;
  ASSERT_TRUE(ParseFit(R"({"scene": "scene.json",
      "parameters": [{"name": "more", "initial": 0, "sets": [{"path": "gravity/y", "add": true}]}],
      "recordings": [{"name": "a", "observations": [{"file": "seen.csv", "sigma": 0.01}],
                      "values": {"gravity/y": -9}}]})",
                       folder_ + "fit.json", &fit, &error))
      << error;
  EXPECT_EQ(fit.run().scene.gravity.y(), -9.0);
}

// The range of a joint moves beyond itself: one end alone would be on the wrong side of the other.
TEST_F(FitJsonTest, ValuesAreSetTogether) {
  Json scene = Json::parse(kFallingBall);
  scene["joints"] = {{{"name", "j"},
                      {"type", "revolute"},
                      {"bodies", {"ball", "world"}},
                      {"anchor", {0, 0}},
                      {"limits", {-1, 1}}}};
  std::ofstream(folder_ + "scene.json") << scene;
  const auto fit_with = [this](double low, double high, std::string* error) {
    Json json = Json::parse(R"({"scene": "scene.json", "parameters": ["gravity/y"],
        "recordings": [{"name": "a", "observations": [{"file": "seen.csv", "sigma": 0.01}]}]})");
    json["recordings"][0]["values"] = {{"joints/j/limits/0", low}, {"joints/j/limits/1", high}};
    FitFile fit;
    return ParseFit(json.dump(), folder_ + "fit.json", &fit, error) ? fit.run().scene.joints[0]
                                                                    : Scene().joints.emplace_back();
  };
  std::string error;
  EXPECT_EQ(fit_with(2.0, 3.0, &error).limits->first, 2.0) << error;
  fit_with(3.0, 2.0, &error);
  EXPECT_EQ(error.find(folder_ + "fit.json: /recordings/0/values: the scene with these values: "),
            0u)
      << error;
}

TEST_F(FitJsonTest, ASensorWhoseSigmaIsEstimatedNeedsObservations) {
  const auto message = [this](Json json) {
    FitFile fit;
    std::string error;
    ParseFit(json.dump(), folder_ + "fit.json", &fit, &error);
    return error.substr(std::min(error.size(), folder_.size() + 10));
  };
  Json json = Json::parse(With("sensors", R"({"s": {"sigma": 0.1, "estimate_sigma": true}})"));
  EXPECT_EQ(message(json),
            "/sensors/s/estimate_sigma: expected a sensor that observations name, got one without "
            "observations");
  json["observations"][0]["sensor"] = "s";
  EXPECT_EQ(message(json), "");
  // What recordings name alike is one sensor, and may be used by one of them.
  const Json seen = json["observations"];
  json.erase("observations");
  json["recordings"] = {{{"name", "a"}, {"observations", seen}},
                        {{"name", "b"}, {"observations", seen}}};
  json["recordings"][1]["observations"][0].erase("sensor");
  EXPECT_EQ(message(json), "");
  json["recordings"][1]["sensors"] = {{"other", {{"estimate_sigma", true}}}};
  EXPECT_EQ(message(json),
            "/recordings/1/sensors/other/estimate_sigma: expected a sensor that observations name, "
            "got one without observations");
}

TEST_F(FitJsonTest, InstrumentsAreRead) {
  std::ofstream(folder_ + "image.csv") << "time,body,x,omega\n0.5,ball,0.5,10.3\n1,ball,,8\n";
  FitFile fit;
  std::string error;
  ASSERT_TRUE(ParseFit(R"({"scene": "scene.json",
      "observations": [{"file": "image.csv", "sensor": "encoder", "camera": "left", "clock": "c",
                        "relative_to": "rim"},
                       {"file": "seen.csv", "sigma": {"x": 0.1, "y": 0.2}, "unwrap": true}],
      "points": {"rim": {"body": "ball", "at": [0.1, 0]}},
      "sensors": {"encoder": {"delay": 0.125, "gain": 2, "bias": 0.5, "sigma": 0.25}},
      "cameras": {"left": {"scale": 700, "rotation": 0.1, "origin": [1, 2], "marker": "rim",
                           "aspect": 1.5, "radial": -0.25, "radial_length": 0.5}},
      "clocks": {"c": {"rate": 0.5, "offset": 0.25}},
      "parameters": ["gravity/y", "sensors/encoder/delay", "cameras/left/scale",
                     {"path": "clocks/*/rate", "lower": 0.25, "upper": 0.75}]})",
                       folder_ + "fit.json", &fit, &error))
      << error;
  const FitProblem& problem = fit.run();
  EXPECT_EQ(problem.instruments.sensors[0].delay, 0.125);
  EXPECT_EQ(problem.instruments.sensors[0].gain, 2.0);
  EXPECT_EQ(problem.instruments.sensors[0].bias, 0.5);
  EXPECT_EQ(problem.instruments.cameras[0].origin.y(), 2.0);
  EXPECT_EQ(problem.instruments.cameras[0].marker_point, 0);
  EXPECT_EQ(problem.instruments.cameras[0].aspect, 1.5);
  EXPECT_EQ(problem.instruments.cameras[0].radial, -0.25);
  EXPECT_EQ(problem.instruments.cameras[0].radial_length, 0.5);
  EXPECT_EQ(problem.instruments.clocks[0].offset, 0.25);
  ASSERT_EQ(problem.channels.size(), 2u);
  EXPECT_EQ(problem.channels[0].sensor, 0);
  EXPECT_EQ(problem.channels[0].camera, 0);
  EXPECT_EQ(problem.channels[0].clock, 0);
  EXPECT_EQ(problem.channels[0].to_point, 0);
  EXPECT_EQ(problem.channels[1], Channel{.file = 1});
  EXPECT_EQ(problem.observations[0].sigma, 0.25);  // the sensor's
  EXPECT_EQ(problem.observations[1].coordinate, Coordinate::kOmega);
  EXPECT_EQ(problem.observations[3].channel, 1);
  const std::unique_ptr<RecordingsProblem> made = MakeProblem(fit, &error);
  ASSERT_NE(made, nullptr) << error;
  const RolloutResiduals& run = made->recordings()[0].residuals;
  EXPECT_TRUE(run.scene().MovesTimes());
  EXPECT_EQ(run.entries()[1].initial, 0.125);
  EXPECT_TRUE(run.entries()[2].logarithmic);
}

TEST_F(FitJsonTest, BadInstrumentsAreOneLine) {
  // Of the file in this test's folder, without the folder.
  const auto message = [&](const std::string& part, const std::string& entry = "",
                           const std::string& parameter = "gravity/y") {
    FitFile fit;
    std::string error;
    EXPECT_FALSE(ParseFit(R"({"scene": "scene.json", "observations": [{"file": "seen.csv",
        "sigma": 0.1)" + entry +
                              R"(}], "parameters": [")" + parameter + R"("], )" + part + "}",
                          folder_ + "fit.json", &fit, &error));
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_EQ(error.find(folder_ + "fit.json: "), 0u) << error;
    return error.substr(std::min(error.size(), folder_.size() + 10));
  };
  const std::string none = R"("starts": 1)";
  EXPECT_EQ(message(R"("cameras": {"c": {"scale": 0}})"),
            "/cameras/c/scale: expected a number > 0, got 0");
  EXPECT_EQ(message(R"("cameras": {"c": {"aspect": 0}})"),
            "/cameras/c/aspect: expected a number > 0, got 0");
  EXPECT_EQ(message(R"("cameras": {"c": {"radial": 0.02}})"),
            "/cameras/c/radial_length: missing, expected a number > 0");
  EXPECT_EQ(message(R"("cameras": {"c": {"radial_length": -1}})"),
            "/cameras/c/radial_length: expected a number > 0, got -1");
  EXPECT_EQ(message(R"("cameras": {"c": {"scale": 2}})", "", "cameras/c/radial"),
            "/parameters/0/sets/0/path: parameter cameras/c/radial: cameras/c/radial needs a "
            "radial_length beside it, expected one > 0, got none");
  EXPECT_EQ(message(R"("clocks": {"c": {"rate": -1}})"),
            "/clocks/c/rate: expected a number > 0, got -1");
  EXPECT_EQ(message(R"("sensors": {"s": {"sigma": 0}})"),
            "/sensors/s/sigma: expected a number > 0, got 0");
  EXPECT_EQ(message(R"("sensors": {"s": {"gain": 0}})"),
            "/sensors/s/gain: expected a number other than 0, got 0");
  EXPECT_EQ(message(R"("sensors": {"s": {"lag": 0}})"),
            "/sensors/s/lag: unknown key of a sensor, expected one of delay, gain, bias, sigma, "
            "estimate_sigma, got \"lag\"");
  EXPECT_EQ(message(R"("cameras": {"c": {"marker": "bal"}})"),
            "/cameras/c/marker: expected the name of a body (ball) or point (none), got \"bal\"");
  EXPECT_EQ(message(none, R"(, "sensor": "s")"),
            "/observations/0/sensor: expected the name of a sensor (none), got \"s\"");
  EXPECT_EQ(message(none, R"(, "relative_to": "bal")"),
            "/observations/0/relative_to: expected the name of a body (ball) or point (none), got "
            "\"bal\"");
  EXPECT_EQ(message(R"("sensors": {"s": {}})", "", "sensors/t/delay"),
            "/parameters/0/sets/0/path: parameter sensors/t/delay: matches no number; of points, "
            "sensors, cameras and clocks there are: sensors/s/delay, sensors/s/gain, "
            "sensors/s/bias");
  EXPECT_EQ(message(R"("sensors": {"s": {}}, "segments": 3)", "", "sensors/s/delay"),
            "/segments: expected 1 where a delay or clock is a parameter (sensors/s/delay), got 3");
}

}  // namespace
}  // namespace tangible
