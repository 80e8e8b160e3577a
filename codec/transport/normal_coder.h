// Codes normals that are predicted from the triangles around: see page_coder.h.
#ifndef TRANSPORT_NORMAL_CODER_H
#define TRANSPORT_NORMAL_CODER_H
#include "transport/page_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

constexpr uint32_t kHalfTurn = 1608;  // in 1/512 of a radian

// The angle of the vector (x, y), y >= 0, nearly.
inline uint32_t angle_of(int32_t x, uint32_t y) {
  const uint32_t size = magnitude(uint32_t(x)), large = std::max<uint32_t>(size, y),
                 small = std::min<uint32_t>(size, y);
  const uint32_t length = bit_length(large), k = length > 19 ? length - 19 : 0;
  const uint32_t q = ((small >> k) << 12) / std::max<uint32_t>(large >> k, 1);  // 0 .. 4096
  uint32_t angle = q * (402 + (140 * (4096 - q) >> 12)) >> 12;
  if (y > size) angle = kHalfTurn / 2 - angle;
  return x < 0 ? kHalfTurn - angle : angle;
}

// The floor of the square root of x < 2^52.
inline uint32_t root(uint64_t x) { return uint32_t(__builtin_sqrt(double(x))); }

// Weighs the normal of a triangle with the edges e and f by its angles, for each of its corners.
inline void weigh_by_angles(Vertex e, Vertex f, Vertex (&normals)[3]) {
  const Vertex n = normals[0];
  uint64_t square = 0;
  for (uint32_t i = 0; i < 3; i++) square += uint64_t(int64_t(int32_t(n[i])) * int32_t(n[i]));
  const uint32_t length = root(square);
  const int64_t scale = length ? (int64_t(1) << 38) / length : 0;
  Vertex unit = {};  // of 4096
  for (uint32_t i = 0; i < 3; i++) unit[i] = uint32_t(int32_t(n[i]) * scale >> 26);
  const uint32_t first = angle_of(int32_t(dot(e, f)), length),
                 second = angle_of(int32_t(dot(e, e - f)), length);
  normals[0] = unit * first;
  normals[1] = unit * second;
  normals[2] = unit * (kHalfTurn - first - second);
}

// For each vertex the sum of the vectors of all triangles around it, in the place of its value.
template <class Coder>
void PageCoder<Coder>::sum_normals(uint32_t s) {
  const uint32_t bits = to.rows[0].bits(), shift = bits > 12 ? bits - 12 : 0;
  const uint32_t* positions = to.streams[0].values.data();
  uint32_t* sums = to.streams[s].values.data();
  std::memset(sums, 0, 16 * size_t(to.streams[s].vertices));
  for (uint32_t i = 0; i < to.meshlets.size(); i++) {
    const MeshletRow& m = to.meshlets[i];
    const uint32_t *position = &to.streams[0].id[m.vertex], *id = &to.ids(s)[m.vertex];
    for (uint32_t t = m.triangle; t < m.triangle + m.triangles; t++) {
      const uint32_t triangle = to.triangles[t];
      const auto point = [&](uint32_t k) {
        return load(positions, position[Page::local(triangle, k)]) >> shift;
      };
      const Vertex a = point(0), e = point(1) - a, f = point(2) - a, n = cross(e, f);
      Vertex parts[3] = {n, n, n};
      if (settings.angles) weigh_by_angles(e, f, parts);
      for (uint32_t k = 0; k < 3; k++) {
        const uint32_t v = id[Page::local(triangle, k)];
        store(sums, v, load(sums, v) + parts[k]);
      }
    }
  }
}

// The octahedral square seen from its centre, turned inside out: points near the corners, which
// are one direction, come together.
inline void invert(int32_t& s, int32_t& t, int32_t centre) {
  const int32_t corner_s = s > 0 || (s == 0 && t > 0) ? centre : -centre;
  const int32_t corner_t = t > 0 || (t == 0 && s > 0) ? centre : -centre;
  const bool same = corner_s == corner_t;
  const int32_t u = same ? -s : s, v = same ? -t : t;
  s = corner_s + v;
  t = corner_t + u;
}
inline int32_t wrapped(int32_t d, int32_t centre) {
  return d > centre ? d - 2 * centre - 1 : d < -centre ? d + 2 * centre + 1 : d;
}

// The vertices of an OCT stream that GEO predicts, in their order, from all triangles around.
template <class Coder>
void PageCoder<Coder>::code_normals(uint32_t s) {
  sum_normals(s);
  const uint32_t bits = to.rows[s].bits();
  const int32_t centre = int32_t((1u << bits) - 2) / 2;
  Stream& stream = to.streams[s];
  uint32_t* values = stream.values.data();
  uint32_t last = 0, before = 0;
  Buffer<Vertex> sources;
  if (kEncodes) {
    sources.grow(stream.vertices);
    const Buffer<uint32_t>& ids = to.ids(s);
    for (uint32_t i = 0; i < ids.size(); i++) sources[ids[i]] = source_value(s, i);
  }
  for (uint32_t i = 0; i < stream.vertices; i++) {
    const Vertex source = kEncodes ? sources[i] : Vertex{};
    const Vertex normal = load(values, i), prediction = octahedral(normal, bits);
    int32_t p[2] = {int32_t(prediction[0]) - centre, int32_t(prediction[1]) - centre};
    const bool inside_out =
        magnitude(uint32_t(p[0])) + magnitude(uint32_t(p[1])) > uint32_t(centre);
    if (inside_out) invert(p[0], p[1], centre);
    int32_t q[2] = {int32_t(source[0]) - centre, int32_t(source[1]) - centre};
    if (kEncodes) {
      bad_ = bad_ || q[0] > centre || q[1] > centre;
      if (inside_out) invert(q[0], q[1], centre);
    }
    const uint32_t area = std::min<uint32_t>(bit_length(any(absolute(normal))) / 2, 15);
    uint32_t size = 0, near = token_of(2 * last + before);
    for (uint32_t e = 0; e < 2; e++) {
      const uint32_t d = signed_number(kEncodes ? uint32_t(wrapped(q[e] - p[e], centre)) : 0, near,
                                       x.normal[e][area][near]);
      bad_ = bad_ || magnitude(d) > uint32_t(2 * centre);
      size += magnitude(d);
      q[e] = bad_ ? 0 : wrapped(p[e] + int32_t(d), centre);
    }
    before = last;
    last = std::min<uint32_t>(size, 255);
    if (inside_out) {
      invert(q[0], q[1], centre);
      // At the edge of the square two points are one direction, at its corners four.
      const bool edge = magnitude(uint32_t(q[0])) == uint32_t(centre) ||
                        magnitude(uint32_t(q[1])) == uint32_t(centre);
      for (uint32_t e = 0; edge && e < 2; e++)
        if (coder.flag(x.mirrored[e], kEncodes && q[e] != int32_t(source[e]) - centre))
          q[e] = -q[e];
    }
    store(values, i, Vertex{uint32_t(q[0] + centre), uint32_t(q[1] + centre), 0, 0});
  }
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif
