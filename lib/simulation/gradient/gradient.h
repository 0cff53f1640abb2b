// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The derivative of a rollout's final state, or of a loss that depends on it, with respect to
// parameters of the scene, by any of five methods that must agree:
//
//   adjoint            one reverse sweep, a column per output (rollout_adjoint.h)
//   tangent            one forward sweep, a column per parameter (rollout_tangent.h)
//   jet_implicit       Jets in passes of their width, through K⁻¹ of each step
//   jet                Jets through every operation of the interior point:
//                      the independent reference
//   finite_difference  central; at the end of a parameter's range one-sided,
//                      (−3 f(p) + 4 f(p ± h) − f(p ± 2h)) / ±2h
//
// With auto, the default, the first or the second is used, whichever has fewer columns: MethodOf.
//
// A path that matches several numbers is one parameter that sets all of them: its derivative is
// their sum.

#include <limits>
#include <string>
#include <vector>

#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/lcp/certificate/certificate.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/gradient/derivative_method.h"

namespace tangible {

enum class CertificatePass { kRun, kSkip };
/// Whether the certificate has the radius of validity of each parameter, which takes two more runs
/// a parameter, and the growth of the flow.
enum class RadiusPass { kRun, kSkip };

/// At a kink: one element of the generalised Jacobian (that of the modes found); or the derivative
/// for growing parameters (kPlus), or for shrinking ones (kMinus: lim (f(p) − f(p − h)) / h), each
/// parameter alone. Only the tangent has one-sided derivatives, so that auto then selects it. With
/// fixed steps they are exact where contacts are at a kink (rollout_directional.h); at all others,
/// and with event stepping, they are extrapolated from tangents beside it (gradient_sides.cc).
enum class DerivativeSide { kBoth, kPlus, kMinus };

struct GradientOptions {
  GradientMethod method = GradientMethod::kAuto;
  /// Step of finite differences, in the parameter's unit; 0: 6e-6 max(|p|, the parameter's scale).
  double step = 0.0;
  DerivativeSide side = DerivativeSide::kBoth;
  Factorisations factorisations = Factorisations::kKeep;  ///< of the adjoint
  Checkpointing checkpointing{};                          ///< of the adjoint
  int repeat = 1;                                         ///< CPU times are the best of this many
  CertificatePass certificate = CertificatePass::kRun;    ///< one more rollout, not timed
  RadiusPass radius = RadiusPass::kSkip;
};

enum class Differentiated { kFinalState, kLoss };

/// The method that is used: the one that the options name or, with auto, the one that has fewer
/// columns. A sweep is a rollout and, for each column and step, a solve and a product, which cost
/// about the same forwards and backwards; the adjoint's records cost another half rollout or less.
/// The first rule that applies decides:
///   a one-sided derivative           tangent: no other method has it
///   the adjoint's memory is limited  adjoint: checkpoints, recomputed factorisations
///   a loss                           adjoint: one column
///   parameters ≤ outputs             tangent
///   else                             adjoint
GradientMethod MethodOf(const GradientOptions& options, Differentiated what, long parameters,
                        long outputs);

/// A scalar Σ weight (output − target)².
struct LossTerm {
  std::string output;  ///< "ball/x"
  double target = 0.0;
  double weight = 1.0;
};

/// The same with its outputs found among those of a scene.
class OutputLoss {
 public:
  /// Empty, or one line: an output that the scene does not have.
  std::string Create(const ModelStructure& structure, const std::vector<LossTerm>& terms);
  double Value(const VectorX<double>& outputs) const;
  VectorX<double> Derivative(const VectorX<double>& outputs) const;

 private:
  std::vector<LossTerm> terms_;
  std::vector<Eigen::Index> places_;  ///< of the terms' outputs
};

struct GradientResult {
  bool done = false;
  GradientMethod method = GradientMethod::kAuto;  ///< the one used; kAuto before one was chosen
  std::string message;                            ///< empty, or one line: what failed
  std::vector<std::string> outputs;  ///< body/x, y, angle, vx, vy, omega of each moving body
  VectorX<double> values;            ///< of the outputs, at the end
  RowMatrixXd jacobian;              ///< outputs x parameters; only from FinalStateJacobian
  double loss = std::numeric_limits<double>::quiet_NaN();
  VectorX<double> gradient;  ///< by parameter; only from LossGradient
  double seconds =
      std::numeric_limits<double>::quiet_NaN();  ///< the method's own forward pass included
  double rollout_seconds = std::numeric_limits<double>::quiet_NaN();  ///< of a plain rollout
  /// Both times of each repeat, CPU time; a rollout is run before every repeat of the method.
  std::vector<double> all_seconds, all_rollout_seconds;
  /// One-sided differences, changes of modes between them, fallbacks, and open_joint.
  std::vector<std::string> notes;
  /// Empty, or a line on the joint that is widest open at the end (joint_opening.h).
  std::string open_joint;
  long fallbacks = 0;     ///< unrolled steps that took the implicit derivative
  size_t tape_bytes = 0;  ///< of the adjoint: the most memory that its records took
  long steps_again = 0;   ///< of the adjoint: steps that were run again from checkpoints
  Certificate certificate;
};

/// Names of the outputs of a scene.
std::vector<std::string> OutputNames(const ModelStructure& structure);
/// Their indices among the poses and twists of State, and so in [poses | twists | parameters].
std::vector<int> OutputVariables(const ModelStructure& structure);

/// The Jacobian of the final state. `message` reports a rollout that is unsolved or diverges,
/// settings that the engine does not support, and Jets of which no width is built.
GradientResult FinalStateJacobian(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                  const GradientOptions& options);

/// The gradient of a loss; the adjoint then needs one column.
GradientResult LossGradient(const Scene& scene, const std::vector<ParameterPath>& parameters,
                            const std::vector<LossTerm>& terms, const GradientOptions& options);

}  // namespace tangible
