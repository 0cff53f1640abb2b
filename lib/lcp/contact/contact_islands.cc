// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_islands.h"

#include <algorithm>
#include <functional>

namespace tangible {
namespace {

// Threads are used only where solving an island costs more than handing it to a thread.
constexpr size_t kLeastContactsForThreads = 64;

}  // namespace

IslandSolver::IslandSolver(int threads) : pool_(threads) {
  for (int i = 0; i < pool_.threads(); ++i) {
    workers_.push_back(std::make_unique<Worker>());
  }
}

int IslandSolver::Partition(const ContactProblem<double>& problem) {
  const int n = problem.num_bodies;
  bodies_.AddAll(n);
  const auto join = [&](const auto& blocks) {
    for (const auto& block : blocks) {
      if (block.a >= 0 && block.b >= 0) bodies_.Join(block.a, block.b);
    }
  };
  join(problem.dampers);
  join(problem.joints);
  join(problem.contacts);
  for (const JointBlock<double>& joint : problem.joints) {
    for (const int body : {joint.c, joint.d}) {
      if (body >= 0) bodies_.Join(std::max(joint.a, joint.b), body);
    }
  }
  has_contact_.assign(n, 0);
  count_ = 0;
  for (const ContactBlock<double>& contact : problem.contacts) {
    char& has = has_contact_[bodies_.Root(std::max(contact.a, contact.b))];
    count_ += has == 0 ? 1 : 0;
    has = 1;
  }
  return count_;
}

void IslandSolver::Clear(Island* island) {
  island->bodies.clear();
  island->dampers.clear();
  island->joints.clear();
  island->contacts.clear();
}

IslandSolver::Island* IslandSolver::IslandOf(int a, int b) {
  const int root = bodies_.Root(std::max(a, b));
  return has_contact_[root] != 0 ? island_of_first_[root].get() : &rest_;
}

void IslandSolver::ListIslands(const ContactProblem<double>& problem) {
  const int n = problem.num_bodies;
  place_.resize(n);
  if (static_cast<int>(island_of_first_.size()) < n) {
    island_of_first_.resize(n);
  }
  islands_.clear();
  Clear(&rest_);
  for (int body = 0; body < n; ++body) {
    if (bodies_.Root(body) == body && has_contact_[body] != 0) {
      if (!island_of_first_[body]) {
        island_of_first_[body] = std::make_unique<Island>();
      }
      Clear(island_of_first_[body].get());
      islands_.push_back(island_of_first_[body].get());
    }
    Island* island = IslandOf(body, body);
    place_[body] = static_cast<int>(island->bodies.size());
    island->bodies.push_back(body);
  }
  for (size_t i = 0; i < problem.dampers.size(); ++i) {
    IslandOf(problem.dampers[i].a, problem.dampers[i].b)->dampers.push_back(static_cast<int>(i));
  }
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    IslandOf(problem.joints[j].a, problem.joints[j].b)->joints.push_back(static_cast<int>(j));
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    IslandOf(problem.contacts[i].a, problem.contacts[i].b)->contacts.push_back(static_cast<int>(i));
  }
  if (!rest_.bodies.empty()) {
    islands_.push_back(&rest_);
  }
}

void IslandSolver::Gather(const ContactProblem<double>& problem,
                          const ContactSolution<double>& guess, const Island& island,
                          Worker* worker) const {
  ContactProblem<double>& own = worker->problem;
  ContactSolution<double>& start = worker->solution;
  const auto moved = [this](auto block) {
    block.a = block.a < 0 ? -1 : place_[block.a];
    block.b = block.b < 0 ? -1 : place_[block.b];
    return block;
  };
  const auto append = [](const std::vector<double>& from, int block, std::vector<double>* to) {
    const double* first = &from[3 * static_cast<size_t>(block)];
    to->insert(to->end(), first, first + 3);
  };
  own.num_bodies = static_cast<int>(island.bodies.size());
  own.redundant_joints = problem.redundant_joints;
  own.has_rolling = problem.has_rolling;
  own.mass.clear();
  own.load.clear();
  own.pushed_load.clear();
  own.dampers.clear();
  own.joints.clear();
  own.contacts.clear();
  start.joint_impulse.clear();
  start.normal_impulse.clear();
  start.tangent_impulse.clear();
  start.modes.clear();
  for (const int body : island.bodies) {
    append(problem.mass, body, &own.mass);
    append(problem.load, body, &own.load);
    if (!problem.pushed_load.empty()) {
      append(problem.pushed_load, body, &own.pushed_load);
    }
  }
  for (const int i : island.dampers) {
    own.dampers.push_back(moved(problem.dampers[i]));
  }
  for (const int j : island.joints) {
    JointBlock<double>& joint = own.joints.emplace_back(moved(problem.joints[j]));
    joint.c = joint.c < 0 ? -1 : place_[joint.c];
    joint.d = joint.d < 0 ? -1 : place_[joint.d];
    append(guess.joint_impulse, j, &start.joint_impulse);
  }
  for (const int i : island.contacts) {
    own.contacts.push_back(moved(problem.contacts[i]));
    start.normal_impulse.push_back(guess.normal_impulse[i]);
    start.tangent_impulse.push_back(guess.tangent_impulse[i]);
    start.modes.push_back(guess.modes[i]);
  }
}

// Islands share no bodies or contacts, so that threads write to different places.
void IslandSolver::Scatter(const Island& island, const ContactSolution<double>& solved) {
  for (size_t k = 0; k < island.bodies.size(); ++k) {
    std::copy_n(&solved.motion[3 * k], 3,
                &result_.motion[3 * static_cast<size_t>(island.bodies[k])]);
  }
  for (size_t k = 0; k < island.joints.size(); ++k) {
    std::copy_n(&solved.joint_impulse[3 * k], 3,
                &result_.joint_impulse[3 * static_cast<size_t>(island.joints[k])]);
  }
  for (size_t k = 0; k < island.contacts.size(); ++k) {
    const int i = island.contacts[k];
    result_.modes[i] = solved.modes[k];
    result_.normal_impulse[i] = solved.normal_impulse[k];
    result_.tangent_impulse[i] = solved.tangent_impulse[k];
  }
}

bool IslandSolver::Solve(const ContactProblem<double>& problem, const ContactSolverOptions& options,
                         ContactSolution<double>* solution, ContactSolverReport* report) {
  ListIslands(problem);
  result_.motion.resize(problem.load.size());
  result_.joint_impulse.resize(3 * problem.joints.size());
  result_.modes.resize(problem.contacts.size());
  result_.normal_impulse.resize(problem.contacts.size());
  result_.tangent_impulse.resize(problem.contacts.size());
  const auto solve = [&](size_t k, int thread) {
    Island* island = islands_[k];
    Worker* worker = workers_[thread].get();
    Gather(problem, *solution, *island, worker);
    worker->solver.system().SwapPattern(&island->pattern);
    island->report = worker->solver.Solve(worker->problem, options, &worker->solution);
    worker->solver.system().SwapPattern(&island->pattern);
    if (island->report.solved) {
      Scatter(*island, worker->solution);
    }
  };
  pool_.Run(islands_.size(),
            problem.contacts.size() < kLeastContactsForThreads ? 1 : pool_.threads(),
            std::ref(solve));
  *report = ContactSolverReport();
  report->solved = true;
  for (const Island* island : islands_) {
    const ContactSolverReport& of = island->report;
    report->solved = report->solved && of.solved;
    report->rung = std::max(report->rung, of.rung);
    report->factorisations = std::max(report->factorisations, of.factorisations);
    report->iterations = std::max(report->iterations, of.iterations);
    report->fallbacks.Add(of.fallbacks);
    if (of.residual > report->residual) {
      report->residual = of.residual;
      report->worst_contact = of.worst_contact < 0 ? -1 : island->contacts[of.worst_contact];
    }
  }
  if (report->solved) {
    std::swap(*solution, result_);
  }
  return report->solved;
}

}  // namespace tangible
