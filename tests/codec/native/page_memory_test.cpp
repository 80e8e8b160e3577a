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

size_t held = 0, most_held = 0;  // bytes that operator new has given

void* allocate(size_t bytes) {
  constexpr size_t kBefore = alignof(std::max_align_t);  // where its size stands
  auto* place = static_cast<unsigned char*>(std::malloc(bytes + kBefore));
  if (!place) throw std::bad_alloc();
  std::memcpy(place, &bytes, sizeof bytes);
  held += bytes;
  if (held > most_held) most_held = held;
  return place + kBefore;
}

void release(void* given) {
  if (!given) return;
  auto* place = static_cast<unsigned char*>(given) - alignof(std::max_align_t);
  size_t bytes;
  std::memcpy(&bytes, place, sizeof bytes);
  held -= bytes;
  std::free(place);
}

}  // namespace

void* operator new(size_t bytes) { return allocate(bytes); }
void* operator new[](size_t bytes) { return allocate(bytes); }
void operator delete(void* given) noexcept { release(given); }
void operator delete[](void* given) noexcept { release(given); }
void operator delete(void* given, size_t) noexcept { release(given); }
void operator delete[](void* given, size_t) noexcept { release(given); }

namespace {

using namespace meshlet;
using namespace meshlet::transport;

struct Shape {
  const char* name;
  uint32_t triangles;  // of a meshlet
  Symbol symbol;       // of all of them but the last
  uint32_t streams, elements;
};

// A page of zeros that takes nearly no bytes.
std::vector<uint8_t> packed_page(const Shape& shape, uint32_t meshlets) {
  Page page, known;
  page.clear();
  for (uint32_t s = 0; s < shape.streams; s++)
    page.rows.push({{KIND_INTEGER | shape.elements << 8 | 1u << 16, 0, 0, 0, 0, 0, 0}});
  for (uint32_t i = 0; i < meshlets; i++) {
    MeshletRow& m = page.begin_meshlet();
    m.triangles = uint8_t(shape.triangles);
    m.symbols[shape.symbol] = below(shape.triangles - 1);
    m.symbols[kE] |= 1ull << (shape.triangles - 1);
    if (!page.decode_connectivity(m)) std::abort();
    m.references = uint8_t(page.serial.disk_count);
    for (uint32_t d = 0; d < m.references; d++)
      page.references.push({0, kNone, i, kPrivate, 1, 0, 0, 0, 0, 0, 0, 0});
    if (!page.place_references(m)) std::abort();
    for (uint32_t s = 0; s < shape.streams; s++)
      if (!page.number_vertices(m, s)) std::abort();
  }
  for (uint32_t s = 0; s < shape.streams; s++) {
    const size_t values = 4 * size_t(page.streams[s].vertices);
    std::memset(page.streams[s].values.grow(values), 0, 4 * values);
  }
  PageCoder<Encoder> coder(known);
  if (!coder.begin(&page, page.triangles.size(), meshlets)) std::abort();
  for (uint32_t s = 0; s < shape.streams; s++)
    if (!coder.code_stream(s)) std::abort();
  return coder.coder.finish(page.triangles.size(), meshlets);
}

// Bytes that unpacking a page takes at most.
size_t memory_of(const std::vector<uint8_t>& packed, size_t resident) {
  std::vector<uint8_t> out(resident);
  const size_t before = held;
  most_held = held;
  (void)make_page_unpacker()->unpack(packed.data(), {0, packed.size(), 0, resident, false},
                                     out.data());
  return most_held - before;
}

}  // namespace

int main() {
  constexpr uint32_t kMeshlets = 2000;
  // A triangle with its vertex takes about 50 bytes and, in the blob, at least a bit. Of these
  // pages "disks of a stream" take the most per resident byte: 333.
  constexpr size_t kPerByte = 400, kUnpacker = 1 << 20;
  constexpr Shape shapes[] = {
      {"fans of a stream", 62, kR, 1, 1},     {"fans of two streams", 62, kR, 2, 1},
      {"fans of 64 streams", 62, kR, 64, 1},  {"disks of a stream", 21, kE, 1, 3},
      {"disks of 64 streams", 21, kE, 64, 4}, {"small meshlets of 64 streams", 1, kE, 64, 4},
  };
  int failures = 0;
  for (const Shape& shape : shapes) {
    const std::vector<uint8_t> packed = packed_page(shape, kMeshlets);
    // From the fewest bytes that the page's header allows.
    for (size_t resident = most(kMeshlets * shape.triangles / 8, kMeshlets); resident < 1 << 20;
         resident += resident / 4) {
      const size_t memory = memory_of(packed, resident);
      if (memory <= kUnpacker + kPerByte * resident) continue;
      std::fprintf(stderr, "FAILED: %s: %zu bytes for %zu\n", shape.name, memory, resident);
      failures++;
    }
  }
  return failures != 0;
}
