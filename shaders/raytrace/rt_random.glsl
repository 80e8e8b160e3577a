// Pseudo-random numbers: the same on every device and path.
#ifndef RT_RANDOM_GLSL
#define RT_RANDOM_GLSL

// PCG's output function (Jarzynski, Olano: Hash Functions for GPU Rendering, JCGT 2020).
uint hash(uint x) {
  uint state = x * 747796405u + 2891336453u;
  uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
  return (word >> 22) ^ word;
}

// In [0, 1).
float unit_float(uint x) { return float(x >> 8) * (1.0 / 16777216.0); }

#endif
