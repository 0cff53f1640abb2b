// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/scene_kit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tangible/math/scalar.h"
#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/verification/gradients/scene_check.h"
#include "tangible/verification/support/compare.h"
#include "tangible/verification/support/differences.h"

namespace tangible::extremes {
namespace {

double Energy(const Model<double>& model, const State<double>& state) {
  return KineticEnergy(model, state) + PotentialEnergy(model, state);
}

bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

double LargestSpeed(const State<double>& state) {
  double speed = 0.0;
  for (size_t i = 0; i + 2 < state.twist.size(); i += 3) {
    speed = std::max(speed, std::hypot(state.twist[i], state.twist[i + 1]));
  }
  return speed;
}

double LargestMove(const State<double>& from, const State<double>& to) {
  double moved = 0.0;
  for (size_t i = 0; i + 2 < to.pose.size(); i += 3) {
    moved =
        std::max(moved, std::hypot(to.pose[i] - from.pose[i], to.pose[i + 1] - from.pose[i + 1]));
  }
  return moved;
}

// S and C of scene_check.h.
struct Sizes {
  Contributions contributions;
  VectorX<double> column;
};

Sizes SizesOf(const Scene& scene, const std::vector<ParameterPath>& parameters,
              const VectorX<double>& outputs) {
  Sizes sizes{ContributionsOf(scene, parameters), {}};
  sizes.column = sizes.contributions.column;
  for (size_t k = 0; k < parameters.size(); ++k) {
    const double value = std::abs(parameters[k].value);
    const double size = value > 0.0 ? value : std::min(parameters[k].scale, 1.0);
    double& column = sizes.column[static_cast<Eigen::Index>(k)];
    column = std::max(column, outputs.cwiseAbs().maxCoeff() / size);
  }
  return sizes;
}

// The largest error of (1) in scene_check.h over all entries; `estimates` may be empty.
double LargestError(const MatrixX<double>& got, const MatrixX<double>& tangent, const Sizes& sizes,
                    double tolerance, const std::vector<VectorX<double>>& estimates) {
  double largest = 0.0;
  for (Eigen::Index p = 0; p < got.cols(); ++p) {
    for (Eigen::Index o = 0; o < got.rows(); ++o) {
      if (std::isnan(got(o, p))) continue;
      const double sum = std::max(sizes.contributions.sum(o, p), 0.1 * sizes.column[p]);
      const double estimate = estimates.empty() ? 0.0 : estimates[p][o];
      const double error = EntryError(got(o, p), tangent(o, p), tolerance, sum, estimate);
      largest = std::max(largest, std::isnan(error) ? kInfinity : error);
    }
  }
  return largest;
}

// Differences column by column; NaN where no step keeps the choices.
double DifferenceError(const Scene& scene, const std::vector<ParameterPath>& parameters,
                       const MatrixX<double>& tangent, const Sizes& sizes) {
  const RunTrace trace = TraceRun(scene);
  const VectorX<double> noise = RoundingNoise(scene, trace);
  MatrixX<double> quotients(tangent.rows(), tangent.cols());
  quotients.setConstant(kNotMeasured);
  std::vector<VectorX<double>> errors;
  bool any = false;
  for (size_t k = 0; k < parameters.size(); ++k) {
    const DifferenceColumn column = FiniteDifferences(scene, trace, noise, parameters[k]);
    const bool judged = column.status == DifferenceStatus::kJudged;
    errors.push_back(judged ? column.errors : VectorX<double>::Zero(tangent.rows()).eval());
    if (judged) quotients.col(static_cast<Eigen::Index>(k)) = column.values;
    any = any || judged;
  }
  return any ? LargestError(quotients, tangent, sizes, kDifferenceTolerance, errors) : kNotMeasured;
}

}  // namespace

Scene NewScene(const std::string& name, const std::string& stepping, double dt, double duration) {
  Scene scene;
  scene.name = name;
  scene.simulation.dt = dt;
  scene.simulation.duration = duration;
  if (stepping == "event") {
    scene.simulation.stepping = Stepping::kEvent;
    scene.simulation.integrator = Integrator::kTrapezoidal;
  }
  return scene;
}

BasicBody<double>& AddBody(Scene* scene, const std::string& name, BasicShape<double> shape,
                           double mass, double x, double y) {
  BasicBody<double>& body = scene->bodies.emplace_back();
  body.name = name;
  body.shape = std::move(shape);
  body.mass = mass;
  body.position = {x, y};
  return body;
}

BasicBody<double>& AddBox(Scene* scene, const std::string& name, double width, double height,
                          double mass, double x, double y) {
  return AddBody(scene, name, {ShapeType::kBox, {width, height}}, mass, x, y);
}

BasicBody<double>& AddDisc(Scene* scene, const std::string& name, double radius, double mass,
                           double x, double y) {
  return AddBody(scene, name, {ShapeType::kCircle, {radius}}, mass, x, y);
}

BasicBody<double>& AddFloor(Scene* scene) {
  BasicBody<double>& floor =
      AddBody(scene, "floor", {ShapeType::kHalfPlane, {0.0, 1.0, 0.0}}, 0.0, 0.0, 0.0);
  floor.motion = Motion::kStatic;
  return floor;
}

void SetMaterial(Scene* scene, double friction, double restitution) {
  for (BasicBody<double>& body : scene->bodies) {
    body.friction = friction;
    body.restitution = restitution;
  }
}

BasicJoint<double>& AddPin(Scene* scene, const std::string& name, int a, int b, double x,
                           double y) {
  BasicJoint<double>& pin = scene->joints.emplace_back();
  pin.name = name;
  pin.bodies[0] = a;
  pin.bodies[1] = b;
  pin.anchors[0] = pin.anchors[1] = {x, y};
  return pin;
}

void AddChain(Scene* scene, int count, double length, double mass, double x, double y, Top top) {
  const int first = static_cast<int>(scene->bodies.size());
  for (int i = 0; i < count; ++i) {
    AddBox(scene, "link" + std::to_string(i), 0.2 * length, length, mass, x,
           y - length * (i + 0.5));
    if (i > 0 || top == Top::kPinned) {
      AddPin(scene, "pin" + std::to_string(i), first + i, i > 0 ? first + i - 1 : -1, x,
             y - length * i);
    }
  }
  scene->no_contact.emplace_back("link*", "link*");
}

void AddStack(Scene* scene, const std::vector<double>& masses) {
  for (size_t i = 0; i < masses.size(); ++i) {
    AddBox(scene, "box" + std::to_string(i), 1.0, 1.0, masses[i], 0.0,
           static_cast<double>(i) + 0.5);
  }
  AddFloor(scene);
}

int MeasuredRun::IndexOf(const std::string& body) const {
  const std::vector<BodyIndex>& bodies = model.structure->bodies;
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].name == body) return static_cast<int>(i);
  }
  throw std::invalid_argument("no body " + body);
}

double MeasuredRun::Coordinate(const std::string& body, int i,
                               const std::vector<double>& of) const {
  return of[3 * static_cast<size_t>(IndexOf(body)) + static_cast<size_t>(i)];
}

double MeasuredRun::NormalImpulse(const std::string& a, const std::string& b) const {
  const int i = IndexOf(a), j = IndexOf(b);
  double sum = 0.0;
  for (size_t k = 0; k < last_step.contacts.size(); ++k) {
    const ActiveContact& contact = last_step.contacts[k];
    if ((contact.a == i && contact.b == j) || (contact.a == j && contact.b == i)) {
      sum += last_step.solution.normal_impulse[k];
    }
  }
  return sum;
}

Scene ThroughText(const Scene& scene) {
  Scene read;
  std::string error;
  if (!ParseScene(SceneToJson(scene), scene.name, ".", &read, &error)) {
    throw std::invalid_argument(error);
  }
  return read;
}

MeasuredRun RunScene(const Scene& scene, const StateObserver& observer) {
  MeasuredRun run;
  const Scene read = ThroughText(scene);
  BuildModel(read, &run.model, &run.first);
  run.energy_start = Energy(run.model, run.first);
  const bool joints = !read.joints.empty();
  run.report = Rollout(
      run.model, run.first,
      [&](long k, double t, const State<double>& state, Stepper* stepper) {
        run.energy_gain = std::max(run.energy_gain, Energy(run.model, state) - run.energy_start);
        run.energy_scale = std::max(run.energy_scale, KineticEnergy(run.model, state));
        run.moved = std::max(run.moved, LargestMove(run.first, state));
        run.speed_max = std::max(run.speed_max, LargestSpeed(state));
        run.finite = run.finite && AllFinite(state.pose) && AllFinite(state.twist);
        if (joints) run.joint_drift = std::max(run.joint_drift, JointDrift(run.model, state));
        if (stepper != nullptr && k == NumSteps(read.simulation)) {
          run.last_step = stepper->record();
        }
        if (observer) observer(k, t, state, stepper);
      },
      &run.last);
  run.energy_end = Energy(run.model, run.last);
  run.penetration = std::max(run.report.penetration_max, DeepestPenetration(run.model, run.last));
  run.speed_end = LargestSpeed(run.last);
  return run;
}

void AddDone(const MeasuredRun& run, Finding* finding) {
  const bool good = run.report.status == StepStatus::kDone && run.finite;
  finding->figures.push_back({"runs that do not end well", good ? 0.0 : 1.0, 0.0, "1",
                              "the scene has a motion, and it is finite"});
  if (!run.report.message.empty()) finding->note += run.report.message;
}

void AddGradient(const Scene& scene, long steps, const std::vector<std::string>& parameters,
                 Differences differences, Finding* finding) {
  GradientFinding& gradient = finding->gradient;
  gradient.taken = true;
  Scene brief = ThroughText(scene);
  brief.simulation.duration =
      std::min(brief.simulation.duration, brief.simulation.dt * static_cast<double>(steps));
  std::vector<ParameterPath> paths(parameters.size());
  for (size_t k = 0; k < parameters.size(); ++k) {
    if (!ResolveParameter(brief, parameters[k], &paths[k], &gradient.message)) return;
  }
  GradientOptions options;
  options.method = GradientMethod::kTangent;
  const GradientResult tangent = FinalStateJacobian(brief, paths, options);
  options.method = GradientMethod::kAdjoint;
  options.certificate = CertificatePass::kSkip;
  const GradientResult adjoint = FinalStateJacobian(brief, paths, options);
  gradient.verdict = tangent.certificate.verdict;
  gradient.condition = tangent.certificate.condition;
  if (!tangent.done || !adjoint.done) {
    gradient.message = tangent.done ? adjoint.message : tangent.message;
    return;
  }
  gradient.finite = tangent.jacobian.allFinite() && adjoint.jacobian.allFinite();
  if (!gradient.finite) {
    gradient.verdict += tangent.jacobian.allFinite() ? " (adjoint not finite)" : "";
  }
  if (!gradient.finite) return;
  const Sizes sizes = SizesOf(brief, paths, tangent.values);
  gradient.adjoint = LargestError(adjoint.jacobian, tangent.jacobian, sizes, kAdjointTolerance, {});
  if (differences == Differences::kTake) {
    gradient.differences = DifferenceError(brief, paths, tangent.jacobian, sizes);
  }
}

}  // namespace tangible::extremes
