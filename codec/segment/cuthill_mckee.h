// Orders the nodes of a graph so that neighbours have close numbers.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace gltf_meshlet_codec {

// Neighbours of node i: targets[begin[i] .. begin[i + 1]), ascending, each once.
struct Graph {
  std::vector<uint32_t> begin;
  std::vector<uint32_t> targets;

  uint32_t size() const { return uint32_t(begin.size() - 1); }
  uint32_t degree(uint32_t node) const { return begin[node + 1] - begin[node]; }
};

// Builds the undirected graph of these edges on nodes 0 .. node_count - 1; repeated edges count
// once.
Graph build_graph(uint32_t node_count, const std::vector<std::pair<uint32_t, uint32_t>>& edges);

// Returns the nodes in Cuthill-McKee order: breadth first from a node at the rim of each connected
// component, neighbours of small degree first.
std::vector<uint32_t> cuthill_mckee(const Graph& graph);

}  // namespace gltf_meshlet_codec
