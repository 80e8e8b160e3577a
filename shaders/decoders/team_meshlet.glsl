// A meshlet's state in shared memory, for a workgroup (a team) that decodes its values together
// (spec, appendix A.7): team_values.glsl decodes all of it, interior.comp the part inside the
// boundary.
//
// WORKGROUP: the threads of a workgroup. The includer also defines the three functions that are
// declared below.
//
// Long functions are called from one place: compilers inline everything, and the code must fit the
// instruction cache. Hostile bytes: every subscript is masked or bounded by a checked count, every
// loop by 64, by the streams, or by the blob's end. Loops that contain barriers run equally often
// in all threads.
//
// needs: WORKGROUP, packed_triangle, connectivity_boundary, connectivity_starts
#ifndef TEAM_MESHLET_GLSL
#define TEAM_MESHLET_GLSL

#define OWN_GRID_POSITION
#include "decoders/sections.glsl"

uint packed_triangle(uint t);   // of the team's meshlet, packed as in serial_decoder.glsl
uvec2 connectivity_boundary();  // mask of its boundary vertices
uvec2 connectivity_starts();    // mask of the triangles that begin a disk

// Words of a team's scratch memory: the ends of the quotients of up to four elements, or GEO's sums
// at 64 vertices.
#define SCRATCH_ELEMENTS 4u
#define SCRATCH_WORDS (SCRATCH_ELEMENTS * 64u)

shared uint team_values[MAX_ELEMENTS * 64u];
shared ATOMIC_UINT team_error;
shared mask64 team_symbols[4];       // R, C, E, S
shared uint team_traversal[64];      // packed triangles that introduce a vertex
shared uint team_references[64];     // rank in the loop order | length << 8
shared ATOMIC_UINT team_loop[16];    // boundary ids in loop order, four to a word
shared ATOMIC_UINT team_begins[17];  // first local id of each disk and the end, four to a word
shared mask64 team_ranks;            // ranks at which references start
shared mask64 team_waiting;          // inner vertices of private references
// Inner vertices of a stream's seams: id | reference << 8 | place << 16. Later weights of AFFINE:
// by rank along the boundary, then by place in the traversal.
shared uint team_seams[64];
shared mask64 team_seam_refs[MAX_STREAMS];
// The interior's codes | bit positions of their widths, from team_codes_begin on, << 8.
shared uint team_codes[MAX_STREAMS];
uint team_codes_begin;
shared uint team_interior;  // bit position of the interior

// The ends of the quotients, later the vertices' sums of cross products.
shared ATOMIC_UINT team_scratch[SCRATCH_WORDS];

uint loop_id(uint rank) {
  return bitfieldExtract(ATOMIC_LOAD(team_loop[(rank >> 2) & 15u]), int(rank & 3u) * 8, 6);
}
uint disk_begin(uint disk) {
  return bitfieldExtract(ATOMIC_LOAD(team_begins[min(disk, 64u) >> 2]), int(disk & 3u) * 8, 7);
}
uint first_id(uint r) { return loop_id(team_references[r & 63u]); }
uint reference_length_of(uint r) { return team_references[r & 63u] >> 8; }

Triple grid_position(uint id) {
  return Triple(team_values[id], team_values[64u + id], team_values[128u + id]);
}

// --- disks ---

mask64 team_boundary;
uint team_disks;

void find_disks() {
  mask64 starts = connectivity_starts();
  team_boundary = connectivity_boundary();
  team_disks = mask_count(starts);
  vertex_count = pushed_vertices(mask_below(triangle_count)) + team_disks;
  if (vertex_count > 64u || team_disks == 0u) {
    error = ERROR_VERTICES;
    vertex_count = min(vertex_count, 64u);
  }
  for (uint t = THREAD; t <= triangle_count; t += WORKGROUP) {
    if (t < triangle_count && !mask_test(starts, t)) continue;
    mask64 before = mask_below(t);
    uint disk = mask_count(starts & before);
    uint ids = pushed_vertices(before) + disk;
    if (t == triangle_count) ids = vertex_count;
    ATOMIC_OR(team_begins[disk >> 2], min(ids, 64u) << 8u * (disk & 3u));
  }
  for (uint id = THREAD; id < vertex_count; id += WORKGROUP) {
    if (!mask_test(team_boundary, id)) continue;
    uint rank = mask_count(team_boundary & mask_below(id));
    ATOMIC_OR(team_loop[rank >> 2], id << 8u * (rank & 3u));
  }
}

// First rank of loop k, and the rank after its last.
uvec2 loop_ranks(uint k) {
  return uvec2(mask_count(team_boundary & mask_below(disk_begin(k))),
               mask_count(team_boundary & mask_below(disk_begin(k + 1u))));
}

// The inner vertex of a private reference at this rank waits for the traversal.
void add_waiting(uint rank) {
  mask64 id = mask_bit(loop_id(rank));
  atomicOr(team_waiting.x, id.x);
  atomicOr(team_waiting.y, id.y);
}

// A meshlet without references: all boundary vertices wait but the first of each disk.
void add_waiting_loops() {
  mask64 firsts = mask_none();
  for (uint i = 0u; i < team_disks; i++) firsts = firsts | mask_bit(disk_begin(i) & 63u);
  team_waiting = team_boundary & ~firsts;
}

// --- beginning and agreeing ---

// Broadcasts any thread's error to its team. Contains a barrier.
bool agree() {
  if (error != ERROR_NONE) ATOMIC_MAX(team_error, error);
  barrier();
  error = ATOMIC_LOAD(team_error);
  return error == ERROR_NONE;
}

// Call first: clears the memory that the threads of a team fill together. Contains a barrier.
void open_team() {
  error = ERROR_NONE;
  for (uint i = THREAD; i < 17u; i += WORKGROUP) {
    ATOMIC_STORE(team_begins[i], 0u);
    ATOMIC_STORE(team_loop[i & 15u], 0u);
  }
  if (THREAD == 0u) {
    ATOMIC_STORE(team_error, ERROR_NONE);
    for (uint i = 0u; i < 4u; i++) team_symbols[i] = mask_none();
    team_ranks = mask_none();
    team_waiting = mask_none();
  }
  barrier();
}

#endif
