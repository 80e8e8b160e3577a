// Fragment stage of all raster paths: shades the surface with a light over the viewer's shoulder
// and ambient light.
//
// Inputs: the attributes in VARYINGS (bits HAS_); with MESH_IDS a number per triangle from a
//   mesh stage (mesh_output.glsl), else gl_PrimitiveID.
// Outputs: colour; with IDS the ids.
// variants: surface_position.frag=VARYINGS=0 surface_normal.frag=VARYINGS=1
// variants: surface_texcoord.frag=VARYINGS=3 surface_color.frag=VARYINGS=7
// variants: surface_position_ids.frag=VARYINGS=0,IDS surface_normal_ids.frag=VARYINGS=1,IDS
// variants: surface_texcoord_ids.frag=VARYINGS=3,IDS surface_color_ids.frag=VARYINGS=7,IDS
// variants: surface_position_mesh_ids.frag=VARYINGS=0,IDS,MESH_IDS
// variants: surface_normal_mesh_ids.frag=VARYINGS=1,IDS,MESH_IDS
// variants: surface_texcoord_mesh_ids.frag=VARYINGS=3,IDS,MESH_IDS
// variants: surface_color_mesh_ids.frag=VARYINGS=7,IDS,MESH_IDS
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_nonuniform_qualifier : require
#ifdef MESH_IDS
#extension GL_EXT_mesh_shader : require
#endif

#include "raster/raster.glsl"
#include "scene/default_light.glsl"

#if (VARYINGS & 1) != 0
layout(location = 0) in vec3 in_normal;
#else
const vec3 in_normal = vec3(0.0);
#endif
#if (VARYINGS & 2) != 0
layout(location = 1) in vec2 in_texcoord;
#else
const vec2 in_texcoord = vec2(0.0);
#endif
#if (VARYINGS & 4) != 0
layout(location = 2) in vec4 in_color;
#else
const vec4 in_color = vec4(1.0);
#endif
layout(location = 0) out vec4 out_color;
#ifdef IDS
// Instance, meshlet * 64 + triangle. Path `vertex`: instance, triangle in the primitive.
layout(location = 1) out uvec2 out_ids;
#ifdef MESH_IDS
layout(location = 3) perprimitiveEXT flat in uint in_id;
#else
#define in_id uint(gl_PrimitiveID)
#endif
#endif

#define TEXCOORD ((ATTRIBUTES & HAS_TEXCOORD) != 0u ? in_texcoord : vec2(0.0))
#define COLOR ((ATTRIBUTES & HAS_COLOR) != 0u ? in_color : vec4(1.0))
#define SAMPLE(number, uv) texture(textures[number], uv)
#include "scene/material.glsl"

vec3 world_position() {
  Frame frame = the_frame();
  vec2 ndc = 2.0 * gl_FragCoord.xy / vec2(frame.width, frame.height) - 1.0;
  vec4 world = frame.clip_to_world * vec4(ndc, gl_FragCoord.z, 1.0);
  return world.xyz / world.w;
}

// Threshold of 4 x 4 ordered dithering at this pixel, in (0, 1). Blended surfaces cover a share of
// the pixels equal to their alpha, so that the order of drawing does not matter.
float dither() {
  uvec2 p = uvec2(gl_FragCoord.xy) & 3u;
  uint x = p.x ^ p.y, y = p.y;
  uint rank = ((x & 1u) << 3) | ((y & 1u) << 2) | (x & 2u) | ((y & 2u) >> 1);
  return (float(rank) + 0.5) / 16.0;
}

// Returns the normal, or the triangle's own if there is none, flipped to face the viewer.
vec3 shading_normal(vec3 position, vec3 view) {
  vec3 face = cross(dFdx(position), dFdy(position));
  vec3 normal =
      (ATTRIBUTES & HAS_NORMAL) != 0u && dot(in_normal, in_normal) > 0.0 ? in_normal : face;
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

void main() {
#ifdef IDS
  out_ids = uvec2(push.instance, in_id);
#endif
  Material material = Materials(the_frame().materials).at[the_instance().material];
  vec4 base = base_color(material);
  vec3 color = (material.flags & MATERIAL_UNLIT) != 0u ? base.rgb : lit(material, base.rgb);
  if ((material.flags & MATERIAL_MASK) != 0u && base.a < material.alpha_cutoff) discard;
  if ((material.flags & MATERIAL_BLEND) != 0u && base.a < dither()) discard;
  out_color = vec4(color, 1.0);
}
