// Mesh -> meshlets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace meshlet {

// Triangles (at least one, below 2^31 / 3), three vertex numbers each, never one twice in a
// triangle. position_ids[v] (below vertex_count) is equal for two vertices if and only if their
// positions are bit-identical; positions: three finite floats per vertex.
struct MeshView {
  const uint32_t* triangles;
  size_t triangle_count;
  const uint32_t* position_ids;
  const float* positions;
  size_t vertex_count;
};

// Which weight orders the attachment of triangles to regions: equation (1) of the paper with its
// penalty C(F) for full regions, or without it, as Choe et al. have it.
enum class Weight { paper, choe };

struct GenerationOptions {
  int max_triangles = 64;  // per meshlet, 1..64
  int max_vertices = 64;   // per meshlet, 3..64
  float lambda =
      1.4f;  // above 1: the smaller, the more planar the meshlets; the larger, the more compact
  int iterations = 12;  // at most this many rounds of attaching triangles and moving centres
  Weight weight = Weight::paper;
  int threads = 0;  // 0: one per processor; no influence on the result
  std::function<void(float)>
      progress;  // called on the calling thread with a fraction that never decreases
  float fill =
      0.96f;  // as many initial centres as give regions this share of max_triangles, in the mean
};

// A meshlet is a range of components, a component a range of triangles.
struct Meshlets {
  std::vector<uint32_t> triangles;   // a permutation of the mesh's triangles
  std::vector<uint32_t> disk_begin;  // component k: triangles[disk_begin[k] .. disk_begin[k + 1])
  std::vector<uint32_t>
      meshlet_begin;      // meshlet m: components meshlet_begin[m] .. meshlet_begin[m + 1]
  uint32_t histogram[4];  // regions before the limits are enforced, of [0, 32), [32, 64), [64, 72),
                          // >= 72 triangles
  int iterations_run;
};

// Partitions the mesh. Every component is a disk when triangles are joined by shared vertices (not
// just positions): connected through edges, of Euler characteristic 1, with one boundary loop of at
// least three edges that passes each vertex once. A meshlet has at most max_triangles triangles
// and, summed over its components, at most max_vertices vertices. Meshlets that share an edge (by
// position) have close numbers. The result depends on nothing but the mesh and the options, threads
// excepted.
Meshlets generate_meshlets(const MeshView& mesh, const GenerationOptions& options);

}  // namespace meshlet
