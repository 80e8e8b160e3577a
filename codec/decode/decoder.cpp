#include "decode/decoder.h"

#include "decode/build.h"
#ifdef MESHLET_AVX2
#include <cpuid.h>
#endif

namespace meshlet {

// The caller deletes the decoder. bulk_decoder.cpp defines one for each build.
inline namespace MESHLET_BUILD {
Decoder* new_decoder();
}

#ifdef MESHLET_AVX2
namespace avx2 {
Decoder* new_decoder();

// Does the processor have the instruction sets of avx2_options (codec/CMakeLists.txt)?
static bool supported() {
  unsigned a, b, c = 0, d;  // not every compiler's __builtin_cpu_supports knows lzcnt
  return __get_cpuid(0x80000001u, &a, &b, &c, &d) && (c & bit_LZCNT) &&
         __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
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

void Decoder::open(const Blob& blob) {
  data_ = blob.data;
  size_ = uint32_t(blob.size);
  vertex_count_ = blob.header.vertex_count;
  meshlet_count_ = blob.header.meshlet_count;
  stream_count_ = uint32_t(blob.header.streams.size());
  streams_ = blob.header.streams.data();
  opened();
}

DecodedCounts Decoder::decode(uint32_t first, uint32_t count, StreamRange streams,
                              const Outputs& out) {
  DecodedCounts counts;
  if (const Problem problem = try_decode(first, count, streams, out, counts)) refuse(problem);
  return counts;
}

DecodedMeshlet Decoder::meshlet(uint32_t m, StreamRange streams) {
  DecodedMeshlet decoded;
  Outputs out;
  out.meshlet = &decoded;
  decode(m, 1, streams, out);
  return decoded;
}

void Decoder::validate() {
  if (const Problem problem = try_validate()) refuse(problem);
}

}  // namespace meshlet
