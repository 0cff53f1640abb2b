// SPDX-License-Identifier: Apache-2.0
//
// The choice of features against a brute force that shares nothing with it, and its invariances.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "random_shapes.h"
#include "tangible/geometry/collide.h"

namespace tangible::testing {
namespace {

constexpr int kNumSamples = 20000;
/// Coordinates are below 10.
constexpr double kWideTolerance = 10.0 * kTolerance;

TEST(CollideCoreRandom, GapIsTheSignedDistanceOfAllPairs) {
  std::mt19937 random(20240101);
  int num_apart = 0;
  int num_in_penetration = 0;
  int num_two = 0;
  int num_vertex_vertex = 0;
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 1.5);
    const Pose<double> pose_b = RandomPose(&random, 1.5);
    const Contacts contacts = Collide(a, pose_a, b, pose_b);
    const double expected = SignedDistance(a, pose_a, b, pose_b);
    ASSERT_GE(contacts.count, 1) << sample;
    ASSERT_NEAR(contacts.geometry[0].gap, expected, kWideTolerance) << sample;
    if (contacts.count == 2) {
      ++num_two;
      ASSERT_GE(contacts.geometry[1].gap, contacts.geometry[0].gap - kWideTolerance) << sample;
      ASSERT_FALSE(contacts.features[0] == contacts.features[1]) << sample;
    }
    (expected > 0.0 ? num_apart : num_in_penetration) += 1;
    num_vertex_vertex += contacts.features[0].kind == FeatureKind::kVertexVertex ? 1 : 0;
  }
  // Each kind of case must have been met often.
  EXPECT_GT(num_apart, kNumSamples / 20);
  EXPECT_GT(num_in_penetration, kNumSamples / 20);
  EXPECT_GT(num_two, kNumSamples / 20);
  EXPECT_GT(num_vertex_vertex, kNumSamples / 20);
}

// A triangle and a box that slide towards each other on a floor: the tip meets the end of a face,
// by rounding beside it, and it is the only contact within reach.
TEST(CollideCoreTies, ATipBeforeTheEndOfAFaceIsNotLost) {
  const TestShape triangle =
      Polygon({0.13700537136076896, -0.053678600659748596, -0.07712391176713448,
               0.12531466867141383, -0.1288331979609946, -0.071090583438555});
  const TestShape box = Box(0.2583188115705465, 0.18118329127363492);
  const Pose<double> on_floor =
      At(0.071506927629088946, 0.062518264768450557, -0.065404908703935768);
  for (const double rise : {0.0, 1e-17, -1e-17, 1e-16, -1e-16, 1e-15, -1e-15, 1e-12, -1e-12}) {
    const Pose<double> other =
        At(0.33813951958763983, 0.090591645636817486 + rise, 1.0831962713870811e-16);
    const Contacts contacts = Collide(triangle, on_floor, box, other, 0.0186);
    ASSERT_GE(contacts.count, 1) << rise;
    EXPECT_NEAR(contacts.geometry[0].gap, SignedDistance(triangle, on_floor, box, other), 1e-12)
        << rise;
    EXPECT_NEAR(contacts.geometry[0].gap, 0.004269, 1e-6) << rise;
  }
}

// A box that slides off the end of a table. Where it has only one contact left, and then another
// one, must not depend on how long the table is: a derivative with respect to that would be
// missing.
TEST(CollideCoreTies, WhereFeaturesChangeDoesNotDependOnTheFacesLength) {
  const auto place_of_change = [](double width, int count) {
    const TestShape table = Box(width, 0.5);
    const TestShape box = Box(0.5, 0.25);
    double low = -1e-6;
    double high = 1e-6;
    while (high - low > 1e-16) {
      const double middle = 0.5 * (low + high);
      // The table ends at x = 0, and the box begins at `middle`.
      const Contacts found =
          Collide(table, At(-0.5 * width, -0.25, 0.0), box, At(0.25 + middle, 0.125, 0.0));
      const bool on_table = found.count >= count && std::abs(found.geometry[0].normal.y()) > 0.9;
      (on_table ? low : high) = middle;
    }
    return low;
  };
  for (const int count : {1, 2}) {
    const double place = place_of_change(1.0, count);
    EXPECT_NEAR(place, 0.0, 1e-8);
    EXPECT_NEAR(place_of_change(1.25, count), place, 1e-14) << count;
    EXPECT_NEAR(place_of_change(1.4375, count), place, 1e-14) << count;
  }
}

// At a point of overlap, by rounding more or less, there is one contact and always the same one.
TEST(CollideCoreTies, FacesThatOverlapInAPointHaveOneContact) {
  const TestShape table = Box(1.0, 0.5);
  const TestShape box = Box(0.5, 0.25);
  std::optional<ContactFeature> first;
  for (const double rise : {0.0, 1e-17, -1e-17, 1e-16, -1e-16, 1e-12, -1e-12}) {
    for (const double over : {0.0, 1e-16, -1e-16, 1e-12, -1e-12, 1e-10, -1e-10}) {
      const Contacts found =
          Collide(table, At(-0.5, -0.25, 0.0), box, At(0.25 + over, 0.125 + rise, 1e-17));
      ASSERT_EQ(found.count, 1) << rise << " " << over;
      // Of the two faces' normals either is as good: so deep is it behind neither.
      if (std::abs(found.geometry[0].normal.y()) > 0.9) {
        first = first.value_or(found.features[0]);
        EXPECT_TRUE(found.features[0] == *first) << rise << " " << over;
      }
    }
  }
  EXPECT_TRUE(first.has_value());
}

TEST(CollideCoreRandom, PointIsMidwayBetweenTheSurfaces) {
  std::mt19937 random(20240102);
  const TestShape probe = Circle(0.0);
  int num_apart = 0;
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 3.0);
    const Pose<double> pose_b = RandomPose(&random, 3.0);
    const Contacts contacts = Collide(a, pose_a, b, pose_b);
    ASSERT_GE(contacts.count, 1);
    const ContactGeometry<double>& contact = contacts.geometry[0];
    if (contact.gap <= 0.0) {
      continue;
    }
    ++num_apart;
    const Pose<double> at_point(contact.point, 0.0);
    ASSERT_NEAR(SignedDistance(probe, at_point, a, pose_a), 0.5 * contact.gap, kWideTolerance);
    ASSERT_NEAR(SignedDistance(probe, at_point, b, pose_b), 0.5 * contact.gap, kWideTolerance);
    ASSERT_NEAR(contact.normal.norm(), 1.0, kWideTolerance);
    // From the second body to the first: a step along it from the point comes nearer to the first.
    const Pose<double> nearer(contact.point + 0.25 * contact.gap * contact.normal, 0.0);
    ASSERT_NEAR(SignedDistance(probe, nearer, a, pose_a), 0.25 * contact.gap, kWideTolerance);
  }
  EXPECT_GT(num_apart, kNumSamples / 4);
}

TEST(CollideCoreRandom, SwappedBodiesGiveTheMirroredContacts) {
  std::mt19937 random(20240103);
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 1.5);
    const Pose<double> pose_b = RandomPose(&random, 1.5);
    const Contacts forward = Collide(a, pose_a, b, pose_b);
    const Contacts backward = Collide(b, pose_b, a, pose_a);
    ASSERT_EQ(forward.count, backward.count) << sample;
    for (int i = 0; i < forward.count; ++i) {
      ASSERT_EQ(forward.features[i], Mirrored(backward.features[i])) << sample;
      ASSERT_NEAR(forward.geometry[i].gap, backward.geometry[i].gap, kWideTolerance);
      ASSERT_NEAR((forward.geometry[i].normal + backward.geometry[i].normal).norm(), 0.0,
                  kWideTolerance);
      ASSERT_NEAR((forward.geometry[i].point - backward.geometry[i].point).norm(), 0.0,
                  kWideTolerance);
    }
  }
}

TEST(CollideCoreRandom, ChoiceDoesNotDependOnTheCoordinates) {
  std::mt19937 random(20240104);
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 1.5);
    const Pose<double> pose_b = RandomPose(&random, 1.5);
    const Pose<double> motion = RandomPose(&random, 5.0);
    const Contacts here = Collide(a, pose_a, b, pose_b);
    const Contacts there =
        Collide(a, Pose<double>(motion * pose_a.position, motion.angle + pose_a.angle), b,
                Pose<double>(motion * pose_b.position, motion.angle + pose_b.angle));
    ASSERT_EQ(here.count, there.count) << sample;
    for (int i = 0; i < here.count; ++i) {
      ASSERT_EQ(here.features[i], there.features[i]) << sample;
      ASSERT_NEAR(here.geometry[i].gap, there.geometry[i].gap, kWideTolerance);
      ASSERT_NEAR((motion.rotation * here.geometry[i].normal - there.geometry[i].normal).norm(),
                  0.0, kWideTolerance / 0.1);
      ASSERT_NEAR((motion * here.geometry[i].point - there.geometry[i].point).norm(), 0.0,
                  10.0 * kWideTolerance);
    }
  }
}

TEST(CollideCoreRandom, MaximalGapLeavesOutNoNearerContact) {
  std::mt19937 random(20240105);
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const TestShape a = RandomShape(&random);
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 1.5);
    const Pose<double> pose_b = RandomPose(&random, 1.5);
    const double max_gap = Uniform(&random, -0.2, 0.5);
    const Contacts all = Collide(a, pose_a, b, pose_b);
    const Contacts near = Collide(a, pose_a, b, pose_b, max_gap);
    int expected = 0;
    for (int i = 0; i < all.count; ++i) {
      if (all.geometry[i].gap < max_gap) {
        ASSERT_EQ(all.features[i], near.features[expected]);
        ++expected;
      }
    }
    ASSERT_EQ(near.count, expected);
  }
}

TEST(CollideCoreRandom, NearlyParallelFacesGiveTheEndsOfTheirOverlap) {
  // Tilts, gaps and overhangs from rounding to 1e-6, in turned coordinates: contacts at both ends,
  // gaps right to the tilt, normals too.
  std::mt19937 random(20240107);
  const auto tiny = [&random] {
    return std::pow(10.0, Uniform(&random, -18.0, -6.0)) *
           (Uniform(&random, -1.0, 1.0) < 0 ? -1 : 1);
  };
  for (int sample = 0; sample < kNumSamples; ++sample) {
    const double width = Uniform(&random, 0.5, 2.0);
    const double tilt = tiny();
    const double shift = sample % 2 == 0 ? tiny() : Uniform(&random, -0.2, 0.2);
    const double gap = tiny();
    const TestShape a = sample % 3 == 0 ? Capsule(width, 0.5) : Box(width, 1.0);
    const TestShape b = Box(1.0, 1.0);
    const Pose<double> frame = RandomPose(&random, 3.0);
    const Pose<double> pose_a(frame * Vector2<double>(shift, 1.0 + gap), frame.angle + tilt);
    const Contacts contacts = Collide(a, pose_a, b, frame, 1e-3);
    ASSERT_EQ(contacts.count, 2) << sample;
    const double left = std::fmax(-0.5, shift - 0.5 * width);
    const double right = std::fmin(0.5, shift + 0.5 * width);
    const double tolerance = kWideTolerance + 4.0 * (std::abs(tilt) + std::abs(gap)) + 4e-9;
    double sum = 0.0;
    for (const ContactGeometry<double>& contact : contacts.geometry) {
      const Vector2<double> point = frame.Inverse(contact.point);
      ASSERT_NEAR(std::fmin(std::abs(point.x() - left), std::abs(point.x() - right)), 0.0,
                  tolerance);
      sum += point.x();
      ASSERT_NEAR(contact.gap, gap + tilt * (point.x() - shift),
                  kWideTolerance + tilt * tilt * 4.0);
      ASSERT_NEAR(frame.rotation.Inverse(contact.normal).x(), 0.0, kWideTolerance + std::abs(tilt));
    }
    ASSERT_NEAR(sum, left + right, 2.0 * tolerance);  // one at each end
  }
}

/// A regular polygon with more vertices than any buffer of the engine.
TestShape RegularPolygon(int num_vertices) {
  std::vector<double> vertices;
  for (int i = 0; i < num_vertices; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / num_vertices;
    vertices.push_back(std::cos(angle));
    vertices.push_back(std::sin(angle));
  }
  return Polygon(vertices);
}

/// Degenerate and extreme shapes: thin, long, of no length, with collinear and repeated vertices.
std::vector<TestShape> ExtremeShapes() {
  return {Circle(0.0),
          Circle(1e-9),
          Capsule(0.0, 0.1),
          Capsule(1e-200, 0.1),
          Capsule(1.0, 0.0),
          Capsule(1e6, 1e-6),
          Box(1.0, 1e-12),
          Box(1e-12, 1.0),
          Box(1e6, 1e-6),
          Box(0.0, 0.0),
          Polygon({0, 0, 1, 0, 0.5, 1e-14}),
          Polygon({0, 0, 1, 0, 2, 0, 1, 1}),
          Polygon({0, 0, 1, 0, 1, 0, 1, 1, 0, 1}),
          Polygon({0, 0, 0, 0, 0, 0}),
          Polygon({0, 0, 1, 0, 0, 0}),
          Polygon({-1e-8, 0, 0, -1e6, 1e-8, 0, 0, 1e6}),
          RegularPolygon(1000)};
}

TEST(CollideCoreExtreme, EverythingIsFinite) {
  const std::vector<TestShape> shapes = ExtremeShapes();
  const std::vector<Pose<double>> poses = {At(0, 0),        At(0.5, 0),         At(0, 1),
                                           At(1, 1, 1e-13), At(0.3, -0.2, 1.0), At(1e8, 1e8, 0.5),
                                           At(0, 0, 1e-9)};
  for (const TestShape& a : shapes) {
    for (const TestShape& b : shapes) {
      for (const Pose<double>& pose : poses) {
        const Contacts contacts = Collide(a, At(0, 0), b, pose);
        ASSERT_GE(contacts.count, 1);
        for (int i = 0; i < contacts.count; ++i) {
          const ContactGeometry<double>& contact = contacts.geometry[i];
          ASSERT_TRUE(std::isfinite(contact.gap) && contact.normal.allFinite() &&
                      contact.point.allFinite());
          ASSERT_NEAR(contact.normal.norm(), 1.0, kWideTolerance);
        }
      }
    }
  }
}

TEST(CollideCore, CapsuleWithoutLengthIsACircle) {
  std::mt19937 random(20240106);
  for (int sample = 0; sample < 200; ++sample) {
    const TestShape b = RandomShape(&random);
    const Pose<double> pose_a = RandomPose(&random, 2.0);
    const Pose<double> pose_b = RandomPose(&random, 2.0);
    const Contacts capsule = Collide(Capsule(0.0, 0.3), pose_a, b, pose_b);
    const Contacts circle = Collide(Circle(0.3), pose_a, b, pose_b);
    ASSERT_EQ(capsule.count, 1);
    ASSERT_EQ(circle.count, 1);
    ASSERT_EQ(capsule.geometry[0].gap, circle.geometry[0].gap);
    ASSERT_EQ(capsule.geometry[0].normal, circle.geometry[0].normal);
  }
}

/// Going round a corner of b: gap and normal are continuous where vertex-vertex turns into
/// vertex-edge.
void ExpectContinuous(const TestShape& a, double turn) {
  const TestShape b = Box(2.0, 2.0);
  constexpr int kNumSteps = 10000;
  const double step = 1.0 / kNumSteps;
  const auto at = [&](int i) {
    const double t = -0.5 + i * step;
    return Collide(a, At(1.0 + t, 1.9 - 0.3 * t, turn), b, At(0, 0));
  };
  Contacts last = at(0);
  int num_switches = 0;
  for (int i = 1; i <= kNumSteps; ++i) {
    const Contacts now = at(i);
    ASSERT_GE(now.count, 1);
    // Bounds: |dgap/dt| ≤ |velocity| = 1.05; the normal turns by at most velocity / distance of the
    // cores.
    ASSERT_NEAR(now.geometry[0].gap, last.geometry[0].gap, 1.1 * step);
    ASSERT_LT((now.geometry[0].normal - last.geometry[0].normal).norm(), 1.1 * step / 0.1);
    num_switches += now.features[0] == last.features[0] ? 0 : 1;
    last = now;
  }
  EXPECT_GE(num_switches, 1);
}

TEST(CollideCore, GoesContinuouslyRoundACorner) {
  ExpectContinuous(Circle(0.3), 0.0);
  ExpectContinuous(Box(0.5, 0.5), 0.4);
  ExpectContinuous(Capsule(0.4, 0.1), -0.3);
}

}  // namespace
}  // namespace tangible::testing
