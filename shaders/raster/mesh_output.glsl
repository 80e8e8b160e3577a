// Outputs of the mesh stages besides positions; surface.frag reads them. For ids, and for clusters
// of several instances in one draw, also two numbers per triangle: the built-in gl_PrimitiveID
// would do for the second, but Mesa's software renderer passes a wrong one. They are always
// written: Mesa's software renderer draws wrong pictures if they are not.
//
// needs: push
#ifndef MESH_OUTPUT_GLSL
#define MESH_OUTPUT_GLSL

#include "raster/raster.glsl"
layout(location = 0) out vec3 out_normal[];
layout(location = 1) out vec2 out_texcoord[];
layout(location = 2) out vec4 out_color[];
// Instance, meshlet * MESHLET_TRIANGLES + triangle.
layout(location = 3) perprimitiveEXT out uvec2 out_ids[];
layout(constant_id = 22) const bool NUMBERS = false;  // surface.frag reads out_ids

// Writes the attributes of vertex v that any primitive of the scene has. normal: in world space.
void put_attributes(uint v, vec3 normal, vec2 texcoord, vec4 color) {
  // With NUMBERS all: Mesa's software renderer loses out_ids if an earlier output is not written.
  if (NUMBERS || (ATTRIBUTES & HAS_NORMAL) != 0u) out_normal[v] = normal;
  if (NUMBERS || (ATTRIBUTES & HAS_TEXCOORD) != 0u) out_texcoord[v] = texcoord;
  if (NUMBERS || (ATTRIBUTES & HAS_COLOR) != 0u) out_color[v] = color;
}

// Writes triangle t of meshlet m, packed a | b << 8 | v << 16.
void put_triangle(uint t, uint m, uint packed, uint vertices) {
  gl_PrimitiveTriangleIndicesEXT[t] =
      min(uvec3(packed, packed >> 8, packed >> 16) & 63u, uvec3(vertices - 1u));
  out_ids[t] = uvec2(INSTANCE, m * MESHLET_TRIANGLES + t);
}

#endif
