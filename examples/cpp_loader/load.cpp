// load MODEL.glb: reads a model with tinygltf, decodes its compressed primitives with the C
// interface of gltf-meshlet, and prints their vertices' attributes and bounds. An engine copies
// decode().
//
// c++ -std=c++11 load.cpp $(pkg-config --cflags --libs gltf_meshlet) -o load
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <gltf_meshlet.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

const char* const kExtension = "EXT_meshlet_edgebreaker";
const char* const kTransport = "EXT_meshlet_transport";

// Vertices of a primitive: `components` floats each.
struct Attribute {
  uint32_t components;
  std::vector<float> values;
};

struct Primitive {
  std::vector<uint32_t> indices;
  std::map<std::string, Attribute> attributes;
};

void check(int status) {
  if (status != GLTF_MESHLET_OK) throw std::runtime_error(gltf_meshlet_error());
}

void require(bool ok, const char* problem) {
  if (!ok) throw std::runtime_error(problem);
}

// The bytes of a buffer view. tinygltf has read the buffers, but checks no view against them.
const unsigned char* bytes_of(const tinygltf::Model& model, int number, size_t& size) {
  require(number >= 0 && size_t(number) < model.bufferViews.size(), "there is no such buffer view");
  const tinygltf::BufferView& view = model.bufferViews[size_t(number)];
  require(view.buffer >= 0 && size_t(view.buffer) < model.buffers.size(),
          "there is no such buffer");
  const std::vector<unsigned char>& data = model.buffers[size_t(view.buffer)].data;
  require(view.byteOffset <= data.size() && view.byteLength <= data.size() - view.byteOffset,
          "a buffer view lies outside its buffer");
  size = view.byteLength;
  return data.data() + view.byteOffset;
}

// The blobs of a buffer view, which may be packed for download.
std::vector<unsigned char> blobs_of(const tinygltf::Model& model, int number) {
  size_t size = 0;
  const unsigned char* bytes = bytes_of(model, number, size);
  if (!model.bufferViews[size_t(number)].extensions.count(kTransport))
    return std::vector<unsigned char>(bytes, bytes + size);
  size_t unpacked = 0;
  check(gltf_meshlet_get_unpacked_bytes(bytes, size, &unpacked));
  std::vector<unsigned char> blobs(unpacked);
  check(gltf_meshlet_unpack(bytes, size, 0, blobs.data(), blobs.size()));
  return blobs;
}

// A stream of the view: its table row, and its decoded values.
struct Stream {
  gltf_meshlet_stream row;
  std::vector<uint32_t> integers;  // of INTEGER streams
  std::vector<float> reals;        // of all others

  uint32_t components() const { return row.kind == GLTF_MESHLET_OCT ? 3u : uint32_t(row.elements); }
  float value(size_t vertex, uint32_t c) const {
    const size_t at = vertex * components() + c;
    return row.kind == GLTF_MESHLET_INTEGER ? float(integers[at]) : reals[at];
  }
};

// The attribute that begins at a stream: as many streams as fill its components.
Attribute attribute_of(const std::vector<Stream>& streams, size_t first, uint32_t components,
                       size_t vertices) {
  Attribute out;
  out.components = components;
  out.values.resize(vertices * components);
  uint32_t done = 0;
  for (size_t s = first; done < components; done += streams[s++].components()) {
    require(s < streams.size() && streams[s].components() <= components - done,
            "an attribute's streams do not fill its components");
    for (size_t v = 0; v < vertices; v++)
      for (uint32_t c = 0; c < streams[s].components(); c++)
        out.values[v * components + done + c] = streams[s].value(v, c);
  }
  return out;
}

// Decodes a compressed primitive. Attributes of integer accessors become floats, too, without the
// division of a normalized accessor.
Primitive decode(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const tinygltf::Value& extension = primitive.extensions.at(kExtension);
  const std::vector<unsigned char> blobs =
      blobs_of(model, extension.Get("bufferView").GetNumberAsInt());
  gltf_meshlet_view* opened = nullptr;
  check(gltf_meshlet_open(blobs.data(), blobs.size(), &opened));
  const std::unique_ptr<gltf_meshlet_view, int (*)(void*)> view(opened, gltf_meshlet_close);
  gltf_meshlet_counts counts = gltf_meshlet_counts();
  counts.size = sizeof counts;
  check(gltf_meshlet_get_counts(view.get(), &counts));
  if (counts.suspicious) check(gltf_meshlet_validate(view.get(), 0));

  Primitive out;
  out.indices.resize(3 * size_t(counts.triangles));
  const size_t vertices = size_t(counts.vertices);
  std::vector<Stream> streams(counts.streams);
  std::vector<void*> values;
  for (uint32_t s = 0; s < counts.streams; s++) {
    Stream& stream = streams[s];
    check(gltf_meshlet_get_stream(view.get(), 0, s, &stream.row));
    if (stream.row.kind == GLTF_MESHLET_INTEGER) {
      stream.integers.resize(vertices * stream.components());
      values.push_back(stream.integers.data());
    } else {
      stream.reals.resize(vertices * stream.components());
      values.push_back(stream.reals.data());
    }
  }
  gltf_meshlet_arrays arrays = gltf_meshlet_arrays();
  arrays.size = sizeof arrays;
  arrays.triangle_room = counts.triangles;
  arrays.vertex_room = counts.vertices;
  arrays.triangles = out.indices.data();
  arrays.values = values.data();
  check(gltf_meshlet_decode(view.get(), 0, &arrays));

  const tinygltf::Value& places = extension.Get("attributes");
  for (const std::string& name : places.Keys()) {
    const auto accessor = primitive.attributes.find(name);
    require(accessor != primitive.attributes.end() && accessor->second >= 0 &&
                size_t(accessor->second) < model.accessors.size(),
            "an attribute has no accessor");
    const int type = model.accessors[size_t(accessor->second)].type;
    const int components = tinygltf::GetNumComponentsInType(uint32_t(type));
    const int first = places.Get(name).GetNumberAsInt();
    require(components > 0 && first >= 0, "an attribute has no streams");
    out.attributes[name] = attribute_of(streams, size_t(first), uint32_t(components), vertices);
  }
  return out;
}

// tinygltf refuses indices without a buffer view, though glTF allows them: names one in the JSON of
// a .glb, that of the compressed bytes. decode() does not look at it.
std::string with_views_of_indices(const std::string& glb) {
  const size_t head = 20;
  uint32_t length = 0;
  require(glb.size() >= head, "the file is too short");
  std::memcpy(&length, glb.data() + 12, sizeof length);
  require(length <= glb.size() - head, "the file is shorter than its header says");
  nlohmann::json gltf = nlohmann::json::parse(glb.substr(head, length));
  for (const nlohmann::json& mesh : gltf.at("meshes"))
    for (const nlohmann::json& primitive : mesh.at("primitives"))
      if (primitive.contains("extensions") && primitive["extensions"].contains(kExtension))
        gltf.at("accessors").at(primitive.at("indices").get<size_t>())["bufferView"] =
            primitive["extensions"][kExtension].at("bufferView");
  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out = glb.substr(0, head) + text + glb.substr(head + length);
  const uint32_t sizes[2] = {uint32_t(out.size()), uint32_t(text.size())};
  std::memcpy(&out[8], sizes, sizeof sizes);
  return out;
}

void print(const Primitive& primitive) {
  std::printf("%zu triangles\n", primitive.indices.size() / 3);
  for (const auto& named : primitive.attributes) {
    const Attribute& a = named.second;
    std::printf("  %s, %zu vertices:", named.first.c_str(), a.values.size() / a.components);
    for (uint32_t c = 0; c < a.components; c++) {
      float low = a.values[c], high = low;
      for (size_t i = c; i < a.values.size(); i += a.components) {
        low = std::min(low, a.values[i]);
        high = std::max(high, a.values[i]);
      }
      std::printf(" %.9g..%.9g", double(low), double(high));
    }
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: load MODEL.glb\n");
    return 2;
  }
  tinygltf::TinyGLTF loader;
  // Images are the engine's own business.
  loader.SetImageLoader([](tinygltf::Image*, const int, std::string*, std::string*, int, int,
                           const unsigned char*, int, void*) { return true; },
                        nullptr);
  try {
    std::ifstream file(argv[1], std::ios::binary);
    const std::string glb = with_views_of_indices(
        std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()));
    tinygltf::Model model;
    std::string error, warning;
    const auto* bytes = reinterpret_cast<const unsigned char*>(glb.data());
    if (!loader.LoadBinaryFromMemory(&model, &error, &warning, bytes, uint32_t(glb.size())))
      throw std::runtime_error(error);
    for (const tinygltf::Mesh& mesh : model.meshes)
      for (const tinygltf::Primitive& primitive : mesh.primitives)
        if (primitive.extensions.count(kExtension)) print(decode(model, primitive));
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s: %s\n", argv[1], problem.what());
    return 2;
  }
}
