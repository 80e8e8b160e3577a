// Values of a stream in the layout of the caller's vertices.
#pragma once
#include <cstdint>
#include <cstring>

#include "format/constants.h"

namespace gltf_meshlet_codec {

// Of each component. kUint8 to kUint32 hold the integers of the stream, all others its values.
enum class VertexFormat : uint32_t {
  kFloat,
  kHalf,
  kSnorm8,
  kUnorm8,
  kSnorm16,
  kUnorm16,
  kUint8,
  kUint16,
  kUint32,
  kCount
};

inline bool holds_integers(VertexFormat format) { return format >= VertexFormat::kUint8; }

inline uint32_t component_bytes(VertexFormat format) {
  switch (format) {
    case VertexFormat::kFloat:
    case VertexFormat::kUint32: return 4;
    case VertexFormat::kSnorm8:
    case VertexFormat::kUnorm8:
    case VertexFormat::kUint8: return 1;
    default: return 2;
  }
}

// Where one stream goes: vertex v to data + stride * v.
struct VertexAttribute {
  uint32_t stream;
  VertexFormat format;
  uint8_t* data;
  size_t stride;
};

// The nearest half, ties to even.
inline uint16_t half_of(float value) {
  uint32_t bits, scaled;
  std::memcpy(&bits, &value, sizeof bits);
  const uint32_t sign = bits >> 16 & 0x8000u, size = bits & 0x7FFFFFFFu;
  if (size > 0x7F800000u) return uint16_t(sign | 0x7E00u);   // no number
  if (size >= 0x477FF000u) return uint16_t(sign | 0x7C00u);  // 65520 and more round to infinity
  if (size < 0x38800000u) {  // below 2^-14: the sum has the half's last bit at its own
    float sum;
    std::memcpy(&sum, &size, sizeof sum);
    sum += 0.5f;
    std::memcpy(&scaled, &sum, sizeof scaled);
    return uint16_t(sign | (scaled - 0x3F000000u));
  }
  const uint32_t rebiased = size - 0x38000000u;
  return uint16_t(sign | (rebiased + 0xFFFu + (rebiased >> 13 & 1u)) >> 13);
}

// The nearest integer of value * scale, from -scale or 0 to scale; halves away from 0. No number
// gives the least one. In double the product and the sum are exact.
inline int32_t snorm_of(float value, double scale) {
  const float bound = !(value > -1.0f) ? -1.0f : value > 1.0f ? 1.0f : value;
  return int32_t(double(bound) * scale + (bound < 0.0f ? -0.5 : 0.5));
}
inline uint32_t unorm_of(float value, double scale) {
  const float bound = !(value > 0.0f) ? 0.0f : value > 1.0f ? 1.0f : value;
  return uint32_t(double(bound) * scale + 0.5);
}

template <class Component, class Value, class Convert>
void pack_components(const Value* values, uint32_t vertices, uint32_t components, uint8_t* out,
                     size_t stride, const Convert& convert) {
  for (uint32_t v = 0; v < vertices; v++, out += stride) {
    for (uint32_t c = 0; c < components; c++) {
      const Component component = convert(*values++);
      std::memcpy(out + c * sizeof component, &component, sizeof component);
    }
  }
}

// Writes vertices x components values, one vertex after the other, to every `stride` bytes.
inline void pack_values(VertexFormat format, const float* values, uint32_t vertices,
                        uint32_t components, uint8_t* out, size_t stride) {
  const auto pack = [&](auto component, const auto& convert) {
    pack_components<decltype(component)>(values, vertices, components, out, stride, convert);
  };
  switch (format) {
    case VertexFormat::kHalf: return pack(uint16_t(), half_of);
    case VertexFormat::kSnorm8:
      return pack(int8_t(), [](float x) { return int8_t(snorm_of(x, 127.0)); });
    case VertexFormat::kUnorm8:
      return pack(uint8_t(), [](float x) { return uint8_t(unorm_of(x, 255.0)); });
    case VertexFormat::kSnorm16:
      return pack(int16_t(), [](float x) { return int16_t(snorm_of(x, 32767.0)); });
    case VertexFormat::kUnorm16:
      return pack(uint16_t(), [](float x) { return uint16_t(unorm_of(x, 65535.0)); });
    default: return pack(float(), [](float x) { return x; });
  }
}

// Likewise integers, which fit the format.
inline void pack_integers(VertexFormat format, const uint32_t* values, uint32_t vertices,
                          uint32_t components, uint8_t* out, size_t stride) {
  const auto pack = [&](auto component) {
    using Component = decltype(component);
    pack_components<Component>(values, vertices, components, out, stride,
                               [](uint32_t x) { return Component(x); });
  };
  switch (format) {
    case VertexFormat::kUint8: return pack(uint8_t());
    case VertexFormat::kUint16: return pack(uint16_t());
    default: return pack(uint32_t());
  }
}

}  // namespace gltf_meshlet_codec
