// The models of a page. All begin anew with it.
#ifndef TRANSPORT_CONTEXTS_H
#define TRANSPORT_CONTEXTS_H
#include <new>

#include "transport/page.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

// Sizes of numbers: 0 .. 3 | two per octave | 14: 128 .. 255 | 15: more.
constexpr uint32_t kLargeToken = 15;
struct Tokens {
  uint8_t of[256] = {0, 1, 2, 3};

  constexpr Tokens() {
    for (uint32_t x = 4, length = 3; x < 256; x++) {
      length += x >> length;
      of[x] = uint8_t(length < 8 ? 2 * length - 2 + (x >> (length - 2) & 1) : 14);
    }
  }
};
constexpr Tokens kTokens;
inline uint32_t token_of(uint32_t x) { return x < 256 ? kTokens.of[x] : kLargeToken; }
constexpr uint8_t kTokenBase[15] = {0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128};
constexpr uint8_t kTokenBits[15] = {0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 7};
// The token of twice a number, by the number's token below kLargeToken.
constexpr uint8_t kDoubled[kLargeToken] = {0, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 14, 15};
constexpr uint32_t kLargeLength = 9, kManyBits = 24;  // lengths of numbers of kLargeToken

constexpr uint32_t kMostCounted = 9;  // triangles at a node of a gate
constexpr uint32_t kClasses = 5;      // of predictions

// The kinds of streams that have models of their own.
enum StreamClass : uint8_t { kPositions, kPairs, kOthers, kStreamClasses };

struct ValueModels {
  Model first[kClasses][kSymbols][4];
  Model near[3][kClasses][kSymbols], around[3][kSymbols];  // of further elements
};

struct Contexts {
  Model triangles, triangles_low[4];
  Model gate[kMostCounted + 1][kMostCounted + 1], before[25][kMostCounted + 1];  // of symbols
  Model reference_kind[4][4];
  Model delta[3], slot[16], length[kSymbols], length_of[3][2];
  Model choice[4][kSymbols];
  Model match[2][4];
  ValueModels values[kStreamClasses];
  Model normal[2][kSymbols][kSymbols];
  Model large;
  Flag last[3][2], taken, shares[BLOB_MAX_STREAMS][4], mirrored[2];

  // In place: there are 100 kB of them, which might not fit the stack.
  void reset() { new (this) Contexts; }
};

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif
