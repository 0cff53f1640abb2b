// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/json_reader.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

namespace tangible {
namespace {

std::string ParseError(const std::string& text) {
  Json json;
  std::string error;
  EXPECT_FALSE(ParseJson(text, "f.json", &json, &error)) << text;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  return error;
}

// The message that reading the text gives, "" if none.
std::string ReadError(const std::string& text, const std::function<void(const JsonReader&)>& read) {
  Json json;
  std::string error;
  EXPECT_TRUE(ParseJson(text, "f.json", &json, &error)) << error;
  JsonErrors errors("f.json");
  read(JsonReader(json, &errors));
  return errors.message();
}

TEST(ParseJsonTest, KeepsEveryKindOfValue) {
  Json json;
  std::string error;
  const std::string text =
      R"({"a": [1, -2, 0.1, true, null, "x\n"], "b": {"c": {}}, "d": 18446744073709551615})";
  ASSERT_TRUE(ParseJson(text, "f.json", &json, &error)) << error;
  EXPECT_EQ(json, Json::parse(text));
}

TEST(ParseJsonTest, MalformedTextSaysLineAndColumn) {
  EXPECT_EQ(ParseError("{\n  \"a\": [1,\n").rfind("f.json: line 3, column 1: malformed JSON: ", 0),
            0u);
  EXPECT_EQ(ParseError("").rfind("f.json: line 1, column 1: malformed JSON: ", 0), 0u);
  EXPECT_EQ(ParseError("{\"a\" 1}").rfind("f.json: line 1, column 6: malformed JSON: ", 0), 0u);
  EXPECT_LT(ParseError("[\"" + std::string(100000, 'a')).size(), 300u)
      << "an open string is quoted";
  EXPECT_EQ(ParseError(std::string("{}\n{}") + '\0' + "garbage"),
            "f.json: line 2, column 3: expected text, got a NUL byte");
  EXPECT_EQ(ParseError("[1] x").rfind("f.json: line 1, column 5: malformed JSON: ", 0), 0u);
  EXPECT_EQ(ParseError("{\"a\": \"\xff\"}").rfind("f.json: line 1, column ", 0), 0u);
}

TEST(ParseJsonTest, NumbersThatNoDoubleHoldsAreRefused) {
  EXPECT_EQ(ParseError("[1e999]"),
            "f.json: line 1, column 6: malformed JSON: number overflow parsing '1e999'");
  EXPECT_NE(ParseError("[NaN]").find("line 1, column"), std::string::npos);
  EXPECT_NE(ParseError("[-Infinity]").find("line 1, column"), std::string::npos);
}

TEST(ParseJsonTest, AKeyTwiceIsRefused) {
  EXPECT_EQ(ParseError(R"({"bodies": [{}, {"mass": 1, "mass": 2}]})"),
            "f.json: /bodies/1/mass: key given twice in one object, expected once");
  EXPECT_EQ(ParseError(R"({"a/b~": 1, "a/b~": 1})"),
            "f.json: /a~1b~0: key given twice in one object, expected once");
}

TEST(ParseJsonTest, DeepNestingIsRefusedWithoutOverflow) {
  EXPECT_NE(ParseError(std::string(1000000, '[')).find("nested too deep"), std::string::npos);
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  EXPECT_NE(ParseError(objects).find("nested too deep"), std::string::npos);
  Json json;
  std::string error;
  const std::string deepest = std::string(kMaxJsonDepth, '[') + std::string(kMaxJsonDepth, ']');
  EXPECT_TRUE(ParseJson(deepest, "f.json", &json, &error)) << error;
  EXPECT_FALSE(ParseJson("[" + deepest + "]", "f.json", &json, &error));
}

TEST(JsonReaderTest, ReadsWhatIsThere) {
  const std::string text =
      R"({"n": -2.5, "i": 7, "b": true, "s": "x", "p": [1, 2], "v": [1, 2, 3], "m": [[1, 2], [3, 4]]})";
  EXPECT_EQ(ReadError(text,
                      [](const JsonReader& root) {
                        EXPECT_EQ(root.At("n").Number(), -2.5);
                        EXPECT_EQ(root.At("i").Integer(0, 10), 7);
                        EXPECT_TRUE(root.At("b").Boolean());
                        EXPECT_EQ(root.At("s").String(), "x");
                        EXPECT_EQ(root.At("p").Point(), Vector2<double>(1, 2));
                        EXPECT_EQ(root.At("v").Vector(), Vector3<double>(1, 2, 3));
                        const MatrixX<double> m = root.At("m").Matrix();
                        EXPECT_EQ(m(0, 1), 2.0);
                        EXPECT_EQ(m(1, 0), 3.0);
                        EXPECT_EQ(root.Keys().size(), 7u);
                      }),
            "");
}

TEST(JsonReaderTest, MessagesNamePlaceExpectedAndGot) {
  struct Case {
    std::string text;
    std::function<void(const JsonReader&)> read;
    std::string message;
  };
  const std::vector<Case> cases = {
      {R"({"m": -1})", [](const auto& r) { r.At("m").Number(NumberKind::kPositive); },
       "f.json: /m: expected a number > 0, got -1"},
      {R"({"m": "1"})", [](const auto& r) { r.At("m").Number(); },
       "f.json: /m: expected a number, got \"1\""},
      {R"({})", [](const auto& r) { r.At("m").Number(NumberKind::kFraction); },
       "f.json: /m: missing, expected a number in [0, 1]"},
      {R"({"a": {"b": [0, null]}})",
       [](const auto& r) { r.At("a").At("b").At(1).Number(NumberKind::kNonNegative); },
       "f.json: /a/b/1: expected a number >= 0, got null"},
      {R"({"a": 1})", [](const auto& r) { r.At("a").At("b").At("c").String(); },
       "f.json: /a/b/c: missing, expected a string"},
      {R"({"a": 1.5})", [](const auto& r) { r.At("a").Integer(0, 9); },
       "f.json: /a: expected an integer in [0, 9], got 1.5"},
      {R"({"a": 10})", [](const auto& r) { r.At("a").Integer(0, 9); },
       "f.json: /a: expected an integer in [0, 9], got 10"},
      {R"({"a": 0})", [](const auto& r) { r.At("a").Boolean(); },
       "f.json: /a: expected true or false, got 0"},
      {R"({"a": [1, 2, 3]})", [](const auto& r) { r.At("a").Point(); },
       "f.json: /a: expected an array of 2 numbers [x, y], got an array of 3"},
      {R"({"a": [1, true]})", [](const auto& r) { r.At("a").Vector(); },
       "f.json: /a/1: expected a number, got true"},
      {R"({"a": [[1, 2], [3]]})", [](const auto& r) { r.At("a").Matrix(); },
       "f.json: /a/1: expected a row of 2 numbers, got an array of 1"},
      {R"({"a": "sloww"})",
       [](const auto& r) {
         r.At("a").Choice({"fast", "slow"});
       },
       "f.json: /a: expected one of fast, slow, got \"sloww\""},
      {R"({"x/y": 1})",
       [](const auto& r) {
         r.ExpectKeys({"a", "b"}, " of a thing");
       },
       "f.json: /x~1y: unknown key of a thing, expected one of a, b, got \"x/y\""},
      {R"([])", [](const auto& r) { r.ExpectKeys({"a"}); },
       "f.json: expected an object, got an array of 0"},
      {R"({"a": {}})", [](const auto& r) { r.At("a").ExpectArray("a list"); },
       "f.json: /a: expected a list, got an object"},
      {"{\"a\\nb\": 1}", [](const auto& r) { r.ExpectKeys({"a"}); },
       "f.json: /a\\nb: unknown key, expected one of a, got \"a\\nb\""},
  };
  for (const Case& c : cases) EXPECT_EQ(ReadError(c.text, c.read), c.message);
}

TEST(JsonReaderTest, TheFirstErrorIsKept) {
  EXPECT_EQ(ReadError(R"({"a": 1, "b": 2})",
                      [](const JsonReader& root) {
                        root.At("b").String();
                        root.At("a").String();
                      }),
            "f.json: /b: expected a string, got 2");
}

TEST(JsonReaderTest, LongValuesAreCutShort) {
  const std::string message = ReadError("\"" + std::string(1000, 'x') + "\"",
                                        [](const JsonReader& root) { root.Number(); });
  EXPECT_LT(message.size(), 120u);
}

}  // namespace
}  // namespace tangible
