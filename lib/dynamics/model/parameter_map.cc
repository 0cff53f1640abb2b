// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/parameter_map.h"

#include <algorithm>

namespace tangible {

ParameterDirection DirectionOf(const ParameterPath& path) {
  ParameterDirection direction;
  for (const int number : path.numbers) {
    direction.push_back({number, 1.0});
  }
  return direction;
}

namespace {

// Adds the weights to the derivatives k of the values that parameters[first + k] sets.
template <typename T>
void Seed(const std::vector<ParameterDirection>& parameters, int first, double weight,
          const std::vector<SceneNumber<T>>& numbers) {
  const int width = NumDerivatives<T>::value;
  for (int k = 0; k < width && first + k < static_cast<int>(parameters.size()); ++k) {
    for (const SetNumber& set : parameters[first + k]) {
      numbers[set.number].value->v[k] += weight * set.scale;
    }
  }
}

}  // namespace

template <typename T>
BasicScene<T> SeededScene(const Scene& scene, const std::vector<ParameterDirection>& parameters,
                          int first) {
  BasicScene<T> seeded = CastScene<T>(scene);
  Seed(parameters, first, 1.0, EnumerateNumbers(&seeded));
  return seeded;
}

std::shared_ptr<const ModelStructure> WithFreePoints(
    const Scene& scene, const std::shared_ptr<const ModelStructure>& structure,
    const std::vector<ParameterDirection>& parameters) {
  const auto has_points = [](const BodyIndex& body) {
    return body.shape == ShapeType::kPolyline || body.shape == ShapeType::kPolygon;
  };
  if (std::none_of(structure->bodies.begin(), structure->bodies.end(), has_points)) {
    return structure;
  }
  Scene copy = scene;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&copy);
  std::shared_ptr<ModelStructure> marked;
  for (size_t k = 0; k < structure->bodies.size(); ++k) {
    if (!has_points(structure->bodies[k])) continue;
    const std::string shape = "bodies/" + structure->bodies[k].name + "/shape/";
    const auto moves_point = [&](const SetNumber& set) {
      const std::string& path = numbers[static_cast<size_t>(set.number)].path;
      return path.rfind(shape, 0) == 0;
    };
    for (const ParameterDirection& parameter : parameters) {
      if (std::none_of(parameter.begin(), parameter.end(), moves_point)) continue;
      if (marked == nullptr) marked = std::make_shared<ModelStructure>(*structure);
      marked->bodies[k].has_free_points = true;
      break;
    }
  }
  return marked == nullptr ? structure : marked;
}

Eigen::SparseMatrix<double> VariableJacobian(const Scene& scene,
                                             const std::shared_ptr<const ModelStructure>& structure,
                                             const std::vector<ParameterDirection>& parameters) {
  std::vector<Eigen::Triplet<double>> entries;
  const int num_parameters = static_cast<int>(parameters.size());
  // All passes use one copy of the scene and of its paths.
  BasicScene<LocalJet> seeded = CastScene<LocalJet>(scene);
  const std::vector<SceneNumber<LocalJet>> numbers = EnumerateNumbers(&seeded);
  Model<LocalJet> model;
  State<LocalJet> state;
  for (int first = 0; first < num_parameters; first += kLocalJetWidth) {
    Seed(parameters, first, 1.0, numbers);
    BuildModelWithStructure(seeded, structure, &model, &state);
    Seed(parameters, first, -1.0, numbers);
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
    collect(model.parameters, 6 * structure->num_bodies());
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
