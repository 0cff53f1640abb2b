// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_residual.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/system/contact_system.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/math/leased.h"

namespace tangible {
namespace {

// The upper limit of the speed scale due to impulses, as a multiple of the fastest body's speed.
// For a body between masses 1e20 times as large that scale would exceed all actual speeds, and
// every residual would seem small.
constexpr double kMostPushed = 1e6;

// x / scale, with 0/0 = 0. Numbers next to the smallest ones have no digits to be compared: what
// decays by its rounding in each step comes there.
double ShareOf(double x, double scale) { return scale > kLeastScale ? x / scale : 0.0; }

// The largest component of a row for a body, with rotation taken at the body's lever.
double RowSize(const RowPart<double>& row, double lever) {
  return std::max({std::abs(row[0]), std::abs(row[1]), std::abs(row[2]) / lever});
}

// Scale of a row's value: for each body its largest term, at the body's speed scale.
double RowSpeed(const ContactScales& scales, int a, const RowPart<double>& row_a, int b,
                const RowPart<double>& row_b) {
  return (a >= 0 ? scales.speed[a] * RowSize(row_a, scales.lever[a]) : 0.0) +
         (b >= 0 ? scales.speed[b] * RowSize(row_b, scales.lever[b]) : 0.0);
}

// |min(z/ζ, s/σ)|. A scale that overflows would make every residual seem small.
double RowResidual(double z, double zeta, double s, double sigma) {
  if (!std::isfinite(sigma)) return HUGE_VAL;
  return std::abs(std::min(ShareOf(z, zeta), ShareOf(s, sigma)));
}

struct ResidualScratch {
  ContactScales scales;
  std::vector<double> left;
  std::vector<double> terms;  // the largest of each row
};

// The residual is relative to the terms of each body itself: those of a heavy body would hide the
// error of a light one. What a body at rest keeps of its last step's rounding is no such term: the
// least scale is the momentum of the body at a share of the fastest speed.
double MomentumResidual(const ContactProblem<double>& problem,
                        const ContactSolution<double>& solution, ResidualScratch* scratch) {
  const ContactScales& scales = scratch->scales;
  std::vector<double>& left = scratch->left;
  std::vector<double>& terms = scratch->terms;
  left.assign(problem.load.begin(), problem.load.end());
  terms.resize(left.size());
  const double* v = solution.motion.data();
  for (size_t i = 0; i < left.size(); ++i) {
    terms[i] = std::max(std::abs(left[i]), std::abs(problem.mass[i] * v[i]));
    left[i] -= problem.mass[i] * v[i];
  }
  // `size` is the size of the terms that cancel in the impulse.
  const auto add_sized = [&](int a, const RowPart<double>& row_a, int b,
                             const RowPart<double>& row_b, double impulse, double size) {
    AddRowTransposed(a, row_a, b, row_b, impulse, left.data());
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) terms[3 * a + i] = std::max(terms[3 * a + i], std::abs(row_a[i]) * size);
      if (b >= 0) terms[3 * b + i] = std::max(terms[3 * b + i], std::abs(row_b[i]) * size);
    }
  };
  const auto add = [&](int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
                       double impulse) {
    add_sized(a, row_a, b, row_b, impulse, std::abs(impulse));
  };
  for (const DamperBlock<double>& d : problem.dampers) {
    double size = 0.0;
    for (int i = 0; i < 3; ++i) {
      size = std::max({size, d.a >= 0 ? std::abs(d.row_a[i] * v[3 * d.a + i]) : 0.0,
                       d.b >= 0 ? std::abs(d.row_b[i] * v[3 * d.b + i]) : 0.0});
    }
    add_sized(d.a, d.row_a, d.b, d.row_b, -d.weight * RowDot(d.a, d.row_a, d.b, d.row_b, v),
              std::abs(d.weight) * size);
  }
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    const JointBlock<double>& joint = problem.joints[j];
    for (int k = 0; k < joint.rows; ++k) {
      add(joint.a, joint.row_a[k], joint.b, joint.row_b[k], solution.joint_impulse[3 * j + k]);
    }
    if (joint.c >= 0) {
      add(joint.c, joint.row_c, joint.d, joint.row_d, solution.joint_impulse[3 * j]);
    }
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = problem.contacts[i];
    add(c.a, c.normal_a, c.b, c.normal_b, solution.normal_impulse[i]);
    add(c.a, c.tangent_a, c.b, c.tangent_b, solution.tangent_impulse[i]);
  }
  double worst = 0.0;
  for (int body = 0; body < problem.num_bodies; ++body) {
    const double lever = scales.lever[body];
    const double* x = &left[3 * body];
    const double* of = &terms[3 * body];
    const double missing = std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2]) / lever});
    const double least = kLeastMomentum * problem.mass[3 * body] * scales.fastest();
    const double scale = std::max({of[0], of[1], of[2] / lever, least});
    // Terms that overflow would make every residual seem small.
    if (!std::isfinite(scale) || std::isnan(x[0] + x[1] + x[2])) return HUGE_VAL;
    worst = std::max(worst, ShareOf(missing, scale));
  }
  return worst;
}

double JointResidual(const ContactProblem<double>& problem, const ContactScales& scales,
                     const double* v) {
  double worst = 0.0;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int k = 0; k < joint.rows; ++k) {
      const double value = JointRowDot(joint, k, v);
      double scale = std::abs(joint.rhs[k]) +
                     RowSpeed(scales, joint.a, joint.row_a[k], joint.b, joint.row_b[k]);
      if (joint.c >= 0) scale += RowSpeed(scales, joint.c, joint.row_c, joint.d, joint.row_d);
      if (!std::isfinite(scale)) return HUGE_VAL;
      worst = std::max(worst, ShareOf(std::abs(value - joint.rhs[k]), scale));
    }
  }
  return worst;
}

}  // namespace

void ContactScales::Compute(const ContactProblem<double>& problem,
                            const ContactSolution<double>& solution) {
  ComputeSpeeds(problem, solution);
  if (!AddPushes(problem, solution)) {
    ComputeSpeeds(problem, solution);
    RaiseLevers(problem, solution);
    AddPushes(problem, solution);
  }
  impulse = 0.0;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (!problem.contacts[i].limit_given) {
      impulse = std::max(impulse, std::abs(solution.normal_impulse[i]));
    }
  }
}

void ContactScales::ComputeSpeeds(const ContactProblem<double>& problem,
                                  const ContactSolution<double>& solution) {
  const std::vector<double>& momentum = problem.scale_load();
  const std::vector<double>& mass = problem.mass;
  speed.assign(problem.num_bodies, 0.0);
  lever.assign(problem.num_bodies, 0.0);
  total_ = 0.0;
  fastest_ = 0.0;
  for (int body = 0; body < problem.num_bodies; ++body) {
    lever[body] = std::sqrt(mass[3 * body + 2] / mass[3 * body]);
    for (int i = 0; i < 3; ++i) {
      const int k = 3 * body + i;
      const double component =
          std::max(std::abs(solution.motion[k]), std::abs(momentum[k] / mass[k]));
      speed[body] = std::max(speed[body], i < 2 ? component : lever[body] * component);
    }
    total_ += mass[3 * body] * speed[body];
    fastest_ = std::max(fastest_, speed[body]);
  }
  AddGivenFriction(problem, solution);
  for (double& of_body : speed) {
    of_body = std::max(of_body, kSlowest * fastest_);
  }
}

void ContactScales::AddGivenFriction(const ContactProblem<double>& problem,
                                     const ContactSolution<double>& solution) {
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    if (!contact.limit_given) continue;
    const auto add = [&](int body, const RowPart<double>& row) {
      if (body < 0) return;
      const double size = RowSize(row, lever[body]) * std::abs(solution.tangent_impulse[i]);
      total_ = std::max(total_, size);
      fastest_ = std::max(fastest_, size / problem.mass[3 * body]);
    };
    add(contact.a, contact.tangent_a);
    add(contact.b, contact.tangent_b);
  }
}

void ContactScales::RaiseLevers(const ContactProblem<double>& problem,
                                const ContactSolution<double>& solution) {
  ForEachImpulse(problem, solution, [this](int body, const RowPart<double>& row, double /*z*/) {
    const double straight = std::max(std::abs(row[0]), std::abs(row[1]));
    if (body >= 0 && straight > 0.0) {
      lever[body] = std::max(lever[body], kLeastLever * std::abs(row[2]) / straight);
    }
  });
}

bool ContactScales::AddPushes(const ContactProblem<double>& problem,
                              const ContactSolution<double>& solution) {
  bool levers_are_long = true;
  ForEachImpulse(problem, solution, [&](int body, const RowPart<double>& row, double z) {
    if (body < 0) return;
    const double straight = std::max(std::abs(row[0]), std::abs(row[1]));
    const double turning = std::abs(row[2]) / lever[body];
    levers_are_long = levers_are_long && !(straight > 0.0 && kLeastLever * turning > straight);
    const double change = std::min(std::abs(z) * std::max(straight, turning), total_);
    const double pushed = std::min(change / problem.mass[3 * body], kMostPushed * fastest_);
    speed[body] = std::max(speed[body], pushed);
  });
  return levers_are_long;
}

ContactValues Evaluate(const ContactProblem<double>& problem, const ContactScales& scales,
                       const ContactBlock<double>& c, const double* v) {
  ContactValues values;
  values.s_n = RowDot(c.a, c.normal_a, c.b, c.normal_b, v) + c.c_n;
  values.scale_n = RowSpeed(scales, c.a, c.normal_a, c.b, c.normal_b) + std::abs(c.c_n);
  values.mobility_n = RowMobility(problem.mass, c.a, c.normal_a, c.b, c.normal_b);
  if (c.limit_given) {
    values.scale_n = 0.0;
  }
  values.slip = values.scale_t = 0.0;
  values.mobility_t = 1.0;
  if (c.has_friction) {
    values.slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) + c.c_t;
    values.scale_t = RowSpeed(scales, c.a, c.tangent_a, c.b, c.tangent_b) + std::abs(c.c_t);
    values.mobility_t = RowMobility(problem.mass, c.a, c.tangent_a, c.b, c.tangent_b);
    // Both rows of a contact have one scale of speed, because an impulse along one row leaves
    // rounding in the other.
    values.scale_n = values.scale_t = std::max(values.scale_n, values.scale_t);
  }
  if (c.limit_given) {  // far from closing, as it has no gap
    values.s_n = values.scale_n = values.scale_n > 0.0 ? values.scale_n : 1.0;
    values.mobility_n = c.offset > 0.0 ? values.scale_n / c.offset : 1.0;
  }
  return values;
}

double NormalScale(const ContactBlock<double>& contact, const ContactValues& values,
                   double impulse_scale) {
  const double own = values.scale_n / values.mobility_n;
  return contact.limit_given ? own : std::max(impulse_scale, own);
}

double ImpulseScale(const std::vector<double>& impulses) {
  double scale = 0.0;
  for (const double impulse : impulses) {
    scale = std::max(scale, std::abs(impulse));
  }
  return scale;
}

double NaturalResidual(const ContactProblem<double>& problem,
                       const ContactSolution<double>& solution, int* worst_contact) {
  *worst_contact = -1;
  Leased<ResidualScratch> scratch;
  ContactScales& scales = scratch->scales;
  scales.Compute(problem, solution);
  double worst = std::max(MomentumResidual(problem, solution, &*scratch),
                          JointResidual(problem, scales, solution.motion.data()));
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = problem.contacts[i];
    const ContactValues values = Evaluate(problem, scales, c, solution.motion.data());
    const double normal = solution.normal_impulse[i];
    const double zeta = NormalScale(c, values, scales.impulse);
    double residual = RowResidual(normal - c.offset, zeta, values.s_n, values.scale_n);
    if (c.rolls) {
      residual = zeta > 0.0 ? std::abs(normal - solution.normal_impulse[i - 1]) / zeta : 0.0;
    }
    if (c.has_friction) {
      const double limit = c.friction * normal;
      const double tangent = solution.tangent_impulse[i];
      const double zeta_t = std::max(zeta * c.friction, values.scale_t / values.mobility_t);
      // w⁺ against τ⁺ = μ λn + λt, w⁻ against τ⁻ = μ λn − λt.
      residual = std::max(
          {residual,
           RowResidual(limit + tangent, zeta_t, std::max(0.0, values.slip), values.scale_t),
           RowResidual(limit - tangent, zeta_t, std::max(0.0, -values.slip), values.scale_t)});
    }
    if (!(residual <= worst)) {
      worst = std::isnan(residual) ? HUGE_VAL : residual;
      *worst_contact = static_cast<int>(i);
    }
  }
  return worst;
}

double BalancedResidual(const ContactProblem<double>& problem, double tolerance,
                        ContactSolution<double>* solution, int* worst_contact) {
  const double residual = NaturalResidual(problem, *solution, worst_contact);
  if (residual <= tolerance || *worst_contact >= 0) {
    return residual;
  }
  std::vector<double> v(problem.load.begin(), problem.load.end());
  ForEachImpulse(problem, *solution, [&](int body, const RowPart<double>& row, double impulse) {
    for (int i = 0; body >= 0 && i < 3; ++i) {
      v[3 * body + i] += row[i] * impulse;
    }
  });
  for (size_t i = 0; i < v.size(); ++i) {
    v[i] /= problem.mass[i];
  }
  for (const DamperBlock<double>& d : problem.dampers) {
    for (const int body : {d.a, d.b}) {
      for (int i = 3 * body; body >= 0 && i < 3 * body + 3; ++i) {
        v[i] = solution->motion[i];
      }
    }
  }
  std::swap(v, solution->motion);
  int worst = -1;
  const double balanced = NaturalResidual(problem, *solution, &worst);
  if (!(balanced < residual)) {
    std::swap(v, solution->motion);
    return residual;
  }
  *worst_contact = worst;
  return balanced;
}

void FindDegenerateContacts(const ContactProblem<double>& problem,
                            const ContactSolution<double>& solution, double tolerance,
                            std::vector<int>* degenerate) {
  degenerate->clear();
  const ContactScales scales(problem, solution);
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = problem.contacts[i];
    const ContactValues values = Evaluate(problem, scales, c, solution.motion.data());
    const double normal = solution.normal_impulse[i];
    const double zeta = NormalScale(c, values, scales.impulse);
    const bool grazes =
        std::abs(values.s_n) <= tolerance * values.scale_n && normal - c.offset <= tolerance * zeta;
    const double zeta_t = std::max(zeta * c.friction, values.scale_t / values.mobility_t);
    const bool at_limit =
        c.has_friction && normal > tolerance * zeta &&
        std::abs(values.slip) <= tolerance * values.scale_t &&
        c.friction * normal - std::abs(solution.tangent_impulse[i]) <= tolerance * zeta_t;
    if (grazes || at_limit) {
      degenerate->push_back(static_cast<int>(i));
    }
  }
}

int SlacksOfContact(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
                    const ContactScales& scales, int contact, ContactSlack slacks[2]) {
  using Kind = ContactSlack::Kind;
  const ContactBlock<double>& c = problem.contacts[contact];
  const ContactValues values = Evaluate(problem, scales, c, solution.motion.data());
  const ContactMode mode = solution.modes[contact];
  const double normal = solution.normal_impulse[contact];
  if (mode == ContactMode::kOpen) {
    slacks[0] = {Kind::kClosing, values.s_n, values.scale_n};
    return 1;
  }
  const double zeta = NormalScale(c, values, scales.impulse);
  slacks[0] = c.driven ? ContactSlack{Kind::kClosing, values.s_n, values.scale_n}
                       : ContactSlack{Kind::kOpening, normal - c.offset, zeta};
  if (mode == ContactMode::kClosed) return 1;
  if (mode == ContactMode::kSticking) {
    const double zeta_t = std::max(zeta * c.friction, values.scale_t / values.mobility_t);
    const double left = c.friction * normal - std::abs(solution.tangent_impulse[contact]);
    slacks[1] = {Kind::kFrictionLimit, left, zeta_t};
  } else {
    slacks[1] = {Kind::kSlidingSpeed, SlidingSign(mode) * values.slip, values.scale_t};
  }
  return 2;
}

ContactMargin MarginOfContact(const ContactProblem<double>& problem,
                              const ContactSolution<double>& solution, const ContactScales& scales,
                              int contact) {
  ContactSlack slacks[2];
  const int count = SlacksOfContact(problem, solution, scales, contact, slacks);
  // 0 / 0 counts as 0: nothing moves and nothing pushes.
  const auto margin = [](const ContactSlack& slack) {
    return ContactMargin{slack.scale > 0.0 ? slack.value / slack.scale : 0.0, slack.kind};
  };
  const ContactMargin first = margin(slacks[0]);
  if (count == 1) return first;
  const ContactMargin friction = margin(slacks[1]);
  return friction.value < first.value ? friction : first;
}

int MostViolatedJoint(const ContactProblem<double>& problem, const std::vector<double>& v,
                      const std::vector<double>& sizes, double share) {
  int worst = -1;
  const size_t size = 3 * static_cast<size_t>(problem.num_bodies);
  if (v.size() != size || sizes.size() != size) {
    return worst;
  }
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    const JointBlock<double>& joint = problem.joints[j];
    for (int k = 0; k < joint.rows; ++k) {
      const double left = JointRowDot(joint, k, v.data());
      double terms = std::abs(joint.rhs[k]);
      for (int i = 0; i < 3; ++i) {
        terms += joint.a >= 0 ? std::abs(joint.row_a[k][i] * sizes[3 * joint.a + i]) : 0.0;
        terms += joint.b >= 0 ? std::abs(joint.row_b[k][i] * sizes[3 * joint.b + i]) : 0.0;
        terms += joint.c >= 0 ? std::abs(joint.row_c[i] * sizes[3 * joint.c + i]) : 0.0;
        terms += joint.d >= 0 ? std::abs(joint.row_d[i] * sizes[3 * joint.d + i]) : 0.0;
      }
      const double missed = std::abs(left - joint.rhs[k]);
      if (missed > share * terms) {
        share = missed / terms;
        worst = static_cast<int>(j);
      }
    }
  }
  return worst;
}

}  // namespace tangible
