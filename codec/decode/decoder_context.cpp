#include "decode/decoder_context.h"

#ifdef MESHLET_AVX2
#include <cpuid.h>
#endif

namespace meshlet {

#ifdef MESHLET_AVX2
namespace avx2 {
MeshletDecoder* new_meshlet_decoder();
RangeDecoder* new_range_decoder(const BlobJob& job, uint32_t begin, uint32_t first_number);

// Does the processor have the instruction sets of MESHLET_AVX2_OPTIONS (codec/CMakeLists.txt)?
static bool supported() {
  unsigned a, b, c = 0, d;  // not every compiler's __builtin_cpu_supports knows lzcnt
  return __get_cpuid(0x80000001u, &a, &b, &c, &d) && (c & bit_LZCNT) &&
         __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("popcnt");
}
}  // namespace avx2
#endif

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

namespace {

[[noreturn]] void refuse_meshlet(uint32_t meshlet, const char* problem) {
  refuse({problem, 0, meshlet});
}

}  // namespace

MeshletDecoder::~MeshletDecoder() = default;
RangeDecoder::~RangeDecoder() = default;

std::unique_ptr<MeshletDecoder> make_meshlet_decoder() {
#ifdef MESHLET_AVX2
  if (avx2::supported()) return std::unique_ptr<MeshletDecoder>(avx2::new_meshlet_decoder());
#endif
  return std::unique_ptr<MeshletDecoder>(new_meshlet_decoder());
}

DecoderContext::DecoderContext(const uint8_t* data, size_t size)
    : data_(data), size_(size), header_(read_blob_header(data, size)) {}

DecodedMeshlet DecoderContext::meshlet(uint32_t m) {
  if (!decoder_) {
    decoder_ = make_meshlet_decoder();
    decoder_->open(data_, size_);
  }
  const DecodedMeshlet decoded = decoder_->decode(m);
  if (decoded.error != ERROR_NONE) refuse_meshlet(m, error_text(decoded.error));
  return decoded;
}

namespace {

void check(const BlobResult& result) {
  switch (result.problem) {
    case BlobProblem::kNone: return;
    case BlobProblem::kMalformedMeshlet: refuse_meshlet(result.meshlet, error_text(result.error));
    case BlobProblem::kInconsistent:
      refuse_meshlet(result.meshlet, "a shared vertex differs from its owner's");
    case BlobProblem::kOverlap:
      refuse_meshlet(result.meshlet, "its data run past the start of the next meshlet");
    case BlobProblem::kTooManyVertices: refuse({"the blob has more vertices than its header says"});
    case BlobProblem::kTooFewVertices: refuse({"the blob has fewer vertices than its header says"});
  }
}

}  // namespace

BlobJob DecoderContext::job() const {
  BlobJob job{};
  job.data = data_;
  job.size = uint32_t(size_);
  job.vertex_count = header_.vertex_count;
  job.meshlet_count = header_.meshlet_count;
  job.stream_count = uint32_t(header_.streams.size());
  job.streams = header_.streams.data();
  return job;
}

void DecoderContext::start(uint32_t begin, uint32_t first_number) {
#ifdef MESHLET_AVX2
  if (avx2::supported()) return range_.reset(avx2::new_range_decoder(job(), begin, first_number));
#endif
  range_.reset(new_range_decoder(job(), begin, first_number));
}

DecodedPart DecoderContext::decode_next(uint32_t end, const Outputs& outputs) {
  const BlobResult result = range_->decode(end, outputs);
  check(result);
  return result.part;
}

void DecoderContext::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values) {
  start(0, 0);
  decode_next(header_.meshlet_count, {triangles, integers, values, nullptr});
  range_.reset();
}

void DecoderContext::validate() { check(validate_blob(job())); }

}  // namespace meshlet
