// The functions of meshoptimizer that the library shows; simplifier_guard.h has one more. Included
// ahead of its sources, whose own macro would show all functions on Windows and macOS.
#pragma once
#include <stddef.h>

#ifdef _WIN32
#define SHOWN extern "C" __declspec(dllexport)
#else
#define SHOWN extern "C" __attribute__((visibility("default")))
#endif

SHOWN size_t meshopt_simplifyWithAttributes(
    unsigned int* destination, const unsigned int* indices, size_t index_count,
    const float* vertex_positions, size_t vertex_count, size_t vertex_positions_stride,
    const float* vertex_attributes, size_t vertex_attributes_stride,
    const float* attribute_weights, size_t attribute_count, const unsigned char* vertex_lock,
    size_t target_index_count, float target_error, unsigned int options, float* result_error);
SHOWN size_t meshopt_partitionClusters(unsigned int* destination,
                                       const unsigned int* cluster_indices,
                                       size_t total_index_count,
                                       const unsigned int* cluster_index_counts,
                                       size_t cluster_count, size_t vertex_count,
                                       size_t target_partition_size);
