// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The derivatives of one scene by every method (methods.h), compared entry by entry.
//
// An entry a of one method agrees with b of another where
//
//   |a − b| ≤ max(tolerance |b|, e) + 1e-13 S,                                     (1)
//
// S the sum of the magnitudes of the contributions to it (support/compare.h), at least a tenth of
//
//   C  the size of the parameter's column: its largest contributions at any step, or the largest
//      output over the parameter's size, if that is more.
//
// e is the method's own estimate of its error: 0 except for
//
//   Ridders        from the table of differences (support/differences.h), with rounding
//   unrolled Jets  (10 κ / margin²) N C after N steps, or 0 if that factor is above the tolerance;
//                  κ = 1e-14 is the complementarity at which the interior point ends, margin the
//                  certificate's smallest, or the share of a speed that the friction of a joint
//                  can change in a step (methods.h). Here S = C, as all bodies are solved at once.
//
// There is no absolute tolerance. The reported error of an entry is the tolerance at which (1)
// would just hold if S and e shrank with it, tolerance |a − b| / (the right-hand side); it has to
// be compared with the tolerance. Differences of one step have no bound; their error is reported
// relative to the largest entry of the column, at least 1e-5 C.
//
// An entry that does not agree is an exception. It is `named` if the certificate, computed before
// the comparison, had reported for this parameter that the derivative is at a kink, one-sided or
// beside a jump; for the unrolled Jets also if it had reported a margin at which 10 κ / margin² is
// above the tolerance; for modes that differ at p ± h also if it had reported redundant rows, whose
// impulses and so modes are not unique. It is of `another solution` if the unrolled interior point
// ended at other values than the step: with large friction a problem may have several. Otherwise it
// is unexplained, and the check has failed.
//
// Differences are taken where the runs at p ± h make the same choices as the run at p, contact by
// contact (support/trace.h). Where no step is small enough for that the column is an exception.

#include <string>
#include <vector>

#include "tangible/verification/gradients/methods.h"

namespace tangible {

/// Two methods that are compared; `bounded` pairs must agree, the others are shown.
struct MethodPair {
  Method a, b;
  const char* name;
  double tolerance;
  bool bounded;
};

inline constexpr MethodPair kMethodPairs[] = {
    {kByAdjoint, kByTangent, "adjoint", 1e-9, true},
    {kByAdjointRecomputed, kByTangent, "adjoint, recomputed", 1e-9, true},
    {kByImplicitJets, kByTangent, "implicit Jets", 1e-9, true},
    {kByImplicitJets, kByAdjoint, "implicit Jets, adjoint", 1e-9, true},
    {kByUnrolledJets, kByTangent, "unrolled Jets", 1e-6, true},
    {kByRidders, kByTangent, "Ridders", 1e-5, true},
    {kByCoarseDifference, kByTangent, "difference 1e-4", 1e-5, false},
    {kByFineDifference, kByTangent, "difference 6e-6", 1e-5, false},
    {kByClosedForm, kByTangent, "closed form", 0.0, true},  // its tolerance is its own
    {kByPlus, kByClosedPlus, "plus side", 1e-5, true},
    {kByMinus, kByClosedMinus, "minus side", 1e-5, true}};
inline constexpr int kNumPairs = static_cast<int>(std::size(kMethodPairs));

/// One entry with the value of every method.
struct CheckedEntry {
  std::string output, parameter;
  int pair = 0;        ///< of kMethodPairs: which was compared
  double error = 0.0;  ///< see above
  double ratio = 0.0;  ///< error over the tolerance: 1 at the bound
  double values[kNumMethods] = {};
  double contributions = 0.0;
  double ridders_error = 0.0;
};

/// Entries of one parameter that do not agree, or could not be compared.
struct CheckedException {
  std::string parameter;
  int pair = 0;
  long entries = 0;
  double error = 0.0;  ///< the largest; infinite where they could not be compared
  std::string what;    ///< details: the contact that differs at p ± h, values, a message
  std::string named;   ///< the certificate's earlier verdict; or empty
  bool other_solution = false;

  bool unexplained() const { return named.empty() && !other_solution; }
};

/// A row of the table: the parameters of one kind.
struct KindRow {
  std::string kind;  ///< "bodies/mass"
  int parameters = 0;
  long entries = 0;
  double error[kNumPairs];  ///< largest of the entries that agree or are unexplained; NaN: none
  long coarse = 0;          ///< entries of differences whose estimated error is above 1e-3 of them
  long named = 0;           ///< exceptions that the certificate had named
  long other_solution = 0;  ///< exceptions of another solution
  long unexplained = 0;     ///< other exceptions
  std::vector<std::string> zero_columns;  ///< parameters on which no output depends

  KindRow();
  void Add(const KindRow& other);
};

struct SceneCheck {
  std::string name;
  std::string replay;  ///< the command that checks this scene alone
  Stepping stepping = Stepping::kFixed;
  bool done = false;
  std::string message;  ///< why not
  int bodies = 0, joints = 0, parameters = 0;
  long steps = 0;
  Certificate certificate;
  std::string missing[kNumMethods];
  long unrolled_fallbacks = 0;
  long closed = 0, sliding = 0, sticking = 0, limits = 0, impacts = 0, recoveries = 0;
  std::vector<KindRow> rows;  ///< in the order of the kinds' names
  KindRow total;
  std::vector<CheckedEntry> worst;  ///< by ratio, of bounded pairs, at most kMostWorst
  std::vector<CheckedException> exceptions;
  std::string wrong_value;  ///< empty, or the output that differs most from its closed form
  /// Parameters that the certificate names although both sides have the same derivative in closed
  /// form, with its verdict.
  std::vector<std::string> false_alarms;
  /// Filled only on request: outputs, parameters and every method's Jacobian.
  std::vector<std::string> outputs, parameter_paths;
  MatrixX<double> jacobian[kNumMethods], contributions, ridders_error;
};

inline constexpr int kMostWorst = 10;

enum class KeepJacobians { kNo, kYes };

/// The kind of a parameter: its path without names and indices.
std::string KindOf(const std::string& path);

/// The error of an entry as above: a, b, S and e.
double EntryError(double a, double b, double tolerance, double contributions, double estimate);

/// Whether e is too large for a useful comparison: above 1e-3 of the entry and 1e-6 of its column
/// (if that is not 0).
bool IsCoarse(double value, double estimate, double largest_of_column);

/// Checks a scene with respect to the parameters; `known` as for RunMethods.
SceneCheck CheckScene(const Scene& scene, const std::vector<ParameterPath>& parameters,
                      KeepJacobians keep,
                      const std::optional<ClosedFormJacobian>& known = std::nullopt);

}  // namespace tangible
