// Shared by the stages of all raster paths: specialisation constants, and access to the current
// instance.
//
// needs: push
// optional: INSTANCE, PRIMITIVE
#ifndef RASTER_GLSL
#define RASTER_GLSL

#include "scene/scene.glsl"

// Ids 0 and 1 are the decoder's capacities, MAX_STREAMS and MAX_ELEMENTS.
// Attributes (HAS_) that any primitive of the scene has; shaders read and write no others.
layout(constant_id = 2) const uint ATTRIBUTES = 7u;
layout(constant_id = 3) const bool CULLING = true;  // skip meshlets that cannot be visible

// The current instance. Shaders that look at several define their own.
#ifndef INSTANCE
#define INSTANCE push.instance
#endif

// The primitive of the current meshlet.
#ifndef PRIMITIVE
#define PRIMITIVE Instances(the_frame().instances).at[INSTANCE].primitive
#endif

Frame the_frame() { return Frame(push.frame); }
Instance the_instance() { return Instances(the_frame().instances).at[INSTANCE]; }
uint the_primitive() { return PRIMITIVE; }
ivec2 picture_size() { return ivec2(the_frame().width, the_frame().height); }
mat4 object_to_clip() { return Matrices(the_frame().object_to_clip).at[INSTANCE]; }

// Transforms a normal to world space; the fragment shader normalises it. Zero means no normal.
vec3 world_normal(vec3 normal) {
  return transpose(mat3(Instances(the_frame().instances).at[INSTANCE].world_to_object)) * normal;
}

#endif
