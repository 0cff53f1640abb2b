// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A checkpoint of a fit: the data with which a fit continues after an interruption and ends with
// the same bits.
//
//   "tangible-fit checkpoint 7 <hash of the content>\n", then in CBOR
//   {"problem": hash, "fits": [the first fit, the next, ...]}
//
// Fits follow each other where standard deviations of noise or spreads are estimated
// (variance_components.h), and the last is the one at dt / 2. Of each fit it keeps the starts that
// are finished (how they ended, and all of the best one), the
// point at which windows or multiple shooting arrived, and the evaluations (evaluation_log.h) of
// the part of a start under way: those of the search for the first point, then costs and the
// factors of the blocks (linearisation.h), whose size does not grow with the number of
// observations, up to EvaluationLog::kMaxNumbers. CBOR holds doubles as they are. A checkpoint
// whose content is
// damaged, or that belongs to another problem (scene, parameters, observations, options), is
// refused.

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/evaluation_log.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct FitParts;  // fit_parts.h

/// What is kept of one fit.
struct FitLog {
  EvaluationLog search;                   ///< of a first point where every parameter does something
  std::vector<FitStart> starts;           ///< finished
  Minimum best;                           ///< of these
  std::vector<Minimum> reached;           ///< of the start under way: of approaches that ended
  std::optional<FitApproachResult> shot;  ///< of the start under way: where an approach led
  EvaluationLog start;           ///< of the start under way, since the last part of it ended
  long rollouts = 0;             ///< when the last part of a start ended
  std::function<void()> on_end;  ///< called at the end of each part of a start
  /// What is taken over from elsewhere (fit_parts.h); with it nothing is kept here for a restart.
  FitParts* parts = nullptr;

  /// If not 0, the number of an evaluation that was at another point than that in the log.
  long mismatch() const { return search.mismatch() > 0 ? search.mismatch() : start.mismatch(); }
};

/// A hash of everything that determines the result of a fit.
std::uint64_t Fingerprint(const FitInput& input);

class FitCheckpoint {
 public:
  /// Puts the text of a checkpoint into its file; returns an error or empty.
  using Writer = std::function<std::string(const std::string& text)>;

  FitCheckpoint(const FitInput& input, Writer writer);
  FitCheckpoint(const FitCheckpoint&) = delete;
  FitCheckpoint& operator=(const FitCheckpoint&) = delete;

  /// Takes over what a file holds. Returns one line "file: what, expected, got", or empty.
  std::string Restore(const std::string& text, const std::string& file);

  /// The log of the next fit.
  FitLog* Next();
  /// If not 0, the number of an evaluation that was at another point than that in its log.
  long mismatch() const;

  std::string Text() const;

  /// Writes the file now; returns an error or empty.
  std::string Write();
  /// The message of the first write that failed; empty where none did.
  const std::string& error() const { return error_; }

 private:
  /// Writes the file, unless a write has failed before.
  void WriteOnTheWay();
  /// The same, unless writing would take more than a tenth of the time.
  void WriteNowAndThen();

  std::uint64_t problem_ = 0;
  Writer writer_;
  /// A log whose changes are written.
  FitLog* Add();

  std::deque<FitLog> fits_;  ///< logs do not move
  size_t next_ = 0;
  std::string error_;
  std::chrono::steady_clock::time_point written_{};
  std::chrono::steady_clock::duration write_time_{};
};

}  // namespace tangible
