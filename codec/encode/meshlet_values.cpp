#include "encode/meshlet_values.h"

#include <algorithm>

namespace gltf_meshlet_codec {

MeshletValues::MeshletValues(const std::vector<Stream>& streams, const VertexValues& values)
    : streams_(streams), values_(values), decoder_(new SerialDecoder) {
  SerialDecoder& decoder = *decoder_;
  decoder.stream_total = decoder.stream_end = uint32_t(streams.size());
  for (uint32_t s = 0; s < streams.size(); s++) {
    decoder.stream_elements[s] = streams[s].elements;
    decoder.stream_bits[s] = streams[s].bits;
    decoder.stream_element[s] = uint16_t(STREAM_MAX_ELEMENTS * s);
    first_element_.push_back(element_count_);
    element_count_ += streams[s].elements;
    affine_streams_ |= uint64_t(streams[s].predictor == kAffine) << s;
    needs_normals_ = needs_normals_ || streams[s].kind == kOct;
  }
}

void MeshletValues::add_disk(const LocalMeshlet& meshlet) {
  SerialDecoder& decoder = *decoder_;
  const uint32_t first = meshlet.first_vertex(), end = meshlet.vertex_count();
  for (uint32_t s = 0; s < streams_.size(); s++)
    for (uint32_t v = first; v < end; v++)
      copy_elements(values_.of(s, meshlet.vertex(v)), streams_[s].elements, decoder.vertex(s, v));
  if (!needs_normals_) return;
  // Does the same as SerialDecoder::sum_normals, for this disk alone.
  const uint32_t h = decoder.excess(streams_[0].bits, GEO_POSITION_BITS);
  std::fill(decoder.normals + 4 * first, decoder.normals + 4 * end, 0u);
  for (uint32_t t = meshlet.first_triangle(); t < meshlet.triangle_count(); t++) {
    const uint32_t corners[3] = {meshlet.start(3 * t), meshlet.start(3 * t + 1),
                                 meshlet.start(3 * t + 2)};
    const SerialDecoder::Triple n =
        decoder.triangle_normal(corners[0] | corners[1] << 8 | corners[2] << 16, h);
    for (uint32_t v : corners) {
      decoder.normals[4 * v] += n.x;
      decoder.normals[4 * v + 1] += n.y;
      decoder.normals[4 * v + 2] += n.z;
    }
  }
}

void MeshletValues::traversed(uint32_t s, uint32_t predictor, uint32_t triangle,
                              const SerialDecoder::Weights& weights, uint32_t* out) {
  SerialDecoder& decoder = *decoder_;
  const uint32_t id = triangle >> 16 & 255u, bits = streams_[s].bits;
  const uint32_t* v = decoder.vertex(s, id);
  if (predictor == PREDICT_GEO) {
    const uint32_t* normal = decoder.normals + 4 * id;
    const SerialDecoder::OctPair q =
        decoder.octahedral_prediction(normal[0], normal[1], normal[2], bits);
    out[0] = zigzag(v[0] - q.u, bits);
    out[1] = zigzag(v[1] - q.v, bits);
    return;
  }
  const bool across = triangle >> 24 != NO_VERTEX;
  const bool affine = predictor == PREDICT_AFFINE;
  const uint32_t* a = decoder.vertex(s, triangle & 255u);
  const uint32_t* b = decoder.vertex(s, triangle >> 8 & 255u);
  const uint32_t* o = across ? decoder.vertex(s, triangle >> 24) : a;
  for (uint32_t c = 0; c < streams_[s].elements; c++) {
    const uint32_t prediction =
        affine && weights.exist
            ? decoder.affine_point(weights, a[c], b[c], o[c])
            : decoder.traversed_prediction(affine ? PREDICT_PARALLELOGRAM : predictor, a[c], b[c],
                                           o[c], across);
    out[c] = zigzag(v[c] - prediction, bits);
  }
}

void MeshletValues::traversed(uint32_t s, uint32_t predictor, uint32_t triangle, uint32_t* out) {
  SerialDecoder::Weights weights{};
  if (predictor == PREDICT_AFFINE) weights = decoder_->traversed_weights(triangle);
  traversed(s, predictor, triangle, weights, out);
}

void MeshletValues::traversed(uint64_t streams, uint32_t triangle, uint32_t* out) {
  SerialDecoder::Weights weights{};
  if (streams & affine_streams_) weights = decoder_->traversed_weights(triangle);
  for (; streams; streams &= streams - 1) {
    const uint32_t s = SerialDecoder::mask_lsb(streams);
    traversed(s, streams_[s].predictor, triangle, weights, out + first_element_[s]);
  }
}

void MeshletValues::place(PlannedReferences references, const std::vector<uint8_t>& loop_vertices) {
  SerialDecoder& decoder = *decoder_;
  references_ = references;
  listed_ = 0;
  std::copy(loop_vertices.begin(), loop_vertices.end(), decoder.loop_vertex);
  uint32_t rank = 0, loop = 0;
  for (uint32_t i = 0; i < references.count; i++) {
    const PlannedReference& r = references.data[i];
    decoder.reference_rank[i] = uint16_t(rank);
    decoder.reference_length[i] = uint16_t(r.reference.length);
    rank += r.reference.length;
    decoder.reference_end[i] = decoder.loop_vertex[r.loop_end ? loop : rank];
    if (r.loop_end) loop = rank;
  }
}

void MeshletValues::anchors(uint32_t s, std::vector<uint32_t>& out) const {
  const uint32_t* first = nullptr;
  for (uint32_t i = 0; i < references_.count; i++) {
    if (!references_.data[i].own_for(s) || !references_.before(i).own_for(s)) continue;
    const uint32_t* v = decoder_->vertex(s, decoder_->loop_vertex[decoder_->reference_rank[i]]);
    for (uint32_t c = 0; c < streams_[s].elements; c++)
      out.push_back(first ? zigzag(v[c] - first[c], streams_[s].bits) : v[c]);
    if (!first) first = v;
  }
}

void MeshletValues::append_chains(uint32_t s, uint32_t predictor, uint64_t references,
                                  std::vector<uint32_t>& out) {
  if (references == 0) return;
  SerialDecoder& decoder = *decoder_;
  if (references != listed_) decoder.list_chains(references);
  listed_ = references;
  for (uint32_t j = 0; j < decoder.chain_count; j++) {
    const uint32_t step = decoder.chain_step[j];
    const uint32_t* v = decoder.vertex(s, step & 255u);
    const uint32_t* before = decoder.vertex(s, step >> 8 & 255u);
    const uint32_t* end = decoder.vertex(s, step >> 16 & 255u);
    const uint32_t* earlier = step >> 24 == NO_VERTEX ? before : decoder.vertex(s, step >> 24);
    SerialDecoder::Weights weights{};
    if (predictor == PREDICT_AFFINE) weights = decoder.chain_weights(step);
    for (uint32_t c = 0; c < streams_[s].elements; c++) {
      const uint32_t prediction =
          predictor == PREDICT_COPY ? before[c]
                                    : decoder.affine_chain_point(weights, before[c], end[c],
                                                                 earlier[c], decoder.chain_left[j]);
      out.push_back(zigzag(v[c] - prediction, streams_[s].bits));
    }
  }
}

void MeshletValues::chains(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out) {
  uint64_t owned = 0;
  for (uint32_t i = 0; i < references_.count; i++)
    owned |= uint64_t(references_.data[i].owned()) << i;
  append_chains(s, predictor, owned, out);
}

void MeshletValues::seams(uint32_t s, uint32_t predictor, std::vector<uint32_t>& out) {
  uint64_t seams = 0;
  for (uint32_t i = 0; i < references_.count; i++)
    seams |= uint64_t(references_.data[i].foreign() && references_.data[i].own_for(s)) << i;
  append_chains(s, predictor, seams, out);
}

}  // namespace gltf_meshlet_codec
