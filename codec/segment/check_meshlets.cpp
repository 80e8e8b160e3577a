#include "segment/check_meshlets.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "format/constants.h"
#include "segment/half_edges.h"

namespace gltf_meshlet_codec {
namespace {

[[noreturn]] void refuse(const char* problem) { throw std::invalid_argument(problem); }

// Checks disks. Looks triangles and vertices up in arrays: sorting each disk takes twice as long.
class DiskCheck {
 public:
  DiskCheck(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets)
      : mesh_(mesh),
        half_edges_(half_edges),
        meshlets_(meshlets),
        place_(mesh.triangle_count),
        corner_of_(mesh.vertex_count, kNone),
        start_of_(mesh.vertex_count, kNone) {
    for (uint32_t i = 0; i < place_.size(); i++) place_[meshlets.triangles[i]] = i;
  }

  // Checks a disk of at most 64 triangles. Returns its number of vertices.
  //
  // A connected set of triangles of Euler characteristic 1 (V - E + F) is a disk: sharing a vertex
  // without an edge, a second boundary loop, or a handle makes the characteristic smaller.
  size_t check(uint32_t disk) {
    const uint32_t first = meshlets_.disk_begin[disk];
    const uint32_t count = meshlets_.disk_begin[disk + 1] - first;
    for (uint32_t i = 0; i < count; i++) parent_[i] = i;
    size_t vertices = 0, edges = 0, starts = 0, connected = count;
    bool passes_twice = false;
    for (uint32_t i = 0; i < count; i++) {
      for (uint32_t k = 0; k < 3; k++) {
        const uint32_t h = 3 * meshlets_.triangles[first + i] + k, vertex = mesh_.triangles[h];
        vertices += corner_of_[vertex] != disk;
        corner_of_[vertex] = disk;
        const int32_t opposite = half_edges_.by_vertex(h);
        // The number of the other triangle in this disk; large in another disk.
        const uint32_t j = opposite < 0 ? kNone : place_[uint32_t(opposite) / 3] - first;
        if (j >= count) {
          passes_twice = passes_twice || start_of_[vertex] == disk;
          start_of_[vertex] = disk;
          starts++;
          edges++;
          continue;
        }
        edges += h < uint32_t(opposite);
        const uint32_t a = root(i), b = root(j);
        if (a != b) connected--;
        parent_[a] = b;
      }
    }
    if (connected != 1 || vertices + count != edges + 1 || starts < 3 || passes_twice)
      refuse("a meshlet holds triangles that are not a disk");
    return vertices;
  }

 private:
  static constexpr uint32_t kNone = ~0u;

  uint32_t root(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  const MeshView& mesh_;
  const HalfEdges& half_edges_;
  const Meshlets& meshlets_;
  std::vector<uint32_t> place_;      // of each triangle
  std::vector<uint32_t> corner_of_;  // last disk of each vertex
  std::vector<uint32_t> start_of_;   // last disk with an open edge from each vertex
  uint32_t parent_[MESHLET_TRIANGLES];
};

}  // namespace

bool are_begins(const std::vector<uint32_t>& begin, size_t end) {
  return begin.size() >= 2 && begin.front() == 0 && begin.back() == end &&
         std::adjacent_find(begin.begin(), begin.end(), std::greater_equal<uint32_t>()) ==
             begin.end();
}

void check_order(const std::vector<uint32_t>& triangles, size_t count) {
  if (triangles.size() != count) refuse("the meshlets do not hold each triangle once");
  std::vector<bool> seen(count, false);
  for (uint32_t t : triangles) {
    if (t >= count || seen[t]) refuse("the meshlets do not hold each triangle once");
    seen[t] = true;
  }
}

void check_lists(const Meshlets& meshlets, size_t triangle_count) {
  check_order(meshlets.triangles, triangle_count);
  if (!are_begins(meshlets.disk_begin, triangle_count)) refuse("the disks' begins are not valid");
  if (!are_begins(meshlets.meshlet_begin, meshlets.disk_begin.size() - 1))
    refuse("the meshlets' begins are not valid");
  for (size_t m = 0; m < meshlets.count(); m++)
    if (meshlets.first_triangle(m + 1) - meshlets.first_triangle(m) > MESHLET_TRIANGLES)
      refuse("a meshlet has more than 64 triangles");
}

void check_disks(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets) {
  DiskCheck disks(mesh, half_edges, meshlets);
  for (size_t m = 0; m < meshlets.count(); m++) {
    size_t vertices = 0;
    for (uint32_t k = meshlets.meshlet_begin[m]; k < meshlets.meshlet_begin[m + 1]; k++)
      vertices += disks.check(k);
    if (vertices > MESHLET_VERTICES) refuse(kTooManyVertices);
  }
}

}  // namespace gltf_meshlet_codec
