// What a mesh stage of the raster paths puts out besides positions, which surface.frag takes in. To
// be included at file scope, after raster.glsl; with IDS also a number per triangle. (The built-in
// gl_PrimitiveID would do, but Mesa's software renderer gives another one on.)
layout(location = 0) out vec3 out_normal[];
layout(location = 1) out vec2 out_texcoord[];
layout(location = 2) out vec4 out_color[];
#ifdef IDS
layout(location = 3) perprimitiveEXT out uint out_id[];  // meshlet * MESHLET_TRIANGLES + triangle
#endif

// Vertex v's attributes, of which those that no primitive has are left out. normal: in world space.
void put_attributes(uint v, vec3 normal, vec2 texcoord, vec4 color) {
#ifdef IDS
  bool all =
      true;  // Mesa's software renderer loses out_id where an output before it is not written
#else
  bool all = false;
#endif
  if (all || (ATTRIBUTES & HAS_NORMAL) != 0u) out_normal[v] = normal;
  if (all || (ATTRIBUTES & HAS_TEXCOORD) != 0u) out_texcoord[v] = texcoord;
  if (all || (ATTRIBUTES & HAS_COLOR) != 0u) out_color[v] = color;
}

// Triangle t of meshlet m.
void put_id(uint t, uint m) {
#ifdef IDS
  out_id[t] = m * MESHLET_TRIANGLES + t;
#endif
}
