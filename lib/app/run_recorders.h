// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The outputs of a run of tangible-simulate, and the CPU time that recording took.
//
// Reading the process's CPU clock is a system call of about a microsecond, while a step of a small
// scene takes five. Therefore it is read only where the summary reports the time of the steps, and
// there only around work that takes long enough: rows that are written, and the summary's figures
// for many steps at once.

#include <optional>

#include "tangible/app/observation_csv.h"
#include "tangible/app/run_summary.h"
#include "tangible/app/trajectory_csv.h"
#include "tangible/render/recorder/view_recorder.h"
#include "tangible/simulation/certificate/certify.h"

namespace tangible {

/// CPU time of the process with all its threads, s.
double CpuSeconds();

/// Each member is set if the user asked for it.
struct RunRecorders {
  std::optional<TrajectoryCsv> trajectory;
  std::optional<ContactsCsv> contacts;
  std::optional<ObservationCsv> observations;
  std::optional<ViewRecorder> view;
  std::optional<RunSummary> summary;
  std::optional<RolloutCertifier> certifier;

  /// The clock, s; tests replace it.
  double (*clock)() = &CpuSeconds;
  /// CPU time that recording took, s; 0 without a summary, because only the summary uses it.
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
