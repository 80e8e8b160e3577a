#include "segment/cuthill_mckee.h"

#include <algorithm>

namespace gltf_meshlet_codec {
namespace {

// Walks to the far end of the graph in the search for a node at the rim.
constexpr int kRimWalks = 3;

class CuthillMcKee {
 public:
  explicit CuthillMcKee(const Graph& graph) : graph_(graph), mark_(graph.size(), 0) {
    order_.reserve(graph.size());
  }

  std::vector<uint32_t> run() {
    for (uint32_t node = 0; node < graph_.size(); node++) {
      if (mark_[node] == kOrdered) continue;
      uint32_t start = node;
      for (int walk = 0; walk < kRimWalks; walk++) start = farthest(start);
      number_from(start);
    }
    return std::move(order_);
  }

 private:
  uint32_t farthest(uint32_t start);
  void number_from(uint32_t start);

  static constexpr uint32_t kOrdered = ~0u;
  const Graph& graph_;
  std::vector<uint32_t> mark_;  // the last walk that saw the node, or `ordered`
  std::vector<uint32_t> order_, queue_, next_;
  uint32_t walk_ = 0;
};

// The last node of a breadth-first walk.
uint32_t CuthillMcKee::farthest(uint32_t start) {
  walk_++;
  queue_.assign(1, start);
  mark_[start] = walk_;
  for (size_t head = 0; head < queue_.size(); head++) {
    for (uint32_t i = graph_.begin[queue_[head]]; i < graph_.begin[queue_[head] + 1]; i++) {
      uint32_t& mark = mark_[graph_.targets[i]];
      if (mark == walk_) continue;
      mark = walk_;
      queue_.push_back(graph_.targets[i]);
    }
  }
  return queue_.back();
}

void CuthillMcKee::number_from(uint32_t start) {
  size_t head = order_.size();
  mark_[start] = kOrdered;
  order_.push_back(start);
  for (; head < order_.size(); head++) {
    next_.clear();
    for (uint32_t i = graph_.begin[order_[head]]; i < graph_.begin[order_[head] + 1]; i++) {
      if (mark_[graph_.targets[i]] == kOrdered) continue;
      mark_[graph_.targets[i]] = kOrdered;
      next_.push_back(graph_.targets[i]);
    }
    std::sort(next_.begin(), next_.end(), [&](uint32_t a, uint32_t b) {
      return graph_.degree(a) != graph_.degree(b) ? graph_.degree(a) < graph_.degree(b) : a < b;
    });
    order_.insert(order_.end(), next_.begin(), next_.end());
  }
}

}  // namespace

Graph build_graph(uint32_t node_count, const std::vector<std::pair<uint32_t, uint32_t>>& edges) {
  Graph all;
  all.begin.assign(size_t(node_count) + 2, 0);
  for (const auto& edge : edges) ++all.begin[edge.first + 2], ++all.begin[edge.second + 2];
  for (size_t i = 2; i < all.begin.size(); i++) all.begin[i] += all.begin[i - 1];
  all.targets.resize(all.begin.back());
  for (const auto& edge : edges) {
    all.targets[all.begin[edge.first + 1]++] = edge.second;
    all.targets[all.begin[edge.second + 1]++] = edge.first;
  }
  Graph graph;
  graph.begin.assign(1, 0);
  for (uint32_t node = 0; node < node_count; node++) {
    const auto first = all.targets.begin() + all.begin[node],
               last = all.targets.begin() + all.begin[node + 1];
    std::sort(first, last);
    graph.targets.insert(graph.targets.end(), first, std::unique(first, last));
    graph.begin.push_back(uint32_t(graph.targets.size()));
  }
  return graph;
}

std::vector<uint32_t> cuthill_mckee(const Graph& graph) { return CuthillMcKee(graph).run(); }

}  // namespace gltf_meshlet_codec
