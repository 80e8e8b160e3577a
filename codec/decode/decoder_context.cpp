#include "decode/decoder_context.h"

namespace meshlet {

#ifdef MESHLET_AVX2
namespace avx2 {
void decode_one(void* decoder, uint32_t meshlet);
BlobResult decode_blob(const BlobJob& job);

// Does the processor have the instruction sets of MESHLET_AVX2_OPTIONS (codec/CMakeLists.txt)?
static bool supported() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
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

[[noreturn]] void throw_malformed(uint32_t meshlet, const char* problem) {
  throw Malformed("meshlet " + std::to_string(meshlet) + ": " + problem);
}

}  // namespace

DecoderContext::DecoderContext(const uint8_t* data, size_t size)
    : header_(read_blob_header(data, size)), decoder_(std::make_unique<SerialDecoder>()) {
  decoder_->data = data;
  decoder_->size = uint32_t(size);
  decoder_->load_streams(0, uint32_t(header_.streams.size()));
}

SerialDecoder& DecoderContext::meshlet(uint32_t m) {
#ifdef MESHLET_AVX2
  if (avx2::supported())
    avx2::decode_one(decoder_.get(), m);
  else
#endif
    decode_one(decoder_.get(), m);
  if (decoder_->error != ERROR_NONE) throw_malformed(m, error_text(decoder_->error));
  return *decoder_;
}

namespace {

void check(const BlobResult& result) {
  switch (result.problem) {
    case BlobProblem::kNone: return;
    case BlobProblem::kMalformedMeshlet: throw_malformed(result.meshlet, error_text(result.error));
    case BlobProblem::kInconsistent:
      throw_malformed(result.meshlet, "a shared vertex differs from its owner's");
    case BlobProblem::kOverlap:
      throw_malformed(result.meshlet, "its data run past the start of the next meshlet");
    case BlobProblem::kTooManyVertices:
      throw Malformed("the blob has more vertices than its header says");
    case BlobProblem::kTooFewVertices:
      throw Malformed("the blob has fewer vertices than its header says");
  }
}

}  // namespace

BlobJob DecoderContext::job() const {
  BlobJob job{};
  job.data = decoder_->data;
  job.size = decoder_->size;
  job.vertex_count = header_.vertex_count;
  job.meshlet_count = header_.meshlet_count;
  job.stream_count = uint32_t(header_.streams.size());
  job.streams = header_.streams.data();
  return job;
}

void DecoderContext::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values) {
  BlobJob all = job();
  all.triangles = triangles;
  all.integers = integers;
  all.values = values;
#ifdef MESHLET_AVX2
  if (avx2::supported()) return check(avx2::decode_blob(all));
#endif
  check(decode_blob(all));
}

void DecoderContext::validate() { check(validate_blob(job())); }

}  // namespace meshlet
