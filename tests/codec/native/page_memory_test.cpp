// What unpacking a page takes is bounded by the resident bytes that its table names, also for pages
// that hold far more than a blob of so many bytes can.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include "transport/encoder.h"
#include "transport/transport.h"

namespace {

// Bytes that operator new has given. Also those that were freed: in WebAssembly none are
// (web/heap.h).
size_t given = 0;

void* allocate(size_t bytes) {
  void* place = std::malloc(bytes);
  if (!place) throw std::bad_alloc();
  given += bytes;
  return place;
}

}  // namespace

void* operator new(size_t bytes) { return allocate(bytes); }
void* operator new[](size_t bytes) { return allocate(bytes); }
void operator delete(void* place) noexcept { std::free(place); }
void operator delete[](void* place) noexcept { std::free(place); }
void operator delete(void* place, size_t) noexcept { std::free(place); }
void operator delete[](void* place, size_t) noexcept { std::free(place); }

namespace {

using namespace gltf_meshlet_codec;
using namespace gltf_meshlet_codec::transport;

enum Border { kLoops, kSeam, kOwnedEdges };

struct Shape {
  const char* name;
  uint32_t triangles;  // of a meshlet
  Symbol symbol;       // of all of them but the last
  uint32_t streams, elements;
  Border border;
};

// Private loops, perhaps with a seam in a first meshlet for each stream: each stream has more
// vertices than the one before. Or an owned reference for each edge of the border.
void add_references(const Shape& shape, Page& page, MeshletRow& m) {
  const uint32_t number = page.meshlets.size() - 1;
  const auto add = [&](Kind kind, uint32_t partner, uint32_t length, bool loop_end) {
    page.references.push({kind == kForeign ? below(shape.streams - number) : 0, partner, number,
                          kind, uint8_t(loop_end), 0, uint8_t(length), 0, 0, 0, 0, 0});
    m.owned |= uint64_t(kind == kOwned) << m.references++;
  };
  if (shape.border == kOwnedEdges) {
    for (uint32_t j = 1; j <= m.border_size; j++) add(kOwned, kNone, 1, j == m.border_size);
  } else if (shape.border == kSeam && number < shape.streams) {
    add(kOwned, m.reference + 2, 1, false);
    add(kPrivate, kNone, 8, false);
    add(kForeign, m.reference, 1, false);
    add(kPrivate, kNone, m.border_size - 10u, true);
  } else {
    for (uint32_t d = 0; d < page.serial.disk_count; d++) add(kPrivate, kNone, 1, true);
    return;
  }
  m.stored_references = m.references;
}

struct PackedShape {
  std::vector<uint8_t> bytes;
  size_t least_bytes;  // resident bytes from which on the unpacker takes all of its meshlets
};

// A page of zeros that takes nearly no bytes.
PackedShape packed_page(const Shape& shape, uint32_t meshlets) {
  Page page, known;
  page.clear();
  size_t least_bytes = 0;
  for (uint32_t s = 0; s < shape.streams; s++)
    page.rows.push({{KIND_INTEGER | shape.elements << 8 | 1u << 16, 0, 0, 0, 0, 0, 0}});
  for (uint32_t i = 0; i < meshlets; i++) {
    MeshletRow& m = page.begin_meshlet();
    m.triangles = uint8_t(shape.triangles);
    m.symbols[shape.symbol] = below(shape.triangles - 1);
    m.symbols[kE] |= 1ull << (shape.triangles - 1);
    if (!page.decode_connectivity(m)) std::abort();
    add_references(shape, page, m);
    if (!page.place_references(m)) std::abort();
    for (uint32_t s = 0; s < shape.streams; s++)
      if (!page.number_vertices(m, s)) std::abort();
    least_bytes += page.least_bytes(m);
  }
  for (uint32_t s = 0; s < shape.streams; s++) {
    const size_t values = 4 * size_t(page.streams[s].vertices);
    std::memset(page.streams[s].values.grow(values), 0, 4 * values);
  }
  PageCoder<Encoder> coder(known);
  if (!coder.begin(&page, page.triangles.size(), meshlets)) std::abort();
  for (uint32_t s = 0; s < shape.streams; s++)
    if (!coder.code_stream(s)) std::abort();
  return {coder.coder.finish(page.triangles.size(), meshlets), least_bytes};
}

// Bytes that unpacking a page takes.
size_t memory_of(const std::vector<uint8_t>& packed, size_t resident) {
  std::vector<uint8_t> out(resident);
  const size_t before = given;
  (void)make_page_unpacker()->unpack(packed.data(), {0, packed.size(), 0, resident, false},
                                     out.data());
  return given - before;
}

}  // namespace

int main() {
  // "Shorter fans of two streams" take the most: 565 for each further byte. A triangle of them with
  // its vertex takes 74 bytes and, in the blob, at least a bit; their meshlets fill whole bytes.
  constexpr size_t kPerByte = 600, kUnpacker = 1 << 20;
  constexpr Shape shapes[] = {
      {"fans of a stream", 62, kR, 1, 1, kLoops},
      {"fans of two streams", 62, kR, 2, 1, kSeam},
      {"shorter fans of two streams", 61, kR, 2, 1, kSeam},
      {"fans of 64 streams", 62, kR, 64, 1, kSeam},
      {"disks of a stream", 21, kE, 1, 3, kLoops},
      {"disks of two streams", 21, kE, 2, 3, kLoops},
      {"disks of 64 streams", 21, kE, 64, 4, kLoops},
      {"small meshlets of a stream", 1, kE, 1, 1, kLoops},
      {"small meshlets of 64 streams", 1, kE, 64, 4, kLoops},
      {"owned edges of a stream", 61, kR, 1, 1, kOwnedEdges},
      {"owned edges of two streams", 61, kR, 2, 1, kOwnedEdges},
  };
  int failures = 0;
  for (const Shape& shape : shapes) {
    for (uint32_t meshlets : {2000u, 3300u, 4500u, 6400u}) {
      const PackedShape packed = packed_page(shape, meshlets);
      const size_t least = packed.least_bytes;
      for (size_t resident : {least / 2, least - 1, least, 2 * least}) {
        const size_t memory = memory_of(packed.bytes, resident);
        if (memory <= kUnpacker + kPerByte * resident) continue;
        std::fprintf(stderr, "FAILED: %s: %zu bytes for %zu\n", shape.name, memory, resident);
        failures++;
      }
    }
  }
  return failures != 0;
}
