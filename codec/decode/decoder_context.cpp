#include "decode/decoder_context.h"

namespace meshlet {

#ifdef MESHLET_AVX2
namespace avx2 {
BlobResult decode_blob(const BlobJob& job);

// Does this machine have what CMakeLists.txt lets the compiler use?
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
    case ERROR_CODE: return "a Rice parameter is above 31";
    case ERROR_UNARY: return "a meshlet's residuals run past the end of the blob";
    default: return "malformed";
  }
}

Decoder::Decoder(const uint8_t* data, size_t size)
    : header_(read_blob_header(data, size)), lane_(std::make_unique<SerialDecoder>()) {
  lane_->data = data;
  lane_->size = uint32_t(size);
  lane_->load_streams(0, uint32_t(header_.streams.size()));
}

SerialDecoder& Decoder::meshlet(uint32_t m) {
  lane_->decode_meshlet(m);
  check(m);
  return *lane_;
}

void Decoder::check(uint32_t m) const {
  if (lane_->error != ERROR_NONE)
    throw Malformed("meshlet " + std::to_string(m) + ": " + error_text(lane_->error));
}

namespace {

void check(const BlobResult& result) {
  switch (result.problem) {
    case BlobProblem::none: return;
    case BlobProblem::malformed_meshlet:
      throw Malformed("meshlet " + std::to_string(result.meshlet) + ": " +
                      error_text(result.error));
    case BlobProblem::inconsistent:
      throw Malformed("meshlet " + std::to_string(result.meshlet) +
                      ": a shared vertex differs from its owner's");
    case BlobProblem::too_many_vertices:
      throw Malformed("the blob has more vertices than its header says");
    case BlobProblem::too_few_vertices:
      throw Malformed("the blob has fewer vertices than its header says");
  }
}

}  // namespace

BlobJob Decoder::job() const {
  BlobJob job{};
  job.data = lane_->data;
  job.size = lane_->size;
  job.vertex_count = header_.vertex_count;
  job.meshlet_count = header_.meshlet_count;
  job.stream_count = uint32_t(header_.streams.size());
  job.streams = header_.streams.data();
  return job;
}

void Decoder::decode(uint32_t* triangles, uint32_t* const* integers, void* const* values) {
  BlobJob all = job();
  all.triangles = triangles;
  all.integers = integers;
  all.values = values;
#ifdef MESHLET_AVX2
  if (avx2::supported()) return meshlet::check(avx2::decode_blob(all));
#endif
  meshlet::check(decode_blob(all));
}

void Decoder::validate() { meshlet::check(validate_blob(job())); }

}  // namespace meshlet
