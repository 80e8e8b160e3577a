#include "meshlet_generation.h"

#include <algorithm>
#include <array>

#include "cluster.h"
#include "half_edges.h"
#include "ordering.h"
#include "packing.h"
#include "parallel.h"
#include "patches.h"
#include "region_growing.h"
#include "region_refinement.h"

namespace meshlet {
namespace {

// Triangles per patch: enough for some hundred regions, few enough to stay in a core's own cache.
constexpr size_t patch_size = 1 << 15;

constexpr int refinement_sweeps = 4;

// How much it is worth to join two meshlets, per edge between them: one that is inside a disk afterwards, or a seam
// that stays.
constexpr uint32_t inner_edge_weight = 4, seam_weight = 1;

// Meshlets per parallel task when they are put together.
constexpr size_t joined_per_part = 256;

// Some meshlets, laid out as in Meshlets.
struct Piece {
    std::vector<uint32_t> triangles;
    std::vector<uint32_t> component_begin{0};
    std::vector<uint32_t> meshlet_begin{0};
    std::vector<uint32_t> vertices;  // of each meshlet

    uint32_t count() const { return static_cast<uint32_t>(vertices.size()); }
    uint32_t first_triangle(uint32_t meshlet) const { return component_begin[meshlet_begin[meshlet]]; }
    void append(const Piece& other);
};

void Piece::append(const Piece& other) {
    const uint32_t base = static_cast<uint32_t>(triangles.size());
    const uint32_t components = static_cast<uint32_t>(component_begin.size() - 1);
    triangles.insert(triangles.end(), other.triangles.begin(), other.triangles.end());
    vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
    for (size_t k = 1; k < other.component_begin.size(); ++k) component_begin.push_back(base + other.component_begin[k]);
    for (size_t m = 1; m < other.meshlet_begin.size(); ++m) meshlet_begin.push_back(components + other.meshlet_begin[m]);
}

void append_meshlet(const Disks& disks, Piece& piece) {
    const uint32_t base = static_cast<uint32_t>(piece.triangles.size());
    piece.triangles.insert(piece.triangles.end(), disks.triangles.begin(), disks.triangles.end());
    for (size_t k = 1; k < disks.begin.size(); ++k) piece.component_begin.push_back(base + disks.begin[k]);
    piece.meshlet_begin.push_back(static_cast<uint32_t>(piece.component_begin.size() - 1));
    piece.vertices.push_back(static_cast<uint32_t>(disks.vertex_count));
}

// Adds one meshlet that consists of the components of those members of `from`.
void append_as_they_are(const Piece& from, const std::vector<uint32_t>& members, Piece& piece) {
    piece.vertices.push_back(0);
    for (const uint32_t m : members) {
        piece.vertices.back() += from.vertices[m];
        for (uint32_t k = from.meshlet_begin[m]; k < from.meshlet_begin[m + 1]; ++k) {
            piece.triangles.insert(piece.triangles.end(), from.triangles.begin() + from.component_begin[k],
                                   from.triangles.begin() + from.component_begin[k + 1]);
            piece.component_begin.push_back(static_cast<uint32_t>(piece.triangles.size()));
        }
    }
    piece.meshlet_begin.push_back(static_cast<uint32_t>(piece.component_begin.size() - 1));
}

class Generator {
  public:
    Generator(const MeshView& mesh, const GenerationOptions& options)
        : mesh_(mesh),
          options_(options),
          by_vertex_(match_half_edges(mesh.triangles, mesh.triangle_count, nullptr, mesh.vertex_count,
                                      options.threads)),
          by_position_(match_half_edges(mesh.triangles, mesh.triangle_count, mesh.position_ids, mesh.vertex_count,
                                        options.threads)),
          shapes_(measure_triangles(mesh, options.threads)) {}

    Meshlets run();

  private:
    struct PatchResult {
        Piece piece;
        std::array<uint32_t, 4> histogram{};
        int iterations = 0;
    };
    PatchResult partition(size_t first, size_t last) const;
    void add_meshlets(std::vector<uint32_t>& triangles, DiskCutter& cutter, Piece& piece) const;
    std::vector<uint32_t> split_off_half(std::vector<uint32_t>& triangles) const;
    void keep_disks(const Disks& disks, DiskCutter& cutter, Piece& piece) const;
    Piece join_small(const Piece& piece) const;
    std::vector<Contact> find_contacts(const Piece& piece) const;
    std::vector<Load> measure_loads(const Piece& piece) const;
    Meshlets assemble(const std::vector<PatchResult>& results) const;

    const MeshView mesh_;
    const GenerationOptions& options_;
    std::vector<int32_t> by_vertex_, by_position_;
    TriangleShapes shapes_;
    std::vector<uint32_t> order_, slot_;
};

Meshlets Generator::run() {
    order_ = order_along_curve(shapes_.centres, options_.threads);
    group_components(by_position_, order_);
    slot_.resize(order_.size());
    for (size_t i = 0; i < order_.size(); ++i) slot_[order_[i]] = static_cast<uint32_t>(i);
    const size_t patches = (order_.size() + patch_size - 1) / patch_size;
    std::vector<PatchResult> results(patches);
    parallel_for(options_.threads, patches, [&](size_t p) {
        results[p] = partition(order_.size() * p / patches, order_.size() * (p + 1) / patches);
    });
    return assemble(results);
}

Generator::PatchResult Generator::partition(size_t first, size_t last) const {
    Patch patch = extract_patch(order_, first, last, slot_, by_position_, by_vertex_, shapes_);
    PatchResult result;
    const float mean = std::max(1.0f, options_.fill * static_cast<float>(options_.max_triangles));
    result.iterations = grow_regions(
        patch, {mean, options_.max_triangles - 1, options_.lambda, options_.weight, options_.iterations});
    std::vector<uint32_t> sizes(static_cast<size_t>(patch.region_count), 0);
    for (const int32_t region : patch.region) ++sizes[region];
    for (const uint32_t size : sizes) ++result.histogram[size < 32 ? 0 : size < 64 ? 1 : size < 72 ? 2 : 3];
    refine_regions(patch, {options_.max_triangles, refinement_sweeps});
    std::vector<std::vector<uint32_t>> regions(static_cast<size_t>(patch.region_count));
    for (size_t t = 0; t < patch.size(); ++t) regions[patch.region[t]].push_back(patch.triangles[t]);
    DiskCutter cutter(mesh_.triangles, by_vertex_.data());
    for (std::vector<uint32_t>& region : regions) {
        add_meshlets(region, cutter, result.piece);
    }
    return result;
}

// Adds the triangles as one meshlet, or as several where that would exceed the limits.
void Generator::add_meshlets(std::vector<uint32_t>& triangles, DiskCutter& cutter, Piece& piece) const {
    if (triangles.empty()) return;
    if (triangles.size() <= static_cast<size_t>(options_.max_triangles)) {
        Disks disks;
        cutter.cut(triangles.data(), triangles.size(), disks);
        if (disks.vertex_count <= static_cast<size_t>(options_.max_vertices)) return append_meshlet(disks, piece);
        if (disks.count() > 1) return keep_disks(disks, cutter, piece);
    }
    std::vector<uint32_t> half = split_off_half(triangles);
    add_meshlets(triangles, cutter, piece);
    add_meshlets(half, cutter, piece);
}

// Adds a meshlet of disks that fit together, the largest first, and then the others.
void Generator::keep_disks(const Disks& disks, DiskCutter& cutter, Piece& piece) const {
    std::vector<uint32_t> by_size(disks.count());
    for (uint32_t k = 0; k < by_size.size(); ++k) by_size[k] = k;
    std::stable_sort(by_size.begin(), by_size.end(), [&](uint32_t a, uint32_t b) {
        return disks.begin[a + 1] - disks.begin[a] > disks.begin[b + 1] - disks.begin[b];
    });
    std::vector<uint32_t> kept, others;
    size_t vertices = 0;
    for (const uint32_t k : by_size) {
        const bool fits = kept.empty() || vertices + disks.vertices[k] <= static_cast<size_t>(options_.max_vertices);
        if (fits) vertices += disks.vertices[k];
        std::vector<uint32_t>& part = fits ? kept : others;
        part.insert(part.end(), disks.triangles.begin() + disks.begin[k], disks.triangles.begin() + disks.begin[k + 1]);
    }
    add_meshlets(kept, cutter, piece);
    add_meshlets(others, cutter, piece);
}

// Removes the half of the triangles that is nearest to the one farthest from their common centre.
std::vector<uint32_t> Generator::split_off_half(std::vector<uint32_t>& triangles) const {
    Vec3 centre{0, 0, 0};
    for (const uint32_t t : triangles) centre = centre + shapes_.centres[t];
    centre = centre * (1.0f / static_cast<float>(triangles.size()));
    const auto distance = [&](uint32_t t, Vec3 from) {
        return dot(shapes_.centres[t] - from, shapes_.centres[t] - from);
    };
    uint32_t pole = triangles[0];
    for (const uint32_t t : triangles)
        if (distance(t, centre) > distance(pole, centre)) pole = t;
    const Vec3 end = shapes_.centres[pole];
    std::sort(triangles.begin(), triangles.end(), [&](uint32_t a, uint32_t b) {
        const float da = distance(a, end), db = distance(b, end);
        return da != db ? da < db : a < b;
    });
    const auto middle = triangles.begin() + static_cast<std::ptrdiff_t>(triangles.size() / 2);
    std::vector<uint32_t> half(triangles.begin(), middle);
    triangles.erase(triangles.begin(), middle);
    return half;
}

std::vector<Contact> Generator::find_contacts(const Piece& piece) const {
    std::vector<uint32_t> meshlet_of(mesh_.triangle_count);
    for (uint32_t m = 0; m < piece.count(); ++m)
        for (uint32_t i = piece.first_triangle(m); i < piece.first_triangle(m + 1); ++i)
            meshlet_of[piece.triangles[i]] = m;
    std::vector<Contact> contacts;
    for (size_t h = 0; h < by_position_.size(); ++h) {
        if (by_position_[h] < 0) continue;
        const uint32_t a = meshlet_of[h / 3], b = meshlet_of[static_cast<size_t>(by_position_[h]) / 3];
        if (a < b) contacts.push_back({a, b, by_vertex_[h] >= 0 ? inner_edge_weight : seam_weight});
    }
    std::sort(contacts.begin(), contacts.end(), [](const Contact& x, const Contact& y) {
        return x.a != y.a ? x.a < y.a : x.b != y.b ? x.b < y.b : x.weight < y.weight;
    });
    size_t count = 0;
    for (const Contact& contact : contacts) {
        if (count > 0 && contacts[count - 1].a == contact.a && contacts[count - 1].b == contact.b)
            contacts[count - 1].weight += contact.weight;
        else
            contacts[count++] = contact;
    }
    contacts.resize(count);
    return contacts;
}

std::vector<Load> Generator::measure_loads(const Piece& piece) const {
    std::vector<Load> loads;
    for (uint32_t m = 0; m < piece.count(); ++m)
        loads.push_back({piece.first_triangle(m + 1) - piece.first_triangle(m), piece.vertices[m]});
    return loads;
}

// Joins meshlets that fit into one, and numbers the result so that neighbours are close.
Piece Generator::join_small(const Piece& piece) const {
    std::vector<Contact> contacts = find_contacts(piece);
    std::vector<Vec3> centres;
    for (uint32_t m = 0; m < piece.count(); ++m)
        centres.push_back(shapes_.centres[piece.triangles[piece.first_triangle(m)]]);
    const Load limit{static_cast<uint32_t>(options_.max_triangles), static_cast<uint32_t>(options_.max_vertices)};
    const std::vector<uint32_t> group =
        pack_meshlets(measure_loads(piece), contacts, order_along_curve(centres, options_.threads), limit);

    const uint32_t count = *std::max_element(group.begin(), group.end()) + 1;
    std::vector<std::pair<uint32_t, uint32_t>> edges;
    for (const Contact& contact : contacts)
        if (group[contact.a] != group[contact.b]) edges.emplace_back(group[contact.a], group[contact.b]);
    const std::vector<uint32_t> order = cuthill_mckee(build_graph(count, edges));

    std::vector<std::vector<uint32_t>> members(count);
    for (uint32_t m = 0; m < piece.count(); ++m) members[group[m]].push_back(m);
    const size_t parts = (count + joined_per_part - 1) / joined_per_part;
    std::vector<Piece> results(parts);
    parallel_for(options_.threads, parts, [&](size_t part) {
        DiskCutter cutter(mesh_.triangles, by_vertex_.data());
        Disks disks;
        std::vector<uint32_t> triangles;
        for (size_t i = part * joined_per_part; i < std::min<size_t>(count, (part + 1) * joined_per_part); ++i) {
            triangles.clear();
            for (const uint32_t m : members[order[i]])
                triangles.insert(triangles.end(), piece.triangles.begin() + piece.first_triangle(m),
                                 piece.triangles.begin() + piece.first_triangle(m + 1));
            cutter.cut(triangles.data(), triangles.size(), disks);
            // Disks that grow across former borders rarely, but may, leave more vertices on boundaries.
            if (disks.vertex_count > limit.vertices)
                append_as_they_are(piece, members[order[i]], results[part]);
            else
                append_meshlet(disks, results[part]);
        }
    });
    Piece joined;
    for (const Piece& result : results) joined.append(result);
    return joined;
}

Meshlets Generator::assemble(const std::vector<PatchResult>& results) const {
    Meshlets meshlets{{}, {}, {}, {0, 0, 0, 0}, 0};
    Piece all;
    for (const PatchResult& result : results) {
        all.append(result.piece);
        for (size_t i = 0; i < 4; ++i) meshlets.histogram[i] += result.histogram[i];
        meshlets.iterations_run = std::max(meshlets.iterations_run, result.iterations);
    }
    all = join_small(all);
    meshlets.triangles = std::move(all.triangles);
    meshlets.component_begin = std::move(all.component_begin);
    meshlets.meshlet_begin = std::move(all.meshlet_begin);
    return meshlets;
}

}  // namespace

Meshlets generate_meshlets(const MeshView& mesh, const GenerationOptions& options) {
    return Generator(mesh, options).run();
}

}  // namespace meshlet
