// Shades a point of a surface with a light over the viewer's shoulder and ambient light. POINT: the
// point's pixel coordinates and depth; NORMAL: its normal in world space; FACE_NORMAL(position): a
// normal of its triangle; the others: see material.glsl.
//
// needs: push, POINT, NORMAL, FACE_NORMAL, TEXCOORD, COLOR, SAMPLE
#ifndef SHADING_GLSL
#define SHADING_GLSL

#include "raster/raster.glsl"
#include "scene/default_light.glsl"
#include "scene/material.glsl"

vec3 world_position() {
  Frame frame = the_frame();
  vec2 ndc = 2.0 * POINT.xy / vec2(frame.width, frame.height) - 1.0;
  vec4 world = frame.clip_to_world * vec4(ndc, POINT.z, 1.0);
  return world.xyz / world.w;
}

// Threshold of 4 x 4 ordered dithering at this pixel, in (0, 1). Blended surfaces cover a share of
// the pixels equal to their alpha, so that the order of drawing does not matter.
float dither() {
  uvec2 p = uvec2(POINT.xy) & 3u;
  uint x = p.x ^ p.y, y = p.y;
  uint rank = ((x & 1u) << 3) | ((y & 1u) << 2) | (x & 2u) | ((y & 2u) >> 1);
  return (float(rank) + 0.5) / 16.0;
}

// Returns the normal, or the triangle's own if there is none, flipped to face the viewer.
vec3 shading_normal(vec3 position, vec3 view) {
  vec3 face = FACE_NORMAL(position);
  vec3 normal = (ATTRIBUTES & HAS_NORMAL) != 0u && dot(NORMAL, NORMAL) > 0.0 ? NORMAL : face;
  normal = normalize(normal);
  return dot(normal, view) < 0.0 ? -normal : normal;
}

vec3 lit(Material material, vec3 base) {
  Frame frame = the_frame();
  vec3 position = world_position();
  vec3 view = normalize(frame.eye.w > 0.0 ? frame.eye.xyz - position : frame.eye.xyz);
  vec3 normal = shading_normal(position, view);
  vec3 light = frame.light_direction.xyz;
  float toward = max(dot(normal, light), 0.0);
  float roughness = clamp(material.roughness, 0.2, 1.0);
  float gloss = 2.0 / pow(roughness, 4.0);
  // A rough metal spreads its light as a diffuse surface does, which `base` below stands for.
  vec3 mirror = mix(vec3(0.04), base, material.metallic * (1.0 - pow(roughness, 4.0)));
  float highlight =
      toward * pow(max(dot(normal, normalize(light + view)), 0.0), gloss) * min(gloss / 8.0, 4.0);
  return base * (sky_light(normal) + KEY * toward) + mirror * KEY * highlight + emission(material);
}

// Whether a surface of this alpha lets the pixel through.
bool cut_out(Material material, float alpha) {
  return ((material.flags & MATERIAL_MASK) != 0u && alpha < material.alpha_cutoff) ||
         ((material.flags & MATERIAL_BLEND) != 0u && alpha < dither());
}

// base: linear RGB of base_color.
vec3 shaded(Material material, vec3 base) {
  return (material.flags & MATERIAL_UNLIT) != 0u ? base : lit(material, base);
}

#endif
