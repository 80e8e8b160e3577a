#include "encode/boundaries.h"

#include <algorithm>
#include <numeric>

#include "format/blob.h"
#include "common/parallel.h"

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kChunk = 256;  // disks per parallel item

// Shortest seam that is shared. A reference costs about 15 bits and saves about as much per vertex:
// shorter seams are cheaper as private vertices.
constexpr uint32_t kMinSeamLength = 2;

template <class Body>
void for_disks(int threads, size_t count, Body&& body) {
  for_blocks(threads, count, kChunk, [&](size_t, size_t first, size_t last) {
    for (size_t c = first; c < last; c++) body(uint32_t(c));
  });
}

class Builder {
 public:
  Builder(const MeshView& mesh, const HalfEdges& half_edges, const Meshlets& meshlets,
          const VertexValues& values, bool share_seams, int threads)
      : mesh_(mesh),
        half_edges_(half_edges),
        meshlets_(meshlets),
        values_(values),
        share_seams_(share_seams),
        threads_(threads) {}

  Boundaries build() {
    number_disks();
    find_loops();
    find_twins();
    cut_chains();
    if (drop_short_seams()) cut_chains();
    while (drop_excess()) cut_chains();
    find_references();
    while (drop_long_paths()) {
      cut_chains();
      find_references();
    }
    return std::move(b_);
  }

 private:
  size_t disk_count() const { return meshlets_.disk_begin.size() - 1; }

  void number_disks() {
    b_.place_of.resize(mesh_.triangle_count);
    b_.meshlet_of.resize(disk_count());
    for (size_t m = 0; m < meshlets_.count(); m++)
      for (uint32_t c = meshlets_.meshlet_begin[m]; c < meshlets_.meshlet_begin[m + 1]; c++)
        b_.meshlet_of[c] = uint32_t(m);
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      for (uint32_t i = meshlets_.disk_begin[c]; i < meshlets_.disk_begin[c + 1]; i++)
        b_.place_of[meshlets_.triangles[i]] = i;
    });
  }

  void find_loops() {
    b_.loops.resize(disk_count());
    std::vector<std::vector<uint32_t>> of_chunk(block_count(disk_count(), kChunk));
    for_disks(threads_, disk_count(),
              [&](uint32_t c) { b_.loops[c].count = walk_loop(c, of_chunk[c / kChunk]); });
    uint32_t places = 0;
    for (Loop& l : b_.loops) {
      l.begin = places;
      places += l.count;
    }
    b_.half_edge.resize(places);
    b_.vertex.resize(places);
    b_.place_disk.resize(places);
    place_of_.resize(3 * mesh_.triangle_count);
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      const Loop& l = b_.loops[c];
      const uint32_t first = b_.loops[c / kChunk * kChunk].begin;
      for (uint32_t p = l.begin; p < l.begin + l.count; p++) {
        const uint32_t h = of_chunk[c / kChunk][p - first];
        b_.half_edge[p] = h;
        b_.vertex[p] = mesh_.triangles[h];
        b_.place_disk[p] = c;
        place_of_[h] = p;
      }
    });
  }

  // Appends the half-edges around the disk and returns their number.
  uint32_t walk_loop(uint32_t c, std::vector<uint32_t>& half_edges) const {
    const uint32_t begin = meshlets_.disk_begin[c], count = meshlets_.disk_begin[c + 1] - begin;
    const auto is_inside = [&](uint32_t h) {
      const int32_t opposite = half_edges_.by_vertex(h);
      return opposite >= 0 && b_.place_of[uint32_t(opposite) / 3] - begin < count;
    };
    uint32_t i = begin, k = 0;
    while (is_inside(3 * meshlets_.triangles[i] + k)) {
      i += k == 2;
      k = k == 2 ? 0 : k + 1;
    }
    const uint32_t first = 3 * meshlets_.triangles[i] + k;
    const size_t before = half_edges.size();
    uint32_t h = first;
    do {
      half_edges.push_back(h);
      h = next_in_triangle(h);  // turn around the end of h until the next boundary edge
      while (is_inside(h)) h = next_in_triangle(uint32_t(half_edges_.by_vertex(h)));
    } while (h != first);
    return uint32_t(half_edges.size() - before);
  }

  // Finds the place across each boundary edge, and the streams that are equal on both sides.
  void find_twins() {
    twin_.resize(b_.half_edge.size());
    shared_.resize(b_.half_edge.size());
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      for (uint32_t p = b_.loops[c].begin; p < b_.loops[c].begin + b_.loops[c].count; p++) {
        twin_[p] = kNone;
        shared_[p] = 0;
        uint32_t h = b_.half_edge[p];
        const bool whole = half_edges_.by_vertex(h) >= 0;
        const int32_t other = share_seams_ ? half_edges_.by_position(h) : half_edges_.by_vertex(h);
        if (other < 0) continue;
        twin_[p] = place_of_[other];
        shared_[p] = whole ? ~0ull : equal_streams(p, twin_[p]);
        if (!(shared_[p] & 1)) twin_[p] = kNone;
      }
    });
  }

  uint64_t equal_streams(uint32_t p, uint32_t q) const {
    uint32_t p1 = b_.vertex[b_.next(p)], q1 = b_.vertex[b_.next(q)];
    uint64_t equal = 0;
    for (uint32_t s = 0; s < values_.values.size(); s++)
      if (values_.equal(s, b_.vertex[p], q1) && values_.equal(s, p1, b_.vertex[q]))
        equal |= 1ull << s;
    return equal == all_streams() ? ~0ull : equal;
  }

  uint64_t all_streams() const {
    return values_.values.size() >= 64 ? ~0ull : (1ull << values_.values.size()) - 1;
  }

  // Does the chain continue from the place before p to p, on both sides? It ends where a seam folds
  // a loop onto itself.
  bool continues(uint32_t p) const {
    uint32_t before = b_.previous(p);
    if (twin_[p] == kNone || twin_[before] == kNone) return twin_[p] == twin_[before];
    return shared_[p] == shared_[before] && b_.next(twin_[p]) == twin_[before] &&
           twin_[p] != before;
  }

  // Marks the first place of each chain. A closed chain is cut at the same vertex on both sides.
  void cut_chains() {
    cut_.resize(b_.half_edge.size());
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      const Loop& l = b_.loops[c];
      bool any = false;
      uint32_t lowest = l.begin;  // place of the loop's lowest edge number, over both sides
      for (uint32_t p = l.begin; p < l.begin + l.count; p++) {
        cut_[p] = !continues(p);
        any = any || cut_[p];
        if (edge_number(p) < edge_number(lowest)) lowest = p;
      }
      if (!any) cut_[b_.half_edge[lowest] == edge_number(lowest) ? lowest : b_.next(lowest)] = 1;
    });
  }

  uint32_t edge_number(uint32_t p) const {
    return twin_[p] == kNone ? b_.half_edge[p] : std::min(b_.half_edge[p], b_.half_edge[twin_[p]]);
  }

  // Length of the chain that begins at place p.
  uint32_t chain_length(uint32_t p) const {
    uint32_t n = 1;
    for (uint32_t q = b_.next(p); !cut_[q]; q = b_.next(q)) n++;
    return n;
  }

  // Makes the chain that begins at p private on both sides.
  void drop_chain(uint32_t p) {
    for (uint32_t n = chain_length(p), q = p; n > 0; n--, q = b_.next(q)) {
      twin_[twin_[q]] = kNone;
      twin_[q] = kNone;
    }
  }

  // Returns whether any chain was dropped.
  bool drop_short_seams() {
    bool dropped = false;
    for (uint32_t p = 0; p < cut_.size(); p++) {
      if (!cut_[p] || twin_[p] == kNone || shared_[p] == ~0ull) continue;
      any_seams_ = true;
      if (chain_length(p) >= kMinSeamLength) continue;
      drop_chain(p);
      dropped = true;
    }
    return dropped;
  }

  // A meshlet with more references than its directory entry can count gives up shared chains, seams
  // first. Returns whether any chain was dropped.
  bool drop_excess() {
    bool dropped = false;
    for (size_t m = 0; m < meshlets_.count(); m++) {
      uint32_t begin = b_.loops[meshlets_.meshlet_begin[m]].begin;
      const Loop& last = b_.loops[meshlets_.meshlet_begin[m + 1] - 1];
      uint32_t end = last.begin + last.count;
      uint32_t references = uint32_t(std::count(cut_.begin() + begin, cut_.begin() + end, 1));
      for (int seams = 1; seams >= 0 && references > MESHLET_MAX_REFERENCES; seams--)
        for (uint32_t p = begin; p < end && references > MESHLET_MAX_REFERENCES; p++)
          if (cut_[p] && twin_[p] != kNone && (shared_[p] != ~0ull || !seams)) {
            drop_chain(p);
            references--;
            dropped = true;
          }
    }
    return dropped;
  }

  // The owner of a chain is its side of the smaller disk, so of the smaller meshlet; within one
  // disk, of the smaller place.
  void find_references() {
    b_.reference_begin.assign(disk_count() + 1, 0);
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      const auto first = cut_.begin() + b_.loops[c].begin;
      b_.reference_begin[c + 1] = uint32_t(std::count(first, first + b_.loops[c].count, 1));
    });
    std::partial_sum(b_.reference_begin.begin(), b_.reference_begin.end(),
                     b_.reference_begin.begin());
    b_.references.resize(b_.reference_begin.back());
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      uint32_t p = b_.loops[c].begin;
      while (!cut_[p]) p++;
      for (uint32_t i = b_.reference_begin[c]; i < b_.reference_begin[c + 1]; i++)
        p = place_reference(c, p, b_.references[i]);
    });
  }

  // Returns the place after it.
  uint32_t place_reference(uint32_t c, uint32_t p, Reference& r) const {
    r = {p, 1, ReferenceKind::kPrivate, ~0ull, kNone};
    uint32_t last = p, next = b_.next(p);
    for (; !cut_[next]; next = b_.next(next)) {
      last = next;
      r.length++;
    }
    if (twin_[p] == kNone) return next;
    const uint32_t other = b_.place_disk[twin_[p]];
    r.owner_start = twin_[last];
    const bool owned = c < other || (c == other && p < r.owner_start);
    r.kind = owned ? ReferenceKind::kOwned : ReferenceKind::kForeign;
    r.shared = shared_[p];
    return next;
  }

  // Does reference r store its own values for stream s? all() stands for the whole vertex, which is
  // shared only if every stream is.
  bool own_for(const Reference& r, uint32_t s) const {
    return r.kind != ReferenceKind::kForeign ||
           (s == all() ? r.shared != ~0ull : !(r.shared >> s & 1));
  }
  uint32_t all() const { return uint32_t(values_.values.size()); }

  const Reference& reference_at(uint32_t c, uint32_t start) const {
    const DiskReferences references = b_.references_of(c);
    for (const Reference& r : references)
      if (r.start == start) return r;
    return references[0];
  }

  // Number of hops that the decoder takes from corner i of disk c for stream s; MAX_HOPS + 1 if it
  // gives up.
  uint32_t hops(uint32_t c, size_t i, uint32_t s) const {
    const DiskReferences refs = b_.references_of(c);
    const Reference* at = &refs[i];
    const Reference* before = &refs[(i + refs.size() - 1) % refs.size()];
    if (own_for(*at, s) && own_for(*before, s)) return 0;
    bool at_end = !own_for(*at, s);
    if (at_end && !own_for(*before, s)) at_end = owner_meshlet(*before) >= owner_meshlet(*at);
    const Reference* way = at_end ? at : before;
    for (uint32_t hop = 1; hop <= MAX_HOPS; hop++) {
      uint32_t owner = b_.place_disk[way->owner_start];
      const DiskReferences list = b_.references_of(owner);
      size_t k = size_t(&reference_at(owner, way->owner_start) - list.data);
      way = &list[at_end ? (k + 1) % list.size() : (k + list.size() - 1) % list.size()];
      if (own_for(*way, s)) return hop;
    }
    return MAX_HOPS + 1;
  }

  uint32_t owner_meshlet(const Reference& r) const {
    return b_.meshlet_of[b_.place_disk[r.owner_start]];
  }

  bool long_path(uint32_t c, size_t i) const {
    // Without seams, all streams take the way of the whole vertex.
    for (uint32_t s = any_seams_ ? 0 : all(); s <= all(); s++)
      if (hops(c, i, s) > MAX_HOPS) return true;
    return false;
  }

  // Makes chains private whose corners take too many hops: seams of a disk with itself may form a
  // cycle, rings of meshlets a long path. Returns whether any chain was dropped.
  bool drop_long_paths() {
    std::vector<uint8_t> found(disk_count(), 0);
    for_disks(threads_, disk_count(), [&](uint32_t c) {
      for (size_t i = 0; i < b_.references_of(c).size(); i++) found[c] |= long_path(c, i);
    });
    for (uint32_t c = 0; c < disk_count(); c++) {
      if (!found[c]) continue;
      const DiskReferences refs = b_.references_of(c);
      for (size_t i = 0; i < refs.size(); i++)
        if (long_path(c, i))
          for (size_t k : {i, (i + refs.size() - 1) % refs.size()})
            if (twin_[refs[k].start] != kNone) drop_chain(refs[k].start);
    }
    return std::count(found.begin(), found.end(), 1) > 0;
  }

  const MeshView& mesh_;
  const HalfEdges& half_edges_;
  const Meshlets& meshlets_;
  const VertexValues& values_;
  bool share_seams_;
  int threads_;
  Boundaries b_;
  Array<uint32_t> place_of_;  // per half-edge of a boundary
  Array<uint32_t> twin_;      // per place
  Array<uint64_t> shared_;    // per place
  Array<uint8_t> cut_;        // per place: a chain begins here
  bool any_seams_ = false;    // some chain shares some of the streams only
};

}  // namespace

Boundaries find_boundaries(const MeshView& mesh, const HalfEdges& half_edges,
                           const Meshlets& meshlets, const VertexValues& values, bool share_seams,
                           int threads) {
  return Builder(mesh, half_edges, meshlets, values, share_seams, threads).build();
}

}  // namespace gltf_meshlet_codec
