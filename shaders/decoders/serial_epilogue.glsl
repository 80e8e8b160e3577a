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

void skip_unary(inout UnaryReader reader, uint n) {
  for (uint i = 0u; i < n && error == ERROR_NONE; i++) next_quotient(reader);
}

void read_rice(uint n, uint k, uint low) {
  for (uint i = 0u; i < n && error == ERROR_NONE; i++)
    residuals[i] = unzigzag((next_quotient(unary) << k) | load_inside(low + i * k, k));
}
