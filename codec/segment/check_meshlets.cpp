#include "segment/check_meshlets.h"

#include <algorithm>
#include <stdexcept>

#include "format/constants.h"
#include "segment/half_edges.h"

namespace meshlet {
namespace {

[[noreturn]] void refuse(const char* problem) { throw std::invalid_argument(problem); }

// begin must start at 0, increase, and end at `end`.
void check_begins(const std::vector<uint32_t>& begin, size_t end, const char* problem) {
  if (begin.size() < 2 || begin.front() != 0 || begin.back() != end) refuse(problem);
  if (std::adjacent_find(begin.begin(), begin.end(), std::greater_equal<uint32_t>()) != begin.end())
    refuse(problem);
}

void check_permutation(const std::vector<uint32_t>& triangles, size_t count) {
  if (triangles.size() != count) refuse("the meshlets do not hold each triangle once");
  std::vector<bool> seen(count, false);
  for (uint32_t t : triangles) {
    if (t >= count || seen[t]) refuse("the meshlets do not hold each triangle once");
    seen[t] = true;
  }
}

uint32_t root(std::vector<uint32_t>& parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Checks one disk and returns its number of vertices. `disk_of`: the disk of each triangle.
//
// A connected set of triangles of Euler characteristic 1 (V - E + F) is a disk: sharing a vertex
// without an edge, a second boundary loop, or a handle makes the characteristic smaller.
size_t check_disk(const MeshView& mesh, const HalfEdges& half_edges,
                  const std::vector<uint32_t>& disk_of, const uint32_t* triangles, size_t count,
                  uint32_t disk) {
  std::vector<uint32_t> vertices, starts, parent(count);
  for (uint32_t i = 0; i < count; i++) parent[i] = i;
  size_t edges = 0, parts = count;
  for (uint32_t i = 0; i < count; i++) {
    for (uint32_t k = 0; k < 3; k++) {
      const uint32_t h = 3 * triangles[i] + k, vertex = mesh.triangles[h];
      vertices.push_back(vertex);
      const int32_t opposite = half_edges.by_vertex(h);
      const uint32_t other = uint32_t(opposite) / 3;
      if (opposite < 0 || disk_of[other] != disk) {
        starts.push_back(vertex);
        edges++;
        continue;
      }
      edges += h < uint32_t(opposite);
      const uint32_t j = uint32_t(std::find(triangles, triangles + count, other) - triangles);
      const uint32_t a = root(parent, i), b = root(parent, j);
      if (a != b) parts--;
      parent[a] = b;
    }
  }
  std::sort(vertices.begin(), vertices.end());
  const size_t vertex_count =
      size_t(std::unique(vertices.begin(), vertices.end()) - vertices.begin());
  std::sort(starts.begin(), starts.end());
  const bool passes_twice = std::adjacent_find(starts.begin(), starts.end()) != starts.end();
  if (parts != 1 || vertex_count + count != edges + 1 || starts.size() < 3 || passes_twice)
    refuse("a meshlet's part is not a disk");
  return vertex_count;
}

}  // namespace

void check_meshlets(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets) {
  check_permutation(meshlets.triangles, mesh.triangle_count);
  check_begins(meshlets.disk_begin, mesh.triangle_count, "the disks' begins are not valid");
  check_begins(meshlets.meshlet_begin, meshlets.disk_begin.size() - 1,
               "the meshlets' begins are not valid");
  std::vector<uint32_t> disk_of(mesh.triangle_count);
  for (uint32_t k = 0; k + 1 < meshlets.disk_begin.size(); k++)
    for (uint32_t i = meshlets.disk_begin[k]; i < meshlets.disk_begin[k + 1]; i++)
      disk_of[meshlets.triangles[i]] = k;
  for (size_t m = 0; m + 1 < meshlets.meshlet_begin.size(); m++) {
    const uint32_t first = meshlets.meshlet_begin[m], last = meshlets.meshlet_begin[m + 1];
    const size_t count = meshlets.disk_begin[last] - meshlets.disk_begin[first];
    if (count > MESHLET_TRIANGLES) refuse("a meshlet has more than 64 triangles");
    size_t vertices = 0;
    for (uint32_t k = first; k < last; k++)
      vertices += check_disk(mesh, half_edges, disk_of, &meshlets.triangles[meshlets.disk_begin[k]],
                             meshlets.disk_begin[k + 1] - meshlets.disk_begin[k], k);
    if (vertices > MESHLET_VERTICES) refuse("a meshlet has more than 64 vertices");
  }
}

}  // namespace meshlet
