// Levels of detail: the hierarchies of all primitives, as in the files (EXT_meshlet_lod, "Tables"),
// and the push constants of cut.comp and rounds.comp. The host has checked all numbers.
#ifndef LEVELS_GLSL
#define LEVELS_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "scene/scene.glsl"
#include "levels/jobs.glsl"

struct Group {
  vec4 sphere;  // centre, radius
  float error;
  uint first_run;
  uint page;
  uint counts;  // first cluster | clusters << 16 | runs << 24
};

// Where a primitive's tables begin in those of all primitives.
struct Hierarchy {
  uint first_group;
  uint groups;
  uint first_page;
  uint first_run;
};

struct Page {
  uint row;            // in Frame.primitives, or NOT_RESIDENT
  uint first_cluster;  // number of its first cluster in the primitive
};

// CUT_THREADS groups of an instance.
struct Block {
  uint instance;
  uint first_group;
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Groups {
  Group at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Hierarchies {
  Hierarchy at[];
};
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Pages { Page at[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer Blocks { Block at[]; };
// Per page: the largest error of a visible group on the screen, as bits of a float.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Requests { uint at[]; };

// Where the camera will be soon, and what it will need.
struct Ahead {
  mat4 world_to_clip;
  vec4 eye;  // as Frame.eye
  uvec2 requests;
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Aheads { Ahead at; };

layout(push_constant) uniform CutPush {
  uvec2 frame;
  uvec2 groups;
  uvec2 runs;
  uvec2 hierarchies;
  uvec2 pages;
  uvec2 blocks;
  uvec2 requests;
  uvec2 jobs;
  uvec2 ahead;            // 0: the camera stands still
  float pixels_per_unit;  // of one unit at distance one, or at any if the camera is orthographic
  float least_pixels;     // the error from which on pages are asked for
  uint block_total;
  uint last_round;
  float near;  // the near plane: no surface is nearer to a perspective camera
}
push;

#define INFINITE_BITS 0x7F800000u

#endif
