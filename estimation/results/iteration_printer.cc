// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/iteration_printer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace tangible {
namespace {

constexpr size_t kMostColumns = 6;
// Of more parameters than this only those are printed that have changed the most.
constexpr size_t kMostPrinted = 60;
constexpr size_t kMostChanged = 24;
constexpr size_t kLineWidth = 110;

}  // namespace

void IterationPrinter::Print(int start, int iteration, const FitIteration& values) {
  if (iteration == 0) {
    if (start > 0) {
      std::printf("start %d\n", start + 1);
    }
    PrintHeader();
  }
  std::printf("%4d %13.6e %11.3e", iteration, values.cost, values.gradient_norm);
  if (InOneLine()) {
    for (const double value : values.parameters) {
      std::printf(" %14.9g", value);
    }
  }
  std::printf(" %9.3f\n", values.seconds);
  if (!InOneLine()) {
    PrintBelow(values.parameters);
  }
  last_ = values.parameters;
  std::fflush(stdout);
}

bool IterationPrinter::InOneLine() const { return entries_.size() <= kMostColumns; }

void IterationPrinter::PrintHeader() const {
  std::printf("%4s %13s %11s", "iter", "cost", "gradient");
  if (InOneLine()) {
    for (const ParameterEntry& entry : entries_) {
      std::printf(" %14.14s", entry.name.c_str());
    }
  }
  std::printf(" %9s\n", "seconds");
}

// "name value" of the parameters, as many a line as there is room for.
void IterationPrinter::PrintBelow(const std::vector<double>& parameters) const {
  const std::vector<size_t> shown = Shown(parameters);
  std::string line = "    ";
  for (const size_t k : shown) {
    char value[40];
    std::snprintf(value, sizeof value, "%.9g", parameters[k]);
    const std::string item = entries_[k].name + " " + value;
    if (line.size() > 4 && line.size() + 2 + item.size() > kLineWidth) {
      std::printf("%s\n", line.c_str());
      line = "    ";
    }
    line += (line.size() > 4 ? ", " : "") + item;
  }
  if (shown.size() < entries_.size()) {
    line += "; " + std::to_string(entries_.size() - shown.size()) + " others that changed less";
  }
  std::printf("%s\n", line.c_str());
}

std::vector<size_t> IterationPrinter::Shown(const std::vector<double>& parameters) const {
  std::vector<size_t> all(entries_.size());
  std::iota(all.begin(), all.end(), size_t{0});
  if (all.size() <= kMostPrinted) {
    return all;
  }
  const auto change = [&](size_t k) {
    const double before = k < last_.size() ? last_[k] : entries_[k].initial;
    return std::abs(ToInternal(entries_[k], parameters[k]) - ToInternal(entries_[k], before));
  };
  std::stable_sort(all.begin(), all.end(),
                   [&](size_t a, size_t b) { return change(a) > change(b); });
  all.resize(kMostChanged);
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace tangible
