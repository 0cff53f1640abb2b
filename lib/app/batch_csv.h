// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Batches as tables: parameters in, final states out.

#include <string>
#include <vector>

#include "tangible/app/shards.h"
#include "tangible/simulation/gradient/batch.h"

namespace tangible {

/// A table of parameters: a column for each path, a row for each rollout.
struct BatchTable {
  std::vector<ParameterPath> parameters;
  RowMatrixXd values;      ///< rows x parameters
  std::vector<int> lines;  ///< of each row in the file, from 1
};

/// Reads the table of a scene. On failure, including paths that match nothing and values that are
/// not allowed, sets one line "file: line 3: bodies/ball/mass: expected, got".
bool ReadBatch(const std::string& file, const Scene& scene, BatchTable* table, std::string* error);

/// Rows row,status, then x, y, angle, vx, vy, omega of each moving and kinematic body, in scene
/// order, under names such as ball/x. Rows are counted from 1, those of a shard as in the whole
/// table; one that failed has the last good state.
std::string BatchCsv(const ModelStructure& structure, const std::vector<BatchRow>& rows,
                     const Shard& shard = {});

/// The table of all rows from those of shards 0, 1, ..., each with as many rows as it must have.
/// Sets one line where the tables are none of the same scene.
bool MergeBatchCsv(const std::vector<std::string>& shards, long num_rows, std::string* text,
                   std::string* error);

/// The values of a shard's rows, and their lines.
BatchTable RowsOf(const Shard& shard, BatchTable table);

}  // namespace tangible
