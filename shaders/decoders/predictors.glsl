// Integer predictors that use positions: GEO and AFFINE (spec, appendix A.7), in 32-bit integers
// modulo 2^32, and the step of a chain toward its end.
#ifndef PREDICTORS_GLSL
#define PREDICTORS_GLSL

uint bit_length(uint x) { return uint(findMSB(x) + 1); }
uint magnitudes(ivec3 v) {
  uvec3 m = uvec3(abs(v));
  return m.x | m.y | m.z;
}
// Right shift, or left shift if `by` is negative.
ivec3 scaled_down(ivec3 v, int by) { return by >= 0 ? v >> by : v << -by; }
int scaled_down(int x, int by) { return by >= 0 ? x >> by : x << -by; }
int dot3(ivec3 a, ivec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Quotient of magnitudes with the sign of n. d > 0.
int quotient_toward_zero(int n, uint d) {
  int q = int(uint(abs(n)) / d);
  return n < 0 ? -q : q;
}

// Cross product of a triangle. h: bits to drop, from geo_shift.
ivec3 geo_triangle(ivec3 a, ivec3 b, ivec3 c, uint h) {
  ivec3 from = a >> h;
  ivec3 e = (b >> h) - from;
  ivec3 f = (c >> h) - from;
  return e.yzx * f.zxy - e.zxy * f.yzx;
}
uint geo_shift(uint position_bits) { return max(position_bits, 13u) - 13u; }

// Octahedral pair of a vertex's summed cross products.
uvec2 geo_oct(ivec3 n, uint bits) {
  uint m = magnitudes(n);
  uvec3 a = uvec3(abs(n)) >> (max(bit_length(m), 13u) - 13u);
  uint sum = a.x + a.y + a.z;
  uint top = (1u << bits) - 2u;
  if (sum == 0u) return uvec2(top >> 1);
  uvec2 folded = n.z < 0 ? sum - a.yx : a.xy;
  uvec2 p = uvec2(n.x < 0 ? sum - folded.x : sum + folded.x,
                  n.y < 0 ? sum - folded.y : sum + folded.y);
  return (p * top + sum) / (2u * sum);
}

// Weights of a prediction a + S (b - a) + U (o - a), in 1/256: 12 bits each, or 0 if they fail.
#define WEIGHTS_HOLD 0x80000000u
uint pack_weights(int s, int u) {
  return (uint(s) & 0xFFFu) | (uint(u) & 0xFFFu) << 12 | WEIGHTS_HOLD;
}

// AFFINE: positions v = a + S (b - a) + U (o - a).
uint affine_weights(ivec3 a, ivec3 b, ivec3 o, ivec3 v) {
  ivec3 e = b - a;
  ivec3 f = o - a;
  ivec3 r = v - a;
  int h = max(int(bit_length(magnitudes(e) | magnitudes(f) | magnitudes(r))) - 14, 0);
  e >>= h;
  f >>= h;
  r >>= h;
  int ee = dot3(e, e);
  int ef = dot3(e, f);
  int ff = dot3(f, f);
  int re = dot3(r, e);
  int rf = dot3(r, f);
  int k = int(bit_length(uint(ee) | uint(ff) | uint(abs(re)) | uint(abs(rf)))) - 15;
  ee = scaled_down(ee, k);
  ef = scaled_down(ef, k);
  ff = scaled_down(ff, k);
  re = scaled_down(re, k);
  rf = scaled_down(rf, k);
  int p = ee * ff;
  int determinant = p - ef * ef;
  if (determinant <= p >> 5 || determinant >> 8 == 0) return 0u;
  uint d = uint(determinant) >> 8;
  int s = quotient_toward_zero(re * ff - rf * ef, d);
  int u = quotient_toward_zero(rf * ee - re * ef, d);
  return max(abs(s), abs(u)) < 1024 ? pack_weights(s, u) : 0u;
}

// AFFINE, chains whose affine weights fail: the projection of v onto the way from a to b.
uint projected_weights(ivec3 a, ivec3 b, ivec3 v) {
  ivec3 e = b - a;
  ivec3 r = v - a;
  int h = max(int(bit_length(magnitudes(e) | magnitudes(r))) - 10, 0);
  e >>= h;
  r >>= h;
  int ee = dot3(e, e);
  int re = dot3(r, e);
  return ee > 0 && re >= 0 && re <= ee ? pack_weights((re * 256 + (ee >> 1)) / ee, 0) : 0u;
}

uint affine_apply(uint weights, uint a, uint b, uint o) {
  int s = bitfieldExtract(int(weights), 0, 12);
  int u = bitfieldExtract(int(weights), 12, 12);
  return a + uint((s * int(b - a) + u * int(o - a) + 128) >> 8);
}

// The vertex after `prev` on a chain whose end is `left` edges away. Values have up to 24 bits: the
// bias keeps the dividend positive.
uint toward(uint prev, uint end, uint left) {
  return prev + (end - prev + (left >> 1) + (left << 24)) / left - (1u << 24);
}

#endif
