// Path `visibility`, after decoding: a workgroup rasterises the meshlet of one slot. A thread
// transforms a vertex, then draws a triangle whose box has few pixels. Triangles that are larger or
// need clipping become pieces for visibility_pieces.comp.
//
// Inputs: the slot and its summary.
// Outputs: the visibility buffer; pieces; triangles whose pieces did not fit.
// variants: visibility_small.comp=
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "visibility/visibility.glsl"
#include "visibility/seen.glsl"
#include "visibility/put.glsl"
layout(local_size_x = MESHLET_VERTICES) in;

layout(constant_id = 20) const uint SMALL_PIXELS = 128u;  // in the box of a small triangle
#define SMALL_SIDE 64  // pixels: edge functions of smaller triangles fit in 32 bits

#define MOST_OF_TRIANGLE 4096u  // pieces; enough for 16 million pixels

shared vec3 places[MESHLET_VERTICES];
shared uint outsides[MESHLET_VERTICES];
shared uint overflow[MESHLET_TRIANGLES / 32u];

// Draws a triangle of positive area whose corners are at most SMALL_SIDE pixels apart.
void draw_small(vec3 a, vec3 b, vec3 c, ivec2 first, ivec2 last, uint payload, bool masked) {
  ivec2 origin = first * SUBPIXELS;
  ivec2 p = snapped(a.xy) - origin, q = snapped(b.xy) - origin, r = snapped(c.xy) - origin;
  ivec2 pq = q - p, qr = r - q, rp = p - r;
  ivec3 row =
      ivec3(pq.y * p.x - pq.x * p.y + edge_bias(pq), qr.y * q.x - qr.x * q.y + edge_bias(qr),
            rp.y * r.x - rp.x * r.y + edge_bias(rp));
  ivec3 right = -ivec3(pq.y, qr.y, rp.y) * SUBPIXELS, down = ivec3(pq.x, qr.x, rp.x) * SUBPIXELS;
  Depth depth = depth_of(a, b, c);
  for (int y = first.y; y <= last.y; y++, row += down) {
    ivec3 edges = row;
    for (int x = first.x; x <= last.x; x++, edges += right)
      if ((edges.x | edges.y | edges.z) >= 0)
        // Waiting for the pixel's value takes longer than an atomic operation in vain: on an H200
        // this shader takes 1.3 to 3 times as long with the test.
        put(ivec2(x, y), depth_at(depth, ivec2(x, y)), payload, masked, masked);
  }
}

// Leaves a triangle to visibility_pieces.comp. first, last: pixels of its box.
void put_pieces(ivec2 first, ivec2 last, uint t) {
  Pieces pieces = Pieces(push.pieces);
  uvec2 count = uvec2(last - first) / PIECE_SIDE + 1u;
  uint total = count.x * count.y;
  bool fits = false;
  // The counter must not wrap around.
  if (total <= MOST_OF_TRIANGLE && pieces.at[0].x <= MAX_PIECES) {
    uint begin = atomicAdd(pieces.at[0].x, total);
    fits = begin <= MAX_PIECES && total <= MAX_PIECES - begin;
    // Fills records even if some do not fit: the other shader reads all of them.
    uint payload = fits ? payload_of(job_place, t) : 0u;
    for (uint i = 0u; i < total && begin + i < MAX_PIECES; i++) {
      uvec2 corner = uvec2(first) + PIECE_SIDE * uvec2(i % count.x, i / count.x);
      pieces.at[1u + begin + i] = uvec2(payload, corner.x | corner.y << 16);
    }
  }
  if (!fits) atomicOr(overflow[t >> 5], 1u << (t & 31u));
}

// The box of the part of a triangle behind the near plane, in pixels, within the picture.
void clipped_box(uvec3 v, out ivec2 first, out ivec2 last) {
  vec4 corners[3] = vec4[3](clip_position(v.x), clip_position(v.y), clip_position(v.z));
  vec2 size = vec2(picture_size()), low = size, high = vec2(0.0);
  for (uint i = 0u; i < 3u; i++) {
    vec4 a = corners[i], b = corners[(i + 1u) % 3u];
    vec4 found[2] = vec4[2](a, mix(a, b, a.z / (a.z - b.z)));
    bool inside[2] = bool[2](a.z >= 0.0, (a.z >= 0.0) != (b.z >= 0.0));
    for (uint k = 0u; k < 2u; k++) {
      if (!inside[k]) continue;
      // A point before the near plane's eye: no projection is known to have one.
      if (!(found[k].w > 0.0)) {
        low = vec2(0.0);
        high = size;
        continue;
      }
      vec2 place = (found[k].xy / found[k].w * 0.5 + 0.5) * size;
      low = min(low, place - 2.0);  // for rounding
      high = max(high, place + 2.0);
    }
  }
  first = ivec2(clamp(low, vec2(0.0), size));
  last = min(ivec2(clamp(high, vec2(-1.0), size)), picture_size() - 1);
}

void draw(uint t, uvec3 v, bool masked) {
  if ((outsides[v.x] & outsides[v.y] & outsides[v.z]) != 0u) return;
  ivec2 first, last;
  if ((outsides[v.x] | outsides[v.y] | outsides[v.z]) != 0u) {
    clipped_box(v, first, last);
    if (first.x <= last.x && first.y <= last.y) put_pieces(first, last, t);
    return;
  }
  vec3 a = places[v.x], b = places[v.y], c = places[v.z];
  ivec2 p = snapped(a.xy), q = snapped(b.xy), r = snapped(c.xy);
  ivec2 low = min(p, min(q, r)), high = max(p, max(q, r));
  first = first_pixel(low);
  last = last_pixel(high);
  if (first.x > last.x || first.y > last.y) return;
  i64vec2 pq = i64vec2(q - p), pr = i64vec2(r - p);
  int64_t area = pq.x * pr.y - pr.x * pq.y;
  if (area == 0 || !side_visible(area > 0)) return;
  uvec2 box = uvec2(last - first) + 1u;
  if (any(greaterThan(high - low, ivec2(SMALL_SIDE * SUBPIXELS))) || box.x * box.y > SMALL_PIXELS) {
    put_pieces(first, last, t);
    return;
  }
  if (masked) open_triangle(v, clip_position(v.x), clip_position(v.y), clip_position(v.z));
  bool swap = area < 0;
  draw_small(a, swap ? c : b, swap ? b : c, first, last, payload_of(job_place, t), masked);
}

void finish(uvec2 without_pieces, uint triangle_count) {
  SlotPairs(push.overflow).at[job_place] = without_pieces;
  if (!has_pool()) return;
  atomicAdd(Jobs(push.jobs).cut.triangles, triangle_count);
  SlotNumbers(Jobs(push.jobs).cut.states).at[job_place] = JOB_DRAWN + push.first;
}

void main() {
  uint thread = gl_LocalInvocationIndex;
  uint number = job_workgroup();
  if (number >= job_total() || (has_pool() && job_state(number) != JOB_WAITING)) return;
  open_slot(number);
  if (has_pool() && slot_number == Jobs(push.jobs).cut.slots) return;  // it waits for the next pass
  uint summary = SUMMARY(slot_number);
  // A malformed meshlet has an error code in the upper half and is not drawn.
  uint triangle_count = summary >> 16 != 0u ? 0u : min(summary & 255u, MESHLET_TRIANGLES);
  uint vertex_count = min((summary >> 8) & 255u, MESHLET_VERTICES);
  if (triangle_count == 0u || vertex_count == 0u) {
    if (thread == 0u) finish(uvec2(0u), 0u);
    return;
  }
  if (thread < 2u) overflow[thread] = 0u;
  if (thread < vertex_count) {
    vec4 clip = clip_position(thread);
    outsides[thread] = outside_planes(clip);
    places[thread] = window_position(clip);
  }
  barrier();
  if (thread < triangle_count)
    draw(thread, min(slot_corners(thread), uvec3(vertex_count - 1u)), instance_masked());
  barrier();
  if (thread == 0u) finish(uvec2(overflow[0], overflow[1]), triangle_count);
}
