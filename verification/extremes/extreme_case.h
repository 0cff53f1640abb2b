// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A case at the engine's limits: measured figures, the bounds that physics or arithmetic puts on
// them, and the gradient of the same scene by several methods.
//
//   holds            |figure| ≤ bound for every figure, and each is a number
//   gradient holds   all entries are finite, and, where the certificate says "trustworthy",
//                    adjoint and differences agree with the tangent (gradients/scene_check.h (1),
//                    tolerances 1e-9 and 1e-5; of the adjoint eps times the condition of the linear
//                    systems, which the certificate tells, where that is more, up to 1e-6: what it
//                    allows a system that is said to be solved)
//
// A case runs in a separate process (cost/child.h), so that a crash or an endless loop gives a
// failed row.

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tangible/lcp/certificate/certificate.h"

namespace tangible::extremes {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kReported = std::numeric_limits<double>::infinity();

/// One measured number.
struct Figure {
  std::string what;
  double value = kNotMeasured;
  double bound = 0.0;  ///< kReported: shown, must only be finite
  std::string unit;    ///< "m"; "1" for ratios and counts
  std::string reason;  ///< why this bound

  bool holds() const { return value <= bound && value >= -bound && value - value == 0.0; }
};

struct GradientFinding {
  bool taken = false;
  std::string message;  ///< not empty: why there is no derivative
  bool finite = false;
  double adjoint = kNotMeasured;      ///< largest error against the tangent, see above
  double differences = kNotMeasured;  ///< the same; NaN where no choice-preserving step was found
  std::string verdict;                ///< the certificate's
  double condition = 1.0;             ///< the certificate's

  bool trustworthy() const { return WithoutDiscreteMap(verdict) == kTrustworthy; }
  double adjoint_bound() const;
  bool holds() const;
};

inline constexpr double kAdjointTolerance = 1e-9;
inline constexpr double kDifferenceTolerance = 1e-5;

/// The result of a case.
struct Finding {
  std::vector<Figure> figures;
  GradientFinding gradient;
  std::string note;  ///< for example which of several solutions was found

  bool holds() const;
};

/// Lengths of cases: kShort for daily use (all cases within two minutes), kLong as in the table's
/// title (60 s at rest, a million steps).
enum class Length { kShort, kLong };

struct ExtremeCase {
  std::string group, name;
  std::string stepping;  ///< "fixed", "event", or what else is compared
  std::function<Finding(Length)> run;
  double seconds = 30.0;       ///< of CPU time, at most; a long run may take 20 times that
  std::string known_reason{};  ///< not empty: why it is known not to hold
};

/// All of them, groups one after the other. Names are unique together with the stepping.
std::vector<ExtremeCase> AllCases();

/// A finding as text and back, bit for bit, NaN and infinity included.
std::string Serialise(const Finding& finding);
bool Deserialise(const std::string& text, Finding* finding);

}  // namespace tangible::extremes
