// Storage for the apices of the serial decoder, in a workgroup of WORKGROUP threads with a meshlet
// each. Include before serial.glsl. APEX_THREADS: fewer if no thread decodes.
//
// Apices in shared memory: arrays of a thread live in slow memory. Four to a word: the less shared
// memory a workgroup takes, the more workgroups run at once.
//
// needs: WORKGROUP
// optional: APEX_THREADS
#ifndef SHARED_APEXES_GLSL
#define SHARED_APEXES_GLSL

#ifndef APEX_THREADS
#define APEX_THREADS WORKGROUP
#endif
shared uint apexes[16u * APEX_THREADS];
#define APEX_WORD(t) apexes[((t) >> 2) * WORKGROUP + gl_LocalInvocationIndex]
#define APEX(t) bitfieldExtract(APEX_WORD(t), int(((t) & 3u) * 8u), 8)
#define SET_APEX(t, v) APEX_WORD(t) = bitfieldInsert(APEX_WORD(t), v, int(((t) & 3u) * 8u), 8)

#endif
