// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Fills the data of the HTML view (tangible/render/view.h) from a run.

#include "tangible/render/view.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

class ViewRecorder {
 public:
  ViewRecorder(const Scene& scene, const Model<double>& model);
  /// The state after a step; `record` is that step's, nullptr for the initial state.
  void Add(const Model<double>& model, double t, const State<double>& state,
           const StepRecord* record);
  const ViewData& data() const { return data_; }
  /// The same, to be completed.
  ViewData* mutable_data() { return &data_; }

 private:
  void AddContacts(const Model<double>& model, const StepRecord& record, ViewFrame* frame) const;

  ViewData data_;
};

}  // namespace tangible
