// Cuts by the rule of EXT_meshlet_lod, and the pages that they need.
#pragma once
#include <cstddef>

#include "levels/tables.h"

namespace gltf_meshlet_codec {

// From where the groups of an instance are seen.
struct CutCamera {
  bool orthographic;
  double eye[3];
  double pixels_per_unit;
  double least_distance;  // to a sphere; 0: a millionth of the largest radius in root pages
  double threshold;       // groups of more pixels are needed
  const double* matrix;  // 16 numbers, column by column, from POSITION to the eye's coordinates, or
                         // null
  double scale;          // largest_scale(matrix); 1 without one
};

// The largest singular value of the upper left 3 x 3 part; infinite if it is beyond double.
double largest_scale(const double* matrix);

// Clusters [first, first + count) of a page, of one group.
struct CutDraw {
  uint32_t page, first_cluster, clusters, group;
};

// Arrays of the caller.
struct CutArrays {
  const uint8_t* resident;  // of each page: 0 if it is not in memory; null: all are
  uint8_t* active;          // of each known group: receives 1 or 0
  float* urgency;           // of each page, or null: is raised to the pixels of its needed groups
  CutDraw* draws;           // null, or room for most_draws()
};

struct CutResult {
  size_t draws;
  uint32_t groups;  // of whole pages, that have to be known for the finest such cut
  double error;     // at most, in pixels
};

// Writes the cut of an instance. Allocates nothing. Draws nothing unless all root pages are
// resident.
CutResult make_cut(const LevelTables& tables, const CutCamera& camera, const CutArrays& arrays);

// Writes the numbers of the pages of an urgency above 0, the most urgent first. Returns how many.
size_t rank_pages(const float* urgency, size_t count, uint32_t* order);

}  // namespace gltf_meshlet_codec
