// Constants of the scene, its slots and the raster paths. The host and the shaders share them.
// Nothing but #define NAME integer, so that GLSL and vk_backend/gpu/constants.py can both read it.
#ifndef SCENE_CONSTANTS_H
#define SCENE_CONSTANTS_H

// --- the scene: scene.glsl ---

#define HAS_NORMAL 1u  // bits of the shaders' constant ATTRIBUTES
#define HAS_TEXCOORD 2u
#define HAS_COLOR 4u
#define NO_ELEMENT 0xFFFFFFFFu      // Attribute.element: the primitive lacks the attribute
#define ATTRIBUTE_ROUND 0x1000000u  // Attribute.kind_bits: round to an integer before scaling
#define INSTANCE_MIRRORED 1u        // Instance.flags
#define MATERIAL_DOUBLE_SIDED 1u    // Material.flags
#define MATERIAL_MASK 2u
#define MATERIAL_BLEND 4u
#define MATERIAL_UNLIT 8u

// --- decoded meshlets ---

#define PACKED_POSITION_BITS 21u  // per axis: three coordinates fit in two words
#define SUMMARY_BYTES 4u          // per meshlet: Summaries of decoders/decode_buffers.glsl

// --- raster paths ---

#define BOUNDS_BYTES 4u     // per meshlet: the word of bounds.glsl
#define BOUNDS_THREADS 32u  // of a workgroup of bounds.comp, one meshlet each

// --- paths mesh and mesh-paper: raster/tasks.glsl ---

#define PAPER_WORDS 75u  // of a meshlet in the payload of mesh-paper: task_payload.glsl
#define PHASE_FIRST 0u   // see task_tests.glsl
#define PHASE_SECOND 1u
#define PHASE_VISIBLE 2u
#define PHASE_ALL 3u
#define SIDES_FRONT 0u
#define SIDES_MIRRORED 1u
#define SIDES_BOTH 2u

// --- path visibility ---

#define BATCH_FIRST 1u       // RasterPush.batch: the picture's first batch,
#define BATCH_LAST 2u        //   its last batch
#define PIECE_SIDE 64u       // pixels
#define PIECE_BYTES 8u       // of a record in the list of pieces
#define PIXEL_BYTES 8u       // of a pixel in the visibility buffer
#define CLEAR_THREADS 256u   // of a workgroup of visibility_clear.comp, one pixel each
#define RESOLVE_SIDE 8u      // pixels: side of a workgroup of visibility_resolve.comp
#define MAX_SLOTS 67108862u  // of a batch: (slot + 1) * 64 + triangle fits in 32 bits

// --- levels of detail: levels/levels.glsl ---

#define CUT_THREADS 64u           // of a workgroup of cut.comp and touch.comp
#define CUT_COLUMNS 32768u        // workgroups in a row
#define NOT_RESIDENT 0xFFFFFFFFu  // Page.row
#define UNDECODED 0x80000000u     // in Cut.decoded and Cut.owners

// --- the pool of decoded clusters: levels/touch.comp ---

#define STEP_TOUCH 0u
#define STEP_PLACE 1u
#define STEP_TEST 2u
#define STEP_NEXT 3u
#define PYRAMID_SIDE 64u     // pixels: side of a tile, see visibility/pyramid.comp
#define PYRAMID_FLOATS 341u  // of a tile

#endif
