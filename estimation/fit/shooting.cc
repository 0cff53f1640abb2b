// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/shooting.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/elements/joint_coupling_inl.h"
#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/dynamics/model/state_variable.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/observed_state.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/math/median.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

constexpr int kIterationsPerStage = 30;
// Times of a segment with observations, on average, at least: from fewer than two positions no
// velocity is known.
constexpr int kTimesPerSegment = 2;
// Numbers of the states at the cuts of a run, at most: they are columns of a dense factorisation,
// which takes 2 · 1200² operations a row.
constexpr int kMostStateNumbers = 1200;

double MedianSigma(const std::vector<Observation>& observations) {
  std::vector<double> sigmas;
  sigmas.reserve(observations.size());
  for (const Observation& observation : observations) {
    sigmas.push_back(observation.sigma);
  }
  return UpperMedian(std::move(sigmas));
}

}  // namespace

/// One evaluation under way.
struct ShootingResiduals::Run {
  const Eigen::VectorXd* unknowns = nullptr;
  State<double> state;
  RowMatrixXd
      w_dot;  ///< variables x [parameters | state at the segment's start]; no rows: values only
  std::vector<double> samples;
  RowMatrixXd sample_derivatives;
  std::vector<int> segment_of_sample;
  Eigen::VectorXd* residuals = nullptr;
  RowMatrixXd* jacobian = nullptr;
};

int MostSegments(const RolloutResiduals& residuals) {
  if (residuals.NeedsWholeRun()) return 1;
  std::vector<double> times;
  times.reserve(residuals.observations().size());
  for (const Observation& observation : residuals.observations()) {
    times.push_back(observation.time);
  }
  std::sort(times.begin(), times.end());
  const auto distinct = std::unique(times.begin(), times.end()) - times.begin();
  const int state_size = 6 * residuals.scene().model().structure->num_blocks();
  const long most =
      std::min({static_cast<long>(distinct) / kTimesPerSegment,
                1L + kMostStateNumbers / std::max(1, state_size), residuals.plan().last_step()});
  return static_cast<int>(std::max(1L, most));
}

ShootingResiduals::ShootingResiduals(int segments, RolloutResiduals* residuals)
    : residuals_(residuals) {
  const ParameterizedScene& scene = residuals->scene();
  const long last = std::max(1L, residuals->plan().last_step());
  const long count = std::min(segments, MostSegments(*residuals));
  for (long j = 0; j <= count; ++j) {
    cuts_.push_back(last * j / count);
  }
  num_parameters_ = scene.size();
  variables_ = OutputVariables(*scene.model().structure);
  state_size_ = static_cast<int>(variables_.size());
  segment_seconds_ = StepTime(scene.scene().simulation, last) / static_cast<double>(count);
}

int ShootingResiduals::num_observations() const { return residuals_->num_residuals(); }

double ShootingResiduals::JumpWeight(int i) const {
  return (i % 6 < 3 ? 1.0 : segment_seconds_) / jump_sigma_;
}

bool ShootingResiduals::StatesOfRun(const Eigen::VectorXd& p, Eigen::VectorXd* states) {
  states->setZero(num_states());
  if (!residuals_->SetParameters(p)) {
    return false;
  }
  const Model<double>& model = residuals_->scene().model();
  State<double> final;
  int segment = 1;
  const StateObserver keep = [&](long k, double, const State<double>& state, Stepper*) {
    if (segment >= num_segments() || k != cuts_[segment]) {
      return;
    }
    for (int i = 0; i < state_size_; ++i) {
      (*states)[(segment - 1) * state_size_ + i] = StateNumber(state, variables_[i]);
    }
    ++segment;
  };
  return Rollout(model, residuals_->scene().initial_state(), keep, &final).status ==
         StepStatus::kDone;
}

void ShootingResiduals::StatesFromObservations(const Eigen::VectorXd& p, Eigen::VectorXd* states) {
  const ParameterizedScene& scene = residuals_->scene();
  const bool runs = StatesOfRun(p, states);
  State<double> state = scene.initial_state();
  for (int segment = 1; segment < num_segments(); ++segment) {
    const Eigen::Index first = static_cast<Eigen::Index>(segment - 1) * state_size_;
    for (int i = 0; i < state_size_ && runs; ++i) {
      StateNumber(&state, variables_[i]) = (*states)[first + i];
    }
    // Where the run fails the state before it is the best known approximation.
    const double time = StepTime(scene.scene().simulation, cuts_[segment]);
    state = StateFromObservations(*residuals_, time, state);
    for (int i = 0; i < state_size_; ++i) {
      (*states)[first + i] = StateNumber(state, variables_[i]);
    }
  }
}

void ShootingResiduals::AddShares(int segment, long k, const State<double>& state, Run* run) const {
  const SamplePlan& plan = residuals_->plan();
  const ModelStructure& structure = *residuals_->scene().model().structure;
  for (const StateShare& share : plan.numbers().At(k)) {
    const int sample = share.row / plan.width();
    // At a cut, samples that began before it use the end of the segment, and those after it the
    // start of the next one.
    const bool begins_here = plan.samples()[sample].step == k;
    const bool at_end = k == cuts_[segment + 1] && segment + 1 < num_segments();
    if (begins_here ? at_end : k == cuts_[segment]) {
      continue;
    }
    run->segment_of_sample[sample] = segment;
    share.Add(state, run->samples.data());
    if (run->jacobian != nullptr) {
      share.AddTangent(structure, run->w_dot, &run->sample_derivatives);
    }
  }
}

bool ShootingResiduals::RunSegment(int segment, Run* run) {
  const Model<double>& model = residuals_->scene().model();
  Stepper stepper(model);
  const StepRange steps{cuts_[segment], cuts_[segment + 1]};
  const auto add = [&](long k, double, const State<double>& state, const auto&) {
    AddShares(segment, k, state, run);
  };
  const RolloutReport report =
      run->jacobian == nullptr
          ? Rollout(model, run->state, add, &stepper, &run->state, steps)
          : RolloutTangent(model, run->state, {}, add, &stepper, &run->w_dot, &run->state, steps);
  return report.status == StepStatus::kDone;
}

/// Adds the jump at the end of a segment and sets the start of the next one: moving bodies get its
/// own state, everything else continues.
void ShootingResiduals::Meet(int segment, Run* run) const {
  const int first_row = num_observations() + segment * state_size_;
  const int own = num_parameters_ + (segment - 1) * state_size_;
  const int next = num_parameters_ + segment * state_size_;
  for (int i = 0; i < state_size_; ++i) {
    const double weight = JumpWeight(i);
    double& number = StateNumber(&run->state, variables_[i]);
    (*run->residuals)[first_row + i] = weight * (number - (*run->unknowns)[next + i]);
    number = (*run->unknowns)[next + i];
    if (run->jacobian == nullptr) {
      continue;
    }
    auto row = run->jacobian->row(first_row + i);
    const auto dots = run->w_dot.row(variables_[i]);
    row.head(num_parameters_) = weight * dots.head(num_parameters_);
    if (segment > 0) {
      row.segment(own, state_size_) = weight * dots.tail(state_size_);
    }
    row[next + i] = -weight;
  }
  if (run->jacobian != nullptr) {
    run->w_dot.rightCols(state_size_).setZero();
    for (int i = 0; i < state_size_; ++i) {
      run->w_dot.row(variables_[i]).setZero();
      run->w_dot(variables_[i], num_parameters_ + i) = 1.0;
    }
  }
}

int ShootingResiduals::num_joint_rows() const {
  return 6 * static_cast<int>(residuals_->scene().model().structure->joints.size());
}

/// Errors and rates of the joints at the start of the segment after this one.
void ShootingResiduals::AddJoints(int segment, Run* run) const {
  int row = num_observations() + num_states() + segment * num_joint_rows();
  for (const JointIndex& joint : residuals_->scene().model().structure->joints) {
    const bool ends = IsReleased(*residuals_->scene().model().structure, run->state, joint);
    for (int k = 0; k < (joint.IsCoupling() ? 2 : 1) && !ends; ++k) {
      AddJointShare(joint, k, segment, row, run);
    }
    row += 6;
  }
}

/// Those of one joint, or the share that coordinate k of a coupling has in them.
void ShootingResiduals::AddJointShare(const JointIndex& joint, int k, int segment, int row,
                                      Run* run) const {
  const Model<double>& model = residuals_->scene().model();
  const ModelStructure& s = *model.structure;
  const State<double>& state = run->state;
  const JointIndex& of = joint.IsCoupling() ? s.joints[joint.coupled[k]] : joint;
  int variables[kLocalJetWidth];
  LocalJet local[kLocalJetWidth];
  for (int i = 0; i < 6; ++i) {
    const int body = i < 3 ? of.a : of.b;
    variables[i] = s.PoseVariable(body, i % 3);
    local[i] = LocalJet(state.pose[3 * static_cast<size_t>(body) + i % 3], i);
  }
  int count = 6;
  const auto number = [&](int place) {
    variables[count] = s.ParameterVariable(place);
    local[count] = LocalJet(model.parameters[place], count);
    ++count;
  };
  for (int i = 0; i < of.num_geometry; ++i) number(of.geometry + i);
  JointRows<LocalJet> rows;
  EvaluateJoint(of.type, Pose<LocalJet>(Vector2<LocalJet>(local[0], local[1]), local[2]),
                Pose<LocalJet>(Vector2<LocalJet>(local[3], local[4]), local[5]), local + 6, &rows);
  if (joint.IsCoupling()) {
    number(joint.geometry + (k == 0 ? 1 : 0));
    const LocalJet numbers[2] = {local[count - 1], local[count - 1]};
    ScaleToShare(joint.type, k, numbers, &rows);
  }
  for (int r = 0; r < rows.rows; ++r) {
    LocalJet rate(0.0);
    Eigen::RowVectorXd by_twist = Eigen::RowVectorXd::Zero(run->w_dot.cols());
    for (int i = 0; i < 6; ++i) {
      const int body = i < 3 ? of.a : of.b;
      const LocalJet& entry = i < 3 ? rows.row_a[r][i] : rows.row_b[r][i - 3];
      rate += entry * state.twist[3 * static_cast<size_t>(body) + i % 3];
      if (run->jacobian != nullptr) {
        by_twist += entry.a * run->w_dot.row(s.TwistVariable(body, i % 3));
      }
    }
    const LocalJet* const values[2] = {&rows.error[r], &rate};
    for (int m = 0; m < 2; ++m) {
      const double weight = (m == 0 ? 1.0 : segment_seconds_) / joint_sigma_;
      const int at = row + 2 * r + m;
      (*run->residuals)[at] = weight * values[m]->a + (k == 0 ? 0.0 : (*run->residuals)[at]);
      if (run->jacobian == nullptr) {
        continue;
      }
      Eigen::RowVectorXd dots =
          m == 0 ? Eigen::RowVectorXd::Zero(run->w_dot.cols()).eval() : by_twist;
      for (int v = 0; v < count; ++v) {
        dots += values[m]->v[v] * run->w_dot.row(variables[v]);
      }
      auto out = run->jacobian->row(at);
      auto of_state = out.segment(num_parameters_ + segment * state_size_, state_size_);
      if (k == 0) {
        out.head(num_parameters_).setZero();
        of_state.setZero();
      }
      out.head(num_parameters_) += weight * dots.head(num_parameters_);
      of_state += weight * dots.tail(state_size_);
    }
  }
}

bool ShootingResiduals::Evaluate(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals,
                                 RowMatrixXd* jacobian) {
  if (!residuals_->SetParameters(unknowns.head(num_parameters_))) {
    return false;
  }
  const ParameterizedScene& scene = residuals_->scene();
  const Eigen::Index num_samples = residuals_->plan().num_samples();
  Run run;
  run.unknowns = &unknowns;
  run.state = scene.initial_state();
  const int width = residuals_->plan().width();
  run.samples.assign(static_cast<size_t>(width * num_samples), 0.0);
  run.segment_of_sample.assign(static_cast<size_t>(num_samples), 0);
  run.residuals = residuals;
  run.jacobian = jacobian;
  residuals->setZero(num_residuals());
  if (jacobian != nullptr) {
    jacobian->setZero(num_residuals(), num_unknowns());
    run.w_dot.setZero(scene.model().structure->num_variables(), num_parameters_ + state_size_);
    run.w_dot.leftCols(num_parameters_) = scene.VariableDerivatives();
    run.sample_derivatives.setZero(width * num_samples, num_parameters_ + state_size_);
  }
  for (int segment = 0; segment < num_segments(); ++segment) {
    if (!RunSegment(segment, &run)) {
      return false;
    }
    if (segment + 1 < num_segments()) {
      Meet(segment, &run);
      AddJoints(segment, &run);
    }
  }
  residuals->head(num_observations()) = residuals_->FromSamples(run.samples);
  if (jacobian != nullptr) {
    Scatter(run);
  }
  return residuals->allFinite() && (jacobian == nullptr || jacobian->allFinite());
}

void ShootingResiduals::Scatter(const Run& run) const {
  const RowMatrixXd local = residuals_->FromSampleDerivatives(
      run.samples, {}, run.sample_derivatives, Eigen::VectorXd::Ones(num_parameters_));
  for (int i = 0; i < num_observations(); ++i) {
    auto row = run.jacobian->row(i);
    row.head(num_parameters_) = local.row(i).head(num_parameters_);
    const int segment = run.segment_of_sample[residuals_->plan().sample_of()[i]];
    if (segment > 0) {
      row.segment(num_parameters_ + (segment - 1) * state_size_, state_size_) =
          local.row(i).tail(state_size_);
    }
  }
}

ShootingProblem::ShootingProblem(int segments, RecordingsProblem* problem)
    : problem_(problem), effects_(problem->effects()) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  entries_.assign(entries.begin(), entries.begin() + num_shared());
  for (int block = 0; block < num_blocks(); ++block) {
    runs_.emplace_back(segments, problem->run(block));
    median_sigma_.push_back(MedianSigma(problem->run(block)->observations()));
    const int before = num_shared() + block * problem->num_own(block);
    const int shift = static_cast<int>(entries_.size()) - before;
    for (RandomEffect& effect : effects_) {
      effect.own[block] += shift;
    }
    const auto own = entries.begin() + before;
    entries_.insert(entries_.end(), own, own + problem->num_own(block));
    const ParameterEntry state{"a state between segments", 0.0, -HUGE_VAL, HUGE_VAL};
    entries_.insert(entries_.end(), static_cast<size_t>(runs_.back().num_states()), state);
  }
}

bool ShootingProblem::Start(const Eigen::VectorXd& p, Eigen::VectorXd* unknowns) {
  const BlockLayout layout(*this);
  unknowns->resize(layout.num_parameters());
  unknowns->head(num_shared()) = p.head(num_shared());
  bool any = false;
  for (int block = 0; block < num_blocks(); ++block) {
    const int own = problem_->num_own(block);
    Eigen::VectorXd states;
    runs_[block].StatesFromObservations(problem_->ParametersOf(block, p), &states);
    unknowns->segment(layout.own_offset(block), own) = p.segment(num_shared() + block * own, own);
    unknowns->segment(layout.own_offset(block) + own, states.size()) = states;
    any = any || states.size() > 0;
  }
  return any;
}

Eigen::VectorXd ShootingProblem::ParametersOf(const Eigen::VectorXd& unknowns) const {
  const BlockLayout layout(*this);
  Eigen::VectorXd p(static_cast<Eigen::Index>(problem_->entries().size()));
  p.head(num_shared()) = unknowns.head(num_shared());
  for (int block = 0; block < num_blocks(); ++block) {
    const int own = problem_->num_own(block);
    p.segment(num_shared() + block * own, own) = unknowns.segment(layout.own_offset(block), own);
  }
  return p;
}

void ShootingProblem::SetJumpSigma(double sigma) {
  for (size_t block = 0; block < runs_.size(); ++block) {
    runs_[block].SetJumpSigma(sigma * median_sigma_[block]);
    runs_[block].SetJointSigma(kOnJoints * median_sigma_[block]);
  }
}

bool ShootingProblem::EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod /*method*/,
                                    BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  ShootingResiduals& run = runs_[block];
  const Eigen::Index states = run.num_states();
  const Eigen::VectorXd ordered = problem_->Ordered(p.head(p.size() - states));
  const Eigen::Index parameters = ordered.size();
  Eigen::VectorXd unknowns(parameters + states);
  unknowns << ordered, p.tail(states);
  const bool with_jacobian = derivatives == BlockDerivatives::kCompute;
  RowMatrixXd jacobian;
  evaluation->rollouts = 1;
  if (!run.Evaluate(unknowns, &evaluation->residuals, with_jacobian ? &jacobian : nullptr)) {
    evaluation->message = "a segment's run fails";
    return false;
  }
  if (with_jacobian) {
    const std::vector<int>& order = problem_->order();
    evaluation->jacobian.setZero(jacobian.rows(), p.size());
    evaluation->jacobian.rightCols(states) = jacobian.rightCols(states);
    for (size_t k = 0; k < order.size(); ++k) {
      if (order[k] >= 0) {
        evaluation->jacobian.col(static_cast<Eigen::Index>(k)) = jacobian.col(order[k]);
      }
    }
  }
  return true;
}

namespace {

/// The cost of the whole runs at p; infinite where one fails.
double CostOfRuns(const FitOptions& options, const Eigen::VectorXd& p, RecordingsProblem* problem,
                  long* rollouts) {
  Linearizer linearizer(problem, options.derivatives, options.threads, nullptr);
  Eigen::VectorXd blocks;
  double cost = 0.0;
  const bool done = linearizer.Cost(ToInternal(problem->entries(), p),
                                    {options.huber, options.huber}, &blocks, &cost);
  *rollouts += linearizer.rollouts();
  return done ? cost : HUGE_VAL;
}

/// What to say where runs are cut into fewer segments than was asked for; else empty.
std::string FewerSegments(int segments, RecordingsProblem* problem) {
  int most = segments;
  for (int block = 0; block < problem->num_blocks(); ++block) {
    most = std::min(most, MostSegments(*problem->run(block)));
  }
  return most == segments
             ? ""
             : "only " + std::to_string(most) + " of " + std::to_string(segments) + " segments" +
                   (problem->num_blocks() > 1 ? " in the shortest recording" : "") +
                   ": each needs observations at " + std::to_string(kTimesPerSegment) +
                   " times, and all states at cuts may have " + std::to_string(kMostStateNumbers) +
                   " numbers";
}

}  // namespace

FitApproachResult Shoot(const FitOptions& options, const Eigen::VectorXd& start,
                        RecordingsProblem* problem, EvaluationLog* log) {
  FitApproachResult result{start};
  ShootingProblem shooting(options.segments, problem);
  Eigen::VectorXd x;
  result.message = FewerSegments(options.segments, problem);
  if (!shooting.Start(start, &x)) {
    return result;
  }
  FitOptions stage_options = options;
  stage_options.max_iterations = kIterationsPerStage;
  double least = HUGE_VAL;
  for (const double stage : kJumpSigmas) {
    shooting.SetJumpSigma(stage);
    ProblemWithPriors with_priors(&shooting, shooting.effects());
    const Minimum minimum = Minimise(
        stage_options, x, [] { return 0.0; }, {}, &with_priors, log);
    result.rollouts += minimum.rollouts;
    if (minimum.status == FitStatus::kFailed || !std::isfinite(minimum.cost)) {
      result.message += std::string(result.message.empty() ? "" : "; ") +
                        "multiple shooting ended early: " + minimum.message;
      return result;
    }
    x = minimum.parameters;
    result.iterations += std::max(0, static_cast<int>(minimum.iterations.size()) - 1);
    // If the high cost of jumps traps the minimiser, the stage before it may be nearer to the
    // optimum.
    const Eigen::VectorXd p = shooting.ParametersOf(x);
    const double cost = CostOfRuns(options, p, problem, &result.rollouts);
    if (cost < least || least == HUGE_VAL) {
      result.parameters = p;
      least = cost;
    }
  }
  return result;
}

}  // namespace tangible
