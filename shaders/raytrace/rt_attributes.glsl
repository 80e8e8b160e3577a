// Interpolates the attributes of a hit triangle: from the cache, (PAPER) from the compressed bytes,
// or (PLAIN) from uncompressed buffers. Include after rt_common.glsl, rt_hit.glsl and, if PAPER,
// the decoder. Call open_attributes first.

#include "raytrace/rt_exact.glsl"

// A hit.
struct Place {
  Placed placed;
  uint number;    // of the meshlet; with TRIANGLES, of the primitive's first one
  uint triangle;  // in the meshlet; with TRIANGLES, in the primitive
  vec3 weights;
};

// The hit that the stage runs for.
Place hit_place(vec2 barycentrics, uint triangle) {
  Place place;
  place.placed = PlacedPieces(push.placed).at[gl_InstanceCustomIndexEXT & PLACED_INDEX];
  place.number = place.placed.first;
#ifndef TRIANGLES
  place.number += uint(gl_PrimitiveID) / (MESHLET_TRIANGLES / GROUP_TRIANGLES);
#endif
  place.triangle = triangle;
  place.weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
  return place;
}

uint hit_instance(Place place) { return SWEEPS ? place.placed.instance : gl_InstanceID; }

#define PRIMITIVE Primitives(Frame(push.frame).primitives).at[open_primitive]
uint open_primitive;
uvec3 open_corners;  // vertices of the hit triangle
vec3 open_weights;

// Set by open_attributes. Vertices are local to the meshlet, or (PLAIN) to the primitive.
#ifdef PLAIN

void open_attributes(Place place) {
  open_primitive = place.placed.primitive;
  open_weights = place.weights;
  uint triangle = place.triangle;
#ifndef TRIANGLES
  Counts firsts = Counts(push.first_triangles);
  triangle += firsts.at[place.number] - firsts.at[place.placed.first];
#endif
  SceneWords indices = SceneWords(PRIMITIVE.index_data);
  for (uint k = 0u; k < 3u; k++) open_corners[k] = indices.at[3u * triangle + k];
}

float plain(uint v, uint at) {
  return SceneFloats(PRIMITIVE.vertex_data).at[VERTEX_FLOATS * v + at];
}
bool has_normal() { return (ATTRIBUTES & HAS_NORMAL) != 0u; }
vec3 vertex_position(uint v) { return vec3(plain(v, 0u), plain(v, 1u), plain(v, 2u)); }
vec3 vertex_normal(uint v) { return vec3(plain(v, 3u), plain(v, 4u), plain(v, 5u)); }
vec2 vertex_texcoord(uint v) {
  uint at = has_normal() ? 6u : 3u;
  return (ATTRIBUTES & HAS_TEXCOORD) == 0u ? vec2(0.0) : vec2(plain(v, at), plain(v, at + 1u));
}
vec4 vertex_color(uint v) {
  if ((ATTRIBUTES & HAS_COLOR) == 0u) return vec4(1.0);
  uint at = VERTEX_FLOATS - 4u;
  return vec4(plain(v, at), plain(v, at + 1u), plain(v, at + 2u), plain(v, at + 3u));
}

#else

uvec2 open_slot;
#define SLOT open_slot
#ifdef PAPER
bool in_cache;
#define VALUE(a, place, c, v)                                                           \
  (in_cache ? slot_bits(SLOT, v, (place) + (c) * attribute_field(a), attribute_bits(a)) \
            : values[(a.element + (c)) * 64u + (v)])
#endif
#include "scene/decoded_vertex.glsl"

void open_attributes(Place place) {
  open_primitive = place.placed.primitive;
  open_weights = place.weights;
  uint entry = slot_entry(place.number);
  open_slot = slot_address(push.cache, entry);
  uint corners;
#ifdef PAPER
  in_cache = entry != NO_SLOT;
  if (!in_cache) {
    open_blob(PRIMITIVE.blob, PRIMITIVE.blob_words);
    load_streams(0u, PRIMITIVE.stream_end);
    decode_meshlet(meshlet_of(place.placed, place.number));
    corners = triangles[place.triangle];
  } else
#endif
    corners = SceneWords(open_slot).at[place.triangle];
  open_corners = uvec3(corners, corners >> 8, corners >> 16) & 63u;
}

bool has_normal() { return PRIMITIVE.normal.element != NO_ELEMENT; }
vec3 vertex_position(uint v) {
#ifdef PAPER
  if (!in_cache)
    return position_value(PRIMITIVE.position, uvec3(values[v], values[64u + v], values[128u + v]));
#endif
  return decoded_position(PRIMITIVE, v);
}
vec3 vertex_normal(uint v) { return decoded_normal(PRIMITIVE, v); }
vec2 vertex_texcoord(uint v) { return decoded_texcoord(PRIMITIVE, v); }
vec4 vertex_color(uint v) { return decoded_color(PRIMITIVE, v); }

#endif

#define INTERPOLATED(attribute)                                                              \
  (open_weights.x * attribute(open_corners.x) + open_weights.y * attribute(open_corners.y) + \
   open_weights.z * attribute(open_corners.z))

vec3 flat_normal_in_object() {
  vec3 first = vertex_position(open_corners.x);
  return cross_product(vertex_position(open_corners.y) - first,
                       vertex_position(open_corners.z) - first);
}
vec3 normal_in_object() { return INTERPOLATED(vertex_normal); }

layout(set = 0, binding = 0) uniform sampler2D textures[];

vec4 texture_at_hit(Material material, int number) {
  vec2 uv = INTERPOLATED(vertex_texcoord);
  uv = material.texcoord_matrix.xy * uv.x + material.texcoord_matrix.zw * uv.y +
       material.texcoord_offset;
  return textureLod(textures[nonuniformEXT(number)], uv, 0.0);
}

// Linear RGB and alpha.
vec4 base_color(Material material) {
  vec4 color = material.base_color * INTERPOLATED(vertex_color);
  return material.base_texture < 0 ? color
                                   : color * texture_at_hit(material, material.base_texture);
}

vec3 emission(Material material) {
  return material.emissive_texture < 0
             ? material.emissive.rgb
             : material.emissive.rgb * texture_at_hit(material, material.emissive_texture).rgb;
}
