// Writes the bits of a meshlet (spec, appendix A.5).
#pragma once
#include <cstdint>
#include <vector>

#include "encode/plan.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

// The fields that the meshlets of a group share.
struct Group {
  uint32_t delta_width = 0, slot_width = 0, reference_width = 0;
  uint32_t flags = 0;  // of any meshlet
  uint32_t table = 0;  // of connectivity
};

// Finds the owners of foreign references.
struct Owners {
  const Boundaries& boundaries;
  std::vector<uint8_t> slot_of_place;  // slots of owned references, by first place

  uint32_t meshlet_of(const Reference& foreign) const {
    return boundaries.meshlet_of[boundaries.place_disk[foreign.owner_start]];
  }
  uint32_t slot_of(const Reference& foreign) const { return slot_of_place[foreign.owner_start]; }
};

// Writes meshlets with complete plans, one at a time. One thread at a time.
class MeshletWriter {
 public:
  // All must outlive this object. Adds the bits of anchors and residuals of each stream to
  // stream_bits.
  MeshletWriter(const std::vector<Stream>& streams, const Owners& owners, BitWriter& out,
                uint64_t* stream_bits)
      : streams_(streams),
        owners_(owners),
        out_(out),
        stream_bits_(stream_bits),
        lists_(streams.size()),
        codes_(streams.size()) {}

  // The i-th meshlet of the chunk, number m.
  void write(const PlanChunk& chunk, size_t i, uint32_t m, const Group& group);

 private:
  struct Codes {
    Code chain, interior;
  };

  void write_header(const Symbols& symbols, PlannedReferences references, const Group& group);
  void write_symbols(const Symbols& symbols, const Group& group);
  void write_references(PlannedReferences references, uint32_t m, const Group& group);
  Code write_code(CodedList list, Residuals residuals, uint32_t elements, uint32_t base);
  void write_anchors(uint32_t s);
  void write_lists(bool chains);

  const std::vector<Stream>& streams_;
  const Owners& owners_;
  BitWriter& out_;
  uint64_t* stream_bits_;
  std::vector<StreamLists> lists_;  // of the meshlet
  std::vector<Codes> codes_;
};

}  // namespace gltf_meshlet_codec
