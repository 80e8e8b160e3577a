// Decoded geometry as a temporary .ply file.
#pragma once
#include <string>
#include <vector>

#include "primitive.h"

namespace meshlet_shape {

class TemporaryPly {
 public:
  // Writes the primitives one after another, with normals and texture coordinates if all primitives
  // have them. Throws std::runtime_error.
  TemporaryPly(std::vector<Primitive> primitives, bool face_normals);
  ~TemporaryPly();
  TemporaryPly(const TemporaryPly&) = delete;

  const std::string& path() const { return path_; }
  bool has_normals() const { return has_normals_; }

 private:
  bool has_normals_;
  std::string path_;
};

}  // namespace meshlet_shape
