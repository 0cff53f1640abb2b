// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The map from a vector of parameters to a scene.
//
//   number_i = scale_i p_k + offset_i        each parameter k sets one or several numbers i
//
// of the scene, of the observed points (`points/tip/at/x`) or of the instruments
// (`sensors/encoder/delay`); no number is set by two. Further parameters may add to a number: it is
// then the value set by the first one, or else the scene's own value, plus the sum of
// scale p + offset of those that add (a pivot moves everything that hangs from it, a length
// everything below it). From the numbers the model and the initial state are rebuilt with an
// unchanged structure. The derivative of this map is taken at the current p, because initial joint
// angles and inertias that follow their mass make it nonlinear.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/estimation/problem/observation.h"
#include "tangible/estimation/problem/parameter_entry.h"
#include "tangible/estimation/problem/prior.h"

namespace tangible {

enum class SetMode { kAssign, kAdd };

/// Numbers that a parameter sets, or adds to, as scale · p + offset; `*` in the path matches within
/// a name.
struct ParameterSet {
  std::string path;
  double scale = 1.0;  ///< not 0
  double offset = 0.0;
  SetMode mode = SetMode::kAssign;
};

/// The minimiser's variable for a parameter.
enum class ParameterScale {
  kByBounds,  ///< logarithmic where the bounds keep it positive
  kLinear,
  kLogarithmic,  ///< needs a lower bound >= 0
};

/// A named number to be estimated, as the user wrote it.
struct FitParameter {
  std::string name;
  std::optional<double> initial;  ///< default: the scene's value of the first number set; 0 if
                                  ///< the first is added to
  std::optional<double> lower;    ///< default: the smallest value that its numbers may take
  std::optional<double> upper;
  std::vector<ParameterSet> sets;
  ParameterScale scale = ParameterScale::kByBounds;
  std::optional<Prior> prior = std::nullopt;
};

/// An error in a list of parameters, and its place.
struct ParameterError {
  int parameter = -1;
  int set = -1;     ///< −1: the parameter itself
  std::string key;  ///< of the parameter or set; empty: the whole
  std::string what;
};

class ParameterizedScene {
 public:
  /// The data of a parameter once its paths are resolved.
  using Entry = ParameterEntry;

  /// Resolves the parameters. False and `error` where a path matches nothing, a number is set
  /// twice, a name is used twice, bounds are crossed or allow values that a number may not have, or
  /// the initial value is outside them.
  bool Create(const Scene& scene, const std::vector<BodyPoint>& points,
              const std::vector<FitParameter>& parameters, ParameterError* error,
              const Instruments& instruments = {});

  /// One more parameter after the others; false and `error` as in Create, and the scene is then of
  /// no use.
  bool Add(const FitParameter& parameter, ParameterError* error);

  int size() const { return static_cast<int>(entries_.size()); }
  /// Which of the scene's numbers (EnumerateNumbers) some parameter sets or adds to.
  std::vector<bool> NumbersSet() const;
  const std::vector<Entry>& entries() const { return entries_; }
  Eigen::VectorXd Initial() const { return InitialOf(entries_); }

  /// Sets the parameters and rebuilds the model; false where a number would get a value that is not
  /// allowed.
  bool Set(const Eigen::VectorXd& p);

  /// Other initial values, within the bounds.
  void SetInitial(const Eigen::VectorXd& p);

  /// Changes the times at which the steps of the run end.
  void SetSimulation(const SimulationSettings& settings);

  /// Whether some parameter changes the time in the run of an observation.
  bool MovesTimes() const { return moves_times_; }

  const Scene& scene() const { return scene_; }
  const std::vector<BodyPoint>& points() const { return points_; }
  const Instruments& instruments() const { return instruments_; }
  const Model<double>& model() const { return model_; }
  const State<double>& initial_state() const { return state_; }

  /// d [poses | twists | the model's parameters] / d p at the p of the last Set: num_variables x
  /// size().
  RowMatrixXd VariableDerivatives() const;
  /// d [at x, at y of each point] / d p: 2 points x size(), constant.
  const RowMatrixXd& point_derivatives() const { return point_derivatives_; }
  /// d [numbers of the instruments] / d p, constant, in the order of EnumerateNumbers.
  const RowMatrixXd& instrument_derivatives() const { return instrument_derivatives_; }

  /// The model in Jets, derivative k of which is that of parameter first + k.
  template <typename T>
  void SeededModel(int first, Model<T>* model, State<T>* state) const;

 private:
  struct NumberSet {
    int parameter, number;  ///< number: of the scene, then two per point, then instruments
    NumberKind kind;
    double scale, offset;
    SetMode mode;
  };
  /// A number that some parameter sets or adds to; base: the value to which parameters add, unless
  /// a parameter sets it.
  struct Target {
    int number;
    NumberKind kind;
    double base;
    std::vector<int> sets;  ///< indices into numbers_
  };
  bool AddParameter(const FitParameter& parameter, ParameterError* error);
  bool Finish(ParameterError* error);
  bool AddSet(const ParameterSet& set, double* value, double* scale, ParameterError* error);
  bool AddNumber(int number, NumberKind kind, const std::string& path, const ParameterSet& set,
                 ParameterError* error);
  bool SetBounds(const FitParameter& parameter, Entry* entry, ParameterError* error) const;
  static bool SetScaleAndPrior(const FitParameter& parameter, Entry* entry, ParameterError* error);
  bool AddMeasurementSet(const ParameterSet& set, double* value, double* scale,
                         ParameterError* error);
  std::vector<InstrumentNumber> MeasurementNumbers();
  void CollectTargets();

  Scene scene_;
  std::vector<BodyPoint> points_;
  Instruments instruments_;
  std::vector<Entry> entries_;
  std::vector<NumberSet> numbers_;
  std::vector<Target> targets_;
  std::vector<ParameterDirection> directions_;  ///< of the scene's numbers
  RowMatrixXd point_derivatives_;
  RowMatrixXd instrument_derivatives_;
  bool moves_times_ = false;
  int num_scene_numbers_ = 0;
  std::shared_ptr<const ModelStructure> structure_;
  Model<double> model_;
  State<double> state_;
};

}  // namespace tangible
