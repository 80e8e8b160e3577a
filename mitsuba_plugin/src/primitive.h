// The plugin's interface to the codec: compressed primitives, and their meshlets as floats.
#pragma once
#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "cache.h"
#include "decode/decoder.h"
#include "format/blob.h"
#include "triangles.h"

namespace meshlet_shape {

// The bytes of a compressed primitive, or of one of its pages.
class Blob {
 public:
  Blob(const uint8_t* data, size_t size);

  // Checks the header once, in the thread that needs it first. Throws std::runtime_error if it is
  // malformed.
  const gltf_meshlet_codec::Blob& checked() const;
  const gltf_meshlet_codec::BlobHeader& header() const { return checked().header; }

  const std::vector<uint8_t> bytes;
  const uint64_t id;  // unique in the process

 private:
  mutable std::once_flag read_;
  mutable gltf_meshlet_codec::Blob checked_{};
};

constexpr uint32_t kNoStream = ~0u;
constexpr uint32_t kMaxStored = 16;

// A vertex attribute: the streams from `stream` on hold `stored` numbers per vertex; skip the first
// `skipped` and take `components`. Integers are rounded and clamped to [lowest, highest]; then all
// are multiplied by scale.
// mitsuba_plugin/reader.py declares the same struct.
struct Attribute {
  char name[96] = "";
  uint32_t stream = kNoStream;
  uint32_t stored = 0, skipped = 0, components = 0;
  float scale = 1, lowest = 0, highest = 0;
  uint32_t integer = 0;

  bool exists() const { return stream != kNoStream; }
};

// Row-major 3 x 4.
struct Affine {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

  float determinant() const;
  Affine normal_matrix() const;  // inverse transpose times the determinant's absolute value
  Affine operator*(const Affine& b) const;
};

// A compressed primitive in the scene, or some meshlets of it.
struct Primitive {
  std::shared_ptr<const Blob> blob;
  std::vector<uint32_t> chosen;  // meshlets of the blob, ascending; all if empty
  Attribute position, normal, texcoord;
  std::vector<Attribute> others;
  Affine to_world;
  bool flip_winding = false;    // to_world mirrors
  bool flip_texcoords = false;  // v becomes 1 - v; only for a cache

  // Set by check_primitive: streams to decode for triangles, [0, position_end), and for attributes,
  // [others_first, others_end).
  uint32_t position_end = 0, others_first = 0, others_end = 0;
  uint32_t width = 0;  // floats per vertex in VertexAttributes

  uint32_t meshlet_count() const {
    return chosen.empty() ? blob->header().meshlet_count : uint32_t(chosen.size());
  }
  uint32_t number_in_blob(uint32_t m) const { return chosen.empty() ? m : chosen[m]; }
  // All streams that it needs, and perhaps others between them.
  gltf_meshlet_codec::StreamRange streams() const {
    return {std::min(position.stream, others_first), std::max(position_end, others_end)};
  }
};

// Vertex attributes of a decoded meshlet: this header, then count x width floats. Per vertex:
// normal (3), texcoord (2), others in order, without those that the primitive lacks.
struct VertexAttributes {
  uint8_t corner[kMeshletTriangles][3];
  uint32_t width;

  const float* values() const { return reinterpret_cast<const float*>(this + 1); }
  float* values() { return reinterpret_cast<float*>(this + 1); }
  const float* of(uint32_t triangle, uint32_t k) const {
    return values() + corner[triangle][k] * width;
  }
};

// vertices: of the whole blob.
struct PrimitiveFacts {
  uint32_t triangles, vertices, meshlets;
};

// Checks a primitive and fills in its last fields. Throws std::runtime_error if the blob is
// malformed or lacks the primitive's streams or meshlets.
PrimitiveFacts check_primitive(Primitive& primitive);

// Decodes meshlet m of a blob; the result is valid until the thread decodes another one. Throws
// std::runtime_error.
gltf_meshlet_codec::DecodedMeshlet decode_meshlet(const Blob& blob, uint32_t m,
                                                  gltf_meshlet_codec::StreamRange streams);

// Reads attribute `a` of a vertex, whose streams must be decoded.
void read_attribute(const gltf_meshlet_codec::DecodedMeshlet& d,
                    const std::vector<gltf_meshlet_codec::Stream>& streams, const Attribute& a,
                    uint32_t vertex, float* out);

// Corner k of a packed triangle, after a change of its winding.
inline uint32_t corner_of(uint32_t packed, uint32_t k, bool flip) {
  return packed >> (8 * (flip && k ? 3 - k : k)) & 255u;
}

// Bytes of a cache entry, by kind.
size_t triangles_bytes(uint32_t triangles);
size_t attributes_bytes(uint32_t vertices, uint32_t width);

// Decode meshlet `m` of the primitive into the thread's scratch memory. The payload is Triangles or
// VertexAttributes. Throw std::runtime_error.
Entry* decode_triangles(ThreadSlot& thread, const Primitive& primitive, uint32_t m);
// Decodes all of a meshlet, which finds damage; also returns its number of vertices.
Entry* decode_whole(ThreadSlot& thread, const Primitive& primitive, uint32_t m,
                    uint32_t& vertex_count);
Entry* decode_attributes(ThreadSlot& thread, const Primitive& primitive, uint32_t m);

}  // namespace meshlet_shape
