// SPDX-License-Identifier: Apache-2.0
// SolveImplicit and SolveUnrolled of solver.h for each Jet width.
#include "tangible/lcp/dense/jet_solver_inl.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {

#define TANGIBLE_INSTANTIATE(N)                                                               \
  template LcpSolution<Jet<(N)>> SolveImplicit(const MixedLcp<Jet<(N)>>&, const LcpOptions&); \
  template LcpSolution<Jet<(N)>> SolveUnrolled(const MixedLcp<Jet<(N)>>&, const LcpOptions&);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
