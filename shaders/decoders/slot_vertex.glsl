// The vertices of the meshlet in a slot.
//
// needs: slot
#ifndef SLOT_VERTEX_GLSL
#define SLOT_VERTEX_GLSL

#include "decoders/decoded_vertex.glsl"

uint vertex_integer(Attribute a, uint place, uint c, uint v) {
  return slot_bits(slot, v, place + c * attribute_field(a), attribute_bits(a));
}

vec3 vertex_position(Primitive p, uint v) { return slot_object_position(slot, p.position, v); }

#endif
