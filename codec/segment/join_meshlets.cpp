#include "segment/join_meshlets.h"

#include <algorithm>

namespace gltf_meshlet_codec {
namespace {

// Half the number of consecutive sets along the curve that are packed together (best fit, largest
// first).
constexpr size_t kWindow = 32;

// A meshlet stores about one vertex in this many relative to its first, with the bits that its box
// needs. Sets are joined if these bits grow by at most max_spread.
constexpr int32_t kVerticesPerAnchor = 16;

int32_t bit_width(int32_t value) {
  int32_t bits = 0;
  for (; value > 0; value >>= 1) ++bits;
  return bits;
}

Load join_loads(const Load& a, const Load& b) {
  Load joined{a.triangles + b.triangles, a.vertices + b.vertices, a.low, a.high};
  for (size_t c = 0; c < 3; c++) {
    joined.low[c] = std::min(a.low[c], b.low[c]);
    joined.high[c] = std::max(a.high[c], b.high[c]);
  }
  return joined;
}

// Extra bits of storing both relative to one vertex instead of each relative to its own.
int32_t spread(const Load& a, const Load& b) {
  const Load joined = join_loads(a, b);
  int32_t bits = 0;
  for (size_t c = 0; c < 3; c++) {
    const int32_t width = bit_width(joined.high[c] - joined.low[c]);
    for (const Load* load : {&a, &b})
      bits += (width - bit_width(load->high[c] - load->low[c])) *
              int32_t(1 + load->vertices / kVerticesPerAnchor);
  }
  return bits;
}

class Packer {
 public:
  Packer(const std::vector<Load>& loads, uint32_t max_triangles, uint32_t max_vertices,
         int32_t max_spread)
      : loads_(loads),
        max_triangles_(max_triangles),
        max_vertices_(max_vertices),
        max_spread_(max_spread),
        parent_(loads.size()) {
    for (uint32_t i = 0; i < parent_.size(); i++) parent_[i] = i;
  }

  void join_contacts(std::vector<Contact>& contacts);
  void join_along(const Array<uint32_t>& curve_order);
  std::vector<uint32_t> number_sets();

 private:
  uint32_t find(uint32_t item) {
    while (parent_[item] != item) item = parent_[item] = parent_[parent_[item]];
    return item;
  }
  bool fit(const Load& a, const Load& b) const {
    return a.triangles + b.triangles <= max_triangles_ && a.vertices + b.vertices <= max_vertices_;
  }
  bool fits(uint32_t a, uint32_t b) const { return fit(loads_[a], loads_[b]); }
  void join(uint32_t a, uint32_t b) {
    if (b < a) std::swap(a, b);
    parent_[b] = a;
    loads_[a] = join_loads(loads_[a], loads_[b]);
  }
  // How full the set is: the larger of its shares of the two limits, scaled.
  uint32_t fill(uint32_t set) const {
    return std::max(loads_[set].triangles * max_vertices_, loads_[set].vertices * max_triangles_);
  }
  void pack_window(std::vector<uint32_t>& sets);

  std::vector<Load> loads_;
  const uint32_t max_triangles_, max_vertices_;
  const int32_t max_spread_;
  std::vector<uint32_t> parent_;
};

void Packer::join_contacts(std::vector<Contact>& contacts) {
  // Loads only grow: those that do not fit now never will.
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(),
                                [&](const Contact& c) { return !fits(c.a, c.b); }),
                 contacts.end());
  std::sort(contacts.begin(), contacts.end(), [](const Contact& x, const Contact& y) {
    if (x.weight != y.weight) return x.weight > y.weight;
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  });
  for (const Contact& contact : contacts) {
    const uint32_t a = find(contact.a), b = find(contact.b);
    if (a != b && fits(a, b)) join(a, b);
  }
}

void Packer::pack_window(std::vector<uint32_t>& sets) {
  std::sort(sets.begin(), sets.end(),
            [&](uint32_t a, uint32_t b) { return fill(a) != fill(b) ? fill(a) > fill(b) : a < b; });
  Load least = loads_[sets.empty() ? 0 : sets[0]];
  for (const uint32_t set : sets) {
    least.triangles = std::min(least.triangles, loads_[set].triangles);
    least.vertices = std::min(least.vertices, loads_[set].vertices);
  }
  std::vector<uint32_t> bins;
  std::vector<size_t> open;  // bins with room for any set
  for (const uint32_t set : sets) {
    size_t best = bins.size();
    for (const size_t i : open) {
      if (!fits(bins[i], set) || spread(loads_[bins[i]], loads_[set]) > max_spread_) continue;
      if (best == bins.size() || fill(bins[i]) > fill(bins[best])) best = i;
    }
    if (best == bins.size()) {
      bins.push_back(set);
      if (fit(loads_[set], least)) open.push_back(best);
    } else {
      join(bins[best], set);
      bins[best] = find(set);
    }
  }
  sets.swap(bins);
}

void Packer::join_along(const Array<uint32_t>& curve_order) {
  std::vector<uint32_t> sets;
  for (const uint32_t item : curve_order) {
    if (find(item) != item) continue;
    sets.push_back(item);
    if (sets.size() < 2 * kWindow) continue;
    pack_window(sets);
    // The emptiest sets stay open for the next ones.
    if (sets.size() > kWindow) sets.erase(sets.begin(), sets.end() - std::ptrdiff_t(kWindow));
  }
  pack_window(sets);
}

std::vector<uint32_t> Packer::number_sets() {
  std::vector<uint32_t> set(parent_.size());
  uint32_t count = 0;
  for (uint32_t i = 0; i < set.size(); i++) {
    const uint32_t root = find(i);
    set[i] = root == i ? count++ : set[root];
  }
  return set;
}

}  // namespace

std::vector<uint32_t> join_meshlets(const std::vector<Load>& loads, std::vector<Contact> contacts,
                                    const Array<uint32_t>& curve_order, uint32_t max_triangles,
                                    uint32_t max_vertices, int32_t max_spread) {
  Packer packer(loads, max_triangles, max_vertices, max_spread);
  packer.join_contacts(contacts);
  packer.join_along(curve_order);
  return packer.number_sets();
}

}  // namespace gltf_meshlet_codec
