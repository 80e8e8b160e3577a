// Cuts polygons into triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace meshlet {

// points: 3 floats of each corner, one polygon after the other; sizes: corners of each of `count`
// polygons, less than 2^32 in all.
// Returns three corners, numbered over all polygons, of each triangle: size - 2 triangles for each
// polygon, none for fewer than three corners, in the polygon's direction. They do not overlap if
// the polygon is planar and does not cross itself.
std::vector<uint32_t> triangulate(const float* points, const uint32_t* sizes, size_t count);

}  // namespace meshlet
