#include "model.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

using Json = nlohmann::json;

void require(bool ok, const char* problem) {
  if (!ok) throw std::runtime_error(problem);
}

void check(int status) { require(status == GLTF_MESHLET_OK, gltf_meshlet_error()); }

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 4; r++)
      for (int k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

namespace {

Matrix place_of(const Json& node) {
  if (node.contains("matrix")) return node["matrix"].get<Matrix>();
  const auto t = node.value("translation", std::array<double, 3>{0, 0, 0});
  const auto q = node.value("rotation", std::array<double, 4>{0, 0, 0, 1});
  const auto s = node.value("scale", std::array<double, 3>{1, 1, 1});
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {s[0] * (1 - 2 * (y * y + z * z)),
          s[0] * 2 * (x * y + z * w),
          s[0] * 2 * (x * z - y * w),
          0,
          s[1] * 2 * (x * y - z * w),
          s[1] * (1 - 2 * (x * x + z * z)),
          s[1] * 2 * (y * z + x * w),
          0,
          s[2] * 2 * (x * z + y * w),
          s[2] * 2 * (y * z - x * w),
          s[2] * (1 - 2 * (x * x + y * y)),
          0,
          t[0],
          t[1],
          t[2],
          1};
}

class Reader {
 public:
  Reader(const Json& gltf, Bytes buffer, Model& model)
      : gltf_(gltf), buffer_(buffer), model_(model) {}

  void read() {
    const Json& scene = gltf_.at("scenes").at(gltf_.value("scene", size_t(0)));
    const Matrix none{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (const Json& node : scene.at("nodes")) visit(node.get<size_t>(), none, 0);
    require(model_.tables.data, "no primitive has levels of detail: compress it with --lod");
  }

 private:
  void visit(size_t number, const Matrix& above, int depth) {
    // A circle never ends, and nodes that have two parents may be met 2^n times.
    require(depth < 100 && met_++ < gltf_.at("nodes").size(),
            "the nodes are no trees, or too deep");
    const Json& node = gltf_.at("nodes").at(number);
    const Matrix place = product(above, place_of(node));
    if (node.contains("mesh") && !model_.tables.data)
      for (const Json& primitive :
           gltf_.at("meshes").at(node["mesh"].get<size_t>()).at("primitives"))
        if (!model_.tables.data) read_levels(primitive, place);
    if (node.contains("camera") && !model_.has_camera) {
      const Json& camera = gltf_.at("cameras").at(node["camera"].get<size_t>());
      if (camera.contains("perspective")) {
        model_.camera = {place, camera["perspective"].at("yfov").get<double>()};
        model_.has_camera = true;
      }
    }
    if (node.contains("children"))
      for (const Json& child : node["children"]) visit(child.get<size_t>(), place, depth + 1);
  }

  Bytes view(const Json& number) const {
    const Json& row = gltf_.at("bufferViews").at(number.get<size_t>());
    const size_t begin = row.value("byteOffset", size_t(0)),
                 size = row.at("byteLength").get<size_t>();
    require(row.at("buffer") == 0 && begin <= buffer_.size && size <= buffer_.size - begin,
            "a buffer view lies outside of the file");
    require(!row.contains("extensions"),
            "the file is packed for download: see gltf_meshlet_unpack_page, or transcode it");
    return {buffer_.data + begin, size};
  }

  void read_levels(const Json& primitive, const Matrix& place) {
    const Json extensions = primitive.value("extensions", Json::object());
    if (!extensions.contains("EXT_meshlet_lod")) return;
    const Json &levels = extensions["EXT_meshlet_lod"],
               &meshlets = extensions.at("EXT_meshlet_edgebreaker");
    if (levels.at("version") != 1) return;
    model_.tables = view(levels.at("bufferView"));
    model_.views[0] = view(levels.at("pages").at("bufferView"));
    model_.views[1] = view(meshlets.at("bufferView"));
    const Json& streams = meshlets.at("attributes");
    if (streams.contains("NORMAL")) {
      const size_t number = streams["NORMAL"].get<size_t>();
      require(number < 8, "NORMAL is no stream that the shader has room for");
      model_.normals = int(number);
    }
    model_.place = place;
    gltf_meshlet_tables& counts = model_.counts;
    counts.size = sizeof counts;
    counts.page_count = levels.at("pageCount").get<uint32_t>();
    counts.coarse_page_count = levels.at("coarsePageCount").get<uint32_t>();
    counts.group_count = levels.at("groupCount").get<uint32_t>();
    counts.run_count = levels.at("runCount").get<uint32_t>();
    counts.root_page_count = levels.value("rootPageCount", 0u);
    counts.bytes = model_.tables.data;
    counts.byte_count = model_.tables.size;
  }

  const Json& gltf_;
  const Bytes buffer_;
  Model& model_;
  size_t met_ = 0;  // nodes
};

}  // namespace

Model read_model(const std::string& path) {
  Model model;
  std::ifstream in(path, std::ios::binary);
  require(in.good(), "the file cannot be read");
  model.file.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  const std::vector<uint8_t>& file = model.file;
  // A .glb: a header of 12 bytes, then chunks of JSON and of the buffer, each behind 8 bytes.
  uint32_t json_bytes = 0;
  require(file.size() >= 20 && std::memcmp(file.data(), "glTF", 4) == 0, "this is no .glb");
  std::memcpy(&json_bytes, &file[12], 4);
  require(json_bytes <= file.size() - 20, "the .glb is shorter than its header says");
  const uint8_t* json = &file[20];
  const size_t begin = size_t(20) + json_bytes + 8;
  const Bytes buffer = {json + json_bytes + 8, begin < file.size() ? file.size() - begin : 0};
  try {
    const Json gltf = Json::parse(json, json + json_bytes);
    Reader(gltf, buffer, model).read();
  } catch (const Json::exception& error) {
    throw std::runtime_error(std::string("the JSON is not as expected: ") + error.what());
  }
  return model;
}
