/* gltf-meshlet: functions of the library that only gltf_ext calls, and its tests. They have no
 * promises: any version may change them. Programs use gltf_meshlet.h. */
#ifndef GLTF_MESHLET_INTERNAL_H
#define GLTF_MESHLET_INTERNAL_H

#include "gltf_meshlet.h"

#ifdef __cplusplus
extern "C" {
#endif

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

/* ---- Levels of detail ---- */

/* Functions of meshoptimizer, by its header and cmake/simplifier_guard.h. */
typedef struct gltf_meshlet_simplifier {
  uint32_t size;
  void (*simplify)(void);         /* meshopt_simplifyWithAttributes */
  void (*simplify_guarded)(void); /* meshopt_simplifyGuarded; may be null */
  void (*partition)(void);        /* meshopt_partitionClusters */
} gltf_meshlet_simplifier;

/* What becomes of a chunk: one level, whose clusters then wait for others; one level that is the
 * last; all further levels. */
enum { GLTF_MESHLET_ONE_LEVEL = 0, GLTF_MESHLET_ALL_LEVELS = 1, GLTF_MESHLET_LAST_LEVEL = 2 };

/* A primitive, or a chunk of it, on its grid. Numbers of floats are those of each vertex. */
typedef struct gltf_meshlet_levels_input {
  uint32_t size, shape_count;
  /* Triangles; streams and values; positions: integers; position_ids: equal where they are.
   * disk_begin and meshlet_begin: clusters of `level`, or of finer ones, in the order of the
   * triangles; null to generate level 0. */
  const gltf_meshlet_mesh* mesh;
  /* Equal for equal positions before quantisation. */
  const uint32_t* source_position_ids;
  /* The same vertex for all that are equal in all integers, or that edges of length zero connect.
   */
  const uint32_t* canonical_vertices;
  const float* seam_points;   /* 3: positions, moved apart where only the grid joins vertices */
  const float* const* shapes; /* 3 each: positions with each morph target at weight 1 */
  const float *attributes,
      *weights; /* values that count in the choice of edges, beside positions */
  uint64_t attribute_count;
  const uint8_t* locked; /* 1 for vertices that stay, equal where positions are; or null */
  /* Equal for vertices that may stand for each other at a corner; null for none. */
  const uint32_t* places;
  const float *normals, *others; /* 3, of length one or zero; texture coordinates and colours */
  uint64_t other_count;
  /* Of each cluster: the group that it replaces a part of, or -1; the error of that group; centre
   * and radius of a sphere around it and all finer ones that it replaces. */
  const int32_t* finer_groups;
  const double *errors, *spheres;
  uint32_t level, first_group; /* of the groups to form */
  uint32_t group_size;         /* clusters, about */
  uint32_t chunk;              /* GLTF_MESHLET_ONE_LEVEL, ... */
  double reduction;   /* triangles of a group over those of its replacement: 1 to a million */
  double error_limit; /* groups with a larger error stay as they are */
  const gltf_meshlet_simplifier* simplifier;
} gltf_meshlet_levels_input;

/* Builds levels and encodes them in pages. Uses the options threads, effort, max_triangles, lambda,
 * page_bytes, progress (after each level). Lengths are in cells of the grid. Without pages, a whole
 * primitive cannot be simplified. statistics: of the pages of level 0, or null. Arrays of the
 * result, uint32_t unless said otherwise:
 * - 0 the group of each cluster; 1 its finer group, int32_t;
 * - 2 the level of each group; 3 double, the error of its replacement, infinite without one; 4 four
 *   double, its sphere;
 * - of clusters that wait for the next level: 5 triangles, 6 disk_begin, 7 meshlet_begin, 8 finer
 *   groups, int32_t, 9 errors, double, 10 spheres;
 * - of each level, uint64_t: 11 triangles that could not be simplified, 12 triangles;
 * - 13 pages of coarse levels, 14 of level 0: bytes, groups, triangles, vertices; 15 the groups of
 *   all pages; 16 their bytes, uint8_t. */
GLTF_MESHLET_API int gltf_meshlet_build_levels(const gltf_meshlet_levels_input* input,
                                               const gltf_meshlet_options* options,
                                               gltf_meshlet_statistics* statistics,
                                               gltf_meshlet_result** result);

/* Triangles of all groups: those of group g are begin[g] .. begin[g + 1], at least one. */
typedef struct gltf_meshlet_groups {
  uint32_t size;
  const uint32_t* triangles; /* three vertex numbers each */
  const uint32_t* begin;
  uint64_t triangle_count, begin_count; /* the latter: one more than groups */
} gltf_meshlet_groups;

/* Writes the distance of each point to the nearest triangle, or to any that is no farther than
 * `enough`, and, unless `nearest` is null, that triangle's number. */
GLTF_MESHLET_API int gltf_meshlet_get_distances(const float* points, size_t point_count,
                                                const gltf_meshlet_groups* triangles,
                                                const float* positions, uint64_t vertex_count,
                                                float enough, int32_t threads, float* distances,
                                                uint32_t* nearest);

/* Writes, for each of `count` points and triangles of three corners each, three weights of the
 * corners: of the nearest point of the triangle. */
GLTF_MESHLET_API int gltf_meshlet_get_nearest_weights(const double* points, const double* corners,
                                                      size_t count, double* weights);

#ifdef __cplusplus
}
#endif
#endif
