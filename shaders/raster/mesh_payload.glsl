// What a task workgroup of path `mesh` sends on: the connectivity of its visible meshlets, decoded
// by one invocation each.
struct Payload {
  uint meshlets[TASK_MESHLETS];
  uvec2 boundary[TASK_MESHLETS];  // mask of the boundary vertices
  uvec2 starts[TASK_MESHLETS];    // mask of the triangles that begin a component
  uint triangles[TASK_MESHLETS * MESHLET_TRIANGLES];  // packed as in serial_decoder.glsl
};
taskPayloadSharedEXT Payload payload;
