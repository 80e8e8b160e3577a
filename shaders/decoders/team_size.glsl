// Sizes of the team decoder (team_values.glsl). The includer defines TEAM. Include before
// serial_prologue.glsl.
#define GROUP 32u             // threads per workgroup
#define TEAMS (GROUP / TEAM)  // meshlets per workgroup
layout(constant_id = 8) const uint STAGE_WORDS_OF_HOST = 32u;
// Words of the data of an owner and of the team's own meshlet that are copied to shared memory.
#define STAGE_WORDS STAGE_WORDS_OF_HOST
#define OWN_STAGE_WORDS (2u * STAGE_WORDS)
#define STAGE_OWNERS 6u  // owners of foreign references whose data are copied, too
// Per team: the owners' data, later the ends of the quotients, then GEO's sums at 64 vertices.
#define SCRATCH_VALUES (MAX_ELEMENTS * 64u > 192u ? MAX_ELEMENTS * 64u : 192u)
#ifdef NO_STAGE
#undef OWN_STAGE_WORDS
#define OWN_STAGE_WORDS 0u
#define SCRATCH_WORDS SCRATCH_VALUES
#else
#define SCRATCH_WORDS \
  (SCRATCH_VALUES > STAGE_OWNERS * STAGE_WORDS ? SCRATCH_VALUES : STAGE_OWNERS * STAGE_WORDS)
#endif
#define STAGE_TOTAL (TEAMS * (OWN_STAGE_WORDS + SCRATCH_WORDS))
