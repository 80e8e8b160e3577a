// What an intersection shader tells the shaders that follow it, and what they answer the ray's sender.

struct HitAttributes {
  vec2 barycentrics;                       // weights of the second and the third vertex
  uint triangle;                           // in its meshlet
};

struct Surface {
  float t;                                 // negative: nothing was hit
  uint instance;
  uint id;                                 // meshlet * 64 + triangle
  vec2 barycentrics;
  vec3 normal;                             // for shading, in world space, of unit length; not yet turned towards the viewer
  vec3 flat_normal;                        // the triangle's own
  vec3 albedo;
  uvec2 emission;                          // red, green, blue in 16-bit floats
};

// The pixel's number in the picture.
#define PIXEL ((gl_LaunchIDEXT.y + push.first_row) * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x)

// The custom index of an instance is its primitive's number, and a bit that tells that parts of it may be transparent.
#define PRIMITIVE_INDEX 0x7FFFFFu
#define INSTANCE_MASKED 0x800000u
