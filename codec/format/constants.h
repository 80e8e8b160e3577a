// Constants that the host, the codec (C++) and the shaders (GLSL) share; nothing but #define NAME
// integer, so that all three, and vk_backend/constants.py, can read this file. The blob is the one
// of spec/EXT_meshlet_edgebreaker.md, appendices A.2 to A.4.
#ifndef CONSTANTS_H
#define CONSTANTS_H

#define BLOB_MAGIC 0x314D4245u  // "EBM1"
#define BLOB_VERSION 1u
#define BLOB_HEADER_BYTES 32u
#define BLOB_STREAM_BYTES 28u
#define BLOB_GROUP_BYTES 8u
#define BLOB_GROUP_MESHLETS 32u
#define BLOB_PADDING_BYTES 8u
#define BLOB_MAX_BYTES 0x20000000u
#define BLOB_OFFSET_BITS 17u  // of a directory entry; the number of triangles - 1 follows
#define BLOB_TRIANGLE_BITS 6u

#define KIND_GRID 0u
#define KIND_OCT 1u
#define KIND_INTEGER 2u
#define KIND_FLOAT32 3u
#define KIND_SIGN 4u

#define MESHLET_TRIANGLES 64u  // at most; ids are meshlet * MESHLET_TRIANGLES + triangle
#define MESHLET_VERTICES 64u

#endif
