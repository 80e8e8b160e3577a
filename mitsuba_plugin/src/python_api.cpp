#include "python_api.h"

#include <cstring>
#include <stdexcept>

#include "decode/decoder.h"
#include "model.h"

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace meshlet_shape {
namespace {

// Filled by the Python reader inside read_primitives.
struct Request {
  std::vector<std::shared_ptr<const Blob>> blobs;
  std::vector<Primitive> primitives;
  std::string error;
};

using Reader = void (*)(const char* filename, const Selection* selection, Request* request);
Reader g_reader = nullptr;

// mitsuba_plugin/native.py declares the same struct.
struct StatisticsRow {
  Statistics cache;
  ModelFacts shape;
  uint64_t cache_number;  // equal for shapes that share a cache, 0 without one
};

}  // namespace

std::vector<Primitive> read_primitives(const std::string& filename, const Selection& selection) {
  if (!g_reader) throw std::runtime_error("the plugin is not ready; import mitsuba_plugin");
  Request request;
  g_reader(filename.c_str(), &selection, &request);
  if (!request.error.empty()) throw std::runtime_error(request.error);
  return request.primitives;
}

EXPORT void meshlet_set_reader(Reader reader) { g_reader = reader; }

EXPORT void meshlet_fail(Request* request, const char* message) { request->error = message; }

// Copies the bytes. Returns the blob's number for meshlet_add_primitive.
EXPORT uint32_t meshlet_add_blob(Request* request, const uint8_t* data, uint64_t size) {
  request->blobs.push_back(std::make_shared<const Blob>(data, size));
  return uint32_t(request->blobs.size() - 1);
}

// rows: POSITION, NORMAL, TEXCOORD_0 (stream ~0 if missing), then the others. matrix: row-major 3
// x 4. chosen: meshlets of the blob, all of them if there are none.
EXPORT void meshlet_add_primitive(Request* request, uint32_t blob, const float* matrix,
                                  const Attribute* rows, uint32_t count, const uint32_t* chosen,
                                  uint32_t chosen_count) {
  Primitive primitive;
  primitive.blob = request->blobs.at(blob);
  primitive.chosen.assign(chosen, chosen + chosen_count);
  std::memcpy(primitive.to_world.m, matrix, sizeof(primitive.to_world.m));
  primitive.position = rows[0];
  primitive.normal = rows[1];
  primitive.texcoord = rows[2];
  primitive.others.assign(rows + 3, rows + count);
  request->primitives.push_back(std::move(primitive));
}

// Statistics of the shape with this cache_id, or of its cache group. Returns 0 if there is no such
// shape.
EXPORT int meshlet_statistics(uint64_t cache_id, StatisticsRow* row, int reset) {
  std::lock_guard lock(listings().mutex);
  auto found = listings().by_id.find(cache_id);
  if (found == listings().by_id.end()) return 0;
  Store* cache = found->second->cache;
  *row = {cache ? cache->statistics() : Statistics(), *found->second->facts,
          reinterpret_cast<uintptr_t>(cache)};
  if (cache && reset) cache->reset_statistics();
  return 1;
}

// Writes up to `capacity` cache_ids of existing shapes; returns the number of shapes.
EXPORT uint32_t meshlet_shapes(uint64_t* ids, uint32_t capacity) {
  std::lock_guard lock(listings().mutex);
  uint32_t n = 0;
  for (auto& entry : listings().by_id) {
    if (n < capacity) ids[n] = entry.first;
    n++;
  }
  return n;
}

EXPORT int meshlet_fits_memory(uint64_t triangles) { return fits_memory(triangles); }

// Bytes of the threads' decoders and scratch memory, which no limit counts.
EXPORT uint64_t meshlet_working_bytes() {
  return thread_slots() * gltf_meshlet_codec::make_decoder()->bytes() + scratch_bytes();
}

}  // namespace meshlet_shape
