// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The maker behind RandomScene: one draw after the other from one sequence of random numbers, so
// that a seed is a scene. Not for other users.

#include <string>

#include "tangible/verification/support/random_scene.h"

namespace tangible::internal {

/// A body's half height above a level floor, as drawn at angle 0 (or a bound of it).
double HalfHeight(const BasicShape<double>& shape);

class SceneMaker {
 public:
  SceneMaker(unsigned seed, const RandomSceneOptions& options);
  Scene Make();

 private:
  double U(double low, double high) { return random_.Uniform(low, high); }
  void Settings();
  double Friction() { return friction_ * (random_.Chance(0.1) ? 1.0 : U(0.7, 1.3)); }
  double Restitution() { return bounces_ ? (random_.Chance(0.1) ? 0.5 : U(0.2, 0.9)) : 0.0; }

  BasicShape<double> Polygon();
  BasicShape<double> Shape();
  BasicBody<double> Body(const std::string& name);
  /// A half-plane (tilted or not, its normal not unit), a box or a polygon; static, or a conveyor.
  void Floor();
  /// A point of the floor's surface, the way up from it and the way along it.
  Vector2<double> FloorPoint(double along) const;
  Vector2<double> Up() const;
  Vector2<double> Along() const;
  /// On or above the floor: at rest, sliding, about to land, in penetration, or thrown; or on top
  /// of the last one.
  void FreeBody();
  /// A kinematic paddle that moves into the bodies, a static bump or a wall.
  void Obstacles();

  // random_joints.cc
  std::string JointName() const;
  void Finish(BasicJoint<double>* joint, bool in_tree);
  JointType AnyType();
  /// A chain (a tree) that hangs from the world, from a kinematic body, or lies free above the
  /// floor; its lower end may reach the floor. Returns how many bodies it took.
  int Chain(int links);
  /// A kinematic body without a shape.
  int Carrier(double x, double y);
  void LoopJoint(JointType type, int a, int b, const Vector2<double>& at);
  /// A closed four-bar linkage that hangs from the world, or two bodies pinned twice, whose rows
  /// are redundant. Returns how many bodies it took.
  int Loop();

  // random_loads.cc
  int AnyMoving();
  void Springs();
  void Forces();
  Signal ForceSignal(double dt);
  Signal ValueSignal(double dt, double largest);
  int CountNamed(const std::string& start) const;
  void Pairs();
  /// Rare features: torques and efforts that follow a series, narrow limits of a prismatic joint,
  /// no gravity.
  void Rarities();
  /// Drag and joint springs, in every fourth scene. They use separate random numbers, so that the
  /// rest of the scene of a seed does not change.
  void Mechanisms();
  /// Motors, ropes, restitution of limits and friction that decays, likewise.
  void Drives();
  /// Ellipses in the place of other shapes, and contact points, in every fourth scene; with random
  /// numbers of their own as well.
  void Outlines();
  /// Concave polygons in the place of other shapes, in every eighth scene, likewise.
  void ConcavePolygons();
  /// A wavy spline in the place of the floor, in every eighth scene, likewise.
  void SplineFloor();
  /// Servos of joints and forces in every fourth scene, likewise.
  void Servos();
  /// Couplings of joints and joints that end, in every fourth scene, likewise.
  void Couplings();
  void Ends();
  /// Friction of bodies on the plane of motion in every fourth scene of fixed steps, likewise.
  void Supports();
  /// Rolling friction of contacts in every eighth scene, likewise.
  void RollingFriction();
  /// A servo whose coordinate starts at `at`.
  BasicServo<double> Servo(double at, RandomNumbers* random);

  RandomNumbers random_;
  const RandomSceneOptions options_;
  const unsigned seed_;
  Scene scene_;
  bool level_ = true;
  bool bounces_ = false;
  double slope_ = 0.0;     // of the floor
  double friction_ = 0.0;  // typical of the scene
  double next_column_ = 0.0;
  int last_free_ = -1;
};

}  // namespace tangible::internal
