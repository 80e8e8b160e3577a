// The attributes of a triangle at a pixel: perspective-correct weights of its corners from
// homogeneous coordinates, so that clipped triangles need no special case. Call open_triangle, then
// open_pixel.
#ifndef SEEN_GLSL
#define SEEN_GLSL

#include "visibility/visibility.glsl"
#extension GL_EXT_nonuniform_qualifier : require

uvec3 seen_corners;
vec3 seen_x, seen_y, seen_w;  // clip coordinates of the corners
vec3 seen_point;              // pixel coordinates and depth
vec3 seen_weights;            // of the corners; sum 1
vec3 seen_normal;             // in world space; who shades computes both
vec3 seen_face_normal;
vec2 seen_texcoord;
vec2 texcoord_right;  // differences within the 2 x 2 pixels around, as dFdx and dFdy
vec2 texcoord_down;
vec4 seen_color;
vec4 texcoord_matrix;  // of the material

void open_triangle(uvec3 corners, vec4 a, vec4 b, vec4 c) {
  seen_corners = corners;
  seen_x = vec3(a.x, b.x, c.x);
  seen_y = vec3(a.y, b.y, c.y);
  seen_w = vec3(a.w, b.w, c.w);
}

// Interpolates texcoords as at the pixels of a 2 x 2 quad. weights: at the pixel, times a common
// factor, which change by `right` and `down` per pixel.
void open_texcoords(ivec2 pixel, vec3 weights, vec3 right, vec3 down) {
  mat3x2 corners =
      mat3x2(vertex_texcoord(primitive, seen_corners.x), vertex_texcoord(primitive, seen_corners.y),
             vertex_texcoord(primitive, seen_corners.z));
  vec3 first = weights - right * float(pixel.x & 1) - down * float(pixel.y & 1);
  vec3 across = first + right, below = first + down;
  vec2 base = corners * first / (first.x + first.y + first.z);
  texcoord_right = corners * across / (across.x + across.y + across.z) - base;
  texcoord_down = corners * below / (below.x + below.y + below.z) - base;
  seen_texcoord = corners * seen_weights;
}

// texcoords: whether they are needed.
void open_pixel(ivec2 pixel, float depth, bool texcoords) {
  seen_point = vec3(vec2(pixel) + 0.5, depth);
  vec2 step_size = 2.0 / vec2(picture_size());
  vec2 ndc = seen_point.xy * step_size - 1.0;
  vec3 x = seen_x - ndc.x * seen_w, y = seen_y - ndc.y * seen_w;
  vec3 weights = cross(x, y);
  float sum = weights.x + weights.y + weights.z;
  seen_weights = sum != 0.0 ? weights / sum : vec3(1.0, 0.0, 0.0);
  if (texcoords)
    open_texcoords(pixel, weights, cross(y, seen_w) * step_size.x, cross(seen_w, x) * step_size.y);
  if ((ATTRIBUTES & HAS_COLOR) != 0u)
    seen_color =
        mat3x4(vertex_color(primitive, seen_corners.x), vertex_color(primitive, seen_corners.y),
               vertex_color(primitive, seen_corners.z)) *
        seen_weights;
}

bool has_texture(Material material) {
  return (ATTRIBUTES & HAS_TEXCOORD) != 0u &&
         (material.base_texture >= 0 || material.emissive_texture >= 0);
}

vec2 transformed_difference(vec2 v) { return texcoord_matrix.xy * v.x + texcoord_matrix.zw * v.y; }

#define POINT seen_point
#define NORMAL seen_normal
#define TEXCOORD seen_texcoord
#define COLOR ((ATTRIBUTES & HAS_COLOR) != 0u ? seen_color : vec4(1.0))
#define SAMPLE(number, uv)                                                                 \
  textureGrad(textures[nonuniformEXT(number)], uv, transformed_difference(texcoord_right), \
              transformed_difference(texcoord_down))
#define FACE_NORMAL(position) seen_face_normal
#include "raster/shading.glsl"

#endif
