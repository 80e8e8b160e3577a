#include "primitive.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

#include "decode/decoder.h"
#include "decode/dequantise.h"
#include "format/malformed.h"

namespace meshlet_shape {
namespace {

using gltf_meshlet_codec::BlobHeader;
using gltf_meshlet_codec::DecodedMeshlet;
using gltf_meshlet_codec::Stream;
using gltf_meshlet_codec::value_count;

float float_of_bits(uint32_t bits) {
  float f;
  std::memcpy(&f, &bits, 4);
  return f;
}

float clamped(const Attribute& a, float value) {
  if (a.integer) value = std::min(std::max(std::nearbyint(value), a.lowest), a.highest);
  value *= a.scale;
  return a.scale != 1.0f ? std::max(value, -1.0f)
                         : value;  // the lowest normalized signed integer means -1
}

void read_stream(const Stream& s, const uint32_t* q, float* out) {
  if (s.kind == gltf_meshlet_codec::kOct) {
    const float scale = gltf_meshlet_codec::octahedral_scale(s.bits);
    return gltf_meshlet_codec::octahedral_direction(q[0], q[1], scale, out[0], out[1], out[2]);
  }
  for (uint32_t c = 0; c < s.elements; c++) {
    switch (s.kind) {
      case gltf_meshlet_codec::kGrid:
        out[c] = gltf_meshlet_codec::grid_value(q[c], s.step, s.offset[c]);
        break;
      case gltf_meshlet_codec::kFloat32:
        out[c] = float_of_bits(gltf_meshlet_codec::float_bits(q[c]));
        break;
      case gltf_meshlet_codec::kSign: out[c] = gltf_meshlet_codec::sign_value(q[c]); break;
      default: out[c] = float(q[c]);
    }
  }
}

uint32_t stream_end(const Attribute& a, const BlobHeader& header) {
  uint32_t s = a.stream;
  if (a.stored > kMaxStored || a.skipped > a.stored || a.components > a.stored - a.skipped)
    throw std::runtime_error(std::string(a.name) + " has too many components");
  for (uint32_t done = 0; done < a.stored; s++) {
    if (s >= header.streams.size())
      throw std::runtime_error(std::string(a.name) + " names a stream that does not exist");
    done += value_count(header.streams[s]);
    if (done > a.stored)
      throw std::runtime_error(std::string(a.name) + " does not fit its streams");
  }
  return s;
}

// Throws std::runtime_error unless the chosen meshlets exist, each once. Returns their triangles.
uint32_t chosen_triangles(const Primitive& primitive) {
  const BlobHeader& header = primitive.blob->header();
  const std::vector<uint32_t> counts =
      gltf_meshlet_codec::meshlet_triangle_counts(primitive.blob->bytes.data(), header);
  uint32_t total = 0;
  for (size_t i = 0; i < primitive.chosen.size(); i++) {
    if (primitive.chosen[i] >= header.meshlet_count ||
        (i && primitive.chosen[i] <= primitive.chosen[i - 1]))
      throw std::runtime_error("a meshlet is chosen that does not exist, or twice");
    total += counts[primitive.chosen[i]];
  }
  return total;
}

template <class Function>
void for_each_vertex_attribute(const Primitive& primitive, Function&& f) {
  if (primitive.normal.exists()) f(primitive.normal);
  if (primitive.texcoord.exists()) f(primitive.texcoord);
  for (const Attribute& a : primitive.others)
    if (a.exists()) f(a);
}

Vec3 world_normal(const Affine& m, Vec3 n) {
  const Vec3 r{dot(load(m.m[0]), n), dot(load(m.m[1]), n), dot(load(m.m[2]), n)};
  const float norm = length(r);
  return norm > 0 ? Vec3{r.x / norm, r.y / norm, r.z / norm} : r;
}

std::atomic<uint64_t> g_next_blob{1};

// Reads the positions of all vertices: out[axis][id].
void read_positions(const DecodedMeshlet& d, const std::vector<Stream>& streams, const Attribute& a,
                    float (*out)[64]) {
  const Stream& stream = streams[a.stream];
  if (stream.kind != gltf_meshlet_codec::kGrid || a.integer || stream.elements != 3) {
    for (uint32_t id = 0; id < 64; id++) {
      float p[3] = {};
      if (id < d.vertex_count) read_attribute(d, streams, a, id, p);
      for (int i = 0; i < 3; i++) out[i][id] = p[i];
    }
    return;
  }
  const uint32_t* q = d.vertex(a.stream, 0);
  for (int i = 0; i < 3; i++) {
    const double offset = stream.offset[i], step = stream.step;
    for (uint32_t id = 0; id < 64; id++)
      out[i][id] = gltf_meshlet_codec::grid_value(q[4 * id + i], step, offset);
  }
}

}  // namespace

void read_attribute(const DecodedMeshlet& d, const std::vector<Stream>& streams, const Attribute& a,
                    uint32_t id, float* out) {
  float stored[kMaxStored];
  for (uint32_t s = a.stream, done = 0; done < a.stored; done += value_count(streams[s]), s++)
    read_stream(streams[s], d.vertex(s, id), stored + done);
  for (uint32_t c = 0; c < a.components; c++) out[c] = clamped(a, stored[a.skipped + c]);
}

// Each thread has a decoder, open on the last blob that it asked for.
DecodedMeshlet decode_meshlet(const Blob& blob, uint32_t m,
                              gltf_meshlet_codec::StreamRange streams) {
  static thread_local const std::unique_ptr<gltf_meshlet_codec::Decoder> decoder =
      gltf_meshlet_codec::make_decoder();
  static thread_local uint64_t open = 0;
  if (!decoder) throw std::bad_alloc();
  if (open != blob.id) {
    open = 0;
    decoder->open(blob.checked());
    open = blob.id;
  }
  DecodedMeshlet decoded;
  gltf_meshlet_codec::throw_if(decoder->meshlet(m, decoded, streams));
  return decoded;
}

Blob::Blob(const uint8_t* data, size_t size)
    : bytes(data, data + size), id(g_next_blob.fetch_add(1)) {}

const gltf_meshlet_codec::Blob& Blob::checked() const {
  std::call_once(read_, [&] {
    gltf_meshlet_codec::Blob blob{bytes.data(), bytes.size(), {}};
    gltf_meshlet_codec::throw_if(
        gltf_meshlet_codec::read_blob_header(blob.data, blob.size, blob.header));
    checked_ = std::move(blob);
  });
  return checked_;
}

float Affine::determinant() const {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Affine Affine::normal_matrix() const {
  Affine r;
  float sign = determinant() < 0 ? -1.0f : 1.0f;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      r.m[i][j] = sign * (m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1]);
    }
  return r;
}

Affine Affine::operator*(const Affine& b) const {
  Affine r;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 4; j++)
      r.m[i][j] = m[i][0] * b.m[0][j] + m[i][1] * b.m[1][j] + m[i][2] * b.m[2][j] +
                  (j == 3 ? m[i][3] : 0.0f);
  return r;
}

PrimitiveFacts check_primitive(Primitive& primitive) {
  const BlobHeader& header = primitive.blob->header();
  if (!primitive.position.exists() || primitive.position.components != 3)
    throw std::runtime_error("POSITION does not have 3 components");
  if ((primitive.normal.exists() && primitive.normal.components != 3) ||
      (primitive.texcoord.exists() && primitive.texcoord.components != 2))
    throw std::runtime_error("NORMAL does not have 3 or TEXCOORD_0 not 2 components");
  primitive.position_end = stream_end(primitive.position, header);
  primitive.others_first = uint32_t(header.streams.size());
  primitive.others_end = primitive.width = 0;
  for_each_vertex_attribute(primitive, [&](const Attribute& a) {
    primitive.others_first = std::min(primitive.others_first, a.stream);
    primitive.others_end = std::max(primitive.others_end, stream_end(a, header));
    primitive.width += a.components;
  });
  return {primitive.chosen.empty() ? header.triangle_count : chosen_triangles(primitive),
          header.vertex_count, primitive.meshlet_count()};
}

size_t triangles_bytes(uint32_t triangles) { return sizeof(Entry) + Triangles::bytes(triangles); }
size_t attributes_bytes(uint32_t vertices, uint32_t width) {
  return sizeof(Entry) + sizeof(VertexAttributes) + sizeof(float) * size_t(vertices) * width;
}

namespace {

Entry* to_triangles(ThreadSlot& thread, const Primitive& primitive, const DecodedMeshlet& d) {
  float local[3][64], world[3][64];
  read_positions(d, primitive.blob->header().streams, primitive.position, local);
  for (int i = 0; i < 3; i++) {
    const float* row = primitive.to_world.m[i];
    for (uint32_t id = 0; id < 64; id++)
      world[i][id] = row[0] * local[0][id] + row[1] * local[1][id] + row[2] * local[2][id] + row[3];
  }
  alignas(8) uint8_t corner[3][kMeshletTriangles];
  uint32_t shift[3] = {0, primitive.flip_winding ? 16u : 8u, primitive.flip_winding ? 8u : 16u};
  for (uint32_t k = 0; k < 3; k++) {
    for (uint32_t t = 0; t < d.triangle_count; t++)
      corner[k][t] = uint8_t(d.triangles[t] >> shift[k]) & 63u;
    // Fill the last group with a point, which no ray hits.
    std::fill(corner[k] + d.triangle_count, corner[k] + kMeshletTriangles,
              corner[0][d.triangle_count - 1]);
  }
  Entry* entry = thread.scratch(kTriangles, triangles_bytes(d.triangle_count));
  static_cast<Triangles*>(entry->payload())->build(world, corner, d.triangle_count);
  return entry;
}

}  // namespace

Entry* decode_triangles(ThreadSlot& thread, const Primitive& primitive, uint32_t m) {
  return to_triangles(thread, primitive,
                      decode_meshlet(*primitive.blob, primitive.number_in_blob(m),
                                     {primitive.position.stream, primitive.position_end}));
}

Entry* decode_whole(ThreadSlot& thread, const Primitive& primitive, uint32_t m,
                    uint32_t& vertex_count) {
  const DecodedMeshlet d =
      decode_meshlet(*primitive.blob, primitive.number_in_blob(m), primitive.streams());
  vertex_count = d.vertex_count;
  return to_triangles(thread, primitive, d);
}

Entry* decode_attributes(ThreadSlot& thread, const Primitive& primitive, uint32_t m) {
  const DecodedMeshlet d = decode_meshlet(*primitive.blob, primitive.number_in_blob(m),
                                          {primitive.others_first, primitive.others_end});
  const std::vector<Stream>& streams = primitive.blob->header().streams;
  const Affine normal_matrix = primitive.to_world.normal_matrix();
  const uint32_t width = primitive.width;
  Entry* entry = thread.scratch(kAttributes, attributes_bytes(d.vertex_count, width));
  auto* out = static_cast<VertexAttributes*>(entry->payload());
  out->width = width;
  for (uint32_t t = 0; t < kMeshletTriangles; t++)
    for (uint32_t k = 0; k < 3; k++)
      out->corner[t][k] =
          t < d.triangle_count ? uint8_t(corner_of(d.triangles[t], k, primitive.flip_winding)) : 0;
  for (uint32_t id = 0; id < d.vertex_count; id++) {
    float* v = out->values() + id * width;
    for_each_vertex_attribute(primitive, [&](const Attribute& a) {
      read_attribute(d, streams, a, id, v);
      if (&a == &primitive.normal) store(world_normal(normal_matrix, load(v)), v);
      if (&a == &primitive.texcoord && primitive.flip_texcoords) v[1] = 1 - v[1];
      v += a.components;
    });
  }
  return entry;
}

}  // namespace meshlet_shape
