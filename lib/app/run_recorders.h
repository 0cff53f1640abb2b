// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a run of tangible-simulate writes, and how much CPU time recording took.
//
// Reading the process's CPU clock is a call of the system, a microsecond or so, and a step of a
// small scene takes five. So it is read only where the summary reports the steps' own time, and
// there only around what is worth timing: rows that are written, and the summary's figures of many
// steps at once.

#include <optional>

#include "tangible/app/observation_csv.h"
#include "tangible/app/run_summary.h"
#include "tangible/app/trajectory_csv.h"
#include "tangible/app/view_recorder.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {

/// CPU time of the process with all its threads, s.
double CpuSeconds();

/// Each member is there if it was asked for.
struct RunRecorders {
  std::optional<TrajectoryCsv> trajectory;
  std::optional<ContactsCsv> contacts;
  std::optional<ObservationCsv> observations;
  std::optional<ViewRecorder> view;
  std::optional<RunSummary> summary;
  std::optional<RolloutCertifier> certifier;

  /// s; a test has its own.
  double (*clock)() = &CpuSeconds;
  /// CPU time that recording took, s; 0 without a summary, which is where it counts.
  double seconds = 0.0;

  /// The state after k steps, at time t; `stepper` is null for the initial one.
  void Add(const Model<double>& model, long k, double t, const State<double>& state,
           Stepper* stepper);

 private:
  bool WritesRows(long k, double t, const Stepper* stepper) const;
  void Record(const Model<double>& model, long k, double t, const State<double>& state,
              Stepper* stepper);
};

}  // namespace tangible
