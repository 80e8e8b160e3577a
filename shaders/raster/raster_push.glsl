// Push constants of the raster paths and of the decoding for them; paths `mesh` and `mesh-paper`
// have their own (tasks.glsl), which begin in the same way.
#ifndef RASTER_PUSH_GLSL
#define RASTER_PUSH_GLSL

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
