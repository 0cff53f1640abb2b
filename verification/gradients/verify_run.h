// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The check of many scenes, on one or more threads, and whether its bounds hold.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/verification/gradients/coverage.h"
#include "tangible/verification/gradients/scene_check.h"

namespace tangible {

/// The list to which a random scene belongs: random_scene.h, random_starts.h or coincidences.h.
enum class RandomList { kScenes, kStarts, kCoincidences };

/// A scene to be checked: a random one by its seed, or one of the user's.
struct VerifyJob {
  std::optional<unsigned> seed;
  RandomList list = RandomList::kScenes;
  Stepping stepping = Stepping::kFixed;  ///< of a random scene
  Scene scene;                           ///< of the user; with its path
  std::vector<ParameterPath> parameters;
};

/// The job's scene.
Scene SceneOf(const VerifyJob& job);

/// Jobs for `count` random scenes from `seed` on, each in every stepping of the list.
std::vector<VerifyJob> RandomJobs(RandomList list, unsigned seed, int count,
                                  const std::vector<Stepping>& steppings);

/// All numbers of a scene, a path each.
std::vector<ParameterPath> AllParameters(const Scene& scene);

/// At most 24 of a random scene's numbers, and two paths that set several numbers at once.
std::vector<ParameterPath> RandomParameters(const Scene& scene, unsigned seed);

struct VerifyResult {
  std::vector<SceneCheck> scenes;  ///< in the order of the jobs
  Coverage coverage;               ///< of the scenes that ran
  KindRow total;
  std::vector<KindRow> kinds;  ///< over all scenes
  /// The worst entries of all scenes, and the scene of each.
  std::vector<std::pair<int, CheckedEntry>> worst;
  std::map<int, std::string> worst_scenes;  ///< those scenes as JSON
  long exceptions_named = 0, exceptions_other = 0, exceptions_unexplained = 0;  ///< entries
  int not_run = 0;  ///< scenes whose own rollout fails
};

/// At most this fraction of random scenes may fail to run: for example a body between a kinematic
/// body and a floor that approach each other cannot move.
inline constexpr double kMostNotRun = 0.03;

/// What was found of one job.
struct CheckedJob {
  SceneCheck check;
  Coverage coverage;  ///< empty where the scene does not run
};

/// Checks all jobs, in their order; as RunVerification.
std::vector<CheckedJob> CheckJobs(const std::vector<VerifyJob>& jobs, int threads,
                                  KeepJacobians keep, const std::function<void(long)>& progress);

/// The result of jobs that were checked.
VerifyResult Summarize(const std::vector<VerifyJob>& jobs, std::vector<CheckedJob> checked);

/// Both. The same result for any number of threads. `progress` may be empty; it is called from any
/// thread, never from two at once, with the number of scenes that are done.
VerifyResult RunVerification(const std::vector<VerifyJob>& jobs, int threads, KeepJacobians keep,
                             const std::function<void(long)>& progress);

/// Empty if every bound holds, else one line.
std::string BrokenBound(const std::vector<VerifyJob>& jobs, const VerifyResult& result);

}  // namespace tangible
