#include "decode/decoder.h"

#include "decode/build.h"
#ifdef MESHLET_AVX2
#include <cpuid.h>
#endif

namespace gltf_meshlet_codec {

// The caller deletes the decoder. bulk_decoder.cpp defines one for each build.
inline namespace MESHLET_BUILD {
Decoder* new_decoder();
}

#ifdef MESHLET_AVX2
namespace avx2 {
Decoder* new_decoder();

// Does the processor have the instruction sets of avx2_options (codec/CMakeLists.txt), and does the
// system save AVX registers? Not by __builtin_cpu_supports: with Zig's run-time library it answers
// no to everything.
bool detect() {
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
bool supported() {
  static const bool all = detect();
  return all;
}
}  // namespace avx2
#endif

std::unique_ptr<Decoder> make_decoder() {
#ifdef MESHLET_AVX2
  if (avx2::supported()) return std::unique_ptr<Decoder>(avx2::new_decoder());
#endif
  return std::unique_ptr<Decoder>(MESHLET_BUILD::new_decoder());
}

const char* error_text(uint32_t error) {
  switch (error) {
    case ERROR_OFFSET: return "a meshlet's data lie outside the blob";
    case ERROR_CLERS: return "a meshlet's CLERS symbols do not describe disks";
    case ERROR_VERTICES: return "a meshlet has more than 64 vertices";
    case ERROR_REFERENCES: return "a meshlet's references do not fit its boundary";
    case ERROR_OWNER: return "a reference leads to no owned boundary of an earlier meshlet";
    case ERROR_HOPS: return "a corner is more than 8 references away";
    case ERROR_CODE: return "a code's parameter is above 31, or an exp-Golomb value too long";
    case ERROR_UNARY: return "a meshlet's residuals run past the end of the blob";
    default: return "malformed";
  }
}

Decoder::~Decoder() = default;

void Decoder::open(const uint8_t* data, size_t size, const BlobCounts& counts) {
  data_ = data;
  size_ = uint32_t(size);
  vertex_count_ = counts.vertex_count;
  meshlet_count_ = counts.meshlet_count;
  stream_count_ = data[kStreamCountByte];
  for (uint32_t s = 0; s < stream_count_; s++) streams_[s] = read_stream(data, s);
  opened();
}

Problem Decoder::decode(const Outputs& out) {
  DecodedCounts counts;
  return decode(0, meshlet_count_, {}, out, counts);
}

Problem Decoder::meshlet(uint32_t m, DecodedMeshlet& out, StreamRange streams) {
  DecodedCounts counts;
  Outputs outputs;
  outputs.meshlet = &out;
  return decode(m, 1, streams, outputs, counts);
}

}  // namespace gltf_meshlet_codec
