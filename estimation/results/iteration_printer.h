// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The iterations of a fit on stdout, as they are done.

#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Prints all parameters beside the cost, or below it where they are many.
class IterationPrinter {
 public:
  /// `entries` must outlive this object.
  explicit IterationPrinter(const std::vector<ParameterEntry>& entries) : entries_(entries) {}

  void Print(int start, int iteration, const FitIteration& values);

 private:
  bool InOneLine() const;
  void PrintHeader() const;
  void PrintBelow(const std::vector<double>& parameters) const;
  std::vector<size_t> Shown(const std::vector<double>& parameters) const;

  const std::vector<ParameterEntry>& entries_;
  std::vector<double> last_;
};

}  // namespace tangible
