// The part of the C interface that builds levels of detail, and measures distances.
#include "c/encoder_input.h"
#include "common/parallel.h"
#include "lod/level_pages.h"
#include "lod/nearest_weights.h"
#include "lod/surface_distance.h"

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kPointsAtOnce = 1024;
constexpr uint64_t kMostAttributes = 32;  // meshoptimizer checks nothing
// With more, the error expected of a small surface would round to 0, which never doubles.
constexpr double kMostReduction = 1e6;

template <class Function>
Function function_of(void (*address)(void)) {
  return reinterpret_cast<Function>(address);
}

Simplifier simplifier_of(const gltf_meshlet_simplifier* from) {
  const gltf_meshlet_simplifier s = taken(from);
  require(s.simplify && s.partition, kNull);
  return {function_of<decltype(Simplifier::simplify)>(s.simplify),
          function_of<decltype(Simplifier::simplify_guarded)>(s.simplify_guarded),
          function_of<decltype(Simplifier::partition)>(s.partition)};
}

void check_floats(const float* floats, uint64_t count) {
  require(floats || count == 0, kNull);
  for (uint64_t i = 0; i < count; i++) require(std::isfinite(floats[i]), "a number is not finite");
}

std::vector<double> sphere_columns(const std::vector<Sphere>& spheres) {
  std::vector<double> all;
  for (const Sphere& s : spheres)
    all.insert(all.end(), {s.centre.x, s.centre.y, s.centre.z, s.radius});
  return all;
}

// What is known of each cluster, or group, as an array.
template <class T, class Item, class Get>
std::vector<T> column(const std::vector<Item>& items, const Get& get) {
  std::vector<T> values;
  for (const Item& item : items) values.push_back(get(item));
  return values;
}

// The arguments of build_levels. Borrows the caller's arrays.
struct LevelsInput {
  const gltf_meshlet_levels_input in;
  const gltf_meshlet_mesh mesh;
  std::vector<Stream> streams;
  VertexValues values;
  Simplifier simplifier;
  Surface surface;
  VertexChoices choices;
  ClusterSet given;
  LevelOptions options;
  size_t page_bytes;

  LevelsInput(const gltf_meshlet_levels_input* input, const gltf_meshlet_options* encoding);
  LevelsInput(const LevelsInput&) = delete;

 private:
  void take_surface();
  void take_choices();
  void take_given();
  void check_canonical_vertices() const;
  void check_places() const;
};

std::vector<uint64_t> triangles_of_levels(const Levels& levels) {
  std::vector<uint64_t> triangles;
  for (size_t c = 0; c < levels.cluster_group.size(); c++) {
    const uint32_t level = levels.groups[levels.cluster_group[c]].level;
    if (level >= triangles.size()) triangles.resize(size_t(level) + 1);
    triangles[level] += levels.grouped.ranges.size(c);
  }
  return triangles;
}

std::vector<uint32_t> page_table(const std::vector<EncodedPage>& pages) {
  std::vector<uint32_t> table;
  for (const EncodedPage& p : pages)
    table.insert(table.end(),
                 {uint32_t(p.blob.size()), uint32_t(p.groups.size()), p.triangles, p.vertices});
  return table;
}

std::vector<uint32_t> page_groups(const LevelPages& pages) {
  std::vector<uint32_t> all;
  for (const auto* list : {&pages.coarse, &pages.fine})
    for (const EncodedPage& p : *list) all.insert(all.end(), p.groups.begin(), p.groups.end());
  return all;
}

Bytes page_bytes(const LevelPages& pages) {
  Bytes all;
  for (const auto* list : {&pages.coarse, &pages.fine})
    for (const EncodedPage& p : *list) all.insert(all.end(), p.blob.begin(), p.blob.end());
  return all;
}

const auto finer_group_of = [](const Cluster& c) { return c.finer_group; };
const auto sphere_of = [](const auto& item) { return item.sphere; };
const auto error_of = [](const auto& item) { return item.error; };

LevelsInput::LevelsInput(const gltf_meshlet_levels_input* input,
                         const gltf_meshlet_options* encoding)
    : in(taken(input)), mesh(taken(in.mesh)) {
  const gltf_meshlet_options all = known(encoding);
  options.generation = options_of(all);
  page_bytes = size_t(all.page_bytes);
  require(mesh.triangle_count >= 1 && mesh.triangle_count < (1u << 31) / 3,
          "there are no triangles, or too many");
  require(mesh.vertex_count < 1u << 31, "there are too many vertices");
  const MeshView view = mesh_of(mesh, mesh.triangles, mesh.triangle_count);
  streams = streams_of(mesh);
  check_input(view, streams);  // before values are read by the streams' elements
  values = values_of(mesh, streams);
  simplifier = simplifier_of(in.simplifier);
  take_surface();
  take_choices();
  take_given();
  require(in.group_size >= 1 && in.group_size <= kMostClusters, "a group holds 1 to 255 clusters");
  require(in.reduction >= 1 && in.reduction <= kMostReduction,
          "the reduction is below 1 or above a million");
  require(in.first_group <= kMostGroups && in.level <= kMostGroups, "there are too many groups");
  require(in.chunk <= GLTF_MESHLET_LAST_LEVEL, "the kind of chunk is unknown");
  options.group_size = in.group_size;
  options.reduction = in.reduction;
  options.error_limit = in.error_limit;
  options.level = in.level;
  options.first_group = in.first_group;
  options.builds_all = in.chunk == GLTF_MESHLET_ALL_LEVELS;
  options.must_end = in.chunk == GLTF_MESHLET_LAST_LEVEL;
}

void LevelsInput::check_canonical_vertices() const {
  require(in.canonical_vertices, kNull);
  for (uint64_t v = 0; v < mesh.vertex_count; v++) {
    const uint32_t other = in.canonical_vertices[v];
    require(other < mesh.vertex_count, "a canonical vertex is out of range");
    require(mesh.position_ids[other] == mesh.position_ids[v],
            "a canonical vertex has another position");
  }
}

// Vertices of one place have one position: a triangle would get two equal corners.
void LevelsInput::check_places() const {
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> position(size_t(mesh.vertex_count), kNone);  // of each place
  for (uint64_t v = 0; v < mesh.vertex_count; v++) {
    const uint32_t place = in.places[v];
    require(place < mesh.vertex_count, "a place is out of range");
    require(position[place] == kNone || position[place] == mesh.position_ids[v],
            "vertices of one place have different positions");
    position[place] = mesh.position_ids[v];
  }
}

void LevelsInput::take_surface() {
  const auto vertices = size_t(mesh.vertex_count);
  check_canonical_vertices();
  check_position_ids(mesh, in.source_position_ids);
  check_points(in.seam_points, vertices);
  require(in.attribute_count <= kMostAttributes, "there are too many attributes");
  check_floats(in.attributes, in.attribute_count * vertices);
  check_floats(in.weights, in.attribute_count);
  require(in.shapes || in.shape_count == 0, kNull);
  surface.triangles = mesh.triangles;
  surface.triangle_count = size_t(mesh.triangle_count);
  surface.vertex_count = vertices;
  surface.points = mesh.positions;
  surface.position_ids = mesh.position_ids;
  surface.canonical_vertices = in.canonical_vertices;
  surface.seam_points = in.seam_points;
  surface.attributes = in.attributes;
  surface.weights = in.weights;
  surface.attribute_count = size_t(in.attribute_count);
  surface.shapes = {mesh.positions};
  for (uint32_t s = 0; s < in.shape_count; s++) {
    check_points(in.shapes[s], vertices);
    surface.shapes.push_back(in.shapes[s]);
  }
  surface.locked = in.locked;
  surface.vertex_of_position = first_vertices(mesh.position_ids, vertices);
}

void LevelsInput::take_choices() {
  surface.choices = nullptr;
  if (!in.places) return;
  check_places();
  check_points(in.normals, mesh.vertex_count);
  require(in.other_count <= 4 * BLOB_MAX_STREAMS, "there are too many attributes");
  check_floats(in.others, in.other_count * mesh.vertex_count);
  choices.places = in.places;
  choices.normals = in.normals;
  choices.others = in.others;
  choices.other_count = size_t(in.other_count);
  choices.canonical_vertices = in.canonical_vertices;
  choices.fill(mesh.triangles, 3 * surface.triangle_count, surface.vertex_count);
  surface.choices = &choices;
}

void LevelsInput::take_given() {
  require((mesh.meshlet_begin != nullptr) == (in.level > 0),
          "clusters belong to level 1 or coarser, and level 0 is made of triangles");
  if (!mesh.meshlet_begin) return require(!mesh.disk_begin, kNull);
  ClusterRanges& ranges = given.ranges;
  ranges.triangles = vector_of(mesh.triangles, 3 * mesh.triangle_count);
  ranges.disk_begin = vector_of(mesh.disk_begin, mesh.disk_begin_count);
  ranges.cluster_begin = vector_of(mesh.meshlet_begin, mesh.meshlet_begin_count);
  require(are_begins(ranges.disk_begin, surface.triangle_count) &&
              are_begins(ranges.cluster_begin, ranges.disk_begin.size() - 1),
          "begins do not increase from 0 to the number of triangles");
  require(in.finer_groups && in.errors && in.spheres, kNull);
  for (size_t c = 0; c < ranges.count(); c++) {
    const double* s = in.spheres + 4 * c;
    const double error = in.errors[c];
    require(std::isfinite(s[0] + s[1] + s[2] + s[3] + error) && s[3] >= 0 && error >= 0,
            "a sphere or an error is not finite or negative");
    require(in.finer_groups[c] >= 0 && size_t(in.finer_groups[c]) < kMostGroups,
            "a finer group is out of range");
    given.clusters.push_back({in.finer_groups[c], error, error, {{s[0], s[1], s[2]}, s[3]}});
  }
}

}  // namespace
}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_build_levels(const gltf_meshlet_levels_input* input,
                              const gltf_meshlet_options* options,
                              gltf_meshlet_statistics* statistics, gltf_meshlet_result** result) {
  return guarded([&] {
    require(result, kNull);
    *result = nullptr;
    require(!statistics || has_size(statistics), kWrongSize);
    const LevelsInput in(input, options);
    const PagePilot pilot{in.surface, in.streams, in.values, in.page_bytes};
    const EncodedLevels all = build_and_encode(
        in.surface, in.given, pilot, in.in.source_position_ids, in.simplifier, in.options);
    const Levels& built = all.levels;
    const ClusterRanges& waiting = built.waiting.ranges;
    const auto &clusters = built.grouped.clusters, &others = built.waiting.clusters;
    give_statistics(all.pages.fine_stats, statistics);
    return open_object<Result>(
        result, built.cluster_group, column<int32_t>(clusters, finer_group_of),
        column<uint32_t>(built.groups, [](const ClusterGroup& g) { return g.level; }),
        column<double>(built.groups, error_of),
        sphere_columns(column<Sphere>(built.groups, sphere_of)), waiting.triangles,
        waiting.disk_begin, waiting.cluster_begin, column<int32_t>(others, finer_group_of),
        column<double>(others, error_of), sphere_columns(column<Sphere>(others, sphere_of)),
        built.stuck_triangles, triangles_of_levels(built), page_table(all.pages.coarse),
        page_table(all.pages.fine), page_groups(all.pages), page_bytes(all.pages));
  });
}

int gltf_meshlet_get_distances(const float* points, size_t point_count,
                               const gltf_meshlet_groups* triangles, const float* positions,
                               uint64_t vertex_count, float enough, int32_t threads,
                               float* distances, uint32_t* nearest) {
  return guarded([&] {
    require(distances || point_count == 0, kNull);
    require(threads >= 0, kThreads);
    check_points(points, point_count);
    check_points(positions, vertex_count);
    const GroupTriangles surface = groups_of(triangles, vertex_count, false);
    const TriangleTree tree(positions, surface.triangles, surface.begin, thread_count(threads));
    for_blocks(
        thread_count(threads), point_count, kPointsAtOnce, [&](size_t, size_t first, size_t last) {
          uint32_t hint = 0;
          for (size_t i = first; i < last; i++) {
            const float* p = points + 3 * i;
            const float squared = tree.squared_distance({p[0], p[1], p[2]}, hint, enough * enough);
            distances[i] = std::sqrt(squared);
            if (nearest) nearest[i] = tree.number(hint);
          }
        });
    return kOk;
  });
}

int gltf_meshlet_get_nearest_weights(const double* points, const double* corners, size_t count,
                                     double* weights) {
  return guarded([&] {
    require((points && corners && weights) || count == 0, kNull);
    const auto point = [](const double* p) { return Vec3d{p[0], p[1], p[2]}; };
    for (size_t i = 0; i < count; i++, points += 3, corners += 9, weights += 3) {
      const std::array<double, 3> w =
          nearest_weights(point(points), {point(corners), point(corners + 3), point(corners + 6)});
      std::copy(w.begin(), w.end(), weights);
    }
    return kOk;
  });
}
