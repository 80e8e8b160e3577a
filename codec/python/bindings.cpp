// gltf_ext._codec: the native codec as Python sees it.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "decode/decoder_context.h"
#include "decode/statistics.h"
#include "encode/encoder.h"
#include "segment/weld.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace meshlet {
namespace {

using Bytes = nb::ndarray<const uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Ids = nb::ndarray<const uint32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Points = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class T>
nb::object new_array(size_t rows, size_t columns, T*& data) {
  data = new T[rows * columns];
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T, nb::ndim<2>>(data, {rows, columns}, owner));
}

nb::dict stream_dict(const Stream& s) {
  nb::list offset;
  for (int c = 0; c < s.components; c++) offset.append(s.offset[c]);
  nb::dict d;
  d["kind"] = s.kind;
  d["components"] = s.components;
  d["bits"] = s.bits;
  d["predictor"] = s.predictor;
  d["chain_base"] = s.chain_base;
  d["interior_base"] = s.interior_base;
  d["step"] = s.step;
  d["offset"] = offset;
  return d;
}

nb::dict description_dict(const BlobHeader& h, const Description& d) {
  nb::dict out, bits, symbols, references;
  nb::list streams, stream_bits;
  for (const Stream& s : h.streams) streams.append(stream_dict(s));
  for (uint64_t b : d.streams) stream_bits.append(b);
  bits["connectivity"] = d.connectivity;
  bits["references"] = d.references;
  bits["streams"] = stream_bits;
  const char* names[5] = {"C", "L", "E", "R", "S"};
  for (int i = 0; i < 5; i++) symbols[names[i]] = d.symbols[i];
  references["owned"] = d.kinds[0];
  references["private"] = d.kinds[1];
  references["foreign"] = d.kinds[2];
  out["triangles"] = h.triangle_count;
  out["vertices"] = h.vertex_count;
  out["meshlets"] = h.meshlet_count;
  out["components"] = d.components;
  out["streams"] = streams;
  out["bits"] = bits;
  out["symbols"] = symbols;
  out["references"] = references;
  return out;
}

int integer(const nb::dict& d, const char* key) {
  if (!d.contains(key))
    throw nb::value_error((std::string("a stream lacks '") + key + "'").c_str());
  return nb::cast<int>(d[key]);
}

Stream stream_of(const nb::dict& d) {
  Stream s;
  s.kind = uint8_t(integer(d, "kind"));
  s.components = uint8_t(integer(d, "components"));
  s.bits = uint8_t(integer(d, "bits"));
  int predictor = d.contains("predictor") ? nb::cast<int>(d["predictor"]) : -1;
  s.predictor = predictor < 0 ? kChoosePredictor : uint8_t(predictor);
  if (d.contains("step")) s.step = nb::cast<float>(d["step"]);
  if (d.contains("offset")) {
    nb::sequence offset = nb::cast<nb::sequence>(d["offset"]);
    for (size_t c = 0; c < std::min<size_t>(nb::len(offset), 4); c++)
      s.offset[c] = nb::cast<float>(offset[c]);
  }
  return s;
}

nb::tuple weld(const Bytes& rows) {
  uint32_t* remap;
  nb::object array = new_array(rows.shape(0), 1, remap);
  uint32_t unique;
  {
    nb::gil_scoped_release release;
    unique = weld_rows(rows.data(), rows.shape(0), rows.shape(1), remap);
  }
  return nb::make_tuple(array.attr("reshape")(-1), unique);
}

void check_mesh(const Indices& triangles, const Ids& position_ids, size_t vertices) {
  if (position_ids.shape(0) != vertices)
    throw nb::value_error("position_ids and positions differ in length");
  for (size_t v = 0; v < vertices; v++)
    if (position_ids.data()[v] >= vertices) throw nb::value_error("a position id is out of range");
  const uint32_t* t = triangles.data();
  for (size_t i = 0; i < triangles.shape(0); i++, t += 3) {
    if (t[0] >= vertices || t[1] >= vertices || t[2] >= vertices)
      throw nb::value_error("a triangle index is out of range");
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      throw nb::value_error("a triangle repeats an index");
  }
}

VertexValues vertex_values(const std::vector<Stream>& streams, const std::vector<Values>& values,
                           size_t vertices) {
  if (streams.size() != values.size()) throw nb::value_error("streams and values differ in number");
  VertexValues out;
  for (size_t s = 0; s < streams.size(); s++) {
    if (values[s].shape(0) != vertices || values[s].shape(1) != streams[s].components)
      throw nb::value_error("a stream's values have the wrong shape");
    uint32_t mask = streams[s].bits >= 32 ? ~0u : (1u << streams[s].bits) - 1u, over = 0;
    for (size_t i = 0; i < vertices * streams[s].components; i++)
      over |= values[s].data()[i] & ~mask;
    if (over) throw nb::value_error("a stream's value does not fit its bits");
    out.values.push_back(values[s].data());
    out.components.push_back(streams[s].components);
  }
  return out;
}

nb::tuple encode_primitive(const Indices& triangles, const Ids& position_ids,
                           const Points& positions, const std::vector<nb::dict>& stream_dicts,
                           const std::vector<Values>& values, int max_triangles, int max_vertices,
                           float lambda, int iterations, float fill, const std::string& weight,
                           bool share_seams, int threads, nb::object progress) {
  size_t vertices = positions.shape(0);
  check_mesh(triangles, position_ids, vertices);
  std::vector<Stream> streams;
  for (const nb::dict& d : stream_dicts) streams.push_back(stream_of(d));
  VertexValues all = vertex_values(streams, values, vertices);
  if (max_triangles < 1 || max_triangles > 64 || max_vertices < 3 || max_vertices > 64)
    throw nb::value_error("a meshlet holds 1 to 64 triangles and 3 to 64 vertices");
  if (weight != "paper" && weight != "choe") throw nb::value_error("weight is 'paper' or 'choe'");
  EncodeOptions options;
  options.max_triangles = max_triangles;
  options.max_vertices = max_vertices;
  if (lambda > 0) options.lambda = lambda;
  if (iterations > 0) options.iterations = iterations;
  if (fill > 0) options.fill = fill;
  options.weight = weight == "paper" ? Weight::paper : Weight::choe;
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
  std::vector<uint8_t> blob;
  {
    nb::gil_scoped_release release;
    blob = encode(mesh, streams, all, options, stats);
  }
  nb::dict out = description_dict(read_blob_header(blob.data(), blob.size()), stats.description);
  nb::dict generation;
  generation["histogram"] = nb::make_tuple(stats.histogram[0], stats.histogram[1],
                                           stats.histogram[2], stats.histogram[3]);
  generation["iterations"] = stats.iterations;
  out["generation"] = generation;
  return nb::make_tuple(nb::bytes(blob.data(), blob.size()), out);
}

nb::tuple decode_blob(const nb::bytes& blob, bool as_values) {
  Decoder decoder(static_cast<const uint8_t*>(blob.data()), blob.size());
  const BlobHeader& h = decoder.header();
  uint32_t* triangles;
  nb::object triangle_array = new_array(h.triangle_count, 3, triangles);
  std::vector<uint32_t*> integers(h.streams.size(), nullptr);
  std::vector<void*> values(h.streams.size(), nullptr);
  nb::list arrays;
  for (size_t s = 0; s < h.streams.size(); s++) {
    if (!as_values) {
      arrays.append(new_array(h.vertex_count, h.streams[s].components, integers[s]));
    } else if (h.streams[s].kind == kInteger) {
      uint32_t* data;
      arrays.append(new_array(h.vertex_count, h.streams[s].components, data));
      values[s] = data;
    } else {
      float* data;
      arrays.append(new_array(h.vertex_count, value_elements(h.streams[s]), data));
      values[s] = data;
    }
  }
  {
    nb::gil_scoped_release release;
    decoder.decode(triangles, integers.data(), values.data());
  }
  return nb::make_tuple(triangle_array, arrays);
}

// A Decoder that keeps its bytes.
class OpenBlob {
 public:
  explicit OpenBlob(nb::bytes blob)
      : blob_(std::move(blob)), decoder_(static_cast<const uint8_t*>(blob_.data()), blob_.size()) {}

  const BlobHeader& header() const { return decoder_.header(); }

  nb::list streams() const {
    nb::list out;
    for (const Stream& s : header().streams) out.append(stream_dict(s));
    return out;
  }

  nb::tuple decode_meshlet(uint32_t m) {
    if (m >= header().meshlet_count) throw nb::index_error("no such meshlet");
    SerialDecoder& d = decoder_.meshlet(m);
    uint8_t* triangles;
    nb::object triangle_array = new_array(d.triangle_count, 3, triangles);
    for (uint32_t i = 0; i < 3 * d.triangle_count; i++)
      triangles[i] = uint8_t(d.triangles[i / 3] >> 8 * (i % 3));
    nb::list arrays;
    for (uint32_t s = 0; s < d.stream_total; s++) {
      uint32_t* data;
      arrays.append(new_array(d.vertex_count, d.stream_elements[s], data));
      for (uint32_t v = 0; v < d.vertex_count; v++)
        for (uint32_t c = 0; c < d.stream_elements[s]; c++)
          *data++ = d.values[(d.stream_element[s] + c) * 64u + v];
    }
    return nb::make_tuple(triangle_array, arrays);
  }

  // Decodes the meshlets of the given numbers one after another, without making arrays of them;
  // returns the number of triangles.
  uint64_t decode_many(const Ids& numbers) {
    nb::gil_scoped_release release;
    uint64_t triangles = 0;
    for (size_t i = 0; i < numbers.shape(0); i++) {
      if (numbers.data()[i] >= header().meshlet_count) throw nb::index_error("no such meshlet");
      triangles += decoder_.meshlet(numbers.data()[i]).triangle_count;
    }
    return triangles;
  }

 private:
  nb::bytes blob_;
  Decoder decoder_;
};

nb::dict describe_blob(const nb::bytes& blob) {
  const uint8_t* data = static_cast<const uint8_t*>(blob.data());
  return description_dict(read_blob_header(data, blob.size()), describe(data, blob.size()));
}

void validate(const nb::bytes& blob) {
  Decoder(static_cast<const uint8_t*>(blob.data()), blob.size()).validate();
}

}  // namespace
}  // namespace meshlet

NB_MODULE(_codec, m) {
  using namespace meshlet;
  m.doc() =
      "Native codec of EXT_meshlet_edgebreaker. Everything raises ValueError with one sentence on "
      "malformed input.";
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const Malformed& e) {
      PyErr_SetString(PyExc_ValueError, e.what());
    }
  });
  m.def("weld", &weld, "rows"_a,
        "rows: uint8[N, stride]. Returns (remap: uint32[N], unique: int): bit-identical rows get "
        "one id, in order of first occurrence.");
  m.def("encode", &encode_primitive, "triangles"_a, "position_ids"_a, "positions"_a, "streams"_a,
        "values"_a, "max_triangles"_a = 64, "max_vertices"_a = 64, "lambda_"_a = 0.0f,
        "iterations"_a = 0, "fill"_a = 0.0f, "weight"_a = "paper", "share_seams"_a = true,
        "threads"_a = 0, "progress"_a = nb::none(),
        "Encodes one primitive. triangles: uint32[T, 3] without repeated indices; position_ids: "
        "uint32[V], equal where positions are;\n"
        "positions: float32[V, 3]; streams: dicts of kind, components, bits, step, offset and "
        "predictor (-1: the encoder chooses);\n"
        "values: uint32[V, components] per stream. lambda_, iterations and fill: 0 takes the "
        "default. share_seams: off only to measure what it gives. threads: "
        "0 is one per processor.\n"
        "Returns (blob: bytes, stats: dict), stats as describe has them, with 'generation'.");
  m.def(
      "decode", [](const nb::bytes& blob) { return decode_blob(blob, false); }, "blob"_a,
      "Returns (triangles: uint32[T, 3], [uint32[V, components] per stream]).");
  m.def(
      "decode_values", [](const nb::bytes& blob) { return decode_blob(blob, true); }, "blob"_a,
      "Returns (triangles: uint32[T, 3], [values per stream]): float32[V, components], float32[V, "
      "3] unit vectors for OCT, uint32 for INTEGER.");
  m.def("describe", &describe_blob, "blob"_a,
        "Counts, streams, and where the bits go; the parts of 'bits' sum to 8 * len(blob).");
  m.def("validate", &validate, "blob"_a,
        "Decodes every meshlet on its own; raises ValueError if the blob is malformed in any way, "
        "also those that decode may accept.");
  nb::class_<OpenBlob>(m, "Decoder", "Decodes single meshlets of one blob.")
      .def(nb::init<nb::bytes>(), "blob"_a)
      .def_prop_ro("triangle_count", [](const OpenBlob& b) { return b.header().triangle_count; })
      .def_prop_ro("vertex_count", [](const OpenBlob& b) { return b.header().vertex_count; })
      .def_prop_ro("meshlet_count", [](const OpenBlob& b) { return b.header().meshlet_count; })
      .def_prop_ro("streams", &OpenBlob::streams)
      .def("decode_meshlet", &OpenBlob::decode_meshlet, "index"_a,
           "Returns (triangles: uint8[t, 3] local ids, [uint32[v, components] per stream]).")
      .def("decode_many", &OpenBlob::decode_many, "indices"_a,
           "Decodes the meshlets of the given numbers (uint32[n]) into preallocated memory, for "
           "timing; returns their triangles.");
}
