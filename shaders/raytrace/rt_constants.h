// Constants that the host and the ray-tracing shaders share. Nothing but #define NAME integer, so
// that GLSL and vk_backend/constants.py can both read it.
#ifndef RT_CONSTANTS_H
#define RT_CONSTANTS_H

// --- the slot table: an entry per meshlet. Any other entry is a slot, perhaps with a flag. ---

#define NO_SLOT 0xFFFFFFFFu
#define REQUESTED 0xFFFFFFFEu  // no slot yet, but on the list of requests
#define COMING 0x80000000u     // flag: decoded during the first launch; later launches may read it
#define HOT 0x40000000u        // flag: at least HOT_COUNT rays needed it in the last frame
#define SLOT_BITS 0x3FFFFFFFu
#define HOT_COUNT 256u

// --- a meshlet's counter ---

#define COUNTED_RAY 2u  // added by each ray that needs the meshlet
#define TOUCHED_RAY 1u  // set by rays that tested it and did not hit it

// --- classes of slots and meshlets: rt_cache.glsl ---

#define CLASSES 13u
#define LISTS 26u      // 2 * CLASSES: slots by class, then meshlets without a slot by class
#define REQUESTS 13u   // CLASSES + IDLE: the list of the meshlets that paths wait for
#define NEIGHBOURS 6u  // per meshlet: the owners of its boundaries that the cache remembers

// --- decoding into the cache ---

#define CHOOSE_THREADS 512u  // of a workgroup of rt_cache.comp
#define FILL_GROUPS 32768u   // of rt_fill.comp at once, at most; further meshlets take turns

// --- paths that wait: rt_paths.glsl ---

#define PATH_WORDS 16u      // of a record, struct Path
#define BOUNCE_BITS 11      // of Path.progress
#define SAMPLE_BITS 20u     // of Path.progress, above the bounce
#define SPREAD 32u          // invocations per resumed path: one path per warp
#define SPREAD_PATHS 4096u  // the first paths, which are spread

// --- geometry ---

#define BOXES_THREADS 32u          // of a workgroup of boxes.comp, one meshlet each
#define MESHLET_BOX_BYTES 24u      // the box around a meshlet: low and high corner, 6 floats
#define PRIMITIVE_INDEX 0x7FFFFFu  // bits of an instance's custom index: its primitive
#define INSTANCE_MASKED 0x800000u  // bit of it: parts of the instance may be transparent

// --- output ---

#define HIT_WORDS 5u  // per pixel: instance, meshlet * 64 + triangle, t, two barycentrics

#endif
