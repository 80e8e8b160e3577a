// Constants of the scene, its slots and the raster paths. The host and the shaders share them.
// Nothing but #define NAME integer, so that GLSL and vk_backend/constants.py can both read it.
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

#endif
