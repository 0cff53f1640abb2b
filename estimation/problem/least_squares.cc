// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/least_squares.h"

#include <glog/logging.h>

namespace tangible {

BlockLayout::BlockLayout(const LeastSquaresProblem& problem)
    : own_offset_{problem.num_shared()}, row_offset_{0} {
  for (int block = 0; block < problem.num_blocks(); ++block) {
    own_offset_.push_back(own_offset_.back() + problem.num_own(block));
    row_offset_.push_back(row_offset_.back() + problem.num_rows(block));
  }
  CHECK_EQ(problem.entries().size(), static_cast<size_t>(own_offset_.back()));
}

Eigen::VectorXd BlockLayout::Local(int block, const Eigen::VectorXd& all) const {
  Eigen::VectorXd local(num_local(block));
  local << all.head(num_shared()), all.segment(own_offset(block), num_own(block));
  return local;
}

}  // namespace tangible
