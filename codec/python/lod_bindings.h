// The part of gltf_ext._codec that builds levels of detail.
#pragma once
#include <nanobind/nanobind.h>

namespace meshlet {

void bind_lod(nanobind::module_& m);

}  // namespace meshlet
