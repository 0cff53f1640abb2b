// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/jacobian/contact_gradient.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/dynamics/elements/contact.h"

namespace tangible {
namespace {

enum class What { kGap, kSlip, kApproach };

// Two boxes, one at a corner of the other, both moving and turning.
struct Pair {
  Model<double> model;
  State<double> state;
  ActiveContact contact;

  Pair() {
    const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0.1, 0.33],
       "angle": 0.4, "velocity": [0.7, -0.3], "angular_velocity": 1.2},
      {"name": "b", "shape": {"box": {"size": [0.9, 0.2]}}, "mass": 2, "position": [0, 0.02],
       "angle": -0.1, "velocity": [-0.2, 0.4], "angular_velocity": -0.5}]})");
    BuildModel(scene, &model, &state);
    contact.a = 0;
    contact.b = 1;
    ContactFeature features[2];
    EXPECT_GE(FindContactFeatures(model.Shape(0), state.PoseOf(0), model.Shape(1), state.PoseOf(1),
                                  1.0, features),
              1);
    contact.feature = features[0];
  }

  double Value(What what) const {
    ContactRows<double> rows;
    EvaluateContactRows(model, state, contact, &rows);
    const auto speed = [&](const RowPart<double>& a, const RowPart<double>& b) {
      return RelativeSpeed(state, contact.a, a, contact.b, b);
    };
    return what == What::kGap    ? rows.geometry.gap
           : what == What::kSlip ? speed(rows.tangent_a, rows.tangent_b)
                                 : speed(rows.normal_a, rows.normal_b);
  }

  double* Variable(int v) {
    const ModelStructure& s = *model.structure;
    for (int body = 0; body < s.num_bodies(); ++body) {
      for (int i = 0; i < 3; ++i) {
        if (v == s.PoseVariable(body, i)) return &state.pose[3 * body + i];
        if (v == s.TwistVariable(body, i)) return &state.twist[3 * body + i];
      }
    }
    return &model.parameters[v - s.ParameterVariable(0)];
  }
};

TEST(ContactGradientTest, IsTheDerivativeByEveryVariable) {
  for (const What what : {What::kGap, What::kSlip, What::kApproach}) {
    Pair pair;
    LocalJacobianScratch scratch;
    std::vector<JacobianEntry> entries;
    const auto add = what == What::kGap    ? AddGapGradient
                     : what == What::kSlip ? AddSlipGradient
                                           : AddApproachGradient;
    add(pair.model, pair.state, pair.contact, &scratch, &entries);
    const ModelStructure& s = *pair.model.structure;
    std::vector<double> gradient(s.num_variables(), 0.0);
    for (const JacobianEntry& entry : entries) {
      EXPECT_EQ(entry.row, 0);
      gradient[entry.variable] += entry.value;
    }
    int nonzero = 0;
    // Central differences of 1e-5: truncation 1e-10, rounding 1e-11.
    constexpr double kStep = 1e-5;
    for (int v = 0; v < s.num_variables(); ++v) {
      double* const x = pair.Variable(v);
      const double at = *x;
      *x = at + kStep;
      const double high = pair.Value(what);
      *x = at - kStep;
      const double low = pair.Value(what);
      *x = at;
      EXPECT_NEAR(gradient[v], (high - low) / (2.0 * kStep), 1e-8)
          << static_cast<int>(what) << ", variable " << v;
      nonzero += gradient[v] != 0.0 ? 1 : 0;
    }
    EXPECT_GE(nonzero, what == What::kGap ? 8 : 12);
  }
}

TEST(ContactGradientTest, OfALimitIsOneOfTheCoordinateAndItsRate) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [{"name": "arm", "mass": 1, "inertia": 0.1,
      "position": [0.5, 0]}], "joints": [{"name": "pin", "type": "revolute",
      "bodies": ["arm", "world"], "anchor": [0, 0], "limits": [-0.2, 0.3]}]})"),
             &model, &state);
  ActiveContact limit;
  limit.joint = 0;
  limit.a = model.structure->joints[0].a;
  limit.b = model.structure->joints[0].b;
  limit.side = -1.0;
  LocalJacobianScratch scratch;
  std::vector<JacobianEntry> gap, approach;
  AddGapGradient(model, state, limit, &scratch, &gap);
  AddApproachGradient(model, state, limit, &scratch, &approach);
  ASSERT_EQ(approach.size(), 1u);
  EXPECT_EQ(approach[0].variable, model.structure->TwistVariable(0, 2));
  EXPECT_EQ(approach[0].value, -1.0);  // the upper limit opens where the angle falls
  double by_angle = 0.0;
  for (const JacobianEntry& entry : gap) {
    by_angle += entry.variable == model.structure->PoseVariable(0, 2) ? entry.value : 0.0;
  }
  EXPECT_EQ(by_angle, -1.0);
}

}  // namespace
}  // namespace tangible
