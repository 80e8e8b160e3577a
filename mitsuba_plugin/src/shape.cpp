// The Mitsuba shape `meshlet_edgebreaker`: compressed geometry, decoded when rays meet it.
#include <mitsuba/core/distr_1d.h>
#include <mitsuba/core/fresolver.h>
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/properties.h>
#include <mitsuba/core/util.h>
#include <mitsuba/render/emitter.h>
#include <mitsuba/render/shape.h>
#include <mitsuba/render/srgb.h>

#include <cmath>
#include <cstring>

#include "python_api.h"
#include "model.h"
#include "queries.h"
#include "resident_shape.h"
#include "variants.h"

NAMESPACE_BEGIN(mitsuba)

using namespace meshlet_shape;

// The shape of `accel` = `cache`. Each meshlet is one primitive of the acceleration structure. A
// ray that meets its box decodes the meshlet, unless it is in the cache.
template <typename Float, typename Spectrum>
class MeshletEdgebreaker final : public Shape<Float, Spectrum> {
 public:
  MI_IMPORT_BASE(Shape, m_to_world, m_is_instance, initialize, get_children_string)
  MI_IMPORT_TYPES()
  using typename Base::ScalarIndex;
  using typename Base::ScalarSize;

  MeshletEdgebreaker(const Properties& props, std::unique_ptr<Model> model)
      : Base(props),
        m_model(std::move(model)),
        m_face_count(uint32_t(m_model->facts().triangles)),
        m_bbox(to_bbox<ScalarBoundingBox3f>(m_model->box())) {
    const std::vector<float>& areas = m_model->areas();
    std::vector<ScalarFloat> values(areas.begin(), areas.end());
    for (ScalarFloat area : values) m_surface_area += area;
    if (this->emitter() || this->sensor()) {
      m_area_pmf = DiscreteDistribution<Float>(values.data(), values.size());
      m_model->index_texcoords();
    }
    m_queries.prepare(m_model.get());
    initialize();
  }

  void traverse(TraversalCallback* cb) override {
    Base::traverse(cb);
    m_cache_id = double(m_model->id());  // for mitsuba_plugin.statistics
    constexpr auto kFacts = ParamFlags::NonDifferentiable | ParamFlags::ReadOnly;
    cb->put("cache_id", m_cache_id, kFacts);
    cb->put("face_count", m_face_count, kFacts);
    cb->put("bbox.min", m_bbox.min, kFacts);
    cb->put("bbox.max", m_bbox.max, kFacts);
  }

  ScalarSize primitive_count() const override { return m_model->facts().meshlets; }
  ScalarBoundingBox3f bbox() const override { return m_bbox; }
  ScalarBoundingBox3f bbox(ScalarIndex index) const override {
    return to_bbox<ScalarBoundingBox3f>(m_model->box(index));
  }
  bool has_flipped_normals() const override { return m_model->options().flip_normals; }

  // --- sampling ---

  Float surface_area() const override { return m_surface_area; }

  PositionSample3f sample_position(Float time, const Point2f& sample_, Mask active) const override {
    MI_MASK_ARGUMENT(active);
    Point2f sample = sample_;
    UInt32 meshlet;
    std::tie(meshlet, sample.y()) = m_area_pmf.sample_reuse(sample.y(), active);
    auto w = m_queries.sample(meshlet, sample, active);
    PositionSample3f ps = dr::zeros<PositionSample3f>();
    ps.p = triple<Point3f>(w, kWordP);
    ps.uv = Point2f(w[kWordUv], w[kWordUv + 1]);
    ps.n = triple<Normal3f>(w, kWordN);
    ps.time = time;
    ps.pdf = 1.f / m_surface_area;
    ps.delta = false;
    return ps;
  }

  Float pdf_position(const PositionSample3f&, Mask) const override { return 1.f / m_surface_area; }

  // --- ray tracing ---

  template <typename FloatP, typename Ray3fP>
  std::tuple<dr::mask_t<FloatP>, FloatP, Point<FloatP, 2>, dr::uint32_array_t<FloatP>,
             dr::uint32_array_t<FloatP>>
  ray_intersect_preliminary_impl(const Ray3fP& ray, ScalarIndex meshlet,
                                 dr::mask_t<FloatP> active) const {
    using UInt32P = dr::uint32_array_t<FloatP>;
    if constexpr (dr::is_jit_v<FloatP>) {
      Throw("meshlet_edgebreaker: rays can only be traced through a scene");
    } else if constexpr (dr::is_array_v<FloatP>) {
      constexpr int N = int(dr::size_v<FloatP>);
      Hits<N> hits;
      m_model->intersect(meshlet, to_rays<FloatP>(ray, active), hits);
      alignas(64) float t[N], u[N], v[N];
      std::fill(t, t + N, dr::Infinity<float>);
      for (uint32_t rest = hits.found; rest; rest &= rest - 1) {
        int lane = __builtin_ctz(rest);
        t[lane] = hits.of[lane].t;
        u[lane] = hits.of[lane].b1;
        v[lane] = pack_triangle(hits.of[lane]);
      }
      FloatP distance = dr::load_aligned<FloatP>(t);
      return {distance < dr::Infinity<FloatP>, distance,
              Point<FloatP, 2>(dr::load_aligned<FloatP>(u), dr::load_aligned<FloatP>(v)),
              UInt32P(uint32_t(-1)), UInt32P(meshlet)};
    } else {
      Hits<1> hits;
      m_model->intersect(meshlet, to_rays<FloatP>(ray, active), hits);
      if (!hits.found)
        return {false, dr::Infinity<FloatP>, Point<FloatP, 2>(0.f), uint32_t(-1), meshlet};
      return {true, hits.of[0].t, Point<FloatP, 2>(hits.of[0].b1, pack_triangle(hits.of[0])),
              uint32_t(-1), meshlet};
    }
  }

  template <typename FloatP, typename Ray3fP>
  dr::mask_t<FloatP> ray_test_impl(const Ray3fP& ray, ScalarIndex meshlet,
                                   dr::mask_t<FloatP> active) const {
    if constexpr (dr::is_jit_v<FloatP>) {
      Throw("meshlet_edgebreaker: rays can only be traced through a scene");
    } else if constexpr (dr::is_array_v<FloatP>) {
      constexpr int N = int(dr::size_v<FloatP>);
      uint32_t found = m_model->occlude(meshlet, to_rays<FloatP>(ray, active));
      alignas(64) float hit[N];
      for (int lane = 0; lane < N; lane++) hit[lane] = float(found >> lane & 1u);
      return dr::load_aligned<FloatP>(hit) != 0.f;
    } else {
      return m_model->occlude(meshlet, to_rays<FloatP>(ray, active)) != 0;
    }
  }

  MI_SHAPE_DEFINE_RAY_INTERSECT_METHODS()

  SurfaceInteraction3f compute_surface_interaction(const Ray3f& /*ray*/,
                                                   const PreliminaryIntersection3f& pi,
                                                   uint32_t ray_flags, uint32_t recursion_depth,
                                                   Mask active) const override {
    MI_MASK_ARGUMENT(active);
    if (!m_is_instance && recursion_depth > 0) return dr::zeros<SurfaceInteraction3f>();
    UInt32 packed = dr::reinterpret_array<UInt32>(pi.prim_uv.y());
    auto w = m_queries.surface(pi.prim_index, packed, pi.prim_uv.x(),
                               has_flag(ray_flags, RayFlags::dNSdUV), active);
    SurfaceInteraction3f si = to_interaction(w, ray_flags);
    si.t = dr::select(active, pi.t, dr::Infinity<Float>);
    si.prim_index = pi.prim_index * kMeshletTriangles + (packed >> kTriangleShift);
    return si;
  }

  SurfaceInteraction3f eval_parameterization(const Point2f& uv, uint32_t ray_flags,
                                             Mask active) const override {
    MI_MASK_ARGUMENT(active);
    auto w = m_queries.texcoord(uv, active);
    SurfaceInteraction3f si = to_interaction(w, ray_flags);
    si.t = dr::select(active && w[kWordFound] != 0.f, 0.f, dr::Infinity<Float>);
    si.prim_index = dr::reinterpret_array<UInt32>(w[kWordPrimIndex]);
    return si;
  }

  // --- attributes ---

  Mask has_attribute(std::string_view name, Mask active) const override {
    uint32_t index;
    return m_model->attribute(std::string(name), index) ? Mask(true)
                                                        : Base::has_attribute(name, active);
  }

  UnpolarizedSpectrum eval_attribute(std::string_view name, const SurfaceInteraction3f& si,
                                     Mask active) const override {
    uint32_t index;
    const Attribute* attribute = m_model->attribute(std::string(name), index);
    if (!attribute) return Base::eval_attribute(name, si, active);
    // As in Mitsuba's meshes, colours become spectra of their reflectance.
    bool color = attribute->components == 3 && name.find("color") != std::string_view::npos;
    auto w =
        m_queries.attribute(index, color && is_spectral_v<Spectrum>, si.prim_index, si.p, active);
    if (attribute->components == 1) return UnpolarizedSpectrum(w[0]);
    if (attribute->components == 3) {
      if constexpr (is_spectral_v<Spectrum>) {
        if (color) {
          UnpolarizedSpectrum mixed(0.f);
          for (int k = 0; k < 3; k++)
            mixed += w[kWordWeight + k] *
                     srgb_model_eval<UnpolarizedSpectrum>(
                         triple<dr::Array<Float, 3>>(w, kWordCorner + 3 * k), si.wavelengths);
          return mixed;
        }
      } else if constexpr (is_monochromatic_v<Spectrum>) {
        return luminance(triple<Color3f>(w, 0));
      } else {
        return triple<Color3f>(w, 0);
      }
    }
    return wrong_size<UnpolarizedSpectrum>("eval_attribute", *attribute);
  }

  Float eval_attribute_1(std::string_view name, const SurfaceInteraction3f& si,
                         Mask active) const override {
    uint32_t index;
    const Attribute* attribute = m_model->attribute(std::string(name), index);
    if (!attribute) return Base::eval_attribute_1(name, si, active);
    if (attribute->components != 1) return wrong_size<Float>("eval_attribute_1", *attribute);
    return m_queries.attribute(index, false, si.prim_index, si.p, active)[0];
  }

  Color3f eval_attribute_3(std::string_view name, const SurfaceInteraction3f& si,
                           Mask active) const override {
    uint32_t index;
    const Attribute* attribute = m_model->attribute(std::string(name), index);
    if (!attribute) return Base::eval_attribute_3(name, si, active);
    if (attribute->components != 3) return wrong_size<Color3f>("eval_attribute_3", *attribute);
    auto w = m_queries.attribute(index, false, si.prim_index, si.p, active);
    return triple<Color3f>(w, 0);
  }

  std::string to_string() const override {
    const ModelFacts& facts = m_model->facts();
    Statistics s = m_model->cache().statistics();
    std::ostringstream oss;
    oss << "MeshletEdgebreaker[" << std::endl
        << "  bbox = " << string::indent(bbox()) << "," << std::endl
        << "  triangles = " << facts.triangles << " in " << facts.meshlets << " meshlets,"
        << std::endl
        << "  compressed = " << util::mem_string(facts.compressed_bytes) << "," << std::endl
        << "  cache = " << util::mem_string(s.resident_bytes) << " of at most "
        << util::mem_string(s.limit_bytes) << "," << std::endl
        << "  surface_area = " << m_surface_area << "," << std::endl
        << "  " << string::indent(get_children_string()) << std::endl
        << "]";
    return oss.str();
  }

  MI_DECLARE_CLASS(MeshletEdgebreaker)
  MI_TRAVERSE_CB(Base, m_area_pmf, m_queries.function, m_queries.model_handle)

 private:
  using Words = typename Queries<Float>::Words;

  // Three words of an answer from word `first` on.
  template <typename Triple>
  static Triple triple(const Words& w, uint32_t first) {
    return Triple(w[first], w[first + 1], w[first + 2]);
  }

  SurfaceInteraction3f to_interaction(const Words& w, uint32_t ray_flags) const {
    SurfaceInteraction3f si = dr::zeros<SurfaceInteraction3f>();
    si.p = triple<Point3f>(w, kWordP);
    si.uv = Point2f(w[kWordUv], w[kWordUv + 1]);
    si.n = triple<Normal3f>(w, kWordN);
    si.sh_frame.n = triple<Normal3f>(w, kWordShadingN);
    si.dp_du = triple<Vector3f>(w, kWordDpDu);
    si.dp_dv = triple<Vector3f>(w, kWordDpDv);
    if (has_flag(ray_flags, RayFlags::dNSdUV)) {
      si.dn_du = triple<Vector3f>(w, kWordDnDu);
      si.dn_dv = triple<Vector3f>(w, kWordDnDv);
    }
    si.shape = this;
    si.instance = nullptr;
    return si;
  }

  template <typename Result>
  static Result wrong_size(const char* function, const Attribute& attribute) {
    if constexpr (dr::is_jit_v<Float>)
      return dr::zeros<Result>();  // as Mitsuba's meshes do during tracing
    else
      Throw("%s(): attribute \"%s\" has %u components", function, attribute.name,
            attribute.components);
  }

  std::unique_ptr<Model> m_model;
  Queries<Float> m_queries;
  DiscreteDistribution<Float> m_area_pmf;
  ScalarFloat m_surface_area = 0.f;
  uint32_t m_face_count;
  ScalarBoundingBox3f m_bbox;
  double m_cache_id = 0;
};

namespace {

// --- construction ---

// docs/mitsuba.md lists the parameters.
Options read_options(const Properties& props) {
  Options options;
  options.accel = props.get<std::string>("accel", options.accel);
  if (options.accel != "auto" && options.accel != "cache" && options.accel != "triangles")
    Throw("meshlet_edgebreaker: accel must be auto, cache or triangles, not \"%s\"", options.accel);
  options.cache_is_given = props.has_property("cache") || props.has_property("cache_bytes") ||
                           props.has_property("cache_group");
  options.cache_fraction = props.get<double>("cache", options.cache_fraction);
  options.cache_bytes = props.get<int64_t>("cache_bytes", options.cache_bytes);
  options.cache_group = props.get<std::string>("cache_group", "");
  options.face_normals = props.get<bool>("face_normals", false);
  options.flip_normals = props.get<bool>("flip_normals", false);
  options.flip_texcoords = props.get<bool>("flip_tex_coords", false);
  options.smooth_normals = props.get<bool>("smooth_normals", false);
  if (props.get<std::string>("cache_policy", "clock") != "clock")
    Throw("meshlet_edgebreaker: there is one cache_policy, clock; leave the parameter out");
  if (!(options.cache_fraction >= 0.0 && options.cache_fraction <= 1.0))
    Throw("meshlet_edgebreaker: cache must be between 0 and 1, not %g", options.cache_fraction);
  return options;
}

template <typename Transform>
Affine to_affine(const Transform& transform) {
  Affine result;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 4; j++) result.m[i][j] = float(transform.matrix.entry(i, j));
  return result;
}

float positive(const Properties& props, const char* name, float otherwise) {
  const float value = props.get<float>(name, otherwise);
  if (!(value >= 0.0f && std::isfinite(value)))
    Throw("meshlet_edgebreaker: %s must be 0 or more, not %g", name, value);
  return value;
}

template <typename Float, typename Spectrum>
Selection read_selection(const Properties& props) {
  MI_IMPORT_CORE_TYPES()
  Affine to_world =
      to_affine(props.get<ScalarAffineTransform4f>("to_world", ScalarAffineTransform4f()));
  Selection selection;
  selection.mesh = props.get<int>("mesh", selection.mesh);
  selection.primitive = props.get<int>("primitive", selection.primitive);
  static_assert(sizeof(selection.to_world) == sizeof(to_world.m));
  std::memcpy(selection.to_world, to_world.m, sizeof(to_world.m));
  selection.lod_error = positive(props, "lod_error", selection.lod_error);
  selection.pixels_per_unit = positive(props, "lod_pixels_per_unit", selection.pixels_per_unit);
  selection.has_eye = props.has_property("lod_eye");
  const ScalarPoint3f eye = props.get<ScalarPoint3f>("lod_eye", ScalarPoint3f(0.f));
  for (int i = 0; i < 3; i++) selection.eye[i] = float(eye[i]);
  return selection;
}

// Without the shape's own transform. As glTF has it, outsides stay outside under nodes that mirror;
// under a transform of the shape that mirrors, only if keep_outside asks for it: as with Mitsuba's
// meshes, geometric normals turn.
std::vector<Primitive> read(const std::string& filename, const Selection& selection,
                            bool keep_outside) {
  Affine to_world;
  if (keep_outside) std::memcpy(to_world.m, selection.to_world, sizeof(to_world.m));
  std::vector<Primitive> primitives = read_primitives(filename, selection);
  for (Primitive& primitive : primitives)
    primitive.flip_winding = (to_world * primitive.to_world).determinant() < 0.f;
  return primitives;
}

// Whether rays decode meshlets.
bool uses_cache(const Options& options, std::vector<Primitive>& primitives) {
  if (options.accel == "cache" && options.smooth_normals)
    throw std::runtime_error("accel cache has no smooth_normals, since it decodes meshlets alone");
  if (options.accel != "auto" || options.smooth_normals) return options.accel == "cache";
  return options.cache_is_given || !fits_memory(check_primitives(primitives).triangles);
}

template <typename Float, typename Spectrum>
ref<Object> make(const Properties& props) {
  std::string given = props.get<std::string>("filename");
  if (props.has_property("decoded"))
    Throw("meshlet_edgebreaker: decoded was removed; use mitsuba_plugin.load_scene(decoded=True)");
  const Options options = read_options(props);
  const Selection selection = read_selection<Float, Spectrum>(props);
  std::string filename = file_resolver()->resolve(given).string();
  try {
    std::vector<Primitive> primitives =
        read(filename, selection, props.get<bool>("keep_outside", false));
    if constexpr (dr::is_cuda_v<Float>) {
      if (options.accel == "cache" || (options.accel == "auto" && options.cache_is_given))
        throw std::runtime_error(
            "cuda variants have no cache; leave it out, or use a scalar or llvm variant");
    } else if (uses_cache(options, primitives)) {
      Affine to_world;
      std::memcpy(to_world.m, selection.to_world, sizeof(to_world.m));
      for (Primitive& primitive : primitives) {
        primitive.to_world = to_world * primitive.to_world;
        primitive.flip_texcoords = options.flip_texcoords;
      }
      return new MeshletEdgebreaker<Float, Spectrum>(
          props, std::make_unique<Model>(std::move(primitives), options, on_all_threads));
    }
    return new ResidentMeshlets<Float, Spectrum>(props, std::move(primitives), options);
  } catch (const std::runtime_error& error) {
    Throw("meshlet_edgebreaker: %s: %s", given, error.what());
  }
}

struct Plugin {
  template <typename Float, typename Spectrum>
  static ref<Object> make(void*, const Properties& props) {
    return mitsuba::make<Float, Spectrum>(props);
  }
};

}  // namespace

NAMESPACE_END(mitsuba)

extern "C" MI_EXPORT void meshlet_register(const char* name) {
  mitsuba::register_variants<mitsuba::Plugin>(name, mitsuba::ObjectType::Shape);
}
extern "C" MI_EXPORT const char* meshlet_mitsuba_version() { return MI_VERSION; }
