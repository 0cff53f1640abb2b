// SPDX-License-Identifier: Apache-2.0
#include "tangible/render/view.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace tangible {
namespace {

/// A ball on a spring above a static floor; frame k at k ms, with an impact in frame `impact`.
ViewData MakeView(int num_frames, int impact) {
  ViewData data;
  data.name = "ball";
  data.bodies.resize(2);
  data.bodies[0] = {"floor", Motion::kStatic, {ShapeType::kHalfPlane, {0.0, 1.0, 0.0}}};
  data.bodies[1] = {"ball", Motion::kMoving, {ShapeType::kCircle, {0.25}}};
  ViewJoint joint;
  joint.name = "slider";
  joint.type = JointType::kPrismatic;
  joint.bodies[0] = 1;
  joint.axis = {0.0, 1.0};
  data.joints.push_back(joint);
  ViewSpring spring;
  spring.name = "spring";
  spring.bodies[0] = 1;
  spring.anchors[1] = {0.0, 2.0};
  data.springs.push_back(spring);
  for (int k = 0; k < num_frames; ++k) {
    ViewFrame frame;
    frame.time = 0.001 * k;
    frame.poses = {{0.0, -0.5, 0.0}, {0.1 * k, 1.0, 0.01 * k}};
    frame.kinetic_energy = k;
    frame.potential_energy = 2.0 * k;
    ViewContact contact;
    contact.bodies[0] = 1;
    contact.bodies[1] = 0;
    contact.normal_impulse = k == impact ? 5.0 : 0.125;
    contact.mode = k == impact ? "sliding_left" : "sticking";
    frame.contacts.push_back(contact);
    data.frames.push_back(frame);
  }
  return data;
}

/// What the page's script reads.
nlohmann::json DataOf(const std::string& html) {
  const std::string tag = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = html.find(tag) + tag.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

TEST(ThinFrames, KeepsEndsAndTheImpact) {
  const ViewData data = MakeView(1001, 503);
  ViewOptions options;
  options.max_frames = 101;
  const std::vector<ViewFrame> frames = ThinFrames(data, options);
  ASSERT_EQ(frames.size(), 101U);
  EXPECT_EQ(frames.front().time, data.frames.front().time);
  EXPECT_EQ(frames.back().time, data.frames.back().time);
  int num_impacts = 0;
  for (const ViewFrame& frame : frames) {
    num_impacts += frame.contacts[0].normal_impulse == 5.0 ? 1 : 0;
  }
  EXPECT_EQ(num_impacts, 1);
  EXPECT_EQ(frames[51].contacts[0].normal_impulse, 5.0);
  EXPECT_EQ(frames[51].time, data.frames[510].time);
}

TEST(ThinFrames, BoundsHoldForEveryLength) {
  for (const int num_frames : {0, 1, 2, 3, 9, 10, 11, 12, 19, 20, 21, 100, 101}) {
    ViewOptions options;
    options.max_frames = 10;
    const std::vector<ViewFrame> frames = ThinFrames(MakeView(num_frames, -1), options);
    EXPECT_LE(frames.size(), 10U);
    EXPECT_EQ(frames.empty(), num_frames == 0);
    if (num_frames <= 10) {
      EXPECT_EQ(frames.size(), static_cast<std::size_t>(num_frames));
    }
  }
  ViewOptions options;
  options.max_entries = 300;  // a frame has 3: its pose, its contact, itself
  EXPECT_LE(ThinFrames(MakeView(1000, -1), options).size(), 101U);
}

TEST(ViewHtml, DataIsWhatWasGiven) {
  const nlohmann::json data = DataOf(ViewHtml(MakeView(5, 3)));
  ASSERT_EQ(data["bodies"].size(), 2U);
  EXPECT_EQ(data["bodies"][0]["shape"], "half_plane");
  EXPECT_EQ(data["bodies"][0]["motion"], "static");
  EXPECT_EQ(data["bodies"][0]["pose"], nlohmann::json::array({0, -0.5, 0}));
  EXPECT_FALSE(data["bodies"][1].contains("pose"));
  EXPECT_EQ(data["bodies"][1]["numbers"], nlohmann::json::array({0.25}));
  EXPECT_EQ(data["joints"][0]["type"], "prismatic");
  EXPECT_EQ(data["joints"][0]["axis"], nlohmann::json::array({0, 1}));
  EXPECT_EQ(data["springs"][0]["anchors"][1], nlohmann::json::array({0, 2}));
  EXPECT_EQ(data["springs"][0]["bodies"], nlohmann::json::array({1, -1}));
  EXPECT_EQ(data["time"][4], 0.004);
  EXPECT_EQ(data["poses"][2], nlohmann::json::array({0.2, 1, 0.02}));
  EXPECT_EQ(data["kinetic"][3], 3);
  EXPECT_EQ(data["potential"][3], 6);
  EXPECT_EQ(data["modes"], nlohmann::json::array({"sticking", "sliding_left"}));
  EXPECT_EQ(data["contacts"][3][0], nlohmann::json::array({1, 0, 0, 0, 0, 1, 5, 0, 1}));
}

TEST(ViewHtml, AJointThatEndsSaysWhen) {
  ViewData view = MakeView(2, -1);
  EXPECT_FALSE(DataOf(ViewHtml(view))["joints"][0].contains("until"));
  view.joints[0].until = 0.25;
  EXPECT_EQ(DataOf(ViewHtml(view))["joints"][0]["until"], 0.25);
}

TEST(ViewHtml, EllipsesAndContactPointsAreGiven) {
  ViewData view = MakeView(2, -1);
  view.bodies[1].shape = {ShapeType::kEllipse, {0.5, 0.25}};
  view.bodies[1].contact_points = {{0.0, -0.5}, {0.25, 0.5}};
  const nlohmann::json bodies = DataOf(ViewHtml(view))["bodies"];
  EXPECT_EQ(bodies[1]["shape"], "ellipse");
  EXPECT_EQ(bodies[1]["numbers"], nlohmann::json({0.5, 0.25}));
  EXPECT_EQ(bodies[1]["points"], nlohmann::json::parse("[[0, -0.5], [0.25, 0.5]]"));
  EXPECT_FALSE(bodies[0].contains("points"));
}

TEST(ViewHtml, WhatStandsBelowIsReachedByScrolling) {
  EXPECT_NE(ViewHtml(MakeView(2, -1)).find("<body class=\"view\">"), std::string::npos);
  ViewOptions options;
  options.below = "<p>plots</p>";
  const std::string html = ViewHtml(MakeView(2, -1), options);
  EXPECT_NE(html.find("<body class=\"view long\">"), std::string::npos);
  EXPECT_NE(html.find("<div class=\"below\"><p>plots</p></div>"), std::string::npos);
}

TEST(ViewHtml, EveryIdThatTheScriptLooksUpExists) {
  const std::string html = ViewHtml(MakeView(2, -1));
  int num_ids = 0;
  for (std::size_t at = html.find("$(\""); at != std::string::npos;
       at = html.find("$(\"", at + 1)) {
    const std::string id = html.substr(at + 3, html.find('"', at + 3) - at - 3);
    if (id.back() != '_') {  // "show_" + name
      EXPECT_NE(html.find("id=\"" + id + "\""), std::string::npos) << id;
      ++num_ids;
    }
  }
  EXPECT_GT(num_ids, 8);
}

// On a canvas of 330 pixels the third entry, and the second one's number, lay beyond the edge.
TEST(ViewHtml, TheEnergyPlotsLegendWrapsOnANarrowScreen) {
  const std::string html = ViewHtml(MakeView(2, -1));
  EXPECT_NE(html.find("<div class=\"key\" id=\"energy-key\">"), std::string::npos);
  const std::size_t key = html.find(".view .key {");
  ASSERT_NE(key, std::string::npos);
  EXPECT_LT(html.find("flex-wrap: wrap", key), html.find('}', key));
  // The curves' names are text of the page: nothing writes them at a fixed place of the canvas.
  const std::size_t draws = html.find("function drawEnergy()");
  const std::string body = html.substr(draws, html.find("\n}\n", draws) - draws);
  EXPECT_NE(body.find(".textContent ="), std::string::npos);
  EXPECT_EQ(body.find("fillText(text"), std::string::npos);
}

TEST(ViewHtml, IsSelfContainedAndSafe) {
  ViewData data = MakeView(2, -1);
  data.name = "</script><script>alert(1)</script>";
  data.bodies[1].name = "</script>";
  data.frames[0].contacts[0].mode = "<!--";
  const std::string html = ViewHtml(data);
  EXPECT_EQ(html.find("alert(1)</script>"), std::string::npos);
  EXPECT_EQ(html.find("<!--"), std::string::npos);
  for (const char* outside : {"http:", "https:", " src=", "@import", "url("}) {
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  }
  EXPECT_EQ(DataOf(html)["name"], data.name);
  EXPECT_EQ(DataOf(html)["bodies"][1]["name"], "</script>");
}

TEST(ViewHtml, NumbersThatAreNotFiniteAreNull) {
  ViewData data = MakeView(3, -1);
  data.frames[1].poses[1].x() = std::numeric_limits<double>::quiet_NaN();
  data.frames[2].kinetic_energy = std::numeric_limits<double>::infinity();
  const nlohmann::json json = DataOf(ViewHtml(data));
  EXPECT_TRUE(json["poses"][1][0].is_null());
  EXPECT_TRUE(json["kinetic"][2].is_null());
}

TEST(ViewHtml, FramesWithTheWrongNumberOfPosesAreLeftOut) {
  ViewData data = MakeView(3, -1);
  data.frames[1].poses.pop_back();
  EXPECT_EQ(DataOf(ViewHtml(data))["time"].size(), 2U);
  data.frames.clear();
  EXPECT_EQ(DataOf(ViewHtml(data))["time"].size(), 0U);
}

TEST(ViewHtml, SizeIsBounded) {
  const std::string html = ViewHtml(MakeView(50000, -1));
  // 2000 frames of at most 3 + 9 + 3 numbers of at most 13 characters, and the texts.
  EXPECT_LT(html.size(), 2000U * 15U * 13U + 60000U);
}

}  // namespace
}  // namespace tangible
