// Path `visibility`, last for each batch: shades the pixels that show a surface of this batch, a
// thread each. Later batches reuse the slots, so it marks these pixels as done.
//
// Inputs: the visibility buffer and the slots. Outputs: colour, depth and ids.
// variants: visibility_resolve.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "visibility/visibility.glsl"
#include "visibility/seen.glsl"
layout(local_size_x = RESOLVE_SIDE, local_size_y = RESOLVE_SIDE) in;

uint place;  // of the pixel

void put_result(vec4 color, float depth, uvec2 ids) {
  vec3 c = clamp(color.rgb, 0.0, 1.0);
  vec3 srgb = mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThan(c, vec3(0.0031308)));
  SlotWords(push.color).at[place] = packUnorm4x8(vec4(srgb, color.a));
  SlotWords(push.depth).at[place] = floatBitsToUint(depth);
  if (push.ids != uvec2(0u)) SlotPairs(push.ids).at[place] = ids;
}

vec3 interpolated_normal(uvec3 v) {
  if ((ATTRIBUTES & HAS_NORMAL) == 0u) return vec3(0.0);
  mat3 corners = mat3(vertex_normal(primitive, v.x), vertex_normal(primitive, v.y),
                      vertex_normal(primitive, v.z));
  return world_normal(corners * seen_weights);
}

vec4 surface_color(ivec2 pixel, float depth, uvec3 v) {
  vec3 a = vertex_position(primitive, v.x);
  vec3 b = vertex_position(primitive, v.y);
  vec3 c = vertex_position(primitive, v.z);
  mat4 to_clip = object_to_clip();
  open_triangle(v, transformed(to_clip, a), transformed(to_clip, b), transformed(to_clip, c));
  Material material = Materials(the_frame().materials).at[instance.material];
  texcoord_matrix = material.texcoord_matrix;
  open_pixel(pixel, depth, has_texture(material));
  seen_normal = interpolated_normal(v);
  mat3 to_world = mat3(instance.object_to_world);
  seen_face_normal = cross(to_world * (b - a), to_world * (c - a));
  return vec4(shaded(material, base_color(material).rgb), 1.0);
}

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = picture_size();
  if (pixel == ivec2(0)) Pieces(push.pieces).at[0] = uvec2(0u);  // for the next batch
  if (pixel.x >= size.x || pixel.y >= size.y) return;
  place = uint(pixel.y * size.x + pixel.x);
  uvec2 visible = unpack32(Pixels(push.pixels).at[place]);
  if (visible.x < FIRST_PAYLOAD) {
    if ((push.batch & BATCH_FIRST) != 0u) put_result(vec4(0.0), 1.0, uvec2(~0u));
    return;
  }
  if (!drawn_in_pass(job_of(visible.x))) return;
  open_payload(visible.x);
  uint t = visible.x % MESHLET_TRIANGLES;
  float depth = uintBitsToFloat(visible.y);
  vec4 color = surface_color(pixel, depth, slot_corners(t));
  put_result(color, depth, uvec2(job_instance, job_number * MESHLET_TRIANGLES + t));
  if ((push.batch & BATCH_LAST) == 0u) Pixels(push.pixels).at[place] = pack64(uvec2(0u, visible.y));
}
