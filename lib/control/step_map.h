// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The controlled system in discrete time, x_{k+1} = f_k(x_k, u_k). The engine is one
// (engine_step.h), a learned model another.

#include <string>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

class StepMap {
 public:
  StepMap() = default;
  virtual ~StepMap() = default;
  StepMap(const StepMap&) = delete;
  StepMap& operator=(const StepMap&) = delete;

  virtual int num_states() const = 0;
  virtual int num_controls() const = 0;
  /// False where the step cannot be made: `error` says why, in one line.
  virtual bool Step(long k, const VectorX<double>& x, const VectorX<double>& u,
                    VectorX<double>* next, std::string* error) = 0;
  /// The same with A = ∂f/∂x (num_states x num_states) and B = ∂f/∂u (num_states x num_controls).
  virtual bool Linearise(long k, const VectorX<double>& x, const VectorX<double>& u,
                         VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                         std::string* error) = 0;

  /// The impacts of the last Step or Linearise in their order, at which states jump. Each is the
  /// number of its kind, which stands for the bodies that met. Systems without jumps have none.
  virtual const std::vector<int>& impacts() const {
    static const std::vector<int> none;
    return none;
  }
  /// The same system where impacts of that kind do not happen, bodies passing through each other;
  /// null where there is no such system. It lives as long as this object.
  virtual StepMap* Without(int impact) {
    (void)impact;
    return nullptr;
  }
  /// The state from which step k leads to `next`, as far as the system can trace it back; false
  /// where it cannot.
  virtual bool StepBack(long k, const VectorX<double>& next, const VectorX<double>& u,
                        VectorX<double>* x) {
    (void)k, (void)next, (void)u, (void)x;
    return false;
  }
};

}  // namespace tangible
