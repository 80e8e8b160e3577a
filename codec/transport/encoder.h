// The packer's side of adaptive_coder.h.
#pragma once
#include <unordered_map>
#include <vector>

#include "transport/connectivity_coder.h"
#include "transport/normal_coder.h"
#include "transport/page_coder.h"
#include "transport/value_coder.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

// Records the ranges that the models give; rANS runs over the record backwards at the end.
class Encoder {
 public:
  static constexpr bool kDecodes = false;

  uint32_t symbol(Model& a, Model& b, uint32_t k) {
    put(Model::mean(a, b), k);
    a.update(k);
    b.update(k);
    return k;
  }
  uint32_t symbol(Model& a, uint32_t k) {
    put(a.cumulative(), k);
    a.update(k);
    return k;
  }
  bool flag(Flag& f, bool bit) {
    const uint32_t zero = kWhole - f.one;
    put(bit ? zero : 0, bit ? f.one : zero);
    f.update(bit);
    return bit;
  }
  uint32_t bits(uint32_t x, uint32_t n) {
    x &= uint32_t((1ull << n) - 1);
    cost_ += 16 * n;
    word_ |= uint64_t(x) << filled_;
    for (filled_ += n; filled_ >= 8; filled_ -= 8, word_ >>= 8) bytes_.push_back(uint8_t(word_));
    return x;
  }

  // Earlier vertices of a stream: how many vertices before `count` the last one like this perhaps
  // is, or 0.
  uint32_t find(Vertex value, uint32_t count) const {
    const auto found = last_.find(key(value));
    return found == last_.end() ? 0 : count - found->second;
  }
  void remember(Vertex value, uint32_t number) { last_[key(value)] = number; }
  void forget() { last_.clear(); }

  // In 1/16 of a bit, nearly.
  uint64_t cost() const { return cost_; }

  void reset() { *this = Encoder(); }

  std::vector<uint8_t> finish(uint32_t triangles, uint32_t meshlets) {
    std::vector<uint32_t> words;
    uint64_t state = kStateEnd;
    for (size_t i = ranges_.size(); i-- > 0;) {
      const uint32_t frequency = ranges_[i].frequency;
      if (state >= uint64_t(frequency) << (63 - kProbabilityBits)) {
        words.push_back(uint32_t(state));
        state >>= 32;
      }
      state = ((state / frequency) << kProbabilityBits) + state % frequency + ranges_[i].start;
    }
    if (filled_) bytes_.push_back(uint8_t(word_));
    std::vector<uint8_t> page;
    const auto put = [&](uint32_t x) {
      for (uint32_t i = 0; i < 4; i++) page.push_back(uint8_t(x >> 8 * i));
    };
    for (uint32_t x :
         {triangles, meshlets, uint32_t(words.size()), uint32_t(state), uint32_t(state >> 32)})
      put(x);
    for (size_t i = words.size(); i-- > 0;) put(words[i]);
    page.insert(page.end(), bytes_.begin(), bytes_.end());
    return page;
  }

 private:
  struct Range {
    uint16_t start, frequency;
  };

  static uint64_t key(Vertex v) {
    return v[0] ^ uint64_t(v[1]) << 20 ^ uint64_t(v[2]) << 40 ^ uint64_t(v[3]) << 10;
  }
  void put(Cumulative c, uint32_t k) {
    put(c[k], (k + 1 < kSymbols ? uint32_t(c[k + 1]) : kWhole) - c[k]);
  }
  void put(uint32_t start, uint32_t frequency) {
    ranges_.push_back({uint16_t(start), uint16_t(frequency)});
    cost_ += 16 * kProbabilityBits - cost_of(frequency);
  }

  std::vector<Range> ranges_;
  std::vector<uint8_t> bytes_;
  uint64_t word_ = 0, cost_ = 0;
  uint32_t filled_ = 0;
  std::unordered_map<uint64_t, uint32_t> last_;
};

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec
