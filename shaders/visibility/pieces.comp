// Path `visibility`, after visibility_small.comp: rasterises pieces of triangles that are large or
// need clipping, a workgroup per piece, in turns.
//
// Inputs: the pieces; triangles whose pieces did not fit. Output: the visibility buffer.
// variants: visibility_pieces.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "visibility/visibility.glsl"
#include "visibility/seen.glsl"
#include "visibility/put.glsl"
#define BLOCK 8  // pixels: side of the square that a workgroup tests at once
layout(local_size_x = BLOCK * BLOCK) in;

// Draws the pixels [first, last] of a triangle, at most PIECE_SIDE in each direction. corners:
// snapped, of a triangle of positive area.
void draw_piece(Depth depth, ivec2 corners[3], ivec2 first, ivec2 last, uint payload, bool masked) {
  // An edge function changes by multiples of SUBPIXELS from pixel to pixel: its lower 8 bits do not
  // count. The rest fits in 32 bits if its sign changes within the piece.
  ivec3 edges, right, down;
  i64vec2 extent = i64vec2(last - first);
  for (uint e = 0u; e < 3u; e++) {
    ivec2 along = corners[e == 2u ? 0u : e + 1u] - corners[e];
    i64vec2 d = i64vec2(along), from = i64vec2(first) * SUBPIXELS - i64vec2(corners[e]);
    int64_t at_first = (d.x * from.y - d.y * from.x + edge_bias(along)) >> 8;
    int64_t across = -d.y * extent.x, below = d.x * extent.y, none = 0;
    if (at_first + max(across, none) + max(below, none) < 0) return;
    bool crosses = at_first + min(across, none) + min(below, none) < 0;
    edges[e] = crosses ? int(at_first) : 0;
    right[e] = crosses ? -along.y : 0;
    down[e] = crosses ? along.x : 0;
  }
  int thread = int(gl_LocalInvocationIndex);
  ivec2 own = ivec2(thread % BLOCK, thread / BLOCK);
  ivec3 row = edges + right * own.x + down * own.y;
  for (int y = first.y + own.y; y <= last.y; y += BLOCK, row += down * BLOCK) {
    ivec3 at = row;
    for (int x = first.x + own.x; x <= last.x; x += BLOCK, at += right * BLOCK)
      if ((at.x | at.y | at.z) >= 0)
        put(ivec2(x, y), depth_at(depth, ivec2(x, y)), payload, masked, true);
  }
}

// Draws the pixels [first, last] of a triangle.
void draw_triangle(vec3 a, vec3 b, vec3 c, ivec2 first, ivec2 last, uint payload, bool masked) {
  ivec2 p = snapped(a.xy), q = snapped(b.xy), r = snapped(c.xy);
  i64vec2 pq = i64vec2(q - p), pr = i64vec2(r - p);
  int64_t area = pq.x * pr.y - pr.x * pq.y;
  if (area == 0 || !side_visible(area > 0)) return;
  bool swap = area < 0;
  Depth depth = depth_of(a, swap ? c : b, swap ? b : c);
  ivec2 corners[3] = ivec2[3](p, swap ? r : q, swap ? q : r);
  first = max(first, first_pixel(min(p, min(q, r))));
  last = min(last, last_pixel(max(p, max(q, r))));
  int side = int(PIECE_SIDE);
  for (int y = first.y; y <= last.y; y += side)
    for (int x = first.x; x <= last.x; x += side)
      draw_piece(depth, corners, ivec2(x, y), min(ivec2(x, y) + side - 1, last), payload, masked);
}

// --- clipping ---

#define MAX_POLYGON 8u  // 3 corners, and one more for each plane
vec4 polygon[MAX_POLYGON];
uint polygon_size;

// The point of an edge on a plane, computed from the inside out: the same for both triangles of the
// edge.
vec4 crossing(vec4 inner, vec4 outer, float inner_distance, float outer_distance) {
  precise float share = inner_distance / (inner_distance - outer_distance);
  precise vec4 difference = outer - inner;
  precise vec4 offset = share * difference;
  precise vec4 result = inner + offset;
  return result;
}

void clip_polygon(uint plane) {
  vec4 kept[MAX_POLYGON];
  uint count = 0u;
  for (uint i = 0u; i < polygon_size; i++) {
    vec4 a = polygon[i], b = polygon[i + 1u < polygon_size ? i + 1u : 0u];
    float of_a = inside_plane(a, plane), of_b = inside_plane(b, plane);
    bool in_a = of_a >= 0.0, in_b = of_b >= 0.0;
    if (in_a && count < MAX_POLYGON) kept[count++] = a;
    if (in_a != in_b && count < MAX_POLYGON)
      kept[count++] = in_a ? crossing(a, b, of_a, of_b) : crossing(b, a, of_b, of_a);
  }
  polygon_size = count;
  for (uint i = 0u; i < count; i++) polygon[i] = kept[i];
}

// --- pieces ---

// Draws the pixels [first, last] of the triangle of a payload.
void draw(uint payload, ivec2 first, ivec2 last) {
  open_payload(payload);
  uint vertex_count = min((SUMMARY(slot_number) >> 8) & 255u, MESHLET_VERTICES);
  uvec3 v = min(slot_corners(payload % MESHLET_TRIANGLES), uvec3(max(vertex_count, 1u) - 1u));
  uint planes = 0u;
  polygon_size = 3u;
  for (uint i = 0u; i < 3u; i++) {
    polygon[i] = clip_position(v[i]);
    planes |= outside_planes(polygon[i]);
  }
  open_triangle(v, polygon[0], polygon[1], polygon[2]);
  for (uint plane = 0u; plane < PLANES; plane++)
    if ((planes >> plane & 1u) != 0u) clip_polygon(plane);
  for (uint i = 0u; i < polygon_size; i++)
    if (!(polygon[i].w > 0.0)) return;
  bool masked = instance_masked();
  for (uint i = 2u; i < polygon_size; i++)
    draw_triangle(window_position(polygon[0]), window_position(polygon[i - 1u]),
                  window_position(polygon[i]), first, last, payload, masked);
}

// Draws the triangles of a slot whose pieces did not fit, in the strip of PIECE_SIDE rows from
// `top` on.
void draw_overflow(uint number, int top) {
  if (!drawn_in_pass(number)) return;
  uvec2 waiting = SlotPairs(push.overflow).at[number];
  for (uint t = 0u; t < MESHLET_TRIANGLES; t++)
    if ((waiting[t >> 5] >> (t & 31u) & 1u) != 0u)
      draw(payload_of(number, t), ivec2(0, top),
           ivec2(picture_size().x, top + int(PIECE_SIDE)) - 1);
}

void main() {
  Pieces pieces = Pieces(push.pieces);
  uint total = pieces.at[0].x;
  for (uint i = gl_WorkGroupID.x; i < min(total, MAX_PIECES); i += gl_NumWorkGroups.x) {
    uvec2 piece = pieces.at[1u + i];
    ivec2 first = ivec2(piece.y & 0xFFFFu, piece.y >> 16);
    if (piece.x >= FIRST_PAYLOAD) draw(piece.x, first, first + int(PIECE_SIDE) - 1);
  }
  if (total <= MAX_PIECES) return;
  uint strips = (the_frame().height + PIECE_SIDE - 1u) / PIECE_SIDE;
  for (uint i = gl_WorkGroupID.x; i < job_total() * strips; i += gl_NumWorkGroups.x)
    draw_overflow(i / strips, int(PIECE_SIDE * (i % strips)));
}
