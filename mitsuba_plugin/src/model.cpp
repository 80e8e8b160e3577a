#include "model.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace meshlet_shape {
namespace {

// Margin of boxes relative to the coordinates. Box traversal with fused multiply-adds errs by about
// epsilon times the coordinates; this covers ray origins a few scene sizes away.
constexpr float kRelativeMargin = 1.0f / (1 << 20);

float largest_coordinate(const Box& box) {
  float largest = 0;
  for (int i = 0; i < 3; i++)
    largest = std::max({largest, std::fabs(box.lower[i]), std::fabs(box.upper[i])});
  return largest;
}

Vec3 blend(const Vec3* v, const float* b) { return v[0] * b[0] + v[1] * b[1] + v[2] * b[2]; }

// Mitsuba's coordinate_system (Duff et al. 2017): without texture coordinates, tangents are those
// of its meshes.
void tangents(Vec3 n, float* s, float* t) {
  float sign = std::copysign(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  store({sign * n.x * n.x * a + 1.0f, sign * b, -sign * n.x}, s);
  store({b, n.y * n.y * a + sign, -n.y}, t);
}

// Returns the store of the cache group. It lives as long as a shape uses it.
std::shared_ptr<Store> store_for(const Options& options) {
  if (options.cache_group.empty()) return std::make_shared<Store>();
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Store>> groups;
  std::lock_guard lock(mutex);
  std::shared_ptr<Store> shared = groups[options.cache_group].lock();
  if (!shared) groups[options.cache_group] = shared = std::make_shared<Store>();
  return shared;
}

}  // namespace

Listings& listings() {
  static Listings all;
  return all;
}

Listing::Listing(const ModelFacts* facts_, Store* cache_)
    : facts(facts_), cache(cache_), id([] {
        static std::atomic<uint64_t> next{1};
        return next.fetch_add(1);
      }()) {
  std::lock_guard lock(listings().mutex);
  listings().by_id[id] = this;
}

Listing::~Listing() {
  std::lock_guard lock(listings().mutex);
  listings().by_id.erase(id);
}

// The machine's free memory, but no more than a container's limit; the largest number if unknown.
static uint64_t free_memory() {
  uint64_t bytes = std::numeric_limits<uint64_t>::max();
  std::ifstream file("/proc/meminfo");
  for (std::string name, unit; file >> name;) {
    uint64_t kilobytes = 0;
    if (!(file >> kilobytes)) break;
    if (name == "MemAvailable:") bytes = kilobytes * 1024;
    std::getline(file, unit);
  }
  for (const char* path :
       {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    uint64_t limit;
    if (std::ifstream(path) >> limit) bytes = std::min(bytes, limit);
  }
  return bytes;
}

bool fits_memory(uint64_t triangles) {
  constexpr uint64_t kBytes = 110;  // of a triangle, as measured
  return triangles <= free_memory() / 2 / kBytes;
}

ModelFacts check_primitives(std::vector<Primitive>& primitives) {
  if (primitives.empty()) throw std::runtime_error("there is no compressed primitive");
  ModelFacts facts;
  std::set<const Blob*> blobs;
  for (Primitive& primitive : primitives) {
    const PrimitiveFacts own = check_primitive(primitive);
    facts.meshlets += own.meshlets;
    facts.triangles += own.triangles;
    facts.vertices += own.vertices;
    if (blobs.insert(primitive.blob.get()).second)
      facts.compressed_bytes += primitive.blob->bytes.size();
  }
  if (facts.meshlets * kMeshletTriangles > std::numeric_limits<uint32_t>::max())
    throw std::runtime_error("there are too many meshlets");
  return facts;
}

Model::Model(std::vector<Primitive> primitives, const Options& options, const Parallel& parallel)
    : primitives_(std::move(primitives)), options_(options), box_(kEmptyBox) {
  facts_ = check_primitives(primitives_);
  first_meshlet_.push_back(0);
  for (const Primitive& primitive : primitives_)
    first_meshlet_.push_back(first_meshlet_.back() + primitive.meshlet_count());
  measure(parallel);
  std::shared_ptr<Store> store = store_for(options);
  uint64_t limit = options.cache_bytes >= 0
                       ? uint64_t(options.cache_bytes)
                       : uint64_t(std::ceil(options.cache_fraction * double(facts_.decoded_bytes)));
  table_ = std::make_unique<Table>(std::move(store), kEntryKinds * facts_.meshlets, limit);
  facts_.table_bytes =
      facts_.meshlets * (sizeof(Boxes) + sizeof(float) + kEntryKinds * sizeof(std::atomic<Entry*>));
  listing_ = std::make_unique<Listing>(&facts_, &table_->store());
}

void Model::measure(const Parallel& parallel) {
  constexpr uint32_t kPart = 64;
  std::vector<GroupBounds> bounds(facts_.meshlets);
  std::atomic<uint64_t> bytes{0};
  areas_.assign(facts_.meshlets, 0.0f);
  auto measure_one = [&](uint32_t m) {
    const Place place = place_of(m);
    uint32_t vertices;
    const Entry* entry = decode_whole(this_thread(), place.primitive, place.meshlet, vertices);
    const auto& triangles = *static_cast<const Triangles*>(entry->payload());
    bounds[m] = triangles.bounds();
    for (uint32_t t = 0; t < triangles.count; t++) {
      const Vec3 a = triangles.corner(t, 0);
      areas_[m] += 0.5f * length(cross(triangles.corner(t, 1) - a, triangles.corner(t, 2) - a));
    }
    const uint32_t width = place.primitive.width;
    bytes += entry->bytes + (width ? attributes_bytes(vertices, width) : 0);
  };
  const uint32_t count = uint32_t(facts_.meshlets);
  parallel((count + kPart - 1) / kPart, [&](size_t part) {
    const uint32_t first = uint32_t(part) * kPart;
    for (uint32_t m = first; m < std::min(first + kPart, count); m++) measure_one(m);
  });
  facts_.decoded_bytes = bytes;
  for (const GroupBounds& b : bounds)
    for (uint32_t g = 0; g < b.groups; g++) {
      expand(box_, {b.low[0][g], b.low[1][g], b.low[2][g]});
      expand(box_, {b.high[0][g], b.high[1][g], b.high[2][g]});
    }
  const float margin = largest_coordinate(box_) * kRelativeMargin;
  boxes_.reserve(count);
  for (const GroupBounds& b : bounds) boxes_.push_back(Boxes::around(b, margin));
}

Box Model::box(uint32_t meshlet) const {
  Box box;
  for (int i = 0; i < 3; i++) {
    box.lower[i] = boxes_[meshlet].bound(false, i);
    box.upper[i] = boxes_[meshlet].bound(true, i);
  }
  return box;
}

Model::Place Model::place_of(uint32_t meshlet) const {
  size_t p = size_t(std::upper_bound(first_meshlet_.begin(), first_meshlet_.end() - 1, meshlet) -
                    first_meshlet_.begin()) -
             1;
  return {primitives_[p], meshlet - first_meshlet_[p]};
}

const Triangles& Model::triangles(uint32_t meshlet, uint32_t rays) const {
  ThreadSlot& thread = this_thread();
  auto decode = [&] {
    const Place place = place_of(meshlet);
    return decode_triangles(thread, place.primitive, place.meshlet);
  };
  return *static_cast<const Triangles*>(
      table_->get(thread, kTriangles, kEntryKinds * meshlet + kTriangles, decode, rays));
}

const VertexAttributes& Model::vertex_attributes(uint32_t meshlet) const {
  ThreadSlot& thread = this_thread();
  auto decode = [&] {
    const Place place = place_of(meshlet);
    return decode_attributes(thread, place.primitive, place.meshlet);
  };
  return *static_cast<const VertexAttributes*>(
      table_->get(thread, kAttributes, kEntryKinds * meshlet + kAttributes, decode));
}

void Model::surface(uint32_t meshlet, uint32_t triangle, float b1, float b2,
                    SurfacePoint& out) const {
  const Triangles& t = triangles(meshlet);
  const Vec3 corner[3] = {t.corner(triangle, 0), t.corner(triangle, 1), t.corner(triangle, 2)};
  const float b[3] = {1.0f - b1 - b2, b1, b2};
  out = {};
  store(blend(corner, b), out.p);
  Vec3 n = normalized(cross(corner[1] - corner[0], corner[2] - corner[0]));
  store(n, out.n);
  store(n, out.shading_n);
  tangents(n, out.dp_du, out.dp_dv);
  out.uv[0] = b1;
  out.uv[1] = b2;
  const Primitive& primitive = place_of(meshlet).primitive;
  if (primitive.texcoord.exists() || (primitive.normal.exists() && !options_.face_normals))
    shading(primitive, vertex_attributes(meshlet), triangle, b, corner, out);
  if (options_.flip_normals)
    for (float* flipped : {out.n, out.shading_n})
      for (int i = 0; i < 3; i++) flipped[i] = -flipped[i];
}

void Model::shading(const Primitive& primitive, const VertexAttributes& values, uint32_t triangle,
                    const float* b, const Vec3* corner, SurfacePoint& out) const {
  const float* at[3] = {values.of(triangle, 0), values.of(triangle, 1), values.of(triangle, 2)};
  if (primitive.normal.exists()) {
    Vec3 normal[3];
    for (int k = 0; k < 3; k++, at[k - 1] += 3) normal[k] = {at[k][0], at[k][1], at[k][2]};
    Vec3 n = blend(normal, b);
    const float norm = length(n);
    if (norm > 0 && !options_.face_normals) {
      n = n * (1 / norm);
      store(n, out.shading_n);
      Vec3 du = (normal[1] - normal[0]) * (1 / norm), dv = (normal[2] - normal[0]) * (1 / norm);
      store(du - n * dot(n, du), out.dn_du);
      store(dv - n * dot(n, dv), out.dn_dv);
    }
  }
  if (!primitive.texcoord.exists()) return;
  for (int i = 0; i < 2; i++) out.uv[i] = at[0][i] * b[0] + at[1][i] * b[1] + at[2][i] * b[2];
  float du1 = at[1][0] - at[0][0], dv1 = at[1][1] - at[0][1], du2 = at[2][0] - at[0][0],
        dv2 = at[2][1] - at[0][1];
  float determinant = du1 * dv2 - dv1 * du2;
  if (determinant == 0) return;
  Vec3 e1 = corner[1] - corner[0], e2 = corner[2] - corner[0];
  store((e1 * dv2 - e2 * dv1) * (1 / determinant), out.dp_du);
  store((e2 * du1 - e1 * du2) * (1 / determinant), out.dp_dv);
}

uint32_t Model::sample(uint32_t meshlet, float u1, float u2, SurfacePoint& out) const {
  const Triangles& t = triangles(meshlet);
  float area[kMeshletTriangles] = {}, total = 0;
  for (uint32_t triangle = 0; triangle < t.count; triangle++) {
    Vec3 a = t.corner(triangle, 0), n = cross(t.corner(triangle, 1) - a, t.corner(triangle, 2) - a);
    area[triangle] = length(n);
    total += area[triangle];
  }
  uint32_t triangle = 0;
  float rest = u2 * total;
  while (triangle + 1 < t.count && rest >= area[triangle]) rest -= area[triangle++];
  float y = area[triangle] > 0 ? std::min(rest / area[triangle], 1.0f) : 0.0f;
  float root = std::sqrt(std::max(0.0f, 1.0f - u1));
  surface(meshlet, triangle, 1.0f - root, root * y, out);
  std::copy(out.shading_n, out.shading_n + 3, out.n);  // as Mitsuba's meshes do
  return triangle;
}

void Model::index_texcoords() {
  for (uint32_t m = 0; m < facts_.meshlets; m++) {
    if (!place_of(m).primitive.texcoord.exists()) continue;
    std::vector<float> corners;
    for (uint32_t corner = 0; corner < 3 * triangles(m).count; corner++) {
      const float* uv = texcoord_of(m, corner / 3, corner % 3);
      corners.insert(corners.end(), uv, uv + 2);
    }
    cells_.add(m, corners);
  }
  cells_.sort();
  facts_.table_bytes += sizeof(uint32_t) * (cells_.first.size() + cells_.items.size());
}

bool Model::at_texcoord(const float (&uv)[2], uint32_t& meshlet, uint32_t& triangle,
                        SurfacePoint& out) const {
  if (cells_.first.empty() || !std::isfinite(uv[0]) || !std::isfinite(uv[1])) return false;
  const uint32_t cell = cells_.cell(uv);
  for (uint32_t i = cells_.first[cell]; i < cells_.first[cell + 1]; i++) {
    meshlet = cells_.items[i];
    const Triangles& t = triangles(meshlet);
    for (triangle = 0; triangle < t.count; triangle++) {
      const float *a = texcoord_of(meshlet, triangle, 0), *b = texcoord_of(meshlet, triangle, 1),
                  *c = texcoord_of(meshlet, triangle, 2);
      float bu = b[0] - a[0], bv = b[1] - a[1], cu = c[0] - a[0], cv = c[1] - a[1],
            determinant = bu * cv - bv * cu;
      // Move the point by whole periods next to the triangle.
      float u = uv[0] - a[0], v = uv[1] - a[1];
      u -= std::round(u - 0.5f * (std::min({0.0f, bu, cu}) + std::max({0.0f, bu, cu})));
      v -= std::round(v - 0.5f * (std::min({0.0f, bv, cv}) + std::max({0.0f, bv, cv})));
      float b1 = (u * cv - v * cu) / determinant, b2 = (bu * v - bv * u) / determinant;
      if (determinant != 0 && b1 >= 0 && b2 >= 0 && b1 + b2 <= 1) {
        surface(meshlet, triangle, b1, b2, out);
        return true;
      }
    }
  }
  return false;
}

const float* Model::texcoord_of(uint32_t meshlet, uint32_t triangle, uint32_t k) const {
  return vertex_attributes(meshlet).of(triangle, k) +
         3 * place_of(meshlet).primitive.normal.exists();
}

const Attribute* Model::attribute(const std::string& name, uint32_t& index) const {
  const auto& others = attributes();
  for (index = 0; index < others.size(); index++)
    if (others[index].name == name) return &others[index];
  return nullptr;
}

void Model::attribute(uint32_t index, uint32_t meshlet, uint32_t triangle, const float* p,
                      const float* (&corners)[3], float (&weights)[3]) const {
  const Triangles& t = triangles(meshlet);
  triangle = std::min(triangle, t.count - 1);
  Vec3 a = t.corner(triangle, 0), u = t.corner(triangle, 1) - a, v = t.corner(triangle, 2) - a,
       r = Vec3{p[0], p[1], p[2]} - a;
  float uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), ru = dot(r, u), rv = dot(r, v),
        inverse = 1 / (uu * vv - uv * uv);
  weights[1] = (vv * ru - uv * rv) * inverse;
  weights[2] = (uu * rv - uv * ru) * inverse;
  weights[0] = 1.0f - weights[1] - weights[2];
  static constexpr float kNothing[4] = {0, 0, 0, 0};
  uint32_t offset = 0;
  const Primitive& primitive = place_of(meshlet).primitive;
  for (uint32_t i = 0; i < index; i++)
    offset += primitive.others[i].exists() ? primitive.others[i].components : 0;
  offset += 3 * primitive.normal.exists() + 2 * primitive.texcoord.exists();
  bool there = primitive.others[index].exists();
  const VertexAttributes* values = there ? &vertex_attributes(meshlet) : nullptr;
  for (uint32_t k = 0; k < 3; k++) corners[k] = there ? values->of(triangle, k) + offset : kNothing;
}

}  // namespace meshlet_shape
