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
    const GradientResult other = Jacobian(scene, paths, method);
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

}  // namespace tangible::testing
