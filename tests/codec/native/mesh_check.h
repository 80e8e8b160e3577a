// Checks the guarantees of generate_meshlets by brute force and measures a partition. Shares no
// code with the partition itself.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "segment/generate_meshlets.h"

struct Mesh {
  std::vector<float> positions;
  std::vector<uint32_t> triangles, position_ids;

  size_t vertex_count() const { return positions.size() / 3; }
  size_t triangle_count() const { return triangles.size() / 3; }
  gltf_meshlet_codec::MeshView view() const {
    return {triangles.data(), triangle_count(), position_ids.data(), positions.data(),
            vertex_count()};
  }
};

// Returns an empty string if all guarantees hold, else the problem.
std::string check_meshlets(const Mesh& mesh, const gltf_meshlet_codec::GenerationOptions& options,
                           const gltf_meshlet_codec::Meshlets& meshlets);

// Sums over the meshlets of one or more meshes.
struct Figures {
  size_t triangles = 0, meshlets = 0, disks = 0;
  size_t vertices = 0, boundary_vertices = 0;  // counted once per disk
  size_t references = 0,
         owned_chains = 0;  // runs of boundary edges with one meshlet on their other side
  size_t corners = 0, chain_vertices = 0;  // shared by the meshlets: ends of runs, vertices within
  size_t neighbours = 0;                   // per meshlet, by position
  double index_difference = 0;             // summed over pairs of neighbours
  size_t pairs = 0;
};

void add_figures(const Mesh& mesh, const gltf_meshlet_codec::Meshlets& meshlets, Figures& figures);
