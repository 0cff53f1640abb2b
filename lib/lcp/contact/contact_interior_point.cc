// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_interior_point_iteration_inl.h"

namespace tangible {

#define TANGIBLE_INSTANTIATE(T)                                                                 \
  template InteriorPointOutcome SolveContactsByInteriorPoint<T>(                                \
      const ContactProblem<T>&, const ContactInteriorPointOptions&, InteriorPointWorkspace<T>*, \
      ContactSolution<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
