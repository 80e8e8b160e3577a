// Interpolates the attributes of the hit triangle: from the cache, (PAPER) from the compressed
// bytes, or (TRIANGLES) from uncompressed buffers. Include after rt_common.glsl. Call open_hit
// first.

#include "raytrace/rt_exact.glsl"
#include "raytrace/rt_hit.glsl"
#include "raytrace/rt_meshlet.glsl"

#define PRIMITIVE Primitives(Frame(push.frame).primitives).at[placed.primitive]
uint id;  // meshlet * 64 + triangle
uvec3 corners;
vec3 weights;  // of the corners

#ifdef TRIANGLES

#include "scene/plain_vertex.glsl"
hitAttributeEXT vec2 found;

void open_hit() {
  open_box();
  id = gl_PrimitiveID;  // the host looks up the meshlet
  weights = vec3(1.0 - found.x - found.y, found);
  SceneWords indices = SceneWords(PRIMITIVE.index_data);
  for (uint k = 0u; k < 3u; k++) corners[k] = indices.at[3u * id + k];
}

#else

uvec2 slot;
#define SLOT slot
#ifdef PAPER
#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"
bool in_cache;
#define VALUE(a, place, c, v)                                                           \
  (in_cache ? slot_bits(SLOT, v, (place) + (c) * attribute_field(a), attribute_bits(a)) \
            : values[(a.element + (c)) * 64u + (v)])
#define POSITION(p, v)                                  \
  (in_cache ? slot_object_position(SLOT, p.position, v) \
            : position_value(p.position, uvec3(values[v], values[64u + v], values[128u + v])))
#endif
#include "scene/decoded_vertex.glsl"
hitAttributeEXT HitAttributes found;

void open_hit() {
  open_box();
  id = hit_id(found.triangle);
  weights = vec3(1.0 - found.barycentrics.x - found.barycentrics.y, found.barycentrics);
  uint entry = slot_entry();
  slot = slot_address(push.cache, entry);
  uint packed;
#ifdef PAPER
  in_cache = entry != NO_SLOT;
  if (!in_cache) {
    open_blob(PRIMITIVE.blob, PRIMITIVE.blob_words);
    load_streams(0u, PRIMITIVE.stream_end);
    decode_meshlet(meshlet());
    packed = triangles[found.triangle];
  } else
#endif
    packed = SceneWords(slot).at[found.triangle];
  corners = uvec3(packed, packed >> 8, packed >> 16) & 63u;
}

#endif

#define INTERPOLATED(attribute)                                                                \
  (weights.x * attribute(PRIMITIVE, corners.x) + weights.y * attribute(PRIMITIVE, corners.y) + \
   weights.z * attribute(PRIMITIVE, corners.z))

#define TEXCOORD INTERPOLATED(vertex_texcoord)
#define COLOR INTERPOLATED(vertex_color)
#define SAMPLE(number, uv) textureLod(textures[nonuniformEXT(number)], uv, 0.0)
#include "scene/material.glsl"
