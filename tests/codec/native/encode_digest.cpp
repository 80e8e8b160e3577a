// Encodes generated meshes with every effort, and builds levels with a stand-in for the simplifier.
// Prints a digest of each result, equal for every compiler and optimisation level. Checks that the
// number of threads makes no difference.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "encode/encoder.h"
#include "encode/pages.h"
#include "common/weld.h"
#include "lod/build_levels.h"
#include "stand_in_simplifier.h"

using namespace gltf_meshlet_codec;

namespace {

struct Model {
  std::vector<uint32_t> triangles;
  std::vector<float> positions;
  std::vector<uint32_t> position_ids, grid, normals;
};

// A random generator with the same numbers on every platform.
struct Random {
  uint32_t state;
  uint32_t next() { return state = state * 1664525u + 1013904223u; }
  uint32_t below(uint32_t n) { return (next() >> 8) % n; }
};

void finish(Model& m) {
  const size_t count = m.positions.size() / 3;
  m.position_ids.resize(count);
  weld_rows(reinterpret_cast<const uint8_t*>(m.positions.data()), count, 12, m.position_ids.data());
  for (float p : m.positions) m.grid.push_back(uint32_t(p));
  m.normals.assign(2 * count, 0);
  for (size_t v = 0; v < count; v++)
    m.normals[2 * v] = m.grid[3 * v] / 256 % 16;  // jumps make seams
}

// A bumpy height field of n x n vertices.
Model height_field(uint32_t n) {
  Model m;
  Random random{7};
  for (uint32_t y = 0; y < n; y++)
    for (uint32_t x = 0; x < n; x++)
      m.positions.insert(m.positions.end(),
                         {x * 31.0f, y * 31.0f, float(random.below(60) + (x * x + y * y) % 97)});
  for (uint32_t y = 0; y + 1 < n; y++)
    for (uint32_t x = 0; x + 1 < n; x++) {
      const uint32_t a = y * n + x;
      m.triangles.insert(m.triangles.end(), {a, a + 1, a + n, a + 1, a + n + 1, a + n});
    }
  finish(m);
  return m;
}

Model soup(uint32_t count) {
  Model m;
  Random random{11};
  for (uint32_t v = 0; v < count; v++)
    for (int k = 0; k < 3; k++) m.positions.push_back(float(random.below(40)));
  for (uint32_t t = 0; t < 2 * count; t++) {
    const uint32_t a = random.below(count), b = random.below(count), c = random.below(count);
    if (a != b && b != c && c != a) m.triangles.insert(m.triangles.end(), {a, b, c});
  }
  finish(m);
  return m;
}

constexpr size_t kPageBytes = 4096;

std::vector<Stream> streams_of_models() {
  std::vector<Stream> streams(2);
  streams[0].elements = 3;
  streams[0].bits = 12;
  streams[1].elements = 2;
  streams[1].bits = 8;
  for (Stream& s : streams) s.predictor = kChoosePredictor;
  return streams;
}

VertexValues values_of(const Model& m) {
  return {{m.grid.data(), m.normals.data()}, {3, 2}, nullptr};
}

uint64_t hashed(uint64_t hash, const void* data, size_t size) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 1099511628211ull;
  return hash;
}

constexpr uint64_t kNoHash = 14695981039346656037ull;

// Of its pages and of it as one blob.
uint64_t digest(const Model& m, Effort effort, int threads) {
  const std::vector<Stream> streams = streams_of_models();
  const VertexValues values = values_of(m);
  EncodeOptions options;
  options.effort = effort;
  options.threads = threads;
  EncoderStats stats;
  MeshView view{m.triangles.data(), m.triangles.size() / 3, m.position_ids.data(),
                m.positions.data(), m.positions.size() / 3};
  std::vector<std::vector<uint8_t>> blobs =
      encode_pages(view, streams, values, options, kPageBytes, stats);
  blobs.push_back(encode(view, streams, values, options, stats));
  uint64_t hash = kNoHash;
  for (const std::vector<uint8_t>& blob : blobs) hash = hashed(hash, blob.data(), blob.size());
  return hash;
}

// The model with two vertices at each position; patches of triangles use one or the other.
Model doubled(Model m) {
  const auto count = uint32_t(m.positions.size() / 3);
  for (size_t i = 0; i < m.triangles.size(); i++) m.triangles[i] += i / 600 % 2 * count;
  const auto twice = [](auto& list) {
    const auto copy = list;
    list.insert(list.end(), copy.begin(), copy.end());
  };
  twice(m.positions), twice(m.position_ids), twice(m.grid), twice(m.normals);
  return m;
}

// Of levels of the doubled model, whose normals are tilted at random.
uint64_t digest_of_levels(const Model& single, int threads) {
  const Model m = doubled(single);
  const size_t count = m.positions.size() / 3;
  const std::vector<Stream> streams = streams_of_models();
  const VertexValues values = values_of(m);
  Random random{3};
  std::vector<float> normals, others(m.normals.begin(), m.normals.end());
  std::vector<uint32_t> vertices;
  for (uint32_t v = 0; v < count; v++) {
    const float x = float(random.below(100)) / 200, y = float(random.below(100)) / 200;
    normals.insert(normals.end(), {x, y, std::sqrt(1 - x * x - y * y)});
    vertices.push_back(v);
  }
  VertexChoices choices{
      m.position_ids.data(), normals.data(), others.data(), 2, vertices.data(), {}, {}, {}};
  choices.fill(m.triangles.data(), m.triangles.size(), count);
  Surface surface{};
  surface.triangles = m.triangles.data();
  surface.triangle_count = m.triangles.size() / 3;
  surface.vertex_count = count;
  surface.points = surface.seam_points = m.positions.data();
  surface.position_ids = m.position_ids.data();
  surface.canonical_vertices = vertices.data();
  surface.shapes = {m.positions.data()};
  surface.choices = &choices;
  surface.vertex_of_position = first_vertices(surface.position_ids, count);
  LevelOptions options{{}, 24, 4, 1e9, 0, 0, true, false};
  options.generation.threads = threads;
  const PagePilot pilot{surface, streams, values, kPageBytes};
  const Levels built = build_levels(surface, {}, pilot, kStandIn, options);
  const std::vector<uint32_t>& triangles = built.grouped.ranges.triangles;
  uint64_t hash = hashed(kNoHash, triangles.data(), 4 * triangles.size());
  for (const ClusterGroup& g : built.groups) {
    hash = hashed(hash, &g.error, sizeof g.error);
    hash = hashed(hash, &g.sphere, sizeof g.sphere);
  }
  return hash + built.groups.back().level;
}

}  // namespace

int main() {
  const auto print = [](const auto& digest_by) {
    const uint64_t one = digest_by(1);
    if (digest_by(2) != one || digest_by(5) != one) {
      std::fprintf(stderr, "the number of threads changes the result\n");
      std::exit(1);
    }
    std::printf("%016llx\n", static_cast<unsigned long long>(one));
  };
  const Model models[] = {height_field(120), soup(700)};
  for (const Model& m : models) {
    for (Effort effort : {Effort::kFast, Effort::kNormal, Effort::kPaper})
      print([&](int threads) { return digest(m, effort, threads); });
    print([&](int threads) { return digest_of_levels(m, threads); });
  }
}
