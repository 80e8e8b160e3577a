// Outputs of the mesh stages for the vertices of a decoded meshlet (decoded_vertex.glsl).
//
// needs: push, vertex_integer, vertex_position
#ifndef MESH_VERTEX_GLSL
#define MESH_VERTEX_GLSL

#include "decoders/decoded_vertex.glsl"
#include "raster/mesh_output.glsl"

void put_vertex(Primitive primitive, mat4 to_clip, uint v) {
  gl_MeshVerticesEXT[v].gl_Position = transformed(to_clip, vertex_position(primitive, v));
  put_attributes(v, world_normal(vertex_normal(primitive, v)), vertex_texcoord(primitive, v),
                 vertex_color(primitive, v));
}

#endif
