// Watertight ray-triangle test. Transforms vertices to a frame in which the ray runs along z from
// the origin, as in Woop, Benthin, Wald: Watertight Ray/Triangle Intersection, JCGT 2013, but with
// three dot products instead of a shear: permuting the axes would cost a GPU as much as the shear
// saves. It is watertight for the same reasons: a vertex gets the same coordinates in all
// triangles, and one expression without contraction decides which side of an edge the ray passes.
#ifndef RT_TRIANGLES_GLSL
#define RT_TRIANGLES_GLSL

#include "raytrace/rt_exact.glsl"

struct RayFrame {
  vec4 x;  // coordinate of p: dot(x.xyz, p) + x.w
  vec4 y;
  vec4 z;  // in units of the ray's t
};

RayFrame ray_frame(vec3 origin, vec3 direction) {
  float squared = dot_product(direction, direction);
  vec3 d = direction * inversesqrt(squared);
  // Any two directions perpendicular to the ray.
  vec3 across = abs(d.x) > abs(d.z) ? vec3(-d.y, d.x, 0.0) : vec3(0.0, -d.z, d.y);
  vec3 second = cross_product(d, across);
  vec3 along = direction / squared;
  return RayFrame(vec4(across, -dot_product(across, origin)),
                  vec4(second, -dot_product(second, origin)),
                  vec4(along, -dot_product(along, origin)));
}

vec3 in_frame(RayFrame f, vec3 p) {
  return vec3(fma(f.x.x, p.x, fma(f.x.y, p.y, fma(f.x.z, p.z, f.x.w))),
              fma(f.y.x, p.x, fma(f.y.y, p.y, fma(f.y.z, p.z, f.y.w))),
              fma(f.z.x, p.x, fma(f.z.y, p.y, fma(f.z.z, p.z, f.z.w))));
}

// The sign says on which side of the directed edge p -> q the ray passes. Rounding is monotonic, so
// a non-zero sign is right, and swapping p and q negates it exactly.
float edge(vec3 p, vec3 q) {
  precise float forward = q.x * p.y;
  precise float backward = q.y * p.x;
  precise float side = forward - backward;
  return side;
}

// Whether the ray hits a triangle in (t_min, t_max], and where. a, b, c: in the ray's frame.
// Both sides count, and an edge (zero) belongs to both triangles.
bool meets_triangle(vec3 a, vec3 b, vec3 c, float t_min, float t_max, out float t,
                    out vec2 barycentrics) {
  float u = edge(b, c);
  float v = edge(c, a);
  float w = edge(a, b);
  float determinant = u + v + w;
  float inverse = 1.0 / determinant;
  precise float along = fma(u, a.z, fma(v, b.z, w * c.z)) * inverse;
  t = along;
  barycentrics = vec2(v, w) * inverse;
  bool inside = min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0;
  return inside && determinant != 0.0 && t > t_min && t <= t_max;
}

#endif
