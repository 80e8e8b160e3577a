/* formats FILE...: decodes each view to every vertex format, on several threads, in ranges and by
 * single meshlets, and compares with gltf_meshlet_decode's floats and integers; checks the bounds of
 * meshlets. C99. */
#include <gltf_meshlet.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GAP = 3, FILL = 0xA5 };

static const size_t bytes_of[9] = {4, 2, 1, 1, 2, 2, 1, 2, 4};
static const double scale_of[6] = {0, 0, 127, 255, 32767, 65535};

typedef struct {
  gltf_meshlet_view* view;
  gltf_meshlet_counts counts;
  gltf_meshlet_stream streams[GLTF_MESHLET_STREAMS];
  uint32_t *triangles, *begins[2];
  uint32_t* integers[GLTF_MESHLET_STREAMS];
  void* values[GLTF_MESHLET_STREAMS];
  gltf_meshlet_bounds* bounds; /* or null */
} model;

static void require(int holds, const char* what) {
  if (holds) return;
  fprintf(stderr, "%s\n", what);
  exit(1);
}

static void check(int status) { require(status == GLTF_MESHLET_OK, gltf_meshlet_error()); }

static void* room(size_t bytes) {
  void* memory = malloc(bytes + 16);
  require(memory != NULL, "out of memory");
  memset(memory, FILL, bytes + 16);
  return memory;
}

static double half(uint32_t bits) {
  const int exponent = (int)(bits >> 10 & 31);
  const double mantissa = (double)(bits & 1023);
  const double size = exponent == 0    ? ldexp(mantissa, -24)
                      : exponent == 31 ? HUGE_VAL
                                       : ldexp(1024 + mantissa, exponent - 25);
  return bits >> 15 ? -size : size;
}

/* Is it the nearest half, the even one of two? */
static int is_nearest_half(uint32_t bits, double value) {
  const double error = fabs(half(bits) - value);
  const uint32_t size = bits & 0x7FFF, sign = bits & 0x8000;
  if (value != value) return size > 0x7C00;
  if (size == 0x7C00) return fabs(value) >= 65520;
  if (size == 0x7BFF && fabs(value) >= 65520) return 0;
  for (int step = -1; step <= 1; step += 2) {
    const uint32_t other = size + (uint32_t)step;
    double distance;
    if (other >= 0x7C00) continue;
    distance = fabs(half(sign | other) - value);
    if (distance < error || (distance == error && size & 1)) return 0;
  }
  return 1;
}

static uint32_t load(const uint8_t* at, size_t bytes) {
  uint32_t x = 0;
  memcpy(&x, at, bytes);
  return x;
}

static int is_right(uint32_t format, const uint8_t* at, double value, uint32_t integer) {
  const uint32_t word = load(at, bytes_of[format]);
  double low, wanted;
  float real;
  if (format >= GLTF_MESHLET_U8) return word == integer;
  if (format == GLTF_MESHLET_F32) {
    memcpy(&real, at, 4);
    return (double)real == value || value != value;
  }
  if (format == GLTF_MESHLET_F16) return is_nearest_half(word, value);
  low = format == GLTF_MESHLET_SNORM8 || format == GLTF_MESHLET_SNORM16 ? -1 : 0;
  wanted = !(value > low) ? low : value > 1 ? 1 : value;
  {
    const double got = low == 0                  ? (double)word
                       : bytes_of[format] == 1 ? (double)(int8_t)word
                                               : (double)(int16_t)word;
    return fabs(got - wanted * scale_of[format]) <= 0.5; /* exact in double */
  }
}

static uint32_t components_of(const gltf_meshlet_stream* s, uint32_t format) {
  return s->kind == GLTF_MESHLET_OCT && format < GLTF_MESHLET_U8 ? 3 : s->elements;
}

/* Compares the vertices [first, first + count) of the view with those at `row` of an attribute. */
static void compare(const model* m, const gltf_meshlet_attribute* a, size_t first, size_t count,
                    size_t row) {
  const gltf_meshlet_stream* s = &m->streams[a->stream];
  const uint32_t components = components_of(s, a->format);
  for (size_t v = 0; v < count; v++) {
    const uint8_t* at = (const uint8_t*)a->data + a->stride * (row + v);
    for (uint32_t c = 0; c < components; c++) {
      const size_t i = (first + v) * components + c;
      double value = 0;
      uint32_t integer = 0;
      if (a->format >= GLTF_MESHLET_U8)
        integer = m->integers[a->stream][i];
      else if (s->kind == GLTF_MESHLET_INTEGER)
        value = (double)(float)((const uint32_t*)m->values[a->stream])[i];
      else
        value = (double)((const float*)m->values[a->stream])[i];
      require(is_right(a->format, at + c * bytes_of[a->format], value, integer),
              "a component is wrong");
    }
    for (size_t k = components * bytes_of[a->format]; k < a->stride; k++)
      require(at[k] == FILL, "bytes between attributes were written");
  }
}

static gltf_meshlet_attribute attribute_of(const model* m, uint32_t stream, uint32_t format,
                                           size_t vertices) {
  gltf_meshlet_attribute a;
  a.stream = stream;
  a.format = format;
  a.stride = components_of(&m->streams[stream], format) * bytes_of[format] + GAP;
  a.data = room(a.stride * vertices);
  return a;
}

static gltf_meshlet_arrays arrays_of(const model* m) {
  gltf_meshlet_arrays arrays = {0};
  arrays.size = sizeof arrays;
  arrays.triangle_room = m->counts.triangles;
  arrays.vertex_room = m->counts.vertices;
  return arrays;
}

/* Decodes the whole view, and ranges of it, with one attribute. */
static void decode_attribute(const model* m, uint32_t stream, uint32_t format) {
  const size_t vertices = (size_t)m->counts.vertices, corners = 3 * (size_t)m->counts.triangles;
  gltf_meshlet_attribute a = attribute_of(m, stream, format, vertices);
  gltf_meshlet_arrays arrays = arrays_of(m);
  uint16_t* narrow = room(2 * corners);
  gltf_meshlet_bounds* bounds = room(sizeof *bounds * (size_t)m->counts.meshlets);
  const int status_of_narrow = vertices <= 1 << 16 ? GLTF_MESHLET_OK : GLTF_MESHLET_ARGUMENT;
  arrays.triangles_16 = narrow;
  arrays.attributes = &a;
  arrays.attribute_count = 1;
  if (m->bounds) arrays.bounds = bounds;
  for (int32_t way = 1; way <= 3; way++) { /* one thread, two, ranges */
    memset(a.data, FILL, a.stride * vertices);
    if (way == 3) {
      arrays.triangle_begins = m->begins[0];
      arrays.vertex_begins = m->begins[1];
      for (uint32_t b = 0; b < m->counts.pages; b++) {
        gltf_meshlet_page blob = {0};
        blob.size = sizeof blob;
        check(gltf_meshlet_get_page(m->view, b, &blob));
        for (uint64_t i = 0; i < blob.meshlets; i++)
          require(gltf_meshlet_decode_range(m->view, NULL, blob.first_meshlet + i, 1, &arrays,
                                            NULL) == status_of_narrow,
                  gltf_meshlet_error());
      }
    } else {
      require(gltf_meshlet_decode(m->view, way, &arrays) == status_of_narrow, gltf_meshlet_error());
    }
    if (status_of_narrow) continue;
    compare(m, &a, 0, vertices, 0);
    for (size_t i = 0; i < corners; i++)
      require(narrow[i] == m->triangles[i], "triangles of 16 bits differ");
    require(!m->bounds ||
                !memcmp(bounds, m->bounds, sizeof *bounds * (size_t)m->counts.meshlets),
            "bounds differ");
  }
  free(bounds);
  free(narrow);
  free(a.data);
}

/* Decodes all meshlets alone; their corners have the values of the view's. */
static void decode_meshlets(const model* m, uint32_t stream, uint32_t format) {
  const size_t meshlets = (size_t)m->counts.meshlets;
  gltf_meshlet_attribute a = attribute_of(m, stream, format, 64 * meshlets);
  gltf_meshlet_meshlet_arrays arrays = {0};
  uint32_t *numbers = room(4 * meshlets), *sizes = room(8 * meshlets);
  uint8_t* triangles = room(4 * 64 * meshlets);
  gltf_meshlet_bounds* bounds = room(sizeof *bounds * meshlets);
  for (uint32_t i = 0; i < meshlets; i++) numbers[i] = i;
  arrays.size = sizeof arrays;
  arrays.sizes = sizes;
  arrays.triangles = triangles;
  arrays.triangle_bytes = 4;
  arrays.attributes = &a;
  arrays.attribute_count = 1;
  if (m->bounds) arrays.bounds = bounds;
  check(gltf_meshlet_decode_meshlets(m->view, NULL, numbers, meshlets, &arrays));
  for (size_t i = 0; i < meshlets; i++) {
    for (size_t t = 0; t < sizes[2 * i]; t++) {
      const uint8_t* local = triangles + 4 * (64 * i + t);
      require(local[3] == 0, "the fourth byte is not 0");
      for (int k = 0; k < 3; k++) {
        require(local[k] < sizes[2 * i + 1], "a local number is too large");
        compare(m, &a, m->triangles[3 * (m->begins[0][i] + t) + (size_t)k], 1, 64 * i + local[k]);
      }
    }
  }
  require(!m->bounds || !memcmp(bounds, m->bounds, sizeof *bounds * meshlets), "bounds differ");
  free(bounds);
  free(triangles);
  free(sizes);
  free(numbers);
  free(a.data);
}

static double dot(const double* a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The normal, not of length 1, of a triangle of the view, and one of its corners. */
static void normal_of(const model* m, size_t triangle, size_t first, double* corner, double* n) {
  double p[3][3], u[3], w[3];
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) {
      const size_t i = 3 * (size_t)m->triangles[3 * triangle + (first + (size_t)k) % 3] + (size_t)c;
      p[k][c] = m->streams[0].kind == GLTF_MESHLET_INTEGER
                    ? (double)((const uint32_t*)m->values[0])[i]
                    : (double)((const float*)m->values[0])[i];
    }
  for (int c = 0; c < 3; c++) {
    u[c] = p[1][c] - p[0][c];
    w[c] = p[2][c] - p[0][c];
    corner[c] = p[0][c];
  }
  n[0] = u[1] * w[2] - u[2] * w[1];
  n[1] = u[2] * w[0] - u[0] * w[2];
  n[2] = u[0] * w[1] - u[1] * w[0];
}

/* Triangles are inside of their meshlet's sphere; from where the cone says so, all show backs. */
static void check_bounds(const model* m, size_t meshlet) {
  const gltf_meshlet_bounds* b = &m->bounds[meshlet];
  const double centre[3] = {b->centre[0], b->centre[1], b->centre[2]},
               axis[3] = {b->axis[0], b->axis[1], b->axis[2]};
  double farthest = 0;
  if (!(b->radius < HUGE_VALF)) return; /* positions that are not finite */
  for (size_t i = 3 * (size_t)m->begins[0][meshlet]; i < 3 * (size_t)m->begins[0][meshlet + 1];
       i++) {
    double corner[3], n[3], from[3], eye[3];
    normal_of(m, i / 3, i % 3, corner, n);
    for (int c = 0; c < 3; c++) from[c] = corner[c] - centre[c];
    require(sqrt(dot(from, from)) <= (double)b->radius, "a corner is outside of its sphere");
    if (sqrt(dot(from, from)) > farthest) farthest = sqrt(dot(from, from));
    if (b->cutoff >= 1) continue;
    require(dot(n, axis) >= -1e-5 * sqrt(dot(n, n)), "a cone is wider than a half space");
    for (int k = 0; k < 64; k++) { /* eyes behind, near the cone's surface and elsewhere */
      double to[3], length;
      for (int c = 0; c < 3; c++)
        eye[c] = centre[c] + ((k >> (2 * c) & 3) - 1.5) * (double)b->radius * (k % 7 + 1);
      for (int c = 0; c < 3; c++) to[c] = centre[c] - eye[c];
      length = sqrt(dot(to, to));
      if (!(dot(to, axis) >= (double)b->cutoff * length + (double)b->radius)) continue;
      for (int c = 0; c < 3; c++) to[c] = eye[c] - corner[c];
      require(dot(n, to) <= 1e-5 * sqrt(dot(n, n) * dot(to, to)), "a front is culled");
    }
  }
  require((double)b->radius <= 2 * farthest + 1e-30, "a sphere is too large");
}

static void open_model(model* m, const uint8_t* bytes, size_t size) {
  gltf_meshlet_arrays arrays;
  check(gltf_meshlet_open(bytes, size, &m->view));
  m->counts.size = sizeof m->counts;
  check(gltf_meshlet_get_counts(m->view, &m->counts));
  arrays = arrays_of(m);
  for (uint32_t s = 0; s < m->counts.streams; s++) {
    check(gltf_meshlet_get_stream(m->view, 0, s, &m->streams[s]));
    m->integers[s] = room(16 * (size_t)m->counts.vertices);
    m->values[s] = room(16 * (size_t)m->counts.vertices);
  }
  for (int i = 0; i < 2; i++) m->begins[i] = room(4 * (size_t)m->counts.meshlets + 4);
  check(gltf_meshlet_get_begins(m->view, 1, m->begins[0], m->begins[1],
                                (size_t)m->counts.meshlets + 1));
  m->triangles = room(12 * (size_t)m->counts.triangles);
  m->bounds = NULL;
  if (m->streams[0].elements == 3)
    m->bounds = room(sizeof *m->bounds * (size_t)m->counts.meshlets);
  arrays.triangles = m->triangles;
  arrays.integers = m->integers;
  arrays.values = m->values;
  arrays.bounds = m->bounds;
  check(gltf_meshlet_decode(m->view, 1, &arrays));
}

static void close_model(model* m) {
  for (uint32_t s = 0; s < m->counts.streams; s++) {
    free(m->integers[s]);
    free(m->values[s]);
  }
  for (int i = 0; i < 2; i++) free(m->begins[i]);
  free(m->triangles);
  free(m->bounds);
  check(gltf_meshlet_close(m->view));
}

int main(int argc, char** argv) {
  static uint8_t bytes[1 << 22];
  for (int i = 1; i < argc; i++) {
    model m;
    FILE* file = fopen(argv[i], "rb");
    require(file != NULL, "cannot open a file");
    memset(&m, 0, sizeof m);
    open_model(&m, bytes, fread(bytes, 1, sizeof bytes, file));
    fclose(file);
    for (uint32_t s = 0; s < m.counts.streams; s++) {
      for (uint32_t format = 0; format < 9; format++) {
        if (format >= GLTF_MESHLET_U8 && m.streams[s].bits > 8 * bytes_of[format]) continue;
        decode_attribute(&m, s, format);
        decode_meshlets(&m, s, format);
      }
    }
    for (size_t k = 0; m.bounds && k < m.counts.meshlets; k++) check_bounds(&m, k);
    close_model(&m);
  }
  return 0;
}
