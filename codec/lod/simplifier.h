// meshoptimizer's functions that levels are built with. The caller gives them: a library of the
// codec contains them only if it was built with MESHLET_SIMPLIFIER.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gltf_meshlet_codec {

// As in meshoptimizer.h and cmake/simplifier_guard.h.
struct Simplifier {
  size_t (*simplify)(uint32_t* destination, const uint32_t* indices, size_t index_count,
                     const float* positions, size_t vertex_count, size_t position_stride,
                     const float* attributes, size_t attribute_stride, const float* weights,
                     size_t attribute_count, const uint8_t* locks, size_t target_index_count,
                     float target_error, uint32_t options, float* error);
  // May be null: the PyPI package of meshoptimizer has no guard.
  size_t (*simplify_guarded)(uint32_t* destination, const uint32_t* indices, size_t index_count,
                             const float* positions, size_t vertex_count, size_t position_stride,
                             const float* attributes, size_t attribute_stride, const float* weights,
                             size_t attribute_count, const uint8_t* locks,
                             size_t target_index_count, float target_error, uint32_t options,
                             float* error, const uint32_t* places, const uint32_t* normal_begin,
                             const float* normals, float least_cosine);
  size_t (*partition)(uint32_t* destination, const uint32_t* cluster_indices, size_t index_count,
                      const uint32_t* cluster_index_counts, size_t cluster_count,
                      size_t vertex_count, size_t target_partition_size);
};

}  // namespace gltf_meshlet_codec
