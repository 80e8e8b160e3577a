// Which pages of a model are in memory, and what a frame draws of them.
#pragma once
#include <memory>
#include <vector>

#include "model.h"

struct Close {
  void operator()(void* object) const { gltf_meshlet_close(object); }
};

struct Sphere {
  double centre[3], radius;
};

// Meshlets of a slot, in which a page is.
struct Draw {
  uint32_t slot, first, count;
};

struct Load {
  uint32_t slot, meshlets;
  Bytes bytes;
};

class Streamer {
 public:
  // budget: bytes of compressed pages in memory.
  Streamer(const Model& model, uint64_t budget, double threshold);

  // Slots are of equal size, so that a page goes into any.
  uint32_t slots() const { return uint32_t(page_of_.size()); }
  uint32_t page_bytes() const { return page_bytes_; }
  uint32_t meshlets() const { return meshlets_; }  // of a page, at most
  uint32_t streams() const { return streams_; }
  // Around everything, in coordinates of POSITION.
  Sphere whole() const;

  // The cut for a camera, of the pages that are in memory.
  std::vector<Draw> cut(const Camera& camera, uint32_t height, double near);
  double error() const { return cut_.error; }  // of the last cut, in pixels

  // What that cut would like to have next, at most `most` pages: the caller loads them into their
  // slots before the next cut. Pages that nothing needs make room.
  std::vector<Load> load(size_t most);

 private:
  void open_page(uint32_t page);

  const Model& model_;
  std::unique_ptr<gltf_meshlet_levels, Close> levels_;
  std::unique_ptr<gltf_meshlet_view, Close> first_;  // a page whose streams all others have
  std::vector<gltf_meshlet_level_page> rows_;
  std::vector<int64_t> slot_of_, page_of_;  // -1: none
  std::vector<uint8_t> resident_, active_;
  std::vector<float> urgency_;
  std::vector<uint32_t> costs_, order_;
  std::vector<gltf_meshlet_draw> draws_;
  gltf_meshlet_cut cut_{};
  uint32_t page_bytes_ = 0, meshlets_ = 0, streams_ = 0, root_pages_ = 0;
};
