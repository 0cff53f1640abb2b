// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/interior_point.h"

#include "tangible/lcp/dense/interior_point_inl.h"

namespace tangible {

#define TANGIBLE_INSTANTIATE(T)                                          \
  template InteriorPointResult<T> SolveInteriorPoint(const MixedLcp<T>&, \
                                                     const InteriorPointOptions&);
TANGIBLE_INSTANTIATE(double)
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<(N)>)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)
#undef TANGIBLE_INSTANTIATE_JET
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
