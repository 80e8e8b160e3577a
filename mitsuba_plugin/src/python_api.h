// The interface to Python, which reads glTF files for the shape: functions that Python calls
// through ctypes (mitsuba_plugin/native.py), and calls of its reader.
#pragma once
#include <string>
#include <vector>

#include "part.h"

namespace meshlet_shape {

// Returns the compressed primitives of a file: of the whole scene (mesh < 0), of one mesh
// (primitive < 0), or one. Calls the Python reader. Throws std::runtime_error with its message.
std::vector<Part> read_parts(const std::string& filename, int mesh, int primitive);

class Model;

// Register a model for statistics, by the uid of its cache table.
void announce(const Model* model);
void retire(const Model* model);

}  // namespace meshlet_shape
