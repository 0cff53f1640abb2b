// SPDX-License-Identifier: Apache-2.0
//
// Runs of scenes with all that they give.
#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/run_recorders.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/python/binding.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/gradient/rollout_function.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/run_warnings.h"

namespace tangible::python {
namespace {

// Rows of contacts and events as they come, one vector a column.
struct Table {
  std::vector<double> time, length, gap, normal, tangential;
  std::vector<int> first, second;
  std::vector<std::string> name, mode;
};

// The animated view of a run: what was recorded, or the page that was made of it.
class View {
 public:
  explicit View(ViewData data) : data_(std::move(data)) {}
  explicit View(std::string page) : page_(std::move(page)) {}

  const std::string& Html() {
    if (page_.empty()) page_ = ViewHtml(data_);
    return page_;
  }

 private:
  ViewData data_;
  std::string page_;
};

struct Run {
  std::vector<double> times, poses, twists;
  std::vector<int> bodies;  // those that are not static
  Table contacts, events;
  std::vector<std::string> joints, units;  // of their coordinates, empty where there is none
  std::vector<double> step_ends;
  std::vector<double> coordinates;   // of each time and joint: coordinate and rate
  std::vector<double> joint_forces;  // of each step and joint: force and torque
  std::string status, message, summary, certificate;
  std::shared_ptr<View> view;
  std::vector<std::string> warnings;
  std::vector<double> energies;  // kinetic and potential of each time
  std::vector<double> margins;   // of each step, where the certificate is wanted
};

// What a run is given beside its scene: a state of the moving bodies (else the scene's), and
// controls with a row for each step.
struct RunInputs {
  std::optional<VectorX<double>> state;
  std::vector<std::string> paths;
  RowMatrixXd controls;
};

void AddContacts(double t, double length, const Stepper& stepper, Table* table) {
  const StepRecord& record = stepper.record();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (!contact.IsOfShapes()) continue;
    table->time.push_back(t);
    table->length.push_back(length);
    table->first.push_back(contact.a);
    table->second.push_back(contact.b);
    table->gap.push_back(contact.gap);
    table->normal.push_back(record.solution.normal_impulse[i]);
    table->tangential.push_back(record.solution.tangent_impulse[i]);
    table->mode.emplace_back(ModeName(record.solution.modes[i]));
  }
}

JointRows<double> RowsOf(const Model<double>& model, const State<double>& state,
                         const JointIndex& joint) {
  JointRows<double> rows;
  EvaluateJoint(model, state, joint, &rows);
  return rows;
}

bool HasCoordinate(const JointIndex& joint) {
  return joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
}

// Of each joint its coordinate and rate; NaN where its type has none.
void AddCoordinates(const Model<double>& model, const State<double>& state,
                    std::vector<double>* coordinates) {
  for (const JointIndex& joint : model.structure->joints) {
    if (!HasCoordinate(joint)) {
      coordinates->insert(coordinates->end(), 2, kNaN);
      continue;
    }
    const JointRows<double> rows = RowsOf(model, state, joint);
    double rate = 0.0;
    for (int i = 0; i < 3; ++i) {
      rate += rows.coordinate_a[i] * state.twist[3 * joint.a + i] +
              rows.coordinate_b[i] * state.twist[3 * joint.b + i];
    }
    coordinates->push_back(rows.coordinate);
    coordinates->push_back(rate);
  }
}

// The mean force (N, world) and torque (N m, about the anchor of bodies[0]) over a step with which
// a joint holds bodies[0]: its impulses along its rows at the step's start.
void AddJointForces(const Model<double>& model, const StepRecord& record, double length,
                    std::vector<double>* forces) {
  const ModelStructure& s = *model.structure;
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const JointIndex& joint = s.joints[j];
    const JointRows<double> rows = RowsOf(model, record.before, joint);
    double wrench[3] = {0.0, 0.0, 0.0};  // about the centre of mass
    for (int k = 0; k < joint.rows; ++k) {
      for (int i = 0; i < 3; ++i) {
        wrench[i] += rows.row_a[k][i] * record.solution.joint_impulse[3 * j + k] / length;
      }
    }
    if (HasAnchors(joint.type)) {
      const Pose<double> pose = record.before.PoseOf(joint.a);
      const Vector2<double> anchor(model.parameters[joint.geometry],
                                   model.parameters[joint.geometry + 1]);
      const Vector2<double> arm = pose * anchor - pose.position;
      wrench[2] -= arm.x() * wrench[1] - arm.y() * wrench[0];
    }
    forces->insert(forces->end(), wrench, wrench + 3);
  }
}

void AddEvents(Stepper* stepper, Table* table) {
  struct Event {
    double time;
    ActiveContact contact;
    EventKind kind;
  };
  std::vector<Event> events;  // of the islands, one after another
  stepper->parts().ForEachPart([&](const IslandRecord& island, const EventPart& part) {
    const Segment& segment = part.segment;
    if (part.is_impulses || !IsLocated(segment.event)) return;
    events.push_back(
        {segment.time + segment.length, island.InWhole(segment.event_contact), segment.event});
  });
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& x, const Event& y) { return x.time < y.time; });
  for (const Event& event : events) {
    table->time.push_back(event.time);
    table->first.push_back(event.contact.a);
    table->second.push_back(event.contact.b);
    table->name.emplace_back(NameOf(event.kind));
  }
}

// Prepares a run, and keeps what its steps give.
class Simulator {
 public:
  Simulator(const Scene& scene, long every, bool certify)
      : every_(every), certify_(certify), steps_(NumSteps(scene.simulation)) {
    std::string error;
    if (!CheckSettings(scene, &error)) throw Error(error);
    BuildModel(scene, &model_, &initial_);
    const ModelStructure& s = *model_.structure;
    for (int body = 0; body < s.world(); ++body) {
      if (s.bodies[body].motion != Motion::kStatic) run_.bodies.push_back(body);
    }
    for (const JointIndex& joint : s.joints) {
      run_.joints.push_back(joint.name);
      const char* unit = joint.type == JointType::kRevolute ? "rad" : "m";
      run_.units.emplace_back(HasCoordinate(joint) ? unit : "");
    }
    view_.emplace(scene, model_);
  }

  void SetInputs(const Scene& scene, const RunInputs& inputs) {
    if (!inputs.state && inputs.paths.empty()) return;
    RolloutFunction function;
    const std::string error = function.Create(scene, {}, inputs.paths, {});
    if (!error.empty()) throw Error((scene.path.empty() ? "" : scene.path + ": ") + error);
    RolloutInput given;
    if (inputs.state) given.state = *inputs.state;
    given.controls = inputs.controls;
    const std::string wrong = function.CheckSizes(given);
    if (!wrong.empty()) throw py::value_error(wrong);
    if (!given.state.allFinite() || !given.controls.allFinite()) {
      throw Error(std::string(given.state.allFinite() ? "controls" : "initial_state") +
                  ": expected finite numbers");
    }
    if (inputs.state) function.SetState(given.state, &initial_);
    controls_.numbers = function.control_numbers();
    const auto count = static_cast<Eigen::Index>(controls_.numbers.size());
    controls_.values.resize(given.controls.rows(), count);
    for (Eigen::Index j = 0; j < count; ++j) {
      controls_.values.col(j) =
          given.controls.col(function.control_of_number()[static_cast<size_t>(j)]);
    }
  }

  Run Do() {
    RunSummary summary;
    RolloutCertifier certifier;
    RunWarnings warnings(model_, initial_);
    Stepper stepper(model_);
    State<double> last;
    const bool controlled = !controls_.numbers.empty();
    ControlledModel<double> model =
        controlled ? ControlledModel<double>(model_, controls_) : ControlledModel<double>(model_);
    const RolloutReport report = Rollout(
        model, initial_,
        [&](long k, double t, const State<double>& state, Stepper* done) {
          summary.Keep(model_, state, done);
          if (summary.IsFull()) summary.EvaluateKept(model_);
          warnings.Add(model_, k, t, state, done);
          if (done != nullptr && certify_) {
            certifier.AddStep(model.At(k - 1), k - 1, done);
            if (controlled) certifier.AddControls(*model_.structure, controls_, k - 1, done);
            run_.margins.push_back(certifier.step_margin());
          }
          if (done != nullptr) AddStep(k, t, done);
          if (k % every_ == 0 || k == steps_) AddTime(t, state, done);
        },
        &stepper, &last);
    summary.EvaluateKept(model_);
    run_.status = NameOf(report.status);
    run_.message = report.message;
    run_.summary = summary.ToJson(model_, report, last).dump();
    run_.warnings = warnings.Finish(model_, report, last);
    if (certify_) run_.certificate = ToJson(certifier.Finish(model_, report)).dump();
    run_.view = std::make_shared<View>(view_->data());
    return std::move(run_);
  }

 private:
  void AddStep(long k, double t, Stepper* done) {
    const double length = StepLength(model_.structure->settings, k - 1);
    run_.step_ends.push_back(t);
    AddContacts(t, length, *done, &run_.contacts);
    AddEvents(done, &run_.events);
    AddJointForces(model_, done->record(), length, &run_.joint_forces);
  }

  void AddTime(double t, const State<double>& state, Stepper* done) {
    run_.times.push_back(t);
    run_.energies.push_back(KineticEnergy(model_, state));
    run_.energies.push_back(PotentialEnergy(model_, state));
    for (const int body : run_.bodies) {
      run_.poses.insert(run_.poses.end(), &state.pose[3 * body], &state.pose[3 * body] + 3);
      run_.twists.insert(run_.twists.end(), &state.twist[3 * body], &state.twist[3 * body] + 3);
    }
    AddCoordinates(model_, state, &run_.coordinates);
    view_->Add(model_, t, state, done != nullptr ? &done->record() : nullptr);
  }

  long every_;
  bool certify_;
  long steps_;
  Model<double> model_;
  State<double> initial_;
  Controls controls_;
  std::optional<ViewRecorder> view_;
  Run run_;
};

py::array_t<int> Ints(const std::vector<int>& values) {
  return py::array_t<int>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::dict ContactsOf(const Table& table) {
  const auto rows = static_cast<py::ssize_t>(table.time.size());
  py::dict out;
  out["time"] = ToArray(table.time, {rows});
  out["length"] = ToArray(table.length, {rows});
  out["first"] = Ints(table.first);
  out["second"] = Ints(table.second);
  out["gap"] = ToArray(table.gap, {rows});
  out["normal_impulse"] = ToArray(table.normal, {rows});
  out["tangential_impulse"] = ToArray(table.tangential, {rows});
  out["mode"] = table.mode;
  return out;
}

py::dict EventsOf(const Table& table) {
  py::dict out;
  out["time"] = ToArray(table.time, {static_cast<py::ssize_t>(table.time.size())});
  out["first"] = Ints(table.first);
  out["second"] = Ints(table.second);
  out["kind"] = table.name;
  return out;
}

RunInputs ReadInputs(const std::optional<Array>& state, const std::vector<std::string>& paths,
                     const std::optional<Array>& controls) {
  RunInputs inputs;
  inputs.paths = paths;
  if (state) inputs.state = Eigen::Map<const VectorX<double>>(state->data(), state->size());
  if (controls && controls->ndim() == 2) {
    inputs.controls =
        Eigen::Map<const RowMatrixXd>(controls->data(), controls->shape(0), controls->shape(1));
  }
  return inputs;
}

py::dict SimulateToDict(const Scene& scene, long every, bool certify,
                        const std::optional<Array>& state, const std::vector<std::string>& paths,
                        const std::optional<Array>& controls) {
  if (every < 1) {
    throw py::value_error("every: expected a number >= 1, got " + std::to_string(every));
  }
  const RunInputs inputs = ReadInputs(state, paths, controls);
  const Run run = WithoutLock([&] {
    Simulator simulator(scene, every, certify);
    simulator.SetInputs(scene, inputs);
    return simulator.Do();
  });
  const auto rows = static_cast<py::ssize_t>(run.times.size());
  const auto bodies = static_cast<py::ssize_t>(run.bodies.size());
  const auto joints = static_cast<py::ssize_t>(run.joints.size());
  const auto steps = static_cast<py::ssize_t>(run.step_ends.size());
  py::dict out;
  out["times"] = ToArray(run.times, {rows});
  out["poses"] = ToArray(run.poses, {rows, bodies, 3});
  out["twists"] = ToArray(run.twists, {rows, bodies, 3});
  out["bodies"] = run.bodies;
  out["energies"] = ToArray(run.energies, {rows, 2});
  out["margins"] = ToArray(run.margins, {static_cast<py::ssize_t>(run.margins.size())});
  out["contacts"] = ContactsOf(run.contacts);
  out["events"] = EventsOf(run.events);
  out["joints"] = run.joints;
  out["units"] = run.units;
  out["step_ends"] = ToArray(run.step_ends, {steps});
  out["coordinates"] = ToArray(run.coordinates, {rows, joints, 2});
  out["joint_forces"] = ToArray(run.joint_forces, {steps, joints, 3});
  out["status"] = run.status;
  out["message"] = run.message;
  out["summary"] = run.summary;
  out["warnings"] = run.warnings;
  out["certificate"] = run.certificate;
  out["view"] = run.view;
  return out;
}

}  // namespace

void BindSimulate(py::module_* module) {
  py::class_<View, std::shared_ptr<View>>(*module, "View")
      .def("html", &View::Html)
      .def(py::pickle([](View& view) { return view.Html(); },
                      [](const std::string& page) { return std::make_shared<View>(page); }));
  module->def("simulate", &SimulateToDict);
}

}  // namespace tangible::python
