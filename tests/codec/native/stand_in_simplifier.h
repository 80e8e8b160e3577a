// Stands for meshoptimizer where a test needs no good simplification: some of the triangles.
#pragma once
#include <algorithm>
#include <vector>

#include "lod/simplifier.h"

// Keeps the triangles with a locked vertex, and others, spread evenly, until the target is reached.
inline size_t keep_some(uint32_t* destination, const uint32_t* indices, size_t index_count,
                        const float*, size_t, size_t, const float*, size_t, const float*, size_t,
                        const uint8_t* locks, size_t target_index_count, float, uint32_t,
                        float* error) {
  const auto is_locked = [&](size_t t) {
    const uint32_t* v = indices + 3 * t;
    return locks[v[0]] || locks[v[1]] || locks[v[2]];
  };
  const size_t triangles = index_count / 3, target = target_index_count / 3;
  size_t locked = 0;
  for (size_t t = 0; t < triangles; t++) locked += is_locked(t);
  const size_t others = triangles - locked, wanted = target > locked ? target - locked : 0;
  size_t written = 0, passed = 0;
  for (size_t t = 0; t < triangles; t++) {
    bool is_kept = is_locked(t);
    if (!is_kept) {
      is_kept = passed * wanted / others != (passed + 1) * wanted / others;
      passed++;
    }
    if (is_kept) destination = std::copy_n(indices + 3 * t, 3, destination), written += 3;
  }
  *error = 1;
  return written;
}

// Puts as many clusters as wanted into a group, in their order.
inline size_t in_order(uint32_t* destination, const uint32_t*, size_t, const uint32_t*,
                       size_t cluster_count, size_t, size_t target_partition_size) {
  for (size_t c = 0; c < cluster_count; c++) destination[c] = uint32_t(c / target_partition_size);
  return (cluster_count + target_partition_size - 1) / target_partition_size;
}

constexpr gltf_meshlet_codec::Simplifier kStandIn{keep_some, nullptr, in_order};
