// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Short functions to build the scenes of the cases, and the measurements of a run.

#include <string>
#include <vector>

#include "tangible/scene/scene.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/verification/extremes/extreme_case.h"

namespace tangible::extremes {

/// "fixed" with semi_implicit_euler, "event" with trapezoidal.
inline constexpr const char* kSteppings[] = {"fixed", "event"};

inline constexpr double kGravity = 9.81;  ///< m/s²

/// An empty scene without friction; gravity downwards.
Scene NewScene(const std::string& name, const std::string& stepping, double dt, double duration);

BasicBody<double>& AddBody(Scene* scene, const std::string& name, BasicShape<double> shape,
                           double mass, double x, double y);
BasicBody<double>& AddBox(Scene* scene, const std::string& name, double width, double height,
                          double mass, double x, double y);
BasicBody<double>& AddDisc(Scene* scene, const std::string& name, double radius, double mass,
                           double x, double y);
/// "floor", solid below y = 0.
BasicBody<double>& AddFloor(Scene* scene);
/// Friction and restitution of every pair.
void SetMaterial(Scene* scene, double friction, double restitution);
/// A hinge at a point; −1 is the world.
BasicJoint<double>& AddPin(Scene* scene, const std::string& name, int a, int b, double x, double y);
/// `count` links of a length hanging down from (x, y), a hinge above each (not above the first if
/// it is free); bodies "link0", ..., which do not collide with each other.
enum class Top { kPinned, kFree };
void AddChain(Scene* scene, int count, double length, double mass, double x, double y, Top top);
/// `count` unit boxes "box0", ... upon the floor.
void AddStack(Scene* scene, const std::vector<double>& masses);

/// A run with the quantities measured during it.
struct MeasuredRun {
  Model<double> model;
  State<double> first, last;
  RolloutReport report;
  double energy_start = 0.0, energy_end = 0.0;
  double energy_gain = 0.0;   ///< J, the largest rise above the start at any step
  double energy_scale = 0.0;  ///< J, the largest kinetic energy
  double moved = 0.0;         ///< m, the largest distance of a body from its first place
  double penetration = 0.0;   ///< m, from the steps' reports and, at the end, of every pair
  double joint_drift = 0.0;   ///< m or rad
  double speed_end = 0.0;     ///< m/s, the largest of a body
  double speed_max = 0.0;     ///< m/s, at any step
  bool finite = true;         ///< of all states
  StepRecord last_step;

  double x(const std::string& body) const { return Coordinate(body, 0, last.pose); }
  double y(const std::string& body) const { return Coordinate(body, 1, last.pose); }
  double angle(const std::string& body) const { return Coordinate(body, 2, last.pose); }
  double vx(const std::string& body) const { return Coordinate(body, 0, last.twist); }
  double vy(const std::string& body) const { return Coordinate(body, 1, last.twist); }
  double omega(const std::string& body) const { return Coordinate(body, 2, last.twist); }
  /// Sum of the normal impulses between two bodies in the last step, N s.
  double NormalImpulse(const std::string& a, const std::string& b) const;
  int IndexOf(const std::string& body) const;

 private:
  double Coordinate(const std::string& body, int i, const std::vector<double>& of) const;
};

/// Runs a scene after converting it to text and back, so that values that a file may not have are
/// refused here too (throws std::invalid_argument).
MeasuredRun RunScene(const Scene& scene, const StateObserver& observer = {});
Scene ThroughText(const Scene& scene);

/// The two figures of every run: that it ended (0, else 1), that all its numbers are finite.
void AddDone(const MeasuredRun& run, Finding* finding);

/// The gradient of the final state after at most `steps` steps with respect to parameters, by
/// adjoint, tangent and, if asked for, differences.
enum class Differences { kTake, kSkip };
void AddGradient(const Scene& scene, long steps, const std::vector<std::string>& parameters,
                 Differences differences, Finding* finding);

}  // namespace tangible::extremes
