// The files that bench/meshlet_peers.py exchanges with these programs, and their timer.
//
// A file is an array of uint32: the number of parts; per part its counts of triangles, vertices and
// elements, the bits of each element, the triangles' vertices, the values of each vertex. The first
// three elements are the position.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

constexpr int kRepetitions = 7;

struct Part {
  std::vector<uint32_t> bits;       // of each element
  std::vector<uint32_t> triangles;  // three vertices each
  std::vector<uint32_t> values;     // vertex by vertex

  size_t elements() const { return bits.size(); }
  size_t vertex_count() const { return values.size() / elements(); }
  size_t triangle_count() const { return triangles.size() / 3; }
  // Positions as floats, as both projects' functions take them.
  std::vector<float> positions() const {
    std::vector<float> positions;
    for (size_t v = 0; v < vertex_count(); v++)
      for (size_t k = 0; k < 3; k++) positions.push_back(float(values[v * elements() + k]));
    return positions;
  }
};

inline std::vector<Part> read_parts(const char* path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  const uint32_t* at = reinterpret_cast<const uint32_t*>(bytes.data());
  std::vector<Part> parts(*at++);
  for (Part& part : parts) {
    const size_t triangles = at[0], vertices = at[1], elements = at[2];
    at += 3;
    const auto take = [&at](std::vector<uint32_t>& to, size_t count) {
      to.assign(at, at + count);
      at += count;
    };
    take(part.bits, elements);
    take(part.triangles, 3 * triangles);
    take(part.values, elements * vertices);
  }
  return parts;
}

inline void write_parts(const std::string& path, const std::vector<Part>& parts) {
  std::vector<uint32_t> words{uint32_t(parts.size())};
  for (const Part& part : parts) {
    words.insert(words.end(), {uint32_t(part.triangle_count()), uint32_t(part.vertex_count()),
                               uint32_t(part.elements())});
    for (const auto* list : {&part.bits, &part.triangles, &part.values})
      words.insert(words.end(), list->begin(), list->end());
  }
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(words.data()), std::streamsize(4 * words.size()));
}

// Prints the figures of a format as a JSON object. The times are seconds of the processor, which
// other programs disturb little, in each of kRepetitions calls of `decode`.
template <class Function>
void print_figures(size_t meshlets, size_t bytes, const Function& decode) {
  std::printf("{\"meshlets\": %zu, \"bytes\": %zu, \"decode_seconds\": [", meshlets, bytes);
  for (int i = 0; i < kRepetitions; i++) {
    const std::clock_t start = std::clock();
    decode();
    std::printf("%s%.9g", i ? ", " : "", double(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::printf("]}\n");
}

// Ends the program with one line unless a function of the other project succeeded.
inline void require(bool succeeded, const char* function) {
  if (succeeded) return;
  std::fprintf(stderr, "%s failed\n", function);
  std::exit(1);
}
