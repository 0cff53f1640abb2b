// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Smooth motion between events: accelerations with the contacts' modes held, integrated over a
// segment, then poses and twists put back onto the constraints.
//
// Integrators are Nyström tableaux: with stages A_i = a(Q_i, V_i, t + c_i τ),
//   Q_i = q + c_i τ v + τ² Σ â_ij A_j,   V_i = v + τ Σ a_ij A_j
//   q⁺ = q + τ v + τ² Σ b̂_j A_j,          v⁺ = v + τ Σ b_j A_j
//   trapezoidal           the implicit trapezoidal rule, solved to rounding: order 2
//   runge_kutta_4         the classical rule: order 4
// Both are exact for constant accelerations. Hairer, Nørsett, Wanner, Solving Ordinary
// Differential Equations I, II.1 and II.14.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tangible/dynamics/model/lengths.h"
#include "tangible/lcp/system/mode_solve.h"
#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/implicit_stage.h"

namespace tangible {

struct NystromTableau {
  static constexpr int kMost = 4;
  int stages = 0;
  double c[kMost] = {};
  double a[kMost][kMost] = {};
  double a_hat[kMost][kMost] = {};
  double b[kMost] = {};
  double b_hat[kMost] = {};
  bool last_is_implicit = false;  ///< a[last][last] ≠ 0

  static const NystromTableau& Of(Integrator integrator);
};

inline bool AllFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// x += factor · solved: adds 3 numbers for each moving body to the poses or twists of all bodies.
template <typename T>
void AddBodies(const ModelStructure& structure, const T& factor, const std::vector<T>& solved,
               std::vector<T>* x) {
  for (int k = 0; k < structure.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      (*x)[3 * structure.moving[k] + i] += factor * solved[3 * k + i];
    }
  }
}

/// The twists of all bodies from the solved ones.
template <typename T>
void SpreadTwists(const ModelStructure& structure, const std::vector<T>& solved,
                  std::vector<T>* twist) {
  for (int k = 0; k < structure.num_blocks(); ++k) {
    std::copy_n(&solved[3 * k], 3, &(*twist)[3 * structure.moving[k]]);
  }
}

/// q += h v of all bodies that move: a motion without accelerations.
template <typename T>
void MovePoses(const ModelStructure& structure, double h, State<T>* state) {
  for (int body = 0; body < structure.num_bodies(); ++body) {
    for (int i = 0; i < 3 && structure.bodies[body].motion != Motion::kStatic; ++i) {
      state->pose[3 * body + i] += h * state->twist[3 * body + i];
    }
  }
}

/// The state at c τ of a motion of length τ from its stages' accelerations, 3 for each moving body:
/// q + c τ v + τ² Σ â_j A_j and v + τ Σ a_j A_j over j < terms. `accelerations(j)` is a vector.
template <typename T, typename Accelerations>
void PlaceStage(const ModelStructure& structure, const State<T>& before, const T& tau, double c,
                const double* a, const double* a_hat, int terms, const Accelerations& accelerations,
                State<T>* out) {
  *out = before;
  for (size_t i = 0; i < out->pose.size(); ++i) {
    out->pose[i] += c * tau * before.twist[i];
  }
  for (int j = 0; j < terms; ++j) {
    if (a_hat[j] != 0.0) {
      AddBodies(structure, T(tau * tau * a_hat[j]), accelerations(j), &out->pose);
    }
    if (a[j] != 0.0) {
      AddBodies(structure, T(tau * a[j]), accelerations(j), &out->twist);
    }
  }
}

/// Fallbacks of motions, counted since the start.
struct FlowCounts {
  long whole_system = 0;   ///< condensed systems that were factorised as a whole instead
  long newton_stages = 0;  ///< implicit stages whose iteration does not contract
};

class SegmentFlow {
 public:
  explicit SegmentFlow(const Model<double>& model) : lengths_(model) {}
  /// Continues with another model.
  void Retarget(const Model<double>& model) { lengths_ = Lengths(model); }

  /// Fills stages, corrections, projection and `after` of a segment whose time, length, middle,
  /// before, contacts, friction and modes are set. `first`: the first stage of the same segment
  /// with another length, which does not depend on it, or nullptr. False with a message where it
  /// fails.
  bool Run(const Model<double>& model, Segment* segment, std::string* message,
           const SolvedNode* first = nullptr);

  /// The same without corrections, for a segment of zero length: `after` is `before`.
  bool RunUncorrected(const Model<double>& model, Segment* segment, std::string* message);

  /// The accelerations at a state of the segment, with its modes.
  bool Accelerate(const Model<double>& model, const Segment& segment, const State<double>& state,
                  double time, SolvedNode* node);

  /// Projects twists onto the rows of an instant whose modes are given (SetUpProjection).
  bool Project(const Model<double>& model, Impulses* projection);

  const FlowCounts& counts() const { return counts_; }

 private:
  bool Solve(const std::vector<ContactMode>& modes, SolvedNode* node);
  bool Integrate(const Model<double>& model, Segment* segment, const SolvedNode* first,
                 std::string* message);
  bool SolveImplicitStage(const Model<double>& model, Segment* segment, std::string* message);
  bool HasConverged(const SolvedNode& stage, const std::vector<double>& last, int iteration);
  struct PoseErrors;
  void LeaveRounding(const Segment& segment, SolvedNode* node) const;
  PoseErrors ErrorsOf(const Model<double>& model, const Segment& segment,
                      const SolvedNode& node) const;
  bool CorrectPoses(const Model<double>& model, Segment* segment, std::string* message);
  bool ProjectTwists(const Model<double>& model, Segment* segment, std::string* message);

  ModeSolve mode_solve_;
  Lengths lengths_;
  AssemblyScratch<double> assembly_;
  std::vector<double> terms_;
  ImplicitStage implicit_;
  FlowCounts counts_;
};

/// Whether a motion has gained more energy than its loads can have given, as rows that depend on
/// each other to rounding may do: contacts that stay closed, joints and friction do no work. False
/// where motors or bodies of given motion drive the scene.
bool GainsEnergy(const Model<double>& model, const Segment& segment);

/// Sets up a segment's twist projection at a state: contacts act without rebound, sliding ones
/// without friction (with friction at the start of a run, where a contact that approaches lands).
void SetUpProjection(const Segment& segment, const State<double>& state, Impulses* projection);

/// "joint crank contradicts the others: no twist satisfies all".
std::string NameOfContradicted(const ModelStructure& structure, int joint);

/// Assembles impulses at their state, of length h (0: an impact).
void AssembleImpulses(const Model<double>& model, AssemblyScratch<double>* scratch,
                      Impulses* impulses);

}  // namespace tangible
