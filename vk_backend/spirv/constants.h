// Facts of the format, for C++, GLSL and Python. Nothing but
// `#define NAME integer`: vk_backend/gpu/constants.py reads this file as text.
#ifndef CONSTANTS_H
#define CONSTANTS_H

// A meshlet. Ids of triangles are meshlet * MESHLET_TRIANGLES + triangle.
#define MESHLET_TRIANGLES 64u
#define MESHLET_VERTICES 64u

// --- the blob (spec, appendices A.2 to A.4) ---

#define BLOB_MAGIC 0x314D4245u  // "EBM1"
#define BLOB_VERSION 2u         // 1.0 of the format
#define BLOB_DRAFT_VERSION 1u   // drafts before it, refused
// 448 MiB. The positions of bits have 32 bits: those of a malformed meshlet's fields seem to reach
// up to 2^29 bits behind the blob, see serial_decoder.h.
#define BLOB_MAX_BYTES 0x1C000000u
#define BLOB_MAX_STREAMS 64u
#define BLOB_PADDING_BYTES 8u  // zeros at the end: an unaligned 64-bit read stays inside

// The header, by 32-bit word.
#define BLOB_HEADER_BYTES 32u
#define BLOB_HEADER_WORDS 8u
#define BLOB_WORD_VERSION 1u  // version | streams << 8
#define BLOB_WORD_TRIANGLES 2u
#define BLOB_WORD_VERTICES 3u
#define BLOB_WORD_MESHLETS 4u
#define BLOB_WORD_BYTES 5u
#define BLOB_WORD_DATA 6u  // offset of the data section, in bytes

// A row of the stream table: kind | elements << 8 | bits << 16 | predictor << 24,
// chain base | interior base << 8 | anchor base << 16, step, four offsets.
#define BLOB_STREAM_BYTES 28u
#define BLOB_STREAM_WORDS 7u
#define STREAM_MAX_ELEMENTS 4u
#define STREAM_MAX_BITS 32u

// A row of the group table: base, stride | bias << 16, then fields by their lowest bit. The shift
// counts have no u.
#define BLOB_GROUP_BYTES 12u
#define BLOB_GROUP_WORDS 3u
#define BLOB_GROUP_MESHLETS 32u
#define GROUP_ENTRY_SHIFT 0       // width of the entries
#define GROUP_DELTA_SHIFT 5       // width of references' owner deltas
#define GROUP_SLOT_SHIFT 10       // width of references' slots
#define GROUP_REFERENCE_SHIFT 13  // width of the reference counts
#define GROUP_FLAGS_SHIFT 16      // FLAG_ bits that the group's meshlets store
#define GROUP_TABLE_SHIFT 19      // the connectivity table
#define GROUP_BITS 20
#define GROUP_MAX_DELTA_WIDTH 24u
#define GROUP_MAX_SLOT_WIDTH 6u
#define GROUP_MAX_REFERENCE_WIDTH 6u

// A meshlet's header: triangles - 1, references, flags.
#define BLOB_TRIANGLE_BITS 6
#define BLOB_REFERENCE_BITS 6
#define MESHLET_MAX_REFERENCES 63u
#define FLAG_LOOPS 1u    // more than one boundary loop
#define FLAG_PRIVATE 2u  // some references are private
#define FLAG_SEAMS 4u    // foreign references say which streams they share

#define KIND_GRID 0u
#define KIND_OCT 1u
#define KIND_INTEGER 2u
#define KIND_FLOAT32 3u
#define KIND_SIGN 4u
#define KINDS 5u
#define GRID_MAX_BITS 24u
#define OCT_MIN_BITS 2u
#define OCT_MAX_BITS 16u

#define PREDICT_PARALLELOGRAM 0u
#define PREDICT_MEAN 1u
#define PREDICT_COPY 2u
#define PREDICT_DAMPED 3u
#define PREDICT_GEO 4u     // normals from the positions of the triangles around the vertex
#define PREDICT_AFFINE 5u  // from positions: their place in the triangle across the gate
#define PREDICTORS 6u
#define PREDICT_MAX_BITS 24u       // streams of more bits use PREDICT_COPY
#define GEO_POSITION_BITS 13u      // GEO drops lower bits of positions
#define AFFINE_WEIGHT_LIMIT 1024u  // weights, in 1/256, stay below

// --- a meshlet's sections (spec, appendix A.5) ---

#define LENGTH_WIDTH_BITS 3u  // the width of reference lengths
#define LENGTH_MAX_WIDTH 6u
// A chain's code: 0 to 6 Rice. An interior's: 0 to 3 Rice and 4 to 6 exp-Golomb. The parameter
// depends on the stream's base. 7: fixed widths follow, WIDTH_BITS for each element.
#define CODE_BITS 3u
#define CODE_FIRST_EXPONENTIAL 4u
#define CODE_ESCAPE 7u
#define CODE_MAX_PARAMETER 31u
#define EXPONENTIAL_MAX_QUOTIENT 31u  // of an exp-Golomb value; its low bits are at most
#define EXPONENTIAL_MAX_BITS 32u
#define WIDTH_BITS 5u  // a fixed width; WIDTH_ESCAPE means 32
#define WIDTH_ESCAPE 31u
// Further anchors: a width field for each element; the width is anchor base + field, or all bits.
#define ANCHOR_WIDTH_BITS 3u
#define ANCHOR_WIDTH_FULL 7u
#define MAX_QUOTIENT 16383u  // of a Rice code
#define MAX_HOPS 8u          // references from a corner to the meshlet that stores it

// --- inside the decoders ---

#define CODE_EXPONENTIAL 32u  // added to an exp-Golomb parameter; Rice parameters stand alone
#define CODE_FIXED 255u       // fixed widths
#define NO_VERTEX 255u        // no triangle across the gate
#define NO_MESHLET 0xFFFFFFFFu

#define ERROR_NONE 0u
#define ERROR_OFFSET 1u      // a meshlet number or data offset lies outside the blob
#define ERROR_CLERS 2u       // the symbols do not describe disks
#define ERROR_VERTICES 3u    // more than 64 vertices
#define ERROR_REFERENCES 4u  // masks overlap, or lengths do not sum to the boundary loop
#define ERROR_OWNER 5u  // a reference leads to no owned reference of an earlier or the same meshlet
#define ERROR_HOPS 6u   // a corner needs more than MAX_HOPS hops
#define ERROR_CODE 7u   // a code's parameter, or an exp-Golomb value's length, is too large
#define ERROR_UNARY 8u  // data run past the end of the blob, or a quotient is above MAX_QUOTIENT

#endif
