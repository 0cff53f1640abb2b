// SPDX-License-Identifier: Apache-2.0
//
// Derivatives of rollouts of random scenes by every method, against each other and against
// differences. 100 scenes; the environment's TANGIBLE_RANDOM_SCENES asks for another number, and
// TANGIBLE_FIRST_SEED for another start.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "tangible/simulation/gradient.h"
#include "tangible/verification/support/compare.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

constexpr int kMaxParameters = 24;
// An entry of differences whose own error estimate is above this fraction decides nothing.
constexpr double kResolved = 1e-3;
constexpr double kExcludedLimit = 0.15;
constexpr double kUnsolvedLimit = 0.03;  // of the scenes
#define TANGIBLE_COUNT_WIDTH(N) +1
constexpr bool kNoJets = 0 TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_COUNT_WIDTH) == 0;
#undef TANGIBLE_COUNT_WIDTH
const char* const kUnrolled = "unrolled Jets";

int FromEnvironment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

/// All numbers of a scene, or a random choice of them.
std::vector<ParameterPath> ChooseParameters(Scene scene, unsigned seed) {
  std::vector<ParameterPath> chosen;
  for (const SceneNumber<double>& number : EnumerateNumbers(&scene)) {
    std::string error;
    ParameterPath path;
    EXPECT_TRUE(ResolveParameter(scene, number.path, &path, &error)) << error;
    chosen.push_back(path);
  }
  RandomNumbers random(seed);
  while (static_cast<int>(chosen.size()) > kMaxParameters) {
    chosen.erase(chosen.begin() + random.Integer(0, static_cast<int>(chosen.size()) - 1));
  }
  return chosen;
}

/// The kind of a parameter: its path without names and digits.
std::string KindOf(const std::string& path) {
  const size_t first = path.find('/');
  const size_t second = path.find('/', first + 1);
  if (second == std::string::npos) {
    return path;
  }
  std::string kind = path.substr(0, first) + path.substr(second);
  std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
  return kind;
}

struct Tally {
  int unsolved = 0;
  long entries = 0;
  long judged = 0;
  std::map<std::string, long> excluded;
  std::map<std::string, long> kinds;  ///< judged entries that are not 0
  long nonzero = 0;
  long unrolled = 0, unrolled_fallbacks = 0, unrolled_skipped = 0;
  long closed = 0, sliding = 0, sticking = 0, limits = 0, impacts = 0, recoveries = 0;

  long Excluded() const {
    long sum = 0;
    for (const auto& [why, count] : excluded) {
      sum += count;
    }
    return sum;
  }
  std::string Report() const {
    std::ostringstream out;
    out << entries << " entries, " << judged << " judged by differences (" << nonzero
        << " not 0)\n";
    for (const auto& [why, count] : excluded) {
      out << "  excluded, " << why << ": " << count << "\n";
    }
    out << "unrolled scenes " << unrolled << ", not compared " << unrolled_skipped
        << ", steps taken implicitly " << unrolled_fallbacks << "\n"
        << "closed contacts " << closed << ": sliding " << sliding << ", sticking " << sticking
        << ", limits " << limits << ", impacts " << impacts << ", recovering " << recoveries
        << "\n";
    return out.str();
  }
};

class RandomGradient {
 public:
  RandomGradient(unsigned seed, Tally* tally)
      : seed_(seed),
        tally_(*tally),
        scene_(RandomScene(seed)),
        parameters_(ChooseParameters(scene_, seed)) {}

  void Check() {
    trace_ = TraceRun(scene_);
    if (!trace_.done) {
      // A body between a kinematic one and a floor that hold it may have nowhere to go.
      ++tally_.unsolved;
      std::cout << "seed " << seed_ << ": " << trace_.message << "\n";
      return;
    }
    tally_.closed += trace_.closed;
    tally_.sliding += trace_.sliding;
    tally_.sticking += trace_.sticking;
    tally_.limits += trace_.limits;
    tally_.impacts += trace_.impacts;
    tally_.recoveries += trace_.recoveries;
    tangent_ = Jacobian(GradientMethod::kTangent, Factorisations::kKeep);
    ASSERT_TRUE(tangent_.done) << tangent_.message;
    magnitudes_ = ContributionMagnitudes(scene_, parameters_);
    Compare("adjoint", Jacobian(GradientMethod::kAdjoint, Factorisations::kKeep), 1e-9,
            magnitudes_);
    Compare("adjoint, recomputed", Jacobian(GradientMethod::kAdjoint, Factorisations::kRecompute),
            1e-9, magnitudes_);
    if (kNoJets) {
      return;
    }
    Compare("implicit Jets", Jacobian(GradientMethod::kJetImplicit, Factorisations::kKeep), 1e-9,
            magnitudes_);
    CheckUnrolled();
    CheckDifferences();
  }

 private:
  GradientResult Jacobian(GradientMethod method, Factorisations factorisations) const {
    GradientOptions options;
    options.method = method;
    options.factorisations = factorisations;
    options.certificate = CertificatePass::kSkip;
    return FinalStateJacobian(scene_, parameters_, options);
  }

  std::string Where(int output, int parameter) const {
    std::ostringstream out;
    out << "seed " << seed_ << ", output " << output << ", " << parameters_[parameter].path;
    return out.str();
  }

  void Compare(const std::string& method, const GradientResult& other, double tolerance,
               const MatrixX<double>& magnitudes) {
    ASSERT_TRUE(other.done) << method << ", seed " << seed_ << ": " << other.message;
    int shown = 0;
    for (int o = 0; o < tangent_.jacobian.rows(); ++o) {
      for (int p = 0; p < tangent_.jacobian.cols() && shown < 3; ++p) {
        const double a = other.jacobian(o, p);
        const double b = tangent_.jacobian(o, p);
        if (method == kUnrolled && FrictionIsAbsent(p)) {
          continue;
        }
        const bool agree = Agree(a, b, tolerance, magnitudes(o, p), Rounding(method));
        shown += agree ? 0 : 1;
        EXPECT_TRUE(agree) << method << ", " << Where(o, p) << ": " << a << ", tangent " << b
                           << ", contributions " << magnitudes(o, p);
      }
    }
  }

  // Solves of redundant rows, of loops of joints, are regularised and refined: they lose two
  // digits.
  double Rounding(const std::string& method) const {
    return method == kUnrolled ? 1e-9 : BuildStructure(scene_)->joint_loops ? 1e-11 : 1e-13;
  }

  // A contact without friction has no rows for it, and the unrolled step no derivative with respect
  // to it; the other methods have the one-sided one.
  bool FrictionIsAbsent(int parameter) {
    const ParameterPath& path = parameters_[parameter];
    return path.value == 0.0 && path.path.find("/friction") != std::string::npos;
  }

  void CheckUnrolled() {
    const GradientResult unrolled = Jacobian(GradientMethod::kJet, Factorisations::kKeep);
    tally_.unrolled_fallbacks += unrolled.fallbacks;
    // Another solution of a problem that has several is not an error; near a kink the central path
    // ends elsewhere.
    if (!unrolled.done || trace_.degenerate > 0) {
      ++tally_.unrolled_skipped;
      return;
    }
    ++tally_.unrolled;
    // The interior point's step length is common to all bodies, so each entry has (cancelling)
    // contributions of the size of its column's largest; and rows that are not active keep a little
    // influence, as it ends at a complementarity above 0: 1e-9 of the contributions.
    const MatrixX<double> common =
        magnitudes_.colwise().maxCoeff().cwiseMax(1.0).replicate(magnitudes_.rows(), 1);
    Compare(kUnrolled, unrolled, 1e-6, common);
  }

  void CheckDifferences() {
    int shown = 0;
    const VectorX<double> noise = RoundingNoise(scene_, trace_);
    const int outputs = static_cast<int>(tangent_.jacobian.rows());
    for (int p = 0; p < static_cast<int>(parameters_.size()); ++p) {
      tally_.entries += outputs;
      const std::string& path = parameters_[p].path;
      if ((trace_.friction_tie && path.find("/friction") != std::string::npos) ||
          (trace_.restitution_tie && path.find("/restitution") != std::string::npos)) {
        tally_.excluded["kink of the mixing rule"] += outputs;
        continue;
      }
      const DifferenceColumn column = FiniteDifferences(scene_, trace_, noise, parameters_[p]);
      if (column.status != DifferenceStatus::kJudged) {
        tally_.excluded[column.status == DifferenceStatus::kChoicesDiffer
                            ? "choices differ on either side"
                            : "a perturbed run fails"] += outputs;
        continue;
      }
      for (int o = 0; o < outputs; ++o) {
        shown += JudgeDifference(o, p, column, shown < 3);
      }
    }
  }

  int JudgeDifference(int o, int p, const DifferenceColumn& column, bool show) {
    const double a = tangent_.jacobian(o, p);
    const double b = column.values[o];
    const double error = column.errors[o];
    const double largest = tangent_.jacobian.col(p).cwiseAbs().maxCoeff();
    if (error > kResolved * std::max({std::abs(b), kResolved * largest, kResolved * kResolved})) {
      ++tally_.excluded["differences too coarse"];
      return 0;
    }
    ++tally_.judged;
    if (a != 0.0) {
      ++tally_.nonzero;
      ++tally_.kinds[KindOf(parameters_[p].path)];
    }
    const double allowed =
        std::max(1e-5 * std::abs(b), 10.0 * error) + 1e-13 * magnitudes_(o, p) + 1e-16;
    if (std::abs(a - b) <= allowed) {
      return 0;
    }
    if (show) {
      ADD_FAILURE() << "differences, " << Where(o, p) << ": " << b << " ± " << error << ", tangent "
                    << a << ", contributions " << magnitudes_(o, p) << ", step " << column.step
                    << ", degenerate " << trace_.degenerate;
    }
    return 1;
  }

  const unsigned seed_;
  Tally& tally_;
  const Scene scene_;
  const std::vector<ParameterPath> parameters_;
  RunTrace trace_;
  GradientResult tangent_;
  MatrixX<double> magnitudes_;
};

TEST(RandomGradientTest, EveryMethodAgrees) {
  Tally tally;
  const int first = FromEnvironment("TANGIBLE_FIRST_SEED", 1);
  const int count = FromEnvironment("TANGIBLE_RANDOM_SCENES", 100);
  for (int seed = first; seed < first + count; ++seed) {
    RandomGradient(seed, &tally).Check();
  }
  std::cout << tally.Report();
  for (const auto& [kind, entries] : tally.kinds) {
    std::cout << "  " << kind << " " << entries << "\n";
  }
  EXPECT_LE(tally.unsolved, kUnsolvedLimit * count);
  EXPECT_LE(tally.Excluded(), kExcludedLimit * tally.entries);
  if (count < 100) {
    return;
  }
  // What the scenes are meant to reach was reached.
  EXPECT_GT(tally.nonzero, tally.judged / 4);
  EXPECT_GT(tally.sliding, 0);
  EXPECT_GT(tally.sticking, 0);
  EXPECT_GT(tally.limits, 0);
  EXPECT_GT(tally.impacts, 0);
  EXPECT_GT(tally.recoveries, 0);
}

}  // namespace
}  // namespace tangible
