#include "c/objects.h"

#include <mutex>
#include <unordered_map>

namespace meshlet {
namespace {

thread_local char last_error[512];  // no destructor: nothing runs when a thread ends

#ifdef __wasm__  // one thread, and no std::mutex
struct Mutex {
  void lock() {}
  void unlock() {}
};
#else
using Mutex = std::mutex;
#endif

struct Objects {
  Mutex mutex;
  std::unordered_map<uintptr_t, std::shared_ptr<Object>> by_number;
  uintptr_t last = 0;
};

// Never destroyed: other threads may still run when the process ends.
Objects& objects() {
  static Objects* const all = new Objects;
  return *all;
}

// Closes a handle. The caller frees the object, which may take a while, without the lock.
std::shared_ptr<Object> take_object(const void* handle) {
  Objects& all = objects();
  const std::lock_guard<Mutex> lock(all.mutex);
  const auto found = all.by_number.find(reinterpret_cast<uintptr_t>(handle));
  if (found == all.by_number.end()) return nullptr;
  std::shared_ptr<Object> object = std::move(found->second);
  all.by_number.erase(found);
  return object;
}

}  // namespace

int fail(int status, const char* sentence) {
  std::strncpy(last_error, sentence, sizeof last_error - 1);  // the last byte stays 0
  return status;
}

void* new_handle(std::shared_ptr<Object> object) {
  Objects& all = objects();
  const std::lock_guard<Mutex> lock(all.mutex);
  do all.last++;  // 32 bits may begin anew, at a number that is in use
  while (all.last == 0 || all.by_number.count(all.last));
  all.by_number.emplace(all.last, std::move(object));
  return reinterpret_cast<void*>(all.last);
}

std::shared_ptr<Object> find_object(const void* handle, Object::Kind kind) {
  Objects& all = objects();
  const std::lock_guard<Mutex> lock(all.mutex);
  const auto found = all.by_number.find(reinterpret_cast<uintptr_t>(handle));
  const bool open = found != all.by_number.end() && found->second->kind == kind;
  return open ? found->second : nullptr;
}

}  // namespace meshlet

using namespace meshlet;

uint32_t gltf_meshlet_abi(void) { return GLTF_MESHLET_ABI; }

const char* gltf_meshlet_error(void) { return last_error; }

int gltf_meshlet_close(void* object) {
  if (!object) return kOk;
  return guarded([&] {
    const std::shared_ptr<Object> closed = take_object(object);
    return closed ? GLTF_MESHLET_OK
                  : bad_argument("the object is closed or not one of this library");
  });
}
