// The variants of Mitsuba's wheel, which the plugins are compiled for.
#pragma once
#include <mitsuba/core/plugin.h>
#include <mitsuba/core/spectrum.h>

NAMESPACE_BEGIN(mitsuba)

// Plugin::make<Float, Spectrum>(payload, properties) creates an object of a variant.
template <typename Plugin, JitBackend backend>
void register_jit_variants(const char* name, ObjectType type, const std::string& prefix) {
  using F = dr::DiffArray<backend, float>;
  using Spectral = Spectrum<F, 4>;
  auto add = [&](const char* colors, PluginInstantiateFn make) {
    PluginManager::instance()->register_plugin(name, prefix + colors, type, make, nullptr, nullptr);
  };
  add("rgb", &Plugin::template make<F, Color<F, 3>>);
  add("spectral", &Plugin::template make<F, Spectral>);
  if constexpr (backend == JitBackend::LLVM) {
    add("mono", &Plugin::template make<F, Color<F, 1>>);
    add("mono_polarized", &Plugin::template make<F, MuellerMatrix<Color<F, 1>>>);
    add("spectral_polarized", &Plugin::template make<F, MuellerMatrix<Spectral>>);
  }
}

template <typename Plugin>
void register_variants(const char* name, ObjectType type) {
  using Spectral = Spectrum<float, 4>;
  auto add = [&](const char* variant, PluginInstantiateFn make) {
    PluginManager::instance()->register_plugin(name, variant, type, make, nullptr, nullptr);
  };
  add("scalar_rgb", &Plugin::template make<float, Color<float, 3>>);
  add("scalar_spectral", &Plugin::template make<float, Spectral>);
  add("scalar_spectral_polarized", &Plugin::template make<float, MuellerMatrix<Spectral>>);
  register_jit_variants<Plugin, JitBackend::LLVM>(name, type, "llvm_ad_");
  register_jit_variants<Plugin, JitBackend::CUDA>(name, type, "cuda_ad_");
}

NAMESPACE_END(mitsuba)
