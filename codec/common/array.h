// Arrays whose new elements are not initialised, and views of arrays.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace gltf_meshlet_codec {

template <class T>
struct Uninitialised : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = Uninitialised<U>;
  };
  template <class U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

// The thread that fills a range of a new array is the first to touch its memory.
template <class T>
using Array = std::vector<T, Uninitialised<T>>;

// Consecutive elements that something else owns.
template <class T>
struct Span {
  const T* data;
  size_t count;

  const T* begin() const { return data; }
  const T* end() const { return data + count; }
  size_t size() const { return count; }
  const T& operator[](size_t i) const { return data[i]; }
};

}  // namespace gltf_meshlet_codec
