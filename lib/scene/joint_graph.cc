// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/joint_graph.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace tangible {
namespace {

// Bridges by depth-first search (Tarjan 1974, "A note on finding the bridges of a graph"): the tree
// edge to node v is a bridge unless an edge of v's subtree leads to an earlier visited node.
class BridgeSearch {
 public:
  BridgeSearch(int num_nodes, const std::vector<std::array<int, 2>>& edges)
      : edges_(edges),
        incident_(num_nodes),
        order_(num_nodes, -1),
        low_(num_nodes, -1),
        root_(num_nodes, -1),
        parent_edge_(num_nodes, -1),
        next_(num_nodes, 0) {
    for (std::size_t e = 0; e < edges.size(); ++e) {
      incident_[edges[e][0]].push_back(static_cast<int>(e));
      incident_[edges[e][1]].push_back(static_cast<int>(e));
    }
    // Node 0 (the fixed one) is visited first, so that it is the root of its component.
    for (int node = 0; node < num_nodes; ++node) {
      if (order_[node] < 0) VisitFrom(node);
    }
  }

  JointPlace Place(int edge) const {
    for (int end = 0; end < 2; ++end) {
      const int node = edges_[edge][end];
      if (parent_edge_[node] != edge) continue;
      // `node` is the lower end: its subtree holds the root only if the edge is no bridge.
      if (low_[node] < order_[node]) return JointPlace::kLoop;
      const bool fixed_first = end == 1 && root_[node] == 0;
      return fixed_first ? JointPlace::kFixedFirst : JointPlace::kTree;
    }
    return JointPlace::kLoop;  // not a tree edge
  }

 private:
  void VisitFrom(int root) {
    // An explicit stack: a chain of 100 000 links would overflow the call stack.
    std::vector<int> stack;
    Enter(root, root, -1, &stack);
    while (!stack.empty()) {
      const int node = stack.back();
      if (next_[node] == incident_[node].size()) {
        stack.pop_back();
        if (!stack.empty()) low_[stack.back()] = std::min(low_[stack.back()], low_[node]);
        continue;
      }
      const int edge = incident_[node][next_[node]++];
      if (edge == parent_edge_[node]) continue;
      const int other = edges_[edge][0] == node ? edges_[edge][1] : edges_[edge][0];
      if (order_[other] < 0) {
        Enter(other, root, edge, &stack);
      } else {
        low_[node] = std::min(low_[node], order_[other]);
      }
    }
  }

  void Enter(int node, int root, int edge, std::vector<int>* stack) {
    order_[node] = low_[node] = count_++;
    root_[node] = root;
    parent_edge_[node] = edge;
    stack->push_back(node);
  }

  const std::vector<std::array<int, 2>>& edges_;
  std::vector<std::vector<int>> incident_;
  std::vector<int> order_;         // of visits
  std::vector<int> low_;           // the earliest node that the subtree reaches
  std::vector<int> root_;          // of the node's component
  std::vector<int> parent_edge_;   // by which it was visited
  std::vector<std::size_t> next_;  // incident edge to look at next
  int count_ = 0;
};

}  // namespace

template <typename T>
std::vector<JointPlace> ClassifyJoints(const BasicScene<T>& scene) {
  const auto node = [&scene](int body) {
    return body < 0 || scene.bodies[body].motion != Motion::kMoving ? 0 : body + 1;
  };
  std::vector<std::array<int, 2>> edges;
  for (const BasicJoint<T>& joint : scene.joints) {
    const int first = node(joint.bodies[0]);
    // A rope holds nothing in its place: it is an edge from a node to itself, which is no bridge.
    // So is a coupling, which has no bodies of its own: joints that it couples can be turned.
    const bool is_rope = joint.type == JointType::kDistance && joint.limits;
    edges.push_back({first, is_rope ? first : node(joint.bodies[1])});
  }
  const BridgeSearch search(static_cast<int>(scene.bodies.size()) + 1, edges);
  std::vector<JointPlace> places;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    places.push_back(search.Place(static_cast<int>(e)));
  }
  return places;
}

template std::vector<JointPlace> ClassifyJoints(const BasicScene<double>& scene);
#define TANGIBLE_INSTANTIATE(N) \
  template std::vector<JointPlace> ClassifyJoints(const BasicScene<Jet<N>>& scene);
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
