// Constants that the host and the ray-tracing shaders share. Nothing but #define NAME integer, so
// that GLSL and vk_backend/constants.py can both read it.
#ifndef RT_CONSTANTS_H
#define RT_CONSTANTS_H

// --- the slot table: an entry per meshlet. Any other entry is a slot. ---

#define NO_SLOT 0xFFFFFFFFu
#define REQUESTED 0xFFFFFFFEu  // no slot yet, but on the list of requests

// --- the passes of a frame: rt_cache.glsl ---

#define FIRST_RAYS 0u  // kinds of passes: all pixels
#define RESUME 1u      // waiting paths go on, after the meshlets that they wait for are decoded
#define SWEEP 2u       // waiting paths meet one part of the model, which is decoded
#define LOADING 3u     // only rt_fill.comp: every meshlet gets the slot of its number
#define NO_PART 0xFFFFFFFFu
#define TURNS 2u             // paths without room for a record start in the second turn
#define FIRST_FRAME 64u      // so that no meshlet seems to have been needed before it
#define CHOOSE_THREADS 512u  // of a workgroup of rt_cache.comp
#define FILL_GROUPS 4096u    // of rt_fill.comp, at most; further meshlets take turns

// --- records of waiting paths: rt_paths.glsl ---

#define RECORD_BYTES 32u    // of struct Found, and of struct Level
#define SPREAD 32u          // invocations per path, if they are few: one path per warp
#define SPREAD_PATHS 4096u  // from how many paths on each has one invocation
#define BOUNCE_BITS 8     // of Found.progress
#define SAMPLE_BITS 16    // of Found.progress

// --- geometry ---

#define BOXES_THREADS 32u         // of a workgroup of boxes.comp, one meshlet each
#define MESHLET_BOX_BYTES 24u     // the box around a meshlet: low and high corner, 6 floats
#define PLACED_INDEX 0x7FFFFFu    // bits of an instance's custom index: struct Placed
#define INSTANCE_MASKED 0x800000u  // bit of it: parts of the instance may be transparent

// --- output ---

#define HIT_WORDS 5u  // per pixel: instance, meshlet * 64 + triangle, t, two barycentrics
// The upper byte of a finished pixel's colour is 255. Before, the word holds the key of a hit.
#define MAX_KEY 0xFF000000u

#endif
