// Attributes at a hit, from those of the triangle's corners. PRIMITIVE: what vertex_normal and the
// like take.
//
// needs: raytrace/rt_attributes.glsl
#ifndef RT_INTERPOLATED_GLSL
#define RT_INTERPOLATED_GLSL

#define INTERPOLATED(attribute)                                                                \
  (weights.x * attribute(PRIMITIVE, corners.x) + weights.y * attribute(PRIMITIVE, corners.y) + \
   weights.z * attribute(PRIMITIVE, corners.z))
#define TEXCOORD INTERPOLATED(vertex_texcoord)
#define COLOR INTERPOLATED(vertex_color)
#define SAMPLE(number, uv) textureLod(textures[nonuniformEXT(number)], uv, 0.0)
#include "scene/material.glsl"

#endif
