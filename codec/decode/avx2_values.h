// What vertex_values.h does otherwise with AVX2: what depends on positions alone, for eight
// vertices at a time. The results are the same bits.
//
// serial_decoder.h includes this file inside its struct.

using Four = __m128i;   // the elements of a vertex
using Eight = __m256i;  // a number of each of eight vertices

// Ones in the elements of stream s.
Four element_mask(uint s) const {
  return _mm_cmpgt_epi32(_mm_set1_epi32(int(stream_elements[s])), _mm_setr_epi32(0, 1, 2, 3));
}

// --- anchors ---

// The places of the elements of a vertex with up to 57 bits: element c has width[c] bits, after
// those before it.
class PackedVertex {
 public:
  explicit PackedVertex(Four width) {
    Four end = _mm_add_epi32(width, _mm_slli_si128(width, 4));
    end = _mm_add_epi32(end, _mm_slli_si128(end, 8));
    total_ = uint(_mm_extract_epi32(end, 3));
    offset_ = _mm256_cvtepu32_epi64(_mm_sub_epi32(end, width));
    const __m256i ones = _mm256_set1_epi64x(-1);
    mask_ = _mm256_andnot_si256(_mm256_sllv_epi64(ones, _mm256_cvtepu32_epi64(width)), ones);
  }
  uint total() const { return total_; }  // bits
  Four elements(uint64_t bits) const {
    const __m256i wide =
        _mm256_and_si256(_mm256_srlv_epi64(_mm256_set1_epi64x(int64_t(bits)), offset_), mask_);
    const __m256i low = _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6);
    return _mm256_castsi256_si128(_mm256_permutevar8x32_epi32(wide, low));
  }

 private:
  __m256i offset_, mask_;
  uint total_;
};

Four load_packed(const PackedVertex& packed, uint p) const {
  return packed.elements((p >> 3) + 8u > size ? 0 : load64(p >> 3) >> (p & 7u));
}

// Bits of the elements of a further anchor of stream s, whose width fields begin at bit `fields`.
Four further_widths(uint s, uint fields) const {
  const Four full = _mm_set1_epi32(ANCHOR_WIDTH_FULL), bits = _mm_set1_epi32(stream_bits[s]);
  const Four word = _mm_set1_epi32(int(load_bits(fields, 4u * ANCHOR_WIDTH_BITS)));
  const Four shift =
      _mm_setr_epi32(0, ANCHOR_WIDTH_BITS, 2 * ANCHOR_WIDTH_BITS, 3 * ANCHOR_WIDTH_BITS);
  const Four field = _mm_and_si128(_mm_srlv_epi32(word, shift), full);
  const Four width =
      _mm_min_epi32(_mm_add_epi32(field, _mm_set1_epi32(stream_anchor_base[s])), bits);
  return _mm_and_si128(_mm_blendv_epi8(width, bits, _mm_cmpeq_epi32(field, full)), element_mask(s));
}

// Calls write(vertex, anchor number) for the vertices of the anchors of a stream.
template <class Write>
void for_anchors(HEADER_IN h, uint s, mask64 stored, Write write) {
  for (uint i = 0; i < anchor_count[s]; i++, stored = mask_clear_lsb(stored))
    write(h.references > 0 ? loop_vertex[reference_rank[mask_lsb(stored) & 63u]] : disk_first[i],
          i);
}

void read_own_anchors(HEADER_IN h, uint s, mask64 stored) {
  const uint bits = stream_bits[s], elements = stream_elements[s];
  if (bits * elements > 57u)
    return for_anchors(h, s, stored, [&](uint v, uint i) { read_anchor(s, i, v); });
  const PackedVertex whole(_mm_and_si128(_mm_set1_epi32(int(bits)), element_mask(s)));
  const uint fields = anchor_position[s] + bits * elements;
  const PackedVertex difference(further_widths(s, fields));
  const Four first = load_packed(whole, anchor_position[s]), mask = Four(vertex_mask(s));
  const Four one = _mm_set1_epi32(1);
  uint p = fields + ANCHOR_WIDTH_BITS * elements;
  for_anchors(h, s, stored, [&](uint v, uint i) {
    Four value = first;
    if (i > 0) {
      const Four u = load_packed(difference, p);
      const Four sign = _mm_sub_epi32(_mm_setzero_si128(), _mm_and_si128(u, one));
      value = _mm_add_epi32(value, _mm_xor_si128(_mm_srli_epi32(u, 1), sign));
      p += difference.total();
    }
    store(vertex(s, v), 0, Vertex(_mm_and_si128(value, mask)));
  });
}

// --- eight vertices ---

static Eight load_eight(const uint* from) {
  return _mm256_load_si256(reinterpret_cast<const __m256i*>(from));
}
static void store_eight(uint* to, Eight v) {
  _mm256_store_si256(reinterpret_cast<__m256i*>(to), v);
}
static Eight eight_of(uint x) { return _mm256_set1_epi32(int(x)); }

struct EightTriples {
  Eight x, y, z;
};

// Element 0 of eight vertices in the low bytes of x, 1 and 2 likewise; vertex[i] for i = 0 .. 7.
static EightTriples transposed(const Four* vertex) {
  __m256i pair[4];  // vertices i and i + 4
  for (uint i = 0; i < 4; i++)
    pair[i] = _mm256_inserti128_si256(_mm256_castsi128_si256(vertex[i]), vertex[i + 4], 1);
  const __m256i xy01 = _mm256_unpacklo_epi32(pair[0], pair[1]),
                xy23 = _mm256_unpacklo_epi32(pair[2], pair[3]),
                zw01 = _mm256_unpackhi_epi32(pair[0], pair[1]),
                zw23 = _mm256_unpackhi_epi32(pair[2], pair[3]);
  return {_mm256_unpacklo_epi64(xy01, xy23), _mm256_unpackhi_epi64(xy01, xy23),
          _mm256_unpacklo_epi64(zw01, zw23)};
}

// The positions of the vertices in byte `byte` of packed[0 .. 7].
template <uint byte>
EightTriples load_positions(const uint* packed) const {
  Four vertex[8];
  for (uint i = 0; i < 8; i++) vertex[i] = Four(load(values, packed[i] >> 8 * byte & 255u));
  return transposed(vertex);
}

static EightTriples minus(const EightTriples& v, const EightTriples& w) {
  return {_mm256_sub_epi32(v.x, w.x), _mm256_sub_epi32(v.y, w.y), _mm256_sub_epi32(v.z, w.z)};
}
static EightTriples shifted(const EightTriples& v, Eight n) {
  return {_mm256_srav_epi32(v.x, n), _mm256_srav_epi32(v.y, n), _mm256_srav_epi32(v.z, n)};
}
static Eight dot(const EightTriples& v, const EightTriples& w) {
  return _mm256_add_epi32(
      _mm256_add_epi32(_mm256_mullo_epi32(v.x, w.x), _mm256_mullo_epi32(v.y, w.y)),
      _mm256_mullo_epi32(v.z, w.z));
}
static Eight magnitudes(const EightTriples& v) {
  return _mm256_or_si256(_mm256_or_si256(_mm256_abs_epi32(v.x), _mm256_abs_epi32(v.y)),
                         _mm256_abs_epi32(v.z));
}
// max(x - y, 0) of small numbers.
static Eight excess(Eight x, Eight y) {
  return _mm256_max_epi32(_mm256_sub_epi32(x, y), _mm256_setzero_si256());
}

// Position of the highest one, from 1: the exponent of a float. Without the bit below each one, the
// float is not rounded up. 0 may give a negative number.
static Eight bit_length(Eight x) {
  const Eight sparse = _mm256_andnot_si256(_mm256_srli_epi32(x, 1), x);
  const Eight bits = _mm256_castps_si256(_mm256_cvtepi32_ps(sparse));
  return _mm256_sub_epi32(_mm256_and_si256(_mm256_srli_epi32(bits, 23), eight_of(255)),
                          eight_of(126));
}

// Divides by the same eight numbers d, 0 < d < 2^31: trunc((x + 0.5) / d) by reciprocals in double.
// The nearest integer is at least 0.5 / d away, much more than the error of the product.
class Divisor {
 public:
  explicit Divisor(Eight d) : low_(reciprocal(low_half(d))), high_(reciprocal(high_half(d))) {}

  // x / d toward zero, of signed x.
  Eight signed_quotient(Eight x) const {
    return join(quotient(to_double(low_half(x)), low_), quotient(to_double(high_half(x)), high_));
  }
  // (x * scale + y) / d toward zero, of positive numbers.
  Eight scaled_quotient(Eight x, double scale, Eight y) const {
    return join(quotient(scaled(low_half(x), scale, low_half(y)), low_),
                quotient(scaled(high_half(x), scale, high_half(y)), high_));
  }

 private:
  static __m128i low_half(Eight x) { return _mm256_castsi256_si128(x); }
  static __m128i high_half(Eight x) { return _mm256_extracti128_si256(x, 1); }
  static Eight join(__m128i low, __m128i high) {
    return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
  }
  static __m256d to_double(__m128i x) { return _mm256_cvtepi32_pd(x); }
  static __m256d reciprocal(__m128i d) { return _mm256_div_pd(_mm256_set1_pd(1.0), to_double(d)); }
  static __m256d scaled(__m128i x, double scale, __m128i y) {
    return _mm256_add_pd(_mm256_mul_pd(to_double(x), _mm256_set1_pd(scale)), to_double(y));
  }
  static __m128i quotient(__m256d x, __m256d inverse) {
    const __m256d sign = _mm256_and_pd(x, _mm256_set1_pd(-0.0));
    const __m256d half = _mm256_or_pd(sign, _mm256_set1_pd(0.5));
    return _mm256_cvttpd_epi32(_mm256_mul_pd(_mm256_add_pd(x, half), inverse));
  }

  __m256d low_, high_;
};

// --- AFFINE ---

// Weights of up to 64 vertices. If `exists` is 0, the others are undefined.
struct WeightLists {
  alignas(32) uint exists[64], s[64], u[64];
};
WeightLists traversed_weight, chain_weight;

// affine_weights drops lower bits of longer differences.
static constexpr uint kWeighedBits = 14;

// Of eight vertices: from a to b and to v.
struct Differences {
  EightTriples e, r;
};

// affine_weights of the vertices i .. i + 7 of a list, whose items are packed vertices: a, b and v
// in these bytes, o or NO_VERTEX in the highest.
template <uint a, uint b, uint v>
Differences weigh_eight(const uint* packed, uint i, WeightLists& out) {
  const EightTriples origin = load_positions<a>(packed + i);
  EightTriples e = minus(load_positions<b>(packed + i), origin),
               f = minus(load_positions<3>(packed + i), origin),
               r = minus(load_positions<v>(packed + i), origin);
  const Differences differences = {e, r};
  if (stream_bits[0] > kWeighedBits) {  // differences may be longer
    const Eight h = excess(
        bit_length(_mm256_or_si256(_mm256_or_si256(magnitudes(e), magnitudes(f)), magnitudes(r))),
        eight_of(kWeighedBits));
    e = shifted(e, h);
    f = shifted(f, h);
    r = shifted(r, h);
  }
  Eight ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), re = dot(r, e), rf = dot(r, f);
  const Eight n = bit_length(_mm256_or_si256(
      _mm256_or_si256(ee, ff), _mm256_or_si256(_mm256_abs_epi32(re), _mm256_abs_epi32(rf))));
  const Eight up = _mm256_min_epi32(excess(eight_of(15), n), eight_of(15)),
              down = excess(n, eight_of(15));
  for (Eight* x : {&ee, &ef, &ff, &re, &rf})
    *x = _mm256_srav_epi32(_mm256_sllv_epi32(*x, up), down);
  const Eight product = _mm256_mullo_epi32(ee, ff),
              determinant = _mm256_sub_epi32(product, _mm256_mullo_epi32(ef, ef)),
              d = _mm256_srli_epi32(determinant, 8);
  const Divisor divisor(_mm256_max_epi32(d, eight_of(1)));
  const Eight s = divisor.signed_quotient(
      _mm256_sub_epi32(_mm256_mullo_epi32(re, ff), _mm256_mullo_epi32(rf, ef)));
  const Eight u = divisor.signed_quotient(
      _mm256_sub_epi32(_mm256_mullo_epi32(rf, ee), _mm256_mullo_epi32(re, ef)));
  Eight exists = _mm256_and_si256(_mm256_cmpgt_epi32(determinant, _mm256_srai_epi32(product, 5)),
                                  _mm256_cmpgt_epi32(d, _mm256_setzero_si256()));
  for (const Eight weight : {s, u})
    exists = _mm256_and_si256(
        exists, _mm256_cmpgt_epi32(eight_of(AFFINE_WEIGHT_LIMIT), _mm256_abs_epi32(weight)));
  const Eight across = _mm256_cmpgt_epi32(
      eight_of(NO_VERTEX),
      _mm256_srli_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(packed + i)), 24));
  store_eight(out.exists + i, _mm256_and_si256(exists, across));
  store_eight(out.s + i, s);
  store_eight(out.u + i, u);
  return differences;
}

// Weighs the traversed vertices. Instead of no weights it takes those of the parallelogram: with
// (256, -256), affine_point is b + (a - o) up to bits that the stream's mask clears.
void weigh_traversed() {
  WeightLists& w = traversed_weight;
  for (uint i = 0; i < traversed_count; i += 8) {
    weigh_eight<0, 1, 2>(traversed, i, w);
    const Eight exists = load_eight(w.exists + i);
    store_eight(w.s + i, _mm256_blendv_epi8(eight_of(256u), load_eight(w.s + i), exists));
    store_eight(w.u + i, _mm256_blendv_epi8(eight_of(0u - 256u), load_eight(w.u + i), exists));
  }
}

// line_weights of the chain vertices j .. j + 7 that have no others.
void weigh_lines(uint j, const Differences& differences) {
  WeightLists& w = chain_weight;
  EightTriples e = differences.e, r = differences.r;
  const Eight h = excess(bit_length(_mm256_or_si256(magnitudes(e), magnitudes(r))), eight_of(10));
  e = shifted(e, h);
  r = shifted(r, h);
  const Eight ee = dot(e, e), re = dot(r, e), none = eight_of(0u - 1u);
  const Divisor divisor(_mm256_max_epi32(ee, eight_of(1)));
  const Eight s = divisor.scaled_quotient(re, 256.0, _mm256_srai_epi32(ee, 1));
  Eight exists = _mm256_andnot_si256(_mm256_cmpgt_epi32(re, ee), _mm256_cmpgt_epi32(re, none));
  exists = _mm256_and_si256(exists, _mm256_cmpgt_epi32(ee, _mm256_setzero_si256()));
  const Eight affine = load_eight(w.exists + j);
  store_eight(w.exists + j, _mm256_or_si256(affine, exists));
  store_eight(w.s + j, _mm256_blendv_epi8(s, load_eight(w.s + j), affine));
  store_eight(w.u + j, _mm256_and_si256(load_eight(w.u + j), affine));
}

// Weighs the listed chain vertices.
void weigh_chains() {
  for (uint j = 0; j < chain_count; j += 8)
    weigh_lines(j, weigh_eight<1, 2, 0>(chain_step, j, chain_weight));
}

// The prediction of the vertex of chain step j; returns false if it has no weights. Without a
// vertex before the one before, the weight of this one is 0.
bool affine_chain(uint j, Vertex before, Vertex end, const uint* base, Vertex& point) const {
  const WeightLists& w = chain_weight;
  if (!w.exists[j]) return false;
  point = affine(before, end, load(base, chain_step[j] >> 24 & 63u), {int(w.s[j]), int(w.u[j])});
  return true;
}
Vertex affine_traversed(uint i, Vertex a, Vertex b, Vertex o) const {
  return affine(a, b, o, {int(traversed_weight.s[i]), int(traversed_weight.u[i])});
}

// --- normals ---

// octahedral_prediction of the traversed vertices i .. i + 7.
void predict_directions(uint bits, uint i, uint (*out)[8]) const {
  Four sums[8];
  for (uint k = 0; k < 8; k++) {
    const Four* sum = normal_sums[traversed[i + k] >> 16 & 63u];
    sums[k] = _mm_add_epi32(sum[0], sum[1]);
  }
  const EightTriples normal = transposed(sums);
  const Eight zero = _mm256_setzero_si256();
  const Eight k = excess(bit_length(magnitudes(normal)), eight_of(13));
  const Eight x = _mm256_srlv_epi32(_mm256_abs_epi32(normal.x), k),
              y = _mm256_srlv_epi32(_mm256_abs_epi32(normal.y), k),
              z = _mm256_srlv_epi32(_mm256_abs_epi32(normal.z), k);
  const Eight sum = _mm256_add_epi32(_mm256_add_epi32(x, y), z),
              below = _mm256_cmpgt_epi32(zero, normal.z), none = _mm256_cmpeq_epi32(sum, zero);
  const Divisor divisor(_mm256_max_epi32(_mm256_add_epi32(sum, sum), eight_of(1)));
  const uint limit = (1u << bits) - 2u;
  auto element = [&](Eight component, Eight other, Eight sign) {
    const Eight size = _mm256_blendv_epi8(component, _mm256_sub_epi32(sum, other), below);
    const Eight negative = _mm256_cmpgt_epi32(zero, sign);
    // sum - size where the sign is negative, else sum + size
    const Eight from =
        _mm256_add_epi32(sum, _mm256_sub_epi32(_mm256_xor_si256(size, negative), negative));
    return _mm256_blendv_epi8(divisor.scaled_quotient(from, double(limit), sum),
                              eight_of(limit >> 1), none);
  };
  store_eight(out[0], element(x, y, normal.x));
  store_eight(out[1], element(y, x, normal.y));
}

template <class Sink>
void predict_geo(uint s, Sink sink) {
  auto visit = sink.visitor(*this, s);
  for (uint i = 0; i < traversed_count; i += 8) {
    alignas(32) uint prediction[2][8];
    predict_directions(stream_bits[s], i, prediction);
    for (uint k = 0; k < 8 && i + k < traversed_count; k++)
      visit(traversed[i + k] >> 16 & 255u, Vertex{prediction[0][k], prediction[1][k], 0, 0});
  }
}

Four normal_sums[64][2];  // of each vertex, of even and of odd triangles

// As sum_normals. Positions fit 16 bits, so that one multiplication of
// pairs makes a cross product: (y, -z) * (z', y'), (z, -x) * (x', z'), (x, -y) * (y', x'). Even and
// odd triangles have sums of their own: a sum soon follows from the last one at the same vertex.
void sum_vertex_normals() {
  struct alignas(16) Factors {
    __m128i left, right;
  };
  Factors factors[64];
  const __m128i h = _mm_cvtsi32_si128(int(excess(stream_bits[0], GEO_POSITION_BITS)));
  const __m128i left = _mm_setr_epi8(4, 5, 8, 9, 8, 9, 0, 1, 0, 1, 4, 5, -1, -1, -1, -1),
                right = _mm_setr_epi8(8, 9, 4, 5, 0, 1, 8, 9, 4, 5, 0, 1, -1, -1, -1, -1),
                signs = _mm_setr_epi16(1, -1, 1, -1, 1, -1, 0, 0);
  for (uint v = 0; v < vertex_count; v++) {
    const Four position = _mm_srl_epi32(Four(load(values, v)), h);
    factors[v] = {_mm_sign_epi16(_mm_shuffle_epi8(position, left), signs),
                  _mm_shuffle_epi8(position, right)};
    normal_sums[v][0] = normal_sums[v][1] = _mm_setzero_si128();
  }
  auto add = [&](index_uint triangle, uint parity) {
    const index_uint a = triangle & 63u, b = triangle >> 8 & 63u, v = triangle >> 16 & 63u;
    const Four normal = _mm_madd_epi16(_mm_sub_epi16(factors[b].left, factors[a].left),
                                       _mm_sub_epi16(factors[v].right, factors[a].right));
    normal_sums[a][parity] = _mm_add_epi32(normal_sums[a][parity], normal);
    normal_sums[b][parity] = _mm_add_epi32(normal_sums[b][parity], normal);
    normal_sums[v][parity] = _mm_add_epi32(normal_sums[v][parity], normal);
  };
  uint t = 0;
  for (; t + 1 < triangle_count; t += 2) {
    add(triangles[t], 0);
    add(triangles[t + 1], 1);
  }
  if (t < triangle_count) add(triangles[t], 0);
}

void finish_positions() {
  if (needs_normals) sum_vertex_normals();
}
