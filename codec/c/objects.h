// What all functions of the C interface have in common: objects, statuses, structs with a size.
#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "c/gltf_meshlet.h"
#include "decode/bit_statistics.h"

namespace meshlet {

// An object of the caller, who has a handle: a number that is not given again, in the guise of a
// pointer. Calls on other threads keep an object alive that is closed meanwhile.
struct Object {
  enum class Kind { kView, kResult, kSurface };
  const Kind kind;

  explicit Object(Kind k) : kind(k) {}
  virtual ~Object() = default;
};

constexpr int kOk = GLTF_MESHLET_OK;

// Notes the sentence for gltf_meshlet_error and returns the status.
int fail(int status, const char* sentence);
inline int bad_argument(const char* s) { return fail(GLTF_MESHLET_ARGUMENT, s); }

void* new_handle(std::shared_ptr<Object> object);
// Returns null if the handle is not that of an open object of this kind.
std::shared_ptr<Object> find_object(const void* handle, Object::Kind kind);

// Thrown by the progress function's caller.
struct Cancelled {};

// Runs action(), which returns a status; turns exceptions into statuses.
template <class Action>
int guarded(const Action& action) noexcept {
#ifdef __cpp_exceptions
  try {
    return action();
  } catch (const std::invalid_argument& e) {
    return fail(GLTF_MESHLET_ARGUMENT, e.what());
  } catch (const std::length_error& e) {
    return fail(GLTF_MESHLET_LIMIT, e.what());
  } catch (const std::bad_alloc&) {
    return fail(GLTF_MESHLET_MEMORY, "there is not enough memory");
  } catch (const Cancelled&) {
    return fail(GLTF_MESHLET_CANCELLED, "the progress function cancelled");
  } catch (const std::exception& e) {
    return fail(GLTF_MESHLET_INTERNAL, e.what());
  }
#else
  return action();
#endif
}

// Runs action(object) on the open object of a handle.
template <class T, class Action>
int with(const void* handle, const Action& action) noexcept {
  return guarded([&] {
    const std::shared_ptr<Object> object = find_object(handle, T::kKind);
    if (!object) return bad_argument("an object is null, closed or of another kind");
    return action(static_cast<T&>(*object));
  });
}

// Opens a new T and gives its handle to the caller.
template <class T, class Handle, class... Arguments>
int open_object(Handle** out, Arguments&&... arguments) {
  *out =
      static_cast<Handle*>(new_handle(std::make_shared<T>(std::forward<Arguments>(arguments)...)));
  return kOk;
}

// Is this a struct of the first version of the interface or a later one?
template <class T>
bool has_size(const T* s) {
  return s && s->size >= sizeof(T) && s->size <= 4096;
}
constexpr const char* kWrongSize = "a struct is null or its size is wrong";

// Copies a struct of the caller. Returns false if its size is wrong, or if it has fields of a later
// version that are not 0.
template <class T>
bool take(const T* from, T& to) {
  if (!has_size(from)) return false;
  const auto* bytes = reinterpret_cast<const uint8_t*>(from);
  if (!std::all_of(bytes + sizeof to, bytes + from->size, [](uint8_t b) { return b == 0; }))
    return false;
  std::memcpy(&to, from, sizeof to);
  return true;
}

// Copies to a struct of the caller.
template <class T>
int give(const T& from, T* to) {
  if (!has_size(to)) return bad_argument(kWrongSize);
  const uint32_t size = to->size;
  std::memset(to, 0, size);
  std::memcpy(to, &from, sizeof from);
  to->size = size;
  return kOk;
}

void copy_statistics(const BitStatistics& from, gltf_meshlet_statistics& to);

constexpr const char* kNull = "a pointer is null";

// More threads than any machine has gain nothing.
inline int thread_count(int32_t threads) { return std::min(threads, 1024); }

}  // namespace meshlet
