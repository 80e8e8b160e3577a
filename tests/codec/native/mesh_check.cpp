#include "mesh_check.h"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>

namespace {

using Edge = std::pair<uint32_t, uint32_t>;

struct EdgeHash {
  size_t operator()(const Edge& edge) const {
    return (uint64_t(edge.first) << 32 | edge.second) * 0x9E3779B97F4A7C15u >> 20;
  }
};

// For each half-edge the one it is glued to, or -1, by the definition in half_edges.h.
std::vector<int64_t> glue(const Mesh& mesh, bool by_position) {
  std::unordered_map<Edge, std::vector<uint32_t>, EdgeHash> uses;
  const auto name = [&](size_t corner) {
    return by_position ? mesh.position_ids[mesh.triangles[corner]] : mesh.triangles[corner];
  };
  for (uint32_t h = 0; h < mesh.triangles.size(); h++) {
    const uint32_t a = name(h), b = name(h / 3 * 3 + (h + 1) % 3);
    if (a != b) uses[{std::min(a, b), std::max(a, b)}].push_back(h);
  }
  std::vector<int64_t> glued(mesh.triangles.size(), -1);
  for (const auto& use : uses) {
    if (use.second.size() != 2) continue;
    const uint32_t h = use.second[0], g = use.second[1];
    if (name(h) == name(g) || h / 3 == g / 3) continue;
    glued[h] = g;
    glued[g] = h;
  }
  return glued;
}

uint32_t corner_after(uint32_t half_edge) { return half_edge / 3 * 3 + (half_edge + 1) % 3; }

// One disk: triangles [first, last) of the partition.
std::string check_disk(const Mesh& mesh, const std::vector<int64_t>& glued, const uint32_t* first,
                       const uint32_t* last, size_t& vertices) {
  const std::set<uint32_t> members(first, last);
  const auto inside = [&](uint32_t half_edge) {
    return glued[half_edge] >= 0 && members.count(uint32_t(glued[half_edge] / 3)) > 0;
  };
  std::map<uint32_t, size_t> fan;       // triangles per vertex
  std::map<uint32_t, uint32_t> next;    // along the boundary
  std::map<uint32_t, size_t> glued_at;  // glued pairs of half-edges that meet at the vertex
  size_t glued_pairs = 0;
  for (const uint32_t t : members) {
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
      const uint32_t a = mesh.triangles[h], b = mesh.triangles[corner_after(h)];
      ++fan[a];
      if (!inside(h)) {
        if (!next.emplace(a, b).second) return "a boundary vertex is left twice";
      } else if (h < glued[h]) {
        glued_pairs++;
        ++glued_at[a];
        ++glued_at[b];
      }
    }
  }
  vertices = fan.size();
  const size_t edges = 3 * members.size() - glued_pairs;
  if (vertices + members.size() != edges + 1) return "a disk's Euler characteristic is not 1";
  // A fan of n triangles that is one open run has n - 1 glued edges at its vertex, a closed one n.
  for (const auto& at : fan) {
    const bool boundary = next.count(at.first) > 0;
    if (glued_at[at.first] + (boundary ? 1 : 0) != at.second)
      return "a vertex has more than one fan";
  }
  if (next.size() < 3) return "a boundary loop is shorter than three edges";
  uint32_t at = next.begin()->first;
  for (size_t step = 0; step < next.size(); step++) {
    const auto found = next.find(at);
    if (found == next.end()) return "a boundary is not closed";
    at = found->second;
    if (at == next.begin()->first && step + 1 != next.size())
      return "a disk has several boundary loops";
  }
  if (at != next.begin()->first) return "a boundary is not closed";
  std::vector<uint32_t> stack{*first};
  std::set<uint32_t> reached{*first};
  while (!stack.empty()) {
    const uint32_t t = stack.back();
    stack.pop_back();
    for (uint32_t h = 3 * t; h < 3 * t + 3; h++)
      if (inside(h) && reached.insert(uint32_t(glued[h] / 3)).second)
        stack.push_back(uint32_t(glued[h] / 3));
  }
  if (reached.size() != members.size()) return "a disk is not connected through edges";
  return {};
}

}  // namespace

std::string check_meshlets(const Mesh& mesh, const gltf_meshlet_codec::GenerationOptions& options,
                           const gltf_meshlet_codec::Meshlets& meshlets) {
  const auto& disk_begin = meshlets.disk_begin;
  const auto& meshlet_begin = meshlets.meshlet_begin;
  std::vector<bool> seen(mesh.triangle_count(), false);
  for (const uint32_t t : meshlets.triangles) {
    if (t >= seen.size() || seen[t]) return "triangles are not a permutation";
    seen[t] = true;
  }
  if (meshlets.triangles.size() != seen.size()) return "triangles are missing";
  if (disk_begin.empty() || disk_begin.front() != 0 || disk_begin.back() != seen.size())
    return "disks do not cover the triangles";
  if (meshlet_begin.empty() || meshlet_begin.front() != 0 ||
      meshlet_begin.back() + 1 != disk_begin.size())
    return "meshlets do not cover the disks";
  const std::vector<int64_t> glued = glue(mesh, false);
  for (size_t m = 0; m + 1 < meshlet_begin.size(); m++) {
    if (meshlet_begin[m] >= meshlet_begin[m + 1]) return "a meshlet is empty";
    size_t vertices = 0;
    for (uint32_t k = meshlet_begin[m]; k < meshlet_begin[m + 1]; k++) {
      if (disk_begin[k] >= disk_begin[k + 1]) return "a disk is empty";
      size_t own = 0;
      const std::string wrong = check_disk(mesh, glued, meshlets.triangles.data() + disk_begin[k],
                                           meshlets.triangles.data() + disk_begin[k + 1], own);
      if (!wrong.empty()) return wrong;
      vertices += own;
    }
    if (vertices > size_t(options.max_vertices)) return "a meshlet has too many vertices";
    if (disk_begin[meshlet_begin[m + 1]] - disk_begin[meshlet_begin[m]] >
        uint32_t(options.max_triangles))
      return "a meshlet has too many triangles";
  }
  return {};
}

void add_figures(const Mesh& mesh, const gltf_meshlet_codec::Meshlets& meshlets, Figures& figures) {
  const size_t triangles = mesh.triangle_count();
  std::vector<uint32_t> disk_of(triangles), meshlet_of(triangles);
  for (uint32_t m = 0; m + 1 < meshlets.meshlet_begin.size(); m++)
    for (uint32_t k = meshlets.meshlet_begin[m]; k < meshlets.meshlet_begin[m + 1]; k++)
      for (uint32_t i = meshlets.disk_begin[k]; i < meshlets.disk_begin[k + 1]; i++)
        disk_of[meshlets.triangles[i]] = k, meshlet_of[meshlets.triangles[i]] = m;
  const std::vector<int64_t> by_vertex = glue(mesh, false), by_position = glue(mesh, true);
  std::set<Edge> neighbours;
  std::set<Edge> corners,
      on_chains;  // (0, position) where shared, (disk + 1, position) on open edges
  for (size_t k = 0; k + 1 < meshlets.disk_begin.size(); k++) {
    std::set<uint32_t> vertices;
    std::map<uint32_t, uint32_t> leaving;  // boundary half-edge by its first vertex
    for (uint32_t i = meshlets.disk_begin[k]; i < meshlets.disk_begin[k + 1]; i++) {
      for (uint32_t h = 3 * meshlets.triangles[i], end = h + 3; h < end; h++) {
        vertices.insert(mesh.triangles[h]);
        const int64_t other = by_position[h];
        if (other >= 0 && meshlet_of[h / 3] != meshlet_of[other / 3])
          neighbours.insert({meshlet_of[h / 3], meshlet_of[other / 3]});
        if (by_vertex[h] < 0 || disk_of[by_vertex[h] / 3] != k) leaving[mesh.triangles[h]] = h;
      }
    }
    figures.vertices += vertices.size();
    figures.boundary_vertices += leaving.size();
    const auto across = [&](uint32_t h) -> int64_t {
      return by_position[h] < 0 ? -1 : disk_of[by_position[h] / 3];
    };
    uint32_t h = leaving.begin()->second, start = h;
    size_t runs = 0, owned = 0;
    do {
      const uint32_t next = leaving.at(mesh.triangles[corner_after(h)]);
      const uint32_t position = mesh.position_ids[mesh.triangles[next]];
      if (across(h) != across(next)) {
        runs++;
        owned += across(next) < 0 || across(next) > int64_t(k);
        corners.insert({0, position});
      } else if (across(h) < 0 || across(h) > int64_t(k)) {
        on_chains.insert({0, position});
      }
      h = next;
    } while (h != start);
    figures.references += std::max<size_t>(runs, 1);
    figures.owned_chains += owned;
  }
  figures.triangles += triangles;
  figures.meshlets += meshlets.meshlet_begin.size() - 1;
  figures.disks += meshlets.disk_begin.size() - 1;
  figures.corners += corners.size();
  figures.chain_vertices += on_chains.size();
  figures.neighbours += neighbours.size();
  for (const Edge& pair : neighbours)
    if (pair.first < pair.second)
      figures.index_difference += pair.second - pair.first, ++figures.pairs;
}
