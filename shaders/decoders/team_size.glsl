// Sizes of the cooperative decoder (team_values.glsl); the includer has defined TEAM. To be
// included before the prologue.
#define GROUP 32u             // invocations of a workgroup
#define TEAMS (GROUP / TEAM)  // meshlets of a workgroup
layout(constant_id = 8) const uint STAGE_WORDS_OF_HOST = 32u;
#define STAGE_WORDS \
  STAGE_WORDS_OF_HOST    // of a meshlet's data that are copied to shared memory, at least 3
#define STAGE_OWNERS 6u  // owners whose data are copied, too
// Of a team: the owners' data, later the places of quotients' ends.
#define SCRATCH_WORDS                                                   \
  (MAX_ELEMENTS * 64u > STAGE_OWNERS * STAGE_WORDS ? MAX_ELEMENTS * 64u \
                                                   : STAGE_OWNERS * STAGE_WORDS)
#define STAGE_TOTAL (TEAMS * (STAGE_WORDS + SCRATCH_WORDS))
