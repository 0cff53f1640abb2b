// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/assembly/assembly_inl.h"

namespace tangible {

template <typename T>
void AssembleAcceleration(const Model<T>& model, const State<T>& state, const T& t, double middle,
                          const std::vector<ActiveContact>& contacts,
                          const std::vector<CoefficientSource>& friction,
                          AssemblyScratch<T>* scratch, ContactProblem<T>* problem) {
  Instant<T> instant;
  instant.time = t;
  instant.middle = middle;
  internal::ProblemBuilder<Level::kAcceleration, T> builder(model, state, instant, scratch,
                                                            problem);
  builder.AssembleElements();
  builder.AssembleContacts(contacts, friction, nullptr);
}

template <typename T>
void AssembleCorrection(const Model<T>& model, const State<T>& state,
                        const std::vector<ActiveContact>& contacts,
                        const std::vector<CoefficientSource>& friction, const T& recovery,
                        AssemblyScratch<T>* scratch, ContactProblem<T>* problem) {
  Instant<T> instant;
  instant.recovery = recovery;
  internal::ProblemBuilder<Level::kCorrection, T> builder(model, state, instant, scratch, problem);
  builder.AssembleElements();
  builder.AssembleContacts(contacts, friction, nullptr);
}

#define TANGIBLE_INSTANTIATE(T)                                                              \
  template void AssembleWithoutContacts<T>(const Model<T>&, const State<T>&, double, double, \
                                           ContactProblem<T>*, AssemblyScratch<T>*);         \
  template void AssembleContacts<T>(                                                         \
      const Model<T>&, const State<T>&, double, const std::vector<ActiveContact>&,           \
      const std::vector<CoefficientSource>&, const std::vector<CoefficientSource>&,          \
      AssemblyScratch<T>*, ContactProblem<T>*);                                              \
  template void AssembleAcceleration<T>(                                                     \
      const Model<T>&, const State<T>&, const T&, double, const std::vector<ActiveContact>&, \
      const std::vector<CoefficientSource>&, AssemblyScratch<T>*, ContactProblem<T>*);       \
  template void AssembleCorrection<T>(                                                       \
      const Model<T>&, const State<T>&, const std::vector<ActiveContact>&,                   \
      const std::vector<CoefficientSource>&, const T&, AssemblyScratch<T>*, ContactProblem<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<N>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
