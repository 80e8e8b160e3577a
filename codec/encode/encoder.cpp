#include "encode/encoder.h"

#include <algorithm>
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
  std::vector<uint32_t> chain, interior;
};

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

  Context make_context() const;
  void load(SerialDecoder& context, const Plan& plan) const;
  Plan plan_disk(SerialDecoder& context, uint32_t disk, const Reference* first,
                 uint32_t gate) const;
  Plan best_disk(SerialDecoder& context, uint32_t disk) const;
  Plan plan_meshlet(SerialDecoder& context, uint32_t m) const;
  void plan_all();
  uint64_t cost(SerialDecoder& context, const Plan& plan) const;

  void chain_residuals(SerialDecoder& context, uint32_t s, const Reference& r,
                       std::vector<uint32_t>& out) const;
  Residuals residuals(SerialDecoder& context, const Plan& plan, uint32_t s) const;
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
  uint32_t write_code(BitWriter& out, const std::vector<uint32_t>& residuals, const Stream& stream,
                      uint32_t base) const;
  void write_references(BitWriter& out, const Plan& plan, uint32_t m) const;
  void write_anchors(BitWriter& out, const Plan& plan, uint32_t s) const;
  void write_low(BitWriter& out, const std::vector<uint32_t>& residuals, const Stream& stream,
                 uint32_t base, uint32_t code) const;
  void write_unary(BitWriter& out, const std::vector<uint32_t>& residuals, uint32_t base,
                   uint32_t code) const;
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

  struct Group {
    uint8_t delta_width = 0, slot_width = 0;
  };

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

// Residual of element c of the vertex that a packed triangle of `traversed` introduces.
uint32_t traversed_residual(SerialDecoder& context, uint32_t s, uint32_t triangle, uint32_t c) {
  uint32_t at = (context.stream_element[s] + c) * 64u, o = triangle >> 24;
  uint32_t a = at + (triangle & 255u), b = at + (triangle >> 8 & 255u),
           v = at + (triangle >> 16 & 255u);
  bool across = o != NO_VERTEX;
  uint32_t beyond = across ? context.values[at + o] : 0u;
  return zigzag(context.values[v] -
                context.traversed_prediction(context.stream_predictor[s], context.values[a],
                                             context.values[b], beyond, across));
}

// A decoder that runs on masks and values from memory instead of bits.
Encoder::Context Encoder::make_context() const {
  auto context = std::make_unique<SerialDecoder>();
  context->stream_total = context->stream_end = uint32_t(streams_.size());
  context->stream_first = 0;
  uint16_t at = 0;
  for (size_t s = 0; s < streams_.size(); s++) {
    context->stream_elements[s] = streams_[s].elements;
    context->stream_predictor[s] = streams_[s].predictor;
    context->stream_element[s] = at;
    at = uint16_t(at + streams_[s].elements);
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
        context.values[(context.stream_element[s] + c) * 64u + id] = value(s, plan.vertex[id], c);
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
    for (uint32_t i = 0; i < context.traversed_count; i++)
      for (uint32_t c = 0; c < streams_[s].elements; c++)
        traversed.push_back(traversed_residual(context, s, context.traversed[i], c));
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

void Encoder::chain_residuals(SerialDecoder& context, uint32_t s, const Reference& r,
                              std::vector<uint32_t>& out) const {
  uint32_t last = r.start;
  for (uint32_t i = 0; i < r.length; i++) last = boundaries_.next(last);
  uint32_t a = boundaries_.vertex[r.start], b = boundaries_.vertex[last], place = r.start;
  for (uint32_t i = 1; i < r.length; i++) {
    place = boundaries_.next(place);
    for (uint32_t c = 0; c < streams_[s].elements; c++) {
      uint32_t prediction = value(s, a, c);
      if (streams_[s].predictor != kCopy)
        prediction = context.chord(prediction, value(s, b, c), i, r.length);
      out.push_back(zigzag(value(s, boundaries_.vertex[place], c) - prediction));
    }
  }
}

// The plan must be loaded into the context.
Residuals Encoder::residuals(SerialDecoder& context, const Plan& plan, uint32_t s) const {
  Residuals out;
  for (const Plan::Ref& ref : plan.refs) {
    if (ref.reference.kind == ReferenceKind::kOwned)
      chain_residuals(context, s, ref.reference, out.chain);
    if (ref.reference.kind == ReferenceKind::kForeign && own_for(ref.reference, s))
      chain_residuals(context, s, ref.reference, out.interior);
  }
  for (uint32_t i = 0; i < context.traversed_count; i++)
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      out.interior.push_back(traversed_residual(context, s, context.traversed[i], c));
  return out;
}

// Tries all predictors on a sample of meshlets, for streams whose predictor is not given.
void Encoder::choose_predictors() {
  std::vector<uint32_t> open;
  for (uint32_t s = 0; s < streams_.size(); s++)
    if (streams_[s].predictor == kChoosePredictor) {
      open.push_back(s);
      streams_[s].predictor = streams_[s].bits > PREDICT_MAX_BITS ? kCopy : kParallelogram;
    }
  uint32_t stride = (meshlet_count_ + kPredictorSample - 1) / kPredictorSample;
  std::vector<Plan> sample(meshlet_count_ / stride + 1);
  for_meshlets(stride, [&](SerialDecoder& context, uint32_t m) {
    sample[m / stride] = plan_meshlet(context, m);
  });
  std::vector<std::vector<uint64_t>> bits(PREDICTORS, std::vector<uint64_t>(streams_.size(), 0));
  std::vector<uint8_t> best(streams_.size(), 0);
  std::mutex mutex;
  for (uint8_t p = 0; p < PREDICTORS; p++) {
    for (uint32_t s : open)
      if (streams_[s].bits <= PREDICT_MAX_BITS) streams_[s].predictor = p;
    for_meshlets(stride, [&](SerialDecoder& context, uint32_t m) {
      load(context, sample[m / stride]);
      for (uint32_t s : open) {
        Residuals r = residuals(context, sample[m / stride], s);
        uint64_t sum =
            rice_bits(r.chain, best_rice(r.chain)) + rice_bits(r.interior, best_rice(r.interior));
        std::lock_guard<std::mutex> lock(mutex);
        bits[p][s] += sum;
      }
    });
    for (uint32_t s : open)
      if (bits[p][s] < bits[best[s]][s]) best[s] = p;
  }
  for (uint32_t s : open)
    if (streams_[s].bits <= PREDICT_MAX_BITS) streams_[s].predictor = best[s];
}

// Chooses the window of RICE_CODES parameters that contains the best one of most residuals.
void Encoder::choose_bases() {
  std::vector<std::vector<uint64_t>> histogram(2 * streams_.size(),
                                               std::vector<uint64_t>(RICE_MAX + 1, 0));
  std::mutex mutex;
  for_meshlets(1, [&](SerialDecoder& context, uint32_t m) {
    load(context, plans_[m]);
    for (uint32_t s = 0; s < streams_.size(); s++) {
      Residuals r = residuals(context, plans_[m], s);
      uint32_t chain = best_rice(r.chain), interior = best_rice(r.interior);
      std::lock_guard<std::mutex> lock(mutex);
      histogram[2 * s][chain] += r.chain.size();
      histogram[2 * s + 1][interior] += r.interior.size();
    }
  });
  for (uint32_t s = 0; s < streams_.size(); s++)
    for (uint32_t which = 0; which < 2; which++) {
      const auto& h = histogram[2 * s + which];
      uint64_t most = 0;
      uint8_t base = 0;
      for (uint32_t b = 0; b + RICE_CODES <= RICE_MAX + 1; b++) {
        uint64_t sum = 0;
        for (uint32_t k = b; k < b + RICE_CODES; k++) sum += h[k];
        if (sum > most) {
          most = sum;
          base = uint8_t(b);
        }
      }
      (which ? streams_[s].interior_base : streams_[s].chain_base) = base;
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
  for (uint32_t m = 0; m < meshlet_count_; m++)
    for (const Plan::Ref& ref : plans_[m].refs)
      if (ref.reference.kind == ReferenceKind::kForeign) {
        Group& g = groups_[m / BLOB_GROUP_MESHLETS];
        g.delta_width = std::max(
            g.delta_width, uint8_t(bit_length(m - meshlet_of_place(ref.reference.owner_start))));
        g.slot_width =
            std::max(g.slot_width, uint8_t(bit_length(slot_of_place_[ref.reference.owner_start])));
      }
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

void Encoder::write_anchors(BitWriter& out, const Plan& plan, uint32_t s) const {
  std::vector<uint32_t> anchors = stored_corners(plan, s);
  if (anchors.empty()) return;
  const Stream& stream = streams_[s];
  for (uint32_t c = 0; c < stream.elements; c++) out.put(value(s, anchors[0], c), stream.bits);
  if (anchors.size() == 1) return;
  std::vector<uint32_t> deltas;
  uint32_t width = 0;
  for (size_t i = 1; i < anchors.size(); i++)
    for (uint32_t c = 0; c < stream.elements; c++) {
      deltas.push_back(zigzag(value(s, anchors[i], c) - value(s, anchors[0], c)));
      width = std::max(width, bit_length(deltas.back()));
    }
  if (width >= WIDTH_ESCAPE) width = 32;
  out.put(std::min(width, WIDTH_ESCAPE), WIDTH_BITS);
  for (uint32_t d : deltas) out.put(d, width);
}

std::vector<uint32_t> fixed_widths(const std::vector<uint32_t>& residuals, uint32_t elements) {
  std::vector<uint32_t> widths(elements, 0);
  for (size_t i = 0; i < residuals.size(); i++)
    widths[i % elements] = std::max(widths[i % elements], bit_length(residuals[i]));
  for (uint32_t& w : widths)
    if (w >= WIDTH_ESCAPE) w = 32;
  return widths;
}

// Chooses the cheaper code and writes it to section C.
uint32_t Encoder::write_code(BitWriter& out, const std::vector<uint32_t>& residuals,
                             const Stream& stream, uint32_t base) const {
  uint32_t code = 0;
  uint64_t least = ~0ull;
  for (uint32_t i = 0; i < RICE_CODES && base + i <= RICE_MAX; i++) {
    uint64_t bits = rice_bits(residuals, base + i);
    if (bits < least) {
      least = bits;
      code = i;
    }
  }
  std::vector<uint32_t> widths = fixed_widths(residuals, stream.elements);
  uint64_t fixed = WIDTH_BITS * stream.elements;
  for (uint32_t w : widths) fixed += uint64_t(w) * (residuals.size() / stream.elements);
  if (fixed < least) code = CODE_ESCAPE;
  out.put(code, CODE_BITS);
  if (code == CODE_ESCAPE)
    for (uint32_t w : widths) out.put(std::min(w, WIDTH_ESCAPE), WIDTH_BITS);
  return code;
}

void Encoder::write_low(BitWriter& out, const std::vector<uint32_t>& residuals,
                        const Stream& stream, uint32_t base, uint32_t code) const {
  std::vector<uint32_t> widths(stream.elements, base + code);
  if (code == CODE_ESCAPE) widths = fixed_widths(residuals, stream.elements);
  for (size_t i = 0; i < residuals.size(); i++) out.put(residuals[i], widths[i % stream.elements]);
}

void Encoder::write_unary(BitWriter& out, const std::vector<uint32_t>& residuals, uint32_t base,
                          uint32_t code) const {
  if (code == CODE_ESCAPE) return;
  for (uint32_t u : residuals) out.put_unary(u >> (base + code));
}

// Adds the bits of the anchors and residuals of each stream to stream_bits.
std::vector<uint8_t> Encoder::write_meshlet(SerialDecoder& context, uint32_t m,
                                            uint32_t* stream_bits) const {
  const Plan& plan = plans_[m];
  const Symbols& y = plan.symbols;
  uint64_t x = ~(y.r | y.e | y.c) & SerialDecoder::mask_below(y.count);
  load(context, plan);
  BitWriter out;
  out.put_mask(y.e | x, y.count);
  out.put_mask(y.c | x, y.count);
  for (; x; x &= x - 1) out.put(y.s >> SerialDecoder::mask_lsb(x) & 1, 1);
  write_references(out, plan, m);
  bool chains = std::any_of(plan.refs.begin(), plan.refs.end(), [](const Plan::Ref& r) {
    return r.reference.kind == ReferenceKind::kOwned;
  });
  std::vector<Residuals> all;
  std::vector<uint32_t> chain_codes(streams_.size()), interior_codes(streams_.size());
  for (uint32_t s = 0; s < streams_.size(); s++) {
    all.push_back(residuals(context, plan, s));
    if (chains) chain_codes[s] = write_code(out, all[s].chain, streams_[s], streams_[s].chain_base);
    interior_codes[s] = write_code(out, all[s].interior, streams_[s], streams_[s].interior_base);
  }
  uint64_t counted = out.bit_count();
  auto count_for = [&](uint32_t s) {  // adds the bits since the last call to stream s
    stream_bits[s] += uint32_t(out.bit_count() - counted);
    counted = out.bit_count();
  };
  for (uint32_t s = 0; s < streams_.size(); s++) {
    write_anchors(out, plan, s);
    count_for(s);
  }
  for (uint32_t s = 0; s < streams_.size(); s++) {
    write_low(out, all[s].chain, streams_[s], streams_[s].chain_base, chain_codes[s]);
    count_for(s);
  }
  for (uint32_t s = 0; s < streams_.size(); s++) {
    write_unary(out, all[s].chain, streams_[s].chain_base, chain_codes[s]);
    count_for(s);
  }
  for (uint32_t s = 0; s < streams_.size(); s++) {
    write_low(out, all[s].interior, streams_[s], streams_[s].interior_base, interior_codes[s]);
    count_for(s);
  }
  for (uint32_t s = 0; s < streams_.size(); s++) {
    write_unary(out, all[s].interior, streams_[s].interior_base, interior_codes[s]);
    count_for(s);
  }
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
  for (const Plan& plan : plans_) {
    const Symbols& y = plan.symbols;
    const uint32_t c = SerialDecoder::mask_count(y.c), e = SerialDecoder::mask_count(y.e),
                   r = SerialDecoder::mask_count(y.r), s = SerialDecoder::mask_count(y.s);
    const uint32_t counts[5] = {c, y.count - c - e - r - s, e, r, s};
    for (int i = 0; i < 5; i++) out.symbols[i] += counts[i];
    out.connectivity += 3 * y.count - c - e - r;  // 2 bits per triangle, a third for L and S
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

std::vector<uint8_t> Encoder::assemble(const std::vector<std::vector<uint8_t>>& bytes) const {
  BlobHeader header;
  header.triangle_count = uint32_t(mesh_.triangle_count);
  header.vertex_count = count_vertices();
  header.meshlet_count = meshlet_count_;
  header.data_offset = data_offset(uint32_t(streams_.size()), meshlet_count_);
  header.streams = streams_;
  std::vector<uint8_t> blob, data, directory;
  write_blob_header(header, blob);
  auto put_word = [](std::vector<uint8_t>& to, uint32_t w) {
    for (int i = 0; i < 4; i++) to.push_back(uint8_t(w >> 8 * i));
  };
  for (uint32_t g = 0; g < groups_.size(); g++) {
    uint32_t begin = g * BLOB_GROUP_MESHLETS,
             end = std::min(begin + BLOB_GROUP_MESHLETS, meshlet_count_);
    size_t length = 0;
    uint32_t shift = 0;
    auto padded = [&](uint32_t m) {
      return (bytes[m].size() + (size_t(1) << shift) - 1) >> shift << shift;
    };
    do {  // the smallest unit in which the group's offsets fit BLOB_OFFSET_BITS
      length = 0;
      for (uint32_t m = begin; m < end; m++) length += padded(m);
    } while (length >> shift >= (1u << BLOB_OFFSET_BITS) && ++shift <= GROUP_MAX_SHIFT);
    if (data.size() + length > BLOB_MAX_BYTES - kReservedBytes)
      throw std::length_error(
          "the primitive is too large: its blob would exceed 448 MiB; split it");
    put_word(blob, uint32_t(data.size()));
    put_word(blob, groups_[g].delta_width | uint32_t(groups_[g].slot_width) << 8 | shift << 16);
    size_t offset = 0;
    for (uint32_t m = begin; m < end; m++) {
      const Plan& plan = plans_[m];
      uint32_t references = plan.all_private() ? 0 : uint32_t(plan.refs.size());
      put_word(directory, uint32_t(offset >> shift) | (plan.symbols.count - 1) << BLOB_OFFSET_BITS |
                              references << REFERENCES_SHIFT | flags(plan) << FLAGS_SHIFT);
      data.insert(data.end(), bytes[m].begin(), bytes[m].end());
      data.resize(data.size() + padded(m) - bytes[m].size(), 0);
      offset += padded(m);
    }
  }
  blob.insert(blob.end(), directory.begin(), directory.end());
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
  for (const Stream& s : streams) {
    Stream known = s;
    if (known.predictor == kChoosePredictor) known.predictor = kCopy;
    std::string problem = stream_problem(known);
    if (!problem.empty()) throw std::invalid_argument(problem);
  }
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
