// Constants that the host and the ray-tracing shaders share. Nothing but #define NAME integer, so
// that GLSL and vk_backend/gpu/constants.py can both read it.
#ifndef RT_CONSTANTS_H
#define RT_CONSTANTS_H

#define NO_HIT 0xFFFFFFFFu  // in the output
#define RECORD_BYTES 32u    // of struct Found, and of struct Level

// --- flags of a pass: RaysPush.part ---

#define FIRST_PART 1u
#define LAST_PART 2u
#define BACKGROUND 4u  // all rays miss

// --- geometry ---

#define PLACED_INDEX 0x7FFFFFu     // bits of an instance's custom index: struct Placed
#define INSTANCE_MASKED 0x800000u  // bit of it: the instance may be transparent in places

// --- output ---

#define HIT_WORDS 5u  // of FirstHit, per pixel

#endif
