// Boundary loops of disks, cut into chains that two loops share, so that boundaries are stored once
// (paper, section 3).
#pragma once
#include <cstdint>
#include <vector>

#include "common/array.h"
#include "segment/generate_meshlets.h"
#include "segment/half_edges.h"

namespace gltf_meshlet_codec {

constexpr uint32_t kNone = 0xFFFFFFFFu;

// The integers of all streams: values[s][r * elements[s] + c] of row r.
struct VertexValues {
  std::vector<const uint32_t*> values;
  std::vector<uint32_t> elements;
  const uint32_t* rows = nullptr;  // of the mesh's vertices; null: row v is vertex v

  const uint32_t* of(uint32_t stream, uint32_t v) const {
    return values[stream] + size_t(rows ? rows[v] : v) * elements[stream];
  }
  bool equal(uint32_t stream, uint32_t v, uint32_t w) const {
    const uint32_t *a = of(stream, v), *b = of(stream, w);
    uint32_t different = 0;
    for (uint32_t c = 0; c < elements[stream]; c++) different |= a[c] ^ b[c];
    return different == 0;
  }
};

// The boundary of a disk as places. Place i is the half-edge from its vertex to that of the next
// place, cyclically.
struct Loop {
  uint32_t begin, count;  // in the arrays of Boundaries
};

enum class ReferenceKind : uint8_t { kOwned, kPrivate, kForeign };

// Consecutive places of one loop.
struct Reference {
  uint32_t start;   // place (global index)
  uint32_t length;  // edges
  ReferenceKind kind;
  uint64_t shared;       // foreign: mask of streams taken from the owner, always with the position
  uint32_t owner_start;  // foreign: first place of the owner's reference, which runs the other way
};

// The references of one disk, in loop order. A private loop is one reference from place 0.
using DiskReferences = Span<Reference>;

struct Boundaries {
  Array<uint32_t> place_of;    // per triangle: its place in Meshlets::triangles
  Array<uint32_t> meshlet_of;  // per disk
  Array<Loop> loops;           // per disk
  Array<uint32_t> half_edge;   // per place
  Array<uint32_t> vertex;      // per place: start of its half-edge
  Array<uint32_t> place_disk;  // per place
  Array<Reference> references;
  Array<uint32_t> reference_begin;  // per disk, and the end

  DiskReferences references_of(uint32_t disk) const {
    return {references.data() + reference_begin[disk],
            reference_begin[disk + 1] - reference_begin[disk]};
  }
  uint32_t next(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place + 1 == l.begin + l.count ? l.begin : place + 1;
  }
  uint32_t previous(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place == l.begin ? l.begin + l.count - 1 : place - 1;
  }
};

// half_edges: match_half_edges of the mesh. Without share_seams, only whole vertices are shared.
Boundaries find_boundaries(const MeshView& mesh, const HalfEdges& half_edges,
                           const Meshlets& meshlets, const VertexValues& values, bool share_seams,
                           int threads);

}  // namespace gltf_meshlet_codec
