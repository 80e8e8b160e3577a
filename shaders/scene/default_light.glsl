// The light of all pictures: a sky whose radiance changes evenly with height, and a key light over
// the viewer's shoulder. gltf_scene/default_light.py has the same numbers for Mitsuba.
#ifndef DEFAULT_LIGHT_GLSL
#define DEFAULT_LIGHT_GLSL

// Light that a white diffuse surface reflects: facing up, facing down, and facing the key light
// alone.
const vec3 SKY = vec3(0.26, 0.29, 0.34);
const vec3 GROUND = vec3(0.15, 0.13, 0.12);
const vec3 KEY = vec3(0.58, 0.56, 0.52);

// Radiance from a direction.
vec3 sky_radiance(vec3 direction) {
  return 0.5 * (SKY + GROUND) + 0.75 * direction.y * (SKY - GROUND);
}

// Reflected light of the whole sky, for a white diffuse surface. Ray tracing needs exact
// arithmetic: no mix (raytrace/rt_exact.glsl).
vec3 sky_light(vec3 normal) { return GROUND + (SKY - GROUND) * (normal.y * 0.5 + 0.5); }

#endif
