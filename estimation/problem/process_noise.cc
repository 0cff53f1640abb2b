// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/process_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/model/state_variable.h"
#include "tangible/estimation/problem/residual.h"
#include "tangible/estimation/problem/tolerances.h"
#include "tangible/math/median.h"
#include "tangible/scene/parameter.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

// Runs to the least cost at given parameters, and halvings of a step on the way, at most.
constexpr int kMostRuns = 40;
constexpr int kMostHalvings = 8;

/// The name of the force of a term, which no force of a file can have.
std::string ForceName(size_t term, int end) {
  return "process noise " + std::to_string(term) + (end == 0 ? "" : " back");
}

int IndexOfBody(const Scene& scene, const std::string& name) {
  const auto at = std::find_if(scene.bodies.begin(), scene.bodies.end(),
                               [&](const BasicBody<double>& body) { return body.name == name; });
  return at == scene.bodies.end() ? -1 : static_cast<int>(at - scene.bodies.begin());
}

int IndexOfJoint(const Scene& scene, const std::string& name) {
  const auto at = std::find_if(scene.joints.begin(), scene.joints.end(),
                               [&](const BasicJoint<double>& joint) { return joint.name == name; });
  return at == scene.joints.end() ? -1 : static_cast<int>(at - scene.joints.begin());
}

/// Whether a joint's effort is a number, beside which the force acts; else, of a hinge, torques on
/// its two bodies do.
bool HasPlainEffort(const BasicJoint<double>& joint) {
  return !joint.effort_signal && !joint.effort_servo;
}

std::optional<NoiseFault> CheckTerm(const NoiseTerm& term, const Scene& scene) {
  const auto fault = [](const char* key, std::string what) {
    return NoiseFault{0, key, std::move(what)};
  };
  if (term.body.empty() == term.joint.empty()) {
    return fault("", std::string("expected one of body and joint, got ") +
                         (term.body.empty() ? "none" : "both"));
  }
  if (term.intensity && !(*term.intensity > 0.0 && std::isfinite(*term.intensity))) {
    return fault("intensity", "expected a number > 0 or \"estimate\"");
  }
  if (!(term.correlation_time >= 0.0 && std::isfinite(term.correlation_time))) {
    return fault("correlation_time", "expected a number >= 0");
  }
  if (!term.body.empty()) {
    const int body = IndexOfBody(scene, term.body);
    if (body < 0) return fault("body", "expected a body of the scene, got " + term.body);
    if (scene.bodies[body].motion != Motion::kMoving) {
      return fault("body", "expected a moving body, got " + term.body + ", which no force moves");
    }
    if (term.coordinate == NoiseCoordinate::kDisplacement) {
      return fault("coordinate", "expected x, y or angle of a body, got displacement");
    }
    return std::nullopt;
  }
  const int at = IndexOfJoint(scene, term.joint);
  if (at < 0) return fault("joint", "expected a joint of the scene, got " + term.joint);
  const BasicJoint<double>& joint = scene.joints[at];
  const bool slides = joint.type == JointType::kPrismatic;
  if (!slides && joint.type != JointType::kRevolute) {
    return fault("joint", "expected a revolute or prismatic joint, got " + term.joint);
  }
  if (term.coordinate != (slides ? NoiseCoordinate::kDisplacement : NoiseCoordinate::kAngle)) {
    return fault("coordinate", std::string("expected ") + (slides ? "displacement" : "angle") +
                                   " of this joint, got " + NameOf(term.coordinate));
  }
  if (slides && !HasPlainEffort(joint)) {
    return fault("joint", "expected a slider whose effort is a number, got " + term.joint +
                              ", whose effort is a file or servo");
  }
  return std::nullopt;
}

double SquareOf(double r, double huber) {
  const double size = std::abs(r);
  return huber > 0.0 && size > huber ? 2.0 * huber * size - huber * huber : r * r;
}

}  // namespace

const char* NameOf(NoiseCoordinate coordinate) {
  switch (coordinate) {
    case NoiseCoordinate::kX:
      return "x";
    case NoiseCoordinate::kY:
      return "y";
    case NoiseCoordinate::kAngle:
      return "angle";
    case NoiseCoordinate::kDisplacement:
      return "displacement";
  }
  return "";
}

std::string NameOf(const NoiseTerm& term) {
  return (term.body.empty() ? "joint '" + term.joint : "body '" + term.body) + "' " +
         NameOf(term.coordinate);
}

std::optional<NoiseFault> CheckNoise(const std::vector<NoiseTerm>& terms, const Scene& scene) {
  for (size_t i = 0; i < terms.size(); ++i) {
    std::optional<NoiseFault> fault = CheckTerm(terms[i], scene);
    for (size_t j = 0; j < i && !fault; ++j) {
      if (NameOf(terms[j]) == NameOf(terms[i])) {
        fault = NoiseFault{0, "", "expected each force once, got " + NameOf(terms[i]) + " twice"};
      }
    }
    if (fault) {
      fault->term = static_cast<int>(i);
      return fault;
    }
  }
  return std::nullopt;
}

std::string WhyNoNoise(const RolloutResiduals& run) {
  if (run.NeedsWholeRun()) {
    return "expected observed positions and velocities alone beside process_noise, got times of "
           "events, accelerations or forces";
  }
  if (run.scene().MovesTimes()) {
    return "expected no delay or clock as a parameter beside process_noise";
  }
  if (NumSteps(run.scene().model().structure->settings) < 1) {
    return "expected observations after the start beside process_noise";
  }
  Scene scene = run.scene().scene();
  const std::vector<bool> set = run.scene().NumbersSet();
  const auto numbers = EnumerateNumbers(&scene);
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (set[i] && numbers[i].path.rfind("forces/process noise ", 0) == 0) {
      return "expected parameters that set named forces alone beside process_noise, got one that "
             "sets all (forces/*)";
    }
  }
  return "";
}

Scene WithNoiseForces(const std::vector<NoiseTerm>& terms, const Scene& scene) {
  Scene driven = scene;
  const auto add = [&driven](size_t term, int end, int body) {
    BasicForce<double>& force = driven.forces.emplace_back();
    force.name = ForceName(term, end);
    force.body = body;
  };
  for (size_t i = 0; i < terms.size(); ++i) {
    if (!terms[i].body.empty()) {
      add(i, 0, IndexOfBody(scene, terms[i].body));
      continue;
    }
    const BasicJoint<double>& joint = scene.joints[IndexOfJoint(scene, terms[i].joint)];
    if (HasPlainEffort(joint)) continue;
    for (int end = 0; end < 2; ++end) {
      const int body = joint.bodies[end];
      if (body >= 0 && scene.bodies[body].motion == Motion::kMoving) add(i, end, body);
    }
  }
  return driven;
}

ProcessNoise::ProcessNoise(std::vector<NoiseTerm> terms, const RolloutResiduals& run)
    : terms_(std::move(terms)), intensities_(Eigen::VectorXd::Ones(num_terms())) {
  for (int i = 0; i < num_terms(); ++i) intensities_[i] = terms_[i].intensity.value_or(1.0);
  variables_ = OutputVariables(*run.scene().model().structure);
  FindNumbers(run);
  MakeKnots(run);
}

void ProcessNoise::FindNumbers(const RolloutResiduals& run) {
  const ModelStructure& s = *run.scene().model().structure;
  const auto add = [this](size_t term, int number, double sign) {
    numbers_.push_back(number);
    term_of_number_.push_back(static_cast<int>(term));
    sign_of_number_.push_back(sign);
  };
  for (size_t i = 0; i < terms_.size(); ++i) {
    for (const ForceIndex& force : s.forces) {  // at (2), force (2), torque
      for (int end = 0; end < 2; ++end) {
        if (force.name != ForceName(i, end)) continue;
        const int place = terms_[i].IsTorque() ? 4 : 2 + static_cast<int>(terms_[i].coordinate);
        add(i, force.numbers + place, end == 0 ? 1.0 : -1.0);
      }
    }
    for (const JointIndex& joint : s.joints) {
      if (terms_[i].body.empty() && joint.name == terms_[i].joint && joint.effort_signal < 0 &&
          (term_of_number_.empty() || term_of_number_.back() != static_cast<int>(i))) {
        add(i, joint.effort, 1.0);
      }
    }
  }
}

/// Knots are so near that the forces between them are nearly constant, and not nearer than what is
/// observed can tell.
void ProcessNoise::MakeKnots(const RolloutResiduals& run) {
  const SimulationSettings& settings = run.scene().model().structure->settings;
  std::vector<double> times;
  for (const Observation& one : run.observations()) times.push_back(one.time);
  std::sort(times.begin(), times.end());
  std::vector<double> distances;
  for (size_t i = 1; i < times.size(); ++i) {
    if (times[i] > times[i - 1]) distances.push_back(times[i] - times[i - 1]);
  }
  const long steps = NumSteps(settings);
  const double step = StepTime(settings, steps) / static_cast<double>(std::max(1L, steps));
  double distance = distances.empty() ? step : UpperMedian(std::move(distances));
  for (const NoiseTerm& term : terms_) {
    if (term.correlation_time > 0.0) distance = std::min(distance, term.correlation_time);
  }
  const long every =
      std::max(1L, static_cast<long>(std::floor(distance / step * (1.0 + kKnotRounding))));
  for (long k = 0; k < steps; k += every) knots_.push_back(k);
  knots_.push_back(steps);
  for (size_t i = 1; i < knots_.size(); ++i) {
    lengths_.push_back(StepTime(settings, knots_[i]) - StepTime(settings, knots_[i - 1]));
  }
}

std::vector<double> ProcessNoise::KnotTimes(const RolloutResiduals& run) const {
  std::vector<double> times;
  for (const long k : knots_) times.push_back(StepTime(run.scene().model().structure->settings, k));
  return times;
}

FollowedForces ProcessNoise::Found(const RolloutResiduals& run) const {
  FollowedForces found{numbers_, KnotTimes(run), {}};
  found.forces.resize(num_intervals(), static_cast<Eigen::Index>(numbers_.size()));
  for (size_t i = 0; i < numbers_.size(); ++i) {
    found.forces.col(static_cast<Eigen::Index>(i)) =
        sign_of_number_[i] * now_.path.forces.col(term_of_number_[i]);
  }
  return found;
}

Controls FollowedForces::In(const Model<double>& model) const {
  const SimulationSettings& settings = model.structure->settings;
  const long steps = NumSteps(settings);
  Controls controls{numbers, {}};
  controls.values.resize(steps, static_cast<Eigen::Index>(numbers.size()));
  Eigen::Index at = 0;
  for (long k = 0; k < steps; ++k) {
    // A step belongs to the interval that its middle is in.
    const double middle = StepTime(settings, k) + 0.5 * StepLength(settings, k);
    while (at < forces.rows() && times[static_cast<size_t>(at) + 1] < middle) ++at;
    for (size_t i = 0; i < numbers.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      controls.values(k, column) =
          model.parameters[numbers[i]] + (at < forces.rows() ? forces(at, column) : 0.0);
    }
  }
  return controls;
}

namespace {

/// Whether a force that is constant over `length` stands for the mean of a process whose
/// correlation time is shorter: knots cannot be nearer than steps.
bool IsMean(double correlation_time, double length) {
  return length > correlation_time * (1.0 + kKnotRounding);
}

/// The standard deviation of the mean of an Ornstein-Uhlenbeck process of variance 1 over `length`,
/// in correlation times.
double DeviationOfMean(double length) {
  return std::sqrt(2.0 * (length + std::expm1(-length))) / length;
}

/// The correlation of its means over two lengths, one behind the other.
double CorrelationOfMeans(double before, double behind) {
  return std::expm1(-before) * std::expm1(-behind) /
         (before * behind * DeviationOfMean(before) * DeviationOfMean(behind));
}

}  // namespace

/// (1) of noise_sweep.h, with the forces as they are.
void ProcessNoise::SetScale(const Eigen::VectorXd& intensities,
                            std::vector<NoiseInterval>* intervals) const {
  const int m = num_terms();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(m);
  for (size_t k = 0; k < intervals->size(); ++k) {
    NoiseInterval& interval = (*intervals)[k];
    interval.decay.setZero(m);
    interval.drive.setOnes(m);
    interval.size = intensities;
    for (int i = 0; i < m; ++i) {
      const double time = terms_[i].correlation_time;
      if (time == 0.0) {
        interval.size[i] /= std::sqrt(lengths_[k]);
        continue;
      }
      const bool is_mean = IsMean(time, lengths_[k]);
      if (is_mean) interval.size[i] *= DeviationOfMean(lengths_[k] / time);
      if (k == 0) continue;
      if (is_mean || IsMean(time, lengths_[k - 1])) {
        const double decay = CorrelationOfMeans(lengths_[k - 1] / time, lengths_[k] / time);
        interval.decay[i] = decay;
        interval.drive[i] = std::sqrt((1.0 - decay) * (1.0 + decay));
      } else {
        const double distance = 0.5 * (lengths_[k - 1] + lengths_[k]);
        interval.decay[i] = std::exp(-distance / time);
        interval.drive[i] = std::sqrt(-std::expm1(-2.0 * distance / time));
      }
    }
    const Eigen::VectorXd next = interval.force.cwiseQuotient(interval.size);
    interval.innovation = (next - interval.decay.cwiseProduct(u)).cwiseQuotient(interval.drive);
    u = next;
  }
}

std::vector<NoiseInterval> ProcessNoise::WithIntensities(const Eigen::VectorXd& intensities) const {
  std::vector<NoiseInterval> intervals = now_.intervals;
  SetScale(intensities, &intervals);
  SetWeights(Weights::kReweighted, &intervals);
  return intervals;
}

void ProcessNoise::SetIntensities(const Eigen::VectorXd& intensities) {
  if (intensities == intensities_) return;
  intensities_ = intensities;
  now_.valid = false;
  if (!kept_.valid) return;
  SetScale(intensities_, &kept_.intervals);
  for (size_t k = 0; k < kept_.intervals.size(); ++k) {
    const NoiseInterval& interval = kept_.intervals[k];
    const auto row = static_cast<Eigen::Index>(k);
    kept_.path.epsilon.row(row) = interval.innovation.transpose();
    kept_.path.u.row(row) = interval.force.cwiseQuotient(interval.size).transpose();
  }
  kept_.path.cost = Cost(kept_.path);
  Sweep(Weights::kReweighted, &kept_);
}

void ProcessNoise::SetHuber(double huber) {
  if (huber == huber_) return;
  huber_ = huber;
  now_.valid = false;
  if (!kept_.valid) return;
  kept_.path.cost = Cost(kept_.path);
  Sweep(Weights::kReweighted, &kept_);
}

double ProcessNoise::Cost(const NoisePath& path) const {
  double sum = path.epsilon.squaredNorm();
  for (const double r : path.residuals) sum += SquareOf(r, huber_);
  return 0.5 * sum;
}

void ProcessNoise::SetWeights(Weights weights, std::vector<NoiseInterval>* intervals) const {
  for (NoiseInterval& interval : *intervals) {
    interval.weights.setOnes(interval.residuals.size());
    for (Eigen::Index i = 0; i < interval.residuals.size(); ++i) {
      const double size = std::abs(interval.residuals[i]);
      if (!(huber_ > 0.0 && size > huber_)) continue;
      interval.weights[i] = weights == Weights::kCurved ? 0.0 : std::sqrt(huber_ / size);
    }
  }
}

void ProcessNoise::Sweep(Weights weights, Smoothed* smoothed) const {
  SetWeights(weights, &smoothed->intervals);
  smoothed->sweep = SweepNoise(smoothed->intervals, smoothed->start);
}

/// One run and its pieces.
class ProcessNoise::Runner {
 public:
  Runner(const ProcessNoise& noise, const Eigen::VectorXd& p, const Smoothed* from, double step,
         RolloutResiduals* run, Smoothed* to)
      : noise_(noise),
        p_(p),
        from_(from),
        step_(step),
        residuals_(run),
        to_(to),
        structure_(*run->scene().model().structure),
        num_parameters_(p.size()),
        n_(static_cast<Eigen::Index>(noise.variables_.size())),
        m_(noise.num_terms()) {}

  bool Go(std::string* message) {
    const ParameterizedScene& scene = residuals_->scene();
    const SamplePlan& plan = residuals_->plan();
    const Eigen::Index columns = num_parameters_ + n_ + m_;
    Start(scene, plan, columns);
    RowMatrixXd w_dot = RowMatrixXd::Zero(structure_.num_variables(), columns);
    w_dot.leftCols(num_parameters_) = scene.VariableDerivatives();
    to_->start.resize(n_, num_parameters_);
    for (Eigen::Index i = 0; i < n_; ++i) {
      to_->start.row(i) = w_dot.row(noise_.variables_[i]).head(num_parameters_);
    }
    for (size_t i = 0; i < noise_.numbers_.size(); ++i) {
      w_dot(structure_.ParameterVariable(noise_.numbers_[i]),
            num_parameters_ + n_ + noise_.term_of_number_[i]) = noise_.sign_of_number_[i];
    }
    const TangentObserver observer = [this](long k, double, const State<double>& state,
                                            const RowMatrixXd& dots) {
      state_ = &state;
      EndInterval(k, dots);
    };
    const ControlDirections directions = [this](long k, RowMatrixXd* dots) {
      BeginInterval(k, dots);
    };
    Stepper stepper(scene.model());
    State<double> final;
    const RolloutReport report =
        RolloutTangent(ControlledModel<double>(scene.model(), controls_), scene.initial_state(),
                       directions, observer, &stepper, &w_dot, &final);
    *message = report.message;
    return report.status == StepStatus::kDone && Finish(message);
  }

 private:
  void Start(const ParameterizedScene& scene, const SamplePlan& plan, Eigen::Index columns) {
    const auto intervals = static_cast<Eigen::Index>(noise_.num_intervals());
    samples_.assign(static_cast<size_t>(plan.width()) * plan.num_samples(), 0.0);
    derivatives_.setZero(static_cast<Eigen::Index>(samples_.size()), columns);
    interval_of_sample_.assign(plan.num_samples(), 0);
    controls_.numbers = noise_.numbers_;
    controls_.values.resize(noise_.knots_.back(),
                            static_cast<Eigen::Index>(noise_.numbers_.size()));
    for (size_t i = 0; i < noise_.numbers_.size(); ++i) {
      controls_.values.col(static_cast<Eigen::Index>(i))
          .setConstant(scene.model().parameters[noise_.numbers_[i]]);
    }
    to_->path.p = p_;
    to_->path.states.setZero(intervals + 1, n_);
    to_->path.forces.setZero(intervals, m_);
    to_->path.u.setZero(intervals, m_);
    to_->path.epsilon.setZero(intervals, m_);
    to_->intervals.assign(static_cast<size_t>(intervals), {});
    for (NoiseInterval& interval : to_->intervals) interval.force.setZero(m_);
    noise_.SetScale(noise_.intensities_, &to_->intervals);
  }

  bool IsKnot(long k) const { return noise_.knots_[at_ + 1] == k; }

  /// What the state after k steps is of the interval that it ends, or is within.
  void EndInterval(long k, const RowMatrixXd& dots) {
    const bool first = k == 0;
    const bool ends = !first && IsKnot(k);
    const bool last = k == noise_.knots_.back();
    if (!first) AddShares(k, dots, [&](bool begins) { return !ends || last || !begins; });
    if (!ends) return;
    NoiseInterval& interval = to_->intervals[at_];
    interval.map.resize(n_, dots.cols());
    for (Eigen::Index i = 0; i < n_; ++i) interval.map.row(i) = dots.row(noise_.variables_[i]);
    if (last) KeepState(at_ + 1);
  }

  /// Of a knot: the force from here on.
  void BeginInterval(long k, RowMatrixXd* dots) {
    const bool first = k == 0;
    if (k == noise_.knots_.back() || (!first && !IsKnot(k))) return;
    if (!first) ++at_;
    KeepState(at_);
    SetForce();
    dots->rightCols(n_ + m_).topRows(structure_.ParameterVariable(0)).setZero();
    for (Eigen::Index i = 0; i < n_; ++i) {
      dots->row(noise_.variables_[i]).setZero();
      (*dots)(noise_.variables_[i], num_parameters_ + i) = 1.0;
    }
    AddShares(k, *dots, [&](bool begins) { return first || begins; });
  }

  void KeepState(size_t knot) {
    for (Eigen::Index i = 0; i < n_; ++i) {
      to_->path.states(static_cast<Eigen::Index>(knot), i) =
          StateNumber(*state_, noise_.variables_[i]);
    }
  }

  void SetForce() {
    const auto row = static_cast<Eigen::Index>(at_);
    NoiseInterval& interval = to_->intervals[at_];
    Eigen::VectorXd before = Eigen::VectorXd::Zero(m_);
    if (at_ > 0) before = to_->path.u.row(row - 1).transpose();
    Eigen::VectorXd innovation = Eigen::VectorXd::Zero(m_);
    if (from_ != nullptr) {
      Eigen::VectorXd changes(n_ + m_ + num_parameters_ + 1);
      changes.head(n_) = (to_->path.states.row(row) - from_->path.states.row(row)).transpose();
      changes.segment(n_, m_) = before;
      if (at_ > 0) changes.segment(n_, m_) -= from_->path.u.row(row - 1).transpose();
      changes.segment(n_ + m_, num_parameters_) = p_ - from_->path.p;
      changes[n_ + m_ + num_parameters_] = step_;
      innovation =
          from_->path.epsilon.row(row).transpose() + NoiseStep(from_->sweep.gains[at_], changes);
    }
    const Eigen::VectorXd u =
        interval.decay.cwiseProduct(before) + interval.drive.cwiseProduct(innovation);
    interval.innovation = innovation;
    interval.force = interval.size.cwiseProduct(u);
    to_->path.epsilon.row(row) = innovation.transpose();
    to_->path.u.row(row) = u.transpose();
    to_->path.forces.row(row) = interval.force.transpose();
    const long begin = noise_.knots_[at_];
    const long count = noise_.knots_[at_ + 1] - begin;
    for (size_t i = 0; i < noise_.numbers_.size(); ++i) {
      controls_.values.col(static_cast<Eigen::Index>(i)).segment(begin, count).array() +=
          noise_.sign_of_number_[i] * interval.force[noise_.term_of_number_[i]];
    }
  }

  /// `is_own`: whether a sample that begins at this step, or does not, is one of the interval.
  template <typename IsOwn>
  void AddShares(long k, const RowMatrixXd& dots, const IsOwn& is_own) {
    const SamplePlan& plan = residuals_->plan();
    for (const StateShare& share : plan.numbers().At(k)) {
      const int sample = share.row / plan.width();
      if (!is_own(plan.samples()[sample].step == k)) continue;
      interval_of_sample_[sample] = at_;
      share.Add(*state_, samples_.data());
      share.AddTangent(structure_, dots, &derivatives_);
    }
  }

  /// Residuals, and to each interval its rows.
  bool Finish(std::string* message) {
    to_->path.residuals = residuals_->FromSamples(samples_);
    const RowMatrixXd rows = residuals_->FromSampleDerivatives(
        samples_, {}, derivatives_, Eigen::VectorXd::Ones(num_parameters_));
    const std::vector<int>& sample_of = residuals_->plan().sample_of();
    for (size_t i = 0; i < sample_of.size(); ++i) {
      to_->intervals[interval_of_sample_[sample_of[i]]].observations.push_back(static_cast<int>(i));
    }
    bool finite = to_->path.residuals.allFinite() && rows.allFinite();
    for (NoiseInterval& interval : to_->intervals) {
      const auto count = static_cast<Eigen::Index>(interval.observations.size());
      interval.rows.resize(count, rows.cols());
      interval.residuals.resize(count);
      for (Eigen::Index i = 0; i < count; ++i) {
        const int row = interval.observations[static_cast<size_t>(i)];
        interval.rows.row(i) = rows.row(row);
        interval.residuals[i] = to_->path.residuals[row];
      }
      finite = finite && interval.map.allFinite();
    }
    to_->path.cost = noise_.Cost(to_->path);
    finite = finite && std::isfinite(to_->path.cost);
    if (!finite) *message = "a residual or its derivative is not finite";
    return finite;
  }

  const ProcessNoise& noise_;
  const Eigen::VectorXd& p_;
  const Smoothed* from_;
  const double step_;
  RolloutResiduals* residuals_;
  Smoothed* to_;
  const ModelStructure& structure_;
  const Eigen::Index num_parameters_, n_, m_;
  size_t at_ = 0;  ///< the interval
  const State<double>* state_ = nullptr;
  Controls controls_;
  std::vector<double> samples_;
  RowMatrixXd derivatives_;
  std::vector<size_t> interval_of_sample_;
};

bool ProcessNoise::Run(const Eigen::VectorXd& p, const Smoothed* from, double step,
                       RolloutResiduals* run, Smoothed* to, std::string* message) {
  ++rollouts_;
  to->valid = Runner(*this, p, from, step, run, to).Go(message);
  return to->valid;
}

/// The first run at p: with forces that follow the change of p from the last evaluation, or none.
bool ProcessNoise::Begin(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed,
                         std::string* message) {
  return (kept_.valid && Run(p, &kept_, 0.0, run, smoothed, message)) ||
         Run(p, nullptr, 0.0, run, smoothed, message);
}

/// A run of lower cost from one with its sweep; false where none is found.
bool ProcessNoise::Improve(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed) {
  double step = 1.0;
  for (int halving = 0; halving <= kMostHalvings; ++halving, step *= 0.5) {
    Smoothed next;
    std::string none;
    if (!Run(p, smoothed, step, run, &next, &none)) continue;
    if (next.path.cost <= smoothed->path.cost * (1.0 + kEqualNoiseCost)) {
      *smoothed = std::move(next);
      return true;
    }
  }
  return false;
}

/// Goes to the least cost at p, as far as steps lower it. The derivatives there are those of
/// Newton's method, in which a row beyond Huber's bound has no part.
void ProcessNoise::Smooth(const Eigen::VectorXd& p, RolloutResiduals* run, Smoothed* smoothed) {
  Sweep(Weights::kReweighted, smoothed);
  for (int i = 0; i < kMostRuns && smoothed->sweep.decrement > kSmoothedForces; ++i) {
    if (!Improve(p, run, smoothed)) break;
    Sweep(Weights::kReweighted, smoothed);
  }
  if (huber_ > 0.0) Sweep(Weights::kCurved, smoothed);
}

double ProcessNoise::LogDeterminant() const {
  if (huber_ == 0.0) return now_.sweep.log_determinant;
  return SweepNoise(WithIntensities(intensities_), now_.start).log_determinant;
}

bool ProcessNoise::Evaluate(const Eigen::VectorXd& p, RolloutResiduals* run,
                            Eigen::VectorXd* residuals, RowMatrixXd* jacobian,
                            std::string* message) {
  const int slopes = num_slope_rows();
  const double twice = slopes > 0 ? 2.0 * (kSlopeOffset + slope_.dot(p - slope_at_)) : 0.0;
  if (slopes > 0 && !(twice > 0.0)) {
    *message = "the point is too far from where the random forces' determinant was linearised";
    return false;
  }
  if (!(now_.valid && now_.path.p == p)) {
    now_.valid = false;
    Smoothed found;
    if (!Begin(p, run, &found, message)) return false;
    Smooth(p, run, &found);
    now_ = std::move(found);
    now_.valid = true;
  }
  const Eigen::Index observed = now_.path.residuals.size();
  residuals->setConstant(observed + num_rows() + slopes, std::sqrt(twice));
  residuals->head(observed) = now_.path.residuals;
  residuals->segment(observed, num_rows()) =
      Eigen::Map<const Eigen::VectorXd>(now_.path.epsilon.data(), num_rows());
  if (jacobian == nullptr) return true;
  RowMatrixXd of_observations(observed, p.size());
  RowMatrixXd of_innovations;
  NoiseSensitivity(now_.intervals, now_.sweep, now_.start, &of_observations, &of_innovations);
  jacobian->resize(residuals->size(), p.size());
  jacobian->topRows(observed) = of_observations;
  jacobian->middleRows(observed, num_rows()) = of_innovations;
  if (slopes > 0) jacobian->bottomRows(1) = slope_.transpose() / std::sqrt(twice);
  if (!jacobian->allFinite()) {
    *message = "a derivative is not finite";
    return false;
  }
  kept_ = now_;
  return true;
}

}  // namespace tangible
