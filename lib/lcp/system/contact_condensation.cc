// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_condensation.h"

#include <type_traits>

namespace tangible {
namespace {

// Fewer contacts are factorised as fast without condensation, and without loss of digits.
constexpr int kLeastContacts = 3;
// With B = n − σ μ t the digits lost to δ are lost once more to μ; sliding contacts with more
// friction are not condensed.
constexpr double kLargeFriction = 10.0;

// A row of C and the direction B of its impulse, on both bodies.
struct CondensedRow {
  RowPart<double> impulse_a, impulse_b;
  RowPart<double> constraint_a, constraint_b;
};

double DiagonalOf(const ClosedContacts& contacts, size_t contact, int k) {
  return k == 0 && contacts.problem.contacts[contact].driven
             ? 1.0
             : contacts.delta[3 * static_cast<size_t>(contacts.block[contact]) + k];
}

// Visits row 0 (normal) and, for a sticking contact, row 1 (tangent).
template <typename Visit>
void ForEachRow(const ClosedContacts& contacts, size_t i, const Visit& visit) {
  const ContactBlock<double>& c = contacts.problem.contacts[i];
  const ContactMode mode = contacts.modes[i];
  const double along = c.rolls ? 0.0 : -SlidingSign(mode) * c.friction;
  const RollingColumn rolling = RollingColumnOf(contacts.problem, contacts.modes, i);
  const RowPart<double> none = {0.0, 0.0, 0.0};
  visit(0, CondensedRow{rolling.AddedTo(Combine(c.normal_a, along, c.tangent_a), rolling.row_a),
                        rolling.AddedTo(Combine(c.normal_b, along, c.tangent_b), rolling.row_b),
                        c.driven ? none : c.normal_a, c.driven ? none : c.normal_b});
  if (mode == ContactMode::kSticking) {
    visit(1, CondensedRow{c.tangent_a, c.tangent_b, c.tangent_a, c.tangent_b});
  }
}

using OneColumn = std::integral_constant<int, 1>;

template <typename Columns>
void AddScaled(int body, const RowPart<double>& row, double weight, const double* z, double* x,
               Columns columns) {
  if (body < 0) {
    return;
  }
  double* of_body = x + 3 * static_cast<size_t>(body) * columns;
  for (int i = 0; i < 3; ++i) {
    const double factor = weight * row[i];
    for (int c = 0; c < columns; ++c) {
      of_body[i * columns + c] += factor * z[c];
    }
  }
}

template <typename Columns>
void AddProduct(int body, const RowPart<double>& row, double weight, const double* x, double* z,
                Columns columns) {
  if (body < 0) {
    return;
  }
  const double* of_body = x + 3 * static_cast<size_t>(body) * columns;
  for (int i = 0; i < 3; ++i) {
    const double factor = weight * row[i];
    for (int c = 0; c < columns; ++c) {
      z[c] += factor * of_body[i * columns + c];
    }
  }
}

// Calls visit(contact, row, its unknown, its entry of D) for all closed contacts.
template <typename Visit>
void ForEachClosedRow(const ClosedContacts& contacts, const Visit& visit) {
  for (size_t i = 0; i < contacts.problem.contacts.size(); ++i) {
    if (contacts.block[i] < 0) {
      continue;
    }
    const ContactBlock<double>& contact = contacts.problem.contacts[i];
    ForEachRow(contacts, i, [&](int k, const CondensedRow& row) {
      visit(contact, row, 3 * static_cast<size_t>(contacts.block[i]) + k,
            DiagonalOf(contacts, i, k));
    });
  }
}

template <bool kTransposed, typename Columns>
void Condense(const ClosedContacts& contacts, double* x, Columns columns) {
  ForEachClosedRow(contacts, [&](const ContactBlock<double>& contact, const CondensedRow& row,
                                 size_t at, double diagonal) {
    const double weight = (kTransposed ? -1.0 : 1.0) / diagonal;
    const double* z = x + at * columns;
    AddScaled(contact.a, kTransposed ? row.constraint_a : row.impulse_a, weight, z, x, columns);
    AddScaled(contact.b, kTransposed ? row.constraint_b : row.impulse_b, weight, z, x, columns);
  });
}

template <bool kTransposed, typename Columns>
void Recover(const ClosedContacts& contacts, double* x, Columns columns) {
  ForEachClosedRow(contacts, [&](const ContactBlock<double>& contact, const CondensedRow& row,
                                 size_t at, double diagonal) {
    const double sign = kTransposed ? 1.0 : -1.0;
    double* z = x + at * columns;
    AddProduct(contact.a, kTransposed ? row.impulse_a : row.constraint_a, sign, x, z, columns);
    AddProduct(contact.b, kTransposed ? row.impulse_b : row.constraint_b, sign, x, z, columns);
    const double inverse = 1.0 / diagonal;
    for (int c = 0; c < columns; ++c) {
      z[c] *= inverse;
    }
  });
}

}  // namespace

bool WorthCondensing(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes) {
  int closed = 0;
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    closed += modes[i] != ContactMode::kOpen ? 1 : 0;
    if (SlidingSign(modes[i]) != 0.0 && problem.contacts[i].friction > kLargeFriction) {
      return false;
    }
  }
  return closed >= kLeastContacts;
}

void AddContactEdges(const ContactProblem<double>& problem,
                     std::vector<std::pair<int, int>>* edges) {
  for (const ContactBlock<double>& contact : problem.contacts) {
    if (contact.a >= 0 && contact.b >= 0) {
      edges->emplace_back(contact.a, contact.b);
    }
  }
}

void AddCondensedContacts(const ClosedContacts& contacts, int edge, BlockLu<double>* lu) {
  for (size_t i = 0; i < contacts.problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = contacts.problem.contacts[i];
    const bool both = contact.a >= 0 && contact.b >= 0;
    if (contacts.block[i] >= 0) {
      ForEachRow(contacts, i, [&](int k, const CondensedRow& row) {
        const double weight = 1.0 / DiagonalOf(contacts, i, k);
        if (contact.a >= 0) {
          AddOuter(row.impulse_a, row.constraint_a, weight, lu->Diagonal(contact.a));
        }
        if (contact.b >= 0) {
          AddOuter(row.impulse_b, row.constraint_b, weight, lu->Diagonal(contact.b));
        }
        if (both) {
          AddOuter(row.impulse_a, row.constraint_b, weight, lu->FirstSecond(edge));
          AddOuter(row.impulse_b, row.constraint_a, weight, lu->SecondFirst(edge));
        }
      });
    }
    edge += both ? 1 : 0;
  }
}

template <bool kTransposed>
void CondenseRightHandSide(const ClosedContacts& contacts, double* x, int columns) {
  if (columns == 1) {
    Condense<kTransposed>(contacts, x, OneColumn());
  } else {
    Condense<kTransposed>(contacts, x, columns);
  }
}

template <bool kTransposed>
void RecoverImpulses(const ClosedContacts& contacts, double* x, int columns) {
  if (columns == 1) {
    Recover<kTransposed>(contacts, x, OneColumn());
  } else {
    Recover<kTransposed>(contacts, x, columns);
  }
}

template void CondenseRightHandSide<false>(const ClosedContacts&, double*, int);
template void CondenseRightHandSide<true>(const ClosedContacts&, double*, int);
template void RecoverImpulses<false>(const ClosedContacts&, double*, int);
template void RecoverImpulses<true>(const ClosedContacts&, double*, int);

}  // namespace tangible
