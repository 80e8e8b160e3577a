// The triangles of a meshlet by the parallel connectivity. Call decode_connectivity with all
// threads after open_team and read_team_symbols; it ends with a barrier.
//
// needs: WORKGROUP, packed_triangle, connectivity_boundary, connectivity_starts
// optional: PARALLEL_ROOM
#ifndef TEAM_CONNECTIVITY_GLSL
#define TEAM_CONNECTIVITY_GLSL

#include "decoders/team_meshlet.glsl"

#ifndef PARALLEL_ROOM
#define PARALLEL_ROOM(n) (n)
#endif
shared uint parallel_triangles[PARALLEL_ROOM(64u)];

#define SHARED shared
#define OR_MASK(target, mask) (atomicOr((target).x, (mask).x), atomicOr((target).y, (mask).y))
#define ADD(target, value) atomicAdd(target, value)
#define TRIANGLES parallel_triangles
#include "decode/parallel_connectivity.glsl"

uint parallel_triangle(uint t) { return parallel_triangles[t & 63u]; }

uvec2 parallel_starts() {
  return (mask_shl1(closing_ends) | mask_bit(0u)) & mask_below(triangle_count);
}

uvec2 parallel_boundary() {
  uint vertices = 2u * mask_count(symbol_e) +
                  mask_count(mask_below(triangle_count) & ~(symbol_e | symbol_c | symbol_s)) +
                  disks_of_symbols();
  return mask_below(min(vertices, 64u)) & ~interior_ids;
}

void decode_connectivity() {
  if (disks_of_symbols() - 1u > 63u) error = ERROR_CLERS;
  for (uint step = 0u; step < 8u; step++) {
    for (uint t = gl_LocalInvocationIndex; t < 64u; t += WORKGROUP) {
      if (step == 0u)
        parallel_step_0(t);
      else if (step == 1u)
        parallel_step_1(t);
      else if (step == 2u)
        parallel_step_2(t);
      else if (step == 3u)
        parallel_step_3(t);
      else if (step == 4u)
        parallel_step_4(t);
      else if (step == 5u)
        parallel_step_5(t);
      else if (step == 6u)
        parallel_step_6(t);
      else
        parallel_step_7(t);
    }
    barrier();
  }
}

#endif
