// Compressed geometry that rays can hit: the Mitsuba shape without Mitsuba.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "primitive.h"
#include "cache.h"
#include "texcoord_cells.h"
#include "triangles.h"

namespace meshlet_shape {

// A point on the surface: everything that depends on the geometry alone.
struct SurfacePoint {
  float p[3], uv[2];
  float n[3], shading_n[3];
  float dp_du[3], dp_dv[3];
  float dn_du[3], dn_dv[3];
};
static_assert(sizeof(SurfacePoint) == 23 * sizeof(float));

struct Options {
  std::string accel = "auto";    // or "cache" or "triangles"
  bool cache_is_given = false;   // any of the next three
  double cache_fraction = 0.25;  // of the size of all meshlets decoded
  int64_t cache_bytes = -1;      // unless negative: used instead of the fraction
  std::string cache_group;       // shapes with the same name share a cache; "": no sharing
  bool face_normals = false;
  bool flip_normals = false;
  bool flip_texcoords = false;
  bool smooth_normals = false;  // where the file has none
};

struct ModelFacts {
  uint64_t triangles = 0, meshlets = 0;
  uint64_t vertices = 0;          // of the blobs
  uint64_t compressed_bytes = 0;  // of the blobs, each counted once
  uint64_t table_bytes = 0;       // boxes, areas, the cache's tables
  uint64_t decoded_bytes = 0;     // of all entries together
  uint64_t block_bytes = 0;       // of all meshlets, if they are resident
};

// Runs a function for each number below `count`, on several threads.
using Parallel = std::function<void(size_t count, const std::function<void(size_t)>& run)>;

// Checks the primitives of a shape and adds up the first four facts. Throws std::runtime_error.
ModelFacts check_primitives(std::vector<Primitive>& primitives);

// Whether half of the memory that is free holds so many triangles with an acceleration structure.
bool fits_memory(uint64_t triangles);

// A shape in the list of all that exist, for statistics. cache: null without one.
struct Listing {
  Listing(const ModelFacts* facts, Store* cache);
  ~Listing();
  Listing(const Listing&) = delete;

  const ModelFacts* const facts;
  Store* const cache;
  const uint64_t id;
};

// Hold the mutex while using one.
struct Listings {
  std::mutex mutex;
  std::map<uint64_t, const Listing*> by_id;
};
Listings& listings();

class Model {
 public:
  // Decodes every meshlet for its box and area. Throws std::runtime_error.
  Model(std::vector<Primitive> primitives, const Options& options, const Parallel& parallel);
  Model(const Model&) = delete;

  const ModelFacts& facts() const { return facts_; }
  Box box(uint32_t meshlet) const;  // enlarged by the rounding errors of ray traversal
  const Box& box() const { return box_; }
  const std::vector<float>& areas() const { return areas_; }  // per meshlet
  Store& cache() const { return table_->store(); }
  uint64_t id() const { return listing_->id; }
  const Attribute* attribute(const std::string& name, uint32_t& index) const;
  const std::vector<Attribute>& attributes() const { return primitives_[0].others; }
  const std::vector<Primitive>& primitives() const { return primitives_; }
  const Options& options() const { return options_; }

  // Nearest hits with 0 < t < t_max of a meshlet.
  template <int N>
  void intersect(uint32_t meshlet, const Rays<N>& rays, Hits<N>& hits) const {
    Meetings<N> meetings;
    boxes_[meshlet].meet(rays, meetings);
    if (meetings.any)
      triangles(meshlet, uint32_t(__builtin_popcount(meetings.any)))
          .intersect(rays, meetings, hits);
  }
  // Mask of the rays that hit the meshlet.
  template <int N>
  uint32_t occlude(uint32_t meshlet, const Rays<N>& rays) const {
    Meetings<N> meetings;
    boxes_[meshlet].meet(rays, meetings);
    return meetings.any ? triangles(meshlet, uint32_t(__builtin_popcount(meetings.any)))
                              .occlude(rays, meetings)
                        : 0u;
  }

  // triangle, b1, b2: as in Hit.
  void surface(uint32_t meshlet, uint32_t triangle, float b1, float b2, SurfacePoint& out) const;

  // Maps two uniform numbers to a point uniform over the meshlet's area; fills p, uv, n. Returns
  // the triangle.
  uint32_t sample(uint32_t meshlet, float u1, float u2, SurfacePoint& out) const;

  // Finds a point with these texture coordinates, any if there are several. Returns false if there
  // is none. Call index_texcoords before.
  bool at_texcoord(const float (&uv)[2], uint32_t& meshlet, uint32_t& triangle,
                   SurfacePoint& out) const;

  // Builds the grid for at_texcoord, which emitters with a texture need.
  void index_texcoords();

  // Returns the attribute `index` (1 to 4 floats) at the corners of a triangle, and the barycentric
  // weights of the point nearest to p.
  void attribute(uint32_t index, uint32_t meshlet, uint32_t triangle, const float* p,
                 const float* (&corners)[3], float (&weights)[3]) const;

 private:
  // A meshlet's primitive, and its number there.
  struct Place {
    const Primitive& primitive;
    uint32_t meshlet;
  };
  Place place_of(uint32_t meshlet) const;
  // Valid until this thread asks for another meshlet. rays: number of rays, for the statistics.
  const Triangles& triangles(uint32_t meshlet, uint32_t rays = 1) const;
  const VertexAttributes& vertex_attributes(uint32_t meshlet) const;
  const float* texcoord_of(uint32_t meshlet, uint32_t triangle, uint32_t k) const;
  void measure(const Parallel& parallel);
  void shading(const Primitive& primitive, const VertexAttributes& values, uint32_t triangle,
               const float* b, const Vec3* corner, SurfacePoint& out) const;

  std::vector<Primitive> primitives_;
  std::vector<uint32_t> first_meshlet_;  // per primitive, and the total
  Options options_;
  ModelFacts facts_;
  std::vector<Boxes> boxes_;  // per meshlet
  std::vector<float> areas_;
  TexcoordCells cells_;  // of meshlets
  Box box_;
  std::unique_ptr<Table> table_;
  std::unique_ptr<Listing> listing_;
};

}  // namespace meshlet_shape
