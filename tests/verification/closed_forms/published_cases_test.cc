// SPDX-License-Identifier: Apache-2.0
//
// Independent values and derivatives, derived elsewhere by hand, with 45 digits and by integration
// with saltation matrices (published_cases.json). The formulas and the engine are compared with
// every variant.

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bounds.h"

namespace tangible::closed_forms {
namespace {

using Maker = ClosedForm (*)(const std::string&, const Inputs&);

/// What is published of a variant, in the rows and columns of `form`; NaN where it says nothing.
Outcome Published(const ClosedForm& form, const nlohmann::json& variant) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Outcome outcome;
  const auto rows = static_cast<Eigen::Index>(form.outputs.size());
  const auto cols = static_cast<Eigen::Index>(form.parameters.size());
  outcome.values.setConstant(rows, kNan);
  outcome.jacobian.setConstant(rows, cols, kNan);
  // Of a double pendulum's two Jacobians that whose lengths are independent, if they are here.
  bool independent = variant.contains("gradients_primitive");
  if (independent) {
    independent = std::any_of(form.parameters.begin(), form.parameters.end(),
                              [](const auto& parameter) { return parameter.first == "c1"; });
  }
  const char* name = independent ? "gradients_primitive" : "gradients";
  const nlohmann::json gradients = variant.value(name, nlohmann::json::object());
  for (Eigen::Index i = 0; i < rows; ++i) {
    const std::string& output = form.outputs[i];
    if (variant["outputs"].contains(output)) outcome.values[i] = variant["outputs"][output];
    if (!gradients.contains(output)) continue;
    for (Eigen::Index k = 0; k < cols; ++k) {
      const std::string& parameter = form.parameters[k].first;
      const nlohmann::json& row = gradients[output];
      if (row.contains(parameter) && !row[parameter].is_null()) {
        outcome.jacobian(i, k) = row[parameter];
      }
    }
  }
  return outcome;
}

/// Compares what was published; returns how many numbers that were.
int ExpectPublished(const ClosedForm& form, const Outcome& published, const Outcome& got,
                    double relative, const std::string& what) {
  EXPECT_EQ(got.message, "") << what;
  if (!got.message.empty()) return 0;
  int compared = 0;
  const auto expect = [&](double a, double b, double scale, const std::string& entry) {
    if (std::isnan(b)) return;
    ++compared;
    EXPECT_LE(std::abs(a - b), relative * (std::abs(b) + 1e-4 * scale))
        << what << ", " << entry << ": " << a << ", published " << b;
  };
  const auto largest = [](const Eigen::MatrixXd& numbers) {
    return std::max(1e-2, numbers.array().isNaN().select(0.0, numbers).cwiseAbs().maxCoeff());
  };
  for (Eigen::Index i = 0; i < published.values.size(); ++i) {
    expect(got.values[i], published.values[i], largest(published.values), form.outputs[i]);
    for (Eigen::Index k = 0; k < published.jacobian.cols(); ++k) {
      // Neither the engine nor a formula with a kink has all that is published.
      if (std::isnan(got.jacobian(i, k))) continue;
      expect(got.jacobian(i, k), published.jacobian(i, k), largest(published.jacobian),
             "d " + form.outputs[i] + " / d " + form.parameters[k].first);
    }
  }
  return compared;
}

void CompareForm(const std::string& of, Maker maker, int at_least) {
  std::ifstream stream(std::string(TANGIBLE_SOURCE_DIR) +
                       "/tests/verification/closed_forms/published_cases.json");
  const nlohmann::json variants = nlohmann::json::parse(stream);
  int compared = 0;
  for (const nlohmann::json& variant : variants) {
    if (variant["form"] != of) continue;
    Inputs inputs;
    for (const auto& [key, value] : variant["inputs"].items()) inputs[key] = value;
    const std::string name = of + ", " + variant["name"].get<std::string>();
    const ClosedForm form = maker(name, inputs);
    const Outcome published = Published(form, variant);
    const bool smooth = form.kind == Kind::kSmooth;
    // Smooth forms are integrated numerically, and a double pendulum amplifies how sin and cos
    // round, which differs between machines (1e-10 of an entry was seen).
    compared +=
        ExpectPublished(form, published, Exact(form), smooth ? 1e-9 : 1e-11, name + ", formula");
    // Without derivatives: on a kink, whose sides are published. The engine's value counts.
    const int steps = form.instant > 0.0 ? 1 : smooth ? 2000 : 40;
    const Outcome got = Simulate(form, kRungeKutta, steps, Method::kAdjoint);
    compared += ExpectPublished(form, published, got, smooth ? 1e-8 : 1e-9, name + ", engine");
  }
  EXPECT_GE(compared, at_least);
}

TEST(PublishedCases, Drop) { CompareForm("ball_drop", &Drop, 60); }
TEST(PublishedCases, ObliqueWall) { CompareForm("oblique_wall", &ObliqueWall, 80); }
TEST(PublishedCases, TwoDiscs) { CompareForm("two_discs", &TwoDiscs, 300); }
TEST(PublishedCases, SlidingBlock) { CompareForm("block_stop", &SlidingBlock, 20); }
TEST(PublishedCases, Incline) { CompareForm("incline", &Incline, 50); }
TEST(PublishedCases, SlideToRoll) { CompareForm("disc_slide_to_roll", &SlideToRoll, 100); }
TEST(PublishedCases, Rolling) { CompareForm("disc_incline", &Rolling, 100); }
TEST(PublishedCases, PhysicalPendulum) { CompareForm("physical_pendulum", &PhysicalPendulum, 40); }
TEST(PublishedCases, DoublePendulum) { CompareForm("double_pendulum", &DoublePendulum, 100); }
TEST(PublishedCases, ThreeBalls) { CompareForm("three_ball_chain", &ThreeBalls, 200); }
TEST(PublishedCases, FrictionalImpact) { CompareForm("impact_friction", &FrictionalImpact, 300); }
TEST(PublishedCases, BoxPush) { CompareForm("box_tip_slide", &BoxPush, 80); }
TEST(PublishedCases, BoxTip) { CompareForm("box_tip_motion", &BoxTip, 30); }

}  // namespace
}  // namespace tangible::closed_forms
