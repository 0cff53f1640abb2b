// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/shooting.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/problem/cost_function.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"

namespace tangible {
namespace {

// Standard deviations of the jumps, stage by stage, in multiples of the observations' median sigma.
constexpr double kStages[] = {1e3, 30.0, 1.0};
constexpr int kIterationsPerStage = 30;
// Of the cost: a stage only has to lead to the next.
constexpr double kStageTolerance = 1e-6;

/// The unknown numbers of a moving body's state in the rows of w = [poses | twists | parameters].
int StateRow(const ModelStructure& s, int i) {
  const int body = s.moving[i / 6];
  const int component = i % 6;
  return component < 3 ? s.PoseVariable(body, component) : s.TwistVariable(body, component - 3);
}

double& StateNumber(const ModelStructure& s, int i, State<double>* state) {
  const int component = i % 6;
  const size_t body = static_cast<size_t>(s.moving[i / 6]);
  return component < 3 ? state->pose[3 * body + component] : state->twist[3 * body + component - 3];
}

double MedianSigma(const std::vector<Observation>& observations) {
  std::vector<double> sigmas;
  sigmas.reserve(observations.size());
  for (const Observation& observation : observations) {
    sigmas.push_back(observation.sigma);
  }
  std::nth_element(sigmas.begin(), sigmas.begin() + sigmas.size() / 2, sigmas.end());
  return sigmas[sigmas.size() / 2];
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

ShootingResiduals::ShootingResiduals(int segments, RolloutResiduals* residuals)
    : residuals_(residuals) {
  const ParameterizedScene& scene = residuals->scene();
  const long last = std::max(1L, residuals->plan().last_step());
  const long count = std::min<long>(segments, last);
  for (long j = 0; j <= count; ++j) {
    cuts_.push_back(last * j / count);
  }
  num_parameters_ = scene.size();
  state_size_ = 6 * scene.model().structure->num_blocks();
  segment_seconds_ = StepTime(scene.scene().simulation, last) / static_cast<double>(count);
}

int ShootingResiduals::num_observations() const { return residuals_->num_residuals(); }

double ShootingResiduals::JumpWeight(int i) const {
  return (i % 6 < 3 ? 1.0 : segment_seconds_) / jump_sigma_;
}

bool ShootingResiduals::Start(const Eigen::VectorXd& q, Eigen::VectorXd* unknowns) {
  unknowns->resize(num_unknowns());
  unknowns->head(num_parameters_) = q;
  if (!residuals_->SetParameters(ToParameters(residuals_->entries(), q))) {
    return false;
  }
  residuals_->CountRollout();
  const Model<double>& model = residuals_->scene().model();
  State<double> final;
  int segment = 1;
  const StateObserver keep = [&](long k, double, const State<double>& state, Stepper*) {
    if (segment >= num_segments() || k != cuts_[segment]) {
      return;
    }
    State<double> copy = state;
    for (int i = 0; i < state_size_; ++i) {
      (*unknowns)[num_parameters_ + (segment - 1) * state_size_ + i] =
          StateNumber(*model.structure, i, &copy);
    }
    ++segment;
  };
  return Rollout(model, residuals_->scene().initial_state(), keep, &final).status ==
         StepStatus::kDone;
}

void ShootingResiduals::AddShares(int segment, long k, Run* run) const {
  const SamplePlan& plan = residuals_->plan();
  for (const SampleShare& share : plan.SharesAt(k)) {
    const Sample& sample = plan.samples()[share.sample];
    // At a cut the end of one segment serves samples that began before it, the start of the next
    // those after.
    const bool begins_here = sample.step == k;
    const bool at_end = k == cuts_[segment + 1] && segment + 1 < num_segments();
    if (begins_here ? at_end : k == cuts_[segment]) {
      continue;
    }
    run->segment_of_sample[share.sample] = segment;
    const int width = plan.width();
    const ModelStructure& structure = *residuals_->scene().model().structure;
    for (int i = 0; i < width; ++i) {
      const std::vector<double>& numbers = i < 3 ? run->state.pose : run->state.twist;
      run->samples[static_cast<size_t>(width) * share.sample + i] +=
          share.weight * numbers[3 * static_cast<size_t>(sample.body) + i % 3];
      if (run->jacobian != nullptr) {
        const int row = i < 3 ? structure.PoseVariable(sample.body, i)
                              : structure.TwistVariable(sample.body, i - 3);
        run->sample_derivatives.row(width * share.sample + i) += share.weight * run->w_dot.row(row);
      }
    }
  }
}

bool ShootingResiduals::RunSegment(int segment, Run* run) {
  const Model<double>& model = residuals_->scene().model();
  const SimulationSettings& settings = model.structure->settings;
  Stepper stepper(model);
  StepTangent tangent;
  AddShares(segment, cuts_[segment], run);
  for (long k = cuts_[segment]; k < cuts_[segment + 1]; ++k) {
    const StepReport report =
        stepper.Step(model, StepTime(settings, k), StepLength(settings, k), &run->state);
    if (report.status != StepStatus::kDone) {
      return false;
    }
    if (run->jacobian != nullptr) {
      tangent.Apply(model, &stepper, &run->w_dot);
    }
    AddShares(segment, k + 1, run);
  }
  return true;
}

/// The jump at the end of a segment; then the next segment's start: its own state for moving
/// bodies, all else goes on.
void ShootingResiduals::Meet(int segment, Run* run) const {
  const ModelStructure& structure = *residuals_->scene().model().structure;
  const int first_row = num_observations() + segment * state_size_;
  const int own = num_parameters_ + (segment - 1) * state_size_;
  const int next = num_parameters_ + segment * state_size_;
  for (int i = 0; i < state_size_; ++i) {
    const double weight = JumpWeight(i);
    double& number = StateNumber(structure, i, &run->state);
    (*run->residuals)[first_row + i] = weight * (number - (*run->unknowns)[next + i]);
    number = (*run->unknowns)[next + i];
    if (run->jacobian == nullptr) {
      continue;
    }
    auto row = run->jacobian->row(first_row + i);
    const auto dots = run->w_dot.row(StateRow(structure, i));
    row.head(num_parameters_) = weight * dots.head(num_parameters_);
    if (segment > 0) {
      row.segment(own, state_size_) = weight * dots.tail(state_size_);
    }
    row[next + i] = -weight;
  }
  if (run->jacobian != nullptr) {
    run->w_dot.rightCols(state_size_).setZero();
    for (int i = 0; i < state_size_; ++i) {
      const int row = StateRow(structure, i);
      run->w_dot.row(row).setZero();
      run->w_dot(row, num_parameters_ + i) = 1.0;
    }
  }
}

bool ShootingResiduals::Evaluate(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals,
                                 RowMatrixXd* jacobian) {
  return residuals_->Logged(
      unknowns,
      [&](Eigen::VectorXd* computed, RowMatrixXd* derivatives) {
        return Compute(unknowns, computed, derivatives);
      },
      residuals, jacobian);
}

bool ShootingResiduals::Compute(const Eigen::VectorXd& unknowns, Eigen::VectorXd* residuals,
                                RowMatrixXd* jacobian) {
  const Eigen::VectorXd q = unknowns.head(num_parameters_);
  const ParameterizedScene& scene = residuals_->scene();
  if (!residuals_->SetParameters(ToParameters(scene.entries(), q))) {
    return false;
  }
  residuals_->CountRollout();
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
    run.w_dot.leftCols(num_parameters_) =
        scene.VariableDerivatives() *
        ParametersByInternal(scene.entries(), ToParameters(scene.entries(), q)).asDiagonal();
    run.sample_derivatives.setZero(width * num_samples, num_parameters_ + state_size_);
  }
  for (int segment = 0; segment < num_segments(); ++segment) {
    if (!RunSegment(segment, &run)) {
      return false;
    }
    if (segment + 1 < num_segments()) {
      Meet(segment, &run);
    }
  }
  residuals->head(num_observations()) = residuals_->FromSamples(run.samples);
  if (jacobian != nullptr) {
    Scatter(run);
  }
  return residuals->allFinite() && (jacobian == nullptr || jacobian->allFinite());
}

void ShootingResiduals::Scatter(const Run& run) const {
  const ParameterizedScene& scene = residuals_->scene();
  const RowMatrixXd local = residuals_->FromSampleDerivatives(
      run.samples, {}, run.sample_derivatives,
      ParametersByInternal(scene.entries(),
                           ToParameters(scene.entries(), run.unknowns->head(num_parameters_))));
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

namespace {

/// Minimises with the jumps' sigma as set; false, with a message, where Ceres finds no point to go
/// on from.
bool SolveStage(const FitOptions& options, const ParameterizedScene& scene,
                ShootingResiduals* shooting, Eigen::VectorXd* x, ShootingResult* result) {
  SharedEvaluation shared(
      [shooting](const Eigen::VectorXd& at, Eigen::VectorXd* values, RowMatrixXd* jacobian) {
        return shooting->Evaluate(at, values, jacobian);
      },
      x);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &shared;
  ceres::Problem problem(problem_options);
  for (int i = 0; i < shooting->num_residuals(); ++i) {
    const bool robust = options.huber > 0.0 && i < shooting->num_observations();
    problem.AddResidualBlock(new CoordinateCostFunction(&shared, i, shooting->num_unknowns()),
                             robust ? new ceres::HuberLoss(options.huber) : nullptr, x->data());
  }
  SetInternalBounds(scene.entries(), 0, scene.size(), &problem, x->data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = kIterationsPerStage;
  solver.function_tolerance = kStageTolerance;
  solver.max_num_consecutive_invalid_steps = 20;
  solver.line_search_interpolation_type = ceres::QUADRATIC;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    result->message = "multiple shooting: " + summary.message;
    return false;
  }
  result->iterations += static_cast<int>(summary.iterations.size()) - 1;
  result->parameters = ToParameters(scene.entries(), x->head(scene.size()));
  shared.PrepareForEvaluation(false, true);
  const Eigen::Index jumps = shared.values().size() - shooting->num_observations();
  result->jump = jumps > 0 ? shared.values().tail(jumps).cwiseAbs().maxCoeff() : 0.0;
  return true;
}

}  // namespace

ShootingResult Shoot(const FitOptions& options, const Eigen::VectorXd& start,
                     RolloutResiduals* residuals) {
  ShootingResult result;
  result.parameters = start;
  ShootingResiduals shooting(options.segments, residuals);
  Eigen::VectorXd x;
  if (!shooting.Start(ToInternal(residuals->entries(), start), &x)) {
    result.message = "multiple shooting: the run at the initial values fails";
    return result;
  }
  const double sigma = MedianSigma(residuals->observations());
  for (const double stage : kStages) {
    shooting.SetJumpSigma(stage * sigma);
    if (!SolveStage(options, residuals->scene(), &shooting, &x, &result)) {
      return result;
    }
    result.jump *= stage;
  }
  return result;
}

}  // namespace tangible
