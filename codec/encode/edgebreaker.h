// Edgebreaker (Rossignac 1999) on a disk whose boundary is known.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/boundaries.h"

namespace meshlet {

// CLERS symbols of up to 64 triangles as masks, in stream order.
struct Symbols {
  uint32_t count = 0;
  uint64_t r = 0, e = 0, c = 0, s = 0;  // L: none of these

  void append(const Symbols& other);
  uint64_t lefts() const { return ~(r | e | c | s) & (count < 64 ? (1ull << count) - 1 : ~0ull); }
};

struct Traversal {
  Symbols symbols;
  uint32_t corners[64][3];  // vertices (a, b, v) of each triangle: gate a -> b, apex v
};

// Traverses a disk of up to 64 triangles from the boundary edge at `gate`, a place of its loop.
Traversal edgebreaker(const MeshView& mesh, const Boundaries& boundaries,
                      const std::vector<int32_t>& opposite, uint32_t gate);

}  // namespace meshlet
