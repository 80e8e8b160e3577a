// The cache of the paper: any meshlet may have a slot, and rays count their tests.
#ifndef PAPER_CACHE_GLSL
#define PAPER_CACHE_GLSL

#include "raytrace/rt_meshlet.glsl"

#define NO_SLOT 0xFFFFFFFFu
struct CachedMeshlet {
  uint slot;   // or NO_SLOT
  uint tests;  // by rays of the last frame
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer CachedMeshlets {
  CachedMeshlet at[];
};
// Paths of rt-paper do not sweep, so the address of records is free.
#define CACHED CachedMeshlets(push.records).at[number]

#endif
