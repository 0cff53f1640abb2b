// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/batch_csv.h"

#include "tangible/app/program.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

bool ReadRow(const CsvTable& csv, int row, const Scene& scene, BatchTable* table,
             std::string* error) {
  double* const values = table->values.row(row).data();
  for (int k = 0; k < static_cast<int>(csv.columns.size()); ++k) {
    if (!ReadCell(csv, row, k, &values[k], error)) return false;
  }
  Scene copy = scene;
  const std::string refused = SetParameters(table->parameters, values, &copy);
  if (refused.empty()) return true;
  *error = csv.file + ": line " + std::to_string(csv.lines[row]);
  *error += ": " + refused;
  return false;
}

std::vector<int> WrittenBodies(const ModelStructure& structure) {
  std::vector<int> bodies;
  for (int body = 0; body < structure.world(); ++body) {
    if (structure.bodies[body].motion != Motion::kStatic) bodies.push_back(body);
  }
  return bodies;
}

}  // namespace

bool ReadBatch(const std::string& file, const Scene& scene, BatchTable* table, std::string* error) {
  CsvTable csv;
  if (!ReadCsv(file, {}, {}, &csv, error)) return false;
  const std::string header = file + ": line " + std::to_string(csv.header_line) + ": ";
  for (const std::string& path : csv.columns) {
    if (!ResolveParameter(scene, path, &table->parameters.emplace_back(), error)) {
      error->insert(0, header);
      return false;
    }
  }
  if (!CheckApart(scene, table->parameters, error)) {
    error->insert(0, header);
    return false;
  }
  if (csv.rows.empty()) {
    *error = file + ": expected at least one row, got none";
    return false;
  }
  table->lines = csv.lines;
  table->values.resize(static_cast<Eigen::Index>(csv.rows.size()),
                       static_cast<Eigen::Index>(csv.columns.size()));
  for (int row = 0; row < static_cast<int>(csv.rows.size()); ++row) {
    if (!ReadRow(csv, row, scene, table, error)) return false;
  }
  return true;
}

std::string BatchCsv(const ModelStructure& structure, const std::vector<BatchRow>& rows) {
  const std::vector<int> bodies = WrittenBodies(structure);
  std::string text = "row,status";
  for (const int body : bodies) {
    for (const char* component : {"x", "y", "angle", "vx", "vy", "omega"}) {
      text += "," + structure.bodies[body].name + "/" + component;
    }
  }
  text += "\n";
  for (size_t r = 0; r < rows.size(); ++r) {
    text += std::to_string(r + 1) + "," + NameOf(rows[r].status);
    for (const int body : bodies) {
      for (const std::vector<double>* numbers : {&rows[r].final.pose, &rows[r].final.twist}) {
        for (int i = 0; i < 3; ++i) text += "," + FormatNumber((*numbers)[3 * body + i]);
      }
    }
    text += "\n";
  }
  return text;
}

}  // namespace tangible
