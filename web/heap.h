// The memory of a WebAssembly module: nothing is freed but everything at once. Included once.
#pragma once
#include <cstddef>
#include <cstdint>
#include <new>

#include "decode/memory.h"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

extern "C" unsigned char __heap_base;  // by the linker

// Called when memory is used up.
[[noreturn]] void out_of_memory();

namespace {

constexpr uint64_t kPage = 65536;
constexpr uint64_t kMemory = kPage << 16;  // 32-bit addresses
constexpr uint64_t kAlignment = 32;

uint64_t heap_end = 0;

void free_all() { heap_end = uintptr_t(&__heap_base); }

// Not inlined: it would make a module of one source larger by a twentieth.
__attribute__((noinline)) void* take(size_t bytes) {
  const uint64_t begin = (heap_end + kAlignment - 1) / kAlignment * kAlignment;
  const uint64_t end = begin + bytes, size = kPage * __builtin_wasm_memory_size(0);
  if (end > kMemory ||
      (end > size &&
       __builtin_wasm_memory_grow(0, size_t((end - size + kPage - 1) / kPage)) == size_t(-1)))
    out_of_memory();
  heap_end = end;
  return reinterpret_cast<void*>(uintptr_t(begin));
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

namespace gltf_meshlet_codec {
void* allocate(size_t bytes) { return take(bytes); }
void release(void*) {}
void out_of_memory() { ::out_of_memory(); }
}  // namespace gltf_meshlet_codec

// Called by the standard library for errors that cannot happen here. Its own would bring printf.
extern "C" void abort() { __builtin_trap(); }
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) _NOEXCEPT { __builtin_trap(); }
_LIBCPP_END_NAMESPACE_STD

EXPORT(allocate) void* allocate(size_t bytes) { return take(bytes); }
