// Buffers of the decoding compute shaders (vk_backend/decode.py).
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Integers { uint at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Summaries { uint of[]; };   // triangles | vertices << 8 | error << 16

struct Connected {
  uvec2 boundary;        // mask of the boundary vertices
  uvec2 starts;          // mask of the triangles that begin a component
  uvec2 references;      // mask of the ranks along the boundary at which references begin (lengths.comp)
};
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Connectivity { Connected of[]; };

layout(push_constant) uniform Push {
  uvec2 blob;
  uvec2 summaries;
  uvec2 connectivity;
  uvec2 triangles;       // 64 words per meshlet, packed
  uvec2 integers;        // lanes x 64 words per meshlet
  uvec2 values;          // packed (packed_values.glsl), 64 vertices per meshlet (meshlet_passes.glsl)
  uint blob_words;
  uint meshlets;
  uint streams;          // that are decoded, and
  uint lanes;            //   the sum of their components
  uint vertex_words;     // of packed values (packed_values.glsl)
  uint max_hops;         // MAX_HOPS, from the host so that compilers do not unroll a long loop
} push;
