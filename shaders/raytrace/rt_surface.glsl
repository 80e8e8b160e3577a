// Normals, albedo and emission of a hit.
//
// needs: raytrace/rt_attributes.glsl
#ifndef RT_SURFACE_GLSL
#define RT_SURFACE_GLSL

#include "raytrace/rt_exact.glsl"
#include "raytrace/rt_interpolated.glsl"
#include "raytrace/rt_packing.glsl"

// Transforms a normal to world space. Returns `otherwise` if it is 0.
vec3 world_normal(mat4 world_to_object, vec3 n, vec3 otherwise) {
  vec3 v = vec3(dot_product(world_to_object[0].xyz, n), dot_product(world_to_object[1].xyz, n),
                dot_product(world_to_object[2].xyz, n));
  float squared = dot_product(v, v);
  return squared > 0.0 ? v * inversesqrt(squared) : otherwise;
}

Surface found_surface() {
  Instance instance = Instances(Frame(push.frame).instances).at[placed.instance];
  Material material = Materials(Frame(push.frame).materials).at[instance.material];
  mat4 to_object = instance.world_to_object;
  vec3 first = vertex_position(PRIMITIVE, corners.x);
  vec3 across = cross_product(vertex_position(PRIMITIVE, corners.y) - first,
                              vertex_position(PRIMITIVE, corners.z) - first);
  vec3 flat_normal = world_normal(to_object, across, -gl_WorldRayDirectionEXT);
  vec3 normal = world_normal(to_object, INTERPOLATED(vertex_normal), flat_normal);
  bool unlit = (material.flags & MATERIAL_UNLIT) != 0u;
  Hit hit =
      Hit(gl_HitTEXT, packed_unit(normal), packed_unit(flat_normal),
          packed_light(base_color(material).rgb), unlit ? UNLIT : packed_light(emission(material)));
  return Surface(hit, placed.instance, id, weights.yz);
}

#endif
