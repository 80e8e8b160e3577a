// The serial decoder for Vulkan and WebGPU, with the functions that it asks for. An includer may
// first choose where it keeps results: the options are described in serial_decoder.glsl.
#ifndef SERIAL_GLSL
#define SERIAL_GLSL

#include "decoders/serial_prologue.glsl"
#include "decode/serial_decoder.glsl"
#include "decoders/serial_epilogue.glsl"

#endif
