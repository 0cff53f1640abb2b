// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/linearisation.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/shared_work.h"

namespace tangible {
namespace {

// The number of rows that are added to a triangular factor at once: a multiple of its columns, and
// at least kChunk. It is large enough for the decomposition to work on matrices and not on single
// rows.
constexpr Eigen::Index kChunkFactor = 4;
constexpr Eigen::Index kChunk = 64;

/// The triangular factor of rows that are added chunk by chunk.
class FactorGatherer {
 public:
  explicit FactorGatherer(Eigen::Index columns)
      : stacked_(columns + std::max(kChunkFactor * columns, kChunk), columns) {}

  /// The next row, to be filled in.
  auto NextRow() {
    if (num_rows_ == stacked_.rows()) {
      Compress();
    }
    return stacked_.row(num_rows_++);
  }
  /// Takes the last row back.
  void DropRow() { --num_rows_; }

  RowMatrixXd Factor() {
    if (num_rows_ > 0) {
      Compress();
    }
    return stacked_.topRows(num_rows_);
  }

 private:
  void Compress() {
    const Eigen::Index rows = std::min(num_rows_, stacked_.cols());
    stacked_.topRows(rows) = UnpivotedQr(stacked_.topRows(num_rows_)).UpperFactor();
    num_rows_ = rows;
  }

  Eigen::MatrixXd stacked_;
  Eigen::Index num_rows_ = 0;
};

/// Appends to and reads from a vector of numbers, the form in which a log keeps an evaluation.
class Packer {
 public:
  void Add(double x) { numbers_.push_back(x); }
  void Add(const Eigen::VectorXd& x) { numbers_.insert(numbers_.end(), x.begin(), x.end()); }
  void Add(const RowMatrixXd& x) {
    Add(static_cast<double>(x.rows()));
    numbers_.insert(numbers_.end(), x.data(), x.data() + x.size());
  }
  Eigen::VectorXd numbers() const {
    return Eigen::Map<const Eigen::VectorXd>(numbers_.data(),
                                             static_cast<Eigen::Index>(numbers_.size()));
  }

 private:
  std::vector<double> numbers_;
};

class Unpacker {
 public:
  explicit Unpacker(const Eigen::VectorXd& numbers) : numbers_(numbers) {}
  double Number() { return numbers_[at_++]; }
  Eigen::VectorXd Vector(Eigen::Index size) {
    at_ += size;
    return numbers_.segment(at_ - size, size);
  }
  RowMatrixXd Matrix(Eigen::Index columns) {
    const auto rows = static_cast<Eigen::Index>(Number());
    at_ += rows * columns;
    return Eigen::Map<const RowMatrixXd>(numbers_.data() + at_ - rows * columns, rows, columns);
  }

 private:
  const Eigen::VectorXd& numbers_;
  Eigen::Index at_ = 0;
};

/// How the evaluation of a block went.
struct BlockOutcome {
  bool done = false;
  long rollouts = 0;
  std::string message;
};

/// Bytes for processes of the same program on machines of one kind.
class ByteWriter {
 public:
  template <typename T>
  void Add(const T& value) {
    const size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  template <typename T>
  void Add(const T* values, size_t count) {
    Add(count);
    const size_t at = bytes_.size();
    bytes_.resize(at + count * sizeof(T));
    if (count > 0) std::memcpy(bytes_.data() + at, values, count * sizeof(T));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class ByteReader {
 public:
  explicit ByteReader(const std::string& bytes) : bytes_(bytes) {}
  template <typename T>
  T One() {
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <typename T>
  std::vector<T> Some() {
    std::vector<T> values(One<size_t>());
    if (!values.empty()) std::memcpy(values.data(), bytes_.data() + at_, values.size() * sizeof(T));
    at_ += values.size() * sizeof(T);
    return values;
  }

 private:
  const std::string& bytes_;
  size_t at_ = 0;
};

/// Whether processes may divide the blocks: what a problem keeps of the random forces of a block
/// (process_noise.h) others would not have.
bool CanDivide(const LeastSquaresProblem& problem) {
  for (int block = 0; block < problem.num_blocks(); ++block) {
    if (problem.num_noise_rows(block) > 0) return false;
  }
  return problem.num_blocks() > 1;
}

/// The process that evaluates each block: the longest first, each by the one that has the fewest
/// rows so far.
std::vector<int> OwnersOf(const BlockLayout& layout, int processes) {
  const auto count = static_cast<size_t>(layout.num_blocks());
  const auto rows = [&](int block) {
    return layout.row_offset(block + 1) - layout.row_offset(block);
  };
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return rows(a) > rows(b); });
  std::vector<long> loads(static_cast<size_t>(processes), 0);
  std::vector<int> owners(count);
  for (const int block : order) {
    const auto least = std::min_element(loads.begin(), loads.end());
    owners[block] = static_cast<int>(least - loads.begin());
    *least += rows(block) + 1;
  }
  return owners;
}

/// Row i of [A B], from that of [shared | own].
template <typename Row>
void FillRow(const BlockEvaluation& evaluation, Eigen::Index i, const Eigen::VectorXd& q_scale,
             Eigen::Index num_own, double scale, Row row) {
  const Eigen::Index num_shared = q_scale.size() - num_own;
  const auto jacobian = evaluation.jacobian.row(i);
  row.head(num_own) =
      scale * jacobian.tail(num_own).cwiseProduct(q_scale.tail(num_own).transpose());
  row.segment(num_own, num_shared) =
      scale * jacobian.head(num_shared).cwiseProduct(q_scale.head(num_shared).transpose());
}

double CostOf(const BlockEvaluation& evaluation, Eigen::Index num_observations, double weight,
              double huber) {
  const Eigen::Index priors = evaluation.residuals.size() - num_observations;
  return weight * (RobustCost(evaluation.residuals.head(num_observations), huber) +
                   RobustCost(evaluation.residuals.tail(priors), 0.0));
}

/// ∂cost/∂q of [shared | own].
Eigen::VectorXd GradientOf(const BlockEvaluation& evaluation, const Eigen::VectorXd& q_scale,
                           Eigen::Index num_observations, double weight, double huber) {
  Eigen::VectorXd pull = weight * evaluation.residuals;
  for (Eigen::Index i = 0; i < num_observations; ++i) {
    pull[i] *= RobustWeight(evaluation.residuals[i], huber);
  }
  return q_scale.cwiseProduct(evaluation.jacobian.transpose() * pull);
}

}  // namespace

double RobustWeight(double residual, double huber) {
  const double size = std::abs(residual);
  return huber > 0.0 && size > huber ? huber / size : 1.0;
}

double RobustCost(const Eigen::VectorXd& residuals, double huber) {
  double sum = 0.0;
  for (const double r : residuals) {
    const double size = std::abs(r);
    sum += huber > 0.0 && size > huber ? 2.0 * huber * size - huber * huber : r * r;
  }
  return 0.5 * sum;
}

BlockFactor Reduce(const BlockEvaluation& evaluation, const Eigen::VectorXd& q_scale, int num_own,
                   int num_observation_rows, double weight, double huber) {
  const Eigen::Index columns = q_scale.size();
  FactorGatherer factor(columns + 1);
  FactorGatherer curved(columns);
  double remainder = 0.0;  // of the cost, times 2
  for (Eigen::Index i = 0; i < evaluation.residuals.size(); ++i) {
    const double r = evaluation.residuals[i];
    const double size = std::abs(r);
    const double bound = i < num_observation_rows ? huber : 0.0;
    const double scale = std::sqrt(weight * RobustWeight(r, bound));
    auto row = factor.NextRow();
    FillRow(evaluation, i, q_scale, num_own, scale, row);
    row[columns] = scale * r;
    if (bound > 0.0 && size > bound) {
      // ρ(r²) − ρ'(r²) r² = 2 b |r| − b² − b |r|
      remainder += weight * bound * (size - bound);
    } else if (huber > 0.0) {
      FillRow(evaluation, i, q_scale, num_own, scale, curved.NextRow());
    }
  }
  return {factor.Factor(), curved.Factor(), std::sqrt(remainder)};
}

void ForEachOnThreads(int threads, int count, const std::function<void(int)>& function) {
  const int used = std::min(NumThreads(threads), count);
  WorkerPool pool(used);
  pool.Run(static_cast<size_t>(count), used,
           [&function](size_t i, int) { function(static_cast<int>(i)); });
}

Linearizer::Linearizer(LeastSquaresProblem* problem, GradientMethod method, int threads,
                       EvaluationLog* log)
    : problem_(problem), layout_(*problem), method_(method), threads_(threads), log_(log) {}

bool Linearizer::EvaluateBlocks(const Eigen::VectorXd& p, BlockDerivatives derivatives,
                                const BlockUse& use) {
  const int count = layout_.num_blocks();
  SharedWork* const work = CanDivide(*problem_) ? SharedWork::Current() : nullptr;
  const std::vector<int> owners = work != nullptr ? OwnersOf(layout_, work->size())
                                                  : std::vector<int>(static_cast<size_t>(count), 0);
  const int rank = work != nullptr ? work->rank() : 0;
  std::vector<BlockOutcome> outcomes(static_cast<size_t>(count));
  ForEachOnThreads(threads_, count, [&](int block) {
    if (owners[block] != rank) return;
    BlockEvaluation evaluation;
    BlockOutcome& outcome = outcomes[block];
    outcome.done =
        problem_->EvaluateBlock(block, layout_.Local(block, p), method_, derivatives, &evaluation);
    outcome.rollouts = evaluation.rollouts;
    if (outcome.done) {
      use.take(block, &evaluation);
    } else {
      outcome.message = problem_->BlockName(block) + evaluation.message;
    }
  });
  if (work != nullptr) {
    ByteWriter own;
    for (int block = 0; block < count; ++block) {
      const BlockOutcome& outcome = outcomes[block];
      if (owners[block] != rank) continue;
      own.Add(outcome.done);
      own.Add(outcome.rollouts);
      own.Add(outcome.message.data(), outcome.message.size());
      const Eigen::VectorXd numbers = outcome.done ? use.numbers(block) : Eigen::VectorXd();
      own.Add(numbers.data(), static_cast<size_t>(numbers.size()));
    }
    const std::vector<std::string> all = work->Exchange(own.bytes());
    std::vector<ByteReader> readers(all.begin(), all.end());
    for (int block = 0; block < count; ++block) {
      if (owners[block] == rank) continue;
      ByteReader& reader = readers[owners[block]];
      BlockOutcome& outcome = outcomes[block];
      outcome.done = reader.One<bool>();
      outcome.rollouts = reader.One<long>();
      const std::vector<char> message = reader.Some<char>();
      outcome.message.assign(message.begin(), message.end());
      const std::vector<double> numbers = reader.Some<double>();
      if (outcome.done) {
        use.set(block, Eigen::Map<const Eigen::VectorXd>(
                           numbers.data(), static_cast<Eigen::Index>(numbers.size())));
      }
    }
  }
  message_.clear();
  bool done = true;
  for (const BlockOutcome& outcome : outcomes) {
    rollouts_ += outcome.rollouts;
    if (done && !outcome.done) message_ = outcome.message;
    done = done && outcome.done;
  }
  return done;
}

bool Linearizer::Rows(const Eigen::VectorXd& p, BlockDerivatives derivatives,
                      std::vector<BlockEvaluation>* blocks) {
  blocks->assign(static_cast<size_t>(layout_.num_blocks()), {});
  BlockUse use;
  use.take = [blocks](int block, BlockEvaluation* evaluation) {
    (*blocks)[block] = std::move(*evaluation);
  };
  use.numbers = [blocks](int block) {
    const BlockEvaluation& evaluation = (*blocks)[block];
    Packer pack;
    pack.Add(static_cast<double>(evaluation.rollouts));
    pack.Add(RowMatrixXd(evaluation.residuals));
    pack.Add(static_cast<double>(evaluation.jacobian.cols()));
    pack.Add(evaluation.jacobian);
    return pack.numbers();
  };
  use.set = [blocks](int block, const Eigen::VectorXd& numbers) {
    BlockEvaluation& evaluation = (*blocks)[block];
    Unpacker unpack(numbers);
    evaluation.rollouts = static_cast<long>(unpack.Number());
    evaluation.residuals = unpack.Matrix(1);
    const auto columns = static_cast<Eigen::Index>(unpack.Number());
    evaluation.jacobian = unpack.Matrix(columns);
  };
  return EvaluateBlocks(p, derivatives, use);
}

Eigen::VectorXd Linearizer::Numbers(int block, const BlockEvaluation& evaluation,
                                    const Eigen::VectorXd& q_scale, const HuberBounds& huber,
                                    BlockDerivatives derivatives) const {
  const int observations = problem_->num_observation_rows(block);
  const double weight = problem_->weight(block);
  Packer pack;
  for (const double bound : {huber.current, huber.target}) {
    pack.Add(CostOf(evaluation, observations, weight, bound));
    if (derivatives == BlockDerivatives::kCompute) {
      pack.Add(GradientOf(evaluation, q_scale, observations, weight, bound));
    }
  }
  if (derivatives == BlockDerivatives::kCompute) {
    const BlockFactor factor =
        Reduce(evaluation, q_scale, layout_.num_own(block), observations, weight, huber.current);
    pack.Add(factor.remainder);
    pack.Add(factor.factor);
    pack.Add(factor.curved);
  }
  return pack.numbers();
}

bool Linearizer::Compute(const Eigen::VectorXd& q, const HuberBounds& huber,
                         BlockDerivatives derivatives, Eigen::VectorXd* numbers) {
  const Eigen::VectorXd p = ToParameters(entries(), q);
  const Eigen::VectorXd q_scale = ParametersByInternal(entries(), p);
  problem_->SetHuber(huber.current);
  std::vector<Eigen::VectorXd> blocks(static_cast<size_t>(layout_.num_blocks()));
  BlockUse use;
  use.take = [&](int block, BlockEvaluation* evaluation) {
    blocks[block] = Numbers(block, *evaluation, layout_.Local(block, q_scale), huber, derivatives);
  };
  use.numbers = [&](int block) { return blocks[block]; };
  use.set = [&](int block, const Eigen::VectorXd& numbers_of) { blocks[block] = numbers_of; };
  if (!EvaluateBlocks(p, derivatives, use)) {
    return false;
  }
  Packer pack;
  for (const Eigen::VectorXd& block : blocks) {
    pack.Add(block);
  }
  *numbers = pack.numbers();
  if (!numbers->allFinite()) {
    message_ = "the cost is not finite: an observation, a prior or a sigma is beyond all bounds";
  }
  return message_.empty();
}

bool Linearizer::Logged(const Eigen::VectorXd& q, const HuberBounds& huber,
                        BlockDerivatives derivatives, Eigen::VectorXd* numbers) {
  if (log_ == nullptr) {
    return Compute(q, huber, derivatives, numbers);
  }
  RowMatrixXd none;  // only that a Jacobian is asked for matters to the log
  return log_->Evaluate(
      q,
      [&](Eigen::VectorXd* computed, RowMatrixXd*) {
        return Compute(q, huber, derivatives, computed);
      },
      numbers, derivatives == BlockDerivatives::kCompute ? &none : nullptr, &rollouts_, &message_);
}

bool Linearizer::Cost(const Eigen::VectorXd& q, const HuberBounds& huber, Eigen::VectorXd* current,
                      double* target) {
  Eigen::VectorXd numbers;
  if (!Logged(q, huber, BlockDerivatives::kSkip, &numbers)) {
    return false;
  }
  Unpacker unpack(numbers);
  current->resize(layout_.num_blocks());
  *target = 0.0;
  for (double& cost : *current) {
    cost = unpack.Number();
    *target += unpack.Number();
  }
  return true;
}

bool Linearizer::Linearise(const Eigen::VectorXd& q, const HuberBounds& huber,
                           Linearisation* current, Linearisation* target) {
  Eigen::VectorXd numbers;
  if (!Logged(q, huber, BlockDerivatives::kCompute, &numbers)) {
    return false;
  }
  Unpacker unpack(numbers);
  for (Linearisation* model : {current, target}) {
    *model = {0.0, Eigen::VectorXd::Zero(layout_.num_parameters()), {}};
  }
  for (int block = 0; block < layout_.num_blocks(); ++block) {
    const int local = layout_.num_local(block);
    for (Linearisation* model : {current, target}) {
      model->cost += unpack.Number();
      const Eigen::VectorXd gradient = unpack.Vector(local);
      for (int i = 0; i < local; ++i) {
        model->gradient[layout_.ParameterOf(block, i)] += gradient[i];
      }
    }
    BlockFactor factor;
    factor.remainder = unpack.Number();
    factor.factor = unpack.Matrix(local + 1);
    factor.curved = unpack.Matrix(local);
    current->blocks.push_back(std::move(factor));
  }
  return true;
}

}  // namespace tangible
