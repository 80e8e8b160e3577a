#include "encode/edgebreaker.h"

namespace gltf_meshlet_codec {

void Symbols::append(const Symbols& other) {
  r |= other.r << count;
  e |= other.e << count;
  c |= other.c << count;
  s |= other.s << count;
  count += other.count;
}

void traverse(const LocalMeshlet& meshlet, uint32_t gate, uint64_t waiting, Traversal& out) {
  static_assert(LocalMeshlet::kHalfEdges + MESHLET_VERTICES <= 256);
  const uint32_t loop_end = meshlet.first_vertex() + meshlet.loop_length();
  uint64_t visited = 0;                                            // triangles
  uint64_t seen = loop_end < 64 ? (1ull << loop_end) - 1 : ~0ull;  // vertices
  uint8_t splits[MESHLET_TRIANGLES];
  uint32_t split_count = 0, count = 0, t = 0, h = meshlet.loop_half_edge(gate);
  Symbols y;
  // The half-edge across g is open if its triangle is still to be visited.
  const auto is_open = [&](uint32_t g) {
    return g != LocalMeshlet::kNoHalfEdge && !(visited >> g / 3 & 1);
  };
  if (const uint32_t a = meshlet.start(h); waiting >> a & 1) {
    out.introductions[count++] = Introduction(LocalMeshlet::kHalfEdges + a);
    waiting &= ~(1ull << a);
  }
  while (true) {
    const uint64_t bit = 1ull << t++;
    visited |= 1ull << h / 3;
    const uint32_t right = next_in_triangle(h), left = next_in_triangle(right);
    const uint32_t v = meshlet.start(left);
    const uint32_t right_gate = meshlet.opposite(right), left_gate = meshlet.opposite(left);
    const bool is_new = !(seen >> v & 1);
    if (is_new || (waiting >> v & 1)) {
      out.introductions[count++] = Introduction(h);
      waiting &= ~(1ull << v);
      seen |= 1ull << v;
    }
    if (is_new) {
      y.c |= bit;
      h = right_gate;
    } else if (is_open(right_gate)) {
      if (is_open(left_gate)) {
        y.s |= bit;
        splits[split_count++] = uint8_t(left_gate);
      }
      h = right_gate;
    } else if (is_open(left_gate)) {
      y.r |= bit;
      h = left_gate;
    } else {
      y.e |= bit;
      if (split_count == 0) break;
      h = splits[--split_count];
    }
  }
  y.count = t;
  out.symbols = y;
  out.count = count;
}

uint32_t packed_triangle(const LocalMeshlet& meshlet, Introduction introduction) {
  if (introduction >= LocalMeshlet::kHalfEdges) {
    const uint32_t a = introduction - LocalMeshlet::kHalfEdges;
    const uint32_t next = a + 1 - meshlet.first_vertex();
    const uint32_t b = next == meshlet.loop_length() ? meshlet.first_vertex() : a + 1;
    return b | b << 8 | a << 16 | b << 24;
  }
  const uint32_t b = next_in_triangle(introduction), v = next_in_triangle(b);
  const uint32_t across = meshlet.opposite(introduction);
  const uint32_t o = across == LocalMeshlet::kNoHalfEdge
                         ? NO_VERTEX
                         : meshlet.start(next_in_triangle(next_in_triangle(across)));
  return meshlet.start(introduction) | meshlet.start(b) << 8 | meshlet.start(v) << 16 | o << 24;
}

}  // namespace gltf_meshlet_codec
