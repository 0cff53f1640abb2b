// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/contact_case.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace tangible::corpus {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kStep = 0.01;  // s

struct Vec {
  double x, y;
};

class Maker {
 public:
  Maker(const std::string& kind, std::uint64_t seed, int index)
      : random_(seed * 1000003 + static_cast<std::uint64_t>(index)) {
    case_.kind = kind;
    case_.name = kind + " " + std::to_string(index);
  }

  ContactCase Make(int most_contacts) {
    const int contacts =
        static_cast<int>(std::floor(std::exp(Draw(0.0, std::log(most_contacts + 1.0)))));
    const std::string& kind = case_.kind;
    if (kind == "infeasible") return Squeezed(contacts);
    if (kind == "high friction") {
      friction_low_ = 2.0;
      friction_high_ = 1e6;
      case_.known = Known::kHardlySolvable;
    }
    // Surfaces move and rebound at any speed: no theorem guarantees a solution, and pivots may end
    // on a ray.
    if (kind == "restitution") case_.known = Known::kHardlySolvable;
    if (kind == "frictionless") friction_low_ = friction_high_ = 0.0;
    if (kind == "mass ratio") mass_ratio_ = 1e9;
    const bool stacked = kind == "stack" || (kind != "scattered" && Draw(0, 1) < 0.3);
    if (kind == "redundant") {
      Redundant(contacts);
    } else if (stacked) {
      Stack(contacts);
    } else {
      Scatter(contacts);
    }
    if (kind == "joints") Join();
    if (kind == "restitution" || kind == "frictionless") DrawSolution();
    return std::move(case_);
  }

 private:
  double Draw(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
  }
  double DrawLog(double low, double high) { return low * std::exp(Draw(0, std::log(high / low))); }
  int Pick(int count) { return static_cast<int>(random_() % static_cast<std::uint64_t>(count)); }

  double DrawFriction() {
    if (friction_high_ == 0.0) return 0.0;
    if (friction_low_ > 0.0) return DrawLog(friction_low_, friction_high_);
    return Draw(0, 1) < 0.15 ? 0.0 : Draw(0, 1) < 0.1 ? friction_high_ : Draw(0, friction_high_);
  }

  // A body of radius of gyration about 0.3 m and a twist of up to 1 m/s, a step's gravity in its
  // momentum.
  int AddBody(Vec velocity, double spin) {
    ContactProblem<double>& p = case_.problem;
    const double mass = DrawLog(1.0, mass_ratio_);
    const double inertia = mass * Draw(0.03, 0.15);
    p.mass.insert(p.mass.end(), {mass, mass, inertia});
    p.load.insert(p.load.end(),
                  {mass * velocity.x, mass * (velocity.y - 9.81 * kStep), inertia * spin});
    return p.num_bodies++;
  }
  int AddMovingBody() { return AddBody({Draw(-1, 1), Draw(-1, 1)}, Draw(-2, 2)); }

  static RowPart<double> Row(Vec direction, Vec arm, double sign) {
    return {sign * direction.x, sign * direction.y,
            sign * (arm.x * direction.y - arm.y * direction.x)};
  }

  // b = −1: a body that does not move. The arms lead from the bodies' centres to the point.
  void AddContact(int a, Vec arm_a, int b, Vec arm_b, Vec normal, double c_n) {
    const Vec tangent{normal.y, -normal.x};
    ContactBlock<double> c;
    c.a = a;
    c.b = b;
    c.normal_a = Row(normal, arm_a, 1.0);
    c.tangent_a = Row(tangent, arm_a, 1.0);
    c.normal_b = b < 0 ? RowPart<double>{0, 0, 0} : Row(normal, arm_b, -1.0);
    c.tangent_b = b < 0 ? RowPart<double>{0, 0, 0} : Row(tangent, arm_b, -1.0);
    c.c_n = c_n;
    c.c_t = 0.0;
    c.friction = DrawFriction();
    c.has_friction = c.friction > 0.0;
    case_.problem.contacts.push_back(c);
  }

  int DrawOther(int a) {
    const int b = Pick(case_.problem.num_bodies + 1) - 1;
    return b == a ? -1 : b;
  }
  // On the ground of a gap, over the step: most touch.
  double DrawGap() { return Draw(0, 1) < 0.6 ? 0.0 : Draw(0.0, 1.0); }

  // Bodies one above the other on up to three points each, most at rest, some pushed.
  void Stack(int contacts) {
    int below = -1;
    while (contacts > 0) {
      const bool rests = Draw(0, 1) < 0.7;
      const int body =
          rests ? AddBody({Draw(0, 1) < 0.5 ? 0.0 : Draw(-0.1, 0.1), 0.0}, 0.0) : AddMovingBody();
      const int points = std::min(contacts, 1 + Pick(3));
      for (int k = 0; k < points; ++k) {
        const double at = points == 1 ? 0.0 : -0.5 + k / (points - 1.0);
        AddContact(body, {at, -0.25}, below, {at, 0.25}, {0.0, 1.0}, rests ? 0.0 : DrawGap());
      }
      contacts -= points;
      below = body;
    }
  }

  // Arbitrary points and normals; one body for one to four contacts.
  void Scatter(int contacts) {
    const int bodies = 1 + Pick(std::max(1, contacts));
    for (int i = 0; i < std::max(bodies, contacts / 4); ++i) AddMovingBody();
    for (int k = 0; k < contacts; ++k) {
      const int a = Pick(case_.problem.num_bodies);
      const double angle = Draw(-kPi, kPi);
      const auto arm = [&] { return Vec{Draw(-0.5, 0.5), Draw(-0.5, 0.5)}; };
      AddContact(a, arm(), DrawOther(a), arm(), {std::cos(angle), std::sin(angle)}, DrawGap());
    }
  }

  // Rows of points on few faces, some of them repeated: far more contacts than velocities.
  void Redundant(int contacts) {
    const int bodies = 1 + Pick(1 + contacts / 6);
    for (int i = 0; i < bodies; ++i) AddMovingBody();
    while (contacts > 0) {
      const int a = Pick(bodies);
      const int b = DrawOther(a);
      const double angle = Pick(4) * 0.5 * kPi;
      const Vec normal{std::round(std::cos(angle)), std::round(std::sin(angle))};
      const Vec tangent{normal.y, -normal.x};
      const int points = std::min(contacts, 2 + Pick(4));
      const double gap = DrawGap();
      for (int k = 0; k < points; ++k) {
        const double at = Pick(5) * 0.25 - 0.5;
        const Vec arm{at * tangent.x - 0.25 * normal.x, at * tangent.y - 0.25 * normal.y};
        const Vec other{at * tangent.x + 0.25 * normal.x, at * tangent.y + 0.25 * normal.y};
        AddContact(a, arm, b, other, normal, gap);
      }
      contacts -= points;
    }
  }

  // Pins between neighbours; about a third of the bodies stay free.
  void Join() {
    ContactProblem<double>& p = case_.problem;
    for (int i = 1; i < p.num_bodies; ++i) {
      if (Draw(0, 1) < 0.33) continue;
      JointBlock<double> joint;
      joint.a = i;
      joint.b = i - 1;
      joint.rows = 2;
      const Vec arm_a{Draw(-0.5, 0.5), Draw(-0.5, 0.5)};
      const Vec arm_b{Draw(-0.5, 0.5), Draw(-0.5, 0.5)};
      const Vec axes[] = {{1.0, 0.0}, {0.0, 1.0}};
      for (int r = 0; r < 2; ++r) {
        joint.row_a[r] = Row(axes[r], arm_a, 1.0);
        joint.row_b[r] = Row(axes[r], arm_b, -1.0);
        joint.rhs[r] = 0.0;
      }
      p.joints.push_back(joint);
    }
  }

  // Draws speeds, modes and impulses, and computes p, c_n and c_t from them: contacts rebound at
  // independent speeds, and surfaces move.
  void DrawSolution() {
    ContactProblem<double>& p = case_.problem;
    ContactSolution<double>& x = case_.drawn;
    for (int i = 0; i < 3 * p.num_bodies; ++i) x.motion.push_back(Draw(-1.0, 1.0));
    p.load.resize(x.motion.size());
    for (size_t i = 0; i < x.motion.size(); ++i) p.load[i] = p.mass[i] * x.motion[i];
    for (ContactBlock<double>& c : p.contacts) {
      const double normal_speed = RowDot(c.a, c.normal_a, c.b, c.normal_b, x.motion.data());
      const double slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, x.motion.data());
      double normal = Draw(0, 1) < 0.4 ? 0.0 : DrawLog(0.01, 10.0);
      double tangent = 0.0;
      ContactMode mode = ContactMode::kOpen;
      c.c_n = -normal_speed;
      if (normal == 0.0) {
        c.c_n += DrawLog(0.001, 1.0);
      } else if (!c.has_friction) {
        mode = ContactMode::kClosed;
      } else if (Draw(0, 1) < 0.5) {
        mode = ContactMode::kSticking;
        c.c_t = -slip;
        tangent = Draw(-1.0, 1.0) * c.friction * normal;
      } else {
        const double sliding = Draw(-1.0, 1.0);
        mode = sliding > 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
        c.c_t = sliding - slip;
        tangent = (sliding > 0.0 ? -1.0 : 1.0) * c.friction * normal;
      }
      AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, -normal, p.load.data());
      AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, -tangent, p.load.data());
      x.normal_impulse.push_back(normal);
      x.tangent_impulse.push_back(tangent);
      x.modes.push_back(mode);
    }
  }

  // A row of bodies between walls that approach each other, and other contacts that any speeds
  // satisfy.
  ContactCase Squeezed(int contacts) {
    const int in_row = std::max(1, std::min(contacts - 1, 1 + Pick(8)));
    for (int i = 0; i < in_row; ++i) AddMovingBody();
    const double angle = Draw(-kPi, kPi);
    const Vec normal{std::cos(angle), std::sin(angle)};
    const auto arm = [&](double along) { return Vec{along * normal.x, along * normal.y}; };
    for (int i = 0; i < in_row; ++i) {
      AddContact(i, arm(-0.25), i - 1, arm(0.25), normal, i == 0 ? -Draw(0.1, 1.0) : 0.0);
    }
    AddContact(in_row - 1, arm(0.25), -1, {0, 0}, {-normal.x, -normal.y}, Draw(0.0, 0.05));
    // The arms are 0, so that spinning cannot open the contacts, not even by rounding.
    for (ContactBlock<double>& c : case_.problem.contacts) c.normal_a[2] = c.normal_b[2] = 0.0;
    const int others = std::max(0, contacts - in_row - 1);
    for (int k = 0; k < others; ++k) {
      const int a = Pick(in_row);
      const double turn = Draw(-kPi, kPi);
      AddContact(a, {Draw(-0.5, 0.5), Draw(-0.5, 0.5)}, DrawOther(a),
                 {Draw(-0.5, 0.5), Draw(-0.5, 0.5)}, {std::cos(turn), std::sin(turn)}, 100.0);
    }
    case_.known = Known::kInfeasible;
    return std::move(case_);
  }

  std::mt19937_64 random_;
  ContactCase case_;
  double mass_ratio_ = 10.0;
  double friction_low_ = 0.0, friction_high_ = 2.0;
};

void SetRow(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b, double sign,
            Eigen::Index at, MatrixX<double>* matrix) {
  for (int i = 0; i < 3; ++i) {
    if (a >= 0) (*matrix)(at, 3 * a + i) += sign * row_a[i];
    if (b >= 0) (*matrix)(at, 3 * b + i) += sign * row_b[i];
  }
}

}  // namespace

const std::vector<std::string>& ContactKinds() {
  static const std::vector<std::string> kinds = {"stack",       "scattered",     "redundant",
                                                 "mass ratio",  "joints",        "frictionless",
                                                 "restitution", "high friction", "infeasible"};
  return kinds;
}

ContactCase MakeContactCase(const std::string& kind, std::uint64_t seed, int index,
                            int most_contacts) {
  return Maker(kind, seed, index).Make(most_contacts);
}

MixedLcp<double> OneSidedForm(const ContactProblem<double>& problem) {
  const Eigen::Index nv = 3 * problem.num_bodies;
  Eigen::Index nz = 0;
  for (const ContactBlock<double>& c : problem.contacts) nz += c.has_friction ? 4 : 1;
  Eigen::Index ny = 0;
  for (const JointBlock<double>& joint : problem.joints) ny += joint.rows;
  MixedLcp<double> form;
  form.M = Eigen::Map<const VectorX<double>>(problem.mass.data(), nv).asDiagonal();
  form.p = Eigen::Map<const VectorX<double>>(problem.load.data(), nv);
  form.A = MatrixX<double>::Zero(ny, nv);
  form.b = VectorX<double>::Zero(ny);
  Eigen::Index at = 0;
  for (const JointBlock<double>& joint : problem.joints) {
    for (int r = 0; r < joint.rows; ++r, ++at) {
      SetRow(joint.a, joint.row_a[r], joint.b, joint.row_b[r], 1.0, at, &form.A);
      form.b[at] = joint.rhs[r];
    }
  }
  form.G = MatrixX<double>::Zero(nz, nv);
  form.F = MatrixX<double>::Zero(nz, nz);
  form.c = VectorX<double>::Zero(nz);
  at = 0;
  for (const ContactBlock<double>& c : problem.contacts) {
    SetRow(c.a, c.normal_a, c.b, c.normal_b, 1.0, at, &form.G);
    form.c[at] = c.c_n;
    if (c.has_friction) {
      for (int side = 1; side <= 2; ++side) {
        const double sign = side == 1 ? 1.0 : -1.0;
        SetRow(c.a, c.tangent_a, c.b, c.tangent_b, sign, at + side, &form.G);
        form.c[at + side] = sign * c.c_t;
        form.F(at + side, at + 3) = 1.0;
        form.F(at + 3, at + side) = -1.0;
      }
      form.F(at + 3, at) = c.friction;
    }
    at += c.has_friction ? 4 : 1;
  }
  return form;
}

ContactSolution<double> FromOneSided(const ContactProblem<double>& problem,
                                     const LcpSolution<double>& solution) {
  ContactSolution<double> result;
  result.motion.assign(solution.v.data(), solution.v.data() + solution.v.size());
  result.joint_impulse.assign(3 * problem.joints.size(), 0.0);
  Eigen::Index at = 0;
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    for (int r = 0; r < problem.joints[j].rows; ++r) {
      result.joint_impulse[3 * j + r] = solution.y[at++];
    }
  }
  at = 0;
  for (const ContactBlock<double>& c : problem.contacts) {
    result.normal_impulse.push_back(solution.z[at]);
    result.tangent_impulse.push_back(c.has_friction ? solution.z[at + 1] - solution.z[at + 2] : 0);
    at += c.has_friction ? 4 : 1;
  }
  result.modes.assign(problem.contacts.size(), ContactMode::kOpen);
  return result;
}

}  // namespace tangible::corpus
