// The depth pyramid: the greatest depth of each square of 4, 8, 16, 32 and 64 pixels. Levels follow
// each other; rows of a level span the picture's tiles. The pyramid lies after the pixels at
// push.pixels: the visibility buffer, or the depths of a depth image. A pixel has PIXEL_WORDS
// words, the last of which is its depth.
//
// needs: push
#ifndef PYRAMID_GLSL
#define PYRAMID_GLSL

#include "raster/raster.glsl"
#include "scene/addresses.glsl"

layout(constant_id = 29) const uint PIXEL_WORDS = 2u;

#define PYRAMID_LEVELS 5u
#define TILE_TEXELS 16u  // of the finest level: side of a tile

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Depths { float at[]; };

#define PYRAMID Depths(byte_offset(push.pixels, PIXEL_WORDS, the_frame().width* the_frame().height))

uint pyramid_place(uint level, uvec2 texel) {
  uvec2 tiles = (uvec2(picture_size()) + PYRAMID_SIDE - 1u) / PYRAMID_SIDE;
  uint before = (1024u - (1024u >> (2u * level))) / 3u;  // floats of a tile in finer levels
  return tiles.x * tiles.y * before + texel.y * tiles.x * (TILE_TEXELS >> level) + texel.x;
}

#endif
