// What all functions of the C interface have in common: objects, statuses, structs with a size.
#pragma once
#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "c/gltf_meshlet.h"
#include "format/blob.h"
#include "decode/memory.h"

namespace gltf_meshlet_codec {

// An object of the caller. Its first words tell its kind, so that one of another kind is refused.
class Object : public Allocated {
 public:
  enum class Kind : uint32_t {
    kNone = 0,
    kView = 0x6D760001,
    kScratch = 0x6D760002,
    kResult = 0x6D760003,
    kLevels = 0x6D760004
  };

  explicit Object(Kind kind) : kind_(kind) {}
  virtual ~Object() { kind_ = Kind::kNone; }
  Object(const Object&) = delete;

  bool is(Kind kind) const { return kind_ == kind; }
  bool is_open() const { return kind_ >= Kind::kView && kind_ <= Kind::kLevels; }

 private:
  Kind kind_;
};

constexpr int kOk = GLTF_MESHLET_OK;

// Notes the sentence for gltf_meshlet_error and returns the status.
int fail(int status, const char* text);
int fail(const Problem& problem);
inline int bad_argument(const char* text) { return fail(GLTF_MESHLET_ARGUMENT, text); }
inline int status_of(const Problem& problem) { return problem ? fail(problem) : kOk; }

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
    return fail({kNoMemory});
  } catch (const Cancelled&) {
    return fail(GLTF_MESHLET_CANCELLED, "the progress function cancelled");
  } catch (const std::exception& e) {
    return fail(GLTF_MESHLET_INTERNAL, e.what());
  }
#else
  return action();
#endif
}

constexpr const char* kWrongObject = "an object is null, closed or of another kind";

// The caller's object; null if it is of another kind.
template <class T, class Handle>
T* object_of(Handle* handle) {
  auto* const object = reinterpret_cast<Object*>(const_cast<std::remove_const_t<Handle>*>(handle));
  return object && object->is(T::kKind) ? static_cast<T*>(object) : nullptr;
}

// Runs action(object) on the caller's object.
template <class T, class Handle, class Action>
int with(Handle* handle, const Action& action) noexcept {
  return guarded([&] {
    T* const object = object_of<T>(handle);
    return object ? action(*object) : bad_argument(kWrongObject);
  });
}

// Gives an object, which may be null for the lack of memory, to the caller.
template <class T, class Handle>
int give_object(std::unique_ptr<T> object, Handle** out) {
  if (!object) return fail({kNoMemory});
  *out = reinterpret_cast<Handle*>(static_cast<Object*>(object.release()));
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

constexpr const char* kNull = "a pointer is null";
constexpr const char* kThreads = "the number of threads is below 0";

// More threads than any machine has gain nothing.
inline int thread_count(int32_t threads) { return std::min(threads, 1024); }

}  // namespace gltf_meshlet_codec
