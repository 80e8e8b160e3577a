// The connectivity of a meshlet by the serial decoder alone, with one thread.
#ifndef SERIAL_CONNECTIVITY_GLSL
#define SERIAL_CONNECTIVITY_GLSL

#include "decoders/serial.glsl"

bool header_sound;  // of the meshlet decoded last

// Decodes meshlet m of the opened blob: TRIANGLE(t), boundary, disk_starts, `opened`. Returns false
// and sets `error` if it is malformed.
bool connect(uint m) {
  load_tables();
  error = ERROR_NONE;
  opened = read_header(m);
  header_sound = error == ERROR_NONE;
  read_symbols(opened);
  if (error == ERROR_NONE) decode_apexes();
  if (error == ERROR_NONE) decode_triangles();
  if (error != ERROR_NONE) return false;
  // As in list_interior: the first C that pops too much has a == b.
  for (mask64 rest = symbol_c; mask_any(rest); rest = mask_clear_lsb(rest)) {
    uint triangle = TRIANGLE(mask_lsb(rest));
    if (((triangle ^ (triangle >> 8)) & 255u) == 0u) error = ERROR_CLERS;
  }
  return error == ERROR_NONE;
}

#endif
