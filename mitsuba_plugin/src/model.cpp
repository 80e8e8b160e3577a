#include "model.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

namespace meshlet_shape {
namespace {

Models g_models;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Margin of boxes relative to the coordinates. Box traversal with fused multiply-adds errs by about
// epsilon times the coordinates; this covers ray origins a few scene sizes away.
constexpr float kRelativeMargin = 1.0f / (1 << 20);

constexpr uint32_t kUvCells = 64;  // per axis

// The cell of a texture coordinate on its axis. Texture coordinates repeat; in double, no finite
// one overflows.
uint32_t uv_cell(float coordinate) {
  const double cell = std::floor(double(coordinate) * kUvCells);
  return uint32_t(cell - kUvCells * std::floor(cell / kUvCells));
}

// The number of cells between two texture coordinates, both included: each cell once.
uint32_t uv_cells(float low, float high) {
  const double cells = std::floor(double(high) * kUvCells) - std::floor(double(low) * kUvCells) + 1;
  return uint32_t(std::min(cells, double(kUvCells)));
}

const Box kEmpty = {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};

void expand(Box& box, Vec3 p) {
  for (int i = 0; i < 3; i++) {
    box.lower[i] = std::min(box.lower[i], p[i]);
    box.upper[i] = std::max(box.upper[i], p[i]);
  }
}

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

Model::Model(std::vector<Primitive> primitives, const Options& options)
    : primitives_(std::move(primitives)), options_(options), box_(kEmpty) {
  if (primitives_.empty()) throw std::runtime_error("there is no compressed primitive");
  std::set<const Blob*> blobs;
  uint64_t meshlets = 0;
  for (Primitive& primitive : primitives_) {
    PrimitiveFacts facts = check_primitive(primitive);
    first_meshlet_.push_back(uint32_t(meshlets));
    meshlets += facts.meshlets;
    facts_.triangles += facts.triangles;
    facts_.vertices += facts.vertices;
    if (blobs.insert(primitive.blob.get()).second)
      facts_.compressed_bytes += primitive.blob->bytes.size();
  }
  if (meshlets * kMeshletTriangles > std::numeric_limits<uint32_t>::max())
    throw std::runtime_error("there are too many meshlets");
  first_meshlet_.push_back(uint32_t(meshlets));
  facts_.meshlets = meshlets;
  measure();
  std::shared_ptr<Store> store = store_for(options);
  uint64_t limit = options.cache_bytes >= 0
                       ? uint64_t(options.cache_bytes)
                       : uint64_t(std::ceil(options.cache_fraction * double(facts_.decoded_bytes)));
  table_ = std::make_unique<Table>(std::move(store), kEntryKinds * facts_.meshlets, limit);
  facts_.table_bytes =
      meshlets * (sizeof(Boxes) + sizeof(float) + kEntryKinds * sizeof(std::atomic<Entry*>));
  std::lock_guard lock(g_models.mutex);
  g_models.by_uid[uid()] = this;
}

Model::~Model() {
  std::lock_guard lock(g_models.mutex);
  g_models.by_uid.erase(uid());
}

Models& models() { return g_models; }

// Visits the triangles twice: the margin depends on the size of the model.
void Model::measure() {
  ThreadSlot& thread = this_thread();
  auto decode = [&](uint32_t m) {
    const Place place = place_of(m);
    return decode_triangles(thread, place.primitive, place.meshlet);
  };
  areas_.assign(facts_.meshlets, 0.0f);
  for (uint32_t m = 0; m < facts_.meshlets; m++) {
    Entry* entry = decode(m);
    const auto& triangles = *static_cast<const Triangles*>(entry->payload());
    facts_.decoded_bytes += entry->bytes;
    for (uint32_t triangle = 0; triangle < triangles.count; triangle++) {
      Vec3 c[3] = {triangles.corner(triangle, 0), triangles.corner(triangle, 1),
                   triangles.corner(triangle, 2)};
      for (Vec3 p : c) expand(box_, p);
      Vec3 n = cross(c[1] - c[0], c[2] - c[0]);
      areas_[m] += 0.5f * length(n);
    }
    const Place place = place_of(m);
    if (place.primitive.width)
      facts_.decoded_bytes += decode_attributes(thread, place.primitive, place.meshlet)->bytes;
  }
  float margin = largest_coordinate(box_) * kRelativeMargin;
  boxes_.reserve(facts_.meshlets);
  for (uint32_t m = 0; m < facts_.meshlets; m++)
    boxes_.push_back(static_cast<const Triangles*>(decode(m)->payload())->boxes(margin));
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
  std::vector<std::vector<uint32_t>> cells(size_t(kUvCells) * kUvCells);
  for (uint32_t m = 0; m < facts_.meshlets; m++) {
    if (!place_of(m).primitive.texcoord.exists()) continue;
    float low[2] = {kInfinity, kInfinity}, high[2] = {-kInfinity, -kInfinity};
    const Triangles& t = triangles(m);
    for (uint32_t triangle = 0; triangle < t.count; triangle++)
      for (uint32_t k = 0; k < 3; k++)
        for (int i = 0; i < 2; i++) {
          float value = texcoord_of(m, triangle, k)[i];
          if (!std::isfinite(value)) continue;
          low[i] = std::min(low[i], value);
          high[i] = std::max(high[i], value);
        }
    if (low[0] > high[0] || low[1] > high[1]) continue;  // no number is finite
    const uint32_t x = uv_cell(low[0]), columns = uv_cells(low[0], high[0]);
    const uint32_t y = uv_cell(low[1]), rows = uv_cells(low[1], high[1]);
    for (uint32_t row = y; row < y + rows; row++)
      for (uint32_t column = x; column < x + columns; column++)
        cells[row % kUvCells * kUvCells + column % kUvCells].push_back(m);
  }
  cell_first_.assign(1, 0);
  cell_meshlets_.clear();
  for (const auto& cell : cells) {
    cell_meshlets_.insert(cell_meshlets_.end(), cell.begin(), cell.end());
    cell_first_.push_back(uint32_t(cell_meshlets_.size()));
  }
  facts_.table_bytes += sizeof(uint32_t) * (cell_first_.size() + cell_meshlets_.size());
}

bool Model::at_texcoord(const float (&uv)[2], uint32_t& meshlet, uint32_t& triangle,
                        SurfacePoint& out) const {
  if (cell_first_.empty() || !std::isfinite(uv[0]) || !std::isfinite(uv[1])) return false;
  const size_t cell = uv_cell(uv[1]) * kUvCells + uv_cell(uv[0]);
  for (uint32_t i = cell_first_[cell]; i < cell_first_[cell + 1]; i++) {
    meshlet = cell_meshlets_[i];
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
