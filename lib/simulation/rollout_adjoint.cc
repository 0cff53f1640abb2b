// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/rollout_adjoint.h"

#include <algorithm>

namespace tangible {
namespace {

bool Projects(const ModelStructure& structure) {
  return structure.settings.joint_correction == JointCorrection::kProjection &&
         !structure.joints.empty();
}

}  // namespace

RolloutReport RolloutTape::Record(const Model<double>& model, const State<double>& initial,
                                  Factorisations factorisations, const StateObserver& observer,
                                  State<double>* final) {
  factorisations_ = factorisations;
  used_ = 0;
  if (!stepper_ || structure_ != model.structure.get()) {
    stepper_ = std::make_unique<Stepper>(model);
    structure_ = model.structure.get();
    entries_.clear();
  }
  const bool keep = factorisations == Factorisations::kKeep;
  const StateObserver record = [&](long k, double t, const State<double>& state, Stepper* stepper) {
    if (observer) {
      observer(k, t, state, stepper);
    }
    if (stepper != nullptr) {
      if (used_ == entries_.size()) {
        entries_.push_back(std::make_unique<Entry>());
      }
      Entry& entry = *entries_[used_++];
      if (stepper->by_events()) {
        std::swap(entry.events, stepper->events().mutable_record());
        return;
      }
      if (keep) {
        stepper->TakeRecord(&entry.record, &entry.system);
      } else {
        stepper->TakeRecord(&entry.record, nullptr);
      }
      if (Projects(*model.structure)) {
        entry.projection = stepper->projection();
      }
    }
  };
  return Rollout(model, initial, record, stepper_.get(), final);
}

void RolloutTape::StepAdjoint(const Model<double>& model, const StepRecord& record,
                              ContactSystem* system, JointProjection* projection,
                              RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_bar->cols());
  if (Projects(s)) {
    projection->Adjoint(model, w_bar->data(), columns);
  }
  double* w = w_bar->data();
  for (int body = 0; body < s.num_bodies(); ++body) {
    if (s.bodies[body].motion == Motion::kStatic) {
      continue;
    }
    const double* pose = w + static_cast<size_t>(s.PoseVariable(body, 0)) * columns;
    double* twist = w + static_cast<size_t>(s.TwistVariable(body, 0)) * columns;
    for (int i = 0; i < 3 * columns; ++i) {
      twist[i] += record.h * pose[i];
    }
  }
  u_.assign(3 * static_cast<size_t>(system->num_blocks()) * columns, 0.0);
  for (int k = 0; k < s.num_blocks(); ++k) {
    double* twist = w_bar->data() + static_cast<size_t>(s.TwistVariable(s.moving[k], 0)) * columns;
    std::copy_n(twist, 3 * columns, &u_[3 * static_cast<size_t>(k) * columns]);
    std::fill_n(twist, 3 * columns, 0.0);
  }
  system->SolveTransposed(record.problem, record.solution.modes, u_.data(), columns);
  const SolvedStep step = record.View(system->contact_block());
  if (columns == 1) {
    VisitStepJacobian(model, step, JointRoute::kByHand, &scratch_,
                      SingleAdjointSink{u_.data(), w_bar->data()});
  } else {
    VisitStepJacobian(model, step, JointRoute::kByHand, &scratch_,
                      AdjointSink{u_.data(), w_bar->data(), columns});
  }
}

void RolloutTape::Adjoint(const Model<double>& model, int num_losses, const Seed& seed,
                          RowMatrixXd* w_bar) {
  AdjointFrom(model, steps(), num_losses, seed, w_bar);
}

void RolloutTape::AdjointFrom(const Model<double>& model, long last, int num_losses,
                              const Seed& seed, RowMatrixXd* w_bar) {
  w_bar->setZero(model.structure->num_variables(), num_losses);
  for (long k = std::min(last, steps()); k > 0; --k) {
    seed(k, w_bar);
    Entry& entry = *entries_[k - 1];
    if (stepper_->by_events()) {
      stepper_->event_derivative().Adjoint(model, &entry.events, w_bar);
      continue;
    }
    if (factorisations_ == Factorisations::kKeep) {
      StepAdjoint(model, entry.record, &entry.system, &entry.projection, w_bar);
    } else {
      std::swap(entry.record.problem, refactored_);
      stepper_->Refactor(model, &entry.record);
      StepAdjoint(model, entry.record, &stepper_->system(), &entry.projection, w_bar);
      std::swap(entry.record.problem, refactored_);
    }
  }
  seed(0, w_bar);
}

size_t RolloutTape::bytes() const {
  size_t sum = 0;
  for (size_t i = 0; i < used_; ++i) {
    const Entry& e = *entries_[i];
    sum += sizeof(Entry) + e.system.bytes() + e.events.bytes() +
           sizeof(double) * (e.record.before.pose.size() + e.record.before.twist.size() +
                             e.record.new_twist.size() + e.record.problem.mass.size() +
                             e.record.problem.momentum.size()) +
           sizeof(ActiveContact) * e.record.contacts.size() +
           sizeof(ContactBlock<double>) * e.record.problem.contacts.size() +
           sizeof(JointBlock<double>) * e.record.problem.joints.size() +
           sizeof(CoefficientSource) * 2 * e.record.friction.size();
  }
  return sum;
}

}  // namespace tangible
