// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/methods.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tangible/verification/gradients/closed_form.h"

namespace tangible {
namespace {

// MethodJacobians::friction_share. V is that of the start, the end and what efforts cause in a
// step; 1 where all are 0, as in the interior point.
double FrictionShare(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const ModelStructure& s = *model.structure;
  const double h = scene.simulation.dt;
  const auto mobility = [&](const JointIndex& joint) {
    double sum = 0.0;
    for (const int body : {joint.a, joint.b}) {
      const BodyIndex& index = s.bodies[body];
      if (index.block < 0) continue;
      sum +=
          1.0 / model.parameters[joint.type == JointType::kRevolute ? index.inertia : index.mass];
    }
    return sum;
  };
  double speed = h * scene.gravity.norm();
  for (const double v : state.twist) speed = std::max(speed, std::abs(v));
  State<double> final;
  Rollout(model, state, {}, &final);
  for (const double v : final.twist) speed = std::max(speed, std::abs(v));
  for (const JointIndex& joint : s.joints) {
    if (joint.friction < 0 || joint.effort < 0 || joint.effort_signal >= 0) continue;
    speed = std::max(speed, h * std::abs(model.parameters[joint.effort]) * mobility(joint));
  }
  if (speed == 0.0) speed = 1.0;
  double share = 1.0;
  for (const JointIndex& joint : s.joints) {
    if (joint.friction < 0 || !(model.parameters[joint.friction] > 0.0)) continue;
    share = std::min(share, h * model.parameters[joint.friction] * mobility(joint) / speed);
  }
  return share;
}

class MethodRun {
 public:
  MethodRun(const Scene& scene, const std::vector<ParameterPath>& parameters,
            const std::optional<ClosedFormJacobian>& known)
      : scene_(scene), parameters_(parameters), known_(known) {}

  MethodJacobians Run() {
    // The certificate is computed with the first method, before anything is compared.
    const GradientResult tangent = Differentiate(parameters_, GradientMethod::kTangent,
                                                 Factorisations::kKeep, CertificatePass::kRun);
    r_.outputs = tangent.outputs;
    if (!tangent.done) {
      r_.message = tangent.message;
      return std::move(r_);
    }
    r_.done = true;
    r_.certificate = tangent.certificate;
    NameKinks();
    r_.jacobian[kByTangent] = tangent.jacobian;
    r_.trace = TraceRun(scene_);
    r_.contributions = ContributionsOf(scene_, parameters_);
    if (scene_.simulation.stepping == Stepping::kFixed) r_.friction_share = FrictionShare(scene_);
    Add(kByAdjoint, GradientMethod::kAdjoint, Factorisations::kKeep);
    Add(kByAdjointRecomputed, GradientMethod::kAdjoint, Factorisations::kRecompute);
    Add(kByImplicitJets, GradientMethod::kJetImplicit, Factorisations::kKeep);
    Add(kByUnrolledJets, GradientMethod::kJet, Factorisations::kKeep);
    AddDifferences();
    AddClosedForm();
    return std::move(r_);
  }

 private:
  GradientResult Differentiate(const std::vector<ParameterPath>& parameters, GradientMethod method,
                               Factorisations factorisations, CertificatePass certificate,
                               DerivativeSide side = DerivativeSide::kBoth) const {
    GradientOptions options;
    options.side = side;
    options.method = method;
    options.factorisations = factorisations;
    options.certificate = certificate;
    return FinalStateJacobian(scene_, parameters, options);
  }

  // Some reasons (equal coefficients in the mixing rule, friction 0) concern only some parameters.
  void NameKinks() {
    r_.named.resize(parameters_.size());
    if (IsTrustworthyMap(r_.certificate)) {
      return;
    }
    for (size_t k = 0; k < parameters_.size(); ++k) {
      const GradientResult one = Differentiate({parameters_[k]}, GradientMethod::kTangent,
                                               Factorisations::kKeep, CertificatePass::kRun);
      r_.named[k] = IsTrustworthyMap(one.certificate) ? "" : one.certificate.verdict;
    }
  }

  void Add(Method place, GradientMethod method, Factorisations factorisations) {
    const GradientResult result =
        Differentiate(parameters_, method, factorisations, CertificatePass::kSkip);
    if (!result.done) {
      r_.missing[place] = result.message;
      return;
    }
    r_.jacobian[place] = result.jacobian;
    if (method == GradientMethod::kJet) {
      r_.unrolled_fallbacks = result.fallbacks;
    }
  }

  void AddDifferences() {
    const VectorX<double> noise = RoundingNoise(scene_, r_.trace);
    const auto rows = static_cast<Eigen::Index>(r_.outputs.size());
    const auto columns = static_cast<Eigen::Index>(parameters_.size());
    for (const Method method : {kByCoarseDifference, kByFineDifference, kByRidders}) {
      r_.jacobian[method].setConstant(rows, columns, kUnknown);
    }
    for (Eigen::Index k = 0; k < columns; ++k) {
      // Where the certificate has named a parameter, the differences of its two sides are not
      // compared.
      DifferenceColumn column =
          FiniteDifferences(scene_, r_.trace, noise, parameters_[k],
                            r_.named[static_cast<size_t>(k)].empty() ? ChoicesDiffer::kCompareSides
                                                                     : ChoicesDiffer::kGiveUp);
      if (column.status == DifferenceStatus::kJudged) {
        r_.jacobian[kByRidders].col(k) = column.values;
      }
      for (int i = 0; i < 2; ++i) {
        if (column.plain[i].status == DifferenceStatus::kJudged) {
          r_.jacobian[kByCoarseDifference + i].col(k) = column.plain[i].values;
        }
      }
      r_.differences.push_back(std::move(column));
    }
  }

  void AddClosedForm() {
    std::optional<ClosedFormJacobian> known = known_ ? known_ : FindClosedForm(scene_, parameters_);
    if (known && known->jacobian.rows() == r_.contributions.sum.rows() &&
        known->jacobian.cols() == r_.contributions.sum.cols()) {
      r_.jacobian[kByClosedForm] = std::move(known->jacobian);
      r_.closed_form_tolerance = known->tolerance;
      r_.known_values = std::move(known->values);
      if (known->plus.size() > 0) {
        AddSide(DerivativeSide::kPlus, kByPlus);
        AddSide(DerivativeSide::kMinus, kByMinus);
        r_.jacobian[kByClosedPlus] = std::move(known->plus);
        r_.jacobian[kByClosedMinus] = std::move(known->minus);
      }
    }
  }

  // One-sided derivatives of the parameters that the certificate has named.
  void AddSide(DerivativeSide side, Method place) {
    r_.jacobian[place].setConstant(static_cast<Eigen::Index>(r_.outputs.size()),
                                   static_cast<Eigen::Index>(parameters_.size()), kUnknown);
    for (size_t k = 0; k < parameters_.size(); ++k) {
      if (r_.named[k].empty()) continue;
      const GradientResult one = Differentiate({parameters_[k]}, GradientMethod::kTangent,
                                               Factorisations::kKeep, CertificatePass::kRun, side);
      if (one.done) r_.jacobian[place].col(static_cast<Eigen::Index>(k)) = one.jacobian.col(0);
    }
  }

  const Scene& scene_;
  const std::vector<ParameterPath>& parameters_;
  const std::optional<ClosedFormJacobian>& known_;
  MethodJacobians r_;
};

}  // namespace

const char* NameOf(Method method) {
  switch (method) {
    case kByTangent:
      return "tangent";
    case kByAdjoint:
      return "adjoint";
    case kByAdjointRecomputed:
      return "adjoint, recomputed";
    case kByImplicitJets:
      return "implicit Jets";
    case kByUnrolledJets:
      return "unrolled Jets";
    case kByCoarseDifference:
      return "difference 1e-4";
    case kByFineDifference:
      return "difference 6e-6";
    case kByRidders:
      return "Ridders";
    case kByClosedForm:
      return "closed form";
    case kByPlus:
      return "plus side";
    case kByMinus:
      return "minus side";
    case kByClosedPlus:
      return "closed form, plus side";
    case kByClosedMinus:
      return "closed form, minus side";
    case kNumMethods:
      break;
  }
  return "";
}

MethodJacobians RunMethods(const Scene& scene, const std::vector<ParameterPath>& parameters,
                           const std::optional<ClosedFormJacobian>& known) {
  return MethodRun(scene, parameters, known).Run();
}

}  // namespace tangible
