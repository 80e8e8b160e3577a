/* gltf-meshlet: the codec's C interface, for C99, C++ and whatever calls C. Manual: docs/c.md.
 *
 * Memory: results go to arrays of the caller, but for opaque objects, which the caller closes. An
 * object of another kind is refused; one that is closed must not be used. What an object borrows
 * must stay unchanged until it is closed.
 *
 * Errors: no function throws or aborts, without memory either. Each returns a status; unless it is
 * GLTF_MESHLET_OK, gltf_meshlet_error() is one sentence, and results are unspecified.
 *
 * Threads: any function may be called on any thread, and any number of threads share a view, or
 * levels, with no lock. Only a scratch is for one thread at a time: another one gets
 * GLTF_MESHLET_BUSY. Functions with an argument `threads` start so many themselves (0: one per
 * processor; negative ones are refused); it changes no result, but for values of corrupt bytes that
 * only gltf_meshlet_validate refuses.
 *
 * Structs with a field `size` begin with it: the caller sets it to sizeof the struct. Later
 * versions append fields, for which 0 has the meaning of the version without them. So a size may be
 * larger than a library knows, up to 4096: what it does not know must be 0 where it reads, and
 * becomes 0 where it writes. */
#ifndef GLTF_MESHLET_H
#define GLTF_MESHLET_H

#include <stddef.h>
#include <stdint.h>

#if defined(GLTF_MESHLET_STATIC) /* linked into the program, not a shared library */
#define GLTF_MESHLET_API
#elif defined(_WIN32) && defined(GLTF_MESHLET_EXPORTS)
#define GLTF_MESHLET_API __declspec(dllexport)
#elif defined(_WIN32)
#define GLTF_MESHLET_API __declspec(dllimport)
#else
#define GLTF_MESHLET_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this interface. It grows with each addition; what exists never changes. */
#define GLTF_MESHLET_ABI 1

/* Statuses, which functions return. */
enum {
  GLTF_MESHLET_OK = 0,
  GLTF_MESHLET_MALFORMED = 1, /* the bytes break a rule of the format */
  GLTF_MESHLET_ARGUMENT = 2,  /* a mistake of the caller */
  GLTF_MESHLET_NUMBER = 3,    /* there is no meshlet, page, stream or array of this number */
  GLTF_MESHLET_BUSY = 4,      /* another thread decodes with this scratch */
  GLTF_MESHLET_LIMIT = 5,     /* beyond a limit of the format */
  GLTF_MESHLET_MEMORY = 6,
  GLTF_MESHLET_CANCELLED = 7, /* by the progress function */
  GLTF_MESHLET_INTERNAL = 8   /* a bug of the library */
};

/* Limits of the format. */
enum {
  GLTF_MESHLET_TRIANGLES = 64, /* at most, in a meshlet */
  GLTF_MESHLET_VERTICES = 64,  /* at most, in a meshlet */
  GLTF_MESHLET_STREAMS = 64,   /* at most, in a view */
  GLTF_MESHLET_ELEMENTS = 4    /* at most, per vertex of a stream */
};

/* gltf_meshlet_stream.kind: what its integers decode to. */
enum {
  GLTF_MESHLET_GRID = 0,    /* floats: offset + integer * step */
  GLTF_MESHLET_OCT = 1,     /* unit vectors of three floats, from two integers */
  GLTF_MESHLET_INTEGER = 2, /* the integers */
  GLTF_MESHLET_FLOAT32 = 3, /* floats: of the bits b, the integer is b >> 31 ? ~b : b ^ 0x80000000,
                               and b is the integer >> 31 ? integer ^ 0x80000000 : ~integer */
  GLTF_MESHLET_SIGN = 4     /* -1 or 1, of tangents */
};

/* gltf_meshlet_stream.predictor: how its integers are predicted. */
enum {
  GLTF_MESHLET_PARALLELOGRAM = 0,
  GLTF_MESHLET_MEAN = 1,
  GLTF_MESHLET_COPY = 2, /* the only one for elements of more than 24 bits */
  GLTF_MESHLET_DAMPED = 3,
  GLTF_MESHLET_GEO = 4,               /* normals, from positions */
  GLTF_MESHLET_AFFINE = 5,            /* from positions */
  GLTF_MESHLET_CHOOSE_PREDICTOR = 255 /* the encoder chooses */
};

enum { GLTF_MESHLET_EFFORT_NORMAL = 0, GLTF_MESHLET_EFFORT_FAST = 1 };

typedef struct gltf_meshlet_view gltf_meshlet_view;       /* compressed bytes that are open */
typedef struct gltf_meshlet_scratch gltf_meshlet_scratch; /* what a thread needs to decode parts */
typedef struct gltf_meshlet_result gltf_meshlet_result;   /* arrays whose size a function finds */
typedef struct gltf_meshlet_levels gltf_meshlet_levels;   /* tables of levels that are open */

/* ---- The library, all objects ---- */

/* The version of the library, at least GLTF_MESHLET_ABI of the headers that it works with. */
GLTF_MESHLET_API uint32_t gltf_meshlet_abi(void);

/* One sentence in English, UTF-8, about the last call on this thread that failed; "" before. Valid
 * until the next one that fails. */
GLTF_MESHLET_API const char* gltf_meshlet_error(void);

/* Where the functions that decode take memory, on any thread; functions that encode do not ask it.
 * A null result is a failure that they return. */
typedef struct gltf_meshlet_allocator {
  uint32_t size;
  void* (*allocate)(void* user, size_t bytes); /* aligned as malloc does */
  void (*release)(void* user, void* memory);
  void* user;
} gltf_meshlet_allocator;

/* Sets it for the whole program, before any object is open; null: the C++ library's again. */
GLTF_MESHLET_API int gltf_meshlet_set_allocator(const gltf_meshlet_allocator* allocator);

/* Closes any object. Null is allowed and does nothing. */
GLTF_MESHLET_API int gltf_meshlet_close(void* object);

/* Array 0, 1, .. of a result: where it is, valid until the result is closed, and its size in
 * bytes. */
GLTF_MESHLET_API int gltf_meshlet_get_array(const gltf_meshlet_result* result, uint32_t array,
                                            const void** items, size_t* bytes);

/* ---- Views: what a glTF buffer view holds, one page or several ----
 * A page, a blob of the specification, decodes alone. Triangles, vertices and meshlets are numbered
 * on through the pages. */

typedef struct gltf_meshlet_counts {
  uint32_t size, pages, streams;
  uint32_t
      suspicious; /* 1: headers claim far more than such bytes hold. Validate, then allocate. */
  uint64_t triangles, vertices, meshlets; /* triangles * 3 and vertices are below 2^32 */
} gltf_meshlet_counts;

typedef struct gltf_meshlet_page {
  uint32_t size, data_offset;                           /* the latter: bytes of header and tables */
  uint64_t offset, bytes;                               /* in the view */
  uint64_t triangles, vertices, meshlets;               /* of this page */
  uint64_t first_triangle, first_vertex, first_meshlet; /* in the view */
} gltf_meshlet_page;

/* A row of the stream table, as in the page. The encoder chooses the three bases. */
typedef struct gltf_meshlet_stream {
  uint8_t kind, elements, bits; /* elements: integers per vertex, 1 to 4, each of 1 to 32 bits */
  uint8_t predictor, chain_base, interior_base, anchor_base, reserved;
  float step, offset[4];
} gltf_meshlet_stream;

/* Opens bytes and borrows them. Checks headers and tables, so that counts are true of the tables;
 * takes memory in proportion to the bytes. A view does not change once it is open. */
GLTF_MESHLET_API int gltf_meshlet_open(const void* bytes, size_t size, gltf_meshlet_view** view);

/* Opens a scratch, for one thread and any views, which it does not borrow. Its memory, 0.1 to 0.3
 * MB and some kB for each meshlet that references reach, is taken when it is needed. */
GLTF_MESHLET_API int gltf_meshlet_open_scratch(gltf_meshlet_scratch** scratch);

GLTF_MESHLET_API int gltf_meshlet_get_counts(const gltf_meshlet_view* view,
                                             gltf_meshlet_counts* counts);
GLTF_MESHLET_API int gltf_meshlet_get_page(const gltf_meshlet_view* view, uint32_t page,
                                           gltf_meshlet_page* out);

/* Pages of a view differ only in their streams' predictors and bases. */
GLTF_MESHLET_API int gltf_meshlet_get_stream(const gltf_meshlet_view* view, uint32_t page,
                                             uint32_t stream, gltf_meshlet_stream* out);

/* Writes the numbers of the first triangle and of the first vertex of each meshlet of the view, and
 * the view's counts behind them: a meshlet has the vertices from its begin to the next one and, in
 * common with earlier meshlets, others. room: of either array, in numbers; more than the view's
 * meshlets. Null arrays are skipped. Triangles are read from tables; vertices cost a part of the
 * decoding, once: a program may keep them with its file. Functions that take them refuse those that
 * lead outside of the view's arrays; other wrong ones give wrong triangles. */
GLTF_MESHLET_API int gltf_meshlet_get_begins(const gltf_meshlet_view* view, int32_t threads,
                                             uint32_t* triangle_begins, uint32_t* vertex_begins,
                                             size_t room);

/* Fails unless the bytes are valid in every way. Decodes every meshlet alone, and so finds errors
 * that other functions may accept. */
GLTF_MESHLET_API int gltf_meshlet_validate(const gltf_meshlet_view* view, int32_t threads);

/* gltf_meshlet_attribute.format, of each component. */
enum {
  GLTF_MESHLET_F32 = 0, /* the value: that of gltf_meshlet_arrays.values as a float */
  GLTF_MESHLET_F16 = 1, /* the nearest half, ties to even */
  GLTF_MESHLET_SNORM8 = 2,
  GLTF_MESHLET_UNORM8 = 3,  /* normalised: the nearest integer of the value, which is cut off at */
  GLTF_MESHLET_SNORM16 = 4, /* -1 or 0 and 1, times 127, 255, 32767 or 65535. Halves go away from */
  GLTF_MESHLET_UNORM16 = 5, /* 0; NaN gives -1 or 0 */
  GLTF_MESHLET_U8 = 6,      /* the integer of the stream, whose bits must fit: for joints, and to */
  GLTF_MESHLET_U16 = 7,     /* dequantise positions, normals and others on the GPU */
  GLTF_MESHLET_U32 = 8
};

/* A stream in the caller's layout: vertex v at data + stride * v, one component after the other,
 * three of OCT values, else as many as the stream has elements. Other bytes are left as they are.
 */
typedef struct gltf_meshlet_attribute {
  uint32_t stream, format;
  void* data;
  size_t stride; /* in bytes; 0: the components follow on */
} gltf_meshlet_attribute;

/* A sphere around a meshlet, and a cone around its normals, which point to where triangles run
 * anticlockwise. Seen from `eye` it shows only backs, if dot(centre - eye, axis) >= cutoff *
 * length(centre - eye) + radius; cutoff 1: never. In units of stream 0, which has 3 elements. */
typedef struct gltf_meshlet_bounds {
  float centre[3], radius, axis[3], cutoff;
} gltf_meshlet_bounds;

/* Arrays of the caller, to decode to. `integers` and `values` may be null; if not, they have an
 * array for each stream of the view, which may be null, too. */
typedef struct gltf_meshlet_arrays {
  uint32_t size;
  uint32_t first_vertex;     /* is added to the numbers of a range; 0 for arrays of a view */
  uint64_t triangle_room;    /* of `triangles`, in triangles */
  uint64_t vertex_room;      /* of the other arrays, in vertices */
  uint32_t* triangles;       /* three vertex numbers each */
  uint32_t* const* integers; /* vertices x elements */
  void* const* values;       /* INTEGER: uint32_t, vertices x elements; others: float,
                                vertices x elements, but x 3 for OCT */
  const uint32_t *triangle_begins, *vertex_begins; /* of gltf_meshlet_get_begins, to decode ranges
                                                      to arrays of the view; or null */
  uint32_t* shared; /* null, or for gltf_meshlet_join_vertices: per vertex, itself or an earlier one
                       that has its position by a reference. Only gltf_meshlet_decode writes it */
  const gltf_meshlet_attribute* attributes; /* or null; at most 64 */
  gltf_meshlet_bounds* bounds;              /* null, or room for one of each meshlet: of the view,
                                               with begins or gltf_meshlet_decode, else of the
                                               range */
  uint16_t* triangles_16; /* in place of `triangles`, for at most 2^16 vertices; or null */
  uint32_t attribute_count, reserved;
} gltf_meshlet_arrays;

/* Decodes everything; needs room for the view's triangles and vertices. Threads share out the
 * pages, and parts of large ones. */
GLTF_MESHLET_API int gltf_meshlet_decode(const gltf_meshlet_view* view, int32_t threads,
                                         const gltf_meshlet_arrays* arrays);

/* Decodes meshlets [first, first + count), at least one, of one page. The result depends on nothing
 * that was decoded before. sizes, or null: receives the numbers of triangles and of vertices that
 * were written. scratch: null takes one for this call, at 10 to 30 us.
 *
 * With begins, arrays are those of the whole view, with room for all of it: a range writes its
 * triangles and its new vertices to their places, as gltf_meshlet_decode does, and nothing else.
 * Threads decode different ranges of a view to the same arrays at the same time.
 *
 * Without, the arrays hold the range alone: vertices are numbered in the order of their first
 * meshlets, from arrays->first_vertex, with copies of those that meshlets before `first` have, too.
 * Needs room for 64 triangles and 64 vertices for each meshlet, or for the page's if it is all of
 * it. */
GLTF_MESHLET_API int gltf_meshlet_decode_range(const gltf_meshlet_view* view,
                                               gltf_meshlet_scratch* scratch, uint64_t first,
                                               uint64_t count, const gltf_meshlet_arrays* arrays,
                                               uint32_t* sizes);

/* Arrays for single meshlets, the i-th of a call at i times its room. Null ones are skipped. */
typedef struct gltf_meshlet_meshlet_arrays {
  uint32_t size, attribute_count;
  uint32_t triangle_bytes; /* 3, or 0; or 4, the last of which becomes 0 */
  uint32_t reserved;
  uint32_t* sizes;    /* 2 for each meshlet: its numbers of triangles and of vertices */
  uint8_t* triangles; /* room for 64; local vertex numbers, below 64 */
  uint32_t* integers; /* room for 64 x (sum of all streams' elements): 64 x elements of stream 0, of
                         which its vertices x elements are written; then those of stream 1, .. */
  const gltf_meshlet_attribute* attributes; /* vertex v at data + stride * (64 * i + v) */
  gltf_meshlet_bounds* bounds;              /* null, or one for each meshlet of the call */
} gltf_meshlet_meshlet_arrays;

/* Decodes `count` meshlets alone, in any order. scratch: as above. */
GLTF_MESHLET_API int gltf_meshlet_decode_meshlets(const gltf_meshlet_view* view,
                                                  gltf_meshlet_scratch* scratch,
                                                  const uint32_t* meshlets, size_t count,
                                                  const gltf_meshlet_meshlet_arrays* arrays);

#ifndef GLTF_MESHLET_DECODER_ONLY
/* What gltf_meshlet_decode wrote, to find the source's vertices. */
typedef struct gltf_meshlet_vertices {
  uint32_t size, stream_count;
  const uint32_t* triangles;       /* three vertex numbers each, below vertex_count */
  const uint32_t* const* integers; /* per stream: vertices x elements; stream 0 is the position */
  const uint32_t* elements;        /* per stream, 1 to 4 */
  const uint32_t* shared;          /* null, or of gltf_meshlet_arrays */
  const uint64_t* first_vertices;  /* of the pages, in ascending order */
  uint64_t triangle_count, vertex_count, page_count;
  uint64_t source_vertices; /* of the extension's object: vertex_count if it has none; 0 if
                               not known, as of a cut through levels of detail */
} gltf_meshlet_vertices;

/* A view holds vertices on borders of its pages, and a few others, more than once. Writes
 * numbers[vertex]: equal for those that were one vertex of the source, from 0 in order of first
 * occurrence; and how many there are. Corners of one triangle stay different. docs/c.md says how
 * sure it is. */
GLTF_MESHLET_API int gltf_meshlet_join_vertices(const gltf_meshlet_vertices* decoded,
                                                uint32_t* numbers, uint32_t* different);

typedef struct gltf_meshlet_topology {
  uint32_t size, reserved;
  uint64_t vertices;       /* of triangles */
  uint64_t boundary_edges; /* that exactly one triangle has: none in a closed mesh */
  uint64_t islands;        /* connected by vertices */
} gltf_meshlet_topology;

/* triangles: three vertex numbers each, below vertex_count. */
GLTF_MESHLET_API int gltf_meshlet_get_topology(const uint32_t* triangles, uint64_t triangle_count,
                                               uint64_t vertex_count, gltf_meshlet_topology* out);
#endif

/* ---- Views packed for download: EXT_meshlet_transport ---- */

/* Writes the number of bytes that a packed view unpacks to: at most 256 times its own, and 4096 for
 * each page. Checks its table. */
GLTF_MESHLET_API int gltf_meshlet_get_unpacked_bytes(const void* packed, size_t size,
                                                     size_t* bytes);

/* Unpacks to the identical bytes of the view, which open or validate are still to check. room: of
 * `view`, in bytes. */
GLTF_MESHLET_API int gltf_meshlet_unpack(const void* packed, size_t size, int32_t threads,
                                         void* view, size_t room);

typedef struct gltf_meshlet_packed_page {
  uint64_t offset;       /* of the stored bytes, in the packed view */
  uint32_t stored_bytes; /* equal to page_bytes: it is not packed, and needs no unpacking */
  uint32_t page_bytes;
} gltf_meshlet_packed_page;

/* Reads the page table, which is at the beginning of a packed view: head_bytes of its view_bytes,
 * at least 4 and 8 for each page. Writes the pages, unless they are null, and how many there are.
 * room: of `pages`. */
GLTF_MESHLET_API int gltf_meshlet_get_packed_pages(const void* head, size_t head_bytes,
                                                   uint64_t view_bytes,
                                                   gltf_meshlet_packed_page* pages, size_t room,
                                                   size_t* count);

/* Unpacks one page, of which `stored` are the stored bytes, to page_bytes. It is a view of one
 * page, which open or validate are still to check. scratch: null takes one for this call. */
GLTF_MESHLET_API int gltf_meshlet_unpack_page(gltf_meshlet_scratch* scratch, const void* stored,
                                              size_t stored_bytes, void* page, size_t page_bytes);

/* ---- Levels of detail: EXT_meshlet_lod ----
 * The program reads bytes by itself: tables, then pages as cuts ask for them. */

/* The tables of one primitive: their buffer view, whole or a prefix, and counts of the extension's
 * object. */
typedef struct gltf_meshlet_tables {
  uint32_t size;
  uint32_t page_count, coarse_page_count, group_count, run_count;
  uint32_t root_page_count; /* 0 if the object has none; a prefix needs it */
  const void* bytes;        /* all; or a prefix: pages, then groups, those of root pages at least. A
                               page whose groups are there in part counts as not known */
  const void* runs; /* null if `bytes` are all; else the first runs, of these groups or more:
                       firstRun (bytes 20 to 23 of a group) + runs (byte 31) of the last */
  uint64_t byte_count, run_bytes;
} gltf_meshlet_tables;

typedef struct gltf_meshlet_level_counts {
  uint32_t size;
  uint32_t pages, coarse_pages, root_pages; /* root pages are the first ones, and always needed */
  uint32_t groups, known_groups;            /* fewer are known from a prefix */
  uint64_t most_draws;                      /* of a cut */
} gltf_meshlet_level_counts;

/* A page, in the view of the object's `pages`, or in that of level 0. */
typedef struct gltf_meshlet_level_page {
  uint32_t size, bytes;
  uint64_t offset;   /* in its view; of a packed view, in the unpacked one */
  uint32_t is_fine;  /* 1: of level 0 */
  uint32_t is_known; /* 0: its groups are not in the prefix, and its meshlets are not known */
  uint32_t triangles, vertices, meshlets;
  uint32_t first_group, groups;
} gltf_meshlet_level_page;

typedef struct gltf_meshlet_group {
  uint32_t size;
  float centre[3], radius; /* a sphere around its meshlets and those of all finer groups below it */
  float error;             /* of its replacement; infinite for a top group */
  uint32_t page, first_meshlet, meshlets;
} gltf_meshlet_group;

/* Copies the tables and checks all that the specification demands of them. A prefix that is too
 * short is a mistake of the caller (GLTF_MESHLET_ARGUMENT), not of the file. */
GLTF_MESHLET_API int gltf_meshlet_open_levels(const gltf_meshlet_tables* tables,
                                              gltf_meshlet_levels** levels);

GLTF_MESHLET_API int gltf_meshlet_get_level_counts(const gltf_meshlet_levels* levels,
                                                   gltf_meshlet_level_counts* counts);
GLTF_MESHLET_API int gltf_meshlet_get_level_page(const gltf_meshlet_levels* levels, uint32_t page,
                                                 gltf_meshlet_level_page* out);
GLTF_MESHLET_API int gltf_meshlet_get_group(const gltf_meshlet_levels* levels, uint32_t group,
                                            gltf_meshlet_group* out);

/* Fails unless the view is that page by its counts, and has the streams of `other`, which is null
 * or any view of the primitive. Call it before the page counts as resident. Refuses a page that is
 * not known yet. */
GLTF_MESHLET_API int gltf_meshlet_check_page(const gltf_meshlet_levels* levels, uint32_t page,
                                             const gltf_meshlet_view* view,
                                             const gltf_meshlet_view* other);

/* Meshlets [first_meshlet, first_meshlet + meshlets) of a page, of one group. */
typedef struct gltf_meshlet_draw {
  uint32_t page, first_meshlet, meshlets, group;
} gltf_meshlet_draw;

/* A cut for one instance: the camera, and arrays of the caller. */
typedef struct gltf_meshlet_cut {
  uint32_t size;
  uint32_t is_orthographic; /* 1: eye and least_distance have no meaning */
  double eye[3];
  double pixels_per_unit; /* of a unit at distance one: height / (2 tan(vertical angle / 2)); if it
                             is orthographic, at any distance. 1: `threshold` is in units */
  double threshold;       /* pixels: groups of larger errors are not replaced, top groups never */
  double least_distance;  /* to the sphere of a group, as of the camera's near plane; 0: a millionth
                             of the largest radius in the root pages, by the scale of `matrix` */
  const double* matrix;   /* null, or 16 numbers, column by column: from POSITION to the eye's
                             coordinates */
  const uint8_t* resident; /* per page: 0 if it is not in memory; null: all are */
  uint8_t* active; /* per known group: becomes 1 or 0; top groups: 1 if root pages are here */
  float* urgency;  /* null, or per page: the largest error in pixels of its needed groups is
                      put there if it is larger than what is there; infinite for root pages.
                      Set to 0 before the first instance of a frame */
  gltf_meshlet_draw* draws; /* null, or what to draw */
  uint64_t draw_room;       /* at least most_draws */
  /* Results. */
  uint64_t draw_count;
  double error;           /* of the cut, in pixels; more than the threshold while pages lack */
  uint32_t groups_needed; /* more than known_groups: a prefix with so many groups, which are those
                             of whole pages, may give a finer cut */
  uint32_t reserved;
} gltf_meshlet_cut;

/* Makes a cut by the rule of the specification: level 0 with whole groups replaced, without cracks,
 * for any pages that are resident. Draws nothing unless all root pages are. Takes no memory. */
GLTF_MESHLET_API int gltf_meshlet_make_cut(const gltf_meshlet_levels* levels,
                                           gltf_meshlet_cut* cut);

/* Writes the numbers of all pages with an urgency above 0 to `order`, the most urgent first, and
 * how many these are; and how many of the first ones have at most `budget` bytes together: load or
 * keep those. If the root pages are more, nothing can be drawn by this budget: load them all the
 * same. bytes: of each page, in whatever form they count. For several primitives their arrays
 * follow on one another. Takes no memory. */
GLTF_MESHLET_API int gltf_meshlet_rank_pages(const float* urgency, const uint32_t* bytes,
                                             size_t count, uint64_t budget, uint32_t* order,
                                             size_t* needed, size_t* affordable);

#ifndef GLTF_MESHLET_DECODER_ONLY
/* ---- The encoder. The same input and options give the same bytes on any machine. ---- */

typedef struct gltf_meshlet_mesh {
  uint32_t size, stream_count;
  const uint32_t* triangles; /* three different vertex numbers each */
  uint64_t triangle_count, vertex_count;
  const uint32_t* position_ids; /* per vertex, below vertex_count, equal where positions are; null:
                                   where the integers of stream 0 are */
  const float* positions;       /* three finite floats per vertex; null: the values of stream 0,
                                   which is a GRID of three elements */
  const gltf_meshlet_stream* streams; /* stream 0 is the position */
  const uint32_t* const* values;      /* per stream: vertices x elements integers below 2^bits */
  /* Meshlets of the caller; null, and counts of 0, to have them made. Order: all triangles. Disk d
   * is order[disk_begin[d]] .. order[disk_begin[d + 1]]; likewise meshlets of disks and groups of
   * meshlets. Begins start with 0 and end with the number of what they divide; the counts are
   * those of the begins, one more than of disks, meshlets, groups.
   * Without disk_begin, meshlet m is order[meshlet_begin[m]] .. order[meshlet_begin[m + 1]]: any
   * triangles, which are cut into disks, and into several meshlets if they are too many for one.
   * Without group_begin, all are one group. Begins without order are refused. */
  const uint32_t *order, *disk_begin, *meshlet_begin, *group_begin;
  uint64_t disk_begin_count, meshlet_begin_count, group_begin_count;
  const uint16_t* triangles_16; /* in place of `triangles`, or null */
  /* In place of `values`, or null: per stream, its integers in the caller's layout, in one of the
   * formats _U8, _U16, _U32. They are only read. */
  const gltf_meshlet_attribute* attributes;
  size_t position_stride; /* in bytes, at least 12; 0: 12 */
} gltf_meshlet_mesh;

typedef struct gltf_meshlet_options { /* 0 is the default of each */
  uint32_t size;
  uint32_t effort;        /* GLTF_MESHLET_EFFORT_NORMAL or _FAST */
  uint32_t max_triangles; /* of a meshlet, 1 to 64 */
  uint32_t max_vertices;  /* of a meshlet, 3 to 64 */
  int32_t threads;
  float lambda;        /* smaller: flatter meshlets; larger: more compact ones. At most 1000 */
  uint64_t page_bytes; /* 0: one blob, or one for each group of the caller's meshlets; else blobs of
                          at most so many bytes, but of one meshlet (group) at least */
  /* Called on the calling thread with a fraction from 0 to 1. Cancels unless it returns 0. Must
   * not throw. */
  int (*progress)(void* user, float fraction);
  void* user;
} gltf_meshlet_options;

/* Encodes a primitive. Array 0 of the result: the view's bytes. options: may be null. */
GLTF_MESHLET_API int gltf_meshlet_encode(const gltf_meshlet_mesh* mesh,
                                         const gltf_meshlet_options* options,
                                         gltf_meshlet_result** result);

/* Packs a valid view. Array 0 of the result: the packed bytes. */
GLTF_MESHLET_API int gltf_meshlet_pack(const void* view, size_t size, int32_t threads,
                                       gltf_meshlet_result** result);
#endif

#ifdef __cplusplus
}
#endif
#endif
