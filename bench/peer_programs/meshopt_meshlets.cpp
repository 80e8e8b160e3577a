// meshopt_meshlets MAX_VERTICES MAX_TRIANGLES IN DECODED
//
// Encodes parts (parts.h) as meshlets of meshoptimizer, whose triangles meshopt_encodeMeshlet
// packs. Its manual leaves the vertices to the application; here each meshlet has its own, packed
// as the manual recommends for positions: an anchor per element and the least bits that hold the
// differences to it. DECODED: the parts after decoding, vertices per meshlet. Prints a JSON
// object.
#include <algorithm>
#include <bit>
#include <cstring>

#include "meshoptimizer.h"
#include "parts.h"

namespace {

constexpr int kLevel = 3;         // of optimisation: what meshoptimizer recommends
constexpr size_t kOverread = 16;  // bytes that may be read beyond a meshlet

// Bits that hold the numbers from 0 to `most`.
uint32_t width_of(uint32_t most) { return uint32_t(std::bit_width(most)); }

class BitWriter {
 public:
  explicit BitWriter(std::vector<uint8_t>& bytes) : bytes_(bytes) {}
  void write(uint32_t value, uint32_t bits) {
    for (uint32_t i = 0; i < bits; i++, count_++) {
      if (count_ % 8 == 0) bytes_.push_back(0);
      bytes_.back() |= uint8_t((value >> i & 1) << count_ % 8);
    }
  }

 private:
  std::vector<uint8_t>& bytes_;
  size_t count_ = 0;
};

uint32_t read_bits(const uint8_t* bytes, size_t at, uint32_t bits) {
  uint64_t word;
  std::memcpy(&word, bytes + at / 8, 8);
  return uint32_t(word >> at % 8 & ((uint64_t(1) << bits) - 1));
}

// What a renderer needs to find and decode a meshlet: 8 bytes of the format.
struct Entry {
  uint32_t offset;     // of its triangles in the stream; its vertices follow them
  uint16_t size;       // of its triangles, in bytes
  uint16_t vertices;   // stored less 1 in a byte
  uint16_t triangles;  // stored less 1 in a byte
  uint32_t part;
};
constexpr size_t kEntryBytes = 8;

struct Encoded {
  std::vector<uint8_t> stream;
  std::vector<Entry> entries;
};

void encode_vertices(const Part& part, const uint32_t* vertices, size_t count,
                     std::vector<uint8_t>& stream) {
  const size_t elements = part.elements();
  std::vector<uint32_t> low(elements), width(elements);
  BitWriter writer(stream);
  for (size_t e = 0; e < elements; e++) {
    uint32_t high = 0;
    low[e] = UINT32_MAX;
    for (size_t i = 0; i < count; i++) {
      const uint32_t value = part.values[vertices[i] * elements + e];
      low[e] = std::min(low[e], value);
      high = std::max(high, value);
    }
    width[e] = width_of(high - low[e]);
    writer.write(low[e], part.bits[e]);
    writer.write(width[e], width_of(part.bits[e]));
  }
  for (size_t i = 0; i < count; i++)
    for (size_t e = 0; e < elements; e++)
      writer.write(part.values[vertices[i] * elements + e] - low[e], width[e]);
}

void encode_part(const Part& part, uint32_t number, size_t max_vertices, size_t max_triangles,
                 Encoded& encoded) {
  const std::vector<float> positions = part.positions();
  const std::vector<uint32_t>& corners = part.triangles;
  const size_t bound = meshopt_buildMeshletsBound(corners.size(), max_vertices, max_triangles);
  std::vector<meshopt_Meshlet> meshlets(bound);
  std::vector<uint32_t> vertices(bound * max_vertices);
  std::vector<uint8_t> triangles(bound * max_triangles * 3);
  meshlets.resize(meshopt_buildMeshlets(
      meshlets.data(), vertices.data(), triangles.data(), corners.data(), corners.size(),
      positions.data(), part.vertex_count(), 3 * sizeof(float), max_vertices, max_triangles, 0.0f));
  std::vector<uint8_t> buffer(meshopt_encodeMeshletBound(0, max_triangles));
  for (const meshopt_Meshlet& meshlet : meshlets) {
    uint32_t* const own = &vertices[meshlet.vertex_offset];
    uint8_t* const local = &triangles[meshlet.triangle_offset];
    meshopt_optimizeMeshletLevel(own, meshlet.vertex_count, local, meshlet.triangle_count, kLevel);
    const size_t size = meshopt_encodeMeshlet(buffer.data(), buffer.size(), nullptr, 0, local,
                                              meshlet.triangle_count);
    require(size > 0, "meshopt_encodeMeshlet");
    encoded.entries.push_back({uint32_t(encoded.stream.size()), uint16_t(size),
                               uint16_t(meshlet.vertex_count), uint16_t(meshlet.triangle_count),
                               number});
    encoded.stream.insert(encoded.stream.end(), buffer.begin(), buffer.begin() + size);
    encode_vertices(part, own, meshlet.vertex_count, encoded.stream);
  }
}

// Room for one decoded meshlet.
struct Output {
  alignas(16) uint32_t triangles[256];  // a | b << 8 | c << 16
  std::vector<float> values = std::vector<float>(256 * 16);
};

void decode_triangles(const Encoded& encoded, const Entry& entry, Output& output) {
  const int failed = meshopt_decodeMeshletRaw(nullptr, 0, output.triangles, entry.triangles,
                                              &encoded.stream[entry.offset], entry.size);
  require(failed == 0, "meshopt_decodeMeshletRaw");
}

void decode_values(const Encoded& encoded, const Entry& entry, const Part& part, Output& output) {
  const uint8_t* const bytes = &encoded.stream[entry.offset + entry.size];
  const size_t elements = part.elements();
  uint32_t low[16], width[16];
  size_t at = 0;
  for (size_t e = 0; e < elements; e++) {
    low[e] = read_bits(bytes, at, part.bits[e]);
    at += part.bits[e];
    width[e] = read_bits(bytes, at, width_of(part.bits[e]));
    at += width_of(part.bits[e]);
  }
  float* value = output.values.data();
  for (size_t i = 0; i < entry.vertices; i++)
    for (size_t e = 0; e < elements; e++) {
      *value++ = float(low[e] + read_bits(bytes, at, width[e]));
      at += width[e];
    }
}

// The parts, each with the vertices of its meshlets one after another.
std::vector<Part> decode(const Encoded& encoded, const std::vector<Part>& parts) {
  std::vector<Part> decoded(parts.size());
  Output output;
  for (size_t i = 0; i < parts.size(); i++) decoded[i].bits = parts[i].bits;
  for (const Entry& entry : encoded.entries) {
    Part& part = decoded[entry.part];
    const uint32_t first = uint32_t(part.vertex_count());
    decode_triangles(encoded, entry, output);
    decode_values(encoded, entry, part, output);
    for (size_t t = 0; t < entry.triangles; t++)
      for (uint32_t shift : {0, 8, 16})
        part.triangles.push_back(first + (output.triangles[t] >> shift & 255));
    part.values.insert(part.values.end(), output.values.begin(),
                       output.values.begin() + entry.vertices * part.elements());
  }
  return decoded;
}

}  // namespace

int main(int argc, char** argv) {
  require(argc == 5, "reading the arguments");
  const std::vector<Part> parts = read_parts(argv[3]);
  Encoded encoded;
  for (size_t i = 0; i < parts.size(); i++)
    encode_part(parts[i], uint32_t(i), size_t(atoi(argv[1])), size_t(atoi(argv[2])), encoded);
  const size_t bytes = encoded.stream.size() + kEntryBytes * encoded.entries.size();
  encoded.stream.resize(encoded.stream.size() + kOverread);
  write_parts(argv[4], decode(encoded, parts));

  Output output;
  print_figures(encoded.entries.size(), bytes, [&] {
    for (const Entry& entry : encoded.entries) {
      decode_triangles(encoded, entry, output);
      decode_values(encoded, entry, parts[entry.part], output);
    }
  });
}
