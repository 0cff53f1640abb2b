// SPDX-License-Identifier: Apache-2.0
//
// Plans and runs over a receding horizon: what tangible-control does.
#include <string>

#include "tangible/app/control_output.h"
#include "tangible/app/control_problem.h"
#include "tangible/app/control_run.h"
#include "tangible/python/binding.h"

namespace tangible::python {
namespace {

Array RowsOf(const RowMatrixXd& values) { return ToArray(values, {values.rows(), values.cols()}); }

// A file of a control problem, read.
class ControlOf {
 public:
  ControlOf(const std::string& text, const std::string& name) : name_(name) {
    std::string error;
    if (!ParseControlFile(text, name, &file_, &error)) throw Error(error);
  }

  // `progress`: called with the start, the number of its iteration and its numbers, or None.
  py::dict Plan(int threads, const py::object& progress) const {
    ControlRunOptions options;
    options.threads = threads;
    if (!progress.is_none()) {
      options.progress = [&progress](int start, long number, const IlqrIteration& iteration) {
        const py::gil_scoped_acquire lock;
        progress(start, number, iteration.cost, iteration.gradient, iteration.step);
      };
    }
    ControlRun run;
    DrawnMotion drawn;
    ReplayRun replay;
    WithoutLock([&] {
      Check(MakePlan(name_, file_, options, &run));
      Check(DrawMotion(file_, run, &drawn));
      replay = MakeReplay(file_.scene, run.controls);
    });
    py::dict out = Describe(run, drawn);
    out["holds"] = run.verdict.holds;
    out["replay_scene"] = replay.scene;
    out["replay_parts"] = replay.parts;
    out["replay_controls"] = RowsOf(replay.controls);
    out["replay_states"] = RowsOf(run.replay.states);
    return out;
  }

  // The plant is the problem's own scene where `plant` is None; `progress` is called with the step,
  // their number and the cost so far.
  py::dict Predict(const py::object& plant, const std::string& plant_name, double budget,
                   int threads, const py::object& progress) const {
    ControlRunOptions options;
    options.threads = threads;
    options.budget = budget;
    if (!progress.is_none()) {
      options.step_done = [&progress](long step, long steps, double cost) {
        const py::gil_scoped_acquire lock;
        progress(step, steps, cost);
      };
    }
    const bool own = plant.is_none();
    const Scene scene = own ? file_.scene : plant.cast<Scene>();
    const std::string named = own ? file_.scene_path : plant_name;
    ControlRun run;
    DrawnMotion drawn;
    WithoutLock([&] {
      if (!own) Check(CheckPlant(file_, scene, named));
      Check(RunPredictive(name_, file_, scene, named, options, &run));
      Check(DrawMotion(file_, run, &drawn));
    });
    return Describe(run, drawn);
  }

  double dt() const { return file_.scene.simulation.dt; }
  const std::vector<std::string>& paths() const { return file_.paths; }

 private:
  static void Check(const std::string& error) {
    if (!error.empty()) throw Error(error);
  }

  py::dict Describe(const ControlRun& run, const DrawnMotion& drawn) const {
    py::dict out;
    out["result"] = run.result.dump();
    out["scene"] = run.scene;
    out["states"] = RowsOf(run.states);
    out["controls"] = RowsOf(run.controls);
    out["warnings"] = run.warnings;
    out["plan"] = PlanCsv(file_, run);
    out["trajectory"] = drawn.trajectory;
    out["page"] = drawn.page;
    return out;
  }

  std::string name_;
  ControlFile file_;
};

}  // namespace

void BindControl(py::module_* module) {
  py::class_<ControlOf>(*module, "Control")
      .def(py::init<const std::string&, const std::string&>())
      .def_property_readonly("dt", &ControlOf::dt)
      .def_property_readonly("paths", &ControlOf::paths)
      .def("plan", &ControlOf::Plan)
      .def("mpc", &ControlOf::Predict);
}

}  // namespace tangible::python
