// SPDX-License-Identifier: Apache-2.0
//
// tangible-gradient: the final state of a scene, or a loss of it, differentiated with respect to
// parameters.

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <string>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"
#include "tangible/simulation/gradient/compare_motion.h"
#include "tangible/simulation/gradient/gradient.h"

DEFINE_string(parameters, "", "paths of the parameters, separated by commas");
DEFINE_string(method, "auto",
              "auto (adjoint for a loss or more parameters than outputs, else tangent), adjoint, "
              "tangent, jet, jet_implicit or finite_difference");
DEFINE_string(side, "both",
              "at kinks: both (one element of the generalised Jacobian), or the one-sided "
              "derivatives for growing (plus) or shrinking (minus) parameters; by the tangent");
DEFINE_double(step, 0.0, "of finite differences, in the parameter's unit; 0: 6e-6 max(|p|, scale)");
DEFINE_string(loss, "", "file of a scalar loss (JSON) to differentiate instead of the final state");
DEFINE_bool(compare_motion, false,
            "of a scene with fixed steps: differentiates its motion by events too, and says how "
            "far the derivative of the fixed steps is from that");
DEFINE_string(
    radius, "auto",
    "how far each parameter may be changed until another discrete choice is made, and the "
    "growth of the flow, in the certificate: true, false, or auto: of at most 20 "
    "parameters, as each takes two runs");
DEFINE_int32(repeat, 1, "runs, of which the best times are reported");
DEFINE_string(factorisations, "keep", "of the adjoint's steps: keep, or recompute to save memory");
DEFINE_string(
    checkpoint, "all",
    "records of the adjoint: all; every:K, a checkpoint every K steps, from which the steps "
    "between are run again; budget:MIB, as fast as so much memory (2^20 bytes) lets it be");
DEFINE_string(out, "", "file of the result; empty: stdout");

namespace tangible {
namespace {

// Of more parameters the radius is computed only where it is asked for.
constexpr size_t kParametersWithRadius = 20;

// Whether a flag is given that only the adjoint uses, whatever its value.
bool AsksForTheAdjoint() {
  const auto written = [](const char* flag) {
    return !gflags::GetCommandLineFlagInfoOrDie(flag).is_default;
  };
  return written("checkpoint") || written("factorisations");
}

// Empty, or one line about a flag's value.
std::string CheckFlags(GradientOptions* options) {
  if (!FindMethod(FLAGS_method, &options->method)) {
    return "--method: expected auto, adjoint, tangent, jet, jet_implicit or finite_difference, "
           "got '" +
           FLAGS_method + "'";
  }
  if (FLAGS_factorisations != "keep" && FLAGS_factorisations != "recompute") {
    return "--factorisations: expected keep or recompute, got '" + FLAGS_factorisations + "'";
  }
  if (FLAGS_side != "both" && FLAGS_side != "plus" && FLAGS_side != "minus") {
    return "--side: expected both, plus or minus, got '" + FLAGS_side + "'";
  }
  if (FLAGS_side != "both" && options->method != GradientMethod::kTangent &&
      options->method != GradientMethod::kAuto) {
    return "--side: expected --method=tangent or auto with it, got '" + FLAGS_method + "'";
  }
  if (FLAGS_radius != "auto" && FLAGS_radius != "true" && FLAGS_radius != "false") {
    return "--radius: expected auto, true or false, got '" + FLAGS_radius + "'";
  }
  std::string wrong = FirstOutside({{"--step", FLAGS_step, 0}, {"--repeat", FLAGS_repeat, 1}});
  if (!wrong.empty()) return wrong;
  if (!ParseCheckpointing(FLAGS_checkpoint, &options->checkpointing, &wrong)) {
    return "--checkpoint: " + wrong;
  }
  const std::vector<std::string> paths = SplitAtCommas(FLAGS_parameters);
  if (std::find(paths.begin(), paths.end(), "") != paths.end()) {
    return "--parameters: expected paths separated by commas, got '" + FLAGS_parameters + "'";
  }
  if (options->method == GradientMethod::kAuto && FLAGS_side == "both" && AsksForTheAdjoint()) {
    options->method = GradientMethod::kAdjoint;
  }
  const bool few = paths.size() <= kParametersWithRadius;
  options->radius = FLAGS_radius == "true" || (FLAGS_radius == "auto" && few) ? RadiusPass::kRun
                                                                              : RadiusPass::kSkip;
  options->step = FLAGS_step;
  options->side = FLAGS_side == "plus"    ? DerivativeSide::kPlus
                  : FLAGS_side == "minus" ? DerivativeSide::kMinus
                                          : DerivativeSide::kBoth;
  options->repeat = FLAGS_repeat;
  options->factorisations =
      FLAGS_factorisations == "keep" ? Factorisations::kKeep : Factorisations::kRecompute;
  return "";
}

LossTerm ReadTerm(const JsonReader& json, const std::vector<std::string>& outputs) {
  json.ExpectKeys({"output", "target", "weight"}, " of a term");
  LossTerm term;
  const JsonReader output = json.At("output");
  term.output = output.String();
  if (std::find(outputs.begin(), outputs.end(), term.output) == outputs.end()) {
    output.FailExpected("an output such as " + (outputs.empty() ? "ball/x" : outputs[0]));
  }
  if (json.Has("target")) term.target = json.At("target").Number();
  if (json.Has("weight")) term.weight = json.At("weight").Number();
  return term;
}

// Empty, or one line.
std::string ReadLoss(const std::string& file, const std::vector<std::string>& outputs,
                     std::vector<LossTerm>* terms) {
  Json json;
  std::string error;
  if (!ParseJsonFile(file, &json, &error)) return error;
  JsonErrors errors(file);
  const JsonReader root(json, &errors);
  root.ExpectKeys({"terms"});
  const JsonReader list = root.At("terms");
  const int count = list.ExpectArray("an array of terms");
  if (count == 0) list.Fail("expected at least one term, got none");
  for (int i = 0; i < count; ++i) terms->push_back(ReadTerm(list.At(i), outputs));
  return errors.message();
}

OrderedJson ToJson(const VectorX<double>& values) {
  return std::vector<double>(values.data(), values.data() + values.size());
}

// The loss and its gradient, or the Jacobian, as keys of the object.
void AddDerivative(const GradientResult& result, OrderedJson* text) {
  if (!FLAGS_loss.empty()) {
    (*text)["loss"] = result.loss;
    (*text)["gradient"] = ToJson(result.gradient);
    return;
  }
  OrderedJson& rows = (*text)["jacobian"] = OrderedJson::array();
  for (Eigen::Index i = 0; i < result.jacobian.rows(); ++i) {
    rows.push_back(ToJson(VectorX<double>(result.jacobian.row(i).transpose())));
  }
}

OrderedJson Describe(const MotionComparison& comparison) {
  if (!comparison.done) return {{"message", comparison.message}};
  OrderedJson text = {{"values", ToJson(comparison.motion.values)}};
  AddDerivative(comparison.motion, &text);
  text["difference_max"] = comparison.difference_max;
  if (!comparison.parameter.empty()) {
    OrderedJson& at = text["difference_at"] = OrderedJson::object();
    if (!comparison.output.empty()) at["output"] = comparison.output;
    at["parameter"] = comparison.parameter;
  }
  text["verdict"] = comparison.motion.certificate.verdict;
  return text;
}

OrderedJson Describe(const GradientResult& result) {
  OrderedJson text = {{"method", NameOf(result.method)},
                      {"requested_method", FLAGS_method},
                      {"parameters", SplitAtCommas(FLAGS_parameters)},
                      {"outputs", result.outputs},
                      {"values", ToJson(result.values)},
                      {"certificate", ToJson(result.certificate)},
                      {"notes", result.notes},
                      {"seconds", result.seconds},
                      {"rollout_seconds", result.rollout_seconds}};
  if (result.method == GradientMethod::kAdjoint) {
    text["tape_bytes"] = result.tape_bytes;
    text["steps_again"] = result.steps_again;
  }
  AddDerivative(result, &text);
  return text;
}

// Empty, or one line: derivatives of numbers near 1e308 or 1e-308 may overflow.
std::string CheckFinite(const std::string& file, const GradientResult& result) {
  const bool finite = result.values.allFinite() && result.jacobian.allFinite() &&
                      result.gradient.allFinite() &&
                      (FLAGS_loss.empty() || std::isfinite(result.loss));
  return finite ? "" : file + ": expected finite derivatives, got one beyond what numbers hold";
}

int Run(const std::string& file, const GradientOptions& options) {
  Scene scene;
  std::string error;
  if (!LoadScene(file, &scene, &error)) return ReportError(error);
  std::vector<ParameterPath> parameters;
  for (const std::string& path : SplitAtCommas(FLAGS_parameters)) {
    if (!ResolveParameter(scene, path, &parameters.emplace_back(), &error)) {
      return ReportError(error.insert(0, ": ").insert(0, file));
    }
  }
  if (FLAGS_compare_motion && scene.simulation.stepping == Stepping::kEvent) {
    return ReportError(file +
                       ": /simulation/stepping: expected fixed with --compare_motion, got "
                       "event, whose derivative is that of the motion");
  }
  error = OutputOverInput();
  if (!error.empty()) return ReportError(error, kExitUsage);
  GradientResult result;
  std::vector<LossTerm> terms;
  if (FLAGS_loss.empty()) {
    result = FinalStateJacobian(scene, parameters, options);
  } else {
    error = ReadLoss(FLAGS_loss, OutputNames(*BuildStructure(scene)), &terms);
    if (!error.empty()) return ReportError(error);
    result = LossGradient(scene, parameters, terms, options);
  }
  if (!result.done) return ReportError(result.message);
  error = CheckFinite(file, result);
  if (!error.empty()) return ReportError(error);
  OrderedJson text = Describe(result);
  std::string failed;
  if (FLAGS_compare_motion) {
    const MotionComparison comparison =
        CompareWithMotion(scene, parameters, terms, options, result);
    text["motion"] = Describe(comparison);
    if (!comparison.done) failed = "--compare_motion: by events: " + comparison.message;
  }
  error = WriteResult(FLAGS_out, JsonText(text));
  if (!error.empty()) return ReportError(error);
  if (!result.open_joint.empty()) ReportError(file + ": warning: " + result.open_joint);
  return failed.empty() ? kExitDone : ReportError(failed);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-gradient",
       .synopsis = "SCENE.json --parameters=P1,P2 "
                   "[--method=auto|adjoint|tangent|jet|jet_implicit|finite_difference] [--step=H] "
                   "[--side=plus|minus] [--loss=L.json] [--radius=auto|true|false] "
                   "[--compare_motion] [--out=G.json]",
       .description = "Differentiates the final state of every moving body, or with --loss a "
                      "scalar of it, with respect to\nparameters of the scene, and certifies the "
                      "result.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .inputs = {"loss"}});
  if (line.exit_status) return *line.exit_status;
  GradientOptions options;
  const std::string wrong = CheckFlags(&options);
  if (!wrong.empty()) {
    return ReportError("tangible-gradient: " + wrong, kExitUsage);
  }
  if (FLAGS_step > 0.0 && options.method != GradientMethod::kFiniteDifference) {
    ReportError(line.positional[0] +
                ": warning: --step does nothing without --method=finite_difference");
  }
  try {
    return Run(line.positional[0], options);
  } catch (const std::bad_alloc&) {
    return ReportError(line.positional[0] +
                       ": not enough memory: the adjoint keeps the records of all steps, and "
                       "needs less with --checkpoint=budget:MIB; the certificate's radius keeps "
                       "their choices, and needs nothing with --radius=false; a tangent needs less "
                       "with fewer --parameters at once");
  }
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
