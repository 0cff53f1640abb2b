// SPDX-License-Identifier: Apache-2.0
//
// Masses that differ by a factor of up to 1e9: contact forces equal the weight that they carry, and
// chains hold.

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/simulation/stepping/invariants.h"
#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kMassRatioGroup[] = "mass ratio";

std::string Power(int exponent) { return "1e" + std::to_string(exponent); }

// Two unit boxes at rest, `lower` carries `upper`.
Finding TwoBoxes(const std::string& stepping, double lower, double upper, Length length) {
  const double dt = 0.01;
  Scene scene = NewScene("two boxes", stepping, dt, length == Length::kLong ? 10.0 : 1.0);
  AddStack(&scene, {lower, upper});
  SetMaterial(&scene, 0.5, 0.0);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const double weight = upper * kGravity * dt, total = (lower + upper) * kGravity * dt;
  finding.figures.push_back({"error of the impulse between the boxes",
                             run.NormalImpulse("box0", "box1") / weight - 1.0, 1e-8, "1",
                             "it is m g h of the upper box"});
  finding.figures.push_back({"error of the impulse on the floor",
                             run.NormalImpulse("box0", "floor") / total - 1.0, 1e-8, "1",
                             "it is m g h of both"});
  finding.figures.push_back({"penetration", run.penetration, 1e-4, "m", "contact_margin"});
  finding.figures.push_back({"speed at the end", run.speed_end, 1e-6, "m/s",
                             "rest is a solution; 1e-5 of what g adds in a step"});
  AddGradient(scene, 20, {"bodies/box1/mass", "bodies/box0/friction", "gravity/x"},
              Differences::kTake, &finding);
  return finding;
}

// A chain of 100 links of 0.1 m and 1 kg that hangs still, with a heavy end.
Finding HangingChain(const std::string& stepping, double end_mass, Length length) {
  constexpr int kLinks = 100;
  const double dt = 0.01;
  const double brief = stepping == "fixed" ? 0.3 : 0.05;
  Scene scene = NewScene("hanging chain", stepping, dt, length == Length::kLong ? 5.0 : brief);
  AddChain(&scene, kLinks, 0.1, 1.0, 0.0, 0.0, Top::kPinned);
  scene.bodies.back().mass = end_mass;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  if (!run.last_step.solution.joint_impulse.empty()) {
    const double tension = std::hypot(run.last_step.solution.joint_impulse[0],
                                      run.last_step.solution.joint_impulse[1]);
    finding.figures.push_back({"error of the top's tension",
                               tension / dt / kGravity / (end_mass + kLinks - 1.0) - 1.0, 1e-8, "1",
                               "it carries all masses"});
  }
  // The tension T rounds by eps T, which accelerates a link of mass m by eps T / m.
  const double rounding = 2.3e-16 * (end_mass + kLinks) * kGravity;
  const double t = scene.simulation.duration;
  finding.figures.push_back({"joint drift", run.joint_drift, 1e-9 + 0.5 * rounding * t * t, "m",
                             "it hangs still; eps T / m for the time"});
  finding.figures.push_back({"speed at the end", run.speed_end, 1e-6 + rounding * t, "m/s",
                             "rest is a solution; eps T / m for the time"});
  AddGradient(scene, 3, {"bodies/link99/mass", "gravity/x", "joints/pin0/anchor/x"},
              Differences::kSkip, &finding);
  return finding;
}

// The same chain swings, straight, from an angle. Transverse waves of the links, of frequency
// w² = 4 T / (m l), are resolved by event steps or, with fewer links, are not.
enum class Waves { kResolved, kNot };
Finding SwingingChain(const std::string& stepping, double end_mass, Waves waves, Length length) {
  const int links = waves == Waves::kResolved ? 20 : 10;
  const double wave = std::sqrt(4.0 * kGravity * (end_mass + links) / 0.1);
  const bool by_waves = stepping == "event" && waves == Waves::kResolved;
  const double dt = by_waves ? 0.5 / wave : stepping == "event" ? 1e-3 : 0.01;
  const double duration = length == Length::kLong ? 10.0 : 0.3;
  const double most = (length == Length::kLong ? 1e4 : 150.0) * dt;
  Scene scene =
      NewScene("swinging chain", stepping, dt, by_waves ? std::min(duration, most) : duration);
  AddChain(&scene, links, 0.1, 1.0, 0.0, 0.0, Top::kPinned);
  scene.bodies.back().mass = end_mass;
  scene.joints[0].angle = 0.5;
  scene.simulation.joint_correction = JointCorrection::kProjection;
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  finding.figures.push_back(
      {"joint drift", run.joint_drift, 1e-6, "m", "projection keeps anchors together"});
  const double change = (run.energy_end - run.energy_start) / run.energy_scale;
  finding.figures.push_back({"energy change over the largest kinetic energy", change,
                             stepping == "fixed" ? kReported : 1e-2, "1",
                             stepping == "fixed" ? "no bound: the step is of first order"
                                                 : "no force does work but gravity"});
  AddGradient(scene, 5,
              {"bodies/" + scene.bodies.back().name + "/mass", "gravity/y", "joints/pin0/angle"},
              Differences::kSkip, &finding);
  return finding;
}

// A ball flies into a free chain of light links.
Finding BallAgainstChain(const std::string& stepping, double ball_mass, double link_mass,
                         Length length) {
  Scene scene =
      NewScene("ball against chain", stepping, 0.001, length == Length::kLong ? 1.0 : 0.1);
  scene.gravity = {0.0, 0.0};
  AddChain(&scene, 10, 0.3, link_mass, 0.0, 1.5, Top::kFree);
  AddDisc(&scene, "ball", 0.1, ball_mass, -0.25, 0.07).velocity = {10.0, 0.0};
  SetMaterial(&scene, 0.0, 0.5);
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  AddDone(run, &finding);
  const Vector3<double> before = Momentum(run.model, run.first);
  const Vector3<double> after = Momentum(run.model, run.last);
  finding.figures.push_back({"change of momentum over momentum",
                             (after - before).head<2>().norm() / before.head<2>().norm(), 1e-9, "1",
                             "no force from outside"});
  finding.figures.push_back({"energy gain over energy", run.energy_gain / run.energy_start,
                             stepping == "fixed" ? 1e-2 : 1e-3, "1",
                             "e = 0.5 without friction gains none; joints of first (fixed) and "
                             "second order (event)"});
  finding.figures.push_back(
      {"penetration", run.penetration, 1e-3, "m", "1 % of the ball; a step's move is 1e-2 m"});
  AddGradient(scene, 30, {"bodies/ball/mass", "bodies/ball/velocity/x", "bodies/link*/mass"},
              Differences::kTake, &finding);
  return finding;
}

}  // namespace

void AddMassRatios(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const int exponent : {3, 6, 9}) {
      const double ratio = std::pow(10.0, exponent);
      cases->push_back({kMassRatioGroup, "box " + Power(exponent) + " on box 1", stepping,
                        [=](Length length) { return TwoBoxes(stepping, 1.0, ratio, length); }});
      cases->push_back({kMassRatioGroup, "box 1 on box " + Power(exponent), stepping,
                        [=](Length length) { return TwoBoxes(stepping, ratio, 1.0, length); }});
      cases->push_back({kMassRatioGroup, "100 links hang, end " + Power(exponent), stepping,
                        [=](Length length) { return HangingChain(stepping, ratio, length); }});
      cases->push_back(
          {kMassRatioGroup, "20 links swing, end " + Power(exponent), stepping, [=](Length length) {
             return SwingingChain(stepping, ratio, Waves::kResolved, length);
           }});
      cases->push_back(
          {kMassRatioGroup, "ball " + Power(exponent) + " against chain of 1", stepping,
           [=](Length length) { return BallAgainstChain(stepping, ratio, 1.0, length); }});
      cases->push_back(
          {kMassRatioGroup, "ball 1 against chain of " + Power(exponent), stepping,
           [=](Length length) { return BallAgainstChain(stepping, 1.0, ratio, length); }});
    }
    for (const int exponent : {2, 4, 6}) {
      const double ratio = std::pow(10.0, exponent);
      cases->push_back(
          {kMassRatioGroup, "10 links swing, end " + Power(exponent), stepping,
           [=](Length length) { return SwingingChain(stepping, ratio, Waves::kNot, length); }});
    }
  }
}

}  // namespace tangible::extremes
