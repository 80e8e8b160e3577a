// Paths `visibility` and `stream`, decoding: the job of connect_stream.comp and values_stream.comp
// is one batch of meshlets, which go into the slots from push.first_slot on
// (vk_backend/decode/batches.py). Same functions as decode_push.glsl. Slots between two segments
// are empty.
#ifndef SLOT_JOBS_GLSL
#define SLOT_JOBS_GLSL

uint job_instance;
uint job_primitive_number;
uint job_begin;  // place of the primitive's first meshlet, if it is in the batch
#define PLACE_OF(m) (job_begin + (m))
#define INSTANCE job_instance
#define PRIMITIVE job_primitive_number
#include "raster/raster_push.glsl"
#include "raster/culling.glsl"
#include "decoders/slots.glsl"
#include "decoders/decode_buffers.glsl"
#include "levels/jobs.glsl"

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
uint job_number;  // of the meshlet in the primitive, for ids
uint job_place;
bool job_present;  // false in an empty slot, which then has the number of the meshlet before

bool has_pool() { return push.jobs != uvec2(0u); }

// Clusters of the frame to draw, or slots of the batch.
uint job_total() {
  if (!has_pool()) return push.meshlets;
  return min(Jobs(push.jobs).cut.clusters, Jobs(push.jobs).cut.capacity);
}

// Number of a workgroup in rows of them.
uint job_workgroup() { return gl_WorkGroupID.y * CUT_COLUMNS + gl_WorkGroupID.x; }

// Opens cluster i of those to decode. Those after the last one have the slot after the last one.
void open_fresh(uint i) {
  Cut cut = Jobs(push.jobs).cut;
  Fresh fresh = FreshClusters(cut.fresh).at[min(i, cut.slots - 1u)];
  job_present = i < cut.fresh_total;
  job_place = job_present ? fresh.slot : cut.slots;
  job_primitive_number = fresh.row;
  job_meshlet = fresh.meshlet;
}

// Opens job i of the frame's clusters: its instance and meshlet.
void open_drawn(uint i) {
  Job job = Jobs(push.jobs).at[min(i, Jobs(push.jobs).cut.capacity - 1u)];
  job_instance = job.instance;
  job_primitive_number = job.row;
  job_meshlet = job.meshlet;
  job_number = job.number;
  job_place = i;
}

// Of the current meshlet in Cut.decoded.
uint decoded_place() {
  return Primitives(the_frame().primitives).at[the_primitive()].first_meshlet + job_meshlet;
}

// Finds the instance and meshlet of the job's slot i, by binary search in the batch's segments.
void open_job(uint i) {
  if (has_pool()) {
    open_fresh(i);
    return;
  }
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
  Segment segment = segments.at[low];
  uint offset = job_place - segment.slot;
  job_instance = segment.instance;
  job_primitive_number = Instances(the_frame().instances).at[job_instance].primitive;
  job_begin = segment.slot - segment.first;
  job_present = offset < segment.meshlets;
  job_meshlet = segment.first + min(offset, segment.meshlets - 1u);
  job_number = job_meshlet;
}

Primitive job_primitive() { return Primitives(the_frame().primitives).at[the_primitive()]; }
bool job_wanted() { return has_pool() || meshlet_visible(job_meshlet); }
uvec2 job_blob() { return Primitives(the_frame().primitives).at[the_primitive()].blob; }
uint job_blob_words() { return Primitives(the_frame().primitives).at[the_primitive()].blob_words; }
uint job_streams() { return Primitives(the_frame().primitives).at[the_primitive()].stream_end; }
uvec2 job_triangles() { return slot_address(push.slots, job_place); }
uvec2 job_values() { return job_triangles(); }  // see packed_values.glsl

#endif
