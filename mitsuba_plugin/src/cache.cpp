#include "cache.h"

#include <cstring>
#include <new>

namespace meshlet_shape {
namespace {

// A list of all slots. Slots are reused, never freed: an evicting thread walks the list without
// lock.
struct SlotNode {
  ThreadSlot slot;
  SlotNode* next = nullptr;
};

std::atomic<SlotNode*> g_slots{nullptr};
std::atomic<uint32_t> g_slot_count{0};
std::atomic<uint64_t> g_next_uid{1};

ThreadSlot& take_slot() {
  for (SlotNode* node = g_slots.load(std::memory_order_acquire); node; node = node->next) {
    bool expected = false;
    if (node->slot.taken.compare_exchange_strong(expected, true, std::memory_order_acquire))
      return node->slot;
  }
  auto* node = new SlotNode;
  node->slot.taken.store(true, std::memory_order_relaxed);
  node->slot.index = g_slot_count.fetch_add(1, std::memory_order_relaxed);
  node->next = g_slots.load(std::memory_order_relaxed);
  while (!g_slots.compare_exchange_weak(node->next, node, std::memory_order_release,
                                        std::memory_order_relaxed)) {
  }
  return node->slot;
}

struct SlotHolder {
  ThreadSlot& slot = take_slot();
  ~SlotHolder() {
    for (auto& announced : slot.announced) announced.store(nullptr, std::memory_order_release);
    for (auto& recent : slot.recent) recent = {};
    slot.taken.store(false, std::memory_order_release);
  }
};

bool announced_by_any(const Entry* entry) {
  for (SlotNode* node = g_slots.load(std::memory_order_acquire); node; node = node->next)
    for (auto& announced : node->slot.announced)
      if (announced.load(std::memory_order_seq_cst) == entry) return true;
  return false;
}

Entry* allocate(size_t bytes) {
  return static_cast<Entry*>(::operator new(bytes, std::align_val_t(kEntryAlignment)));
}
void release(Entry* entry) { ::operator delete(entry, std::align_val_t(kEntryAlignment)); }

}  // namespace

ThreadSlot& take_this_thread() {
  static thread_local SlotHolder holder;
  return *(t_slot = &holder.slot);
}

__thread ThreadSlot* t_slot = nullptr;

uint64_t thread_slots() { return g_slot_count.load(std::memory_order_relaxed); }

uint64_t scratch_bytes() {
  uint64_t sum = 0;
  for (SlotNode* node = g_slots.load(std::memory_order_acquire); node; node = node->next)
    for (auto& bytes : node->slot.scratch_bytes) sum += bytes.load(std::memory_order_relaxed);
  return sum;
}

Entry* ThreadSlot::scratch(EntryKind kind, size_t bytes) {
  size_t room = bytes + kEntryAlignment;
  if (scratch_bytes[kind].load(std::memory_order_relaxed) < room) {
    scratch_memory[kind] = std::make_unique<std::byte[]>(room);
    scratch_bytes[kind].store(room, std::memory_order_relaxed);
  }
  auto address = reinterpret_cast<uintptr_t>(scratch_memory[kind].get());
  auto* entry =
      reinterpret_cast<Entry*>((address + kEntryAlignment - 1) / kEntryAlignment * kEntryAlignment);
  entry->bytes = uint32_t(bytes);
  return entry;
}

// --- Table ---

Table::Table(std::shared_ptr<Store> store, uint32_t capacity, uint64_t limit_bytes)
    : store_(std::move(store)),
      uid_(g_next_uid.fetch_add(1)),
      entries_(new std::atomic<Entry*>[capacity]),
      limit_bytes_(limit_bytes) {
  for (uint32_t i = 0; i < capacity; i++) entries_[i].store(nullptr, std::memory_order_relaxed);
  store_->limit_.fetch_add(limit_bytes);
}

Table::~Table() {
  std::lock_guard lock(store_->mutex_);
  auto& residents = store_->residents_;
  for (size_t i = residents.size(); i-- > 0;)
    if (residents[i]->table == this) {
      Entry* entry = residents[i];
      store_->remove(uint32_t(i));
      release(entry);
    }
  store_->limit_.fetch_sub(limit_bytes_);
  store_->make_room(0);
}

void Table::note_hits(ThreadSlot& thread, uint32_t asks) {
  auto& hits = store_->counters(thread).hits;
  hits.store(hits.load(std::memory_order_relaxed) + asks, std::memory_order_relaxed);
}

const Entry* Table::find(ThreadSlot& thread, EntryKind kind, uint32_t key, uint32_t asks) {
  for (;;) {
    Entry* entry = entries_[key].load(std::memory_order_acquire);
    if (!entry) {
      thread.announced[kind].store(nullptr, std::memory_order_release);
      auto& misses = store_->counters(thread).misses;
      misses.store(misses.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      note_hits(thread, asks - 1);
      return nullptr;
    }
    thread.announced[kind].store(entry, std::memory_order_seq_cst);
    if (entries_[key].load(std::memory_order_seq_cst) == entry) {
      if (!entry->used.load(std::memory_order_relaxed))
        entry->used.store(1, std::memory_order_relaxed);
      note_hits(thread, asks);
      return entry;
    }
  }
}

void Table::insert(ThreadSlot& thread, const Entry& fresh) {
  auto& decoded = store_->counters(thread).decoded;
  decoded.store(decoded.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (fresh.bytes > store_->limit_.load(std::memory_order_relaxed)) return;
  // If another thread holds the lock, decoding again later is cheaper than waiting.
  std::unique_lock lock(store_->mutex_, std::try_to_lock);
  if (lock && entries_[fresh.key].load(std::memory_order_relaxed)) return;  // another was faster
  if (!lock || !store_->make_room(fresh.bytes)) {
    store_->refused_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  auto* entry = new (allocate(fresh.bytes)) Entry;
  entry->table = this;
  entry->key = fresh.key;
  entry->bytes = fresh.bytes;
  entry->place = uint32_t(store_->residents_.size());
  entry->used.store(0, std::memory_order_relaxed);
  std::memcpy(entry->payload(), fresh.payload(), fresh.bytes - sizeof(Entry));
  store_->residents_.push_back(entry);
  store_->resident_.fetch_add(entry->bytes, std::memory_order_relaxed);
  store_->entries_.fetch_add(1, std::memory_order_relaxed);
  entries_[entry->key].store(entry, std::memory_order_release);
}

// --- Store ---

Store::~Store() {
  for (Entry* entry : residents_) release(entry);
}

Statistics Store::statistics() const {
  Statistics s;
  for (const Counters& c : counters_) {
    s.hits += c.hits.load(std::memory_order_relaxed);
    s.misses += c.misses.load(std::memory_order_relaxed);
    s.decoded += c.decoded.load(std::memory_order_relaxed);
  }
  s.evictions = evictions_.load(std::memory_order_relaxed);
  s.refused = refused_.load(std::memory_order_relaxed);
  s.resident_bytes = resident_.load(std::memory_order_relaxed);
  s.resident_entries = entries_.load(std::memory_order_relaxed);
  s.limit_bytes = limit_.load(std::memory_order_relaxed);
  return s;
}

void Store::reset_statistics() {
  for (Counters& c : counters_)
    for (auto* counter : {&c.hits, &c.misses, &c.decoded})
      counter->store(0, std::memory_order_relaxed);
  evictions_.store(0, std::memory_order_relaxed);
  refused_.store(0, std::memory_order_relaxed);
}

// Evicts until `bytes` more fit. Returns false if that is impossible.
bool Store::make_room(size_t bytes) {
  const uint64_t limit = limit_.load(std::memory_order_relaxed);
  while (resident_.load(std::memory_order_relaxed) + bytes > limit) {
    Entry* victim = next_unused();
    if (!victim || !evict(victim)) return false;
  }
  return true;
}

// The hand of the clock passes over entries that were used since it came by last.
Entry* Store::next_unused() {
  for (size_t steps = 0; steps < 2 * residents_.size() + 1 && !residents_.empty(); steps++) {
    hand_ = (hand_ + 1) % uint32_t(residents_.size());
    Entry* entry = residents_[hand_];
    if (!entry->used.exchange(0, std::memory_order_relaxed) && !announced_by_any(entry))
      return entry;
  }
  return nullptr;
}

// Returns false, and keeps the entry, if a thread has announced it in the meantime.
bool Store::evict(Entry* entry) {
  std::atomic<Entry*>& home = entry->table->entries_[entry->key];
  home.store(nullptr, std::memory_order_seq_cst);
  if (announced_by_any(entry)) {
    home.store(entry, std::memory_order_release);
    return false;
  }
  remove(entry->place);
  release(entry);
  evictions_.fetch_add(1, std::memory_order_relaxed);
  return true;
}

void Store::remove(uint32_t place) {
  Entry* entry = residents_[place];
  residents_[place] = residents_.back();
  residents_[place]->place = place;
  residents_.pop_back();
  resident_.fetch_sub(entry->bytes, std::memory_order_relaxed);
  entries_.fetch_sub(1, std::memory_order_relaxed);
}

}  // namespace meshlet_shape
