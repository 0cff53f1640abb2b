// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The function that a fit minimises: a least-squares problem in blocks,
//
//   cost(p) = 1/2 Σ_b w_b Σ_i ρ_i(r_bi(p_s, p_b)²)        within lower ≤ p ≤ upper
//   p = [p_s | p_0 | p_1 | ... ]                          shared parameters, then each block's own
//
// A block is one recording, or rows such as those of a prior on shared parameters. Its rows depend
// only on the shared parameters p_s and on its own p_b, so that the own parameters of all blocks
// can be eliminated block by block (Schur complement), and blocks can be evaluated at the same
// time. The first rows of a block are those of observations, to which the robust loss applies; the
// others (priors) are plain squares. w_b is the weight of the block, 1 by default.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/problem/parameter_entry.h"
#include "tangible/lcp/certificate/certificate.h"
#include "tangible/math/scalar.h"
#include "tangible/simulation/gradient/derivative_method.h"

namespace tangible {

/// The result of a block's evaluation.
struct BlockEvaluation {
  Eigen::VectorXd residuals;  ///< in multiples of sigma, without the block's weight
  RowMatrixXd jacobian;       ///< rows x [shared | own]: ∂r/∂p; only if requested
  std::string message;        ///< why it failed, one line
  long rollouts = 0;          ///< runs that it took
};

enum class BlockDerivatives { kSkip, kCompute };

/// The series and time of a row.
struct RowPlace {
  int series = 0;      ///< a number for each coordinate of a body or point, within the block
  double time = 0.0;   ///< s
  double least = 0.0;  ///< in multiples of sigma: smaller residuals are rounding
};

/// Derivatives with respect to numbers that no parameter sets.
struct HeldColumns {
  std::vector<ParameterEntry> entries;  ///< for each number: its path, value and allowed range
  RowMatrixXd columns;                  ///< observation rows of the block x entries
};

class LeastSquaresProblem {
 public:
  virtual ~LeastSquaresProblem() = default;

  /// All parameters in the order of p.
  virtual const std::vector<ParameterEntry>& entries() const = 0;
  virtual int num_shared() const = 0;
  virtual int num_blocks() const = 0;
  virtual int num_own(int block) const = 0;
  virtual int num_rows(int block) const = 0;
  /// Number of rows of observations, which come first.
  virtual int num_observation_rows(int block) const { return num_rows(block); }
  /// Number of rows of random forces, which follow them (process_noise.h).
  virtual int num_noise_rows(int /*block*/) const { return 0; }
  /// Number of rows that then give the cost a slope and no curvature (process_noise.h): they are no
  /// priors, which follow.
  virtual int num_slope_rows(int /*block*/) const { return 0; }
  /// Huber's bound of the cost whose rows are asked for next, which matters to random forces alone.
  virtual void SetHuber(double /*huber*/) {}
  /// w_b > 0. A block without observation rows is a prior, and has the weight 1.
  virtual double weight(int /*block*/) const { return 1.0; }
  /// The place of each observation row.
  virtual std::vector<RowPlace> Places(int block) const = 0;

  /// The rows of a block at p = [shared | own], and their derivatives by `method` if asked for.
  /// False, with a message, where a run fails, a value is not allowed, or a residual or derivative
  /// is not finite. The same p gives the same bits. Calls for different blocks may run at the same
  /// time; calls for one block may not.
  virtual bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                             BlockDerivatives derivatives, BlockEvaluation* evaluation) = 0;

  /// The certificate of the derivatives at p (all parameters); empty where nothing is certified.
  virtual std::optional<Certificate> Certify(const Eigen::VectorXd& /*p*/) { return std::nullopt; }

  /// Adds to it how far each parameter that sets numbers of scenes may be changed until another
  /// discrete choice is made, and the growth of the flow: two runs a parameter and block, and
  /// nothing where these are more than kMostRadiusRuns.
  virtual void AddRadii(const Eigen::VectorXd& /*p*/, Certificate* /*certificate*/) {}

  /// The derivatives of a block's observation rows at p = [shared | own] with respect to the
  /// numbers of its scene that no parameter sets; empty where there are none, more than `most`, or
  /// a run fails.
  virtual HeldColumns EvaluateHeld(int /*block*/, const Eigen::VectorXd& /*p*/,
                                   GradientMethod /*method*/, int /*most*/) {
    return {};
  }

  /// The problem with one more parameter, the last of the shared ones: the number at `path`, which
  /// no parameter sets and has the same value in all blocks. Null where there is none. This problem
  /// must outlive it.
  virtual std::unique_ptr<LeastSquaresProblem> Released(const std::string& /*path*/) const {
    return nullptr;
  }

  /// Physical inconsistencies at p (all parameters), a line each (consistency.h).
  virtual std::vector<std::string> FindInconsistencies(const Eigen::VectorXd& /*p*/) { return {}; }

  /// The problem with only the observations of the first `part` (0 to 1) of each block's time, and
  /// the same parameters; null where blocks have no times. This problem must outlive it.
  virtual std::unique_ptr<LeastSquaresProblem> Window(double /*part*/) const { return nullptr; }

  /// The start of a message about a block, for block 3 "recording 'take 4': "; empty where there is
  /// only one.
  virtual std::string BlockName(int /*block*/) const { return ""; }
};

/// Of more parameters times blocks the radius of validity is not computed.
inline constexpr size_t kMostRadiusRuns = 100;

/// The places of the blocks in the vectors of all parameters and of all rows.
class BlockLayout {
 public:
  explicit BlockLayout(const LeastSquaresProblem& problem);

  int num_parameters() const { return own_offset_.back(); }
  long num_rows() const { return row_offset_.back(); }
  int num_shared() const { return own_offset_.front(); }
  int num_blocks() const { return static_cast<int>(own_offset_.size()) - 1; }
  int num_own(int block) const { return own_offset_[block + 1] - own_offset_[block]; }
  int num_local(int block) const { return num_shared() + num_own(block); }
  /// Index of a block's first own parameter.
  int own_offset(int block) const { return own_offset_[block]; }
  /// Index of a block's first row.
  long row_offset(int block) const { return row_offset_[block]; }

  /// The index in p of a block's parameter i in [shared | own].
  int ParameterOf(int block, int i) const {
    return i < num_shared() ? i : own_offset_[block] + i - num_shared();
  }
  /// [shared | own] of a block, out of a vector with a number for each parameter.
  Eigen::VectorXd Local(int block, const Eigen::VectorXd& all) const;

 private:
  std::vector<int> own_offset_;   ///< blocks + 1
  std::vector<long> row_offset_;  ///< blocks + 1
};

}  // namespace tangible
