// Path `vertex`, vertex stage: an indexed draw of the decompressed model, the baseline.
//
// Inputs: the vertex buffer.
// Outputs: position, the attributes that the scene has, and the number of the instance.
#version 460
#extension GL_GOOGLE_include_directive : require

#define INSTANCE (push.instance + uint(gl_InstanceIndex))
#include "raster/raster_push.glsl"
#include "raster/raster.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 3) in vec4 color;
layout(location = 0) out vec3 out_normal;
layout(location = 1) out vec2 out_texcoord;
layout(location = 2) out vec4 out_color;
layout(location = 3) flat out uint out_instance;
invariant gl_Position;

void main() {
  out_instance = INSTANCE;
  gl_Position = transformed(object_to_clip(), position);
  if ((ATTRIBUTES & HAS_NORMAL) != 0u) out_normal = world_normal(normal);
  if ((ATTRIBUTES & HAS_TEXCOORD) != 0u) out_texcoord = texcoord;
  if ((ATTRIBUTES & HAS_COLOR) != 0u) out_color = color;
}
