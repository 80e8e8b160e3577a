// Whether a meshlet is behind the surfaces that are drawn so far: compares the nearest depth of its
// bounding sphere with the depth pyramid. Rounding never hides a visible meshlet.
//
// needs: push
#ifndef OCCLUSION_GLSL
#define OCCLUSION_GLSL

#include "raster/culling.glsl"
#include "visibility/pyramid.glsl"

#define MOST_TEXELS 64u  // of the coarsest level; larger meshlets count as visible
// A sphere whose eye is within 1.05 radii, or across the near plane, counts as visible.
#define LEAST_SHARE 0.1
// Rounding errors of the shaders that rasterise and of this one, relative to the terms of the sums:
// some 16 half units of binary32.
#define ROUNDING 1e-6

// A coordinate over w: its least and greatest value in a sphere that is before the eye. row, w_row:
// of the matrix to clip space. They are the roots k of |row - k w_row| * radius = distance of the
// centre to the plane row - k w_row.
vec2 range_over_w(vec4 row, vec4 w_row, vec3 center, float radius) {
  float x = dot(row.xyz, center) + row.w, w = dot(w_row.xyz, center) + w_row.w;
  float xx = dot(row.xyz, row.xyz), ww = dot(w_row.xyz, w_row.xyz), xw = dot(row.xyz, w_row.xyz);
  float square = radius * radius, scale = w * w - square * ww;
  vec3 across = w * row.xyz - x * w_row.xyz;
  float root = radius * sqrt(max(dot(across, across) - square * (xx * ww - xw * xw), 0.0));
  vec2 range = (x * w - square * xw + vec2(-root, root)) / scale;
  vec3 farthest = abs(center) + radius;
  vec2 terms =
      vec2(dot(abs(row.xyz), farthest) + abs(row.w), dot(abs(w_row.xyz), farthest) + abs(w_row.w));
  vec2 error = ROUNDING * (terms.x + (abs(range) + 1.0) * terms.y) * (w / scale);
  return range + vec2(-error.x, error.y);
}

// The greatest depth of the pixels [first, last].
float farthest_depth(uvec2 first, uvec2 last) {
  uint level = 0u;
  for (; level + 1u < PYRAMID_LEVELS; level++) {
    uvec2 extent = (last >> (level + 2u)) - (first >> (level + 2u));
    if (max(extent.x, extent.y) < 4u) break;
  }
  uvec2 low = first >> (level + 2u), high = last >> (level + 2u);
  if ((high.x - low.x + 1u) * (high.y - low.y + 1u) > MOST_TEXELS) return 1.0;
  float farthest = 0.0;
  for (uint y = low.y; y <= high.y; y++)
    for (uint x = low.x; x <= high.x; x++)
      farthest = max(farthest, PYRAMID.at[pyramid_place(level, uvec2(x, y))]);
  return farthest;
}

// Whether all pixels that meshlet m of the current instance may cover show nearer surfaces.
bool meshlet_hidden(uint m) {
  Bounds b = meshlet_bounds(m);
  if (!(b.radius >= 0.0)) return false;
  mat4 rows = transpose(object_to_clip());
  float w = dot(rows[3].xyz, b.center) + rows[3].w;
  float square = b.radius * b.radius * dot(rows[3].xyz, rows[3].xyz);
  if (!(w > 0.0 && w * w - square > LEAST_SHARE * w * w)) return false;
  float near = range_over_w(rows[2], rows[3], b.center, b.radius).x;
  if (!(near > 0.0)) return false;
  vec2 x = range_over_w(rows[0], rows[3], b.center, b.radius);
  vec2 y = range_over_w(rows[1], rows[3], b.center, b.radius);
  vec2 low = vec2(x.x, y.x), high = vec2(x.y, y.y);
  if (!(all(greaterThan(low, vec2(-1e6))) && all(lessThan(high, vec2(1e6))))) return false;
  vec2 size = vec2(picture_size());
  // A pixel more on each side, for snapping.
  vec2 first = clamp((low * 0.5 + 0.5) * size - 1.0, vec2(0.0), size - 1.0);
  vec2 last = clamp((high * 0.5 + 0.5) * size + 1.0, vec2(0.0), size - 1.0);
  return near > farthest_depth(uvec2(first), uvec2(last));
}

#endif
