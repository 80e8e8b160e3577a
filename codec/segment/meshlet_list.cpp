#include "segment/meshlet_list.h"

namespace gltf_meshlet_codec {

void MeshletList::append(const MeshletList& other) {
  const uint32_t base = uint32_t(triangles.size());
  const uint32_t disks_before = uint32_t(disk_begin.size() - 1);
  triangles.insert(triangles.end(), other.triangles.begin(), other.triangles.end());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  for (size_t k = 1; k < other.disk_begin.size(); k++)
    disk_begin.push_back(base + other.disk_begin[k]);
  for (size_t m = 1; m < other.meshlet_begin.size(); m++)
    meshlet_begin.push_back(disks_before + other.meshlet_begin[m]);
}

void MeshletList::append_meshlet(const Disks& disks) {
  const uint32_t base = uint32_t(triangles.size());
  triangles.insert(triangles.end(), disks.triangles.begin(), disks.triangles.end());
  for (size_t k = 1; k < disks.begin.size(); k++) disk_begin.push_back(base + disks.begin[k]);
  meshlet_begin.push_back(uint32_t(disk_begin.size() - 1));
  vertices.push_back(uint32_t(disks.vertex_count));
}

void MeshletList::append_joined(const MeshletList& other, const std::vector<uint32_t>& meshlets) {
  vertices.push_back(0);
  for (const uint32_t m : meshlets) {
    vertices.back() += other.vertices[m];
    for (uint32_t k = other.meshlet_begin[m]; k < other.meshlet_begin[m + 1]; k++) {
      triangles.insert(triangles.end(), other.triangles.begin() + other.disk_begin[k],
                       other.triangles.begin() + other.disk_begin[k + 1]);
      disk_begin.push_back(uint32_t(triangles.size()));
    }
  }
  meshlet_begin.push_back(uint32_t(disk_begin.size() - 1));
}

}  // namespace gltf_meshlet_codec
