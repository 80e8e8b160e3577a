// Compact blocks: all meshlets of a shape as integers, in arrays of words that kernels can gather.
#pragma once
#include <vector>

#include "model.h"

namespace meshlet_shape {

// How the vertices of a shape are stored; alike for all its meshlets.
struct Form {
  bool wide_positions = false;  // floats in place of 16-bit distances from the block's corner
  bool normals = false, wide_normals = false;      // wide: floats, in place of 2 x 8 bits
  bool texcoords = false, wide_texcoords = false;  // wide: floats, in place of 2 x 16 bits
  uint32_t attribute_words = 0;                    // floats of all further attributes

  uint32_t vertex_words() const { return wide_positions ? 3 : 2; }
};

// From the integers of a block to the world, for the blocks of one primitive. As words of a table:
// a kernel gathers them.
struct Place {
  float to_world[3][4];  // of positions
  float normals[3][3];   // of directions; zero if the primitive has no normals
  float normal_scale;
  float texcoord_scale[2], texcoord_offset[2];
  float texcoords;  // 1 if the primitive has them, else 0
};
constexpr uint32_t kPlaceWords = sizeof(Place) / sizeof(float);

// What a Place is computed from when the shape's to_world changes.
struct Grid {
  Affine matrix;  // from the primitive to the shape
  double step = 1, offset[3] = {0, 0, 0};
  float normal_scale = 0;  // 0: there are no normals, or they are floats
  bool normals = false, texcoords = false;
  bool smooth = false;  // normals are those of the triangles, and turn with them
  float texcoord_scale = 1, texcoord_offset[2] = {0, 0};
  float lower[3], upper[3];  // of the positions, before step and offset

  bool same_place(const Grid& other) const;
  void expand(const Grid& other);
};

// Words of `heads` for each block: the corner x, y, z that 16-bit positions count from, and the
// number of the first vertex. One more head ends the list.
constexpr uint32_t kHeadWords = 4;
// A triangle: three corners of 6 bits, numbers in the block; then its block as a distance from
// first_block of the triangle's 64.
constexpr uint32_t kCornerBits = 6, kCornerMask = 63, kBlockShift = 18;

struct Blocks {
  Form form;
  std::vector<uint32_t> heads;
  std::vector<uint32_t> block_grid;  // per block, the number of its grid
  std::vector<uint32_t> vertices;    // x | y << 16, z | normal << 16; wide: three floats
  std::vector<uint32_t> normals;     // only if they are wide
  std::vector<uint32_t> texcoords;   // u | v << 16; wide: two floats
  std::vector<uint32_t> attributes;  // floats
  std::vector<uint32_t> triangles;
  std::vector<uint32_t> first_block;  // of every 64 triangles
  std::vector<Grid> grids;

  uint32_t block_count() const { return uint32_t(heads.size() / kHeadWords) - 1; }
  uint32_t vertex_count() const { return uint32_t(vertices.size() / form.vertex_words()); }
};

// Decodes all meshlets of checked primitives. Throws std::runtime_error.
Blocks make_blocks(const std::vector<Primitive>& primitives, const Options& options,
                   const Parallel& parallel);

// The grid under the shape's to_world, row-major 3 x 4.
Place place_of(const Grid& grid, const double (&to_world)[3][4], bool flip_texcoords);

// Where the blocks of a shape lie in memory.
struct BlockView {
  const uint32_t *heads, *block_grid, *vertices, *triangles, *first_block;
  uint32_t block_count, triangle_count;
  bool wide_positions;
  const Place* places;
};

Box bounds_of(const BlockView& blocks);
// Of the blocks of a grid, and sometimes a bit more: without a look at vertices.
Box bounds_of(const Grid& grid, const Place& place);

// Writes three floats for each vertex, and three vertex numbers for each triangle.
void write_triangles(const BlockView& blocks, float* positions, uint32_t* faces);

// Writes the texture coordinates of all corners, six floats for each triangle.
void write_texcoords(const BlockView& blocks, const uint32_t* texcoords, bool wide, float* out);

}  // namespace meshlet_shape
