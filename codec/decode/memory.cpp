#include "decode/memory.h"

#include <cstdlib>
#include <new>

namespace gltf_meshlet_codec {
namespace {

Allocator allocator;  // set before any other call, so that no thread needs a lock to read it

// operator new aligns for these.
static_assert(sizeof(void*) <= kMemoryAlignment);

}  // namespace

void set_allocator(const Allocator& chosen) { allocator = chosen; }

// The bytes before an aligned address have the address that the allocator returned.
void* allocate(size_t bytes) {
  constexpr size_t kHead = sizeof(void*) + kMemoryAlignment - 1;
  if (bytes > SIZE_MAX - kHead) return nullptr;
  void* const memory = allocator.allocate ? allocator.allocate(allocator.user, bytes + kHead)
                                          : ::operator new(bytes + kHead, std::nothrow);
  if (!memory) return nullptr;
  const uintptr_t end = reinterpret_cast<uintptr_t>(memory) + kHead;
  char* const aligned = static_cast<char*>(memory) + (kHead - end % kMemoryAlignment);
  std::memcpy(aligned - sizeof(void*), &memory, sizeof memory);
  return aligned;
}

void release(void* aligned) {
  if (!aligned) return;
  void* memory;
  std::memcpy(&memory, static_cast<char*>(aligned) - sizeof(void*), sizeof memory);
  if (allocator.allocate)
    allocator.release(allocator.user, memory);
  else
    ::operator delete(memory);
}

void out_of_memory() {
#ifdef __cpp_exceptions
  throw std::bad_alloc();
#else
  std::abort();
#endif
}

}  // namespace gltf_meshlet_codec
