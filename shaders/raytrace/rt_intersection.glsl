// Tests the triangles behind a box, and reports the nearest hit.
#ifndef RT_INTERSECTION_GLSL
#define RT_INTERSECTION_GLSL

#include "raytrace/rt_meshlet.glsl"
#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_triangles.glsl"

hitAttributeEXT HitAttributes found;

RayFrame frame;
bool masked;   // report each hit: the any-hit shader may reject it
bool any_hit;  // stop at the first hit
float t_max;
bool hit;
bool done;  // with `hit && any_hit` in its place frames take 2 % longer
HitAttributes nearest;

// Reports `nearest`, unless there is a hit with a smaller key at the same distance. Returns whether
// it counts. Keys order hits by (instance, meshlet, triangle).
bool report(float t) {
  Counts keys = Counts(push.colors);
  uint pixel = launched_pixel();
  uint key = placed.key + hit_id(nearest.triangle);
  if (t == gl_RayTmaxEXT && !any_hit && keys.at[pixel] < key) return false;
  found = nearest;
  if (!reportIntersectionEXT(t, 0u)) return false;
  if (!any_hit) keys.at[pixel] = key;
  return true;
}

void test(vec3 a, vec3 b, vec3 c, uint triangle) {
  float t;
  vec2 barycentrics;
  if (!meets_triangle(in_frame(frame, a), in_frame(frame, b), in_frame(frame, c), gl_RayTminEXT,
                      t_max, t, barycentrics))
    return;
  if (hit && t == t_max) return;  // the earlier triangle has the smaller key
  nearest = HitAttributes(barycentrics, triangle);
  if (masked && !report(t)) return;
  hit = true;
  t_max = t;
  done = any_hit;
}

// Tests the triangles of a slot behind the box that begins with triangle `first`.
void test_slot(uvec2 slot, uint first) {
  for (uint t = first; t < first + BOX_TRIANGLES && !done; t++) {
    uint corners = SceneWords(slot).at[t];
    if (corners == 0u) return;  // end of the meshlet
    test(slot_position(slot, corners & 255u), slot_position(slot, (corners >> 8) & 255u),
         slot_position(slot, corners >> 16), t);
  }
}

// Prepares the tests; returns the first triangle behind the box.
uint open_ray() {
  open_box();
  frame = ray_frame(gl_ObjectRayOriginEXT, gl_ObjectRayDirectionEXT);
  masked = (gl_InstanceCustomIndexEXT & INSTANCE_MASKED) != 0u;
  any_hit = (gl_IncomingRayFlagsEXT & gl_RayFlagsTerminateOnFirstHitEXT) != 0u;
  t_max = gl_RayTmaxEXT;
  hit = false;
  done = false;
  return uint(gl_PrimitiveID) % BOXES * BOX_TRIANGLES;
}

void close_ray() {
  if (!masked && hit) report(t_max);
}

#endif
