// Payload from mesh.task to mesh.mesh: the decoded connectivity of up to TASK_MESHLETS visible
// meshlets. 8,832 bytes.
struct Payload {
  uint meshlets[TASK_MESHLETS];
  uvec2 boundary[TASK_MESHLETS];                      // mask of the boundary vertices
  uvec2 starts[TASK_MESHLETS];                        // mask of the triangles that begin a disk
  uint triangles[TASK_MESHLETS * MESHLET_TRIANGLES];  // packed as in serial_decoder.glsl
};
taskPayloadSharedEXT Payload payload;
