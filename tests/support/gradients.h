// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Jacobians of a scene by paths of its parameters, and methods that must agree.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "jets.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible::testing {

/// Paths that are known to match.
inline std::vector<ParameterPath> Resolve(const Scene& scene,
                                          const std::vector<std::string>& paths) {
  std::vector<ParameterPath> parameters;
  for (const std::string& path : paths) {
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene, path, &parameters.emplace_back(), &error)) << error;
  }
  return parameters;
}

/// Done or not.
inline GradientResult JacobianOf(const Scene& scene, const std::vector<std::string>& paths,
                                 GradientMethod method,
                                 CertificatePass certificate = CertificatePass::kRun) {
  GradientOptions options;
  options.method = method;
  options.certificate = certificate;
  return FinalStateJacobian(scene, Resolve(scene, paths), options);
}

/// Of a scene that is known to run.
inline GradientResult Jacobian(const Scene& scene, const std::vector<std::string>& paths,
                               GradientMethod method,
                               CertificatePass certificate = CertificatePass::kRun) {
  GradientResult result = JacobianOf(scene, paths, method, certificate);
  EXPECT_TRUE(result.done) << result.message;
  return result;
}

/// The other four methods give the adjoint's Jacobian: those by formulas and implicit Jets to 1e-9
/// of a column's largest, unrolled Jets to 1e-6, differences to 1e-5.
inline void ExpectOthersAgree(const Scene& scene, const std::vector<std::string>& paths,
                              const GradientResult& adjoint) {
  std::vector<std::pair<GradientMethod, double>> others = {
      {GradientMethod::kTangent, 1e-9}, {GradientMethod::kFiniteDifference, 1e-5}};
  if (HaveJets()) {
    others.emplace_back(GradientMethod::kJetImplicit, 1e-9);
    others.emplace_back(GradientMethod::kJet, 1e-6);
  }
  for (const auto& [method, tolerance] : others) {
    // The certificate is the same whatever the method, and takes several runs.
    const GradientResult other = Jacobian(scene, paths, method, CertificatePass::kSkip);
    ASSERT_EQ(other.jacobian.rows(), adjoint.jacobian.rows());
    for (Eigen::Index c = 0; c < adjoint.jacobian.cols(); ++c) {
      const double size = adjoint.jacobian.col(c).cwiseAbs().maxCoeff();
      for (Eigen::Index r = 0; r < adjoint.jacobian.rows(); ++r) {
        EXPECT_NEAR(other.jacobian(r, c), adjoint.jacobian(r, c), tolerance * size + 1e-9)
            << "method " << static_cast<int>(method) << ", " << adjoint.outputs[r] << " by "
            << paths[c];
      }
    }
  }
}

/// Derivatives by all methods, and by differences with two steps; no column is zero.
inline GradientResult ExpectAllAgree(const Scene& scene, const std::vector<std::string>& paths) {
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  ExpectOthersAgree(scene, paths, result);
  for (const double step : {3e-6, 1.5e-6}) {
    GradientOptions options;
    options.method = GradientMethod::kFiniteDifference;
    options.step = step;
    options.certificate = CertificatePass::kSkip;
    const GradientResult differences = FinalStateJacobian(scene, Resolve(scene, paths), options);
    EXPECT_TRUE(differences.done) << differences.message;
    for (Eigen::Index c = 0; c < result.jacobian.cols(); ++c) {
      const double size = result.jacobian.col(c).cwiseAbs().maxCoeff();
      EXPECT_GT(size, 1e-3) << paths[c];
      // Steps² times third derivatives, and an event's rounding over the step.
      EXPECT_LT((result.jacobian.col(c) - differences.jacobian.col(c)).cwiseAbs().maxCoeff(),
                1e-5 * size + 1e-6)
          << paths[c] << " by a step of " << step;
    }
  }
  return result;
}

/// The pose and the twist of the first body.
inline void ExpectNear(const State<double>& a, const State<double>& b, double tolerance) {
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.pose[i], b.pose[i], tolerance) << i;
    EXPECT_NEAR(a.twist[i], b.twist[i], tolerance) << i;
  }
}

}  // namespace tangible::testing
