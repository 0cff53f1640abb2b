// SPDX-License-Identifier: Apache-2.0
//
// Fits: what tangible-fit does, and the residuals and Jacobians that it minimises.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/row_archive.h"
#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/fit/fit_parts.h"
#include "tangible/estimation/fit/posterior.h"
#include "tangible/estimation/results/design_output.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/fitted_scene.h"
#include "tangible/estimation/results/missing_output.h"
#include "tangible/estimation/results/noise_output.h"
#include "tangible/estimation/results/posterior_output.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/estimation/results/report.h"
#include "tangible/python/binding.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/text_file.h"

namespace tangible::python {
namespace {

// Draws, chains, warm-up, target, seed and temperatures, as the package gives them.
using Sampling = std::tuple<int, int, int, double, unsigned, int>;
PosteriorOptions ReadSampling(const Sampling& sampling) {
  const auto& [draws, chains, warm_up, target, seed, temperatures] = sampling;
  PosteriorOptions options{draws, chains, warm_up, target, seed};
  options.temperatures = temperatures;
  return options;
}

// A fit file of one run or several recordings, read. Calls change its memory, and take turns.
class FitProblemOf {
 public:
  FitProblemOf(const std::string& text, const std::string& file) {
    std::string error;
    if (ParseFit(text, file, &fit_, &error)) problem_ = MakeProblem(fit_, &error);
    if (problem_ == nullptr) throw Error(error);
  }

  std::vector<std::string> names() {
    std::vector<std::string> names;
    for (const auto& entry : problem().entries()) names.push_back(entry.name);
    return names;
  }

  // Columns: initial value, lower and upper bound.
  Array Ranges() {
    const auto& entries = problem().entries();
    Array ranges({static_cast<py::ssize_t>(entries.size()), py::ssize_t{3}});
    double* out = ranges.mutable_data();
    for (const auto& entry : entries) {
      *out++ = entry.initial;
      *out++ = entry.lower;
      *out++ = entry.upper;
    }
    return ranges;
  }

  py::tuple Evaluate(const Array& at, bool with_jacobian) {
    const BlockLayout layout(problem());
    const Eigen::Index count = layout.num_parameters();
    if (at.ndim() != 1 || at.shape(0) != count) {
      throw py::value_error("parameters: expected " + std::to_string(count) + " values");
    }
    const Eigen::VectorXd p = Eigen::Map<const Eigen::VectorXd>(at.data(), count);
    Eigen::VectorXd values(layout.num_rows());
    RowMatrixXd jacobian = RowMatrixXd::Zero(with_jacobian ? layout.num_rows() : 0, count);
    const std::string error = WithoutLock(
        [&] { return turns_.Take([&] { return EvaluateBlocks(layout, p, &values, &jacobian); }); });
    if (!error.empty()) throw Error(error);
    const auto rows = static_cast<py::ssize_t>(values.size());
    return py::make_tuple(
        ToArray(RowMatrixXd(values), {rows}),
        with_jacobian ? py::object(ToArray(jacobian, {rows, count})) : py::object(py::none()));
  }

  // What others have done of a fit, as texts: starts in their order, profiles of these names, and
  // chains in their order.
  struct Parts {
    std::vector<std::string> starts;
    std::vector<std::string> names, profiles;
    std::vector<std::string> chains;
  };
  struct Wanted {
    int max_iterations = 50;
    double predict_from = INFINITY;  // s; infinite: all observations are fitted
    bool discretisation_check = false;
    std::string checkpoint;             // a file, or empty
    py::object on_iteration;            // called with a dict, or None
    std::vector<std::string> profiles;  // of these parameters
    std::string design, design_name;    // a file of candidates as text, or empty
    Parts parts;
    bool missing = false;  // whether it is asked what would explain the residuals
    std::optional<PosteriorOptions> sampling;  // of draws from the posterior
  };

  int num_starts() const { return NumStarts(fit_.input.options()); }

  // A start as a text that `Wanted::parts` takes; empty where none can be made.
  std::string MakeStart(int number, int max_iterations, double predict_from, int threads) {
    return WithoutLock([&] {
      return turns_.Take([&] {
        SetOptions(max_iterations, threads);
        HoldBack(predict_from);
        const auto starts = MakeStarts(fit_.input.options(), problem_.get(), {number});
        return starts.front() ? ToRow(*starts.front()).dump() : std::string();
      });
    });
  }

  // The profile of a parameter around the estimate to which the starts lead, likewise.
  std::string MakeProfile(const std::string& name, int max_iterations, double predict_from,
                          int threads, const std::vector<std::string>& starts) {
    return WithoutLock([&] {
      return turns_.Take([&] {
        SetOptions(max_iterations, threads);
        SetProfiles({name});
        HoldBack(predict_from);
        const auto made = MakeProfiles(fit_.input.options(), problem_.get(),
                                       Read({starts, {}, {}, {}}).starts, {name});
        return made.empty() ? std::string() : ToRow(made.begin()->second).dump();
      });
    });
  }

  // A chain of draws from the posterior around that estimate, likewise.
  std::string MakeChain(int number, int max_iterations, double predict_from, int threads,
                        const std::vector<std::string>& starts, const Sampling& sampling) {
    return WithoutLock([&] {
      return turns_.Take([&] {
        SetOptions(max_iterations, threads);
        std::vector<std::vector<Observation>> held_back = HoldBack(predict_from);
        FitParts parts = Read({starts, {}, {}, {}});
        FitPartLogs logs(&parts);
        const FitOptions& options = fit_.input.options();
        VarianceComponents components;
        const FitResult result = FitWithComponents(options, problem_.get(), {}, &components,
                                                   [&logs] { return logs.Next(); });
        Scale(components.noise, &held_back);
        std::vector<FinishedChain> chains;
        std::string error;
        if (result.estimate.size() > 0) {
          MakeChains(ReadSampling(sampling), options, result,
                     FreeCoordinates(problem_->entries(), problem_->effects()),
                     MakerOf(fit_.input, *problem_), {number}, &chains, &error);
        }
        return chains.empty() ? std::string() : ToRow(chains.front()).dump();
      });
    });
  }

  // The result as tangible-fit writes it, the report as a page, the predictions as a table, the
  // fitted scene of each recording and draws from the posterior as a table; all but the first are
  // empty where there is no estimate, the last where none are wanted.
  py::tuple Run(const Wanted& wanted) {
    Found found = WithoutLock([&] { return turns_.Take([&] { return Do(wanted); }); });
    return py::make_tuple(found.json, found.report, found.predictions, found.scenes, found.draws);
  }

 private:
  RecordingsProblem& problem() { return *problem_; }

  struct Found {
    std::string json, report, predictions;
    std::vector<Scene> scenes;
    std::string draws;
  };

  Found Do(const Wanted& wanted) {
    SetOptions(wanted.max_iterations, 0);
    SetProfiles(wanted.profiles);
    const std::string refused =
        RefusedWithNoise(*problem_, {{"design", !wanted.design.empty()},
                                     {"profile", !wanted.profiles.empty()},
                                     {"posterior", wanted.sampling.has_value()},
                                     {"missing", wanted.missing},
                                     {"checkpoint", !wanted.checkpoint.empty()},
                                     {"discretisation_check", wanted.discretisation_check}});
    if (!refused.empty()) throw Error(refused);
    std::vector<std::vector<Observation>> held_back = HoldBack(wanted.predict_from);
    const DesignRequest request = ReadDesign(wanted);
    const std::unique_ptr<FitCheckpoint> checkpoint = Open(wanted.checkpoint);
    FitParts parts = Read(wanted.parts);
    FitPartLogs logs(&parts);
    NextLog next_log;
    if (!parts.starts.empty() || !parts.profiles.empty()) {
      next_log = [&logs] { return logs.Next(); };
    } else if (checkpoint != nullptr) {
      next_log = [&] { return checkpoint->Next(); };
    }
    VarianceComponents components;
    FitResult result = FitWithComponents(fit_.input.options(), problem_.get(), ProgressOf(wanted),
                                         &components, next_log);
    Scale(components.noise, &held_back);
    CheckSameFit(checkpoint.get());
    FitFindings findings{&components};
    const std::optional<Posterior> posterior = Sample(wanted, parts, &result);
    if (posterior) findings.posterior = &*posterior;
    std::optional<DiscretisationCheck> check;
    if (wanted.discretisation_check && result.status == FitStatus::kConverged) {
      std::vector<double> spreads;
      for (const RandomEffect& effect : problem_->effects()) spreads.push_back(effect.spread);
      FitLog* const log = checkpoint ? checkpoint->Next() : nullptr;
      findings.check = &check.emplace(CheckDiscretisation(fit_.input, spreads, result, log));
      CheckSameFit(checkpoint.get());
    }
    const bool any = result.estimate.size() > 0;
    std::optional<PredictedRecordings> later;
    if (!held_back.empty() && any) {
      findings.later = &later.emplace(PredictLater(fit_.input, *problem_, result.estimate,
                                                   wanted.predict_from, std::move(held_back)));
    }
    std::optional<HeldOutRuns> held_out;
    if (!fit_.held_out.empty() && any) {
      findings.held_out = &held_out.emplace(
          PredictHeldOut(fit_.input, *problem_, result.estimate, components.noise, fit_.held_out));
    }
    std::optional<MissingResult> missing;
    if (any && (wanted.missing || fit_.input.options().missing == MissingPass::kRun)) {
      findings.missing = &missing.emplace(FindMissing({}, fit_.input, result, problem_.get()));
    }
    std::optional<Design> design;
    if (!request.candidates.empty() && any) {
      const std::string error =
          MakeDesign(fit_.input, request, result.estimate, problem_.get(), &design.emplace());
      if (!error.empty()) throw Error("design: " + error);
      findings.design = &*design;
    }
    OrderedJson all = ResultToJson(*problem_, result, findings);
    all["certificate"] = any && !result.certificate.verdict.empty() ? ToJson(result.certificate)
                                                                    : OrderedJson(nullptr);
    Found found{all.dump(), "", "", {}, ""};
    if (!any) return found;
    if (posterior) found.draws = PosteriorCsv(problem_->entries(), *posterior);
    found.report = FitReport(fit_.path, *problem_, result, findings);
    found.predictions =
        PredictionCsv(*problem_, result.residuals, findings.later, findings.held_out);
    for (int b = 0; b < problem_->num_blocks(); ++b) found.scenes.push_back(SceneOf(b, result));
    return found;
  }

  // Draws around the estimate, whose intervals become those of the result.
  std::optional<Posterior> Sample(const Wanted& wanted, const FitParts& parts, FitResult* result) {
    if (!wanted.sampling || result->estimate.size() == 0) return std::nullopt;
    std::optional<Posterior> made(std::in_place);
    std::string error;
    if (!SamplePosterior(*wanted.sampling, fit_.input.options(), *result,
                         FreeCoordinates(problem_->entries(), problem_->effects()),
                         MakerOf(fit_.input, *problem_), nullptr, parts.chains, &*made, &error)) {
      throw Error("posterior: " + error);
    }
    TakeIntervals(*made, result);
    return made;
  }

  Scene SceneOf(int b, const FitResult& result) {
    const std::string folder = FolderOf(fit_.path);
    std::string text;
    std::string error;
    Scene scene;
    if (!FittedScene(fit_.input.recordings[b].problem, problem_->ParametersOf(b, result.estimate),
                     folder, &text, &error) ||
        !ParseScene(text, "fitted scene", folder, &scene, &error)) {
      throw Error(problem_->BlockName(b) + error);
    }
    return scene;
  }

  void SetOptions(int max_iterations, int threads) {
    fit_.run().options.max_iterations = max_iterations;
    fit_.run().options.threads = threads;
  }

  void SetProfiles(const std::vector<std::string>& profiles) {
    fit_.run().options.profiles = profiles;
    const std::vector<std::string> all = names();
    for (const std::string& name : profiles) {
      if (std::find(all.begin(), all.end(), name) == all.end()) {
        throw Error("profile: expected names of parameters, got " + name);
      }
    }
  }

  DesignRequest ReadDesign(const Wanted& wanted) {
    DesignRequest request;
    std::string error;
    if (!wanted.design.empty() &&
        !ParseDesign(wanted.design, wanted.design_name, fit_.input, *problem_, &request, &error)) {
      throw Error(error);
    }
    return request;
  }

  static FitParts Read(const Parts& texts) {
    FitParts parts;
    for (size_t i = 0; i < texts.starts.size(); ++i) {
      if (texts.starts[i].empty()) continue;
      FromRow(Json::parse(texts.starts[i]), &parts.starts[static_cast<int>(i)]);
    }
    for (size_t i = 0; i < texts.profiles.size(); ++i) {
      if (texts.profiles[i].empty()) continue;
      FromRow(Json::parse(texts.profiles[i]), &parts.profiles[texts.names.at(i)]);
    }
    for (size_t i = 0; i < texts.chains.size(); ++i) {
      if (texts.chains[i].empty()) continue;
      FromRow(Json::parse(texts.chains[i]), &parts.chains[static_cast<int>(i)]);
    }
    return parts;
  }

  // Moves what each recording has after a time out of the fit.
  std::vector<std::vector<Observation>> HoldBack(double from) {
    std::vector<std::vector<Observation>> later;
    if (!(from < INFINITY)) return later;
    bool any = false;
    for (RecordingInput& recording : fit_.input.recordings) {
      std::vector<Observation>& observations = recording.problem.observations;
      later.push_back(TakeLater(from, &observations));
      any = any || !later.back().empty();
      if (observations.empty()) throw Error("predict_from: expected observations up to this time");
    }
    if (!any) throw Error("predict_from: expected observations after this time");
    std::string error;
    problem_ = MakeProblem(fit_, &error);
    if (problem_ == nullptr) throw Error(error);
    return later;
  }

  void Scale(const std::vector<SensorNoise>& noise,
             std::vector<std::vector<Observation>>* held_back) {
    for (size_t b = 0; b < fit_.input.recordings.size(); ++b) {
      FitProblem& run = fit_.input.recordings[b].problem;
      ScaleSigma(noise, run.instruments, run.channels, &run.observations);
      if (!held_back->empty()) {
        ScaleSigma(noise, run.instruments, run.channels, &(*held_back)[b]);
      }
    }
  }

  // The checkpoint in its file, with what that holds already; null without one.
  std::unique_ptr<FitCheckpoint> Open(const std::string& file) {
    if (file.empty()) return nullptr;
    auto checkpoint = std::make_unique<FitCheckpoint>(fit_.input, [file](const std::string& text) {
      // Renamed when it is whole, so that an interruption leaves the last one.
      const std::string beside = file + ".new";
      const bool written = bool(std::ofstream(beside, std::ios::binary) << text << std::flush);
      std::error_code failed;
      if (written) std::filesystem::rename(beside, file, failed);
      return written && !failed ? std::string() : file + ": cannot be written";
    });
    std::string error;
    std::string text;
    if (!std::filesystem::exists(file)) {
      error = checkpoint->Write();
    } else if (ReadTextFile(file, &text, &error)) {
      error = checkpoint->Restore(text, file);
    }
    if (!error.empty()) throw Error(error);
    return checkpoint;
  }

  static void CheckSameFit(const FitCheckpoint* checkpoint) {
    if (checkpoint == nullptr) return;
    if (checkpoint->mismatch() != 0) throw Error("checkpoint: expected that of this fit");
    if (!checkpoint->error().empty()) throw Error(checkpoint->error());
  }

  FitProgress ProgressOf(const Wanted& wanted) {
    return [this, &wanted](int start, int iteration, const FitIteration& values) {
      CheckInterrupt();
      if (wanted.on_iteration.is_none()) return;
      const py::gil_scoped_acquire gil;
      py::dict parameters;
      for (size_t k = 0; k < values.parameters.size(); ++k) {
        parameters[py::str(problem().entries()[k].name)] = values.parameters[k];
      }
      py::dict said;
      said["start"] = start;
      said["iteration"] = iteration;
      said["cost"] = values.cost;
      said["gradient_norm"] = values.gradient_norm;
      said["parameters"] = parameters;
      said["seconds"] = values.seconds;
      wanted.on_iteration(said);
    };
  }

  // Rows of all blocks, each times the root of its weight; what is wrong, or empty. No Jacobian
  // where that has no rows.
  std::string EvaluateBlocks(const BlockLayout& layout, const Eigen::VectorXd& p,
                             Eigen::VectorXd* values, RowMatrixXd* jacobian) {
    const auto derivatives =
        jacobian->rows() > 0 ? BlockDerivatives::kCompute : BlockDerivatives::kSkip;
    for (int b = 0; b < layout.num_blocks(); ++b) {
      CheckInterrupt();
      BlockEvaluation block;
      if (!problem().EvaluateBlock(b, layout.Local(b, p), fit_.input.options().derivatives,
                                   derivatives, &block)) {
        return problem().BlockName(b) + block.message;
      }
      const double root = std::sqrt(problem().weight(b));
      const Eigen::Index first = layout.row_offset(b);
      values->segment(first, block.residuals.size()) = root * block.residuals;
      for (Eigen::Index k = 0; k < block.jacobian.cols(); ++k) {
        jacobian->col(layout.ParameterOf(b, static_cast<int>(k)))
            .segment(first, block.residuals.size()) = root * block.jacobian.col(k);
      }
    }
    return "";
  }

  FitFile fit_;
  std::unique_ptr<RecordingsProblem> problem_;
  Turns turns_;
};

}  // namespace

void BindFit(py::module_* module) {
  py::class_<FitProblemOf>(*module, "Fit")
      .def(py::init<const std::string&, const std::string&>())
      .def_property_readonly("names", &FitProblemOf::names)
      .def_property_readonly("num_starts", &FitProblemOf::num_starts)
      .def("start", &FitProblemOf::MakeStart)
      .def("profile", &FitProblemOf::MakeProfile)
      .def("chain", &FitProblemOf::MakeChain)
      .def("ranges", &FitProblemOf::Ranges)
      .def("evaluate", &FitProblemOf::Evaluate)
      .def("run",
           [](FitProblemOf& fit, int max_iterations, double predict_from, bool discretisation_check,
              const std::string& checkpoint, const py::object& on_iteration,
              const std::vector<std::string>& profiles, const std::vector<std::string>& starts_done,
              const std::vector<std::string>& profiles_done, const std::string& design,
              const std::string& design_name, bool missing, const std::optional<Sampling>& sampling,
              const std::vector<std::string>& chains_done) {
             std::optional<PosteriorOptions> options;
             if (sampling) options = ReadSampling(*sampling);
             return fit.Run({max_iterations,
                             predict_from,
                             discretisation_check,
                             checkpoint,
                             on_iteration,
                             profiles,
                             design,
                             design_name,
                             {starts_done, profiles, profiles_done, chains_done},
                             missing,
                             options});
           });
}

}  // namespace tangible::python
