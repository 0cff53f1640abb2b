// SPDX-License-Identifier: Apache-2.0
//
// tangible-fit: identifies parameters of a scene from observed positions.

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/app/shards.h"
#include "tangible/estimation/app/fit_overrides.h"
#include "tangible/estimation/app/fit_printer.h"
#include "tangible/estimation/app/fit_shards.h"
#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/fit/motion_check.h"
#include "tangible/estimation/fit/posterior.h"
#include "tangible/estimation/fit/profile.h"
#include "tangible/estimation/fit/variance_components.h"
#include "tangible/estimation/results/design_output.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/fit_schema.h"
#include "tangible/estimation/results/fitted_scene.h"
#include "tangible/estimation/results/iteration_printer.h"
#include "tangible/estimation/results/missing_output.h"
#include "tangible/estimation/results/noise_output.h"
#include "tangible/estimation/results/posterior_output.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/estimation/results/report.h"
#include "tangible/estimation/results/residual_summary.h"
#include "tangible/math/shared_work.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/text_file.h"

DEFINE_string(out, "", "file of the result (JSON); empty: none is written");
DEFINE_string(report, "", "file of the report (HTML); empty: none is written");
DEFINE_string(scene_out, "", "file of the fitted scene (JSON); empty: none is written");
DEFINE_string(predictions, "",
              "file of observed and predicted values and residuals at all times (CSV); empty: none "
              "is written");
DEFINE_double(predict_from, INFINITY,
              "s: fit to the observations up to this time, and score the prediction of later ones");
DEFINE_string(checkpoint, "",
              "file that keeps what is done as the fit goes on; where it is there already the fit "
              "goes on from it, and ends as if it had not been interrupted. It stays when the fit "
              "is done");
DEFINE_bool(discretisation_check, false,
            "fit at dt / 2 too and report the difference as the bias of the step");
DEFINE_bool(compare_motion, false,
            "of scenes with fixed steps: say how far the derivatives at the estimate are from the "
            "motion's, by one run by events beside it");
DEFINE_string(derivatives, "",
              "tangent, adjoint, jet, jet_implicit or finite_difference, instead of the file's");
DEFINE_string(initial, "", "other initial values: name=value, separated by commas");
DEFINE_int32(max_iterations, 50, "of each start");
DEFINE_int32(threads, 0, "that evaluate recordings; 0: one a core; results do not depend on it");
DEFINE_string(profile, "",
              "names of parameters, separated by commas, whose intervals are found by profiles: "
              "the cost with the parameter held, the others minimised");
DEFINE_string(design, "",
              "file of candidates for the next experiment (JSON): which would narrow which "
              "interval by how much");
DEFINE_bool(missing, false,
            "test what would explain the residuals: numbers that are held, absent forces and "
            "instruments, softer joints; the best are fitted for real");
TANGIBLE_DEFINE_SHARD_FLAGS();
DEFINE_string(posterior, "", "N: so many draws from the posterior, by Hamiltonian Monte Carlo");
DEFINE_int32(posterior_chains, 4, "of --posterior, each with a start of its own");
DEFINE_int32(posterior_warm_up, 200, "transitions of each chain before its draws");
DEFINE_int32(posterior_seed, 0, "of the draws");
DEFINE_double(posterior_target, 0.8, "mean acceptance; nearer to 1: shorter steps");
DEFINE_int32(posterior_temperatures, 1,
             "of each chain, 1, 2, 4, ...: more pass between modes, and take as much more time");
DEFINE_string(posterior_samples, "", "file of the draws (CSV); empty: none is written");
DEFINE_string(posterior_scenes, "", "folder of a scene for each draw; empty: none is written");
DEFINE_string(posterior_bands, "", "file of quantiles of predictions over draws (CSV)");

namespace tangible {
namespace {

std::string OverrideDerivatives(FitOptions* options) {
  if (FLAGS_derivatives.empty()) {
    return "";
  }
  for (const GradientMethod method :
       {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJet,
        GradientMethod::kJetImplicit, GradientMethod::kFiniteDifference}) {
    if (FLAGS_derivatives == NameOf(method) && IsAvailable(method)) {
      options->derivatives = method;
      return "";
    }
  }
  return "expected tangent, adjoint, jet, jet_implicit or finite_difference (Jets if built with "
         "them), got '" +
         FLAGS_derivatives + "'";
}

/// A checkpoint in its file, with what that holds already; null without --checkpoint. Returns what
/// is wrong or empty: a file that cannot be written is found before the work, not after it.
std::string OpenCheckpoint(const FitInput& input, std::unique_ptr<FitCheckpoint>* checkpoint) {
  if (FLAGS_checkpoint.empty()) {
    return "";
  }
  *checkpoint = std::make_unique<FitCheckpoint>(input, [](const std::string& text) {
    return WriteFileAtomically(FLAGS_checkpoint, text, Over::kOwnInput);
  });
  std::error_code none;
  const bool exists = std::filesystem::exists(FLAGS_checkpoint, none);
  if (exists && !std::filesystem::is_regular_file(FLAGS_checkpoint, none)) {
    return FLAGS_checkpoint + ": cannot be written: expected a file, got a device or pipe";
  }
  // A rank that is not the first asks that one for the file, and goes on from it like all others.
  const SharedWork* const work = SharedWork::Current();
  const bool asks = work != nullptr && work->rank() > 0;
  std::string text;
  std::string error;
  const bool read = (exists || asks) && ReadTextFile(FLAGS_checkpoint, &text, &error);
  if (exists && !asks && !read) return error;
  if (read) {
    // It is not written again before there is something new: with what a restart takes the fit
    // would not get on where it is often ended.
    return (*checkpoint)->Restore(text, FLAGS_checkpoint);
  }
  return (*checkpoint)->Write();
}

/// One line unless the logs were of these very fits; empty without a checkpoint.
std::string Mismatch(const FitCheckpoint* checkpoint) {
  if (checkpoint == nullptr || checkpoint->mismatch() == 0) {
    return "";
  }
  return FLAGS_checkpoint + ": /fits: evaluation " + std::to_string(checkpoint->mismatch()) +
         " is not the one that this program makes: written by another version or on another "
         "machine; remove the file to begin anew";
}

/// What a fit needs before it begins.
struct Prepared {
  std::optional<PosteriorOptions> sampling;  ///< of --posterior
  std::optional<DesignRequest> design;       ///< of --design
  FitFile fit;
  std::vector<std::vector<Observation>> held_back;  ///< of each recording, after --predict_from
  std::unique_ptr<RecordingsProblem> problem;
  std::unique_ptr<FitCheckpoint> checkpoint;
};

/// Moves what each recording has after --predict_from out of the fit. Returns what is wrong.
std::string HoldBack(Prepared* prepared) {
  bool any = false;
  for (RecordingInput& recording : prepared->fit.input.recordings) {
    std::vector<Observation>& observations = recording.problem.observations;
    prepared->held_back.push_back(TakeLater(FLAGS_predict_from, &observations));
    any = any || !prepared->held_back.back().empty();
    if (observations.empty()) {
      return "expected a time with observations up to it" +
             (recording.name.empty()
                  ? " and after it, got " + Cell(FLAGS_predict_from, 10) + " with none up to it"
                  : " in each recording, got " + Cell(FLAGS_predict_from, 10) + " with none in '" +
                        recording.name + "'");
    }
  }
  const std::string sensor = SensorWithoutObservations(prepared->fit.input);
  if (!sensor.empty()) {
    return "expected a time with observations of sensor \"" + sensor +
           "\", whose sigma is estimated, up to it, got " + Cell(FLAGS_predict_from, 10) +
           " with none";
  }
  return any ? ""
             : "expected a time with observations after it, got " + Cell(FLAGS_predict_from, 10) +
                   " with none after it";
}

/// --posterior and the flags beside it; returns what is wrong or empty.
std::string ReadPosterior(std::optional<PosteriorOptions>* options) {
  if (FLAGS_posterior.empty()) {
    const bool any =
        !(FLAGS_posterior_samples + FLAGS_posterior_scenes + FLAGS_posterior_bands).empty();
    return any ? "--posterior: expected a number of draws beside --posterior_samples, "
                 "--posterior_scenes or --posterior_bands, got none"
               : "";
  }
  const std::vector<int> draws = WholeNumbersAtCommas(FLAGS_posterior, 1, 1000000);
  if (draws.size() != 1) {
    return "--posterior: expected a whole number from 1 to 1000000, got '" + FLAGS_posterior + "'";
  }
  std::string error = FirstOutside(
      {{"--posterior_chains", FLAGS_posterior_chains, 1, 64},
       {"--posterior_warm_up", FLAGS_posterior_warm_up, 0, 1e6},
       {"--posterior_seed", FLAGS_posterior_seed, 0},
       {"--posterior_temperatures", FLAGS_posterior_temperatures, 1, kMostTemperatures},
       {"--posterior_target", FLAGS_posterior_target, 0.01, 0.999}});
  if (!error.empty()) return error;
  *options = {draws[0],
              FLAGS_posterior_chains,
              FLAGS_posterior_warm_up,
              FLAGS_posterior_target,
              static_cast<unsigned>(FLAGS_posterior_seed),
              FLAGS_threads};
  (*options)->temperatures = FLAGS_posterior_temperatures;
  const std::string folder =
      FLAGS_posterior_scenes.empty() ? "" : CheckSceneFolder(FLAGS_posterior_scenes);
  return folder.empty() ? "" : "--posterior_scenes: " + folder;
}

/// The flags' changes of the file; kExitDone, or the status after what is wrong has been printed.
int ApplyFlags(Prepared* prepared) {
  for (RecordingInput& recording : prepared->fit.input.recordings) {
    FitProblem& problem = recording.problem;
    problem.options.max_iterations = FLAGS_max_iterations;
    problem.options.threads = FLAGS_threads;
    std::string error = OverrideInitial(FLAGS_initial, &problem.parameters);
    if (!error.empty()) {
      return ReportError("tangible-fit: --initial: " + error, kExitUsage);
    }
    if (FLAGS_missing) problem.options.missing = MissingPass::kRun;
    error = OverrideDerivatives(&problem.options);
    if (!error.empty()) {
      return ReportError("tangible-fit: --derivatives: " + error, kExitUsage);
    }
  }
  if (FLAGS_predict_from < INFINITY) {
    const std::string error = HoldBack(prepared);
    if (!error.empty()) {
      return ReportError("tangible-fit: --predict_from: " + error, kExitUsage);
    }
  }
  return kExitDone;
}

/// Of recording b: "scene_2.json" for "scene.json"; the name itself of a file with one run.
std::string SceneOut(const RecordingsProblem& problem, int b) {
  if (!problem.IsNamed()) {
    return FLAGS_scene_out;
  }
  const std::filesystem::path path(FLAGS_scene_out);
  const std::string name =
      path.stem().string() + "_" + std::to_string(b) + path.extension().string();
  return (path.parent_path() / name).string();
}

/// Empty, or that a recording's scene would be written over another file, or cannot be written.
std::string SceneOverOther(const RecordingsProblem& problem) {
  for (int b = 0; b < problem.num_blocks() && !FLAGS_scene_out.empty(); ++b) {
    const std::string scene = SceneOut(problem, b);
    const std::vector<std::string> inputs = FilesRead();
    const bool over_input = std::any_of(
        inputs.begin(), inputs.end(), [&](const auto& input) { return IsSameFile(scene, input); });
    std::error_code none;
    if (std::filesystem::is_directory(scene, none)) {
      return "--scene_out: expected files, got " + scene + ", a directory";
    }
    for (const std::string& other :
         {FLAGS_out, FLAGS_report, FLAGS_predictions, FLAGS_checkpoint}) {
      if (over_input || (!other.empty() && IsSameFile(scene, other))) {
        return "--scene_out: expected files of their own, got " + scene +
               (over_input ? ", an input" : " for two outputs");
      }
    }
  }
  return "";
}

/// --design; what is wrong or empty.
std::string ReadDesign(Prepared* prepared) {
  std::string text;
  std::string error;
  if (FLAGS_design.empty() || !ReadTextFile(FLAGS_design, &text, &error)) return error;
  ParseDesign(text, FLAGS_design, prepared->fit.input, *prepared->problem,
              &prepared->design.emplace(), &error);
  return error;
}

/// Reads the file and the flags; the same.
int Prepare(const std::string& text, const std::string& file, Prepared* prepared) {
  std::string error;
  if (!ParseFit(text, file, &prepared->fit, &error)) {
    return ReportError(error);
  }
  const int status = ApplyFlags(prepared);
  if (status != kExitDone) {
    return status;
  }
  prepared->problem = MakeProblem(prepared->fit, &error);
  if (prepared->problem == nullptr) {
    return ReportError(error);
  }
  error =
      RefusedWithNoise(*prepared->problem, {{"--posterior", !FLAGS_posterior.empty()},
                                            {"--design", !FLAGS_design.empty()},
                                            {"--profile", !FLAGS_profile.empty()},
                                            {"--checkpoint", !FLAGS_checkpoint.empty()},
                                            {"--discretisation_check", FLAGS_discretisation_check},
                                            {"--compare_motion", FLAGS_compare_motion},
                                            {"--missing", FLAGS_missing},
                                            {"--shard", !FLAGS_shard.empty()},
                                            {"--merge", !FLAGS_merge.empty()}});
  if (!error.empty()) return ReportError("tangible-fit: " + error, kExitUsage);
  error = ReadProfiles(FLAGS_profile, *prepared->problem,
                       &prepared->fit.input.recordings.front().problem.options);
  if (!error.empty()) return ReportError("tangible-fit: --profile: " + error, kExitUsage);
  error = ReadDesign(prepared);
  if (!error.empty()) return ReportError(error);
  error = ReadPosterior(&prepared->sampling);
  if (!error.empty()) return ReportError("tangible-fit: " + error, kExitUsage);
  if (FLAGS_compare_motion && !HasFixedSteps(prepared->fit.input)) {
    return ReportError(file +
                       ": --compare_motion: expected a scene with fixed steps, got event "
                       "stepping, whose derivatives are those of the motion");
  }
  error = OutputOverInput();
  if (!error.empty()) return ReportError(error, kExitUsage);
  error = SceneOverOther(*prepared->problem);
  if (!error.empty()) return ReportError("tangible-fit: " + error, kExitUsage);
  error = OpenCheckpoint(prepared->fit.input, &prepared->checkpoint);
  return error.empty() ? kExitDone : ReportError(error);
}

/// Returns what went wrong or empty.
std::string WriteFiles(const Prepared& prepared, const FitResult& result,
                       const FitFindings& findings, const MotionCheck* motion) {
  const RecordingsProblem& problem = *prepared.problem;
  const bool estimated = result.estimate.size() > 0;
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = ResultToJson(problem, result, findings);
    json["certificate"] =
        result.certificate.verdict.empty() ? OrderedJson(nullptr) : ToJson(result.certificate);
    if (motion != nullptr) json["motion"] = MotionToJson(problem.entries(), *motion);
    return JsonText(json);
  });
  if (!estimated) {
    return writer.error();
  }
  writer.Write(FLAGS_report,
               [&] { return FitReport(prepared.fit.path, problem, result, findings); });
  writer.Write(FLAGS_predictions, [&] {
    return PredictionCsv(problem, result.residuals, findings.later, findings.held_out);
  });
  if (findings.posterior != nullptr) {
    const Posterior& posterior = *findings.posterior;
    writer.Write(FLAGS_posterior_samples,
                 [&] { return PosteriorCsv(problem.entries(), posterior); });
    writer.Write(FLAGS_posterior_bands, [&] {
      return PosteriorBandsCsv(prepared.fit.input, posterior, findings.later,
                               prepared.problem.get());
    });
    std::string error =
        FLAGS_posterior_scenes.empty()
            ? ""
            : WritePosteriorScenes(FLAGS_posterior_scenes, prepared.fit.input, problem, posterior,
                                   [](const std::string& path, const std::string& text) {
                                     return WriteFileAtomically(path, text);
                                   });
    if (!error.empty()) return error;
  }
  for (int b = 0; b < problem.num_blocks() && !FLAGS_scene_out.empty(); ++b) {
    std::string text;
    std::string error;
    if (!FittedScene(prepared.fit.input.recordings[b].problem,
                     problem.ParametersOf(b, result.estimate), FolderOf(FLAGS_scene_out), &text,
                     &error)) {
      return prepared.fit.path + ": " + problem.BlockName(b) + error;
    }
    writer.Write(SceneOut(problem, b), [&] { return text; });
  }
  return writer.error();
}

/// "; --report not written: there is no estimate" of the files that need one, or empty.
std::string NotWritten(const FitResult& result) {
  std::string flags;
  for (const auto& [flag, path] : {std::pair("--report", &FLAGS_report),
                                   {"--predictions", &FLAGS_predictions},
                                   {"--scene_out", &FLAGS_scene_out}}) {
    if (path->empty() || result.estimate.size() > 0) continue;
    flags.append(flags.empty() ? "; " : ", ").append(flag);
  }
  return flags.empty() ? "" : flags + " not written: there is no estimate";
}

/// The exit status of a fit whose results are written, after a line about what is wrong.
int Conclude(const Prepared& prepared, const FitResult& result, const FitFindings& findings) {
  const std::string& file = prepared.fit.path;
  if (result.status == FitStatus::kNoEffect) {
    const int index = prepared.problem->IndexInRecording(result.parameter);
    return ReportError(file + ": /parameters/" + std::to_string(index) + ": " + result.message +
                       NotWritten(result));
  }
  if (result.status != FitStatus::kConverged) {
    return ReportError(file + ": " + NameOf(result.status) + ": " + result.message +
                       NotWritten(result));
  }
  const DiscretisationCheck* const check = findings.check;
  if (check != nullptr && check->status != FitStatus::kConverged) {
    return ReportError(file + ": the fit at dt / 2: " + NameOf(check->status) + ": " +
                       check->message);
  }
  if (findings.later != nullptr && !findings.later->score.message.empty()) {
    return ReportError(file + ": the run after " + Cell(FLAGS_predict_from, 10) +
                       " s fails: " + findings.later->score.message);
  }
  if (findings.held_out != nullptr) {
    const std::string failure = FirstFailure(*findings.held_out);
    if (!failure.empty()) return ReportError(file + ": " + failure);
  }
  if (findings.design != nullptr) {
    const std::string failure = FirstFailure(*findings.design);
    if (!failure.empty()) return ReportError(file + ": " + failure);
  }
  // Said above: what was asked for is not there.
  const FitCheckpoint* const checkpoint = prepared.checkpoint.get();
  return checkpoint != nullptr && !checkpoint->error().empty() ? kExitFailed : kExitDone;
}

/// The sigma that were found, for what follows the fit.
void ScaleObservations(const std::vector<SensorNoise>& noise, Prepared* prepared) {
  for (size_t b = 0; b < prepared->fit.input.recordings.size(); ++b) {
    FitProblem& problem = prepared->fit.input.recordings[b].problem;
    ScaleSigma(noise, problem.instruments, problem.channels, &problem.observations);
    if (!prepared->held_back.empty()) {
      ScaleSigma(noise, problem.instruments, problem.channels, &prepared->held_back[b]);
    }
  }
}

void PrintResult(const Prepared& prepared, const FitResult& result,
                 const VarianceComponents& components) {
  PrintEstimates(prepared.problem->entries(), result);
  PrintComponents(components);
  std::cout << DescribeProcessNoise(components);
  PrintOutliers(SummarizeResiduals(*prepared.problem, result.residuals));
  const Certificate& certificate = result.certificate;
  if (certificate.verdict.empty()) return;
  const std::string warning = prepared.fit.path + ": warning: ";
  const bool impact = !certificate.discrete_impact.empty();
  if (!IsTrustworthyMap(certificate)) {
    ReportError(warning + "not trustworthy at the estimate: " + certificate.verdict +
                (impact ? std::string("; ") + kMotionInstead : ""));
  } else if (impact) {
    ReportError(warning + AdviceOf(certificate));
  }
}

/// The fit at dt / 2.
DiscretisationCheck CheckStep(const Prepared& prepared, const FitResult& result) {
  std::vector<double> spreads;
  for (const RandomEffect& effect : prepared.problem->effects()) {
    spreads.push_back(effect.spread);
  }
  FitLog* const log = prepared.checkpoint ? prepared.checkpoint->Next() : nullptr;
  return CheckDiscretisation(prepared.fit.input, spreads, result, log);
}

/// How far the derivatives at the estimate are from the motion's, with a line that says so.
MotionCheck CompareMotion(const Prepared& prepared, const FitResult& result) {
  MotionCheck check = CheckMotion(prepared.fit.input, result.estimate, prepared.problem.get());
  if (check.message.empty()) {
    std::cout << "derivatives at the estimate differ from the motion's by up to "
              << Cell(check.difference.size() == 0 ? 0.0 : check.difference.maxCoeff(), 3)
              << " of a parameter's; the motion's: " << check.verdict << "\n";
  }
  return check;
}

/// The chains of a shard of --posterior, around the estimate of the whole fit.
ChainsOfFit ChainsOf(Prepared* prepared) {
  if (!prepared->sampling) return {};
  return {prepared->sampling->chains, [prepared](const std::vector<int>& numbers) {
            std::vector<FinishedChain> chains;
            const FitOptions& options = prepared->fit.input.options();
            VarianceComponents components;
            const FitResult result =
                FitWithComponents(options, prepared->problem.get(), {}, &components, {});
            ScaleObservations(components.noise, prepared);
            if (result.estimate.size() == 0) return chains;
            const RecordingsProblem& problem = *prepared->problem;
            std::string error;
            MakeChains(*prepared->sampling, options, result,
                       FreeCoordinates(problem.entries(), problem.effects()),
                       MakerOf(prepared->fit.input, problem), numbers, &chains, &error);
            return chains;
          }};
}

/// Draws from the posterior, whose intervals become those of the result; what is wrong or empty.
std::string Sample(const Prepared& prepared, const FitParts& parts, FitResult* result,
                   std::optional<Posterior>* posterior) {
  const RecordingsProblem& problem = *prepared.problem;
  const PosteriorOptions& options = *prepared.sampling;
  Progress progress("transitions", TransitionsOf(options));
  Posterior made;
  std::string error;
  if (!SamplePosterior(
          options, prepared.fit.input.options(), *result,
          FreeCoordinates(problem.entries(), problem.effects()),
          MakerOf(prepared.fit.input, problem), [&progress](long done) { progress.Show(done); },
          parts.chains, &made, &error)) {
    return "--posterior: " + error;
  }
  TakeIntervals(made, result);
  *posterior = std::move(made);
  return "";
}

/// What would explain the residuals, where that is asked for, and prints it.
void AskWhatIsMissing(const Prepared& prepared, const FitResult& result,
                      std::optional<MissingResult>* missing) {
  if (prepared.fit.input.options().missing == MissingPass::kSkip) return;
  *missing = FindMissing({}, prepared.fit.input, result, prepared.problem.get());
  std::cout << DescribeMissing(**missing);
}

/// Predicts the recordings that are held out, if any, and prints how well.
void PredictHeld(const FitResult& result, const VarianceComponents& components, Prepared* prepared,
                 std::optional<HeldOutRuns>* held_out) {
  if (prepared->fit.held_out.empty()) return;
  *held_out = PredictHeldOut(prepared->fit.input, *prepared->problem, result.estimate,
                             components.noise, std::move(prepared->fit.held_out));
  std::cout << Describe(**held_out);
}

/// Makes and prints the design of the next experiment that is asked for; an error or empty.
std::string PlanNext(const Prepared& prepared, const FitResult& result,
                     std::optional<Design>* design) {
  if (!prepared.design) return "";
  std::string error = MakeDesign(prepared.fit.input, *prepared.design, result.estimate,
                                 prepared.problem.get(), &design->emplace());
  if (error.empty()) std::cout << DescribeDesign(prepared.problem->entries(), **design);
  return error;
}

/// What is found beside the estimate, each where it is asked for.
struct Extras {
  std::optional<Posterior> posterior;
  std::optional<DiscretisationCheck> check;
  std::optional<PredictedRecordings> later;
  std::optional<HeldOutRuns> held_out;
  std::optional<MissingResult> missing;
  std::optional<Design> design;

  [[nodiscard]] FitFindings View(const VarianceComponents& components) const {
    const auto pointer = [](const auto& value) { return value ? &*value : nullptr; };
    return {&components,       pointer(check),  pointer(later),  pointer(posterior),
            pointer(held_out), pointer(design), pointer(missing)};
  }
};

/// Finds and prints what is asked for beside the estimate of `result`, whose intervals become those
/// of the draws. Returns what leaves nothing to be written, or empty; `unsampled` is what is wrong
/// with the draws alone.
std::string FindExtras(const FitParts& parts, const VarianceComponents& components,
                       Prepared* prepared, FitResult* result, Extras* extras,
                       std::string* unsampled) {
  const bool estimated = result->estimate.size() > 0;
  if (estimated && prepared->sampling) {
    *unsampled = Sample(*prepared, parts, result, &extras->posterior);
  }
  if (estimated) PrintResult(*prepared, *result, components);
  if (extras->posterior) {
    std::cout << DescribePosterior(prepared->problem->entries(), *extras->posterior);
  }
  if (FLAGS_discretisation_check && result->status == FitStatus::kConverged) {
    extras->check = CheckStep(*prepared, *result);
    std::string error = Mismatch(prepared->checkpoint.get());
    if (!error.empty()) return error;
    PrintCheck(prepared->problem->entries(), *extras->check);
  }
  if (!estimated) return "";
  if (!prepared->held_back.empty()) {
    extras->later = PredictLater(prepared->fit.input, *prepared->problem, result->estimate,
                                 FLAGS_predict_from, std::move(prepared->held_back));
    PrintScore(extras->later->score);
  }
  PredictHeld(*result, components, prepared, &extras->held_out);
  AskWhatIsMissing(*prepared, *result, &extras->missing);
  const std::string error = PlanNext(*prepared, *result, &extras->design);
  return error.empty() ? "" : prepared->fit.path + ": --design: " + error;
}

int Run(const std::string& text, const std::string& file, const ShardPlan& plan) {
  Prepared prepared;
  const int status = Prepare(text, file, &prepared);
  if (status != kExitDone) return status;
  FitCheckpoint* const checkpoint = prepared.checkpoint.get();
  const FitOptions& options = prepared.fit.input.options();
  std::string error = plan.part != ShardPlan::Part::kAll ? HashInputs() : "";
  if (error.empty() && plan.IsShard()) {
    error = WriteFitShard(options, ChainsOf(&prepared), plan, FLAGS_out, prepared.problem.get());
    return error.empty() ? kExitDone : ReportError(error);
  }
  FitParts parts;
  FitPartLogs logs(&parts);
  if (error.empty() && plan.IsMerge()) {
    error = MergeFitShards(options, ChainsOf(&prepared).count, plan, &parts);
  }
  if (!error.empty()) return ReportError(error);
  IterationPrinter printer(prepared.problem->entries());
  const FitProgress progress = [&](int start, int iteration, const FitIteration& values) {
    printer.Print(start, iteration, values);
  };
  NextLog next_log;
  if (checkpoint != nullptr) next_log = [checkpoint] { return checkpoint->Next(); };
  if (plan.IsMerge()) next_log = [&logs] { return logs.Next(); };
  VarianceComponents components;
  FitResult result =
      FitWithComponents(options, prepared.problem.get(), progress, &components, next_log);
  ScaleObservations(components.noise, &prepared);
  error = Mismatch(checkpoint);
  if (!error.empty()) return ReportError(error);
  Extras extras;
  std::string unsampled;
  error = FindExtras(parts, components, &prepared, &result, &extras, &unsampled);
  if (!error.empty()) return ReportError(error);
  if (checkpoint != nullptr && !checkpoint->error().empty()) {
    ReportError(checkpoint->error() + ": the fit went on without its checkpoint");
  }
  std::optional<MotionCheck> motion;
  if (FLAGS_compare_motion && result.estimate.size() > 0) motion = CompareMotion(prepared, result);
  const FitFindings findings = extras.View(components);
  error = WriteFiles(prepared, result, findings, motion ? &*motion : nullptr);
  if (error.empty() && motion && !motion->message.empty()) {
    error = file + ": --compare_motion: by events: " + motion->message;
  }
  if (error.empty() && !unsampled.empty()) error = file + ": " + unsampled;
  return error.empty() ? Conclude(prepared, result, findings) : ReportError(error);
}

/// Reads --shard and --merge; returns what is wrong with them or empty.
std::string CheckShardFlags(ShardPlan* plan) {
  std::string wrong = ReadShardFlags(FLAGS_shard, FLAGS_merge, FLAGS_out, plan);
  if (!wrong.empty() || plan->part == ShardPlan::Part::kAll) return wrong;
  if (!FLAGS_checkpoint.empty()) return "--checkpoint: not with --shard or --merge";
  for (const auto& [flag, path] : {std::pair("--report", &FLAGS_report),
                                   {"--predictions", &FLAGS_predictions},
                                   {"--scene_out", &FLAGS_scene_out},
                                   {"--posterior_samples", &FLAGS_posterior_samples},
                                   {"--posterior_bands", &FLAGS_posterior_bands}}) {
    if (plan->IsShard() && !path->empty()) {
      return std::string(flag) + ": not with --shard; --merge writes it";
    }
  }
  return "";
}

/// Whether a fit may have chains, profiles or starts that can be divided, without its observations.
bool MayHaveRows(const std::vector<std::string>& positional) {
  if (!FLAGS_posterior.empty() || !FLAGS_profile.empty()) return true;
  std::string text;
  std::string error;
  Json json;
  if (!ReadTextFile(positional[0], &text, &error) ||
      !ParseJson(text, positional[0], &json, &error) || !json.is_object()) {
    return true;  // what is wrong is said where the fit is read
  }
  const auto starts = json.find("starts");
  return starts != json.end() && *starts != 1;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-fit",
       .synopsis =
           "FIT.json [--out=R.json] [--report=R.html] [--scene_out=S.json]\n"
           "                    [--predictions=P.csv] [--predict_from=T]\n"
           "                    [--discretisation_check] [--compare_motion] [--checkpoint=C.json]\n"
           "                    [--profile=P1,P2] [--missing] [--design=D.json]\n"
           "                    [--posterior=N] [--threads=T]\n"
           "                    [--posterior_samples=P.csv] [--posterior_scenes=FOLDER]\n"
           "                    [--posterior_bands=B.csv]\n"
           "                    [--shard=I/N | --merge=R0.json,R1.json,...]",
       .description =
           "Identifies parameters of a scene from observed positions by nonlinear least squares.\n"
           "Prints each iteration and, for each parameter, the estimate, its standard deviation\n"
           "and 95 % interval.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out", "report", "scene_out", "predictions", "checkpoint", "posterior_samples",
                   "posterior_bands"},
       .inputs = {"design"},
       .runs_in_step = true,
       .may_have_rows = MayHaveRows,
       .schema = [] { return JsonText(FitSchema()); }});
  if (line.exit_status) return *line.exit_status;
  if (FLAGS_max_iterations < 1) {
    return ReportError("tangible-fit: --max_iterations: expected a number >= 1, got " +
                           std::to_string(FLAGS_max_iterations),
                       kExitUsage);
  }
  const std::string outside = FirstOutside({{"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return ReportError("tangible-fit: " + outside, kExitUsage);
  ShardPlan plan;
  const std::string wrong = CheckShardFlags(&plan);
  if (!wrong.empty()) return ReportError("tangible-fit: " + wrong, kExitUsage);
  if (std::isnan(FLAGS_predict_from)) {
    return ReportError("tangible-fit: --predict_from: expected a time in s, got nan", kExitUsage);
  }
  const std::string& file = line.positional[0];
  std::string text;
  std::string error;
  if (!ReadTextFile(file, &text, &error)) {
    return ReportError(error);
  }
  return Run(text, file, plan);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
