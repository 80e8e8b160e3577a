// Tests of the segmentation, codec/segment.
//   meshlet_generation_test              generated meshes, regular and hostile
//   meshlet_generation_test FILE...      checks meshes from files and prints figures
// Options, before files: --max-triangles N, --max-vertices N, --lambda X,
// --weight paper|choe, --fill X, --threads N, --no-check.
// File: little-endian uint32 primitive count, then per primitive uint32 vertex and triangle counts,
// float32 positions, uint32 triangles.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "segment/half_edges.h"
#include "mesh_check.h"
#include "common/weld.h"

namespace {

int failures = 0;

void expect(bool holds, const std::string& what) {
  if (holds) return;
  failures++;
  std::fprintf(stderr, "FAILED: %s\n", what.c_str());
}

// The same numbers on every platform, unlike the standard library's distributions.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 2 + 1) {}
  uint32_t below(uint32_t bound) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return uint32_t((state_ >> 33) % bound);
  }

 private:
  uint64_t state_;
};

void weld_positions(Mesh& mesh) {
  mesh.position_ids.resize(mesh.vertex_count());
  gltf_meshlet_codec::weld_rows(reinterpret_cast<const uint8_t*>(mesh.positions.data()),
                                mesh.vertex_count(), 12, mesh.position_ids.data());
}

std::vector<Mesh> read_meshes(const char* path) {
  std::ifstream file(path, std::ios::binary);
  const auto read = [&](void* to, size_t bytes) {
    file.read(static_cast<char*>(to), std::streamsize(bytes));
    if (!file) std::fprintf(stderr, "%s: too short\n", path), std::exit(2);
  };
  uint32_t count;
  read(&count, 4);
  std::vector<Mesh> meshes(count);
  for (Mesh& mesh : meshes) {
    uint32_t sizes[2];
    read(sizes, 8);
    mesh.positions.resize(3 * size_t(sizes[0]));
    mesh.triangles.resize(3 * size_t(sizes[1]));
    read(mesh.positions.data(), 4 * mesh.positions.size());
    read(mesh.triangles.data(), 4 * mesh.triangles.size());
    weld_positions(mesh);
  }
  return meshes;
}

// Grid of n x n quads on a height field. wrap_u joins the columns, wrap_v the rows; both give a
// torus.
Mesh make_grid(uint32_t n, bool wrap_u, bool wrap_v) {
  Mesh mesh;
  const uint32_t columns = wrap_u ? n : n + 1, rows = wrap_v ? n : n + 1;
  for (uint32_t j = 0; j < rows; j++)
    for (uint32_t i = 0; i < columns; i++)
      for (const uint32_t c : {i, j, (i * i + 3 * j) % 7}) mesh.positions.push_back(float(c));
  const auto at = [&](uint32_t i, uint32_t j) { return j % rows * columns + i % columns; };
  for (uint32_t j = 0; j < n; j++)
    for (uint32_t i = 0; i < n; i++)
      for (const uint32_t v :
           {at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)})
        mesh.triangles.push_back(v);
  return mesh;
}

void append(Mesh& mesh, const Mesh& other) {
  const uint32_t base = uint32_t(mesh.vertex_count());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const uint32_t vertex : other.triangles) mesh.triangles.push_back(base + vertex);
}

// Triangles between random vertices, several of which share a position. Some triangles are
// repeated, rotated or reversed.
Mesh make_soup(Random& random, uint32_t vertices, uint32_t triangles, uint32_t positions) {
  Mesh mesh;
  for (uint32_t v = 0; v < vertices; v++) {
    const uint32_t place = random.below(positions);
    for (const uint32_t c : {place % 5, place / 5 % 5, place / 25})
      mesh.positions.push_back(float(c));
  }
  while (mesh.triangles.size() < 3 * size_t(triangles)) {
    uint32_t corner[3] = {random.below(vertices), random.below(vertices), random.below(vertices)};
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    const uint32_t copies = random.below(8) == 0 ? 1 + random.below(3) : 1;
    for (uint32_t i = 0; i < copies; i++) {
      if (random.below(2)) std::swap(corner[0], corner[1]);
      mesh.triangles.insert(mesh.triangles.end(), corner, corner + 3);
    }
  }
  return mesh;
}

// Gives every corner a vertex of its own with probability 1 / odds.
void tear(Mesh& mesh, Random& random, uint32_t odds) {
  for (uint32_t& vertex : mesh.triangles) {
    if (random.below(odds)) continue;
    for (size_t c = 0; c < 3; c++) mesh.positions.push_back(mesh.positions[3 * size_t(vertex) + c]);
    vertex = uint32_t(mesh.vertex_count() - 1);
  }
}

// The mesh as it is partitioned: sorted.
Mesh sorted(const gltf_meshlet_codec::SpatialMesh& mesh) {
  const float* points = &mesh.points[0].x;
  return {{points, points + 3 * mesh.points.size()},
          {mesh.triangles.begin(), mesh.triangles.end()},
          {mesh.position_ids.begin(), mesh.position_ids.end()}};
}

gltf_meshlet_codec::Meshlets generate(const gltf_meshlet_codec::SpatialMesh& mesh,
                                      const gltf_meshlet_codec::GenerationOptions& options) {
  return gltf_meshlet_codec::generate_meshlets(
      mesh, gltf_meshlet_codec::match_half_edges(mesh.view(), options.threads), options);
}

gltf_meshlet_codec::SpatialMesh sort(const Mesh& mesh, int threads) {
  return gltf_meshlet_codec::sort_in_space(mesh.view(), threads);
}

// Is it the same mesh in another order?
bool same_triangles(const Mesh& mesh, const gltf_meshlet_codec::SpatialMesh& sorted) {
  std::vector<std::array<uint32_t, 3>> before, after;
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
    before.push_back({mesh.triangles[i], mesh.triangles[i + 1], mesh.triangles[i + 2]});
    const uint32_t* v = &sorted.triangles[i];
    after.push_back(
        {sorted.source_vertex[v[0]], sorted.source_vertex[v[1]], sorted.source_vertex[v[2]]});
  }
  std::sort(before.begin(), before.end());
  std::sort(after.begin(), after.end());
  for (size_t v = 0; v < sorted.position_ids.size(); v++)
    if (mesh.position_ids[sorted.source_vertex[v]] !=
        mesh.position_ids[sorted.source_vertex[sorted.position_ids[v]]])
      return false;
  return before == after;
}

bool same(const gltf_meshlet_codec::Meshlets& a, const gltf_meshlet_codec::Meshlets& b) {
  return a.triangles == b.triangles && a.disk_begin == b.disk_begin &&
         a.meshlet_begin == b.meshlet_begin;
}

constexpr gltf_meshlet_codec::Effort kEfforts[] = {gltf_meshlet_codec::Effort::kFast,
                                                   gltf_meshlet_codec::Effort::kNormal,
                                                   gltf_meshlet_codec::Effort::kPaper};

// Checks the meshlets of all efforts; returns those of the last one.
gltf_meshlet_codec::Meshlets check(Mesh mesh, const std::string& name,
                                   gltf_meshlet_codec::GenerationOptions options = {}) {
  weld_positions(mesh);
  const gltf_meshlet_codec::SpatialMesh in_space = sort(mesh, 1);
  expect(same_triangles(mesh, in_space), name + ": sorted is another mesh");
  expect(in_space.triangles == sort(mesh, 3).triangles, name + ": order depends on threads");
  gltf_meshlet_codec::Meshlets meshlets;
  for (const gltf_meshlet_codec::Effort effort : kEfforts) {
    options.effort = effort;
    options.threads = 1;
    meshlets = generate(in_space, options);
    const std::string wrong = check_meshlets(sorted(in_space), options, meshlets);
    expect(wrong.empty(), name + ": " + wrong);
    options.threads = 3;
    expect(same(meshlets, generate(in_space, options)), name + ": depends on threads");
  }
  return meshlets;
}

// A mesh of these triangles with position ids, and no positions.
gltf_meshlet_codec::HalfEdges match(const std::vector<uint32_t>& triangles,
                                    const std::vector<uint32_t>& ids, int threads = 2) {
  return gltf_meshlet_codec::match_half_edges(
      {triangles.data(), triangles.size() / 3, ids.data(), nullptr, ids.size()}, threads);
}

std::vector<uint32_t> distinct(uint32_t count) {
  std::vector<uint32_t> ids(count);
  for (uint32_t i = 0; i < count; i++) ids[i] = i;
  return ids;
}

void test_half_edges() {
  // Two triangles joined by 1-2; a third one on 0-1, wound the wrong way; a fourth and fifth on
  // 2-0.
  const std::vector<uint32_t> triangles{0, 1, 2, 2, 1, 3, 0, 1, 4, 0, 2, 5, 0, 2, 6};
  const gltf_meshlet_codec::HalfEdges few = match(triangles, distinct(7));
  for (int32_t h = 0; h < 15; h++)
    expect(few.by_vertex(h) == (h == 1 ? 3 : h == 3 ? 1 : -1), "half-edge " + std::to_string(h));
  // Vertices 4 and 5 have the positions of 0 and 1: 5-4 closes on 0-1.
  const gltf_meshlet_codec::HalfEdges torn = match({0, 1, 2, 5, 4, 3}, {0, 1, 2, 3, 0, 1});
  expect(torn.by_vertex(0) < 0 && torn.by_position(0) == 3, "half-edges joined by position");
  // 1-2 is matched by vertex; 5-6 and 8-7 have the same positions and are matched with each other.
  const gltf_meshlet_codec::HalfEdges four =
      match({0, 1, 2, 2, 1, 3, 4, 5, 6, 7, 8, 9}, {0, 1, 2, 3, 4, 1, 2, 2, 1, 9});
  expect(four.by_position(1) == 3 && four.by_position(7) == 9 && four.by_vertex(7) < 0,
         "two pairs at one position");
  // A star: one vertex in very many triangles.
  std::vector<uint32_t> star;
  for (uint32_t i = 0; i < 1000; i++) star.insert(star.end(), {0, 1 + i, 1 + (i + 1) % 1000});
  const gltf_meshlet_codec::HalfEdges closed = match(star, distinct(1001));
  for (int32_t i = 0; i < 1000; i++)
    expect(closed.by_vertex(3 * i + 2) == (i + 1) % 1000 * 3, "star");
}

// Pairs of triangles and the same pairs reversed, with other vertices at the same positions. The
// first triangles' open half-edges start at high numbers only, and one ends at a low one.
void test_half_edges_of_threads() {
  constexpr uint32_t n = 10000;
  std::vector<uint32_t> triangles, ids(8 * n);
  for (uint32_t v = 0; v < 8 * n; v++) ids[v] = v % (4 * n);
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    for (uint32_t i = 0; i < n; i++) triangles.insert(triangles.end(), {a + i, b + i, c + i});
  };
  add(2 * n, 0, 3 * n);
  add(3 * n, 0, n);
  add(4 * n, 6 * n, 7 * n);
  add(4 * n, 7 * n, 5 * n);
  for (const int threads : {1, 2, 3, 8}) {
    const gltf_meshlet_codec::HalfEdges matched = match(triangles, ids, threads);
    bool right = true;
    for (uint32_t i = 0; i < 3 * n; i += 3)
      right = right && matched.by_vertex(i + 1) == int32_t(3 * n + i) && matched.by_vertex(i) < 0 &&
              matched.by_position(i) == int32_t(6 * n + i) &&
              matched.by_position(i + 2) == int32_t(6 * n + i + 1);
    expect(right, "half-edges of " + std::to_string(threads) + " threads");
  }
}

void test_weld() {
  const std::vector<uint8_t> rows{1, 2, 3, 1, 2, 4, 1, 2, 3, 0, 0, 0, 1, 2, 4};
  std::vector<uint32_t> remap(5);
  expect(gltf_meshlet_codec::weld_rows(rows.data(), 5, 3, remap.data()) == 3, "welded count");
  expect(remap == std::vector<uint32_t>({0, 1, 0, 2, 1}), "welded rows");
}

void test_shapes() {
  check({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {}}, "one triangle");
  check({std::vector<float>(9, 1.0f), {0, 1, 2}, {}}, "one point");
  check({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2, 0, 1, 2, 1, 2, 0, 2, 1, 0}, {}},
        "the same triangle four times");
  check({{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, {}},
        "tetrahedron");
  check({{3e38f, -3e38f, 0, -3e38f, 1e-40f, 0, 0, 3e38f, 3e38f}, {0, 1, 2, 2, 1, 0}, {}},
        "huge numbers");
  const gltf_meshlet_codec::Meshlets plane = check(make_grid(64, false, false), "grid");
  expect(plane.meshlet_begin.size() - 1 < 8192 / 55, "a grid fills its meshlets");
  check(make_grid(40, true, false), "tube");
  check(make_grid(40, true, true), "torus");
  check(make_grid(3, true, true), "small torus");
  check(make_grid(200, true, true), "several patches");
}

// A box of six separate grids whose rims share positions: every edge of the box is a seam.
Mesh make_box(uint32_t n) {
  Mesh box;
  for (uint32_t side = 0; side < 6; side++) {
    Mesh face = make_grid(n, false, false);
    for (size_t v = 0; v < face.vertex_count(); v++) {
      float* p = face.positions.data() + 3 * v;
      p[2] = side % 2 ? float(n) : 0;
      std::rotate(p, p + side / 2, p + 3);
    }
    if (side % 2 == 0)
      for (size_t i = 0; i < face.triangles.size(); i += 3)
        std::swap(face.triangles[i], face.triangles[i + 1]);
    append(box, face);
  }
  return box;
}

void test_seams() {
  const gltf_meshlet_codec::Meshlets cube =
      check(make_box(2), "cube");  // 48 triangles and 54 vertices on six faces
  expect(cube.meshlet_begin.size() == 2 && cube.disk_begin.size() == 7,
         "faces of a cube share a meshlet");
  check(make_box(9), "box");
}

void test_progress() {
  Mesh mesh = make_grid(150, false, false);
  weld_positions(mesh);
  gltf_meshlet_codec::GenerationOptions options;
  std::vector<float> fractions{0};
  options.progress = [&](float fraction) { fractions.push_back(fraction); };
  const gltf_meshlet_codec::SpatialMesh in_space = sort(mesh, 1);
  generate(in_space, options);
  expect(std::is_sorted(fractions.begin(), fractions.end()) && fractions.back() == 1, "progress");
  options.progress = [](float) { throw std::runtime_error("stop"); };
  bool stopped = false;
  try {
    generate(in_space, options);
  } catch (const std::runtime_error&) {
    stopped = true;
  }
  expect(stopped, "an exception of progress reaches the caller");
}

void test_limits() {
  for (const int triangles : {1, 2, 16, 17, 63, 64}) {
    for (const int vertices : {3, 4, 20, 64}) {
      gltf_meshlet_codec::GenerationOptions options;
      options.max_triangles = triangles;
      options.max_vertices = vertices;
      options.weight =
          triangles % 2 ? gltf_meshlet_codec::Weight::kChoe : gltf_meshlet_codec::Weight::kPaper;
      check(make_grid(20, true, false),
            "limits " + std::to_string(triangles) + " " + std::to_string(vertices), options);
    }
  }
}

void test_hostile() {
  Random random(1);
  for (int round = 0; round < 60; round++) {
    Mesh soup =
        make_soup(random, 4 + random.below(60), 1 + random.below(300), 1 + random.below(60));
    check(soup, "soup " + std::to_string(round));
    Mesh torn = make_grid(4 + random.below(30), random.below(2), random.below(2));
    tear(torn, random, 1 + random.below(30));
    append(torn, soup);
    check(torn, "torn grid " + std::to_string(round));
  }
  Mesh scraps;
  for (int i = 0; i < 500; i++) append(scraps, make_grid(1 + random.below(3), false, false));
  const gltf_meshlet_codec::Meshlets packed = check(scraps, "scraps");
  expect(packed.meshlet_begin.size() < packed.disk_begin.size() / 3, "scraps share meshlets");
}

uint32_t checksum(const gltf_meshlet_codec::Meshlets& meshlets, uint32_t sum) {
  for (const auto* part : {&meshlets.triangles, &meshlets.disk_begin, &meshlets.meshlet_begin})
    for (const uint32_t value : *part) sum = (sum ^ value) * 16777619u;
  return sum;
}

void report(const char* path, const gltf_meshlet_codec::GenerationOptions& options, bool checked) {
  Figures figures;
  double seconds = 0;
  uint32_t histogram[4] = {0, 0, 0, 0};
  int iterations = 0;
  uint32_t sum = 2166136261u;
  for (const Mesh& mesh : read_meshes(path)) {
    const auto start = std::chrono::steady_clock::now();
    const gltf_meshlet_codec::SpatialMesh in_space = sort(mesh, options.threads);
    const gltf_meshlet_codec::Meshlets meshlets = generate(in_space, options);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (int i = 0; i < 4; i++) histogram[i] += meshlets.histogram[i];
    sum = checksum(meshlets, sum);
    iterations = std::max(iterations, meshlets.iterations_run);
    if (!checked) continue;
    const std::string wrong = check_meshlets(sorted(in_space), options, meshlets);
    expect(wrong.empty(), std::string(path) + ": " + wrong);
    add_figures(sorted(in_space), meshlets, figures);
  }
  const char* name = std::strrchr(path, '/') ? std::strrchr(path, '/') + 1 : path;
  std::printf("%-18s %6.3f s, %d iterations, histogram %u %u %u %u, checksum %08x", name, seconds,
              iterations, histogram[0], histogram[1], histogram[2], histogram[3], sum);
  if (checked) {
    const double meshlets = double(figures.meshlets);
    const double triangles = double(figures.triangles);
    // Estimated bits of meshlet headers, references, chains and corners.
    const double cost = 45 * meshlets + 5.0 * figures.owned_chains +
                        11.0 * (figures.references - figures.owned_chains) +
                        4.0 * figures.chain_vertices + 24.0 * figures.corners;
    std::printf(
        "\n    meshlets %zu, triangles %.2f, vertices %.2f, disks %.2f, boundary %.3f, "
        "references %.2f, "
        "corners %.2f, chain vertices %.2f, neighbours %.2f, index difference %.1f, cost %.3f b/t",
        figures.meshlets, triangles / meshlets, figures.vertices / meshlets,
        figures.disks / meshlets, double(figures.boundary_vertices) / figures.vertices,
        figures.references / meshlets, figures.corners / meshlets,
        figures.chain_vertices / meshlets, figures.neighbours / meshlets,
        figures.pairs ? figures.index_difference / figures.pairs : 0.0, cost / triangles);
  }
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  gltf_meshlet_codec::GenerationOptions options;
  bool checked = true;
  int i = 1;
  for (; i < argc && std::strncmp(argv[i], "--", 2) == 0; i++) {
    const std::string option = argv[i];
    if (option == "--no-check") {
      checked = false;
      continue;
    }
    const char* value = ++i < argc ? argv[i] : "";
    if (option == "--max-triangles") options.max_triangles = std::atoi(value);
    if (option == "--max-vertices") options.max_vertices = std::atoi(value);
    if (option == "--lambda") options.lambda = float(std::atof(value));
    if (option == "--fill") options.fill = float(std::atof(value));
    if (option == "--threads") options.threads = std::atoi(value);
    if (option == "--weight" && std::strcmp(value, "choe") == 0)
      options.weight = gltf_meshlet_codec::Weight::kChoe;
  }
  if (i == argc) {
    test_half_edges();
    test_half_edges_of_threads();
    test_weld();
    test_shapes();
    test_seams();
    test_progress();
    test_limits();
    test_hostile();
  }
  for (; i < argc; i++) report(argv[i], options, checked);
  return failures ? 1 : 0;
}
