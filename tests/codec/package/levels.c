/* levels OUT: encodes a generated mesh, packs it, and builds its levels of detail. OUT: records as
 * files.c writes them, for comparison between platforms. C11 without extensions; the library contains
 * meshoptimizer. */
#include <gltf_meshlet_internal.h>
#include <stdio.h>
#include <stdlib.h>

/* Only their addresses are needed. */
void meshopt_simplifyWithAttributes(void);
void meshopt_simplifyGuarded(void);
void meshopt_partitionClusters(void);

enum {
  SIDE = 96,
  ROW = SIDE + 1,
  VERTICES = ROW * ROW,
  TRIANGLES = 2 * SIDE * SIDE
};
static uint32_t triangles[3 * TRIANGLES], ids[VERTICES], grid[3 * VERTICES], colours[2 * VERTICES];
static float positions[3 * VERTICES], cells[3 * VERTICES], bent[3 * VERTICES];
static float normals[3 * VERTICES], colour_floats[2 * VERTICES];

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
    for (int k = 0; k < 3; k++) cells[3 * v + k] = (float)grid[3 * v + k];
    for (int k = 0; k < 3; k++) bent[3 * v + k] = cells[3 * v + k] * 1.1f + 0.01f * (float)x;
    normals[3 * v + 2] = 1;
    for (int k = 0; k < 2; k++) colours[2 * v + k] = (k ? x : y) * 5 + (random >> 27 & 1);
    for (int k = 0; k < 2; k++) colour_floats[2 * v + k] = (float)colours[2 * v + k] / 511.0f;
  }
  for (uint32_t q = 0; q < SIDE * SIDE; q++)
    for (int k = 0; k < 6; k++)
      triangles[6 * q + k] = q / SIDE * ROW + q % SIDE + corner[k];
}

static void add_streams(gltf_meshlet_mesh* mesh) {
  static gltf_meshlet_stream streams[2];
  static const uint32_t* values[2] = {grid, colours};
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
}

static void encode(const gltf_meshlet_mesh* mesh) {
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

/* Levels with and without the guard, in a whole primitive. */
static void build_levels(gltf_meshlet_mesh* mesh) {
  const float weights[2] = {0.5f, 0.25f};
  const float* shapes[1] = {bent};
  for (int is_guarded = 0; is_guarded < 2; is_guarded++) {
    gltf_meshlet_simplifier simplifier = {0};
    gltf_meshlet_levels_input input = {0};
    gltf_meshlet_options options = {0};
    gltf_meshlet_result* result;
    simplifier.size = sizeof simplifier;
    simplifier.simplify = meshopt_simplifyWithAttributes;
    simplifier.simplify_guarded = is_guarded ? meshopt_simplifyGuarded : NULL;
    simplifier.partition = meshopt_partitionClusters;
    mesh->positions = cells;
    input.size = sizeof input;
    input.mesh = mesh;
    input.source_position_ids = input.canonical_vertices = input.places = ids;
    input.seam_points = cells;
    input.shapes = shapes;
    input.shape_count = 1;
    input.attributes = input.others = colour_floats;
    input.weights = weights;
    input.attribute_count = input.other_count = 2;
    input.normals = normals;
    input.group_size = 24;
    input.chunk = GLTF_MESHLET_ALL_LEVELS;
    input.reduction = 5;
    input.error_limit = 1e30;
    input.simplifier = &simplifier;
    options.size = sizeof options;
    options.threads = 2;
    options.page_bytes = 20000;
    check(gltf_meshlet_build_levels(&input, &options, NULL, &result));
    put_arrays("levels", result, 17);
    gltf_meshlet_close(result);
  }
}

int main(int argc, char** argv) {
  gltf_meshlet_mesh mesh = {0};
  if (argc != 2 || !(out = fopen(argv[1], "wb"))) return 2;
  make_mesh();
  mesh.size = sizeof mesh;
  mesh.triangles = triangles;
  mesh.triangle_count = TRIANGLES;
  mesh.vertex_count = VERTICES;
  mesh.position_ids = ids;
  mesh.positions = positions;
  add_streams(&mesh);
  encode(&mesh);
  build_levels(&mesh);
  return fclose(out);
}
