// Closest-hit stage: normals, albedo and emission of the nearest hit.
//
// Inputs: the hit; the cache, or (PAPER) the blob if the meshlet is not there, or (PLAIN)
// uncompressed buffers.
// Output: the payload Surface.
// variants: rt_surface.rchit= rt_surface_paper.rchit=PAPER rt_surface_plain.rchit=PLAIN
// variants: rt_surface_triangles.rchit=PLAIN,TRIANGLES
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require

#include "raytrace/rt_common.glsl"
#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_packing.glsl"
#ifdef PAPER
#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#endif
#include "raytrace/rt_attributes.glsl"

layout(location = 0) rayPayloadInEXT Surface surface;
#ifdef TRIANGLES
hitAttributeEXT vec2 found;
#else
hitAttributeEXT HitAttributes found;
#endif

vec3 unit(vec3 v, vec3 otherwise) {
  float squared = dot_product(v, v);
  return squared > 0.0 ? v * inversesqrt(squared) : otherwise;
}

// Transforms a normal to world space, not normalised.
vec3 in_world(Instance instance, vec3 n) {
  mat4 m = instance.world_to_object;
  return vec3(dot_product(m[0].xyz, n), dot_product(m[1].xyz, n), dot_product(m[2].xyz, n));
}

void main() {
#ifdef TRIANGLES
  Place place = hit_place(found, gl_PrimitiveID);
  surface.barycentrics = found;
#else
  Place place = hit_place(found.barycentrics, found.triangle);
  surface.barycentrics = found.barycentrics;
#endif
  open_attributes(place);
  surface.instance = hit_instance(place);
#ifdef TRIANGLES
  surface.id = gl_PrimitiveID;  // the host looks up the meshlet
#else
  surface.id = meshlet_of(place.placed, place.number) * MESHLET_TRIANGLES + place.triangle;
#endif
  Instance instance = Instances(Frame(push.frame).instances).at[surface.instance];
  Material material = Materials(Frame(push.frame).materials).at[instance.material];
  vec3 flat_normal = unit(in_world(instance, flat_normal_in_object()), -gl_WorldRayDirectionEXT);
  vec3 normal =
      has_normal() ? unit(in_world(instance, normal_in_object()), flat_normal) : flat_normal;
  bool unlit = (material.flags & MATERIAL_UNLIT) != 0u;
  surface.hit =
      Hit(gl_HitTEXT, packed_unit(normal), packed_unit(flat_normal),
          packed_light(base_color(material).rgb), unlit ? UNLIT : packed_light(emission(material)));
}
