#include "encode/edgebreaker.h"

namespace meshlet {
namespace {

// Hash set for at most 64 triangles or vertices of one disk; a table of 256 slots never fills.
class SmallSet {
 public:
  SmallSet() {
    for (uint32_t& slot : slots_) slot = kNone;
  }
  // Returns false if `key` was in the set already.
  bool insert(uint32_t key) {
    uint32_t i = (key * 2654435761u) >> 24;
    for (; slots_[i] != kNone; i = (i + 1) & 255u)
      if (slots_[i] == key) return false;
    slots_[i] = key;
    return true;
  }
  bool contains(uint32_t key) const {
    for (uint32_t i = (key * 2654435761u) >> 24; slots_[i] != kNone; i = (i + 1) & 255u)
      if (slots_[i] == key) return true;
    return false;
  }

 private:
  uint32_t slots_[256];
};

uint32_t next_in_triangle(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }

}  // namespace

void Symbols::append(const Symbols& other) {
  r |= other.r << count;
  e |= other.e << count;
  c |= other.c << count;
  s |= other.s << count;
  count += other.count;
}

Traversal edgebreaker(const MeshView& mesh, const Boundaries& b,
                      const std::vector<int32_t>& opposite, uint32_t gate) {
  Traversal out;
  SmallSet triangles, vertices;
  const Loop& loop = b.loops[b.place_disk[gate]];
  for (uint32_t p = loop.begin; p < loop.begin + loop.count; p++) vertices.insert(b.vertex[p]);
  uint32_t splits[64], split_count = 0;
  uint32_t h = b.half_edge[gate];
  // The half-edge across g, or kNone if g is on the boundary of the triangles not yet visited.
  auto across = [&](uint32_t g) {
    return b.interior(opposite, g) && !triangles.contains(uint32_t(opposite[g]) / 3)
               ? uint32_t(opposite[g])
               : kNone;
  };
  while (true) {
    uint32_t t = out.symbols.count++;
    uint64_t bit = 1ull << t;
    triangles.insert(h / 3);
    uint32_t right = next_in_triangle(h), left = next_in_triangle(right);
    out.corners[t][0] = mesh.triangles[h];
    out.corners[t][1] = mesh.triangles[right];
    out.corners[t][2] = mesh.triangles[left];
    uint32_t right_gate = across(right), left_gate = across(left);
    if (vertices.insert(mesh.triangles[left])) {
      out.symbols.c |= bit;
      h = right_gate;
    } else if (right_gate == kNone && left_gate == kNone) {
      out.symbols.e |= bit;
      if (split_count == 0) return out;
      h = splits[--split_count];
    } else if (right_gate == kNone) {
      out.symbols.r |= bit;
      h = left_gate;
    } else {
      if (left_gate != kNone) {
        out.symbols.s |= bit;
        splits[split_count++] = left_gate;
      }
      h = right_gate;
    }
  }
}

}  // namespace meshlet
