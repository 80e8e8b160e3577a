// The unpacker of EXT_meshlet_transport as a WebAssembly module, for transport.js.
#include "heap.h"
#include "transport/page_unpacker.h"

void out_of_memory() { __builtin_trap(); }

// The C library's would import random numbers for its guard of the stack.
extern "C" uintptr_t __stack_chk_guard = 0x5AC3A53C;
extern "C" void __stack_chk_fail() { __builtin_trap(); }

// Frees everything. Call before each page.
EXPORT(reset) void reset() { free_all(); }

// Unpacks a page of `size` bytes to `out`. Returns null, or the rule that it breaks.
EXPORT(unpack) const char* unpack(const uint8_t* page, size_t size, uint8_t* out, size_t bytes) {
  gltf_meshlet_codec::PageUnpacker* const unpacker = new gltf_meshlet_codec::BlobUnpacker;
  return unpacker->unpack(page, {0, size, 0, bytes, false}, out).text;
}
