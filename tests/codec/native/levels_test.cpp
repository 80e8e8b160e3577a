// Parts of the builder of levels: groups are simplified up to one error, distances count by area,
// corners choose their vertices. The simplifier is a stand-in.
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "lod/error_meter.h"
#include "lod/group_meshlets.h"
#include "lod/level_pages.h"
#include "lod/reduce_groups.h"
#include "lod/vertex_choices.h"
#include "stand_in_simplifier.h"

using namespace gltf_meshlet_codec;

namespace {

int failures = 0;

void expect(bool holds, const char* what, int line) {
  if (holds) return;
  failures++;
  std::fprintf(stderr, "levels_test.cpp:%d: %s\n", line, what);
}
#define EXPECT(condition) expect(condition, #condition, __LINE__)

using Numbers = std::vector<uint32_t>;
constexpr uint32_t kSide = 24;  // vertices of a sheet's side
constexpr double kStep = 4, kHigh = 1.2, kInfinite = std::numeric_limits<double>::infinity();
constexpr int kTries = 3, kLastTries = 2;  // of reduce_groups.cpp

Numbers counted(size_t count) {
  Numbers numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

// Flat sheets of unit cells, one after the other along x, each a group.
struct Sheets {
  uint32_t side;
  std::vector<float> points;
  Triangles triangles;
  Numbers begin{0};

  explicit Sheets(uint32_t side_vertices, uint32_t count = 1) : side(side_vertices) {
    for (uint32_t sheet = 0; sheet < count; sheet++) add(2 * side * sheet);
  }

  void add(uint32_t offset) {
    const auto first = uint32_t(points.size() / 3);
    for (uint32_t i = 0; i < side * side; i++)
      points.insert(points.end(), {float(offset + i % side), float(i / side), 0});
    for (uint32_t i = 0; i < side * (side - 1); i++) {
      if (i % side == side - 1) continue;
      const uint32_t a = first + i, b = a + side;
      triangles.insert(triangles.end(), {a, a + 1, b, b, a + 1, b + 1});
    }
    begin.push_back(uint32_t(triangles.size() / 3));
  }

  GroupTriangles groups() const { return {triangles.data(), begin}; }
  std::shared_ptr<const Triangles> shared() const { return std::make_shared<Triangles>(triangles); }
};

Surface surface_of(const Sheets& sheets, const Numbers& numbers) {
  Surface s{};
  s.triangles = sheets.triangles.data();
  s.triangle_count = sheets.triangles.size() / 3;
  s.vertex_count = numbers.size();
  s.points = s.seam_points = sheets.points.data();
  s.position_ids = s.canonical_vertices = numbers.data();
  s.shapes = {s.points};
  s.vertex_of_position = numbers;
  return s;
}

// error_of(group, attempt) stands for the measurement, `lost` for what it finds lost.
struct Stated : GroupMeasure {
  std::function<double(uint32_t, int)> error_of;
  std::map<uint32_t, Numbers> lost;
  std::vector<int> attempts = std::vector<int>(8);

  std::vector<float> measure(const Pieces&, const Numbers& groups) override {
    std::vector<float> errors;
    for (uint32_t g : groups) errors.push_back(float(error_of(g, ++attempts[g])));
    return errors;
  }
  Numbers lost_vertices(uint32_t group, const Triangles&, double) const override {
    const auto at = lost.find(group);
    return at == lost.end() ? Numbers() : at->second;
  }
};

// Eight sheets after reduce_groups.
struct Reduced {
  Sheets sheets{kSide, 8};
  Stated stated;
  ReducedGroups result;

  explicit Reduced(std::function<double(uint32_t, int)> error_of,
                   std::map<uint32_t, Numbers> lost = {}, double expected = kInfinite) {
    stated.error_of = std::move(error_of);
    stated.lost = std::move(lost);
    const Numbers numbers = counted(sheets.points.size() / 3);
    result = reduce_groups(surface_of(sheets, numbers), sheets.groups(), kStep, stated, expected,
                           kStandIn, 2);
  }
  bool attempted(int times, uint32_t group) const { return stated.attempts[group] == times; }
  bool is_small(uint32_t g) const {
    const size_t triangles = result.pieces[g].size() / 3;
    return triangles > 0 && double(triangles) <= double(sheets.groups().size(g)) / kStep + 1;
  }
  bool errors_are(double error) const {
    return result.error == std::vector<double>(8, double(float(error)));
  }
};

void test_groups_near_the_median_are_simplified_once() {
  const Reduced r([](uint32_t g, int) { return 1 + g / 100.0; });
  for (uint32_t g = 0; g < 8; g++)
    EXPECT(r.attempted(1, g) && r.is_small(g) && r.result.error[g] <= kHigh * 1.04);
}

void test_a_group_that_is_farther_is_tried_again() {
  const Reduced r([](uint32_t g, int n) { return g == 3 && n < 3 ? 1.3 : 1; });
  EXPECT(r.attempted(3, 3) && r.errors_are(1));
  const Reduced slow([](uint32_t g, int n) { return g == 3 && n <= kTries + 1 ? 1.3 : 1; });
  EXPECT(slow.attempted(kTries + 2, 3) && slow.errors_are(1) && slow.is_small(3));
}

void test_a_group_that_stays_farther_waits() {
  const Reduced r([](uint32_t g, int) { return g == 3 ? 1.3 : 1; });
  EXPECT(r.attempted(1 + kTries + kLastTries, 3) && std::isinf(r.result.error[3]));
  EXPECT(r.result.pieces[3] == r.sheets.groups().of(3) && r.result.error[4] == 1);
}

void test_what_a_group_lost_stays_at_the_next_try() {
  const uint32_t middle = 3 * kSide * kSide + kSide * (kSide / 2) + kSide / 2;
  const Numbers lost{middle, middle + 2, middle + 2 * kSide};
  const Reduced r([](uint32_t g, int n) { return g == 3 && n == 1 ? 9 : 1; }, {{3, lost}});
  const Triangles& after = r.result.pieces[3];
  EXPECT(r.attempted(2, 3) && r.is_small(3));
  for (uint32_t v : lost) EXPECT(std::find(after.begin(), after.end(), v) != after.end());
}

void test_levels_that_grow_too_much() {
  const auto first_is_far = [](double then) {
    return [then](uint32_t, int n) { return n == 1 ? 9 : then; };
  };
  const Reduced again(first_is_far(1), {}, 2);
  EXPECT(again.attempted(2, 0) && again.errors_are(1));
  // Nothing is as near as expected, and nothing is simplified further than it must be.
  const Reduced looser(first_is_far(2.1), {}, 1);
  EXPECT(looser.errors_are(2.1) && looser.is_small(0));
  const Reduced grows([](uint32_t, int n) { return 8.0 + n; }, {}, 2);  // keeps its first errors
  EXPECT(grows.errors_are(8.0 + grows.stated.attempts[0]) && grows.is_small(0));
}

float measured(const std::vector<float>& points, const Triangles& before, const Triangles& after) {
  const Numbers begin{0, uint32_t(before.size() / 3)}, ids = counted(begin[1]);
  const auto level_0 = std::make_shared<Triangles>(before);
  ErrorMeter meter({points.data()}, points.size() / 3, level_0, begin, ids, 1);
  meter.begin_level(level_0, begin, ids);
  return meter.measure({after}, {0})[0];
}

// The distance stated where a flat sheet replaces one with a spike of height 5 at a vertex.
float spiked(uint32_t side) {
  Sheets sheets(side, 1);
  const Triangles before = sheets.triangles;
  sheets.add(0);
  sheets.points[3 * (side * side / 2 + side / 2) + 2] = 5;
  return measured(
      sheets.points, before,
      {sheets.triangles.begin() + std::ptrdiff_t(before.size()), sheets.triangles.end()});
}

// Large triangles of a square of 1000 units, less a strip of [begin, end) along x, and a sheet of
// small ones beside it.
void add_square(Sheets& sheets, const std::vector<float>& ends) {
  sheets.add(0);
  for (size_t i = sheets.points.size() - 3 * 50 * 50; i < sheets.points.size(); i += 3)
    sheets.points[i] = sheets.points[i] / 49 - 2, sheets.points[i + 1] /= 49;
  for (size_t k = 0; k < ends.size(); k += 2) {
    const auto v = uint32_t(sheets.points.size() / 3);
    for (size_t end = k; end < k + 2; end++)
      sheets.points.insert(sheets.points.end(), {ends[end], 0, 0, ends[end], 1000, 0});
    sheets.triangles.insert(sheets.triangles.end(), {v, v + 1, v + 2, v + 2, v + 1, v + 3});
  }
}

// One in a hundred of the area of few large triangles is lost, or there is too much of it.
void test_large_triangles_have_samples_by_their_area(bool is_lost) {
  Sheets sheets(50, 0);
  const std::vector<float> whole{0, 1000}, cut{0, 600, 610, 1000};
  add_square(sheets, is_lost ? whole : cut);
  const Triangles before = sheets.triangles;
  add_square(sheets, is_lost ? cut : whole);
  const Triangles after(sheets.triangles.begin() + std::ptrdiff_t(before.size()),
                        sheets.triangles.end());
  const float error = measured(sheets.points, before, after);
  EXPECT(4 < error && error <= 5);
}

void test_spikes_count_where_samples_are_few() {
  EXPECT(spiked(160) < 0.5f);  // less than a thousandth of the area
  EXPECT(std::fabs(spiked(12) - 5) < 0.05f);
}

// Each corner is the nearest one for a third of the points, and far for a quarter.
void test_weights_spread_points_evenly() {
  const std::vector<Vec3> weights = sample_weights(3000);
  int nearest = 0, far = 0;
  for (const Vec3& w : weights) {
    EXPECT(w.x >= 0 && w.y >= 0 && w.z >= 0 && std::fabs(w.x + w.y + w.z - 1) < 1e-6f);
    nearest += w.y > w.x && w.y > w.z;
    far += w.y > 0.5f;
  }
  EXPECT(std::abs(nearest - 1000) < 30 && std::abs(far - 750) < 30);
}

// A group that is stuck keeps its samples; those of the other move to its replacement.
void test_samples_stay_on_groups_that_are_stuck() {
  const Sheets sheets(80, 2);
  const uint32_t each = sheets.begin[1], first_new = 2 * each;
  const Numbers ids = counted(2 * size_t(each));
  ErrorMeter meter({sheets.points.data()}, sheets.points.size() / 3, sheets.shared(), sheets.begin,
                   ids, 2);
  meter.begin_level(sheets.shared(), sheets.begin, ids);
  const float area = std::accumulate(meter.sample_areas().begin(), meter.sample_areas().end(), 0.f);
  meter.measure({sheets.groups().of(0), sheets.groups().of(1)}, {0, 1});
  Numbers new_ids = counted(each);
  for (uint32_t& id : new_ids) id += first_new;
  meter.replace({true, false}, {0, 0}, new_ids);
  for (uint32_t id : meter.sample_triangle_ids()) EXPECT(id >= each);
  const float after =
      std::accumulate(meter.sample_areas().begin(), meter.sample_areas().end(), 0.f);
  EXPECT(std::fabs(after - area) < 1e-3f * area);
  const std::set<uint32_t> stuck(meter.sample_triangle_ids().begin(),
                                 meter.sample_triangle_ids().end());
  EXPECT(*stuck.begin() < first_new && *stuck.rbegin() >= first_new);
}

// Few samples that stand for most of the area stay apart from each other.
void test_samples_that_are_carried_on_stand_for_areas_alike() {
  Sheets sheets(20, 1);
  const std::vector<float> points = sheets.points;
  const auto vertices = uint32_t(points.size() / 3);
  CarriedVertices samples{{}, {}, {0}, {}};
  for (uint32_t v = 0; v < vertices; v++)
    for (int k = 0; k < 250; k++) {
      samples.vertices.push_back(uint32_t(sheets.points.size() / 3));
      samples.areas.push_back(v < vertices * 9 / 10 ? 0.01f : 10);
      sheets.points.insert(sheets.points.end(), &points[3 * size_t(v)], &points[3 * size_t(v)] + 3);
    }
  const size_t count = samples.vertices.size();
  samples.begin.push_back(uint32_t(count));
  const double all = std::accumulate(samples.areas.begin(), samples.areas.end(), 0.0);
  const ReplacementErrors errors({sheets.points.data()}, sheets.points.size() / 3, sheets.groups(),
                                 0.05f, 1);
  errors.measure(sheets.groups(), sheets.groups(), {0}, samples, 1);
  const double sum = std::accumulate(samples.areas.begin(), samples.areas.end(), 0.0);
  const float most = *std::max_element(samples.areas.begin(), samples.areas.end());
  EXPECT(samples.areas.size() < count / 3 && std::fabs(sum - all) < 1e-4 * all);
  EXPECT(double(most) < 10 + 1.1 * all / double(samples.areas.size()));
}

// Two triangles, a floor and a wall, meet at a hard edge, whose two positions have a vertex of each
// side.
struct Fold {
  const std::vector<float> points{0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 0, 4, 0, 0, 0, 0, 4};
  const std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0, 0, 1, 0};
  const std::vector<float> others{0.1f, 0.1f, 0.1f, 0.9f, 0.9f, 0.9f};
  const Numbers places{0, 1, 2, 0, 1, 3}, canonical = counted(6);
  const Triangles triangles{0, 1, 2, 3, 5, 4};

  Triangles chosen(Triangles corners, bool has_others) const {
    VertexChoices choices{places.data(),
                          normals.data(),
                          others.data(),
                          has_others ? 1u : 0u,
                          canonical.data(),
                          {},
                          {},
                          {}};
    choices.fill(triangles.data(), triangles.size(), 6);
    // The wall is nearer to points that are higher above the floor than they are off the wall.
    const auto nearest = [&](const std::vector<Vec3>& at) {
      Triangles found;
      for (const Vec3& p : at) {
        const auto first = triangles.begin() + (p.z > p.y ? 3 : 0);
        found.insert(found.end(), first, first + 3);
      }
      return found;
    };
    choose_vertices(choices, points.data(), {1, 1}, nearest, 1, corners);
    return corners;
  }
};

void test_corners_at_a_hard_edge_take_the_vertices_of_their_side() {
  const Fold fold;
  const Triangles right{3, 5, 4, 0, 1, 2};
  for (bool has_others : {false, true})
    for (const Triangles& wall : {Triangles{0, 5, 1}, Triangles{3, 5, 1}, Triangles{0, 5, 4}}) {
      Triangles spoilt = wall;
      spoilt.insert(spoilt.end(), {3, 4, 2});
      EXPECT(fold.chosen(spoilt, has_others) == right);
    }
  EXPECT(fold.chosen(fold.triangles, false) == fold.triangles);  // those that fit stay
}

void test_small_pieces_of_a_group_share_clusters() {
  constexpr uint32_t kCount = 40;
  uint32_t state = 1;
  const auto random = [&] {
    state = state * 1664525u + 1013904223u;
    return float(state >> 8) / float(1 << 24);
  };
  std::vector<float> positions;
  for (uint32_t t = 0; t < 2 * kCount; t++) {
    const Vec3 place{0.1f * random(), 0.1f * random(), 0.1f * random()};
    for (int k = 0; k < 9; k++) positions.push_back(place[k % 3] + 0.004f * random());
  }
  const Numbers corners = counted(6 * kCount);
  const MeshView mesh{corners.data(), 2 * kCount, corners.data(), positions.data(), 6 * kCount};
  const GroupMeshlets made = generate_in_groups(mesh, {0, kCount, 2 * kCount}, {});
  EXPECT(made.group_begin.back() == made.count());
  for (size_t g = 0; g < 2; g++)  // one each if boxes may hardly grow
    EXPECT(made.group_begin[g + 1] - made.group_begin[g] <= kCount / 2);
}

// A cut takes fewer pages, and no page has groups that are far from each other.
void test_groups_of_like_errors_share_pages() {
  std::vector<ClusterGroup> all;
  uint32_t state = 1;
  for (int g = 0; g < 480; g++) {
    state = state * 1664525u + 1013904223u;
    all.push_back({1, double(state >> 8) / (1 << 24), {}});
  }
  size_t taken[2] = {};
  const Numbers groups = counted(480), orders[] = {groups, ordered_by_error(groups, all)};
  for (int k = 0; k < 2; k++) {
    EXPECT(std::set<uint32_t>(orders[k].begin(), orders[k].end()).size() == 480);
    for (size_t first = 0; first < 480; first += 4) {
      const auto page = orders[k].begin() + std::ptrdiff_t(first);
      const auto ends = std::minmax_element(page, page + 4);
      EXPECT(*ends.second - *ends.first <= 2 * 48);
      taken[k] += std::any_of(page, page + 4, [&](uint32_t g) { return all[g].error > 0.8; });
    }
  }
  EXPECT(10 * taken[1] < 6 * taken[0]);
}

}  // namespace

int main() {
  test_groups_of_like_errors_share_pages();
  test_groups_near_the_median_are_simplified_once();
  test_a_group_that_is_farther_is_tried_again();
  test_a_group_that_stays_farther_waits();
  test_what_a_group_lost_stays_at_the_next_try();
  test_levels_that_grow_too_much();
  test_large_triangles_have_samples_by_their_area(true);
  test_large_triangles_have_samples_by_their_area(false);
  test_spikes_count_where_samples_are_few();
  test_weights_spread_points_evenly();
  test_samples_stay_on_groups_that_are_stuck();
  test_samples_that_are_carried_on_stand_for_areas_alike();
  test_corners_at_a_hard_edge_take_the_vertices_of_their_side();
  test_small_pieces_of_a_group_share_clusters();
  return failures != 0;
}
