// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/run_recorders.h"

#include <ctime>

namespace tangible {

double CpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / 1e9;
}

bool RunRecorders::WritesRows(long k, double t, const Stepper* stepper) const {
  return (trajectory && trajectory->Writes(k)) || (observations && observations->Writes(t)) ||
         view.has_value() || (stepper != nullptr && (contacts || certifier));
}

void RunRecorders::Record(const Model<double>& model, long k, double t, const State<double>& state,
                          Stepper* stepper) {
  if (trajectory) trajectory->Add(k, t, state);
  if (contacts && stepper != nullptr) contacts->Add(*model.structure, t, stepper->record());
  if (observations) observations->Add(k, t, state);
  if (view) view->Add(model, t, state, stepper != nullptr ? &stepper->record() : nullptr);
  if (certifier && stepper != nullptr) certifier->AddStep(model, k - 1, stepper);
}

void RunRecorders::Add(const Model<double>& model, long k, double t, const State<double>& state,
                       Stepper* stepper) {
  if (!summary) {
    Record(model, k, t, state, stepper);
    return;
  }
  summary->Keep(model, state, stepper);
  if (!WritesRows(k, t, stepper) && !summary->IsFull()) {
    Record(model, k, t, state, stepper);  // only copies, for later rows
    return;
  }
  const double start = clock();
  Record(model, k, t, state, stepper);
  summary->EvaluateKept(model);
  seconds += clock() - start;
}

}  // namespace tangible
