// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The maker behind RandomCoincidence. An element is a body with what acts on it, for which
// something happens at `at_`, a number of steps after the start; a scene has one or two of them.
// Not for other users.

#include <functional>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "tangible/verification/support/coincidences.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible::internal {

/// All numbers of a scene by path.
std::map<std::string, Real> NumbersOf(const Scene& scene);

/// What pulls at the bodies of a scene.
enum class Group { kLevel, kSteep, kShallow, kNoGravity };

class CoincidenceMaker {
 public:
  struct Element {
    const char* kind;
    void (CoincidenceMaker::*add)();
  };
  static const std::vector<Element>& ElementsOf(Group group);

  CoincidenceMaker(unsigned seed, Stepping stepping);
  Coincidence Make();

 private:
  using Part = std::function<std::vector<Real>(const NumberAt&)>;

  double Pick(std::initializer_list<double> values) {
    return values.begin()[random_.Integer(0, static_cast<int>(values.size()) - 1)];
  }
  void Settings();
  void Add(const Element& element);
  /// For a motion whose speed jumps: as the run ends by events it is not determined on which side.
  void JumpsAt() {
    if (after_ == 0 && course_.stepping == Stepping::kEvent) unknown_ = true;
  }
  /// The same for a body that meets the floor at `speed` (> 0) at `at_`, and may land again as the
  /// run ends. After its pair is added.
  void MayLandAtTheEnd(double speed);
  void Finish();
  bool is_slope() const { return group_ == Group::kSteep || group_ == Group::kShallow; }

  // coincidence_bodies.cc: bodies on a floor or between walls.
  std::string Named(const char* what) const { return what + std::to_string(number_); }
  BasicBody<double>& AddBox();
  BasicBody<double>& AddDisc();
  void AddPair(const std::string& body, double friction, double restitution);
  BasicForce<double>& AddForce(const std::string& body);
  /// A force that grows in proportion to time and has the value `at_force` at `at_`.
  Signal Ramp(double at_force) const;
  /// The motion of a box along the floor, with parameters.
  void SlideBox(const std::string& box, const Signal* ramp);
  /// The motion of a disc on or above the floor, with parameters.
  void RollDisc(const std::string& disc);
  /// A static box whose face at `face` looks along −x (axis 0) or −y (axis 1).
  void AddWall(const char* name, int axis, double face);
  void SlipEnds();
  void SlipBegins();
  void SlipStartsAtOnce();
  void SlipEndsAsAForceBegins();
  void ForceWindow();
  void FreeForceWindow();
  void SignalCorner();
  void Rolls();
  void Lands();
  void LiftsOff();
  void LandsFlat();
  void HitsAWall();
  void HitsACorner();
  void PassesASeam();

  // coincidence_strikes.cc: impacts with friction, and the end of a face.
  /// Adds the kind that a scene with Poisson's law and an impact has.
  void NameLaw();
  /// Makes a body's inertia greater until `is_clear` holds.
  void KeepClear(const std::string& body, const std::function<bool(const NumberAt&)>& is_clear);
  void SlipEndsInAnImpact();
  void StrikesAtACorner();
  void LeavesAFace();

  // coincidence_joints.cc: wheels and sliders.
  struct Jointed {
    std::string body, joint;
    bool is_wheel;
  };
  Jointed AddJointed();
  double& SpeedOf(const Jointed& of);
  /// The motion against friction alone, with parameters.
  void SlideJointed(const Jointed& of);
  /// Its mass or inertia.
  double& MassOf(const Jointed& of);
  /// A speed from which friction alone, without Stribeck's decay, stops it at `at_`; times `share`.
  void StopJointed(const Jointed& of, double friction, double share);
  /// Friction that falls with the speed, by events.
  void AddStribeck(const Jointed& of, double friction, double speed);
  /// The motion against such friction alone, at speeds far below `stribeck_speed`, with parameters.
  void StopByStribeck(const Jointed& of);
  void JointSignalCorner();
  void JointStops();
  void JointBreaksLoose();
  void JointTurns();
  void JointReachesItsLimit();
  void StribeckBreaksLoose();
  void StribeckStops();
  /// The same with a decay so slow that the integrator's error is rounding: of known motion.
  void SlowStribeckStops();

  RandomNumbers random_;
  Coincidence made_;
  Course course_;
  Group group_ = Group::kLevel;
  int count_ = 0;  ///< steps until it happens
  int after_ = 0;  ///< steps that follow
  double at_ = 0.0;
  double gravity_ = 0.0;
  double friction_ = 0.0;  ///< of boxes on a slope
  double mirror_ = 1.0;    ///< −1 of the second of two symmetric elements
  double place_ = 0.0;     ///< x of the element
  int number_ = 0;         ///< of the element
  /// Whether a force changes with time or a speed: then the trapezoidal rule is not exact.
  bool varies_ = false;
  bool unknown_ = false;  ///< the motion is not known
  std::vector<std::string> paths_;
  std::vector<Part> parts_;
};

}  // namespace tangible::internal
