// Arguments and results that both parts of gltf_ext._codec have in common.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <string>
#include <utility>
#include <vector>

#include "segment/generate_meshlets.h"

namespace nb = nanobind;

namespace meshlet {

using Indices = nb::ndarray<const uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const uint32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Floats = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

inline std::vector<uint32_t> vector_of(const Numbers& numbers) {
  return {numbers.data(), numbers.data() + numbers.shape(0)};
}

// A numpy array of one dimension that owns the values.
template <class Vector>
nb::object array_of(Vector values) {
  using T = typename Vector::value_type;
  auto* kept = new Vector(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<Vector*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<1>>(kept->data(), {kept->size()}, owner));
}

// Raises ValueError for an index that is out of range or, with `distinct`, occurs twice in a
// triangle.
inline void check_triangles(const Indices& triangles, size_t vertices, bool distinct) {
  if (triangles.shape(0) > UINT32_MAX / 3) throw nb::value_error("there are too many triangles");
  const uint32_t* t = triangles.data();
  for (size_t i = 0; i < triangles.shape(0); i++, t += 3) {
    if (t[0] >= vertices || t[1] >= vertices || t[2] >= vertices)
      throw nb::value_error("a triangle index is out of range");
    if (distinct && (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]))
      throw nb::value_error("a triangle repeats an index");
  }
}

inline Effort effort_of(const std::string& name) {
  if (name == "fast") return Effort::kFast;
  if (name == "normal") return Effort::kNormal;
  if (name == "high") return Effort::kHigh;
  throw nb::value_error("effort is 'fast', 'normal' or 'high'");
}

}  // namespace meshlet
