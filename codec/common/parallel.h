// Loops over independent items on several threads. Any thread may run any item at any time. An item
// writes only its own data, so results never depend on the number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#ifndef MESHLET_NO_THREADS
#include <atomic>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>
#endif

namespace gltf_meshlet_codec {

#ifdef MESHLET_NO_THREADS
inline int resolve_threads(int) { return 1; }

template <class Body>
void parallel_for(int, size_t count, Body&& body) {
  for (size_t i = 0; i < count; i++) body(i);
}
#else
// Returns `threads` if positive, else the number of processors.
inline int resolve_threads(int threads) {
  return threads > 0 ? threads : std::max(1, int(std::thread::hardware_concurrency()));
}

// Calls body(i) once for every i < count. The calling thread takes part. After an exception the
// remaining items are dropped. When all threads have ended, the exception of the first item that
// failed is rethrown: items start in order, so that all items before it have run.
template <class Body>
void parallel_for(int threads, size_t count, Body&& body) {
  struct Failure {
    size_t item;
    std::exception_ptr exception;
  };
  std::atomic<size_t> next{0};
  const auto work = [&](Failure& failure) {
    size_t i = 0;
    try {
      while ((i = next.fetch_add(1)) < count) body(i);
    } catch (...) {
      failure = {i, std::current_exception()};
      next = count;
    }
  };
  const size_t workers = std::min(size_t(resolve_threads(threads)), count);
  std::vector<Failure> failures(std::max<size_t>(workers, 1), Failure{count, nullptr});
  std::vector<std::thread> pool;
  pool.reserve(workers);
  try {
    for (size_t k = 1; k < workers; k++) pool.emplace_back(work, std::ref(failures[k]));
  } catch (const std::system_error&) {
    // No more threads available: those that started do the work.
  }
  work(failures[0]);
  for (std::thread& thread : pool) thread.join();
  const auto earlier = [](const Failure& a, const Failure& b) { return a.item < b.item; };
  const Failure& first = *std::min_element(failures.begin(), failures.end(), earlier);
  if (first.exception) std::rethrow_exception(first.exception);
}
#endif

inline size_t block_count(size_t count, size_t size) { return (count + size - 1) / size; }

// Calls body(block, first, last) once for every block of `size` items, the last of them smaller:
// items first .. last of `count`.
template <class Body>
void for_blocks(int threads, size_t count, size_t size, Body&& body) {
  parallel_for(threads, block_count(count, size), [&](size_t block) {
    body(block, block * size, std::min(count, (block + 1) * size));
  });
}

}  // namespace gltf_meshlet_codec
