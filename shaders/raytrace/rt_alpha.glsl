// Whether rays pass a transparent surface. Masks compare alpha with the cutoff; blended surfaces
// compare it with a random number. The order of hits does not matter.
//
// needs: raytrace/rt_attributes.glsl
#ifndef RT_ALPHA_GLSL
#define RT_ALPHA_GLSL

#include "raytrace/rt_interpolated.glsl"
#include "raytrace/rt_random.glsl"

bool is_passed() {
  Instance instance = Instances(Frame(push.frame).instances).at[placed.instance];
  Material material = Materials(Frame(push.frame).materials).at[instance.material];
  float cutoff = material.alpha_cutoff;
  if ((material.flags & MATERIAL_BLEND) != 0u) {
    // Hash only what is the same in all paths: neither the order of hits nor triangle numbers.
    uvec3 bits = floatBitsToUint(weights) >> 12;
    cutoff =
        unit_float(hash(hash(launched_pixel()) ^ hash(bits.y + hash(bits.z) + placed.instance)));
  }
  return base_color(material).a < cutoff;
}

#endif
