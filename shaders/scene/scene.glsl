// The scene in GPU memory, and the conversion of decoded integers to floats. Shaders reach
// everything through buffer addresses.
#ifndef SCENE_GLSL
#define SCENE_GLSL
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "format/constants.h"
#include "scene/scene_constants.h"

// Dequantisation of one attribute (specification, appendix B).
struct Attribute {
  vec4 offset;
  float step;
  uint element;    // first element in values[element * 64 + id], or NO_ELEMENT
  uint kind_bits;  // KIND_ | bits << 8 | elements << 16 | ATTRIBUTE_ROUND
  float scale;     // 1 / max for normalised integer accessors, else 1
};

// One glTF primitive. An address is 0 if the path does not need the data behind it.
struct Primitive {
  uvec2 blob;
  uint blob_words;
  uint meshlets;
  uint stream_end;     // decode streams [0, stream_end) and skip the rest: shading does not need it
  uint first_meshlet;  // its number among those of all primitives, or of all resident pages
  uvec2 bounds;        // a word per meshlet, see bounds.glsl
  vec4 box_low;        // box of the positions; a loose box only makes culling less effective
  vec4 box_size;
  Attribute position;
  Attribute normal;
  Attribute texcoord;
  Attribute color;
};

// A primitive placed in the world: one draw.
struct Instance {
  mat4 object_to_world;
  mat4 world_to_object;  // for normals: transpose(mat3(world_to_object)) * n
  uint primitive;
  uint material;
  float scale;  // the largest of object_to_world
  uint flags;   // INSTANCE_
};

struct Material {
  vec4 base_color;  // linear, as all colours
  vec4 emissive;
  vec4 texcoord_matrix;  // of the base texture: two columns
  vec2 texcoord_offset;
  float metallic;
  float roughness;
  float alpha_cutoff;
  uint flags;            // MATERIAL_
  int base_texture;      // in the array of textures, or -1
  int emissive_texture;  // read at the same place
};

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Primitives {
  Primitive at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Instances {
  Instance at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Materials {
  Material at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Matrices {
  mat4 at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer SceneWords {
  uint at[];
};
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer SceneFloats {
  float at[];
};

// The camera, the light and the scene's buffers for one picture.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Frame {
  mat4 world_to_clip;  // y down, depth 0 to 1
  mat4 clip_to_world;
  vec4 eye;              // w 1: position; w 0: direction towards an orthographic camera
  vec4 light_direction;  // unit vector towards the light
  uvec2 primitives;
  uvec2 instances;
  uvec2 materials;
  uvec2 object_to_clip;  // a matrix per instance
  uint width;
  uint height;
};

uint attribute_kind(Attribute a) { return a.kind_bits & 255u; }
uint attribute_bits(Attribute a) { return (a.kind_bits >> 8) & 255u; }
uint attribute_elements(Attribute a) { return (a.kind_bits >> 16) & 255u; }

// Decodes an octahedral pair to a unit vector. The grid is even: 0 and all axes are exact, if no
// driver fuses the multiplication with the subtraction.
vec3 unit_of_oct(uvec2 q, uint bits) {
  precise vec2 doubled = vec2(q) * (2.0 / float((1u << bits) - 2u));
  precise vec2 p = doubled - 1.0;
  float z = 1.0 - abs(p.x) - abs(p.y);
  float fold = max(-z, 0.0);
  p -= vec2(p.x < 0.0 ? -fold : fold, p.y < 0.0 ? -fold : fold);
  vec3 n = vec3(p, z);
  vec3 squares = n * n;
  // Neither normalize nor dot: drivers may contract those, and ray tracing needs exact results.
  return n * inversesqrt(squares.x + squares.y + squares.z);
}

float float_of_ordered_bits(uint q) {
  return uintBitsToFloat((q & 0x80000000u) != 0u ? q ^ 0x80000000u : ~q);
}

// offset + q * step in binary32. Multiplication and addition round separately, so that every path
// and numpy get the same bits. Values of integer accessors are rounded to integers.
float grid_value(float offset, uint q, float step, uint kind_bits, float scale) {
  precise float scaled = float(q) * step;
  precise float value = offset + scaled;
  if ((kind_bits & ATTRIBUTE_ROUND) != 0u) value = roundEven(value);
  precise float result = value * scale;
  // Two integers of a normalised signed type stand for -1: max(c / 127, -1).
  return scale != 1.0 ? max(result, -1.0) : result;
}

// Dequantises any attribute that is not octahedral. Missing elements are 0.
vec4 attribute_value(Attribute a, uvec4 q) {
  vec4 value = vec4(0.0);
  uint elements = min(attribute_elements(a), 4u);
  for (uint c = 0u; c < elements; c++) {
    if (attribute_kind(a) == KIND_GRID)
      value[c] = grid_value(a.offset[c], q[c], a.step, a.kind_bits, a.scale);
    else if (attribute_kind(a) == KIND_FLOAT32)
      value[c] = float_of_ordered_bits(q[c]);
    else
      value[c] = float(q[c]) * a.scale;
  }
  return value;
}

// Dequantises a position to object coordinates. Positions are always of kind GRID.
vec3 position_value(Attribute a, uvec3 q) {
  return vec3(grid_value(a.offset.x, q.x, a.step, a.kind_bits, a.scale),
              grid_value(a.offset.y, q.y, a.step, a.kind_bits, a.scale),
              grid_value(a.offset.z, q.z, a.step, a.kind_bits, a.scale));
}

vec3 normal_value(Attribute a, uvec3 q) {
  if (attribute_kind(a) == KIND_OCT) return unit_of_oct(q.xy, attribute_bits(a));
  return attribute_value(a, uvec4(q, 0u)).xyz;
}

// m * vec4(p, 1). Every operation rounds separately, so that all stages and paths get the same
// bits.
vec4 transformed(mat4 m, vec3 p) {
  precise vec4 x = m[0] * p.x;
  precise vec4 y = m[1] * p.y;
  precise vec4 z = m[2] * p.z;
  precise vec4 xy = x + y;
  precise vec4 xyz = xy + z;
  precise vec4 result = xyz + m[3];
  return result;
}

#endif
