// The decoder and the unpacker for each processor, and the choice when the program runs.
#include "decode/build.h"
#include "decode/bulk_decoder.h"
#include "transport/page_unpacker.h"

#ifdef MESHLET_AVX2_BESIDE
#include <cpuid.h>

#include "decode/avx2_begin.h"
#include "decode/bulk_decoder.h"
#include "transport/page_unpacker.h"
#include "decode/avx2_end.h"
#endif

namespace gltf_meshlet_codec {

#ifdef MESHLET_AVX2_BESIDE
namespace {

// Does the system save the registers, too? Not by __builtin_cpu_supports: with Zig's run-time
// library it answers no to everything.
bool detect_avx2() {
  unsigned a, b, c, d;
  if (!__get_cpuid(1, &a, &b, &c, &d)) return false;
  constexpr unsigned kFirst = bit_OSXSAVE | bit_AVX | bit_POPCNT;
  if ((c & kFirst) != kFirst) return false;
  unsigned low, high;  // XCR0: bits 1 and 2 are the registers of SSE and AVX
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  if ((low & 6u) != 6u) return false;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return false;
  constexpr unsigned kSeventh = bit_AVX2 | bit_BMI | bit_BMI2;
  if ((b & kSeventh) != kSeventh) return false;
  return __get_cpuid(0x80000001u, &a, &b, &c, &d) && (c & bit_LZCNT);
}

// Asks once: a virtual machine answers each of these instructions in some microseconds.
bool has_avx2() {
  static const bool has = detect_avx2();
  return has;
}

}  // namespace
#endif

std::unique_ptr<Decoder> make_decoder() {
#ifdef MESHLET_AVX2_BESIDE
  if (has_avx2()) return std::unique_ptr<Decoder>(new avx2::BlobDecoder);
#endif
  return std::unique_ptr<Decoder>(new baseline::BlobDecoder);
}

std::unique_ptr<PageUnpacker> make_page_unpacker() {
#ifdef MESHLET_AVX2_BESIDE
  if (has_avx2()) return std::unique_ptr<PageUnpacker>(new avx2::BlobUnpacker);
#endif
  return std::unique_ptr<PageUnpacker>(new baseline::BlobUnpacker);
}

}  // namespace gltf_meshlet_codec
