// bad_arguments FILE: calls the C interface with everything that is wrong; FILE holds a valid view.
// Build with ASan and UBSan (MESHLET_FUZZ). Each call must return a status, and the library must
// work after it.
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "gltf_meshlet_internal.h"

namespace {

void expect(bool holds, const char* what, int line) {
  if (holds) return;
  std::fprintf(stderr, "bad_arguments.cpp:%d: %s (%s)\n", line, what, gltf_meshlet_error());
  std::exit(1);
}
#define EXPECT(condition) expect(condition, #condition, __LINE__)
#define REFUSED(call) EXPECT((call) == GLTF_MESHLET_ARGUMENT && *gltf_meshlet_error())
#define WORKS(call) EXPECT((call) == GLTF_MESHLET_OK)

template <class T>
T sized() {
  T out{};
  out.size = sizeof out;
  return out;
}

std::vector<char> file;
const gltf_meshlet_meshlet_arrays none = sized<gltf_meshlet_meshlet_arrays>();

gltf_meshlet_view* open_view() {
  gltf_meshlet_view* view;
  WORKS(gltf_meshlet_open(file.data(), file.size(), &view));
  return view;
}

// Arrays with room for a whole view.
struct Room {
  gltf_meshlet_counts counts = sized<gltf_meshlet_counts>();
  std::vector<uint32_t> triangles;
  std::vector<std::vector<uint32_t>> integers;
  std::vector<uint32_t*> lists;
  gltf_meshlet_arrays arrays = sized<gltf_meshlet_arrays>();

  explicit Room(const gltf_meshlet_view* view) {
    WORKS(gltf_meshlet_get_counts(view, &counts));
    triangles.resize(3 * counts.triangles);
    integers.resize(counts.streams);
    for (auto& list : integers) list.resize(GLTF_MESHLET_ELEMENTS * counts.vertices);
    for (auto& list : integers) lists.push_back(list.data());
    arrays.triangle_room = counts.triangles;
    arrays.vertex_room = counts.vertices;
    arrays.triangles = triangles.data();
    arrays.integers = lists.data();
  }
};

void test_objects() {
  gltf_meshlet_view* view = open_view();
  gltf_meshlet_counts counts = sized<gltf_meshlet_counts>();
  const void* items;
  size_t bytes;
  REFUSED(gltf_meshlet_get_counts(nullptr, &counts));
  REFUSED(gltf_meshlet_get_array(nullptr, 0, &items, &bytes));
  REFUSED(gltf_meshlet_get_array(reinterpret_cast<gltf_meshlet_result*>(view), 0, &items, &bytes));
  WORKS(gltf_meshlet_get_counts(view, &counts));
  gltf_meshlet_scratch* scratch;
  REFUSED(gltf_meshlet_open_scratch(nullptr));
  WORKS(gltf_meshlet_open_scratch(&scratch));
  auto* const no_view = reinterpret_cast<gltf_meshlet_view*>(scratch);
  auto* const no_scratch = reinterpret_cast<gltf_meshlet_scratch*>(view);
  REFUSED(gltf_meshlet_get_counts(no_view, &counts));
  REFUSED(gltf_meshlet_validate(no_view, 1));
  REFUSED(gltf_meshlet_decode_meshlets(no_view, nullptr, nullptr, 0, &none));
  REFUSED(gltf_meshlet_decode_meshlets(view, no_scratch, nullptr, 0, &none));
  WORKS(gltf_meshlet_decode_meshlets(view, scratch, nullptr, 0, &none));
  WORKS(gltf_meshlet_close(view));
  WORKS(gltf_meshlet_close(scratch));
  WORKS(gltf_meshlet_close(nullptr));
  WORKS(gltf_meshlet_close(open_view()));
}

void test_bytes() {
  gltf_meshlet_view* view;
  REFUSED(gltf_meshlet_open(nullptr, 0, &view));
  REFUSED(gltf_meshlet_open(file.data(), file.size(), nullptr));
  for (size_t size = 0; size < file.size(); size += 4) {
    const std::vector<char> cut(file.data(), file.data() + size);
    EXPECT(gltf_meshlet_open(cut.empty() ? file.data() : cut.data(), size, &view) ==
           GLTF_MESHLET_MALFORMED);
    EXPECT(view == nullptr);
  }
}

template <class T>
void test_sizes(int (*call)(const gltf_meshlet_view*, T*), const gltf_meshlet_view* view) {
  REFUSED(call(view, nullptr));
  struct {
    T known;
    char later[64];
  } large;
  for (uint32_t size : {0u, 4u, uint32_t(sizeof(T)) - 1, 5000u, ~0u}) {
    large.known.size = size;
    REFUSED(call(view, &large.known));
  }
  std::memset(&large, 0xAA, sizeof large);
  large.known.size = sizeof large;
  WORKS(call(view, &large.known));
  EXPECT(large.known.size == sizeof large && large.later[0] == 0 && large.later[63] == 0);
}

void test_views() {
  gltf_meshlet_view* view = open_view();
  const uint32_t many = ~0u;
  test_sizes<gltf_meshlet_counts>(gltf_meshlet_get_counts, view);
  test_sizes<gltf_meshlet_statistics>(gltf_meshlet_get_statistics, view);
  test_sizes<gltf_meshlet_page>([](const gltf_meshlet_view* v,
                                   gltf_meshlet_page* b) { return gltf_meshlet_get_page(v, 0, b); },
                                view);
  gltf_meshlet_page blob = sized<gltf_meshlet_page>();
  gltf_meshlet_stream stream;
  uint32_t one[1];
  EXPECT(gltf_meshlet_get_page(view, many, &blob) == GLTF_MESHLET_NUMBER);
  EXPECT(gltf_meshlet_get_stream(view, many, 0, &stream) == GLTF_MESHLET_NUMBER);
  EXPECT(gltf_meshlet_get_stream(view, 0, many, &stream) == GLTF_MESHLET_NUMBER);
  REFUSED(gltf_meshlet_get_stream(view, 0, 0, nullptr));
  WORKS(gltf_meshlet_get_begins(view, 0, nullptr, nullptr, 1 << 20));
  REFUSED(gltf_meshlet_get_begins(view, 0, one, nullptr, 1));
  REFUSED(gltf_meshlet_get_begins(view, 0, nullptr, one, 1));
  REFUSED(gltf_meshlet_get_begins(view, -1, nullptr, nullptr, 1 << 20));
  for (int32_t threads : {0, 1, 1 << 30, INT32_MAX}) WORKS(gltf_meshlet_validate(view, threads));
  for (int32_t threads : {-1, INT32_MIN}) REFUSED(gltf_meshlet_validate(view, threads));
  WORKS(gltf_meshlet_close(view));
}

void test_decoding() {
  gltf_meshlet_view* view = open_view();
  Room room(view);
  WORKS(gltf_meshlet_decode(view, 0, &room.arrays));
  const gltf_meshlet_arrays good = room.arrays;
  const auto refused = [&](gltf_meshlet_arrays arrays) {
    REFUSED(gltf_meshlet_decode(view, 1, &arrays));
    arrays.first_vertex = 0;
    REFUSED(gltf_meshlet_decode_range(view, nullptr, 0, room.counts.meshlets, &arrays, nullptr));
  };
  gltf_meshlet_arrays wrong = good;
  refused((wrong.size = 0, wrong));
  wrong = good;
  refused((wrong.triangles = nullptr, wrong));
  wrong = good;
  refused((wrong.triangle_room--, wrong));
  wrong = good;
  refused((wrong.vertex_room--, wrong));
  wrong = good;
  wrong.first_vertex = 1;
  REFUSED(gltf_meshlet_decode(view, 1, &wrong));
  REFUSED(gltf_meshlet_decode(view, 1, nullptr));
  REFUSED(gltf_meshlet_decode(view, -1, &good));
  const uint64_t all = room.counts.meshlets, largest = ~uint64_t(0);
  const auto range = [&](uint64_t first, uint64_t count) {
    return gltf_meshlet_decode_range(view, nullptr, first, count, &room.arrays, nullptr);
  };
  REFUSED(range(0, all - 1));  // needs 64 for each
  EXPECT(range(0, 0) == GLTF_MESHLET_NUMBER);
  EXPECT(range(all, 1) == GLTF_MESHLET_NUMBER);
  EXPECT(range(1, largest) == GLTF_MESHLET_NUMBER);
  EXPECT(range(largest, largest) == GLTF_MESHLET_NUMBER);
  WORKS(range(0, all));
  const uint32_t numbers[] = {0, uint32_t(all)};
  const auto meshlets = [&](const uint32_t* list, size_t count) {
    return gltf_meshlet_decode_meshlets(view, nullptr, list, count, &none);
  };
  REFUSED(meshlets(nullptr, 1));
  WORKS(meshlets(nullptr, 0));
  EXPECT(meshlets(numbers, 2) == GLTF_MESHLET_NUMBER);
  WORKS(gltf_meshlet_close(view));
}

// Layouts of vertices and triangles that cannot be.
void test_formats() {
  gltf_meshlet_view* view = open_view();
  Room room(view);
  std::vector<uint16_t> narrow(room.triangles.size());
  gltf_meshlet_attribute one = {0, GLTF_MESHLET_U16, room.integers[0].data(), 0};
  gltf_meshlet_meshlet_arrays single = none;
  const uint32_t number = 0;
  const auto both = [&](int status) {
    EXPECT(gltf_meshlet_decode(view, 1, &room.arrays) == status);
    EXPECT(gltf_meshlet_decode_range(view, nullptr, 0, room.counts.meshlets, &room.arrays,
                                     nullptr) == status);
    single.attributes = room.arrays.attributes;
    single.attribute_count = room.arrays.attribute_count;
    EXPECT(gltf_meshlet_decode_meshlets(view, nullptr, &number, 1, &single) == status);
  };
  room.arrays.attribute_count = 1;
  both(GLTF_MESHLET_ARGUMENT);  // without attributes
  room.arrays.attributes = &one;
  both(GLTF_MESHLET_OK);
  const auto refused = [&](auto member, auto value) {
    const gltf_meshlet_attribute good = one;
    one.*member = value;
    both(GLTF_MESHLET_ARGUMENT);
    one = good;
  };
  using A = gltf_meshlet_attribute;
  refused(&A::stream, room.counts.streams);
  refused(&A::format, 9u);
  refused(&A::format, uint32_t(GLTF_MESHLET_U8));  // of 12 bits
  refused(&A::data, static_cast<void*>(nullptr));
  refused(&A::stride, size_t(1));
  room.arrays.attribute_count = 65;
  both(GLTF_MESHLET_ARGUMENT);
  room.arrays.attribute_count = 1;
  room.arrays.triangles_16 = narrow.data();
  REFUSED(gltf_meshlet_decode(view, 1, &room.arrays));
  room.arrays.triangles = nullptr;
  WORKS(gltf_meshlet_decode(view, 1, &room.arrays));
  for (size_t i = 0; i < narrow.size(); i++) EXPECT(narrow[i] < room.counts.vertices);
  room.arrays.first_vertex = 1 << 16;
  REFUSED(gltf_meshlet_decode_range(view, nullptr, 0, room.counts.meshlets, &room.arrays, nullptr));
  single.triangle_bytes = 5;
  REFUSED(gltf_meshlet_decode_meshlets(view, nullptr, &number, 1, &single));
  single.triangle_bytes = 4;
  single.reserved = 1;
  REFUSED(gltf_meshlet_decode_meshlets(view, nullptr, &number, 1, &single));
  WORKS(gltf_meshlet_close(view));
}

// Begins that are not the view's never lead outside of the arrays.
void test_begins() {
  gltf_meshlet_view* view = open_view();
  Room room(view);
  const size_t all = size_t(room.counts.meshlets);
  std::vector<uint32_t> triangles(all + 1), vertices(all + 1);
  WORKS(gltf_meshlet_get_begins(view, 1, triangles.data(), vertices.data(), all + 1));
  EXPECT(triangles[all] == room.counts.triangles && vertices[all] == room.counts.vertices);
  gltf_meshlet_arrays& to = room.arrays;
  const auto range = [&](uint64_t first, uint64_t count) {
    return gltf_meshlet_decode_range(view, nullptr, first, count, &to, nullptr);
  };
  to.triangle_begins = triangles.data();
  REFUSED(range(0, all));
  to.vertex_begins = vertices.data();
  WORKS(range(0, all));
  WORKS(range(all - 1, 1));
  to.vertex_room--;
  REFUSED(range(0, 1));
  to.vertex_room++;
  to.triangle_room--;
  REFUSED(range(0, 1));
  to.triangle_room++;
  to.first_vertex = 1;
  REFUSED(range(0, 1));
  to.first_vertex = 0;
  for (std::vector<uint32_t>* begins : {&triangles, &vertices}) {
    const std::vector<uint32_t> good = *begins;
    begins->back()++;
    REFUSED(range(0, all));
    begins->back() = 0;
    REFUSED(range(0, all));
    *begins = good;
    (*begins)[1]++;
    EXPECT(range(0, all) == GLTF_MESHLET_MALFORMED);
    begins->assign(all + 1, 0);
    EXPECT(range(0, all) == GLTF_MESHLET_MALFORMED);
    *begins = good;
  }
  // Of meshlets before the range, which it only looks up.
  const std::vector<uint32_t> good = vertices;
  int refused = 0;
  for (size_t m = 1; m < all; m++) {
    for (size_t before = 0; before < m; before++) vertices[before] += 0x40000000u;
    std::fill(room.triangles.begin(), room.triangles.end(), 0);
    const int status = range(m, 1);
    EXPECT(status == GLTF_MESHLET_OK || status == GLTF_MESHLET_MALFORMED);
    refused += status == GLTF_MESHLET_MALFORMED;
    for (uint32_t v : room.triangles) EXPECT(status || v < room.counts.vertices);
    vertices = good;
  }
  EXPECT(refused > 0);
  WORKS(range(0, all));
  WORKS(gltf_meshlet_close(view));
}

// Two threads decode with one scratch, until one has been refused.
void test_threads() {
  gltf_meshlet_view* view = open_view();
  gltf_meshlet_scratch* scratch;
  WORKS(gltf_meshlet_open_scratch(&scratch));
  std::atomic<int> busy{0};
  const std::vector<uint32_t> numbers(1000, 0);
  const auto run = [&] {
    while (!busy) {
      const int status =
          gltf_meshlet_decode_meshlets(view, scratch, numbers.data(), numbers.size(), &none);
      if (status == GLTF_MESHLET_BUSY) busy++;
      EXPECT(status == GLTF_MESHLET_OK || status == GLTF_MESHLET_BUSY);
    }
  };
  std::thread other(run);
  run();
  other.join();
  WORKS(gltf_meshlet_close(scratch));
  WORKS(gltf_meshlet_close(view));
}

void test_allocator() {
  gltf_meshlet_allocator allocator{};
  REFUSED(gltf_meshlet_set_allocator(&allocator));
  allocator.size = sizeof allocator;
  allocator.allocate = [](void*, size_t) -> void* { return nullptr; };
  REFUSED(gltf_meshlet_set_allocator(&allocator));  // half of it
  allocator.release = [](void*, void*) {};
  WORKS(gltf_meshlet_set_allocator(&allocator));
  gltf_meshlet_view* view;
  EXPECT(gltf_meshlet_open(file.data(), file.size(), &view) == GLTF_MESHLET_MEMORY);
  WORKS(gltf_meshlet_set_allocator(nullptr));
}

// A mesh of two triangles, which encodes.
struct Mesh {
  uint32_t triangles[6] = {0, 1, 2, 2, 1, 3}, ids[4] = {0, 1, 2, 3};
  float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  uint32_t integers[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  uint16_t narrow[6];
  float wide[16];
  uint8_t bytes[20];
  gltf_meshlet_attribute attribute{};
  uint32_t order[2] = {0, 1}, begin[2] = {0, 1}, two[2] = {0, 2};
  const uint32_t* values[1] = {integers};
  gltf_meshlet_stream stream{};
  gltf_meshlet_mesh mesh = sized<gltf_meshlet_mesh>();
  gltf_meshlet_options options = sized<gltf_meshlet_options>();
  gltf_meshlet_groups groups = sized<gltf_meshlet_groups>();

  Mesh() {
    stream.elements = 3;
    stream.bits = 1;
    stream.predictor = GLTF_MESHLET_CHOOSE_PREDICTOR;
    stream.step = 1;
    mesh.triangles = triangles;
    mesh.triangle_count = 2;
    mesh.vertex_count = 4;
    mesh.position_ids = ids;
    mesh.positions = positions;
    mesh.streams = &stream;
    mesh.values = values;
    mesh.stream_count = 1;
    groups.triangles = triangles;
    groups.triangle_count = 2;
    groups.begin = two;
    groups.begin_count = 2;
  }

  int encode() {
    gltf_meshlet_result* result = nullptr;
    const int status = gltf_meshlet_encode(&mesh, &options, &result);
    EXPECT((result != nullptr) == (status == GLTF_MESHLET_OK));
    WORKS(gltf_meshlet_close(result));
    return status;
  }

  // The same in another layout: 16 bits, positions every 16 bytes, integers of 8 bits every 5.
  void give_layout() {
    for (int i = 0; i < 6; i++) narrow[i] = uint16_t(triangles[i]);
    for (int i = 0; i < 12; i++) wide[i / 3 * 4 + i % 3] = positions[i];
    for (int i = 0; i < 12; i++) bytes[i / 3 * 5 + i % 3] = uint8_t(integers[i]);
    mesh.triangles = nullptr;
    mesh.triangles_16 = narrow;
    mesh.positions = wide;
    mesh.position_stride = 16;
    mesh.values = nullptr;
    attribute = {0, GLTF_MESHLET_U8, bytes, 5};
    mesh.attributes = &attribute;
  }

  // A meshlet that says nothing of disks.
  void give_triangles() {
    mesh.order = order;
    mesh.meshlet_begin = two;
    mesh.meshlet_begin_count = 2;
  }

  void give_meshlets() {
    mesh.order = order;
    mesh.disk_begin = two;
    mesh.meshlet_begin = mesh.group_begin = begin;
    mesh.disk_begin_count = mesh.meshlet_begin_count = mesh.group_begin_count = 2;
  }
};

// Any layout of a mesh gives the same bytes.
void test_layouts() {
  const auto bytes_of = [](Mesh& m) {
    gltf_meshlet_result* result = nullptr;
    const void* items;
    size_t size;
    WORKS(gltf_meshlet_encode(&m.mesh, &m.options, &result));
    WORKS(gltf_meshlet_get_array(result, 0, &items, &size));
    const std::string bytes(static_cast<const char*>(items), size);
    WORKS(gltf_meshlet_close(result));
    return bytes;
  };
  Mesh plain, other, given;
  const std::string bytes = bytes_of(plain);
  other.give_layout();
  EXPECT(bytes_of(other) == bytes);
  other.mesh.positions = nullptr;
  other.mesh.position_ids = nullptr;
  EXPECT(bytes_of(other) == bytes);
  given.give_triangles();
  EXPECT(bytes_of(given) == bytes);
}

// Changes a mesh that encodes and generates; encoding it is then refused.
template <class Change>
void encode_refuses(const Change& change, int line) {
  Mesh m;
  change(m);
  expect(m.encode() == GLTF_MESHLET_ARGUMENT, "a bad mesh is encoded", line);
}
#define ENCODE_REFUSES(change) encode_refuses([](Mesh& m) { change; }, __LINE__)

void test_encoding() {
  WORKS(Mesh().encode());
  ENCODE_REFUSES(m.mesh.size = 8);
  ENCODE_REFUSES(m.options.size = ~0u);
  ENCODE_REFUSES(m.mesh.triangles = nullptr);
  ENCODE_REFUSES(m.mesh.streams = nullptr);
  ENCODE_REFUSES(m.mesh.values = nullptr);
  ENCODE_REFUSES(m.values[0] = nullptr);
  ENCODE_REFUSES(m.mesh.triangle_count = 0);
  ENCODE_REFUSES(m.mesh.triangle_count = ~uint64_t(0));
  ENCODE_REFUSES(m.mesh.vertex_count = 3);
  ENCODE_REFUSES(m.mesh.vertex_count = ~uint64_t(0));
  ENCODE_REFUSES(m.mesh.stream_count = 0);
  ENCODE_REFUSES(m.triangles[5] = 4);
  ENCODE_REFUSES(m.triangles[5] = 2);
  ENCODE_REFUSES(m.ids[3] = 4);
  ENCODE_REFUSES(m.positions[3] = INFINITY);
  ENCODE_REFUSES(m.positions[11] = NAN);
  ENCODE_REFUSES(m.integers[11] = 2);
  ENCODE_REFUSES(m.stream.kind = 200);
  ENCODE_REFUSES(m.stream.elements = 0);
  ENCODE_REFUSES(m.stream.elements = 5);
  ENCODE_REFUSES(m.stream.bits = 33);
  ENCODE_REFUSES(m.stream.predictor = 99);
  ENCODE_REFUSES(m.stream.step = NAN);
  ENCODE_REFUSES(m.options.threads = -1);
  ENCODE_REFUSES(m.stream.reserved = 1);
  ENCODE_REFUSES(m.ids[3] = 0);  // another position
  ENCODE_REFUSES(m.options.effort = 2);
  ENCODE_REFUSES(m.options.max_triangles = 65);
  ENCODE_REFUSES(m.options.max_vertices = 2);
  ENCODE_REFUSES(m.options.lambda = NAN);
  ENCODE_REFUSES(m.options.lambda = -1);
  ENCODE_REFUSES((m.give_meshlets(), m.order[1] = 0));
  ENCODE_REFUSES((m.give_meshlets(), m.order[1] = 7));
  ENCODE_REFUSES((m.give_meshlets(), m.mesh.disk_begin = nullptr));
  ENCODE_REFUSES((m.give_meshlets(), m.mesh.group_begin_count = 0));
  ENCODE_REFUSES((m.give_triangles(), m.mesh.disk_begin_count = 2));
  ENCODE_REFUSES((m.give_triangles(), m.two[1] = 3));
  ENCODE_REFUSES((m.give_triangles(), m.order[1] = 0));
  ENCODE_REFUSES((m.give_triangles(), m.mesh.order = nullptr));
  ENCODE_REFUSES((m.mesh.disk_begin = m.two, m.mesh.disk_begin_count = 2));
  ENCODE_REFUSES((m.mesh.group_begin = m.begin, m.mesh.group_begin_count = 2));
  ENCODE_REFUSES(m.mesh.meshlet_begin_count = 2);
  ENCODE_REFUSES((m.mesh.positions = nullptr, m.stream.kind = GLTF_MESHLET_INTEGER));
  ENCODE_REFUSES((m.mesh.position_ids = nullptr, m.mesh.values = nullptr));
  ENCODE_REFUSES((m.give_layout(), m.mesh.triangles = m.triangles));
  ENCODE_REFUSES((m.give_layout(), m.mesh.values = m.values));
  ENCODE_REFUSES((m.give_layout(), m.attribute.stream = 1));
  ENCODE_REFUSES((m.give_layout(), m.attribute.format = GLTF_MESHLET_F32));
  ENCODE_REFUSES((m.give_layout(), m.attribute.format = ~0u));
  ENCODE_REFUSES((m.give_layout(), m.attribute.data = nullptr));
  ENCODE_REFUSES((m.give_layout(), m.stream.elements = 5));
  ENCODE_REFUSES((m.give_layout(), m.narrow[5] = 4));
  ENCODE_REFUSES((m.give_layout(), m.attribute.stride = 2));
  ENCODE_REFUSES((m.give_layout(), m.mesh.position_stride = 11));
  ENCODE_REFUSES((m.give_meshlets(), m.mesh.disk_begin_count = 1));
  ENCODE_REFUSES((m.give_meshlets(), m.begin[1] = 2));
  Mesh m;
  gltf_meshlet_result* result;
  REFUSED(gltf_meshlet_encode(&m.mesh, nullptr, nullptr));
  REFUSED(gltf_meshlet_encode(nullptr, nullptr, &result));
  gltf_meshlet_statistics statistics{};
  REFUSED(gltf_meshlet_encode_described(&m.mesh, nullptr, &statistics, &result));
  m.options.progress = [](void* count, float) { return ++*static_cast<int*>(count); };
  int calls = 0;
  m.options.user = &calls;
  EXPECT(m.encode() == GLTF_MESHLET_CANCELLED && calls == 1);
  m.give_meshlets();
  m.options.progress = nullptr;
  WORKS(m.encode());
  m.mesh.group_begin = nullptr;
  m.mesh.group_begin_count = 0;
  WORKS(m.encode());
  test_layouts();
}

void test_results() {
  Mesh m;
  gltf_meshlet_result* result;
  WORKS(gltf_meshlet_encode(&m.mesh, nullptr, &result));
  const void* items;
  size_t bytes;
  REFUSED(gltf_meshlet_get_array(result, 0, nullptr, &bytes));
  REFUSED(gltf_meshlet_get_array(result, 0, &items, nullptr));
  EXPECT(gltf_meshlet_get_array(result, 1, &items, &bytes) == GLTF_MESHLET_NUMBER);
  WORKS(gltf_meshlet_get_array(result, 0, &items, &bytes));
  WORKS(gltf_meshlet_close(result));
}

void test_packing() {
  gltf_meshlet_result* result = nullptr;
  REFUSED(gltf_meshlet_pack(nullptr, 1, 1, &result));
  REFUSED(gltf_meshlet_pack(file.data(), file.size(), 1, nullptr));
  EXPECT(gltf_meshlet_pack(file.data(), file.size() - 4, 1, &result) == GLTF_MESHLET_MALFORMED);
  EXPECT(result == nullptr);
  REFUSED(gltf_meshlet_pack(file.data(), file.size(), -1, &result));
  WORKS(gltf_meshlet_pack(file.data(), file.size(), 1, &result));
  const void* packed = nullptr;
  size_t size = 0, bytes = 0;
  WORKS(gltf_meshlet_get_array(result, 0, &packed, &size));
  REFUSED(gltf_meshlet_get_unpacked_bytes(nullptr, size, &bytes));
  REFUSED(gltf_meshlet_get_unpacked_bytes(packed, size, nullptr));
  EXPECT(gltf_meshlet_get_unpacked_bytes(packed, size - 1, &bytes) == GLTF_MESHLET_MALFORMED);
  WORKS(gltf_meshlet_get_unpacked_bytes(packed, size, &bytes));
  EXPECT(bytes == file.size());
  std::vector<char> view(bytes);
  REFUSED(gltf_meshlet_unpack(nullptr, size, 1, view.data(), bytes));
  REFUSED(gltf_meshlet_unpack(packed, size, 1, nullptr, bytes));
  REFUSED(gltf_meshlet_unpack(packed, size, 1, view.data(), bytes - 1));
  WORKS(gltf_meshlet_unpack(packed, size, 0, view.data(), bytes));
  EXPECT(view == file);
  gltf_meshlet_packed_page page{};
  size_t count = 0;
  REFUSED(gltf_meshlet_get_packed_pages(nullptr, size, size, &page, 1, &count));
  REFUSED(gltf_meshlet_get_packed_pages(packed, size, size, &page, 1, nullptr));
  REFUSED(gltf_meshlet_get_packed_pages(packed, size, size, &page, 0, &count));
  for (size_t head : {0, 4, 11})
    EXPECT(gltf_meshlet_get_packed_pages(packed, head, size, &page, 1, &count) ==
           GLTF_MESHLET_MALFORMED);
  for (uint64_t whole : {uint64_t(8), size - 1, size + 1, ~uint64_t(0)})
    EXPECT(gltf_meshlet_get_packed_pages(packed, 12, whole, &page, 1, &count) ==
           GLTF_MESHLET_MALFORMED);
  WORKS(gltf_meshlet_get_packed_pages(packed, 12, size, nullptr, 0, &count));
  WORKS(gltf_meshlet_get_packed_pages(packed, 12, size, &page, 1, &count));
  EXPECT(count == 1 && page.page_bytes == file.size());
  const char* stored = static_cast<const char*>(packed) + page.offset;
  REFUSED(gltf_meshlet_unpack_page(nullptr, nullptr, page.stored_bytes, view.data(), bytes));
  REFUSED(gltf_meshlet_unpack_page(nullptr, stored, page.stored_bytes, nullptr, bytes));
  REFUSED(gltf_meshlet_unpack_page(nullptr, stored, page.stored_bytes, view.data(), 0));
  REFUSED(gltf_meshlet_unpack_page(nullptr, stored, 0, view.data(), bytes));
  EXPECT(gltf_meshlet_unpack_page(nullptr, stored, page.stored_bytes, view.data(), bytes - 4) ==
         GLTF_MESHLET_MALFORMED);
  std::fill(view.begin(), view.end(), 0);
  WORKS(gltf_meshlet_unpack_page(nullptr, stored, page.stored_bytes, view.data(), bytes));
  EXPECT(view == file);
  WORKS(gltf_meshlet_close(result));
}

void test_join_vertices() {
  // Two triangles that share an edge, whose vertices are doubled.
  const uint32_t triangles[6] = {0, 1, 2, 3, 4, 5}, elements[1] = {1},
                 missing[6] = {0, 1, 2, 3, 4, 6};
  const uint32_t values[6] = {0, 1, 2, 2, 1, 3}, later[6] = {1, 1, 2, 3, 4, 5};
  const uint32_t* integers[1] = {values};
  const uint64_t first[2] = {0, 3};
  uint32_t numbers[6], different = 0;
  gltf_meshlet_vertices v{};
  v.size = sizeof v;
  v.stream_count = 1;
  v.triangles = triangles;
  v.integers = integers;
  v.elements = elements;
  v.first_vertices = first;
  v.triangle_count = 2;
  v.vertex_count = 6;
  v.page_count = 2;
  for (uint64_t source : {0, 1, 4, 6}) {
    v.source_vertices = source;
    WORKS(gltf_meshlet_join_vertices(&v, numbers, &different));
    EXPECT(different == (source == 6 ? 6 : 4));
  }
  REFUSED(gltf_meshlet_join_vertices(nullptr, numbers, &different));
  REFUSED(gltf_meshlet_join_vertices(&v, nullptr, &different));
  REFUSED(gltf_meshlet_join_vertices(&v, numbers, nullptr));
  const auto refused_with = [&](auto member, auto value) {
    gltf_meshlet_vertices wrong = v;
    wrong.*member = value;
    REFUSED(gltf_meshlet_join_vertices(&wrong, numbers, &different));
  };
  using V = gltf_meshlet_vertices;
  refused_with(&V::size, 8u);
  refused_with(&V::stream_count, 0u);
  refused_with(&V::stream_count, 65u);
  refused_with(&V::triangles, static_cast<const uint32_t*>(nullptr));
  refused_with(&V::triangles, static_cast<const uint32_t*>(missing));
  refused_with(&V::shared, static_cast<const uint32_t*>(later));
  refused_with(&V::integers, static_cast<const uint32_t* const*>(nullptr));
  refused_with(&V::elements, static_cast<const uint32_t*>(nullptr));
  refused_with(&V::first_vertices, static_cast<const uint64_t*>(nullptr));
  refused_with(&V::vertex_count, uint64_t(0));
  EXPECT(std::string(gltf_meshlet_error()) == "there are no vertices");
  refused_with(&V::vertex_count, uint64_t(UINT32_MAX));
  gltf_meshlet_topology topology{};
  topology.size = sizeof topology;
  WORKS(gltf_meshlet_get_topology(triangles, 2, 6, &topology));
  EXPECT(topology.vertices == 6 && topology.boundary_edges == 6 && topology.islands == 2);
  REFUSED(gltf_meshlet_get_topology(missing, 2, 6, &topology));
  REFUSED(gltf_meshlet_get_topology(nullptr, 2, 6, &topology));
  REFUSED(gltf_meshlet_get_topology(triangles, 2, 6, nullptr));
}

void test_weld() {
  uint32_t numbers[2], different;
  const char rows[4] = {};
  REFUSED(gltf_meshlet_weld(nullptr, 1, 1, numbers, &different));
  REFUSED(gltf_meshlet_weld(rows, 2, 2, nullptr, &different));
  REFUSED(gltf_meshlet_weld(rows, 2, 2, numbers, nullptr));
  REFUSED(gltf_meshlet_weld(rows, ~size_t(0), 2, numbers, &different));
  WORKS(gltf_meshlet_weld(rows, 2, 0, numbers, &different));
  EXPECT(different == 1);
  WORKS(gltf_meshlet_weld(nullptr, 0, 1, nullptr, &different));
}

void test_lines() {
  gltf_meshlet_result* result;
  const char text[] = {'v', ' ', '1', '\n', 'f', ' ', 'x'};  // no zero at the end
  const char *keywords[] = {"v", "f"}, *const none = nullptr;
  uint32_t words[] = {GLTF_MESHLET_NUMBERS, GLTF_MESHLET_CORNERS};
  const auto scan = [&](size_t count) {
    return gltf_meshlet_scan_lines(text, sizeof text, keywords, words, count, &result);
  };
  WORKS(scan(0));
  WORKS(gltf_meshlet_close(result));
  WORKS(scan(1));
  WORKS(gltf_meshlet_close(result));
  REFUSED(scan(2));
  EXPECT(result == nullptr);
  words[0] = 3;
  REFUSED(scan(1));
  words[0] = GLTF_MESHLET_NUMBERS;
  REFUSED(gltf_meshlet_scan_lines(text, ~size_t(0), keywords, words, 1, &result));
  REFUSED(gltf_meshlet_scan_lines(nullptr, 1, keywords, words, 1, &result));
  REFUSED(gltf_meshlet_scan_lines(text, 1, nullptr, words, 1, &result));
  REFUSED(gltf_meshlet_scan_lines(text, 1, &none, words, 1, &result));
  REFUSED(gltf_meshlet_scan_lines(text, 1, keywords, nullptr, 1, &result));
  REFUSED(gltf_meshlet_scan_lines(text, 1, keywords, words, 1, nullptr));
}

void test_polygons() {
  gltf_meshlet_result* result;
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, NAN};
  const uint32_t three = 3, sizes[] = {2, 1};
  WORKS(gltf_meshlet_triangulate(nullptr, 0, nullptr, 0, &result));
  WORKS(gltf_meshlet_close(result));
  WORKS(gltf_meshlet_triangulate(points, 3, &three, 1, &result));
  WORKS(gltf_meshlet_close(result));
  WORKS(gltf_meshlet_triangulate(points, 3, sizes, 2, &result));
  WORKS(gltf_meshlet_close(result));
  REFUSED(gltf_meshlet_triangulate(points, 2, &three, 1, &result));
  EXPECT(result == nullptr);
  REFUSED(gltf_meshlet_triangulate(points, 3, sizes, 1, &result));
  REFUSED(gltf_meshlet_triangulate(points, ~size_t(0), &three, 1, &result));
  REFUSED(gltf_meshlet_triangulate(nullptr, 3, &three, 1, &result));
  REFUSED(gltf_meshlet_triangulate(points, 3, nullptr, 1, &result));
  REFUSED(gltf_meshlet_triangulate(points, 3, &three, 1, nullptr));
}

// Stand for functions of meshoptimizer: the first triangles, one group.
size_t first_triangles(uint32_t* to, const uint32_t* indices, size_t, const float*, size_t, size_t,
                       const float*, size_t, const float*, size_t, const uint8_t*, size_t count,
                       float, uint32_t, float* error) {
  std::memcpy(to, indices, count * sizeof *to);
  *error = 1;
  return count;
}
size_t one_group(uint32_t* to, const uint32_t*, size_t, const uint32_t*, size_t clusters, size_t,
                 size_t) {
  std::memset(to, 0, clusters * sizeof *to);
  return 1;
}

// A square of 200 triangles in one chunk, from which levels are built.
struct LevelsMesh : Mesh {
  static constexpr uint32_t kSide = 11;
  std::vector<uint32_t> corners, numbers, places, canonical, source;
  std::vector<uint32_t> grid;
  std::vector<float> points, normals;
  const uint32_t* lists[1];
  const float* shapes[1];
  uint32_t disks[2] = {0, 1}, clusters[2] = {0, 1};
  int32_t finer[1] = {0};
  double error[1] = {1}, sphere[4] = {5, 5, 0, 8};
  gltf_meshlet_simplifier simplifier = sized<gltf_meshlet_simplifier>();
  gltf_meshlet_levels_input input = sized<gltf_meshlet_levels_input>();
  gltf_meshlet_statistics counted = sized<gltf_meshlet_statistics>();

  LevelsMesh() {
    for (uint32_t i = 0; i < kSide * kSide; i++) {
      numbers.push_back(i);
      grid.insert(grid.end(), {i % kSide, i / kSide, 0});
      normals.insert(normals.end(), {0, 0, 1});
      if (i % kSide == kSide - 1 || i / kSide == kSide - 1) continue;
      corners.insert(corners.end(), {i, i + 1, i + kSide, i + kSide, i + 1, i + kSide + 1});
    }
    points.assign(grid.begin(), grid.end());
    places = canonical = source = numbers;
    lists[0] = grid.data();
    shapes[0] = points.data();
    stream.bits = 4;
    mesh.triangles = corners.data();
    mesh.triangle_count = corners.size() / 3;
    mesh.vertex_count = numbers.size();
    mesh.position_ids = numbers.data();
    input.canonical_vertices = canonical.data();
    input.source_position_ids = source.data();
    mesh.positions = input.seam_points = points.data();
    mesh.values = lists;
    simplifier.simplify = reinterpret_cast<void (*)(void)>(first_triangles);
    simplifier.partition = reinterpret_cast<void (*)(void)>(one_group);
    input.mesh = &mesh;
    input.simplifier = &simplifier;
    input.shapes = shapes;
    input.shape_count = 1;
    input.places = places.data();
    input.normals = normals.data();
    input.group_size = 8;
    input.chunk = GLTF_MESHLET_ALL_LEVELS;
    input.reduction = 5;
    input.error_limit = INFINITY;
    options.page_bytes = 32768;
  }

  // As one cluster of a coarser level.
  void give_clusters() {
    mesh.triangle_count = 1;
    mesh.disk_begin = disks;
    mesh.meshlet_begin = clusters;
    mesh.disk_begin_count = mesh.meshlet_begin_count = 2;
    input.finer_groups = finer;
    input.errors = error;
    input.spheres = sphere;
    input.level = 1;
  }

  int build() {
    gltf_meshlet_result* result = nullptr;
    const int status = gltf_meshlet_build_levels(&input, &options, &counted, &result);
    EXPECT((result != nullptr) == (status == GLTF_MESHLET_OK));
    WORKS(gltf_meshlet_close(result));
    return status;
  }
};

#define BUILD_REFUSES(change) \
  do {                        \
    LevelsMesh m;             \
    WORKS(m.build());         \
    change;                   \
    REFUSED(m.build());       \
  } while (false)

void test_given_clusters() {
  BUILD_REFUSES((m.give_clusters(), m.mesh.disk_begin = nullptr));
  BUILD_REFUSES((m.give_clusters(), m.mesh.meshlet_begin = nullptr));
  BUILD_REFUSES((m.give_clusters(), m.disks[1] = 2));
  BUILD_REFUSES((m.give_clusters(), m.clusters[1] = 2));
  BUILD_REFUSES((m.give_clusters(), m.mesh.meshlet_begin_count = 1));
  BUILD_REFUSES((m.give_clusters(), m.input.finer_groups = nullptr));
  BUILD_REFUSES((m.give_clusters(), m.input.errors = nullptr));
  BUILD_REFUSES((m.give_clusters(), m.input.spheres = nullptr));
  BUILD_REFUSES((m.give_clusters(), m.finer[0] = -1));
  BUILD_REFUSES((m.give_clusters(), m.input.level = 0));
  BUILD_REFUSES((m.give_clusters(), m.finer[0] = 1 << 24));
  BUILD_REFUSES((m.give_clusters(), m.error[0] = NAN));
  BUILD_REFUSES((m.give_clusters(), m.error[0] = -1));
  BUILD_REFUSES((m.give_clusters(), m.sphere[3] = -1));
  BUILD_REFUSES((m.give_clusters(), m.sphere[0] = INFINITY));
}

void test_levels() {
  BUILD_REFUSES(m.input.size = 8);
  BUILD_REFUSES(m.input.mesh = nullptr);
  BUILD_REFUSES(m.mesh.triangle_count = 0);
  BUILD_REFUSES(m.mesh.triangle_count = 1u << 30);
  BUILD_REFUSES(m.mesh.vertex_count = 100);
  BUILD_REFUSES(m.mesh.vertex_count = 1ull << 31);
  BUILD_REFUSES(m.corners[0] = m.corners[1]);
  BUILD_REFUSES(m.numbers[5] = 121);
  BUILD_REFUSES(m.mesh.streams = nullptr);
  BUILD_REFUSES(m.grid[0] = 16);
  BUILD_REFUSES(m.points[0] = NAN);
  BUILD_REFUSES(m.counted.size = 8);
  BUILD_REFUSES(m.input.level = 1);
  BUILD_REFUSES(m.input.source_position_ids = nullptr);
  BUILD_REFUSES(m.source[3] = 121);
  BUILD_REFUSES(m.source[3] = 4);
  BUILD_REFUSES(m.input.canonical_vertices = nullptr);
  BUILD_REFUSES(m.input.seam_points = nullptr);
  BUILD_REFUSES(m.input.shapes = nullptr);
  BUILD_REFUSES(m.shapes[0] = nullptr);
  BUILD_REFUSES(m.input.attribute_count = 33);
  BUILD_REFUSES(m.input.attribute_count = 1);
  BUILD_REFUSES(m.canonical[3] = 121);
  BUILD_REFUSES(m.canonical[3] = 4);
  BUILD_REFUSES(m.places[3] = 121);
  BUILD_REFUSES(m.places[3] = 4);
  BUILD_REFUSES(m.input.normals = nullptr);
  BUILD_REFUSES(m.input.other_count = 1);
  BUILD_REFUSES(m.input.other_count = ~uint64_t(0));
  BUILD_REFUSES(m.input.group_size = 0);
  BUILD_REFUSES(m.input.group_size = 256);
  BUILD_REFUSES(m.input.chunk = 3);
  BUILD_REFUSES(m.input.reduction = 0);
  BUILD_REFUSES(m.input.reduction = 0.99);  // more triangles than there are
  BUILD_REFUSES(m.input.reduction = 1e300);
  BUILD_REFUSES(m.input.reduction = NAN);
  BUILD_REFUSES(m.input.first_group = ~0u);
  BUILD_REFUSES(m.input.level = ~0u);
  BUILD_REFUSES(m.input.simplifier = nullptr);
  BUILD_REFUSES(m.simplifier.size = 0);
  BUILD_REFUSES(m.simplifier.partition = nullptr);
  BUILD_REFUSES(m.options.threads = -1);
  for (uint32_t chunk : {GLTF_MESHLET_ONE_LEVEL, GLTF_MESHLET_LAST_LEVEL}) {
    LevelsMesh m;
    m.input.chunk = chunk;
    WORKS(m.build());
    m.give_clusters();
    WORKS(m.build());
    m.error[0] = INFINITY;
    REFUSED(m.build());
  }
  LevelsMesh cancelled;
  REFUSED(gltf_meshlet_build_levels(&cancelled.input, nullptr, nullptr, nullptr));
  cancelled.options.progress = [](void*, float) { return 1; };
  EXPECT(cancelled.build() == GLTF_MESHLET_CANCELLED);
}

void test_distances() {
  Mesh m;
  float distance[4];
  const float* p = m.positions;
  WORKS(gltf_meshlet_get_distances(p, 4, &m.groups, p, 4, 0, 1, distance, nullptr));
  REFUSED(gltf_meshlet_get_distances(p, 4, &m.groups, p, 3, 0, 1, distance, nullptr));
  REFUSED(gltf_meshlet_get_distances(p, 4, &m.groups, nullptr, 4, 0, 1, distance, nullptr));
  REFUSED(gltf_meshlet_get_distances(nullptr, 4, &m.groups, p, 4, 0, 1, distance, nullptr));
  REFUSED(gltf_meshlet_get_distances(p, 4, &m.groups, p, 4, 0, 1, nullptr, nullptr));
  REFUSED(gltf_meshlet_get_distances(p, 4, nullptr, p, 4, 0, 1, distance, nullptr));
  const double point[3] = {0, 0, 1}, corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  double weights[3];
  WORKS(gltf_meshlet_get_nearest_weights(point, corners, 1, weights));
  EXPECT(weights[0] == 1);
  REFUSED(gltf_meshlet_get_nearest_weights(point, nullptr, 1, weights));
  REFUSED(gltf_meshlet_get_nearest_weights(point, corners, 1, nullptr));
}

}  // namespace

int main(int argc, char** argv) {
  std::ifstream input(argc > 1 ? argv[1] : "", std::ios::binary);
  file.assign(std::istreambuf_iterator<char>(input), {});
  EXPECT(gltf_meshlet_abi() == GLTF_MESHLET_ABI && *gltf_meshlet_error() == 0);
  test_allocator();
  test_objects();
  test_bytes();
  test_views();
  test_decoding();
  test_formats();
  test_begins();
  test_threads();
  test_encoding();
  test_results();
  test_packing();
  test_weld();
  test_join_vertices();
  test_lines();
  test_polygons();
  test_given_clusters();
  test_levels();
  test_distances();
  return 0;
}
