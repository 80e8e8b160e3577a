// The serial decoder's comparisons of bit positions do not wrap: it refuses residuals behind the
// end of a blob of nearly 2^29 bytes, which is longer than readers accept. The memory behind the
// blob cannot be read.
#include <sys/mman.h>

#include <cstdio>
#include <initializer_list>
#include <memory>

#include "decode/serial_decoder.h"

namespace gltf_meshlet_codec {
namespace {

constexpr uint32_t kBytes = (1u << 29) - 4, kPage = 1u << 16;

// The field of the residuals' code, and the bytes from the meshlet's
// start to the blob's end. Low bits begin about 100 bits before 2^32.
struct Case {
  const char* name;
  uint32_t field, from_end;
};

struct Bits {
  uint8_t* blob;
  uint64_t at;

  void put(uint32_t value, uint32_t bits) {
    for (uint32_t i = 0; i < bits; i++, at++)
      if (value >> i & 1) blob[at >> 3] |= uint8_t(1u << (at & 7));
  }
};

void put_word(uint8_t* blob, uint32_t word, uint32_t value) {
  std::memcpy(blob + 4 * size_t(word), &value, 4);
}

// A triangle; stream 0 without bits, stream 1 with eight residuals.
void write_blob(uint8_t* blob, const Case& c) {
  constexpr uint32_t kStreams = 2, kBase = 28;
  const uint32_t group = BLOB_HEADER_WORDS + kStreams * BLOB_STREAM_WORDS;
  put_word(blob, BLOB_WORD_VERSION, BLOB_VERSION | kStreams << 8);
  put_word(blob, BLOB_WORD_MESHLETS, 1);
  put_word(blob, BLOB_WORD_BYTES, kBytes);
  put_word(blob, BLOB_HEADER_WORDS, KIND_GRID | 3u << 8 | 1u << 16 | PREDICT_COPY << 24);
  const uint32_t second = BLOB_HEADER_WORDS + BLOB_STREAM_WORDS;
  put_word(blob, second, KIND_INTEGER | 4u << 8 | 32u << 16 | PREDICT_COPY << 24);
  put_word(blob, second + 1, kBase << 8);
  put_word(blob, group, kBytes - c.from_end);
  Bits bits{blob, 8ull * (kBytes - c.from_end)};
  bits.put(0, BLOB_TRIANGLE_BITS);
  bits.put(CODE_ESCAPE, CODE_BITS);
  bits.put(0, 3 * WIDTH_BITS);
  bits.put(c.field, CODE_BITS);
  if (c.field == CODE_ESCAPE) bits.put((1u << 4 * WIDTH_BITS) - 1, 4 * WIDTH_BITS);
  bits.put(0, 3);  // anchors
  for (int i = 0; i < 4; i++) bits.put(0, 32);
  if (c.field != CODE_ESCAPE) bits.put(0xFF, 8);
}

bool refused(uint8_t* blob, const Case& c) {
  std::memset(blob + kBytes - kPage, 0, kPage);
  write_blob(blob, c);
  const auto decoder = std::make_unique<SerialDecoder>();
  decoder->data = blob;
  decoder->size = kBytes;
  decoder->load_streams(0, 2);
  decoder->decode_meshlet(0);
  return decoder->error == ERROR_UNARY;
}

}  // namespace
}  // namespace gltf_meshlet_codec

int main() {
  using namespace gltf_meshlet_codec;
  const size_t mapped = size_t(kBytes) + 4 + kPage;
  void* memory = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return std::fprintf(stderr, "FAILED: no memory\n"), 1;
  uint8_t* const blob = static_cast<uint8_t*>(memory) + 4;
  if (mprotect(blob + kBytes, kPage, PROT_NONE)) return std::fprintf(stderr, "FAILED\n"), 1;
  int failures = 0;
  for (const Case& c : {Case{"fixed", CODE_ESCAPE, 31}, Case{"Rice", 3, 29},
                        Case{"exp-Golomb", CODE_FIRST_EXPONENTIAL + 2, 29}}) {
    if (refused(blob, c)) continue;
    std::fprintf(stderr, "FAILED: %s residuals behind the end of a blob\n", c.name);
    failures++;
  }
  return failures;
}
