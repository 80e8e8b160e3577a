#include "common/polygons.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace meshlet {
namespace {

// Points that are compared with ears, for each corner of all polygons; then fans do. A comb of
// 10,000 corners takes 60.
constexpr uint64_t kTestsPerCorner = 4096;

struct Point {
  double u, v;

  bool operator==(const Point& other) const { return u == other.u && v == other.v; }
};

// Twice the area of a triangle; above 0 if it turns left.
double area_of(const Point& a, const Point& b, const Point& c) {
  return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

// Which ears a polygon may lose. Only polygons that cross or touch themselves need the later ones.
enum class Ears {
  kClean,      // no other corner is in the ear, not even on its border
  kTouched,    // none is inside
  kFlat,       // also those without area
  kAnyCorner,  // all
};

// Cuts ears off one polygon: Meisters, "Polygons Have Ears", 1975. A corner's neighbours alone
// change when its ear is cut, so time is that of comparing all ears with all reflex corners; these
// are sorted along the longer side of the polygon, and an ear meets those in its range.
class EarClipper {
 public:
  // The polygon, which turns left as a whole.
  explicit EarClipper(std::vector<Point> points)
      : points_(std::move(points)), size_(uint32_t(points_.size())), corners_(size_) {
    for (uint32_t i = 0; i < size_; i++)
      corners_[i].previous = i ? i - 1 : size_ - 1, corners_[i].next = i + 1 < size_ ? i + 1 : 0;
    for (uint32_t i = 0; i < size_; i++) corners_[i].is_reflex = is_reflex(i);
    sort_reflex();
  }

  // Calls triangle(a, b, c) for each; takes what it compares from `tests`.
  template <class Triangle>
  void clip(uint64_t& tests, Triangle triangle) {
    uint32_t left = size_;
    for (const Ears ears : {Ears::kClean, Ears::kTouched, Ears::kFlat, Ears::kAnyCorner}) {
      ears_ = ears;
      look_at_all(tests);
      while (left > 3 && !waiting_.empty()) {
        const auto [corner, turn] = waiting_.front();
        waiting_.pop_front();
        Corner& c = corners_[corner];
        if (c.is_cut || c.turn != turn) continue;
        triangle(c.previous, corner, c.next);
        c.is_cut = true, left--;
        corners_[c.previous].next = c.next, corners_[c.next].previous = c.previous;
        for (const uint32_t neighbour : {c.previous, c.next}) {
          corners_[neighbour].is_reflex = is_reflex(neighbour);
          look_at(neighbour, tests);
        }
      }
      if (left == 3) break;
    }
    const auto last =
        std::find_if(corners_.begin(), corners_.end(), [](const Corner& c) { return !c.is_cut; });
    triangle(uint32_t(last - corners_.begin()), last->next, corners_[last->next].next);
  }

 private:
  struct Corner {
    uint32_t previous, next;
    uint32_t turn = 0;  // how often it was looked at: an older entry in `waiting_` is void
    bool is_reflex = false, is_cut = false;
  };
  struct Waiting {
    uint32_t corner, turn;
  };

  bool is_reflex(uint32_t i) const { return !(area_at(i) > 0); }
  double area_at(uint32_t i) const {
    const Corner& c = corners_[i];
    return area_of(points_[c.previous], points_[i], points_[c.next]);
  }
  double along(const Point& p) const { return is_tall_ ? p.v : p.u; }

  void sort_reflex() {
    const auto [low_u, high_u] = std::minmax_element(
        points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.u < b.u; });
    const auto [low_v, high_v] = std::minmax_element(
        points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.v < b.v; });
    is_tall_ = high_v->v - low_v->v > high_u->u - low_u->u;
    for (uint32_t i = 0; i < size_; i++)
      if (corners_[i].is_reflex) reflex_.push_back(i);
    std::sort(reflex_.begin(), reflex_.end(), [&](uint32_t a, uint32_t b) {
      const double first = along(points_[a]), second = along(points_[b]);
      return first != second ? first < second : a < b;
    });
  }

  void look_at_all(uint64_t& tests) {
    waiting_.clear();
    for (uint32_t i = 0; i < size_; i++)
      if (!corners_[i].is_cut) look_at(i, tests);
  }

  // Ears wait for their turn, so that the triangles of long polygons stay compact.
  void look_at(uint32_t i, uint64_t& tests) {
    corners_[i].turn++;
    if (is_ear(i, tests)) waiting_.push_back({i, corners_[i].turn});
  }

  bool is_ear(uint32_t i, uint64_t& tests) const {
    if (ears_ == Ears::kAnyCorner) return true;
    const double area = area_at(i);
    if (!(area > 0) && !(ears_ == Ears::kFlat && area == 0)) return false;
    const Corner& corner = corners_[i];
    const Point &a = points_[corner.previous], &b = points_[i], &c = points_[corner.next];
    const double low = std::min({along(a), along(b), along(c)});
    const double high = std::max({along(a), along(b), along(c)});
    auto at = std::lower_bound(reflex_.begin(), reflex_.end(), low,
                               [&](uint32_t p, double value) { return along(points_[p]) < value; });
    for (; at != reflex_.end() && along(points_[*at]) <= high; ++at) {
      if (!tests) return false;
      tests--;
      const Corner& other = corners_[*at];
      if (!other.is_cut && other.is_reflex && is_inside(points_[*at], a, b, c)) return false;
    }
    return true;
  }

  // Corners at the same place as one of the ear's, as at the ends of a cut to a hole, are outside.
  bool is_inside(const Point& p, const Point& a, const Point& b, const Point& c) const {
    if (p == a || p == b || p == c) return false;
    const double least = std::min({area_of(a, b, p), area_of(b, c, p), area_of(c, a, p)});
    return ears_ == Ears::kClean ? least >= 0 : least > 0;
  }

  std::vector<Point> points_;
  uint32_t size_;
  std::vector<Corner> corners_;
  std::vector<uint32_t> reflex_;  // along the longer side; some are cut or convex by now
  std::deque<Waiting> waiting_;
  Ears ears_ = Ears::kClean;
  bool is_tall_ = false;
};

// The plane of the coordinates that a polygon looks largest in, by its normal: Newell's.
struct Plane {
  int u, v;  // axes; the polygon turns left in them

  // Returns a plane; is_fan: whether all triangles around the first corner turn as the polygon.
  static Plane of(const float* points, uint32_t size, bool& is_fan);
  double area(const float* origin, const float* b, const float* c) const {
    return (double(b[u]) - origin[u]) * (double(c[v]) - origin[v]) -
           (double(b[v]) - origin[v]) * (double(c[u]) - origin[u]);
  }
};

Plane Plane::of(const float* points, uint32_t size, bool& is_fan) {
  constexpr Plane kPlanes[3] = {{1, 2}, {2, 0}, {0, 1}};
  double normal[3] = {};
  for (uint32_t i = 1; i + 1 < size; i++)
    for (int axis = 0; axis < 3; axis++)
      normal[axis] += kPlanes[axis].area(points, points + 3 * i, points + 3 * (i + 1));
  const int y = std::abs(normal[1]) > std::abs(normal[0]);
  const int axis = std::abs(normal[2]) > std::abs(normal[y]) ? 2 : y;
  Plane plane = kPlanes[axis];
  if (normal[axis] < 0) std::swap(plane.u, plane.v);
  is_fan = true;
  for (uint32_t i = 1; i + 1 < size && is_fan; i++)
    is_fan = plane.area(points, points + 3 * i, points + 3 * (i + 1)) > 0;
  if (!(std::abs(normal[axis]) > 0)) is_fan = true;  // no area, or no numbers: nothing is better
  return plane;
}

}  // namespace

std::vector<uint32_t> triangulate(const float* points, const uint32_t* sizes, size_t count) {
  size_t corner_count = 0, triangle_count = 0;
  for (size_t i = 0; i < count; i++) {
    corner_count += sizes[i];
    triangle_count += sizes[i] > 2 ? sizes[i] - 2 : 0;
  }
  std::vector<uint32_t> triangles;
  triangles.reserve(3 * triangle_count);
  uint64_t tests = kTestsPerCorner * corner_count;
  uint32_t first = 0;
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    triangles.insert(triangles.end(), {first + a, first + b, first + c});
  };
  for (size_t i = 0; i < count; first += sizes[i++]) {
    const uint32_t size = sizes[i];
    const float* const polygon = points + 3 * size_t(first);
    bool is_fan = true;
    const Plane plane = size > 3 ? Plane::of(polygon, size, is_fan) : Plane{0, 1};
    if (is_fan || !tests) {
      for (uint32_t corner = 2; corner < size; corner++) add(0, corner - 1, corner);
      continue;
    }
    std::vector<Point> flat(size);
    for (uint32_t corner = 0; corner < size; corner++)
      flat[corner] = {polygon[3 * corner + plane.u], polygon[3 * corner + plane.v]};
    EarClipper(std::move(flat)).clip(tests, add);
  }
  return triangles;
}

}  // namespace meshlet
