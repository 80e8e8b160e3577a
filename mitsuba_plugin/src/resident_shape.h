// The shape of `accel` = `triangles`: Embree or OptiX builds its own structure from decoded
// triangles, which then go. Compact blocks of all meshlets stay; surface interactions are computed
// from them by Dr.Jit, in all variants, as Mitsuba's meshes compute theirs.
#pragma once
#include <mitsuba/core/distr_1d.h>
#include <mitsuba/core/warp.h>
#include <mitsuba/render/emitter.h>
#include <mitsuba/render/scene_ir.h>
#include <mitsuba/render/shape.h>
#include <mitsuba/render/srgb.h>

#include <atomic>
#include <cstring>
#include <mutex>

#include "blocks.h"
#include "model.h"
#include "resident_blocks.h"

NAMESPACE_BEGIN(mitsuba)

using namespace meshlet_shape;

template <typename Float, typename Spectrum>
class ResidentMeshlets final : public Shape<Float, Spectrum> {
 public:
  MI_IMPORT_BASE(Shape, m_to_world, m_is_instance, m_shape_type, initialize, mark_dirty,
                 get_children_string)
  MI_IMPORT_TYPES()
  using typename Base::ScalarIndex;
  using typename Base::ScalarSize;
  using Resident = ResidentBlocks<Float, Spectrum>;
  using Corners = typename Resident::Corners;

  ResidentMeshlets(const Properties& props, std::vector<Primitive> primitives,
                   const Options& options)
      : Base(props), m_options(options), m_blocks(primitives, options, m_to_world.scalar()) {
    m_facts = m_blocks.facts;
    m_listing = std::make_unique<Listing>(&m_facts, nullptr);
    if constexpr (dr::is_cuda_v<Float>)
      m_shape_type = ShapeType::Mesh;  // chooses OptiX's programs for triangles
    prepare_sampling();
    initialize();
  }

  void traverse(TraversalCallback* cb) override {
    Base::traverse(cb);
    constexpr auto kFacts = ParamFlags::NonDifferentiable | ParamFlags::ReadOnly;
    m_cache_id = double(m_listing->id);  // for mitsuba_plugin.statistics
    cb->put("cache_id", m_cache_id, kFacts);
    cb->put("to_world", m_to_world, ParamFlags::NonDifferentiable);
    cb->put("vertex_count", m_blocks.vertex_count, kFacts);
    cb->put("face_count", m_blocks.triangle_count, kFacts);
    cb->put("bbox.min", m_blocks.bbox.min, kFacts);
    cb->put("bbox.max", m_blocks.bbox.max, kFacts);
  }

  void parameters_changed(const std::vector<std::string>& keys) override {
    if (keys.empty() || string::contains(keys, "to_world")) {
      m_to_world = m_to_world.value().update();
      drop_triangles();
      m_blocks.move(m_to_world.scalar(), m_options.flip_texcoords);
      prepare_sampling();
      mark_dirty();
    }
    Base::parameters_changed(keys);
  }

  ScalarSize primitive_count() const override { return m_blocks.triangle_count; }
  ScalarBoundingBox3f bbox() const override { return m_blocks.bbox; }
  bool has_flipped_normals() const override { return m_options.flip_normals; }

  // --- the acceleration structure ---

  // The builder reads the arrays after this returns, in the same thread and stream.
  void describe(ShapeIR& ir) const override {
    std::lock_guard lock(m_mutex);
    if (!m_expanded) {
      m_triangles = m_blocks.expand();
      m_expanded = true;
    }
    ir.kind = ShapeIR::Kind::Triangles;
    ir.type = ShapeType::Mesh;
    ir.ctx = this;
    ir.vertex_count = m_blocks.vertex_count;
    ir.face_count = m_blocks.triangle_count;
    ir.vertex_ptr = m_triangles.positions.data();
    ir.index_ptr = m_triangles.faces.data();
  }

  // A scene asks all its shapes after each build, so the triangles can go. It does not ask the
  // members of shape groups, whose triangles go when the first ray has met them.
  bool parameters_grad_enabled() const override {
    drop_triangles();
    return false;
  }

  // --- surface interactions ---

  SurfaceInteraction3f compute_surface_interaction(const Ray3f& ray,
                                                   const PreliminaryIntersection3f& pi,
                                                   uint32_t ray_flags, uint32_t recursion_depth,
                                                   Mask active) const override {
    MI_MASK_ARGUMENT(active);
    if (m_is_instance)
      drop_triangles();
    else if (recursion_depth > 0)
      return dr::zeros<SurfaceInteraction3f>();
    const Corners c = m_blocks.corners(pi.prim_index, active);
    const Vector3f e1 = c.p[1] - c.p[0], e2 = c.p[2] - c.p[0];
    const bool follow = has_flag(ray_flags, RayFlags::FollowShape);
    Float t = pi.t;
    Point2f b = pi.prim_uv;
    if constexpr (dr::is_diff_v<Float>) {
      if (!follow && dr::grad_enabled(ray.o, ray.d)) track(ray, c.p[0], e1, e2, t, b);
    }
    SurfaceInteraction3f si = at(c, b, ray_flags, active);
    if (dr::is_diff_v<Float> && follow)
      t = dr::sqrt(dr::squared_norm(si.p - ray.o) / dr::squared_norm(ray.d));
    si.t = dr::select(active, t, dr::Infinity<Float>);
    si.prim_index = pi.prim_index;
    return si;
  }

  SurfaceInteraction3f eval_parameterization(const Point2f& uv, uint32_t ray_flags,
                                             Mask active) const override {
    MI_MASK_ARGUMENT(active);
    auto [face, b] = m_blocks.at_texcoord(uv, active);
    SurfaceInteraction3f si = at(m_blocks.corners(face, active), b, ray_flags, active);
    si.t = dr::select(active, Float(0.f), dr::Infinity<Float>);
    si.prim_index = face;
    return si;
  }

  // --- sampling ---

  Float surface_area() const override { return areas().sum(); }

  PositionSample3f sample_position(Float time, const Point2f& sample_, Mask active) const override {
    MI_MASK_ARGUMENT(active);
    Point2f sample = sample_;
    UInt32 face;
    std::tie(face, sample.y()) = areas().sample_reuse(sample.y(), active);
    const SurfaceInteraction3f si =
        at(m_blocks.corners(face, active), warp::square_to_uniform_triangle(sample),
           RayFlags::UV | RayFlags::ShadingFrame, active);
    PositionSample3f ps = dr::zeros<PositionSample3f>();
    ps.p = si.p;
    ps.uv = si.uv;
    ps.n = si.sh_frame.n;
    ps.time = time;
    ps.pdf = areas().normalization();
    ps.delta = false;
    return ps;
  }

  Float pdf_position(const PositionSample3f&, Mask) const override {
    return areas().normalization();
  }

  // --- attributes ---

  Mask has_attribute(std::string_view name, Mask active) const override {
    return m_blocks.attribute(name) ? Mask(true) : Base::has_attribute(name, active);
  }

  UnpolarizedSpectrum eval_attribute(std::string_view name, const SurfaceInteraction3f& si,
                                     Mask active) const override {
    const auto* a = m_blocks.attribute(name);
    if (!a) return Base::eval_attribute(name, si, active);
    if (a->components == 1) return UnpolarizedSpectrum(interpolated<1>(a->first, si, active)[0]);
    if (a->components != 3) return wrong_size<UnpolarizedSpectrum>("eval_attribute", name, *a);
    if constexpr (is_spectral_v<Spectrum>) {
      if (!a->is_color) return wrong_size<UnpolarizedSpectrum>("eval_attribute", name, *a);
      const Point3f b = barycentric(si, active);
      const auto corner = m_blocks.corners(si.prim_index, active).vertex;
      UnpolarizedSpectrum mixed(0.f);
      for (int k = 0; k < 3; k++)
        mixed += b[k] * srgb_model_eval<UnpolarizedSpectrum>(
                            m_blocks.template attribute_at<3>(a->spectrum, corner[k], active),
                            si.wavelengths);
      return mixed;
    } else {
      const Color3f color(interpolated<3>(a->first, si, active));
      if constexpr (is_monochromatic_v<Spectrum>)
        return luminance(color);
      else
        return color;
    }
  }

  Float eval_attribute_1(std::string_view name, const SurfaceInteraction3f& si,
                         Mask active) const override {
    const auto* a = m_blocks.attribute(name);
    if (!a) return Base::eval_attribute_1(name, si, active);
    if (a->components != 1) return wrong_size<Float>("eval_attribute_1", name, *a);
    return interpolated<1>(a->first, si, active)[0];
  }

  Color3f eval_attribute_3(std::string_view name, const SurfaceInteraction3f& si,
                           Mask active) const override {
    const auto* a = m_blocks.attribute(name);
    if (!a) return Base::eval_attribute_3(name, si, active);
    if (a->components != 3) return wrong_size<Color3f>("eval_attribute_3", name, *a);
    return Color3f(interpolated<3>(a->first, si, active));
  }

  std::string to_string() const override {
    std::ostringstream oss;
    oss << "MeshletEdgebreaker[" << std::endl
        << "  bbox = " << string::indent(bbox()) << "," << std::endl
        << "  triangles = " << m_facts.triangles << " in " << m_facts.meshlets << " meshlets,"
        << std::endl
        << "  compressed = " << util::mem_string(m_facts.compressed_bytes) << "," << std::endl
        << "  blocks = " << util::mem_string(m_facts.block_bytes) << "," << std::endl
        << "  " << string::indent(get_children_string()) << std::endl
        << "]";
    return oss.str();
  }

  MI_DECLARE_CLASS(ResidentMeshlets)
  MI_TRAVERSE_CB(Base, m_blocks.heads, m_blocks.block_grid, m_blocks.vertices, m_blocks.triangles,
                 m_blocks.first_block, m_blocks.normals, m_blocks.texcoords, m_blocks.attributes,
                 m_blocks.cell_first, m_blocks.cell_triangles, m_blocks.places, m_areas)

 private:
  // Gradients of a hit through the ray (Moeller and Trumbore).
  static void track(const Ray3f& ray, const Point3f& p0, const Vector3f& e1, const Vector3f& e2,
                    Float& t, Point2f& b) {
    const Vector3f p = dr::cross(ray.d, e2), o = ray.o - p0, q = dr::cross(o, e1);
    const Float inverse = dr::rcp(dr::dot(e1, p));
    b = dr::replace_grad(b, Point2f(dr::dot(o, p) * inverse, dr::dot(ray.d, q) * inverse));
    t = dr::replace_grad(t, Float(dr::dot(e2, q) * inverse));
  }

  // The point with these barycentric weights of the second and third corner; without t and number.
  SurfaceInteraction3f at(const Corners& c, const Point2f& b, uint32_t ray_flags,
                          const Mask& active) const {
    const Vector3f e1 = c.p[1] - c.p[0], e2 = c.p[2] - c.p[0];
    const Float b0 = 1.f - b.x() - b.y();
    auto mix = [&](const auto* v) {
      return dr::fmadd(v[0], b0, dr::fmadd(v[1], b.x(), v[2] * b.y()));
    };
    SurfaceInteraction3f si = dr::zeros<SurfaceInteraction3f>();
    si.p = mix(c.p);
    si.n = dr::normalize(dr::cross(e1, e2));
    si.uv = b;
    si.dp_du = e1;
    si.dp_dv = e2;
    const bool tangents = has_flag(ray_flags, RayFlags::dPdUV);
    if (m_blocks.form.texcoords && (tangents || has_flag(ray_flags, RayFlags::UV)))
      add_texcoords(si, c, b, tangents, active);
    si.sh_frame.n = si.n;
    const bool curved = has_flag(ray_flags, RayFlags::dNSdUV);
    if (m_blocks.form.normals && (curved || has_flag(ray_flags, RayFlags::ShadingFrame))) {
      Normal3f n[3];
      for (int k = 0; k < 3; k++) n[k] = m_blocks.normal(c, k, active);
      const Normal3f sum = mix(n);
      const Float squared = dr::squared_norm(sum);
      const Mask there = squared > 0.f;  // corners may have opposite normals, or none
      const Float inverse = dr::rsqrt(squared);
      si.sh_frame.n = dr::select(there, Normal3f(sum * inverse), si.n);
      if (curved) {
        auto along = [&](const Normal3f& difference) {
          const Vector3f d = difference * inverse;
          return dr::select(there, dr::fnmadd(si.sh_frame.n, dr::dot(si.sh_frame.n, d), d), 0.f);
        };
        si.dn_du = along(n[1] - n[0]);
        si.dn_dv = along(n[2] - n[0]);
      }
    }
    if (m_options.flip_normals) {
      si.n = -si.n;
      si.sh_frame.n = -si.sh_frame.n;
    }
    si.shape = this;
    si.instance = nullptr;
    return si;
  }

  void add_texcoords(SurfaceInteraction3f& si, const Corners& c, const Point2f& b, bool tangents,
                     const Mask& active) const {
    Point2f uv[3];
    for (int k = 0; k < 3; k++) uv[k] = m_blocks.texcoord(c, k, active);
    const Float b0 = 1.f - b.x() - b.y();
    const Mask there = m_blocks.has_texcoords(c);
    si.uv = dr::select(there, dr::fmadd(uv[0], b0, dr::fmadd(uv[1], b.x(), uv[2] * b.y())), b);
    if (!tangents) return;
    const Vector3f e1 = si.dp_du, e2 = si.dp_dv;
    const Vector2f d1 = uv[1] - uv[0], d2 = uv[2] - uv[0];
    const Float determinant = dr::fmsub(d1.x(), d2.y(), d1.y() * d2.x());
    const Float inverse = dr::rcp(determinant);
    const Mask regular = determinant != 0.f;
    Vector3f s(e1), t(e2);
    if (dr::none_or<true>(regular)) std::tie(s, t) = coordinate_system(si.n);
    si.dp_du = dr::select(regular, Vector3f(dr::fmsub(d2.y(), e1, d1.y() * e2) * inverse),
                          dr::select(there, s, e1));
    si.dp_dv = dr::select(regular, Vector3f(dr::fnmadd(d2.x(), e1, d1.x() * e2) * inverse),
                          dr::select(there, t, e2));
  }

  // Of the point of the triangle's plane that is nearest to si.p.
  Point3f barycentric(const SurfaceInteraction3f& si, const Mask& active) const {
    const Corners c = m_blocks.corners(si.prim_index, active);
    const Vector3f u = c.p[1] - c.p[0], v = c.p[2] - c.p[0], r = si.p - c.p[0];
    const Float uu = dr::dot(u, u), uv = dr::dot(u, v), vv = dr::dot(v, v), ru = dr::dot(r, u),
                rv = dr::dot(r, v), inverse = dr::rcp(uu * vv - uv * uv);
    const Float b1 = (vv * ru - uv * rv) * inverse, b2 = (uu * rv - uv * ru) * inverse;
    return {1.f - b1 - b2, b1, b2};
  }

  template <uint32_t Size>
  dr::Array<Float, Size> interpolated(uint32_t first, const SurfaceInteraction3f& si,
                                      const Mask& active) const {
    const Point3f b = barycentric(si, active);
    const Corners c = m_blocks.corners(si.prim_index, active);
    dr::Array<Float, Size> sum(0.f);
    for (int k = 0; k < 3; k++)
      sum += b[k] * m_blocks.template attribute_at<Size>(first, c.vertex[k], active);
    return sum;
  }

  template <typename Result, typename Named>
  static Result wrong_size(const char* function, std::string_view name, const Named& attribute) {
    if constexpr (dr::is_jit_v<Float>)
      return dr::zeros<Result>();  // as Mitsuba's meshes do during tracing
    else
      Throw("%s(): attribute \"%s\" has %u components", function, std::string(name).c_str(),
            attribute.components);
  }

  void prepare_sampling() {
    m_areas = {};
    if (!this->emitter() && !this->sensor()) return;
    if (m_blocks.cell_first.empty()) m_blocks.index_texcoords();
    m_facts.table_bytes = sizeof(uint32_t) * (2 * areas().size() + m_blocks.cell_first.size() +
                                              m_blocks.cell_triangles.size());
  }

  // A table of all triangles, for emitters and who asks for the area.
  const DiscreteDistribution<Float>& areas() const {
    std::lock_guard lock(m_mutex);
    if (m_areas.empty()) m_areas = m_blocks.areas();
    return m_areas;
  }

  void drop_triangles() const {
    if (!m_expanded.load(std::memory_order_acquire)) return;
    std::lock_guard lock(m_mutex);
    m_triangles = {};
    m_expanded = false;
  }

  Options m_options;
  Resident m_blocks;
  ModelFacts m_facts;
  std::unique_ptr<Listing> m_listing;
  mutable DiscreteDistribution<Float> m_areas;
  double m_cache_id = 0;

  mutable std::mutex m_mutex;
  mutable std::atomic<bool> m_expanded{false};
  mutable typename Resident::Triangles m_triangles;
};

NAMESPACE_END(mitsuba)
