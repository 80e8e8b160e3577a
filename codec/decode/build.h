// The instruction sets that the decoder is compiled for: those of the compiler's options, and on
// x86-64 AVX2 beside them, in one compilation. What has a guard instead of #pragma once is compiled
// again between avx2_begin.h and avx2_end.h, in a namespace of its own. The decoder is made for the
// processor when the program runs.
#pragma once

// Not for 32-bit x86, which has no bit instructions on 64 bits.
#if defined(__x86_64__) && defined(__AVX2__) && defined(__BMI__) && defined(__BMI2__) && \
    defined(__LZCNT__) && defined(__POPCNT__)
#define MESHLET_AVX2 1  // is this code for AVX2?
#else
#define MESHLET_AVX2 0
// clang-cl hides the intrinsics of sets that its options do not name.
#if defined(__x86_64__) && !defined(_MSC_VER) && !defined(GLTF_MESHLET_NO_AVX2)
#define MESHLET_AVX2_BESIDE
#endif
#endif
#define MESHLET_BUILD baseline

#if MESHLET_AVX2 || defined(MESHLET_AVX2_BESIDE)
#include <immintrin.h>
#endif

namespace gltf_meshlet_codec {
namespace baseline {}
using namespace baseline;
}  // namespace gltf_meshlet_codec
