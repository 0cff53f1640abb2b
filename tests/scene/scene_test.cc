// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace tangible {
namespace {

TEST(MatchesPatternTest, WithoutStarIsEquality) {
  EXPECT_TRUE(MatchesPattern("ball", "ball"));
  EXPECT_FALSE(MatchesPattern("ball", "ball2"));
  EXPECT_FALSE(MatchesPattern("ball", "bal"));
  EXPECT_FALSE(MatchesPattern("", "a"));
  EXPECT_TRUE(MatchesPattern("", ""));
  // A dot is a dot, not any character.
  EXPECT_FALSE(MatchesPattern("a.b", "axb"));
}

TEST(MatchesPatternTest, StarStandsForAnyCharacters) {
  EXPECT_TRUE(MatchesPattern("*", ""));
  EXPECT_TRUE(MatchesPattern("*", "a/b"));
  EXPECT_TRUE(MatchesPattern("link*", "link"));
  EXPECT_TRUE(MatchesPattern("link*", "link12"));
  EXPECT_FALSE(MatchesPattern("link*", "lin"));
  EXPECT_TRUE(MatchesPattern("*k*1*", "link21"));
  EXPECT_FALSE(MatchesPattern("*k*1*", "1link"));
  EXPECT_TRUE(MatchesPattern("a**b", "ab"));
  // The first place where "ab" fits is not the right one.
  EXPECT_TRUE(MatchesPattern("*abc", "ababc"));
}

TEST(MatchesPatternTest, ManyStarsStayFast) {
  std::string pattern;
  for (int i = 0; i < 50; ++i) pattern += "*a";
  // A search that returns to every star would take 2^50 steps.
  EXPECT_FALSE(MatchesPattern(pattern + "b", std::string(200, 'a')));
}

TEST(MatchesPathTest, StarStaysWithinAComponent) {
  EXPECT_TRUE(MatchesPath("bodies/link*/mass", "bodies/link7/mass"));
  EXPECT_FALSE(MatchesPath("bodies/*", "bodies/ball/mass"));
  EXPECT_FALSE(MatchesPath("*", "a/b"));
  EXPECT_FALSE(MatchesPath("bodies/*/x", "bodies/ball/position/x"));
  EXPECT_TRUE(MatchesPath("*/*/*/x", "bodies/ball/position/x"));
  EXPECT_FALSE(MatchesPath("bodies/ball*mass", "bodies/ball/mass"));
  EXPECT_TRUE(MatchesPath("pairs/ball:wall*/friction", "pairs/ball:wall*/friction"));
}

// The definition, by recursion.
bool Slow(const std::string& p, const std::string& n, char separator) {
  if (p.empty()) return n.empty();
  if (p[0] != '*') return !n.empty() && p[0] == n[0] && Slow(p.substr(1), n.substr(1), separator);
  if (Slow(p.substr(1), n, separator)) return true;
  return !n.empty() && n[0] != separator && Slow(p, n.substr(1), separator);
}

TEST(MatchesPathTest, AgreesWithTheDefinitionOnRandomTexts) {
  std::mt19937 random(7);
  const std::string letters = "ab/*";
  const auto text = [&random, &letters](int count) {
    std::string result;
    for (int i = 0; i < count; ++i) result += letters[random() % letters.size()];
    return result;
  };
  int matches = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::string pattern = text(static_cast<int>(random() % 7));
    const std::string name = text(static_cast<int>(random() % 7));
    EXPECT_EQ(MatchesPath(pattern, name), Slow(pattern, name, '/')) << pattern << " " << name;
    EXPECT_EQ(MatchesPattern(pattern, name), Slow(pattern, name, '\0')) << pattern << " " << name;
    matches += MatchesPath(pattern, name) ? 1 : 0;
  }
  EXPECT_GT(matches, 100);
}

TEST(SimulationSettingsTest, WhatIsNotSetFollowsTheSteppingWheneverThatIsSet) {
  SimulationSettings settings;
  EXPECT_EQ(IntegratorOf(settings), Integrator::kSemiImplicitEuler);
  EXPECT_EQ(JointCorrectionOf(settings), JointCorrection::kNone);
  settings.stepping = Stepping::kEvent;
  EXPECT_EQ(IntegratorOf(settings), Integrator::kRungeKutta4);
  EXPECT_EQ(JointCorrectionOf(settings), JointCorrection::kProjection);
  settings.integrator = Integrator::kTrapezoidal;
  settings.joint_correction = JointCorrection::kNone;
  EXPECT_EQ(IntegratorOf(settings), Integrator::kTrapezoidal);
  EXPECT_EQ(JointCorrectionOf(settings), JointCorrection::kNone);
}

}  // namespace
}  // namespace tangible
