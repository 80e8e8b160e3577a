// The Mitsuba texture `meshlet_product`: the product of two textures, as of glTF's vertex colours
// and base colours.
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/properties.h>
#include <mitsuba/render/texture.h>

NAMESPACE_BEGIN(mitsuba)

namespace {

/**!

.. _texture-meshlet_product:

Product (:monosp:`meshlet_product`)
-----------------------------------

.. pluginparameters::

 * - a, b
   - |texture|
   - The factors
   - |exposed|, |differentiable|
 */
template <typename Float, typename Spectrum>
class Product final : public Texture<Float, Spectrum> {
 public:
  MI_IMPORT_TYPES(Texture)
  using Base = Texture;

  explicit Product(const Properties& props)
      : Base(props), m_a(props.get_texture<Texture>("a")), m_b(props.get_texture<Texture>("b")) {}

  void traverse(TraversalCallback* cb) override {
    cb->put("a", m_a, ParamFlags::Differentiable);
    cb->put("b", m_b, ParamFlags::Differentiable);
  }

  UnpolarizedSpectrum eval(const SurfaceInteraction3f& si, Mask active) const override {
    return m_a->eval(si, active) * m_b->eval(si, active);
  }
  Float eval_1(const SurfaceInteraction3f& si, Mask active) const override {
    return m_a->eval_1(si, active) * m_b->eval_1(si, active);
  }
  Color3f eval_3(const SurfaceInteraction3f& si, Mask active) const override {
    return m_a->eval_3(si, active) * m_b->eval_3(si, active);
  }
  Float mean() const override { return m_a->mean() * m_b->mean(); }
  bool is_spatially_varying() const override {
    return m_a->is_spatially_varying() || m_b->is_spatially_varying();
  }

  std::string to_string() const override {
    std::ostringstream out;
    out << "Product[a = " << string::indent(m_a) << ", b = " << string::indent(m_b) << "]";
    return out.str();
  }

  MI_DECLARE_CLASS(Product)

 private:
  ref<Texture> m_a, m_b;

  MI_TRAVERSE_CB(Base, m_a, m_b)
};

template <typename Float, typename Spectrum>
ref<Object> make(void*, const Properties& props) {
  return new Product<Float, Spectrum>(props);
}

template <typename Float>
using Spectral = Spectrum<Float, 4>;
using LlvmFloat = dr::DiffArray<JitBackend::LLVM, float>;
using CudaFloat = dr::DiffArray<JitBackend::CUDA, float>;

}  // namespace

void register_product(const char* name) {
  auto add = [&](const char* variant, PluginInstantiateFn instantiate) {
    PluginManager::instance()->register_plugin(name, variant, ObjectType::Texture, instantiate,
                                               nullptr, nullptr);
  };
  add("scalar_rgb", &make<float, Color<float, 3>>);
  add("scalar_spectral", &make<float, Spectral<float>>);
  add("scalar_spectral_polarized", &make<float, MuellerMatrix<Spectral<float>>>);
  add("llvm_ad_rgb", &make<LlvmFloat, Color<LlvmFloat, 3>>);
  add("llvm_ad_mono", &make<LlvmFloat, Color<LlvmFloat, 1>>);
  add("llvm_ad_mono_polarized", &make<LlvmFloat, MuellerMatrix<Color<LlvmFloat, 1>>>);
  add("llvm_ad_spectral", &make<LlvmFloat, Spectral<LlvmFloat>>);
  add("llvm_ad_spectral_polarized", &make<LlvmFloat, MuellerMatrix<Spectral<LlvmFloat>>>);
  add("cuda_ad_rgb", &make<CudaFloat, Color<CudaFloat, 3>>);
  add("cuda_ad_spectral", &make<CudaFloat, Spectral<CudaFloat>>);
}

NAMESPACE_END(mitsuba)

extern "C" MI_EXPORT void meshlet_register_product(const char* name) {
  mitsuba::register_product(name);
}
