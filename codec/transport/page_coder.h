// Codes a page both ways (spec/EXT_meshlet_transport.md, "Pages"): `from` is the page when packing
// and is not looked at when unpacking; `to` is what is known so far, in both directions.
#ifndef TRANSPORT_PAGE_CODER_H
#define TRANSPORT_PAGE_CODER_H
#include "transport/contexts.h"

namespace gltf_meshlet_codec {
namespace MESHLET_BUILD {
namespace transport {

// The packer's choices for a page.
struct Settings {
  bool choices = false;  // positions may take one of their two candidates
  bool smooth = false;   // else their mean is weighted for smooth surfaces
  bool angles = false;   // normals are weighted by angles instead of areas
};

// The parts of a packed page: connectivity and positions; other values; normals.
enum Part : uint8_t { kPositionPart, kValuePart, kNormalPart, kParts };

// Of the residuals around, by the sum of their sizes. The specification counts in tokens.
constexpr uint32_t kMostLevel = 3;
inline uint32_t level_of(uint32_t size) {
  return uint32_t(size >= 3) + uint32_t(size >= 8) + uint32_t(size >= 24);
}
constexpr uint8_t kNext[4] = {1, 2, 0, 1};  // the corners after a corner of a triangle

struct Candidate;  // of a vertex: see value_coder.h

template <class Coder>
class PageCoder {
 public:
  explicit PageCoder(Page& known) : to(known) {}

  Coder coder;
  Settings settings;
  uint64_t room = ~0ull >> 3;  // bytes of the blob
  uint64_t cost[kParts];       // of the packed page's parts
  bool no_memory;              // a function returned false for the lack of it

  // Codes settings, streams and connectivity. Returns false if the page is malformed. triangles,
  // meshlets: of the page.
  bool begin(const Page* from, uint32_t triangles, uint32_t meshlets);
  // Codes the values of stream s; then only streams 0 and s have theirs. Streams come in order.
  // Returns false if the page is malformed.
  bool code_stream(uint32_t s);

 private:
  // How a vertex is predicted: from the triangles opposite to some of its corners, or from some of
  // its neighbours.
  struct Step {
    uint8_t corner[2];  // of the vertex; of neighbours
    uint8_t vertex, candidates, neighbours;
  };

  static constexpr bool kEncodes = !Coder::kDecodes;

  struct Prediction {
    Vertex value;
    uint32_t prediction_class, spread, level;
  };

  template <class... Models>
  uint32_t unsigned_number(uint32_t x, Models&... models);
  template <class... Models>
  uint32_t signed_number(uint32_t x, uint32_t& token, Models&... models);
  uint32_t large_number(uint32_t x, uint32_t sign);
  void code_settings();
  bool code_rows();
  bool code_connectivity(MeshletRow& m);
  bool code_reference(MeshletRow& m, bool fresh, uint32_t& left);
  bool code_length(Reference& r, bool fresh, uint32_t left);
  bool code_foreign(const MeshletRow& m, uint32_t j, bool fresh, bool after_foreign, bool& later);
  uint32_t candidate_of(uint32_t reference, uint32_t meshlet, uint32_t& state) const;
  bool resolve_later_owners(const MeshletRow& m);
  void code_shares(MeshletRow& m, uint32_t j);
  bool code_symbols(MeshletRow& m);
  class Plan;
  uint32_t code_values(MeshletRow& m, uint32_t s, uint32_t first);
  void predict(const MeshletRow& m, uint32_t s, const Step& step, Prediction& p);
  void choose(const MeshletRow& m, const Step& step, const Candidate& one, const Candidate& two,
              Prediction& p);
  void start(uint32_t s, const Step& step, Prediction& p) const;
  uint32_t code_match(uint32_t s, size_t local, uint32_t neighbours);
  Vertex code_residual(uint32_t s, size_t local, const Prediction& p, uint32_t& size);
  void end_part(uint32_t part);
  bool reserve_arrays(uint32_t triangles, uint32_t meshlets);
  bool begin_stream(uint32_t s);
  void sum_normals(uint32_t s);
  void code_normals(uint32_t s);

  const Reference& source(uint32_t reference) const { return from->references[reference]; }
  Vertex source_value(uint32_t s, size_t local) const {
    return load(from->streams[s].values.data(), from->streams[s].id[local]);
  }

  const Page* from = nullptr;
  Page& to;
  Contexts x;
  Buffer<uint8_t> sizes_;     // of the residuals, per vertex of the stream being coded
  Buffer<Step> steps_;        // of stream 0
  Buffer<Step> other_steps_;  // of a meshlet in another stream
  Buffer<uint32_t> order_;    // vertices of the stream as they were coded
  Corners corners_;           // of a meshlet in the stream being coded
  Corners positions_;         // of it in stream 0

  StreamClass class_;  // of the stream being coded
  uint64_t shared_;    // bit s: all references share stream s
  Vertex last_;        // value
  uint32_t last_match_;
  bool bad_;  // a number that the unpacker read is impossible
};

// --- numbers ---

template <class Coder>
uint32_t PageCoder<Coder>::large_number(uint32_t number, uint32_t sign) {
  const uint32_t length = bit_length(number);
  uint32_t l = coder.symbol(x.large, kEncodes ? std::min<uint32_t>(length - kLargeLength, 15) : 0) +
               kLargeLength;
  if (l == kManyBits) l += coder.bits(length - kManyBits, 4);
  l = std::min<uint32_t>(l, 32);
  const uint32_t high = 1u << (l - 1);
  const uint32_t u = high | coder.bits(number & (high - 1), l - 1);
  return sign && coder.bits(sign & 1, 1) ? 0u - u : u;
}

// models: one or two.
template <class Coder>
template <class... Models>
uint32_t PageCoder<Coder>::unsigned_number(uint32_t number, Models&... models) {
  const uint32_t token = coder.symbol(models..., kEncodes ? token_of(number) : 0);
  if (token == kLargeToken) return large_number(number, 0);
  return kTokenBase[token] + coder.bits(number - kTokenBase[token], kTokenBits[token]);
}

// The sign is the lowest of the plain bits, 1 for negative numbers; 0 has none. models: one or two.
// token: of the magnitude. A context made of it instead of the number is known sooner.
template <class Coder>
template <class... Models>
uint32_t PageCoder<Coder>::signed_number(uint32_t number, uint32_t& token, Models&... models) {
  const uint32_t size = magnitude(number), negative = number >> 31;
  token = coder.symbol(models..., kEncodes ? token_of(size) : 0);
  if (token == kLargeToken) return large_number(size, 2 | negative);
  const uint32_t bits =
      coder.bits((size - kTokenBase[token]) << 1 | negative, kTokenBits[token] + (token > 0));
  const uint32_t u = kTokenBase[token] + (bits >> 1);
  return bits & 1 ? 0u - u : u;
}

// --- settings and streams ---

template <class Coder>
void PageCoder<Coder>::code_settings() {
  for (bool* setting : {&settings.choices, &settings.smooth, &settings.angles})
    *setting = coder.bits(*setting, 1);
}

// May the coder use this row? A reader of the blob checks it further.
inline bool usable(const StreamRow& row, bool first) {
  const uint32_t bits = row.bits(), elements = row.elements();
  if (elements < 1 || elements > STREAM_MAX_ELEMENTS || bits < 1 || bits > STREAM_MAX_BITS ||
      row.reserved() != 0)
    return false;
  if (bits > PREDICT_MAX_BITS && row.predictor() != PREDICT_COPY) return false;
  return row.predictor() != PREDICT_GEO ||
         (!first && elements == 2 && bits >= OCT_MIN_BITS && bits <= OCT_MAX_BITS);
}

// A word of a row that is that of the row before takes one bit. Returns false if a row is
// malformed.
template <class Coder>
bool PageCoder<Coder>::code_rows() {
  const uint32_t count = coder.bits(kEncodes ? from->stream_count() - 1 : 0, 6) + 1;
  StreamRow row = {};
  for (uint32_t s = 0; s < count; s++) {
    for (uint32_t i = 0; i < BLOB_STREAM_WORDS; i++) {
      const uint32_t word = kEncodes ? from->rows[s].words[i] : 0;
      if (coder.bits(word != row.words[i], 1)) row.words[i] = coder.bits(word, 32);
    }
    if (!usable(row, s == 0)) return false;
    to.rows.push(row);
  }
  return true;
}

// --- the page ---

template <class Coder>
void PageCoder<Coder>::end_part(uint32_t part) {
  if constexpr (kEncodes) {
    const uint64_t others = cost[0] + cost[1] + cost[2];
    cost[part] += coder.cost() - others;
  }
}

template <class Coder>
bool PageCoder<Coder>::begin_stream(uint32_t s) {
  Stream& stream = to.streams[s];
  // Each stream gets the arrays of the one before: they have room for the largest.
  const bool alike = (shared_ & to.all_streams()) == to.all_streams();
  const uint64_t most_vertices = alike ? to.streams[0].vertices : to.streams[0].id.size();
  no_memory = true;  // unless all of it is there
  if (s == 0) {
    if (!steps_.reserve(stream.vertices)) return false;
  } else {
    if (s > 1) stream.id.take(to.streams[s - 1].id);
    if (s > 1) stream.values.take(to.streams[s - 1].values);
    stream.numbered_as_first = shared_ >> s & 1;
    stream.vertices = stream.numbered_as_first ? to.streams[0].vertices : 0;
    if (!stream.numbered_as_first && !stream.id.reserve(to.streams[0].id.size())) return false;
    for (uint32_t i = 0; i < to.meshlets.size() && !stream.numbered_as_first; i++)
      if (!to.number_vertices(to.meshlets[i], s)) {
        no_memory = false;
        return false;
      }
  }
  sizes_.clear();
  order_.clear();
  const uint64_t vertices = most_vertices < stream.vertices ? stream.vertices : most_vertices;
  if (!stream.values.reserve(4 * vertices) || !sizes_.reserve(vertices) ||
      !order_.reserve(vertices))
    return false;
  no_memory = false;
  const StreamRow& row = to.rows[s];
  class_ = s == 0 ? kPositions : row.kind() == KIND_GRID && row.elements() == 2 ? kPairs : kOthers;
  stream.values.grow(4 * uint64_t(stream.vertices));
  sizes_.grow(stream.vertices);
  last_ = Vertex{};
  last_match_ = 0;
  if constexpr (kEncodes) coder.forget();
  return true;
}

// Makes room for all that the blob can have: no array of connectivity grows further. So what a page
// takes depends on its counts alone, and is the same in WebAssembly, where nothing is freed.
template <class Coder>
bool PageCoder<Coder>::reserve_arrays(uint32_t triangles, uint32_t meshlets) {
  // A meshlet has a bit or more for each of its vertices: R adds one and takes a bit, L adds one
  // and takes two, E adds three at most and takes three; the head has more than the last E adds.
  uint64_t vertices = 8 * room;
  for (uint64_t limit : {MESHLET_VERTICES * uint64_t(meshlets), 3 * uint64_t(triangles)})
    if (limit < vertices) vertices = limit;
  // A reference has a bit beside that of the vertex where it begins.
  const uint64_t references = vertices < 4 * room ? vertices : 4 * room;
  return other_steps_.reserve(MESHLET_VERTICES) && to.rows.reserve(BLOB_MAX_STREAMS) &&
         to.meshlets.reserve(meshlets) && to.triangles.reserve(triangles) &&
         to.opposite.reserve(4 * uint64_t(triangles)) && to.references.reserve(references) &&
         to.streams[0].id.reserve(vertices) && to.traversed.reserve(vertices) &&
         to.border.reserve(vertices) && to.border_corner.reserve(vertices);
}

template <class Coder>
bool PageCoder<Coder>::begin(const Page* source_page, uint32_t triangles, uint32_t meshlets) {
  if (triangles >> 30) return false;  // corners have 32 bits
  from = source_page;
  to.clear();
  x.reset();
  steps_.clear();
  bad_ = no_memory = false;
  for (uint64_t& c : cost) c = 0;
  shared_ = ~0ull;
  code_settings();
  if (!reserve_arrays(triangles, meshlets)) {
    no_memory = true;
    return false;
  }
  if (!code_rows()) return false;
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < meshlets; i++) {
    MeshletRow& m = to.begin_meshlet();
    if (!code_connectivity(m) || to.triangles.size() > triangles) return false;
    // What a page takes is bounded by what the blob can hold.
    bytes += to.least_bytes(m);
    if (bytes > room) return false;
    if (!to.number_vertices(m, 0)) return false;
    to.link_corners(m);
    shared_ &= m.shared;
  }
  return to.triangles.size() == triangles;
}

template <class Coder>
bool PageCoder<Coder>::code_stream(uint32_t s) {
  if (!begin_stream(s)) return false;
  const bool normals = to.rows[s].predictor() == PREDICT_GEO;
  uint32_t first = 0;
  if (normals)
    code_normals(s);
  else
    for (uint32_t i = 0; i < to.meshlets.size(); i++)
      first += code_values(to.meshlets[i], s, first);
  end_part(s == 0 ? kPositionPart : normals ? kNormalPart : kValuePart);
  return !bad_;
}

}  // namespace transport
}  // namespace MESHLET_BUILD
}  // namespace gltf_meshlet_codec

#endif
