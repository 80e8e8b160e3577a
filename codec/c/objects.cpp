#include "c/objects.h"

namespace gltf_meshlet_codec {
namespace {

thread_local char last_error[kSentence];  // no destructor: nothing runs when a thread ends

}  // namespace

int fail(int status, const char* text) {
  std::strncpy(last_error, text, sizeof last_error - 1);  // the last byte stays 0
  return status;
}

int fail(const Problem& problem) {
  write_sentence(problem, last_error, sizeof last_error);
  return problem.text == kNoMemory ? GLTF_MESHLET_MEMORY : GLTF_MESHLET_MALFORMED;
}

}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

uint32_t gltf_meshlet_abi(void) { return GLTF_MESHLET_ABI; }

const char* gltf_meshlet_error(void) { return last_error; }

int gltf_meshlet_set_allocator(const gltf_meshlet_allocator* allocator) {
  return guarded([&] {
    gltf_meshlet_allocator chosen{};
    if (allocator && !take(allocator, chosen)) return bad_argument(kWrongSize);
    if (!chosen.allocate != !chosen.release) return bad_argument(kNull);
    set_allocator({chosen.allocate, chosen.release, chosen.user});
    return kOk;
  });
}

int gltf_meshlet_close(void* object) {
  Object* const closed = static_cast<Object*>(object);
  if (!closed) return kOk;
  if (!closed->is_open()) return bad_argument(kWrongObject);
  delete closed;
  return kOk;
}
