// gltf_ext._codec: the Python binding of the codec. After a change, generate its stub again:
// python -m nanobind.stubgen -m gltf_ext._codec -o gltf_ext/_codec.pyi
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <tuple>

#include "common/parallel.h"
#include "common/weld.h"
#include "decode/bit_statistics.h"
#include "decode/view.h"
#include "encode/encoder.h"
#include "encode/pages.h"
#include "arrays.h"
#include "lod_bindings.h"

namespace meshlet {

using namespace nb::literals;

namespace {

using Bytes = nb::ndarray<const uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

const uint8_t* bytes_of(const nb::bytes& blob) { return static_cast<const uint8_t*>(blob.data()); }

template <class T>
nb::object new_array(size_t rows, size_t columns, T*& data) {
  data = new T[rows * columns];
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<2>>(data, {rows, columns}, owner));
}

std::vector<float> offsets_of(const Stream& s) { return {s.offset, s.offset + s.elements}; }

nb::dict stream_dict(const Stream& s) {
  nb::dict d;
  d["kind"] = s.kind;
  d["components"] = s.elements;
  d["bits"] = s.bits;
  d["predictor"] = s.predictor;
  d["chain_base"] = s.chain_base;
  d["interior_base"] = s.interior_base;
  d["anchor_base"] = s.anchor_base;
  d["step"] = s.step;
  d["offset"] = nb::cast(offsets_of(s));
  return d;
}

// The stream table of the first blob. Predictors and bases of others may differ.
nb::list stream_dicts(const View& view) {
  nb::list out;
  for (const Stream& s : view.streams()) out.append(stream_dict(s));
  return out;
}

nb::dict description_dict(const View& view, const BitStatistics& d) {
  nb::dict out, bits, symbols, references;
  nb::list stream_bits;
  for (uint64_t b : d.streams) stream_bits.append(b);
  bits["connectivity"] = d.connectivity;
  bits["references"] = d.references;
  bits["streams"] = stream_bits;
  const char* names[5] = {"C", "L", "E", "R", "S"};
  for (int i = 0; i < 5; i++) symbols[names[i]] = d.symbols[i];
  references["owned"] = d.owned_references;
  references["private"] = d.private_references;
  references["foreign"] = d.foreign_references;
  out["blobs"] = view.blobs.size();
  out["triangles"] = view.triangle_count;
  out["vertices"] = view.vertex_count;
  out["meshlets"] = view.meshlet_count;
  out["components"] = d.disks;
  out["streams"] = stream_dicts(view);
  out["bits"] = bits;
  out["symbols"] = symbols;
  out["references"] = references;
  return out;
}

[[noreturn]] void refuse_stream(const std::string& problem) {
  throw nb::value_error(("a stream" + problem).c_str());
}

// An integer of a stream's dict from `lowest` to 255.
int integer(const nb::dict& d, const char* key, int lowest) {
  if (!d.contains(key)) refuse_stream(std::string(" lacks '") + key + "'");
  int value;
  if (!nb::try_cast(d[key], value) || value < lowest || value > 255)
    refuse_stream(std::string("'s '") + key + "' is not an integer from " + std::to_string(lowest) +
                  " to 255");
  return value;
}

float real(const nb::handle& number) {
  float value;
  if (!nb::try_cast(number, value)) refuse_stream("'s step or offset is not a number");
  return value;
}

Stream stream_of(const nb::dict& d) {
  Stream s;
  s.kind = uint8_t(integer(d, "kind", 0));
  s.elements = uint8_t(integer(d, "components", 0));
  s.bits = uint8_t(integer(d, "bits", 0));
  const int predictor = d.contains("predictor") ? integer(d, "predictor", -1) : -1;
  s.predictor = predictor < 0 ? kChoosePredictor : uint8_t(predictor);
  if (d.contains("step")) s.step = real(d["step"]);
  if (!d.contains("offset")) return s;
  size_t c = 0;
  for (const nb::handle offset : d["offset"]) {
    if (c == STREAM_MAX_ELEMENTS) refuse_stream(" has more than 4 offsets");
    s.offset[c++] = real(offset);
  }
  return s;
}

nb::tuple weld(const Bytes& rows) {
  if (rows.shape(0) > UINT32_MAX) throw nb::value_error("there are too many rows");
  std::vector<uint32_t> remap(rows.shape(0));
  uint32_t unique;
  {
    nb::gil_scoped_release release;
    unique = weld_rows(rows.data(), rows.shape(0), rows.shape(1), remap.data());
  }
  return nb::make_tuple(array_of(std::move(remap)), unique);
}

void check_mesh(const Indices& triangles, const Numbers& position_ids, size_t vertices) {
  if (position_ids.shape(0) != vertices)
    throw nb::value_error("position_ids and positions differ in length");
  for (size_t v = 0; v < vertices; v++)
    if (position_ids.data()[v] >= vertices) throw nb::value_error("a position id is out of range");
  check_triangles(triangles, vertices, true);
}

VertexValues vertex_values(const std::vector<Stream>& streams, const std::vector<Values>& values,
                           size_t vertices) {
  if (streams.size() != values.size()) throw nb::value_error("streams and values differ in number");
  VertexValues out;
  for (size_t s = 0; s < streams.size(); s++) {
    if (values[s].shape(0) != vertices || values[s].shape(1) != streams[s].elements)
      throw nb::value_error("a stream's values have the wrong shape");
    uint32_t mask = streams[s].bits >= 32 ? ~0u : (1u << streams[s].bits) - 1u, over = 0;
    for (size_t i = 0; i < vertices * streams[s].elements; i++) over |= values[s].data()[i] & ~mask;
    if (over) throw nb::value_error("a stream's value does not fit its bits");
    out.values.push_back(values[s].data());
    out.elements.push_back(streams[s].elements);
  }
  return out;
}

// (triangles, disk_begin, meshlet_begin) as in Meshlets, and group_begin as in encode_given.
using GivenMeshlets = std::tuple<Numbers, Numbers, Numbers, Numbers>;

nb::tuple encode_primitive(const Indices& triangles, const Numbers& position_ids,
                           const Points& positions, const std::vector<nb::dict>& stream_dicts,
                           const std::vector<Values>& values, int max_triangles, int max_vertices,
                           float lambda, float fill, const std::string& weight, bool share_seams,
                           int threads, nb::object progress, size_t page_bytes,
                           const std::optional<GivenMeshlets>& given, const std::string& effort) {
  size_t vertices = positions.shape(0);
  check_mesh(triangles, position_ids, vertices);
  std::vector<Stream> streams;
  for (const nb::dict& d : stream_dicts) streams.push_back(stream_of(d));
  VertexValues all = vertex_values(streams, values, vertices);
  if (max_triangles < 1 || max_triangles > int(MESHLET_TRIANGLES) || max_vertices < 3 ||
      max_vertices > int(MESHLET_VERTICES))
    throw nb::value_error("a meshlet holds 1 to 64 triangles and 3 to 64 vertices");
  if (weight != "paper" && weight != "choe") throw nb::value_error("weight is 'paper' or 'choe'");
  EncodeOptions options;
  options.effort = effort_of(effort);
  options.max_triangles = max_triangles;
  options.max_vertices = max_vertices;
  if (lambda > 0) options.lambda = lambda;
  if (fill > 0) options.fill = fill;
  options.weight = weight == "paper" ? Weight::kPaper : Weight::kChoe;
  options.share_seams = share_seams;
  options.threads = threads;
  if (!progress.is_none())
    options.progress = [&](float fraction) {
      nb::gil_scoped_acquire acquire;
      progress(fraction);
    };
  MeshView mesh{triangles.data(), triangles.shape(0), position_ids.data(), positions.data(),
                vertices};
  EncoderStats stats;
  std::vector<std::vector<uint8_t>> blobs;
  {
    nb::gil_scoped_release release;
    if (given) {
      const auto& [order, disk_begin, meshlet_begin, group_begin] = *given;
      Meshlets meshlets;
      meshlets.triangles = vector_of(order);
      meshlets.disk_begin = vector_of(disk_begin);
      meshlets.meshlet_begin = vector_of(meshlet_begin);
      blobs = encode_given(mesh, meshlets, vector_of(group_begin), streams, all, options,
                           page_bytes, stats);
    } else if (page_bytes) {
      blobs = encode_pages(mesh, streams, all, options, page_bytes, stats);
    } else {
      blobs.push_back(encode(mesh, streams, all, options, stats));
    }
  }
  std::vector<uint8_t> view;
  for (const std::vector<uint8_t>& blob : blobs) view.insert(view.end(), blob.begin(), blob.end());
  nb::dict out = description_dict(View(view.data(), view.size()), stats.bits);
  nb::dict generation;
  generation["histogram"] = nb::make_tuple(stats.histogram[0], stats.histogram[1],
                                           stats.histogram[2], stats.histogram[3]);
  generation["iterations"] = stats.iterations;
  out["generation"] = generation;
  return nb::make_tuple(nb::bytes(view.data(), view.size()), out);
}

void validate(const View& view, int threads) {
  nb::gil_scoped_release release;
  parallel_for(threads, view.blobs.size(), [&](size_t b) { view.validate(b); });
}

nb::tuple decode_view(const nb::bytes& bytes, int threads, bool as_values) {
  const View view(bytes_of(bytes), bytes.size());
  const std::vector<Stream>& streams = view.streams();
  const size_t vertices = size_t(view.vertex_count);
  uint64_t decoded = 0;
  for (const Blob& blob : view.blobs) decoded += decoded_bytes(blob.header);
  if (needs_proof(decoded, bytes.size())) validate(view, threads);
  uint32_t* triangles;
  nb::object triangle_array = new_array(size_t(view.triangle_count), 3, triangles);
  std::vector<uint32_t*> integers(streams.size(), nullptr);
  std::vector<void*> values(streams.size(), nullptr);
  nb::list arrays;
  for (size_t s = 0; s < streams.size(); s++) {
    if (!as_values) {
      arrays.append(new_array(vertices, streams[s].elements, integers[s]));
    } else if (streams[s].kind == kInteger) {
      uint32_t* data;
      arrays.append(new_array(vertices, streams[s].elements, data));
      values[s] = data;
    } else {
      float* data;
      arrays.append(new_array(vertices, value_count(streams[s]), data));
      values[s] = data;
    }
  }
  {
    nb::gil_scoped_release release;
    const Outputs out{triangles, integers.data(), values.data()};
    parallel_for(threads, view.blobs.size(), [&](size_t b) { view.decode(b, out); });
  }
  return nb::make_tuple(triangle_array, arrays);
}

nb::list split_view(const nb::bytes& bytes) {
  const View view(bytes_of(bytes), bytes.size());
  nb::list out;
  for (const Blob& blob : view.blobs)
    out.append(nb::make_tuple(blob.data - bytes_of(bytes), blob.size));
  return out;
}

// Python's Decoder: single meshlets of a view, whose bytes it owns.
class PythonDecoder {
 public:
  const nb::bytes bytes;
  const View view;

  explicit PythonDecoder(nb::bytes given)
      : bytes(std::move(given)), view(bytes_of(bytes), bytes.size()) {}

  nb::tuple decode_one(uint64_t m) {
    const DecodedMeshlet d = decode(m);
    uint8_t* triangles;
    nb::object triangle_array = new_array(d.triangle_count, 3, triangles);
    for (uint32_t i = 0; i < 3 * d.triangle_count; i++)
      triangles[i] = uint8_t(d.triangles[i / 3] >> 8 * (i % 3));
    nb::list arrays;
    for (uint32_t s = 0; s < view.streams().size(); s++) {
      const uint32_t elements = view.streams()[s].elements;
      uint32_t* data;
      arrays.append(new_array(d.vertex_count, elements, data));
      for (uint32_t v = 0; v < d.vertex_count; v++, data += elements)
        std::copy_n(d.vertex(s, v), elements, data);
    }
    return nb::make_tuple(triangle_array, arrays);
  }

  uint64_t decode_many(const Numbers& numbers) {
    nb::gil_scoped_release release;
    uint64_t triangles = 0;
    for (size_t i = 0; i < numbers.shape(0); i++)
      triangles += decode(numbers.data()[i]).triangle_count;
    return triangles;
  }

 private:
  DecodedMeshlet decode(uint64_t m) {
    if (m >= view.meshlet_count) throw nb::index_error("no such meshlet");
    DecodedMeshlet decoded;
    const size_t number = view.blob_of_meshlet(m);
    view.with_blob(number, [&](const Blob& blob) {
      if (number != open_) decoder_->open(blob);
      open_ = number;
      decoded = decoder_->meshlet(uint32_t(m - blob.first_meshlet));
    });
    return decoded;
  }

  const std::unique_ptr<Decoder> decoder_ = make_decoder();
  size_t open_ = SIZE_MAX;  // number of the open blob
};

// The header and tables of a blob, without its data.
struct HeaderView {
  BlobHeader header;
  std::vector<uint32_t> meshlet_triangles;
};

HeaderView read_header(const nb::bytes& blob) {
  BlobHeader header = read_blob_header(bytes_of(blob), blob.size());
  std::vector<uint32_t> triangles = meshlet_triangle_counts(bytes_of(blob), header);
  return {std::move(header), std::move(triangles)};
}

nb::object meshlet_triangles(const HeaderView& view) { return array_of(view.meshlet_triangles); }

nb::dict describe_view(const nb::bytes& bytes) {
  const View view(bytes_of(bytes), bytes.size());
  BitStatistics bits;
  for (size_t b = 0; b < view.blobs.size(); b++)
    view.with_blob(b, [&](const Blob& blob) { bits.add(count_bits(blob)); });
  return description_dict(view, bits);
}

}  // namespace
}  // namespace meshlet

// Constants of the format that Python needs, under the names of format/constants.h.
void define_constants(nb::module_& m) {
#define CONSTANT(name) m.attr(#name) = name
  CONSTANT(KIND_GRID);
  CONSTANT(KIND_OCT);
  CONSTANT(KIND_INTEGER);
  CONSTANT(KIND_FLOAT32);
  CONSTANT(KIND_SIGN);
  CONSTANT(PREDICT_PARALLELOGRAM);
  CONSTANT(PREDICT_MEAN);
  CONSTANT(PREDICT_COPY);
  CONSTANT(PREDICT_DAMPED);
  CONSTANT(PREDICT_GEO);
  CONSTANT(PREDICT_AFFINE);
  CONSTANT(PREDICT_MAX_BITS);
  CONSTANT(GRID_MAX_BITS);
  CONSTANT(OCT_MIN_BITS);
  CONSTANT(OCT_MAX_BITS);
  CONSTANT(STREAM_MAX_ELEMENTS);
  CONSTANT(STREAM_MAX_BITS);
  CONSTANT(BLOB_MAX_STREAMS);
  CONSTANT(MESHLET_TRIANGLES);
  CONSTANT(MESHLET_VERTICES);
#undef CONSTANT
}

NB_MODULE(_codec, m) {
  using namespace meshlet;
  m.doc() =
      "The native codec of EXT_meshlet_edgebreaker.\n\n"
      "Functions that take a blob raise ValueError, with one sentence, if it is malformed.";
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const Malformed& e) {
      PyErr_SetString(PyExc_ValueError, e.what());
    }
  });
  define_constants(m);
  bind_lod(m);

  m.def(
      "weld", &weld, "rows"_a,
      nb::sig("def weld(rows: numpy.typing.NDArray[numpy.uint8]) -> "
              "tuple[numpy.typing.NDArray[numpy.uint32], int]"),
      "Gives bit-identical rows one number, in order of first occurrence. rows: uint8[N, stride].\n"
      "Returns (numbers: uint32[N], number of different rows).");

  m.def(
      "encode", &encode_primitive, "triangles"_a, "position_ids"_a, "positions"_a, "streams"_a,
      "values"_a, "max_triangles"_a = 64, "max_vertices"_a = 64, "lambda_"_a = 0.0f,
      "fill"_a = 0.0f, "weight"_a = "paper", "share_seams"_a = true, "threads"_a = 0,
      "progress"_a = nb::none(), "page_bytes"_a = 0, "meshlets"_a = nb::none(),
      "effort"_a = "normal",
      nb::sig(
          "def encode(triangles: numpy.typing.NDArray[numpy.uint32], position_ids: "
          "numpy.typing.NDArray[numpy.uint32], "
          "positions: numpy.typing.NDArray[numpy.float32], streams: "
          "collections.abc.Sequence[collections.abc.Mapping[str, typing.Any]], "
          "values: collections.abc.Sequence[numpy.typing.NDArray[numpy.uint32]], max_triangles: "
          "int = 64, "
          "max_vertices: int = 64, lambda_: float = 0.0, "
          "fill: float = 0.0, weight: str = 'paper', share_seams: bool = True, "
          "threads: int = 0, progress: collections.abc.Callable[[float], object] | None = None, "
          "page_bytes: int = 0, meshlets: tuple[numpy.typing.NDArray[numpy.uint32], "
          "numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.uint32], "
          "numpy.typing.NDArray[numpy.uint32]] | None = None, effort: str = 'normal') "
          "-> tuple[bytes, dict[str, typing.Any]]"),
      "Encodes one primitive.\n\n"
      "triangles: uint32[T, 3], no index twice in a triangle. position_ids: uint32[V], equal "
      "where\n"
      "positions are. positions: float32[V, 3]. streams: dicts of kind, components (integers per\n"
      "vertex), bits, step, offset, predictor (-1: the encoder chooses). values: uint32[V,\n"
      "components] per stream. lambda_, fill: 0 means the default. weight: 'paper' or 'choe'. "
      "Fill\n"
      "and weight are there to measure the paper's Table 1, share_seams to measure its gain. "
      "threads:\n"
      "0 means one per processor. progress: called with a fraction from 0 to 1. page_bytes: 0 for\n"
      "one blob, else pages, blobs of at most so many bytes. meshlets: those of the caller, as\n"
      "uint32 arrays (triangles, disk begins, meshlet begins, group begins; each of the begins "
      "ends\n"
      "with the number of its items). Pages then hold whole groups in their order; without\n"
      "page_bytes, each holds one. effort: 'fast', 'normal' or 'high'.\n\n"
      "Returns (view, statistics): those of describe, and 'generation': {'histogram',\n"
      "'iterations'}. Raises ValueError for bad arguments.");

  m.def(
      "decode",
      [](const nb::bytes& view, int threads) { return decode_view(view, threads, false); },
      "view"_a, "threads"_a = 0,
      nb::sig(
          "def decode(view: bytes, threads: int = 0) -> tuple[numpy.typing.NDArray[numpy.uint32], "
          "list[numpy.typing.NDArray[numpy.uint32]]]"),
      "Decodes a view: one blob or several, one on each thread (0: one thread per processor).\n"
      "Returns (triangles: uint32[T, 3], [uint32[V, components] per stream]).");
  m.def(
      "decode_values",
      [](const nb::bytes& view, int threads) { return decode_view(view, threads, true); }, "view"_a,
      "threads"_a = 0,
      nb::sig("def decode_values(view: bytes, threads: int = 0) -> "
              "tuple[numpy.typing.NDArray[numpy.uint32], "
              "list[numpy.typing.NDArray[typing.Any]]]"),
      "Returns (triangles: uint32[T, 3], [values per stream]): uint32[V, components] for INTEGER,\n"
      "float32[V, 3] unit vectors for OCT, float32[V, components] otherwise.");
  m.def("split", &split_view, "view"_a, nb::sig("def split(view: bytes) -> list[tuple[int, int]]"),
        "Returns (offset, size) of each blob of a view. Checks all headers.");
  m.def("describe", &describe_view, "view"_a,
        nb::sig("def describe(view: bytes) -> dict[str, typing.Any]"),
        "Returns counts, streams and numbers of bits; the entries of 'bits' sum to 8 * len(view).");
  m.def(
      "validate",
      [](const nb::bytes& view, int threads) {
        validate(View(bytes_of(view), view.size()), threads);
      },
      "view"_a, "threads"_a = 0,
      "Raises ValueError if a blob of the view is malformed in any way. Decodes every meshlet\n"
      "alone, and so finds errors that decode may accept.");

  nb::class_<Stream>(m, "StreamHeader", "A row of a blob's stream table.")
      .def_ro("kind", &Stream::kind, "One of KIND_.")
      .def_ro("elements", &Stream::elements, "Integers per vertex, 1 to 4.")
      .def_ro("bits", &Stream::bits, "Bits per element, 1 to 32.")
      .def_ro("predictor", &Stream::predictor, "One of PREDICT_.")
      .def_ro("chain_base", &Stream::chain_base, "Base of the parameters of chains' codes.")
      .def_ro("interior_base", &Stream::interior_base,
              "Base of the parameters of interiors' codes.")
      .def_ro("anchor_base", &Stream::anchor_base, "Base of the widths of further anchors.")
      .def_ro("step", &Stream::step, "GRID: value = offset + integer * step.")
      .def_prop_ro("offset", &offsets_of, "One float per element.");
  nb::class_<HeaderView>(m, "Header", "The header and tables of a blob; see read_header.")
      .def_prop_ro("triangle_count", [](const HeaderView& v) { return v.header.triangle_count; })
      .def_prop_ro("vertex_count", [](const HeaderView& v) { return v.header.vertex_count; })
      .def_prop_ro("meshlet_count", [](const HeaderView& v) { return v.header.meshlet_count; })
      .def_prop_ro(
          "data_offset", [](const HeaderView& v) { return v.header.data_offset; },
          "Byte offset of the meshlets' data: the size of header and tables.")
      .def_prop_ro("streams", [](const HeaderView& v) { return v.header.streams; })
      .def_prop_ro("meshlet_triangles", &meshlet_triangles,
                   nb::sig("def meshlet_triangles(self) -> numpy.typing.NDArray[numpy.uint32]"),
                   "uint32[meshlet_count]: number of triangles of each meshlet.");
  m.def("read_header", &read_header, "blob"_a,
        "Reads and checks header and tables; decodes nothing.");

  nb::class_<PythonDecoder>(m, "Decoder",
                            "Decodes single meshlets of a view, numbered on through its blobs. Not "
                            "thread-safe.")
      .def(nb::init<nb::bytes>(), "view"_a)
      .def_prop_ro("triangle_count", [](const PythonDecoder& d) { return d.view.triangle_count; })
      .def_prop_ro("vertex_count", [](const PythonDecoder& d) { return d.view.vertex_count; })
      .def_prop_ro("meshlet_count", [](const PythonDecoder& d) { return d.view.meshlet_count; })
      .def_prop_ro(
          "streams", [](const PythonDecoder& d) { return stream_dicts(d.view); },
          nb::sig("def streams(self) -> list[dict[str, typing.Any]]"),
          "The stream table as dicts, as encode takes them.")
      .def(
          "decode_meshlet", &PythonDecoder::decode_one, "index"_a,
          nb::sig(
              "def decode_meshlet(self, index: int) -> "
              "tuple[numpy.typing.NDArray[numpy.uint8], list[numpy.typing.NDArray[numpy.uint32]]]"),
          "Returns (triangles: uint8[t, 3] local ids, [uint32[v, components] per stream]). Raises\n"
          "IndexError.")
      .def("decode_many", &PythonDecoder::decode_many, "indices"_a,
           nb::sig("def decode_many(self, indices: numpy.typing.NDArray[numpy.uint32]) -> int"),
           "Decodes the meshlets of these numbers (uint32[n]) without making arrays, for timing.\n"
           "Returns the number of their triangles. Raises IndexError.");
}
