// The values of the meshlet that the serial decoder has decoded.
#ifndef SERIAL_VALUES_GLSL
#define SERIAL_VALUES_GLSL

#include "decoders/serial.glsl"

uint decoded_value(uint element, uint vertex) {
  return values[min(element, MAX_ELEMENTS - 1u) * 64u + vertex];
}

#endif
