// Finds the decoded vertices that are one vertex of the source.
//
// A vertex on the border of two blobs is in both, and a blob doubles some where its meshlets meet
// (specification, "Joining vertices"). All copies have equal integers. The reverse does not hold:
// vertices of the source that only the grid makes equal stay apart, as far as that can be told.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gltf_meshlet_codec {

struct DecodedMesh {
  const uint32_t* triangles;  // three vertex numbers each, below vertex_count
  size_t triangle_count;
  size_t vertex_count;              // below 2^32 - 1
  const uint32_t* const* integers;  // per stream: vertices x elements; stream 0 is the position
  const uint32_t* elements;         // per stream
  size_t stream_count;
  const uint32_t* shared;      // per vertex: see Outputs in decode/decoder.h; or null
  const uint64_t* blob_begin;  // first vertex of each blob, in ascending order
  size_t blob_count;
};

// source_vertices: number of the source's vertices; 0 if it is not known. Writes numbers[v]: equal
// for vertices that are one, from 0 in order of first occurrence. Returns how many there are: at
// least source_vertices, unless vertices are equal that no source would double.
uint32_t join_vertices(const DecodedMesh& mesh, uint32_t source_vertices, uint32_t* numbers);

}  // namespace gltf_meshlet_codec
