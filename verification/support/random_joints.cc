// SPDX-License-Identifier: Apache-2.0
//
// Joints of random scenes.
#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/verification/support/random_scene_maker.h"

namespace tangible::internal {

std::string SceneMaker::JointName() const { return "joint" + std::to_string(scene_.joints.size()); }

void SceneMaker::Finish(BasicJoint<double>* joint, bool in_tree) {
  joint->name = JointName();
  const bool turns = joint->type == JointType::kRevolute;
  if (turns || joint->type == JointType::kPrismatic) {
    joint->damping = random_.Chance(0.4) ? U(0.01, 0.1) : 0.0;
    joint->effort = random_.Chance(0.3) ? U(-1.0, 1.0) : 0.0;
    if (random_.Chance(0.35)) {
      joint->limits = {random_.Chance(0.5) ? U(-0.03, 0.0) : -0.3, U(0.01, 0.3)};
    }
    if (in_tree && random_.Chance(0.5)) {
      const double reach = joint->limits ? 0.005 : 0.3;
      joint->angle = U(0.0, reach) * (turns ? 1.0 : 0.2);
      joint->rate = U(-1.5, 1.5);
    }
  }
  scene_.joints.push_back(*joint);
}

JointType SceneMaker::AnyType() {
  const JointType types[] = {JointType::kRevolute, JointType::kPrismatic, JointType::kWeld,
                             JointType::kDistance, JointType::kFixedAngle};
  return random_.Chance(0.4) ? JointType::kRevolute : types[random_.Integer(0, 4)];
}

int SceneMaker::Chain(int links) {
  const bool hangs = random_.Chance(0.75);
  int parent = -1;
  const double x = -1.2;
  const double top = hangs ? U(0.5, 0.9) : 0.45;
  if (hangs && random_.Chance(0.25)) {
    parent = Carrier(x, top + 0.1);
  }
  const double turn = U(-1.2, 1.2);
  Vector2<double> end = FloorPoint(x) + Vector2<double>(0.0, top);
  const Vector2<double> direction(std::sin(turn), -std::cos(turn));
  // Links of one joint overlap, and could not separate.
  if (links > 1) {
    scene_.no_contact.emplace_back("link*", "link*");
  }
  int count = 0;
  for (; count < links; ++count) {
    BasicBody<double> link = Body("link");
    const double length = 0.24;
    link.shape = random_.Chance(0.5) ? BasicShape<double>{ShapeType::kBox, {0.05, length}}
                                     : BasicShape<double>{ShapeType::kCircle, {0.07}};
    link.angle = turn;
    link.position = end + 0.5 * length * direction;
    const int index = static_cast<int>(scene_.bodies.size());
    scene_.bodies.push_back(link);
    if (count > 0 || hangs) {
      BasicJoint<double> joint;
      joint.type = AnyType();
      joint.bodies[0] = index;
      joint.bodies[1] = parent;
      joint.anchors[0] = end;
      joint.anchors[1] = end - 0.3 * direction + Vector2<double>(0.05, 0.02);
      joint.axis = Vector2<double>(U(-1.0, 1.0), U(0.2, 1.0));
      Finish(&joint, true);
    }
    // A tree branches now and then.
    parent = random_.Chance(0.8) || parent < 0 ? index : parent;
    end += length * direction * (parent == index ? 1.0 : 0.1);
  }
  return count;
}

int SceneMaker::Carrier(double x, double y) {
  BasicBody<double> body;
  body.name = "carrier";
  body.motion = Motion::kKinematic;
  body.position = FloorPoint(x) + Vector2<double>(0.0, y);
  body.velocity = Vector2<double>(U(-0.5, 0.5), U(-0.5, 0.5));
  body.angular_velocity = U(-1.0, 1.0);
  scene_.bodies.push_back(body);
  return static_cast<int>(scene_.bodies.size()) - 1;
}

void SceneMaker::LoopJoint(JointType type, int a, int b, const Vector2<double>& at) {
  BasicJoint<double> joint;
  joint.type = type;
  joint.bodies[0] = a;
  joint.bodies[1] = b;
  joint.anchors[0] = at;
  Finish(&joint, false);
}

int SceneMaker::Loop() {
  const Vector2<double> at = FloorPoint(2.5) + Vector2<double>(0.0, 1.0);
  const auto bar = [&](const Vector2<double>& from, const Vector2<double>& to) {
    BasicBody<double> body = Body("bar");
    const Vector2<double> reach = to - from;
    body.shape = {ShapeType::kCapsule, {0.8 * reach.norm(), 0.03}};
    body.position = 0.5 * (from + to);
    body.angle = std::atan2(reach.y(), reach.x());
    scene_.bodies.push_back(body);
    return static_cast<int>(scene_.bodies.size()) - 1;
  };
  const bool redundant = random_.Chance(0.4);
  if (redundant) {
    const int first = bar(at, at + Vector2<double>(0.3, 0.0));
    const int second = bar(at + Vector2<double>(0.0, -0.2), at + Vector2<double>(0.3, -0.15));
    LoopJoint(JointType::kRevolute, first, second, at + Vector2<double>(0.05, -0.1));
    LoopJoint(JointType::kRevolute, first, second, at + Vector2<double>(0.25, -0.1));
    LoopJoint(JointType::kRevolute, first, -1, at);
    return 2;
  }
  const Vector2<double> b = at + Vector2<double>(U(-0.1, 0.1), -0.3);
  const Vector2<double> c = at + Vector2<double>(0.4, U(-0.4, -0.2));
  const Vector2<double> d = at + Vector2<double>(U(0.3, 0.5), 0.05);
  const int first = bar(at, b);
  const int second = bar(b, c);
  const int third = bar(c, d);
  LoopJoint(JointType::kRevolute, first, -1, at);
  LoopJoint(JointType::kRevolute, second, first, b);
  LoopJoint(JointType::kRevolute, third, second, c);
  LoopJoint(JointType::kRevolute, third, -1, d);
  return 3;
}

}  // namespace tangible::internal
