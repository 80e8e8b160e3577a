// Values of serial_decoder.glsl for WebAssembly's SIMD: all elements of a vertex at a time. The
// results are the same bits.
//
// serial_decoder.h includes this file inside its struct.

using Vertex = uint __attribute__((vector_size(16)));       // the elements of one stream
using SignedVertex = int __attribute__((vector_size(16)));  // shifts keep the sign
using Doubles = double __attribute__((vector_size(32)));
using Words = uint __attribute__((vector_size(32)));

static Vertex load_vertex(const uint* from) {
  Vertex v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
static void store_vertex(uint* to, Vertex v) { std::memcpy(to, &v, sizeof v); }
static Vertex shifted_right(Vertex v, uint n) { return Vertex(SignedVertex(v) >> int(n)); }

// Residuals under a Rice parameter k <= 8, four at a time. The multiplication moves the low bits of
// each of the four to the top of its element.
void read_rice_fours(uint n, uint k, uint low, const uint* list) {
  const uint top = 1u << (31u - k) << 1;  // 0 for k = 0: no low bits
  const Vertex scale = {top, top >> k, top >> 2u * k, top >> 3u * k};
  for (uint i = 0; i < n; i += 4, low += 4u * k) {
    const uint bits = uint(load64(low >> 3) >> (low & 7u));
    const Vertex quotient = load_vertex(list + i + 1) - load_vertex(list + i) - 1u;
    const Vertex u = (quotient << k) | (bits * scale >> ((32u - k) & 31u));
    store_vertex(residuals + i, (u >> 1) ^ (0u - (u & 1u)));
  }
}

// Ones in the bits that values of stream s have.
Vertex vertex_mask(uint s) const {
  const Vertex mask = {0, 1, 2, 3};
  return Vertex(mask < uint(stream_elements[s])) & stream_mask[s];
}

void read_own_anchors(HEADER_IN h, uint s, mask64 stored) {
  const uint elements = stream_elements[s], bits = stream_bits[s];
  const uint fields = anchor_position[s] + elements * bits;
  uint first[4], width[4], p = anchor_position[s];
  for (uint c = 0; c < elements; c++, p += bits) {
    first[c] = load_bits(p, bits);
    width[c] = anchor_width(s, fields, c);
  }
  p += ANCHOR_WIDTH_BITS * elements;
  for (uint i = 0; i < anchor_count[s]; i++, stored = mask_clear_lsb(stored)) {
    uint* value = vertex(
        s, h.references > 0 ? loop_vertex[reference_rank[mask_lsb(stored) & 63u]] : disk_first[i]);
    for (uint c = 0; c < elements; c++) {
      value[c] = first[c];
      if (i > 0) {
        value[c] += unzigzag(load_bits(p, width[c]));
        p += width[c];
      }
      value[c] &= stream_mask[s];
    }
  }
}

static Vertex affine_vertex(Weights w, Vertex a, Vertex b, Vertex o) {
  return a + shifted_right(w.s * (b - a) + w.u * (o - a) + 128u, 8);
}

// As the other `toward`. The last sum rounds the quotient, which is nowhere half-way between two
// integers, and leaves it in the low word.
static Vertex toward(Vertex a, Vertex b, uint n) {
  const double half = n % 2u == 0u ? 0.5 : 0.0, factor = 1.0 / n;
  const Doubles way = __builtin_convertvector(SignedVertex(b - a), Doubles);
  const Words sum = Words((way + half) * factor + 0x1.8p52);
  return a + __builtin_shufflevector(sum, sum, 0, 2, 4, 6);
}

void predict_chains(uint s) {
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  const uint elements = stream_elements[s], predictor = stream_predictor[s];
  const uint* residual = residuals;
  for (uint j = 0; j < chain_count; j++, residual += elements) {
    const uint step = chain_step[j];
    const Vertex before = load_vertex(base + 4u * (step >> 8 & 255u));
    Vertex point = before;
    if (predictor != PREDICT_COPY) {
      const Vertex end = load_vertex(base + 4u * (step >> 16 & 255u));
      Weights w{};
      if (predictor == PREDICT_AFFINE) w = chain_weights(step);
      if (w.exist) {
        const uint earlier = step >> 24 == NO_VERTEX ? step >> 8 & 255u : step >> 24;
        point = affine_vertex(w, before, end, load_vertex(base + 4u * earlier));
      } else {
        point = toward(before, end, chain_left[j]);
      }
    }
    store_vertex(base + 4u * (step & 255u), (point + load_vertex(residual)) & mask);
  }
}

template <uint predictor>
void predict_traversed_of(uint s, const uint* residual) {
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  const uint elements = stream_elements[s], count = traversed_count;
  for (uint i = 0; i < count; i++, residual += elements) {
    const uint triangle = traversed[i];
    const Vertex a = load_vertex(base + 4u * (triangle & 255u)),
                 b = load_vertex(base + 4u * (triangle >> 8 & 255u));
    Vertex point = (a + b) >> 1;
    if (predictor == PREDICT_COPY) {
      point = a;
    } else if (predictor != PREDICT_MEAN && triangle >> 24 != NO_VERTEX) {
      const Vertex o = load_vertex(base + 4u * (triangle >> 24));
      point = a + b - o;
      if (predictor == PREDICT_DAMPED) point = shifted_right(3u * (a + b) - 2u * o + 2u, 2);
      if (predictor == PREDICT_AFFINE) {
        const Weights w = traversed_weights(triangle);
        if (w.exist) point = affine_vertex(w, a, b, o);
      }
    }
    store_vertex(base + 4u * (triangle >> 16 & 255u), (point + load_vertex(residual)) & mask);
  }
}

void predict_geo(uint s, const uint* residual) {
  uint* base = vertex(s, 0);
  const Vertex mask = vertex_mask(s);
  for (uint i = 0; i < traversed_count; i++, residual += 2) {
    const uint v = traversed[i] >> 16 & 63u;
    const Vertex n = load_vertex(normals + 4u * v);
    const OctPair q = octahedral_prediction(n[0], n[1], n[2], stream_bits[s]);
    store_vertex(base + 4u * v, (Vertex{q.u, q.v, 0, 0} + load_vertex(residual)) & mask);
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
    default: return predict_traversed_of<PREDICT_AFFINE>(s, residual);
  }
}

// As sum_normals.
void finish_positions() {
  if (!needs_normals) return;
  const uint h = excess(stream_bits[0], GEO_POSITION_BITS);
  const auto position = [&](uint v) { return shifted_right(load_vertex(values + 4u * v), h); };
  for (uint v = 0; v < vertex_count; v++) store_vertex(normals + 4u * v, Vertex{});
  for (uint t = 0; t < triangle_count; t++) {
    const uint i = triangles[t] & 63u, j = triangles[t] >> 8 & 63u, k = triangles[t] >> 16 & 63u;
    const Vertex a = position(i), e = position(j) - a, f = position(k) - a;
    const Vertex n =
        __builtin_shufflevector(e, e, 1, 2, 0, 3) * __builtin_shufflevector(f, f, 2, 0, 1, 3) -
        __builtin_shufflevector(e, e, 2, 0, 1, 3) * __builtin_shufflevector(f, f, 1, 2, 0, 3);
    const auto add = [&](uint v) {
      store_vertex(normals + 4u * v, load_vertex(normals + 4u * v) + n);
    };
    add(i);  // not a loop, which -Os would leave one
    add(j);
    add(k);
  }
}
