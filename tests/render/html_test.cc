// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/html.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace tangible {
namespace {

TEST(HtmlEscape, EveryCharacterWithAMeaning) {
  EXPECT_EQ(HtmlEscape("a<b> & \"c\" 'd'"), "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
  EXPECT_EQ(HtmlEscape("µ = 0.3"), "µ = 0.3");
}

TEST(ScriptString, CannotEndItsElement) {
  const std::string text = "</script><!-- \" \\ \n µ";
  const std::string literal = ScriptString(text);
  EXPECT_EQ(literal.find('<'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(literal).get<std::string>(), text);
}

TEST(ScriptString, InvalidUtf8IsReplacedNotThrown) {
  EXPECT_EQ(nlohmann::json::parse(ScriptString("a\xff z")).get<std::string>(), "a\uFFFD z");
}

TEST(CompactNumber, SignificantDigitsAndNull) {
  EXPECT_EQ(CompactNumber(0.1 + 0.2), "0.3");
  EXPECT_EQ(CompactNumber(1234567.0), "1.23457e+06");
  EXPECT_EQ(CompactNumber(-0.0), "0");
  EXPECT_EQ(CompactNumber(3.0), "3");
  EXPECT_EQ(CompactNumber(M_PI, 3), "3.14");
  EXPECT_EQ(CompactNumber(std::numeric_limits<double>::quiet_NaN()), "null");
  EXPECT_EQ(CompactNumber(-std::numeric_limits<double>::infinity()), "null");
}

TEST(HtmlTable, EscapesAndAlignsNumbers) {
  const std::string table = HtmlTable({"name", "value"}, {{"a<b", "-1.5e3"}, {"short"}});
  EXPECT_NE(table.find("<td>a&lt;b</td>"), std::string::npos);
  EXPECT_NE(table.find("<td class=\"number\">-1.5e3</td>"), std::string::npos);
  EXPECT_NE(table.find("<td>short</td><td></td>"), std::string::npos);
}

TEST(HtmlPage, IsSelfContained) {
  const std::string page = HtmlPage("a & b", "<p>text</p>");
  EXPECT_NE(page.find("<title>a &amp; b</title>"), std::string::npos);
  EXPECT_NE(page.find("--series-0"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("src="), std::string::npos);
}

}  // namespace
}  // namespace tangible
