// Many threads request random entries of a small cache and check the payloads. Run under
// ThreadSanitizer.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include "cache.h"

using namespace meshlet_shape;

namespace {

constexpr uint32_t kKeys = 512;
constexpr uint32_t kThreads = 8;
constexpr uint32_t kAsks = 20000;

struct Payload {
  uint32_t key, words;
};

uint32_t words_of(uint32_t key) { return 8 + key % 57; }
size_t bytes_of(uint32_t key) { return sizeof(Entry) + sizeof(Payload) + 4 * words_of(key); }

Entry* produce(ThreadSlot& thread, EntryKind kind, uint32_t key) {
  Entry* entry = thread.scratch(kind, bytes_of(key));
  auto* payload = static_cast<Payload*>(entry->payload());
  *payload = {key, words_of(key)};
  auto* words = reinterpret_cast<uint32_t*>(payload + 1);
  for (uint32_t i = 0; i < payload->words; i++) words[i] = key * 2654435761u + i;
  return entry;
}

bool is_right(const void* data, uint32_t key) {
  auto* payload = static_cast<const Payload*>(data);
  auto* words = reinterpret_cast<const uint32_t*>(payload + 1);
  bool right = payload->key == key && payload->words == words_of(key);
  for (uint32_t i = 0; right && i < payload->words; i++) right = words[i] == key * 2654435761u + i;
  return right;
}

// Half of the requests go to a few popular keys. Holds both kinds of entries at once, as shading
// does.
void ask(Table& table, uint32_t seed, std::atomic<uint32_t>& wrong, std::atomic<bool>& over) {
  ThreadSlot& thread = this_thread();
  uint32_t state = seed * 747796405u + 1;
  for (uint32_t i = 0; i < kAsks; i++) {
    state = state * 1664525u + 1013904223u;
    uint32_t key = (state >> 16) % (state & 0x8000 ? 16 : kKeys) & ~1u;
    const void* first =
        table.get(thread, kTriangles, key, [&] { return produce(thread, kTriangles, key); });
    const void* second = table.get(thread, kAttributes, key + 1,
                                   [&] { return produce(thread, kAttributes, key + 1); });
    if (!is_right(first, key) || !is_right(second, key + 1)) wrong++;
    if (i % 64 == 0) {
      Statistics s = table.store().statistics();
      if (s.resident_bytes > s.limit_bytes) over = true;
    }
  }
}

bool run(double fraction) {
  uint64_t needed = 0;
  for (uint32_t key = 0; key < kKeys; key++) needed += bytes_of(key);
  auto store = std::make_shared<Store>();
  const uint64_t share = uint64_t(double(needed) * fraction);
  auto table = std::make_unique<Table>(store, kKeys, share);
  auto other = std::make_unique<Table>(store, kKeys, share / 2);
  std::atomic<uint32_t> wrong{0};
  std::atomic<bool> over{false};
  std::vector<std::thread> threads;
  for (uint32_t t = 0; t < kThreads; t++)
    threads.emplace_back([&, t] { ask(t % 2 ? *table : *other, t + 1, wrong, over); });
  for (auto& thread : threads) thread.join();
  ThreadSlot& thread = this_thread();  // fills what the threads have left
  for (uint32_t key = 0; key < kKeys; key += 2)
    table->get(thread, kTriangles, key, [&] { return produce(thread, kTriangles, key); });
  other.reset();  // gives its share of the limit back
  Statistics s = store->statistics();
  const bool returned = s.limit_bytes == share && s.resident_bytes <= share;
  uint64_t asked = 2ull * kThreads * kAsks + kKeys / 2;
  bool counted = s.hits + s.misses == asked && s.misses == s.decoded;
  std::printf(
      "%3.0f %%: %llu hits, %llu misses, %llu evictions, %llu refused, %llu of %llu bytes\n",
      100 * fraction, (unsigned long long)s.hits, (unsigned long long)s.misses,
      (unsigned long long)s.evictions, (unsigned long long)s.refused,
      (unsigned long long)s.resident_bytes, (unsigned long long)s.limit_bytes);
  table.reset();
  s = store->statistics();
  return wrong == 0 && !over && counted && returned && s.limit_bytes == 0 &&
         s.resident_bytes == 0 && s.resident_entries == 0;
}

}  // namespace

int main() {
  bool good = true;
  for (double fraction : {0.0, 0.02, 0.25, 1.0, 2.0}) good = run(fraction) && good;
  if (!good) std::fputs("the cache gave wrong data or broke its limit\n", stderr);
  return good ? 0 : 1;
}
