// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/dense_lu.h"

#include "tangible/lcp/dense/dense_lu_inl.h"

namespace tangible {

template class DenseLu<double>;
#define TANGIBLE_INSTANTIATE(N) template class DenseLu<Jet<(N)>>;
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
