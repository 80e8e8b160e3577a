// A bounded cache of decoded meshlets, shared by all threads.
//
// Reading takes no lock. A thread announces the entry that it is about to use (a hazard pointer)
// and checks that the entry is still in the table. Announced entries are not evicted: the limit
// holds exactly and no thread waits. Only inserting takes the lock; decoding costs far more.
// Entries that were used since the last visit get a second chance (the clock algorithm).
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace meshlet_shape {

struct Statistics {
  uint64_t hits = 0, misses = 0, evictions = 0, decoded = 0, refused = 0;
  uint64_t resident_bytes = 0, resident_entries = 0, limit_bytes = 0;
};

class Store;
class Table;

constexpr size_t kEntryAlignment = 32;

// This header, then `bytes - sizeof(Entry)` bytes of payload.
struct alignas(kEntryAlignment) Entry {
  Table* table;
  uint32_t key;
  uint32_t bytes;
  uint32_t place;             // index among the store's residents
  std::atomic<uint8_t> used;  // since the clock's hand came by

  void* payload() { return this + 1; }
  const void* payload() const { return this + 1; }
};

// Kinds of entries. A thread holds at most one of each at a time.
enum EntryKind : uint32_t { kTriangles = 0, kAttributes = 1, kEntryKinds = 2 };

// The state of one thread, from this_thread(). Reused after the thread has ended.
struct ThreadSlot {
  struct Recent {
    uint64_t table = 0;  // uid; 0: none
    uint32_t key = 0;
    const Entry* entry = nullptr;
  };

  alignas(64) std::atomic<const Entry*> announced[kEntryKinds] = {};
  Recent recent[kEntryKinds];  // only the owner reads and writes it
  std::unique_ptr<std::byte[]> scratch_memory[kEntryKinds];
  std::atomic<size_t> scratch_bytes[kEntryKinds] = {};  // written by the owner
  uint32_t index = 0;
  std::atomic<bool> taken{false};

  // Memory for an entry of this size outside any store.
  Entry* scratch(EntryKind kind, size_t bytes);
};

// Null before the first call of this_thread.
extern __thread ThreadSlot* t_slot;
ThreadSlot& take_this_thread();
inline ThreadSlot& this_thread() { return t_slot ? *t_slot : take_this_thread(); }

// Number of slots made so far, and bytes of all scratch memory.
uint64_t thread_slots();
uint64_t scratch_bytes();

// The entries of one shape: its decoded meshlets.
class Table {
 public:
  // capacity: keys 0 .. capacity - 1. limit_bytes: the shape's share of the store's limit, until
  // the table is destroyed.
  Table(std::shared_ptr<Store> store, uint32_t capacity, uint64_t limit_bytes);
  ~Table();

  uint64_t uid() const { return uid_; }
  Store& store() const { return *store_; }

  // Returns the payload for a key, from the store or from `produce()`, which decodes it into the
  // thread's scratch memory. Valid until the thread requests another key of this kind. Counts as
  // `asks` requests, of which at most one is a miss.
  template <class Produce>
  const void* get(ThreadSlot& thread, EntryKind kind, uint32_t key, Produce&& produce,
                  uint32_t asks = 1) {
    ThreadSlot::Recent& recent = thread.recent[kind];
    if (recent.table != uid_ || recent.key != key) {
      recent.table = 0;  // nothing is held if produce throws
      const Entry* entry = find(thread, kind, key, asks);
      if (!entry) {
        Entry* fresh = produce();
        fresh->key = key;
        insert(thread, *fresh);
        entry = fresh;
      }
      recent = {uid_, key, entry};
    } else {
      note_hits(thread, asks);
    }
    return recent.entry->payload();
  }

 private:
  friend class Store;

  const Entry* find(ThreadSlot& thread, EntryKind kind, uint32_t key, uint32_t asks);
  void insert(ThreadSlot& thread, const Entry& fresh);
  void note_hits(ThreadSlot& thread, uint32_t asks);

  std::shared_ptr<Store> store_;
  uint64_t uid_;
  std::unique_ptr<std::atomic<Entry*>[]> entries_;
  const uint64_t limit_bytes_;
};

// Entries of any number of tables under one limit.
class Store {
 public:
  ~Store();

  Statistics statistics() const;
  void reset_statistics();

 private:
  friend class Table;

  struct alignas(64) Counters {
    std::atomic<uint64_t> hits{0}, misses{0}, decoded{0};
  };
  static constexpr uint32_t kCounters = 64;  // more threads share them and may lose counts

  Counters& counters(const ThreadSlot& thread) { return counters_[thread.index % kCounters]; }
  bool make_room(size_t bytes);
  Entry* next_unused();
  bool evict(Entry* entry);
  void remove(uint32_t place);

  Counters counters_[kCounters];
  std::atomic<uint64_t> limit_{0}, resident_{0}, entries_{0}, evictions_{0}, refused_{0};
  mutable std::mutex mutex_;  // guards the members below and changes of a table's entries
  std::vector<Entry*> residents_;
  uint32_t hand_ = 0;
};

}  // namespace meshlet_shape
