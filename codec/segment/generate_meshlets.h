// Segmentation: mesh to meshlets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "segment/half_edges.h"
#include "segment/meshlet_list.h"
#include "segment/region_growing.h"
#include "segment/spatial_mesh.h"

namespace gltf_meshlet_codec {

// How much time goes into small files. kFast and kNormal shift the borders of regions. kPaper grows
// regions anew in each round, as the paper: only for bench, and for the conformance vectors.
enum class Effort { kFast, kNormal, kPaper };

struct GenerationOptions {
  int max_triangles = 64;  // per meshlet, 1..64
  int max_vertices = 64;   // per meshlet, 3..64
  // Equation (1), above 1. Smaller: flatter meshlets; larger: more compact ones.
  float lambda = 1.4f;
  Effort effort = Effort::kNormal;
  int32_t max_spread = 20;  // bits, see join_meshlets; measured by the sizes of files
  int threads = 0;          // 0: one per processor; does not change the result
  // Called on the calling thread with a fraction that never decreases.
  std::function<void(float)> progress;
  // Mean share of max_triangles in a region; sets the number of initial centres. Another value, or
  // another weight, only to measure the paper's Table 1.
  float fill = 0.96f;
  Weight weight = Weight::kPaper;
};

// Meshlets of all triangles of a mesh.
struct Meshlets : MeshletList {
  // Regions of < 32, < 64, < 72 and more triangles, before the limits are enforced.
  uint32_t histogram[4] = {0, 0, 0, 0};
  int iterations_run = 0;
};

// Partitions the mesh into meshlets of disks. A disk is connected through edges of shared vertices
// (equal positions do not suffice), has Euler characteristic 1, and one boundary loop of at least
// three edges that passes each vertex once. A meshlet has at most max_triangles triangles and,
// summed over its disks, max_vertices vertices. Meshlets that share an edge (by position) have
// close numbers. The result depends on the mesh and the options only, not on `threads`.
//
// half_edges: match_half_edges of the mesh.
Meshlets generate_meshlets(const SpatialMesh& mesh, const HalfEdges& half_edges,
                           const GenerationOptions& options);

}  // namespace gltf_meshlet_codec
