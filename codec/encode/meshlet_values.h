// The values of one meshlet, and their residuals.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "decode/serial_decoder.h"
#include "encode/local_meshlet.h"
#include "encode/plan.h"
#include "format/blob.h"

namespace gltf_meshlet_codec {

// Copies the integers of a vertex: 1 to 4, too few for a call of memmove.
inline void copy_elements(const uint32_t* from, uint32_t elements, uint32_t* to) {
  to[0] = from[0];
  if (elements > 1) to[1] = from[1];
  if (elements > 2) to[2] = from[2];
  if (elements > 3) to[3] = from[3];
}

// Predicts with the decoder's own functions, from values instead of bits.
class MeshletValues {
 public:
  // Both must outlive this object.
  MeshletValues(const std::vector<Stream>& streams, const VertexValues& values);

  // Number of integers of a vertex.
  uint32_t element_count() const { return element_count_; }
  // The number of the first integer of stream s.
  uint32_t first_element(uint32_t s) const { return first_element_[s]; }

  // Loads the disk that the meshlet added last.
  void add_disk(const LocalMeshlet& meshlet);

  // Writes residuals of the vertex of a packed triangle: those of one stream under a predictor, or
  // those of a mask of streams under their own, each at its place among all streams' residuals.
  void traversed(uint32_t s, uint32_t predictor, uint32_t triangle, uint32_t* out);
  void traversed(uint64_t streams, uint32_t triangle, uint32_t* out);

  // Places the meshlet's references along its loops, once all disks are loaded. loop_vertices:
  // local vertices of all loops, from the first reference of each.
  void place(PlannedReferences references, const std::vector<uint8_t>& loop_vertices);
  // Append the residuals of stream s: values of the first anchor, then residuals of the others
  // against it; of owned references; of seams. After place().
  void anchors(uint32_t s, std::vector<uint32_t>& out) const;
  void chains(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out);
  void seams(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out);

 private:
  void append_chains(uint32_t s, uint32_t predictor, uint64_t references,
                     std::vector<uint32_t>& out);
  void traversed(uint32_t s, uint32_t predictor, uint32_t triangle,
                 const SerialDecoder::Weights& weights, uint32_t* out);

  const std::vector<Stream>& streams_;
  const VertexValues& values_;
  bool needs_normals_ = false;
  uint32_t element_count_ = 0;
  uint64_t affine_streams_ = 0;
  std::vector<uint32_t> first_element_;
  PlannedReferences references_{nullptr, 0};
  uint64_t listed_ = 0;  // references whose chains the decoder has listed
  std::unique_ptr<SerialDecoder> decoder_;
};

}  // namespace gltf_meshlet_codec
