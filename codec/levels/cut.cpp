#include "levels/cut.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gltf_meshlet_codec {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kLargest = std::numeric_limits<float>::max();
constexpr double kLeastShare = 1e-6;  // of the largest radius in root pages
constexpr int kSweeps = 12;           // Jacobi's method has settled after 6

// Makes a[p][q] of a symmetric matrix 0.
void rotate(double (&a)[3][3], int p, int q) {
  if (a[p][q] == 0) return;
  const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
  const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
  const double cosine = 1 / std::sqrt(t * t + 1), sine = t * cosine;
  for (int k = 0; k < 3; k++) {
    const double x = a[k][p], y = a[k][q];
    a[k][p] = cosine * x - sine * y;
    a[k][q] = sine * x + cosine * y;
  }
  for (int k = 0; k < 3; k++) {
    const double x = a[p][k], y = a[q][k];
    a[p][k] = cosine * x - sine * y;
    a[q][k] = sine * x + cosine * y;
  }
}

bool is_top(const LevelGroup& group) { return group.error > kLargest; }

class Cutter {
 public:
  Cutter(const LevelTables& tables, const CutCamera& camera, const CutArrays& arrays)
      : tables_(tables),
        camera_(camera),
        arrays_(arrays),
        least_distance_(camera.least_distance > 0 ? camera.least_distance : least_distance()) {}

  CutResult run() {
    const uint32_t known = tables_.known_groups();
    const bool has_roots = ask_for_roots();
    std::fill(arrays_.active, arrays_.active + known, uint8_t(1));  // until something blocks it
    for (uint32_t g = 0; g < known; g++) decide(g, has_roots);
    for (uint32_t g = 0; g < known; g++)
      if (arrays_.active[g]) draw(g);
    if (result_.groups)
      result_.groups = tables_.page_end_group(tables_.page_of(result_.groups - 1));
    return result_;
  }

 private:
  bool is_resident(uint32_t page) const { return !arrays_.resident || arrays_.resident[page]; }

  // One for all groups: a finer one must not be more urgent than what it replaces.
  double least_distance() const {
    float largest = 0;
    for (uint32_t g = 0; g < tables_.page_end_group(tables_.root_pages() - 1); g++)
      largest = std::max(largest, tables_.group(g).radius);
    return kLeastShare * double(largest) * camera_.scale;
  }

  // Returns whether all root pages are resident. Nothing is more urgent.
  bool ask_for_roots() {
    bool all = true;
    for (uint32_t p = 0; p < tables_.root_pages(); p++) {
      all = all && is_resident(p);
      if (arrays_.urgency) arrays_.urgency[p] = float(kInfinity);
    }
    return all;
  }

  // Decides whether group g is active; all coarser ones are decided.
  void decide(uint32_t g, bool has_roots) {
    const LevelGroup& group = tables_.group(g);
    uint8_t& active = arrays_.active[g];
    if (active) {
      const double error = pixels(group);
      const bool needed = is_top(group) || error > camera_.threshold;
      if (needed && arrays_.urgency)
        arrays_.urgency[group.page] = std::max(arrays_.urgency[group.page], float(error));
      active = needed && has_roots && is_resident(group.page);
      if (!active || lacks_groups(group)) result_.error = std::max(result_.error, error);
    }
    if (active) return;
    for (uint32_t r = group.first_run; r < group.first_run + group.runs; r++)
      if (const uint32_t finer = tables_.run(r).group(); finer < tables_.known_groups())
        arrays_.active[finer] = 0;
  }

  // Are finer groups of an active one not there?
  bool lacks_groups(const LevelGroup& group) {
    uint32_t last = 0;
    for (uint32_t r = group.first_run; r < group.first_run + group.runs; r++)
      last = std::max(last, tables_.run(r).group());
    result_.groups = std::max(result_.groups, last + 1);
    return last >= tables_.known_groups();
  }

  void draw(uint32_t g);
  void add(const CutDraw& draw, bool follows);
  double pixels(const LevelGroup& group) const;

  const LevelTables& tables_;
  const CutCamera& camera_;
  const CutArrays& arrays_;
  const double least_distance_;
  CutResult result_{0, 0, 0};
};

// The error of a group on the screen, at the nearest point of its sphere.
double Cutter::pixels(const LevelGroup& group) const {
  if (is_top(group)) return kInfinity;
  const double error = double(group.error) * camera_.scale * camera_.pixels_per_unit;
  if (camera_.orthographic || !(error > 0)) return error;
  double x = group.centre[0], y = group.centre[1], z = group.centre[2];
  if (const double* m = camera_.matrix) {
    const double a = x, b = y, c = z;
    x = m[0] * a + m[4] * b + m[8] * c + m[12];
    y = m[1] * a + m[5] * b + m[9] * c + m[13];
    z = m[2] * a + m[6] * b + m[10] * c + m[14];
  }
  x -= camera_.eye[0];
  y -= camera_.eye[1];
  z -= camera_.eye[2];
  const double distance = std::sqrt((x * x + y * y) + z * z);
  const double nearest = std::max(distance - double(group.radius) * camera_.scale, least_distance_);
  const double pixels = nearest > 0 ? error / nearest : kInfinity;
  return pixels >= 0 ? pixels : kInfinity;  // beyond double
}

// Draws the clusters of an active group that no active group replaces.
void Cutter::draw(uint32_t g) {
  const LevelGroup& group = tables_.group(g);
  if (group.runs == 0) return add({group.page, group.first_cluster, group.clusters, g}, false);
  uint32_t first = group.first_cluster;
  bool follows = false;
  for (uint32_t r = group.first_run; r < group.first_run + group.runs; r++) {
    const LevelRun& run = tables_.run(r);
    const bool drawn = run.group() >= tables_.known_groups() || !arrays_.active[run.group()];
    if (drawn) add({group.page, first, run.clusters(), g}, follows);
    follows = drawn;
    first += run.clusters();
  }
}

// follows: the draw before, of the same group.
void Cutter::add(const CutDraw& draw, bool follows) {
  if (follows && arrays_.draws)
    arrays_.draws[result_.draws - 1].clusters += draw.clusters;
  else if (arrays_.draws)
    arrays_.draws[result_.draws] = draw;
  result_.draws += !follows;
}

}  // namespace

// The root of the largest eigenvalue of the products of the columns. Entries are divided by the
// largest one, so that products neither overflow nor vanish.
double largest_scale(const double* m) {
  double largest = 0;
  for (int i = 0; i < 12; i++)
    if (i % 4 < 3) largest = std::max(largest, std::fabs(m[i]));
  if (largest == 0) return 0;
  double columns[3][3], a[3][3];
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) columns[i][k] = m[4 * i + k] / largest;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      a[i][j] = columns[i][0] * columns[j][0] + columns[i][1] * columns[j][1] +
                columns[i][2] * columns[j][2];
  for (int sweep = 0; sweep < kSweeps; sweep++) {
    rotate(a, 0, 1);
    rotate(a, 0, 2);
    rotate(a, 1, 2);
  }
  return largest * std::sqrt(std::max(std::max(a[0][0], a[1][1]), a[2][2]));
}

CutResult make_cut(const LevelTables& tables, const CutCamera& camera, const CutArrays& arrays) {
  return Cutter(tables, camera, arrays).run();
}

size_t rank_pages(const float* urgency, size_t count, uint32_t* order) {
  size_t wanted = 0;
  for (size_t p = 0; p < count; p++)
    if (urgency[p] > 0) order[wanted++] = uint32_t(p);
  std::sort(order, order + wanted, [&](uint32_t a, uint32_t b) {
    return urgency[a] != urgency[b] ? urgency[a] > urgency[b] : a < b;
  });
  return wanted;
}

}  // namespace gltf_meshlet_codec
