// The codec's decoder as a WebAssembly module, for decoder.js: flat functions over one open blob.
#include "decode/bulk_decoder.h"
#include "heap.h"

// Throws a JavaScript exception with this problem's sentence.
extern "C" __attribute__((import_module("host"), import_name("refuse"))) [[noreturn]] void
host_refuse(const char* text, uint32_t number, uint32_t meshlet);

void out_of_memory() { host_refuse("the decoded arrays do not fit into memory", 0, NO_MESHLET); }

namespace {

gltf_meshlet_codec::Blob* blob = nullptr;        // that is open
gltf_meshlet_codec::Decoder* decoder = nullptr;  // open on it; made when it is needed

void check(const gltf_meshlet_codec::Problem& p) {
  if (p) host_refuse(p.text, p.number, p.meshlet);
}

gltf_meshlet_codec::Decoder& open_decoder() {
  if (!decoder) {
    decoder = new gltf_meshlet_codec::BlobDecoder;
    decoder->open(*blob);
  }
  return *decoder;
}

}  // namespace

// Frees everything. Call before the first allocation.
EXPORT(reset) void reset() {
  free_all();
  blob = nullptr;
  decoder = nullptr;
}

// Opens a blob, which must stay in memory; checks its header and tables.
EXPORT(open_blob) void open_blob(const uint8_t* data, size_t size) {
  blob = new gltf_meshlet_codec::Blob{data, size, {}};
  check(gltf_meshlet_codec::read_blob_header(data, size, blob->header));
}

// The functions below need an open blob.

// See Decoder::decode. Returns words: number of triangles, number of vertices.
EXPORT(decode)
const uint32_t* decode(uint32_t first, uint32_t count, uint32_t first_vertex, uint32_t* triangles,
                       uint32_t* const* integers, void* const* values) {
  static uint32_t words[2];
  gltf_meshlet_codec::DecodedCounts counts;
  check(
      open_decoder().decode(first, count, {}, {triangles, integers, values, first_vertex}, counts));
  words[0] = counts.triangles;
  words[1] = counts.vertices;
  return words;
}

// Decodes meshlet m < meshlet_count. Returns words: triangle count, vertex count, address of the
// packed triangles, then per stream the address of the first vertex's integers.
EXPORT(decode_meshlet) const uint32_t* decode_meshlet(uint32_t m) {
  static uint32_t words[3 + BLOB_MAX_STREAMS];
  gltf_meshlet_codec::DecodedMeshlet decoded;
  check(open_decoder().meshlet(m, decoded));
  words[0] = decoded.triangle_count;
  words[1] = decoded.vertex_count;
  words[2] = uint32_t(uintptr_t(decoded.triangles));
  for (uint32_t s = 0; s < blob->header.streams.size(); s++)
    words[3 + s] = uint32_t(uintptr_t(decoded.vertex(s, 0)));
  return words;
}

EXPORT(validate) void validate() { check(open_decoder().validate()); }
