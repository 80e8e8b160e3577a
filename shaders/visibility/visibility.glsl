// Path `visibility`: compute shaders rasterise triangles into a visibility buffer. A pixel has 64
// bits: depth (a float from 0 to 1, so that its bits are ordered), then (slot + 1) * 64 + triangle.
// The smaller number is the nearer surface; of equally near ones it is that of the earlier meshlet,
// as if they were drawn in order. Payloads below 64: the pixel shows no surface of this batch.
//
// Vertices snap to 1/256 of a pixel. A triangle covers the pixels whose centres are inside of it,
// or on a top or left edge. All arithmetic up to snapping is `precise`: if the shaders disagreed
// about a vertex, there would be cracks between small and large triangles.
#ifndef VISIBILITY_GLSL
#define VISIBILITY_GLSL
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

#include "decoders/slot_jobs.glsl"
uvec2 slot;  // address
#include "decoders/slot_vertex.glsl"

layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pixels { uint64_t at[]; };
// at[0].x: number of pieces; may exceed MAX_PIECES. Then of each: payload, x | y << 16.
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pieces { uvec2 at[]; };

layout(constant_id = 18) const uint MAX_PIECES = 131072u;

#define SUBPIXELS 256
#define FIRST_PAYLOAD 64u

uint payload_of(uint number, uint t) { return (number + 1u) * MESHLET_TRIANGLES + t; }

Primitive primitive;
Instance instance;

uint slot_number;

// Slot of the frame's cluster that was opened last; the one after the last if it is not decoded.
uint drawn_slot() {
  Cut cut = Jobs(push.jobs).cut;
  return min(SlotNumbers(cut.decoded).at[decoded_place()], cut.slots);
}

uint job_state(uint number) { return SlotNumbers(Jobs(push.jobs).cut.states).at[number]; }

// Whether the slot of job `number` has its triangles, and not those of a later pass.
bool drawn_in_pass(uint number) {
  return !has_pool() || job_state(number) == JOB_DRAWN + push.first;
}

// Opens slot `number` of the batch, or cluster `number` of the frame.
void open_slot(uint number) {
  if (has_pool()) {
    open_drawn(number);
    slot_number = drawn_slot();
  } else {
    open_job(number);
    slot_number = job_place;
  }
  slot = slot_address(push.slots, slot_number);
  instance = the_instance();
  primitive = job_primitive();
}

// Of a payload of at least FIRST_PAYLOAD.
uint job_of(uint payload) { return min(payload / MESHLET_TRIANGLES - 1u, job_total() - 1u); }

void open_payload(uint payload) { open_slot(job_of(payload)); }

// Vertices of a triangle in the slot.
uvec3 slot_corners(uint t) {
  uint corners = SceneWords(slot).at[t];
  return uvec3(corners, corners >> 8, corners >> 16) & (MESHLET_VERTICES - 1u);
}

vec4 clip_position(uint v) { return transformed(object_to_clip(), vertex_position(primitive, v)); }

// --- vertices in the window ---

// Bits of a vertex that is outside a clipping plane: the near plane, and four planes at GUARD
// pixels around the picture's centre. Within them, corners are less than 2^24 / 256 pixels apart.
#define OUTSIDE_NEAR 1u
#define PLANES 5u
#define GUARD 16384.0

// Distance to a plane, in the order of the bits; negative outside.
float inside_plane(vec4 clip, uint plane) {
  if (plane == 0u) return clip.z;
  vec2 guards = 2.0 * GUARD / vec2(picture_size());
  float along = plane < 3u ? clip.x : clip.y;
  precise float bound = clip.w * (plane < 3u ? guards.x : guards.y);
  precise float low = bound + along;
  precise float high = bound - along;
  return (plane & 1u) != 0u ? low : high;
}

// A position that is not a number, or whose w is not positive, is outside.
uint outside_planes(vec4 clip) {
  uint bits = clip.w > 0.0 ? 0u : OUTSIDE_NEAR;
  for (uint plane = 0u; plane < PLANES; plane++)
    if (!(inside_plane(clip, plane) >= 0.0)) bits |= 1u << plane;
  return bits;
}

// Pixel coordinates and depth of a clip position that is not outside.
vec3 window_position(vec4 clip) {
  precise float inverse = 1.0 / clip.w;
  precise vec3 ndc = clip.xyz * inverse;
  vec2 half_size = 0.5 * vec2(picture_size());
  precise vec2 place = fma(ndc.xy, half_size, half_size);
  return vec3(place, ndc.z);
}

// In 1 / SUBPIXELS pixels from the centre of pixel (0, 0).
ivec2 snapped(vec2 place) {
  precise vec2 from_center = place - 0.5;
  return ivec2(roundEven(from_center * float(SUBPIXELS)));
}

// --- triangles in the window ---

// The first and the last pixel of the picture whose centres lie in a box of snapped coordinates.
ivec2 first_pixel(ivec2 low) { return max((low + (SUBPIXELS - 1)) >> 8, ivec2(0)); }
ivec2 last_pixel(ivec2 high) { return min(high >> 8, picture_size() - 1); }

// Whether the instance shows triangles whose area has this sign (y points down).
bool side_visible(bool positive) {
  if ((Materials(the_frame().materials).at[instance.material].flags & MATERIAL_DOUBLE_SIDED) != 0u)
    return true;
  return positive == ((instance.flags & INSTANCE_MIRRORED) != 0u);
}

// -1 excludes samples on the edge, 0 includes them: top and left edges. along: the edge of a
// triangle of positive area.
int edge_bias(ivec2 along) { return along.y < 0 || (along.y == 0 && along.x > 0) ? 0 : -1; }

// Depth as a linear function of the pixel, from the positions before snapping. It is clamped to the
// depths of the corners, because a sliver's slope is mostly rounding error.
struct Depth {
  vec3 at;
  vec2 slope;
  float low;
  float high;
};

Depth depth_of(vec3 a, vec3 b, vec3 c) {
  vec3 ab = b - a, ac = c - a;
  float area = ab.x * ac.y - ac.x * ab.y;
  vec2 slope = vec2(ab.z * ac.y - ac.z * ab.y, ac.z * ab.x - ab.z * ac.x) / area;
  if (area == 0.0) slope = vec2(0.0);
  return Depth(a, slope, min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
}

float depth_at(Depth depth, ivec2 pixel) {
  vec2 from = vec2(pixel) + 0.5 - depth.at.xy;
  return clamp(depth.at.z + depth.slope.x * from.x + depth.slope.y * from.y, depth.low, depth.high);
}

#endif
