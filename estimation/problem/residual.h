// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The residuals of a run with respect to observations: one for each measured coordinate, never one
// for a trajectory,
//
//   r_i(p) = (predicted_i(p) − observed_i) / σ_i,        J = ∂r / ∂p   (observations x parameters)
//
// with J by any of five methods, which must agree (tests/estimation/problem/residual_test.cc):
//
//   tangent            forward mode with the step's own factorisation: one run, P columns
//   adjoint            reverse mode: one recorded run, reverse sweeps of 64 residuals
//   jet_implicit       Jets pushed through each step's factorisation, in passes
//   jet                Jets through every operation of the interior point: slow
//   finite_difference  central, step 6e-6 max(|p|, scale); one-sided of second order at a bound

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/problem/event_times.h"
#include "tangible/estimation/problem/force_rows.h"
#include "tangible/estimation/problem/least_squares.h"
#include "tangible/estimation/problem/measurement.h"
#include "tangible/estimation/problem/parameterized_scene.h"
#include "tangible/estimation/problem/process_noise.h"
#include "tangible/estimation/problem/sampling.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

/// The residuals of one run: a least-squares problem of one block without own parameters.
class RolloutResiduals : public LeastSquaresProblem {
 public:
  /// `scene` is the scene of the run, which ends at the last observation, or as the scene says
  /// where times of events are observed. Without `channels` all observations are made directly.
  RolloutResiduals(ParameterizedScene scene, std::vector<Observation> observations,
                   std::vector<Channel> channels = {});

  int num_residuals() const { return static_cast<int>(observations_.size()); }
  int num_parameters() const { return scene_.size(); }
  const ParameterizedScene& scene() const { return scene_; }
  const std::vector<Observation>& observations() const { return observations_; }
  /// The channels, indexed by Observation::channel.
  const std::vector<Channel>& channels() const { return channels_; }
  const Channel& ChannelOf(const Observation& observation) const {
    return channels_[observation.channel];
  }
  const SamplePlan& plan() const { return plan_; }
  /// Whether times of events are observed.
  bool HasEvents() const { return event_times_.num_rows() > 0; }
  /// Whether what is observed needs the whole run: an event's number counts from its start, an
  /// acceleration is that between two states, and a force that of a step.
  bool NeedsWholeRun() const {
    return HasEvents() || sample_options_.accelerations || forces_.num_rows() > 0;
  }
  /// Names of the observations' files, by Channel::file; empty where there are none.
  const std::vector<std::string>& files() const { return files_; }
  void SetFiles(std::vector<std::string> files) { files_ = std::move(files); }
  /// Adds random forces, for which the scene was made (WithNoiseForces); all derivatives are then
  /// those of the tangent. Nothing of the observations may need the whole run, no parameter may
  /// move their times, and the run must have steps.
  void SetNoise(const std::vector<NoiseTerm>& terms) { noise_.emplace(terms, *this); }
  /// Lets the forces that another run of the same scene has found act in this one, whose
  /// residuals are then made without derivatives alone.
  void Follow(const RolloutResiduals& other) { followed_ = other.noise()->Found(other); }
  const ProcessNoise* noise() const { return noise_ ? &*noise_ : nullptr; }
  ProcessNoise* noise() { return noise_ ? &*noise_ : nullptr; }

  const std::vector<ParameterEntry>& entries() const override { return scene_.entries(); }
  int num_shared() const override { return num_parameters(); }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int block) const override {
    return num_residuals() + num_noise_rows(block) + num_slope_rows(block);
  }
  int num_observation_rows(int /*block*/) const override { return num_residuals(); }
  int num_noise_rows(int /*block*/) const override { return noise_ ? noise_->num_rows() : 0; }
  int num_slope_rows(int /*block*/) const override { return noise_ ? noise_->num_slope_rows() : 0; }
  void SetHuber(double huber) override {
    if (noise_) noise_->SetHuber(huber);
  }
  std::vector<RowPlace> Places(int block) const override;
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override;
  std::optional<Certificate> Certify(const Eigen::VectorXd& p) override;
  void AddRadii(const Eigen::VectorXd& p, Certificate* certificate) override;
  HeldColumns EvaluateHeld(int block, const Eigen::VectorXd& p, GradientMethod method,
                           int most) override;
  std::vector<std::string> FindInconsistencies(const Eigen::VectorXd& p) override;
  std::unique_ptr<LeastSquaresProblem> Window(double part) const override;
  std::unique_ptr<LeastSquaresProblem> Released(const std::string& path) const override;
  /// The same as residuals; none where the number cannot be a parameter.
  std::optional<RolloutResiduals> With(const std::string& path) const;
  /// The residuals of the observations in the first `part` of the time.
  RolloutResiduals FirstPart(double part) const;

  /// The residuals of the observations at p and, unless `jacobian` is null, their derivatives by
  /// `method`. False where
  /// the run fails or p sets a number to a value that it may not take; message() says which.
  /// Deterministic: the same p gives the same bits.
  bool Evaluate(const Eigen::VectorXd& p, GradientMethod method, Eigen::VectorXd* residuals,
                RowMatrixXd* jacobian);
  const std::string& message() const { return message_; }

  /// Runs made so far, in double or Jets; a reverse sweep of the adjoint does not count.
  long rollouts() const { return rollouts_; }

  /// The values from which a fit begins, within the bounds.
  void SetInitial(const Eigen::VectorXd& p) { scene_.SetInitial(p); }
  /// `scale` may change only the sigma of the observations.
  void ScaleSigma(const std::function<void(std::vector<Observation>*)>& scale) {
    scale(&observations_);
  }

  /// Sets the parameters without a run; false where they set a number to a value that it may not
  /// take.
  bool SetParameters(const Eigen::VectorXd& p);

  /// What observation i would be with the bodies in this state of the scene's model.
  Prediction PredictionIn(int i, const State<double>& state) const;
  /// The bodies (−1: none) of an observation's places (measurement.h).
  std::array<int, kPlaces> BodiesOf(int i) const;

  /// Residuals from the samples, plan().width() numbers each.
  Eigen::VectorXd FromSamples(const std::vector<double>& samples) const;
  /// Their derivatives from those of the samples: width() rows for each sample, any number of
  /// columns, the first P of which belong to unknowns q with dp/dq = `p_by_q`. `rates` of the
  /// samples may be empty where no time depends on a parameter.
  RowMatrixXd FromSampleDerivatives(const std::vector<double>& samples,
                                    const std::vector<double>& rates,
                                    const RowMatrixXd& sample_derivatives,
                                    const Eigen::VectorXd& p_by_q) const;

 private:
  void NameSamplesOnImpacts(Certificate* certificate) const;
  /// Those of the samples, then the times of events, then forces.
  Eigen::Index num_sample_rows() const { return ForceRow(forces_.num_rows()); }
  Eigen::Index ForceRow(int row) const { return EventRow(event_times_.num_rows()) + row; }
  Eigen::Index EventRow(int row) const {
    return plan_.width() * static_cast<Eigen::Index>(plan_.num_samples()) + row;
  }
  void FinishEvents(const State<double>& final);
  template <typename VariableDot>
  void FinishEventDerivatives(Eigen::Index first, Eigen::Index count, const VariableDot& dot,
                              RowMatrixXd* rows) const;
  struct EventBars;
  void AddEventBars(int i, int loss, EventBars* bars) const;
  double EventFactor(int i) const;
  double RecordedTime(int i, double time) const;
  Eigen::RowVectorXd EventDirectTerm(int i, double time) const;
  std::vector<std::string> DescribeMissingEvents();
  /// Reads the forces that the step before the state after k steps has.
  void AddForces(long k, Stepper* stepper);
  /// The gain of what recorded a force.
  double GainOf(int i) const;
  double RecordedForce(int i, double force) const;
  Eigen::RowVectorXd ForceDirectTerm(int i, double force) const;
  bool Accept(const RolloutReport& report);
  bool WithNoise(const Eigen::VectorXd& p, Eigen::VectorXd* residuals, RowMatrixXd* jacobian);
  bool Plain();
  bool Tangent(RowMatrixXd* jacobian);
  bool Adjoint(RowMatrixXd* jacobian);
  void AdjointBlock(int first, int count, const RowMatrixXd& variables, RowMatrixXd* jacobian);
  bool FiniteDifferences(const Eigen::VectorXd& p, RowMatrixXd* jacobian);
  bool Jets(JetRoute route, RowMatrixXd* jacobian);
  template <int N>
  bool JetPass(int first, JetRoute route, RowMatrixXd* sample_derivatives);
  /// Updates the ends of steps and the samples for the times that the parameters give; false where
  /// a time is outside the run.
  bool UpdateTimes();
  bool FindTimes(std::vector<double>* times);
  /// Whether the observed value is a number of a sample without further computation, and which.
  /// This holds for most observations, and fits of many spend a tenth of their time here.
  bool IsDirect(int i) const;
  Eigen::Index DirectNumber(int i) const;
  Prediction PredictionOf(int i, const std::vector<double>& samples) const;
  Prediction PredictAt(int i, ObservedPlaces places) const;
  /// What a row of J owes to parameters that do not act by way of the run: places of points in
  /// their bodies, instruments.
  Eigen::RowVectorXd DirectTerm(int i, const Prediction& prediction,
                                const std::vector<double>& rates) const;

  ParameterizedScene scene_;
  SimulationSettings settings_;  ///< those of the scene
  std::vector<Observation> observations_;
  std::vector<Channel> channels_;
  std::vector<int> markers_;  ///< the body of the camera's marker of each channel, or −1
  SampleOptions sample_options_;
  SamplePlan plan_;
  EventTimes event_times_;
  ForceRows forces_;
  RowMatrixXd by_gravity_;  ///< d gravity / d p, where accelerations are observed
  std::vector<std::string> files_;
  std::optional<ProcessNoise> noise_;
  std::optional<FollowedForces> followed_;
  std::vector<double> samples_;  ///< plan_.width() numbers each
  std::vector<double> rates_;    ///< of these; empty without SampleOptions::rates
  RolloutTape tape_;
  std::string message_;
  long rollouts_ = 0;
};

}  // namespace tangible
