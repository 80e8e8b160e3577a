// Push constants of the shaders of rays.
#ifndef RT_PUSH_GLSL
#define RT_PUSH_GLSL

layout(push_constant) uniform RaysPush {
  uvec2 frame;      // Frame
  uvec2 structure;  // top-level acceleration structure: of all, or of a part
  uvec2 placed;     // per instance of the structure of all: Placed
  uvec2 sources;    // per meshlet: Source
  uvec2 cache;      // the slots
  uvec2 colors;     // output, a word per pixel
  uvec2 hits;       // output, per pixel: FirstHit
  uvec2 records;    // of paths that sweep: rt_paths.glsl
  uint bounces;
  uint samples;  // paths per pixel
  uint shadows;
  uint width;  // of the picture
  // Of a pass:
  uint pixel;  // the launch's first one
  uint part;   // FIRST_PART, LAST_PART, BACKGROUND
  uint level;  // bounce | sample << 8
  uint first;  // number of the meshlet in the first slot
}
push;

// The pixel of the picture that this invocation works at.
uint launched_pixel() { return push.pixel + gl_LaunchIDEXT.y * push.width + gl_LaunchIDEXT.x; }

#endif
