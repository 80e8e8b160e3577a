/* gltf-meshlet: functions of the library that only gltf_ext calls, and its tests. They have no
 * promises: any version may change them. Programs use gltf_meshlet.h. */
#ifndef GLTF_MESHLET_INTERNAL_H
#define GLTF_MESHLET_INTERNAL_H

#include "gltf_meshlet.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct gltf_meshlet_surface gltf_meshlet_surface; /* level 0, to measure other levels */

/* ---- Statistics ---- */

/* Where the bits of a view go: they sum to 8 * its bytes. */
typedef struct gltf_meshlet_statistics {
  uint32_t size;
  int32_t iterations;    /* rounds of region growing; the encoder's, like the histogram */
  uint32_t histogram[4]; /* regions of < 32, < 64, < 72 and more triangles, before they are cut */
  uint64_t connectivity_bits, reference_bits, stream_bits[GLTF_MESHLET_STREAMS];
  uint64_t symbols[5], disks; /* numbers of C, L, E, R, S, and of disks */
  uint64_t owned_references, private_references, foreign_references;
} gltf_meshlet_statistics;

/* Decodes every meshlet, to count bits. */
GLTF_MESHLET_API int gltf_meshlet_get_statistics(const gltf_meshlet_view* view,
                                                 gltf_meshlet_statistics* out);

/* gltf_meshlet_encode, and where the bits went. statistics: may be null. */
GLTF_MESHLET_API int gltf_meshlet_encode_described(const gltf_meshlet_mesh* mesh,
                                                   const gltf_meshlet_options* options,
                                                   gltf_meshlet_statistics* statistics,
                                                   gltf_meshlet_result** result);

/* ---- Sources ---- */

/* Gives identical rows of `stride` bytes one number, from 0 in order of first occurrence. Writes
 * `count` numbers, and how many rows differ. count < 2^32 - 1. */
GLTF_MESHLET_API int gltf_meshlet_weld(const void* rows, size_t count, size_t stride,
                                       uint32_t* numbers, uint32_t* different);

enum { GLTF_MESHLET_ANY = 0, GLTF_MESHLET_NUMBERS = 1, GLTF_MESHLET_CORNERS = 2 }; /* words */

/* Reads the lines of a text (OBJ, PLY, STL) whose first word, in any case, is one of `count`
 * keywords, which are in lower case; an empty one stands for all lines. words: what follows each.
 * GLTF_MESHLET_NUMBERS: numbers. GLTF_MESHLET_CORNERS: each word is 1 to 3 integers between slashes
 * and gives 3, 0 for a missing one. GLTF_MESHLET_ANY: words that are not read, without continued
 * lines. Three arrays of the result for each keyword: the numbers, of double, or of int32_t if they
 * are corners; uint32_t, how many each line has; uint32_t, the lines' offsets in the text. */
GLTF_MESHLET_API int gltf_meshlet_scan_lines(const char* text, size_t size,
                                             const char* const* keywords, const uint32_t* words,
                                             size_t count, gltf_meshlet_result** result);

/* Cuts `count` polygons into triangles. points: 3 floats of each corner, one polygon after the
 * other; sizes: corners of each polygon, `corners` in all, less than 2^32. Convex polygons become
 * fans, others lose their ears. Array 0 of the result: uint32_t, three corners, numbered over all
 * polygons, of each triangle; size - 2 triangles for each polygon with at least three corners, one
 * polygon after the other. */
GLTF_MESHLET_API int gltf_meshlet_triangulate(const float* points, size_t corners,
                                              const uint32_t* sizes, size_t count,
                                              gltf_meshlet_result** result);

/* ---- Parts of the builder of levels ---- */

/* Triangles of all groups: those of group g are begin[g] .. begin[g + 1], at least one. */
typedef struct gltf_meshlet_groups {
  uint32_t size;
  const uint32_t* triangles; /* three vertex numbers each */
  const uint32_t* begin;
  uint64_t triangle_count, begin_count; /* the latter: one more than groups */
} gltf_meshlet_groups;

/* Makes meshlets that never cross groups. Uses the mesh's position_ids, positions
 * and vertex_count, and the options effort, max_triangles, threads, lambda. Arrays of the
 * result, uint32_t: order, disk_begin, meshlet_begin, group_begin, as in gltf_meshlet_mesh. */
GLTF_MESHLET_API int gltf_meshlet_generate(const gltf_meshlet_mesh* mesh,
                                           const gltf_meshlet_groups* groups,
                                           const gltf_meshlet_options* options,
                                           gltf_meshlet_result** result);

/* Writes the numbers of points (three finite floats each) along a Hilbert curve. */
GLTF_MESHLET_API int gltf_meshlet_sort_points(const float* points, size_t count, uint32_t* order);

/* Opens level 0 and borrows the shapes: positions of all vertices, three finite floats each, at
 * rest and with each morph target. vertex_share: the share of its area that its vertices stand for.
 */
GLTF_MESHLET_API int gltf_meshlet_open_surface(const float* const* shapes, uint32_t shape_count,
                                               uint64_t vertex_count,
                                               const gltf_meshlet_groups* level_0,
                                               float vertex_share, int32_t threads,
                                               gltf_meshlet_surface** surface);

/* Vertices of level 0 that are gone, for each of the chosen groups. */
typedef struct gltf_meshlet_samples {
  uint32_t size;
  const uint32_t *vertices, *begin; /* begin: one more than chosen groups */
  const float* areas;               /* of level 0, that each vertex stands for */
  uint64_t count;
} gltf_meshlet_samples;

/* Measures chosen groups of whole levels that others replace. Arrays of the result: float, for each
 * chosen replacement, the distance within which 99.9 % of either surface lies of the other, level
 * 0; then of the vertices to carry on: uint32_t their numbers, the triangle of its group's `after`
 * that is nearest to each, and begins; float areas. */
GLTF_MESHLET_API int gltf_meshlet_measure(const gltf_meshlet_surface* surface,
                                          const gltf_meshlet_groups* before,
                                          const gltf_meshlet_groups* after, const uint32_t* chosen,
                                          size_t chosen_count, const gltf_meshlet_samples* carried,
                                          int32_t threads, gltf_meshlet_result** result);

/* Writes the triangle of level 0, at rest, that is nearest to each point. */
GLTF_MESHLET_API int gltf_meshlet_get_nearest(const gltf_meshlet_surface* surface,
                                              const float* points, size_t point_count,
                                              int32_t threads, uint32_t* triangles);

/* Writes the distance of each point to the nearest triangle, or to any that is no farther than
 * `enough`, and, unless `nearest` is null, that triangle's number. */
GLTF_MESHLET_API int gltf_meshlet_get_distances(const float* points, size_t point_count,
                                                const gltf_meshlet_groups* triangles,
                                                const float* positions, uint64_t vertex_count,
                                                float enough, int32_t threads, float* distances,
                                                uint32_t* nearest);

#ifdef __cplusplus
}
#endif
#endif
