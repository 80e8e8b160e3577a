// The colours of a surface. TEXCOORD, COLOR: the values of the vertices at the point that is
// shaded; SAMPLE(number, uv) reads a texture.
//
// needs: TEXCOORD, COLOR, SAMPLE
#ifndef MATERIAL_GLSL
#define MATERIAL_GLSL

#include "scene/scene.glsl"

layout(set = 0, binding = 0) uniform sampler2D textures[];

// Returns white if the material has no texture.
vec4 textured(Material material, int number) {
  if (number < 0) return vec4(1.0);
  vec2 uv = TEXCOORD;
  return SAMPLE(number, material.texcoord_matrix.xy * uv.x + material.texcoord_matrix.zw * uv.y +
                            material.texcoord_offset);
}

// Linear RGB and alpha.
vec4 base_color(Material material) {
  return material.base_color * COLOR * textured(material, material.base_texture);
}

vec3 emission(Material material) {
  return material.emissive.rgb * textured(material, material.emissive_texture).rgb;
}

#endif
