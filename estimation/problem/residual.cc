// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/residual.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/estimation/problem/consistency.h"
#include "tangible/scene/parameter.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"

namespace tangible {
namespace {

// Residuals in one sweep back. More columns share each step's local derivatives but leave the
// cache.
constexpr int kAdjointColumns = 64;

constexpr double kDifferenceStep = 6e-6;

// Of an observed value: a run's rounding and what its projections leave.
constexpr double kRounding = 1e-9;

/// Adds a state's share to the poses of its samples.
void AddShares(const SamplePlan& plan, long k, const std::vector<double>& pose,
               std::vector<double>* poses) {
  for (const SampleShare& share : plan.SharesAt(k)) {
    const int body = plan.samples()[share.sample].body;
    for (int i = 0; i < 3; ++i) {
      (*poses)[3 * static_cast<size_t>(share.sample) + i] += share.weight * pose[3 * body + i];
    }
  }
}

/// One parameter for each number of the scene that is not set.
std::vector<FitParameter> Candidates(const ParameterizedScene& scene) {
  Scene copy = scene.scene();
  const auto numbers = EnumerateNumbers(&copy);
  const std::vector<bool> set = scene.NumbersSet();
  std::vector<FitParameter> candidates;
  for (size_t i = 0; i < numbers.size(); ++i) {
    ParameterPath path;
    std::string error;
    if (set[i] || !ResolveParameter(copy, numbers[i].path, &path, &error) ||
        !IsAllowed(numbers[i].kind, *numbers[i].value)) {
      continue;
    }
    FitParameter candidate;
    candidate.name = numbers[i].path;
    candidate.sets = {{numbers[i].path}};
    candidates.push_back(candidate);
  }
  return candidates;
}

}  // namespace

RolloutResiduals::RolloutResiduals(ParameterizedScene scene, std::vector<Observation> observations)
    : scene_(std::move(scene)), observations_(std::move(observations)) {
  if (scene_.scene().simulation.stepping == Stepping::kEvent) {
    std::vector<double> times;
    for (const Observation& observation : observations_) {
      times.push_back(observation.time);
    }
    scene_.SplitSteps(times);
  }
  plan_ = SamplePlan(observations_, scene_.scene().simulation);
  scene_.Shorten(StepTime(scene_.scene().simulation, plan_.last_step()));
}

std::vector<RowPlace> RolloutResiduals::Places(int /*block*/) const {
  const ObservationSeries series = IndexSeries(observations_);
  std::vector<RowPlace> places;
  places.reserve(observations_.size());
  for (size_t i = 0; i < observations_.size(); ++i) {
    const Observation& observation = observations_[i];
    places.push_back({series.of[i], observation.time,
                      kRounding * std::abs(observation.value) / observation.sigma});
  }
  return places;
}

bool RolloutResiduals::EvaluateBlock(int /*block*/, const Eigen::VectorXd& p,
                                     DerivativeMethod method, BlockDerivatives derivatives,
                                     BlockEvaluation* evaluation) {
  const long before = rollouts_;
  const bool done =
      Compute(p, method, &evaluation->residuals,
              derivatives == BlockDerivatives::kCompute ? &evaluation->jacobian : nullptr);
  evaluation->message = message_;
  evaluation->rollouts = rollouts_ - before;
  return done;
}

// Along the parameters that set numbers of the scene.
std::optional<Certificate> RolloutResiduals::Certify(const Eigen::VectorXd& p) {
  if (!SetParameters(p)) {
    return std::nullopt;
  }
  std::vector<std::string> names;
  std::vector<double> sizes;
  for (const ParameterEntry& entry : scene_.entries()) {
    sizes.push_back(std::max(std::abs(p[static_cast<Eigen::Index>(names.size())]), entry.scale));
    names.push_back(entry.name);
  }
  return CertifyDerivative(scene_.model(), scene_.initial_state(), scene_.VariableDerivatives(),
                           names, sizes);
}

bool RolloutResiduals::Evaluate(const Eigen::VectorXd& p, DerivativeMethod method,
                                Eigen::VectorXd* residuals, RowMatrixXd* jacobian) {
  return Logged(
      p,
      [&](Eigen::VectorXd* computed, RowMatrixXd* derivatives) {
        return Compute(p, method, computed, derivatives);
      },
      residuals, jacobian);
}

bool RolloutResiduals::Logged(const Eigen::VectorXd& at, const EvaluationLog::Function& function,
                              Eigen::VectorXd* residuals, RowMatrixXd* jacobian) {
  return log_ == nullptr ? function(residuals, jacobian)
                         : log_->Evaluate(at, function, residuals, jacobian, &rollouts_, &message_);
}

bool RolloutResiduals::Compute(const Eigen::VectorXd& p, DerivativeMethod method,
                               Eigen::VectorXd* residuals, RowMatrixXd* jacobian) {
  if (!SetParameters(p)) {
    return false;
  }
  bool done = false;
  if (jacobian == nullptr) {
    done = Plain();
  } else if (method == DerivativeMethod::kTangent) {
    done = Tangent(jacobian);
  } else if (method == DerivativeMethod::kAdjoint) {
    done = Adjoint(jacobian);
  } else if (method == DerivativeMethod::kFiniteDifference) {
    done = FiniteDifferences(p, jacobian) && SetParameters(p) && Plain();
  } else {
    const bool implicit = method == DerivativeMethod::kJetImplicit;
    done = Plain() && Jets(implicit ? JetRoute::kImplicit : JetRoute::kUnrolled, jacobian);
  }
  if (!done) {
    return false;
  }
  *residuals = FromPoses(poses_);
  const bool finite = residuals->allFinite() && (jacobian == nullptr || jacobian->allFinite());
  if (!finite) {
    message_ = "a residual or its derivative is not finite";
  }
  return finite;
}

bool RolloutResiduals::SetParameters(const Eigen::VectorXd& p) {
  message_.clear();
  poses_.assign(3 * static_cast<size_t>(plan_.num_samples()), 0.0);
  if (scene_.Set(p)) {
    return true;
  }
  message_ = "a parameter sets a number to a value that it may not take";
  return false;
}

bool RolloutResiduals::Accept(const RolloutReport& report) {
  ++rollouts_;
  message_ = report.message;
  return report.status == StepStatus::kDone;
}

bool RolloutResiduals::Plain() {
  State<double> final;
  return Accept(Rollout(
      scene_.model(), scene_.initial_state(),
      [this](long k, double, const State<double>& state, Stepper*) {
        AddShares(plan_, k, state.pose, &poses_);
      },
      &final));
}

bool RolloutResiduals::Tangent(RowMatrixXd* jacobian) {
  RowMatrixXd w_dot = scene_.VariableDerivatives();
  RowMatrixXd pose_derivatives =
      RowMatrixXd::Zero(3 * static_cast<Eigen::Index>(plan_.num_samples()), num_parameters());
  State<double> final;
  const TangentObserver observer = [&](long k, double, const State<double>& state,
                                       const RowMatrixXd& dots) {
    AddShares(plan_, k, state.pose, &poses_);
    for (const SampleShare& share : plan_.SharesAt(k)) {
      const int body = plan_.samples()[share.sample].body;
      pose_derivatives.middleRows(3 * share.sample, 3) +=
          share.weight * dots.middleRows(3 * body, 3);
    }
  };
  if (!Accept(RolloutTangent(scene_.model(), scene_.initial_state(), observer, &w_dot, &final))) {
    return false;
  }
  *jacobian =
      FromPoseDerivatives(poses_, pose_derivatives, Eigen::VectorXd::Ones(num_parameters()));
  return true;
}

bool RolloutResiduals::Adjoint(RowMatrixXd* jacobian) {
  State<double> final;
  const StateObserver observer = [this](long k, double, const State<double>& state, Stepper*) {
    AddShares(plan_, k, state.pose, &poses_);
  };
  if (!Accept(tape_.Record(scene_.model(), scene_.initial_state(), Factorisations::kKeep, observer,
                           &final))) {
    return false;
  }
  const RowMatrixXd variables = scene_.VariableDerivatives();
  jacobian->resize(num_residuals(), num_parameters());
  for (int first = 0; first < num_residuals(); first += kAdjointColumns) {
    AdjointBlock(first, std::min(kAdjointColumns, num_residuals() - first), variables, jacobian);
  }
  return true;
}

void RolloutResiduals::AdjointBlock(int first, int count, const RowMatrixXd& variables,
                                    RowMatrixXd* jacobian) {
  // The losses that read each sample: (loss, derivative by the sample's pose).
  struct Reader {
    int loss;
    double by_pose[3];
  };
  std::vector<std::vector<Reader>> readers(plan_.num_samples());
  long last = 0;  // step that is read
  for (int i = 0; i < count; ++i) {
    const Observation& observation = observations_[first + i];
    const int sample = plan_.sample_of()[first + i];
    const Prediction prediction = PredictionOf(first + i, poses_);
    last = std::max(last, plan_.samples()[sample].step + 1);
    Reader reader{i, {}};
    for (int j = 0; j < 3; ++j) {
      reader.by_pose[j] = prediction.by_pose[j] / observation.sigma;
    }
    readers[sample].push_back(reader);
    jacobian->row(first + i) = PointTerm(observation, prediction);
  }
  const auto seed = [&](long k, RowMatrixXd* w_bar) {
    for (const SampleShare& share : plan_.SharesAt(k)) {
      const int body = plan_.samples()[share.sample].body;
      for (const Reader& reader : readers[share.sample]) {
        for (int j = 0; j < 3; ++j) {
          (*w_bar)(3 * body + j, reader.loss) += share.weight * reader.by_pose[j];
        }
      }
    }
  };
  RowMatrixXd w_bar;
  tape_.AdjointFrom(scene_.model(), last, count, seed, &w_bar);
  jacobian->middleRows(first, count) += w_bar.transpose() * variables;
}

bool RolloutResiduals::ResidualsAt(const Eigen::VectorXd& p, Eigen::VectorXd* residuals) {
  if (!SetParameters(p) || !Plain()) {
    return false;
  }
  *residuals = FromPoses(poses_);
  return true;
}

bool RolloutResiduals::FiniteDifferences(const Eigen::VectorXd& p, RowMatrixXd* jacobian) {
  jacobian->resize(num_residuals(), num_parameters());
  Eigen::VectorXd at[3];
  for (int k = 0; k < num_parameters(); ++k) {
    const ParameterizedScene::Entry& entry = scene_.entries()[k];
    const double h = kDifferenceStep * std::max(std::abs(p[k]), entry.scale);
    // Forward or backward where a central difference would leave the bounds.
    const double side = p[k] - h < entry.lower ? 1.0 : (p[k] + h > entry.upper ? -1.0 : 0.0);
    const double offsets[3] = {side == 0.0 ? -h : 0.0, side == 0.0 ? h : side * h, 2.0 * side * h};
    for (int i = 0; i < (side == 0.0 ? 2 : 3); ++i) {
      Eigen::VectorXd moved = p;
      moved[k] += offsets[i];
      if (!ResidualsAt(moved, &at[i])) {
        return false;
      }
    }
    if (side == 0.0) {
      jacobian->col(k) = (at[1] - at[0]) / (2.0 * h);
    } else {
      jacobian->col(k) = side * (-3.0 * at[0] + 4.0 * at[1] - at[2]) / (2.0 * h);
    }
  }
  return true;
}

Prediction RolloutResiduals::PredictionOf(int i, const std::vector<double>& poses) const {
  const Observation& observation = observations_[i];
  const Vector2<double> at =
      observation.point >= 0 ? scene_.points()[observation.point].at : Vector2<double>(0.0, 0.0);
  return Predict(observation.coordinate, &poses[3 * static_cast<size_t>(plan_.sample_of()[i])], at);
}

Eigen::RowVectorXd RolloutResiduals::PointTerm(const Observation& observation,
                                               const Prediction& prediction) const {
  Eigen::RowVectorXd term = Eigen::RowVectorXd::Zero(num_parameters());
  if (observation.point >= 0) {
    for (int axis = 0; axis < 2; ++axis) {
      term += prediction.by_at[axis] / observation.sigma *
              scene_.point_derivatives().row(2 * observation.point + axis);
    }
  }
  return term;
}

Eigen::VectorXd RolloutResiduals::FromPoses(const std::vector<double>& poses) const {
  Eigen::VectorXd residuals(num_residuals());
  for (int i = 0; i < num_residuals(); ++i) {
    residuals[i] = (PredictionOf(i, poses).value - observations_[i].value) / observations_[i].sigma;
  }
  return residuals;
}

RowMatrixXd RolloutResiduals::FromPoseDerivatives(const std::vector<double>& poses,
                                                  const RowMatrixXd& pose_derivatives,
                                                  const Eigen::VectorXd& p_by_q) const {
  RowMatrixXd jacobian(num_residuals(), pose_derivatives.cols());
  for (int i = 0; i < num_residuals(); ++i) {
    const Prediction prediction = PredictionOf(i, poses);
    jacobian.row(i).setZero();
    jacobian.row(i).head(num_parameters()) =
        PointTerm(observations_[i], prediction).cwiseProduct(p_by_q.transpose());
    for (int j = 0; j < 3; ++j) {
      jacobian.row(i) += prediction.by_pose[j] / observations_[i].sigma *
                         pose_derivatives.row(3 * plan_.sample_of()[i] + j);
    }
  }
  return jacobian;
}

HeldColumns RolloutResiduals::EvaluateHeld(int /*block*/, const Eigen::VectorXd& p,
                                           DerivativeMethod method, int most) {
  HeldColumns held;
  if (!SetParameters(p)) {
    return held;
  }
  const std::vector<FitParameter> candidates = Candidates(scene_);
  ParameterizedScene scene;
  ParameterError error;
  if (candidates.empty() || static_cast<int>(candidates.size()) > most ||
      !scene.Create(scene_.scene(), scene_.points(), candidates, &error)) {
    return held;
  }
  RolloutResiduals released(scene, observations_);
  Eigen::VectorXd values;
  if (released.Evaluate(scene.Initial(), method, &values, &held.columns)) {
    held.entries = scene.entries();
  }
  return held;
}

std::vector<std::string> RolloutResiduals::FindInconsistencies(const Eigen::VectorXd& p) {
  return SetParameters(p) ? FindInconsistentBodies(scene_.scene()) : std::vector<std::string>();
}

}  // namespace tangible
