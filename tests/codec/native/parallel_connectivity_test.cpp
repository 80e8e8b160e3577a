// Compares the parallel connectivity with the serial decoder on the symbols of random disks, and
// checks on random symbols that it stays within bounds.
#include <cstdio>

#include "decode/serial_decoder.h"

namespace gltf_meshlet_codec {
namespace {

// The serial decoder and the parallel connectivity, on the same symbols.
struct BothDecoders : SerialDecoder {
#define SHARED
#define OR_MASK(target, mask) (target) |= (mask)
#define ADD(target, value) (target) += (value)
#define TRIANGLES triangles
#include "decode/parallel_connectivity.glsl"

  void decode_parallel() {
    error = ERROR_NONE;
    for (uint t = 0; t < 64; t++) parallel_step_0(t);
    for (uint t = 0; t < 64; t++) parallel_step_1(t);
    for (uint t = 0; t < 64; t++) parallel_step_2(t);
    for (uint t = 0; t < 64; t++) parallel_step_3(t);
    for (uint t = 0; t < 64; t++) parallel_step_4(t);
    for (uint t = 0; t < 64; t++) parallel_step_5(t);
    for (uint t = 0; t < 64; t++) parallel_step_6(t);
    for (uint t = 0; t < 64; t++) parallel_step_7(t);
  }
};

struct Random {
  uint32_t state;
  uint32_t below(uint32_t n) {
    state = state * 1664525u + 1013904223u;
    return uint32_t((uint64_t(state >> 8) * n) >> 24);
  }
};

// Appends the symbols of a random disk of at most `budget` triangles whose loop, with the gate, has
// `edges` edges. The outline limits the choice of symbols.
void random_disk(BothDecoders& d, Random& random, uint32_t edges, uint32_t budget) {
  auto put = [&](uint64_t* mask) {
    if (mask) *mask |= 1ull << d.triangle_count;
    d.triangle_count++;
  };
  const uint32_t needed = edges - 2;  // triangles that fill a loop without interior vertices
  const uint32_t choice = random.below(8);
  if (edges == 3 && (budget < 3 || choice < 5)) return put(&d.symbol_e);
  if (budget >= needed + 2 && choice < 4) {
    put(&d.symbol_c);
    return random_disk(d, random, edges + 1, budget - 1);
  }
  if (edges == 3) return put(&d.symbol_e);
  if (choice == 4 && edges >= 5) {
    const uint32_t right = 3 + random.below(edges - 4), left = edges + 1 - right;
    put(&d.symbol_s);
    const uint32_t spare = budget - needed;
    const uint32_t before = d.triangle_count;
    random_disk(d, random, right, right - 2 + spare / 2);
    return random_disk(d, random, left, budget - 1 - (d.triangle_count - before));
  }
  put(choice & 1 ? &d.symbol_r : nullptr);
  random_disk(d, random, edges - 1, budget - 1);
}

void clear(BothDecoders& d) {
  d.triangle_count = 0;
  d.symbol_r = d.symbol_e = d.symbol_c = d.symbol_s = 0;
  d.error = ERROR_NONE;
}

bool same(BothDecoders& d) {
  d.decode_apexes();
  if (d.error == ERROR_NONE) d.decode_triangles();
  if (d.error == ERROR_NONE) d.list_traversed(d.boundary);
  if (d.error != ERROR_NONE) return false;
  uint32_t serial[64];
  for (uint32_t t = 0; t < d.triangle_count; t++) serial[t] = d.triangles[t];
  d.decode_parallel();
  if (d.error != ERROR_NONE) return false;
  if (d.boundary & d.interior_ids) return false;
  for (uint32_t t = 0; t < d.triangle_count; t++)
    if (serial[t] != d.triangles[t]) return false;
  return true;
}

}  // namespace
}  // namespace gltf_meshlet_codec

int main() {
  using namespace gltf_meshlet_codec;
  static BothDecoders d;
  Random random{1};
  uint32_t tried = 0, largest = 0;
  for (uint32_t i = 0; i < 200000; i++) {
    clear(d);
    while (d.triangle_count < 50 && (d.triangle_count == 0 || random.below(3))) {
      const uint32_t room = 64 - d.triangle_count, edges = 3 + random.below(room < 20 ? room : 20);
      random_disk(d, random, edges, edges - 2 + random.below(room - (edges - 2) + 1));
    }
    d.decode_apexes();
    if (d.error == ERROR_VERTICES) continue;
    tried++;
    if (d.triangle_count > largest) largest = d.triangle_count;
    if (!same(d)) {
      std::fprintf(stderr, "the decoders differ on string %u of %u triangles, error %u\n", i,
                   d.triangle_count, d.error);
      return 1;
    }
  }
  if (tried < 50000 || largest < 64) {
    std::fprintf(stderr, "only %u strings tried, of at most %u triangles\n", tried, largest);
    return 1;
  }
  for (uint32_t i = 0; i < 200000; i++) {
    clear(d);
    d.triangle_count = 1 + random.below(64);
    for (uint32_t t = 0; t < d.triangle_count; t++) {
      uint64_t* const masks[5] = {&d.symbol_r, &d.symbol_e, &d.symbol_c, &d.symbol_s, nullptr};
      if (uint64_t* mask = masks[random.below(5)]) *mask |= 1ull << t;
    }
    d.decode_parallel();
    if (d.error != ERROR_NONE) continue;
    for (uint32_t t = 0; t < d.triangle_count; t++)
      for (uint32_t k = 0; k < 3; k++)
        if ((d.triangles[t] >> 8 * k & 255u) > 63u) return 1;
  }
  std::printf("%u strings decode alike\n", tried);
}
