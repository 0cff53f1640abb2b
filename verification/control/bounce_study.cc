// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/control/bounce_study.h"

#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <string>

#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"
#include "tangible/control/plan_search.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/math/cpu_time.h"
#include "tangible/math/random.h"

namespace tangible::bounce {
namespace {

constexpr double kLargestEffort = 30.0;  // N
constexpr double kEffortWeight = 1e-3, kCupWeight = 100.0;
// Of the surrogate: its deviation is a share of the range of efforts.
constexpr int kSamples = 8;
constexpr double kDeviation = 0.05;
// Of the search for a start.
constexpr int kSamplesOfRound = 32, kRounds = 4;
// Of problems: a ball that comes so far, m, was struck; so many are drawn for one, at most.
constexpr double kStruck = 0.8;
constexpr int kMostDraws = 100;

template <typename Named>
const Named* Find(const std::vector<Named>& list, const std::string& name) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Named& one) { return one.name == name; });
  return found == list.end() ? nullptr : &*found;
}

// A problem in one stepping, with its map.
class Planned {
 public:
  Planned(const Problem& problem, Stepping stepping) : problem_(problem) {
    Scene scene = problem.scene;
    scene.simulation.stepping = stepping;
    if (stepping == Stepping::kFixed) {
      scene.simulation.joint_correction = JointCorrection::kProjection;
    }
    const std::string error = function_.Create(scene, {}, {"joints/slider/effort"}, {});
    CHECK(error.empty()) << error;
    map_ = std::make_unique<EngineStep>(function_);
    const std::vector<std::string> names = OutputNames(function_.structure());
    ball_ = static_cast<int>(std::find(names.begin(), names.end(), "ball/x") - names.begin());
    std::vector<CostTerm> terms = {
        {CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, kEffortWeight, false}};
    for (const int axis : {0, 1}) {
      terms.push_back(
          {CostTerm::Kind::kPoint, ball_, axis, {0, 0}, problem.cup[axis], kCupWeight, true});
    }
    cost_ = std::make_unique<Cost>(map_->num_states(), 1, scene.simulation.dt, terms);
    const VectorX<double> bound = VectorX<double>::Constant(1, kLargestEffort);
    control_ = {map_.get(), cost_.get(), map_->initial(), -bound, bound};
  }

  const ControlProblem& control() const { return control_; }
  SearchProblem search() const { return {&function_, cost_.get(), control_.low, control_.high}; }
  RowMatrixXd Start() const {
    return RowMatrixXd::Constant(function_.num_steps(), 1, problem_.effort);
  }

  // The motion under controls; false where a step cannot be made.
  bool Play(const RowMatrixXd& controls, Plan* plan) {
    plan->controls = controls;
    plan->states.resize(controls.rows() + 1, map_->num_states());
    plan->states.row(0) = control_.initial.transpose();
    VectorX<double> next;
    std::string error;
    for (long k = 0; k < controls.rows(); ++k) {
      if (!map_->Step(k, plan->states.row(k), controls.row(k), &next, &error)) return false;
      plan->states.row(k + 1) = next.transpose();
    }
    return true;
  }
  Vector2<double> BallAtEnd(const Plan& plan) const {
    const auto last = plan.states.row(plan.states.rows() - 1);
    return {last[ball_], last[ball_ + 1]};
  }
  double Distance(const Plan& plan) const { return (BallAtEnd(plan) - problem_.cup).norm(); }

 private:
  const Problem& problem_;
  RolloutFunction function_;
  std::unique_ptr<EngineStep> map_;
  std::unique_ptr<Cost> cost_;
  ControlProblem control_;
  int ball_ = 0;
};

// Efforts that are constant in pieces of equal length, uniform within the bounds.
void DrawPieces(int pieces, std::mt19937_64* random, RowMatrixXd* efforts) {
  for (int piece = 0; piece < pieces; ++piece) {
    const double effort = Uniform(-kLargestEffort, kLargestEffort, random);
    const Eigen::Index first = piece * efforts->rows() / pieces;
    const Eigen::Index last = (piece + 1) * efforts->rows() / pieces;
    efforts->middleRows(first, last - first).setConstant(effort);
  }
}

// Empty where it has none.
RowMatrixXd GradientAtStart(Planned* planned) {
  Plan plan;
  if (!planned->Play(planned->Start(), &plan)) return {};
  RowMatrixXd costates;
  std::string error;
  const RowMatrixXd gradient = CostGradient(planned->control(), plan, &costates, &error);
  return error.empty() ? gradient : RowMatrixXd();
}

}  // namespace

std::string CheckScene(const Scene& scene) {
  for (const char* name : {"hammer", "ball"}) {
    if (Find(scene.bodies, name) == nullptr) {
      return std::string("/bodies: expected a body ") + name + ", got none";
    }
  }
  const BasicJoint<double>* slider = Find(scene.joints, "slider");
  if (slider != nullptr && slider->type == JointType::kPrismatic) return "";
  return "/joints: expected a prismatic joint slider, got none";
}

Problem Draw(const Scene& scene, unsigned seed, unsigned number, int pieces) {
  std::mt19937_64 random = Generator(seed, number);
  Problem problem;
  problem.scene = scene;
  BasicBody<double>& ball = problem.scene.bodies[Find(scene.bodies, "ball") - scene.bodies.data()];
  const Vector2<double> position = ball.position;
  const double speed = ball.velocity[0];
  for (int i = 0; i < kMostDraws; ++i) {
    ball.position[0] = position[0] + Uniform(-0.1, 0.1, &random);
    ball.position[1] = position[1] + Uniform(-0.15, 0.15, &random);
    ball.velocity[0] = speed + Uniform(-0.1, 0.1, &random);
    problem.effort = Uniform(4.0, 14.0, &random);
    Planned planned(problem, Stepping::kEvent);
    RowMatrixXd efforts = planned.Start();
    if (pieces > 1) DrawPieces(pieces, &random, &efforts);
    Plan plan;
    if (!planned.Play(efforts, &plan)) continue;
    problem.cup = planned.BallAtEnd(plan);
    if (problem.cup.x() > ball.position[0] + kStruck) break;
  }
  problem.effort = Uniform(3.0, 10.0, &random);
  problem.ball = ball.position;
  problem.ball_speed = ball.velocity[0];
  return problem;
}

const char* NameOf(Method method) {
  switch (method) {
    case Method::kExact:
      return "exact";
    case Method::kExtended:
      return "extended";
    case Method::kSurrogate:
      return "surrogate";
    case Method::kStarts:
      return "starts";
    case Method::kSampling:
      return "sampling";
    case Method::kFixed:
      return "fixed";
  }
  return "";
}

Outcome Solve(const Problem& problem, Method method, int iterations, int starts) {
  Planned own(problem, method == Method::kFixed ? Stepping::kFixed : Stepping::kEvent);
  IlqrOptions options;
  options.max_iterations = iterations;
  options.reference_extension = method == Method::kExtended;
  if (method == Method::kSurrogate) {
    options.surrogate = {.samples = kSamples, .deviation = kDeviation};
  }
  Outcome outcome;
  const double began = ThreadCpuSeconds();
  SearchOptions search;
  search.ilqr = options;
  search.threads = 1;
  if (method == Method::kStarts) search.starts.count = starts;
  if (method == Method::kSampling) {
    search.sampling.samples = kSamplesOfRound;
    search.sampling.iterations = kRounds;
  }
  const IlqrResult result = SearchPlan(own.search(), own.Start(), search).best;
  outcome.cpu_seconds = ThreadCpuSeconds() - began;
  outcome.iterations = static_cast<int>(result.iterations.size());
  outcome.distance = outcome.believed = std::numeric_limits<double>::infinity();
  if (result.status == IlqrStatus::kFailed) return outcome;
  outcome.believed = own.Distance(result.plan);
  Planned played(problem, Stepping::kEvent);
  Plan motion;
  if (played.Play(result.plan.controls, &motion)) outcome.distance = played.Distance(motion);
  return outcome;
}

Direction OfFixedGradient(const Problem& problem) {
  Planned by_events(problem, Stepping::kEvent), by_steps(problem, Stepping::kFixed);
  const RowMatrixXd exact = GradientAtStart(&by_events), fixed = GradientAtStart(&by_steps);
  if (exact.size() == 0 || fixed.size() == 0) return Direction::kNothing;
  // What efforts cost is the same in both: only the ball's part says anything.
  const double h = problem.scene.simulation.dt;
  const double own = h * kEffortWeight * problem.effort;
  const double product = ((exact.array() - own) * (fixed.array() - own)).sum();
  return product > 0.0 ? Direction::kDown : product < 0.0 ? Direction::kUp : Direction::kNothing;
}

std::vector<Row> Run(const Scene& scene, const StudyOptions& options,
                     const std::function<void(long)>& progress) {
  std::vector<Row> rows(options.problems);
  std::mutex mutex;
  long done = 0;
  ForEachOnThreads(options.threads, options.problems, [&](int i) {
    const auto number = static_cast<unsigned>(options.first + i * options.stride);
    const Problem problem = Draw(scene, options.seed, number, options.pieces);
    for (const Method method : options.methods) {
      rows[i].outcomes[static_cast<size_t>(method)] =
          Solve(problem, method, options.iterations, options.starts);
    }
    rows[i].problem = problem;
    rows[i].problem.scene = Scene();
    rows[i].fixed = OfFixedGradient(problem);
    const std::lock_guard<std::mutex> lock(mutex);
    if (progress) progress(++done);
  });
  return rows;
}

}  // namespace tangible::bounce
