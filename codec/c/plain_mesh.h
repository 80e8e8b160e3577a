// A mesh of the caller, in whatever layout, as plain arrays for the encoder.
#pragma once
#include <cstring>
#include <stdexcept>
#include <vector>

#include "c/gltf_meshlet.h"
#include "c/objects.h"
#include "common/weld.h"
#include "decode/dequantise.h"
#include "decode/vertex_formats.h"

namespace gltf_meshlet_codec {

// Throws unless a caller's argument is fit.
inline void require(bool fit, const char* problem) {
  if (!fit) throw std::invalid_argument(problem);
}

// The numbers of a caller's array of any width, `bytes` each, `components` in a row, which begin
// every `stride` bytes.
template <class Number>
std::vector<uint32_t> wide(const void* data, uint64_t rows, uint32_t components, size_t stride) {
  std::vector<uint32_t> numbers;
  numbers.reserve(size_t(rows * components));
  const auto* row = static_cast<const uint8_t*>(data);
  for (uint64_t i = 0; i < rows; i++, row += stride) {
    for (uint32_t c = 0; c < components; c++) {
      Number number;
      std::memcpy(&number, row + c * sizeof number, sizeof number);
      numbers.push_back(number);
    }
  }
  return numbers;
}

// A mesh of the caller with plain arrays: what it gives in another layout, or not at all, is here.
struct PlainMesh {
  gltf_meshlet_mesh m;

  explicit PlainMesh(const gltf_meshlet_mesh& given) : m(given) {
    require(m.vertex_count < UINT32_MAX, "there are too many vertices");
    if (m.triangles_16) widen_triangles();
    if (m.attributes) widen_attributes();
    if (m.positions && m.position_stride && m.position_stride != 12) widen_positions();
    if (!m.positions && m.vertex_count) make_positions();
    if (!m.position_ids && m.vertex_count) make_position_ids();
  }
  PlainMesh(const PlainMesh&) = delete;

 private:
  void widen_triangles() {
    require(!m.triangles, "there are two kinds of triangles");
    require(m.triangle_count <= UINT32_MAX / 3, "there are too many triangles");
    triangles_ = wide<uint16_t>(m.triangles_16, m.triangle_count, 3, 6);
    m.triangles = triangles_.data();
  }

  void widen_attributes() {
    require(!m.values, "there are both values and attributes");
    require(m.stream_count <= BLOB_MAX_STREAMS && m.streams, "there are no streams, or too many");
    for (uint32_t s = 0; s < m.stream_count; s++) {
      const gltf_meshlet_attribute& a = m.attributes[s];
      const uint32_t elements = m.streams[s].elements;
      require(a.stream == s, "attribute s is not of stream s");
      require(a.data || m.vertex_count == 0, kNull);
      require(a.format >= GLTF_MESHLET_U8 && a.format <= GLTF_MESHLET_U32,
              "an attribute to encode has no format of integers");
      require(elements <= STREAM_MAX_ELEMENTS, "a stream has not 1 to 4 elements");
      const size_t bytes = elements * component_bytes(VertexFormat(a.format));
      const size_t stride = a.stride ? a.stride : bytes;
      require(stride >= bytes, "an attribute's stride is less than its bytes");
      values_.push_back(a.format == GLTF_MESHLET_U8
                            ? wide<uint8_t>(a.data, m.vertex_count, elements, stride)
                        : a.format == GLTF_MESHLET_U16
                            ? wide<uint16_t>(a.data, m.vertex_count, elements, stride)
                            : wide<uint32_t>(a.data, m.vertex_count, elements, stride));
    }
    for (const auto& values : values_) lists_.push_back(values.data());
    m.values = lists_.data();
  }

  void widen_positions() {
    require(m.position_stride >= 12, "the stride of the positions is less than 12 bytes");
    const auto* row = reinterpret_cast<const uint8_t*>(m.positions);
    positions_.resize(3 * size_t(m.vertex_count));
    for (uint64_t v = 0; v < m.vertex_count; v++, row += m.position_stride)
      std::memcpy(positions_.data() + 3 * v, row, 12);
    m.positions = positions_.data();
  }

  const uint32_t* position_integers() const {
    require(m.values && m.streams && m.stream_count && m.values[0], kNull);
    return m.values[0];
  }

  void make_positions() {
    const uint32_t* q = position_integers();
    const gltf_meshlet_stream& s = m.streams[0];
    require(s.kind == KIND_GRID && s.elements == 3,
            "there are no positions, and stream 0 is no grid of three elements");
    positions_.resize(3 * size_t(m.vertex_count));
    for (size_t i = 0; i < positions_.size(); i++)
      positions_[i] = grid_value(q[i], double(s.step), double(s.offset[i % 3]));
    m.positions = positions_.data();
  }

  void make_position_ids() {
    const uint32_t* q = position_integers();
    const uint32_t elements = m.streams[0].elements;
    require(elements >= 1 && elements <= STREAM_MAX_ELEMENTS, "a stream has not 1 to 4 elements");
    ids_.resize(size_t(m.vertex_count));
    weld_rows(reinterpret_cast<const uint8_t*>(q), ids_.size(), 4 * elements, ids_.data());
    m.position_ids = ids_.data();
  }

  std::vector<uint32_t> triangles_, ids_;
  std::vector<std::vector<uint32_t>> values_;
  std::vector<const uint32_t*> lists_;
  std::vector<float> positions_;
};

}  // namespace gltf_meshlet_codec
