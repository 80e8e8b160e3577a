// Between the two phases of path `visibility` with a pool, and of paths `mesh` and `mesh-paper`:
// the depth pyramid, a workgroup per tile of PYRAMID_SIDE pixels, a thread per texel of the finest
// level.
//
// Input: the visibility buffer, or the depths of a depth image. Output: the pyramid.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "raster/raster_push.glsl"
#include "visibility/pyramid.glsl"
layout(local_size_x = TILE_TEXELS, local_size_y = TILE_TEXELS) in;

shared float depths[TILE_TEXELS][TILE_TEXELS];

float pixel_depth(uint pixel) {
  return SceneFloats(push.pixels).at[pixel * PIXEL_WORDS + PIXEL_WORDS - 1u];
}

void put_depth(uint level, uvec2 own, float depth) {
  uvec2 texel = gl_WorkGroupID.xy * (TILE_TEXELS >> level) + own;
  PYRAMID.at[pyramid_place(level, texel)] = depth;
}

void main() {
  uvec2 own = gl_LocalInvocationID.xy;
  uvec2 first = gl_WorkGroupID.xy * PYRAMID_SIDE + own * 4u;
  uvec2 end = min(first + 4u, uvec2(picture_size()));
  float depth = 0.0;
  for (uint y = first.y; y < end.y; y++)
    for (uint x = first.x; x < end.x; x++)
      depth = max(depth, pixel_depth(y * the_frame().width + x));
  put_depth(0u, own, depth);
  for (uint level = 1u; level < PYRAMID_LEVELS; level++) {
    depths[own.y][own.x] = depth;
    barrier();
    bool inside = max(own.x, own.y) < TILE_TEXELS >> level;
    uvec2 at = min(own * 2u, uvec2(TILE_TEXELS - 2u));
    depth = max(max(depths[at.y][at.x], depths[at.y][at.x + 1u]),
                max(depths[at.y + 1u][at.x], depths[at.y + 1u][at.x + 1u]));
    barrier();
    if (inside) put_depth(level, own, depth);
  }
}
