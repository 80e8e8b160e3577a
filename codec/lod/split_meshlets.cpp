#include "lod/split_meshlets.h"

#include <stdexcept>

#include "segment/check_meshlets.h"
#include "segment/disks.h"
#include "segment/half_edges.h"

namespace gltf_meshlet_codec {
namespace {

// The triangles of chosen meshlets, one meshlet after the other.
struct Chosen {
  std::vector<uint32_t> triangles, corners, begin{0};

  void add(const MeshView& mesh, const uint32_t* first, const uint32_t* last) {
    for (; first != last; first++) {
      const uint32_t* corner = mesh.triangles + 3 * size_t(*first);
      triangles.push_back(*first);
      corners.insert(corners.end(), corner, corner + 3);
    }
    begin.push_back(uint32_t(triangles.size()));
  }

  GroupMeshlets generate(const MeshView& mesh, const GenerationOptions& options) const {
    const MeshView part = {corners.data(), triangles.size(), mesh.position_ids, mesh.positions,
                           mesh.vertex_count};
    GroupMeshlets made = generate_in_groups(part, begin, options);
    for (uint32_t& t : made.triangles) t = triangles[t];
    return made;
  }
};

// Appends the meshlets of one group of another list.
void append_group(const GroupMeshlets& from, uint32_t group, MeshletList& to) {
  for (uint32_t m = from.group_begin[group]; m < from.group_begin[group + 1]; m++)
    to.append_joined(from, {m});
}

}  // namespace

GroupMeshlets split_meshlets(const MeshView& mesh, const std::vector<uint32_t>& order,
                             const std::vector<uint32_t>& meshlet_begin,
                             const GenerationOptions& options) {
  check_order(order, mesh.triangle_count);
  if (!are_begins(meshlet_begin, order.size()))
    throw std::invalid_argument("the meshlets' begins are not valid");
  const HalfEdges half_edges = match_half_edges(mesh, options.threads);
  DiskCutter cutter(mesh.triangles, half_edges);
  GroupMeshlets whole;  // meshlets that stay one; the others are groups without any
  Chosen large;
  for (size_t m = 0; m + 1 < meshlet_begin.size(); m++) {
    const uint32_t* const first = order.data() + meshlet_begin[m];
    const uint32_t* const last = order.data() + meshlet_begin[m + 1];
    Disks disks;
    if (last - first <= options.max_triangles) cutter.cut(first, size_t(last - first), disks);
    if (!disks.begin.empty() && disks.vertex_count <= size_t(options.max_vertices))
      whole.append_meshlet(disks);
    else
      large.add(mesh, first, last);
    whole.group_begin.push_back(whole.count());
  }
  if (large.triangles.empty()) return whole;
  const GroupMeshlets parts = large.generate(mesh, options);
  GroupMeshlets all;
  uint32_t part = 0;
  for (uint32_t m = 0; m + 1 < whole.group_begin.size(); m++) {
    if (whole.group_begin[m] < whole.group_begin[m + 1])
      append_group(whole, m, all);
    else
      append_group(parts, part++, all);
    all.group_begin.push_back(all.count());
  }
  return all;
}

}  // namespace gltf_meshlet_codec
