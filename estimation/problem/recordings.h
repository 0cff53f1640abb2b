// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Recordings in one fit: a block each, with parameters that all share and parameters that each has
// for itself, such as where and how fast bodies start.
//
//   p = [p_s | p_0 | p_1 | ... ],   r_b = r_b(p_s, p_b)
//
// A parameter that varies from recording to recording has a value θ_b of each among p_b and, among
// p_s, the value μ around which they are spread, on which no observation depends
// (problem_with_priors.h). A recording has a scene, observations and parameters of the same names
// in the same order as the others. One run is the case of one recording, which needs no name.

#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/problem/residual.h"

namespace tangible {

/// Whose value a parameter is.
struct ParameterScope {
  enum class Kind {
    kShared,  ///< of all recordings
    kOwn,     ///< each has its own
    kVaries,  ///< each has its own, spread around a shared one
  };
  Kind kind = Kind::kShared;
  PriorKind distribution = PriorKind::kGaussian;  ///< of kVaries
  std::optional<double> spread;                   ///< of kVaries; none: it is estimated
};

struct RecordedRun {
  std::string name;     ///< empty: the only one, of which no message speaks
  double weight = 1.0;  ///< > 0
  RolloutResiduals residuals;
};

class RecordingsProblem : public LeastSquaresProblem {
 public:
  /// `scopes`: of each parameter of a recording.
  RecordingsProblem(std::vector<RecordedRun> recordings, std::vector<ParameterScope> scopes);
  /// One run.
  explicit RecordingsProblem(RolloutResiduals residuals);

  const std::vector<RecordedRun>& recordings() const { return recordings_; }
  RolloutResiduals* run(int recording) { return &recordings_[recording].residuals; }
  /// Whether recordings have names.
  bool IsNamed() const { return !recordings_.front().name.empty(); }
  /// Parameter i of a recording as an index in p.
  int ParameterOf(int recording, int i) const;
  /// The recording's parameters, in its order, out of p.
  Eigen::VectorXd ParametersOf(int recording, const Eigen::VectorXd& p) const;
  /// The same out of [shared | own].
  Eigen::VectorXd Ordered(const Eigen::VectorXd& local) const;
  /// Of each of [shared | own] the index in a recording's parameters; −1: a value μ.
  const std::vector<int>& order() const { return order_; }
  /// Of an index in p that in a recording's parameters, of a value μ too.
  int IndexInRecording(int k) const;
  /// Of an index in p its recording; −1: it is shared.
  int RecordingOf(int k) const;

  /// The parameters that vary, with their spreads; where they are estimated, as large as the
  /// parameter's typical magnitude, or 1 of its logarithm, until they are set.
  const std::vector<RandomEffect>& effects() const { return effects_; }
  /// Whether the spread of an effect is to be estimated.
  bool EstimatesSpread(int effect) const { return !scopes_[effect_parameters_[effect]].spread; }
  void SetSpread(int effect, double spread) { effects_[effect].spread = spread; }

  /// The values from which a fit begins, within the bounds.
  void SetInitial(const Eigen::VectorXd& p);

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return static_cast<int>(shared_.size()); }
  int num_blocks() const override { return static_cast<int>(recordings_.size()); }
  int num_own(int /*block*/) const override { return static_cast<int>(own_.size()); }
  int num_rows(int block) const override { return recordings_[block].residuals.num_rows(0); }
  int num_observation_rows(int block) const override {
    return recordings_[block].residuals.num_residuals();
  }
  int num_noise_rows(int block) const override {
    return recordings_[block].residuals.num_noise_rows(0);
  }
  int num_slope_rows(int block) const override {
    return recordings_[block].residuals.num_slope_rows(0);
  }
  void SetHuber(double huber) override;
  /// Whether there are random forces.
  bool HasNoise() const { return recordings_.front().residuals.noise() != nullptr; }
  double weight(int block) const override { return recordings_[block].weight; }
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
  std::string BlockName(int block) const override {
    return IsNamed() ? "recording '" + recordings_[block].name + "': " : "";
  }

 private:
  void AddEntries();
  void AddEffects();

  std::vector<RecordedRun> recordings_;
  std::vector<ParameterScope> scopes_;
  std::vector<int> shared_, own_;  ///< indices in a recording's parameters; those that vary in both
  std::vector<int> order_;
  std::vector<ParameterEntry> entries_;
  std::vector<RandomEffect> effects_;
  std::vector<int> effect_parameters_;  ///< indices in a recording's parameters
};

}  // namespace tangible
