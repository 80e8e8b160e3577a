// Arrays whose new elements are not initialised: the thread that fills a part of one is the first
// to touch its memory.
#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace meshlet {

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

template <class T>
using Array = std::vector<T, Uninitialised<T>>;

}  // namespace meshlet
