// Edgebreaker (Rossignac 1999) on a disk whose boundary is known.
#pragma once
#include <cstdint>

#include "encode/local_meshlet.h"

namespace gltf_meshlet_codec {

// CLERS symbols of up to 64 triangles as masks, in stream order.
struct Symbols {
  uint32_t count = 0;
  uint64_t r = 0, e = 0, c = 0, s = 0;  // L: none of these

  void append(const Symbols& other);
  uint64_t lefts() const { return ~(r | e | c | s) & (count < 64 ? (1ull << count) - 1 : ~0ull); }
};

// A vertex that gets its value in the traversal, named by what predicts it. Below kHalfEdges: the
// gate of the triangle whose apex it is. kHalfEdges + v: boundary vertex v, from the next one.
using Introduction = uint8_t;

struct Traversal {
  Symbols symbols;
  uint32_t count = 0;  // of introductions
  Introduction introductions[MESHLET_VERTICES];
};

// Traverses the disk added last from the boundary edge at place `gate` of its loop. waiting: local
// vertices of the loop that get their values in the traversal, as those inside do.
void traverse(const LocalMeshlet& meshlet, uint32_t gate, uint64_t waiting, Traversal& out);

// A vertex `v` that is predicted from a gate a -> b and, unless it is NO_VERTEX, the vertex o
// across the gate, packed as in the decoder: a | b << 8 | v << 16 | o << 24.
uint32_t packed_triangle(const LocalMeshlet& meshlet, Introduction introduction);

}  // namespace gltf_meshlet_codec
