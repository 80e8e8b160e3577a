// What Python calls through ctypes, and what the shape asks of Python: the glTF side is read by
// gltf_ext.
#pragma once
#include <string>
#include <vector>

#include "part.h"

namespace meshlet_shape {

// The compressed primitives of a file: of all its scene (mesh < 0), of one mesh (primitive < 0), or
// one. Calls the Python reader. Throws std::runtime_error with its message.
std::vector<Part> read_parts(const std::string& filename, int mesh, int primitive);

class Model;

// Models by the uid of their cache's table, for statistics.
void announce(const Model* model);
void retire(const Model* model);

}  // namespace meshlet_shape
