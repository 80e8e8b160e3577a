// Open views and scratches of the C interface.
#pragma once
#include <atomic>

#include "c/objects.h"
#include "decode/view.h"
#include "transport/transport.h"

namespace gltf_meshlet_codec {

struct OpenView : Object {
  static constexpr Kind kKind = Kind::kView;
  View view;
  const size_t number = next_number();  // of this view among all: addresses are given again

  OpenView() : Object(kKind) {}

  static size_t next_number() {
    static std::atomic<size_t> last{0};
    return ++last;
  }
};

// A decoder and the blob that it is open on.
struct Scratch : Object {
  static constexpr Kind kKind = Kind::kScratch;
  std::atomic_flag in_use = ATOMIC_FLAG_INIT;
  std::unique_ptr<Decoder> decoder;  // both are made when they are needed
  std::unique_ptr<PageUnpacker> unpacker;
  size_t view = 0, blob = 0;

  Scratch() : Object(kKind) {}

  // Returns the decoder, open on the blob; null if there is no memory.
  Decoder* decoder_at(const OpenView& open, size_t number) {
    if (!decoder) decoder = make_decoder();
    if (!decoder) return nullptr;
    if (view != open.number || blob != number) open.view.open_decoder(*decoder, number);
    view = open.number;
    blob = number;
    return decoder.get();
  }

  PageUnpacker* page_unpacker() {
    if (!unpacker) unpacker = make_page_unpacker();
    return unpacker.get();
  }
};

// Runs action(scratch), if no other thread uses the scratch. Null: one for this call.
template <class Action>
int with_scratch(gltf_meshlet_scratch* scratch, const Action& action) {
  if (!scratch) {
    Scratch own;
    return action(own);
  }
  Scratch* const kept = object_of<Scratch>(scratch);
  if (!kept) return bad_argument(kWrongObject);
  if (kept->in_use.test_and_set(std::memory_order_acquire))
    return fail(GLTF_MESHLET_BUSY, "another thread uses the scratch");
  struct End {
    std::atomic_flag& flag;
    ~End() { flag.clear(std::memory_order_release); }
  } end{kept->in_use};
  return action(*kept);
}

// Runs action(view, scratch).
template <class Action>
int with_scratch(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch,
                 const Action& action) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    return with_scratch(scratch, [&](Scratch& s) { return action(open, s); });
  });
}

inline int no_such(const char* sentence) { return fail(GLTF_MESHLET_NUMBER, sentence); }

constexpr const char* kReserved = "a reserved field is not 0";
constexpr const char* kRoom = "an array has too little room";

}  // namespace gltf_meshlet_codec
