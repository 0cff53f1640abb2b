// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/report.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <vector>

#include "tangible/estimation/vision/disc_world.h"
#include "tangible/estimation/vision/png.h"

namespace tangible {
namespace {

unsigned Number(const std::string& bytes, size_t at) {
  unsigned value = 0;
  for (size_t k = at; k < at + 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[k]);
  return value;
}

TEST(PngTest, APictureReadsBack) {
  std::vector<unsigned char> pixels;
  for (int k = 0; k < 3 * 5 * 2; ++k) pixels.push_back(static_cast<unsigned char>(7 * k));
  const std::string png = PngOf(pixels, 5, 2);
  ASSERT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(png.substr(12, 4), "IHDR");
  EXPECT_EQ(Number(png, 16), 5U);
  EXPECT_EQ(Number(png, 20), 2U);
  size_t at = 8;
  std::string found;
  while (at < png.size()) {
    const unsigned size = Number(png, at);
    const std::string content = png.substr(at + 4, 4 + size);
    EXPECT_EQ(Number(png, at + 8 + size),
              crc32(0L, reinterpret_cast<const Bytef*>(content.data()), 4 + size));
    found = content.substr(0, 4);
    if (found == "IDAT") {
      std::vector<unsigned char> raw(2 * 16);
      uLongf length = raw.size();
      ASSERT_EQ(
          uncompress(raw.data(), &length, reinterpret_cast<const Bytef*>(content.data()) + 4, size),
          Z_OK);
      ASSERT_EQ(length, raw.size());
      for (int j = 0; j < 2; ++j) {
        EXPECT_EQ(raw[16 * j], 0);
        for (int i = 0; i < 15; ++i) EXPECT_EQ(raw[16 * j + 1 + i], pixels[15 * j + i]);
      }
    }
    at += 12 + size;
  }
  EXPECT_EQ(found, "IEND");
}

TEST(PngTest, AStripHasAllPictures) {
  const std::string picture(3 * 4, '\x40');
  const std::string png = PngStrip({{picture, picture, picture}, {picture}}, 2, 3);
  EXPECT_EQ(Number(png, 16), 3U * (2 * 3 + 4) + 4);
  EXPECT_EQ(Number(png, 20), 2U * (2 * 3 + 4) + 4);
}

nlohmann::ordered_json Cell(const std::string& name, double labels, double error) {
  const std::vector<double> position(10, error), picture(10, 0.001);
  nlohmann::ordered_json json = {{"cell", name},          {"labels", labels},
                                 {"seen_error", 0.05},    {"iterations", 100},
                                 {"iterations_now", 100}, {"cpu_seconds", 40.0 * labels}};
  for (const char* predictor : {"model", "constant velocity", "last frame", "true state"}) {
    json["ahead"][predictor] = {{"position", position}, {"picture", picture}};
  }
  json["parameters"] = {{{"name", "damping"}, {"estimate", 0.021}, {"truth", 0.02}}};
  return json;
}

TEST(ReportTest, SimbHasItsTable) {
  const nlohmann::ordered_json score = {
      {"mean", 1.25}, {"lower_quartile", 0.5}, {"median", 0.75}, {"upper_quartile", 1.5}};
  nlohmann::ordered_json cell = {
      {"cell", "simb_engine_10_0"}, {"labels", 0.1}, {"seen_error", 0.03}};
  for (const char* predictor : {"ours", "true state", "constant velocity", "last frame"}) {
    cell["simb"][predictor] = {{"near", score}, {"far", score}};
  }
  const std::string tables = StudyTables({cell});
  for (const char* part : {"simb_engine_10_0", "true state", "1.250", "2.55"}) {
    EXPECT_NE(tables.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(tables.find("Billiards"), std::string::npos);
}

TEST(ReportTest, TablesAndPlotsHaveEveryCell) {
  const std::vector<nlohmann::ordered_json> cells = {Cell("billiards_engine_10_0", 0.1, 0.5),
                                                     Cell("billiards_engine_100_0", 1.0, 0.25),
                                                     Cell("billiards_mlp_10_0", 0.1, 4.0)};
  const std::string tables = StudyTables(cells);
  for (const char* part :
       {"billiards_engine_10_0", "billiards_mlp_10_0", "4.000", "0.0210 (0.02)",
        "constant velocity", "3 trainings of one thread: 4 to 40 s of CPU time, together 48 s"}) {
    EXPECT_NE(tables.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(tables.find("SimB"), std::string::npos);
  // A training that was interrupted is not counted.
  std::vector<nlohmann::ordered_json> resumed = {cells[0]};
  resumed[0]["iterations_now"] = 99;
  EXPECT_EQ(StudyTables(resumed).find("trainings"), std::string::npos);
  EXPECT_NE(TimingLine({{"batch", 32},
                        {"frames", 10},
                        {"physics_seconds", 0.004},
                        {"iteration_seconds", 0.2},
                        {"share", 0.02}})
                .find("share 2.0 %"),
            std::string::npos);
  EXPECT_NE(ErrorByFrameSvg(cells).find("billiards_engine_100_0"), std::string::npos);
  const std::string by_labels = ErrorByLabelsSvg(cells);
  EXPECT_EQ(by_labels.find("<svg"), 0U);
  EXPECT_NE(by_labels.find("billiards_mlp"), std::string::npos);
  EXPECT_EQ(by_labels.find("billiards_mlp_10"), std::string::npos);
  const std::string picture(kPictureBytes, '\x20');
  const std::string page = PredictionPage("discs", {picture, picture}, {picture, picture}, "");
  EXPECT_NE(page.find("data:image/png;base64,"), std::string::npos);
  EXPECT_NE(page.find("\"iVBORw0KGgo"), std::string::npos);  // as every PNG begins
}

}  // namespace
}  // namespace tangible
