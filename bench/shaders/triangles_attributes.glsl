// The hit triangle of the driver's acceleration structure. Call open_hit first. The same names
// as in rt_attributes.glsl.
#ifndef TRIANGLES_ATTRIBUTES_GLSL
#define TRIANGLES_ATTRIBUTES_GLSL

#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_meshlet.glsl"

layout(constant_id = 7) const uint ATTRIBUTES = 7u;  // HAS_ bits of an uncompressed vertex
// Paths of rt-triangles do not sweep, so the address of records is free.
#define PLAIN_ADDRESS push.records
#include "plain_vertex.glsl"

uint id;  // triangle: the host looks up the meshlet
uvec3 corners;
vec3 weights;  // of the corners
hitAttributeEXT vec2 found;

#define PRIMITIVE plain_primitive(placed.primitive)

void open_hit() {
  open_box();
  id = gl_PrimitiveID;
  weights = vec3(1.0 - found.x - found.y, found);
  SceneWords indices = SceneWords(PRIMITIVE.indices);
  for (uint k = 0u; k < 3u; k++) corners[k] = indices.at[3u * id + k];
}

#endif
