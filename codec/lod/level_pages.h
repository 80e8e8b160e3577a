// Encodes the groups of all levels in pages.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/pages.h"
#include "lod/build_levels.h"

namespace gltf_meshlet_codec {

struct EncodedPage {
  std::vector<uint32_t> groups;
  Bytes blob;
  uint32_t triangles, vertices;
};

struct LevelPages {
  std::vector<EncodedPage> coarse, fine;  // those of coarse levels, the coarsest first; of level 0
  EncoderStats fine_stats;

  size_t largest() const;  // bytes of a page
};

// All levels of a chunk, and their pages; no pages if it is a whole primitive that cannot be
// simplified, or has too many groups.
struct EncodedLevels {
  Levels levels;
  LevelPages pages;
};

// Builds levels and encodes them. Where a page would be too large, groups are made smaller.
// Arguments as in build_levels and encode_levels.
EncodedLevels build_and_encode(const Surface& surface, const ClusterSet& given,
                               const PagePilot& pilot, const uint32_t* source_position_ids,
                               const Simplifier& simplifier, LevelOptions options);

// Encodes all groups. A group that is larger than `page_bytes` has a page of its own.
//
// Level 0 uses the vertices of the surface. The surfaces of coarser levels lie on it: so that no
// edge has four triangles, each level has its own vertices, and so has each replacement with an
// edge that its level has already.
//
// streams, values: of the surface's vertices. source_position_ids: equal for equal positions before
// quantisation.
LevelPages encode_levels(const Levels& levels, const Surface& surface,
                         const std::vector<Stream>& streams, const VertexValues& values,
                         const uint32_t* source_position_ids, size_t page_bytes, int threads);

// Orders the groups of a level, which are along a curve, by decreasing error in blocks of
// neighbours. A cut draws all groups above an error, and so mostly whole pages.
std::vector<uint32_t> ordered_by_error(const std::vector<uint32_t>& groups,
                                       const std::vector<ClusterGroup>& all);

}  // namespace gltf_meshlet_codec
