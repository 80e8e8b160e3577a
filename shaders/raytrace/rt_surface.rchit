// Closest-hit stage: normals, albedo and emission of the nearest hit.
//
// Inputs: the hit, the cache or the blob or (PLAIN) uncompressed buffers.
// Outputs: the payload Surface; the meshlet's counter.
// variants: rt_surface.rchit= rt_surface_plain.rchit=PLAIN
// variants: rt_surface_triangles.rchit=PLAIN,TRIANGLES
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require

#include "raytrace/rt_common.glsl"
#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_cache.glsl"
#ifndef PLAIN
#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
#endif
#include "raytrace/rt_attributes.glsl"
#ifndef PLAIN
#include "raytrace/rt_request.glsl"
#endif

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

#ifndef PLAIN
// The number of the hit meshlet.
uint hit_meshlet() {
  Traced traced = TracedList(push.traced).at[gl_InstanceCustomIndexEXT & PRIMITIVE_INDEX];
  return traced.first_meshlet + uint(gl_PrimitiveID) / (MESHLET_TRIANGLES / GROUP_TRIANGLES);
}
#endif

void main() {
#ifndef PLAIN
  bool to_light = DEFERRED && (gl_IncomingRayFlagsEXT & RAY_TO_LIGHT) != 0u;
  bool blocked = DEFERRED && gl_HitKindEXT == KIND_BLOCKED;
  uint number = hit_meshlet();
  // The intersection shader has counted the meshlets of shadow rays.
  if (COUNTED && (blocked || !to_light)) count(number, slot_entry(number));
  if (blocked) {
    surface.t = BLOCKED;
    surface.id = number;
    surface.barycentrics.x = gl_HitTEXT;
  }
  if (blocked || to_light) return;
#endif
  Instance instance = Instances(Frame(push.frame).instances).at[gl_InstanceID];
  Place place;
  place.primitive = gl_InstanceCustomIndexEXT & PRIMITIVE_INDEX;
#ifdef TRIANGLES
  place.meshlet = 0u;
  place.triangle = gl_PrimitiveID;
  vec2 barycentrics = found;
  surface.id = gl_PrimitiveID;  // the host looks up the meshlet
#else
  place.meshlet = uint(gl_PrimitiveID) / (MESHLET_TRIANGLES / GROUP_TRIANGLES);
  place.triangle = found.triangle;
  vec2 barycentrics = found.barycentrics;
  surface.id = place.meshlet * MESHLET_TRIANGLES + found.triangle;
#endif
  place.weights = weights_of(barycentrics);
  open_attributes(place);
  surface.t = gl_HitTEXT;
  surface.instance = gl_InstanceID;
  surface.barycentrics = barycentrics;
  surface.flat_normal = unit(in_world(instance, flat_normal_in_object()), -gl_WorldRayDirectionEXT);
  surface.normal = has_normal() ? unit(in_world(instance, normal_in_object()), surface.flat_normal)
                                : surface.flat_normal;
  Material material = Materials(Frame(push.frame).materials).at[instance.material];
  surface.albedo = base_color(material).rgb;
  vec3 emitted = emission(material);
  surface.emission = uvec2(packHalf2x16(emitted.rg), packHalf2x16(vec2(emitted.b, 0.0)));
}
