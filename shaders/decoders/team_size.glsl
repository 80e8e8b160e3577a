// Sizes of the team decoder (team_values.glsl). The includer defines TEAM. Include before
// serial_prologue.glsl.
#define GROUP 32u             // threads per workgroup
#define TEAMS (GROUP / TEAM)  // meshlets per workgroup
layout(constant_id = 8) const uint STAGE_WORDS_OF_HOST = 32u;
// Words of a meshlet's data copied to shared memory, at least 3.
#define STAGE_WORDS STAGE_WORDS_OF_HOST
#define STAGE_OWNERS 6u  // owners of foreign references whose data are copied, too
// Per team: the owners' data, later the ends of the quotients, then GEO's sums at 64 vertices.
#define SCRATCH_VALUES (MAX_ELEMENTS * 64u > 192u ? MAX_ELEMENTS * 64u : 192u)
#define SCRATCH_WORDS \
  (SCRATCH_VALUES > STAGE_OWNERS * STAGE_WORDS ? SCRATCH_VALUES : STAGE_OWNERS * STAGE_WORDS)
#define STAGE_TOTAL (TEAMS * (STAGE_WORDS + SCRATCH_WORDS))
