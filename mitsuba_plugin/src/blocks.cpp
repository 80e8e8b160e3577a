#include "blocks.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>

#include "decode/dequantise.h"

namespace meshlet_shape {
namespace {

using gltf_meshlet_codec::DecodedMeshlet;
using gltf_meshlet_codec::Stream;

constexpr uint32_t kPartMeshlets = 128;
constexpr uint32_t kMaxFloatBits = 24;  // floats hold integers below 2^24

uint32_t bits_of(float f) {
  uint32_t bits;
  std::memcpy(&bits, &f, 4);
  return bits;
}
float float_of(uint32_t bits) {
  float f;
  std::memcpy(&f, &bits, 4);
  return f;
}

const Stream& stream_of(const Primitive& p, const Attribute& a) {
  return p.blob->header().streams[a.stream];
}

// Whether a block can hold an attribute as the integers of one grid.
bool is_grid(const Primitive& p, const Attribute& a, uint32_t bits) {
  const Stream& s = stream_of(p, a);
  return s.kind == gltf_meshlet_codec::kGrid && !a.integer && a.scale == 1.0f && !a.skipped &&
         s.elements == a.components && s.bits <= bits;
}

bool has_small_normals(const Primitive& p) {
  const Stream& s = stream_of(p, p.normal);
  return s.kind == gltf_meshlet_codec::kOct && !p.normal.integer && p.normal.scale == 1.0f &&
         s.bits <= 8;
}

Form form_of(const std::vector<Primitive>& primitives, const Options& options,
             bool wide_positions) {
  Form form;
  form.wide_positions = wide_positions;
  for (const Primitive& p : primitives) {
    form.wide_positions |= !is_grid(p, p.position, kMaxFloatBits);
    if (options.face_normals) {
    } else if (p.normal.exists()) {
      form.normals = true;
      form.wide_normals |= !has_small_normals(p);
    } else if (options.smooth_normals) {
      form.normals = form.wide_normals = true;
    }
    if (p.texcoord.exists()) {
      form.texcoords = true;
      form.wide_texcoords |= !is_grid(p, p.texcoord, 16);
    }
  }
  form.wide_normals |= form.normals && form.wide_positions;
  for (const Attribute& a : primitives[0].others) form.attribute_words += a.components;
  return form;
}

Grid grid_of(const Primitive& p, const Form& form) {
  Grid grid;
  grid.matrix = p.to_world;
  if (!form.wide_positions) {
    const Stream& s = stream_of(p, p.position);
    grid.step = s.step;
    for (int i = 0; i < 3; i++) grid.offset[i] = s.offset[i];
  }
  grid.normals = form.normals && p.normal.exists();
  if (grid.normals && !form.wide_normals)
    grid.normal_scale = gltf_meshlet_codec::octahedral_scale(stream_of(p, p.normal).bits);
  grid.texcoords = p.texcoord.exists();
  if (grid.texcoords && !form.wide_texcoords) {
    const Stream& s = stream_of(p, p.texcoord);
    grid.texcoord_scale = s.step;
    for (int i = 0; i < 2; i++) grid.texcoord_offset[i] = s.offset[i];
  }
  std::fill(grid.lower, grid.lower + 3, std::numeric_limits<float>::infinity());
  std::fill(grid.upper, grid.upper + 3, -std::numeric_limits<float>::infinity());
  return grid;
}

// Some meshlets of a primitive, decoded. Numbers of blocks and vertices count from the part's own.
struct Part {
  const Primitive* primitive;
  uint32_t first, count;
  Grid grid;
  Blocks blocks;
  std::vector<uint32_t> triangle_counts;  // per block
};

void append(std::vector<uint32_t>& to, const std::vector<uint32_t>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

class Writer {
 public:
  Writer(Part& part, const Form& form)
      : part_(part), out_(part.blocks), primitive_(*part.primitive), form_(form) {}

  // Returns false if a meshlet's positions do not fit 16 bits.
  bool write() {
    for (uint32_t m = part_.first; m < part_.first + part_.count; m++) {
      const DecodedMeshlet d =
          decode_meshlet(*primitive_.blob, primitive_.number_in_blob(m), primitive_.streams());
      if (!positions(d)) return false;
      for (uint32_t i = 0; i < d.vertex_count; i++) attributes(d, i);
      for (uint32_t t = 0; t < d.triangle_count; t++) {
        uint32_t packed = 0;
        for (uint32_t k = 0; k < 3; k++)
          packed |= corner_of(d.triangles[t], k, primitive_.flip_winding) << kCornerBits * k;
        out_.triangles.push_back(packed);
      }
      part_.triangle_counts.push_back(d.triangle_count);
    }
    return true;
  }

 private:
  bool positions(const DecodedMeshlet& d) {
    const uint32_t first = uint32_t(out_.vertices.size() / form_.vertex_words());
    uint32_t corner[3] = {0, 0, 0};
    if (!form_.wide_positions && !corner_of_positions(d, corner)) return false;
    out_.heads.insert(out_.heads.end(), {corner[0], corner[1], corner[2], first});
    for (uint32_t i = 0; i < d.vertex_count; i++) {
      float place[3];
      if (form_.wide_positions) {
        read_attribute(d, streams(), primitive_.position, i, place);
        for (float value : place) out_.vertices.push_back(bits_of(value));
      } else {
        const uint32_t* q = d.vertex(primitive_.position.stream, i);
        out_.vertices.push_back((q[0] - corner[0]) | (q[1] - corner[1]) << 16);
        out_.vertices.push_back((q[2] - corner[2]) | small_normal(d, i) << 16);
        for (int a = 0; a < 3; a++) place[a] = float(q[a]);
      }
      for (int a = 0; a < 3; a++) {
        part_.grid.lower[a] = std::min(part_.grid.lower[a], place[a]);
        part_.grid.upper[a] = std::max(part_.grid.upper[a], place[a]);
      }
    }
    return true;
  }

  bool corner_of_positions(const DecodedMeshlet& d, uint32_t (&corner)[3]) const {
    for (int a = 0; a < 3; a++) {
      uint32_t low = ~0u, high = 0;
      for (uint32_t i = 0; i < d.vertex_count; i++) {
        const uint32_t q = d.vertex(primitive_.position.stream, i)[a];
        low = std::min(low, q);
        high = std::max(high, q);
      }
      if (high - low > 0xffffu || high >> kMaxFloatBits) return false;
      corner[a] = low;
    }
    return true;
  }

  uint32_t small_normal(const DecodedMeshlet& d, uint32_t vertex) const {
    if (!part_.grid.normals || form_.wide_normals) return 0;
    const uint32_t* n = d.vertex(primitive_.normal.stream, vertex);
    return (n[0] & 255u) | (n[1] & 255u) << 8;
  }

  void attributes(const DecodedMeshlet& d, uint32_t vertex) {
    if (form_.wide_normals) {
      float n[3] = {0, 0, 0};
      if (part_.grid.normals) read_attribute(d, streams(), primitive_.normal, vertex, n);
      for (float value : n) out_.normals.push_back(bits_of(value));
    }
    if (form_.texcoords && !form_.wide_texcoords) {
      const uint32_t* q =
          part_.grid.texcoords ? d.vertex(primitive_.texcoord.stream, vertex) : nullptr;
      out_.texcoords.push_back(q ? (q[0] & 0xffffu) | q[1] << 16 : 0);
    } else if (form_.texcoords) {
      float uv[2] = {0, 0};
      if (part_.grid.texcoords) read_attribute(d, streams(), primitive_.texcoord, vertex, uv);
      for (float value : uv) out_.texcoords.push_back(bits_of(value));
    }
    for (const Attribute& a : primitive_.others) {
      float values[kMaxStored] = {};
      if (a.exists()) read_attribute(d, streams(), a, vertex, values);
      for (uint32_t c = 0; c < a.components; c++) out_.attributes.push_back(bits_of(values[c]));
    }
  }

  const std::vector<Stream>& streams() const { return primitive_.blob->header().streams; }

  Part& part_;
  Blocks& out_;
  const Primitive& primitive_;
  const Form& form_;
};

// Appends a part; numbers become those of the whole shape.
void join(Blocks& all, Part& part, uint32_t grid) {
  const uint32_t first_block = uint32_t(all.heads.size() / kHeadWords);
  const uint32_t first_vertex = all.vertex_count();
  Blocks& own = part.blocks;
  for (size_t i = kHeadWords - 1; i < own.heads.size(); i += kHeadWords)
    own.heads[i] += first_vertex;
  size_t next = 0;
  for (uint32_t b = 0; b < part.triangle_counts.size(); b++)
    for (uint32_t t = 0; t < part.triangle_counts[b]; t++) {
      const uint32_t block = first_block + b;
      if (all.triangles.size() % kMeshletTriangles == 0) all.first_block.push_back(block);
      const uint32_t distance = block - all.first_block.back();
      all.triangles.push_back(own.triangles[next++] | distance << kBlockShift);
    }
  append(all.heads, own.heads);
  all.block_grid.insert(all.block_grid.end(), part.triangle_counts.size(), grid);
  append(all.vertices, own.vertices);
  append(all.normals, own.normals);
  append(all.texcoords, own.texcoords);
  append(all.attributes, own.attributes);
  own = {};
}

uint32_t number_of(std::vector<Grid>& grids, const Grid& grid) {
  // The pages of a primitive follow each other.
  if (grids.empty() || !grids.back().same_place(grid)) grids.push_back(grid);
  grids.back().expand(grid);
  return uint32_t(grids.size() - 1);
}

// Returns false if positions have to be wide.
bool fill(const std::vector<Primitive>& primitives, const Parallel& parallel, Blocks& all) {
  std::vector<Part> parts;
  for (const Primitive& p : primitives) {
    const uint32_t count = p.meshlet_count();
    for (uint32_t m = 0; m < count; m += kPartMeshlets)
      parts.push_back({&p, m, std::min(kPartMeshlets, count - m), grid_of(p, all.form), {}, {}});
  }
  std::atomic<bool> fits{true};
  parallel(parts.size(), [&](size_t i) {
    if (fits && !Writer(parts[i], all.form).write()) fits = false;
  });
  if (!fits) return false;
  uint64_t vertices = 0;
  for (const Part& part : parts) vertices += part.blocks.vertices.size();
  const uint32_t words = std::max(3u, 2 * all.form.attribute_words);  // with those of spectra
  if (vertices / all.form.vertex_words() * words > std::numeric_limits<uint32_t>::max())
    throw std::runtime_error("there are too many vertices for accel triangles; use cache");
  for (Part& part : parts) join(all, part, number_of(all.grids, part.grid));
  all.heads.insert(all.heads.end(), {0, 0, 0, all.vertex_count()});
  return true;
}

Vec3 position_of(const Blocks& b, uint32_t block, uint32_t vertex) {
  const uint32_t* words = b.vertices.data() + b.form.vertex_words() * size_t(vertex);
  if (b.form.wide_positions) return {float_of(words[0]), float_of(words[1]), float_of(words[2])};
  const uint32_t* head = b.heads.data() + kHeadWords * size_t(block);
  return {float(head[0] + (words[0] & 0xffffu)), float(head[1] + (words[0] >> 16)),
          float(head[2] + (words[1] & 0xffffu))};
}

// Gives the vertices of grids without normals the mean of the triangles at their place, weighted by
// angle as Mitsuba's meshes weigh them. Meshlets have copies of vertices, so places are compared.
void smooth(Blocks& b) {
  using Key = std::array<float, 4>;  // the grid, x, y, z
  std::map<Key, Vec3> sums;
  auto key = [&](uint32_t block, uint32_t vertex) {
    const Vec3 p = position_of(b, block, vertex);
    return Key{float(b.block_grid[block]), p.x, p.y, p.z};
  };
  for (size_t t = 0; t < b.triangles.size(); t++) {
    const uint32_t block = b.first_block[t / kMeshletTriangles] + (b.triangles[t] >> kBlockShift);
    if (b.grids[b.block_grid[block]].normals) continue;
    uint32_t vertex[3];
    Vec3 p[3];
    for (uint32_t k = 0; k < 3; k++) {
      vertex[k] = b.heads[kHeadWords * size_t(block) + 3] +
                  (b.triangles[t] >> kCornerBits * k & kCornerMask);
      p[k] = position_of(b, block, vertex[k]);
    }
    const Vec3 n = normalized(cross(p[1] - p[0], p[2] - p[0]));
    for (uint32_t k = 0; k < 3; k++) {
      const Vec3 u = normalized(p[(k + 1) % 3] - p[k]), v = normalized(p[(k + 2) % 3] - p[k]);
      const float angle = std::acos(std::clamp(dot(u, v), -1.0f, 1.0f));
      if (!std::isfinite(angle + dot(n, n))) continue;
      Vec3& sum = sums[key(block, vertex[k])];
      sum = sum + n * angle;
    }
  }
  for (uint32_t block = 0; block < b.block_count(); block++) {
    if (b.grids[b.block_grid[block]].normals) continue;
    const uint32_t end = b.heads[kHeadWords * size_t(block + 1) + 3];
    for (uint32_t v = b.heads[kHeadWords * size_t(block) + 3]; v < end; v++) {
      const auto found = sums.find(key(block, v));
      const Vec3 n = found == sums.end() ? Vec3{0, 0, 0} : found->second;
      for (int a = 0; a < 3; a++) b.normals[3 * size_t(v) + a] = bits_of(n[a]);
    }
  }
  for (Grid& grid : b.grids) {
    grid.smooth = !grid.normals;
    grid.normals = true;
  }
}

}  // namespace

bool Grid::same_place(const Grid& o) const {
  return !std::memcmp(&matrix, &o.matrix, sizeof(matrix)) && step == o.step &&
         std::equal(offset, offset + 3, o.offset) && normal_scale == o.normal_scale &&
         normals == o.normals && texcoords == o.texcoords && texcoord_scale == o.texcoord_scale &&
         std::equal(texcoord_offset, texcoord_offset + 2, o.texcoord_offset);
}

void Grid::expand(const Grid& o) {
  for (int i = 0; i < 3; i++) {
    lower[i] = std::min(lower[i], o.lower[i]);
    upper[i] = std::max(upper[i], o.upper[i]);
  }
}

Blocks make_blocks(const std::vector<Primitive>& primitives, const Options& options,
                   const Parallel& parallel) {
  for (const bool wide : {false, true}) {
    Blocks blocks;
    blocks.form = form_of(primitives, options, wide);
    if (!fill(primitives, parallel, blocks)) continue;
    if (options.smooth_normals && blocks.form.normals) smooth(blocks);
    return blocks;
  }
  throw std::runtime_error("positions do not fit any block");
}

Place place_of(const Grid& grid, const double (&to_world)[3][4], bool flip_texcoords) {
  double m[3][4];  // from the primitive to the world
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 4; j++) {
      m[i][j] = j == 3 ? to_world[i][3] : 0.0;
      for (int k = 0; k < 3; k++) m[i][j] += to_world[i][k] * double(grid.matrix.m[k][j]);
    }
  Place place{};
  for (int i = 0; i < 3; i++) {
    double origin = m[i][3];
    for (int j = 0; j < 3; j++) {
      place.to_world[i][j] = float(m[i][j] * grid.step);
      origin += m[i][j] * grid.offset[j];
    }
    place.to_world[i][3] = float(origin);
  }
  const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const double sign = !grid.normals ? 0.0 : determinant < 0 && !grid.smooth ? -1.0 : 1.0;
  for (int i = 0; i < 3; i++)  // the inverse transpose, but for its length
    for (int j = 0; j < 3; j++) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      place.normals[i][j] = float(sign * (m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1]));
    }
  place.normal_scale = grid.normal_scale;
  place.texcoords = grid.texcoords;
  for (int i = 0; i < 2; i++) {
    const bool flip = flip_texcoords && i == 1;
    place.texcoord_scale[i] = flip ? -grid.texcoord_scale : grid.texcoord_scale;
    place.texcoord_offset[i] = flip ? 1.0f - grid.texcoord_offset[i] : grid.texcoord_offset[i];
  }
  return place;
}

// Calls f with the number and the position of every vertex, as a kernel computes them.
template <class Function>
void for_each_position(const BlockView& b, Function&& f) {
  for (uint32_t block = 0; block < b.block_count; block++) {
    const uint32_t* head = b.heads + kHeadWords * block;
    const float (&m)[3][4] = b.places[b.block_grid[block]].to_world;
    for (uint32_t v = head[3]; v < head[kHeadWords + 3]; v++) {
      float q[3], p[3];
      if (b.wide_positions) {
        for (int a = 0; a < 3; a++) q[a] = float_of(b.vertices[3 * size_t(v) + a]);
      } else {
        const uint32_t* words = b.vertices + 2 * size_t(v);
        q[0] = float(head[0] + (words[0] & 0xffffu));
        q[1] = float(head[1] + (words[0] >> 16));
        q[2] = float(head[2] + (words[1] & 0xffffu));
      }
      for (int a = 0; a < 3; a++)
        p[a] = std::fma(m[a][0], q[0], std::fma(m[a][1], q[1], std::fma(m[a][2], q[2], m[a][3])));
      f(v, p);
    }
  }
}

void write_triangles(const BlockView& b, float* positions, uint32_t* faces) {
  for_each_position(
      b, [&](uint32_t v, const float* p) { std::copy(p, p + 3, positions + 3 * size_t(v)); });
  for (uint32_t t = 0; t < b.triangle_count; t++) {
    const uint32_t packed = b.triangles[t];
    const uint32_t block = b.first_block[t / kMeshletTriangles] + (packed >> kBlockShift);
    const uint32_t first = b.heads[kHeadWords * block + 3];
    for (uint32_t k = 0; k < 3; k++)
      faces[3 * size_t(t) + k] = first + (packed >> kCornerBits * k & kCornerMask);
  }
}

void write_texcoords(const BlockView& b, const uint32_t* texcoords, bool wide, float* out) {
  for (uint32_t t = 0; t < b.triangle_count; t++) {
    const uint32_t packed = b.triangles[t];
    const uint32_t block = b.first_block[t / kMeshletTriangles] + (packed >> kBlockShift);
    const Place& place = b.places[b.block_grid[block]];
    for (uint32_t k = 0; k < 3; k++) {
      const size_t v =
          b.heads[kHeadWords * size_t(block) + 3] + (packed >> kCornerBits * k & kCornerMask);
      for (uint32_t a = 0; a < 2; a++) {
        const float q =
            wide ? float_of(texcoords[2 * v + a]) : float(texcoords[v] >> 16 * a & 0xffffu);
        *out++ = std::fma(q, place.texcoord_scale[a], place.texcoord_offset[a]);
      }
    }
  }
}

Box bounds_of(const BlockView& b) {
  Box box = kEmptyBox;
  for_each_position(b, [&](uint32_t, const float* p) { expand(box, load(p)); });
  return box;
}

Box bounds_of(const Grid& grid, const Place& place) {
  Box box = kEmptyBox;
  for (int corner = 0; corner < 8; corner++) {
    float p[3];
    for (int i = 0; i < 3; i++) {
      p[i] = place.to_world[i][3];
      for (int j = 0; j < 3; j++)
        p[i] += place.to_world[i][j] * (corner >> j & 1 ? grid.upper : grid.lower)[j];
    }
    expand(box, load(p));
  }
  return box;
}

}  // namespace meshlet_shape
