/* memory VIEW PACKED: each allocation of the functions that decode fails once. They must say so, and
 * lose nothing. C99. */
#include <gltf_meshlet.h>
#include <stdio.h>
#include <stdlib.h>

static long calls, fails_at = -1, held;

static void* allocate(void* user, size_t bytes) {
  (void)user;
  if (calls++ == fails_at) return NULL;
  held++;
  return malloc(bytes);
}

static void release(void* user, void* memory) {
  (void)user;
  held--;
  free(memory);
}

static uint8_t view_bytes[1 << 22], packed_bytes[1 << 22], unpacked[1 << 22];
static uint32_t triangles[1 << 20], values[GLTF_MESHLET_STREAMS][1 << 18], begins[2][1 << 16];

static size_t read(const char* name, uint8_t* bytes) {
  FILE* file = fopen(name, "rb");
  size_t size = 0;
  if (file) {
    size = fread(bytes, 1, 1 << 22, file);
    fclose(file);
  }
  return size;
}

/* Returns the status of the first function that fails. */
static int use(const gltf_meshlet_view* view, gltf_meshlet_scratch* scratch) {
  gltf_meshlet_counts counts = {0};
  gltf_meshlet_arrays arrays = {0};
  gltf_meshlet_meshlet_arrays meshlets = {0};
  void* all[GLTF_MESHLET_STREAMS];
  uint32_t last;
  int status;
  for (int s = 0; s < GLTF_MESHLET_STREAMS; s++) all[s] = values[s];
  counts.size = sizeof counts;
  if ((status = gltf_meshlet_get_counts(view, &counts))) return status;
  arrays.size = sizeof arrays;
  arrays.triangle_room = (1 << 20) / 3;
  arrays.vertex_room = 1 << 16;
  arrays.triangles = triangles;
  arrays.values = all;
  if ((status = gltf_meshlet_validate(view, 1))) return status;
  if ((status = gltf_meshlet_decode(view, 1, &arrays))) return status;
  if ((status = gltf_meshlet_get_begins(view, 1, begins[0], begins[1], 1 << 16))) return status;
  last = (uint32_t)counts.meshlets - 1;
  if ((status = gltf_meshlet_decode_range(view, scratch, last, 1, &arrays, NULL))) return status;
  arrays.triangle_begins = begins[0];
  arrays.vertex_begins = begins[1];
  if ((status = gltf_meshlet_decode_range(view, scratch, last, 1, &arrays, NULL))) return status;
  meshlets.size = sizeof meshlets;
  return gltf_meshlet_decode_meshlets(view, scratch, &last, 1, &meshlets);
}

/* The worked example of EXT_meshlet_lod. */
static const uint32_t tables[34] = {
    0x78,       0,          0x30,       0x32,       0xa0,       1,          0x60,
    0x62,       0x41c00000, 0x3f000000, 0x3f000000, 0x41c80000, 0x7f800000, 0,
    0,          0x02020000, 0x41400000, 0x3f000000, 0x3f000000, 0x41500000, 0x3f800000,
    2,          1,          0x00010000, 0x42100000, 0x3f000000, 0x3f000000, 0x41500000,
    0x3f800000, 2,          1,          0x00010001, 0x01000001, 0x01000002};

/* Opens levels and makes a cut, which takes no memory. */
static int use_levels(void) {
  gltf_meshlet_tables given = {0};
  gltf_meshlet_levels* levels;
  gltf_meshlet_cut cut = {0};
  uint8_t active[3];
  long before;
  int status;
  given.size = sizeof given;
  given.page_count = 2;
  given.coarse_page_count = 1;
  given.group_count = 3;
  given.run_count = 2;
  given.bytes = tables;
  given.byte_count = sizeof tables;
  if ((status = gltf_meshlet_open_levels(&given, &levels))) return status;
  cut.size = sizeof cut;
  cut.eye[0] = 12;
  cut.eye[1] = 0.5;
  cut.eye[2] = 20.5;
  cut.pixels_per_unit = 1000;
  cut.threshold = 60;
  cut.active = active;
  before = calls;
  status = gltf_meshlet_make_cut(levels, &cut);
  if (!status && (calls != before || cut.draw_count != 2 || !active[1] || active[2])) status = -1;
  gltf_meshlet_close(levels);
  return status;
}

static int unpack_pages(gltf_meshlet_scratch* scratch, size_t packed_size) {
  static gltf_meshlet_packed_page pages[64];
  size_t count = 0;
  int status = gltf_meshlet_get_packed_pages(packed_bytes, packed_size, packed_size, pages, 64,
                                             &count);
  for (size_t i = 0; !status && i < count; i++)
    status = gltf_meshlet_unpack_page(scratch, packed_bytes + pages[i].offset,
                                      pages[i].stored_bytes, unpacked, pages[i].page_bytes);
  return status;
}

static int run(size_t view_size, size_t packed_size) {
  gltf_meshlet_view* view = NULL;
  gltf_meshlet_scratch* scratch = NULL;
  size_t bytes;
  int status = gltf_meshlet_open(view_bytes, view_size, &view);
  if (!status) status = gltf_meshlet_open_scratch(&scratch);
  if (!status) status = use(view, scratch);
  if (!status) status = gltf_meshlet_get_unpacked_bytes(packed_bytes, packed_size, &bytes);
  if (!status)
    status = gltf_meshlet_unpack(packed_bytes, packed_size, 1, unpacked, sizeof unpacked);
  if (!status) status = unpack_pages(scratch, packed_size);
  if (!status) status = use_levels();
  gltf_meshlet_close(scratch);
  gltf_meshlet_close(view);
  return status;
}

int main(int argc, char** argv) {
  const size_t view_size = argc > 1 ? read(argv[1], view_bytes) : 0,
               packed_size = argc > 2 ? read(argv[2], packed_bytes) : 0;
  gltf_meshlet_allocator allocator = {0};
  long all;
  allocator.size = sizeof allocator;
  allocator.allocate = allocate;
  allocator.release = release;
  if (gltf_meshlet_set_allocator(&allocator)) return 1;
  if (run(view_size, packed_size)) {
    fprintf(stderr, "%s\n", gltf_meshlet_error());
    return 1;
  }
  all = calls;
  for (fails_at = 0; fails_at < all; fails_at++) {
    calls = 0;
    if (run(view_size, packed_size) != GLTF_MESHLET_MEMORY || held != 0) {
      fprintf(stderr, "allocation %ld: %s, %ld blocks are held\n", fails_at, gltf_meshlet_error(),
              held);
      return 1;
    }
  }
  printf("%ld allocations failed\n", all);
  return 0;
}
