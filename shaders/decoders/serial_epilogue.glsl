// The functions that serial_decoder.glsl asks for and that use its variables. Include after it.

// The next quotient of a unary plane.
uint next_quotient(inout UnaryReader reader) {
  while (reader.window == 0u) {
    reader.base += 32u;
    if ((reader.base >> 5) >= blob_word_total || reader.base - reader.cursor > MAX_QUOTIENT + 32u) {
      error = ERROR_UNARY;
      return 0u;
    }
    reader.window = load_word(reader.base >> 5);
  }
  uint one = reader.base + uint(findLSB(reader.window));
  uint quotient = one - reader.cursor;
  reader.window &= reader.window - 1u;
  reader.cursor = one + 1u;
  if (quotient > MAX_QUOTIENT) error = ERROR_UNARY;
  return quotient;
}

// Skips n quotients, a word at a time.
void skip_unary(inout UnaryReader reader, uint n) {
  uint words = 0u;
  while (n > 0u) {
    uint ones = uint(bitCount(reader.window));
    if (n <= ones) {
      for (; n > 1u; n--) reader.window &= reader.window - 1u;
      reader.cursor = reader.base + uint(findLSB(reader.window)) + 1u;
      reader.window &= reader.window - 1u;
      return;
    }
    n -= ones;
    words = ones > 0u ? 0u : words + 1u;
    reader.base += 32u;
    if ((reader.base >> 5) >= blob_word_total || words > MAX_QUOTIENT / 32u + 1u) {
      error = ERROR_UNARY;
      return;
    }
    reader.window = load_word(reader.base >> 5);
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
  for (uint i = 0u; i < n && error == ERROR_NONE; i++)
    residuals[i] = unzigzag(coded_value(code, next_quotient(unary), low_cursor));
  if (low_cursor > 8u * (byte_length - BLOB_PADDING_BYTES)) error = ERROR_UNARY;
}
