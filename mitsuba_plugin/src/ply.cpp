#include "ply.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace meshlet_shape {
namespace {

// Floats of a vertex that belong together: names in the file, and values.
struct Column {
  std::vector<std::string> names;
  const std::vector<float>* values;
};

// Mitsuba reads r, g, b as vertex_color, and name_0, name_1 .. as a mesh attribute.
std::vector<std::string> column_names(const Attribute& a) {
  if (a.name == "vertex_color" && a.components == 3) return {"r", "g", "b"};
  std::vector<std::string> names;
  for (uint32_t c = 0; c < a.components; c++) names.push_back(a.name + "_" + std::to_string(c));
  return names;
}

void write(std::FILE* file, const void* data, size_t bytes) {
  if (std::fwrite(data, 1, bytes, file) != bytes)
    throw std::runtime_error("cannot write a temporary file");
}

}  // namespace

TemporaryPly::TemporaryPly(std::vector<Primitive> primitives, bool face_normals)
    : has_normals_(!face_normals) {
  bool texcoords = true;
  size_t vertices = 0, triangles = 0;
  for (Primitive& primitive : primitives) {
    check_primitive(primitive);
    has_normals_ &= primitive.normal.exists();
    texcoords &= primitive.texcoord.exists();
  }
  std::vector<DecodedPrimitive> decoded;
  for (const Primitive& primitive : primitives) {
    decoded.push_back(decode_all(primitive));
    vertices += decoded.back().positions.size() / 3;
    triangles += decoded.back().triangles.size() / 3;
  }
  std::string pattern = (std::filesystem::temp_directory_path() / "meshlet-XXXXXX.ply").string();
  int descriptor = mkstemps(pattern.data(), 4);
  if (descriptor < 0) throw std::runtime_error("cannot create a temporary file");
  path_ = pattern;
  std::FILE* file = fdopen(descriptor, "wb");
  std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) + "\n";
  auto columns = [&](size_t p) {
    std::vector<Column> result = {{{"x", "y", "z"}, &decoded[p].positions}};
    if (has_normals_) result.push_back({{"nx", "ny", "nz"}, &decoded[p].normals});
    if (texcoords) result.push_back({{"u", "v"}, &decoded[p].texcoords});
    for (size_t i = 0; i < decoded[p].others.size(); i++) {
      decoded[p].others[i].resize(decoded[p].positions.size() / 3 *
                                  primitives[p].others[i].components);
      result.push_back({column_names(primitives[p].others[i]), &decoded[p].others[i]});
    }
    return result;
  };
  for (const Column& column : columns(0))
    for (const std::string& name : column.names) header += "property float " + name + "\n";
  header += "element face " + std::to_string(triangles) +
            "\nproperty list uchar int vertex_indices\nend_header\n";
  write(file, header.data(), header.size());
  for (size_t p = 0; p < primitives.size(); p++) {
    std::vector<Column> all = columns(p);
    for (size_t v = 0; v < decoded[p].positions.size() / 3; v++)
      for (const Column& column : all)
        write(file, column.values->data() + v * column.names.size(), 4 * column.names.size());
  }
  uint32_t first = 0;
  for (const DecodedPrimitive& d : decoded) {
    for (size_t t = 0; t < d.triangles.size(); t += 3) {
      uint32_t corners[3] = {first + d.triangles[t], first + d.triangles[t + 1],
                             first + d.triangles[t + 2]};
      uint8_t three = 3;
      write(file, &three, 1);
      write(file, corners, sizeof(corners));
    }
    first += uint32_t(d.positions.size() / 3);
  }
  if (std::fclose(file) != 0) throw std::runtime_error("cannot write a temporary file");
}

TemporaryPly::~TemporaryPly() { std::remove(path_.c_str()); }

}  // namespace meshlet_shape
