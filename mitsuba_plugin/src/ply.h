// Decoded geometry as a temporary .ply file.
#pragma once
#include <string>
#include <vector>

#include "part.h"

namespace meshlet_shape {

class TemporaryPly {
 public:
  // Writes the parts one after another, with normals and texture coordinates if all parts have
  // them. Throws std::runtime_error.
  TemporaryPly(std::vector<Part> parts, bool face_normals);
  ~TemporaryPly();
  TemporaryPly(const TemporaryPly&) = delete;

  const std::string& path() const { return path_; }
  bool has_normals() const { return has_normals_; }

 private:
  bool has_normals_;
  std::string path_;
};

}  // namespace meshlet_shape
