// The one place where the plugin meets the codec: compressed primitives, and single meshlets of
// them as floats.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "cache.h"
#include "triangles.h"

namespace meshlet_shape {

// A compressed primitive's bytes, which outlive every use.
struct Blob {
  Blob(const uint8_t* data, size_t size);

  const std::vector<uint8_t> bytes;
  const uint64_t id;  // never given twice
};

constexpr uint32_t kNoStream = ~0u;
constexpr uint32_t kMaxStored = 16;

// A vertex attribute: of the `stored` values from stream `stream` on, the `components` behind the
// first `skipped`. Integers are rounded to [lowest, highest], everything is multiplied by scale.
struct Attribute {
  std::string name;
  uint32_t stream = kNoStream;
  uint32_t stored = 0, skipped = 0, components = 0;
  float scale = 1, lowest = 0, highest = 0;
  bool integer = false;

  bool exists() const { return stream != kNoStream; }
};

// Row-major 3 x 4.
struct Affine {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

  Vector3 point(const Vector3& p) const;
  float determinant() const;
  Affine normal_matrix() const;  // inverse transpose, times the determinant's absolute value
  Affine operator*(const Affine& b) const;
};

// A compressed primitive at its place in the scene.
struct Part {
  std::shared_ptr<const Blob> blob;
  Attribute position, normal, texcoord;
  std::vector<Attribute> others;
  Affine to_world;
  bool flip_winding = false;  // a mirrored triangle is wound the other way

  // Set by check_part: the streams to decode for triangles, [0, position_end), and for everything
  // else.
  uint32_t position_end = 0, others_first = 0, others_end = 0;
  uint32_t width = 0;  // of VertexAttributes
};

// The vertices' attributes of one decoded meshlet; a header, followed in memory by count x width
// floats. width: normal (3), texcoord (2), others in order, each only where the part has it.
struct VertexAttributes {
  uint8_t corner[kMeshletTriangles][3];
  uint32_t width;

  const float* values() const { return reinterpret_cast<const float*>(this + 1); }
  float* values() { return reinterpret_cast<float*>(this + 1); }
  const float* of(uint32_t triangle, uint32_t k) const {
    return values() + corner[triangle][k] * width;
  }
};

// Checks a part and completes it. Throws std::runtime_error when its blob is malformed or does not
// have its streams.
struct BlobFacts {
  uint32_t triangles, vertices, meshlets;
};
BlobFacts check_part(Part& part);

// Bytes of both kinds of entries for a meshlet of so many triangles and vertices.
size_t triangles_bytes(uint32_t triangles);
size_t attributes_bytes(uint32_t vertices, uint32_t width);

// Decodes meshlet `m` into the thread's scratch memory; the payload is Triangles or
// VertexAttributes. Throws std::runtime_error.
Entry* decode_triangles(ThreadSlot& thread, const Part& part, uint32_t m);
Entry* decode_attributes(ThreadSlot& thread, const Part& part, uint32_t m);

// A part decoded whole: triangles 3 x T, positions and normals 3 x V (in world space), texcoords 2
// x V, others in their order.
struct DecodedPart {
  std::vector<uint32_t> triangles;
  std::vector<float> positions, normals, texcoords;
  std::vector<std::vector<float>> others;
};
DecodedPart decode_all(const Part& part);

// Bytes that a thread needs to decode, beside its scratch memory.
size_t decoder_bytes();

}  // namespace meshlet_shape
