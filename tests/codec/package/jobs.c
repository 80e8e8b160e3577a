/* jobs FILE...: decodes each view on four threads that share it and take ranges from a queue, in two
 * ways: straight into the arrays of the whole view, and each range into arrays of its own. Fails
 * unless both give what gltf_meshlet_decode gives. C11 with POSIX threads. */
#include <gltf_meshlet.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 4, RANGE = 3 };

typedef struct {
  uint64_t first, count;
} range;

typedef struct {
  const gltf_meshlet_view* view;
  gltf_meshlet_counts counts;
  gltf_meshlet_arrays whole, parts; /* of gltf_meshlet_decode, and of the jobs */
  uint32_t elements[GLTF_MESHLET_STREAMS];
  range* ranges; /* within blobs */
  size_t range_count, next;
  pthread_mutex_t mutex; /* of next */
} queue;

static void check(int status) {
  if (status == GLTF_MESHLET_OK) return;
  fprintf(stderr, "%s\n", gltf_meshlet_error());
  exit(1);
}

static void require(int holds, const char* what) {
  if (holds) return;
  fprintf(stderr, "%s\n", what);
  exit(1);
}

static void* room(size_t bytes) {
  void* memory = malloc(bytes + 1);
  require(memory != NULL, "out of memory");
  return memory;
}

static gltf_meshlet_arrays new_arrays(const queue* q, uint64_t triangles, uint64_t vertices) {
  gltf_meshlet_arrays arrays = {0};
  uint32_t** integers = room(q->counts.streams * sizeof *integers);
  arrays.size = sizeof arrays;
  arrays.triangle_room = triangles;
  arrays.vertex_room = vertices;
  arrays.triangles = room(12 * (size_t)triangles);
  for (uint32_t s = 0; s < q->counts.streams; s++)
    integers[s] = room(4 * (size_t)vertices * q->elements[s]);
  arrays.integers = integers;
  return arrays;
}

static void free_arrays(const queue* q, gltf_meshlet_arrays* arrays) {
  for (uint32_t s = 0; s < q->counts.streams; s++) free(arrays->integers[s]);
  free((void*)(size_t)arrays->integers);
  free(arrays->triangles);
}

/* The corners of a range that was decoded alone have the integers that they have in the view. */
static void compare(const queue* q, uint64_t first, const gltf_meshlet_arrays* part,
                    const uint32_t* sizes) {
  const uint32_t* there = q->whole.triangles + 3 * (size_t)q->parts.triangle_begins[first];
  for (uint32_t i = 0; i < 3 * sizes[0]; i++) {
    require(part->triangles[i] < sizes[1], "a range names a vertex that it does not have");
    for (uint32_t s = 0; s < q->counts.streams; s++) {
      const uint32_t n = q->elements[s];
      require(!memcmp(part->integers[s] + n * part->triangles[i], q->whole.integers[s] + n * there[i],
                      4 * n),
              "a range has other integers");
    }
  }
}

/* The next range that nobody has taken, or null. */
static const range* take(queue* q) {
  size_t i;
  pthread_mutex_lock(&q->mutex);
  i = q->next++;
  pthread_mutex_unlock(&q->mutex);
  return i < q->range_count ? &q->ranges[i] : NULL;
}

static void* work(void* argument) {
  queue* q = argument;
  gltf_meshlet_scratch* scratch;
  gltf_meshlet_arrays own = new_arrays(q, 64 * RANGE, 64 * RANGE);
  const range* r;
  check(gltf_meshlet_open_scratch(&scratch));
  while ((r = take(q))) {
    uint32_t sizes[2];
    check(gltf_meshlet_decode_range(q->view, scratch, r->first, r->count, &q->parts, NULL));
    check(gltf_meshlet_decode_range(q->view, scratch, r->first, r->count, &own, sizes));
    compare(q, r->first, &own, sizes);
  }
  check(gltf_meshlet_close(scratch));
  free_arrays(q, &own);
  return NULL;
}

static void run(queue* q) {
  pthread_t threads[THREADS];
  const size_t meshlets = (size_t)q->counts.meshlets;
  uint32_t *triangles = room(4 * meshlets + 4), *vertices = room(4 * meshlets + 4);
  check(gltf_meshlet_get_begins(q->view, 1, triangles, vertices, meshlets + 1));
  q->whole = new_arrays(q, q->counts.triangles, q->counts.vertices);
  q->parts = new_arrays(q, q->counts.triangles, q->counts.vertices);
  q->parts.triangle_begins = triangles;
  q->parts.vertex_begins = vertices;
  check(gltf_meshlet_decode(q->view, 1, &q->whole));
  pthread_mutex_init(&q->mutex, NULL);
  for (int t = 0; t < THREADS; t++)
    require(!pthread_create(&threads[t], NULL, work, q), "no thread");
  for (int t = 0; t < THREADS; t++) pthread_join(threads[t], NULL);
  require(!memcmp(q->whole.triangles, q->parts.triangles, 12 * (size_t)q->counts.triangles),
          "the ranges have other triangles");
  for (uint32_t s = 0; s < q->counts.streams; s++)
    require(!memcmp(q->whole.integers[s], q->parts.integers[s],
                    4 * (size_t)q->counts.vertices * q->elements[s]),
            "the ranges have other vertices");
  free_arrays(q, &q->whole);
  free_arrays(q, &q->parts);
  free(triangles);
  free(vertices);
}

static void list_ranges(queue* q, uint32_t number) {
  gltf_meshlet_page blob = {0};
  blob.size = sizeof blob;
  check(gltf_meshlet_get_page(q->view, number, &blob));
  for (uint64_t m = 0; m < blob.meshlets; m += RANGE) {
    range* r = &q->ranges[q->range_count++];
    r->first = blob.first_meshlet + m;
    r->count = blob.meshlets - m < RANGE ? blob.meshlets - m : RANGE;
  }
}

static void decode(const char* name) {
  static uint8_t bytes[1 << 24];
  queue q = {0};
  gltf_meshlet_view* view;
  FILE* file = fopen(name, "rb");
  require(file != NULL, "cannot open a file");
  const size_t size = fread(bytes, 1, sizeof bytes, file);
  fclose(file);
  check(gltf_meshlet_open(bytes, size, &view));
  q.view = view;
  q.counts.size = sizeof q.counts;
  check(gltf_meshlet_get_counts(view, &q.counts));
  q.ranges = room((size_t)q.counts.meshlets * sizeof *q.ranges);
  for (uint32_t b = 0; b < q.counts.pages; b++) list_ranges(&q, b);
  for (uint32_t s = 0; s < q.counts.streams; s++) {
    gltf_meshlet_stream stream;
    check(gltf_meshlet_get_stream(view, 0, s, &stream));
    q.elements[s] = stream.elements;
  }
  run(&q);
  free(q.ranges);
  check(gltf_meshlet_close(view));
}

int main(int argc, char** argv) {
  for (int i = 1; i < argc; i++) decode(argv[i]);
  return 0;
}
