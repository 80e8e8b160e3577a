// Fragment stage for timing: the cheapest that reads every attribute.
//
// Inputs: as surface.frag's, without ids.
// Output: colour.
// variants: attributes_position.frag=VARYINGS=0 attributes_normal.frag=VARYINGS=1
// variants: attributes_texcoord.frag=VARYINGS=3 attributes_color.frag=VARYINGS=7
#version 460
#extension GL_GOOGLE_include_directive : require

#include "raster/raster.glsl"

#if (VARYINGS & 1) != 0
layout(location = 0) in vec3 in_normal;
#endif
#if (VARYINGS & 2) != 0
layout(location = 1) in vec2 in_texcoord;
#endif
#if (VARYINGS & 4) != 0
layout(location = 2) in vec4 in_color;
#endif
layout(location = 0) out vec4 out_color;

void main() {
  out_color = vec4(0.5);
#if (VARYINGS & 1) != 0
  if ((ATTRIBUTES & HAS_NORMAL) != 0u) out_color.xyz += 0.5 * in_normal;
#endif
#if (VARYINGS & 2) != 0
  if ((ATTRIBUTES & HAS_TEXCOORD) != 0u) out_color.xy += 0.1 * in_texcoord;
#endif
#if (VARYINGS & 4) != 0
  if ((ATTRIBUTES & HAS_COLOR) != 0u) out_color *= in_color;
#endif
}
