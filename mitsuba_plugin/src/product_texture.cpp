// The Mitsuba texture `meshlet_product`: the product of two textures, as of glTF's vertex colours
// and base colours.
#include <mitsuba/core/properties.h>
#include <mitsuba/render/texture.h>

#include "variants.h"

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

struct Plugin {
  template <typename Float, typename Spectrum>
  static ref<Object> make(void*, const Properties& props) {
    return new Product<Float, Spectrum>(props);
  }
};

}  // namespace

NAMESPACE_END(mitsuba)

extern "C" MI_EXPORT void meshlet_register_product(const char* name) {
  mitsuba::register_variants<mitsuba::Plugin>(name, mitsuba::ObjectType::Texture);
}
