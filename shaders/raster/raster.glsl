// Shared by the stages of all raster paths: push constants, specialisation constants, and access to
// the current instance.
#ifndef RASTER_GLSL
#define RASTER_GLSL

#include "scene/scene.glsl"

// Ids 0 and 1 are the decoder's capacities, MAX_STREAMS and MAX_ELEMENTS.
// Attributes (HAS_) that any primitive of the scene has; shaders read and write no others.
layout(constant_id = 2) const uint ATTRIBUTES = 7u;
layout(constant_id = 3) const bool CULLING = true;  // skip meshlets that cannot be visible

#ifndef OWN_PUSH  // the includer may have others that begin with `frame` and `instance`
layout(push_constant) uniform RasterPush {
  uvec2 frame;
  uint instance;
  uint first;  // meshlet of the draw's first workgroup or point; with a pool, number of the pass
  // Only paths `stream` and `visibility` (vk_backend/decode/batches.py):
  uint meshlets;       // to decode
  uint first_slot;     // of the first of them, or of the first workgroup that draws
  uvec2 slots;         // the ring
  uvec2 summaries;     // per slot: see decode_buffers.glsl
  uvec2 connectivity;  // per slot
  uvec2 places;        // per slot, for bulk passes
  uvec2 segments;      // of the batch, see slot_jobs.glsl
  uint segment_count;
  // Only path `visibility` (vk_backend/visibility), see visibility.glsl:
  uint batch;      // BATCH_
  uvec2 pixels;    // the visibility buffer
  uvec2 pieces;    // of large triangles
  uvec2 overflow;  // per slot: triangles whose pieces did not fit
  uvec2 color;     // results
  uvec2 depth;
  uvec2 ids;   // may be 0
  uvec2 jobs;  // with a pool: see levels/jobs.glsl; else 0
}
push;
#endif

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
