// Culling bounds of a meshlet in one word: a sphere and the cone of the triangles' normals. The
// sphere is coarse: it only locates the meshlet. The cone culls more, since half of a model faces
// away.
//   bits 0 .. 14   centre, 5 bits per axis, in the primitive's box
//        15 .. 17  k: the radius is the box's diagonal * 2^-k; 0: no bounds
//        18 .. 27  the cone's axis, an octahedral pair of 5 bits each
//        28 .. 31  sine of the cone's half angle in 14ths; 15: no cone
// Both are conservative: radius and angle are measured from the quantised centre and axis.
#ifndef BOUNDS_GLSL
#define BOUNDS_GLSL

#include "scene/scene.glsl"

#define CENTER_BITS 5u
#define AXIS_BITS 5u
#define SINE_STEPS 14.0
#define NO_CONE 15u
#define NO_BOUNDS (NO_CONE << 28)

struct Bounds {
  vec3 center;
  float radius;  // negative: no bounds
  vec3 axis;
  float sine;  // 2: no cone
};

// Unpacks the word.
Bounds bounds_of(uint word, vec3 box_low, vec3 box_size) {
  Bounds b;
  uvec3 cell = uvec3(word, word >> 5, word >> 10) & 31u;
  b.center = box_low + box_size * ((vec3(cell) + 0.5) / 32.0);
  uint k = (word >> 15) & 7u;
  b.radius = k == 0u ? -1.0 : length(box_size) * exp2(-float(k));
  b.axis = unit_of_oct(uvec2(word >> 18, word >> 23) & 31u, AXIS_BITS);
  b.sine = (word >> 28) == NO_CONE ? 2.0 : float(word >> 28) / SINE_STEPS;
  return b;
}

// Whether a sphere is outside a frustum plane. plane: sum or difference of two rows of the matrix
// to clip space.
bool beyond(vec4 plane, vec3 center, float radius) {
  return dot(plane.xyz, center) + plane.w < -radius * length(plane.xyz) * 1.0001;
}

bool outside_view(vec3 center, float radius, mat4 to_clip) {
  mat4 rows = transpose(to_clip);
  for (uint axis = 0u; axis < 3u; axis++) {
    vec4 low = axis == 2u ? rows[2] : rows[3] + rows[axis];  // depth begins at 0
    if (beyond(low, center, radius) || beyond(rows[3] - rows[axis], center, radius)) return true;
  }
  return false;
}

// Bits 0 .. 14: the cell that holds `center`.
uint center_word(vec3 center, vec3 box_low, vec3 box_size) {
  uvec3 cell = uvec3(clamp((center - box_low) / max(box_size, vec3(1e-30)) * 32.0, 0.0, 31.0));
  return cell.x | (cell.y << 5) | (cell.z << 10);
}

// Bits 15 .. 17: the smallest power of two that is at least `radius`.
uint radius_word(float radius, vec3 box_size) {
  float share = radius * 1.001 / length(box_size);
  for (uint k = 7u; k > 0u; k--)
    if (share < exp2(-float(k))) return k << 15;
  return 0u;
}

// Bits 18 .. 27: `direction` as a quantised octahedral pair.
uint axis_word(vec3 direction) {
  vec3 n = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  uvec2 q = uvec2(clamp((n.xy + 1.0) * 0.5 * 30.0 + 0.5, 0.0, 30.0));
  return (q.x << 18) | (q.y << 23);
}

// Bits 28 .. 31. cosine: the smallest between the axis and any normal.
uint sine_word(float cosine) {
  float safe = cosine - 0.001;
  if (safe <= 0.0) return NO_CONE << 28;
  return uint(min(ceil(sqrt(max(1.0 - safe * safe, 0.0)) * SINE_STEPS), 14.0)) << 28;
}

#endif
