#include "lod/group_meshlets.h"

#include <algorithm>

#include "common/parallel.h"

namespace meshlet {
namespace {

// Replaces numbers by their rank among all that occur; `used` lists those, in order.
void compact(std::vector<uint32_t>& numbers, std::vector<uint32_t>& used) {
  used = numbers;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (uint32_t& number : numbers)
    number = uint32_t(std::lower_bound(used.begin(), used.end(), number) - used.begin());
}

Meshlets generate_group(const MeshView& mesh, uint32_t first, uint32_t last,
                        const GenerationOptions& options) {
  std::vector<uint32_t> corners(mesh.triangles + 3 * size_t(first),
                                mesh.triangles + 3 * size_t(last));
  std::vector<uint32_t> vertices, used_ids, ids;
  compact(corners, vertices);
  std::vector<float> positions;
  for (uint32_t v : vertices) {
    ids.push_back(mesh.position_ids[v]);
    const float* p = mesh.positions + 3 * size_t(v);
    positions.insert(positions.end(), p, p + 3);
  }
  compact(ids, used_ids);
  return generate_meshlets(
      {corners.data(), last - first, ids.data(), positions.data(), vertices.size()}, options);
}

// Appends begins that start at 0, after `to`'s last one.
void append_begins(std::vector<uint32_t>& to, const std::vector<uint32_t>& begins) {
  const uint32_t offset = to.back();
  for (size_t i = 1; i < begins.size(); i++) to.push_back(offset + begins[i]);
}

}  // namespace

GroupMeshlets generate_in_groups(const MeshView& mesh, const std::vector<uint32_t>& triangle_begin,
                                 const GenerationOptions& options) {
  const size_t count = triangle_begin.size() - 1;
  std::vector<Meshlets> groups(count);
  GenerationOptions inner = options;
  if (count > 1) inner.threads = 1;
  parallel_for(options.threads, count, [&](size_t g) {
    groups[g] = generate_group(mesh, triangle_begin[g], triangle_begin[g + 1], inner);
  });
  GroupMeshlets all{{}, {0}, {0}, {0}};
  for (size_t g = 0; g < count; g++) {
    for (uint32_t t : groups[g].triangles) all.triangles.push_back(triangle_begin[g] + t);
    append_begins(all.disk_begin, groups[g].disk_begin);
    append_begins(all.meshlet_begin, groups[g].meshlet_begin);
    all.group_begin.push_back(uint32_t(all.meshlet_begin.size() - 1));
  }
  return all;
}

}  // namespace meshlet
