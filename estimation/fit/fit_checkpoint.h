// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A checkpoint of a fit: what is needed to go on after an interruption and end at the same bits.
//
//   "tangible-fit checkpoint 4 <hash of the content>\n", then in CBOR
//   {"problem": hash, "fits": [the fit, the fit at dt / 2]}
//
// Of each fit it keeps the starts that are finished (how they ended, and all of the best one), the
// point at which windows or multiple shooting arrived, and the evaluations (evaluation_log.h) of
// the part of a start under way: those of the search for the first point, then costs and the
// factors of the blocks (linearisation.h), whose size does not grow with the number of
// observations, up to EvaluationLog::kMaxNumbers. CBOR holds doubles as they are. A checkpoint
// whose content is
// damaged, or that belongs to another problem (scene, parameters, observations, options), is
// refused.

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/problem/evaluation_log.h"

namespace tangible {

/// What is kept of one fit.
struct FitLog {
  EvaluationLog search;                   ///< of a first point where every parameter does something
  std::vector<FitStart> starts;           ///< finished
  Minimum best;                           ///< of these
  std::optional<Minimum> first;           ///< of the start under way: of its first approach
  std::optional<FitApproachResult> shot;  ///< of the start under way: where an approach led
  EvaluationLog start;           ///< of the start under way, since the last part of it ended
  long rollouts = 0;             ///< when the last part of a start ended
  std::function<void()> on_end;  ///< called at the end of each part of a start

  /// Not 0: the number of an evaluation that was not where the log has it.
  long mismatch() const { return search.mismatch() > 0 ? search.mismatch() : start.mismatch(); }
};

/// Of everything that determines a fit's result.
std::uint64_t Fingerprint(const FitProblem& problem);

class FitCheckpoint {
 public:
  /// Puts the text of a checkpoint into its file; returns an error or empty.
  using Writer = std::function<std::string(const std::string& text)>;

  FitCheckpoint(const FitProblem& problem, Writer writer);
  FitCheckpoint(const FitCheckpoint&) = delete;
  FitCheckpoint& operator=(const FitCheckpoint&) = delete;

  /// Takes over what a file holds. Returns one line "file: what, expected, got", or empty.
  std::string Restore(const std::string& text, const std::string& file);

  FitLog& fit() { return fits_[0]; }
  FitLog& half_step() { return fits_[1]; }

  std::string Text() const;

  /// Writes the file now; returns an error or empty.
  std::string Write();
  /// What the first write that failed on the way said; empty: none did.
  const std::string& error() const { return error_; }

 private:
  /// Unless a write failed before.
  void WriteOnTheWay();
  /// And unless writing would take more than a tenth of the time.
  void WriteNowAndThen();

  std::uint64_t problem_ = 0;
  Writer writer_;
  std::array<FitLog, 2> fits_;
  std::string error_;
  std::chrono::steady_clock::time_point written_{};
  std::chrono::steady_clock::duration write_time_{};
};

}  // namespace tangible
