// Path `stream`, decoding: the job of connect_stream.comp and values_stream.comp is one batch of
// meshlets, which go into the slots from push.first_slot on (vk_backend/ring.py). Same functions as
// decode_push.glsl, except job_values: slot_output.glsl writes the values.

uint job_instance;
#define INSTANCE job_instance
#include "raster/culling.glsl"
#include "scene/slots.glsl"
#include "decoders/decode_buffers.glsl"

struct Segment {
  uint instance;
  uint first;  // meshlets [first, first + meshlets) of the instance
  uint meshlets;
  uint slot;  // of the first; the others follow
};
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Segments {
  Segment at[];
};

#define FIRST_MESHLET 0u
uint job_meshlet;
uint job_place;

// Finds the instance and meshlet of the job's slot i by binary search in the batch's segments.
void open_job(uint i) {
  job_place = push.first_slot + i;
  Segments segments = Segments(push.segments);
  uint low = 0u;  // the last segment that begins at or before the slot
  uint high = push.segment_count;
  while (high - low > 1u) {
    uint middle = (low + high) >> 1;
    if (segments.at[middle].slot <= job_place)
      low = middle;
    else
      high = middle;
  }
  job_instance = segments.at[low].instance;
  job_meshlet = segments.at[low].first + job_place - segments.at[low].slot;
}

Primitive job_primitive() { return Primitives(the_frame().primitives).at[the_primitive()]; }
bool job_wanted() { return meshlet_visible(job_meshlet); }
uvec2 job_blob() { return Primitives(the_frame().primitives).at[the_primitive()].blob; }
uint job_blob_words() { return Primitives(the_frame().primitives).at[the_primitive()].blob_words; }
uint job_streams() { return Primitives(the_frame().primitives).at[the_primitive()].stream_end; }
uvec2 job_triangles() { return slot_address(push.slots, job_place); }
