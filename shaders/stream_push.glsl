// Path `stream`, decoding: the job of connect.comp and values.comp is a segment, some meshlets of an instance that go into slots of the ring
// (vk_backend/stream.py); see decode_push.glsl.
#include "culling.glsl"
#include "slots.glsl"
#include "decode_buffers.glsl"

Primitive job_primitive() { return Primitives(the_frame().primitives).at[the_primitive()]; }
uvec2 job_blob() { return Primitives(the_frame().primitives).at[the_primitive()].blob; }
uint job_blob_words() { return Primitives(the_frame().primitives).at[the_primitive()].blob_words; }
uint job_streams() { return Primitives(the_frame().primitives).at[the_primitive()].stream_end; }
uint job_meshlet(uint i) { return push.first + i; }
bool job_wants(uint i) { return meshlet_visible(push.first + i); }
uint job_place(uint i) { return push.first_slot + i; }
uvec2 job_triangles(uint i) { return slot_address(push.slots, push.first_slot + i); }
