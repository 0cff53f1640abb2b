// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/control_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <optional>
#include <random>
#include <utility>

#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/app/tolerances.h"
#include "tangible/control/model_predictive.h"
#include "tangible/control/plan_search.h"
#include "tangible/control/unreached_targets.h"
#include "tangible/math/median.h"
#include "tangible/math/random.h"
#include "tangible/render/html.h"
#include "tangible/scene/scene_names.h"
#include "tangible/simulation/stepping/joint_opening.h"

namespace tangible {
namespace {

std::vector<double> ToVector(const VectorX<double>& values) {
  return {values.data(), values.data() + values.size()};
}

// A plan, and what became of it in the motion.
struct Judged {
  IlqrResult result;
  double seconds = 0.0;  // CPU
  Replay replay;
  double cost_of_nothing = 0.0;
  double units = 0.0;  // the cost with every residual as large as its target
  PlanVerdict verdict;
  Certificate certificate;
  SearchResult search;  // without `best`, which is the result
};

// Adds the largest entries of the columns of B, a control each.
void AddEffect(const MatrixX<double>& b, VectorX<double>* effect) {
  *effect += b.cwiseAbs().colwise().maxCoeff().transpose();
}

// Finds a control that moves nothing in any step of the motion with these controls, and with a
// surrogate in none of its samples either. Empty, or an error of one line. Where a step cannot be
// made only those before it count.
std::string FindIdle(const ControlProblem& problem, const ControlFile& file,
                     const RolloutFunction& function, const RowMatrixXd& controls) {
  const long steps = controls.rows();
  Model<double> model;
  State<double> state;
  BuildModel(function.scene(), &model, &state);
  double heaviest = 0.0;
  for (const int body : model.structure->moving) {
    const BodyIndex& index = model.structure->bodies[body];
    heaviest = std::max({heaviest, model.parameters[index.mass], model.parameters[index.inertia]});
  }
  const double least = kMovesNothing * file.scene.simulation.dt / heaviest;
  VectorX<double> effect = VectorX<double>::Zero(problem.map->num_controls());
  VectorX<double> x = problem.initial, next;
  MatrixX<double> a, b;
  std::string error;
  for (long k = 0; k < steps && effect.minCoeff() <= least; ++k) {
    if (!problem.map->Linearise(k, x, controls.row(k), &next, &a, &b, &error)) return "";
    AddEffect(b, &effect);
    x = next;
  }
  if (effect.minCoeff() <= least && file.options.surrogate.samples > 0) {
    Plan plan;
    plan.controls = controls;
    plan.states = problem.initial.transpose();
    std::vector<MatrixX<double>> mean_a(steps, a), mean_b(steps, MatrixX<double>(0.0 * b));
    AverageJacobians(problem, plan, file.options.surrogate, &mean_a, &mean_b);
    for (const MatrixX<double>& one : mean_b) AddEffect(one, &effect);
  }
  Eigen::Index idle = 0;
  if (effect.minCoeff(&idle) > least) return "";
  return "/controls/" + std::to_string(idle) +
         "/path: expected a control that moves something, got " + file.paths[idle] +
         ", which moves nothing in any step with the initial controls";
}

OrderedJson DescribeControls(const ControlFile& file, const RowMatrixXd& controls, double dt) {
  OrderedJson json = {
      {"paths", file.paths}, {"times", OrderedJson::array()}, {"values", OrderedJson::array()}};
  for (Eigen::Index k = 0; k < controls.rows(); ++k) {
    json["times"].push_back(static_cast<double>(k) * dt);
    json["values"].push_back(ToVector(controls.row(k)));
  }
  return json;
}

// `sampled`: how many of them, at the start, have the surrogate's Jacobians.
OrderedJson DescribeIterations(const std::vector<IlqrIteration>& iterations, long sampled) {
  OrderedJson list = OrderedJson::array();
  for (const IlqrIteration& iteration : iterations) {
    const bool is_sampled = static_cast<long>(list.size()) < sampled;
    list.push_back({{"cost", iteration.cost},
                    {"gradient", iteration.gradient},
                    {"shift", iteration.shift},
                    {"step", iteration.step}});
    if (sampled > 0) list.back()["jacobians"] = is_sampled ? "surrogate" : "exact";
  }
  return list;
}

OrderedJson FinalState(const RolloutFunction& function, const RowMatrixXd& states) {
  const std::vector<std::string> names = OutputNames(function.structure());
  OrderedJson json = OrderedJson::object();
  if (states.rows() == 0) return json;
  for (size_t i = 0; i < names.size(); ++i) {
    json[names[i]] = states(states.rows() - 1, static_cast<Eigen::Index>(i));
  }
  return json;
}

// The cost of the motion with controls of 0, or of the bounds nearest to it; not finite where there
// is no such motion.
double CostOfNothing(const ControlFile& file, const Cost& cost, long steps) {
  const VectorX<double> none =
      VectorX<double>::Zero(file.low.size()).cwiseMax(file.low).cwiseMin(file.high);
  return ReplayByEvents(file.scene, file.paths, cost, none.transpose().replicate(steps, 1)).cost;
}

std::string NamesOf(const ControlFile& file, const std::vector<int>& terms) {
  std::string names;
  for (const int term : terms) names += (names.empty() ? "" : ", ") + file.term_names[term];
  return names;
}

PlanVerdict VerdictOf(const ControlFile& file, const Judged& plan,
                      const UnreachedTargets& unreached) {
  const IlqrResult& result = plan.result;
  const Replay& replay = plan.replay;
  if (DiffersFromMotion(result.plan.cost, replay, plan.cost_of_nothing, plan.units)) {
    const std::string why = replay.done ? "the plan's cost is " + CompactNumber(result.plan.cost) +
                                              ", and that of its replay by events " +
                                              CompactNumber(replay.cost)
                                        : "the plan's replay by events failed: " + replay.message;
    return {"differs_from_motion", why, false};
  }
  if (unreached.all) {
    const bool are_given = (file.high - file.low).maxCoeff() == 0.0;
    return {"no_effect_on_target",
            "the controls have no effect on " + NamesOf(file, unreached.terms) +
                (are_given ? ": low and high of all of them are equal"
                           : " from where the plan is; try starts or sampling, another initial, or "
                             "a surrogate"),
            false};
  }
  return {NameOf(result.status), result.message, true};
}

// Rows of planned numbers beside those of the replay: the cost, then the final state.
std::vector<std::vector<std::string>> PlannedBesideMotion(const RolloutFunction& function,
                                                          const IlqrResult& result,
                                                          const Replay& replay) {
  constexpr int kDigits = 8;
  const std::vector<std::string> names = OutputNames(function.structure());
  const auto text = [](double value) {
    return std::isfinite(value) ? CompactNumber(value, kDigits) : std::string("none");
  };
  std::vector<std::vector<std::string>> rows = {
      {"cost", text(result.plan.cost), text(replay.cost)}};
  const Eigen::Index last = result.plan.states.rows() - 1;
  for (size_t i = 0; i < names.size(); ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    const double moved = replay.states.rows() > last ? replay.states(last, j) : std::nan("");
    rows.push_back({names[i], text(result.plan.states(last, j)), text(moved)});
  }
  return rows;
}

std::string WarningOfMaximum() {
  return "with the initial controls the cost has no gradient, as an angle that wraps is half a "
         "turn from its target, where its cost is largest; they were offset by " +
         FormatNumber(kStartOffset) + " of their ranges";
}

void WarnOfDiscreteMap(const Certificate& certificate, std::vector<std::string>* warnings) {
  const std::string advice = AdviceOf(certificate);
  if (advice.empty()) return;
  warnings->push_back("a plan may exploit when its steps have impacts: " + advice);
}

// The options of all plans, with the progress that is wanted.
SearchOptions SearchOf(const ControlFile& file, const ControlRunOptions& options) {
  SearchOptions search{file.starts, file.sampling, file.options, options.threads};
  search.ilqr.progress = options.progress;
  return search;
}

OrderedJson DescribePlan(const ControlFile& file, const RolloutFunction& function,
                         const Judged& plan) {
  const IlqrResult& result = plan.result;
  OrderedJson json = {
      {"status", plan.verdict.status},
      {"message", plan.verdict.message},
      {"planned_status", NameOf(result.status)},
      {"cost", result.plan.cost},
      {"gradient", result.gradient},
      {"final_state", FinalState(function, result.plan.states)},
      {"motion",
       {{"cost", plan.replay.cost},
        {"message", plan.replay.message},
        {"final_state", FinalState(function, plan.replay.states)},
        {"cost_of_nothing", plan.cost_of_nothing}}},
      {"certificate", ToJson(plan.certificate)},
      {"rollouts", result.rollouts},
      {"linearisations", result.linearisations},
      {"cpu_seconds", plan.seconds},
      {"iterations", DescribeIterations(result.iterations, result.surrogate_iterations)},
      {"controls", DescribeControls(file, result.plan.controls, file.scene.simulation.dt)}};
  if (file.starts.count > 1 || file.sampling.samples > 0) {
    json["starts"] = {{"count", plan.search.start_costs.size()},
                      {"pieces", file.starts.pieces},
                      {"seed", file.starts.seed},
                      {"drawn", plan.search.drawn},
                      {"chosen", plan.search.chosen},
                      {"costs", plan.search.start_costs},
                      {"polished_costs", plan.search.polished_costs}};
  }
  if (file.sampling.samples > 0) {
    json["sampling"] = {{"method", NameOf(file.sampling.method)},
                        {"samples", file.sampling.samples},
                        {"iterations", file.sampling.iterations},
                        {"seed", file.sampling.seed}};
  }
  if (file.options.surrogate.samples > 0) {
    json["surrogate"] = {{"samples", file.options.surrogate.samples},
                         {"deviation", file.options.surrogate.deviation},
                         {"seed", file.options.surrogate.seed},
                         {"iterations", result.surrogate_iterations}};
  }
  return json;
}

}  // namespace

std::string MakePlan(const std::string& name, const ControlFile& file,
                     const ControlRunOptions& options, ControlRun* run) {
  RolloutFunction function;
  std::string error = function.Create(file.scene, {}, file.paths, {});
  if (!error.empty()) return name + ": " + error;
  EngineStep map(function);
  const Cost cost(map.num_states(), map.num_controls(), file.scene.simulation.dt, file.terms);
  const ControlProblem problem{&map, &cost, map.initial(), file.low, file.high, 0};
  const RowMatrixXd start = file.InitialControls(function.num_steps());
  const SearchOptions search = SearchOf(file, options);
  const std::string idle = FindIdle(problem, file, function, start);
  if (!idle.empty() && !search.searches()) return name + ": " + idle;
  Judged plan;
  const std::clock_t began = std::clock();
  plan.search = SearchPlan({&function, &cost, file.low, file.high}, start, search);
  plan.result = std::move(plan.search.best);
  plan.seconds = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  const Plan& planned = plan.result.plan;
  if (plan.result.status == IlqrStatus::kFailed) return name + ": " + plan.result.message;
  // What moves nothing at first may in the plan from another start.
  if (!idle.empty()) error = FindIdle(problem, file, function, planned.controls);
  if (!error.empty()) return name + ": " + error;
  if (plan.result.left_maximum) run->warnings.push_back(WarningOfMaximum());
  const RolloutInput input{VectorX<double>(), VectorX<double>(), planned.controls};
  RolloutWorker worker(function);
  const RolloutOutput played = worker.Run(input);
  for (std::string& warning : worker.Warnings(played.report, played.final)) {
    run->warnings.push_back(std::move(warning));
  }
  plan.certificate = worker.Certify(input);
  WarnOfDiscreteMap(plan.certificate, &run->warnings);
  plan.replay = ReplayByEvents(file.scene, file.paths, cost, planned.controls);
  plan.cost_of_nothing = CostOfNothing(file, cost, planned.controls.rows());
  plan.units = cost.ValueOfUnits(planned.controls.rows());
  const UnreachedTargets unreached = FindUnreachedTargets(problem, planned);
  plan.verdict = VerdictOf(file, plan, unreached);
  if (plan.verdict.holds && !unreached.terms.empty()) {
    run->warnings.push_back("the controls have no effect on " + NamesOf(file, unreached.terms) +
                            " from where the plan is");
  }
  if (plan.verdict.holds && !unreached.one_sided.empty()) {
    run->warnings.push_back("the controls have an effect on " + NamesOf(file, unreached.one_sided) +
                            " on one side of the plan alone, as against a stop");
  }
  run->result = DescribePlan(file, function, plan);
  run->beside_motion = PlannedBesideMotion(function, plan.result, plan.replay);
  run->scene = file.scene;
  run->states = planned.states;
  run->controls = planned.controls;
  run->cost = planned.cost;
  run->verdict = std::move(plan.verdict);
  run->replay = std::move(plan.replay);
  run->iterations = std::move(plan.result.iterations);
  return "";
}

namespace {

std::vector<std::string> MovingBodies(const Scene& scene) {
  std::vector<std::string> names;
  for (const BasicBody<double>& body : scene.bodies) {
    if (body.motion == Motion::kMoving) names.push_back(body.name);
  }
  return names;
}

// "a, b", of many the first ones.
std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kMostNames = 5;
  std::string list;
  for (size_t i = 0; i < std::min(names.size(), kMostNames); ++i) {
    list.append(i == 0 ? "" : ", ").append(names[i]);
  }
  return list + (names.size() > kMostNames ? ", ... (" + std::to_string(names.size()) + ")" : "");
}

struct PredictiveRun {
  RowMatrixXd states, controls;
  double cost = 0.0;
  std::vector<double> seconds;  // of each plan, CPU
  long failed = 0;
  // States of the plant that are not on the model's joints, and the largest error of one, m or rad.
  long projected = 0;
  double joint_error = 0.0;
  // Of estimates from observations: the sum of what surprises, how often, and of each number of the
  // state the sum of squares of what it is off.
  double surprise = 0.0;
  long observations = 0;
  VectorX<double> squared_errors;
  std::string failure;        // of the first plan that failed: where and why
  bool left_maximum = false;  // in any plan
  long without_effect = 0;    // plans, from the first on, without effect on any target
  std::string unreached;      // those targets, of the first plan
  // The first contact in a plan by fixed steps through which its derivatives are not the motion's.
  std::string discrete_map;
  std::string error;         // of the plant
  std::string filter_error;  // of the model, which cannot make a step from an estimate
};

long NumRunSteps(const ControlFile& file) {
  SimulationSettings whole = file.scene.simulation;
  whole.duration = file.run_duration;
  return NumSteps(whole);
}

// Where the first plan begins: with starts or sampling at the plan that they find.
RowMatrixXd FirstControls(const ControlFile& file, const Cost& cost, long horizon, int threads) {
  RowMatrixXd initial = file.InitialControls(horizon);
  const SearchOptions search = SearchOf(file, {.threads = threads});
  Scene scene = file.scene;
  scene.simulation.duration = static_cast<double>(horizon) * scene.simulation.dt;
  RolloutFunction function;
  if (!search.searches() || !function.Create(scene, {}, file.paths, {}).empty()) return initial;
  const IlqrResult best = SearchPlan({&function, &cost, file.low, file.high}, initial, search).best;
  return best.status == IlqrStatus::kFailed ? initial : best.plan.controls;
}

// What a plan is made from: the plant's state, on the joints of the model, or an estimate of it.
class Sight {
 public:
  Sight(const ControlFile& file, EngineStep* map)
      : file_(file), map_(*map), random_(Generator(file.noise_seed, 0)) {
    if (file.filter.sensors.empty()) return;
    filter_.emplace(map, file.scene.simulation.dt, file.filter);
  }

  VectorX<double> See(long k, const VectorX<double>& x, PredictiveRun* run) {
    if (filter_) return Estimate(k, x, run);
    VectorX<double> seen = x;
    double error = 0.0;
    if (map_.ProjectOntoJoints(k, &seen, &error) != JointState::Outcome::kOnJoints) {
      ++run->projected;
      run->joint_error = std::max(run->joint_error, error);
    }
    return seen;
  }

  // The control that acts in the step.
  bool Play(long k, const VectorX<double>& u, std::string* error) {
    return !filter_ || filter_->Advance(k, u, error);
  }

 private:
  VectorX<double> Estimate(long k, const VectorX<double>& x, PredictiveRun* run) {
    if (k % file_.observe_every == 0) {
      VectorX<double> observed = filter_->Read(x);
      for (Eigen::Index i = 0; i < observed.size(); ++i) {
        observed[i] += file_.filter.sigma[i] * Normal(&random_);
      }
      filter_->Correct(k, observed);
      run->surprise += filter_->surprise() / static_cast<double>(observed.size());
      ++run->observations;
    }
    if (run->squared_errors.size() == 0) run->squared_errors.setZero(x.size());
    run->squared_errors += (filter_->state() - x).cwiseAbs2();
    return filter_->state();
  }

  const ControlFile& file_;
  EngineStep& map_;
  std::optional<StateFilter> filter_;
  std::mt19937_64 random_;
};

PredictiveRun Control(const ControlFile& file, const ControlRunOptions& wanted, EngineStep* map,
                      EngineStep* plant) {
  PredictiveRun run;
  const double dt = file.scene.simulation.dt;
  const long steps = NumRunSteps(file);
  const long horizon = std::max(1L, std::lround(file.plan_horizon / dt));
  const Cost cost(map->num_states(), map->num_controls(), dt, file.terms);
  PredictiveOptions options{file.options, wanted.budget};
  options.ilqr.max_iterations = file.plan_iterations;
  if (wanted.budget > 0.0) options.ilqr.max_iterations = file.options.max_iterations;
  PredictiveController controller({map, &cost, map->initial(), file.low, file.high, 0},
                                  FirstControls(file, cost, horizon, wanted.threads), options);
  Sight sight(file, map);
  VectorX<double> x = plant->initial();
  run.states.resize(steps + 1, x.size());
  run.controls.resize(steps, map->num_controls());
  run.states.row(0) = x.transpose();
  VectorX<double> next;
  for (long k = 0; k < steps; ++k) {
    const std::clock_t began = std::clock();
    const VectorX<double> u = controller.Control(k, sight.See(k, x, &run));
    run.seconds.push_back(static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
    run.left_maximum |= controller.last().left_maximum;
    if (controller.last().status == IlqrStatus::kFailed && run.failed++ == 0) {
      run.failure = "in step " + std::to_string(k) + ": " + controller.last().message;
    }
    const Plan& plan = controller.last().plan;
    if (controller.last().status != IlqrStatus::kFailed && run.without_effect == k) {
      const ControlProblem problem{map, &cost, x, file.low, file.high, k};
      const UnreachedTargets unreached = FindUnreachedTargets(problem, plan);
      if (unreached.all && run.without_effect++ == 0) {
        run.unreached = NamesOf(file, unreached.terms);
      }
    }
    if (run.discrete_map.empty() && plan.states.rows() > plan.controls.rows()) {
      run.discrete_map = map->DiscreteMapOf(k, plan.states, plan.controls);
    }
    if (!plant->Step(k, x, u, &next, &run.error)) return run;
    if (k + 1 < steps && !sight.Play(k, u, &run.filter_error)) return run;
    run.cost += cost.Value(x, u);
    run.controls.row(k) = u.transpose();
    run.states.row(k + 1) = next.transpose();
    x = next;
    if (wanted.step_done) wanted.step_done(k, steps, run.cost);
  }
  run.cost += cost.EndValue(x);
  return run;
}

// Empty, or why a control is another quantity in the plant: its joint is of another type.
std::string OtherJoint(const Scene& model, const Scene& plant, const std::string& path) {
  const auto type_in = [&](const Scene& scene) {
    std::string type;
    for (const auto& joint : scene.joints) {
      if (path.starts_with("joints/" + joint.name + "/"))
        type = NameOf(joint.type, kJointTypeNames);
    }
    return type;
  };
  const std::string expected = type_in(model), got = type_in(plant);
  return expected == got
             ? ""
             : path + ": expected a joint of the model's type, " + expected + ", got " + got;
}

// Of the model's run with the controls that were played, which is about what the plans were for.
Certificate CertifyPlayed(const ControlFile& file, const RowMatrixXd& controls) {
  Scene scene = file.scene;
  scene.simulation.duration = static_cast<double>(controls.rows()) * scene.simulation.dt;
  RolloutFunction function;
  if (!function.Create(scene, {}, file.paths, {}).empty()) return {};
  return RolloutWorker(function).Certify({VectorX<double>(), VectorX<double>(), controls});
}

std::string FailedPlans(const PredictiveRun& run) {
  return std::to_string(run.failed) + " of " + std::to_string(run.seconds.size()) + " plans failed";
}

// What keeps a run from having a result, or empty.
std::string WhyNoResult(const PredictiveRun& run, const std::string& name,
                        const std::string& plant_name) {
  if (!run.error.empty()) return plant_name + ": " + run.error;
  if (!run.filter_error.empty()) {
    return name +
           ": /mpc/observations: no step of the model from the estimate: " + run.filter_error;
  }
  if (run.failed == static_cast<long>(run.seconds.size())) {
    return name + ": " + FailedPlans(run) + ", the first " + run.failure;
  }
  if (!std::isfinite(run.cost)) return name + ": the cost of the run is not finite";
  return "";
}

}  // namespace

std::string CheckPlant(const ControlFile& file, const Scene& plant, const std::string& name) {
  if (plant.simulation.dt != file.scene.simulation.dt) {
    return name + ": /simulation/dt: expected the problem's, " +
           FormatNumber(file.scene.simulation.dt) + ", got " + FormatNumber(plant.simulation.dt);
  }
  const std::vector<std::string> expected = MovingBodies(file.scene), got = MovingBodies(plant);
  if (got != expected) {
    return name + ": /bodies: expected the moving bodies of " + file.scene_path + ", " +
           Listed(expected) + ", got " + Listed(got);
  }
  int which = -1;
  std::string error = CheckControls(plant, file.paths, &which);
  for (size_t i = 0; i < file.paths.size() && error.empty(); ++i) {
    error = OtherJoint(file.scene, plant, file.paths[i]);
  }
  return error.empty() ? "" : name + ": " + error;
}

namespace {

// Empty, or a joint of the plant that is open at the end.
std::string OpenAtEnd(const Scene& plant, const RolloutFunction& function,
                      const RowMatrixXd& states, double time) {
  Model<double> model;
  State<double> final;
  BuildModel(plant, &model, &final);
  function.SetState(states.row(states.rows() - 1), &final);
  return OpenJointOf(model, final, time);
}

}  // namespace

std::string RunPredictive(const std::string& name, const ControlFile& file, const Scene& plant,
                          const std::string& plant_name, const ControlRunOptions& options,
                          ControlRun* run) {
  if (!(file.run_duration > 0.0)) {
    return name + ": /mpc: missing, expected an object with duration and horizon";
  }
  RolloutFunction function, of_plant;
  std::string error = function.Create(file.scene, {}, file.paths, {});
  if (error.empty()) error = of_plant.Create(plant, {}, file.paths, {});
  if (!error.empty()) return name + ": " + error;
  EngineStep map(function), plant_step(of_plant);
  // With starts or sampling a control that moves nothing at first may in the plan that they find.
  if (!SearchOf(file, options).searches()) {
    error = FindIdle({&map, nullptr, map.initial(), file.low, file.high}, file, function,
                     file.InitialControls(NumRunSteps(file)));
    if (!error.empty()) return name + ": " + error;
  }
  PredictiveRun made = Control(file, options, &map, &plant_step);
  error = WhyNoResult(made, name, plant_name);
  if (!error.empty()) return error;
  if (made.failed > 0) {
    run->warnings.push_back(FailedPlans(made) +
                            ", where the plans before them were continued; the first " +
                            made.failure);
  }
  if (made.left_maximum) run->warnings.push_back(WarningOfMaximum());
  const std::string open = OpenAtEnd(plant, of_plant, made.states, file.run_duration);
  if (!open.empty()) run->warnings.push_back(open);
  const bool no_effect = made.without_effect == static_cast<long>(made.seconds.size());
  if (no_effect) {
    run->verdict = {"no_effect_on_target",
                    "the controls have no effect on " + made.unreached +
                        " in any plan; try a longer horizon or terms at its end, starts or "
                        "sampling, or another initial",
                    false};
  }
  const Certificate certificate = CertifyPlayed(file, made.controls);
  // A plan looks ahead to impacts that the run which is played may never come to.
  Certificate of_plans = certificate;
  if (of_plans.discrete_map.empty()) of_plans.discrete_map = made.discrete_map;
  WarnOfDiscreteMap(of_plans, &run->warnings);
  run->result = {{"status", no_effect ? run->verdict.status : "done"},
                 {"message", run->verdict.message},
                 {"cost", made.cost},
                 {"final_state", FinalState(of_plant, made.states)},
                 {"plans", made.seconds.size()},
                 {"plans_failed", made.failed},
                 {"states_projected", made.projected},
                 {"joint_error_max", made.joint_error},
                 {"certificate", ToJson(certificate)},
                 {"cpu_seconds_median", UpperMedian(made.seconds)},
                 {"cpu_seconds_max", *std::max_element(made.seconds.begin(), made.seconds.end())},
                 {"controls", DescribeControls(file, made.controls, file.scene.simulation.dt)}};
  if (made.observations > 0) {
    OrderedJson errors = OrderedJson::object();
    const std::vector<std::string> names = OutputNames(function.structure());
    for (size_t i = 0; i < names.size(); ++i) {
      errors[names[i]] = std::sqrt(made.squared_errors[static_cast<Eigen::Index>(i)] /
                                   static_cast<double>(made.controls.rows()));
    }
    const double surprise = made.surprise / static_cast<double>(made.observations);
    run->result["estimates"] = {{"observations", made.observations},
                                {"surprise_mean", surprise},
                                {"error_rms", std::move(errors)}};
    if (surprise > kSurprising) {
      char times[32];
      std::snprintf(times, sizeof times, "%.2g", surprise);
      run->warnings.push_back("observations surprise the model's filter " + std::string(times) +
                              " times as much as their noise should: the plant moves otherwise "
                              "than the model, or acceleration_sigma is too small");
    }
  }
  if (!no_effect) run->verdict.status = "done";
  run->scene = plant;
  run->scene.simulation.duration = static_cast<double>(made.controls.rows()) * plant.simulation.dt;
  run->states = std::move(made.states);
  run->controls = std::move(made.controls);
  run->cost = made.cost;
  return "";
}

}  // namespace tangible
