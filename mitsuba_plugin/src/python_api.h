// The interface to Python, which reads glTF files for the shape: functions that Python calls
// through ctypes (mitsuba_plugin/native.py), and calls of its reader.
#pragma once
#include <string>
#include <vector>

#include "primitive.h"

namespace meshlet_shape {

// The geometry of a file that a shape shows: the whole scene (mesh < 0), one mesh (primitive < 0),
// or one primitive, at the detail that a camera needs. mitsuba_plugin/native.py declares the same
// struct.
struct Selection {
  int32_t mesh = -1, primitive = -1;
  float to_world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // row-major 3 x 4
  float lod_error = 0;                                        // pixels; 0: all triangles
  float pixels_per_unit = 1;  // at distance 1 from the eye; everywhere without an eye
  float eye[3] = {0, 0, 0};   // in the world
  uint32_t has_eye = 0;
};

// Returns the compressed primitives of a file, in the shape's coordinates. Calls the Python reader.
// Throws std::runtime_error with its message.
std::vector<Primitive> read_primitives(const std::string& filename, const Selection& selection);

}  // namespace meshlet_shape
