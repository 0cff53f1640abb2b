// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/assembly_inl.h"

namespace tangible {

#define TANGIBLE_INSTANTIATE(T)                                                     \
  template void AssembleFree<T>(const Model<T>&, const State<T>&, double, double,   \
                                ContactProblem<T>*, AssemblyScratch<T>*, bool);     \
  template void AssembleContacts<T>(                                                \
      const Model<T>&, const State<T>&, double, const std::vector<ActiveContact>&,  \
      const std::vector<CoefficientSource>&, const std::vector<CoefficientSource>&, \
      const AssemblyScratch<T>&, ContactProblem<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
