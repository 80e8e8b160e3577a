// Loops over independent items on several threads. Which thread runs an item, and when, is left
// open: an item may write only what is its own, so that results never depend on the number of
// threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace meshlet {

// Number of threads to use: `threads` itself when positive, else one per processor.
inline int resolve_threads(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

// Calls body(i) once for every i < count. The calling thread takes part. If bodies throw, the
// remaining items are dropped and one of the exceptions is rethrown here after all threads have
// ended.
template <class Body>
void parallel_for(int threads, size_t count, Body&& body) {
  std::atomic<size_t> next{0};
  const auto work = [&](std::exception_ptr& failure) {
    try {
      for (size_t i; (i = next.fetch_add(1)) < count;) body(i);
    } catch (...) {
      failure = std::current_exception();
      next = count;
    }
  };
  const size_t workers = std::min(static_cast<size_t>(resolve_threads(threads)), count);
  std::vector<std::exception_ptr> failures(std::max<size_t>(workers, 1));
  std::vector<std::thread> pool;
  pool.reserve(workers);
  try {
    for (size_t k = 1; k < workers; ++k) pool.emplace_back(work, std::ref(failures[k]));
  } catch (const std::system_error&) {
    // The system has no more threads; those that started do the work.
  }
  work(failures[0]);
  for (std::thread& thread : pool) thread.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace meshlet
