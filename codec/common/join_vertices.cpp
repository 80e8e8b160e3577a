#include "common/join_vertices.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/forest.h"
#include "common/weld.h"

namespace gltf_meshlet_codec {
namespace {

constexpr size_t kMostCompared = 16;  // open edges of one place that are matched with care
constexpr size_t kMostTried = 8;      // vertices of one place that another one may join

// A directed edge of a triangle. low, high: its ends' places, the lower one first.
struct Edge {
  uint32_t low, high, from, to;

  uint32_t first() const { return std::min(from, to); }
  uint32_t last() const { return std::max(from, to); }
};

// Two open edges on each other, in opposite directions: a ends where b starts.
struct Match {
  Edge a, b;
};

class Joiner {
 public:
  Joiner(const DecodedMesh& mesh, uint32_t source_vertices, uint32_t* numbers)
      : mesh_(mesh), source_vertices_(source_vertices), parent_(numbers) {}

  uint32_t run() {
    std::iota(parent_, parent_ + mesh_.vertex_count, 0u);
    left_ = mesh_.vertex_count;
    if (source_vertices_ >= left_) return uint32_t(left_);
    find_places();
    const size_t places = left_ - doubled_.size() + place_begin_.size() - 1;
    if (source_vertices_ && source_vertices_ >= places) target_ = source_vertices_;
    if (source_vertices_ && source_vertices_ <= places)
      join_all();
    else if (!doubled_.empty())
      join_some();
    return number();
  }

 private:
  // --- places: one for all vertices with equal integers, named by the first of them ---

  // Finds the vertices that are not alone at their places.
  void find_places() {
    std::vector<uint32_t> vertices(mesh_.vertex_count), ids(mesh_.vertex_count);
    std::iota(vertices.begin(), vertices.end(), 0u);
    const uint32_t* positions = mesh_.integers[0];
    uint32_t count = weld_rows(reinterpret_cast<const uint8_t*>(positions), vertices.size(),
                               4 * mesh_.elements[0], ids.data());
    keep_repeated(vertices, ids, count);
    if (mesh_.stream_count > 1) {
      count = weld_whole(vertices, ids);
      keep_repeated(vertices, ids, count);
    }
    sort_by_place(vertices, ids, count);
  }

  // Leaves only those vertices whose ids others have too.
  static void keep_repeated(std::vector<uint32_t>& vertices, std::vector<uint32_t>& ids,
                            uint32_t count) {
    std::vector<uint8_t> seen(count, 0);
    for (uint32_t id : ids) seen[id] = uint8_t(std::min(seen[id] + 1, 2));
    size_t kept = 0;
    for (size_t i = 0; i < vertices.size(); i++)
      if (seen[ids[i]] > 1) {
        vertices[kept] = vertices[i];
        ids[kept++] = ids[i];
      }
    vertices.resize(kept);
    ids.resize(kept);
  }

  // Sets the ids of vertices by the integers of all streams. Returns the number of ids.
  uint32_t weld_whole(const std::vector<uint32_t>& vertices, std::vector<uint32_t>& ids) const {
    const size_t elements =
        std::accumulate(mesh_.elements, mesh_.elements + mesh_.stream_count, size_t(0));
    std::vector<uint32_t> rows(vertices.size() * elements);
    uint32_t* row = rows.data();
    for (uint32_t v : vertices)
      for (size_t s = 0; s < mesh_.stream_count; s++) {
        const uint32_t* from = mesh_.integers[s] + size_t(v) * mesh_.elements[s];
        row = std::copy(from, from + mesh_.elements[s], row);
      }
    return weld_rows(reinterpret_cast<const uint8_t*>(rows.data()), vertices.size(), 4 * elements,
                     ids.data());
  }

  // Sets doubled_, place_begin_ and place_.
  void sort_by_place(const std::vector<uint32_t>& vertices, const std::vector<uint32_t>& ids,
                     uint32_t count) {
    std::vector<uint32_t> end(count + 1, 0);
    for (uint32_t id : ids) end[id + 1]++;
    std::partial_sum(end.begin(), end.end(), end.begin());
    doubled_.resize(vertices.size());
    std::vector<uint32_t> next(end);
    for (size_t i = 0; i < vertices.size(); i++) doubled_[next[ids[i]]++] = vertices[i];
    place_begin_ = {0};
    for (uint32_t at : end)
      if (at > place_begin_.back()) place_begin_.push_back(at);
    place_.assign(parent_, parent_ + mesh_.vertex_count);
    for (size_t p = 0; p + 1 < place_begin_.size(); p++)
      for (uint32_t i = place_begin_[p]; i < place_begin_[p + 1]; i++)
        place_[doubled_[i]] = doubled_[place_begin_[p]];
    is_doubled_.assign(mesh_.vertex_count, false);
    for (uint32_t v : doubled_) is_doubled_[v] = true;
  }

  void join_all() {
    for (uint32_t v : doubled_) parent_[v] = place_[v];
  }

  // --- which vertices of a place are one: from the most certain ones on ---

  void join_some() {
    find_edges();
    find_matches();
    edges_ = {};
    join_shared();
    join_across_blobs();
    join_touching(false);
    join_without_closing();
    for (const Match& match : matches_) join_ends(match);
    if (source_vertices_) join_touching(true);
  }

  // The edges at doubled vertices. Notes corners of one triangle at one place, which are different
  // vertices: encoders drop triangles that have a vertex twice.
  void find_edges() {
    for (size_t i = 0; i < 3 * mesh_.triangle_count; i += 3)
      for (size_t k = 0; k < 3; k++) {
        const uint32_t from = mesh_.triangles[i + k], to = mesh_.triangles[i + (k + 1) % 3];
        if (from == to || !(is_doubled_[from] || is_doubled_[to])) continue;
        const uint32_t start = place_[from], end = place_[to];
        edges_.push_back({std::min(start, end), std::max(start, end), from, to});
        if (start != end) continue;
        separate(from, to);
        collapsed_.push_back(start);
      }
    std::sort(edges_.begin(), edges_.end(), [](const Edge& a, const Edge& b) {
      if (a.low != b.low) return a.low < b.low;
      if (a.high != b.high) return a.high < b.high;
      if (a.first() != b.first()) return a.first() < b.first();
      if (a.last() != b.last()) return a.last() < b.last();
      return a.from < b.from;
    });
  }

  void find_matches() {
    std::vector<Edge> open;
    for (size_t i = 0, end; i < edges_.size(); i = end) {
      open.clear();
      for (end = i; end < edges_.size() && same_places(edges_[i], edges_[end]);)
        end = add_open(end, open);
      if (edges_[i].low == edges_[i].high)
        match_collapsed(open);
      else
        match_opposite(open);
    }
  }

  static bool same_places(const Edge& a, const Edge& b) {
    return a.low == b.low && a.high == b.high;
  }

  // Adds what is left of the edges between two vertices, from `first` on, when pairs in opposite
  // directions are gone. Returns the edge after them.
  size_t add_open(size_t first, std::vector<Edge>& open) const {
    const Edge& edge = edges_[first];
    size_t end = first, same = 0;
    for (; end < edges_.size() && edges_[end].first() == edge.first() &&
           edges_[end].last() == edge.last();
         end++)
      same += edges_[end].from == edge.from;
    const size_t other = end - first - same;
    for (size_t n = other; n < same; n++) open.push_back(edge);
    for (size_t n = same; n < other; n++) open.push_back(edges_[end - 1]);
    return end;
  }

  // Edges without length have no direction.
  void match_collapsed(const std::vector<Edge>& open) {
    for (size_t i = 1; i < open.size(); i += 2) matches_.push_back({open[i - 1], open[i]});
  }

  void match_opposite(std::vector<Edge>& open) {
    const auto middle = std::stable_partition(
        open.begin(), open.end(), [&](const Edge& e) { return place_[e.from] == e.low; });
    const size_t forth = size_t(middle - open.begin()), back = open.size() - forth;
    const bool with_care = forth <= kMostCompared && back <= kMostCompared;
    for (size_t i = 0; i < std::min(forth, back); i++) {
      const auto first = middle + ptrdiff_t(i);
      // One that has a vertex in common is the likelier one.
      auto best = first;
      if (with_care)
        best = std::find_if(first, open.end(), [&](const Edge& b) {
          return open[i].from == b.to || open[i].to == b.from;
        });
      std::swap(*first, *(best == open.end() ? first : best));
      matches_.push_back({open[i], *first});
    }
  }

  // Vertices that share a position in the blob and are equal in all else.
  void join_shared() {
    if (!mesh_.shared) return;
    std::vector<std::pair<uint32_t, uint32_t>> firsts;  // of a place: (vertex whose position it
                                                        // shares, vertex)
    for (size_t p = 0; p + 1 < place_begin_.size(); p++) {
      firsts.clear();
      for (uint32_t i = place_begin_[p]; i < place_begin_[p + 1]; i++) {
        uint32_t first = doubled_[i];
        while (mesh_.shared[first] != first) first = mesh_.shared[first];
        firsts.push_back({first, doubled_[i]});
      }
      std::sort(firsts.begin(), firsts.end());
      for (size_t i = 1; i < firsts.size(); i++)
        if (firsts[i].first == firsts[i - 1].first) join(firsts[i].second, firsts[i - 1].second);
    }
  }

  // Blobs double every vertex that they share.
  void join_across_blobs() {
    for (const Match& match : matches_)
      if (blob_of(match.a.from) != blob_of(match.b.from)) join_ends(match);
  }

  // Joins ends of matches unless that closes an edge: the other ends are two vertices. Where a
  // crack of the source is closed on the grid, such ends may be one vertex, its edges are not.
  void join_without_closing() {
    struct End {
      uint32_t a, b, other_a, other_b;
    };
    std::vector<End> ends;
    const auto add = [&](uint32_t a, uint32_t b, uint32_t other_a, uint32_t other_b) {
      if (find(a) != find(b)) ends.push_back({std::min(a, b), std::max(a, b), other_a, other_b});
    };
    for (const auto& [a, b] : matches_) {
      add(a.from, b.to, a.to, b.from);
      add(a.to, b.from, a.from, b.to);
    }
    std::sort(ends.begin(), ends.end(),
              [](const End& x, const End& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
    // Those with one match first: they leave the most of the others possible.
    for (const bool single : {true, false})
      for (size_t i = 0, end; i < ends.size(); i = end) {
        bool closes = false;
        for (end = i; end < ends.size() && ends[end].a == ends[i].a && ends[end].b == ends[i].b;
             end++)
          closes = closes || find(ends[end].other_a) == find(ends[end].other_b);
        if (!closes && (end - i == 1) == single) join(ends[i].a, ends[i].b);
      }
  }

  // Joins vertices that no edges connect, as where two cones touch. all: also at places of edges
  // without length, and of open edges that match.
  void join_touching(bool all) {
    std::vector<bool> is_doubtful(mesh_.vertex_count, false);
    if (!all) {
      for (uint32_t place : collapsed_) is_doubtful[place] = true;
      for (const auto& [a, b] : matches_) {
        if (find(a.from) != find(b.to)) is_doubtful[place_[a.from]] = true;
        if (find(a.to) != find(b.from)) is_doubtful[place_[a.to]] = true;
      }
    }
    for (size_t p = 0; p + 1 < place_begin_.size(); p++)
      if (!is_doubtful[doubled_[place_begin_[p]]])
        join_place(&doubled_[place_begin_[p]], place_begin_[p + 1] - place_begin_[p]);
  }

  void join_place(const uint32_t* vertices, size_t count) {
    std::vector<uint32_t> roots;
    for (size_t i = 0; i < count; i++) {
      const uint32_t v = vertices[i];
      bool is_joined = false;
      for (size_t k = 0; k < std::min(roots.size(), kMostTried) && !is_joined; k++)
        is_joined = find(v) == find(roots[k]) || join(v, roots[k]);
      if (!is_joined) roots.push_back(v);
    }
  }

  void join_ends(const Match& match) {
    join(match.a.from, match.b.to);
    join(match.a.to, match.b.from);
  }

  size_t blob_of(uint32_t v) const {
    return size_t(std::upper_bound(mesh_.blob_begin, mesh_.blob_begin + mesh_.blob_count, v) -
                  mesh_.blob_begin);
  }

  // --- sets of vertices that are one ---

  uint32_t find(uint32_t v) { return root_of(parent_, v); }

  // Returns whether the vertices were joined: not if they are one, if triangles keep them apart, or
  // if as many are left as the source had.
  bool join(uint32_t v, uint32_t w) {
    v = find(v);
    w = find(w);
    if (v == w || left_ <= target_ || are_apart(v, w)) return false;
    if (w < v) std::swap(v, w);
    parent_[w] = v;
    left_--;
    join_lists(v, w);
    return true;
  }

  // Notes that two vertices are different ones.
  void separate(uint32_t v, uint32_t w) {
    others_[v].push_back(w);
    others_[w].push_back(v);
  }

  bool are_apart(uint32_t v, uint32_t w) {
    const auto a = others_.find(v), b = others_.find(w);
    if (a == others_.end() || b == others_.end()) return false;
    const bool is_shorter = a->second.size() <= b->second.size();
    const uint32_t root = is_shorter ? w : v;
    const std::vector<uint32_t>& list = (is_shorter ? a : b)->second;
    return std::any_of(list.begin(), list.end(), [&](uint32_t u) { return find(u) == root; });
  }

  // The set w goes into the set v.
  void join_lists(uint32_t v, uint32_t w) {
    const auto from = others_.find(w);
    if (from == others_.end()) return;
    std::vector<uint32_t> less = std::move(from->second);
    others_.erase(from);
    std::vector<uint32_t>& list = others_[v];
    if (list.size() < less.size()) list.swap(less);
    list.insert(list.end(), less.begin(), less.end());
  }

  // Turns sets into numbers. The root of a set is its first vertex.
  uint32_t number() {
    for (uint32_t v = 0; v < mesh_.vertex_count; v++) parent_[v] = find(v);
    uint32_t count = 0;
    for (uint32_t v = 0; v < mesh_.vertex_count; v++)
      parent_[v] = parent_[v] == v ? count++ : parent_[parent_[v]];
    return count;
  }

  const DecodedMesh mesh_;
  const uint32_t source_vertices_;
  uint32_t* const parent_;             // per vertex: another one of its set, or itself
  size_t left_ = 0, target_ = 0;       // sets; how many are to be left, if all others can be joined
  std::vector<uint32_t> place_;        // per vertex
  std::vector<bool> is_doubled_;       // per vertex
  std::vector<uint32_t> doubled_;      // place after place, in ascending order
  std::vector<uint32_t> place_begin_;  // in doubled_
  std::vector<Edge> edges_;
  std::vector<Match> matches_;
  std::vector<uint32_t> collapsed_;                             // places of edges without length
  std::unordered_map<uint32_t, std::vector<uint32_t>> others_;  // of a set: vertices not in it
};

}  // namespace

uint32_t join_vertices(const DecodedMesh& mesh, uint32_t source_vertices, uint32_t* numbers) {
  return Joiner(mesh, source_vertices, numbers).run();
}

}  // namespace gltf_meshlet_codec
