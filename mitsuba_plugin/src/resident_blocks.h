// The compact blocks of a shape as arrays of Dr.Jit, and what kernels read from them.
#pragma once
#include <mitsuba/core/bbox.h>
#include <mitsuba/core/distr_1d.h>
#include <mitsuba/render/interaction.h>
#include <mitsuba/render/srgb.h>
#include <nanothread/nanothread.h>

#include <cstring>
#include <string>

#include "blocks.h"
#include "model.h"
#include "texcoord_cells.h"

NAMESPACE_BEGIN(mitsuba)

using namespace meshlet_shape;

// A Parallel on Mitsuba's threads.
inline void on_all_threads(size_t count, const std::function<void(size_t)>& run) {
  dr::parallel_for(dr::blocked_range<size_t>(0, count, 1), [&](dr::blocked_range<size_t> range) {
    for (size_t i : range) run(i);
  });
}

template <typename BoundingBox>
BoundingBox to_bbox(const Box& box) {
  using Point = typename BoundingBox::Point;
  return {Point(box.lower[0], box.lower[1], box.lower[2]),
          Point(box.upper[0], box.upper[1], box.upper[2])};
}

template <typename Float, typename Spectrum>
struct ResidentBlocks {
  MI_IMPORT_CORE_TYPES()
  using Words = DynamicBuffer<UInt32>;
  using Floats = DynamicBuffer<Float>;

  struct Corners {
    Point3f p[3];
    UInt32 vertex[3], small_normal[3], grid;
  };

  struct NamedAttribute {
    std::string name;
    uint32_t components, first;
    bool is_color;
    uint32_t spectrum;  // in spectral variants, of a colour: where its coefficients begin
  };

  // What the builder of an acceleration structure reads. Kernels write it in cuda variants only.
  struct Triangles {
    std::conditional_t<dr::is_cuda_v<Float>, Floats, std::vector<float>> positions;
    std::conditional_t<dr::is_cuda_v<Float>, Words, std::vector<uint32_t>> faces;
  };

  ResidentBlocks(std::vector<Primitive>& primitives, const Options& options,
                 const ScalarAffineTransform4f& transform) {
    facts = check_primitives(primitives);
    Blocks b = make_blocks(primitives, options, on_all_threads);
    form = b.form;
    block_count = b.block_count();
    vertex_count = b.vertex_count();
    triangle_count = uint32_t(b.triangles.size());
    grids = std::move(b.grids);
    const std::vector<Place> rows = place(transform, options.flip_texcoords);
    bbox = to_bbox<ScalarBoundingBox3f>(
        bounds_of({b.heads.data(), b.block_grid.data(), b.vertices.data(), nullptr, nullptr,
                   block_count, 0, form.wide_positions, rows.data()}));
    name_attributes(primitives[0].others, b);
    for (auto [words, from] : {std::pair(&heads, &b.heads),
                               {&vertices, &b.vertices},
                               {&triangles, &b.triangles},
                               {&first_block, &b.first_block},
                               {&block_grid, &b.block_grid},
                               {&normals, &b.normals},
                               {&texcoords, &b.texcoords},
                               {&attributes, &b.attributes}}) {
      *words = array<Words>(*from);
      facts.block_bytes += sizeof(uint32_t) * from->size();
      std::vector<uint32_t>().swap(*from);
    }
  }

  // After a change of the shape's transform.
  void move(const ScalarAffineTransform4f& transform, bool flip_texcoords) {
    const std::vector<Place> rows = place(transform, flip_texcoords);
    if constexpr (dr::is_cuda_v<Float>) {
      bbox = {};
      for (size_t i = 0; i < rows.size(); i++)
        bbox.expand(to_bbox<ScalarBoundingBox3f>(bounds_of(grids[i], rows[i])));
    } else {
      bbox = to_bbox<ScalarBoundingBox3f>(bounds_of(view()));
    }
  }

  // --- of the corners of a triangle ---

  Corners corners(const UInt32& face, const Mask& active) const {
    Corners c;
    const UInt32 packed = dr::gather<UInt32>(triangles, face, active);
    const UInt32 block =
        dr::gather<UInt32>(first_block, face >> 6u, active) + (packed >> kBlockShift);
    const Head head = dr::gather<Head>(heads, block, active);
    c.grid = grids.size() > 1 ? dr::gather<UInt32>(block_grid, block, active) : UInt32(0u);
    for (uint32_t k = 0; k < 3; k++) {
      c.vertex[k] = head[3] + ((packed >> (kCornerBits * k)) & kCornerMask);
      std::tie(c.p[k], c.small_normal[k]) = vertex(head, c.grid, c.vertex[k], active);
    }
    return c;
  }

  Normal3f normal(const Corners& c, uint32_t k, const Mask& active) const {
    Vector3f n;
    if (form.wide_normals) {
      for (uint32_t a = 0; a < 3; a++) n[a] = float_at(normals, c.vertex[k] * 3u + a, active);
    } else {
      const Float scale = placed(c.grid, offsetof(Place, normal_scale));
      n.x() = dr::fmadd(Float(c.small_normal[k] & 255u), scale, -1.f);
      n.y() = dr::fmadd(Float(c.small_normal[k] >> 8u), scale, -1.f);
      n.z() = 1.f - dr::abs(n.x()) - dr::abs(n.y());
      const Float fold = dr::maximum(-n.z(), 0.f);
      n.x() -= dr::copysign(fold, n.x());
      n.y() -= dr::copysign(fold, n.y());
    }
    Normal3f world;
    for (uint32_t i = 0; i < 3; i++) {
      const size_t row = offsetof(Place, normals) + 3 * sizeof(float) * i;
      world[i] =
          dr::fmadd(placed(c.grid, row), n.x(),
                    dr::fmadd(placed(c.grid, row + 4), n.y(), placed(c.grid, row + 8) * n.z()));
    }
    const Float squared = dr::squared_norm(world);
    return world * dr::select(squared > 0.f, dr::rsqrt(squared), 0.f);
  }

  Point2f texcoord(const Corners& c, uint32_t k, const Mask& active) const {
    Point2f uv;
    if (form.wide_texcoords) {
      for (uint32_t a = 0; a < 2; a++) uv[a] = float_at(texcoords, c.vertex[k] * 2u + a, active);
    } else {
      const UInt32 word = dr::gather<UInt32>(texcoords, c.vertex[k], active);
      uv = {Float(word & 0xffffu), Float(word >> 16u)};
    }
    for (uint32_t a = 0; a < 2; a++)
      uv[a] = dr::fmadd(uv[a], placed(c.grid, offsetof(Place, texcoord_scale) + 4 * a),
                        placed(c.grid, offsetof(Place, texcoord_offset) + 4 * a));
    return uv;
  }

  Mask has_texcoords(const Corners& c) const {
    return grids.size() > 1 ? placed(c.grid, offsetof(Place, texcoords)) != 0.f : Mask(true);
  }

  template <uint32_t Size>
  dr::Array<Float, Size> attribute_at(uint32_t first, const UInt32& vertex,
                                      const Mask& active) const {
    dr::Array<Float, Size> values;
    for (uint32_t c = 0; c < Size; c++)
      values[c] = float_at(attributes, vertex * form.attribute_words + (first + c), active);
    return values;
  }

  const NamedAttribute* attribute(std::string_view name) const {
    for (const NamedAttribute& a : names)
      if (a.name == name) return &a;
    return nullptr;
  }

  // --- of all triangles ---

  // On the CPU without a kernel: to trace one for each shape would take longer than to write.
  Triangles expand() const {
    Triangles out;
    const size_t floats = 3 * size_t(vertex_count) + 1;  // Embree reads 16 bytes of each vertex
    if constexpr (dr::is_cuda_v<Float>) {
      out.positions = dr::empty<Floats>(floats);
      out.faces = dr::empty<Words>(3 * size_t(triangle_count));
      const UInt32 number = dr::arange<UInt32>(kMeshletTriangles * size_t(block_count));
      expand_vertices(number, out.positions);
      expand_faces(dr::arange<UInt32>(triangle_count), out.faces);
      dr::eval(out.positions, out.faces);
    } else {
      out.positions.resize(floats);
      out.faces.resize(3 * size_t(triangle_count));
      write_triangles(view(), out.positions.data(), out.faces.data());
    }
    return out;
  }

  // Complete when it returns: another thread may use it.
  DiscreteDistribution<Float> areas() const {
    if constexpr (dr::is_cuda_v<Float>) {
      const Corners c = corners(dr::arange<UInt32>(triangle_count), true);
      DiscreteDistribution<Float> table(
          Float(.5f * dr::norm(dr::cross(c.p[1] - c.p[0], c.p[2] - c.p[0]))));
      dr::sync_thread();
      return table;
    } else {
      const Triangles t = expand();
      std::vector<ScalarFloat> values(triangle_count);
      for (size_t i = 0; i < triangle_count; i++) {
        Vec3 p[3];
        for (size_t k = 0; k < 3; k++) p[k] = load(&t.positions[3 * size_t(t.faces[3 * i + k])]);
        values[i] = .5f * length(cross(p[1] - p[0], p[2] - p[0]));
      }
      return DiscreteDistribution<Float>(values.data(), values.size());
    }
  }

  // --- points by texture coordinates, for emitters with textures ---

  void index_texcoords() {
    if (!form.texcoords) return;
    const std::vector<float> uv = all_texcoords();
    TexcoordCells cells;
    for (uint32_t i = 0; i < triangle_count; i++)
      cells.add(i, {uv.begin() + 6 * size_t(i), uv.begin() + 6 * size_t(i) + 6});
    cells.sort();
    cells_per_axis = cells.per_axis;
    cell_first = array<Words>(cells.first);
    cell_triangles = array<Words>(cells.items);
  }

  // A triangle that has these texture coordinates, and the weights of its second and third corner.
  // Clears `active` where there is none.
  std::pair<UInt32, Point2f> at_texcoord(const Point2f& uv, Mask& active) const {
    UInt32 face(0u);
    Point2f weights(0.f);
    active &= dr::isfinite(uv.x()) && dr::isfinite(uv.y());
    if (!form.texcoords || cell_first.empty()) active = false;
    const UInt32 cell = cell_of(dr::select(active, uv.y(), 0.f)) * cells_per_axis +
                        cell_of(dr::select(active, uv.x(), 0.f));
    if (cell_first.empty()) return {face, weights};
    const UInt32 end = dr::gather<UInt32>(cell_first, cell + 1u, active);
    UInt32 i = dr::gather<UInt32>(cell_first, cell, active);
    Mask found(false), searching = active && i < end;
    std::tie(i, face, weights, found, searching) = dr::while_loop(
        std::make_tuple(i, face, weights, found, searching),
        [](const UInt32&, const UInt32&, const Point2f&, const Mask&, const Mask& searching) {
          return searching;
        },
        [this, uv, end](UInt32& i, UInt32& face, Point2f& weights, Mask& found, Mask& searching) {
          const UInt32 candidate = dr::gather<UInt32>(cell_triangles, i, searching);
          const auto [inside, b] = contains(candidate, uv, searching);
          face = dr::select(inside, candidate, face);
          weights = dr::select(inside, b, weights);
          found |= inside;
          i += 1u;
          searching &= !inside && i < end;
        },
        "texture coordinates");
    active &= found;
    return {face, weights};
  }

  Form form;
  ModelFacts facts;
  uint32_t block_count = 0, vertex_count = 0, triangle_count = 0;
  std::vector<Grid> grids;
  std::vector<NamedAttribute> names;
  ScalarBoundingBox3f bbox;
  Words heads, block_grid, vertices, triangles, first_block, normals, texcoords, attributes;
  Words cell_first, cell_triangles;
  uint32_t cells_per_axis = 1;
  Floats places;  // a Place for each grid

 private:
  using Head = dr::Array<UInt32, kHeadWords>;

  // Copied when it returns: in variants for CPUs the host may read it.
  template <typename Array, typename Value>
  static Array array(const std::vector<Value>& from) {
    return from.empty() ? Array() : dr::load<Array>(from.data(), from.size());
  }

  std::vector<Place> place(const ScalarAffineTransform4f& transform, bool flip_texcoords) {
    double to_world[3][4];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 4; j++) to_world[i][j] = double(transform.matrix.entry(i, j));
    std::vector<Place> rows;
    for (const Grid& grid : grids) rows.push_back(place_of(grid, to_world, flip_texcoords));
    std::vector<float> values(rows.size() * kPlaceWords);
    std::memcpy(values.data(), rows.data(), sizeof(Place) * rows.size());
    places = array<Floats>(values);
    return rows;
  }

  void name_attributes(const std::vector<Attribute>& others, Blocks& b) {
    const uint32_t plain = b.form.attribute_words;
    uint32_t first = 0, spectra = plain;
    for (const Attribute& a : others) {
      const bool color = a.components == 3 && std::strstr(a.name, "color");
      names.push_back({a.name, a.components, first, color, spectra});
      first += a.components;
      if (is_spectral_v<Spectrum> && color) spectra += 3;
    }
    if (spectra == plain) return;
    std::vector<uint32_t> wider(size_t(spectra) * vertex_count);
    for (uint32_t v = 0; v < vertex_count; v++) {
      uint32_t* to = wider.data() + size_t(spectra) * v;
      std::memcpy(to, b.attributes.data() + size_t(plain) * v, sizeof(uint32_t) * plain);
      for (const NamedAttribute& a : names)
        if (a.is_color) {
          Color<float, 3> color;
          std::memcpy(color.data(), to + a.first, 12);
          const auto coefficients = srgb_model_fetch(color);
          std::memcpy(to + a.spectrum, coefficients.data(), 12);
        }
    }
    b.attributes = std::move(wider);
    form.attribute_words = spectra;
  }

  BlockView view() const {
    return {heads.data(),     block_grid.data(),   vertices.data(),
            triangles.data(), first_block.data(),  block_count,
            triangle_count,   form.wide_positions, reinterpret_cast<const Place*>(places.data())};
  }

  Float placed(const UInt32& grid, size_t offset) const {
    return dr::gather<Float>(places, grid * kPlaceWords + uint32_t(offset / sizeof(float)));
  }

  static Float float_at(const Words& words, const UInt32& index, const Mask& active) {
    return dr::reinterpret_array<Float>(dr::gather<UInt32>(words, index, active));
  }

  // The position and the normal's 16 bits.
  std::pair<Point3f, UInt32> vertex(const Head& head, const UInt32& grid, const UInt32& number,
                                    const Mask& active) const {
    Point3f q, p;
    UInt32 small(0u);
    if (form.wide_positions) {
      for (uint32_t a = 0; a < 3; a++) q[a] = float_at(vertices, number * 3u + a, active);
    } else {
      const auto words = dr::gather<dr::Array<UInt32, 2>>(vertices, number, active);
      q = {Float(head[0] + (words[0] & 0xffffu)), Float(head[1] + (words[0] >> 16u)),
           Float(head[2] + (words[1] & 0xffffu))};
      small = words[1] >> 16u;
    }
    for (uint32_t i = 0; i < 3; i++) {
      const size_t row = offsetof(Place, to_world) + 4 * sizeof(float) * i;
      p[i] = dr::fmadd(placed(grid, row), q.x(),
                       dr::fmadd(placed(grid, row + 4), q.y(),
                                 dr::fmadd(placed(grid, row + 8), q.z(), placed(grid, row + 12))));
    }
    return {p, small};
  }

  // number: 64 for each block, at least as many as it has vertices.
  void expand_vertices(const UInt32& number, Floats& positions) const {
    const UInt32 block = number / kMeshletTriangles;
    const Head head = dr::gather<Head>(heads, block);
    const UInt32 v = head[3] + (number & (kMeshletTriangles - 1));
    const Mask there = v < dr::gather<UInt32>(heads, block * kHeadWords + (kHeadWords + 3));
    const UInt32 grid = grids.size() > 1 ? dr::gather<UInt32>(block_grid, block) : UInt32(0u);
    dr::scatter(positions, vertex(head, grid, v, there).first, v, there);
  }

  void expand_faces(const UInt32& face, Words& faces) const {
    const UInt32 packed = dr::gather<UInt32>(triangles, face);
    const UInt32 block = dr::gather<UInt32>(first_block, face >> 6u) + (packed >> kBlockShift);
    const UInt32 first = dr::gather<UInt32>(heads, block * kHeadWords + 3u);
    dr::Array<UInt32, 3> corners;
    for (uint32_t k = 0; k < 3; k++)
      corners[k] = first + ((packed >> (kCornerBits * k)) & kCornerMask);
    dr::scatter(faces, corners, face);
  }

  // Six for each triangle.
  std::vector<float> all_texcoords() const {
    std::vector<float> all(6 * size_t(triangle_count));
    if constexpr (dr::is_cuda_v<Float>) {
      const Corners c = corners(dr::arange<UInt32>(triangle_count), true);
      for (uint32_t k = 0; k < 6; k++) {
        const Float host = dr::migrate(texcoord(c, k / 2, true)[k % 2], JitBackend::None);
        dr::sync_thread();
        const float* values = host.data();
        for (uint32_t i = 0; i < triangle_count; i++) all[6 * size_t(i) + k] = values[i];
      }
    } else {
      write_texcoords(view(), texcoords.data(), form.wide_texcoords, all.data());
    }
    return all;
  }

  UInt32 cell_of(const Float& coordinate) const {
    return dr::minimum(UInt32((coordinate - dr::floor(coordinate)) * float(cells_per_axis)),
                       cells_per_axis - 1);
  }

  std::pair<Mask, Point2f> contains(const UInt32& face, const Point2f& uv,
                                    const Mask& active) const {
    const Corners c = corners(face, active);
    const Point2f a = texcoord(c, 0, active);
    const Vector2f b = texcoord(c, 1, active) - a, d = texcoord(c, 2, active) - a;
    const Float determinant = dr::fmsub(b.x(), d.y(), b.y() * d.x());
    Vector2f r = uv - a;
    for (uint32_t i = 0; i < 2; i++) {  // by whole periods next to the triangle
      const Float low = dr::minimum(0.f, dr::minimum(b[i], d[i])),
                  high = dr::maximum(0.f, dr::maximum(b[i], d[i]));
      r[i] -= dr::round(r[i] - .5f * (low + high));
    }
    const Point2f weights(dr::fmsub(r.x(), d.y(), r.y() * d.x()) / determinant,
                          dr::fmsub(b.x(), r.y(), b.y() * r.x()) / determinant);
    const Mask inside = active && determinant != 0.f && weights.x() >= 0.f && weights.y() >= 0.f &&
                        weights.x() + weights.y() <= 1.f;
    return {inside, weights};
  }
};

NAMESPACE_END(mitsuba)
