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

#ifdef PLAIN

uvec3 plain_corners;  // offset of each corner's floats
SceneFloats plain_floats;
vec3 plain_weights;

void open_attributes(Place place) {
  open_primitive = place.placed.primitive;
  uint triangle = place.triangle;
#ifndef TRIANGLES
  Counts firsts = Counts(push.first_triangles);
  triangle += firsts.at[place.number] - firsts.at[place.placed.first];
#endif
  SceneWords indices = SceneWords(PRIMITIVE.index_data);
  plain_corners = VERTEX_FLOATS * uvec3(indices.at[3u * triangle], indices.at[3u * triangle + 1u],
                                        indices.at[3u * triangle + 2u]);
  plain_floats = SceneFloats(PRIMITIVE.vertex_data);
  plain_weights = place.weights;
}

float plain_value(uint at) {
  uvec3 place = plain_corners + at;
  return dot_product(plain_weights, vec3(plain_floats.at[place.x], plain_floats.at[place.y],
                                         plain_floats.at[place.z]));
}

vec3 plain_position(uint corner) {
  uint at = plain_corners[corner];
  return vec3(plain_floats.at[at], plain_floats.at[at + 1u], plain_floats.at[at + 2u]);
}

vec3 flat_normal_in_object() {
  return cross_product(plain_position(1u) - plain_position(0u),
                       plain_position(2u) - plain_position(0u));
}
bool has_normal() { return (ATTRIBUTES & HAS_NORMAL) != 0u; }
vec3 normal_in_object() { return vec3(plain_value(3u), plain_value(4u), plain_value(5u)); }
vec2 texcoord_at_hit() {
  uint at = has_normal() ? 6u : 3u;
  return (ATTRIBUTES & HAS_TEXCOORD) == 0u ? vec2(0.0)
                                           : vec2(plain_value(at), plain_value(at + 1u));
}
vec4 color_at_hit() {
  uint at = (has_normal() ? 6u : 3u) + ((ATTRIBUTES & HAS_TEXCOORD) != 0u ? 2u : 0u);
  return (ATTRIBUTES & HAS_COLOR) == 0u ? vec4(1.0)
                                        : vec4(plain_value(at), plain_value(at + 1u),
                                               plain_value(at + 2u), plain_value(at + 3u));
}

#else

uvec2 open_slot;
uvec3 open_corners;
vec3 open_weights;
#ifdef PAPER
bool in_cache;
#else
const bool in_cache = true;
#endif

void open_attributes(Place place) {
  open_primitive = place.placed.primitive;
  open_weights = place.weights;
  uint entry = slot_entry(place.number);
  open_slot = slot_address(push.cache, entry);
  uint corners = 0u;
#ifdef PAPER
  in_cache = entry != NO_SLOT;
  if (!in_cache) {
    open_blob(PRIMITIVE.blob, PRIMITIVE.blob_words);
    load_streams(0u, PRIMITIVE.stream_end);
    decode_meshlet(meshlet_of(place.placed, place.number));
    corners = triangles[place.triangle];
  }
#endif
  if (in_cache) corners = SceneWords(open_slot).at[place.triangle];
  open_corners = uvec3(corners & 63u, (corners >> 8) & 63u, (corners >> 16) & 63u);
}

// One decoded integer that is not in a slot.
uint decoded_integer(uint element, uint vertex) {
#ifdef PAPER
  return values[element * 64u + vertex];
#else
  return 0u;
#endif
}

// Reads an attribute's elements. at: offset of its bits in a slot's vertex.
uvec4 integers(Attribute a, uint at, uint vertex) {
  uvec4 q = uvec4(0u);
  for (uint c = 0u; c < min(attribute_elements(a), 4u); c++)
    q[c] = in_cache ? slot_bits(open_slot, vertex, at + c * attribute_field(a), attribute_bits(a))
                    : decoded_integer(a.element + c, vertex);
  return q;
}

vec4 interpolated(Attribute a, uint at) {
  vec4 sum = vec4(0.0);
  for (uint k = 0u; k < 3u; k++)
    sum += open_weights[k] * attribute_value(a, integers(a, at, open_corners[k]));
  return sum;
}

vec3 corner_position(uint corner) {
  uint v = open_corners[corner];
  if (in_cache) return slot_position(open_slot, v);
  uvec3 q = uvec3(decoded_integer(0u, v), decoded_integer(1u, v), decoded_integer(2u, v));
  return POSITION_FLOATS ? position_value(PRIMITIVE.position, q) : vec3(q);
}

// A grid has the same step on all axes, so normals computed on it are right in object space.
vec3 flat_normal_in_object() {
  return cross_product(corner_position(1u) - corner_position(0u),
                       corner_position(2u) - corner_position(0u));
}
bool has_normal() { return PRIMITIVE.normal.element != NO_ELEMENT; }
vec3 normal_in_object() {
  Attribute a = PRIMITIVE.normal;
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < 3u; k++)
    sum += open_weights[k] * normal_value(a, integers(a, NORMAL_PLACE, open_corners[k]).xyz);
  return sum;
}
vec2 texcoord_at_hit() {
  Attribute a = PRIMITIVE.texcoord;
  return a.element == NO_ELEMENT ? vec2(0.0) : interpolated(a, texcoord_place(PRIMITIVE.normal)).xy;
}
vec4 color_at_hit() {
  Attribute a = PRIMITIVE.color;
  if (a.element == NO_ELEMENT) return vec4(1.0);
  vec4 color = interpolated(a, color_place(PRIMITIVE.normal, PRIMITIVE.texcoord));
  return attribute_elements(a) < 4u ? vec4(color.rgb, 1.0) : color;
}

#endif

layout(set = 0, binding = 0) uniform sampler2D textures[];

vec4 texture_at_hit(Material material, int number) {
  vec2 uv = texcoord_at_hit();
  uv = material.texcoord_matrix.xy * uv.x + material.texcoord_matrix.zw * uv.y +
       material.texcoord_offset;
  return textureLod(textures[nonuniformEXT(number)], uv, 0.0);
}

// Linear RGB and alpha.
vec4 base_color(Material material) {
  vec4 color = material.base_color * color_at_hit();
  return material.base_texture < 0 ? color
                                   : color * texture_at_hit(material, material.base_texture);
}

vec3 emission(Material material) {
  return material.emissive_texture < 0
             ? material.emissive.rgb
             : material.emissive.rgb * texture_at_hit(material, material.emissive_texture).rgb;
}
