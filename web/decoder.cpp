// The codec's decoder as a WebAssembly module, for decoder.js: flat functions over one open blob.
#include <cstdint>
#include <new>

#include "decode/decoder.h"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

// Throws a JavaScript exception with this problem's sentence.
extern "C" __attribute__((import_module("host"), import_name("refuse"))) [[noreturn]] void
host_refuse(const char* text, uint32_t number, uint32_t meshlet);

extern "C" unsigned char __heap_base;  // by the linker

namespace {

constexpr uint64_t kPage = 65536;
constexpr uint64_t kMemory = kPage << 16;  // 32-bit addresses
constexpr uint64_t kAlignment = 32;

// Nothing is freed but everything at once, by reset().
uint64_t heap_end = 0;
meshlet::Blob* blob = nullptr;        // that is open
meshlet::Decoder* decoder = nullptr;  // open on it; made when it is needed

void* take(size_t bytes) {
  const uint64_t begin = (heap_end + kAlignment - 1) / kAlignment * kAlignment;
  const uint64_t end = begin + bytes, size = kPage * __builtin_wasm_memory_size(0);
  if (end > kMemory ||
      (end > size &&
       __builtin_wasm_memory_grow(0, size_t((end - size + kPage - 1) / kPage)) == size_t(-1)))
    meshlet::refuse({"the decoded arrays do not fit into memory"});
  heap_end = end;
  return reinterpret_cast<void*>(uintptr_t(begin));
}

meshlet::Decoder& open_decoder() {
  if (!decoder) {
    decoder = meshlet::make_decoder().release();
    decoder->open(*blob);
  }
  return *decoder;
}

}  // namespace

void* operator new(size_t bytes) { return take(bytes); }
void* operator new[](size_t bytes) { return take(bytes); }
void* operator new(size_t bytes, std::align_val_t) { return take(bytes); }
void operator delete(void*) noexcept {}
void operator delete[](void*) noexcept {}
void operator delete(void*, size_t) noexcept {}
void operator delete[](void*, size_t) noexcept {}
void operator delete(void*, std::align_val_t) noexcept {}
void operator delete(void*, size_t, std::align_val_t) noexcept {}

// Called by the standard library for errors that cannot happen here. Its own would bring printf.
extern "C" void abort() { __builtin_trap(); }
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) _NOEXCEPT { __builtin_trap(); }
_LIBCPP_END_NAMESPACE_STD

namespace meshlet {
void refuse(const Problem& p) { host_refuse(p.text, p.number, p.meshlet); }
}  // namespace meshlet

// Frees everything. Call before the first allocation.
EXPORT(reset) void reset() {
  heap_end = uintptr_t(&__heap_base);
  blob = nullptr;
  decoder = nullptr;
}

EXPORT(allocate) void* allocate(size_t bytes) { return take(bytes); }

// Opens a blob, which must stay in memory; checks its header and tables.
EXPORT(open_blob) void open_blob(const uint8_t* data, size_t size) {
  blob = new meshlet::Blob{data, size, meshlet::read_blob_header(data, size)};
}

// The functions below need an open blob.

// See Decoder::decode. Returns words: number of triangles, number of vertices.
EXPORT(decode)
const uint32_t* decode(uint32_t first, uint32_t count, uint32_t first_vertex, uint32_t* triangles,
                       uint32_t* const* integers, void* const* values) {
  static uint32_t words[2];
  const meshlet::DecodedCounts counts =
      open_decoder().decode(first, count, {}, {triangles, integers, values, first_vertex});
  words[0] = counts.triangles;
  words[1] = counts.vertices;
  return words;
}

// Decodes meshlet m < meshlet_count. Returns words: triangle count, vertex count, address of the
// packed triangles, then per stream the address of the first vertex's integers.
EXPORT(decode_meshlet) const uint32_t* decode_meshlet(uint32_t m) {
  static uint32_t words[3 + BLOB_MAX_STREAMS];
  const meshlet::DecodedMeshlet decoded = open_decoder().meshlet(m);
  words[0] = decoded.triangle_count;
  words[1] = decoded.vertex_count;
  words[2] = uint32_t(uintptr_t(decoded.triangles));
  for (uint32_t s = 0; s < blob->header.streams.size(); s++)
    words[3 + s] = uint32_t(uintptr_t(decoded.vertex(s, 0)));
  return words;
}

EXPORT(validate) void validate() { open_decoder().validate(); }
