// SPDX-License-Identifier: Apache-2.0
//
// Values and derivatives of gap, normal and point, for every kind of feature; which numbers they
// read.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "random_shapes.h"
#include "tangible/geometry/collide.h"
#include "tangible/geometry/contact_geometry_adjoint.h"
#include "tangible/math/dual.h"

namespace tangible::testing {
namespace {

/// A pair with the feature that is evaluated.
struct Case {
  TestShape a;
  Pose<double> pose_a;
  TestShape b;
  Pose<double> pose_b;
  ContactFeature feature;
};

bool IsEdge(const ContactFeature& feature, int body) {
  return feature.kind == (body == 0 ? FeatureKind::kEdgeVertex : FeatureKind::kVertexEdge);
}

std::vector<int> NumbersRead(const Case& pair, int body) {
  const TestShape& shape = body == 0 ? pair.a : pair.b;
  int numbers[4];
  const int count =
      FeatureNumbers(shape.type, static_cast<int>(shape.numbers.size()), IsEdge(pair.feature, body),
                     body == 0 ? pair.feature.a : pair.feature.b, numbers);
  return std::vector<int>(numbers, numbers + count);
}

/// Poses of both bodies, then the numbers that the feature reads of each.
std::vector<double*> Variables(Case* pair, std::array<double, 6>* poses) {
  std::vector<double*> variables;
  *poses = {pair->pose_a.position.x(), pair->pose_a.position.y(), pair->pose_a.angle,
            pair->pose_b.position.x(), pair->pose_b.position.y(), pair->pose_b.angle};
  for (double& value : *poses) {
    variables.push_back(&value);
  }
  for (const int i : NumbersRead(*pair, 0)) {
    variables.push_back(&pair->a.numbers[i]);
  }
  for (const int i : NumbersRead(*pair, 1)) {
    variables.push_back(&pair->b.numbers[i]);
  }
  return variables;
}

template <typename T>
std::array<T, 5> Evaluate(const ContactFeature& feature, const OwnedShape<T>& a,
                          const OwnedShape<T>& b, const std::array<T, 6>& poses) {
  const Pose<T> pose_a(Vector2<T>(poses[0], poses[1]), poses[2]);
  const Pose<T> pose_b(Vector2<T>(poses[3], poses[4]), poses[5]);
  const ContactGeometry<T> contact = EvaluateContact(feature, a.View(), pose_a, b.View(), pose_b);
  return {contact.gap, contact.normal.x(), contact.normal.y(), contact.point.x(),
          contact.point.y()};
}

/// The numbers listed are variables from `*variable` on; those not listed are NaN, with NaN
/// derivatives.
OwnedShape<LocalJet> ToJets(const Case& pair, int body, int* variable) {
  const TestShape& shape = body == 0 ? pair.a : pair.b;
  LocalJet nan(std::numeric_limits<double>::quiet_NaN());
  nan.v.setConstant(std::numeric_limits<double>::quiet_NaN());
  OwnedShape<LocalJet> result{shape.type, std::vector<LocalJet>(shape.numbers.size(), nan)};
  for (const int i : NumbersRead(pair, body)) {
    result.numbers[i] = LocalJet(shape.numbers[i], (*variable)++);
  }
  return result;
}

std::array<LocalJet, 5> EvaluateJets(const Case& pair) {
  const std::array<double, 6> values = {pair.pose_a.position.x(), pair.pose_a.position.y(),
                                        pair.pose_a.angle,        pair.pose_b.position.x(),
                                        pair.pose_b.position.y(), pair.pose_b.angle};
  std::array<LocalJet, 6> poses;
  for (int i = 0; i < 6; ++i) {
    poses[i] = LocalJet(values[i], i);
  }
  int variable = 6;
  const OwnedShape<LocalJet> a = ToJets(pair, 0, &variable);
  const OwnedShape<LocalJet> b = ToJets(pair, 1, &variable);
  return Evaluate(pair.feature, a, b, poses);
}

/// Central differences of fourth order.
std::array<double, 5> Difference(Case pair, int variable, double h) {
  std::array<double, 6> poses{};
  double* const x = Variables(&pair, &poses)[variable];
  const double at = *x;
  std::array<double, 5> result{};
  constexpr double kWeights[4] = {1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};
  constexpr double kSteps[4] = {-2.0, -1.0, 1.0, 2.0};
  for (int i = 0; i < 4; ++i) {
    *x = at + kSteps[i] * h;
    const std::array<double, 5> value = Evaluate(pair.feature, pair.a, pair.b, poses);
    for (int k = 0; k < 5; ++k) {
      result[k] += kWeights[i] * value[k] / h;
    }
  }
  return result;
}

/// Jets against differences, in all variables. The unlisted numbers are NaN in the Jets.
void ExpectDerivatives(const Case& pair) {
  const std::array<LocalJet, 5> jets = EvaluateJets(pair);
  Case copy = pair;
  std::array<double, 6> poses{};
  const int num_variables = static_cast<int>(Variables(&copy, &poses).size());
  ASSERT_LE(num_variables, kLocalJetWidth);
  const std::array<double, 5> value = Evaluate(pair.feature, pair.a, pair.b, poses);
  double largest = 0.0;
  bool is_bit_identical = true;
  // Truncation: h⁴ times fifth derivatives, up to 1e4 here; rounding: 1e-15 / h.
  const double h = 1e-4;
  const double tolerance = 1e-10;
  for (int variable = 0; variable < num_variables; ++variable) {
    const std::array<double, 5> difference = Difference(pair, variable, h);
    for (int k = 0; k < 5; ++k) {
      ASSERT_NEAR(jets[k].a, value[k], 1e-14);
      ASSERT_NEAR(jets[k].v[variable], difference[k], tolerance)
          << "output " << k << ", variable " << variable << ", kind "
          << static_cast<int>(pair.feature.kind);
      largest = std::fmax(largest, std::abs(difference[k]));
      is_bit_identical = is_bit_identical && jets[k].v[variable] == difference[k];
    }
  }
  EXPECT_GT(largest, 0.1);
  EXPECT_FALSE(is_bit_identical);
  for (int variable = num_variables; variable < kLocalJetWidth; ++variable) {
    EXPECT_EQ(jets[0].v[variable], 0.0);
  }
}

/// The adjoint of each output against the Jets, in all variables.
void ExpectAdjointOfJets(const Case& pair) {
  const std::array<LocalJet, 5> jets = EvaluateJets(pair);
  const size_t numbers_a = NumbersRead(pair, 0).size();
  const size_t numbers_b = NumbersRead(pair, 1).size();
  for (int k = 0; k < 5; ++k) {
    ContactGeometry<double> bar;
    bar.gap = k == 0 ? 1.0 : 0.0;
    bar.normal = Vector2<double>(k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0);
    bar.point = Vector2<double>(k == 3 ? 1.0 : 0.0, k == 4 ? 1.0 : 0.0);
    ContactSideAdjoint a, b;
    EvaluateContactAdjoint(pair.feature, pair.a.View(), pair.pose_a, pair.b.View(), pair.pose_b,
                           bar, &a, &b);
    std::vector<double> all(a.pose, a.pose + 3);
    all.insert(all.end(), b.pose, b.pose + 3);
    all.insert(all.end(), a.numbers, a.numbers + numbers_a);
    all.insert(all.end(), b.numbers, b.numbers + numbers_b);
    for (size_t variable = 0; variable < all.size(); ++variable) {
      // Sums of a few products of numbers up to about 10, and 1 / 0.3 for corners that are near.
      EXPECT_NEAR(all[variable], jets[k].v[variable], 1e-13 * (1.0 + std::abs(all[variable])))
          << "output " << k << ", variable " << variable << ", kind "
          << static_cast<int>(pair.feature.kind);
    }
  }
}

TEST(ContactGeometry, JetsAgreeWithDifferencesOnRandomPairs) {
  std::mt19937 random(20240201);
  int num_of_kind[5] = {};
  for (int sample = 0; sample < 400; ++sample) {
    Case pair{RandomShape(&random),
              RandomPose(&random, 1.5),
              RandomShape(&random),
              RandomPose(&random, 1.5),
              {}};
    if (sample % 4 == 0) {
      TestShape& shape = sample % 8 == 0 ? pair.a : pair.b;
      shape = HalfPlane(Uniform(&random, 0.5, 2.0), Uniform(&random, -2.0, 2.0),
                        Uniform(&random, -1.0, 1.0));
    }
    const Contacts contacts = Collide(pair.a, pair.pose_a, pair.b, pair.pose_b);
    for (int i = 0; i < contacts.count; ++i) {
      pair.feature = contacts.features[i];
      // Two vertices that nearly coincide: derivatives of the normal grow with 1 / distance.
      const double distance =
          contacts.geometry[i].gap + CoreRadius(pair.a.View()) + CoreRadius(pair.b.View());
      if (pair.feature.kind == FeatureKind::kVertexVertex && distance < 0.3) {
        continue;
      }
      ExpectDerivatives(pair);
      ExpectAdjointOfJets(pair);
      ++num_of_kind[static_cast<int>(pair.feature.kind)];
    }
  }
  for (const int count : num_of_kind) {
    EXPECT_GT(count, 10);
  }
}

/// A pair of which one is an ellipse, neither of them nearer than 0.1 m: the curvature of the gap
/// is bounded there.
bool MakeEllipsePair(std::mt19937* random, int sample, Case* pair) {
  TestShape other = sample % 4 == 0   ? HalfPlane(0.3, -2.0, 0.7)
                    : sample % 4 == 1 ? RandomEllipse(random)
                                      : RandomShape(random);
  const Pose<double> pose = RandomPose(random, 2.5);
  const Pose<double> other_pose = RandomPose(random, 2.5);
  const double a = Uniform(random, 0.4, 1.0);
  const TestShape ellipse = Ellipse(a, a * Uniform(random, 0.6, 1.6));
  *pair = sample % 8 < 4 ? Case{ellipse, pose, other, other_pose, {}}
                         : Case{other, other_pose, ellipse, pose, {}};
  const Contacts contacts = Collide(pair->a, pair->pose_a, pair->b, pair->pose_b);
  pair->feature = contacts.features[0];
  return contacts.count == 1 && contacts.geometry[0].gap > 0.1;
}

TEST(ContactGeometry, EllipsesHaveTheirDifferencesAndAdjoints) {
  std::mt19937 random(20240703);
  int num_of_kind[5] = {};
  for (int sample = 0; sample < 400; ++sample) {
    Case pair;
    if (MakeEllipsePair(&random, sample, &pair)) {
      ExpectDerivatives(pair);
      ExpectAdjointOfJets(pair);
      ++num_of_kind[static_cast<int>(pair.feature.kind)];
    }
  }
  for (const int count : num_of_kind) {
    EXPECT_GT(count, 5);
  }
}

/// The geometry along a motion, q(t) = q + t v, in dual numbers over T.
template <typename T>
std::array<Dual<T>, 5> AlongMotion(const Case& pair, const std::array<T, 6>& poses) {
  constexpr double kTwist[6] = {0.7, -0.4, 1.3, -0.2, 0.9, -0.8};
  std::array<Dual<T>, 6> moving;
  for (int i = 0; i < 6; ++i) {
    moving[i] = Dual<T>(poses[i], T(kTwist[i]));
  }
  const auto constant = [](const TestShape& shape) {
    OwnedShape<Dual<T>> result{shape.type, {}};
    for (const double number : shape.numbers) {
      result.numbers.push_back(Dual<T>(T(number), T(0.0)));
    }
    return result;
  };
  return Evaluate(pair.feature, constant(pair.a), constant(pair.b), moving);
}

/// Second derivatives, which the rates of rows take: the derivative of the rate along a motion is
/// the difference quotient of that rate.
TEST(ContactGeometry, EllipsesHaveTheirSecondDerivatives) {
  std::mt19937 random(20240704);
  int compared = 0;
  for (int sample = 0; sample < 200; ++sample) {
    Case pair;
    if (!MakeEllipsePair(&random, sample, &pair)) {
      continue;
    }
    const std::array<double, 6> at = {pair.pose_a.position.x(), pair.pose_a.position.y(),
                                      pair.pose_a.angle,        pair.pose_b.position.x(),
                                      pair.pose_b.position.y(), pair.pose_b.angle};
    std::array<LocalJet, 6> jets;
    for (int i = 0; i < 6; ++i) {
      jets[i] = LocalJet(at[i], i);
    }
    const std::array<Dual<LocalJet>, 5> exact = AlongMotion(pair, jets);
    for (int i = 0; i < 6; ++i) {
      for (const double h : {1e-4, 2e-4}) {
        std::array<double, 6> low = at;
        std::array<double, 6> high = at;
        low[i] -= h;
        high[i] += h;
        const std::array<Dual<double>, 5> before = AlongMotion(pair, low);
        const std::array<Dual<double>, 5> after = AlongMotion(pair, high);
        for (int k = 0; k < 5; ++k) {
          const double quotient = (after[k].b - before[k].b) / (2.0 * h);
          // h² / 6 times fourth derivatives of up to 1 / 0.1³.
          EXPECT_NEAR(exact[k].b.v[i], quotient, 500.0 * h * h) << sample << " " << i << " " << k;
        }
      }
    }
    ++compared;
  }
  EXPECT_GT(compared, 50);
}

TEST(ContactGeometry, GapRateIsTheNormalVelocityAtThePoint) {
  // ∂gap/∂pose = (n, (point − position) × n) of the first body, its negative of the second: what a
  // contact row has.
  std::mt19937 random(20240202);
  for (int sample = 0; sample < 400; ++sample) {
    Case pair{RandomShape(&random),
              RandomPose(&random, 1.5),
              RandomShape(&random),
              RandomPose(&random, 1.5),
              {}};
    if (sample % 4 == 0) {
      pair.b = HalfPlane(0.3, -2.0, 0.7);
    }
    if (sample % 8 == 1) {
      pair.a = Ellipse(0.5, 0.3);
    }
    const Contacts contacts = Collide(pair.a, pair.pose_a, pair.b, pair.pose_b);
    for (int i = 0; i < contacts.count; ++i) {
      pair.feature = contacts.features[i];
      const LocalJet gap = EvaluateJets(pair)[0];
      const ContactGeometry<double>& contact = contacts.geometry[i];
      for (int body = 0; body < 2; ++body) {
        const double sign = body == 0 ? 1.0 : -1.0;
        const Pose<double>& pose = body == 0 ? pair.pose_a : pair.pose_b;
        EXPECT_NEAR(gap.v[3 * body], sign * contact.normal.x(), 1e-13);
        EXPECT_NEAR(gap.v[3 * body + 1], sign * contact.normal.y(), 1e-13);
        EXPECT_NEAR(gap.v[3 * body + 2],
                    sign * Cross(Vector2<double>(contact.point - pose.position), contact.normal),
                    1e-13);
      }
    }
  }
}

/// Round a corner: on either side of the border the chosen branch's derivative is that of
/// differences, and those of the gap meet.
TEST(ContactGeometry, DerivativesOnBothSidesOfTheCorner) {
  const auto at = [](double x) {
    Case pair{Circle(0.2), At(x, 1.5), Box(2, 2), At(0, 0), {}};
    const Contacts contacts = Collide(pair.a, pair.pose_a, pair.b, pair.pose_b);
    pair.feature = contacts.features[0];
    return pair;
  };
  const Case edge = at(1.0 - 1e-3);
  const Case corner = at(1.0 + 1e-3);
  EXPECT_EQ(edge.feature.kind, FeatureKind::kVertexEdge);
  EXPECT_EQ(corner.feature.kind, FeatureKind::kVertexVertex);
  ExpectDerivatives(edge);
  ExpectDerivatives(corner);
  // The gap's second derivative is bounded by 1 / distance = 2.
  const LocalJet before = EvaluateJets(edge)[0];
  const LocalJet after = EvaluateJets(corner)[0];
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(before.v[i], after.v[i], 2.0 * 2e-3);
  }
}

TEST(ContactGeometry, HalfPlaneNormalIsDividedThrough) {
  // gap = n_y y / |n| − d / |n| − r with n = (0, 2), d = 1, y = 3: ∂gap/∂n_y = d / n_y² = 0.25 and
  // not y / |n|; ∂gap/∂d = −0.5; ∂gap/∂n_x = x / |n| = 2.
  Case pair{Circle(0.5), At(4, 3), HalfPlane(0, 2, 1), At(0, 0), {FeatureKind::kVertexPlane, 0, 0}};
  const std::array<LocalJet, 5> jets = EvaluateJets(pair);
  EXPECT_NEAR(jets[0].a, 2.0, 1e-15);
  EXPECT_NEAR(jets[0].v[6], -1.0, 1e-15);  // the circle's radius
  EXPECT_NEAR(jets[0].v[7], 2.0, 1e-15);
  EXPECT_NEAR(jets[0].v[8], 0.25, 1e-15);
  EXPECT_NEAR(jets[0].v[9], -0.5, 1e-15);
}

TEST(ContactGeometry, CoincidentPointsHaveFiniteDerivatives) {
  const Case pair{
      Circle(0.5), At(1, 2), Circle(0.25), At(1, 2), {FeatureKind::kVertexVertex, 0, 0}};
  const std::array<LocalJet, 5> jets = EvaluateJets(pair);
  EXPECT_EQ(jets[0].a, -0.75);
  EXPECT_EQ(jets[1].a, 0.0);
  EXPECT_EQ(jets[2].a, 1.0);
  for (const LocalJet& jet : jets) {
    EXPECT_TRUE(jet.v.allFinite());
  }
  EXPECT_EQ(jets[1].v.norm(), 0.0);
  EXPECT_EQ(jets[2].v.norm(), 0.0);
  ExpectAdjointOfJets(pair);
  // Along the normal the gap opens at unit rate.
  EXPECT_EQ(jets[0].v[1], 1.0);
  EXPECT_EQ(jets[0].v[4], -1.0);
}

TEST(ContactGeometry, EdgeWithoutLengthIsFinite) {
  const Case pair{Circle(0.5),
                  At(1, 2),
                  Polygon({0, 0, 0, 0, 1, 1}),
                  At(0, 0),
                  {FeatureKind::kVertexEdge, 0, 0}};
  for (const LocalJet& jet : EvaluateJets(pair)) {
    EXPECT_TRUE(std::isfinite(jet.a) && jet.v.allFinite());
  }
}

TEST(FeatureNumbers, AreTheOnesOfTheFeature) {
  const auto numbers = [](ShapeType type, int size, bool is_edge, int feature) {
    int result[4];
    const int count = FeatureNumbers(type, size, is_edge, feature, result);
    return std::vector<int>(result, result + count);
  };
  EXPECT_EQ(numbers(ShapeType::kCircle, 1, false, 0), (std::vector<int>{0}));
  EXPECT_EQ(numbers(ShapeType::kBox, 2, false, 3), (std::vector<int>{0, 1}));
  EXPECT_EQ(numbers(ShapeType::kBox, 2, true, 0), (std::vector<int>{1}));
  EXPECT_EQ(numbers(ShapeType::kBox, 2, true, 3), (std::vector<int>{0}));
  EXPECT_EQ(numbers(ShapeType::kCapsule, 2, false, 1), (std::vector<int>{0, 1}));
  EXPECT_EQ(numbers(ShapeType::kCapsule, 2, true, 1), (std::vector<int>{1}));
  EXPECT_EQ(numbers(ShapeType::kPolygon, 10, false, 3), (std::vector<int>{6, 7}));
  EXPECT_EQ(numbers(ShapeType::kPolygon, 10, true, 4), (std::vector<int>{8, 9, 0, 1}));
  EXPECT_EQ(numbers(ShapeType::kHalfPlane, 3, false, 0), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(numbers(ShapeType::kNone, 0, false, 0), (std::vector<int>{}));
}

}  // namespace
}  // namespace tangible::testing
