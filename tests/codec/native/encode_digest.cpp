// Encodes generated meshes with every effort and prints a digest of each result, equal for every
// compiler and optimisation level. Checks that the number of threads makes no difference.
#include <cstdio>
#include <cstring>

#include "encode/encoder.h"
#include "encode/pages.h"
#include "common/weld.h"

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

// Of its pages and of it as one blob.
uint64_t digest(const Model& m, Effort effort, int threads) {
  std::vector<Stream> streams(2);
  streams[0].elements = 3;
  streams[0].bits = 12;
  streams[1].elements = 2;
  streams[1].bits = 8;
  for (Stream& s : streams) s.predictor = kChoosePredictor;
  VertexValues values{{m.grid.data(), m.normals.data()}, {3, 2}, nullptr};
  EncodeOptions options;
  options.effort = effort;
  options.threads = threads;
  EncoderStats stats;
  MeshView view{m.triangles.data(), m.triangles.size() / 3, m.position_ids.data(),
                m.positions.data(), m.positions.size() / 3};
  std::vector<std::vector<uint8_t>> blobs =
      encode_pages(view, streams, values, options, kPageBytes, stats);
  blobs.push_back(encode(view, streams, values, options, stats));
  uint64_t hash = 14695981039346656037ull;
  for (const std::vector<uint8_t>& blob : blobs)
    for (uint8_t byte : blob) hash = (hash ^ byte) * 1099511628211ull;
  return hash;
}

}  // namespace

int main() {
  const Model models[] = {height_field(120), soup(700)};
  for (const Model& m : models)
    for (Effort effort : {Effort::kFast, Effort::kNormal, Effort::kPaper}) {
      const uint64_t one = digest(m, effort, 1);
      if (digest(m, effort, 2) != one || digest(m, effort, 5) != one) {
        std::fprintf(stderr, "the number of threads changes the bytes\n");
        return 1;
      }
      std::printf("%016llx\n", static_cast<unsigned long long>(one));
    }
}
