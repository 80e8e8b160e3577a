// Writes a surface's pixel into the visibility buffer if it is the nearest so far. If the instance
// is masked, call open_triangle first.
#ifndef PUT_GLSL
#define PUT_GLSL

#include "visibility/seen.glsl"
#extension GL_EXT_shader_atomic_int64 : require

layout(constant_id = 19) const bool MASKED = false;  // some surface lets pixels through

bool instance_masked() {
  return MASKED && (Materials(the_frame().materials).at[instance.material].flags &
                    (MATERIAL_MASK | MATERIAL_BLEND)) != 0u;
}

// masked: instance_masked(). test: read the pixel first, which saves work where it is mostly
// hidden.
void put(ivec2 pixel, float depth, uint payload, bool masked, bool test) {
  if (!(depth < 1.0)) return;
  depth = depth > 0.0 ? depth : 0.0;
  uint64_t value = pack64(uvec2(payload, floatBitsToUint(depth)));
  Pixels pixels = Pixels(push.pixels);
  uint place = uint(pixel.y) * the_frame().width + uint(pixel.x);
  // The buffer may hold a smaller value by now, never a larger one.
  if (test && pixels.at[place] <= value) return;
  if (masked) {
    Material material = Materials(the_frame().materials).at[instance.material];
    texcoord_matrix = material.texcoord_matrix;
    open_pixel(pixel, depth, has_texture(material));
    if (cut_out(material, base_color(material).a)) return;
  }
  atomicMin(pixels.at[place], value);
}

#endif
