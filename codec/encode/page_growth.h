// Hands out items to pages. An item is some meshlets that stay together.
#pragma once
#include <algorithm>
#include <cstdint>
#include <queue>
#include <set>
#include <vector>

#include "segment/generate_meshlets.h"
#include "segment/half_edges.h"

namespace gltf_meshlet_codec {

// Items that no page has taken are free.
class PageItems {
 public:
  // in_order: whether pages take the items by number, those of a page before those of the next one.
  explicit PageItems(bool in_order) : in_order(in_order) {}
  virtual ~PageItems() = default;

  virtual bool any_free() const = 0;
  // Starts a page. A page that was not finished is given up: release its items first.
  virtual void start() = 0;
  // Adds a free item to the page and returns its number. At least one must be free.
  virtual uint32_t add() = 0;
  // Ends the page with these items, all added since start().
  virtual void finish(const std::vector<uint32_t>& kept) = 0;
  // Makes an added item free again, or (finished) one of a finished page.
  virtual void release(uint32_t item, bool finished) = 0;

  const bool in_order;
};

// Items by number.
class ItemList final : public PageItems {
 public:
  explicit ItemList(uint32_t count) : PageItems(true), count_(count) {}

  bool any_free() const override { return next_ < count_; }
  void start() override {}
  uint32_t add() override { return next_++; }
  void finish(const std::vector<uint32_t>&) override {}
  // Also frees all items after it.
  void release(uint32_t item, bool) override { next_ = std::min(next_, item); }

 private:
  uint32_t count_, next_ = 0;
};

// Grows pages of single meshlets: each step adds the free meshlet that shares most of its border
// with the page, so that pages are compact; borders with finished pages count half, so that no
// fragments stay behind. Depends on the mesh and the meshlets only.
class PageGrowth final : public PageItems {
 public:
  PageGrowth(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets);

  bool any_free() const override { return !free_.empty(); }
  void start() override;
  uint32_t add() override;
  void finish(const std::vector<uint32_t>& kept) override;
  void release(uint32_t m, bool finished) override;

 private:
  struct Neighbour {
    uint32_t meshlet, edges;
  };
  // The candidate of the highest score comes first, of equal ones the oldest.
  struct Candidate {
    double score;
    uint64_t age;
    uint32_t meshlet;
    bool operator<(const Candidate& other) const {
      return score != other.score ? score < other.score : age > other.age;
    }
  };
  using Queue = std::priority_queue<Candidate>;

  void link(const HalfEdges& half_edges, const Meshlets& meshlets);
  double score(uint32_t m) const {
    return double(2u * page_edges_[m] + finished_edges_[m]) / edges_[m];
  }
  double seed_score(uint32_t m) const { return double(finished_edges_[m]) / edges_[m]; }
  // The next free one in `queue` whose score is current, or kNone.
  uint32_t next(Queue& queue, double (PageGrowth::*score)(uint32_t) const);
  uint32_t next_on_curve() const;
  void count_finished(uint32_t m, bool finished);

  std::vector<uint32_t> first_neighbour_;  // of meshlet m: neighbours_[first_neighbour_[m] ..]
  std::vector<Neighbour> neighbours_;
  std::vector<uint32_t> edges_;           // shared with any meshlet; at least 1
  std::vector<uint32_t> page_edges_;      // shared with the page
  std::vector<uint32_t> finished_edges_;  // shared with finished pages
  std::vector<uint32_t> touched_;         // meshlets with page_edges_ above 0
  std::vector<bool> is_free_;
  std::vector<uint32_t> place_;  // of each meshlet on a curve
  Array<uint32_t> at_place_;     // and back
  std::set<uint32_t> free_;      // places of the free ones
  Queue candidates_, seeds_;
  uint64_t age_ = 0;
  uint32_t last_ = 0;  // added
  bool seeding_ = false;
};

}  // namespace gltf_meshlet_codec
