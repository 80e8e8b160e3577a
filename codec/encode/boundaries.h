// Boundary loops of disks, cut into chains that two loops share (paper, section 3: boundaries are
// stored once).
#pragma once
#include <cstdint>
#include <vector>

#include "segment/segment.h"

namespace meshlet {

constexpr uint32_t kNone = 0xFFFFFFFFu;

// Integer values of all streams of all vertices, as the encoder sees them: values[s][v *
// components[s] + c].
struct VertexValues {
  std::vector<const uint32_t*> values;
  std::vector<uint32_t> components;

  bool equal(uint32_t stream, uint32_t v, uint32_t w) const {
    for (uint32_t c = 0; c < components[stream]; c++)
      if (values[stream][size_t(v) * components[stream] + c] !=
          values[stream][size_t(w) * components[stream] + c])
        return false;
    return true;
  }
};

// A disk's boundary as places: place i of the loop is the half-edge from its vertex to that of the
// next place (cyclically).
struct Loop {
  uint32_t begin, count;  // into the arrays of Boundaries
};

enum class ReferenceKind : uint8_t { owned, private_, foreign };

// A run of places that the meshlet refers to as one.
struct Reference {
  uint32_t start;   // place (global index)
  uint32_t length;  // edges
  ReferenceKind kind;
  uint64_t shared;       // foreign: streams taken from the owner (bit 0, the position, always)
  uint32_t owner_start;  // foreign: first place of the owner's reference, which runs the other way
};

struct Boundaries {
  std::vector<uint32_t> component_of;              // per triangle
  std::vector<uint32_t> meshlet_of;                // per component
  std::vector<Loop> loops;                         // per component
  std::vector<uint32_t> half_edge;                 // per place
  std::vector<uint32_t> vertex;                    // per place: where its half-edge starts
  std::vector<uint32_t> place_disk;                // per place
  std::vector<std::vector<Reference>> references;  // per component, in loop order from some break
                                                   // (a private loop: one, from place 0)

  uint32_t next(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place + 1 == l.begin + l.count ? l.begin : place + 1;
  }
  uint32_t previous(uint32_t place) const {
    const Loop& l = loops[place_disk[place]];
    return place == l.begin ? l.begin + l.count - 1 : place - 1;
  }
  bool interior(const std::vector<int32_t>& opposite, uint32_t half_edge) const {
    return opposite[half_edge] >= 0 &&
           component_of[uint32_t(opposite[half_edge]) / 3] == component_of[half_edge / 3];
  }
};

// opposite, opposite_position: match_half_edges by vertex and by position. Without share_seams,
// only whole vertices are shared.
Boundaries find_boundaries(const MeshView& mesh, const Meshlets& meshlets,
                           const std::vector<int32_t>& opposite,
                           const std::vector<int32_t>& opposite_position,
                           const VertexValues& values, bool share_seams, int threads);

}  // namespace meshlet
