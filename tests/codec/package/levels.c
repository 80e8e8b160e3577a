/* levels OUT: what levels of detail are built with, on a generated mesh: encodes it, groups it, makes
 * meshlets in groups, simplifies them and measures the distance. OUT: records as files.c writes them,
 * for comparison between platforms. C11 without extensions; the library contains meshoptimizer. */
#include <gltf_meshlet_internal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t meshopt_simplifyWithAttributes(uint32_t* out, const uint32_t* corners, size_t corner_count,
                                      const float* positions, size_t vertices, size_t stride,
                                      const float* attributes, size_t attribute_stride,
                                      const float* weights, size_t attribute_count,
                                      const uint8_t* locked, size_t target, float limit,
                                      uint32_t options, float* error);
size_t meshopt_partitionClusters(uint32_t* groups, const uint32_t* corners, size_t corner_count,
                                 const uint32_t* counts, size_t clusters, size_t vertices,
                                 size_t size);

enum {
  SIDE = 96,
  ROW = SIDE + 1,
  VERTICES = ROW * ROW,
  TRIANGLES = 2 * SIDE * SIDE,
  GROUPS = 6,
  GROUP = TRIANGLES / GROUPS
};
static uint32_t triangles[3 * TRIANGLES], ids[VERTICES], grid[3 * VERTICES], colours[2 * VERTICES];
static float positions[3 * VERTICES], bent[3 * VERTICES], colour_floats[2 * VERTICES];

static FILE* out;

static void put(const char* key, const void* data, size_t size) {
  fprintf(out, "%s %lu\n", key, (unsigned long)size);
  fwrite(data, 1, size, out);
}

static void check(int status) {
  if (status == GLTF_MESHLET_OK) return;
  fprintf(stderr, "%s\n", gltf_meshlet_error());
  exit(1);
}

/* Writes `count` arrays of a result. */
static void put_arrays(const char* key, gltf_meshlet_result* result, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) {
    const void* items;
    size_t bytes;
    check(gltf_meshlet_get_array(result, i, &items, &bytes));
    put(key, items, bytes);
  }
}

/* A rough height field. Its steps are no powers of two: sums and products round. */
static void make_mesh(void) {
  const uint32_t corner[6] = {0, 1, ROW, 1, ROW + 1, ROW};
  for (uint32_t v = 0, random = 1; v < VERTICES; v++) {
    const uint32_t x = v % ROW, y = v / ROW;
    random = random * 1664525u + 1013904223u;
    ids[v] = v;
    grid[3 * v] = 8 * x + (random >> 30);
    grid[3 * v + 1] = 8 * y + (random >> 28 & 3);
    grid[3 * v + 2] = (x * x + x * y / 2) / 16 % 512 + (random >> 26 & 3);
    for (int k = 0; k < 3; k++) positions[3 * v + k] = 0.37f * (float)grid[3 * v + k] - 11.3f;
    for (int k = 0; k < 3; k++) bent[3 * v + k] = positions[3 * v + k] * 1.1f + 0.01f * (float)x;
    for (int k = 0; k < 2; k++) colours[2 * v + k] = (k ? x : y) * 5 + (random >> 27 & 1);
    for (int k = 0; k < 2; k++) colour_floats[2 * v + k] = (float)colours[2 * v + k] / 511.0f;
  }
  for (uint32_t q = 0; q < SIDE * SIDE; q++)
    for (int k = 0; k < 6; k++)
      triangles[6 * q + k] = q / SIDE * ROW + q % SIDE + corner[k];
}

static void encode(gltf_meshlet_mesh* mesh) {
  gltf_meshlet_stream streams[2] = {{0}, {0}};
  const uint32_t* values[2] = {grid, colours};
  streams[0].kind = GLTF_MESHLET_GRID;
  streams[0].elements = 3;
  streams[0].bits = 10;
  streams[0].step = 0.37f;
  streams[1].kind = GLTF_MESHLET_INTEGER;
  streams[1].elements = 2;
  streams[1].bits = 9;
  streams[1].step = 1;
  streams[0].predictor = streams[1].predictor = GLTF_MESHLET_CHOOSE_PREDICTOR;
  mesh->streams = streams;
  mesh->values = values;
  mesh->stream_count = 2;
  for (uint32_t effort = 0; effort < 2; effort++) {
    gltf_meshlet_options options = {0};
    gltf_meshlet_result *result, *packed;
    const void* view;
    size_t bytes;
    options.size = sizeof options;
    options.effort = effort;
    options.page_bytes = 20000 * effort;
    check(gltf_meshlet_encode(mesh, &options, &result));
    put_arrays("encoded", result, 1);
    check(gltf_meshlet_get_array(result, 0, &view, &bytes));
    check(gltf_meshlet_pack(view, bytes, 0, &packed));
    put_arrays("packed", packed, 1);
    gltf_meshlet_close(packed);
    gltf_meshlet_close(result);
  }
}

/* Meshlets that do not cross groups, and groups of those. */
static void generate(const gltf_meshlet_mesh* mesh, const gltf_meshlet_groups* groups) {
  static uint32_t corners[3 * TRIANGLES], counts[TRIANGLES], partition[TRIANGLES];
  gltf_meshlet_result* result;
  const void *order, *disks, *meshlets;
  size_t bytes, clusters;
  check(gltf_meshlet_generate(mesh, groups, NULL, &result));
  put_arrays("generated", result, 4);
  check(gltf_meshlet_get_array(result, 0, &order, &bytes));
  check(gltf_meshlet_get_array(result, 1, &disks, &bytes));
  check(gltf_meshlet_get_array(result, 2, &meshlets, &bytes));
  clusters = bytes / 4 - 1;
  for (size_t i = 0; i < TRIANGLES; i++)
    memcpy(corners + 3 * i, triangles + 3 * ((const uint32_t*)order)[i], 12);
  for (size_t i = 0; i < clusters; i++) {
    const uint32_t* begin = (const uint32_t*)meshlets + i;
    counts[i] = 3 * (((const uint32_t*)disks)[begin[1]] - ((const uint32_t*)disks)[begin[0]]);
  }
  meshopt_partitionClusters(partition, corners, 3 * TRIANGLES, counts, clusters, VERTICES, 16);
  put("partition", partition, 4 * clusters);
  gltf_meshlet_close(result);
}

/* Halves each group with its border locked, and measures its distance to the original. */
static void simplify(const gltf_meshlet_groups* before) {
  static uint32_t simpler[3 * TRIANGLES];
  static uint8_t locked[VERTICES];
  const float weights[2] = {0.5f, 0.25f};
  const float* shapes[2] = {positions, bent};
  uint32_t begin[GROUPS + 1] = {0}, none[GROUPS + 1] = {0}, chosen[GROUPS];
  gltf_meshlet_groups after = {0};
  gltf_meshlet_samples carried = {0};
  gltf_meshlet_surface* surface;
  gltf_meshlet_result* result;
  for (uint32_t v = 0; v < VERTICES; v++) locked[v] = v / ROW % (SIDE / GROUPS) == 0;
  for (uint32_t g = 0; g < GROUPS; g++) {
    float error = 0;
    const size_t corners = meshopt_simplifyWithAttributes(
        simpler + 3 * begin[g], triangles + 3 * GROUP * g, 3 * GROUP, positions, VERTICES, 12,
        colour_floats, 8, weights, 2, locked, 3 * GROUP / 2, 1e30f, 2 | 4, &error);
    chosen[g] = g;
    begin[g + 1] = begin[g] + (uint32_t)corners / 3;
    put("error", &error, sizeof error);
  }
  put("simpler", simpler, 12 * (size_t)begin[GROUPS]);
  after.size = sizeof after;
  after.triangles = simpler;
  after.begin = begin;
  after.triangle_count = begin[GROUPS];
  after.begin_count = GROUPS + 1;
  carried.size = sizeof carried;
  carried.begin = none;
  check(gltf_meshlet_open_surface(shapes, 2, VERTICES, before, 0.25f, 2, &surface));
  check(gltf_meshlet_measure(surface, before, &after, chosen, GROUPS, &carried, 2, &result));
  put_arrays("measured", result, 5);
  gltf_meshlet_close(result);
  gltf_meshlet_close(surface);
}

int main(int argc, char** argv) {
  static uint32_t begin[GROUPS + 1], order[VERTICES];
  gltf_meshlet_mesh mesh = {0};
  gltf_meshlet_groups groups = {0};
  if (argc != 2 || !(out = fopen(argv[1], "wb"))) return 2;
  make_mesh();
  for (uint32_t g = 0; g <= GROUPS; g++) begin[g] = g * GROUP;
  mesh.size = sizeof mesh;
  mesh.triangles = triangles;
  mesh.triangle_count = TRIANGLES;
  mesh.vertex_count = VERTICES;
  mesh.position_ids = ids;
  mesh.positions = positions;
  groups.size = sizeof groups;
  groups.triangles = triangles;
  groups.begin = begin;
  groups.triangle_count = TRIANGLES;
  groups.begin_count = GROUPS + 1;
  encode(&mesh);
  check(gltf_meshlet_sort_points(positions, VERTICES, order));
  put("order", order, sizeof order);
  generate(&mesh, &groups);
  simplify(&groups);
  return fclose(out);
}
