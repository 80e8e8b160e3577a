// Boundary loops of disks, cut into chains that two loops share, so that boundaries are stored once
// (paper, section 3).
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "segment/generate_meshlets.h"
#include "segment/half_edges.h"

namespace meshlet {

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
    return std::equal(of(stream, v), of(stream, v) + elements[stream], of(stream, w));
  }
};

// The boundary of a disk as places. Place i is the half-edge from its vertex to that of the next
// place, cyclically.
struct Loop {
  uint32_t begin, count;  // in the arrays of Boundaries
};

enum class ReferenceKind : uint8_t { kOwned, kPrivate, kForeign };

// A run of places of one loop.
struct Reference {
  uint32_t start;   // place (global index)
  uint32_t length;  // edges
  ReferenceKind kind;
  uint64_t shared;       // foreign: mask of streams taken from the owner, always with the position
  uint32_t owner_start;  // foreign: first place of the owner's reference, which runs the other way
};

struct Boundaries {
  std::vector<uint32_t> disk_of;     // per triangle
  std::vector<uint32_t> place_of;    // per triangle: its place in Meshlets::triangles
  std::vector<uint32_t> meshlet_of;  // per disk
  std::vector<Loop> loops;           // per disk
  std::vector<uint32_t> half_edge;   // per place
  std::vector<uint32_t> vertex;      // per place: start of its half-edge
  std::vector<uint32_t> place_disk;  // per place
  // Per disk, in loop order; a private loop is one reference from place 0.
  std::vector<std::vector<Reference>> references;

  uint32_t next(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place + 1 == l.begin + l.count ? l.begin : place + 1;
  }
  uint32_t previous(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place == l.begin ? l.begin + l.count - 1 : place - 1;
  }
  // Does the half-edge lie inside its disk?
  bool interior(const HalfEdges& half_edges, uint32_t half_edge) const {
    const int32_t opposite = half_edges.by_vertex(half_edge);
    return opposite >= 0 && disk_of[uint32_t(opposite) / 3] == disk_of[half_edge / 3];
  }
};

// half_edges: match_half_edges of the mesh. Without share_seams, only whole vertices are shared.
Boundaries find_boundaries(const MeshView& mesh, const HalfEdges& half_edges,
                           const Meshlets& meshlets, const VertexValues& values, bool share_seams,
                           int threads);

}  // namespace meshlet
