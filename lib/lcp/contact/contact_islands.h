// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Islands of a contact problem: sets of bodies that joints, dampers and contacts connect. Islands
// are solved separately and on several threads, so that a pile which takes many pivots costs in
// proportion to its own size, not to that of all piles together. The bodies of all islands without
// contacts form one linear system.
//
// An island is solved alone, from its own guess: its bits depend neither on the other islands nor
// on the number of threads.

#include <memory>
#include <vector>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/math/disjoint_sets.h"

namespace tangible {

class IslandSolver {
 public:
  explicit IslandSolver(int threads = 1);

  /// Finds the islands; returns how many of them have contacts.
  int Partition(const ContactProblem<double>& problem);
  int count() const { return count_; }
  /// Solves every island of the last partition. `solution` holds the guess on entry. The report's
  /// factorisations and iterations are those of the island that took the most, its fallbacks are
  /// summed over all. False where an island is not solved; `solution` is then unchanged.
  bool Solve(const ContactProblem<double>& problem, const ContactSolverOptions& options,
             ContactSolution<double>* solution, ContactSolverReport* report);

 private:
  // An island, identified by its first body; its symbolic factorisation is kept as long as the
  // island exists.
  struct Island {
    std::vector<int> bodies, dampers, joints, contacts;
    std::shared_ptr<BlockLuPattern> pattern;
    ContactSolverReport report;
  };
  // A thread's memory, reused from island to island so that it stays in the cache.
  struct Worker {
    ContactProblem<double> problem;
    ContactSolution<double> solution;
    ContactSolver solver;
  };

  Island* IslandOf(int a, int b);
  static void Clear(Island* island);
  void ListIslands(const ContactProblem<double>& problem);
  void Gather(const ContactProblem<double>& problem, const ContactSolution<double>& guess,
              const Island& island, Worker* worker) const;
  void Scatter(const Island& island, const ContactSolution<double>& solved);

  WorkerPool pool_;
  std::vector<std::unique_ptr<Worker>> workers_;
  int count_ = 0;
  DisjointSets bodies_;
  std::vector<char> has_contact_;  // for each root
  std::vector<int> place_;         // index of each body within its island
  std::vector<std::unique_ptr<Island>> island_of_first_;
  Island rest_;
  std::vector<Island*> islands_;  // with contacts, in the order of their first bodies; the rest
  ContactSolution<double> result_;
};

}  // namespace tangible
