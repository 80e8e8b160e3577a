// Arithmetic with 64-bit buffer addresses as uvec2(low, high).
#ifndef ADDRESSES_GLSL
#define ADDRESSES_GLSL

// The address of array item `count`; each item has `words` words.
uvec2 byte_offset(uvec2 address, uint words, uint count) {
  uvec2 product;  // words * count * 4, in 64 bits
  umulExtended(words * 4u, count, product.y, product.x);
  uint carry;
  uint low = uaddCarry(address.x, product.x, carry);
  return uvec2(low, address.y + product.y + carry);
}

#endif
