// SPDX-License-Identifier: Apache-2.0
#include <box2d/box2d.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "tangible/verification/cost/peers.h"

namespace tangible {
namespace {

b2Vec2 ToVec2(const Vector2<double>& x) {
  return b2Vec2(static_cast<float>(x.x()), static_cast<float>(x.y()));
}

class Box2d : public Peer {
 public:
  explicit Box2d(const Scene& scene)
      : world_(ToVec2(scene.gravity)), dt_(static_cast<float>(scene.simulation.dt)) {
    world_.SetAllowSleeping(false);
    for (const BasicBody<double>& body : scene.bodies) {
      bodies_.push_back(Add(scene, body));
    }
    b2BodyDef fixed;
    b2Body* ground = world_.CreateBody(&fixed);
    for (const BasicJoint<double>& joint : scene.joints) {
      b2RevoluteJointDef hinge;
      hinge.Initialize(joint.bodies[1] < 0 ? ground : bodies_[joint.bodies[1]],
                       bodies_[joint.bodies[0]], ToVec2(joint.anchors[0]));
      world_.CreateJoint(&hinge);
    }
  }

  void Step() override { world_.Step(dt_, 8, 3); }
  Vector2<double> PositionOf(int body) const override {
    const b2Vec2 x = bodies_[body]->GetWorldCenter();
    return Vector2<double>(x.x, x.y);
  }

 private:
  b2Body* Add(const Scene& scene, const BasicBody<double>& body) {
    b2BodyDef definition;
    definition.type = body.motion == Motion::kMoving ? b2_dynamicBody : b2_staticBody;
    definition.position = ToVec2(body.position);
    definition.linearVelocity = ToVec2(body.velocity);
    b2Body* added = world_.CreateBody(&definition);
    const std::vector<double>& n = body.shape.numbers;
    b2CircleShape circle;
    b2PolygonShape box;
    b2EdgeShape edge;
    b2FixtureDef fixture;
    double inertia = 0.0;
    switch (body.shape.type) {
      case ShapeType::kCircle:
        circle.m_radius = static_cast<float>(n[0]);
        fixture.shape = &circle;
        inertia = 0.5 * body.mass * n[0] * n[0];
        break;
      case ShapeType::kBox:
        box.SetAsBox(static_cast<float>(0.5 * n[0]), static_cast<float>(0.5 * n[1]));
        fixture.shape = &box;
        inertia = body.mass * (n[0] * n[0] + n[1] * n[1]) / 12.0;
        break;
      case ShapeType::kHalfPlane: {
        constexpr double kHalfLength = 1000.0;
        const Vector2<double> at(n[0] * n[2], n[1] * n[2]);
        edge.SetTwoSided(ToVec2({at.x() - kHalfLength * n[1], at.y() + kHalfLength * n[0]}),
                         ToVec2({at.x() + kHalfLength * n[1], at.y() - kHalfLength * n[0]}));
        fixture.shape = &edge;
        break;
      }
      default:
        std::abort();  // no benchmark has it
    }
    fixture.friction = static_cast<float>(body.friction);
    fixture.density = 1.0f;
    for (const auto& [x, y] : scene.no_contact) {
      if (MatchesPattern(x, body.name) || MatchesPattern(y, body.name)) {
        fixture.filter.groupIndex = -1;
      }
    }
    added->CreateFixture(&fixture);
    if (body.motion == Motion::kMoving) {
      const b2MassData mass = {static_cast<float>(body.mass), b2Vec2(0.0f, 0.0f),
                               static_cast<float>(inertia)};
      added->SetMassData(&mass);
    }
    return added;
  }

  b2World world_;
  float dt_;
  std::vector<b2Body*> bodies_;
};

}  // namespace

std::unique_ptr<Peer> Box2dPeer(const Scene& scene) { return std::make_unique<Box2d>(scene); }

}  // namespace tangible
