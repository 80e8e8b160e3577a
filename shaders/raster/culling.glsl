// Culling: rejects meshlets outside the view frustum and meshlets whose triangles all face away.
//
// needs: push
#ifndef CULLING_GLSL
#define CULLING_GLSL

#include "decoders/bounds.glsl"
#include "raster/raster.glsl"

// Whether all triangles face away. eye: Frame.eye in object coordinates. The test may run in object
// space because an affine transform keeps the sides of a plane.
bool faces_away(Bounds b, vec4 eye) {
  vec3 toward = eye.w > 0.0 ? b.center - eye.xyz : -eye.xyz;
  return dot(toward, b.axis) > b.sine * length(toward) * 1.0001 + (eye.w > 0.0 ? b.radius : 0.0);
}

// Of meshlet m of the current primitive.
Bounds meshlet_bounds(uint m) {
  Primitive primitive = Primitives(the_frame().primitives).at[the_primitive()];
  return bounds_of(SceneWords(primitive.bounds).at[m], primitive.box_low.xyz,
                   primitive.box_size.xyz);
}

// Whether meshlet m of the current instance may be visible.
bool meshlet_visible(uint m) {
  if (!CULLING) return true;
  Frame frame = the_frame();
  Instance instance = Instances(frame.instances).at[INSTANCE];
  Bounds b = meshlet_bounds(m);
  if (b.radius < 0.0) return true;
  if (outside_view(b.center, b.radius, object_to_clip())) return false;
  if ((Materials(frame.materials).at[instance.material].flags & MATERIAL_DOUBLE_SIDED) != 0u)
    return true;
  vec4 eye = instance.world_to_object * frame.eye;
  return !faces_away(b, vec4(eye.xyz, frame.eye.w));
}

#endif
