// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <sstream>
#include <utility>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"
#include "tangible/verification/support/coincidences.h"
#include "tangible/verification/support/random_scene.h"
#include "tangible/verification/support/random_starts.h"

namespace tangible {
namespace {

constexpr int kMostRandomParameters = 24;
constexpr int kMostOfEventRuns = 10;  // which take longer
// Of the entry: rounding of the engine's moments, and of the known sides, by two orders.
constexpr double kCoincidenceTolerance = 1e-9;

std::string Replay(const VerifyJob& job) {
  if (job.seed) {
    return std::string("tangible-verify ") +
           (job.list == RandomList::kStarts         ? "--starts=1"
            : job.list == RandomList::kCoincidences ? "--coincidences=1"
                                                    : "--random=1") +
           " --seed=" + std::to_string(*job.seed) +
           " --stepping=" + NameOf(job.stepping, kSteppingNames);
  }
  return "tangible-verify " + job.scene.path;
}

// The derivatives of a coincidence, where its motion is known: of both sides, and where they agree.
std::optional<ClosedFormJacobian> KnownOf(const Coincidence& coincidence) {
  KnownSides sides = SidesOf(coincidence);
  if (sides.plus.size() == 0) return std::nullopt;
  ClosedFormJacobian known;
  known.tolerance = kCoincidenceTolerance;
  known.jacobian = 0.5 * (sides.plus + sides.minus);
  for (Eigen::Index p = 0; p < known.jacobian.cols(); ++p) {
    const double largest =
        std::max(sides.plus.col(p).cwiseAbs().maxCoeff(), sides.minus.col(p).cwiseAbs().maxCoeff());
    for (Eigen::Index o = 0; o < known.jacobian.rows(); ++o) {
      const double apart = std::abs(sides.plus(o, p) - sides.minus(o, p));
      if (apart > kCoincidenceTolerance * largest) known.jacobian(o, p) = kUnknown;
    }
  }
  known.values = std::move(sides.values);
  known.plus = std::move(sides.plus);
  known.minus = std::move(sides.minus);
  return known;
}

CheckedJob CheckCoincidence(const VerifyJob& job, KeepJacobians keep) {
  CheckedJob checked;
  const Coincidence coincidence = RandomCoincidence(*job.seed, job.stepping);
  checked.check = CheckScene(coincidence.scene, coincidence.parameters, keep, KnownOf(coincidence));
  checked.check.replay = Replay(job);
  if (checked.check.done) {
    checked.coverage = CoverageOf(coincidence.scene, TraceRun(coincidence.scene));
    for (const std::string& kind : coincidence.kinds) {
      checked.coverage[kind] = 1;
    }
  }
  return checked;
}

CheckedJob Check(const VerifyJob& job, KeepJacobians keep) {
  if (job.seed && job.list == RandomList::kCoincidences) return CheckCoincidence(job, keep);
  CheckedJob checked;
  const Scene scene = SceneOf(job);
  const std::vector<ParameterPath> parameters = !job.seed ? job.parameters
                                                : job.list == RandomList::kStarts
                                                    ? StartParameters(scene)
                                                    : RandomParameters(scene, *job.seed);
  checked.check = CheckScene(scene, parameters, keep);
  checked.check.replay = Replay(job);
  if (checked.check.done) {
    checked.coverage = CoverageOf(scene, TraceRun(scene));
  }
  return checked;
}

void AddWorst(const SceneCheck& check, int scene,
              std::vector<std::pair<int, CheckedEntry>>* worst) {
  for (const CheckedEntry& entry : check.worst) {
    worst->emplace_back(scene, entry);
  }
  std::stable_sort(worst->begin(), worst->end(),
                   [](const auto& x, const auto& y) { return x.second.ratio > y.second.ratio; });
  if (worst->size() > kMostWorst) {
    worst->erase(worst->begin() + kMostWorst, worst->end());
  }
}

}  // namespace

Scene SceneOf(const VerifyJob& job) {
  if (!job.seed) {
    return job.scene;
  }
  if (job.list == RandomList::kCoincidences) {
    return RandomCoincidence(*job.seed, job.stepping).scene;
  }
  if (job.list == RandomList::kStarts) {
    return RandomStart(*job.seed, job.stepping);
  }
  RandomSceneOptions options;
  options.stepping = job.stepping;
  return RandomScene(*job.seed, options);
}

std::vector<VerifyJob> RandomJobs(RandomList list, unsigned seed, int count,
                                  const std::vector<Stepping>& steppings) {
  std::vector<VerifyJob> jobs;
  for (int i = 0; i < count; ++i) {
    for (const Stepping stepping : steppings) {
      VerifyJob job;
      job.seed = seed + static_cast<unsigned>(i);
      job.list = list;
      job.stepping = stepping;
      jobs.push_back(std::move(job));
    }
  }
  return jobs;
}

std::vector<ParameterPath> AllParameters(const Scene& scene) {
  Scene copy = scene;
  std::vector<ParameterPath> parameters;
  for (const SceneNumber<double>& number : EnumerateNumbers(&copy)) {
    std::string error;
    ParameterPath path;
    // A number that no path may set (the angle of a joint in a loop) is left out.
    if (ResolveParameter(scene, number.path, &path, &error)) {
      parameters.push_back(std::move(path));
    }
  }
  return parameters;
}

std::vector<ParameterPath> RandomParameters(const Scene& scene, unsigned seed) {
  std::vector<ParameterPath> chosen = AllParameters(scene);
  RandomNumbers random(seed);
  const int most =
      scene.simulation.stepping == Stepping::kEvent ? kMostOfEventRuns : kMostRandomParameters;
  while (static_cast<int>(chosen.size()) > most) {
    chosen.erase(chosen.begin() + random.Integer(0, static_cast<int>(chosen.size()) - 1));
  }
  for (const char* several : {"bodies/*/mass", "bodies/*/friction"}) {
    std::string error;
    ParameterPath path;
    if (ResolveParameter(scene, several, &path, &error)) {
      chosen.push_back(std::move(path));
    }
  }
  return chosen;
}

std::vector<CheckedJob> CheckJobs(const std::vector<VerifyJob>& jobs, int threads,
                                  KeepJacobians keep, const std::function<void(long)>& progress) {
  std::vector<CheckedJob> checked(jobs.size());
  std::mutex mutex;
  long done = 0;
  WorkerPool pool(threads);
  pool.Run(jobs.size(), threads, [&](size_t i, int /*thread*/) {
    checked[i] = Check(jobs[i], keep);
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) {
      progress(done);
    }
  });
  return checked;
}

VerifyResult Summarize(const std::vector<VerifyJob>& jobs, std::vector<CheckedJob> checked) {
  VerifyResult result;
  result.total.kind = "all";
  std::map<std::string, KindRow> kinds;
  for (size_t i = 0; i < checked.size(); ++i) {
    SceneCheck& check = checked[i].check;
    Add(checked[i].coverage, &result.coverage);
    result.not_run += check.done ? 0 : 1;
    result.total.Add(check.total);
    for (const KindRow& row : check.rows) {
      KindRow& sum = kinds[row.kind];
      sum.kind = row.kind;
      sum.Add(row);
      sum.zero_columns.clear();
    }
    AddWorst(check, static_cast<int>(i), &result.worst);
    result.scenes.push_back(std::move(check));
  }
  for (auto& [kind, row] : kinds) {
    result.kinds.push_back(std::move(row));
  }
  for (const auto& [scene, entry] : result.worst) {
    result.worst_scenes[scene] = SceneToJson(SceneOf(jobs[scene]));
  }
  result.exceptions_named = result.total.named;
  result.exceptions_other = result.total.other_solution;
  result.exceptions_unexplained = result.total.unexplained;
  return result;
}

VerifyResult RunVerification(const std::vector<VerifyJob>& jobs, int threads, KeepJacobians keep,
                             const std::function<void(long)>& progress) {
  return Summarize(jobs, CheckJobs(jobs, threads, keep, progress));
}

std::string BrokenBound(const std::vector<VerifyJob>& jobs, const VerifyResult& result) {
  std::ostringstream line;
  for (const SceneCheck& scene : result.scenes) {
    if (!scene.wrong_value.empty()) {
      return scene.name + ": " + scene.wrong_value + " (" + scene.replay + ")";
    }
  }
  for (const SceneCheck& scene : result.scenes) {
    for (const CheckedException& exception : scene.exceptions) {
      if (exception.unexplained()) {
        line << result.exceptions_unexplained << " unexplained entries; first " << scene.name
             << ", " << exception.parameter << ", " << kMethodPairs[exception.pair].name << ": "
             << exception.what << " (" << scene.replay << ")";
        return line.str();
      }
    }
  }
  int random_not_run = 0;
  int random = 0;
  for (size_t i = 0; i < jobs.size(); ++i) {
    const SceneCheck& scene = result.scenes[i];
    random += jobs[i].seed ? 1 : 0;
    random_not_run += jobs[i].seed && !scene.done ? 1 : 0;
    if (!jobs[i].seed && !scene.done) {
      return scene.message;
    }
  }
  // With few scenes a single failure may exceed this fraction.
  if (random_not_run > std::max(1.0, std::ceil(kMostNotRun * random))) {
    line << random_not_run << " of " << random << " random scenes do not run, expected at most "
         << 100.0 * kMostNotRun << " %";
  }
  return line.str();
}

}  // namespace tangible
