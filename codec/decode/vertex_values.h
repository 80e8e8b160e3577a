// Values of serial_decoder.glsl in C++: all elements of a vertex at a time (vertex.h). The results
// are the same bits. A sink makes a visitor, which gets each vertex and its prediction: the
// decoder's adds the residual, the unpacker's finds it. What AVX2 does otherwise is in
// avx2_values.h.
//
// serial_decoder.h includes this file inside its struct.

// Ones in the bits that values of stream s have.
Vertex vertex_mask(uint s) const {
  const Vertex element = {0, 1, 2, 3};
  return Vertex(element < uint(stream_elements[s])) & stream_mask[s];
}

#if !MESHLET_AVX2

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

// Stream 0's integers of a vertex, and 0.
Vertex position(uint v) const { return load(values, v) & Vertex{~0u, ~0u, ~0u, 0}; }

// AFFINE needs nothing before its vertices.
void weigh_chains() {}
void weigh_traversed() {}

// The prediction of the vertex of chain step j; returns false if it has no weights.
bool affine_chain(uint j, Vertex before, Vertex end, const uint* base, Vertex& point) const {
  const uint step = chain_step[j], earlier = step >> 24;
  const Vertex a = position(step >> 8 & 255u), b = position(step >> 16 & 255u),
               v = position(step & 255u);
  VertexWeights w;
  const bool across =
      earlier != NO_VERTEX && MESHLET_BUILD::affine_weights(a, b, position(earlier), v, w);
  if (!across && !MESHLET_BUILD::line_weights(a, b, v, w)) return false;
  point = affine(before, end, across ? load(base, earlier) : before, w);
  return true;
}
Vertex affine_traversed(uint i, Vertex a, Vertex b, Vertex o) const {
  const uint triangle = traversed[i];
  VertexWeights w;
  if (!MESHLET_BUILD::affine_weights(position(triangle & 255u), position(triangle >> 8 & 255u),
                                     position(triangle >> 24), position(triangle >> 16 & 255u), w))
    return predicted<PREDICT_PARALLELOGRAM>(a, b, o);
  return affine(a, b, o, w);
}

template <class Sink>
void predict_geo(uint s, Sink sink) {
  auto visit = sink.visitor(*this, s);
  for (uint i = 0; i < traversed_count; i++) {
    const uint v = traversed[i] >> 16 & 63u;
    visit(v, octahedral(load(normals, v), stream_bits[s]));
  }
}

// As sum_normals.
void finish_positions() {
  if (!needs_normals) return;
  const uint h = excess(stream_bits[0], GEO_POSITION_BITS);
  const auto point = [&](uint v) { return shifted_right(load(values, v), h); };
  for (uint v = 0; v < vertex_count; v++) store(normals, v, Vertex{});
  for (uint t = 0; t < triangle_count; t++) {
    const uint i = triangles[t] & 63u, j = triangles[t] >> 8 & 63u, k = triangles[t] >> 16 & 63u;
    const Vertex a = point(i), n = cross(point(j) - a, point(k) - a);
    const auto add = [&](uint v) { store(normals, v, load(normals, v) + n); };
    add(i);  // not a loop, which -Os would leave one
    add(j);
    add(k);
  }
}

#endif

// --- all vertices of a list ---

template <class Sink>
INLINE void predict_chains_of(uint s, uint predictor, Sink sink) {
  auto visit = sink.visitor(*this, s);
  const uint* base = vertex(s, 0);
  const uint count = chain_count;
  for (uint j = 0; j < count; j++) {
    const uint step = chain_step[j];
    const Vertex before = load(base, step >> 8 & 255u);
    Vertex point = before;
    if (predictor != PREDICT_COPY) {
      const Vertex end = load(base, step >> 16 & 255u);
      if (predictor != PREDICT_AFFINE || !affine_chain(j, before, end, base, point))
        point = step_toward(before, end, chain_left[j]);
    }
    visit(step & 255u, point);
  }
}

// Of the listed chains. Constants instead of variables, but in WebAssembly, which stays smaller.
template <class Sink>
void visit_chains(uint s, Sink sink) {
#ifdef __wasm__
  predict_chains_of(s, stream_predictor[s], sink);
#else
  if (chain_count == 0) return;
  if (stream_predictor[s] == PREDICT_COPY) return predict_chains_of(s, PREDICT_COPY, sink);
  if (stream_predictor[s] != PREDICT_AFFINE)
    return predict_chains_of(s, PREDICT_PARALLELOGRAM, sink);
  weigh_chains();
  predict_chains_of(s, PREDICT_AFFINE, sink);
#endif
}

template <uint predictor, class Sink>
void predict_traversed_of(uint s, Sink sink) {
  auto visit = sink.visitor(*this, s);
  constexpr uint kAlone = predictor == PREDICT_COPY ? PREDICT_COPY : PREDICT_MEAN;
  const uint* base = vertex(s, 0);
  const uint count = traversed_count;
  for (uint i = 0; i < count; i++) {
    const uint triangle = traversed[i];
    const Vertex a = load(base, triangle & 255u), b = load(base, triangle >> 8 & 255u);
    Vertex point;
    if (triangle >> 24 == NO_VERTEX) {
      point = predicted<kAlone>(a, b, a);
    } else {
      const Vertex o = load(base, triangle >> 24);
      point = predictor == PREDICT_AFFINE ? affine_traversed(i, a, b, o)
                                          : predicted<predictor>(a, b, o);
    }
    visit(triangle >> 16 & 255u, point);
  }
}

template <class Sink>
void visit_traversed(uint s, Sink sink) {
  switch (stream_predictor[s]) {
    case PREDICT_PARALLELOGRAM: return predict_traversed_of<PREDICT_PARALLELOGRAM>(s, sink);
    case PREDICT_MEAN: return predict_traversed_of<PREDICT_MEAN>(s, sink);
    case PREDICT_COPY: return predict_traversed_of<PREDICT_COPY>(s, sink);
    case PREDICT_DAMPED: return predict_traversed_of<PREDICT_DAMPED>(s, sink);
    case PREDICT_GEO: return predict_geo(s, sink);
    default: weigh_traversed(); return predict_traversed_of<PREDICT_AFFINE>(s, sink);
  }
}

// --- as the decoder asks for them ---

// Adds residuals to predictions.
struct AddResiduals {
  const uint* residual;

  struct Visitor {
    uint* values;
    const uint* residual;
    uint elements;
    Vertex mask;
    void operator()(uint v, Vertex point) {
      store(values, v, (point + load(residual, 0)) & mask);
      residual += elements;
    }
  };
  Visitor visitor(SerialDecoder& d, uint s) const {
    return {d.vertex(s, 0), residual, d.stream_elements[s], d.vertex_mask(s)};
  }
};

void predict_chains(uint s) { visit_chains(s, AddResiduals{residuals}); }

// `first`: number of residuals of vertices before the first traversed one.
void predict_traversed(uint s, uint first) {
  visit_traversed(s, AddResiduals{residuals + first * stream_elements[s]});
}

#ifdef __wasm_simd128__
// Residuals under a Rice parameter k <= 8, four at a time. The multiplication moves the low bits of
// each of the four to the top of its element.
void read_rice_fours(uint n, uint k, uint low, const uint* list) {
  const uint top = 1u << (31u - k) << 1;  // 0 for k = 0: no low bits
  const Vertex scale = {top, top >> k, top >> 2u * k, top >> 3u * k};
  for (uint i = 0; i < n; i += 4, low += 4u * k) {
    const uint bits = uint(load64(low >> 3) >> (low & 7u));
    const Vertex quotient = load(list + i + 1, 0) - load(list + i, 0) - 1u;
    const Vertex u = (quotient << k) | (bits * scale >> ((32u - k) & 31u));
    store(residuals + i, 0, (u >> 1) ^ (0u - (u & 1u)));
  }
}
#endif
