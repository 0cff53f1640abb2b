// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/parameter_map.h"

#include <algorithm>

namespace tangible {

ParameterDirection DirectionOf(const ParameterPath& path) {
  ParameterDirection direction;
  for (const int number : path.numbers) {
    direction.push_back({number, 1.0});
  }
  return direction;
}

template <typename T>
BasicScene<T> SeededScene(const Scene& scene, const std::vector<ParameterDirection>& parameters,
                          int first) {
  BasicScene<T> seeded = CastScene<T>(scene);
  const std::vector<SceneNumber<T>> numbers = EnumerateNumbers(&seeded);
  const int width = NumDerivatives<T>::value;
  for (int k = 0; k < width && first + k < static_cast<int>(parameters.size()); ++k) {
    for (const SetNumber& set : parameters[first + k]) {
      numbers[set.number].value->v[k] += set.scale;
    }
  }
  return seeded;
}

Eigen::SparseMatrix<double> VariableJacobian(const Scene& scene,
                                             const std::shared_ptr<const ModelStructure>& structure,
                                             const std::vector<ParameterDirection>& parameters) {
  std::vector<Eigen::Triplet<double>> entries;
  const int num_parameters = static_cast<int>(parameters.size());
  for (int first = 0; first < num_parameters; first += kLocalJetWidth) {
    const BasicScene<LocalJet> seeded = SeededScene<LocalJet>(scene, parameters, first);
    Model<LocalJet> model;
    State<LocalJet> state;
    BuildModelWithStructure(seeded, structure, &model, &state);
    const auto collect = [&](const std::vector<LocalJet>& values, int offset) {
      for (size_t i = 0; i < values.size(); ++i) {
        for (int k = 0; k < kLocalJetWidth && first + k < num_parameters; ++k) {
          if (values[i].v[k] != 0.0) {
            entries.emplace_back(offset + static_cast<int>(i), first + k, values[i].v[k]);
          }
        }
      }
    };
    collect(state.pose, 0);
    collect(state.twist, 3 * structure->num_bodies());
    collect(model.numbers, 6 * structure->num_bodies());
  }
  Eigen::SparseMatrix<double> jacobian(structure->num_variables(), num_parameters);
  jacobian.setFromTriplets(entries.begin(), entries.end());
  return jacobian;
}

#define TANGIBLE_INSTANTIATE_JET(N)                             \
  template BasicScene<Jet<N>> SeededScene<Jet<N>>(const Scene&, \
                                                  const std::vector<ParameterDirection>&, int);
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
