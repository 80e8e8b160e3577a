#include "encode/encoder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "encode/bit_writer.h"
#include "encode/edgebreaker.h"
#include "encode/residual_codes.h"
#include "segment/half_edges.h"
#include "decode/serial_decoder.h"
#include "common/parallel.h"

namespace meshlet {
namespace {

constexpr size_t kChunk = 128;              // meshlets per parallel item
constexpr uint32_t kGateTries = 8;          // gates tried per disk
constexpr uint32_t kPredictorSample = 512;  // meshlets sampled to choose a stream's predictor

// Room left below BLOB_MAX_BYTES for tables and the last group.
constexpr size_t kReservedBytes = 64u << 20;

// A meshlet ready to be written: symbols, and references in stream order.
struct Plan {
  struct Ref {
    Reference reference;
    bool loop_end = false;
    bool lone = false;  // alone in its loop
  };
  Symbols symbols;
  std::vector<uint32_t> vertex;  // local id -> vertex of the mesh
  std::vector<Ref> refs;
  std::vector<uint32_t> places;  // boundary places in loop order
  uint64_t known = 0;            // local ids with values before the traversal

  // The reference before refs[i] in its loop.
  const Reference& before(size_t i) const {
    if (i == 0 || refs[i - 1].loop_end)
      while (!refs[i].loop_end) i++;
    else
      i--;
    return refs[i].reference;
  }

  bool all_private() const {
    return std::all_of(refs.begin(), refs.end(), [](const Ref& r) {
      return r.lone && r.reference.kind == ReferenceKind::kPrivate;
    });
  }
};

// Zigzagged residuals of one stream in one meshlet, vertex by vertex.
struct Residuals {
  std::vector<uint32_t> anchor, chain, interior;
};

// The lists of one stream in one meshlet and their codes.
struct Lists {
  std::vector<uint32_t> anchors;  // vertices
  Residuals residuals;
  Code chain, interior;
};

// Width fields of the further anchors of one stream in one meshlet.
struct AnchorFields {
  uint32_t of[STREAM_MAX_ELEMENTS];
};

// residuals: of the further anchors, at least one.
AnchorFields anchor_fields(const std::vector<uint32_t>& residuals, const Stream& stream,
                           uint32_t base) {
  const Code fixed = fixed_code(residuals, stream.elements);
  AnchorFields fields{};
  for (uint32_t c = 0; c < stream.elements; c++)
    fields.of[c] = anchor_field(fixed.widths[c], stream.bits, base);
  return fields;
}

// Bits of the further anchors and of their width fields.
uint64_t further_anchor_bits(const std::vector<uint32_t>& residuals, const Stream& stream,
                             uint32_t base) {
  if (residuals.empty()) return 0;
  const AnchorFields fields = anchor_fields(residuals, stream, base);
  uint64_t bits = 0;
  for (uint32_t c = 0; c < stream.elements; c++)
    bits += ANCHOR_WIDTH_BITS +
            anchor_width(fields.of[c], stream.bits, base) * (residuals.size() / stream.elements);
  return bits;
}

// Runs the first half of the decoder on symbols from memory instead of bits.
void decode_apexes(SerialDecoder& context, const Symbols& symbols) {
  context.error = ERROR_NONE;
  context.triangle_count = symbols.count;
  context.symbol_r = symbols.r;
  context.symbol_e = symbols.e;
  context.symbol_c = symbols.c;
  context.symbol_s = symbols.s;
  context.decode_apexes();
}

// Appends the time between two ends of stages to the statistics.
class StageClock {
 public:
  explicit StageClock(EncoderStats& stats) : stats_(stats) {}
  void end_stage(const char* stage) {
    const Clock::time_point now = Clock::now();
    stats_.stage_seconds.emplace_back(stage, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  EncoderStats& stats_;
  Clock::time_point last_ = Clock::now();
};

class Encoder {
 public:
  Encoder(const MeshView& mesh, const Meshlets& meshlets, std::vector<Stream> streams,
          const VertexValues& values, const EncodeOptions& options)
      : mesh_(mesh),
        streams_(std::move(streams)),
        values_(values),
        options_(options),
        meshlets_(meshlets) {}

  std::vector<uint8_t> encode(EncoderStats& stats);

 private:
  using Context = std::unique_ptr<SerialDecoder>;

  // What the meshlets of a group have in common.
  struct Group {
    uint32_t delta_width = 0, slot_width = 0, reference_width = 0;
    uint32_t flags = 0;  // of any meshlet
    uint32_t table = 0;  // of connectivity
  };

  Context make_context() const;
  void load(SerialDecoder& context, const Plan& plan) const;
  void place_references(SerialDecoder& context, const Plan& plan) const;
  void traversed_residuals(SerialDecoder& context, uint32_t s, std::vector<uint32_t>& out) const;
  void chain_residuals(SerialDecoder& context, uint32_t s, uint64_t references,
                       std::vector<uint32_t>& out) const;
  Plan plan_disk(SerialDecoder& context, uint32_t disk, const Reference* first,
                 uint32_t gate) const;
  Plan best_disk(SerialDecoder& context, uint32_t disk) const;
  Plan plan_meshlet(SerialDecoder& context, uint32_t m) const;
  void plan_all();
  uint64_t cost(SerialDecoder& context, const Plan& plan) const;

  std::vector<uint32_t> anchor_residuals(const std::vector<uint32_t>& anchors, uint32_t s) const;
  Residuals residuals(SerialDecoder& context, const Plan& plan, uint32_t s) const;
  std::vector<uint8_t> allowed_predictors(uint32_t s) const;
  void choose_predictors();
  void choose_bases();

  bool own_for(const Reference& r, uint32_t s) const {
    return r.kind != ReferenceKind::kForeign || !(r.shared >> s & 1);
  }
  std::vector<uint32_t> stored_corners(const Plan& plan, uint32_t s) const;
  uint32_t meshlet_of_place(uint32_t place) const {
    return boundaries_.meshlet_of[boundaries_.place_disk[place]];
  }
  uint32_t value(uint32_t s, uint32_t v, uint32_t c) const {
    return values_.values[s][size_t(v) * streams_[s].elements + c];
  }

  void number_slots();
  void measure_groups();
  uint32_t reference_count(const Plan& plan) const {
    return plan.all_private() ? 0 : uint32_t(plan.refs.size());
  }
  void write_header(BitWriter& out, const Plan& plan, const Group& group) const;
  void write_symbols(BitWriter& out, const Symbols& symbols, const Group& group) const;
  Code write_code(BitWriter& out, CodedList list, const std::vector<uint32_t>& residuals,
                  uint32_t elements, uint32_t base) const;
  void write_references(BitWriter& out, const Plan& plan, uint32_t m) const;
  void write_anchors(BitWriter& out, const Lists& lists, uint32_t s) const;
  void write_lists(BitWriter& out, SerialDecoder& context, const Plan& plan,
                   uint32_t* stream_bits) const;
  std::vector<uint8_t> write_meshlet(SerialDecoder& context, uint32_t m,
                                     uint32_t* stream_bits) const;
  uint32_t flags(const Plan& plan) const;
  uint32_t count_vertices() const;
  BitStatistics bit_statistics(const std::vector<uint32_t>& stream_bits, size_t blob_bytes) const;
  std::vector<uint8_t> assemble(const std::vector<std::vector<uint8_t>>& bytes) const;

  template <class Body>  // body(context, m) for every `stride`-th meshlet
  void for_meshlets(uint32_t stride, Body&& body) const {
    size_t count = (meshlet_count_ + stride - 1) / stride;
    parallel_for(options_.threads, (count + kChunk - 1) / kChunk, [&](size_t chunk) {
      Context context = make_context();
      for (size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); i++)
        body(*context, uint32_t(i) * stride);
    });
  }

  const MeshView& mesh_;
  std::vector<Stream> streams_;
  const VertexValues& values_;
  EncodeOptions options_;
  const Meshlets& meshlets_;
  std::vector<int32_t> opposite_;
  Boundaries boundaries_;
  uint32_t meshlet_count_ = 0;
  std::vector<Plan> plans_;
  std::vector<uint8_t> slot_of_place_;  // owned references' slots, by first place
  std::vector<Group> groups_;
};

// Values and predictions of the elements of one vertex.
struct Elements {
  uint32_t of[STREAM_MAX_ELEMENTS];
};

// Predicts the vertex that a packed triangle of `traversed` introduces.
Elements predict_traversed(SerialDecoder& context, uint32_t s, uint32_t triangle) {
  uint32_t predictor = context.stream_predictor[s];
  const uint32_t v = triangle >> 16 & 255u;
  if (predictor == PREDICT_GEO) {
    const uint32_t* normal = context.normals + 4 * v;
    const SerialDecoder::OctPair q =
        context.octahedral_prediction(normal[0], normal[1], normal[2], context.stream_bits[s]);
    return {{q.u, q.v}};
  }
  SerialDecoder::Weights weights{};
  if (predictor == PREDICT_AFFINE) weights = context.traversed_weights(triangle);
  if (predictor >= PREDICT_GEO) predictor = PREDICT_PARALLELOGRAM;
  const bool across = triangle >> 24 != NO_VERTEX;
  const uint32_t* a = context.vertex(s, triangle & 255u);
  const uint32_t* b = context.vertex(s, triangle >> 8 & 255u);
  const uint32_t* o = across ? context.vertex(s, triangle >> 24) : a;
  Elements out{};
  for (uint32_t c = 0; c < context.stream_elements[s]; c++)
    out.of[c] = weights.exist ? context.affine_point(weights, a[c], b[c], o[c])
                              : context.traversed_prediction(predictor, a[c], b[c], o[c], across);
  return out;
}

// Predicts the vertex of chain step j of the context.
Elements predict_chain(SerialDecoder& context, uint32_t s, uint32_t j) {
  const uint32_t step = context.chain_step[j], left = context.chain_left[j];
  const uint32_t predictor = context.stream_predictor[s];
  const uint32_t* before = context.vertex(s, step >> 8 & 255u);
  const uint32_t* end = context.vertex(s, step >> 16 & 255u);
  const uint32_t* earlier = step >> 24 == NO_VERTEX ? before : context.vertex(s, step >> 24);
  SerialDecoder::Weights weights{};
  if (predictor == PREDICT_AFFINE) weights = context.chain_weights(step);
  Elements out{};
  for (uint32_t c = 0; c < context.stream_elements[s]; c++)
    out.of[c] = predictor == PREDICT_COPY
                    ? before[c]
                    : context.affine_chain_point(weights, before[c], end[c], earlier[c], left);
  return out;
}

// A decoder that runs on masks and values from memory instead of bits.
Encoder::Context Encoder::make_context() const {
  auto context = std::make_unique<SerialDecoder>();
  context->stream_total = context->stream_end = uint32_t(streams_.size());
  context->stream_first = 0;
  for (size_t s = 0; s < streams_.size(); s++) {
    context->stream_elements[s] = streams_[s].elements;
    context->stream_predictor[s] = streams_[s].predictor;
    context->stream_element[s] = uint16_t(STREAM_MAX_ELEMENTS * s);
    context->stream_bits[s] = streams_[s].bits;
  }
  return context;
}

// Runs the decoder on the plan's symbols and fills in the mesh's values.
void Encoder::load(SerialDecoder& context, const Plan& plan) const {
  decode_apexes(context, plan.symbols);
  if (context.error == ERROR_NONE) context.decode_triangles();
  if (context.error == ERROR_NONE) context.list_traversed(plan.known);
  if (context.error != ERROR_NONE)
    throw std::logic_error("the encoder made symbols that do not decode");
  for (uint32_t s = 0; s < streams_.size(); s++)
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      for (uint32_t id = 0; id < plan.vertex.size(); id++)
        context.vertex(s, id)[c] = value(s, plan.vertex[id], c);
  if (std::any_of(streams_.begin(), streams_.end(),
                  [](const Stream& s) { return s.predictor == kGeo; }))
    context.sum_normals();
  place_references(context, plan);
}

// Places the plan's references along the boundary loops.
void Encoder::place_references(SerialDecoder& context, const Plan& plan) const {
  uint32_t places = 0, rank = 0, begin = 0;
  for (uint64_t rest = context.boundary; rest; rest &= rest - 1)
    context.loop_vertex[places++] = uint16_t(SerialDecoder::mask_lsb(rest));
  for (size_t i = 0; i < plan.refs.size(); i++) {
    context.reference_rank[i] = uint16_t(rank);
    context.reference_length[i] = uint16_t(plan.refs[i].reference.length);
    rank += plan.refs[i].reference.length;
    context.reference_end[i] = context.loop_vertex[plan.refs[i].loop_end ? begin : rank];
    if (plan.refs[i].loop_end) begin = rank;
  }
}

// --- gates ---

// Plans a disk traversed from the boundary edge `gate`. Its loop then begins with reference
// `first`.
Plan Encoder::plan_disk(SerialDecoder& context, uint32_t disk, const Reference* first,
                        uint32_t gate) const {
  const auto& refs = boundaries_.references[disk];
  Plan plan;
  Traversal traversal = edgebreaker(mesh_, boundaries_, opposite_, gate);
  plan.symbols = traversal.symbols;
  size_t begin = size_t(first - refs.data());
  uint32_t place = boundaries_.next(gate);
  uint64_t known_ranks = 0;
  uint32_t rank = 0;
  for (size_t i = 0; i < refs.size(); i++) {
    Plan::Ref ref{refs[(begin + i) % refs.size()], i + 1 == refs.size(), refs.size() == 1};
    ref.reference.start = place;
    uint32_t known = ref.reference.kind == ReferenceKind::kPrivate ? 1 : ref.reference.length;
    known_ranks |= SerialDecoder::mask_below(known) << rank;
    for (uint32_t n = 0; n < ref.reference.length; n++, place = boundaries_.next(place))
      plan.places.push_back(place);
    rank += ref.reference.length;
    plan.refs.push_back(ref);
  }
  decode_apexes(context, plan.symbols);
  uint64_t rest = context.boundary;
  for (uint32_t i = 0; i < rank; i++, rest &= rest - 1)
    if (known_ranks >> i & 1) plan.known |= rest & (0 - rest);
  context.decode_triangles();
  context.list_traversed(plan.known);
  if (context.error != ERROR_NONE)
    throw std::logic_error("the segmentation made a part that is not a disk");
  plan.vertex.resize(context.vertex_count);
  for (uint32_t t = 0; t < plan.symbols.count; t++)
    for (uint32_t k = 0; k < 3; k++)
      plan.vertex[context.triangles[t] >> 8 * k & 255u] = traversal.corners[t][k];
  return plan;
}

// Bits that depend on the gate: symbols and traversed residuals.
uint64_t Encoder::cost(SerialDecoder& context, const Plan& plan) const {
  load(context, plan);
  uint64_t bits = SerialDecoder::mask_count(~(plan.symbols.r | plan.symbols.e | plan.symbols.c) &
                                            SerialDecoder::mask_below(plan.symbols.count));
  std::vector<uint32_t> traversed;
  for (uint32_t s = 0; s < streams_.size(); s++) {
    traversed.clear();
    traversed_residuals(context, s, traversed);
    bits += rice_bits(traversed, best_rice(traversed));
  }
  return bits;
}

// Tries gates in front of the disk's references, or all around a private loop, and takes the
// cheapest.
Plan Encoder::best_disk(SerialDecoder& context, uint32_t disk) const {
  const auto& refs = boundaries_.references[disk];
  bool free = refs.size() == 1 && refs[0].kind == ReferenceKind::kPrivate;
  uint32_t choices = free ? refs[0].length : uint32_t(refs.size());
  uint32_t tries = std::min(choices, kGateTries);
  Plan best;
  uint64_t least = ~0ull;
  for (uint32_t i = 0; i < tries; i++) {
    uint32_t choice = i * choices / tries;
    const Reference* first = &refs[free ? 0 : choice];
    uint32_t gate =
        free ? boundaries_.loops[disk].begin + choice : boundaries_.previous(first->start);
    Plan plan = plan_disk(context, disk, first, gate);
    uint64_t bits = tries > 1 ? cost(context, plan) : 0;
    if (bits < least) {
      least = bits;
      best = std::move(plan);
    }
  }
  return best;
}

Plan Encoder::plan_meshlet(SerialDecoder& context, uint32_t m) const {
  Plan plan;
  for (uint32_t c = meshlets_.meshlet_begin[m]; c < meshlets_.meshlet_begin[m + 1]; c++) {
    Plan part = best_disk(context, c);
    plan.known |= part.known << plan.vertex.size();
    plan.symbols.append(part.symbols);
    plan.vertex.insert(plan.vertex.end(), part.vertex.begin(), part.vertex.end());
    plan.refs.insert(plan.refs.end(), part.refs.begin(), part.refs.end());
    plan.places.insert(plan.places.end(), part.places.begin(), part.places.end());
  }
  return plan;
}

void Encoder::plan_all() {
  plans_.resize(meshlet_count_);
  for_meshlets(1,
               [&](SerialDecoder& context, uint32_t m) { plans_[m] = plan_meshlet(context, m); });
}

// --- residuals ---

// Appends the residuals of the traversed vertices.
void Encoder::traversed_residuals(SerialDecoder& context, uint32_t s,
                                  std::vector<uint32_t>& out) const {
  for (uint32_t i = 0; i < context.traversed_count; i++) {
    const uint32_t triangle = context.traversed[i];
    const uint32_t* v = context.vertex(s, triangle >> 16 & 255u);
    const Elements prediction = predict_traversed(context, s, triangle);
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      out.push_back(zigzag(v[c] - prediction.of[c], streams_[s].bits));
  }
}

// Appends the residuals of the inner vertices of some references.
void Encoder::chain_residuals(SerialDecoder& context, uint32_t s, uint64_t references,
                              std::vector<uint32_t>& out) const {
  context.list_chains(references);
  for (uint32_t j = 0; j < context.chain_count; j++) {
    const uint32_t* v = context.vertex(s, context.chain_step[j] & 255u);
    const Elements prediction = predict_chain(context, s, j);
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      out.push_back(zigzag(v[c] - prediction.of[c], streams_[s].bits));
  }
}

// Residuals of all anchors but the first, against the first.
std::vector<uint32_t> Encoder::anchor_residuals(const std::vector<uint32_t>& anchors,
                                                uint32_t s) const {
  std::vector<uint32_t> out;
  for (size_t i = 1; i < anchors.size(); i++)
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      out.push_back(zigzag(value(s, anchors[i], c) - value(s, anchors[0], c), streams_[s].bits));
  return out;
}

// The plan must be loaded into the context.
Residuals Encoder::residuals(SerialDecoder& context, const Plan& plan, uint32_t s) const {
  Residuals out;
  uint64_t owned = 0, seams = 0;
  for (size_t i = 0; i < plan.refs.size(); i++) {
    const Reference& r = plan.refs[i].reference;
    if (r.kind == ReferenceKind::kOwned) owned |= 1ull << i;
    if (r.kind == ReferenceKind::kForeign && own_for(r, s)) seams |= 1ull << i;
  }
  out.anchor = anchor_residuals(stored_corners(plan, s), s);
  chain_residuals(context, s, owned, out.chain);
  chain_residuals(context, s, seams, out.interior);
  traversed_residuals(context, s, out.interior);
  return out;
}

// The predictors that the encoder tries for a stream.
std::vector<uint8_t> Encoder::allowed_predictors(uint32_t s) const {
  if (streams_[s].bits > PREDICT_MAX_BITS) return {kCopy};
  std::vector<uint8_t> allowed = {kParallelogram, kMean, kCopy, kDamped};
  for (uint8_t p = kGeo; p < PREDICTORS; p++) {
    std::vector<Stream> streams = streams_;
    streams[s].predictor = p;
    if (streams_problem(streams).empty()) allowed.push_back(p);
  }
  return allowed;
}

// Tries the allowed predictors on a sample of meshlets, for streams whose predictor is not given.
void Encoder::choose_predictors() {
  std::vector<uint32_t> open;
  for (uint32_t s = 0; s < streams_.size(); s++)
    if (streams_[s].predictor == kChoosePredictor) {
      open.push_back(s);
      streams_[s].predictor = streams_[s].bits > PREDICT_MAX_BITS ? kCopy : kParallelogram;
    }
  std::vector<std::vector<uint8_t>> allowed(streams_.size());
  for (uint32_t s : open) allowed[s] = allowed_predictors(s);
  uint32_t stride = (meshlet_count_ + kPredictorSample - 1) / kPredictorSample;
  std::vector<Plan> sample(meshlet_count_ / stride + 1);
  for_meshlets(stride, [&](SerialDecoder& context, uint32_t m) {
    sample[m / stride] = plan_meshlet(context, m);
  });
  std::vector<uint8_t> best(streams_.size(), 0);
  std::vector<uint64_t> least(streams_.size(), ~0ull);
  std::mutex mutex;
  for (size_t i = 0; i < PREDICTORS; i++) {  // the i-th of every stream's
    std::vector<uint32_t> tried;
    for (uint32_t s : open)
      if (i < allowed[s].size()) {
        streams_[s].predictor = allowed[s][i];
        tried.push_back(s);
      }
    std::vector<uint64_t> bits(streams_.size(), 0);
    for_meshlets(stride, [&](SerialDecoder& context, uint32_t m) {
      load(context, sample[m / stride]);
      for (uint32_t s : tried) {
        Residuals r = residuals(context, sample[m / stride], s);
        uint64_t sum = CodeSizes(r.chain, streams_[s].elements).least() +
                       CodeSizes(r.interior, streams_[s].elements).least();
        std::lock_guard<std::mutex> lock(mutex);
        bits[s] += sum;
      }
    });
    for (uint32_t s : tried)
      if (bits[s] < least[s]) {
        least[s] = bits[s];
        best[s] = streams_[s].predictor;
      }
  }
  for (uint32_t s : open) streams_[s].predictor = best[s];
}

// Chooses the bases of each stream with which its lists take the fewest bits.
void Encoder::choose_bases() {
  constexpr size_t kBases = CODE_MAX_PARAMETER + 1;
  using Totals = std::array<std::array<uint64_t, kBases>, 3>;  // anchors, chains, interior
  std::vector<Totals> totals(streams_.size(), Totals{});
  std::mutex mutex;
  for_meshlets(1, [&](SerialDecoder& context, uint32_t m) {
    load(context, plans_[m]);
    for (uint32_t s = 0; s < streams_.size(); s++) {
      const Residuals r = residuals(context, plans_[m], s);
      const CodeSizes chain(r.chain, streams_[s].elements);
      const CodeSizes interior(r.interior, streams_[s].elements);
      std::lock_guard<std::mutex> lock(mutex);
      for (uint32_t b = 0; b < kBases; b++) {
        const uint64_t bits[3] = {
            further_anchor_bits(r.anchor, streams_[s], b),
            chain.of_field(CodedList::kChain, chain.best_field(CodedList::kChain, b), b),
            interior.of_field(CodedList::kInterior, interior.best_field(CodedList::kInterior, b),
                              b)};
        for (size_t list = 0; list < 3; list++)
          totals[s][list][b] = std::min(totals[s][list][b] + bits[list], kImpossible);
      }
    }
  });
  for (uint32_t s = 0; s < streams_.size(); s++) {
    auto best = [&](size_t list) {
      const auto& bits = totals[s][list];
      return uint8_t(std::min_element(bits.begin(), bits.end()) - bits.begin());
    };
    streams_[s].anchor_base = best(0);
    streams_[s].chain_base = best(1);
    streams_[s].interior_base = best(2);
  }
}

// --- bytes ---

void Encoder::number_slots() {
  slot_of_place_.assign(boundaries_.half_edge.size(), 0);
  for (const Plan& plan : plans_) {
    uint8_t slot = 0;
    for (const Plan::Ref& ref : plan.refs)
      if (ref.reference.kind == ReferenceKind::kOwned) slot_of_place_[ref.reference.start] = slot++;
  }
}

void Encoder::measure_groups() {
  groups_.assign((meshlet_count_ + BLOB_GROUP_MESHLETS - 1) / BLOB_GROUP_MESHLETS, {});
  std::vector<int64_t> gains(groups_.size(), 0);  // bits that table 1 saves
  for (uint32_t m = 0; m < meshlet_count_; m++) {
    Group& g = groups_[m / BLOB_GROUP_MESHLETS];
    const Symbols& y = plans_[m].symbols;
    const int64_t c = SerialDecoder::mask_count(y.c), e = SerialDecoder::mask_count(y.e) - 1,
                  l = SerialDecoder::mask_count(y.lefts());
    gains[m / BLOB_GROUP_MESHLETS] += 2 * l - c - e;
    g.flags |= flags(plans_[m]);
    g.reference_width = std::max(g.reference_width, bit_length(reference_count(plans_[m])));
    for (const Plan::Ref& ref : plans_[m].refs)
      if (ref.reference.kind == ReferenceKind::kForeign) {
        const uint32_t owner = ref.reference.owner_start;
        g.delta_width = std::max(g.delta_width, bit_length(m - meshlet_of_place(owner)));
        g.slot_width = std::max(g.slot_width, bit_length(slot_of_place_[owner]));
      }
  }
  for (size_t g = 0; g < groups_.size(); g++) groups_[g].table = gains[g] > 0;
}

uint32_t Encoder::flags(const Plan& plan) const {
  if (plan.all_private()) return 0;
  uint32_t loops = 0, f = 0;
  for (const Plan::Ref& ref : plan.refs) {
    loops += ref.loop_end;
    if (ref.reference.kind == ReferenceKind::kPrivate) f |= FLAG_PRIVATE;
    if (ref.reference.kind == ReferenceKind::kForeign && ref.reference.shared != ~0ull)
      f |= FLAG_SEAMS;
  }
  return f | (loops > 1 ? FLAG_LOOPS : 0);
}

void Encoder::write_references(BitWriter& out, const Plan& plan, uint32_t m) const {
  if (plan.all_private()) return;
  uint32_t f = flags(plan), width = 0;
  for (const Plan::Ref& ref : plan.refs) out.put(ref.reference.kind == ReferenceKind::kForeign, 1);
  if (f & FLAG_LOOPS)
    for (const Plan::Ref& ref : plan.refs) out.put(ref.loop_end, 1);
  if (f & FLAG_PRIVATE)
    for (const Plan::Ref& ref : plan.refs)
      out.put(ref.reference.kind == ReferenceKind::kPrivate, 1);
  auto sized = [](const Plan::Ref& ref) {
    return ref.reference.kind == ReferenceKind::kOwned ||
           (ref.reference.kind == ReferenceKind::kPrivate && !ref.lone);
  };
  for (const Plan::Ref& ref : plan.refs)
    if (sized(ref)) width = std::max(width, bit_length(ref.reference.length - 1));
  out.put(width, LENGTH_WIDTH_BITS);
  for (const Plan::Ref& ref : plan.refs)
    if (sized(ref)) out.put(ref.reference.length - 1, width);
  const Group& g = groups_[m / BLOB_GROUP_MESHLETS];
  for (const Plan::Ref& ref : plan.refs) {
    if (ref.reference.kind != ReferenceKind::kForeign) continue;
    out.put(m - meshlet_of_place(ref.reference.owner_start), g.delta_width);
    out.put(slot_of_place_[ref.reference.owner_start], g.slot_width);
    if (f & FLAG_SEAMS)
      for (uint32_t s = 1; s < streams_.size(); s++) out.put(ref.reference.shared >> s & 1, 1);
  }
}

// The vertices of the anchors of stream s, in order.
std::vector<uint32_t> Encoder::stored_corners(const Plan& plan, uint32_t s) const {
  std::vector<uint32_t> corners;
  for (size_t i = 0; i < plan.refs.size(); i++)
    if (own_for(plan.refs[i].reference, s) && own_for(plan.before(i), s))
      corners.push_back(boundaries_.vertex[plan.refs[i].reference.start]);
  return corners;
}

// Chooses the cheapest code and writes it.
Code Encoder::write_code(BitWriter& out, CodedList list, const std::vector<uint32_t>& residuals,
                         uint32_t elements, uint32_t base) const {
  const uint32_t field = CodeSizes(residuals, elements).best_field(list, base);
  out.put(field, CODE_BITS);
  if (field != CODE_ESCAPE) return code_of_field(list, field, base);
  const Code code = fixed_code(residuals, elements);
  for (uint32_t c = 0; c < elements; c++)
    out.put(std::min(code.widths[c], WIDTH_ESCAPE), WIDTH_BITS);
  return code;
}

void Encoder::write_header(BitWriter& out, const Plan& plan, const Group& group) const {
  out.put(plan.symbols.count - 1, BLOB_TRIANGLE_BITS);
  out.put(reference_count(plan), group.reference_width);
  for (uint32_t flag : {FLAG_LOOPS, FLAG_PRIVATE, FLAG_SEAMS})
    if (group.flags & flag) out.put((flags(plan) & flag) != 0, 1);
}

// All symbols but the last as a prefix code, a plane for each of its bits.
void Encoder::write_symbols(BitWriter& out, const Symbols& y, const Group& group) const {
  const uint64_t first = group.table ? y.lefts() : y.c, second = group.table ? y.c : y.e;
  uint64_t rest = SerialDecoder::mask_below(y.count - 1);
  for (uint64_t plane : {~y.r, ~first, ~second, y.s}) {
    for (uint64_t left = rest; left; left &= left - 1)
      out.put(plane >> SerialDecoder::mask_lsb(left) & 1, 1);
    rest &= plane;
  }
}

void Encoder::write_anchors(BitWriter& out, const Lists& lists, uint32_t s) const {
  const Stream& stream = streams_[s];
  for (uint32_t c = 0; c < stream.elements && !lists.anchors.empty(); c++)
    out.put(value(s, lists.anchors[0], c), stream.bits);
  if (lists.anchors.size() <= 1) return;
  const AnchorFields fields = anchor_fields(lists.residuals.anchor, stream, stream.anchor_base);
  for (uint32_t c = 0; c < stream.elements; c++) out.put(fields.of[c], ANCHOR_WIDTH_BITS);
  for (size_t i = 0; i < lists.residuals.anchor.size(); i++)
    out.put(lists.residuals.anchor[i],
            anchor_width(fields.of[i % stream.elements], stream.bits, stream.anchor_base));
}

// Writes all streams. Adds the bits of the anchors and residuals of each to stream_bits.
void Encoder::write_lists(BitWriter& out, SerialDecoder& context, const Plan& plan,
                          uint32_t* stream_bits) const {
  const bool chains = std::any_of(plan.refs.begin(), plan.refs.end(), [](const Plan::Ref& r) {
    return r.reference.kind == ReferenceKind::kOwned;
  });
  const uint32_t count = uint32_t(streams_.size());
  std::vector<Lists> all(count);
  for (uint32_t s = 0; s < count; s++) {
    const Stream& stream = streams_[s];
    Lists& lists = all[s];
    lists.anchors = stored_corners(plan, s);
    lists.residuals = residuals(context, plan, s);
    if (chains)
      lists.chain = write_code(out, CodedList::kChain, lists.residuals.chain, stream.elements,
                               stream.chain_base);
    lists.interior = write_code(out, CodedList::kInterior, lists.residuals.interior,
                                stream.elements, stream.interior_base);
  }
  auto for_streams = [&](uint32_t first, uint32_t end, auto write) {
    for (uint32_t s = first; s < end; s++) {
      const uint64_t before = out.bit_count();
      write(all[s], s);
      stream_bits[s] += uint32_t(out.bit_count() - before);
    }
  };
  for_streams(0, count, [&](const Lists& l, uint32_t s) { write_anchors(out, l, s); });
  for_streams(0, count, [&](const Lists& l, uint32_t s) {
    write_low(out, l.residuals.chain, l.chain, streams_[s].elements);
  });
  for_streams(0, count,
              [&](const Lists& l, uint32_t) { write_unary(out, l.residuals.chain, l.chain); });
  for (const auto& [first, end] : {std::pair(0u, 1u), std::pair(1u, count)}) {
    for_streams(first, end, [&](const Lists& l, uint32_t) {
      write_unary(out, l.residuals.interior, l.interior);
    });
    for_streams(first, end, [&](const Lists& l, uint32_t s) {
      write_low(out, l.residuals.interior, l.interior, streams_[s].elements);
    });
  }
}

std::vector<uint8_t> Encoder::write_meshlet(SerialDecoder& context, uint32_t m,
                                            uint32_t* stream_bits) const {
  const Plan& plan = plans_[m];
  const Group& group = groups_[m / BLOB_GROUP_MESHLETS];
  load(context, plan);
  BitWriter out;
  write_header(out, plan, group);
  write_symbols(out, plan.symbols, group);
  write_references(out, plan, m);
  write_lists(out, context, plan, stream_bits);
  out.align(1);
  return out.bytes();
}

// Number of decoded vertices: all local ones except those shared as a whole (spec, appendix A.8).
uint32_t Encoder::count_vertices() const {
  uint32_t count = 0;
  auto alias = [](const Reference& r) {
    return r.kind == ReferenceKind::kForeign && r.shared == ~0ull;
  };
  for (const Plan& plan : plans_) {
    count += uint32_t(plan.vertex.size());
    for (size_t i = 0; i < plan.refs.size(); i++) {
      const Reference& r = plan.refs[i].reference;
      if (alias(r)) count -= r.length - 1;
      count -= alias(r) || alias(plan.before(i));
    }
  }
  return count;
}

// stream_bits: of each stream in each meshlet, meshlet after meshlet.
BitStatistics Encoder::bit_statistics(const std::vector<uint32_t>& stream_bits,
                                      size_t blob_bytes) const {
  BitStatistics out;
  out.streams.assign(streams_.size(), 0);
  for (size_t i = 0; i < stream_bits.size(); i++)
    out.streams[i % streams_.size()] += stream_bits[i];
  out.disks = meshlets_.disk_begin.size() - 1;
  for (size_t m = 0; m < plans_.size(); m++) {
    const Plan& plan = plans_[m];
    const Symbols& y = plan.symbols;
    const uint32_t c = SerialDecoder::mask_count(y.c), e = SerialDecoder::mask_count(y.e),
                   r = SerialDecoder::mask_count(y.r), s = SerialDecoder::mask_count(y.s);
    const uint32_t counts[5] = {c, y.count - c - e - r - s, e, r, s};
    for (int i = 0; i < 5; i++) out.symbols[i] += counts[i];
    const bool table = groups_[m / BLOB_GROUP_MESHLETS].table;
    // 1 bit for R, 2 to 4 for the others, none for the last E.
    const uint32_t l = counts[1], stored_e = e - 1;
    out.connectivity +=
        table ? r + 2 * l + 3 * c + 4 * (stored_e + s) : r + 2 * c + 3 * stored_e + 4 * (l + s);
    for (const Plan::Ref& ref : plan.refs) {
      switch (ref.reference.kind) {
        case ReferenceKind::kOwned: out.owned_references++; break;
        case ReferenceKind::kPrivate: out.private_references++; break;
        case ReferenceKind::kForeign: out.foreign_references++; break;
      }
    }
  }
  out.references = 8 * uint64_t(blob_bytes) - out.connectivity;
  for (uint64_t bits : out.streams) out.references -= bits;
  return out;
}

// Where a group's meshlets start: stride * i - bias + entry i, after the entries.
struct Entries {
  uint32_t stride = 0, bias = 0, width = 0;
  std::vector<uint8_t> bytes;
};

// starts: of the group's meshlets, from its first on; length: of all.
Entries entries_of(const std::vector<uint32_t>& starts, uint32_t length) {
  constexpr int64_t kLargest = 0xFFFF;  // stride and bias
  int64_t stride = std::min<int64_t>(length / starts.size(), kLargest), least, most;
  for (;; stride /= 2) {
    least = most = 0;
    for (size_t i = 0; i < starts.size(); i++) {
      const int64_t deviation = int64_t(starts[i]) - stride * int64_t(i);
      least = std::min(least, deviation);
      most = std::max(most, deviation);
    }
    if (-least <= kLargest) break;
  }
  Entries out;
  out.stride = uint32_t(stride);
  out.bias = uint32_t(-least);
  out.width = bit_length(uint32_t(most - least));
  BitWriter bits;
  for (size_t i = 0; i < starts.size(); i++)
    bits.put(uint32_t(int64_t(starts[i]) - stride * int64_t(i) - least), out.width);
  out.bytes = bits.bytes();
  return out;
}

std::vector<uint8_t> Encoder::assemble(const std::vector<std::vector<uint8_t>>& bytes) const {
  BlobHeader header;
  header.triangle_count = uint32_t(mesh_.triangle_count);
  header.vertex_count = count_vertices();
  header.meshlet_count = meshlet_count_;
  header.data_offset = data_offset(uint32_t(streams_.size()), meshlet_count_);
  header.streams = streams_;
  std::vector<uint8_t> tables, data;
  write_blob_header(header, tables);
  auto put_word = [&](uint32_t w) {
    for (int i = 0; i < 4; i++) tables.push_back(uint8_t(w >> 8 * i));
  };
  for (uint32_t g = 0; g < groups_.size(); g++) {
    const uint32_t begin = g * BLOB_GROUP_MESHLETS,
                   end = std::min(begin + BLOB_GROUP_MESHLETS, meshlet_count_);
    std::vector<uint32_t> starts;
    uint64_t length = 0;
    for (uint32_t m = begin; m < end; m++) {
      starts.push_back(uint32_t(length));
      length += bytes[m].size();
    }
    if (header.data_offset + data.size() + length > BLOB_MAX_BYTES - kReservedBytes)
      throw std::length_error(
          "the primitive is too large: its blob would exceed 448 MiB; split it");
    const Entries entries = entries_of(starts, uint32_t(length));
    put_word(header.data_offset + uint32_t(data.size()));
    put_word(entries.stride | entries.bias << 16);
    put_word(entries.width << GROUP_ENTRY_SHIFT | groups_[g].delta_width << GROUP_DELTA_SHIFT |
             groups_[g].slot_width << GROUP_SLOT_SHIFT |
             groups_[g].reference_width << GROUP_REFERENCE_SHIFT |
             groups_[g].flags << GROUP_FLAGS_SHIFT | groups_[g].table << GROUP_TABLE_SHIFT);
    data.insert(data.end(), entries.bytes.begin(), entries.bytes.end());
    for (uint32_t m = begin; m < end; m++)
      data.insert(data.end(), bytes[m].begin(), bytes[m].end());
  }
  std::vector<uint8_t> blob = std::move(tables);
  blob.insert(blob.end(), data.begin(), data.end());
  blob.resize((blob.size() + BLOB_PADDING_BYTES + 3) / 4 * 4, 0);
  for (int i = 0; i < 4; i++)
    blob[4 * BLOB_WORD_BYTES + i] = uint8_t(uint32_t(blob.size()) >> 8 * i);
  return blob;
}

std::vector<uint8_t> Encoder::encode(EncoderStats& stats) {
  StageClock clock(stats);
  auto progress = [&](float f) {
    if (options_.progress) options_.progress(f);
  };
  meshlet_count_ = uint32_t(meshlets_.meshlet_begin.size() - 1);
  opposite_ = match_half_edges(mesh_.triangles, mesh_.triangle_count, nullptr, mesh_.vertex_count,
                               options_.threads);
  {
    std::vector<int32_t> by_position =
        match_half_edges(mesh_.triangles, mesh_.triangle_count, mesh_.position_ids,
                         mesh_.vertex_count, options_.threads);
    boundaries_ = find_boundaries(mesh_, meshlets_, opposite_, by_position, values_,
                                  options_.share_seams, options_.threads);
  }
  progress(0.25f);
  clock.end_stage("boundaries");
  choose_predictors();
  plan_all();
  progress(0.75f);
  clock.end_stage("predict");
  choose_bases();
  number_slots();
  measure_groups();
  std::vector<std::vector<uint8_t>> bytes(meshlet_count_);
  std::vector<uint32_t> stream_bits(size_t(meshlet_count_) * streams_.size(), 0);
  for_meshlets(1, [&](SerialDecoder& context, uint32_t m) {
    bytes[m] = write_meshlet(context, m, &stream_bits[size_t(m) * streams_.size()]);
  });
  std::vector<uint8_t> blob = assemble(bytes);
  stats.meshlets = meshlet_count_;
  stats.vertices = count_vertices();
  stats.bits = bit_statistics(stream_bits, blob.size());
  progress(1.0f);
  clock.end_stage("write");
  return blob;
}

}  // namespace

void check_input(const MeshView& mesh, const std::vector<Stream>& streams) {
  if (mesh.triangle_count == 0)
    throw std::invalid_argument("a primitive without triangles cannot be encoded");
  if (mesh.triangle_count > (1u << 30) / 3)
    throw std::length_error("the primitive has more than 357 million triangles; split it");
  if (streams.empty() || streams.size() > BLOB_MAX_STREAMS)
    throw std::invalid_argument("a primitive needs 1 to 64 streams");
  std::vector<Stream> known = streams;
  for (Stream& s : known)
    if (s.predictor == kChoosePredictor) s.predictor = kCopy;
  const std::string problem = streams_problem(known);
  if (!problem.empty()) throw std::invalid_argument(problem);
}

Meshlets generate_for_encoder(const MeshView& mesh, const EncodeOptions& options, float share,
                              EncoderStats& stats) {
  StageClock clock(stats);
  GenerationOptions generation = options;
  if (options.progress) generation.progress = [&](float f) { options.progress(share * f); };
  Meshlets meshlets = generate_meshlets(mesh, generation);
  clock.end_stage("grow");
  stats.stage_seconds.back().second -= meshlets.join_seconds;
  stats.stage_seconds.emplace_back("join", meshlets.join_seconds);
  stats.iterations = meshlets.iterations_run;
  std::copy(meshlets.histogram, meshlets.histogram + 4, stats.histogram);
  return meshlets;
}

std::vector<uint8_t> encode_meshlets(const MeshView& mesh, const Meshlets& meshlets,
                                     std::vector<Stream> streams, const VertexValues& values,
                                     const EncodeOptions& options, EncoderStats& stats) {
  check_input(mesh, streams);
  return Encoder(mesh, meshlets, std::move(streams), values, options).encode(stats);
}

std::vector<uint8_t> encode(const MeshView& mesh, std::vector<Stream> streams,
                            const VertexValues& values, const EncodeOptions& options,
                            EncoderStats& stats) {
  constexpr float kGenerationShare = 0.6f;  // of the progress
  check_input(mesh, streams);
  const Meshlets meshlets = generate_for_encoder(mesh, options, kGenerationShare, stats);
  EncodeOptions rest = options;
  if (options.progress)
    rest.progress = [&](float f) {
      options.progress(kGenerationShare + (1 - kGenerationShare) * f);
    };
  return Encoder(mesh, meshlets, std::move(streams), values, rest).encode(stats);
}

}  // namespace meshlet
