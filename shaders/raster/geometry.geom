// Path `geometry`, geometry stage: decodes a meshlet with the serial decoder and emits its
// triangles.
//
// Inputs: the numbers of the meshlet and the instance (geometry.vert).
// Outputs: positions, gl_PrimitiveID, the instance and the attributes in VARYINGS (bits HAS_).
//
// Every device allows 1024 output scalars per invocation. 170 corners of a position and two numbers
// fit. With more attributes, INVOCATIONS share the triangles, and each decodes the whole
// meshlet.
// variants: geometry_normal.geom=INVOCATIONS=2,VARYINGS=1
// variants: geometry_color.geom=INVOCATIONS=3,VARYINGS=7
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#define SHARE ((64 + INVOCATIONS - 1) / INVOCATIONS)
layout(points, invocations = INVOCATIONS) in;
layout(triangle_strip, max_vertices = 3 * SHARE) out;

layout(location = 0) flat in uint in_meshlet[];
layout(location = 1) flat in uint in_instance[];
#define INSTANCE in_instance[0]
#include "raster/raster_push.glsl"
#include "raster/culling.glsl"
#include "decoders/serial_values.glsl"
#include "decoders/value_vertex.glsl"

out gl_PerVertex { vec4 gl_Position; };  // redeclared without the other members to save outputs
#if (VARYINGS & 1) != 0
layout(location = 0) out vec3 out_normal;
#endif
#if (VARYINGS & 2) != 0
layout(location = 1) out vec2 out_texcoord;
#endif
#if (VARYINGS & 4) != 0
layout(location = 2) out vec4 out_color;
#endif
layout(location = 3) flat out uint out_instance;

void emit_corner(Primitive primitive, mat4 to_clip, uint v, uint id) {
  gl_Position = transformed(to_clip, vertex_position(primitive, v));
#if (VARYINGS & 1) != 0
  if ((ATTRIBUTES & HAS_NORMAL) != 0u) out_normal = world_normal(vertex_normal(primitive, v));
#endif
#if (VARYINGS & 2) != 0
  if ((ATTRIBUTES & HAS_TEXCOORD) != 0u) out_texcoord = vertex_texcoord(primitive, v);
#endif
#if (VARYINGS & 4) != 0
  if ((ATTRIBUTES & HAS_COLOR) != 0u) out_color = vertex_color(primitive, v);
#endif
  gl_PrimitiveID = int(id);
  out_instance = INSTANCE;
  EmitVertex();
}

void main() {
  uint m = in_meshlet[0];
  if (!meshlet_visible(m)) return;
  Primitive primitive = Primitives(the_frame().primitives).at[the_primitive()];
  open_blob(primitive.blob, primitive.blob_words);
  load_streams(0u, primitive.stream_end);
  decode_meshlet(m);
  if (error != ERROR_NONE) return;
  mat4 to_clip = object_to_clip();
  uint end = min(triangle_count, uint(gl_InvocationID + 1) * SHARE);
  for (uint t = uint(gl_InvocationID) * SHARE; t < end; t++) {
    uint corners = triangles[t];
    uint id = m * MESHLET_TRIANGLES + t;
    emit_corner(primitive, to_clip, corners & 63u, id);
    emit_corner(primitive, to_clip, (corners >> 8) & 63u, id);
    emit_corner(primitive, to_clip, (corners >> 16) & 63u, id);
    EndPrimitive();
  }
}
