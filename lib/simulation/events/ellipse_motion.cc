// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/ellipse_motion.h"

#include <algorithm>
#include <cmath>

#include "tangible/math/scalar.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

// One of the two shapes of a contact.
struct Side {
  int body = -1;
  bool is_ellipse = false;
  double share = 1.0;   // h / a of an ellipse
  double radius = 0.0;  // ρ, m
};

Side SideOf(const ShapeView<double>& shape, int body, bool is_face,
            const ContactGeometry<double>& geometry, const State<double>& state) {
  Side side;
  side.body = body;
  side.radius = is_face ? kInfinity : CoreRadius(shape);
  if (shape.type == ShapeType::kEllipse) {
    const auto [small, large] = std::minmax(shape.numbers[0], shape.numbers[1]);
    const Vector2<double> arm(geometry.point.x() - state.pose[3 * body],
                              geometry.point.y() - state.pose[3 * body + 1]);
    side.is_ellipse = true;
    side.share = std::clamp(std::abs(geometry.normal.dot(arm)), small, large) / large;
    side.radius = small * (small / large) / (side.share * side.share * side.share);
  }
  return side;
}

// φ̇ of a side, from twists; φ̈ from accelerations in their place.
double TurningRate(const Side& side, const Side& other, const State<double>& state, double slip) {
  const double relative = state.twist[3 * side.body + 2] - state.twist[3 * other.body + 2];
  return std::isinf(other.radius) ? relative
                                  : (other.radius * relative + slip) / (side.radius + other.radius);
}

}  // namespace

EllipseMotion LongestEllipseMotion(const Model<double>& model, const State<double>& state,
                                   const std::vector<ActiveContact>& contacts,
                                   const ContactSolution<double>& accelerations) {
  EllipseMotion motion{kInfinity, -1};
  State<double> rates;
  for (size_t i = 0; i < contacts.size(); ++i) {
    const ActiveContact& contact = contacts[i];
    if (!contact.IsOfShapes() || accelerations.modes[i] == ContactMode::kOpen) continue;
    const ShapeView<double> shape_a = ShapeOfA(model, contact);
    const ShapeView<double> shape_b = ShapeOfB(model, contact);
    if (shape_a.type != ShapeType::kEllipse && shape_b.type != ShapeType::kEllipse) continue;
    if (rates.twist.empty()) {
      rates = state;
      std::fill(rates.twist.begin(), rates.twist.end(), 0.0);
      SpreadTwists(*model.structure, accelerations.motion, &rates.twist);
    }
    ContactRows<double> rows;
    EvaluateContactRows(model, state, contact, &rows);
    const FeatureKind kind = contact.feature.kind;
    const Side sides[2] = {
        SideOf(shape_a, contact.a,
               kind == FeatureKind::kPlaneVertex || kind == FeatureKind::kEdgeVertex, rows.geometry,
               state),
        SideOf(shape_b, contact.b,
               kind == FeatureKind::kVertexPlane || kind == FeatureKind::kVertexEdge, rows.geometry,
               state)};
    const auto slip = [&](const State<double>& of) {
      return RelativeSpeed(of, contact.a, rows.tangent_a, contact.b, rows.tangent_b);
    };
    for (int k = 0; k < 2; ++k) {
      if (!sides[k].is_ellipse) continue;
      const double turning = std::abs(TurningRate(sides[k], sides[1 - k], state, slip(state)));
      const double change = std::abs(TurningRate(sides[k], sides[1 - k], rates, slip(rates)));
      const double most = kEllipseTurn * sides[k].share;
      double longest = 2.0 * most / (turning + std::sqrt(turning * turning + 2.0 * change * most));
      const BodyIndex& body = model.structure->bodies[sides[k].body];
      if (body.block >= 0) {
        const double stiffness =
            accelerations.normal_impulse[i] * std::min(sides[0].radius, sides[1].radius);
        longest = std::min(longest, kEllipsePhase * std::sqrt(model.parameters[body.inertia] /
                                                              std::max(stiffness, 0.0)));
      }
      if (longest < motion.longest) motion = {longest, static_cast<int>(i)};
    }
  }
  return motion;
}

}  // namespace tangible
