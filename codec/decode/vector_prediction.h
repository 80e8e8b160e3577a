// Prediction of serial_decoder.glsl for AVX2: all elements of a vertex at a time, and for what
// depends on positions alone eight vertices at a time. The results are the same bits.
//
// serial_decoder.h includes this file inside its struct.

using Vertex = __m128i;  // the elements of one stream
using Eight = __m256i;   // a number of each of eight vertices

// --- values ---

static Vertex load_vertex(const uint* from) {
  return _mm_load_si128(reinterpret_cast<const __m128i*>(from));
}
static void store_vertex(uint* to, Vertex v) { _mm_store_si128(reinterpret_cast<__m128i*>(to), v); }
static Vertex load_residual(const uint* from) {
  return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
}

// Ones in the bits that values of stream s have.
Vertex vertex_mask(uint s) const {
  const Vertex element = _mm_setr_epi32(0, 1, 2, 3);
  return _mm_and_si128(_mm_cmpgt_epi32(_mm_set1_epi32(int(stream_elements[s])), element),
                       _mm_set1_epi32(int(stream_mask[s])));
}

// --- eight vertices ---

static Eight load_eight(const uint* from) {
  return _mm256_load_si256(reinterpret_cast<const __m256i*>(from));
}
static void store_eight(uint* to, Eight v) {
  _mm256_store_si256(reinterpret_cast<__m256i*>(to), v);
}
static Eight eight_of(uint x) { return _mm256_set1_epi32(int(x)); }

// The smallest multiple of 8 from n on.
static uint whole_eights(uint n) { return (n + 7u) & ~7u; }

struct EightTriples {
  Eight x, y, z;
};

// The first three elements at base + offset[i], for i = 0 .. 7.
static EightTriples load_triples(const uint* base, const uint* offset) {
  __m256i pair[4];  // vertices i and i + 4
  for (uint i = 0; i < 4; i++)
    pair[i] = _mm256_inserti128_si256(_mm256_castsi128_si256(load_vertex(base + offset[i])),
                                      load_vertex(base + offset[i + 4]), 1);
  const __m256i xy01 = _mm256_unpacklo_epi32(pair[0], pair[1]),
                xy23 = _mm256_unpacklo_epi32(pair[2], pair[3]),
                zw01 = _mm256_unpackhi_epi32(pair[0], pair[1]),
                zw23 = _mm256_unpackhi_epi32(pair[2], pair[3]);
  return {_mm256_unpacklo_epi64(xy01, xy23), _mm256_unpackhi_epi64(xy01, xy23),
          _mm256_unpacklo_epi64(zw01, zw23)};
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

// Weights of up to 64 vertices. Where `exists` is 0, the others are undefined.
struct WeightLists {
  alignas(32) uint exists[64], s[64], u[64];
};
WeightLists traversed_weight, chain_weight;

// Offsets in the positions of vertices, by their part in the prediction.
struct AffineOffsets {
  alignas(32) uint a[64], b[64], o[64], v[64];
};

// affine_weights of the vertices i .. i + 7.
void weigh_eight(const AffineOffsets& at, uint i, WeightLists& out) {
  const EightTriples origin = load_triples(values, at.a + i);
  EightTriples e = minus(load_triples(values, at.b + i), origin),
               f = minus(load_triples(values, at.o + i), origin),
               r = minus(load_triples(values, at.v + i), origin);
  const Eight most = _mm256_or_si256(_mm256_or_si256(magnitudes(e), magnitudes(f)), magnitudes(r));
  const Eight h = excess(bit_length(most), eight_of(14));
  e = shifted(e, h);
  f = shifted(f, h);
  r = shifted(r, h);
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
  Eight exists = _mm256_cmpgt_epi32(determinant, _mm256_srai_epi32(product, 5));
  exists = _mm256_and_si256(exists, _mm256_cmpgt_epi32(d, _mm256_setzero_si256()));
  for (const Eight weight : {s, u})
    exists = _mm256_and_si256(
        exists, _mm256_cmpgt_epi32(eight_of(AFFINE_WEIGHT_LIMIT), _mm256_abs_epi32(weight)));
  store_eight(out.exists + i, exists);
  store_eight(out.s + i, s);
  store_eight(out.u + i, u);
}

// Weighs the traversed vertices. Instead of no weights it takes those of the parallelogram: with
// (256, -256), affine_point is b + (a - o) up to bits that the stream's mask clears.
void weigh_traversed() {
  AffineOffsets at;
  const uint count = traversed_count;
  for (uint i = 0; i < whole_eights(count); i++) {
    const uint triangle = i < count ? traversed[i] : 0;
    at.a[i] = 4u * (triangle & 255u);
    at.b[i] = 4u * (triangle >> 8 & 255u);
    at.v[i] = 4u * (triangle >> 16 & 255u);
    at.o[i] = triangle >> 24 == NO_VERTEX ? at.a[i] : 4u * (triangle >> 24);
  }
  WeightLists& w = traversed_weight;
  for (uint i = 0; i < count; i += 8) {
    weigh_eight(at, i, w);
    const Eight exists = load_eight(w.exists + i);
    store_eight(w.s + i, _mm256_blendv_epi8(eight_of(256u), load_eight(w.s + i), exists));
    store_eight(w.u + i, _mm256_blendv_epi8(eight_of(0u - 256u), load_eight(w.u + i), exists));
  }
}

// Weighs the listed chain vertices.
void weigh_chains() {
  AffineOffsets at;
  const uint count = chain_count;
  for (uint j = 0; j < whole_eights(count); j++) {
    const uint step = j < count ? chain_step[j] : 0;
    at.v[j] = 4u * (step & 255u);
    at.a[j] = 4u * (step >> 8 & 255u);
    at.b[j] = 4u * (step >> 16 & 255u);
    at.o[j] = step >> 24 == NO_VERTEX ? at.a[j] : 4u * (step >> 24);
  }
  WeightLists& w = chain_weight;
  for (uint j = 0; j < count; j += 8) weigh_eight(at, j, w);
  for (uint j = 0; j < count; j++) {
    if (w.exists[j]) continue;
    const Weights line = line_weights(at.a[j] / 4u, at.b[j] / 4u, at.v[j] / 4u);
    w.exists[j] = line.exist;
    w.s[j] = line.s;
    w.u[j] = 0;
  }
}

static Vertex affine_vertex(uint s, uint u, Vertex a, Vertex b, Vertex o) {
  const Vertex sum = _mm_add_epi32(_mm_mullo_epi32(_mm_set1_epi32(int(s)), _mm_sub_epi32(b, a)),
                                   _mm_mullo_epi32(_mm_set1_epi32(int(u)), _mm_sub_epi32(o, a)));
  return _mm_add_epi32(a, _mm_srai_epi32(_mm_add_epi32(sum, _mm_set1_epi32(128)), 8));
}

// --- chains ---

// x / n = x * factor >> shift for x < n << 25, with a factor of 32 bits: it is too large by less
// than 1, so the quotient is too large by less than n 2^25 / 2^shift <= 1 / n.
struct VectorReciprocals {
  uint64_t factor[65] = {}, shift[65] = {};
  constexpr VectorReciprocals() {
    for (uint64_t n = 2; n <= 64; n++) {
      shift[n] = 31;
      while (n > 1ull << (shift[n] - 31)) shift[n]++;
      factor[n] = ((1ull << shift[n]) + n - 1) / n;
    }
  }
};

// As the other `toward`.
static Vertex toward(Vertex a, Vertex b, uint n) {
  static constexpr VectorReciprocals reciprocals;
  const __m128i factor = _mm_set1_epi64x(int64_t(reciprocals.factor[n])),
                shift = _mm_cvtsi64_si128(int64_t(reciprocals.shift[n]));
  const Vertex x = _mm_add_epi32(_mm_sub_epi32(b, a), _mm_set1_epi32(int((n >> 1) + (n << 24))));
  const __m128i even = _mm_srl_epi64(_mm_mul_epu32(x, factor), shift),
                odd = _mm_srl_epi64(_mm_mul_epu32(_mm_srli_epi64(x, 32), factor), shift);
  const Vertex quotient = _mm_or_si128(even, _mm_slli_epi64(odd, 32));
  return _mm_add_epi32(a, _mm_sub_epi32(quotient, _mm_set1_epi32(1 << 24)));
}

template <uint predictor>
void predict_chains_of(uint s) {
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  const uint* residual = residuals;
  for (uint j = 0; j < chain_count; j++, residual += stream_elements[s]) {
    const uint step = chain_step[j];
    const Vertex before = load_vertex(base + 4u * (step >> 8 & 255u));
    Vertex point = before;
    if (predictor != PREDICT_COPY) {
      const Vertex end = load_vertex(base + 4u * (step >> 16 & 255u));
      if (predictor == PREDICT_AFFINE && chain_weight.exists[j]) {
        const uint earlier = step >> 24 == NO_VERTEX ? step >> 8 & 255u : step >> 24;
        point = affine_vertex(chain_weight.s[j], chain_weight.u[j], before, end,
                              load_vertex(base + 4u * earlier));
      } else {
        point = toward(before, end, chain_left[j]);
      }
    }
    store_vertex(base + 4u * (step & 255u),
                 _mm_and_si128(_mm_add_epi32(point, load_residual(residual)), mask));
  }
}

void predict_chains(uint s) {
  if (chain_count == 0) return;
  if (stream_predictor[s] == PREDICT_COPY) return predict_chains_of<PREDICT_COPY>(s);
  if (stream_predictor[s] != PREDICT_AFFINE) return predict_chains_of<PREDICT_PARALLELOGRAM>(s);
  weigh_chains();
  predict_chains_of<PREDICT_AFFINE>(s);
}

// --- traversed vertices ---

template <uint predictor>
static Vertex predict_vertex(Vertex a, Vertex b, Vertex o) {
  if (predictor == PREDICT_COPY) return a;
  const Vertex sum = _mm_add_epi32(a, b);
  if (predictor == PREDICT_MEAN) return _mm_srli_epi32(sum, 1);
  if (predictor == PREDICT_PARALLELOGRAM) return _mm_sub_epi32(sum, o);
  const Vertex three = _mm_add_epi32(sum, _mm_slli_epi32(sum, 1));
  return _mm_srai_epi32(
      _mm_add_epi32(_mm_sub_epi32(three, _mm_slli_epi32(o, 1)), _mm_set1_epi32(2)), 2);
}

template <uint predictor>
void predict_traversed_of(uint s, const uint* residual) {
  constexpr uint kAlone = predictor == PREDICT_COPY ? PREDICT_COPY : PREDICT_MEAN;
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  const uint elements = stream_elements[s], count = traversed_count;
  for (uint i = 0; i < count; i++, residual += elements) {
    const uint triangle = traversed[i];
    const Vertex a = load_vertex(base + 4u * (triangle & 255u)),
                 b = load_vertex(base + 4u * (triangle >> 8 & 255u));
    Vertex point;
    if (triangle >> 24 == NO_VERTEX) {
      point = predict_vertex<kAlone>(a, b, a);
    } else {
      const Vertex o = load_vertex(base + 4u * (triangle >> 24));
      point = predictor == PREDICT_AFFINE
                  ? affine_vertex(traversed_weight.s[i], traversed_weight.u[i], a, b, o)
                  : predict_vertex<predictor>(a, b, o);
    }
    store_vertex(base + 4u * (triangle >> 16 & 255u),
                 _mm_and_si128(_mm_add_epi32(point, load_residual(residual)), mask));
  }
}

// octahedral_prediction of the vertices i .. i + 7, whose normals begin at `offset`.
void predict_directions(const uint* offset, uint bits, uint i, uint (*out)[64]) {
  const EightTriples normal = load_triples(normals, offset + i);
  const Eight zero = _mm256_setzero_si256();
  const Eight k = excess(bit_length(magnitudes(normal)), eight_of(13));
  const Eight x = _mm256_srlv_epi32(_mm256_abs_epi32(normal.x), k),
              y = _mm256_srlv_epi32(_mm256_abs_epi32(normal.y), k),
              z = _mm256_srlv_epi32(_mm256_abs_epi32(normal.z), k);
  const Eight sum = _mm256_add_epi32(_mm256_add_epi32(x, y), z),
              below = _mm256_cmpgt_epi32(zero, normal.z);
  const Eight none = _mm256_cmpeq_epi32(sum, zero);
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
  store_eight(out[0] + i, element(x, y, normal.x));
  store_eight(out[1] + i, element(y, x, normal.y));
}

void predict_geo(uint s, const uint* residual) {
  alignas(32) uint offset[64], prediction[2][64];
  const uint count = traversed_count;
  for (uint i = 0; i < whole_eights(count); i++)
    offset[i] = 4u * ((i < count ? traversed[i] : 0) >> 16 & 255u);
  for (uint i = 0; i < count; i += 8) predict_directions(offset, stream_bits[s], i, prediction);
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  for (uint i = 0; i < count; i++, residual += 2) {
    const Vertex point = _mm_setr_epi32(int(prediction[0][i]), int(prediction[1][i]), 0, 0);
    store_vertex(base + offset[i],
                 _mm_and_si128(_mm_add_epi32(point, load_residual(residual)), mask));
  }
}

// `first`: number of residuals of vertices before the first traversed one.
void predict_traversed(uint s, uint first) {
  const uint* residual = residuals + first * stream_elements[s];
  switch (stream_predictor[s]) {
    case PREDICT_PARALLELOGRAM: return predict_traversed_of<PREDICT_PARALLELOGRAM>(s, residual);
    case PREDICT_MEAN: return predict_traversed_of<PREDICT_MEAN>(s, residual);
    case PREDICT_COPY: return predict_traversed_of<PREDICT_COPY>(s, residual);
    case PREDICT_DAMPED: return predict_traversed_of<PREDICT_DAMPED>(s, residual);
    case PREDICT_GEO: return predict_geo(s, residual);
    default: weigh_traversed(); return predict_traversed_of<PREDICT_AFFINE>(s, residual);
  }
}

// --- normals ---

// As sum_normals.
void sum_vertex_normals() {
  alignas(16) uint position[256];
  const uint h = excess(stream_bits[0], GEO_POSITION_BITS);
  for (uint v = 0; v < vertex_count; v++) {
    store_vertex(position + 4 * v,
                 _mm_srl_epi32(load_vertex(values + 4 * v), _mm_cvtsi32_si128(int(h))));
    store_vertex(normals + 4 * v, _mm_setzero_si128());
  }
  for (uint t = 0; t < triangle_count; t++) {
    const uint triangle = triangles[t];
    uint offset[3];
    for (uint k = 0; k < 3; k++) offset[k] = 4u * (triangle >> 8 * k & 63u);
    const Vertex a = load_vertex(position + offset[0]),
                 e = _mm_sub_epi32(load_vertex(position + offset[1]), a),
                 f = _mm_sub_epi32(load_vertex(position + offset[2]), a);
    // (e x f) rotated: e f' - e' f, where ' moves y, z, x to x, y, z.
    const Vertex moved_e = _mm_shuffle_epi32(e, 0xC9), moved_f = _mm_shuffle_epi32(f, 0xC9);
    const Vertex rotated = _mm_sub_epi32(_mm_mullo_epi32(e, moved_f), _mm_mullo_epi32(moved_e, f));
    const Vertex normal = _mm_shuffle_epi32(rotated, 0xC9);
    for (uint corner : offset)
      store_vertex(normals + corner, _mm_add_epi32(load_vertex(normals + corner), normal));
  }
}

void finish_positions() {
  if (needs_normals) sum_vertex_normals();
}
