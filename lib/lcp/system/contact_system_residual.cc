// SPDX-License-Identifier: Apache-2.0
//
// The residual of a mode system at a point. K is not stored; its rows are computed from the
// problem.
#include <algorithm>
#include <cmath>

#include "tangible/lcp/system/contact_system.h"

namespace tangible {
void ContactSystem::RowScale::Include(const RowScale& other) {
  terms = std::max(terms, other.terms);
  parts = std::max(parts, other.parts);
  left = std::max(left, other.left);
}

void ContactSystem::ResidualSize::Include(const ResidualSize& other) {
  momentum.Include(other.momentum);
  constraint.Include(other.constraint);
}

// residual := rhs − K x for one column of strided vectors; sign −1 and exchanged directions for Kᵀ.
template <bool kTransposed>
class ContactSystem::ColumnResidual {
 public:
  ColumnResidual(const ContactProblem<double>& problem, const double* x, int columns,
                 double* residual)
      : p_(problem), x_(x), columns_(columns), r_(residual) {}

  void Bodies() {
    for (int i = 0; i < 3 * p_.num_bodies; ++i) {
      const double term = p_.mass[i] * x_[i * columns_];
      momentum_.Term(r_[i * columns_]);
      momentum_.Term(term);
      r_[i * columns_] -= term;
    }
    for (const DamperBlock<double>& d : p_.dampers) {
      Push(d.a, d.row_a, d.b, d.row_b, -d.weight * Dot(d.a, d.row_a, d.b, d.row_b));
    }
  }

  void Joints() {
    int block = p_.num_bodies;
    for (const JointBlock<double>& j : p_.joints) {
      for (int k = 0; k < j.rows; ++k) {
        double row = Dot(j.a, j.row_a[k], j.b, j.row_b[k]);
        if (j.c >= 0) row += Dot(j.c, j.row_c, j.d, j.row_d);
        Constrain(block, k, row);
        Push(j.a, j.row_a[k], j.b, j.row_b[k], kSign * At(block, k));
        if (j.c >= 0) Push(j.c, j.row_c, j.d, j.row_d, kSign * At(block, k));
      }
      ++block;
    }
  }

  void Contact(const ContactBlock<double>& c, ContactMode mode, const RollingColumn& rolling,
               int block) {
    // The impulse's part on the tangent.
    const double along = c.rolls ? 0.0 : -SlidingSign(mode) * c.friction;
    const double impulse = At(block, 0);
    // A driven contact has a column like any other, but its row is λn alone.
    double row = c.driven && !kTransposed ? impulse : Dot(c.a, c.normal_a, c.b, c.normal_b);
    if (c.driven && kTransposed) {
      row -= impulse;
    } else {
      Push(c.a, c.normal_a, c.b, c.normal_b, kSign * impulse);
    }
    if (mode == ContactMode::kSticking) {
      Constrain(block, 1, Dot(c.a, c.tangent_a, c.b, c.tangent_b));
      Push(c.a, c.tangent_a, c.b, c.tangent_b, kSign * At(block, 1));
    } else if (along != 0.0) {
      if (kTransposed) {
        row += along * Dot(c.a, c.tangent_a, c.b, c.tangent_b);
      } else {
        Push(c.a, c.tangent_a, c.b, c.tangent_b, along * impulse);
      }
    }
    if (rolling.along != 0.0 && kTransposed) {
      row += rolling.along * Dot(c.a, rolling.row_a, c.b, rolling.row_b);
    } else if (rolling.along != 0.0) {
      Push(c.a, rolling.row_a, c.b, rolling.row_b, rolling.along * impulse);
    }
    Constrain(block, 0, row);
  }

  // The free motion's momenta, with the stride of the column or one for all; rotation is taken at
  // the radius of gyration.
  void FreeMotion(const double* momenta, int columns) {
    for (int i = 0; i < 3 * p_.num_bodies; ++i) {
      const double size = std::abs(momenta[static_cast<size_t>(i) * columns]);
      const double mass = i % 3 != 2 ? p_.mass[i] : std::sqrt(p_.mass[i] * p_.mass[i - 1]);
      momentum_.parts = std::max(momentum_.parts, size);
      constraint_.parts = std::max(constraint_.parts, size / mass);
    }
  }

  // Called after all rows. Unused rows of constraints have a right-hand side of 0.
  ResidualSize Size(int rows) {
    for (int i = 0; i < rows; ++i) {
      RowScale& kind = i < 3 * p_.num_bodies ? momentum_ : constraint_;
      kind.left = std::max(kind.left, std::abs(r_[static_cast<size_t>(i) * columns_]));
    }
    return {momentum_, constraint_};
  }

 private:
  static constexpr double kSign = kTransposed ? -1.0 : 1.0;

  double At(int block, int i) const { return x_[(3 * block + i) * columns_]; }
  double Dot(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double part_a = a >= 0 ? row_a[i] * At(a, i) : 0.0;
      const double part_b = b >= 0 ? row_b[i] * At(b, i) : 0.0;
      sum += part_a + part_b;
      constraint_.parts = std::max({constraint_.parts, std::abs(part_a), std::abs(part_b)});
    }
    return sum;
  }
  // Momentum rows: += rowᵀ impulse.
  void Push(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
            double impulse) {
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) {
        r_[(3 * a + i) * columns_] += row_a[i] * impulse;
        momentum_.Term(row_a[i] * impulse);
      }
      if (b >= 0) {
        r_[(3 * b + i) * columns_] += row_b[i] * impulse;
        momentum_.Term(row_b[i] * impulse);
      }
    }
  }
  void Constrain(int block, int i, double value) {
    double& r = r_[(3 * block + i) * columns_];
    constraint_.Term(r);
    constraint_.Term(value);
    r -= kSign * value;
  }

  const ContactProblem<double>& p_;
  const double* x_;
  const int columns_;
  double* r_;
  RowScale momentum_, constraint_;
};

template <bool kTransposed>
double ContactSystem::Residual(const ContactProblem<double>& problem,
                               const std::vector<ContactMode>& modes, const double* rhs,
                               const double* x, int columns, double* residual) const {
  return ResidualWith<kTransposed>(problem, modes, Regularisation::kLeftOut, {rhs, columns}, rhs, x,
                                   columns, residual, nullptr)
      .ToTerms();
}

template <bool kTransposed>
ContactSystem::ResidualSize ContactSystem::ResidualWith(
    const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
    Regularisation regularisation, const FreeMomenta& free, const double* rhs, const double* x,
    int columns, double* residual, ResidualSize* sizes) const {
  const int rows = 3 * num_blocks();
  std::copy(rhs, rhs + static_cast<size_t>(rows) * columns, residual);
  ResidualSize all;
  for (int c = 0; c < columns; ++c) {
    ColumnResidual<kTransposed> column(problem, x + c, columns, residual + c);
    column.Bodies();
    column.Joints();
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      if (contact_block_[i] >= 0) {
        column.Contact(problem.contacts[i], modes[i], RollingColumnOf(problem, modes, i),
                       contact_block_[i]);
      }
    }
    column.FreeMotion(free.values + std::min(c, free.columns - 1), free.columns);
    for (int i = 3 * problem.num_bodies; regularisation == Regularisation::kKept && i < rows; ++i) {
      residual[static_cast<size_t>(i) * columns + c] -=
          regularisation_[i] * x[static_cast<size_t>(i) * columns + c];
    }
    const ResidualSize size = column.Size(rows);
    all.Include(size);
    if (sizes != nullptr) {
      sizes[c] = size;
    }
  }
  return all;
}

template double ContactSystem::Residual<false>(const ContactProblem<double>&,
                                               const std::vector<ContactMode>&, const double*,
                                               const double*, int, double*) const;
template double ContactSystem::Residual<true>(const ContactProblem<double>&,
                                              const std::vector<ContactMode>&, const double*,
                                              const double*, int, double*) const;

#define TANGIBLE_INSTANTIATE(kTransposed)                                             \
  template ContactSystem::ResidualSize ContactSystem::ResidualWith<kTransposed>(      \
      const ContactProblem<double>&, const std::vector<ContactMode>&, Regularisation, \
      const FreeMomenta&, const double*, const double*, int, double*, ResidualSize*) const;
TANGIBLE_INSTANTIATE(false)
TANGIBLE_INSTANTIATE(true)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
