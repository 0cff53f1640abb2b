// SPDX-License-Identifier: Apache-2.0
//
// What an optimiser may do with a scene: absurd masses, parameters that are not numbers, a hundred
// thousand rollouts.

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include "tangible/scene/parameter.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/verification/extremes/groups.h"
#include "tangible/verification/extremes/scene_kit.h"

namespace tangible::extremes {
namespace {

constexpr char kOptimiserGroup[] = "optimiser";

std::string Format(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

// A ball that hits a box on the floor that is hinged to a bar: the scene has every kind of element.
Scene Everything(const std::string& stepping) {
  Scene scene = NewScene("everything", stepping, 0.01, 0.3);
  AddBox(&scene, "box", 0.4, 0.4, 1.0, 0.0, 0.2);
  AddDisc(&scene, "ball", 0.1, 0.5, -0.6, 0.25).velocity = {4.0, 0.5};
  AddBox(&scene, "bar", 0.6, 0.1, 0.3, 0.5, 0.45);
  AddPin(&scene, "hinge", 2, 0, 0.2, 0.45).damping = 0.01;
  AddFloor(&scene);
  SetMaterial(&scene, 0.4, 0.3);
  BasicSpring<double>& spring = scene.springs.emplace_back();
  spring.name = "spring";
  spring.bodies[0] = 2;
  spring.anchors[0] = {0.8, 0.45};
  spring.anchors[1] = {0.8, 1.5};
  spring.stiffness = 5.0;
  spring.rest_length = 1.0;
  return scene;
}

Finding AbsurdMass(const std::string& stepping, const std::string& body, double mass) {
  Scene scene = Everything(stepping);
  for (BasicBody<double>& b : scene.bodies) {
    if (b.name == body) b.mass = mass;
  }
  const MeasuredRun run = RunScene(scene);
  Finding finding;
  // The hinge's 0.01 N m s on the inertia of 1e-12 kg is a rate of 1e12 1/s. The trapezoidal rule
  // would reverse such a speed in every step: the run has to report that it does not resolve this
  // rate.
  const std::string& message = run.report.message;
  if (stepping == "event" && mass < 1e-9 && message.find("dt is too large") != std::string::npos) {
    finding.figures.push_back({"runs that end otherwise than by the status that dt is too large",
                               0.0, 0.0, "1", "damping of 1e12 1/s in a step of 0.01 s"});
    finding.note = message;
    return finding;
  }
  AddDone(run, &finding);
  finding.figures.push_back({"penetration", run.penetration, 2e-2, "m", "a fifth of the ball"});
  AddGradient(scene, 10, {"bodies/" + body + "/mass", "bodies/box/friction", "gravity/y"},
              Differences::kTake, &finding);
  return finding;
}

// Every number of the scene set to NaN, infinity, the largest double: the run reports a failure, or
// its values and gradient are numbers.
Finding NotNumbers(const std::string& stepping) {
  Scene scene = Everything(stepping);
  long tried = 0, silent = 0, refused = 0;
  std::string first;
  const size_t count = EnumerateNumbers(&scene).size();
  const std::string mass = "bodies/box/mass";
  for (size_t i = 0; i < count; ++i) {
    for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1.7e308}) {
      Scene changed = Everything(stepping);
      const SceneNumber<double> number = EnumerateNumbers(&changed)[i];
      *number.value = bad;
      ParameterPath path;
      std::string error;
      ++tried;
      if (!ResolveParameter(changed, number.path == mass ? "bodies/ball/mass" : mass, &path,
                            &error)) {
        ++refused;
        continue;
      }
      GradientOptions options;
      options.method = GradientMethod::kAdjoint;
      options.certificate = CertificatePass::kSkip;
      const GradientResult result = FinalStateJacobian(changed, {path}, options);
      if (!result.done) {
        refused += result.message.empty() ? 0 : 1;
        silent += result.message.empty() ? 1 : 0;
      } else if (!result.values.allFinite() || !result.jacobian.allFinite()) {
        ++silent;
        first += (first.empty() ? "" : "; ") + number.path + Format(" = %g", bad);
      }
    }
  }
  Finding finding;
  finding.note = std::to_string(refused) + " of " + std::to_string(tried) + " reported" +
                 (first.empty() ? "" : "; silent: " + first);
  finding.figures.push_back({"results that are not numbers and not reported",
                             static_cast<double>(silent), 0.0, "1", "never a silent NaN"});
  return finding;
}

// Resident memory of this process, MiB.
double ResidentMebibytes() {
  double size = 0.0, resident = 0.0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

Finding ManyRollouts(const std::string& stepping, Length length) {
  const long rollouts = length == Length::kLong ? 100000 : 1000;
  Scene scene = Everything(stepping);
  scene.simulation.duration = 0.05;
  ParameterPath path;
  Finding finding;
  std::string error;
  ResolveParameter(scene, "bodies/ball/mass", &path, &error);
  GradientOptions options;
  options.method = GradientMethod::kAdjoint;
  options.certificate = CertificatePass::kSkip;
  double early = 0.0;
  long failed = 0, different = 0;
  RowMatrixXd first;
  for (long k = 0; k < rollouts; ++k) {
    const GradientResult result = FinalStateJacobian(scene, {path}, options);
    failed += result.done ? 0 : 1;
    if (k == 0) first = result.jacobian;
    different += result.jacobian == first ? 0 : 1;
    if (k == rollouts / 10) early = ResidentMebibytes();
  }
  finding.figures.push_back({"growth of memory after the first tenth",
                             std::max(0.0, ResidentMebibytes() - early), 1.0, "MiB",
                             "nothing is kept from run to run"});
  finding.figures.push_back({"runs that failed", static_cast<double>(failed), 0.0, "1", "none"});
  finding.figures.push_back({"gradients that differ from the first", static_cast<double>(different),
                             0.0, "1", "the same bits"});
  finding.note = std::to_string(rollouts) + " gradients by the adjoint";
  return finding;
}

}  // namespace

void AddOptimiser(std::vector<ExtremeCase>* cases) {
  for (const std::string stepping : kSteppings) {
    for (const char* body : {"ball", "box", "bar"}) {
      for (const double mass : {1e-12, 1e12}) {
        char text[64];
        std::snprintf(text, sizeof(text), "%s of %g kg", body, mass);
        cases->push_back({kOptimiserGroup, text, stepping, [=, name = std::string(body)](Length) {
                            return AbsurdMass(stepping, name, mass);
                          }});
      }
    }
    cases->push_back({kOptimiserGroup, "every number NaN, infinite, 1.7e308", stepping,
                      [=](Length) { return NotNumbers(stepping); }});
    cases->push_back({kOptimiserGroup, "1e5 gradients in a row", stepping,
                      [=](Length length) { return ManyRollouts(stepping, length); }});
  }
}

}  // namespace tangible::extremes
