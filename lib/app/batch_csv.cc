// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/batch_csv.h"

#include <algorithm>
#include <string_view>
#include <utility>

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

BatchTable RowsOf(const Shard& shard, BatchTable table) {
  BatchTable part;
  part.parameters = std::move(table.parameters);
  const long rows = shard.NumRows(table.values.rows());
  part.values.resize(rows, table.values.cols());
  for (long i = 0; i < rows; ++i) {
    part.values.row(i) = table.values.row(shard.RowOf(i));
    part.lines.push_back(table.lines[shard.RowOf(i)]);
  }
  return part;
}

bool MergeBatchCsv(const std::vector<std::string>& shards, long num_rows, std::string* text,
                   std::string* error) {
  // The next line of each shard is the next row of the run, one shard after the other.
  std::vector<std::string_view> left(shards.begin(), shards.end());
  const auto take = [](std::string_view* lines) {
    const size_t size = std::min(lines->find('\n'), lines->size() - 1) + 1;
    const std::string_view line = lines->substr(0, size);
    lines->remove_prefix(size);
    return line;
  };
  const std::string header(left[0].substr(0, left[0].find('\n') + 1));
  *text = header;
  for (std::string_view& lines : left) {
    if (lines.empty() || take(&lines) != header) {
      *error = "--merge: expected tables with the same columns, got others";
      return false;
    }
  }
  for (long row = 0; row < num_rows; ++row) {
    std::string_view& lines = left[row % static_cast<long>(left.size())];
    const std::string first = std::to_string(row + 1) + ",";
    if (lines.substr(0, first.size()) != first) {
      *error = "--merge: expected row " + std::to_string(row + 1) + ", got none";
      return false;
    }
    text->append(take(&lines));
  }
  return true;
}

std::string BatchCsv(const ModelStructure& structure, const std::vector<BatchRow>& rows,
                     const Shard& shard) {
  const std::vector<int> bodies = WrittenBodies(structure);
  std::string text = "row,status";
  for (const int body : bodies) {
    for (const char* component : {"x", "y", "angle", "vx", "vy", "omega"}) {
      text += "," + structure.bodies[body].name + "/" + component;
    }
  }
  text += "\n";
  for (size_t r = 0; r < rows.size(); ++r) {
    text += std::to_string(shard.RowOf(static_cast<long>(r)) + 1) + "," + NameOf(rows[r].status);
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
