// SPDX-License-Identifier: Apache-2.0
//
// Every scene of data/scenes: the derivatives of the final state with respect to all of its numbers
// by all five methods.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "../support/thorough.h"
#include "tangible/config/jet_widths.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/verification/support/compare.h"
#include "tangible/verification/support/differences.h"

namespace tangible {
namespace {

/// Whether Jets are built at all.
bool HaveJets() {
  int widths = 0;
#define TANGIBLE_COUNT(N) ++widths;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_COUNT)
#undef TANGIBLE_COUNT
  return widths > 0;
}

// At most so many numbers through unrolled Jets, evenly spread: they take a hundred times longer.
int MaxUnrolled() { return testing::Thorough() ? 24 : 4; }
// At most so many through differences, which take 40 runs each.
int MaxDifferenced() { return testing::Thorough() ? 32 : 6; }
// Longer runs are cut here: their derivatives are summed from as many steps, but each number takes
// nine runs of differences.
double MaxSteps() { return testing::Thorough() ? 2000.0 : 1000.0; }
// An entry of differences whose own error estimate is above this fraction decides nothing.
constexpr double kResolved = 1e-3;

std::vector<std::string> SceneFiles() {
  std::vector<std::string> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(TANGIBLE_SOURCE_DIR "/data/scenes")) {
    // chain_fine is the chain with a step so short that its runs, cut, would end before the impact.
    if (entry.path().extension() == ".json" && entry.path().stem() != "chain_fine") {
      files.push_back(entry.path().stem().string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

Scene Load(const std::string& name) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(LoadScene(TANGIBLE_SOURCE_DIR "/data/scenes/" + name + ".json", &scene, &error))
      << error;
  scene.simulation.duration = std::min(scene.simulation.duration, MaxSteps() * scene.simulation.dt);
  return scene;
}

std::vector<ParameterPath> AllNumbers(Scene scene) {
  std::vector<ParameterPath> all;
  for (const SceneNumber<double>& number : EnumerateNumbers(&scene)) {
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene, number.path, &all.emplace_back(), &error)) << error;
  }
  return all;
}

class DataSceneTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    scene_ = Load(GetParam());
    parameters_ = AllNumbers(scene_);
    ASSERT_FALSE(parameters_.empty());
    tangent_ = Jacobian(GradientMethod::kTangent, parameters_);
    ASSERT_TRUE(tangent_.done) << tangent_.message;
    magnitudes_ = ContributionMagnitudes(scene_, parameters_);
  }

  GradientResult Jacobian(GradientMethod method, const std::vector<ParameterPath>& parameters,
                          CertificatePass certificate = CertificatePass::kSkip) const {
    GradientOptions options;
    options.method = method;
    options.certificate = certificate;
    return FinalStateJacobian(scene_, parameters, options);
  }

  std::string Where(Eigen::Index output, Eigen::Index parameter) const {
    return "d " + tangent_.outputs[output] + " / d " + parameters_[parameter].path;
  }

  void ExpectAgrees(const GradientResult& other, double tolerance) const {
    ASSERT_TRUE(other.done) << other.message;
    ASSERT_EQ(other.jacobian.cols(), tangent_.jacobian.cols());
    for (Eigen::Index o = 0; o < tangent_.jacobian.rows(); ++o) {
      for (Eigen::Index p = 0; p < tangent_.jacobian.cols(); ++p) {
        const double a = other.jacobian(o, p);
        const double b = tangent_.jacobian(o, p);
        // The turning of a body on a rail is taken away by its joint to the last digit but one,
        // which S counts in units of what is left of it: 1e-18 is nothing to outputs of order 1.
        EXPECT_TRUE(Agree(a, b, tolerance, magnitudes_(o, p)) || std::abs(a - b) <= 1e-18)
            << Where(o, p) << ": " << a << ", tangent " << b << ", contributions "
            << magnitudes_(o, p);
      }
    }
  }

  Scene scene_;
  std::vector<ParameterPath> parameters_;
  GradientResult tangent_;
  MatrixX<double> magnitudes_;
};

TEST_P(DataSceneTest, ItsDerivativesAreTrustworthy) {
  const GradientResult adjoint =
      Jacobian(GradientMethod::kAdjoint, parameters_, CertificatePass::kRun);
  ASSERT_TRUE(adjoint.done) << adjoint.message;
  EXPECT_TRUE(IsTrustworthyMap(adjoint.certificate)) << adjoint.certificate.verdict;
}

TEST_P(DataSceneTest, AnalyticMethodsAgree) {
  ExpectAgrees(Jacobian(GradientMethod::kAdjoint, parameters_), 1e-9);
  if (HaveJets()) {
    ExpectAgrees(Jacobian(GradientMethod::kJetImplicit, parameters_), 1e-9);
  }
}

TEST_P(DataSceneTest, UnrolledJetsAgree) {
  if (!HaveJets()) {
    GTEST_SKIP() << "no width of Jets was built";
  }
  const int stride = (static_cast<int>(parameters_.size()) + MaxUnrolled() - 1) / MaxUnrolled();
  std::vector<ParameterPath> some;
  for (size_t p = 0; p < parameters_.size(); p += stride) {
    some.push_back(parameters_[p]);
  }
  const GradientResult unrolled = Jacobian(GradientMethod::kJet, some);
  ASSERT_TRUE(unrolled.done) << unrolled.message;
  EXPECT_EQ(unrolled.fallbacks, 0);
  for (Eigen::Index o = 0; o < tangent_.jacobian.rows(); ++o) {
    for (size_t k = 0; k < some.size(); ++k) {
      const auto p = static_cast<Eigen::Index>(k * stride);
      // The interior point's step length is common to all rows, and it ends at a complementarity
      // above 0: 1e-11 of the column's contributions.
      const double common = std::max(1.0, magnitudes_.col(p).maxCoeff());
      const double entry = unrolled.jacobian(o, static_cast<Eigen::Index>(k));
      EXPECT_TRUE(Agree(entry, tangent_.jacobian(o, p), 1e-6, common, 1e-11))
          << Where(o, p) << ": " << entry << ", tangent " << tangent_.jacobian(o, p);
    }
  }
}

TEST_P(DataSceneTest, DifferencesAgree) {
  const RunTrace trace = TraceRun(scene_);
  ASSERT_TRUE(trace.done) << trace.message;
  const VectorX<double> noise = RoundingNoise(scene_, trace);
  long compared = 0;
  long judged = 0;
  long nonzero = 0;
  const size_t stride = (parameters_.size() + MaxDifferenced() - 1) / MaxDifferenced();
  for (size_t k = 0; k < parameters_.size(); k += stride) {
    const auto p = static_cast<Eigen::Index>(k);
    compared += tangent_.jacobian.rows();
    const DifferenceColumn column = FiniteDifferences(scene_, trace, noise, parameters_[k]);
    if (column.status != DifferenceStatus::kJudged) {
      continue;
    }
    const double largest = tangent_.jacobian.col(p).cwiseAbs().maxCoeff();
    for (Eigen::Index o = 0; o < tangent_.jacobian.rows(); ++o) {
      const double a = tangent_.jacobian(o, p);
      const double b = column.values[o];
      const double error = column.errors[o];
      if (error > kResolved * std::max({std::abs(b), kResolved * largest, kResolved * kResolved})) {
        continue;
      }
      ++judged;
      nonzero += a != 0.0 ? 1 : 0;
      EXPECT_LE(std::abs(a - b),
                std::max(1e-5 * std::abs(b), 4.0 * error) + 1e-13 * magnitudes_(o, p) + 1e-16)
          << Where(o, p) << ": " << b << " ± " << error << ", tangent " << a;
    }
  }
  // Most entries were judged, and many say something. In a train of gears most bodies only turn,
  // and a few of its numbers are mostly such that move two of the 22 outputs.
  std::cout << judged << " of " << compared << " entries judged, " << nonzero << " not 0\n";
  EXPECT_GE(judged, compared * 3 / 4);
  EXPECT_GE(nonzero, judged / (testing::Thorough() ? 8 : 12));
}

INSTANTIATE_TEST_SUITE_P(Scenes, DataSceneTest, ::testing::ValuesIn(SceneFiles()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace tangible
