#include "segment/generate_meshlets.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>

#include "common/curve.h"
#include "common/parallel.h"
#include "segment/cuthill_mckee.h"
#include "segment/disks.h"
#include "segment/join_meshlets.h"
#include "segment/patches.h"
#include "segment/region_growing.h"
#include "segment/region_refinement.h"

namespace gltf_meshlet_codec {
namespace {

// Triangles per patch: some hundred regions, and small enough for a core's own cache.
constexpr size_t kPatchSize = 1 << 15;

// How regions are made. With sweeps, kNormal's files are within 0.6 % of kPaper's and kFast's
// within 3.5 %; more sweeps or cycles change kNormal's by 0.1 %. Twice the rounds change kPaper's
// by 0.1 % on average. Mending instead of growing saves 7 % of kFast's time for the same bytes,
// giving up after one failed search up to 5 % for 0.2 % more bytes.
struct Schedule {
  int rounds, cycles, sweeps;  // as in GrowthOptions
  bool mends;
  int refinement_sweeps, max_failures;  // as in RefinementOptions
};

Schedule schedule_of(Effort effort) {
  switch (effort) {
    case Effort::kFast: return {0, 1, 4, true, 0, 1};
    case Effort::kNormal: return {0, 2, 5, false, 4, 6};
    default: return {12, 0, 0, false, 4, 6};
  }
}

// Gain of joining two meshlets, per edge between them: an edge that disappears inside a disk, or a
// seam that remains.
constexpr uint32_t kInnerEdgeWeight = 4;
constexpr uint32_t kSeamWeight = 1;

// Meshlets, or sets of meshlets to join, per parallel item.
constexpr size_t kBlock = 256;

// Cells along the mesh's longest side of the grid that packing compares extents on.
constexpr float kGridCells = 4096;

std::array<int32_t, 3> to_grid(Vec3 point) {
  return {int32_t(point.x * kGridCells), int32_t(point.y * kGridCells),
          int32_t(point.z * kGridCells)};
}

class Generator {
 public:
  Generator(const SpatialMesh& mesh, const HalfEdges& half_edges, const GenerationOptions& options)
      : mesh_(mesh), half_edges_(half_edges), options_(options) {}

  Meshlets run();

 private:
  struct PatchResult {
    MeshletList list;
    std::array<uint32_t, 4> histogram{};
    int iterations = 0;
  };
  PatchResult partition(const ConnectedOrder& order, size_t first, size_t last) const;
  void cut_regions(const Patch& patch, MeshletList& list) const;
  void add_meshlets(std::vector<uint32_t>& triangles, DiskCutter& cutter, MeshletList& list) const;
  std::vector<uint32_t> split_off_half(std::vector<uint32_t>& triangles) const;
  void keep_disks(const Disks& disks, DiskCutter& cutter, MeshletList& list) const;
  std::vector<std::vector<uint32_t>> sets_to_join(const MeshletList& list) const;
  MeshletList join_small(const MeshletList& list) const;
  void join(const MeshletList& list, const std::vector<uint32_t>& meshlets, DiskCutter& cutter,
            MeshletList& result) const;
  template <class Body>
  void for_meshlets(const MeshletList& list, Body&& body) const;
  std::vector<Contact> find_contacts(const MeshletList& list) const;
  std::vector<Load> measure_loads(const MeshletList& list) const;
  Meshlets join_patches(const std::vector<PatchResult>& results) const;

  const SpatialMesh& mesh_;
  const HalfEdges& half_edges_;
  const GenerationOptions& options_;
};

Meshlets Generator::run() {
  std::vector<PatchResult> results;
  {
    const ConnectedOrder order = order_by_component(half_edges_, options_.threads);
    const size_t count = order.triangles.size(), patches = (count + kPatchSize - 1) / kPatchSize;
    results.resize(patches);
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<size_t> done{0};
    parallel_for(options_.threads, patches, [&](size_t p) {
      results[p] = partition(order, count * p / patches, count * (p + 1) / patches);
      done++;
      if (options_.progress && std::this_thread::get_id() == caller)
        options_.progress(float(done) / float(patches + 1));
    });
  }
  Meshlets meshlets = join_patches(results);
  if (options_.progress) options_.progress(1.0f);
  return meshlets;
}

Generator::PatchResult Generator::partition(const ConnectedOrder& order, size_t first,
                                            size_t last) const {
  // Regions end at seams, whose vertices are doubled anyway. Joining small regions across seams
  // later compresses better than regions that cross seams and are cut into disks.
  Patch patch = extract_patch(mesh_, half_edges_, order, first, last);
  PatchResult result;
  const float mean = std::max(1.0f, options_.fill * float(options_.max_triangles));
  const Schedule schedule = schedule_of(options_.effort);
  result.iterations =
      grow_regions(patch, {mean, options_.max_triangles - 1, options_.lambda, options_.weight,
                           schedule.rounds, schedule.cycles, schedule.sweeps, schedule.mends});
  std::vector<uint32_t> sizes(size_t(patch.region_count), 0);
  for (const int32_t region : patch.region) ++sizes[region];
  for (const uint32_t size : sizes)
    ++result.histogram[size < 32 ? 0 : size < 64 ? 1 : size < 72 ? 2 : 3];
  refine_regions(patch,
                 {options_.max_triangles, schedule.refinement_sweeps, schedule.max_failures});
  cut_regions(patch, result.list);
  return result;
}

void Generator::cut_regions(const Patch& patch, MeshletList& list) const {
  // end[r + 1] first counts region r, then is its begin, and after filling its end.
  std::vector<uint32_t> end(size_t(patch.region_count) + 2, 0), sorted(patch.size());
  for (const int32_t region : patch.region) ++end[size_t(region) + 2];
  for (size_t r = 2; r < end.size(); r++) end[r] += end[r - 1];
  for (size_t t = 0; t < patch.size(); t++)
    sorted[end[size_t(patch.region[t]) + 1]++] = patch.triangles[t];
  DiskCutter cutter(mesh_.triangles.data(), half_edges_);
  std::vector<uint32_t> region;
  for (size_t r = 0; r < size_t(patch.region_count); r++) {
    region.assign(sorted.begin() + end[r], sorted.begin() + end[r + 1]);
    add_meshlets(region, cutter, list);
  }
}

// Adds the triangles as one meshlet, or as several if one would exceed the limits.
void Generator::add_meshlets(std::vector<uint32_t>& triangles, DiskCutter& cutter,
                             MeshletList& list) const {
  if (triangles.empty()) return;
  if (triangles.size() <= size_t(options_.max_triangles)) {
    Disks disks;
    cutter.cut(triangles.data(), triangles.size(), disks);
    if (disks.vertex_count <= size_t(options_.max_vertices)) return list.append_meshlet(disks);
    if (disks.count() > 1) return keep_disks(disks, cutter, list);
  }
  std::vector<uint32_t> half = split_off_half(triangles);
  add_meshlets(triangles, cutter, list);
  add_meshlets(half, cutter, list);
}

// Adds a meshlet of the disks that fit together, largest first, then the other disks.
void Generator::keep_disks(const Disks& disks, DiskCutter& cutter, MeshletList& list) const {
  std::vector<uint32_t> by_size(disks.count());
  for (uint32_t k = 0; k < by_size.size(); k++) by_size[k] = k;
  std::stable_sort(by_size.begin(), by_size.end(), [&](uint32_t a, uint32_t b) {
    return disks.begin[a + 1] - disks.begin[a] > disks.begin[b + 1] - disks.begin[b];
  });
  std::vector<uint32_t> kept, others;
  size_t vertices = 0;
  for (const uint32_t k : by_size) {
    const bool fits = kept.empty() || vertices + disks.vertices[k] <= size_t(options_.max_vertices);
    if (fits) vertices += disks.vertices[k];
    std::vector<uint32_t>& chosen = fits ? kept : others;
    chosen.insert(chosen.end(), disks.triangles.begin() + disks.begin[k],
                  disks.triangles.begin() + disks.begin[k + 1]);
  }
  add_meshlets(kept, cutter, list);
  add_meshlets(others, cutter, list);
}

// Removes and returns half of the triangles: those nearest to the one farthest from the centre.
std::vector<uint32_t> Generator::split_off_half(std::vector<uint32_t>& triangles) const {
  Vec3 centre{0, 0, 0};
  for (const uint32_t t : triangles) centre = centre + mesh_.centre(t);
  centre = centre * (1.0f / float(triangles.size()));
  const auto distance = [&](uint32_t t, Vec3 from) {
    return dot(mesh_.centre(t) - from, mesh_.centre(t) - from);
  };
  uint32_t pole = triangles[0];
  for (const uint32_t t : triangles)
    if (distance(t, centre) > distance(pole, centre)) pole = t;
  const Vec3 end = mesh_.centre(pole);
  std::sort(triangles.begin(), triangles.end(), [&](uint32_t a, uint32_t b) {
    const float da = distance(a, end), db = distance(b, end);
    return da != db ? da < db : a < b;
  });
  const auto middle = triangles.begin() + std::ptrdiff_t(triangles.size() / 2);
  std::vector<uint32_t> half(triangles.begin(), middle);
  triangles.erase(triangles.begin(), middle);
  return half;
}

// Calls body(block, meshlet) for every meshlet.
template <class Body>
void Generator::for_meshlets(const MeshletList& list, Body&& body) const {
  for_blocks(options_.threads, list.count(), kBlock, [&](size_t b, size_t first, size_t last) {
    for (size_t m = first; m < last; m++) body(b, uint32_t(m));
  });
}

std::vector<Contact> Generator::find_contacts(const MeshletList& list) const {
  Array<uint32_t> meshlet_of(mesh_.triangle_count());
  for_meshlets(list, [&](size_t, uint32_t m) {
    for (uint32_t i = list.first_triangle(m); i < list.first_triangle(m + 1); i++)
      meshlet_of[list.triangles[i]] = m;
  });
  std::vector<std::vector<Contact>> found(block_count(list.count(), kBlock));
  for_meshlets(list, [&](size_t block, uint32_t m) {
    std::vector<Contact>& contacts = found[block];
    const size_t begin = contacts.size();
    for (uint32_t i = list.first_triangle(m); i < list.first_triangle(m + 1); i++)
      for (size_t h = 3 * size_t(list.triangles[i]); h < 3 * size_t(list.triangles[i]) + 3; h++) {
        const int32_t other = half_edges_.by_position(h);
        const uint32_t b = other < 0 ? m : meshlet_of[size_t(other) / 3];
        if (b <= m) continue;
        const uint32_t weight = half_edges_.by_vertex(h) >= 0 ? kInnerEdgeWeight : kSeamWeight;
        size_t at = begin;
        while (at < contacts.size() && contacts[at].b != b) at++;
        if (at == contacts.size()) contacts.push_back({m, b, 0});
        contacts[at].weight += weight;
      }
    std::sort(contacts.begin() + std::ptrdiff_t(begin), contacts.end(),
              [](const Contact& x, const Contact& y) { return x.b < y.b; });
  });
  std::vector<Contact> contacts;
  for (const std::vector<Contact>& block : found)
    contacts.insert(contacts.end(), block.begin(), block.end());
  return contacts;
}

std::vector<Load> Generator::measure_loads(const MeshletList& list) const {
  std::vector<Load> loads(list.count());
  for_meshlets(list, [&](size_t, uint32_t m) {
    const uint32_t first = list.first_triangle(m), last = list.first_triangle(m + 1);
    Vec3 low = mesh_.centre(list.triangles[first]), high = low;
    for (uint32_t i = first; i < last; i++) {
      low = minimum(low, mesh_.centre(list.triangles[i]));
      high = maximum(high, mesh_.centre(list.triangles[i]));
    }
    loads[m] = {last - first, list.vertices[m], to_grid(low), to_grid(high)};
  });
  return loads;
}

// Sets of meshlets to join, in an order that gives neighbours close numbers.
std::vector<std::vector<uint32_t>> Generator::sets_to_join(const MeshletList& list) const {
  const std::vector<Contact> contacts = find_contacts(list);
  const Array<uint32_t> curve_order =
      order_along_curve(list.count(), options_.threads, [&](size_t m) {
        return mesh_.centre(list.triangles[list.first_triangle(uint32_t(m))]) * kCurveCells;
      });
  const std::vector<uint32_t> set_of =
      join_meshlets(measure_loads(list), contacts, curve_order, uint32_t(options_.max_triangles),
                    uint32_t(options_.max_vertices), options_.max_spread);

  const uint32_t count = *std::max_element(set_of.begin(), set_of.end()) + 1;
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  for (const Contact& contact : contacts)
    if (set_of[contact.a] != set_of[contact.b])
      edges.emplace_back(set_of[contact.a], set_of[contact.b]);
  const std::vector<uint32_t> order = cuthill_mckee(build_graph(count, edges));

  std::vector<uint32_t> place(count);
  for (uint32_t i = 0; i < count; i++) place[order[i]] = i;
  std::vector<std::vector<uint32_t>> sets(count);
  for (uint32_t m = 0; m < list.count(); m++) sets[place[set_of[m]]].push_back(m);
  return sets;
}

// Joins meshlets that fit into one.
MeshletList Generator::join_small(const MeshletList& list) const {
  const std::vector<std::vector<uint32_t>> sets = sets_to_join(list);
  std::vector<MeshletList> blocks(block_count(sets.size(), kBlock));
  for_blocks(options_.threads, sets.size(), kBlock, [&](size_t b, size_t first, size_t last) {
    DiskCutter cutter(mesh_.triangles.data(), half_edges_);
    for (size_t s = first; s < last; s++) join(list, sets[s], cutter, blocks[b]);
  });
  MeshletList joined;
  for (const MeshletList& block : blocks) joined.append(block);
  return joined;
}

// Cuts the triangles of these meshlets into disks again: disks then grow across former borders.
void Generator::join(const MeshletList& list, const std::vector<uint32_t>& meshlets,
                     DiskCutter& cutter, MeshletList& result) const {
  if (meshlets.size() == 1) return result.append_joined(list, meshlets);
  std::vector<uint32_t> triangles;
  for (const uint32_t m : meshlets)
    triangles.insert(triangles.end(), list.triangles.begin() + list.first_triangle(m),
                     list.triangles.begin() + list.first_triangle(m + 1));
  Disks disks;
  cutter.cut(triangles.data(), triangles.size(), disks);
  // In rare cases the new cut has more boundary vertices than the old ones together.
  if (disks.vertex_count > size_t(options_.max_vertices))
    result.append_joined(list, meshlets);
  else
    result.append_meshlet(disks);
}

Meshlets Generator::join_patches(const std::vector<PatchResult>& results) const {
  Meshlets meshlets;
  for (const PatchResult& result : results) {
    meshlets.append(result.list);
    for (size_t i = 0; i < 4; i++) meshlets.histogram[i] += result.histogram[i];
    meshlets.iterations_run = std::max(meshlets.iterations_run, result.iterations);
  }
  static_cast<MeshletList&>(meshlets) = join_small(meshlets);
  return meshlets;
}

}  // namespace

Meshlets generate_meshlets(const SpatialMesh& mesh, const HalfEdges& half_edges,
                           const GenerationOptions& options) {
  return Generator(mesh, half_edges, options).run();
}

}  // namespace gltf_meshlet_codec
