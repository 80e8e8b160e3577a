/* files LIST OUT: everything that the C interface says about each file of a list, for comparison
 * with the expected values and between platforms. C11 without extensions. OUT: records, a line
 * "KEY SIZE" and SIZE bytes each. With GLTF_MESHLET_DECODER_ONLY, nothing is encoded. */
#include <gltf_meshlet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void* room(size_t bytes) {
  void* memory = calloc(bytes ? bytes : 1, 1);
  if (!memory) {
    fprintf(stderr, "out of memory\n");
    exit(2);
  }
  return memory;
}

static FILE* open_file(const char* name, const char* mode) {
  FILE* file = fopen(name, mode);
  if (!file) {
    fprintf(stderr, "cannot open %s\n", name);
    exit(2);
  }
  return file;
}

static uint8_t* read_file(const char* name, size_t* size) {
  FILE* file = open_file(name, "rb");
  uint8_t* bytes;
  fseek(file, 0, SEEK_END);
  *size = (size_t)ftell(file);
  rewind(file);
  bytes = room(*size);
  if (fread(bytes, 1, *size, file) != *size) exit(2);
  fclose(file);
  return bytes;
}

static void put(FILE* out, const char* key, const void* data, size_t size) {
  fprintf(out, "%s %lu\n", key, (unsigned long)size);
  fwrite(data, 1, size, out);
}

/* Notes the status and its sentence. Returns 1 if the call succeeded. */
static int succeeded(FILE* out, const char* key, int status) {
  const char* sentence = status ? gltf_meshlet_error() : "";
  put(out, key, sentence, strlen(sentence));
  return status == GLTF_MESHLET_OK;
}

/* A whole view, decoded. */
typedef struct {
  gltf_meshlet_counts counts;
  gltf_meshlet_stream streams[GLTF_MESHLET_STREAMS];
  uint32_t elements; /* of all streams */
  uint32_t* triangles;
  uint32_t* integers[GLTF_MESHLET_STREAMS];
  void* values[GLTF_MESHLET_STREAMS];
} model;

static void allocate(gltf_meshlet_view* view, model* m) {
  const uint64_t vertices = m->counts.vertices;
  m->triangles = room(12 * (size_t)m->counts.triangles);
  for (uint32_t s = 0; s < m->counts.streams; s++) {
    gltf_meshlet_get_stream(view, 0, s, &m->streams[s]);
    m->elements += m->streams[s].elements;
    m->integers[s] = room(4 * (size_t)vertices * m->streams[s].elements);
    m->values[s] = room(4 * (size_t)vertices * GLTF_MESHLET_ELEMENTS);
  }
}

static void release(model* m) {
  for (uint32_t s = 0; s < m->counts.streams; s++) {
    free(m->integers[s]);
    free(m->values[s]);
  }
  free(m->triangles);
}

static int decode_whole(FILE* out, gltf_meshlet_view* view, model* m) {
  gltf_meshlet_arrays arrays = {0};
  arrays.size = sizeof arrays;
  arrays.triangle_room = m->counts.triangles;
  arrays.vertex_room = m->counts.vertices;
  arrays.triangles = m->triangles;
  arrays.integers = m->integers;
  arrays.values = m->values;
  if (!succeeded(out, "decode", gltf_meshlet_decode(view, 2, &arrays))) return 0;
  put(out, "triangles", m->triangles, 12 * (size_t)m->counts.triangles);
  for (uint32_t s = 0; s < m->counts.streams; s++) {
    const gltf_meshlet_stream* stream = &m->streams[s];
    const size_t numbers = stream->kind == GLTF_MESHLET_OCT ? 3 : stream->elements;
    put(out, "integers", m->integers[s], 4 * (size_t)m->counts.vertices * stream->elements);
    put(out, "values", m->values[s], 4 * (size_t)m->counts.vertices * numbers);
  }
  return 1;
}

static void decode_each(FILE* out, gltf_meshlet_view* view, const model* m) {
  uint32_t* integers = room(4 * (size_t)GLTF_MESHLET_VERTICES * m->elements);
  for (uint32_t i = 0; i < m->counts.meshlets; i++) {
    uint8_t local[3 * GLTF_MESHLET_TRIANGLES];
    uint32_t sizes[2];
    gltf_meshlet_meshlet_arrays arrays = {0};
    arrays.size = sizeof arrays;
    arrays.sizes = sizes;
    arrays.triangles = local;
    arrays.integers = integers;
    const int status = gltf_meshlet_decode_meshlets(view, NULL, &i, 1, &arrays);
    if (!succeeded(out, "meshlet", status)) continue;
    put(out, "sizes", sizes, sizeof sizes);
    put(out, "local", local, 3 * (size_t)sizes[0]);
  }
  free(integers);
}

#ifndef GLTF_MESHLET_DECODER_ONLY
static void encode(FILE* out, const model* m, uint32_t effort, uint64_t page_bytes) {
  gltf_meshlet_mesh mesh = {0};
  gltf_meshlet_options options = {0};
  gltf_meshlet_result* result;
  const void* bytes;
  size_t size;
  mesh.size = sizeof mesh;
  mesh.stream_count = m->counts.streams;
  mesh.triangles = m->triangles;
  mesh.triangle_count = m->counts.triangles;
  mesh.vertex_count = m->counts.vertices;
  mesh.positions = m->values[0];
  mesh.streams = m->streams;
  mesh.values = (const uint32_t* const*)m->integers;
  options.size = sizeof options;
  options.effort = effort;
  options.page_bytes = page_bytes;
  options.threads = 2;
  if (succeeded(out, "encode", gltf_meshlet_encode(&mesh, &options, &result))) {
    gltf_meshlet_get_array(result, 0, &bytes, &size);
    put(out, "encoded", bytes, size);
    gltf_meshlet_close(result);
  }
}
#endif

static void note(FILE* out, const uint8_t* bytes, size_t size) {
  gltf_meshlet_view* view;
  model m = {0};
  if (!succeeded(out, "open", gltf_meshlet_open(bytes, size, &view))) return;
  m.counts.size = sizeof m.counts;
  gltf_meshlet_get_counts(view, &m.counts);
  if (succeeded(out, "validate", gltf_meshlet_validate(view, 2)) || !m.counts.suspicious) {
    allocate(view, &m);
    if (decode_whole(out, view, &m)) {
#ifndef GLTF_MESHLET_DECODER_ONLY
      if (m.streams[0].kind == GLTF_MESHLET_GRID && m.streams[0].elements == 3) {
        encode(out, &m, GLTF_MESHLET_EFFORT_NORMAL, 0);
        encode(out, &m, GLTF_MESHLET_EFFORT_FAST, 4096);
      }
#endif
    }
    decode_each(out, view, &m);
    release(&m);
  }
  gltf_meshlet_close(view);
}

int main(int argc, char** argv) {
  char name[1024];
  if (argc != 3) return 2;
  FILE *list = open_file(argv[1], "r"), *out = open_file(argv[2], "wb");
  while (fgets(name, sizeof name, list)) {
    size_t size;
    name[strcspn(name, "\r\n")] = 0;
    uint8_t* bytes = read_file(name, &size);
    const char* base = strrchr(name, '/') ? strrchr(name, '/') + 1 : name;
    put(out, "file", base, strlen(base));
    note(out, bytes, size);
    free(bytes);
  }
  fclose(list);
  return fclose(out);
}
