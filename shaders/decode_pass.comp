// Decodes a whole blob in passes, each with an invocation for every small part: after connect.comp the lengths of the references, then the
// corners' values, the chains' and last the interior's. What a pass finds goes into the result, where the next one reads it.
// variants: lengths.comp=PASS=0 corners.comp=PASS=1 chains.comp=PASS=2 interior.comp=PASS=3
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define PASS_LENGTHS 0
#define PASS_CORNERS 1
#define PASS_CHAINS 2
#define PASS_INTERIOR 3
#define PER_MESHLET 8u                     // invocations that share a meshlet's references or corners

layout(local_size_x = 64) in;
#include "decode_push.glsl"
#include "meshlet_decoder_prologue.glsl"
#include "meshlet_decoder.glsl"
#include "meshlet_decoder_epilogue.glsl"
#include "meshlet_sections.glsl"
#include "packed_values.glsl"

uint the_meshlet;
mask64 the_boundary;
mask64 the_starts;

// ---- where things are ------------------------------------------------------------------------------------------------------------

uint packed_triangle(uint t) { return Integers(push.triangles).at[64u * the_meshlet + t]; }
uint reference_length_at(uint r) { return Integers(push.lengths).at[64u * the_meshlet + (r & 63u)]; }
uint value_at(uint s, uint c, uint id) { return packed_value(push.values, the_meshlet * push.vertex_words * 64u, s, c, id & 63u); }
void put_value(uint s, uint c, uint id, uint value) {
  put_packed_value(push.values, the_meshlet * push.vertex_words * 64u, s, c, id & 63u, value & bits_mask(s));
}
uvec2 vertex_at(uint s, uint id) { return packed_vertex(push.values, the_meshlet * push.vertex_words * 64u, s, id & 63u); }
void put_vertex(uint s, uint id, uvec2 fields) { put_packed_vertex(push.values, the_meshlet * push.vertex_words * 64u, s, id & 63u, fields); }

// The n-th one of a mask, from 0; 63 or less also where there is none.
uint nth_bit(mask64 m, uint n) {
  uint low = uint(bitCount(m.x));
  uint at = n < low ? 0u : 32u;
  uint word = n < low ? m.x : m.y;
  if (n >= low) n -= low;
  for (uint half_width = 16u; half_width > 0u; half_width >>= 1) {
    uint ones = uint(bitCount(word & word_below(half_width)));
    if (n >= ones) {
      n -= ones;
      at += half_width;
      word >>= half_width;
    }
  }
  return min(at, 63u);
}

// Local ids before component k.
uint ids_before(uint k) {
  uint t = k >= mask_count(the_starts) ? triangle_count : nth_bit(the_starts, k);
  return min(64u, pushed_vertices(mask_below(t)) + min(k, mask_count(the_starts)));
}

// The loop that reference r of h belongs to: its first place in the loop order, and the one behind its last.
uvec2 loop_of(HEADER_IN h, uint r) {
  uint k = mask_count(h.loop_ends & mask_below(r));
  return uvec2(mask_count(the_boundary & mask_below(ids_before(k))), mask_count(the_boundary & mask_below(ids_before(k + 1u))));
}

uint rank_of(uint r) {
  uint rank = 0u;
  for (uint before = 0u; before < r; before++) rank += reference_length_at(before);
  return rank;
}

uint id_at(uint rank) { return nth_bit(the_boundary, rank); }

// The header of foreign reference r's owner, and the reference's number there.
Header owner_header(HEADER_IN h, uint r, out uint reference) {
  uint entry = entry_position(h, r);
  Header owner = read_header(entry_owner(h, entry));
  reference = slot_reference(owner, entry_slot(h, entry)) & 63u;
  return owner;
}

// ---- sections --------------------------------------------------------------------------------------------------------------------

// Where section D begins.
uint anchors_begin(HEADER_IN h) {
  uint p = h.codes;
  bool chains = mask_any(h.owned_refs);
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    if (chains) code_at(p, n, stream_field(s, STREAM_CHAIN_BASE));
    code_at(p, n, stream_field(s, STREAM_INTERIOR_BASE));
  }
  return p;
}

// Anchors of stream s, where `count` is their number for the stream before it, or a meshlet without references.
uint anchors_of(HEADER_IN h, uint s, uint count) {
  if (h.references == 0u || (s > 0u && (h.flags & FLAG_SEAMS) == 0u)) return count;
  return mask_count(stored_corners(h, seam_references(h, s)));
}

uint after_anchors(uint p, uint s, uint count) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  if (count > 0u) p += n * stream_field(s, STREAM_BITS);
  if (count > 1u) p += 5u + (count - 1u) * n * width_field(p);
  return p;
}

// Inner vertices of the owned references before `reference`.
uint chain_vertices(HEADER_IN h, uint reference) {
  uint total = 0u;
  uint lengths = h.lengths;
  for (mask64 rest = h.sized_refs & mask_below(reference); mask_any(rest); rest = mask_clear_lsb(rest)) {
    if (mask_test(h.owned_refs, mask_lsb(rest))) total += load_bits(lengths, h.length_width);
    lengths += h.length_width;
  }
  return total;
}

// ---- residuals -------------------------------------------------------------------------------------------------------------------

uint residual_code;                        // Rice parameter, or CODE_FIXED with
uvec2 residual_widths;                     //   these widths: six bits per component
uint low_position;                         // bit position of the next residual's low bits
uint low_index;                            // the two words that were read last, from this one on
uvec2 low_words;

void seek_low(uint p) {
  low_position = p;
  low_index = p >> 5;
  low_words = load_words2(low_index);
}

uint take_low(uint width) {
  uint w = low_position >> 5;
  if (w != low_index) {
    low_words = uvec2(w == low_index + 1u ? low_words.y : load_word(w), load_word(w + 1u));
    low_index = w;
  }
  uint bits = funnel(low_words.x, low_words.y, low_position & 31u) & word_below(width);
  low_position += width;
  return bits;
}

uvec2 fixed_widths(uint position, uint n) {
  uvec2 widths = uvec2(0u);
  for (uint c = 0u; c < n; c++) widths |= put_field(6u * c, width_field(position + 5u * c));
  return widths;
}

uint next_residual(uint c) {
  if (residual_code == CODE_FIXED) return unzigzag(take_low(get_field(residual_widths, 6u * c, 6u)));
  uint low = take_low(residual_code);
  return unzigzag(low | next_quotient(unary) << residual_code);
}

#if PASS == PASS_LENGTHS
void run(HEADER_IN h, uint part) {
  for (uint r = part; r < h.references; r += PER_MESHLET) {
    uint length;
    if (mask_test(h.foreign_refs, r)) {
      uint reference;
      Header owner = owner_header(h, r, reference);
      length = stored_length(owner, reference);
    } else if (mask_test(h.sized_refs, r)) {
      length = stored_length(h, r);
    } else {
      uvec2 loop = loop_of(h, r);
      length = loop.y - loop.x;
    }
    Integers(push.lengths).at[64u * the_meshlet + r] = min(length, 64u);
  }
}
#endif

#if PASS == PASS_CORNERS
void read_anchors(HEADER_IN h, uint index, uint begin, uint end, uint id) {
  uint p = anchors_begin(h);
  uint count = mask_count(the_starts);
  for (uint s = 0u; s < end; s++) {
    count = anchors_of(h, s, count);
    uint n = stream_field(s, STREAM_COMPONENTS);
    uint bits = stream_field(s, STREAM_BITS);
    uint width = index > 0u ? width_field(p + n * bits) : 0u;
    uint deltas = p + n * bits + 5u + (index - 1u) * n * width;
    for (uint c = 0u; c < n && s >= begin; c++) {
      uint value = load_bits(p + c * bits, bits);
      if (index > 0u) value += unzigzag(load_bits(deltas + c * width, width));
      put_value(s, c, id, value);
    }
    p = after_anchors(p, s, count);
  }
}

// Follows references from corner j to where it is stored, for the streams that go the same way from `s` on; returns the one after them.
uint read_corner(HEADER_IN own, uint j, uint s, uint id) {
  Header h = own;
  bool apart = false;
  for (uint hop = 0u; hop <= MAX_HOPS && error == ERROR_NONE; hop++) {
    apart = apart || (h.flags & FLAG_SEAMS) != 0u;
    mask64 seams = seam_references(h, s);
    mask64 shared_refs = h.foreign_refs & ~seams;
    uint before = h.references > 0u ? previous_reference(h, j) & 63u : 0u;
    bool follow = mask_test(shared_refs, j);
    bool follow_before = mask_test(shared_refs, before);
    if (!follow && !follow_before) {
      uint end = apart ? s + 1u : stream_end;
      read_anchors(h, h.references == 0u ? j : mask_count(stored_corners(h, seams) & mask_below(j)), s, end, id);
      return end;
    }
    if (follow && follow_before) follow = owner_of(h, before) >= owner_of(h, j);
    uint reference;
    Header owner = owner_header(h, follow ? j : before, reference);
    j = follow ? next_reference(owner, reference) & 63u : reference;
    h = owner;
  }
  if (error == ERROR_NONE) error = ERROR_HOPS;
  return stream_end;
}

void check_lengths(HEADER_IN h, uint r, uint rank) {
  uvec2 loop = loop_of(h, r);
  uint end = rank + reference_length_at(r);
  if (r == loop_begin(h, r) && rank != loop.x) error = ERROR_REFERENCES;
  if (mask_test(h.loop_ends, r) ? end != loop.y : end > loop.y) error = ERROR_REFERENCES;
}

void run(HEADER_IN h, uint part) {
  uint components = mask_count(the_starts);
  if (h.references > 0u && mask_count(h.loop_ends) != components) error = ERROR_REFERENCES;
  uint corners = h.references == 0u ? components : h.references;
  for (uint j = part; j < corners; j += PER_MESHLET) {
    uint rank = h.references == 0u ? 0u : rank_of(j);
    if (h.references > 0u) check_lengths(h, j, rank);
    uint id = h.references == 0u ? ids_before(j) & 63u : id_at(rank);
    for (uint s = 0u; s < stream_end && error == ERROR_NONE;) s = read_corner(h, j, s, id);
  }
}
#endif

#if PASS == PASS_CHAINS
// One chain for one stream: the residuals on the chord between the run's ends.
void read_chain(uint s, uint code, uint widths, uint low, uint rank, uint length, uint from, uint to, bool backwards) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  residual_code = code;
  seek_low(low);
  bool vectors = is_packed(s);
  uint field = field_bits(s);
  uint mask = bits_mask(s);
  uvec2 begin = vectors ? vertex_at(s, backwards ? to : from) : uvec2(0u);
  uvec2 end = vectors ? vertex_at(s, backwards ? from : to) : uvec2(0u);
  residual_widths = code == CODE_FIXED ? fixed_widths(widths, n) : uvec2(0u);
  for (uint i = 1u; i < length && error == ERROR_NONE; i++) {
    uint id = id_at(rank + (backwards ? length - i : i));
    uvec2 fields = uvec2(0u);
    for (uint c = 0u; c < n; c++) {
      uint a = vectors ? get_field(begin, c * field, field) : value_at(s, c, backwards ? to : from);
      uint b = vectors ? get_field(end, c * field, field) : value_at(s, c, backwards ? from : to);
      uint value = ((copies ? a : chord_point(a, b, i, length)) + next_residual(c)) & mask;
      if (vectors) fields |= put_field(c * field, value);
      else put_value(s, c, id, value);
    }
    if (vectors) put_vertex(s, id, fields);
  }
  if (low_position > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}

void run_reference(HEADER_IN h, uint r) {
  uint length = min(reference_length_at(r), 64u);
  if (mask_test(h.private_refs, r) || length < 2u) return;
  Header owner = h;
  uint reference = r;
  bool foreign = mask_test(h.foreign_refs, r);
  if (foreign) owner = owner_header(h, r, reference);
  uint first = chain_vertices(owner, reference);
  uint total = chain_vertices(owner, 64u);
  uint low = anchors_begin(owner);
  uint count = mask_count(the_starts);
  for (uint s = 0u; s < stream_total; s++) {
    count = anchors_of(owner, s, count);
    low = after_anchors(low, s, count);
  }
  uint widths_total = 0u;
  uint codes = owner.codes;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
    widths_total += low_width(code, n, codes - 5u * n);
    code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
  }
  uint quotients = low + total * widths_total;
  uint rank = rank_of(r);
  uint from = id_at(rank);
  uint to = id_at(mask_test(h.loop_ends, r) ? loop_of(h, r).x : rank + length);
  uint skipped = 0u;                       // quotients between the last one read and the next chain
  codes = owner.codes;
  for (uint s = 0u; s < stream_end && error == ERROR_NONE; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
    uint widths = codes - 5u * n;
    uint width = low_width(code, n, widths);
    code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint rice = code == CODE_FIXED ? 0u : n;
    if (foreign && mask_test(seam_references(h, s), r)) {
      skipped += total * rice;
    } else {
      if (rice > 0u) {
        unary = seek_unary(after_ones(quotients, skipped + first * rice));
        skipped = (total - first - (length - 1u)) * rice;
      }
      read_chain(s, code, widths, low + first * width, rank, length, from, to, foreign);
      if (rice > 0u) quotients = unary.cursor;
    }
    low += total * width;
  }
}

void run(HEADER_IN h, uint part) {
  for (uint r = part; r < h.references; r += PER_MESHLET) run_reference(h, r);
}
#endif

#if PASS == PASS_INTERIOR
// Vertices of the seams of stream s (spec, A.5, sections G and H).
uint seam_vertices_of(HEADER_IN h, uint s) {
  uint count = 0u;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) count += reference_length_at(mask_lsb(rest)) - 1u;
  return count;
}

void read_seams(HEADER_IN h, uint s) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  bool copies = stream_field(s, STREAM_PREDICTOR) == PREDICT_COPY;
  for (mask64 rest = seam_references(h, s); mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint length = min(reference_length_at(r), 64u);
    uint rank = rank_of(r);
    uint from = id_at(rank);
    uint to = id_at(mask_test(h.loop_ends, r) ? loop_of(h, r).x : rank + length);
    for (uint i = 1u; i < length; i++) {
      for (uint c = 0u; c < n && error == ERROR_NONE; c++) {
        uint a = value_at(s, c, from);
        uint point = copies ? a : chord_point(a, value_at(s, c, to), i, length);
        put_value(s, c, id_at(rank + i), point + next_residual(c));
      }
    }
  }
}

uint predicted(uint predictor, uint a, uint b, uint o, bool across) {
  if (predictor == PREDICT_COPY) return a;
  uint sum = a + b;
  if (predictor == PREDICT_MEAN || !across) return sum >> 1;
  return predictor == PREDICT_DAMPED ? uint(int(3u * sum - 2u * o + 2u) >> 2) : sum - o;
}

// The vertex v of a triangle packed as in meshlet_decoder.glsl.
void read_traversed(uint s, uint triangle) {
  uint n = stream_field(s, STREAM_COMPONENTS);
  uint predictor = stream_field(s, STREAM_PREDICTOR);
  uint a = triangle & 63u;
  uint b = (triangle >> 8) & 63u;
  uint v = (triangle >> 16) & 63u;
  uint o = (triangle >> 24) & 63u;
  bool across = triangle >> 24 != NO_VERTEX;
  if (!is_packed(s)) {
    for (uint c = 0u; c < n; c++)
      put_value(s, c, v, predicted(predictor, value_at(s, c, a), value_at(s, c, b), value_at(s, c, o), across) + next_residual(c));
    return;
  }
  uint field = field_bits(s);
  uint mask = bits_mask(s);
  uvec2 from = vertex_at(s, a);
  uvec2 to = vertex_at(s, b);
  uvec2 beyond = vertex_at(s, o);
  uvec2 fields = uvec2(0u);
  for (uint c = 0u; c < n; c++) {
    uint at = c * field;
    uint point = predicted(predictor, get_field(from, at, field), get_field(to, at, field), get_field(beyond, at, field), across);
    fields |= put_field(at, (point + next_residual(c)) & mask);
  }
  put_vertex(s, v, fields);
}

// Inner vertices of private references.
mask64 waiting_vertices(HEADER_IN h) {
  mask64 waiting = mask_none();
  if (h.references == 0u) {
    waiting = the_boundary;
    for (uint k = 0u; k < mask_count(the_starts); k++) waiting = waiting & ~mask_bit(ids_before(k) & 63u);
  }
  for (mask64 rest = h.private_refs; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint r = mask_lsb(rest);
    uint rank = rank_of(r);
    uint length = min(reference_length_at(r), 64u);
    for (uint i = 1u; i < length; i++) waiting = waiting | mask_bit(id_at(rank + i));
  }
  return waiting;
}

void read_all_traversed(uint s, mask64 waiting) {
  if (!mask_any(waiting)) {
    for (mask64 rest = symbol_c; mask_any(rest) && error == ERROR_NONE; rest = mask_clear_lsb(rest)) read_traversed(s, packed_triangle(mask_lsb(rest)));
    return;
  }
  for (uint t = 0u; t < triangle_count && error == ERROR_NONE; t++) {
    uint triangle = packed_triangle(t);
    uint a = triangle & 63u;
    uint b = (triangle >> 8) & 63u;
    uint v = (triangle >> 16) & 63u;
    bool root = mask_test(the_starts, t) && mask_test(waiting, a);
    if (root) waiting = waiting & ~mask_bit(a);
    bool introduces = mask_test(symbol_c, t) || mask_test(waiting, v);
    waiting = waiting & ~mask_bit(v);
    for (uint step = root ? 0u : 1u; step < (introduces ? 2u : 1u); step++)
      read_traversed(s, step == 0u ? pack4(b, b, a, b) : triangle);
  }
  if (mask_any(waiting)) error = ERROR_CLERS;
}

void run(HEADER_IN h, uint stream) {
  uint total = chain_vertices(h, 64u);
  bool chains = mask_any(h.owned_refs);
  mask64 waiting = waiting_vertices(h);
  uint traversed = mask_count(symbol_c) + mask_count(waiting);
  uint p = anchors_begin(h);
  uint count = mask_count(the_starts);
  for (uint s = 0u; s < stream_total; s++) {
    count = anchors_of(h, s, count);
    p = after_anchors(p, s, count);
  }
  uint codes = h.codes;
  uint chain_quotients = 0u;
  uint before = 0u;                        // low bits and quotients of the interior of earlier streams
  uint skipped = 0u;
  uint all = 0u;
  for (uint s = 0u; s < stream_total; s++) {
    uint n = stream_field(s, STREAM_COMPONENTS);
    if (chains) {
      uint code = code_at(codes, n, stream_field(s, STREAM_CHAIN_BASE));
      p += total * low_width(code, n, codes - 5u * n);
      if (code != CODE_FIXED) chain_quotients += total * n;
    }
    uint code = code_at(codes, n, stream_field(s, STREAM_INTERIOR_BASE));
    uint vertices = traversed + seam_vertices_of(h, s);
    if (s == stream) {
      residual_code = code;
      residual_widths = code == CODE_FIXED ? fixed_widths(codes - 5u * n, n) : uvec2(0u);
      before = all;
    }
    if (s < stream && code != CODE_FIXED) skipped += vertices * n;
    all += vertices * low_width(code, n, codes - 5u * n);
  }
  p = after_ones(p, chain_quotients);
  seek_low(p + before);
  unary = seek_unary(p + all);
  if (residual_code != CODE_FIXED) unary = seek_unary(after_ones(p + all, skipped));
  read_seams(h, stream);
  read_all_traversed(stream, waiting);
  if (max(unary.cursor, low_position) > 8u * (byte_length - 8u)) error = ERROR_UNARY;
}
#endif

void main() {
  open_blob(push.blob, push.blob_words);
  group_streams(push.streams);
  uint per_meshlet = PASS == PASS_INTERIOR ? push.streams : PER_MESHLET;
  the_meshlet = gl_GlobalInvocationID.x / per_meshlet;
  if (the_meshlet >= push.meshlets) return;
  Summaries summaries = Summaries(push.summaries);
  if (summaries.of[the_meshlet] >> 16 != ERROR_NONE) return;
  Connectivity connectivity = Connectivity(push.connectivity);
  the_boundary = connectivity.of[the_meshlet].boundary;
  the_starts = connectivity.of[the_meshlet].starts;
  error = ERROR_NONE;
  Header h = read_header(the_meshlet);
  read_symbols(h.begin, h.triangles);
  run(h, gl_GlobalInvocationID.x - the_meshlet * per_meshlet);
  if (error != ERROR_NONE) atomicOr(summaries.of[the_meshlet], error << 16);
}
