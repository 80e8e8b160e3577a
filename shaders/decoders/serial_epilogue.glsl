// The functions that serial_decoder.glsl asks for and that use its variables. Include after it.

// The next quotient at `unary`.
uint next_quotient() {
  while (unary.window == 0u) {
    unary.base += 32u;
    if ((unary.base >> 5) >= blob_word_total || unary.base - unary.cursor > MAX_QUOTIENT + 32u) {
      error = ERROR_UNARY;
      return 0u;
    }
    unary.window = load_word(unary.base >> 5);
  }
  uint one = unary.base + uint(findLSB(unary.window));
  uint quotient = one - unary.cursor;
  unary.window &= unary.window - 1u;
  unary.cursor = one + 1u;
  if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
  return quotient;
}

// Skips n quotients at `unary`, a word at a time.
void skip_unary(uint n) {
  uint words = 0u;
  while (n > 0u) {
    uint ones = uint(bitCount(unary.window));
    if (n <= ones) {
      for (; n > 1u; n--) unary.window &= unary.window - 1u;
      unary.cursor = unary.base + uint(findLSB(unary.window)) + 1u;
      unary.window &= unary.window - 1u;
      return;
    }
    n -= ones;
    words = ones > 0u ? 0u : words + 1u;
    unary.base += 32u;
    if ((unary.base >> 5) >= blob_word_total || words > MAX_QUOTIENT / 32u + 1u) {
      error = ERROR_UNARY;
      return;
    }
    unary.window = load_word(unary.base >> 5);
  }
}

// The value of a code with quotient q whose low bits begin at bit `low`; moves `low` past them.
uint coded_value(uint code, uint q, inout uint low) {
  uint k = code & CODE_MAX_PARAMETER;
  bool exponential = (code & CODE_EXPONENTIAL) != 0u;
  if (exponential && (q > EXPONENTIAL_MAX_QUOTIENT || k + q > EXPONENTIAL_MAX_BITS)) {
    error = ERROR_CODE;
    q = 0u;
  }
  uint width = exponential ? k + q : k;
  uint bits = load_bits(low, width);
  low += width;
  return ((exponential ? (1u << q) - 1u : q) << k) + bits;
}

void read_codes(uint n, uint code) {
  uint low = low_cursor;
  for (uint i = 0u; i < n && error == ERROR_NONE; i++)
    residuals[i] = unzigzag(coded_value(code, next_quotient(), low));
  low_cursor = low;
  if (low_cursor > 8u * (byte_length - BLOB_PADDING_BYTES)) error = ERROR_UNARY;
}
