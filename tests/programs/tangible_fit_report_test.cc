// SPDX-License-Identifier: Apache-2.0
//
// The report of a fit in a browser. Without Chromium there is nothing to look at it with.
#include <cstdlib>
#include <random>
#include <sstream>

#include "fit_fixture.h"

namespace tangible {
namespace {

/// The browser's name, or empty.
std::string Browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    if (std::system(("command -v " + std::string(name) + " > /dev/null 2>&1").c_str()) == 0) {
      return name;
    }
  }
  return "";
}

// Before the page's scripts: errors are kept. Behind them: the player plays for a while.
constexpr char kWatch[] = R"(<script>
const errors = [];
addEventListener("error", (event) => errors.push(String(event.message)));
for (const kind of ["error", "warn"]) console[kind] = (...all) => errors.push(all.join(" "));
</script>)";
constexpr char kPlay[] = R"(<script>
const shown = () => document.getElementById("now").textContent;
const first = shown();
document.getElementById("play").click();
setTimeout(() => {
  for (const details of document.querySelectorAll("details")) details.open = true;
  const root = document.documentElement, pixels = document.getElementById("stage");
  const drawn = pixels.getContext("2d").getImageData(0, 0, pixels.width, pixels.height).data;
  const result = document.createElement("pre");
  result.id = "seen";
  result.textContent = JSON.stringify({errors, first, later: shown(), width: root.clientWidth,
      wide: root.scrollWidth, drawn: drawn.some((value) => value > 0), marks: view.marks.length,
      folded: document.querySelectorAll("details").length});
  document.body.append(result);
}, 900);
</script>)";

class TangibleFitReportTest : public FitProgramTest {
 protected:
  void SetUp() override {
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0.0, 0.01);
    std::ostringstream table;
    table << "time,body,x,y\n";
    for (int k = 0; k <= 50; ++k) {
      table << 0.01 * k << ",ball," << 0.02 * k + normal(random) << ","
            << Height(k) + normal(random) << "\n";
    }
    SetUpWith(table.str());
  }

  /// What the page says of itself in a window of this width. A browser on a busy machine may end
  /// before the page has answered: it is asked again.
  json Look(const std::string& browser, const std::string& page, int width) {
    constexpr int kMostLooks = 3;
    json seen;
    for (int k = 0; k < kMostLooks; ++k) {
      seen = LookOnce(browser, page, width);
      if (seen.contains("first") && seen["first"] != seen["later"]) break;
    }
    return seen;
  }

  json LookOnce(const std::string& browser, const std::string& page, int width) {
    std::string watched = page;
    watched.insert(watched.find("<head>") + 6, kWatch);
    watched.insert(watched.rfind("</body>"), kPlay);
    // In a frame, because a window has a least width.
    std::string quoted;
    for (const char c : watched)
      quoted += c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
    const std::string frame =
        "<!DOCTYPE html><html><body style=\"margin:0\"><iframe id=\"frame\" style=\"border:0\" "
        "width=\"" +
        std::to_string(width) + "\" height=\"900\" srcdoc=\"" + quoted +
        "\"></iframe><script>setInterval(() => { const seen = "
        "document.getElementById('frame').contentDocument.getElementById('seen'); if (seen) "
        "document.title = seen.textContent; }, 50);</script></body></html>";
    const std::string file = Write("look.html", frame);
    const std::string dom = Path("dom.html");
    const std::string command =
        browser + " --headless --no-sandbox --disable-gpu --user-data-dir='" + Path("profile") +
        "' --window-size=1400,1000 " + "--virtual-time-budget=4000 --dump-dom 'file://" + file +
        "' > '" + dom + "' 2> /dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    const std::string text = Read(dom);
    const size_t begin = text.find("<title>");
    if (begin == std::string::npos) return {{"errors", {"the page did not answer"}}};
    return json::parse(text.substr(begin + 7, text.find("</title>") - begin - 7));
  }
};

TEST_F(TangibleFitReportTest, ThePlayerPlaysAndNothingIsWiderThanThePage) {
  const std::string browser = Browser();
  if (browser.empty()) GTEST_SKIP() << "no Chromium to look at the report with";
  const ProgramRun run = Fit(Problem(), "--missing --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  const std::string page = Read(Path("r.html"));
  for (const int width : {1280, 400}) {
    const json seen = Look(browser, page, width);
    EXPECT_TRUE(seen["errors"].empty()) << seen.dump();
    EXPECT_NE(seen["first"], seen["later"]) << seen.dump();
    EXPECT_EQ(seen["first"], "t = 0.0000 s");
    EXPECT_LE(seen["wide"], seen["width"]) << seen.dump();
    EXPECT_LE(seen["width"], width);
    EXPECT_TRUE(seen["drawn"]);
    EXPECT_GE(seen["marks"], 51);
    EXPECT_GE(seen["folded"], 3);
  }
}

TEST_F(TangibleFitReportTest, TheFirstSentenceSaysWhatToBelieve) {
  ASSERT_EQ(Fit(Problem(), "--report='" + Path("r.html") + "'").exit_status, 0);
  EXPECT_NE(Read(Path("r.html"))
                .find("<p class=\"verdict\">2 parameters were found from 102 measured "
                      "coordinates"),
            std::string::npos);
  EXPECT_NE(Read(Path("r.html")).find("can be believed"), std::string::npos);
  // Ten times the noise that sigma says.
  json wrong = Problem();
  wrong["observations"][0]["sigma"] = 0.001;
  ASSERT_EQ(Fit(wrong, "--report='" + Path("r.html") + "'").exit_status, 0);
  EXPECT_NE(Read(Path("r.html")).find("Take the intervals with care: residuals are larger"),
            std::string::npos);
}

}  // namespace
}  // namespace tangible
