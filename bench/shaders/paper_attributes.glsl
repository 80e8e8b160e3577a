// The hit triangle of a meshlet that is in the cache, or is decoded here. Call
// open_hit first. The same names as in rt_attributes.glsl.
#ifndef PAPER_ATTRIBUTES_GLSL
#define PAPER_ATTRIBUTES_GLSL

#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_meshlet.glsl"
#include "paper_cache.glsl"

uint id;  // meshlet * 64 + triangle
uvec3 corners;
vec3 weights;  // of the corners
uvec2 slot;
bool in_cache;
#include "decoders/serial_values.glsl"
#include "decoders/decoded_vertex.glsl"

uint vertex_integer(Attribute a, uint place, uint c, uint v) {
  return in_cache ? slot_bits(slot, v, place + c * attribute_field(a), attribute_bits(a))
                  : decoded_value(a.element + c, v);
}

vec3 vertex_position(Primitive p, uint v) {
  return in_cache ? slot_object_position(slot, p.position, v)
                  : position_value(p.position, uvec3(values[v], values[64u + v], values[128u + v]));
}

hitAttributeEXT HitAttributes found;

#define PRIMITIVE Primitives(Frame(push.frame).primitives).at[placed.primitive]

void open_hit() {
  open_box();
  id = hit_id(found.triangle);
  weights = vec3(1.0 - found.barycentrics.x - found.barycentrics.y, found.barycentrics);
  uint entry = CACHED.slot;
  slot = slot_address(push.cache, entry);
  in_cache = entry != NO_SLOT;
  uint packed;
  if (in_cache) {
    packed = SceneWords(slot).at[found.triangle];
  } else {
    open_blob(PRIMITIVE.blob, PRIMITIVE.blob_words);
    load_streams(0u, PRIMITIVE.stream_end);
    decode_meshlet(meshlet());
    packed = triangles[found.triangle];
  }
  corners = uvec3(packed, packed >> 8, packed >> 16) & 63u;
}

#endif
