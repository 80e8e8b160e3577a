// The unpacker of pages, for one instruction set: processors.cpp includes it for each.
#ifndef TRANSPORT_PAGE_UNPACKER_H
#define TRANSPORT_PAGE_UNPACKER_H
#include "transport/blob_emitter.h"
#include "transport/connectivity_coder.h"
#include "transport/normal_coder.h"
#include "transport/page_coder.h"
#include "transport/transport.h"
#include "transport/value_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace {

class BlobUnpacker : public PageUnpacker {
 public:
  Problem unpack(const uint8_t* packed_view, const PackedPage& page, uint8_t* out) override {
    if (page.raw) {
      std::memcpy(out, packed_view + page.packed_begin, page.bytes);
      return {};
    }
    packed_.clear();
    if (!packed_.reserve(page.packed_bytes + transport::Decoder::kPadding)) return {kNoMemory};
    uint8_t* bytes = packed_.grow(page.packed_bytes + transport::Decoder::kPadding);
    std::memcpy(bytes, packed_view + page.packed_begin, page.packed_bytes);
    std::memset(bytes + page.packed_bytes, 0, transport::Decoder::kPadding);
    uint32_t header[transport::kPageHeaderWords];
    if (!coder_.coder.open(bytes, page.packed_bytes, header))
      return {"a packed page is shorter than its header says"};
    const uint64_t triangles = header[0], meshlets = header[1];
    // A meshlet takes at least a byte and a bit for each triangle but its last one.
    if (meshlets < 1 || triangles < meshlets || triangles > MESHLET_TRIANGLES * meshlets ||
        meshlets > page.bytes || triangles > 8 * uint64_t(page.bytes))
      return {"a packed page has impossible counts"};
    coder_.room = page.bytes;
    if (!coder_.begin(nullptr, uint32_t(triangles), uint32_t(meshlets))) return damaged();
    if (!emitter_.begin(page_, page.bytes)) return {kNoMemory};
    for (uint32_t s = 0; s < page_.stream_count(); s++) {
      if (!coder_.code_stream(s)) return damaged();
      if (!emitter_.add_stream(s)) return kWrongLength;
    }
    if (!finished()) return kDamaged;
    return emitter_.emit(out) ? Problem{} : kWrongLength;
  }

 private:
  static constexpr Problem kDamaged = {"a packed page is damaged"};
  static constexpr Problem kWrongLength = {
      "a packed page does not have the length that its table says"};

  Problem damaged() const { return coder_.no_memory ? Problem{kNoMemory} : kDamaged; }

  // Fuzzers go on with pages that end elsewhere, or they would hardly reach the emitter.
  bool finished() {
#ifdef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    return true;
#else
    return coder_.coder.finished();
#endif
  }

  transport::Page page_;
  transport::PageCoder<transport::Decoder> coder_{page_};
  transport::BlobEmitter emitter_;
  transport::Buffer<uint8_t> packed_;
};

}  // namespace
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif
