// Memory of the decoding half: the caller of the C interface may supply it, and any of it may fail
// without an exception, which engines do not have.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace gltf_meshlet_codec {

// Where memory comes from; null functions: operator new.
struct Allocator {
  void* (*allocate)(void* user, size_t bytes) = nullptr;
  void (*release)(void* user, void* memory) = nullptr;
  void* user = nullptr;
};

// Not while anything is allocated.
void set_allocator(const Allocator& chosen);

constexpr size_t kMemoryAlignment = 32;

// Returns null if there is none.
void* allocate(size_t bytes);
// Null is allowed.
void release(void* memory);
// Throws std::bad_alloc; in builds without exceptions, ends the program.
[[noreturn]] void out_of_memory();

// Classes that derive from it are allocated here: `new` returns null if there is no memory.
struct Allocated {
  static void* operator new(size_t bytes) noexcept { return allocate(bytes); }
  static void operator delete(void* memory) noexcept { release(memory); }
};

// A growing array of plain elements.
template <class T>
class List {
 public:
  static_assert(std::is_trivially_copyable<T>::value, "elements are moved as bytes");

  List() = default;
  List(const List&) = delete;
  List& operator=(const List&) = delete;
  ~List() { release(items_); }

  size_t size() const { return size_; }
  T* data() { return items_; }
  const T* data() const { return items_; }
  T* begin() { return items_; }
  T* end() { return items_ + size_; }
  const T* begin() const { return items_; }
  const T* end() const { return items_ + size_; }
  T& operator[](size_t i) { return items_[i]; }
  const T& operator[](size_t i) const { return items_[i]; }
  T& back() { return items_[size_ - 1]; }
  void clear() { size_ = 0; }

  // Both return false, and change nothing, if there is no memory.

  // New elements are not initialised.
  bool resize(size_t size) {
    if (size > capacity_ && !reserve(size)) return false;
    size_ = size;
    return true;
  }
  bool push(const T& item) {
    if (size_ == capacity_ && !reserve(2 * size_ + 4)) return false;
    items_[size_++] = item;
    return true;
  }

 private:
  bool reserve(size_t capacity) {
    if (capacity > SIZE_MAX / sizeof(T)) return false;
    T* const items = static_cast<T*>(allocate(capacity * sizeof(T)));
    if (!items) return false;
    if (size_) std::memcpy(static_cast<void*>(items), items_, size_ * sizeof(T));
    release(items_);
    items_ = items;
    capacity_ = capacity;
    return true;
  }

  T* items_ = nullptr;
  size_t size_ = 0, capacity_ = 0;
};

}  // namespace gltf_meshlet_codec
