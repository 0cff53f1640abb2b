// SPDX-License-Identifier: Apache-2.0
//
// Scenes and runs of them.
#include "tangible/app/certificate_json.h"
#include "tangible/app/run_recorders.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/python/binding.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/run_warnings.h"

namespace tangible::python {
namespace {

Scene Parse(const std::string& text, const std::string& name, const std::string& folder) {
  Scene scene;
  std::string error;
  if (!ParseScene(text, name, folder, &scene, &error)) throw Error(error);
  return scene;
}

Scene Load(const std::string& file) {
  Scene scene;
  std::string error;
  if (!LoadScene(file, &scene, &error)) throw Error(error);
  return scene;
}

std::vector<ParameterPath> Resolve(const Scene& scene, const std::vector<std::string>& paths) {
  std::vector<ParameterPath> resolved(paths.size());
  std::string error;
  for (size_t i = 0; i < paths.size(); ++i) {
    if (!ResolveParameter(scene, paths[i], &resolved[i], &error)) throw Error(error);
  }
  if (!CheckApart(scene, resolved, &error)) throw Error(error);
  return resolved;
}

Scene WithParameters(const Scene& scene, const std::vector<std::string>& paths,
                     const std::vector<double>& values) {
  Scene changed = scene;
  const std::string error = SetParameters(Resolve(scene, paths), values.data(), &changed);
  if (!error.empty()) throw Error(error);
  return changed;
}

// Rows of contacts and events as they come, one vector a column.
struct Table {
  std::vector<double> time, gap, normal, tangential;
  std::vector<int> first, second;
  std::vector<std::string> name, mode;
};

struct Run {
  std::vector<double> times, poses, twists;
  std::vector<int> bodies;  // those that are not static
  Table contacts, events;
  std::string status, message, summary, certificate, html;
  std::vector<std::string> warnings;
  std::vector<double> energies;  // kinetic and potential of each time
  std::vector<double> margins;   // of each step, where the certificate is wanted
};

void AddContacts(double t, const Stepper& stepper, Table* table) {
  const StepRecord& record = stepper.record();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ActiveContact& contact = record.contacts[i];
    if (contact.joint >= 0) continue;
    table->time.push_back(t);
    table->first.push_back(contact.a);
    table->second.push_back(contact.b);
    table->gap.push_back(contact.gap);
    table->normal.push_back(record.solution.normal_impulse[i]);
    table->tangential.push_back(record.solution.tangent_impulse[i]);
    table->mode.emplace_back(ModeName(record.solution.modes[i]));
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

// What is recorded beside the trajectory.
struct Wanted {
  bool certificate = false;
  bool html = false;
};

Run Simulate(const Scene& scene, long every, Wanted wanted) {
  std::string error;
  if (!CheckSettings(scene, &error)) throw Error(error);
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  Run run;
  for (int body = 0; body + 1 < model.structure->num_bodies(); ++body) {
    if (model.structure->bodies[body].motion != Motion::kStatic) run.bodies.push_back(body);
  }
  RunSummary summary;
  std::optional<ViewRecorder> view;
  if (wanted.html) view.emplace(scene, model);
  RolloutCertifier certifier;
  RunWarnings warnings(model, initial);
  const long steps = NumSteps(scene.simulation);
  Stepper stepper(model);
  State<double> last;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long k, double t, const State<double>& state, Stepper* done) {
        summary.Keep(model, state, done);
        if (summary.IsFull()) summary.EvaluateKept(model);
        warnings.Add(model, k, t, state, done);
        if (done != nullptr) {
          if (wanted.certificate) {
            certifier.AddStep(model, k - 1, done);
            run.margins.push_back(certifier.step_margin());
          }
          AddContacts(t, *done, &run.contacts);
          AddEvents(done, &run.events);
        }
        if (view) view->Add(model, t, state, done != nullptr ? &done->record() : nullptr);
        if (k % every != 0 && k != steps) return;
        run.times.push_back(t);
        run.energies.push_back(KineticEnergy(model, state));
        run.energies.push_back(PotentialEnergy(model, state));
        for (const int body : run.bodies) {
          run.poses.insert(run.poses.end(), &state.pose[3 * body], &state.pose[3 * body] + 3);
          run.twists.insert(run.twists.end(), &state.twist[3 * body], &state.twist[3 * body] + 3);
        }
      },
      &stepper, &last);
  summary.EvaluateKept(model);
  run.status = NameOf(report.status);
  run.message = report.message;
  run.summary = summary.ToJson(model, report, last).dump();
  run.warnings = warnings.Finish(model, report, last);
  if (wanted.certificate) run.certificate = ToJson(certifier.Finish(model, report)).dump();
  if (view) run.html = ViewHtml(view->data());
  return run;
}

py::array_t<int> Ints(const std::vector<int>& values) {
  return py::array_t<int>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::dict ContactsOf(const Table& table) {
  const auto rows = static_cast<py::ssize_t>(table.time.size());
  py::dict out;
  out["time"] = ToArray(table.time, {rows});
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

py::dict SimulateToDict(const Scene& scene, long every, bool certify, bool html) {
  if (every < 1) {
    throw py::value_error("every: expected a number >= 1, got " + std::to_string(every));
  }
  const Run run =
      WithoutLock([&] { return Simulate(scene, every, {.certificate = certify, .html = html}); });
  const auto rows = static_cast<py::ssize_t>(run.times.size());
  const auto bodies = static_cast<py::ssize_t>(run.bodies.size());
  py::dict out;
  out["times"] = ToArray(run.times, {rows});
  out["poses"] = ToArray(run.poses, {rows, bodies, 3});
  out["twists"] = ToArray(run.twists, {rows, bodies, 3});
  out["bodies"] = run.bodies;
  out["energies"] = ToArray(run.energies, {rows, 2});
  out["margins"] = ToArray(run.margins, {static_cast<py::ssize_t>(run.margins.size())});
  out["contacts"] = ContactsOf(run.contacts);
  out["events"] = EventsOf(run.events);
  out["status"] = run.status;
  out["message"] = run.message;
  out["summary"] = run.summary;
  out["warnings"] = run.warnings;
  out["certificate"] = run.certificate;
  out["html"] = run.html;
  return out;
}

}  // namespace

void BindScene(py::module_* module) {
  py::class_<Scene>(*module, "Scene")
      .def_static("parse", &Parse)
      .def_static("load", &Load)
      .def("to_json", &SceneToJson)
      .def("to_whole_json", &SceneWithSignalsToJson)
      .def(py::pickle(
          [](const Scene& scene) {
            return py::make_tuple(SceneWithSignalsToJson(scene), scene.path);
          },
          [](const py::tuple& state) {
            return Parse(state[0].cast<std::string>(), state[1].cast<std::string>(), "");
          }))
      .def("with_parameters", &WithParameters)
      .def_property_readonly("body_names",
                             [](const Scene& scene) {
                               std::vector<std::string> names;
                               for (const auto& body : scene.bodies) names.push_back(body.name);
                               return names;
                             })
      .def_property_readonly("num_steps",
                             [](const Scene& scene) { return NumSteps(scene.simulation); })
      .def("parameters",
           [](const Scene& scene) {
             Scene copy = scene;
             std::vector<std::tuple<std::string, double, std::string>> all;
             for (const SceneNumber<double>& number : EnumerateNumbers(&copy)) {
               all.emplace_back(number.path, *number.value, UnitOf(number.dimension));
             }
             return all;
           })
      .def("value", [](const Scene& scene, const std::string& path) {
        return Resolve(scene, {path})[0].value;
      });
  module->def("simulate", &SimulateToDict);
}

}  // namespace tangible::python
