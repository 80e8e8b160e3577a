// What a task workgroup passes to its mesh workgroups: its row, and PAYLOAD_WORDS words for each
// meshlet, the first of which is the number of its item (tasks.glsl).
//
// Every device has room for 16 KiB (maxTaskPayloadSize); `mesh` needs 132 bytes, `mesh-paper`
// 2,404. Mesh workgroups have 28 KiB or more for the payload and their shared memory together
// (maxMeshPayloadAndSharedMemorySize). The host checks both: MeshPath.payload in
// vk_backend/raster/mesh.py.
#ifndef TASK_PAYLOAD_GLSL
#define TASK_PAYLOAD_GLSL

#include "raster/tasks.glsl"

struct Payload {
  uint row;
  uint words[TASK_MESHLETS * PAYLOAD_WORDS];
};
taskPayloadSharedEXT Payload payload;

// Words of a meshlet, only of path `mesh-paper`.
#define PAYLOAD_ITEM 0u
#define PAYLOAD_BOUNDARY 1u  // mask of the boundary vertices; masks have two words each
#define PAYLOAD_STARTS 3u    // mask of the triangles that begin a disk; 0: malformed
#define PAYLOAD_C 5u         // masks of the symbols C, E and S
#define PAYLOAD_E 7u
#define PAYLOAD_S 9u
#define PAYLOAD_TRIANGLES 11u  // 64 triangles, packed as in serial_decoder.glsl

#define PAYLOAD_WORD(place, word) payload.words[(place) * PAYLOAD_WORDS + (word)]

#endif
