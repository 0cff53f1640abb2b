// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/residual.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <utility>

#include "tangible/estimation/problem/acceleration.h"
#include "tangible/estimation/problem/consistency.h"
#include "tangible/estimation/problem/residual_events.h"
#include "tangible/estimation/problem/tolerances.h"
#include "tangible/lcp/certificate/tolerances.h"
#include "tangible/scene/parameter.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/impact_times.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/certificate/validity_radius.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/difference_column.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {
namespace {

// Residuals in one reverse sweep. More columns share each step's local derivatives but exceed the
// cache.
constexpr int kAdjointColumns = 64;

/// Whether the coordinate needs a twist.
bool IsRate(Coordinate coordinate) {
  return coordinate == Coordinate::kVx || coordinate == Coordinate::kVy ||
         coordinate == Coordinate::kOmega || IsAcceleration(coordinate);
}

/// Whether an instrument or another body changes the recorded value.
bool IsRecorded(const Channel& channel) {
  return channel.sensor >= 0 || channel.camera >= 0 || channel.clock >= 0 || channel.to_body >= 0;
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

RolloutResiduals::RolloutResiduals(ParameterizedScene scene, std::vector<Observation> observations,
                                   std::vector<Channel> channels)
    : scene_(std::move(scene)),
      settings_(scene_.scene().simulation),
      observations_(std::move(observations)),
      channels_(std::move(channels)) {
  if (channels_.empty()) {
    channels_.emplace_back();
  }
  for (const Channel& channel : channels_) {
    markers_.push_back(
        channel.camera < 0 ? -1 : scene_.instruments().cameras[channel.camera].marker_body);
  }
  for (const Observation& observation : observations_) {
    sample_options_.twists = sample_options_.twists || IsRate(observation.coordinate);
    sample_options_.accelerations =
        sample_options_.accelerations || IsAcceleration(observation.coordinate);
  }
  sample_options_.rates = scene_.MovesTimes();
  const auto is_event = [](const Observation& one) { return one.event >= 0; };
  if (std::any_of(observations_.begin(), observations_.end(), is_event)) {
    event_times_ = EventTimes(scene_.instruments().events, observations_);
  }
  // Where clocks or delays are estimated, the last observations may be of a time behind the end.
  if (sample_options_.rates && !HasEvents()) {
    const double more = std::ceil(kRunsOn * settings_.duration / settings_.dt);
    settings_.duration = (static_cast<double>(NumSteps(settings_)) + more) * settings_.dt;
  }
  UpdateTimes();
}

bool RolloutResiduals::FindTimes(std::vector<double>* times) {
  const double slack = kTimeTolerance * settings_.dt;
  bool within = true;
  times->reserve(observations_.size());
  for (const Observation& observation : observations_) {
    const double time = RunTime(scene_.instruments(), ChannelOf(observation), observation.time);
    const bool is_event = observation.event >= 0;  // its time is predicted, and nothing is read
    if (within && !is_event && !(time >= -slack && time <= settings_.duration + slack)) {
      within = false;
      std::ostringstream what;
      what << "what was recorded at " << observation.time << " s is of the time " << time
           << " s of the run, which is outside of [0, " << settings_.duration
           << "] s: bound delay or clock, or let the run begin earlier (a clock's offset)";
      message_ = what.str();
    }
    times->push_back(std::clamp(time, 0.0, settings_.duration));
  }
  return within;
}

bool RolloutResiduals::UpdateTimes() {
  std::vector<double> times;
  const bool within = FindTimes(&times);
  SimulationSettings settings = settings_;
  if (settings.stepping == Stepping::kEvent) {
    std::vector<double> sampled;
    for (size_t i = 0; i < times.size(); ++i) {
      if (observations_[i].event < 0) sampled.push_back(times[i]);
    }
    AddStepTimes(SplitTimes(sampled, settings, sample_options_), &settings);
  }
  plan_ = SamplePlan(observations_, times, channels_, markers_, settings, sample_options_);
  forces_ = ForceRows(observations_, times, settings);
  if (!HasEvents()) {
    settings.duration = StepTime(settings, std::max(plan_.last_step(), forces_.last_step()));
  }
  std::vector<double>& ends = settings.step_times;
  ends.erase(std::upper_bound(ends.begin(), ends.end(), settings.duration), ends.end());
  scene_.SetSimulation(settings);
  return within;
}

std::vector<RowPlace> RolloutResiduals::Places(int /*block*/) const {
  const ObservationSeries series = IndexSeries(observations_);
  std::vector<RowPlace> places;
  places.reserve(observations_.size());
  for (size_t i = 0; i < observations_.size(); ++i) {
    const Observation& observation = observations_[i];
    places.push_back({series.of[i], observation.time,
                      kPredictionRounding * std::abs(observation.value) / observation.sigma});
  }
  return places;
}

RolloutResiduals RolloutResiduals::FirstPart(double part) const {
  double first = HUGE_VAL;
  double last = -HUGE_VAL;
  for (const Observation& observation : observations_) {
    first = std::min(first, observation.time);
    last = std::max(last, observation.time);
  }
  const double end = first + part * (last - first);
  std::vector<Observation> early;
  for (const Observation& observation : observations_) {
    if (observation.time <= end) {
      early.push_back(observation);
    }
  }
  return {scene_, std::move(early), channels_};
}

std::unique_ptr<LeastSquaresProblem> RolloutResiduals::Window(double part) const {
  if (noise_) return nullptr;
  return std::make_unique<RolloutResiduals>(FirstPart(part));
}

bool RolloutResiduals::EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod method,
                                     BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  const long before = rollouts_;
  RowMatrixXd* const jacobian =
      derivatives == BlockDerivatives::kCompute ? &evaluation->jacobian : nullptr;
  const bool done = noise_ ? WithNoise(p, &evaluation->residuals, jacobian)
                           : Evaluate(p, method, &evaluation->residuals, jacobian);
  evaluation->message = message_;
  evaluation->rollouts = rollouts_ - before;
  return done;
}

bool RolloutResiduals::WithNoise(const Eigen::VectorXd& p, Eigen::VectorXd* residuals,
                                 RowMatrixXd* jacobian) {
  if (!SetParameters(p)) return false;
  const long before = noise_->rollouts();
  const bool done = noise_->Evaluate(p, this, residuals, jacobian, &message_);
  rollouts_ += noise_->rollouts() - before;
  return done;
}

// The certificate is for the parameters that set numbers of the scene. That of a run without the
// random forces would be one of another motion.
std::optional<Certificate> RolloutResiduals::Certify(const Eigen::VectorXd& p) {
  if (noise_ || !SetParameters(p)) {
    return std::nullopt;
  }
  std::vector<std::string> names;
  std::vector<double> sizes;
  for (const ParameterEntry& entry : scene_.entries()) {
    sizes.push_back(std::max(std::abs(p[static_cast<Eigen::Index>(names.size())]), entry.scale));
    names.push_back(entry.name);
  }
  // A velocity at the end of a step may be that before an event or behind it.
  std::vector<StateRead> reads;
  for (const Sample& sample : plan_.samples()) {
    if (plan_.width() > 3 && sample.part == 0.0) reads.push_back({sample.step, sample.body});
  }
  Certificate certificate = CertifyDerivative(scene_.model(), scene_.initial_state(),
                                              scene_.VariableDerivatives(), names, sizes, reads);
  NameSamplesOnImpacts(&certificate);
  return certificate;
}

void RolloutResiduals::AddRadii(const Eigen::VectorXd& p, Certificate* certificate) {
  const std::vector<ParameterEntry>& entries = scene_.entries();
  if (noise_ || entries.size() > kMostRadiusRuns || !SetParameters(p)) return;
  ChoiceList own;
  if (!ChoicesOf(scene_.model(), nullptr, scene_.initial_state(), &own)) return;
  Certificate found;
  // A delay or clock that moves the steps makes a structure anew, in which contacts are the same.
  const std::shared_ptr<const ModelStructure> structure = scene_.model().structure;
  for (size_t i = 0; i < entries.size(); ++i) {
    const ParameterEntry& entry = entries[i];
    const double value = p[static_cast<Eigen::Index>(i)];
    const auto beside = [&](double shift, ChoiceList* choices) {
      Eigen::VectorXd moved = p;
      moved[static_cast<Eigen::Index>(i)] += shift;
      const double at = moved[static_cast<Eigen::Index>(i)];
      return at >= entry.lower && at <= entry.upper && SetParameters(moved) &&
             ChoicesOf(scene_.model(), nullptr, scene_.initial_state(), choices);
    };
    ValidityRadius radius =
        ValidityRadiusOf(*structure, own, beside, std::max(std::abs(value), entry.scale));
    radius.parameter = entry.name;
    const auto clip = [&](double sign, double* distance, std::string* where) {
      Eigen::VectorXd moved = p;
      double* const at = &moved[static_cast<Eigen::Index>(i)];
      *at += sign * (1.0 + kRangeEnd) * *distance;
      if (std::isfinite(*at) && *at >= entry.lower && *at <= entry.upper && scene_.Set(moved)) {
        return;
      }
      *distance = HUGE_VAL;
      where->clear();
    };
    clip(-1.0, &radius.down, &radius.down_where);
    clip(1.0, &radius.up, &radius.up_where);
    found.radius.push_back(std::move(radius));
  }
  if (!SetParameters(p)) return;
  found.growth = GrowthOf(scene_.model(), nullptr, scene_.initial_state());
  Merge(found, *certificate);
  SetVerdict(*certificate);
}

// An observation at the end of a step at which its body is struck is one of the motion before the
// impact or behind it. A velocity jumps.
void RolloutResiduals::NameSamplesOnImpacts(Certificate* certificate) const {
  const Model<double>& model = scene_.model();
  const SimulationSettings& settings = model.structure->settings;
  if (settings.stepping != Stepping::kEvent) return;
  for (const BodyImpact& impact : FindImpacts(model, scene_.initial_state())) {
    for (const Sample& sample : plan_.samples()) {
      if (sample.body != impact.body || sample.part != 0.0 ||
          std::abs(sample.time - impact.time) > kNearKinkMargin * settings.dt) {
        continue;
      }
      std::ostringstream what;
      what << "an observation of " << model.structure->bodies[sample.body].name << " at "
           << sample.time << " s falls on an impact";
      const bool jumps = plan_.width() > 3;
      std::string& reason = jumps ? certificate->discontinuous : certificate->one_sided;
      if (jumps || reason.empty()) reason = what.str();
      SetVerdict(*certificate);
      return;
    }
  }
}

bool RolloutResiduals::Evaluate(const Eigen::VectorXd& p, GradientMethod method,
                                Eigen::VectorXd* residuals, RowMatrixXd* jacobian) {
  if (noise_) {
    const bool done = WithNoise(p, residuals, jacobian);
    if (done) residuals->conservativeResize(num_residuals());
    if (done && jacobian != nullptr) jacobian->conservativeResize(num_residuals(), Eigen::NoChange);
    return done;
  }
  if (!SetParameters(p)) {
    return false;
  }
  bool done = false;
  if (jacobian == nullptr) {
    done = Plain();
  } else if (method == GradientMethod::kTangent) {
    done = Tangent(jacobian);
  } else if (method == GradientMethod::kAdjoint) {
    done = Adjoint(jacobian);
  } else if (method == GradientMethod::kFiniteDifference) {
    done = FiniteDifferences(p, jacobian);
  } else {
    const bool implicit = method == GradientMethod::kJetImplicit;
    done = Plain() && Jets(implicit ? JetRoute::kImplicit : JetRoute::kUnrolled, jacobian);
  }
  if (!done) {
    return false;
  }
  *residuals = FromSamples(samples_);
  const bool finite = residuals->allFinite() && (jacobian == nullptr || jacobian->allFinite());
  if (!finite) {
    message_ = "a residual or its derivative is not finite";
  }
  return finite;
}

bool RolloutResiduals::SetParameters(const Eigen::VectorXd& p) {
  message_.clear();
  if (!scene_.Set(p)) {
    message_ = "a parameter sets a number to a value that it may not take";
    return false;
  }
  if (scene_.MovesTimes() && forces_.num_rows() > 0) {
    message_ = "forces are observed, which have no derivative by a delay or clock";
    return false;
  }
  if (scene_.MovesTimes() && !UpdateTimes()) {
    return false;
  }
  if (sample_options_.accelerations) {
    by_gravity_ = scene_.VariableDerivatives().middleRows(
        scene_.model().structure->ParameterVariable(kGravityX), 2);
  }
  samples_.assign(static_cast<size_t>(num_sample_rows()), 0.0);
  rates_.assign(plan_.has_rates() ? samples_.size() : 0, 0.0);
  return true;
}

bool RolloutResiduals::Accept(const RolloutReport& report) {
  ++rollouts_;
  message_ = report.message;
  return report.status == StepStatus::kDone;
}

bool RolloutResiduals::Plain() {
  State<double> final;
  event_times_.Start();
  Stepper own(scene_.model());
  Controls controls;
  if (followed_) controls = followed_->In(scene_.model());
  const bool done = Accept(Rollout(
      followed_ ? ControlledModel<double>(scene_.model(), controls)
                : ControlledModel<double>(scene_.model()),
      scene_.initial_state(),
      [this](long k, double, const State<double>& state, Stepper* stepper) {
        plan_.Add(k, state, &samples_, &rates_);
        event_times_.Add(k, stepper);
        AddForces(k, stepper);
      },
      &own, &final));
  if (done) FinishEvents(final);
  return done;
}

bool RolloutResiduals::Tangent(RowMatrixXd* jacobian) {
  RowMatrixXd w_dot = scene_.VariableDerivatives();
  RowMatrixXd sample_derivatives = RowMatrixXd::Zero(num_sample_rows(), num_parameters());
  State<double> final;
  Stepper stepper(scene_.model());
  event_times_.Start();
  RowMatrixXd last_dots;  // of the state before, where forces read it
  const TangentObserver observer = [&](long k, double, const State<double>& state,
                                       const RowMatrixXd& dots) {
    AddForces(k, k == 0 ? nullptr : &stepper);
    forces_.ForEachDot(
        k, num_parameters(), [&](int variable) { return last_dots.row(variable); },
        [&](int variable) { return dots.row(variable); },
        [&](int row, const Eigen::RowVectorXd& dot) {
          sample_derivatives.row(ForceRow(row)) = dot;
        });
    if (!forces_.ReadAt(k + 1).empty()) last_dots = dots;
    plan_.Add(k, state, &samples_, &rates_);
    plan_.numbers().AddTangent(k, *scene_.model().structure, dots, &sample_derivatives);
    event_times_.Add(k, k == 0 ? nullptr : &stepper);
  };
  if (!Accept(RolloutTangent(scene_.model(), scene_.initial_state(), {}, observer, &stepper, &w_dot,
                             &final))) {
    return false;
  }
  FinishEvents(final);
  FinishEventDerivatives(
      0, num_parameters(), [&](int variable) { return w_dot.row(variable); }, &sample_derivatives);
  *jacobian = FromSampleDerivatives(samples_, rates_, sample_derivatives,
                                    Eigen::VectorXd::Ones(num_parameters()));
  return true;
}

bool RolloutResiduals::Adjoint(RowMatrixXd* jacobian) {
  State<double> final;
  event_times_.Start();
  const StateObserver observer = [this](long k, double, const State<double>& state,
                                        Stepper* stepper) {
    plan_.Add(k, state, &samples_, &rates_);
    event_times_.Add(k, stepper);
    AddForces(k, stepper);
  };
  if (!Accept(tape_.Record(scene_.model(), scene_.initial_state(), Factorisations::kKeep, observer,
                           &final))) {
    return false;
  }
  FinishEvents(final);
  const RowMatrixXd variables = scene_.VariableDerivatives();
  jacobian->resize(num_residuals(), num_parameters());
  for (int first = 0; first < num_residuals(); first += kAdjointColumns) {
    AdjointBlock(first, std::min(kAdjointColumns, num_residuals() - first), variables, jacobian);
  }
  return true;
}

void RolloutResiduals::AdjointBlock(int first, int count, const RowMatrixXd& variables,
                                    RowMatrixXd* jacobian) {
  // The losses that depend on each sample: (loss, derivative with respect to the sample's state).
  struct Reader {
    int loss;
    double by_state[kPlaceNumbers];
  };
  std::vector<std::vector<Reader>> readers(plan_.num_samples());
  long last = 0;  // the step that is read
  EventBars events;
  std::vector<std::pair<int, int>> forces;  // the losses that read forces, and their rows
  for (int i = 0; i < count; ++i) {
    if (const int row = forces_.RowOf(first + i); row >= 0) {
      forces.emplace_back(i, row);
      last = std::max(last, forces_.StateOf(row));
      jacobian->row(first + i) = ForceDirectTerm(first + i, forces_.Value(row));
      continue;
    }
    if (observations_[first + i].event >= 0) {
      AddEventBars(first + i, i, &events);
      const Eigen::Index row = EventRow(event_times_.RowOf(first + i));
      jacobian->row(first + i) = EventDirectTerm(first + i, samples_[static_cast<size_t>(row)]);
      continue;
    }
    const double sigma = observations_[first + i].sigma;
    const Prediction prediction = PredictionOf(first + i, samples_);
    for (int place = 0; place < kPlaces; ++place) {
      const int sample = plan_.SampleOf(first + i, place);
      if (sample < 0) {
        continue;
      }
      last = std::max(last, plan_.LastStepOf(sample));
      Reader reader{i, {}};
      for (int j = 0; j < kPlaceNumbers; ++j) {
        reader.by_state[j] = prediction.by_state[place][j] / sigma;
      }
      readers[sample].push_back(reader);
    }
    jacobian->row(first + i) = DirectTerm(first + i, prediction, rates_);
  }
  const ModelStructure& structure = *scene_.model().structure;
  const long end = tape_.steps();
  last = std::max(last, events.LastStep(end));
  const auto seed = [&](long k, RowMatrixXd* w_bar) {
    if (k == end) events.AddAtEnd(w_bar);
    for (const auto& [loss, row] : forces) {
      if (forces_.StateOf(row) != k) continue;
      const double factor = GainOf(first + loss) / observations_[first + loss].sigma;
      for (const JacobianEntry& entry : forces_.ByState(row)) {
        (*w_bar)(entry.variable, loss) += factor * entry.value;
      }
    }
    plan_.numbers().ForEachBar(k, structure, [&](int row, double weight, int variable) {
      for (const Reader& reader : readers[row / plan_.width()]) {
        (*w_bar)(variable, reader.loss) += weight * reader.by_state[row % plan_.width()];
      }
    });
  };
  RowMatrixXd w_bar;
  const auto event_seed = [&](long step, IslandRecords* parts) {
    events.AddIn(step, count, parts);
  };
  tape_.AdjointFrom(scene_.model(), last, count, seed, &w_bar, {}, event_seed);
  jacobian->middleRows(first, count) += w_bar.transpose() * variables;
}

bool RolloutResiduals::FiniteDifferences(const Eigen::VectorXd& p, RowMatrixXd* jacobian) {
  if (!Plain()) return false;
  const std::vector<double> samples = samples_;
  const std::vector<double> rates = rates_;
  const Eigen::VectorXd centre = FromSamples(samples);
  jacobian->resize(num_residuals(), num_parameters());
  for (int k = 0; k < num_parameters(); ++k) {
    const ParameterizedScene::Entry& entry = scene_.entries()[k];
    const double h = kRelativeStep * std::max(std::abs(p[k]), entry.scale);
    const bool at_lower = p[k] - h < entry.lower;
    const auto evaluate = [&](double shift, Eigen::VectorXd* residuals) {
      // The difference is forward or backward where a central one would leave the bounds.
      const bool outside = at_lower ? shift < 0.0 : shift == h && p[k] + h > entry.upper;
      if (outside) return Evaluated::kRefused;
      Eigen::VectorXd moved = p;
      moved[k] += shift;
      if (!SetParameters(moved) || !Plain()) return Evaluated::kFailed;
      *residuals = FromSamples(samples_);
      return Evaluated::kDone;
    };
    const DifferenceColumn difference = Difference(h, centre, evaluate);
    if (difference.status != Evaluated::kDone) return false;
    jacobian->col(k) = difference.values;
  }
  SetParameters(p);
  samples_ = samples;
  rates_ = rates;
  return true;
}

bool RolloutResiduals::IsDirect(int i) const {
  const Observation& one = observations_[i];
  return one.point < 0 && one.event < 0 && !IsAcceleration(one.coordinate) &&
         !IsForce(one.coordinate) && !IsRecorded(ChannelOf(one));
}

Eigen::Index RolloutResiduals::DirectNumber(int i) const {
  return plan_.width() * static_cast<Eigen::Index>(plan_.sample_of()[i]) +
         static_cast<int>(observations_[i].coordinate);
}

Prediction RolloutResiduals::PredictionOf(int i, const std::vector<double>& samples) const {
  // Twists that nobody reads are 0.
  double states[kPlaces][kPlaceNumbers] = {};
  ObservedPlaces places;
  for (int place = 0; place < kPlaces; ++place) {
    const int sample = plan_.SampleOf(i, place);
    if (sample < 0) {
      continue;
    }
    const double* const from = &samples[static_cast<size_t>(plan_.width()) * sample];
    std::copy(from, from + plan_.width(), states[place]);
    places[place].state = states[place];
  }
  return PredictAt(i, places);
}

std::array<int, kPlaces> RolloutResiduals::BodiesOf(int i) const {
  const int channel = observations_[i].channel;
  return {observations_[i].body, channels_[channel].to_body, markers_[channel]};
}

Prediction RolloutResiduals::PredictionIn(int i, const State<double>& state) const {
  double states[kPlaces][kPlaceNumbers] = {};
  ObservedPlaces places;
  const std::array<int, kPlaces> bodies = BodiesOf(i);
  for (int place = 0; place < kPlaces; ++place) {
    if (bodies[place] >= 0) {
      const size_t first = 3 * static_cast<size_t>(bodies[place]);
      std::copy_n(&state.pose[first], 3, states[place]);
      std::copy_n(&state.twist[first], 3, states[place] + 3);
      places[place].state = states[place];
    }
  }
  return PredictAt(i, places);
}

/// `places` have their states.
Prediction RolloutResiduals::PredictAt(int i, ObservedPlaces places) const {
  const Observation& observation = observations_[i];
  const Channel& channel = ChannelOf(observation);
  const Instruments& instruments = scene_.instruments();
  const Camera* const camera = channel.camera < 0 ? nullptr : &instruments.cameras[channel.camera];
  const int points[kPlaces] = {observation.point, channel.to_point,
                               camera == nullptr ? -1 : camera->marker_point};
  for (int place = 0; place < kPlaces; ++place) {
    if (places[place].state != nullptr && points[place] >= 0) {
      places[place].point = points[place];
      places[place].at = scene_.points()[points[place]].at;
    }
  }
  if (IsAcceleration(observation.coordinate)) {
    const std::vector<double>& numbers = scene_.model().parameters;
    return PredictAcceleration(
        observation.coordinate, places[0],
        {channel.body_frame, channel.gravity, {numbers[kGravityX], numbers[kGravityY]}},
        channel.sensor < 0 ? nullptr : &instruments.sensors[channel.sensor]);
  }
  if (channel.sensor < 0 && camera == nullptr && channel.to_body < 0) {
    return PredictPlain(observation.coordinate, places[0]);
  }
  return PredictRecorded(observation.coordinate, places,
                         channel.sensor < 0 ? nullptr : &instruments.sensors[channel.sensor],
                         camera);
}

Eigen::RowVectorXd RolloutResiduals::DirectTerm(int i, const Prediction& prediction,
                                                const std::vector<double>& rates) const {
  const Observation& observation = observations_[i];
  const Channel& channel = ChannelOf(observation);
  const Instruments& instruments = scene_.instruments();
  Eigen::RowVectorXd term = Eigen::RowVectorXd::Zero(num_parameters());
  const int points[kPlaces] = {
      observation.point, channel.to_point,
      channel.camera < 0 ? -1 : instruments.cameras[channel.camera].marker_point};
  double by_time = 0.0;
  for (int place = 0; place < kPlaces; ++place) {
    const int sample = plan_.SampleOf(i, place);
    for (int axis = 0; axis < 2 && points[place] >= 0; ++axis) {
      term +=
          prediction.by_at[place][axis] * scene_.point_derivatives().row(2 * points[place] + axis);
    }
    for (int j = 0; j < plan_.width() && sample >= 0 && !rates.empty(); ++j) {
      by_time +=
          prediction.by_state[place][j] * rates[static_cast<size_t>(plan_.width()) * sample + j];
    }
  }
  if (IsAcceleration(observation.coordinate)) {
    term += prediction.by_gravity[0] * by_gravity_.row(0) +
            prediction.by_gravity[1] * by_gravity_.row(1);
  }
  const RowMatrixXd& by_number = scene_.instrument_derivatives();
  if (channel.sensor >= 0) {
    const int first = instruments.SensorNumber(channel.sensor);
    term += -by_time * by_number.row(first) + prediction.by_sensor[0] * by_number.row(first + 1) +
            prediction.by_sensor[1] * by_number.row(first + 2);
  }
  for (int j = 0; j < kCameraNumbers && channel.camera >= 0; ++j) {
    term += prediction.by_camera[j] * by_number.row(instruments.CameraNumber(channel.camera) + j);
  }
  if (channel.clock >= 0) {
    const int first = instruments.ClockNumber(channel.clock);
    term += by_time * (observation.time * by_number.row(first) + by_number.row(first + 1));
  }
  return term / observation.sigma;
}

Eigen::VectorXd RolloutResiduals::FromSamples(const std::vector<double>& samples) const {
  Eigen::VectorXd residuals(num_residuals());
  for (int i = 0; i < num_residuals(); ++i) {
    if (IsDirect(i)) {
      const double predicted = samples[static_cast<size_t>(DirectNumber(i))];
      residuals[i] = (predicted - observations_[i].value) / observations_[i].sigma;
      continue;
    }
    if (const int row = forces_.RowOf(i); row >= 0) {
      const double force = RecordedForce(i, samples[static_cast<size_t>(ForceRow(row))]);
      residuals[i] = (force - observations_[i].value) / observations_[i].sigma;
      continue;
    }
    if (observations_[i].event >= 0) {
      const auto row = static_cast<size_t>(EventRow(event_times_.RowOf(i)));
      residuals[i] =
          (RecordedTime(i, samples[row]) - observations_[i].value) / observations_[i].sigma;
      continue;
    }
    residuals[i] =
        (PredictionOf(i, samples).value - observations_[i].value) / observations_[i].sigma;
  }
  return residuals;
}

RowMatrixXd RolloutResiduals::FromSampleDerivatives(const std::vector<double>& samples,
                                                    const std::vector<double>& rates,
                                                    const RowMatrixXd& sample_derivatives,
                                                    const Eigen::VectorXd& p_by_q) const {
  RowMatrixXd jacobian(num_residuals(), sample_derivatives.cols());
  const int width = plan_.width();
  for (int i = 0; i < num_residuals(); ++i) {
    if (IsDirect(i)) {
      jacobian.row(i) = sample_derivatives.row(DirectNumber(i)) / observations_[i].sigma;
      continue;
    }
    if (const int force = forces_.RowOf(i); force >= 0) {
      const Eigen::Index row = ForceRow(force);
      jacobian.row(i) = GainOf(i) / observations_[i].sigma * sample_derivatives.row(row);
      jacobian.row(i).head(num_parameters()) +=
          ForceDirectTerm(i, samples[static_cast<size_t>(row)]).cwiseProduct(p_by_q.transpose());
      continue;
    }
    if (observations_[i].event >= 0) {
      const Eigen::Index row = EventRow(event_times_.RowOf(i));
      jacobian.row(i) = EventFactor(i) * sample_derivatives.row(row);
      jacobian.row(i).head(num_parameters()) +=
          EventDirectTerm(i, samples[static_cast<size_t>(row)]).cwiseProduct(p_by_q.transpose());
      continue;
    }
    const Prediction prediction = PredictionOf(i, samples);
    jacobian.row(i).setZero();
    if (observations_[i].point >= 0 || IsAcceleration(observations_[i].coordinate) ||
        IsRecorded(ChannelOf(observations_[i]))) {
      jacobian.row(i).head(num_parameters()) =
          DirectTerm(i, prediction, rates).cwiseProduct(p_by_q.transpose());
    }
    for (int place = 0; place < kPlaces; ++place) {
      const int sample = plan_.SampleOf(i, place);
      for (int j = 0; j < width && sample >= 0; ++j) {
        jacobian.row(i) += prediction.by_state[place][j] / observations_[i].sigma *
                           sample_derivatives.row(width * sample + j);
      }
    }
  }
  return jacobian;
}

HeldColumns RolloutResiduals::EvaluateHeld(int /*block*/, const Eigen::VectorXd& p,
                                           GradientMethod method, int most) {
  HeldColumns held;
  if (noise_ || !SetParameters(p)) {
    return held;
  }
  const std::vector<FitParameter> candidates = Candidates(scene_);
  ParameterizedScene scene;
  ParameterError error;
  if (candidates.empty() || static_cast<int>(candidates.size()) > most ||
      !scene.Create(scene_.scene(), scene_.points(), candidates, &error, scene_.instruments())) {
    return held;
  }
  RolloutResiduals released(scene, observations_, channels_);
  Eigen::VectorXd values;
  if (released.Evaluate(scene.Initial(), method, &values, &held.columns)) {
    held.entries = scene.entries();
  }
  return held;
}

std::optional<RolloutResiduals> RolloutResiduals::With(const std::string& path) const {
  FitParameter added;
  added.name = path;
  added.sets = {{path}};
  ParameterizedScene scene = scene_;
  ParameterError error;
  if (!scene.Add(added, &error)) {
    return std::nullopt;
  }
  RolloutResiduals with(std::move(scene), observations_, channels_);
  with.SetFiles(files_);
  return with;
}

std::unique_ptr<LeastSquaresProblem> RolloutResiduals::Released(const std::string& path) const {
  if (noise_) return nullptr;
  std::optional<RolloutResiduals> with = With(path);
  return with ? std::make_unique<RolloutResiduals>(std::move(*with)) : nullptr;
}

std::vector<std::string> RolloutResiduals::FindInconsistencies(const Eigen::VectorXd& p) {
  if (!SetParameters(p)) return {};
  std::vector<std::string> lines = FindInconsistentBodies(scene_.scene());
  const std::vector<std::string> missing = DescribeMissingEvents();
  lines.insert(lines.end(), missing.begin(), missing.end());
  return lines;
}

}  // namespace tangible
