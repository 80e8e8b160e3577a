// Connectivity of one meshlet by one invocation, for connect.comp and mesh.task; to be included
// after serial_epilogue.glsl.

// Decodes the triangles of meshlet m of the opened blob into TRIANGLE(t), its boundary and its
// components' starts; false, with `error`, where it is malformed.
bool connect(uint m) {
  load_tables();
  error = ERROR_NONE;
  Header h = read_header(m);
  read_symbols(h.begin, h.triangles);
  if (error == ERROR_NONE) decode_apexes();
  if (error == ERROR_NONE) decode_triangles();
  if (error != ERROR_NONE) return false;
  // As list_interior finds it out: the first C that pops too much has a == b.
  for (mask64 rest = symbol_c; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint triangle = TRIANGLE(mask_lsb(rest));
    if (((triangle ^ (triangle >> 8)) & 255u) == 0u) error = ERROR_CLERS;
  }
  return error == ERROR_NONE;
}
