// What follows, up to avx2_end.h, is compiled for AVX2, whatever the compiler's options are.
// Library headers come before: their templates, which all code shares, stay as they are.
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2,bmi,bmi2,lzcnt,popcnt"))), \
                             apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,bmi,bmi2,lzcnt,popcnt")
#endif

#undef MESHLET_AVX2
#define MESHLET_AVX2 1
#undef MESHLET_BUILD
#define MESHLET_BUILD avx2

// Of the headers that are compiled again, and of the names that they give to the GLSL.
#undef DECODE_BULK_DECODER_H
#undef DECODE_SERIAL_DECODER_H
#undef DECODE_VERTEX_H
#undef TRANSPORT_ADAPTIVE_CODER_H
#undef TRANSPORT_BLOB_EMITTER_H
#undef TRANSPORT_CONNECTIVITY_CODER_H
#undef TRANSPORT_CONTEXTS_H
#undef TRANSPORT_NORMAL_CODER_H
#undef TRANSPORT_PAGE_CODER_H
#undef TRANSPORT_PAGE_H
#undef TRANSPORT_PAGE_UNPACKER_H
#undef TRANSPORT_RESIDENT_VALUES_H
#undef TRANSPORT_VALUE_CODER_H
#undef APEX
#undef NORMALS
#undef RESIDUAL
#undef SET_APEX
#undef TRIANGLE
#undef VALUES
