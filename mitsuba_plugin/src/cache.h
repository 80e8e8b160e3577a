// A bounded store of decoded meshlets, shared by all threads.
//
// Reading takes no lock: a thread announces the entry it is about to use (a hazard pointer) and
// checks that it is still there. An entry that any thread has announced is not evicted, so that the
// limit holds exactly and nothing waits. Only inserting takes the lock, which is cheap beside the
// decoding before it.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace meshlet_shape {

enum class Policy {
  kCounts,  // keeps what was asked for most often of late; the paper's
  kClock,   // second chance; the default: more hits, see docs/mitsuba.md
};

struct Statistics {
  uint64_t hits = 0, misses = 0, evictions = 0, decoded = 0, refused = 0;
  uint64_t resident_bytes = 0, resident_entries = 0, limit_bytes = 0;
};

class Store;
class Table;

constexpr size_t kEntryAlignment = 32;

// A header, followed in memory by `bytes - sizeof(Entry)` bytes of payload.
struct alignas(kEntryAlignment) Entry {
  Table* table;
  uint32_t key;
  uint32_t bytes;
  uint32_t place;             // among the store's residents
  std::atomic<uint8_t> used;  // CLOCK's bit

  void* payload() { return this + 1; }
  const void* payload() const { return this + 1; }
};

// What one thread reads at a time; a place for each kind of entry that it holds together with
// others.
enum EntryKind : uint32_t { kTriangles = 0, kAttributes = 1, kEntryKinds = 2 };

// One per thread, given by `this_thread`. Reused when its thread has ended.
struct ThreadSlot {
  struct Recent {
    uint64_t table = 0;  // uid, 0: none
    uint32_t key = 0;
    const Entry* entry = nullptr;
  };

  alignas(64) std::atomic<const Entry*> announced[kEntryKinds] = {};
  Recent recent[kEntryKinds];  // the owner's alone
  std::unique_ptr<std::byte[]> scratch_memory[kEntryKinds];
  std::atomic<size_t> scratch_bytes[kEntryKinds] = {};  // written by the owner
  uint32_t index = 0;
  std::atomic<bool> taken{false};

  // Room for an entry of so many bytes that is in no store.
  Entry* scratch(EntryKind kind, size_t bytes);
};

// Null before the first call of this_thread.
extern __thread ThreadSlot* t_slot;
ThreadSlot& take_this_thread();
inline ThreadSlot& this_thread() { return t_slot ? *t_slot : take_this_thread(); }

// Slots made so far, and the bytes of all scratch memory.
uint64_t thread_slots();
uint64_t scratch_bytes();

// The entries of one shape: which of its meshlets are decoded, and how often each was asked for.
class Table {
 public:
  // capacity: keys 0 .. capacity - 1.
  Table(std::shared_ptr<Store> store, uint32_t capacity);
  ~Table();

  uint64_t uid() const { return uid_; }
  Store& store() const { return *store_; }

  // The payload for a key, from the store or from `produce()`, which decodes it into the thread's
  // scratch memory and returns that. Valid until the same thread asks for another key of this kind.
  // Counts as so many `asks`, of which one may be a miss.
  template <class Produce>
  const void* get(ThreadSlot& thread, EntryKind kind, uint32_t key, Produce&& produce,
                  uint32_t asks = 1) {
    ThreadSlot::Recent& recent = thread.recent[kind];
    if (recent.table != uid_ || recent.key != key) {
      recent.table = 0;  // where produce throws, nothing is held
      const Entry* entry = find(thread, kind, key, asks);
      if (!entry) {
        Entry* fresh = produce();
        fresh->key = key;
        insert(thread, *fresh);
        entry = fresh;
      }
      recent = {uid_, key, entry};
    } else {
      note_hits(thread, key, asks);
    }
    return recent.entry->payload();
  }

 private:
  friend class Store;

  const Entry* find(ThreadSlot& thread, EntryKind kind, uint32_t key, uint32_t asks);
  void insert(ThreadSlot& thread, const Entry& fresh);
  void note_hits(ThreadSlot& thread, uint32_t key, uint32_t asks);
  void count(uint32_t key, uint32_t asks);

  std::shared_ptr<Store> store_;
  uint64_t uid_;
  std::unique_ptr<std::atomic<Entry*>[]> entries_;
  std::unique_ptr<std::atomic<uint32_t>[]> counts_;
};

// Entries of any number of tables under one limit.
class Store {
 public:
  Store(Policy policy) : policy_(policy) {}
  ~Store();

  // Adds a shape's share to the limit, and what its entries take when all are there: where all fit,
  // counting is pointless.
  void extend(uint64_t limit_bytes, uint64_t needed_bytes);

  Statistics statistics() const;
  void reset_statistics();

 private:
  friend class Table;

  struct alignas(64) Counters {
    std::atomic<uint64_t> hits{0}, misses{0}, decoded{0};
  };
  static constexpr uint32_t kCounters = 64;  // threads beyond share them and may lose counts

  struct Resident {
    Entry* entry;
    const std::atomic<uint32_t>* count;
  };

  struct Member {
    Table* table;
    uint32_t capacity;
  };

  Counters& counters(const ThreadSlot& thread) { return counters_[thread.index % kCounters]; }
  bool make_room(size_t bytes, uint32_t wanted);
  Entry* least_used(uint32_t wanted);
  Entry* next_unused();
  bool evict(Entry* entry);
  void remove(uint32_t place);
  void age();

  const Policy policy_;
  Counters counters_[kCounters];
  std::atomic<bool> everything_fits_{false};
  std::atomic<uint64_t> limit_{0}, resident_{0}, entries_{0}, evictions_{0}, refused_{0};
  mutable std::mutex mutex_;  // guards what follows, and every change of a table's entries
  uint64_t needed_ = 0;
  std::vector<Resident> residents_;
  std::vector<Member> tables_;
  uint32_t hand_ = 0;
  uint64_t decoded_since_aging_ = 0;
  uint64_t random_ = 0x9E3779B97F4A7C15u;
};

}  // namespace meshlet_shape
