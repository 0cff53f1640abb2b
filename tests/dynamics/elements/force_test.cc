// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/force.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

Signal MakeSignal(Signal::Interpolation interpolation) {
  Signal signal;
  signal.interpolation = interpolation;
  signal.time = {1.0, 2.0, 4.0};
  signal.value = {3.0, 5.0, -1.0};
  return signal;
}

TEST(ForceTest, IntegralsOfSignals) {
  const Signal constant = MakeSignal(Signal::Interpolation::kConstant);
  const Signal linear = MakeSignal(Signal::Interpolation::kLinear);
  const auto integrate = [](const Signal& s, double from, double to) {
    return IntegrateSignal(s, s.value, from, to);
  };
  // Before the first and after the last time a signal keeps its value.
  EXPECT_DOUBLE_EQ(integrate(constant, 0.0, 5.0), 3.0 + 3.0 + 10.0 - 1.0);
  EXPECT_DOUBLE_EQ(integrate(linear, 0.0, 5.0), 3.0 + 4.0 + 4.0 - 1.0);
  EXPECT_DOUBLE_EQ(integrate(constant, 1.5, 2.5), 1.5 + 2.5);
  // From 4 to 5 and from 5 to 3.5.
  EXPECT_DOUBLE_EQ(integrate(linear, 1.5, 2.5), 0.5 * 4.5 + 0.5 * 4.25);
  EXPECT_EQ(integrate(linear, 2.0, 2.0), 0.0);
  EXPECT_EQ(integrate(linear, 3.0, 2.0), 0.0);
  EXPECT_EQ(IntegrateSignal(linear, linear.x, 0.0, 1.0), 0.0);
}

TEST(ForceTest, WindowOverlapAndItsDerivative) {
  const auto overlap = [](double start, double end) {
    const LocalJet a(start, 0);
    const LocalJet b(end, 1);
    return WindowOverlap<LocalJet>(1.0, 0.5, &a, &b);
  };
  const struct {
    double start, end, length, d_start, d_end;
  } cases[] = {{0.0, 9.0, 0.5, 0.0, 0.0},  {1.2, 9.0, 0.3, -1.0, 0.0}, {0.0, 1.4, 0.4, 0.0, 1.0},
               {1.1, 1.3, 0.2, -1.0, 1.0}, {1.6, 9.0, 0.0, 0.0, 0.0},  {0.0, 0.9, 0.0, 0.0, 0.0},
               {1.0, 1.5, 0.5, -0.5, 0.5}};  // at the step's ends: the mean of both sides
  for (const auto& c : cases) {
    const LocalJet x = overlap(c.start, c.end);
    EXPECT_NEAR(x.a, c.length, 1e-15);
    EXPECT_EQ(x.v[0], c.d_start) << c.start;
    EXPECT_EQ(x.v[1], c.d_end) << c.end;
  }
  EXPECT_EQ((WindowOverlap<double>(1.0, 0.5, nullptr, nullptr)), 0.5);
}

TEST(ForceTest, ImpulseOfAForceOffCentre) {
  ModelStructure structure;
  ForceIndex force;
  const double numbers[] = {0.5, 0.0, 3.0, 4.0, 0.7};  // at, force, torque
  double impulse[3];
  const double end = 0.1;
  // The body is turned by 90°, so the force acts at (0, 0.5).
  ForceImpulse<double>(structure, force, 0.0, 0.2, std::acos(0.0), numbers, nullptr, &end, impulse);
  EXPECT_NEAR(impulse[0], 0.3, 1e-15);
  EXPECT_NEAR(impulse[1], 0.4, 1e-15);
  EXPECT_NEAR(impulse[2], -0.15 + 0.07, 1e-15);
}

TEST(ForceTest, SignalsReplaceForceAndTorque) {
  ModelStructure structure;
  structure.signals = {MakeSignal(Signal::Interpolation::kLinear)};
  structure.signals[0].x = {1.0, 1.0, 1.0};
  ForceIndex force;
  force.force_signal = 0;
  force.torque_signal = 0;
  const LocalJet zero(0.0);
  const LocalJet numbers[] = {zero, zero, LocalJet(99.0), LocalJet(99.0), LocalJet(99.0)};
  const LocalJet end(1.5, 0);
  LocalJet impulse[3];
  ForceImpulse<LocalJet>(structure, force, 1.0, 1.0, zero, numbers, nullptr, &end, impulse);
  EXPECT_NEAR(impulse[0].a, 0.5, 1e-15);
  EXPECT_EQ(impulse[1].a, 0.0);
  EXPECT_NEAR(impulse[2].a, 0.5 * 3.5, 1e-15);
  EXPECT_NEAR(impulse[0].v[0], 1.0, 1e-15);  // the signal at the window's end
  EXPECT_NEAR(impulse[2].v[0], 4.0, 1e-15);
  JointIndex joint;
  joint.effort_signal = 0;
  EXPECT_NEAR(MeanEffort(structure, joint, 1.0, 1.0), 4.0, 1e-15);
}

TEST(ForceTest, SpringPullsItsAnchorsTogether) {
  const Pose<double> a(Vector2<double>(3.0, 4.0), 0.0);
  const Pose<double> b;
  const double numbers[] = {0.0, 0.0, 0.0, 0.0, 10.0, 0.5, 2.0};
  SpringRow<double> row;
  EvaluateSpring(a, b, numbers, &row);
  EXPECT_DOUBLE_EQ(row.length, 5.0);
  EXPECT_DOUBLE_EQ(row.tension, 30.0);
  EXPECT_DOUBLE_EQ(row.row_a[0], 0.6);
  EXPECT_DOUBLE_EQ(row.row_a[1], 0.8);
  EXPECT_DOUBLE_EQ(row.row_b[0], -0.6);
}

TEST(ForceTest, SpringRowIsTheDerivativeOfItsLengthAndFiniteAtZero) {
  const Pose<LocalJet> a(Vector2<LocalJet>(LocalJet(0.3, 0), LocalJet(0.4, 1)), LocalJet(0.2, 2));
  const Pose<LocalJet> b(Vector2<LocalJet>(LocalJet(0.0, 3), LocalJet(0.0, 4)), LocalJet(0.1, 5));
  LocalJet numbers[7];
  for (int i = 0; i < 7; ++i) numbers[i] = LocalJet(0.1 * (i + 1));
  SpringRow<LocalJet> row;
  EvaluateSpring(a, b, numbers, &row);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(row.row_a[i].a, row.length.v[i], 1e-15);
    EXPECT_NEAR(row.row_b[i].a, row.length.v[3 + i], 1e-15);
  }
  for (int i = 0; i < 4; ++i) numbers[i] = LocalJet(0.0);
  EvaluateSpring(b, b, numbers, &row);
  EXPECT_EQ(row.length.a, 0.0);
  EXPECT_TRUE(row.tension.v.allFinite());
  EXPECT_TRUE(row.row_a[0].v.allFinite());
}

// F_k + (F − F_k) e^{−(v/v_s)²} is what is left; the decay is odd, and smooth where the joint
// stands.
TEST(ForceTest, FrictionDecaysWithTheSpeedEitherWay) {
  const LocalJet numbers[3] = {LocalJet(2.0, 0), LocalJet(0.5, 1), LocalJet(0.3, 2)};
  const LocalJet forward = FrictionDecay(numbers, LocalJet(0.6, 3));
  const LocalJet back = FrictionDecay(numbers, LocalJet(-0.6, 3));
  const double left = std::exp(-4.0);
  EXPECT_NEAR(forward.a, 1.5 * (1.0 - left), 1e-15);
  EXPECT_EQ(back.a, -forward.a);
  const double by[4] = {1.0 - left, left - 1.0, -1.5 * left * 8.0 / 0.3, 1.5 * left * 4.0 / 0.3};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(forward.v[i], by[i], 1e-14);
    EXPECT_NEAR(back.v[i], i == 3 ? by[i] : -by[i], 1e-14);
  }
  const LocalJet still = FrictionDecay(numbers, LocalJet(0.0, 3));
  EXPECT_EQ(still.a, 0.0);
  EXPECT_EQ(still.v.cwiseAbs().maxCoeff(), 0.0);
  const LocalJet at_once[3] = {LocalJet(2.0, 0), LocalJet(0.5, 1), LocalJet(5e-324, 2)};
  const LocalJet gone = FrictionDecay(at_once, LocalJet(0.6, 3));
  EXPECT_EQ(gone.a, 1.5);
  EXPECT_EQ(gone.v[0], 1.0);
  EXPECT_EQ(gone.v[2], 0.0);
}

TEST(SignalAtTest, KeepsThePieceThatWasChosen) {
  Signal signal;
  signal.time = {0.0, 1.0, 2.0};
  signal.value = {1.0, 3.0, 0.0};
  const auto at = [&](double t, double middle) {
    return SignalAt(signal, signal.value, LocalJet(t, 0), middle);
  };
  EXPECT_EQ(at(1.0, 0.5).a, 1.0);
  EXPECT_EQ(at(1.0, 0.5).v[0], 0.0);
  signal.interpolation = Signal::Interpolation::kLinear;
  EXPECT_EQ(at(1.0, 0.5).a, 3.0);
  EXPECT_EQ(at(1.0, 0.5).v[0], 2.0);
  EXPECT_EQ(at(1.5, 1.2).a, 1.5);
  EXPECT_EQ(at(1.5, 1.2).v[0], -3.0);
  EXPECT_EQ(at(2.5, 2.5).a, 0.0);
  EXPECT_EQ(at(2.5, 2.5).v[0], 0.0);
}

}  // namespace
}  // namespace tangible
