// A broken rule of the format as an exception, for programs that use exceptions.
#pragma once
#include <stdexcept>

#include "format/blob.h"

namespace gltf_meshlet_codec {

// what(): one sentence.
struct Malformed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void throw_if(const Problem& problem) {
  if (problem) throw Malformed(sentence(problem));
}

}  // namespace gltf_meshlet_codec
