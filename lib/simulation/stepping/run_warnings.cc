// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/run_warnings.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "tangible/dynamics/elements/contact.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/geometry/tolerances.h"
#include "tangible/simulation/events/tolerances.h"
#include "tangible/simulation/stepping/energy_watch.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// Empty, or the line that says which steps between bodies at rest count as flush.
std::string FlushStepsMessage(const Model<double>& model) {
  if (model.seams == nullptr || model.seams->steps.count == 0) return "";
  char text[192];
  std::snprintf(text, sizeof text,
                "%d steps of at most %.3g m between faces of static bodies count as flush (up to "
                "%.0e m): what goes over them moves as on one face",
                model.seams->steps.count, model.seams->steps.highest, kFlushStep);
  return text;
}

// Empty, or the line that names a limit of a joint that a run begins beyond.
std::string BrokenLimitMessage(const Model<double>& model, const State<double>& initial) {
  std::vector<ActiveContact> limits;
  AppendLimits(model, initial, &limits);
  const Lengths lengths(model);
  for (const ActiveContact& limit : limits) {
    const JointIndex& joint = model.structure->joints[limit.joint];
    ContactRows<double> rows;
    EvaluateActiveRows(model, initial, limit, &rows);
    if (rows.geometry.gap >= -kBrokenTouches * lengths.LimitTouch(initial, joint)) continue;
    char text[256];
    std::snprintf(
        text, sizeof text,
        "the run begins with joint %s beyond its %s limit by %.3g %s: it is moved back at "
        "recovery_speed, %.3g m/s or rad/s",
        joint.name.c_str(), limit.side > 0.0 ? "low" : "high", -rows.geometry.gap,
        joint.type == JointType::kRevolute ? "rad" : "m", model.structure->settings.recovery_speed);
    return text;
  }
  return "";
}

// Empty, or the line that names a joint to a body of given motion whose other body does not begin
// with its speed: "rate" is beside that of bodies that stand.
std::string LeftBehindMessage(const Model<double>& model, const State<double>& initial) {
  const ModelStructure& s = *model.structure;
  for (const JointIndex& joint : s.joints) {
    if (joint.IsCoupling() || joint.a == s.world() || joint.b == s.world()) continue;
    const bool a_is_given = s.bodies[joint.a].block < 0;
    if (a_is_given == (s.bodies[joint.b].block < 0)) continue;
    const int given = a_is_given ? joint.a : joint.b;
    const double* v = &initial.twist[3 * static_cast<size_t>(given)];
    JointRows<double> rows;
    EvaluateJoint(model, initial, joint, &rows);
    double apart = 0.0, largest = 0.0;
    for (int k = 0; k < rows.rows; ++k) {
      const auto& row = a_is_given ? rows.row_a[k] : rows.row_b[k];
      const double of_given = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
      apart =
          std::hypot(apart, RelativeSpeed(initial, joint.a, rows.row_a[k], joint.b, rows.row_b[k]));
      largest = std::hypot(largest, of_given);
    }
    const double fastest =
        LargestGivenSpeed(model, given, 0.0, s.settings.duration, RadiusOf(model, given));
    if (!(largest > kBegunApart * fastest) || !(apart > kBegunApart * largest)) continue;
    char text[320];
    std::snprintf(text, sizeof text,
                  "the run begins with joint %s, to body %s of given motion, moving apart at %.3g "
                  "m/s or rad/s: an impulse carries body %s along at once; expected a \"velocity\" "
                  "of it that the joint allows",
                  joint.name.c_str(), s.bodies[given].name.c_str(), apart,
                  s.bodies[a_is_given ? joint.b : joint.a].name.c_str());
    return text;
  }
  return "";
}

}  // namespace

void RunWarnings::LookBehindLines(const Model<double>& model, long k, double t,
                                  const std::vector<ActiveContact>& contacts) {
  if (!behind_.empty()) return;
  std::vector<ActiveContact> with_lines;
  for (const ActiveContact& contact : contacts) {
    if (!contact.IsOfShapes()) continue;
    const auto is_line = [&](int body, int part) {
      const Outline* const outline = model.OutlineOf(body, part);
      return model.CurveOf(body, part) != nullptr || (outline != nullptr && !outline->IsPolygon());
    };
    const bool first = is_line(contact.a, contact.feature.part_a);
    if (!first && !is_line(contact.b, contact.feature.part_b)) continue;
    with_lines.push_back(contact);
    const int body = first ? contact.b : contact.a;
    const bool is_new =
        std::none_of(last_contacts_.begin(), last_contacts_.end(),
                     [&](const auto& other) { return other.IsOfTheSameShapes(contact); });
    if (k <= 1 || !is_new || !(contact.gap < -2.0 * RadiusOf(model, body))) continue;
    const std::vector<BodyIndex>& bodies = model.structure->bodies;
    char text[256];
    std::snprintf(text, sizeof text,
                  "body %s is behind the line of body %s from t = %.6g s on, by %.3g m, and is "
                  "pushed out through it: it came past an end of the line, behind which all is "
                  "solid",
                  bodies[body].name.c_str(), bodies[first ? contact.a : contact.b].name.c_str(), t,
                  -contact.gap);
    behind_ = text;
    return;
  }
  last_contacts_ = std::move(with_lines);
}

std::vector<std::string> RunWarnings::Finish(const Model<double>& model,
                                             const RolloutReport& report,
                                             const State<double>& final) {
  if (joints_.watches()) joints_.Look(model, final, report.time);
  coordinates_.LookAtBodies(model, final, report.time);
  std::vector<std::string> lines;
  std::string energy = report.energy_grown;
  if (energy.empty()) energy = EnergyOfOverlap(model, initial_, final, report.penetration_max);
  if (energy.empty()) energy = EnergyOfSqueeze(model, initial_, final);
  for (std::string line :
       {coordinates_.Message(model), joints_.Message(model), BrokenLimitMessage(model, initial_),
        LeftBehindMessage(model, initial_), FlushStepsMessage(model), behind_, std::move(energy)}) {
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace tangible
