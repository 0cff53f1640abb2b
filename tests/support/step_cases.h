// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The time steps of tests/lcp/data/time_steps.json as mixed LCPs, and their data's derivatives with
// respect to the physical parameters:
//
//   p = M v + h f,  c = (e ∘ (Jc v); 0; 0)
//   row of Jc: the normal n acting on body b at r_b and −n on body a at r_a
//   rows of Jf: ± the same with t = (n_y, −n_x).

#include <string>
#include <tuple>
#include <vector>

#include "cases.h"
#include "tangible/lcp/dense/problem.h"

namespace tangible {

class StepCase {
 public:
  explicit StepCase(const nlohmann::json& data)
      : data_(data), v_(ToVector(data["v"])), f_(ToVector(data["f"])), dt_(data["dt"]) {
    if (!data_.contains("one_sided")) data_["one_sided"] = nlohmann::json::object();
    const nlohmann::json& contacts = data["contacts"];
    num_contacts_ = static_cast<Eigen::Index>(contacts.size());
    for (const nlohmann::json& contact : contacts) {
      if (contact["mu"] > 0.0) num_friction_ = 2 * num_contacts_;
    }
    problem_ = Zero();
    for (Eigen::Index i = 0; i < v_.size(); ++i) {
      problem_.M(i, i) = data["bodies"][i / 3][i % 3 < 2 ? "m" : "I"];
    }
    problem_.p = problem_.M * v_ + dt_ * f_;
    for (Eigen::Index k = 0; k < num_contacts_; ++k) {
      AddContact("", k, problem_);
      problem_.c[k] = restitution(k) * problem_.G.row(k).dot(v_);
      if (num_friction_ == 0) continue;
      problem_.F(gamma(k), k) = contacts[k]["mu"];
      for (Eigen::Index row = num_contacts_ + 2 * k; row < num_contacts_ + 2 * k + 2; ++row) {
        problem_.F(row, gamma(k)) = 1.0;
        problem_.F(gamma(k), row) = -1.0;
      }
    }
  }

  std::string id() const { return data_["id"]; }
  const nlohmann::json& data() const { return data_; }
  const MixedLcp<double>& problem() const { return problem_; }

  /// The derivative of the data with respect to "m[0]", "rb_x[1]", "dt", "e_all", ...
  MixedLcp<double> Perturbation(const std::string& parameter) const {
    const std::size_t bracket = parameter.find('[');
    const std::string name = parameter.substr(0, bracket);
    if (name == "e_all" || name == "mu_all") {
      MixedLcp<double> sum = Zero();
      for (Eigen::Index k = 0; k < num_contacts_; ++k) Add(name.substr(0, name.size() - 4), k, sum);
      return sum;
    }
    MixedLcp<double> change = Zero();
    const int index = bracket == std::string::npos ? 0 : std::stoi(parameter.substr(bracket + 1));
    Add(name, index, change);
    return change;
  }

 private:
  using Vector2d = Eigen::Vector2d;

  Eigen::Index gamma(Eigen::Index contact) const { return num_contacts_ + num_friction_ + contact; }

  MixedLcp<double> Zero() const {
    const Eigen::Index nv = v_.size();
    const Eigen::Index nz = num_contacts_ + num_friction_ + num_friction_ / 2;
    MixedLcp<double> zero;
    zero.M = MatrixX<double>::Zero(nv, nv);
    zero.p = VectorX<double>::Zero(nv);
    zero.A = MatrixX<double>::Zero(0, nv);
    zero.b = VectorX<double>::Zero(0);
    zero.G = MatrixX<double>::Zero(nz, nv);
    zero.F = MatrixX<double>::Zero(nz, nz);
    zero.c = VectorX<double>::Zero(nz);
    return zero;
  }

  double restitution(Eigen::Index contact) const { return data_["contacts"][contact]["e"]; }

  // A vector of a contact; (0, 0) for a point of the world.
  static Vector2d Pair(const nlohmann::json& contact, const char* name) {
    return contact.contains(name) ? Vector2d(contact[name][0], contact[name][1])
                                  : Vector2d(0.0, 0.0);
  }

  // Adds to the row the derivative of (d, r x d) on a body, for a change of d and of r.
  static void AddRow(int body, const Vector2d& d, const Vector2d& dd, const Vector2d& r,
                     const Vector2d& dr, double sign, Eigen::Ref<VectorX<double>> row) {
    if (body < 0) return;
    row.segment<2>(3 * body) += sign * dd;
    row[3 * body + 2] += sign * (r.x() * dd.y() - r.y() * dd.x() + dr.x() * d.y() - dr.y() * d.x());
  }

  void AddContact(const std::string& name, Eigen::Index k, MixedLcp<double>& change) const {
    const auto& contact = data_["contacts"][k];
    const Vector2d n = Pair(contact, "n");
    const Vector2d t(n.y(), -n.x());
    // Without a name the rows themselves, whose derivative along (n, 0) they are.
    const Vector2d dn = name.empty()        ? n
                        : name == "n_theta" ? Vector2d(-n.y(), n.x())
                                            : Vector2d(0.0, 0.0);
    const Vector2d dt(dn.y(), -dn.x());
    const auto moved = [&name](const char* which) {
      return Vector2d(name == std::string(which) + "_x" ? 1.0 : 0.0,
                      name == std::string(which) + "_y" ? 1.0 : 0.0);
    };
    VectorX<double> normal_row = VectorX<double>::Zero(v_.size());
    VectorX<double> tangent_row = normal_row;
    for (const auto& [body, r, which, sign] :
         {std::tuple{"b", "rb", "rb", 1.0}, std::tuple{"a", "ra", "ra", -1.0}}) {
      AddRow(contact[body], n, dn, Pair(contact, r), moved(which), sign, normal_row);
      AddRow(contact[body], t, dt, Pair(contact, r), moved(which), sign, tangent_row);
    }
    change.G.row(k) += normal_row.transpose();
    if (num_friction_ > 0) {
      change.G.row(num_contacts_ + 2 * k) += tangent_row.transpose();
      change.G.row(num_contacts_ + 2 * k + 1) -= tangent_row.transpose();
    }
    change.c[k] += restitution(k) * normal_row.dot(v_);
  }

  void Add(const std::string& name, Eigen::Index k, MixedLcp<double>& change) const {
    if (name == "m" || name == "I") {
      for (Eigen::Index j = name == "m" ? 0 : 2; j < (name == "m" ? 2 : 3); ++j) {
        change.M(3 * k + j, 3 * k + j) += 1.0;
        change.p[3 * k + j] += v_[3 * k + j];
      }
    } else if (name == "v") {
      change.p += problem_.M.col(k);
      for (Eigen::Index row = 0; row < num_contacts_; ++row) {
        change.c[row] += restitution(row) * problem_.G(row, k);
      }
    } else if (name == "f") {
      change.p[k] += dt_;
    } else if (name == "dt") {
      change.p += f_;
    } else if (name == "mu") {
      if (num_friction_ > 0) change.F(gamma(k), k) += 1.0;
    } else if (name == "e") {
      change.c[k] += problem_.G.row(k).dot(v_);
    } else {
      AddContact(name, k, change);
    }
  }

  nlohmann::json data_;
  VectorX<double> v_;
  VectorX<double> f_;
  double dt_;
  Eigen::Index num_contacts_ = 0;
  Eigen::Index num_friction_ = 0;
  MixedLcp<double> problem_;
};

inline std::vector<StepCase> StepCases() {
  std::vector<StepCase> cases;
  for (const nlohmann::json& data : ReadCases("time_steps.json")) cases.emplace_back(data);
  return cases;
}

/// Σ gradient ∘ perturbation: the derivative of the loss along it.
inline double Contract(const MixedLcp<double>& gradient, const MixedLcp<double>& change) {
  return gradient.M.cwiseProduct(change.M).sum() + gradient.p.dot(change.p) +
         gradient.A.cwiseProduct(change.A).sum() + gradient.b.dot(change.b) +
         gradient.G.cwiseProduct(change.G).sum() + gradient.F.cwiseProduct(change.F).sum() +
         gradient.c.dot(change.c);
}

}  // namespace tangible
