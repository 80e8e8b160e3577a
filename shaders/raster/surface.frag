// Fragment stage of the raster paths with a graphics pipeline: shades the surface.
//
// Inputs: the attributes in VARYINGS (bits HAS_); with MESH numbers per triangle from a mesh stage
//   (mesh_output.glsl), else gl_PrimitiveID and, with IDS, the instance.
// Outputs: colour; with IDS the ids.
// variants: surface_position.frag=VARYINGS=0 surface_normal.frag=VARYINGS=1
// variants: surface_texcoord.frag=VARYINGS=3 surface_color.frag=VARYINGS=7
// variants: surface_position_ids.frag=VARYINGS=0,IDS surface_normal_ids.frag=VARYINGS=1,IDS
// variants: surface_texcoord_ids.frag=VARYINGS=3,IDS surface_color_ids.frag=VARYINGS=7,IDS
// variants: surface_mesh.frag=VARYINGS=7,MESH surface_mesh_ids.frag=VARYINGS=7,IDS,MESH
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_nonuniform_qualifier : require
#ifdef MESH
#extension GL_EXT_mesh_shader : require

layout(location = 3) perprimitiveEXT flat in uvec2 in_ids;
#define INSTANCE in_ids.x
#define TRIANGLE_ID in_ids.y
#else
#ifdef IDS
layout(location = 3) flat in uint in_instance;
#define INSTANCE in_instance
#endif  // else push.instance: the instances of a draw have the same material
#define TRIANGLE_ID uint(gl_PrimitiveID)
#endif

#include "raster/raster_push.glsl"
#include "raster/raster.glsl"

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
#endif

#define TEXCOORD ((ATTRIBUTES & HAS_TEXCOORD) != 0u ? in_texcoord : vec2(0.0))
#define COLOR ((ATTRIBUTES & HAS_COLOR) != 0u ? in_color : vec4(1.0))
#define SAMPLE(number, uv) texture(textures[number], uv)
#define NORMAL in_normal
#define POINT gl_FragCoord
#define FACE_NORMAL(position) cross(dFdx(position), dFdy(position))
#include "raster/shading.glsl"

void main() {
#ifdef IDS
  out_ids = uvec2(INSTANCE, TRIANGLE_ID);
#endif
  Material material = Materials(the_frame().materials).at[the_instance().material];
  vec4 base = base_color(material);
  vec3 color = shaded(material, base.rgb);
  if (cut_out(material, base.a)) discard;
  out_color = vec4(color, 1.0);
}
