// Whole-blob decoding for x86-64 with AVX2, BMI and popcnt, by the options that CMakeLists.txt sets for this file.
#define MESHLET_BUILD avx2
#include "decode_blob.inl"
